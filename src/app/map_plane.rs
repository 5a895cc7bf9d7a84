//! In which coordinates a map is drawn: a rectangle a cell, or range × angle on metres (bird's-eye), or metres on range × angle.
//!
//! Everything that is drawn on a map or read from it goes through [`Orientation::to_shown`] and [`Orientation::to_grid`]:
//! from the grid of cells, (0, 0) its upper left corner and (1, 1) its lower right, to the picture and back. The picture is
//! no second one: the cells' texture is laid over a mesh whose corners are exact, so that each cell keeps its value.

use super::map_image::Orientation;
use crate::radar::{Axis, AxisKind, Spacing, View};
use egui::{Color32, Mesh, Pos2, Rect, TextureId, epaint::Vertex, pos2};
use std::f64::consts::FRAC_PI_2;

/// Coordinates of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Plane {
    /// Each cell is a rectangle.
    #[default]
    Cells,
    /// A map of range and angle on metres: depth upward, to the side across.
    BirdsEye,
    /// A map in metres on range and angle.
    Polar,
}

/// Arcs are drawn in pieces of this angle, radians.
const ARC: f64 = 0.0087;
/// Pieces of a ray.
const RAY: usize = 24;

impl Plane {
    /// The other coordinates that a map with these axes can be drawn in.
    pub(crate) fn other(vertical: &Axis, horizontal: &Axis) -> Self {
        match (vertical.kind, horizontal.kind) {
            (AxisKind::Range | AxisKind::DepthV, AxisKind::Azimuth | AxisKind::Cone)
            | (AxisKind::Range, AxisKind::Elevation) => Self::BirdsEye,
            (AxisKind::X | AxisKind::DepthH | AxisKind::DepthV, AxisKind::Y | AxisKind::Z) => Self::Polar,
            _ => Self::Cells,
        }
    }
}

/// The least and the greatest.
fn ends(values: impl IntoIterator<Item = f64>) -> [f64; 2] {
    values.into_iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], x| [lo.min(x), hi.max(x)])
}

/// Bin coordinate of a physical value; beyond every bin where no sine is.
fn bin_of(axis: &Axis, value: f64) -> f64 {
    match axis.spacing {
        Spacing::Linear => axis.bin(value),
        Spacing::Sine if value.abs() <= FRAC_PI_2 => axis.bin(value.sin()),
        Spacing::Sine => f64::INFINITY,
    }
}

