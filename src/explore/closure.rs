//! The closure test: a pose before antennas and chirps, then start and fit on what they measure as on a new frame. It tells whether
//! the pipeline could have recovered this pose from this radar at all.
//!
//! The synthesis owes nothing to the forward model: a body of hundreds of skin points with speckle of their own, each an echo with
//! its delay to every antenna, FFTs, noise of the receiver. There is no room: what fails here, fails without reflectors. The body
//! moves on evenly with the mean of its joints' velocities in the frames around, and with each joint's own within a frame. No cell of
//! it is erased: what a person takes away of the measured maps is not in these.

use super::Halt;
use super::cores::{Hand, IdleCores, each};
use super::echo_radar::{EchoRadar, fft_of};
use crate::body::{BodyPose, BodySurface, Build, Parts, Pppr, SegmentFrame, Skeleton};
use crate::config::FitConfig;
use crate::dataset::DatasetInfo;
use crate::diagnose::{JointErrors, joint_errors};
use crate::geometry::{Mat3, Vec3, add, add_scaled, cross, dot, mat_vec, mean, norm, scale, sub, transpose};
use crate::mhp::{Fitter, Precision, Problem};
use crate::radar::{Echo, PointMotion, PointSpread, Receiver, View};
use crate::start::find_start;
use crate::task::Progress;
use rand::{SeedableRng, rngs::StdRng};
use std::sync::Arc;

/// Skin points a person, as the synthetic source has them.
const SKIN_POINTS: usize = 560;
/// Frames to each side that a fit may look at.
const REACH: isize = 4;
/// Frames a second where a data set does not say.
const USUAL_RATE_HZ: f64 = 10.0;
/// Limb segments by their parts: from, to; and their length by height.
const LIMBS: [(usize, usize, f64); 8] = [
    (1, 3, 0.186),
    (2, 4, 0.186),
    (3, 5, 0.146),
    (4, 6, 0.146),
    (7, 9, 0.245),
    (8, 10, 0.245),
    (9, 11, 0.246),
    (10, 12, 0.246),
];
/// Bits of the converter.
const BITS: u32 = 14;

/// What is to be tested.
#[derive(Debug, Clone)]
pub struct ClosureRequest {
    /// The radar, the views, the skeleton.
    pub info: Arc<DatasetInfo>,
    /// The pose: positions and velocities count.
    pub pose: Pppr,
    /// Settings of start and fit.
    pub config: FitConfig,
    /// Scalar of the kernel.
    pub precision: Precision,
    /// Standard deviation of the receiver's noise, in units of the echo of a square metre at 1 m; `simulate`'s presets have 0.002
    /// (easy), 0.02 (medium) and 0.05 (hard).
    pub noise: f64,
    /// Of speckle and noise.
    pub seed: u64,
}

/// What came of it.
#[derive(Debug, Clone, PartialEq)]
pub struct ClosureTest {
    /// The synthetic maps, one a view.
    pub maps: Vec<Vec<f64>>,
    /// The joints that they are of, m.
    pub truth: Vec<Vec3>,
    /// The start that was found, and the fit from there.
    pub start: Pppr,
    /// Where it ended.
    pub fitted: Pppr,
    /// Errors of the start and of the fit.
    pub errors: [JointErrors; 2],
    /// Error of each joint of the fit, mm, persons as they are paired best; empty where another number of them was fitted.
    pub joints_mm: Vec<f64>,
    /// How far the middles of start and fit are off, mm.
    pub middle_mm: [f64; 2],
    /// Mean IoU of the fit.
    pub iou: Option<f64>,
    /// Iterations that were done.
    pub iterations: usize,
    /// Views whose FFTs are not known: a radar with their widths was put in their place.
    pub assumed: Vec<String>,
}

