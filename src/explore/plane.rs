//! Samples along one axis or over two, and where they are lowest.

use super::coarse;
use serde::Serialize;

/// A minimum counts from this share of the whole span of values on: its value is lower by so much than the pass to a lower one.
const LEAST_DEPTH: f64 = 0.01;
/// So many minima are listed.
const MOST: usize = 8;

/// An axis of samples: the first is at `from`, the last at `to`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SampleAxis {
    /// What it is, in words.
    pub name: String,
    /// Unit, or "".
    pub unit: &'static str,
    /// The first sample.
    pub from: f64,
    /// The last sample.
    pub to: f64,
    /// How many.
    pub cells: usize,
    /// Whether behind the last comes the first.
    pub closed: bool,
}

impl SampleAxis {
    /// The value of a sample, or between two of them.
    pub fn at(&self, k: f64) -> f64 {
        self.from + (self.to - self.from) * k / (self.cells.max(2) - 1) as f64
    }

    /// The sample, or the place between two of them, at a value; the other way round of [`Self::at`].
    pub fn place(&self, value: f64) -> f64 {
        (value - self.from) / (self.to - self.from) * (self.cells.max(2) - 1) as f64
    }

    /// Name and unit.
    pub fn title(&self) -> String {
        if self.unit.is_empty() { self.name.clone() } else { format!("{}, {}", self.name, self.unit) }
    }
}

/// A place where values are lower than all around.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Minimum {
    /// Its sample along each axis (0 along a second axis that there is not).
    pub cell: [usize; 2],
    /// The value.
    pub value: f64,
    /// How much higher one has to go from it to get to a lower one; for the lowest, to the highest value.
    pub depth: f64,
}

/// The minima of samples (the first axis fastest), the lowest first. Each is as deep as the pass to a lower one is high: what
/// is no deeper than a hundredth of the span is a ripple.
pub fn minima(values: &[Option<f64>], [across, up]: [usize; 2], closed: [bool; 2]) -> Vec<Minimum> {
    let known = || values.iter().flatten().copied().filter(|x| x.is_finite());
    let (lo, hi) = (known().fold(f64::INFINITY, f64::min), known().fold(f64::NEG_INFINITY, f64::max));
    let mut order: Vec<usize> = (0..values.len()).filter(|&k| values[k].is_some_and(f64::is_finite)).collect();
    let value = |k: usize| values[k].unwrap_or(f64::INFINITY);
    order.sort_by(|&a, &b| value(a).total_cmp(&value(b)).then(a.cmp(&b)));
    // Water rises: basins meet at passes, and the shallower one ends there.
    let mut basin: Vec<Option<usize>> = vec![None; values.len()];
    let mut depth = std::collections::BTreeMap::new();
    for &k in &order {
        let reached: Vec<usize> = neighbours(k, [across, up], closed).filter(|&n| basin[n].is_some()).collect();
        let mut around: Vec<usize> = reached.into_iter().map(|n| root(&mut basin, n)).collect();
        around.sort_by(|&a, &b| value(a).total_cmp(&value(b)).then(a.cmp(&b)));
        around.dedup();
        match around.split_first() {
            None => basin[k] = Some(k),
            Some((&lowest, others)) => {
                basin[k] = Some(lowest);
                for &other in others {
                    depth.insert(other, value(k) - value(other));
                    basin[other] = Some(lowest);
                }
            }
        }
    }
    let roots = (0..values.len()).filter(|&k| basin[k] == Some(k)).map(|k| (k, hi - value(k)));
    let found = depth.into_iter().chain(roots).filter(|(_, depth)| *depth > LEAST_DEPTH * (hi - lo));
    let width = across.max(1);
    let mut minima: Vec<Minimum> =
        found.map(|(k, depth)| Minimum { cell: [k % width, k / width], value: value(k), depth }).collect();
    minima.sort_by(|a, b| a.value.total_cmp(&b.value).then(a.cell.cmp(&b.cell)));
    minima.truncate(MOST);
    minima
}

/// The lowest sample of the basin that `k` is in.
fn root(basin: &mut [Option<usize>], k: usize) -> usize {
    let mut at = k;
    while let Some(next) = basin[at].filter(|&next| next != at) {
        at = next;
    }
    basin[k] = Some(at);
    at
}

