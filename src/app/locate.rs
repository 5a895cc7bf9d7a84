//! From the cells of a map to places: what two axes of a map leave open, and where in the room a cell may lie.

use crate::app::map_image::Orientation;
use crate::geometry::{Vec3, add, cross, dot, norm, scale};
use crate::radar::{Axis, AxisKind, Spacing, View};

/// Newton steps, and what is as good as no error: m or rad.
const STEPS: usize = 40;
const EXACT: f64 = 1e-9;
/// Difference over which a coordinate's slope is taken, m.
const SLOPE_M: f64 = 1e-6;
/// Pieces of a curve in the room.
const PIECES: usize = 48;

/// The coordinate that stays where a point moves on a map of these two axes; `None` where an axis says nothing of places.
pub(super) fn third(view: &View, o: Orientation) -> Option<AxisKind> {
    use AxisKind::{Azimuth, Cone, DepthH, DepthV, Doppler, Elevation, Range, X, Y, Z};
    let kind = |axis: usize| view.axes.get(axis).map(|axis| axis.kind);
    let pair = [kind(o.vertical)?, kind(o.horizontal)?];
    if pair.contains(&Doppler) || pair[0] == pair[1] {
        return None;
    }
    if let Some(kind) = o.collapsed.and_then(kind).filter(|kind| *kind != Doppler) {
        return Some(kind);
    }
    let has = |kinds: &[AxisKind]| pair.iter().any(|kind| kinds.contains(kind));
    Some(match () {
        () if has(&[Range]) && has(&[Azimuth, Cone]) => Elevation,
        () if has(&[Range]) && has(&[Elevation]) => Azimuth,
        () if has(&[Azimuth, Cone]) && has(&[Elevation]) => Range,
        () if has(&[Y]) && has(&[Z]) => X,
        () if has(&[Z]) && has(&[X, Range, DepthH, DepthV]) => Y,
        () => Z,
    })
}

/// A coordinate of a point in the view frame: m or rad.
fn coordinate(kind: AxisKind, p: Vec3) -> f64 {
    Axis { kind, bins: 1, lo: 0.0, hi: 1.0, spacing: Spacing::Linear }.coordinate(p)
}

/// The point of the view frame with these coordinates, m, found from one near by; `None` where there is none.
fn point_at(wanted: [(AxisKind, f64); 3], near: Vec3) -> Option<Vec3> {
    let mut p = near;
    for _ in 0..STEPS {
        let error: Vec3 = wanted.map(|(kind, value)| value - coordinate(kind, p));
        if error.iter().all(|e| e.abs() < EXACT) {
            return Some(p);
        }
        let rows = wanted.map(|(kind, _)| {
            let slope = |axis: usize| {
                let at = |by: f64| coordinate(kind, add(p, std::array::from_fn(|k| if k == axis { by } else { 0.0 })));
                (at(SLOPE_M) - at(-SLOPE_M)) / (2.0 * SLOPE_M)
            };
            [slope(0), slope(1), slope(2)]
        });
        let [a, b, c] = rows;
        let across = [cross(b, c), cross(c, a), cross(a, b)];
        let volume = dot(a, across[0]);
        if !(volume.is_finite() && volume.abs() > 1e-9) {
            return None;
        }
        let step = across.iter().zip(error).fold([0.0; 3], |sum, (v, e)| add(sum, scale(*v, e / volume)));
        // A step as long as the room says that the slope is not that of the whole way.
        let length = norm(step);
        p = add(p, scale(step, (1.0 / length.max(1e-12)).min(1.0)));
    }
    None
}

/// Where a point goes that is moved on a map to picture coordinates `unit`, world frame, m; what the map does not show stays.
pub(super) fn moved_on(view: &View, o: Orientation, from: Vec3, unit: [f64; 2]) -> Option<Vec3> {
    let third = third(view, o)?;
    let p = view.seen_at(from);
    let at = point_at(of_bins(view, o, o.bins_from_unit(view, unit), third, coordinate(third, p)), p)?;
    at.iter().all(|x| x.is_finite()).then(|| view.place_of(at))
}

