//! From a map to pixels: which axis is up, what is left, decibels, colour limits.
//!
//! Conventions: range or depth upward, left as seen from the radar on the left, height upward only where no depth is.
//! Arrays are never flipped in memory; only the picture is.

use super::map_plane::Plane;
use crate::radar::{Axis, AxisKind, View};
use crate::render::Colormap;
use crate::session::{ColorRange, CubeAxes, CubeView, MapScale, ThirdAxis};
use egui::{Color32, ColorImage};

/// How a view's array becomes a grid of cells, cell (column, row), row 0 at the top; and that a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Orientation {
    /// The array axis drawn upward.
    pub(crate) vertical: usize,
    /// The array axis drawn across.
    pub(crate) horizontal: usize,
    /// A third axis, which is not drawn.
    pub(crate) collapsed: Option<usize>,
    /// How it is taken.
    pub(crate) third: ThirdAxis,
    /// Bin 0 of the vertical axis is at the top.
    pub(crate) vertical_from_top: bool,
    /// Bin 0 of the horizontal axis is at the left.
    pub(crate) horizontal_from_left: bool,
    /// The coordinates that the grid of cells is drawn in.
    pub(crate) plane: Plane,
}

/// The way through an array that goes along the rows of its picture.
struct Walk {
    size: [usize; 2],
    first: isize,
    across: isize,
    down: isize,
    /// Bins of the collapsed axis and how far apart they are; one where none is.
    third: (usize, usize),
}

impl Walk {
    /// The picture of `map`: its cells where no axis is collapsed, else what `collapse` makes of the first cell behind a pixel and of
    /// how many there are how far apart; `unknown` beyond the map.
    fn each<T: Copy>(&self, map: &[T], unknown: T, collapse: impl Fn(usize, (usize, usize)) -> T) -> Vec<T> {
        let [width, height] = self.size;
        let mut out = vec![unknown; width * height];
        // Plain loops: every fit that is shown goes through here, and adaptors are calls where little is optimised.
        for (row, pixels) in out.chunks_exact_mut(width.max(1)).enumerate() {
            let mut at = self.first + row as isize * self.down;
            for pixel in pixels {
                if self.third.0 != 1 {
                    *pixel = collapse(at as usize, self.third);
                } else if let Some(&value) = map.get(at as usize) {
                    *pixel = value;
                }
                at += self.across;
            }
        }
        out
    }
}

impl Orientation {
    /// The orientation of a view by the conventions above; `cube` says which axes of three are drawn.
    pub(crate) fn of(view: &View, cube: CubeView) -> Self {
        let axes = &view.axes;
        let depth = axes.iter().position(|axis| axis.kind.is_depth()).unwrap_or(0);
        let others: Vec<usize> = (0..axes.len()).filter(|&axis| axis != depth).collect();
        let (vertical, horizontal, collapsed) = match (others.as_slice(), cube.axes) {
            (&[first, second, ..], CubeAxes::First) => (depth, first, Some(second)),
            (&[first, second, ..], CubeAxes::Second) => (depth, second, Some(first)),
            (&[first, second, ..], CubeAxes::Others) => (second, first, Some(depth)),
            (&[only], _) => (depth, only, None),
            _ => (depth, depth, None),
        };
        let grows_left = |axis: &Axis| matches!(axis.kind, AxisKind::Azimuth | AxisKind::Cone | AxisKind::Y);
        let rising = |axis: usize| axes.get(axis).is_some_and(|axis| axis.step() > 0.0);
        let leftward = axes.get(horizontal).is_some_and(grows_left);
        let plane = match (axes.get(vertical), axes.get(horizontal)) {
            (Some(v), Some(h)) => Plane::other(v, h),
            _ => Plane::Cells,
        };
        let chosen =
            matches!((plane, cube.birds_eye, cube.polar), (Plane::BirdsEye, true, _) | (Plane::Polar, _, true));
        Self {
            vertical,
            horizontal,
            collapsed,
            third: cube.third,
            vertical_from_top: !rising(vertical),
            horizontal_from_left: rising(horizontal) != leftward,
            plane: if chosen { plane } else { Plane::Cells },
        }
    }

