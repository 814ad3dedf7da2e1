//! Cells of the pixels of a block: a quadtree a pixel, in one flat table, with the ring of pixels around the block.

/// Edge of a block in pixels. Blocks are counted from the image's corner, so that what is found in one depends on no tile and no crop.
pub const BLOCK_PX: u32 = 32;

/// A square part of a pixel.
#[derive(Clone, Copy, Debug)]
pub struct Cell {
    /// Column and row among cells of its size, from the corner of the ring around the block.
    pub x: i32,
    /// See `x`.
    pub y: i32,
    /// How often the pixel was halved.
    pub level: u32,
    /// Index of the first of its four children, row by row; 0 for a leaf.
    first_child: u32,
}

/// Corner and edge of a cell in pixels, from the corner of its own pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Square {
    /// Left.
    pub x: f64,
    /// Top.
    pub y: f64,
    /// Edge.
    pub edge: f64,
}

impl Cell {
    /// Pixel column and row, from the corner of the ring.
    pub fn pixel(&self) -> (usize, usize) {
        ((self.x >> self.level) as usize, (self.y >> self.level) as usize)
    }

    /// Where it is in its pixel.
    pub fn square(&self) -> Square {
        let edge = 1.0 / f64::from(1u32 << self.level);
        let within = (1 << self.level) - 1;
        Square { x: f64::from(self.x & within) * edge, y: f64::from(self.y & within) * edge, edge }
    }

    /// A number that no other cell of its pixel has.
    pub fn number(&self) -> u64 {
        let within = (1i64 << self.level) - 1;
        (i64::from(self.x) & within) as u64 | ((i64::from(self.y) & within) as u64) << 24 | u64::from(self.level) << 48
    }

    /// Area in pixels.
    pub fn area(&self) -> f32 {
        1.0 / (1u64 << (2 * self.level)) as f32
    }

    /// Whether it is not divided.
    pub fn is_leaf(&self) -> bool {
        self.first_child == 0
    }
}

/// The cells of a block. The first are the pixels, ring included, row by row.
#[derive(Debug, Default)]
pub struct Tree {
    cells: Vec<Cell>,
    /// Pixels in a row, and rows, ring included.
    size_px: [usize; 2],
}

impl Tree {
    /// Begins a block of so many pixels.
    pub fn begin(&mut self, width_px: usize, height_px: usize) {
        self.size_px = [width_px + 2, height_px + 2];
        self.cells.clear();
        let [columns, rows] = self.size_px.map(|length| length as i32);
        let pixels = (0..rows).flat_map(|y| (0..columns).map(move |x| (x, y)));
        let pixels = pixels.map(|(x, y)| Cell { x, y, level: 0, first_child: 0 });
        self.cells.extend(pixels);
    }

    /// Number of cells, inner ones included.
    pub fn len(&self) -> usize {
        self.cells.len()
    }

    /// A cell.
    pub fn cell(&self, index: usize) -> &Cell {
        &self.cells[index]
    }

    /// The cell that is a whole pixel, by its place in the block.
    pub fn root(&self, column: usize, row: usize) -> usize {
        (row + 1) * self.size_px[0] + column + 1
    }

    /// The index of a cell's pixel.
    pub fn root_of(&self, index: usize) -> usize {
        let (column, row) = self.cells[index].pixel();
        row * self.size_px[0] + column
    }

    /// Whether a cell's pixel is of the block, not of the ring around it.
    pub fn is_inside(&self, index: usize) -> bool {
        let (column, row) = self.cells[index].pixel();
        (1..self.size_px[0] - 1).contains(&column) && (1..self.size_px[1] - 1).contains(&row)
    }

