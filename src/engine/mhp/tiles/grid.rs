//! A box of cells cut into tiles.

use super::cells::{
    BLOCK_TILES, HALF_TILE_ACROSS_BINS, HALF_TILE_ALONG_BINS, PerCell, TILE_ACROSS_BINS, TILE_ALONG_BINS,
};

/// A box of cells in tiles, and B_ori over it: fixed for a fit. Erased cells are as those beyond the box. Sixteen tiles beside each other are a block; the last
/// block of a row may reach beyond the box, as may the last row and column of tiles.
#[derive(Debug, Clone)]
pub(in crate::mhp) struct TileGrid {
    /// First bin of the last three axes (outermost first; missing axes have one bin, 0).
    pub(super) lo: [usize; 3],
    pub(super) size: [usize; 3],
    /// Tiles across and along.
    pub(super) rows: usize,
    pub(super) columns: usize,
    pub(super) blocks: Vec<Block>,
    /// Sixteen tiles a block: B_ori as 0 or 1, −1 beyond the box and where a cell is erased.
    pub(super) target: Vec<PerCell>,
    /// Cells that take part.
    pub(super) cells: usize,
    pub(super) marked: usize,
}

/// Sixteen tiles beside each other: its slice, its row, and its first column of tiles.
#[derive(Debug, Clone, Copy)]
pub(super) struct Block {
    pub(super) slice: usize,
    pub(super) row: usize,
    pub(super) column: usize,
}

/// Blocks of a box of these sizes, the last axis last.
pub(in crate::mhp) fn blocks_of(sizes: impl DoubleEndedIterator<Item = usize>) -> usize {
    let in_block = [BLOCK_TILES * TILE_ALONG_BINS, TILE_ACROSS_BINS, 1];
    sizes.rev().zip(in_block).fold(1, |blocks, (size, bins)| blocks * size.div_ceil(bins))
}

impl TileGrid {
    /// Cuts the box `bins` ([lo, hi) per axis), with B_ori in C order, and whether each cell takes part where not all do.
    pub(in crate::mhp) fn new(bins: &[[usize; 2]], ori: &[bool], there: Option<&[bool]>) -> Self {
        let (mut lo, mut size) = ([0; 3], [1; 3]);
        for (k, &[from, to]) in bins.iter().rev().take(3).enumerate() {
            (lo[2 - k], size[2 - k]) = (from, to.saturating_sub(from));
        }
        let (rows, columns) = (size[1].div_ceil(TILE_ACROSS_BINS), size[2].div_ceil(TILE_ALONG_BINS));
        let is_there = |cell: usize| there.is_none_or(|there| there.get(cell) == Some(&true));
        let marked = (0..ori.len()).filter(|&cell| ori[cell] && is_there(cell)).count();
        let cells = (0..ori.len()).filter(|&cell| is_there(cell)).count();
        let of_line = |line| {
            let (slice, row) = (line / rows, line % rows);
            (0..columns).step_by(BLOCK_TILES).map(move |column| Block { slice, row, column })
        };
        let blocks = (0..size[0] * rows).flat_map(of_line).collect();
        let mut grid = Self { lo, size, rows, columns, blocks, target: Vec::new(), cells, marked };
        let mut target = vec![PerCell::all(-1.0); size[0] * rows * columns.div_ceil(BLOCK_TILES) * BLOCK_TILES];
        let mut ori = ori.iter().enumerate();
        grid.for_places(|tile, cell| {
            let marked = ori.next().filter(|(k, _)| is_there(*k)).map(|(_, &ori)| f32::from(u8::from(ori)));
            target[tile][cell] = marked.unwrap_or(-1.0);
        });
        grid.target = target;
        grid
    }

    /// Calls `each` with the tile of every cell of the box and which of its cells it is, in C order.
    pub(super) fn for_places(&self, mut each: impl FnMut(usize, usize)) {
        let ([slices, height, width], row_tiles) = (self.size, self.columns.div_ceil(BLOCK_TILES) * BLOCK_TILES);
        for slice in 0..slices {
            for y in 0..height {
                let first = (slice * self.rows + y / TILE_ACROSS_BINS) * row_tiles;
                for x in 0..width {
                    each(first + x / TILE_ALONG_BINS, y % TILE_ACROSS_BINS * TILE_ALONG_BINS + x % TILE_ALONG_BINS);
                }
            }
        }
    }

    /// Bins of the first tile's middle, across and along.
    pub(super) fn middle(&self) -> [f64; 2] {
        [self.lo[1] as f64 + f64::from(HALF_TILE_ACROSS_BINS), self.lo[2] as f64 + f64::from(HALF_TILE_ALONG_BINS)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cell_of_the_box_has_a_place_in_a_tile() {
        for [slices, height, width] in [[1, 1, 1], [1, 8, 64], [1, 20, 70], [3, 9, 130], [2, 17, 3]] {
            let bins = [[5, 5 + slices], [2, 2 + height], [7, 7 + width]];
            let marks: Vec<bool> = (0..slices * height * width).map(|cell| cell % 3 == 0).collect();
            let grid = TileGrid::new(&bins, &marks, None);
            assert_eq!(grid.blocks.len(), blocks_of([slices, height, width].into_iter()));
            let mut cells = 0;
            grid.for_places(|tile, cell| {
                let Block { slice, row, column } = grid.blocks[tile / BLOCK_TILES];
                let y = row * TILE_ACROSS_BINS + cell / TILE_ALONG_BINS;
                let x = (column + tile % BLOCK_TILES) * TILE_ALONG_BINS + cell % TILE_ALONG_BINS;
                assert_eq!((slice * height + y) * width + x, cells, "in C order");
                assert_eq!(grid.target[tile][cell], f32::from(u8::from(marks[cells])));
                cells += 1;
            });
            let beyond = grid.target.iter().flat_map(|tile| tile.iter()).filter(|&&mark| mark < 0.0).count();
            assert_eq!((cells, beyond), (grid.cells, grid.target.len() * 32 - cells), "and nothing else is in the box");
        }
    }
}
