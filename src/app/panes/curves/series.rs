//! The values of curves as they grow, and what of them can be seen: lowest and highest of ever longer stretches.

use super::along::Along;
use super::thin::VisibleSpan;
use egui_plot::PlotPoint;
use std::collections::HashMap;

/// What is less is no value of a loss, an IoU or a distance.
const NOTHING: f64 = 1e-12;

/// A curve's values by iteration; NaN where there is none. From each on, of stretches of 2, 4, 8, … values, where the lowest
/// and the highest lie: a part is drawn from stretches that are shorter than a pixel.
#[derive(Debug, Default)]
pub(super) struct Series {
    first: usize,
    values: Vec<f64>,
    /// Of stretches of 2, 4, 8, …: the places of the lowest and of the highest value.
    levels: Vec<Vec<[usize; 2]>>,
}

impl Series {
    fn push(&mut self, value: f64) {
        let place = self.values.len();
        self.values.push(value);
        if place.is_power_of_two() {
            // The longest stretch so far was all there is, and has become the first of two.
            let all = self.levels.last().map_or([0, 0], |longest| longest[0]);
            self.levels.push(vec![all]);
        }
        for (level, stretches) in self.levels.iter_mut().enumerate() {
            match stretches.get_mut(place >> (level + 1)) {
                Some([low, high]) => {
                    // Whatever is a value is preferred to none.
                    let [lowest, highest] = [*low, *high].map(|at| self.values[at]);
                    if value < lowest || lowest.is_nan() {
                        *low = place;
                    }
                    if value > highest || highest.is_nan() {
                        *high = place;
                    }
                }
                None => stretches.push([place, place]),
            }
        }
    }

    /// Whether it is 0 wherever it has a value, but for the last digits of a sum.
    pub(super) fn is_zero(&self) -> bool {
        let nothing = |value: f64| value.abs() < NOTHING || value.is_nan();
        // Of the longest stretches the lowest and the highest; one value alone has none.
        let Some(longest) = self.levels.last() else { return self.values.iter().all(|&value| nothing(value)) };
        longest.iter().flatten().all(|&at| nothing(self.values[at]))
    }

    /// The points that a curve in `window` is drawn from, in pieces: it breaks where there is no value, or on a logarithmic
    /// scale none above 1e−7. Everything, laid `along`, where nothing was on screen yet.
    pub(super) fn pieces(&self, window: Option<&VisibleSpan>, along: Along, log: bool) -> Vec<Vec<PlotPoint>> {
        let Some(last) = self.values.len().checked_sub(1) else { return Vec::new() };
        let window = window.filter(|window| window.along() == along);
        let Some(window) = window else { return self.joined(0..=last, along, log) };
        let place = |iteration: f64| ((iteration - self.first as f64).max(0.0) as usize).min(last);
        let iterations = window.iterations();
        let (mut at, end) = (place(iterations.start().floor()), place(iterations.end().ceil()));
        // Both ends are always among them, so that the plot's own bounds do not depend on what it shows.
        let mut places = vec![0];
        while at <= end {
            let stretch = window.iterations_a_column(self.first + at);
            let level = stretch.ilog2().min(self.levels.len() as u32);
            let ends = level.checked_sub(1).and_then(|k| self.levels.get(k as usize)?.get(at >> level));
            places.extend(ends.map_or([at, at], |&[a, b]| [a.min(b), a.max(b)]));
            at = ends.map_or(at + 1, |_| ((at >> level) + 1) << level);
        }
        places.push(last);
        // A stretch may have begun before the one that it follows was over.
        places.sort_unstable();
        places.dedup();
        self.joined(places.into_iter(), along, log).into_iter().map(|piece| window.thinned(piece)).collect()
    }

    fn joined(&self, places: impl Iterator<Item = usize>, along: Along, log: bool) -> Vec<Vec<PlotPoint>> {
        let mut pieces: Vec<Vec<PlotPoint>> = vec![Vec::new()];
        for place in places {
            let value = self.values[place];
            match pieces.last_mut() {
                Some(piece) if value.is_finite() && (!log || value > 1e-7) => {
                    let y = if log { value.log10() } else { value };
                    piece.push(PlotPoint::new(along.x((self.first + place) as f64), y));
                }
                _ => pieces.push(Vec::new()),
            }
        }
        pieces.retain(|piece| !piece.is_empty());
        pieces
    }
}

