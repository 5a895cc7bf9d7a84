//! Detection: constant false alarm rate against the cells around, in the manner of ETCM-CFAR (paper 4.4, appendix B).
//!
//! A cell is a detection where it exceeds mean + β·standard deviation of its reference cells: a box around it, without the
//! guard box in its middle. Both are in metres, so that they fit a body whatever the grid. The statistics are those of the
//! logarithm: amplitudes of speckle have a heavy tail, and one neighbour at 30 dB would lift mean and deviation of the
//! amplitudes above a second body beside it.
//!
//! Cells are asked on a grid of 0.1 m, so that a cluster has as many points as a body has area. Summed-area tables give
//! every box in four look-ups.

use super::change::{Cells, amplitudes_of, change, logarithms, smooth, unit_of};
use super::sight::Sight;
use crate::radar::{View, unravel};

/// What the detector is told.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CfarOptions {
    /// β: standard deviations above the mean of the reference cells; 3 in the paper.
    pub beta: f32,
    /// Half widths of the guard box, (depth, across), m.
    pub guard_m: [f64; 2],
    /// Half widths of the reference box, (depth, across), m.
    pub reference_m: [f64; 2],
    /// Half width of the box over which power is averaged first, m: about the main lobe.
    pub smooth_m: f64,
    /// At most this many detections of a view, those highest above their threshold.
    pub most: usize,
    /// Detections nearer to a stronger one than this, m,
    pub limb_m: f64,
    /// that are weaker by more than this, ln of amplitudes, are left out: parts of the same body, or its sidelobes.
    pub limb_ln: f32,
    /// So are those at the same range as a stronger one, within this, m,
    pub sidelobe_m: f64,
    /// that are weaker by more than this, ln of amplitudes: its sidelobes.
    pub sidelobe_ln: f32,
    /// Nothing nearer is a detection, m: leakage and sidelobes.
    pub nearest_m: f64,
    /// Cells are asked this far apart, m; 0: every cell.
    pub spacing_m: f64,
}

impl Default for CfarOptions {
    fn default() -> Self {
        Self {
            beta: 3.0,
            guard_m: [0.4, 0.5],
            reference_m: [4.0, 5.0],
            smooth_m: 0.04,
            most: 200,
            limb_m: 0.7,
            limb_ln: 1.4,
            sidelobe_m: 0.15,
            sidelobe_ln: 2.3,
            nearest_m: 0.5,
            spacing_m: 0.1,
        }
    }
}

/// A cell above its threshold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Detection {
    /// Flat index of the cell in the view's map.
    pub cell: usize,
    /// Bins of the depth axis and of the axis across.
    pub bin: [usize; 2],
    /// ln of the amplitude over the mean of the reference cells.
    pub contrast: f32,
    /// ln of the amplitude over the threshold.
    pub excess: f32,
    /// ln of the amplitude of the map itself, averaged over the same box.
    pub level: f32,
}

/// The detections of one map (missing cells filled), strongest excess first, without any frame before: of a simulated map,
/// in which nothing but people is. `None` where the view tells no place or the map is not the view's.
pub fn detect(view: &View, map: &[f64], options: &CfarOptions) -> Option<Vec<Detection>> {
    let sight = Sight::new(view).filter(|_| map.len() == view.cells())?;
    let amplitudes = amplitudes_of(map, view.quantity, unit_of([(map, view.quantity)]));
    Some(Planes::new(&sight, options).detect(&amplitudes, &[], options, &mut Tables::default()))
}

/// The cells of a view as planes of (depth, across), one a bin of the remaining axes.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Planes {
    sight: Sight,
    rows: usize,
    columns: usize,
    /// Bins of the remaining axes, and from one bin to the next, cells. What is a number a row or a plane is worked out where
    /// it is asked for: declared axes may be as long as a map is large.
    others: [Vec<usize>; 2],
    row_stride: usize,
    column_stride: usize,
    /// Half widths in bins, (guard depth, reference depth).
    depth_half: [usize; 2],
    /// Half widths of the box that is averaged, in bins (depth, across).
    smooth_half: [usize; 2],
    /// From one cell that is asked to the next, bins (depth, across).
    step: [usize; 2],
    first_row: usize,
    last_row: usize,
}