fn neighbours(k: usize, [across, up]: [usize; 2], closed: [bool; 2]) -> impl Iterator<Item = usize> {
    let (i, j) = ((k % across.max(1)) as i64, (k / across.max(1)) as i64);
    let inside = move |x: i64, n: usize, closed: bool| {
        let n = n as i64;
        if closed { Some(x.rem_euclid(n)) } else { Some(x).filter(|x| (0..n).contains(x)) }
    };
    let steps = (-1..=1).flat_map(|dj| (-1..=1).map(move |di| (di, dj))).filter(|step| *step != (0, 0));
    steps.filter_map(move |(di, dj)| {
        let (i, j) = (inside(i + di, across, closed[0])?, inside(j + dj, up, closed[1])?);
        Some((j * across as i64 + i) as usize)
    })
}

/// A row of samples of one level: (stride, row, the columns).
pub(super) type Row = (usize, usize, Vec<usize>);

/// The samples of a plane in rows, coarse to fine; long rows in parts, so that each is a short piece of work.
pub(super) fn rows([across, up]: [usize; 2], longest: usize) -> Vec<Row> {
    let mut rows: Vec<Row> = Vec::new();
    // C order has the last axis fastest, which here is the first.
    for (stride, points) in coarse::levels(&[up, across]) {
        for row in points.chunk_by(|a, b| a / across == b / across) {
            let at = row.first().map_or(0, |k| k / across);
            rows.extend(row.chunks(longest.max(1)).map(|part| (stride, at, part.iter().map(|k| k % across).collect())));
        }
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sampled(n: usize, of: impl Fn(f64, f64) -> f64) -> Vec<Option<f64>> {
        let at = |k: usize| k as f64 / (n - 1) as f64;
        (0..n * n).map(|k| Some(of(at(k % n), at(k / n)))).collect()
    }

    #[test]
    fn two_valleys_are_two_minima_the_lower_first() {
        let valley = |x: f64, y: f64, a: f64, b: f64| (-((x - a).powi(2) + (y - b).powi(2)) / 0.02).exp();
        let values = sampled(41, |x, y| 1.0 - valley(x, y, 0.25, 0.5) - 0.6 * valley(x, y, 0.75, 0.25));
        let found = minima(&values, [41, 41], [false; 2]);
        assert_eq!(found.iter().map(|m| m.cell).collect::<Vec<_>>(), [[10, 20], [30, 10]]);
        assert!((found[1].depth - 0.6).abs() < 0.05, "{found:?}");
    }

    #[test]
    fn ripples_and_plateaus_are_no_minima_of_their_own() {
        let values = sampled(64, |x, y| (x - 0.5).powi(2) + (y - 0.5).powi(2) + 1e-4 * (200.0 * x).sin());
        assert_eq!(minima(&values, [64, 64], [false; 2]).len(), 1);
        let flat = vec![Some(0.3); 12];
        assert!(minima(&flat, [12, 1], [false; 2]).is_empty());
        assert!(minima(&[None, None], [2, 1], [false; 2]).is_empty());
    }

    #[test]
    fn a_closed_axis_has_no_ends() {
        let values: Vec<Option<f64>> = (0..36).map(|k| Some((f64::from(k) * 10.0).to_radians().cos())).collect();
        assert_eq!(minima(&values, [36, 1], [true, false]).iter().map(|m| m.cell[0]).collect::<Vec<_>>(), [18]);
        let turned: Vec<Option<f64>> = values.iter().map(|x| x.map(|x| -x)).collect();
        assert_eq!(minima(&turned, [36, 1], [true, false]).len(), 1, "0 and 350 degrees are neighbours");
        assert_eq!(minima(&turned, [36, 1], [false; 2]).len(), 2);
    }

    #[test]
    fn rows_hold_every_sample_once() {
        let mut all: Vec<usize> = rows([10, 7], 4)
            .into_iter()
            .flat_map(|(_, j, columns)| columns.into_iter().map(move |i| j * 10 + i))
            .collect();
        all.sort_unstable();
        assert_eq!(all, (0..70).collect::<Vec<_>>());
    }
}
