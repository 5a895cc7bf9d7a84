//! The middle of one person's echo in space, from a map that tells where across and one that tells how high.

use crate::dataset::Heatmap;
use crate::geometry::Vec3;
use crate::radar::{AxisKind, View};

/// Cells within this of the strongest are its own, m: a body is as wide, and as high.
const REACH_M: [f64; 2] = [0.6, 1.0];
/// Share of the strongest cell's power from which on a cell counts.
const FAINTEST: f64 = 0.05;
/// Depths of the two maps may differ by so much, m.
const SAME_M: f64 = 0.5;
/// The strongest is that of a square of so many cells on each side: one cell alone is speckle.
const SMOOTH: usize = 1;

/// Which maps tell what.
pub(super) struct EchoFinder {
    /// Views with a depth axis and an axis across, y (false) or z (true).
    planes: Vec<(usize, bool, View)>,
}

impl EchoFinder {
    pub(super) fn new(views: &[View]) -> Self {
        let plane = |(k, view): (usize, &View)| {
            let kinds: Vec<AxisKind> = view.axes.iter().map(|axis| axis.kind).collect();
            match kinds[..] {
                [AxisKind::DepthH, AxisKind::Y] => Some((k, false, view.clone())),
                [AxisKind::DepthV, AxisKind::Z] => Some((k, true, view.clone())),
                _ => None,
            }
        };
        Self { planes: views.iter().enumerate().filter_map(plane).collect() }
    }

    /// Radar frame, m; `None` where a map shows nothing, or the two do not fit each other.
    pub(super) fn find(&self, maps: &[Heatmap]) -> Option<Vec3> {
        let middle_of = |upright: bool| {
            let (k, _, view) = self.planes.iter().find(|(_, z, _)| *z == upright)?;
            middle(view, &maps.get(*k)?.data, REACH_M[usize::from(upright)])
        };
        let ([depth_h, y], [depth_v, z]) = (middle_of(false)?, middle_of(true)?);
        // depth_h² = x² + z², depth_v² = x² + y².
        let ahead = |depth: f64, across: f64| (depth * depth - across * across).max(0.0).sqrt();
        let (a, b) = (ahead(depth_h, z), ahead(depth_v, y));
        ((a - b).abs() <= SAME_M).then_some([0.5 * (a + b), y, z])
    }
}

/// Depth and coordinate across of the power about the strongest place of a map.
fn middle(view: &View, map: &[f64], reach_m: f64) -> Option<[f64; 2]> {
    let [depth, across] = &view.axes[..] else { return None };
    let power = |row: usize, column: usize| {
        let h = map.get(row * across.bins + column).copied().filter(|h| h.is_finite()).unwrap_or(0.0);
        h * h
    };
    let near = |at: usize, bins: usize| at.saturating_sub(SMOOTH)..(at + SMOOTH + 1).min(bins);
    let smooth = |row: usize, column: usize| -> f64 {
        near(row, depth.bins).flat_map(|r| near(column, across.bins).map(move |c| power(r, c))).sum()
    };
    let cells = (0..depth.bins).flat_map(|row| (0..across.bins).map(move |column| (row, column)));
    let (top, (row, column)) =
        cells.map(|(row, column)| (smooth(row, column), (row, column))).max_by(|a, b| a.0.total_cmp(&b.0))?;
    if top <= 0.0 {
        return None;
    }
    let (deep, wide) = (reach_m.min(REACH_M[0]) / depth.step().abs(), reach_m / across.step().abs());
    let around = |at: usize, reach: f64, bins: usize| {
        let reach = reach.ceil() as usize;
        at.saturating_sub(reach)..(at + reach + 1).min(bins)
    };
    let mut sums = [0.0; 3];
    for r in around(row, deep, depth.bins) {
        for c in around(column, wide, across.bins) {
            let weight = smooth(r, c);
            if weight >= FAINTEST * top {
                // Amplitudes: the strongest limb is not all of the body.
                let weight = weight.sqrt();
                sums =
                    [sums[0] + weight, sums[1] + weight * depth.at(r as f64), sums[2] + weight * across.at(c as f64)];
            }
        }
    }
    (sums[0] > 0.0).then(|| [sums[1] / sums[0], sums[2] / sums[0]])
}
