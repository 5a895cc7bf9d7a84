//! How an iteration in single precision grows with the cells of a map, the joints, the persons and the views.
//!
//! `cargo bench --no-default-features --bench growth`. Standing bodies before Cartesian maps, whole maps compared; H_ori is the
//! simulation of the same bodies a few centimetres off. One thread; least and median of the timed iterations.
#![expect(clippy::unwrap_used, reason = "a measurement stops where its material cannot be made")]

use mhp_inspector::body::{Group, Pppr, PpprShape, Skeleton};
use mhp_inspector::config::{EmRegion, FitConfig};
use mhp_inspector::geometry::{Pose, rotation_from_quaternion};
use mhp_inspector::mhp::{Fitter, Precision, Problem, simulate};
use mhp_inspector::radar::{Axis, AxisKind, PointSpread, Quantity, RadarConfig, Spacing, View};
use std::sync::Arc;
use std::time::Instant;

const WARM: usize = 30;
const TIMED: usize = 200;

/// One scene.
#[derive(Clone, Copy)]
struct Scene {
    side: usize,
    joints: usize,
    persons: usize,
    views: usize,
}

impl Scene {
    fn view(self, index: usize) -> View {
        let axis = |kind, lo, hi| Axis { kind, bins: self.side, lo, hi, spacing: Spacing::Linear };
        let kinds = [[AxisKind::DepthH, AxisKind::Y], [AxisKind::DepthV, AxisKind::Z]][index % 2];
        View {
            array: format!("map{index}"),
            quantity: Quantity::default(),
            psf: PointSpread {
                range_m: 0.05,
                azimuth_rad: 0.03,
                elevation_rad: 0.03,
                doppler_mps: 0.1,
                ..PointSpread::default()
            },
            pose: Pose { rotation: rotation_from_quaternion([1.0, 0.0, 0.0, 0.0]), translation: [0.0; 3] },
            axes: vec![axis(kinds[0], 8.0, 0.0), axis(kinds[1], -5.0, 5.0)],
            region: None,
        }
    }

    /// Bodies side by side, 1.2 m apart, joints from head to feet; `off` metres from where they are.
    fn params(self, off: f64) -> Pppr {
        let shape = PpprShape { persons: self.persons, joints: self.joints, doppler_features: 1 };
        let mut params = Pppr::zeros(shape);
        for joint in 0..shape.total_joints() {
            let (person, part) = (joint / self.joints, (joint % self.joints) as f64 / self.joints.max(2) as f64);
            let middle = 0.5 * (self.persons - 1) as f64;
            let y = 1.2 * (person as f64 - middle) + 0.2 * (40.0 * part).sin();
            params.set_vec3(Group::Position, joint, [3.5 + off, y + off, 0.7 - 1.6 * part]);
            params.set_vec3(Group::LogScale, joint, [0.08_f64.ln(); 3]);
            params.joint_mut(Group::Rotation, joint).copy_from_slice(&[1.0, 0.0, 0.0, 0.0]);
        }
        params
    }

    fn problem(self) -> Problem {
        let skeleton = Skeleton {
            joints: (0..self.joints).map(|k| format!("joint {k}")).collect(),
            bones: (1..self.joints).map(|k| [k - 1, k]).collect(),
            bone_lengths_m: vec![0.15; self.joints - 1],
            angles: vec![],
        };
        let radar = RadarConfig { doppler_features: 1, ..RadarConfig::default() };
        let views: Vec<View> = (0..self.views).map(|k| self.view(k)).collect();
        let with = |maps: &[Vec<f64>]| {
            let maps: Vec<&[f64]> = maps.iter().map(Vec::as_slice).collect();
            Problem::new(radar.clone(), skeleton.clone(), views.clone(), &maps).unwrap()
        };
        let blank = with(&vec![vec![1.0; self.side * self.side]; self.views]);
        with(&simulate(&blank, &FitConfig::default(), Precision::F64, &self.params(0.0)))
    }

    /// Least and median µs an iteration.
    fn time(self) -> [f64; 2] {
        let config = FitConfig { em_region: EmRegion::Full, ..FitConfig::default() };
        let mut fitter = Fitter::new(Arc::new(self.problem()), config, Precision::F32, self.params(0.04)).unwrap();
        let mut step = || {
            let began = Instant::now();
            fitter.step().unwrap();
            began.elapsed().as_secs_f64() * 1e6
        };
        for _ in 0..WARM {
            step();
        }
        let mut times: Vec<f64> = (0..TIMED).map(|_| step()).collect();
        times.sort_by(f64::total_cmp);
        [times[0], times[TIMED / 2]]
    }
}

fn main() {
    let usual = Scene { side: 256, joints: 17, persons: 1, views: 2 };
    println!("| what grows | | least, µs | median, µs |\n|---|--:|--:|--:|");
    let tell = |what: &str, value: String, scene: Scene| {
        let [least, median] = scene.time();
        println!("| {what} | {value} | {least:.0} | {median:.0} |");
    };
    for side in [64, 128, 256, 512, 1024] {
        tell("cells of a map", format!("{side}²"), Scene { side, ..usual });
    }
    for joints in [4, 8, 17, 34, 68] {
        tell("joints", joints.to_string(), Scene { joints, ..usual });
    }
    for persons in [1, 2, 4, 8] {
        tell("persons", persons.to_string(), Scene { persons, ..usual });
    }
    for views in [1, 2, 4] {
        tell("views", views.to_string(), Scene { views, ..usual });
    }
}
