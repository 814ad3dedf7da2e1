//! A picture of what each pixel cost.

use crate::film::tone_map::linear_from_srgb;
use crate::film::{Display, Film, Picture, Plane, Samples, ToneMap, color_map};

/// A picture of costs.
#[derive(Clone, Debug)]
pub struct CostMap {
    /// `R`, `G` and `B`, linear, for [`CostMap::display`].
    pub picture: Film,
    /// Nodes and leaves visited for a pixel of the brightest colour.
    pub brightest: f64,
}

impl CostMap {
    /// The map of a film with the layer `cost`; `None` of one without. Nodes and leaves visited are added up: equal steps are
    /// equal steps of colour, from black at none to the brightest at the 99.9th percentile of the pixels that cost
    /// anything, so that a single pixel does not darken all others.
    pub fn new(film: &Film) -> Option<CostMap> {
        let [nodes, leaves] = [film.plane("cost.nodes")?, film.plane("cost.leaf_tests")?];
        let cost = |pixel: usize| nodes.samples.get(pixel) + leaves.samples.get(pixel);
        let costs: Vec<f64> = (0..film.n_pixels()).map(cost).collect();
        let mut sorted: Vec<f64> = costs.iter().copied().filter(|&cost| cost > 0.0).collect();
        // Nearest rank.
        let rank = (sorted.len() * 999).div_ceil(1000);
        let brightest = match rank.checked_sub(1) {
            Some(index) => *sorted.select_nth_unstable_by(index, f64::total_cmp).1,
            None => 1.0,
        };
        let colors: Vec<[u8; 3]> = costs.iter().map(|cost| color_map::sequential(cost / brightest)).collect();
        let plane = |channel: usize| colors.iter().map(|color| linear_byte(color[channel])).collect();
        let planes = ["R", "G", "B"].into_iter().enumerate();
        let planes = planes.map(|(channel, name)| Plane::color(name, Samples::F32(plane(channel)))).collect();
        Some(CostMap { picture: Film { planes, ..empty_like(film) }, brightest })
    }

    /// How the picture becomes the bytes of a PNG.
    pub fn display() -> Display {
        Display::Picture(Picture { tone_map: ToneMap::Clip, ..Picture::default() })
    }
}

fn linear_byte(byte: u8) -> f32 {
    linear_from_srgb(f64::from(byte) / 255.0) as f32
}

fn empty_like(film: &Film) -> Film {
    let Film { width_px, height_px, data_window, planes: _ } = *film;
    Film { width_px, height_px, data_window, planes: Vec::new() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{Region, png};
    use std::path::Path;

    fn film(nodes: Vec<u32>, leaves: Vec<u32>) -> Film {
        let width_px = nodes.len() as u32;
        let data_window = Region::whole(width_px, 1);
        let planes = [("cost.nodes", nodes), ("cost.leaf_tests", leaves)];
        let planes = planes.map(|(name, counts)| Plane::data(name, Samples::U32(counts))).into();
        Film { width_px, height_px: 1, data_window, planes }
    }

    #[test]
    fn costs_are_the_colors_of_the_map_in_the_file_and_outliers_are_clamped() {
        let mut nodes = vec![0; 4000];
        let mut leaves = vec![7; 4000];
        // Three of four thousand are the outliers.
        nodes[..3].fill(1_000_000);
        (leaves[4], leaves[5]) = (4, 0);
        nodes[3] = 1;
        let map = CostMap::new(&film(nodes, leaves)).unwrap();
        assert_eq!(map.brightest, 8.0);
        let mut bytes = Vec::new();
        png::write(&map.picture, &CostMap::display(), &mut bytes).unwrap();
        let shown = png::decode(&bytes, None, Path::new("cost.png")).unwrap().rgb8.unwrap();
        let expected = [1e9, 1e9, 1e9, 1.0, 0.5, 0.0, 7.0 / 8.0].map(color_map::sequential);
        assert_eq!(shown[..7], expected);
    }

    #[test]
    fn what_costs_nothing_is_black_and_without_the_layer_there_is_no_map() {
        let map = CostMap::new(&film(vec![0; 4], vec![0; 4])).unwrap();
        assert!(map.picture.planes.iter().all(|plane| (0..4).all(|pixel| plane.samples.get(pixel) == 0.0)));
        let mut other = film(vec![0], vec![0]);
        other.planes.pop();
        assert!(CostMap::new(&other).is_none());
    }
}