    /// Width and height of the grid in cells.
    pub(crate) fn size(&self, view: &View) -> [usize; 2] {
        [view.axes[self.horizontal].bins, view.axes[self.vertical].bins]
    }

    /// Picture coordinates, (0, 0) the upper left corner and (1, 1) the lower right, of bin coordinates.
    pub(crate) fn unit_from_bins(&self, view: &View, bins: &[f64]) -> [f64; 2] {
        self.to_shown(view, self.grid_from_bins(view, [bins[self.horizontal], bins[self.vertical]]))
    }

    /// (horizontal bin, vertical bin), fractional, of picture coordinates.
    pub(crate) fn bins_from_unit(&self, view: &View, unit: [f64; 2]) -> [f64; 2] {
        self.bins_from_grid(view, self.to_grid(view, unit))
    }

    /// The place in the grid, (0, 0) its upper left corner and (1, 1) its lower right, of (horizontal bin, vertical bin).
    pub(crate) fn grid_from_bins(&self, view: &View, [across, up]: [f64; 2]) -> [f64; 2] {
        let across = (across + 0.5) / view.axes[self.horizontal].bins as f64;
        let down = (up + 0.5) / view.axes[self.vertical].bins as f64;
        [
            if self.horizontal_from_left { across } else { 1.0 - across },
            if self.vertical_from_top { down } else { 1.0 - down },
        ]
    }

    /// (horizontal bin, vertical bin), fractional, of a place in the grid.
    pub(crate) fn bins_from_grid(&self, view: &View, grid: [f64; 2]) -> [f64; 2] {
        let across = if self.horizontal_from_left { grid[0] } else { 1.0 - grid[0] };
        let down = if self.vertical_from_top { grid[1] } else { 1.0 - grid[1] };
        [across * view.axes[self.horizontal].bins as f64 - 0.5, down * view.axes[self.vertical].bins as f64 - 0.5]
    }

    /// How far apart neighbours are in the array: across, down, and along the collapsed axis; and where the upper left pixel is.
    fn walk(&self, view: &View) -> Walk {
        let mut strides = vec![1; view.axes.len()];
        for axis in (1..view.axes.len()).rev() {
            strides[axis - 1] = strides[axis] * view.axes[axis].bins;
        }
        let step = |axis: usize, forward: bool| {
            let (stride, last) = (strides[axis] as isize, view.axes[axis].bins.saturating_sub(1) as isize);
            if forward { (stride, 0) } else { (-stride, last * stride) }
        };
        let (across, left) = step(self.horizontal, self.horizontal_from_left);
        let (down, top) = step(self.vertical, self.vertical_from_top);
        let (mut first, mut third) = (left + top, (1, 1));
        if let Some(axis) = self.collapsed {
            let (bins, stride) = (view.axes[axis].bins, strides[axis]);
            match self.third {
                ThirdAxis::Bin(bin) => first += (bin.min(bins.saturating_sub(1)) * stride) as isize,
                ThirdAxis::Largest | ThirdAxis::Mean => third = (bins, stride),
            }
        }
        Walk { size: self.size(view), first, across, down, third }
    }

    /// The picture of a map, row by row: the cell itself, or what the collapsed axis is taken for; means of what is finite.
    pub(crate) fn picture(&self, view: &View, map: &[f64]) -> Vec<f64> {
        let value = |at: usize| map.get(at).copied().unwrap_or(f64::NAN);
        self.walk(view).each(map, f64::NAN, |at, (bins, apart)| {
            if self.third == ThirdAxis::Mean {
                let finite = (0..bins).map(|bin| value(at + bin * apart)).filter(|x| x.is_finite());
                let (sum, count) = finite.fold((0.0, 0), |(sum, count), x| (sum + x, count + 1));
                if count > 0 { sum / f64::from(count) } else { f64::NAN }
            } else {
                (0..bins).map(|bin| value(at + bin * apart)).fold(f64::NAN, f64::max)
            }
        })
    }