impl Orientation {
    fn axes<'a>(&self, view: &'a View) -> [&'a Axis; 2] {
        [&view.axes[self.horizontal], &view.axes[self.vertical]]
    }

    /// Least and greatest physical value of the cells across and up, edges of cells; no further than straight ahead and never
    /// behind the radar.
    fn covered(&self, view: &View) -> [[f64; 2]; 2] {
        let of = |axis: &Axis| ends([-0.5, axis.bins as f64 - 0.5].map(|bin| axis.value_at(bin)));
        let [across, [near, far]] = self.axes(view).map(of);
        let near = if self.plane == Plane::Cells { near } else { near.max(0.0) };
        [across, [near, far.max(near + 1e-6)]]
    }

    /// What is at the ends of the picture: values at its left and right edge, and at its upper and lower one.
    fn ends(&self, view: &View) -> [[f64; 2]; 2] {
        let [[a0, a1], [near, far]] = self.covered(view);
        let ([x0, x1], [y0, y1]) = match self.plane {
            Plane::Cells => ([a0, a1], [near, far]),
            Plane::BirdsEye => {
                let inside = [0.0, -FRAC_PI_2, FRAC_PI_2].into_iter().filter(|a| (a0..=a1).contains(a));
                let angles: Vec<f64> = inside.chain([a0, a1]).collect();
                let corner = |of: fn(f64) -> f64| ends(angles.iter().flat_map(|&a| [near * of(a), far * of(a)]));
                (corner(f64::sin), corner(f64::cos))
            }
            Plane::Polar => {
                let corners = [(near, a0), (near, a1), (far, a0), (far, a1)];
                let nearest = near.hypot(0f64.clamp(a0, a1));
                (ends(corners.map(|(x, y)| y.atan2(x))), [nearest, ends(corners.map(|(x, y)| x.hypot(y)))[1]])
            }
        };
        let leftward = matches!(view.axes[self.horizontal].kind, AxisKind::Azimuth | AxisKind::Cone | AxisKind::Y);
        [if leftward { [x1, x0] } else { [x0, x1] }, [y1, y0]]
    }

    /// Where a point of the grid of cells is in the picture.
    pub(crate) fn to_shown(self, view: &View, grid: [f64; 2]) -> [f64; 2] {
        if self.plane == Plane::Cells {
            return grid;
        }
        let [across, up] = self.values_at(view, grid);
        let at = match self.plane {
            Plane::BirdsEye => [up * across.sin(), up * across.cos()],
            _ => [across.atan2(up), across.hypot(up)],
        };
        let ends = self.ends(view);
        std::array::from_fn(|k| (at[k] - ends[k][0]) / (ends[k][1] - ends[k][0]))
    }

    /// Which point of the grid of cells is at a point of the picture; outside 0..1 where no cell is.
    pub(crate) fn to_grid(self, view: &View, shown: [f64; 2]) -> [f64; 2] {
        if self.plane == Plane::Cells {
            return shown;
        }
        let ends = self.ends(view);
        let [x, y]: [f64; 2] = std::array::from_fn(|k| ends[k][0] + shown[k] * (ends[k][1] - ends[k][0]));
        let [across, up] = match self.plane {
            Plane::BirdsEye => [x.atan2(y), x.hypot(y)],
            _ => [y * x.sin(), y * x.cos()],
        };
        let [h, v] = self.axes(view);
        self.grid_from_bins(view, [bin_of(h, across), bin_of(v, up)])
    }

    /// Physical values across and up at a point of the grid of cells: metres, radians.
    pub(crate) fn values_at(&self, view: &View, grid: [f64; 2]) -> [f64; 2] {
        let [across, up] = self.bins_from_grid(view, grid);
        let [h, v] = self.axes(view);
        [h.value_at(across), v.value_at(up)]
    }

    /// The cell at a point of the picture, column and row of the grid.
    pub(crate) fn pixel_at(&self, view: &View, shown: [f64; 2]) -> Option<[usize; 2]> {
        let (grid, size) = (self.to_grid(view, shown), self.size(view));
        let at: [f64; 2] = std::array::from_fn(|k| (grid[k] * size[k] as f64).floor());
        let inside = (0..2).all(|k| at[k] >= 0.0 && at[k] < size[k] as f64);
        inside.then(|| at.map(|x| x as usize))
    }

    /// Horizontal and vertical bin of a cell, column and row of the grid.
    pub(crate) fn bins_of_pixel(&self, view: &View, pixel: [usize; 2]) -> [f64; 2] {
        let size = self.size(view);
        self.bins_from_grid(view, std::array::from_fn(|k| (pixel[k] as f64 + 0.5) / size[k] as f64))
    }

    /// A straight line of the grid as it is in the picture.
    pub(crate) fn line(&self, view: &View, from: [f64; 2], to: [f64; 2]) -> Vec<[f64; 2]> {
        let far = (from[0] - to[0]).abs().max((from[1] - to[1]).abs());
        let pieces = if self.plane == Plane::Cells { 1 } else { (far * 64.0).ceil().clamp(2.0, 64.0) as usize };
        let at = |i: usize| {
            let t = i as f64 / pieces as f64;
            self.to_shown(view, std::array::from_fn(|k| from[k] + t * (to[k] - from[k])))
        };
        (0..=pieces).map(at).collect()
    }

    /// The closed outline of a box of the grid as it is in the picture, from its upper left corner.
    pub(crate) fn outline(&self, view: &View, [min, max]: [[f32; 2]; 2]) -> Vec<[f64; 2]> {
        let ([x0, y0], [x1, y1]) = (min.map(f64::from), max.map(f64::from));
        let corners = [[x0, y0], [x1, y0], [x1, y1], [x0, y1], [x0, y0]];
        corners.windows(2).flat_map(|side| self.line(view, side[0], side[1])).collect()
    }

    /// The box of the picture round a box of the grid, as far as it is in the picture.
    pub(crate) fn shown_box(&self, view: &View, grid: [[f32; 2]; 2]) -> [[f32; 2]; 2] {
        let outline = self.outline(view, grid);
        let of = |k: usize| ends(outline.iter().map(|p| p[k].clamp(0.0, 1.0)));
        let (x, y) = (of(0), of(1));
        [[x[0] as f32, y[0] as f32], [x[1] as f32, y[1] as f32]]
    }

    /// The axes of the picture, across and up, with whether their bin 0 is at the left or at the top.
    pub(crate) fn shown_axes(&self, view: &View) -> [(Axis, bool); 2] {
        let [h, v] = self.axes(view);
        if self.plane == Plane::Cells {
            return [(h.clone(), self.horizontal_from_left), (v.clone(), self.vertical_from_top)];
        }
        let kinds = match (self.plane, h.kind) {
            (Plane::BirdsEye, AxisKind::Elevation) => [AxisKind::Z, AxisKind::DepthV],
            (Plane::BirdsEye, AxisKind::Cone) => [AxisKind::Y, AxisKind::DepthH],
            (Plane::BirdsEye, _) => [AxisKind::Y, AxisKind::X],
            (_, AxisKind::Z) => [AxisKind::Elevation, AxisKind::Range],
            _ => [AxisKind::Azimuth, AxisKind::Range],
        };
        let ends = self.ends(view);
        std::array::from_fn(|k| {
            // One bin from edge to edge.
            let (middle, step) = (0.5 * (ends[k][0] + ends[k][1]), ends[k][1] - ends[k][0]);
            (Axis { kind: kinds[k], bins: 1, lo: middle, hi: middle + step, spacing: Spacing::Linear }, true)
        })
    }

    /// Width over height of the picture in metres; `None` where an axis is not in metres.
    pub(crate) fn metric_aspect(&self, view: &View) -> Option<f32> {
        let metric = |axis: &Axis| !axis.kind.is_angular() && axis.kind != AxisKind::Doppler;
        let [(h, _), (v, _)] = self.shown_axes(view);
        (metric(&h) && metric(&v)).then(|| ((h.hi - h.lo).abs() / (v.hi - v.lo).abs()) as f32)
    }

    /// The cells as a mesh over the picture; `texture` has a texel for each of them.
    pub(crate) fn mesh(
        &self,
        view: &View,
        texture: TextureId,
        seen: Rect,
        to_screen: &dyn Fn([f64; 2]) -> Pos2,
    ) -> Mesh {
        let mut mesh = Mesh::with_texture(texture);
        match self.plane {
            Plane::Cells => {
                let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
                quad(&mut mesh, seen, to_screen, corners.map(|p| (p, p)));
            }
            Plane::BirdsEye => self.fan(&mut mesh, view, seen, to_screen),
            Plane::Polar => self.unrolled(&mut mesh, view, seen, to_screen),
        }
        mesh
    }

    /// A trapezoid for each angular bin: along it the range is linear, across it nothing changes.
    fn fan(&self, mesh: &mut Mesh, view: &View, seen: Rect, to_screen: &dyn Fn([f64; 2]) -> Pos2) {
        let [columns, _] = self.size(view);
        let [[a0, a1], [near, _]] = self.covered(view);
        let pieces = ((a1 - a0) / columns as f64 / (2.0 * ARC)).ceil().max(1.0) as usize;
        // Half a bin may lie behind a radar whose first range is 0.
        let [h, v] = self.axes(view);
        let bottom = self.grid_from_bins(view, [bin_of(h, 0.0), bin_of(v, near)])[1].clamp(0.0, 1.0);
        for column in 0..columns {
            let u = (column as f64 + 0.5) / columns as f64;
            for piece in 0..pieces {
                let x = |k: usize| (column as f64 + (piece + k) as f64 / pieces as f64) / columns as f64;
                let corner = |k: usize, y: f64| (self.to_shown(view, [x(k), y]), [u, y]);
                let corners = [corner(0, 0.0), corner(1, 0.0), corner(1, bottom), corner(0, bottom)];
                quad(mesh, seen, to_screen, corners);
            }
        }
    }

    /// Rays from the radar across the cells, side by side.
    fn unrolled(&self, mesh: &mut Mesh, view: &View, seen: Rect, to_screen: &dyn Fn([f64; 2]) -> Pos2) {
        let ends = self.ends(view);
        let [across, up] = self.covered(view);
        let unit = |angle: f64| (angle - ends[0][0]) / (ends[0][1] - ends[0][0]);
        let pieces = ((ends[0][1] - ends[0][0]).abs() / ARC).ceil().max(1.0) as usize;
        let mut angles: Vec<f64> = (0..=pieces).map(|i| i as f64 / pieces as f64).collect();
        angles.extend(across.iter().flat_map(|y| up.map(|x| unit(y.atan2(x)))));
        angles.sort_by(f64::total_cmp);
        let ray = |t: f64| {
            let angle = ends[0][0] + t * (ends[0][1] - ends[0][0]);
            // The way through the cells, metres from the radar.
            let (mut from, mut to) = (0.0, f64::INFINITY);
            for (along, [lo, hi]) in [(angle.sin(), across), (angle.cos(), up)] {
                if along.abs() > 1e-12 {
                    let [a, b] = self::ends([lo / along, hi / along]);
                    (from, to) = (f64::max(from, a), f64::min(to, b));
                }
            }
            let radii = if to > from { [from, to] } else { [0.5 * (from + to); 2] };
            radii.map(|r| [t, (r - ends[1][0]) / (ends[1][1] - ends[1][0])])
        };
        let rays: Vec<[[f64; 2]; 2]> = angles.into_iter().map(ray).collect();
        for pair in rays.windows(2) {
            for piece in 0..RAY {
                let at = |side: usize, k: usize| {
                    let (t, [a, b]) = ((piece + k) as f64 / RAY as f64, pair[side]);
                    let shown = [a[0], a[1] + t * (b[1] - a[1])];
                    (shown, self.to_grid(view, shown))
                };
                quad(mesh, seen, to_screen, [at(0, 0), at(1, 0), at(1, 1), at(0, 1)]);
            }
        }
    }
}

