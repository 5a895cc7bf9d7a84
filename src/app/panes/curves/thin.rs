//! A long curve drawn from a thinned copy: of the points that fall on one pixel column only the lowest and the highest.

use super::along::Along;
use egui_plot::PlotPoint;
use std::ops::RangeInclusive;

/// What of a curve can be told apart on screen.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct VisibleSpan {
    /// Places that are drawn: those on screen, and as many on both sides for a drag in between.
    drawn: RangeInclusive<f64>,
    /// The width of a pixel column.
    column: f64,
    /// How iterations have their places.
    along: Along,
}

impl VisibleSpan {
    /// Of a plot that shows the places `lo` to `hi` on `pixels` columns.
    pub(super) fn new(lo: f64, hi: f64, pixels: f32, along: Along) -> Self {
        let span = hi - lo;
        Self { drawn: lo - span..=hi + span, column: span / f64::from(pixels.max(1.0)), along }
    }

    /// How iterations have their places.
    pub(super) fn along(&self) -> Along {
        self.along
    }

    /// Iterations that are drawn.
    pub(super) fn iterations(&self) -> RangeInclusive<f64> {
        self.along.iteration(*self.drawn.start())..=self.along.iteration(*self.drawn.end())
    }

    /// Whole iterations that fall on one pixel column from `iteration` on, at least 1.
    pub(super) fn iterations_a_column(&self, iteration: usize) -> usize {
        self.along.iterations_on(self.column, iteration)
    }

    /// The points that a curve through `points`, in the order of x, is drawn from. Both ends are always among them, so that
    /// the plot's own bounds do not depend on what it shows.
    pub(super) fn thinned(&self, points: Vec<PlotPoint>) -> Vec<PlotPoint> {
        let [first, inner @ .., last] = points.as_slice() else { return points };
        let mut kept = vec![*first];
        let on_screen = inner.iter().filter(|p| self.drawn.contains(&p.x));
        for column in on_screen.collect::<Vec<_>>().chunk_by(|a, b| self.column_of(a) == self.column_of(b)) {
            let by_height = |a: &&&PlotPoint, b: &&&PlotPoint| a.y.total_cmp(&b.y);
            let (low, high) = (column.iter().min_by(by_height), column.iter().max_by(by_height));
            let (Some(&low), Some(&high)) = (low, high) else { continue };
            let (early, late) = if low.x <= high.x { (low, high) } else { (high, low) };
            kept.push(*early);
            if early.x < late.x {
                kept.push(*late);
            }
        }
        kept.push(*last);
        kept
    }

    fn column_of(&self, point: &PlotPoint) -> i64 {
        (point.x / self.column) as i64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(count: usize) -> Vec<PlotPoint> {
        (0..count).map(|k| PlotPoint::new(k as f64, if k == 61_803 { 9.0 } else { (k as f64 * 0.1).sin() })).collect()
    }

    #[test]
    fn a_hundred_thousand_points_become_two_a_column_and_keep_their_spikes() {
        let thinned = VisibleSpan::new(0.0, 100_000.0, 800.0, Along::Even).thinned(curve(100_000));
        assert!(thinned.len() <= 2 * 801 + 2, "{}", thinned.len());
        assert!(thinned.iter().any(|p| p.x == 61_803.0 && p.y == 9.0));
        assert!(thinned.windows(2).all(|pair| pair[0].x < pair[1].x), "in order, none twice");
        assert!((thinned[0].x, thinned[thinned.len() - 1].x) == (0.0, 99_999.0));
    }

    #[test]
    fn where_each_point_has_a_column_none_is_lost() {
        let points = curve(300);
        let same = VisibleSpan::new(0.0, 300.0, 800.0, Along::Even).thinned(points.clone());
        assert!(same.len() == 300 && same.iter().zip(&points).all(|(a, b)| a.x == b.x && a.y == b.y));
    }

    #[test]
    fn what_is_far_off_screen_is_not_drawn() {
        let thinned = VisibleSpan::new(50_000.0, 50_100.0, 800.0, Along::Even).thinned(curve(100_000));
        assert_eq!(thinned.len(), 303, "a window on both sides, and the ends");
    }
}