/// Series by what they are of; they live as long as somebody asks for them and their history grows.
#[derive(Debug, Default)]
pub(super) struct SeriesCache<K> {
    of: K,
    series: HashMap<(Option<u32>, String), (Series, bool)>,
    /// The same smoothed, and with which weight.
    smoothed: HashMap<String, (Series, f64)>,
}

impl<K: PartialEq> SeriesCache<K> {
    /// Forgets what is not of `of`, and what was not asked for since the last call.
    pub(super) fn begin(&mut self, of: K) {
        if self.of == of {
            self.series.retain(|_, (_, asked)| std::mem::take(asked));
        } else {
            (self.of, self.series, self.smoothed) = (of, HashMap::new(), HashMap::new());
        }
    }

    /// The exponential moving average of a curve that was [`Self::grown`] on the way to where the fit stands: of the mean so
    /// far, `weight` is kept at each value. Nothing is known before the first value.
    pub(super) fn smoothed(&mut self, curve: &str, weight: f64) -> Option<&Series> {
        let (raw, _) = self.series.get(&(None, curve.to_owned()))?;
        let (series, of) = self.smoothed.entry(curve.to_owned()).or_default();
        if (*of, series.first) != (weight, raw.first) {
            (*series, *of) = (Series { first: raw.first, ..Series::default() }, weight);
        }
        let mut mean = series.values.iter().rev().copied().find(|value| value.is_finite());
        for &value in raw.values.get(series.values.len()..).unwrap_or_default() {
            let now = mean.map_or(value, |mean| weight * mean + (1.0 - weight) * value);
            mean = Some(now).filter(|now| now.is_finite()).or(mean);
            series.push(now);
        }
        Some(series)
    }

    /// The series of a curve on a branch (`None`: on the way to where the fit stands), of rows without holes from iteration
    /// `first` on, which only grow.
    pub(super) fn grown<R>(
        &mut self,
        branch: Option<u32>,
        curve: &str,
        first: usize,
        rows: &[&[R]],
        value: impl Fn(&R) -> Option<f64>,
    ) -> &Series {
        let (series, asked) = self.series.entry((branch, curve.to_owned())).or_default();
        (series.first, *asked) = (first, true);
        let mut known = series.values.len();
        for rows in rows {
            for row in rows.get(known..).unwrap_or_default() {
                series.push(value(row).filter(|value| value.is_finite()).unwrap_or(f64::NAN));
            }
            known = known.saturating_sub(rows.len());
        }
        series
    }
}