/// Four corners in turn, each with its place in the picture and in the texture; nothing where it is not seen.
fn quad(mesh: &mut Mesh, seen: Rect, to_screen: &dyn Fn([f64; 2]) -> Pos2, corners: [([f64; 2], [f64; 2]); 4]) {
    let at = corners.map(|(shown, _)| to_screen(shown));
    if !Rect::from_points(&at).intersects(seen) {
        return;
    }
    let first = mesh.vertices.len() as u32;
    for (pos, (_, [u, v])) in at.into_iter().zip(corners) {
        mesh.vertices.push(Vertex { pos, uv: pos2(u as f32, v as f32), color: Color32::WHITE });
    }
    mesh.add_triangle(first, first + 1, first + 2);
    mesh.add_triangle(first, first + 2, first + 3);
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests")]
    use super::*;
    use crate::radar::{PointSpread, Quantity};
    use crate::session::CubeView;

    fn view(axes: [(AxisKind, usize, f64, f64, Spacing); 2]) -> View {
        let axis = |(kind, bins, lo, hi, spacing)| Axis { kind, bins, lo, hi, spacing };
        View {
            array: "map".into(),
            quantity: Quantity::Amplitude,
            psf: PointSpread::default(),
            pose: crate::geometry::Pose::default(),
            axes: axes.map(axis).to_vec(),
            region: None,
        }
    }

    fn views() -> Vec<View> {
        use AxisKind::*;
        use Spacing::{Linear, Sine};
        vec![
            view([(Range, 40, 0.0, 8.0, Linear), (Azimuth, 32, -1.0, 1.0, Linear)]),
            view([(Range, 40, 4.0, 1.3, Linear), (Cone, 33, 0.9, -1.0, Sine)]),
            view([(Elevation, 16, -0.5, 0.6, Sine), (Range, 20, 1.0, 5.0, Linear)]),
            view([(DepthH, 256, 8.0, 0.0, Linear), (Y, 128, 2.0, -2.0, Linear)]),
            view([(DepthV, 64, 8.0, 0.0, Linear), (Z, 48, -2.0, 3.0, Linear)]),
        ]
    }

    fn drawn(view: &View) -> Orientation {
        let o = Orientation::of(view, CubeView { birds_eye: true, polar: true, ..CubeView::default() });
        assert_ne!(o.plane, Plane::Cells);
        o
    }

    /// There and back for every cell; and what a joint's place in the picture is, is where its cell is.
    #[test]
    fn every_cell_is_found_where_it_is_drawn() {
        for view in views() {
            let o = drawn(&view);
            let [width, height] = o.size(&view);
            for (column, row) in (0..width).flat_map(|x| (0..height).map(move |y| (x, y))) {
                let bins = o.bins_of_pixel(&view, [column, row]);
                if o.values_at(&view, o.grid_from_bins(&view, bins))[1] <= 0.0 {
                    continue;
                }
                let mut both = vec![0.0; 2];
                (both[o.horizontal], both[o.vertical]) = (bins[0], bins[1]);
                let shown = o.unit_from_bins(&view, &both);
                assert!(shown.iter().all(|x| (0.0..=1.0).contains(x)), "{shown:?}");
                assert_eq!(o.pixel_at(&view, shown), Some([column, row]), "{:?} at {shown:?}", o.plane);
                let back = o.bins_from_unit(&view, shown);
                assert!((back[0] - bins[0]).abs() < 1e-6 && (back[1] - bins[1]).abs() < 1e-6);
            }
        }
    }

    /// The texel that the mesh puts at a point of the picture is the cell that is read there.
    #[test]
    fn the_picture_is_the_cells() {
        for view in views() {
            let o = drawn(&view);
            let size = o.size(&view);
            let to_screen = |p: [f64; 2]| pos2(1e3 * p[0] as f32, 1e3 * p[1] as f32);
            let mesh = o.mesh(&view, TextureId::default(), Rect::EVERYTHING, &to_screen);
            let (mut cells, mut off) = (0, 0);
            for triangle in mesh.indices.chunks_exact(3) {
                let corner = [0, 1, 2].map(|k| mesh.vertices[triangle[k] as usize]);
                for weights in [[0.4, 0.3, 0.3], [0.8, 0.1, 0.1], [0.1, 0.45, 0.45]] {
                    let mix = |of: fn(&Vertex) -> Pos2| {
                        let sum = (0..3).fold(egui::Vec2::ZERO, |sum, k| sum + weights[k] * of(&corner[k]).to_vec2());
                        [f64::from(sum.x), f64::from(sum.y)]
                    };
                    let (at, uv) = (mix(|v| v.pos).map(|x| x / 1e3), mix(|v| v.uv));
                    let read = o.to_grid(&view, at);
                    cells += 1;
                    let apart = (0..2).map(|k| (uv[k] - read[k]).abs() * size[k] as f64).fold(0.0, f64::max);
                    // A column of a fan has one texel: half a cell to each side of its middle.
                    off += usize::from(apart > 0.52);
                }
            }
            assert!(cells > 100 && off * 200 <= cells, "{:?}: {off} of {cells}", o.plane);
        }
    }

    #[test]
    fn far_is_up_left_is_left_and_metres_are_to_scale() {
        let [view, ..] = &views()[..] else { unreachable!("views") };
        let o = drawn(view);
        let at =
            |range: f64, azimuth: f64| o.unit_from_bins(view, &[view.axes[0].bin(range), view.axes[1].bin(azimuth)]);
        let (ahead, left) = (at(6.0, 0.0), at(6.0, 0.6));
        assert!(left[0] < ahead[0] && left[1] > ahead[1] && ahead[1] < at(2.0, 0.0)[1]);
        let aspect = f64::from(o.metric_aspect(view).unwrap());
        let metres = ((left[0] - ahead[0]) * aspect).hypot(left[1] - ahead[1]);
        let scale = (at(6.0, 0.0)[1] - at(5.0, 0.0)[1]).abs();
        assert!((metres / scale - 12.0 * 0.3f64.sin()).abs() < 1e-6, "a chord of 0.6 rad at 6 m");
    }

    #[test]
    fn maps_without_a_pair_of_axes_stay_as_they_are() {
        let v =
            view([(AxisKind::Range, 4, 0.0, 4.0, Spacing::Linear), (AxisKind::Doppler, 4, -2.0, 2.0, Spacing::Linear)]);
        let o = Orientation::of(&v, CubeView { birds_eye: true, polar: true, ..CubeView::default() });
        assert_eq!(
            (o.plane, o.to_shown(&v, [0.3, 0.4]), o.to_grid(&v, [0.3, 0.4])),
            (Plane::Cells, [0.3, 0.4], [0.3, 0.4])
        );
    }
}