/// The coordinates at a horizontal and a vertical bin, and a third one.
fn of_bins(view: &View, o: Orientation, [across, up]: [f64; 2], third: AxisKind, value: f64) -> [(AxisKind, f64); 3] {
    let at = |axis: usize, bin: f64| (view.axes[axis].kind, view.axes[axis].value_at(bin));
    [at(o.horizontal, across), at(o.vertical, up), (third, value)]
}

/// The places that a cell of a map sees, one after the other, world frame, m: along the coordinate that it leaves open, as
/// far as another view has that coordinate. Of a cell with a Doppler axis, level with the radar.
pub(super) fn seen_by(views: &[View], view: &View, o: Orientation, pixel: [usize; 2]) -> Vec<Vec3> {
    let cell = o.bins_of_pixel(view, pixel);
    let (wanted, open) = if let Some(open) = third(view, o) {
        let [a, b, _] = of_bins(view, o, cell, open, 0.0);
        ([a, b], open)
    } else {
        let [a, b, _] = of_bins(view, o, cell, AxisKind::Azimuth, 0.0);
        let known = if a.0 == AxisKind::Doppler { b } else { a };
        let open = match known.0 {
            AxisKind::Doppler | AxisKind::Elevation => return Vec::new(),
            AxisKind::Azimuth | AxisKind::Cone => AxisKind::Range,
            _ => AxisKind::Azimuth,
        };
        ([known, (AxisKind::Elevation, 0.0)], open)
    };
    let [lo, hi] = extent(views, open);
    let mut near = [3.0, 0.1, 0.1];
    let at = |k: usize| lo + (hi - lo) * k as f64 / PIECES as f64;
    let points = (0..=PIECES).filter_map(|k| {
        near = point_at([wanted[0], wanted[1], (open, at(k))], near)?;
        // Behind the radar nothing is seen.
        (near[0] >= -EXACT).then(|| view.place_of(near))
    });
    points.collect()
}

