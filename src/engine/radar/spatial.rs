//! What the axes of a view alone decide of its maps: which cells lie at the same range, and how a map with a Doppler axis
//! becomes one without.

use super::{Axis, AxisKind, Quantity, View, unravel};
use crate::config::Background;
use std::sync::OnceLock;

/// Echoes nearer than this are leakage from the radar itself, m.
pub(crate) const NEAREST_M: f64 = 0.5;
/// A ring with fewer cells says nothing of the background.
const SMALLEST_RING: usize = 8;
/// Cells are held above this share of the map's largest, and at one by it: a map of another time may be much stronger.
const FAINTEST: f32 = 1e-12;

/// The cells of a view without its Doppler axes, and the rings of those at the same range.
#[derive(Debug, Clone)]
pub(crate) struct SpatialGrid {
    pub(crate) view: View,
    /// Spatial axes and their places among the view's axes.
    pub(crate) axes: Vec<(usize, Axis)>,
    /// Bins of each.
    pub(crate) shape: Vec<usize>,
    /// The ring of each spatial cell.
    ring_of: Vec<u32>,
    /// Spatial cells ring by ring, and where each ring begins.
    cells: Vec<u32>,
    rings: Vec<usize>,
    /// Rings before this are too near to the radar to tell anything.
    deaf: usize,
    /// Range of the first ring, and from one to the next, m; `None` where no axis tells any.
    ring_m: Option<[f64; 2]>,
}

impl SpatialGrid {
    pub(crate) fn new(view: &View) -> Self {
        let spatial = view.axes.iter().enumerate().filter(|(_, axis)| axis.kind != AxisKind::Doppler);
        let axes: Vec<(usize, Axis)> = spatial.map(|(k, axis)| (k, axis.clone())).collect();
        let shape: Vec<usize> = axes.iter().map(|(_, axis)| axis.bins).collect();
        let count: usize = shape.iter().product();
        let (ring_of, rings, cells) = (vec![0; count], vec![], vec![0; count]);
        let mut grid = Self { view: view.clone(), axes, shape, ring_of, cells, rings, deaf: 0, ring_m: None };
        if let Some(ranges) = grid.ranges_m() {
            let widths = grid.axes.iter().filter(|(_, a)| !a.kind.is_angular()).map(|(_, a)| a.step().abs());
            (grid.ring_of, grid.deaf, grid.ring_m) = rings_at(&ranges, widths.fold(f64::INFINITY, f64::min));
        }
        // Counting sort: how many cells each ring has, where it begins, and each cell to its place.
        grid.rings = vec![0; grid.ring_of.iter().max().map_or(1, |&last| last as usize + 2)];
        for &ring in &grid.ring_of {
            grid.rings[ring as usize + 1] += 1;
        }
        for ring in 1..grid.rings.len() {
            grid.rings[ring] += grid.rings[ring - 1];
        }
        let mut next = grid.rings.clone();
        for (cell, &ring) in grid.ring_of.iter().enumerate() {
            grid.cells[next[ring as usize]] = cell as u32;
            next[ring as usize] += 1;
        }
        grid
    }

    /// The same cells of a view with the same axes.
    pub(crate) fn seen_as(&self, view: &View) -> Self {
        Self { view: view.clone(), ..self.clone() }
    }

    /// Distance of each cell from the view's origin as far as the axes tell it, m; `None` where no axis tells any.
    fn ranges_m(&self) -> Option<Vec<f64>> {
        let has = |kind: AxisKind| self.axes.iter().any(|(_, axis)| axis.kind == kind);
        let telling: &[AxisKind] = match () {
            () if has(AxisKind::Range) => &[AxisKind::Range],
            () if has(AxisKind::DepthH) => &[AxisKind::DepthH, AxisKind::Y],
            () if has(AxisKind::DepthV) => &[AxisKind::DepthV, AxisKind::Z],
            () => &[AxisKind::X, AxisKind::Y, AxisKind::Z],
        };
        if !telling.iter().any(|&kind| has(kind)) {
            return None;
        }
        // Squares add up axis by axis: the cells of the axes so far, each with every bin of the next.
        let squares = self.axes.iter().fold(vec![0.0], |so_far: Vec<f64>, (_, axis)| {
            let share = f64::from(u8::from(telling.contains(&axis.kind)));
            let own: Vec<f64> = (0..axis.bins).map(|bin| share * axis.value_at(bin as f64).powi(2)).collect();
            so_far.iter().flat_map(|before| own.iter().map(move |square| before + square)).collect()
        });
        let ranges: Vec<f64> = squares.into_iter().map(f64::sqrt).collect();
        // Squares of what no radar sees leave the range of numbers, and then tell nothing.
        ranges.iter().all(|range| range.is_finite()).then_some(ranges)
    }

    /// Range of a ring, m; `None` where no axis tells any.
    pub(crate) fn ring_m(&self, ring: usize) -> Option<f64> {
        self.ring_m.map(|[first, step]| first + step * ring as f64)
    }

    /// How many rings there are.
    pub(crate) fn rings(&self) -> usize {
        self.rings.len().saturating_sub(1)
    }

