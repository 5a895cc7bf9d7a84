//! A start from joints that somebody else found: a network, another program, an earlier run.

use super::perturb;
use super::scatterers::ScattererModel;
use crate::body::{Group, Pppr, PpprShape, Skeleton};
use crate::config::FitConfig;
use crate::geometry::Vec3;
use crate::mhp::Problem;
use crate::mhp::template::Template;

/// The joints of a standing body of this skeleton: x forward, y to its left, z up from the floor, m.
pub fn standing_joints(skeleton: &Skeleton) -> Vec<Vec3> {
    Template::new(skeleton).joints
}

/// A start with every joint where it is given, person by person, m and m/s, world frame: each has the Gaussian of a start, and is
/// perturbed where the settings ask for it. Joints beyond the last whole person are left out.
pub fn start_at(problem: &Problem, config: &FitConfig, joints: &[Vec3], velocities: &[Vec3]) -> Pppr {
    let problem = problem.under(config);
    let of_person = problem.skeleton.joints.len().max(1);
    let doppler_features = problem.radar.doppler_features;
    let mut params = Pppr::zeros(PpprShape { persons: joints.len() / of_person, joints: of_person, doppler_features });
    for joint in 0..params.shape().total_joints() {
        params.set_vec3(Group::Position, joint, joints[joint]);
        let velocity = velocities.get(joint).filter(|_| config.init.velocity);
        params.set_vec3(Group::Velocity, joint, velocity.copied().unwrap_or_default());
    }
    ScattererModel::new(&problem.skeleton, config.scatterers).apply(&mut params, &problem.skeleton);
    perturb::perturb(problem, &config.init, &mut params);
    params
}