/// A series of all values at once.
pub(super) fn series(first: usize, values: impl Iterator<Item = Option<f64>>) -> Series {
    let mut series = Series { first, ..Series::default() };
    values.for_each(|value| series.push(value.filter(|value| value.is_finite()).unwrap_or(f64::NAN)));
    series
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    fn value(k: usize) -> Option<f64> {
        let spike = if k == 61_803 { 9.0 } else { (k as f64 * 0.1).sin() };
        (k / 1000 != 70).then_some(spike)
    }

    #[test]
    fn a_part_looks_as_if_all_points_were_drawn() {
        let series = series(5, (0..100_000).map(value));
        for (lo, hi, pixels) in [(0.0, 100_005.0, 800.0), (61_000.0, 63_000.0, 640.0), (300.0, 420.0, 500.0)] {
            let window = VisibleSpan::new(lo, hi, pixels, Along::Even);
            let every = series.joined(0..series.values.len(), Along::Even, false);
            let every: Vec<PlotPoint> = every.into_iter().flat_map(|piece| window.thinned(piece)).collect();
            let few: Vec<PlotPoint> = series.pieces(Some(&window), Along::Even, false).concat();
            assert!(few.len() <= every.len() + 2, "{} of {}", few.len(), every.len());
            let on_screen = |p: &&PlotPoint| (lo..=hi).contains(&p.x);
            // The same heights in all columns, but for those that the stretches straddle.
            let highest = |points: &[PlotPoint]| {
                let mut columns: BTreeMap<i64, f64> = BTreeMap::new();
                for p in points.iter().filter(on_screen) {
                    let y = columns.entry((p.x * f64::from(pixels) / (hi - lo)) as i64).or_insert(p.y);
                    *y = y.max(p.y);
                }
                columns
            };
            let (of_few, of_every) = (highest(&few), highest(&every));
            let same = |(at, y): &(&i64, &f64)| of_few.get(*at).is_some_and(|found| (found - **y).abs() <= 0.02);
            let (off, all) = (of_every.iter().filter(|column| !same(column)).count(), of_every.len());
            assert!(off * 50 <= all && of_few.len() <= all, "{off} of {all} columns differ");
            assert!(few.iter().filter(on_screen).all(|p| !(70_005.0..71_005.0).contains(&p.x)), "a gap stays a gap");
        }
    }

    #[test]
    fn a_series_grows_by_what_is_new_and_is_forgotten_with_its_history() {
        let mut cache = SeriesCache::<u32>::default();
        let rows: Vec<usize> = (0..300).collect();
        let asked = std::cell::Cell::new(0);
        let mut grown = |of: u32, count: usize| {
            cache.begin(of);
            let (early, late) = rows[..count].split_at(count / 2);
            let value = |&k: &usize| {
                asked.set(asked.get() + 1);
                Some(k as f64)
            };
            let series = cache.grown(None, "L", 0, &[early, late], value);
            let last = series.pieces(None, Along::Even, false)[0].last().map(|p| (p.x, p.y));
            (series.values.len(), last, asked.take())
        };
        assert_eq!(grown(1, 100), (100, Some((99.0, 99.0)), 100));
        assert_eq!(grown(1, 300), (300, Some((299.0, 299.0)), 200), "only what is new is looked at");
        assert_eq!(grown(2, 50), (50, Some((49.0, 49.0)), 50), "another history");
    }

    #[test]
    fn on_a_log_axis_the_start_is_drawn_whole_and_the_rest_by_its_ends() {
        let series = series(0, (0..100_000).map(|k| Some(if k == 61_803 { 9.0 } else { (k as f64 * 0.1).sin() })));
        let window = VisibleSpan::new(0.0, 5.0, 800.0, Along::Log);
        let points = series.pieces(Some(&window), Along::Log, false).concat();
        assert!(points.len() < 2000 && points.is_sorted_by(|a, b| a.x < b.x), "{}", points.len());
        for k in 0..60 {
            let x = Along::Log.x(f64::from(k));
            assert!(points.iter().any(|p| (p.x - x).abs() < 1e-12), "iteration {k}");
        }
        assert!(points.iter().any(|p| p.y == 9.0), "a spike is kept");
    }

    #[test]
    fn smoothing_grows_with_its_curve_and_bridges_what_has_no_value() {
        let mut cache = SeriesCache::<u32>::default();
        let rows: Vec<Option<f64>> = vec![Some(1.0), Some(0.0), None, Some(0.0), Some(1.0)];
        let mut smooth = |count: usize, weight: f64| {
            cache.begin(1);
            cache.grown(None, "L", 0, &[&rows[..count]], |v| *v);
            cache.smoothed("L", weight).map(|series| series.values.clone()).unwrap_or_default()
        };
        assert_eq!(smooth(2, 0.5), [1.0, 0.5]);
        let all = smooth(5, 0.5);
        assert!(all[2].is_nan());
        assert_eq!([all[0], all[1], all[3], all[4]], [1.0, 0.5, 0.25, 0.625]);
        assert_eq!(smooth(5, 0.0)[3..], [0.0, 1.0], "another weight begins anew");
        assert!(cache.smoothed("nothing", 0.5).is_none());
    }

    #[test]
    fn logarithms_break_where_there_are_none() {
        let series = series(0, [Some(1.0), Some(0.0), Some(100.0), None, Some(10.0)].into_iter());
        let ys = |log: bool| -> Vec<Vec<f64>> {
            series.pieces(None, Along::Even, log).iter().map(|piece| piece.iter().map(|p| p.y).collect()).collect()
        };
        assert_eq!(ys(true), [vec![0.0], vec![2.0], vec![1.0]]);
        assert_eq!(ys(false), [vec![1.0, 0.0, 100.0], vec![10.0]]);
    }
}
