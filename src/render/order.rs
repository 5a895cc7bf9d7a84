//! The painter's order: what is drawn after what.
//!
//! The depth buffer alone cannot order translucent things: a splat behind the soft edge of a bone would leave a dark
//! fringe. So splats and lines are drawn in one back-to-front sequence, and a line that passes the depth of a splat
//! which it overlaps on the screen is cut there; the order of lines and splats is then exact. The depth test
//! still decides between lines, and between ellipsoids, whose order is only that of their middles.

use super::camera::Camera;
use super::ellipsoids::EllipsoidPrimitive;
use super::gaussians::SplatPrimitive;
use super::lines::LinePrimitive;
use super::projection::{Globals, Projection};
use super::scene::{LineInstance, Scene, SceneMode, SplatInstance};
use glam::Vec2;
use std::ops::Range;

/// Which drawable a run of primitives belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Splat,
    Ellipsoid,
    Line,
    Overlay,
}

/// Consecutive primitives of one kind, indices into that kind's list.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct DrawRun {
    pub(super) kind: Kind,
    pub(super) range: Range<u32>,
}

/// A scene on the screen, ready to be drawn run by run.
pub(super) struct DrawList {
    pub(super) globals: Globals,
    pub(super) splats: Vec<SplatPrimitive>,
    pub(super) ellipsoids: Vec<EllipsoidPrimitive>,
    pub(super) lines: Vec<LinePrimitive>,
    pub(super) overlay: Vec<LinePrimitive>,
    pub(super) runs: Vec<DrawRun>,
}

impl DrawList {
    /// Projects, sorts and cuts.
    pub(super) fn new(scene: &Scene, camera: &Camera, size: [u32; 2]) -> Self {
        let projection = Projection::new(camera, size, scene);
        let valid = scene.splats.iter().filter(|splat| splat.is_valid());
        let mut prepared = Self {
            globals: projection.globals,
            splats: Vec::new(),
            ellipsoids: Vec::new(),
            lines: Vec::new(),
            overlay: project_lines(&scene.overlay, &projection).collect(),
            runs: Vec::new(),
        };
        let lines = project_lines(&scene.lines, &projection);
        match scene.mode {
            SceneMode::Splat => prepared.interleave(valid, lines, &projection),
            SceneMode::Ellipsoid => prepared.ellipsoids_then_lines(valid, lines, &projection),
        }
        prepared.push_run(Kind::Overlay, 0..prepared.overlay.len());
        prepared
    }

    fn interleave<'a>(
        &mut self,
        splats: impl Iterator<Item = &'a SplatInstance>,
        lines: impl Iterator<Item = LinePrimitive>,
        projection: &Projection,
    ) {
        let mut splats: Vec<_> = splats.filter_map(|splat| SplatPrimitive::project(splat, projection)).collect();
        splats.sort_by(|a, b| b.z.total_cmp(&a.z));
        let sigma = projection.globals.sigma;
        let obstacles = || splats.iter().map(|s| (Vec2::from_array(s.center), s.reach(sigma), s.z));
        let mut pieces = Vec::new();
        lines.for_each(|line| line.cut(obstacles(), &mut pieces));
        pieces.sort_by(|a, b| b.mid_z().total_cmp(&a.mid_z()));
        let (mut next_line, mut next_splat) = (0, 0);
        while next_line < pieces.len() || next_splat < splats.len() {
            let splat_z = splats.get(next_splat).map_or(f32::NEG_INFINITY, |splat| splat.z);
            let behind = pieces.iter().skip(next_line).take_while(|piece| piece.mid_z() >= splat_z).count();
            self.push_run(Kind::Line, next_line..next_line + behind);
            next_line += behind;
            let line_z = pieces.get(next_line).map_or(f32::NEG_INFINITY, LinePrimitive::mid_z);
            let behind = splats.iter().skip(next_splat).take_while(|splat| splat.z > line_z).count();
            self.push_run(Kind::Splat, next_splat..next_splat + behind);
            next_splat += behind;
        }
        (self.splats, self.lines) = (splats, pieces);
    }

    fn ellipsoids_then_lines<'a>(
        &mut self,
        splats: impl Iterator<Item = &'a SplatInstance>,
        lines: impl Iterator<Item = LinePrimitive>,
        projection: &Projection,
    ) {
        // One that would hide everything is drawn as what it is: a cloud.
        let (whole, faded): (Vec<_>, Vec<_>) = splats.partition(|splat| projection.fade(splat) >= 1.0);
        self.splats = faded.into_iter().filter_map(|splat| SplatPrimitive::project(splat, projection)).collect();
        self.splats.sort_by(|a, b| b.z.total_cmp(&a.z));
        let whole = whole.into_iter();
        self.ellipsoids = whole.filter_map(|splat| EllipsoidPrimitive::project(splat, projection)).collect();
        self.ellipsoids.sort_by(|a, b| b.depth().total_cmp(&a.depth()));
        self.lines = lines.collect();
        self.lines.sort_by(|a, b| b.mid_z().total_cmp(&a.mid_z()));
        self.push_run(Kind::Ellipsoid, 0..self.ellipsoids.len());
        self.push_run(Kind::Line, 0..self.lines.len());
        self.push_run(Kind::Splat, 0..self.splats.len());
    }

    fn push_run(&mut self, kind: Kind, range: Range<usize>) {
        if !range.is_empty() {
            self.runs.push(DrawRun { kind, range: range.start as u32..range.end as u32 });
        }
    }
}

fn project_lines<'a>(
    lines: &'a [LineInstance],
    projection: &'a Projection,
) -> impl Iterator<Item = LinePrimitive> + use<'a> {
    lines.iter().filter(|line| line.is_valid()).filter_map(|line| LinePrimitive::project(line, projection))
}