/// Runs the test. It takes a second or two.
///
/// # Errors
/// Where the views are of no line of antennas, nothing can be started or fitted, or it was cancelled.
pub fn closure_test(request: &ClosureRequest, (cores, progress): (&IdleCores, &Progress)) -> Result<ClosureTest, Halt> {
    let ClosureRequest { info, pose, config, precision, noise, seed } = request;
    let (ffts, mut assumed) = (info.ffts(), Vec::new());
    let mut radars = Vec::new();
    for (k, view) in info.views.iter().enumerate() {
        let (fft, known) = fft_of(view, ffts.get(k).and_then(Option::as_ref), &info.radar);
        radars.push(EchoRadar::new(view, &fft, info.static_removed).map_err(Halt::failed)?);
        if !known {
            assumed.push(view.array.clone());
        }
    }
    let bodies = Bodies::new(&info.skeleton, pose, *seed).map_err(Halt::failed)?;
    let rate_hz = info.frame_rate_hz.filter(|rate| *rate > 0.0).unwrap_or(USUAL_RATE_HZ);
    let frames: Vec<isize> = (-REACH..=REACH).collect();
    progress.begin("synthesis", frames.len() as u64);
    let synthesise = |(): &mut (), piece: usize, hand: &Hand<'_>| -> Result<Vec<Vec<f64>>, Halt> {
        let frame = frames[piece];
        let of = |(k, radar): (usize, &EchoRadar)| {
            if !hand.go_on() {
                return Err(Halt::Cancelled);
            }
            let view = &info.views[k];
            let echoes = bodies.echoes(view, frame as f64 / rate_hz, 0.5 * radar.fmcw.radar.frame_s);
            let none = vec![num_complex::Complex64::ZERO; radar.fmcw.array.channels() * radar.fmcw.samples];
            let mut adc = radar.fmcw.synthesise(&none, &echoes);
            let loudest = adc.data.iter().map(|x| x.re.abs().max(x.im.abs())).fold(0.0, f64::max);
            let receiver = Receiver { noise: *noise, full_scale: loudest + 6.0 * noise, bits: BITS };
            let number = (frame + REACH) as u64 * 16 + k as u64;
            adc.digitise(
                &receiver,
                &mut StdRng::seed_from_u64(seed.wrapping_add(number.wrapping_mul(0x9E37_79B9_7F4A_7C15))),
            );
            Ok(radar.map(view, &adc))
        };
        let maps = radars.iter().enumerate().map(of).collect::<Result<Vec<_>, _>>()?;
        progress.advance(1);
        Ok(maps)
    };
    let mut synthesised: Vec<Vec<Vec<f64>>> = vec![Vec::new(); frames.len()];
    each((cores, progress), frames.len(), || (), synthesise, |piece, maps| synthesised[piece] = maps)?;
    progress.begin("start and fit", 0);
    // The synthesis adds nothing to a range.
    let exact = |view: &View| View { psf: PointSpread { range_offset_m: 0.0, ..view.psf }, ..view.clone() };
    let views: Vec<View> = info.views.iter().map(exact).collect();
    let mut problem =
        Problem::new(info.radar.clone(), info.skeleton.clone(), views, &slices(&synthesised[REACH as usize]))
            .map_err(Halt::failed)?;
    problem.static_removed = info.static_removed;
    for (frame, maps) in frames.iter().zip(&synthesised).filter(|(frame, _)| **frame != 0) {
        problem.add_neighbour(*frame as f64 / rate_hz, &slices(maps)).map_err(Halt::failed)?;
    }
    let problem = Arc::new(problem);
    let people = pose.shape().persons;
    let config = FitConfig { people: if config.people == 0 { people } else { config.people }, ..*config };
    let start = find_start(&problem, &config).map_err(Halt::failed)?.initialisation.params;
    cores.make_way(0, progress)?;
    let mut fitter = Fitter::new(problem, config, *precision, start.clone()).map_err(Halt::failed)?;
    fitter.run_unseen(config.iterations, |_| cores.make_way(0, progress).is_err()).map_err(Halt::failed)?;
    cores.make_way(0, progress)?;
    let (truth, fitted) = (pose.positions().to_vec(), fitter.params().clone());
    let joints = info.skeleton.joints.len();
    let errors = |params: &Pppr| {
        joint_errors(params.positions(), &truth, joints)
            .ok_or_else(|| Halt::failed("start and pose have no joints in common"))
    };
    let off = |params: &Pppr| 1000.0 * norm(sub(mean(params.positions()), mean(&truth)));
    let ious: Vec<f64> = fitter.report().iou.iter().flatten().copied().collect();
    let one = people == 1 && fitted.shape().persons == 1;
    let each = || fitted.positions().iter().zip(&truth).map(|(a, b)| 1000.0 * norm(sub(*a, *b)));
    Ok(ClosureTest {
        maps: synthesised.swap_remove(REACH as usize),
        errors: [errors(&start)?, errors(&fitted)?],
        joints_mm: if one { each().collect() } else { Vec::new() },
        middle_mm: [off(&start), off(&fitted)],
        iou: (!ious.is_empty()).then(|| ious.iter().sum::<f64>() / ious.len() as f64),
        iterations: fitter.iteration(),
        truth,
        start,
        fitted,
        assumed,
    })
}

fn slices(maps: &[Vec<f64>]) -> Vec<&[f64]> {
    maps.iter().map(Vec::as_slice).collect()
}

/// The bodies of a pose, and their skin.
struct Bodies {
    parts: Parts,
    joints: usize,
    /// Positions and velocities of all joints.
    places: Vec<[Vec3; 2]>,
    drifts: Vec<Vec3>,
    skins: Vec<BodySurface>,
}

impl Bodies {
    fn new(skeleton: &Skeleton, pose: &Pppr, seed: u64) -> Result<Self, String> {
        let wrong =
            "the skeleton has not all parts of a body: shoulders, elbows, wrists, hips, knees, ankles and a head";
        let parts = Parts::of(skeleton).ok_or(wrong)?;
        let places: Vec<[Vec3; 2]> = pose.positions().iter().zip(pose.velocities()).map(|(p, v)| [*p, *v]).collect();
        let joints = skeleton.joints.len();
        let (mut skins, mut drifts) = (Vec::new(), Vec::new());
        for (person, body) in places.chunks_exact(joints).enumerate() {
            let positions: Vec<Vec3> = body.iter().map(|[p, _]| *p).collect();
            let of = parts.places(&positions);
            // The height that most of the limbs are of.
            let mut heights: Vec<f64> = LIMBS.iter().map(|&(a, b, share)| norm(sub(of[a], of[b])) / share).collect();
            heights.sort_by(f64::total_cmp);
            let build = Build { height_m: heights[heights.len() / 2].clamp(0.8, 2.3), girth: 1.0 };
            skins.push(BodySurface::new(&build, SKIN_POINTS, &mut StdRng::seed_from_u64(seed ^ (person as u64 + 1))));
            drifts.push(mean(&body.iter().map(|[_, v]| *v).collect::<Vec<_>>()));
        }
        Ok(Self { parts, joints, places, drifts, skins })
    }