    /// The picture of a mask: true where any cell over the collapsed axis is.
    pub(crate) fn mask_picture(&self, view: &View, mask: &[bool]) -> Vec<bool> {
        let is_in = |at: usize| mask.get(at) == Some(&true);
        self.walk(view).each(mask, false, |at, (bins, apart)| (0..bins).any(|bin| is_in(at + bin * apart)))
    }
}

/// The lowest level that is told apart, dB re max: far below it is what a simulated map is where no joint returns, and zeros
/// have no level at all. Limits that are set lower by hand take it with them.
pub(crate) const FLOOR_DB: f64 = -60.0;

/// Stored values as shown: relative to the largest finite value, in dB or linear.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Shown {
    /// What is shown, cell by cell of the picture.
    pub(crate) values: Vec<f64>,
    /// The stored value that is 0 dB or 1.
    pub(crate) reference: f64,
    /// What lies lower, zeros included, is shown as this; −∞ where everything is shown as it is.
    pub(crate) floor: f64,
}

/// The floor of shown values.
pub(crate) fn floor(scale: MapScale, range: ColorRange) -> f64 {
    match (scale, range) {
        (MapScale::Linear, _) => f64::NEG_INFINITY,
        (MapScale::Decibel, ColorRange::Fixed { lo, .. }) => lo.min(FLOOR_DB),
        (MapScale::Decibel, ColorRange::Percentile { .. }) => FLOOR_DB,
    }
}

/// A shown value as text: `≤` before what may lie anywhere below the floor.
pub(crate) fn level(value: f64, floor: f64) -> String {
    if value <= floor { format!("≤ {value:.2}") } else { format!("{value:.2}") }
}

/// Converts a picture of stored values.
pub(crate) fn shown(picture: &[f64], scale: MapScale, range: ColorRange, db_factor: f64) -> Shown {
    let floor = floor(scale, range);
    let reference = picture.iter().copied().filter(|x| x.is_finite()).fold(0.0, f64::max);
    let reference = if reference > 0.0 { reference } else { 1.0 };
    let values = picture
        .iter()
        .map(|&value| match scale {
            MapScale::Linear => value / reference,
            MapScale::Decibel if value.is_nan() => f64::NAN,
            MapScale::Decibel => (db_factor * (value.max(0.0) / reference).log10()).max(floor),
        })
        .collect();
    Shown { values, reference, floor }
}

/// The limits of the colour bar for shown values.
pub(crate) fn limits(values: &[f64], range: ColorRange) -> (f64, f64) {
    let (lo, hi) = match range {
        ColorRange::Fixed { lo, hi } => (lo, hi),
        ColorRange::Percentile { lo, hi } => {
            let mut sorted: Vec<f64> = values.iter().copied().filter(|x| x.is_finite()).collect();
            sorted.sort_by(f64::total_cmp);
            let at = |q: f64| {
                let last = sorted.len().saturating_sub(1) as f64;
                sorted.get((q / 100.0 * last).round() as usize).copied().unwrap_or(0.0)
            };
            (at(lo), at(hi))
        }
    };
    if hi > lo { (lo, hi) } else { (lo - 1.0, lo + 1.0) }
}

/// How often shown values occur, over the whole of a colour bar.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Histogram {
    /// Ends of the bar: all that occurs, and the limits.
    pub(crate) span: (f64, f64),
    /// Height of each bar, lowest value first: the logarithm of its count, the largest is 1.
    pub(crate) heights: Vec<f32>,
}

impl Histogram {
    const BARS: usize = 48;

    /// Of shown values, with limits lower < upper; what is no number is left out.
    pub(crate) fn of(values: &[f64], (lo, hi): (f64, f64)) -> Self {
        let finite = || values.iter().copied().filter(|x| x.is_finite());
        let span = finite().fold((lo, hi), |(lo, hi), x| (lo.min(x), hi.max(x)));
        let mut counts = [0u32; Self::BARS];
        let per_value = Self::BARS as f64 / (span.1 - span.0);
        for value in finite() {
            counts[(((value - span.0) * per_value) as usize).min(Self::BARS - 1)] += 1;
        }
        let height = |count: u32| f64::from(count).ln_1p();
        let most = height(counts.into_iter().max().unwrap_or_default()).max(1.0);
        Self { span, heights: counts.map(|count| (height(count) / most) as f32).to_vec() }
    }
}