    /// The power of each ring's cells, of all Doppler bins, and how many they are. Cells that are no number count for nothing.
    pub(crate) fn power_by_ring(&self, map: &[f64], quantity: Quantity) -> (Vec<f64>, Vec<f64>) {
        let (mut powers, mut cells) = (vec![0.0; self.rings()], vec![0.0; self.rings()]);
        let mut add = |ring: u32, h: f64| {
            if h.is_finite() {
                powers[ring as usize] += quantity.power(h);
                cells[ring as usize] += 1.0;
            }
        };
        if self.axes.len() == self.view.axes.len() {
            self.ring_of.iter().zip(map).for_each(|(&ring, &h)| add(ring, h));
            return (powers, cells);
        }
        let shape = self.view.shape();
        for (cell, &h) in map.iter().enumerate() {
            let bins = unravel(cell, &shape);
            let spatial = self.axes.iter().fold(0, |flat, (k, axis)| flat * axis.bins + bins[*k]);
            add(self.ring_of[spatial], h);
        }
        (powers, cells)
    }

    /// A place for the background of each ring, and one for that of the whole map.
    pub(crate) fn unknown(&self) -> Vec<OnceLock<f32>> {
        vec![OnceLock::new(); self.rings.len()]
    }

    /// Whose background a cell has: its ring's, or the whole map's where the ring is small or `background` asks for it.
    pub(crate) fn place(&self, cell: usize, background: Background) -> usize {
        if background == Background::Map {
            return self.rings.len() - 1;
        }
        let ring = self.ring_of[cell] as usize;
        let small = self.rings[ring + 1] - self.rings[ring] < SMALLEST_RING;
        if small && ring >= self.deaf { self.rings.len() - 1 } else { ring }
    }

    /// One over the median at a place; 0 where nothing is told. `value` must be positive.
    pub(crate) fn background(&self, value: &[f32], place: usize) -> f32 {
        if place < self.deaf.min(self.rings.len() - 1) {
            return 0.0;
        }
        let ends = self.rings.get(place + 1).map_or(0..self.cells.len(), |&end| self.rings[place]..end);
        // Positive floats sort as their bits do, and integers are partitioned several times as fast.
        1.0 / median(&mut self.cells[ends].iter().map(|&cell| value[cell as usize].to_bits()).collect::<Vec<_>>())
    }

    /// The median of `power` over those cells of each cell's ring that are not `inside`, both a cell of the view in C order; 0 where
    /// they are too few, and where the ring has nothing inside, of which nobody asks. A ring is one of each Doppler bin: what moves
    /// smears along its own.
    pub(crate) fn beside(&self, power: impl Fn(usize) -> f64, inside: &[bool]) -> Vec<f64> {
        let shape = self.view.shape();
        // The cells of a spatial cell: one a Doppler bin.
        let strides: Vec<usize> = (0..shape.len()).map(|k| shape[k + 1..].iter().product()).collect();
        let offsets = shape.iter().enumerate().fold(vec![0], |offsets: Vec<usize>, (k, &bins)| {
            let own = if self.axes.iter().any(|(axis, _)| *axis == k) { 1 } else { bins };
            offsets
                .iter()
                .flat_map(|&offset| (0..own).map(move |bin| (offset, bin)))
                .map(|(o, bin)| o + bin * strides[k])
                .collect()
        });
        let first = |spatial: usize| -> usize {
            unravel(spatial, &self.shape).iter().zip(&self.axes).map(|(bin, (axis, _))| bin * strides[*axis]).sum()
        };
        let plain = self.axes.len() == shape.len();
        let firsts: Vec<usize> = if plain { Vec::new() } else { (0..self.cells.len()).map(first).collect() };
        let full = |spatial: u32| if plain { spatial as usize } else { firsts[spatial as usize] };
        let mut levels = vec![0.0; inside.len()];
        let mut beside = Vec::new();
        for ring in self.rings.windows(2) {
            let cells = &self.cells[ring[0]..ring[1]];
            for offset in &offsets {
                if !cells.iter().any(|&cell| inside[full(cell) + offset]) {
                    continue;
                }
                beside.clear();
                let outside = cells.iter().map(|&cell| full(cell) + offset).filter(|&cell| !inside[cell]);
                beside.extend(outside.map(|cell| (power(cell) as f32).to_bits()));
                if beside.len() >= SMALLEST_RING {
                    let level = f64::from(median(&mut beside));
                    for &cell in cells {
                        levels[full(cell) + offset] = level;
                    }
                }
            }
        }
        levels
    }

    /// H of each spatial cell in shares of `largest`, and the full cell each was taken from where that is another.
    pub(crate) fn spatial(&self, map: &[f64], largest: f64) -> (Vec<f32>, Vec<u32>) {
        let relative = |h: f64| ((h / largest) as f32).clamp(FAINTEST, 1.0 / FAINTEST);
        if self.axes.len() == self.view.axes.len() {
            return (map.iter().map(|&h| relative(h)).collect(), Vec::new());
        }
        let shape = self.view.shape();
        let (mut value, mut source) = (vec![0.0; self.cells.len()], vec![0; self.cells.len()]);
        for (cell, &h) in map.iter().enumerate() {
            let bins = unravel(cell, &shape);
            let spatial = self.axes.iter().fold(0, |flat, (k, axis)| flat * axis.bins + bins[*k]);
            if relative(h) > value[spatial] {
                (value[spatial], source[spatial]) = (relative(h), cell as u32);
            }
        }
        (value, source)
    }
}