impl Planes {
    pub(super) fn new(sight: &Sight, options: &CfarOptions) -> Self {
        let shape = sight.view.shape();
        let stride = |k: usize| shape.iter().skip(k + 1).product::<usize>();
        let (rows, columns) =
            (shape.get(sight.depth).copied().unwrap_or(0), shape.get(sight.across).copied().unwrap_or(0));
        let others = (0..shape.len()).filter(|&k| k != sight.depth && k != sight.across);
        let others = others.filter_map(|k| Some((*shape.get(k)?, stride(k)))).unzip();
        let depth = |k: f64| bins(k, sight.depth_step_m(), rows);
        let near = |row: &usize| {
            sight.view.axes.get(sight.depth).is_some_and(|axis| axis.value_at(*row as f64).abs() >= options.nearest_m)
        };
        let first_row = (0..rows).find(near).unwrap_or(rows);
        let last_row = (0..rows).rev().find(near).map_or(0, |row| row + 1);
        Self {
            sight: sight.clone(),
            rows,
            columns,
            others: <[Vec<usize>; 2]>::from(others),
            row_stride: stride(sight.depth),
            column_stride: stride(sight.across),
            depth_half: [depth(options.guard_m[0]), depth(options.reference_m[0])],
            smooth_half: [
                ((options.smooth_m / sight.depth_step_m()).round() as usize).min(8),
                ((options.smooth_m / sight.across_step_m(rows / 2)).round() as usize).min(8),
            ],
            step: [
                bins(options.spacing_m, sight.depth_step_m(), rows),
                bins(options.spacing_m, sight.across_step_m(rows / 2), columns),
            ],
            first_row,
            last_row,
        }
    }

    /// The detections of a map of amplitudes, given those of the frames before; strongest excess first.
    pub(super) fn detect(
        &self,
        now: &[f32],
        before: &[&[f32]],
        options: &CfarOptions,
        tables: &mut Tables,
    ) -> Vec<Detection> {
        let mut found = Vec::new();
        for start in self.starts() {
            let cells = Cells { start, row_stride: self.row_stride, column_stride: self.column_stride };
            change(now, before, [self.rows, self.columns], &cells, &mut tables.plane);
            smooth(&mut tables.plane, [self.rows, self.columns], self.smooth_half, &mut tables.scratch);
            logarithms(&mut tables.plane);
            tables.integrate(self.rows, self.columns);
            let first = found.len();
            self.detect_plane(start, options, tables, &mut found);
            for detection in found.iter_mut().skip(first) {
                detection.level = self.level(now, start, detection.bin);
            }
        }
        found.sort_by(|a: &Detection, b| b.excess.total_cmp(&a.excess).then(a.cell.cmp(&b.cell)));
        found.truncate(options.most);
        found
    }

    /// Flat index of the first cell of each plane.
    fn starts(&self) -> impl Iterator<Item = usize> {
        let [bins, strides] = &self.others;
        let start =
            move |plane: usize| unravel(plane, bins).iter().zip(strides).map(|(bin, stride)| bin * stride).sum();
        (0..bins.iter().product()).map(start)
    }

    fn detect_plane(&self, start: usize, options: &CfarOptions, tables: &Tables, found: &mut Vec<Detection>) {
        for row in (self.first_row..self.last_row).step_by(self.step[0]) {
            let Some(line) = tables.plane.get(row * self.columns..(row + 1) * self.columns) else { return };
            let across = [options.guard_m[1], options.reference_m[1]]
                .map(|half_m| bins(half_m, self.sight.across_step_m(row), self.columns));
            for (column, &level) in line.iter().enumerate().step_by(self.step[1]) {
                let (mean, deviation) = self.reference(row, column, across, tables);
                let excess = level - (mean + options.beta * deviation);
                if excess > 0.0 {
                    let cell = start + row * self.row_stride + column * self.column_stride;
                    found.push(Detection { cell, bin: [row, column], contrast: level - mean, excess, level: 0.0 });
                }
            }
        }
    }

