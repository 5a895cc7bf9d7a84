//! What the axes of a view alone decide for its evidence, worked out once for all its maps: which cells lie at the same
//! range, and how a map with a Doppler axis becomes one without.

use crate::config::Background;
use crate::radar::{Axis, AxisKind, View, unravel};
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// Echoes nearer than this are leakage from the radar itself, m.
pub(super) const NEAREST_M: f64 = 0.5;
/// A ring with fewer cells says nothing of the background.
const SMALLEST_RING: usize = 8;
/// Cells are held above this share of the map's largest.
const FAINTEST: f32 = 1e-12;

/// A view as evidence sees it: its axes without Doppler, and the rings of cells at the same range.
#[derive(Debug)]
pub(super) struct Layout {
    pub(super) view: View,
    pub(super) index: usize,
    /// Spatial axes and their places among the view's axes.
    pub(super) axes: Vec<(usize, Axis)>,
    pub(super) shape: Vec<usize>,
    /// The ring of each spatial cell.
    ring_of: Vec<u32>,
    /// Spatial cells ring by ring, and where each ring begins.
    cells: Vec<u32>,
    rings: Vec<usize>,
    /// Rings before this are too near to the radar to tell anything.
    deaf: usize,
}

/// Layouts that were asked for last: frame after frame has the same views.
static KNOWN: Mutex<VecDeque<Arc<Layout>>> = Mutex::new(VecDeque::new());
/// So many are kept.
const MOST_KNOWN: usize = 8;

impl Layout {
    /// The layout of a view, as it is remembered or worked out.
    pub(super) fn of(index: usize, view: &View) -> Arc<Self> {
        let known = || KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
        let same = |layout: &&Arc<Self>| layout.index == index && layout.view == *view;
        if let Some(layout) = known().iter().find(same) {
            return Arc::clone(layout);
        }
        let layout = Arc::new(Self::new(index, view));
        let mut known = known();
        known.truncate(MOST_KNOWN - 1);
        known.push_front(Arc::clone(&layout));
        layout
    }

    fn new(index: usize, view: &View) -> Self {
        let spatial = view.axes.iter().enumerate().filter(|(_, axis)| axis.kind != AxisKind::Doppler);
        let axes: Vec<(usize, Axis)> = spatial.map(|(k, axis)| (k, axis.clone())).collect();
        let shape: Vec<usize> = axes.iter().map(|(_, axis)| axis.bins).collect();
        let count: usize = shape.iter().product();
        let (ring_of, rings, cells) = (vec![0; count], vec![], vec![0; count]);
        let mut layout = Self { view: view.clone(), index, axes, shape, ring_of, cells, rings, deaf: 0 };
        if let Some(ranges) = layout.ranges_m() {
            let widths = layout.axes.iter().filter(|(_, a)| !a.kind.is_angular()).map(|(_, a)| a.step().abs());
            let width_m = widths.fold(f64::INFINITY, f64::min);
            layout.ring_of = ranges.iter().map(|range| (range / width_m).round() as u32).collect();
            layout.deaf = (NEAREST_M / width_m).round() as usize;
        }
        // Counting sort: how many cells each ring has, where it begins, and each cell to its place.
        layout.rings = vec![0; layout.ring_of.iter().max().map_or(1, |&last| last as usize + 2)];
        for &ring in &layout.ring_of {
            layout.rings[ring as usize + 1] += 1;
        }
        for ring in 1..layout.rings.len() {
            layout.rings[ring] += layout.rings[ring - 1];
        }
        let mut next = layout.rings.clone();
        for (cell, &ring) in layout.ring_of.iter().enumerate() {
            layout.cells[next[ring as usize]] = cell as u32;
            next[ring as usize] += 1;
        }
        layout
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
        Some(squares.into_iter().map(f64::sqrt).collect())
    }

    /// A place for the background of each ring, and one for that of the whole map.
    pub(super) fn unknown(&self) -> Vec<OnceLock<f32>> {
        vec![OnceLock::new(); self.rings.len()]
    }

    /// Whose background a cell has: its ring's, or the whole map's where the ring is small or `background` asks for it.
    pub(super) fn place(&self, cell: usize, background: Background) -> usize {
        if background == Background::Map {
            return self.rings.len() - 1;
        }
        let ring = self.ring_of[cell] as usize;
        let small = self.rings[ring + 1] - self.rings[ring] < SMALLEST_RING;
        if small && ring >= self.deaf { self.rings.len() - 1 } else { ring }
    }

    /// One over the median at a place; 0 where nothing is told. `value` must be positive.
    pub(super) fn background(&self, value: &[f32], place: usize) -> f32 {
        if place < self.deaf.min(self.rings.len() - 1) {
            return 0.0;
        }
        let ends = self.rings.get(place + 1).map_or(0..self.cells.len(), |&end| self.rings[place]..end);
        // Positive floats sort as their bits do, and integers are partitioned several times as fast.
        1.0 / median(&mut self.cells[ends].iter().map(|&cell| value[cell as usize].to_bits()).collect::<Vec<_>>())
    }

    /// H of each spatial cell in shares of `largest`, and the full cell each was taken from where that is another.
    pub(super) fn spatial(&self, map: &[f64], largest: f64) -> (Vec<f32>, Vec<u32>) {
        let relative = |h: f64| ((h / largest) as f32).max(FAINTEST);
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

/// The middle value of positive floats given as their bits, the upper one of two; they are reordered. 1 where there are
/// none.
fn median(bits: &mut [u32]) -> f32 {
    if bits.is_empty() {
        return 1.0;
    }
    let middle = bits.len() / 2;
    f32::from_bits(*bits.select_nth_unstable(middle).1)
}