    /// The bodies `after_s` after the frame that is fitted, and `within_s` after the middle of that frame; view frame.
    fn poses(&self, view: &View, after_s: f64, within_s: f64) -> Vec<BodyPose> {
        let of = |(person, body): (usize, &[[Vec3; 2]])| {
            let at = |[p, v]: &[Vec3; 2]| {
                let mut at = *p;
                add_scaled(&mut at, self.drifts[person], after_s);
                add_scaled(&mut at, *v, within_s);
                view.pose.view_from_world(at)
            };
            // Up in the view's frame, for bodies that stand as the world does.
            let up = mat_vec(&view.pose.rotation, [0.0, 0.0, 1.0]);
            posed(&self.parts.places(&body.iter().map(at).collect::<Vec<_>>()), up)
        };
        self.places.chunks_exact(self.joints).enumerate().map(of).collect()
    }

    fn echoes(&self, view: &View, after_s: f64, half_s: f64) -> Vec<Echo> {
        let [before, now, after] = [-half_s, 0.0, half_s].map(|t| self.poses(view, after_s, t));
        let capsules: Vec<_> = self.skins.iter().zip(&now).flat_map(|(skin, pose)| skin.capsules(pose)).collect();
        let mut echoes = Vec::new();
        for (k, skin) in self.skins.iter().enumerate() {
            for (point, position, strength) in skin.seen(&now[k], &capsules) {
                let place = |pose: &BodyPose| pose.segments[point.segment as usize].place(point.position);
                let track = PointMotion::through(place(&before[k]), position, place(&after[k]), half_s);
                echoes.push(Echo::direct(track, point.reflectivity * strength));
            }
        }
        echoes
    }
}

fn unit(v: Vec3) -> Vec3 {
    scale(v, 1.0 / norm(v).max(1e-9))
}

/// The rotation whose z is `z` and whose x comes nearest to `x`.
fn frame(z: Vec3, x: Vec3) -> Mat3 {
    let z = unit(z);
    let across = sub(x, scale(z, dot(x, z)));
    let across = if norm(across) > 1e-6 { across } else { cross(z, [z[1] + 0.5, z[2] - 0.5, z[0]]) };
    let x = unit(across);
    let y = cross(z, x);
    transpose(&[x, y, z])
}

/// A body whose parts are at these places: limbs along their bones, the trunk from the hips to the shoulders.
fn posed(parts: &[Vec3; crate::body::PARTS], up: Vec3) -> BodyPose {
    let [ls, rs, lh, rh] = [1, 2, 7, 8].map(|part| parts[part]);
    let hips = scale(add(lh, rh), 0.5);
    let trunk_z = sub(scale(add(ls, rs), 0.5), hips);
    let trunk_z = if norm(trunk_z) > 1e-6 { trunk_z } else { up };
    let left = add(unit(sub(ls, rs)), unit(sub(lh, rh)));
    let forward = cross(left, trunk_z);
    let limb = |from: usize, to: usize| {
        // Limbs hang along −z.
        let down = sub(parts[from], parts[to]);
        let down = if norm(down) > 1e-6 { down } else { up };
        SegmentFrame { rotation: frame(down, forward), origin: parts[from] }
    };
    let segments = [
        SegmentFrame { rotation: frame(trunk_z, forward), origin: hips },
        limb(1, 3),
        limb(2, 4),
        limb(3, 5),
        limb(4, 6),
        limb(7, 9),
        limb(8, 10),
        limb(9, 11),
        limb(10, 12),
    ];
    let mut joints = [parts[0]; 17];
    joints[5..].copy_from_slice(&parts[1..]);
    BodyPose { joints, segments }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::{Anchor, Posture};

    /// A body that is posed by its joints stands as the body that has them.
    #[test]
    fn a_body_is_posed_by_its_joints() {
        let pose = Build::default().pose(&Posture::upright(0.7, Anchor::Pelvis([2.0, 0.3])), -1.0);
        let mut parts = [[0.0; 3]; crate::body::PARTS];
        parts[0] = pose.joints[0];
        parts[1..].copy_from_slice(&pose.joints[5..]);
        let found = posed(&parts, [0.0, 0.0, 1.0]);
        for (a, b) in found.segments.iter().zip(&pose.segments) {
            for point in [[0.1, 0.0, 0.0], [0.0, 0.1, -0.2], [0.0, 0.0, -0.3]] {
                assert!(norm(sub(a.place(point), b.place(point))) < 1e-3, "{a:?} {b:?}");
            }
        }
    }
}