    /// The cells at the four sides of a cell: of its size, or the larger leaves that are there. None beyond the ring.
    pub fn neighbors(&self, index: usize) -> impl Iterator<Item = usize> + use<'_> {
        let Cell { x, y, level, .. } = self.cells[index];
        [(-1, 0), (1, 0), (0, -1), (0, 1)].into_iter().filter_map(move |(dx, dy)| self.find(x + dx, y + dy, level))
    }

    /// The eight pixels around a pixel of the block.
    pub fn around(&self, root: usize) -> impl Iterator<Item = usize> + use<> {
        let columns = self.size_px[0];
        let rows = [root - columns, root, root + columns];
        rows.into_iter().flat_map(|middle| [middle - 1, middle, middle + 1]).filter(move |&index| index != root)
    }

    /// The cells of its size at the four sides of a cell, left, right, above and below, if all are there.
    pub fn equal_neighbors(&self, index: usize) -> Option<[usize; 4]> {
        let mut equal = [0; 4];
        let mut n = 0;
        let level = self.cells[index].level;
        for neighbor in self.neighbors(index).filter(|&neighbor| self.cells[neighbor].level == level) {
            equal[n] = neighbor;
            n += 1;
        }
        (n == 4).then_some(equal)
    }

    /// The smallest cell of at most a level that covers a place.
    fn find(&self, x: i32, y: i32, level: u32) -> Option<usize> {
        let (column, row) = (x >> level, y >> level);
        let [columns, rows] = self.size_px.map(|length| length as i32);
        if !(0..columns).contains(&column) || !(0..rows).contains(&row) {
            return None;
        }
        let mut index = (row * columns + column) as usize;
        for below in (0..level).rev() {
            let first = self.cells[index].first_child as usize;
            if first == 0 {
                break;
            }
            index = first + (((y >> below) & 1) * 2 + ((x >> below) & 1)) as usize;
        }
        Some(index)
    }

    /// Divides a leaf into four, which are added at the end.
    pub fn split(&mut self, index: usize) {
        let Cell { x, y, level, .. } = self.cells[index];
        self.cells[index].first_child = self.cells.len() as u32;
        let children = [(0, 0), (1, 0), (0, 1), (1, 1)];
        self.cells.extend(children.map(|(dx, dy)| Cell {
            x: 2 * x + dx,
            y: 2 * y + dy,
            level: level + 1,
            first_child: 0,
        }));
    }

    /// Puts the leaves of a cell into a vector, in the order of its quadtree.
    pub fn leaves(&self, index: usize, leaves: &mut Vec<u32>) {
        let first = self.cells[index].first_child as usize;
        if first == 0 {
            leaves.push(index as u32);
            return;
        }
        // As deep as cells are divided, which is little.
        (first..first + 4).for_each(|child| self.leaves(child, leaves));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leaves_of_a_pixel_tile_it_however_it_is_divided() {
        let mut tree = Tree::default();
        tree.begin(3, 2);
        let root = tree.root(2, 1);
        assert_eq!((tree.len(), tree.cell(root).pixel()), (20, (3, 2)));
        tree.split(root);
        tree.split(22);
        let mut leaves = Vec::new();
        tree.leaves(root, &mut leaves);
        assert_eq!(leaves.len(), 7);
        let area: f32 = leaves.iter().map(|&leaf| tree.cell(leaf as usize).area()).sum();
        assert_eq!(area, 1.0);
        assert!(leaves.iter().all(|&leaf| tree.root_of(leaf as usize) == root));
        let square = tree.cell(25).square();
        assert_eq!(square, Square { x: 0.25, y: 0.5, edge: 0.25 });
    }

    #[test]
    fn neighbours_are_of_the_same_size_or_larger_leaves() {
        let mut tree = Tree::default();
        tree.begin(2, 1);
        let (left, right) = (tree.root(0, 0), tree.root(1, 0));
        assert_eq!(tree.neighbors(left).collect::<Vec<_>>(), [left - 1, right, left - 4, left + 4]);
        tree.split(left);
        let first = tree.len() - 4;
        // The upper right child: its left sibling, the whole pixel at its right and above, the child below.
        assert_eq!(tree.neighbors(first + 1).collect::<Vec<_>>(), [first, right, left - 4, first + 3]);
        tree.split(right);
        assert_eq!(tree.neighbors(first + 1).nth(1), Some(first + 4));
        // A cell is compared with a divided neighbour of its size itself.
        assert_eq!(tree.neighbors(left).nth(1), Some(right));
        assert!(tree.is_inside(first) && !tree.is_inside(0));
        assert_eq!(tree.neighbors(0).count(), 2);
    }
}