    /// ln of the root mean square around a cell of a map.
    fn level(&self, now: &[f32], start: usize, [row, column]: [usize; 2]) -> f32 {
        let [depth, across] = self.smooth_half;
        let (mut sum, mut cells) = (0.0, 0.0);
        for r in row.saturating_sub(depth)..(row + depth + 1).min(self.rows) {
            for c in column.saturating_sub(across)..(column + across + 1).min(self.columns) {
                let x = now.get(start + r * self.row_stride + c * self.column_stride).copied().unwrap_or(0.0);
                sum += x * x;
                cells += 1.0;
            }
        }
        0.5 * f32::max(sum / f32::max(cells, 1.0), f32::MIN_POSITIVE).ln()
    }

    /// Mean and standard deviation of the reference cells; `across` are the half widths across in bins, (guard, reference).
    fn reference(&self, row: usize, column: usize, across: [usize; 2], tables: &Tables) -> (f32, f32) {
        let span = |at: usize, half: usize, most: usize| [at.saturating_sub(half), (at + half + 1).min(most)];
        let window = |k: usize| (span(row, self.depth_half[k], self.rows), span(column, across[k], self.columns));
        let (outer, inner) = (tables.sums(window(1)), tables.sums(window(0)));
        let n = (outer.0 - inner.0).max(1.0);
        let mean = (outer.1 - inner.1) / n;
        (mean, ((outer.2 - inner.2) / n - mean * mean).max(0.0).sqrt())
    }
}

/// `metres` in whole steps, at least one and at most as many as there are bins.
fn bins(metres: f64, step_m: f64, most: usize) -> usize {
    ((metres / step_m).round() as usize).clamp(1, most.max(1))
}

/// One plane's logarithms less their mean, and its summed-area tables. The mean goes first, so that single precision is
/// enough: sums stay small.
#[derive(Debug, Default)]
pub(super) struct Tables {
    plane: Vec<f32>,
    sum: Vec<f32>,
    square: Vec<f32>,
    scratch: Vec<f32>,
    width: usize,
}

impl Tables {
    /// Takes the plane's mean off and builds the tables.
    fn integrate(&mut self, rows: usize, columns: usize) {
        let total: f64 = self.plane.chunks(256).map(|part| f64::from(part.iter().sum::<f32>())).sum();
        let mean = (total / self.plane.len().max(1) as f64) as f32;
        self.plane.iter_mut().for_each(|x| *x -= mean);
        self.width = columns + 1;
        self.sum.resize((rows + 1) * self.width, 0.0);
        self.square.resize((rows + 1) * self.width, 0.0);
        self.sum[..self.width].fill(0.0);
        self.square[..self.width].fill(0.0);
        for (row, line) in self.plane.chunks_exact(columns.max(1)).enumerate() {
            let (above, below) = self.sum[row * self.width..(row + 2) * self.width].split_at_mut(self.width);
            let (above2, below2) = self.square[row * self.width..(row + 2) * self.width].split_at_mut(self.width);
            let (mut run, mut run2) = (0.0, 0.0);
            (below[0], below2[0]) = (0.0, 0.0);
            for (k, &x) in line.iter().enumerate() {
                run += x;
                run2 += x * x;
                below[k + 1] = above[k + 1] + run;
                below2[k + 1] = above2[k + 1] + run2;
            }
        }
    }

    /// Cells, sum and sum of squares of a box.
    fn sums(&self, (rows, columns): ([usize; 2], [usize; 2])) -> (f32, f32, f32) {
        let corner =
            |table: &[f32], row: usize, column: usize| table.get(row * self.width + column).copied().unwrap_or(0.0);
        let of = |table: &[f32]| {
            corner(table, rows[1], columns[1]) - corner(table, rows[0], columns[1]) - corner(table, rows[1], columns[0])
                + corner(table, rows[0], columns[0])
        };
        (((rows[1] - rows[0]) * (columns[1] - columns[0])) as f32, of(&self.sum), of(&self.square))
    }
}