/// Colours shown values between limits. Cells outside are hatched where `hatch`, cells without a number are `nan`.
pub(crate) fn colorize(
    size: [usize; 2],
    values: &[f64],
    (lo, hi): (f64, f64),
    map: Colormap,
    hatch: bool,
    nan: Color32,
) -> ColorImage {
    let lut = map.lut();
    let span = hi - lo;
    let mut image = ColorImage::filled(size, Color32::BLACK);
    for (i, (pixel, &value)) in image.pixels.iter_mut().zip(values).enumerate() {
        if value.is_nan() {
            *pixel = nan;
            continue;
        }
        let t = ((value - lo) / span).clamp(0.0, 1.0);
        let [r, g, b] = lut[(t * 255.0 + 0.5) as usize];
        *pixel = Color32::from_rgb(r, g, b);
        let outside = value < lo || value > hi;
        if hatch && outside && (i % size[0] + i / size[0]).is_multiple_of(4) {
            *pixel = if t > 0.5 { Color32::BLACK } else { Color32::from_gray(150) };
        }
    }
    image
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests")]
    use super::*;
    use crate::radar::{PointSpread, Quantity, Spacing};

    fn view(kinds: &[(AxisKind, usize, f64, f64)]) -> View {
        View {
            array: "map".into(),
            quantity: Quantity::Amplitude,
            psf: PointSpread::default(),
            pose: crate::geometry::Pose::default(),
            axes: kinds
                .iter()
                .map(|&(kind, bins, lo, hi)| Axis { kind, bins, lo, hi, spacing: Spacing::Linear })
                .collect(),
            region: None,
        }
    }

    /// Far is up and left is left, however the array lies.
    #[test]
    fn far_is_up_and_left_is_left() {
        for (range, azimuth) in [((0.0, 8.0), (-1.0, 1.0)), ((8.0, 0.0), (1.0, -1.0)), ((0.0, 8.0), (1.0, -1.0))] {
            let v = view(&[(AxisKind::Range, 4, range.0, range.1), (AxisKind::Azimuth, 6, azimuth.0, azimuth.1)]);
            let o = Orientation::of(&v, CubeView::default());
            let far = v.axes[0].bin(6.0);
            let left = v.axes[1].bin(0.6);
            let [x, y] = o.unit_from_bins(&v, &[far, left]);
            assert!(y < 0.5, "6 m of 8 m is in the upper half, got {y}");
            assert!(x < 0.5, "azimuth +0.6 rad is left, got {x}");
        }
    }

    #[test]
    fn height_grows_to_the_right_and_doppler_too() {
        let v = view(&[(AxisKind::DepthV, 256, 7.98, -0.01), (AxisKind::Z, 128, -1.98, 3.02)]);
        let o = Orientation::of(&v, CubeView::default());
        assert!(o.vertical_from_top && o.horizontal_from_left);
        let d = view(&[(AxisKind::Doppler, 8, -2.0, 2.0), (AxisKind::Range, 8, 0.0, 4.0)]);
        let o = Orientation::of(&d, CubeView::default());
        assert_eq!((o.vertical, o.horizontal), (1, 0));
        assert!(o.horizontal_from_left && !o.vertical_from_top);
    }

    #[test]
    fn bins_and_picture_coordinates_invert_each_other() {
        let v = view(&[
            (AxisKind::Range, 40, 4.0, 1.3),
            (AxisKind::Azimuth, 32, 0.9, -1.0),
            (AxisKind::Elevation, 8, -1.0, 1.0),
        ]);
        let o = Orientation::of(&v, CubeView::default());
        let unit = o.unit_from_bins(&v, &[12.25, 7.5, 3.0]);
        let [h, w] = [o.bins_from_unit(&v, unit)[1], o.bins_from_unit(&v, unit)[0]];
        assert!((h - 12.25).abs() < 1e-12 && (w - 7.5).abs() < 1e-12);
    }

    #[test]
    fn a_cube_is_drawn_as_its_largest_over_the_third_axis() {
        let v = view(&[
            (AxisKind::Range, 2, 1.0, 0.0),
            (AxisKind::Azimuth, 2, 1.0, -1.0),
            (AxisKind::Elevation, 3, -1.0, 1.0),
        ]);
        let o = Orientation::of(&v, CubeView::default());
        let map: Vec<f64> = (0..12).map(f64::from).collect();
        assert_eq!(o.picture(&v, &map), vec![2.0, 5.0, 8.0, 11.0]);
        // Range falls with its bins and azimuth too; element (r, a, e) is 6 r + 3 a + e.
        let of = |axes, third| Orientation::of(&v, CubeView { axes, third, ..CubeView::default() }).picture(&v, &map);
        assert_eq!(of(CubeAxes::First, ThirdAxis::Mean), vec![1.0, 4.0, 7.0, 10.0]);
        assert_eq!(of(CubeAxes::First, ThirdAxis::Bin(1)), vec![1.0, 4.0, 7.0, 10.0]);
        assert_eq!(of(CubeAxes::First, ThirdAxis::Bin(99)), vec![2.0, 5.0, 8.0, 11.0], "no further than the last");
        assert_eq!(of(CubeAxes::Second, ThirdAxis::Largest), vec![3.0, 4.0, 5.0, 9.0, 10.0, 11.0]);
        assert_eq!(of(CubeAxes::Others, ThirdAxis::Largest), vec![8.0, 11.0, 7.0, 10.0, 6.0, 9.0]);
    }

    #[test]
    fn decibels_follow_the_quantity() {
        let amplitude = shown(&[1.0, 10.0], MapScale::Decibel, ColorRange::default(), 20.0);
        assert_eq!(amplitude.values, vec![-20.0, 0.0]);
        let power = shown(&[1.0, 10.0, f64::NAN], MapScale::Decibel, ColorRange::default(), 10.0);
        assert_eq!(power.values[..2], [-10.0, 0.0]);
        assert!(power.values.last().unwrap().is_nan());
    }

    /// A tenth of the cells without any echo, and one far below the floor, leave the colours to the others.
    #[test]
    fn zeros_are_the_floor_and_do_not_stretch_the_limits() {
        let mut stored: Vec<f64> = (1..=180).map(|k| 0.05 * f64::from(k)).collect();
        stored.extend([0.0; 20]);
        stored.push(1e-30);
        let of = |range| shown(&stored, MapScale::Decibel, range, 20.0);
        let Shown { values, floor, .. } = of(ColorRange::default());
        assert_eq!((floor, values[180], *values.last().unwrap()), (-60.0, -60.0, -60.0));
        assert_eq!(limits(&values, ColorRange::default()).0, -60.0);
        assert_eq!((level(values[180], floor), level(values[179], floor)), ("≤ -60.00".into(), "0.00".into()));
        let lower = of(ColorRange::Fixed { lo: -90.0, hi: 0.0 });
        assert_eq!((lower.floor, lower.values[180]), (-90.0, -90.0));
        let linear = shown(&stored, MapScale::Linear, ColorRange::default(), 20.0);
        assert_eq!((linear.values[180], level(0.0, linear.floor)), (0.0, "0.00".into()));
    }

    /// The bar reaches over all that occurs and over the limits; what occurs most often is highest.
    #[test]
    fn a_histogram_reaches_over_values_and_limits() {
        let values = [-60.0, -60.0, -60.0, -31.0, -2.0, f64::NAN, f64::NEG_INFINITY];
        let Histogram { span, heights } = Histogram::of(&values, (-40.0, 10.0));
        assert_eq!(span, (-60.0, 10.0));
        let highest = (0..heights.len()).max_by(|&a, &b| heights[a].total_cmp(&heights[b]));
        assert_eq!((highest, heights[0], heights.iter().filter(|height| **height > 0.0).count()), (Some(0), 1.0, 3));
        assert!((heights[19] - 2f32.ln() / 4f32.ln()).abs() < 1e-6, "-31 is 29/70 of the way up: {heights:?}");
    }

    #[test]
    fn a_constant_map_still_has_limits() {
        let (lo, hi) = limits(&[3.0; 9], ColorRange::default());
        assert!(lo < hi);
    }
}