/// How far a coordinate reaches: as far as the axis of a view has it, else as a room has; m or rad.
fn extent(views: &[View], kind: AxisKind) -> [f64; 2] {
    let known = views.iter().flat_map(|view| &view.axes).find(|axis| axis.kind == kind);
    if let Some(axis) = known {
        let ends = [axis.value_at(0.0), axis.value_at(axis.bins as f64 - 1.0)];
        return [ends[0].min(ends[1]), ends[0].max(ends[1])];
    }
    match kind {
        AxisKind::Azimuth | AxisKind::Cone => [-1.0, 1.0],
        AxisKind::Elevation => [-0.5, 0.5],
        AxisKind::Y => [-3.0, 3.0],
        AxisKind::Z => [-1.5, 1.5],
        _ => [0.3, 8.0],
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests fail by panicking")]
    use super::*;
    use crate::geometry::{Pose, sub};
    use crate::radar::{PointSpread, Quantity};
    use crate::session::CubeView;

    fn view(kinds: &[(AxisKind, f64, f64)]) -> View {
        let axes = kinds.iter().map(|&(kind, lo, hi)| Axis { kind, bins: 40, lo, hi, spacing: Spacing::Linear });
        let pose = Pose { translation: [0.1, -0.2, 0.3], ..Pose::default() };
        let (array, quantity) = ("m".into(), Quantity::Amplitude);
        View { array, quantity, psf: PointSpread::default(), pose, axes: axes.collect(), region: None }
    }

    /// The length of a curve, m.
    fn length(points: &[Vec3]) -> f64 {
        points.windows(2).map(|pair| norm(sub(pair[1], pair[0]))).sum()
    }

    /// On every kind of map a moved point is where it was put, and the coordinate that the map does not show stays.
    #[test]
    fn a_point_moved_on_a_map_is_there_and_keeps_what_is_not_shown() {
        use AxisKind::{Azimuth, Cone, DepthH, DepthV, Elevation, Range, X, Y, Z};
        let cases = [
            ([(DepthH, 6.0, 0.0), (Y, 2.0, -2.0)], Z),
            ([(DepthV, 6.0, 0.0), (Z, -2.0, 2.0)], Y),
            ([(X, 0.0, 6.0), (Y, -2.0, 2.0)], Z),
            ([(Range, 0.0, 6.0), (Azimuth, -1.0, 1.0)], Elevation),
            ([(Range, 0.0, 6.0), (Cone, -1.0, 1.0)], Elevation),
            ([(Range, 0.0, 6.0), (Elevation, -0.7, 0.7)], Azimuth),
            ([(Azimuth, -1.0, 1.0), (Elevation, -0.7, 0.7)], Range),
        ];
        let from = [2.9, 0.4, 0.5];
        for (axes, kept) in cases {
            let view = view(&axes);
            let o = Orientation::of(&view, CubeView::default());
            assert_eq!(third(&view, o), Some(kept));
            let unit = o.unit_from_bins(&view, &view.bins_of(from));
            assert!(norm(sub(moved_on(&view, o, from, unit).unwrap(), from)) < 1e-6, "{axes:?}");
            let there = [unit[0] + 0.04, unit[1] - 0.06];
            let to = moved_on(&view, o, from, there).unwrap();
            let is = o.unit_from_bins(&view, &view.bins_of(to));
            assert!((0..2).all(|k| (is[k] - there[k]).abs() < 1e-6), "{axes:?}: {is:?} {there:?}");
            let of = |p| coordinate(kept, view.pose.view_from_world(p));
            assert!((of(to) - of(from)).abs() < 1e-6 && norm(sub(to, from)) > 0.05, "{axes:?}");
        }
        let doppler = view(&[(Range, 0.0, 6.0), (AxisKind::Doppler, -4.0, 4.0)]);
        assert_eq!(moved_on(&doppler, Orientation::of(&doppler, CubeView::default()), from, [0.5, 0.5]), None);
    }

    #[test]
    fn a_cell_sees_a_line_an_arc_or_a_ring() {
        use AxisKind::{Azimuth, DepthH, Doppler, Range, Y, Z};
        let ground = view(&[(AxisKind::X, 0.0, 6.0), (Y, -2.0, 2.0)]);
        let side = view(&[(AxisKind::X, 0.0, 6.0), (Z, -1.0, 1.0)]);
        let views = [ground, side];
        let seen = |view: &View| {
            let o = Orientation::of(view, CubeView::default());
            seen_by(&views, view, o, [20, 20])
        };
        // Upright, as high as the other view reaches.
        let line = seen(&views[0]);
        assert!(line.iter().all(|p| (p[0] - line[0][0]).abs() + (p[1] - line[0][1]).abs() < 1e-6));
        assert!((length(&line) - 1.95).abs() < 1e-6, "{}", length(&line));
        // Every point of it is in the cell.
        for view in [view(&[(DepthH, 6.0, 0.0), (Y, 2.0, -2.0)]), view(&[(Range, 0.0, 6.0), (Azimuth, -1.0, 1.0)])] {
            let points = seen(&view);
            assert!(points.len() > PIECES / 2, "{}", points.len());
            let cells: Vec<Vec<f64>> = points.iter().map(|p| view.bins_of(*p)).collect();
            assert!(cells.iter().all(|bins| (0..2).all(|k| (bins[k] - cells[0][k]).abs() < 1e-6)));
        }
        // Of range and Doppler only the range: a level arc.
        let moving = view(&[(Range, 0.0, 6.0), (Doppler, -4.0, 4.0)]);
        let arc = seen(&moving);
        let radius = |p: &Vec3| norm(moving.pose.view_from_world(*p));
        assert!(arc.len() > PIECES / 2 && arc.iter().all(|p| (radius(p) - radius(&arc[0])).abs() < 1e-6));
    }
}
