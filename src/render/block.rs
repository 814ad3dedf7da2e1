//! The order of a tile's pixels: blocks of neighbours, so that sixteen camera rays in a row make a narrow packet.

/// Indices of the pixels of a tile, row by row counted, block after block. A pixel of many samples is a packet by itself.
pub fn block_order(width_px: usize, height_px: usize, n_samples: usize) -> Vec<u32> {
    let edge_px = match n_samples {
        0..4 => 4,
        4..16 => 2,
        _ => 1,
    };
    let mut order = Vec::with_capacity(width_px * height_px);
    for top in (0..height_px).step_by(edge_px) {
        for left in (0..width_px).step_by(edge_px) {
            for y in top..height_px.min(top + edge_px) {
                order.extend((left..width_px.min(left + edge_px)).map(|x| (y * width_px + x) as u32));
            }
        }
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pixel_comes_once_and_sixteen_rays_are_one_block() {
        for (width, height) in [(1, 1), (32, 32), (5, 7), (33, 2)] {
            for n_samples in [1, 4, 16] {
                let mut order = block_order(width, height, n_samples);
                assert_eq!(order.len(), width * height);
                order.sort_unstable();
                assert!(order.iter().enumerate().all(|(i, &index)| i == index as usize));
            }
        }
        assert_eq!(block_order(8, 4, 1)[..16], [0, 1, 2, 3, 8, 9, 10, 11, 16, 17, 18, 19, 24, 25, 26, 27]);
    }
}
