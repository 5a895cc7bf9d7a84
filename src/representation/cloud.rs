//! PPPR-PC: points where a detector finds something in H_sim.
//!
//! A cell of a map says where on the map's own axes the echo is. What they leave open (the height on a horizontal map, the
//! velocity where there is no Doppler axis) is known from the joints that make the cell: the mean of theirs, weighted by the
//! power that each puts there. From that place the point moves the shortest way to where the map has it.

use crate::body::{Group, Pppr, PpprShape};
use crate::config::{BodyModel, FitConfig};
use crate::geometry::{Vec3, add, dot, norm, scale, sub};
use crate::mhp::{Precision, Problem, simulate};
use crate::people::{CfarOptions, detect};
use crate::radar::{AxisKind, View, unravel};

/// Points of a view of PPPR-PC at most.
pub const CLOUD_POINTS: usize = 2048;

/// One point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CloudPoint {
    /// Where the echo is, m: x forward, y left, z up, the radar at the origin.
    pub position: Vec3,
    /// Radial velocity, m/s, positive moving away.
    pub radial_mps: f64,
    /// H_sim at its cell, in the scale of the exported map.
    pub intensity: f64,
    /// The view that it was detected in.
    pub view: usize,
}

/// The detector's cells in the map of each view, at `most` those highest above their threshold; none where a view tells no place.
pub fn detected_cells(problem: &Problem, maps: &[Vec<f64>], most: usize) -> Vec<Vec<usize>> {
    let of_view = problem.views.iter().zip(maps);
    let options = CfarOptions { spacing_m: 0.0, most, ..CfarOptions::default() };
    let found = of_view.map(|(view, map)| detect(view, map, &options).unwrap_or_default());
    found.map(|found| found.iter().map(|detection| detection.cell).collect()).collect()
}

/// The points of one frame, view by view in the order of `cells`: `cells[view]` are flat indices into `maps[view]`, where
/// something was detected.
pub fn point_cloud(
    problem: &Problem,
    config: &FitConfig,
    params: &Pppr,
    maps: &[Vec<f64>],
    cells: &[Vec<usize>],
) -> Vec<CloudPoint> {
    let shape = params.shape();
    // What a joint alone sends back is its Gaussian's, also where the map was simulated with skin between joints.
    let config = FitConfig { body: BodyModel::Joints, ..*config };
    let parts: Vec<Vec<Vec<f64>>> = (0..shape.total_joints())
        .map(|joint| simulate(problem, &config, Precision::F32, &alone(params, joint)))
        .collect();
    let mut points = Vec::new();
    for (view, (of, cells)) in problem.views_under(&config).iter().zip(cells).enumerate() {
        for &cell in cells {
            let power = |joint: usize| parts[joint].get(view).and_then(|map| map.get(cell)).map_or(0.0, |a| a * a);
            let weights: Vec<f64> = (0..shape.total_joints()).map(power).collect();
            let intensity = maps.get(view).and_then(|map| map.get(cell)).copied().unwrap_or_default();
            if let Some(point) = locate(of, cell, params, &weights) {
                points.push(CloudPoint { intensity, view, ..point });
            }
        }
    }
    points
}

/// One joint as a person of its own.
fn alone(params: &Pppr, joint: usize) -> Pppr {
    let shape = PpprShape { persons: 1, joints: 1, ..params.shape() };
    let mut one = Pppr::zeros(shape);
    for group in Group::ALL {
        one.joint_mut(group, 0).copy_from_slice(params.joint(group, joint));
    }
    one
}

/// Place and velocity of a cell; `None` where no joint puts anything there.
fn locate(view: &View, cell: usize, params: &Pppr, weights: &[f64]) -> Option<CloudPoint> {
    let sum: f64 = weights.iter().sum();
    if !(sum.is_finite() && sum > 0.0) {
        return None;
    }
    let radar = view.pose.world_from_view([0.0; 3]);
    let (mut near, mut radial_mps) = ([0.0; 3], 0.0);
    for (joint, weight) in weights.iter().enumerate() {
        let p = params.position(joint);
        near = add(near, scale(p, weight / sum));
        let away = sub(p, radar);
        radial_mps += weight / sum * dot(params.velocity(joint), away) / norm(away).max(1e-6);
    }
    let bins = unravel(cell, &view.shape());
    let doppler = view.axes.iter().zip(&bins).find(|(axis, _)| axis.kind == AxisKind::Doppler);
    let radial_mps = doppler.map_or(radial_mps, |(axis, &bin)| axis.at(bin as f64));
    Some(CloudPoint { position: moved_to(view, &bins, near), radial_mps, intensity: 0.0, view: 0 })
}

/// Moves `p` to where every spatial axis of `view` has the centre of `bins`, axis after axis along its own gradient: on
/// curved axes too this ends within a hundredth of a bin, near the shortest way.
fn moved_to(view: &View, bins: &[usize], mut p: Vec3) -> Vec3 {
    const STEP_M: f64 = 1e-4;
    for _ in 0..50 {
        for (k, (axis, &bin)) in view.axes.iter().zip(bins).enumerate() {
            if axis.kind == AxisKind::Doppler {
                continue;
            }
            let at = |p: Vec3| view.bins_of(p).get(k).copied().unwrap_or_default();
            let gradient: Vec3 = std::array::from_fn(|i| {
                let (mut above, mut below) = (p, p);
                above[i] += STEP_M;
                below[i] -= STEP_M;
                (at(above) - at(below)) / (2.0 * STEP_M)
            });
            let steepness = dot(gradient, gradient);
            if steepness > 0.0 {
                p = add(p, scale(gradient, (bin as f64 - at(p)) / steepness));
            }
        }
    }
    p
}
