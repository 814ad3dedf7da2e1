//! Which planes go into which part of a file, and where the blocks of a part lie.

use ::exr::math::Vec2;
use ::exr::meta::BlockDescription;
use ::exr::meta::attribute::IntegerBounds;
use ::exr::meta::header::Header;

use crate::film::{Film, Region};

/// The name of the part that holds `R`, `G`, `B` and `A`.
const BEAUTY_PART: &str = "rgba";

/// A part of a file: its name and, sorted by name as the format wants its channels, its planes in the film.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct PartPlanes {
    /// The layer that the part holds.
    pub name: String,
    /// Indices of planes.
    pub planes: Vec<usize>,
}

/// All planes in one part.
pub(super) fn single_part(film: &Film) -> Vec<PartPlanes> {
    vec![PartPlanes { name: BEAUTY_PART.to_string(), planes: by_name(film, (0..film.planes.len()).collect()) }]
}

/// One part for each layer, in the order in which layers first occur among the planes.
pub(super) fn part_per_layer(film: &Film) -> Vec<PartPlanes> {
    let mut parts: Vec<PartPlanes> = Vec::new();
    for (index, plane) in film.planes.iter().enumerate() {
        let name = layer_of(&plane.name);
        match parts.iter_mut().find(|part| part.name == name) {
            Some(part) => part.planes.push(index),
            None => parts.push(PartPlanes { name: name.to_string(), planes: vec![index] }),
        }
    }
    parts.iter_mut().for_each(|part| part.planes = by_name(film, std::mem::take(&mut part.planes)));
    parts
}

fn by_name(film: &Film, mut planes: Vec<usize>) -> Vec<usize> {
    planes.sort_by(|&a, &b| film.planes[a].name.as_bytes().cmp(film.planes[b].name.as_bytes()));
    planes
}

/// The layer of a channel: what stands before its last dot. The ranks of a Cryptomatte (`CryptoObject00`, `01`, …) are one.
fn layer_of(channel: &str) -> &str {
    match channel.rsplit_once('.') {
        Some((layer, _)) if layer.starts_with("Crypto") => {
            let name = layer.trim_end_matches(|c: char| c.is_ascii_digit());
            if name.len() + 2 == layer.len() { name } else { layer }
        }
        Some((layer, _)) => layer,
        None if matches!(channel, "R" | "G" | "B" | "A") => BEAUTY_PART,
        None => channel,
    }
}

/// How the pixels of a part are cut into blocks, which are numbered from the left, then from the top.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Grid {
    width_px: usize,
    height_px: usize,
    block_width_px: usize,
    block_height_px: usize,
}

impl Grid {
    /// The blocks of a header; of tiles those in full resolution.
    pub fn of(header: &Header) -> Grid {
        let Vec2(width_px, height_px) = header.layer_size;
        let (block_width_px, block_height_px) = match header.blocks {
            BlockDescription::ScanLines => (width_px, header.compression.scan_lines_per_block()),
            BlockDescription::Tiles(tiles) => (tiles.tile_size.0, tiles.tile_size.1),
        };
        Grid { width_px, height_px, block_width_px, block_height_px }
    }

    /// Blocks beside each other.
    pub fn n_columns(&self) -> usize {
        self.width_px.div_ceil(self.block_width_px)
    }

    /// Blocks one above the other.
    pub fn n_rows(&self) -> usize {
        self.height_px.div_ceil(self.block_height_px)
    }

    /// Blocks that lie wholly in some rows of pixels, which may end with the part.
    pub fn blocks_inside(&self, rows: std::ops::Range<usize>) -> std::ops::Range<usize> {
        let first = rows.start.div_ceil(self.block_height_px);
        let end = if rows.end >= self.height_px { self.n_rows() } else { rows.end / self.block_height_px };
        first * self.n_columns()..end.max(first) * self.n_columns()
    }

    /// Column and row of a block.
    pub fn place(&self, block: usize) -> (usize, usize) {
        (block % self.n_columns(), block / self.n_columns())
    }

    /// The pixels of a block, counted from the corner of the data window.
    pub fn pixels(&self, block: usize) -> Region {
        let (column, row) = self.place(block);
        let (x0, y0) = (column * self.block_width_px, row * self.block_height_px);
        // All fit: the header has been checked.
        Region {
            x0: x0 as u32,
            y0: y0 as u32,
            x1: (x0 + self.block_width_px).min(self.width_px) as u32,
            y1: (y0 + self.block_height_px).min(self.height_px) as u32,
        }
    }
}

/// A region as the `exr` crate has it.
pub(super) fn bounds_of(region: Region) -> IntegerBounds {
    let Region { x0, y0, .. } = region;
    IntegerBounds::new((x0 as i32, y0 as i32), (region.width_px() as usize, region.height_px() as usize))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{Plane, Samples};

    fn film(names: &[&str]) -> Film {
        let planes = names.iter().map(|name| Plane::data(*name, Samples::F32(vec![0.0]))).collect();
        Film { width_px: 1, height_px: 1, data_window: Region::whole(1, 1), planes }
    }

    #[test]
    fn every_layer_is_a_part_in_the_order_of_the_planes_and_ranks_of_a_cryptomatte_are_one() {
        let names = [
            "R",
            "G",
            "B",
            "A",
            "diffuse.R",
            "diffuse.G",
            "light_key00.R",
            "light_key01.R",
            "Z",
            "P.X",
            "a.b.R",
            "CryptoObject00.R",
            "CryptoObject01.R",
            "CryptoMaterial00.R",
            "CryptoObject.R",
        ];
        let parts = part_per_layer(&film(&names));
        let found: Vec<&str> = parts.iter().map(|part| part.name.as_str()).collect();
        let expected =
            ["rgba", "diffuse", "light_key00", "light_key01", "Z", "P", "a.b", "CryptoObject", "CryptoMaterial"];
        assert_eq!(found, expected);
        assert_eq!(parts[0].planes, [3, 2, 1, 0], "sorted by name");
        assert_eq!(parts[7].planes, [14, 11, 12]);
        assert_eq!(single_part(&film(&names))[0].planes.len(), names.len());
    }

    #[test]
    fn blocks_are_inside_of_rows_that_hold_them_whole() {
        let grid = Grid { width_px: 100, height_px: 70, block_width_px: 64, block_height_px: 32 };
        assert_eq!((grid.n_columns(), grid.n_rows()), (2, 3));
        assert_eq!(grid.blocks_inside(0..32), 0..2);
        assert_eq!(grid.blocks_inside(16..64), 2..4);
        assert_eq!(grid.blocks_inside(16..32), 2..2);
        assert_eq!(grid.blocks_inside(64..70), 4..6);
        assert_eq!(grid.pixels(5), Region { x0: 64, y0: 64, x1: 100, y1: 70 });
    }
}