/// The ring of each cell at one of `ranges` (m, finite), for rings `width_m` wide and counted from the nearest; how many of the
/// first are too near to the radar to tell anything; and the range of the first and the width of each, m.
///
/// There are at most as many rings as cells, plus one: more could only be empty. Where axes are so far apart in scale that
/// `width_m` asks for more (a depth axis to 10⁹ m beside steps of centimetres), rings are as much wider.
fn rings_at(ranges: &[f64], width_m: f64) -> (Vec<u32>, usize, Option<[f64; 2]>) {
    let (nearest, farthest) =
        ranges.iter().fold((f64::INFINITY, 0.0_f64), |(low, high), &range| (low.min(range), high.max(range)));
    let most = ranges.len() as f64;
    let width_m = width_m.max((farthest - nearest) / most).max(f64::MIN_POSITIVE);
    let first = (nearest / width_m).round();
    let ring = |range: f64| ((range / width_m).round() - first).clamp(0.0, most);
    let ring_m = Some([first * width_m, width_m]);
    (ranges.iter().map(|&range| ring(range) as u32).collect(), ring(NEAREST_M) as usize, ring_m)
}

/// The middle value of positive floats given as their bits, the upper one of two; they are reordered. 1 where there are
/// none.
fn median(bits: &mut [u32]) -> f32 {
    if bits.is_empty() {
        return 1.0;
    }
    let middle = bits.len() / 2;
    f32::from_bits(*bits.select_nth_unstable(middle).1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radar::{PointSpread, Spacing};

    fn view(axes: [(AxisKind, usize, f64, f64); 2]) -> View {
        let axis = |(kind, bins, lo, hi)| Axis { kind, bins, lo, hi, spacing: Spacing::Linear };
        View {
            array: "rings".into(),
            quantity: Quantity::Amplitude,
            psf: PointSpread::default(),
            pose: crate::geometry::Pose::default(),
            axes: axes.map(axis).to_vec(),
            region: None,
        }
    }

    fn depth_of(lo: f64, hi: f64) -> SpatialGrid {
        SpatialGrid::new(&view([(AxisKind::DepthH, 16, lo, hi), (AxisKind::Y, 8, -1.0, 1.0)]))
    }

    #[test]
    fn rings_are_bounded_by_the_cells_whatever_the_axes_say() {
        for (lo, hi) in
            [(0.0, 1e9), (0.0, 1e308), (1e308, 0.0), (1e-308, 2e-308), (1e308, 1.1e308), (-1e9, 1e9), (1e9, 2e9)]
        {
            let grid = depth_of(lo, hi);
            assert!(grid.rings.len() <= grid.cells.len() + 3, "{lo} to {hi}: {} rings", grid.rings.len());
            assert_eq!(grid.rings.last(), Some(&grid.cells.len()), "{lo} to {hi}");
            let value = vec![1.0; grid.cells.len()];
            assert!((0..grid.rings.len()).all(|place| grid.background(&value, place).is_finite()), "{lo} to {hi}");
        }
    }

    /// An arc about the radar is known from the cells beside a box, and what is in the box says nothing of it.
    #[test]
    fn what_is_lit_beside_a_box_is_told_of_each_ring_and_doppler_bin() {
        let axis = |kind, bins, lo, hi| Axis { kind, bins, lo, hi, spacing: Spacing::Linear };
        let mut view = view([(AxisKind::Range, 4, 1.0, 5.0), (AxisKind::Azimuth, 20, -1.0, 1.0)]);
        view.axes.insert(1, axis(AxisKind::Doppler, 3, -1.0, 1.0));
        let grid = SpatialGrid::new(&view);
        let of = |cell: usize| unravel(cell, &view.shape());
        let inside: Vec<bool> = (0..view.cells()).map(|cell| (8..12).contains(&of(cell)[2])).collect();
        let level = |cell: usize| (1 + of(cell)[0] * 10 + of(cell)[1]) as f64;
        let power = |cell: usize| if inside[cell] { 1e6 } else { level(cell) };
        let beside = grid.beside(power, &inside);
        assert!((0..view.cells()).all(|cell| beside[cell] == level(cell)));
        assert!(grid.beside(power, &vec![true; view.cells()]).iter().all(|&level| level == 0.0));
    }

    #[test]
    fn rings_are_as_wide_as_a_step_and_begin_at_the_nearest_cell() {
        let grid = depth_of(2.0, 10.0);
        // √(2² + 0²) m and √(2.5² + 0²) m lie two steps of a quarter metre apart.
        assert_eq!((grid.ring_of[4], grid.ring_of[12]), (0, 2));
        assert_eq!(grid.deaf, 0);
        assert_eq!(depth_of(0.0, 8.0).deaf, 2);
    }
}
