#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use super::*;
use crate::body::{PpprShape, Skeleton};
use crate::config::{BodyModel, Clutter, EmLoss, Height, StaticEcho, Summation};
use crate::geometry::{norm, sub};
use crate::radar::{Axis, AxisKind, PointSpread, Quantity, RadarConfig, Spacing, View};
use rand::rngs::StdRng;
use rand::{Rng as _, SeedableRng as _};

fn config() -> FitConfig {
    FitConfig {
        objective: EmLoss::NccDb,
        body: BodyModel::Skin,
        summation: Summation::Incoherent,
        clutter: Clutter::Modelled,
        static_echo: StaticEcho::Fitted,
        dynamic_range_db: 25.0,
        w_em: 0.7,
        w_prior: 0.03,
        ..FitConfig::default()
    }
}

/// Maps of noise, a frame before and two after.
fn problem(rng: &mut StdRng) -> Problem {
    let axis = |kind, bins, lo, hi| Axis { kind, bins, lo, hi, spacing: Spacing::Linear };
    let view = |array: &str, depth, across, psf| View {
        array: array.into(),
        quantity: Quantity::Amplitude,
        psf,
        pose: crate::geometry::Pose::default(),
        axes: vec![axis(depth, 40, 5.0, 1.0), axis(across, 30, 1.6, -1.6)],
        region: None,
    };
    let psf = |azimuth_rad, elevation_rad| PointSpread {
        range_m: 0.05,
        azimuth_rad,
        elevation_rad,
        doppler_mps: 0.1,
        ..PointSpread::default()
    };
    let views = vec![
        view("h", AxisKind::DepthH, AxisKind::Y, psf(0.05, 0.0)),
        view("v", AxisKind::DepthV, AxisKind::Z, psf(0.0, 0.05)),
    ];
    let mut maps =
        || -> Vec<Vec<f64>> { (0..2).map(|_| (0..1200).map(|_| rng.random_range(0.0..1.0)).collect()).collect() };
    let own = maps();
    let radar = RadarConfig { doppler_features: 2, ..RadarConfig::default() };
    let skeleton = Skeleton::preset("coco17").unwrap();
    let mut problem = Problem::new(radar, skeleton, views, &[&own[0], &own[1]]).unwrap();
    for offset_s in [-0.1, 0.1, 0.2] {
        let around = maps();
        problem.add_neighbour(offset_s, &[&around[0], &around[1]]).unwrap();
    }
    problem
}

/// Somebody who walks, as the prior has him.
fn person(rng: &mut StdRng, window: Option<&Window>) -> (Vec<f64>, Pppr) {
    people(rng, window, 1)
}

/// Some who walk, each 0.3 m beside the one before.
fn people(rng: &mut StdRng, window: Option<&Window>, persons: usize) -> (Vec<f64>, Pppr) {
    let mut params = Pppr::zeros(PpprShape { persons, joints: 17, doppler_features: 2 });
    let aside = |person: usize| 0.1 + 0.3 * person as f64;
    for joint in 0..17 * persons {
        params.set_vec3(Group::Position, joint, [3.0, aside(joint / 17), 0.05 * (joint % 17) as f64 - 0.4]);
        params.set_vec3(Group::LogScale, joint, [-2.5; 3]);
        params.joint_mut(Group::Rotation, joint)[0] = 1.0;
    }
    let stride = window.map_or(BODY + 1, |window| window.stride);
    let mut coordinates: Vec<f64> = (0..persons * stride).map(|_| rng.random_range(-0.6..0.6)).collect();
    for (person, own) in coordinates.chunks_exact_mut(stride).enumerate() {
        own[..BODY].copy_from_slice(&[3.0, aside(person), 0.0, 0.4, 0.08, -1.5, 0.1, -0.3, 0.4, 0.9]);
        if let Some(window) = window {
            window.space.residual_mut(own).iter_mut().for_each(|r| *r *= 0.01);
        }
    }
    if let Some(window) = window {
        window.place(&coordinates, &mut params);
    }
    (coordinates, params)
}

#[test]
fn the_gradient_by_the_coordinates_agrees_with_central_differences() {
    agrees(&config(), None, 1);
}

#[test]
fn so_does_that_of_a_body_on_the_floor() {
    agrees(&FitConfig { height: Height::Floor, ..config() }, Some(1.0), 1);
}

#[test]
fn so_does_that_of_a_body_that_the_network_expects_elsewhere() {
    agrees(&FitConfig { w_net: 0.02, ..config() }, None, 1);
}

#[test]
fn so_do_those_of_two_who_stand_in_each_other() {
    agrees(&FitConfig { w_net: 0.02, height: Height::Floor, ..config() }, Some(1.0), 2);
}

fn agrees(config: &FitConfig, height_m: Option<f64>, persons: usize) {
    let rng = &mut StdRng::seed_from_u64(3);
    let mut problem = problem(rng);
    problem.radar.height_m = height_m;
    let (_, initial) = people(rng, None, persons);
    let mut window = Window::fitted(&problem, config, Precision::F64, &initial).unwrap().unwrap();
    assert_eq!((window.frames.len(), window.own), (4, 1), "the frames are those within reach");
    assert_eq!(window.space.ground.is_some(), height_m.is_some());
    let (coordinates, params) = people(rng, Some(&window), persons);
    let mut loss = WindowLoss::default();
    let mut value = |coordinates: &[f64], loss: &mut WindowLoss| {
        window.evaluate((&problem, config), Precision::F64, (coordinates, &params), None, loss);
        config.w_em * loss.em + config.w_prior * loss.prior + config.w_net * loss.network
    };
    value(&coordinates, &mut loss);
    let gradient = loss.gradient.clone();
    let stride = coordinates.len() / persons;
    for (k, got) in gradient.iter().enumerate() {
        if k % stride >= stride - 3 * 17 {
            assert_eq!(*got, 0.0, "the residual stays");
            continue;
        }
        let mut at = |offset: f64| {
            let mut moved = coordinates.clone();
            moved[k] += offset;
            value(&moved, &mut loss)
        };
        let h = 1e-5;
        let slope = (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
        assert!((got - slope).abs() < 1e-6 * (1.0 + slope.abs()), "coordinate {k}: {got}, {slope} by differences");
    }
}

#[test]
fn coordinates_come_back_from_joints_and_velocities() {
    for height_m in [None, Some(1.0)] {
        let (window, params, again) = placed_again(height_m, |_, _| ());
        let off = (0..17).map(|joint| norm(sub(params.position(joint), again.position(joint)))).fold(0.0, f64::max);
        assert!(off < 0.03, "a joint is {off} m away");
        assert_eq!(window.numbers(), window.coordinates_of(&params).len());
    }
}

/// Somebody who walks as a window has him, `changed` before it puts him where it finds him, and he there.
fn placed_again(height_m: Option<f64>, changed: impl Fn(&Window, &mut [f64])) -> (Window, Pppr, Pppr) {
    let rng = &mut StdRng::seed_from_u64(5);
    let (mut problem, config) = (problem(rng), FitConfig { height: Height::Floor, ..config() });
    problem.radar.height_m = height_m;
    let (_, initial) = person(rng, None);
    let window = Window::fitted(&problem, &config, Precision::F64, &initial).unwrap().unwrap();
    let (mut coordinates, mut params) = person(rng, Some(&window));
    changed(&window, &mut coordinates);
    window.place(&coordinates, &mut params);
    let mut again = params.clone();
    window.place(&window.coordinates_of(&params), &mut again);
    (window, params, again)
}

#[test]
fn who_walks_at_the_end_of_a_window_walks_on_in_it() {
    let skeleton = Skeleton::preset("coco17").unwrap();
    let times_s = [-0.2, -0.1, 0.0, 0.1, 0.2];
    let space = PoseSpace::new(MotionPrior::committed().unwrap(), &skeleton, &times_s, None, Detail::Fit).unwrap();
    let at = |coordinates: &[f64], frame: usize| {
        let stance = space.stance(coordinates);
        let (mut joints, mut velocities) = (vec![[0.0; 3]; 17], vec![[0.0; 3]; 17]);
        space.pose(coordinates, &stance, frame, &mut joints);
        space.velocity(coordinates, &stance, (frame, &joints), &mut velocities);
        (joints, velocities)
    };
    let mut walkers = 0;
    for (c, _) in &space.starts {
        let mut walks = vec![0.0; space.coordinates()];
        walks[..BODY].copy_from_slice(&[3.0, 0.2, 0.0, 2.8, 0.08, -1.5, 0.0, 0.0, 0.0, 0.0]);
        walks[BODY..BODY + c.len()].copy_from_slice(c);
        let (joints, velocities) = at(&walks, 0);
        let goes = mean(&velocities);
        if norm(goes) < 0.7 {
            continue;
        }
        walkers += 1;
        let found = space.project(0, &joints, &velocities);
        let (there, moving) = at(&found, 0);
        let left = norm(mean(&moving)) / norm(goes);
        let (off_m, far_m) = (
            crate::geometry::mean_distance(&there, &joints),
            norm(sub(mean(&at(&found, 4).0), mean(&at(&walks, 4).0))),
        );
        let near = left > 0.85 && off_m < 0.02 && far_m < 0.25 * 0.4 * norm(goes);
        assert!(near, "{left} of its pace of {} m/s, {off_m} m, then {far_m} m off", norm(goes));
    }
    assert!(walkers > 0, "the prior begins at walkers");
}

/// What a pose has that the prior cannot say stays; of errors of joints, which show themselves by bones that differ from left to
/// right, little does.
#[test]
fn a_pose_stays_where_it_was_put_and_errors_of_its_joints_do_not() {
    let mean_distance = |a: &Pppr, b: &Pppr| crate::geometry::mean_distance(a.positions(), b.positions());
    for height_m in [None, Some(1.0)] {
        let (window, params, again) = placed_again(height_m, |window, coordinates| {
            coordinates[BODY..].fill(0.0);
            // Both wrists ahead of where anybody has them.
            let residual = window.space.residual_mut(coordinates);
            (residual[3 * 9], residual[3 * 10]) = (0.06, 0.06);
        });
        assert!(mean_distance(&params, &again) < 1e-9, "{} m", mean_distance(&params, &again));
        let mut noisy = params.clone();
        let rng = &mut StdRng::seed_from_u64(8);
        for joint in 0..17 {
            let error = [0; 3].map(|_| rng.random_range(-0.1..0.1));
            noisy.set_vec3(Group::Position, joint, crate::geometry::add(params.position(joint), error));
        }
        let mut found = noisy.clone();
        window.place(&window.coordinates_of(&noisy), &mut found);
        let (before_m, after_m) = (mean_distance(&noisy, &params), mean_distance(&found, &params));
        assert!(after_m < 0.8 * before_m, "{before_m} m, {after_m} m");
    }
}

/// Who lies comes back from the joints, on any side and while falling, and the body is where it was laid.
#[test]
fn who_falls_or_lies_comes_back_from_joints_and_velocities() {
    let prior = MotionPrior::committed().unwrap();
    let skeleton = Skeleton::preset("coco17").unwrap();
    for floor_z_m in [None, Some(-1.0)] {
        let times_s = [-0.2, -0.1, 0.0, 0.1, 0.2];
        let space = PoseSpace::new(prior, &skeleton, &times_s, floor_z_m, Detail::Fit).unwrap();
        for (k, fallen) in tilt::fallen([0.9, -0.3, 0.0]).enumerate().step_by(5) {
            let mut coordinates = vec![0.0; space.coordinates()];
            coordinates[LN_SIZE] = -0.05;
            let hips = [3.0, 0.4, -0.7];
            space.lay(&mut coordinates, &fallen, hips, Some(1.0));
            let at = |coordinates: &[f64], frame: usize| {
                let (mut pose, mut velocities) = (vec![[0.0; 3]; 17], vec![[0.0; 3]; 17]);
                let stance = space.stance(coordinates);
                space.pose(coordinates, &stance, frame, &mut pose);
                space.velocity(coordinates, &stance, (frame, &pose), &mut velocities);
                (pose, velocities)
            };
            let (pose, velocities) = at(&coordinates, 2);
            let middle = mean(&[pose[11], pose[12]]);
            let wanted = crate::geometry::add(hips, crate::geometry::scale(fallen.towards(), fallen.along_m));
            assert!(crate::geometry::flat_distance(middle, wanted) < 0.1, "{k}: {middle:?} {wanted:?}");
            let lowest = pose.iter().map(|p| p[2]).fold(f64::INFINITY, f64::min);
            assert!((-1.1..-0.7).contains(&lowest), "{k}: {lowest}");
            let (again, moving) = at(&space.project(2, &pose, &velocities), 2);
            let off = |a: &[Vec3], b: &[Vec3]| a.iter().zip(b).map(|(p, q)| norm(sub(*p, *q))).fold(0.0, f64::max);
            assert!(off(&pose, &again) < 0.03, "{k}: a joint is {} m away", off(&pose, &again));
            assert!(off(&velocities, &moving) < 0.4, "{k}: {} m/s", off(&velocities, &moving));
        }
    }
}

/// The body of a frame before, moved as it goes, becomes as good as what the search of this one found.
#[test]
fn a_body_is_carried_on_to_where_it_goes() {
    let rng = &mut StdRng::seed_from_u64(6);
    let (problem, (_, params)) = (problem(rng), person(rng, None));
    let config = FitConfig { starts: 2, ..config() };
    let mut searched = search(&problem, &config, &params).unwrap().unwrap();
    let found = searched.persons[0].clone();
    let best = found[0].clone();
    let way = mean(&best.velocities);
    let earlier = |off_m: f64| {
        let joints = best.joints.iter().map(|p| sub(*p, [0.1 * way[0] - off_m, 0.1 * way[1], 0.1 * way[2]])).collect();
        Hypothesis { joints, loss: f64::NAN, ..best.clone() }
    };
    // What has become one with a body that was found, or is carried on twice, is left out.
    carry_on(&problem, &config, &params, &mut searched, &[(-0.1, &earlier(0.0))]).unwrap();
    assert_eq!(searched.persons[0], found);
    let (earlier, again) = (earlier(0.1), earlier(0.11));
    let others = [(-0.1, &earlier), (-0.1, &again)];
    carry_on(&problem, &config, &params, &mut searched, &others).unwrap();
    let all = &searched.persons[0];
    assert_eq!(all.len(), found.len() + 1);
    assert!(all.is_sorted_by(|a, b| a.loss <= b.loss));
    let new = all.iter().find(|body| !found.contains(body)).unwrap();
    assert!(new.loss <= best.loss + 1e-3, "{} {}", new.loss, best.loss);
    // Nothing comes of nothing.
    let before = searched.clone();
    carry_on(&problem, &config, &params, &mut searched, &[]).unwrap();
    assert_eq!(searched, before);
}

/// Where the floor is known and asked for, a body that bends its knees comes down until it stands.
#[test]
fn a_body_stands_on_the_floor_in_any_pose() {
    let prior = MotionPrior::committed().unwrap();
    let skeleton = Skeleton::preset("coco17").unwrap();
    let space = PoseSpace::new(prior, &skeleton, &[-0.1, 0.0, 0.1], Some(-1.0), Detail::Fit).unwrap();
    let rng = &mut StdRng::seed_from_u64(7);
    for _ in 0..20 {
        let mut coordinates: Vec<f64> = (0..space.coordinates()).map(|_| rng.random_range(-0.7..0.7)).collect();
        let tilted = [0; 4].map(|_| rng.random_range(-0.2..0.2));
        coordinates[..TILT].copy_from_slice(&[3.0, 0.1, 0.0, 0.4, 0.08, -1.5]);
        coordinates[TILT..BODY].copy_from_slice(&tilted);
        space.residual_mut(&mut coordinates).fill(0.0);
        let stance = space.stance(&coordinates);
        let lowest = (0..3).flat_map(|frame| {
            let mut pose = vec![[0.0; 3]; 17];
            space.pose(&coordinates, &stance, frame, &mut pose);
            [pose[15][2], pose[16][2]]
        });
        let lowest = lowest.fold(f64::INFINITY, f64::min);
        assert!((lowest + 1.0 - 0.06 * 0.08_f64.exp()).abs() < 0.025, "{lowest}");
    }
}

#[test]
fn a_window_holds_its_frame_as_near_its_middle_as_it_can() {
    let at = |offsets: &[f64], most: usize| {
        let (frames, middle_s) = chosen(offsets, most);
        (frames.len(), frames.iter().position(Option::is_none).unwrap(), (middle_s * 1e3).round())
    };
    let around = [-0.4, -0.3, -0.2, -0.1, 0.1, 0.2, 0.3, 0.4];
    assert_eq!(at(&around, 5), (5, 2, 0.0));
    assert_eq!(at(&around[4..], 5), (5, 0, 200.0), "the first of a sequence");
    assert_eq!(at(&around[..4], 5), (5, 4, -200.0), "the last");
    assert_eq!(at(&[], 5), (1, 0, 0.0));
    assert_eq!(at(&around, 1), (1, 0, 0.0));
    assert_eq!(at(&[-0.5, 0.5], 5), (1, 0, 0.0), "frames that the prior does not reach are left out");
}

#[test]
fn every_skeleton_with_known_names_is_moved() {
    let prior = MotionPrior::committed().unwrap();
    for name in ["coco17", "h36m17", "hupr14"] {
        assert!(PoseSpace::new(prior, &Skeleton::preset(name).unwrap(), &[0.0], None, Detail::Fit).is_some(), "{name}");
    }
    let mut other = Skeleton::preset("coco17").unwrap();
    other.joints[3] = "tail".into();
    assert!(PoseSpace::new(prior, &other, &[0.0], None, Detail::Fit).is_none());
}

/// Left for right, and y for −y in the body's own frame.
#[test]
fn a_mirrored_body_has_left_and_right_exchanged() {
    let skeleton = Skeleton::preset("coco17").unwrap();
    let prior = MotionPrior::committed().unwrap();
    let space = PoseSpace::new(prior, &skeleton, &[-0.1, 0.0, 0.1], None, Detail::Fit).unwrap();
    let rng = &mut StdRng::seed_from_u64(9);
    let mut coordinates: Vec<f64> = (0..space.coordinates()).map(|_| rng.random_range(-1.0..1.0)).collect();
    coordinates[..BODY].fill(0.0);
    space.residual_mut(&mut coordinates).fill(0.0);
    let other = |joint: usize| {
        let name = &skeleton.joints[joint];
        let named = |from: &str, to: &str| skeleton.joints.iter().position(|other| *other == name.replace(from, to));
        if name.contains("left") { named("left", "right") } else { named("right", "left") }.unwrap()
    };
    let pose = |coordinates: &[f64], frame: usize| {
        let mut pose = vec![[0.0; 3]; 17];
        space.pose(coordinates, &space.stance(coordinates), frame, &mut pose);
        pose
    };
    let plain = [0, 1, 2].map(|frame| pose(&coordinates, frame));
    space.mirror(&mut coordinates);
    for (frame, plain) in plain.iter().enumerate() {
        for (joint, p) in pose(&coordinates, frame).into_iter().enumerate() {
            let [x, y, z] = plain[other(joint)];
            assert!(norm(sub(p, [x, -y, z])) < 1e-3, "{}: {p:?} {:?}", skeleton.joints[joint], plain[other(joint)]);
        }
    }
    assert!(norm(sub(plain[1][9], plain[1][10])) > 0.05, "it is no symmetric pose");
}

/// Reflectors in every so manyth cell over frames of noise, `noise` strong; the radar, skeleton and views of [`problem`].
fn reflectors(frames: usize, noise: f64, rng: &mut StdRng) -> Problem {
    let alone = problem(rng);
    let reflector = |cell: usize| if cell.is_multiple_of(7) { 40.0 } else { 0.0 };
    let mut map =
        || -> Vec<f64> { (0..1200).map(|cell| reflector(cell) + noise * rng.random_range(0.0..1.0)).collect() };
    let (radar, skeleton) = (alone.radar.clone(), alone.skeleton.clone());
    let mut problem = Problem::new(radar, skeleton, alone.views.clone(), &[&map(), &map()]).unwrap();
    for k in 1..frames {
        problem.add_neighbour(0.1 * k as f64, &[&map(), &map()]).unwrap();
    }
    problem
}

/// Reflectors that stand everywhere, over six frames of noise: the background is them but where somebody's trunk stands, and of
/// somebody who walks also there; five frames are the fewest that tell it around who stands, and where static echoes were
/// removed there is none.
#[test]
fn a_background_is_known_but_under_the_trunk_of_who_stands() {
    let mut rng = StdRng::seed_from_u64(3);
    let config = config();
    let shape = PpprShape { persons: 1, joints: 17, doppler_features: 2 };
    let mut params = Pppr::zeros(shape);
    params.motion_mut()[0].fill([3.0, 0.2, 0.1]);
    let known = |problem: &Problem, walk: bool| {
        let reduced = ReducedViews::new(problem, &config, &params);
        let centres = region::centres(&params);
        let (regions, _) = region::regions(reduced.views(), config.em_region, &centres).unwrap();
        let found = clutter::known((problem, &config), &reduced, &regions, (&centres, walk)).unwrap();
        found.map(|maps| (reduced.views().to_vec(), maps.into_owned()))
    };
    let six = reflectors(6, 1.0, &mut rng);
    let (views, standing) = known(&six, false).unwrap();
    let (_, walking) = known(&six, true).unwrap();
    for (view, (standing, walking)) in views.iter().zip(standing.iter().zip(&walking)) {
        let vertical = view.array == "v";
        let bins = view.axes[1].bins;
        for (cell, (&of, &whole)) in standing.iter().zip(walking).enumerate() {
            let [depth, across] = [(0, cell / bins), (1, cell % bins)].map(|(k, bin)| view.axes[k].at(bin as f64));
            let trunk = (depth - 3.0).abs() <= 0.15 && (vertical || (across - 0.2).abs() <= 0.15);
            assert_eq!(of, if trunk { 0.0 } else { whole }, "{} {depth} {across}", view.array);
        }
        assert!(standing.contains(&0.0) && walking.iter().any(|&power| power > 1000.0));
    }
    assert!(known(&reflectors(4, 1.0, &mut rng), false).is_none());
    assert!(known(&reflectors(4, 1.0, &mut rng), true).is_some());
    let mut removed = six;
    removed.static_removed = true;
    assert!(known(&removed, true).is_none());
}

/// Where noise and background explain the maps without anybody, who stands is compared as if nothing were known of either; where
/// they do not, or somebody walks, the background counts.
#[test]
fn a_background_that_explains_the_maps_alone_is_not_used_for_who_stands() {
    let mut rng = StdRng::seed_from_u64(5);
    let config = config();
    let hidden = reflectors(6, 1.0, &mut rng);
    // The frame that the body is compared with shows something else than what stands in those around.
    let standing = reflectors(8, 1.0, &mut rng);
    let other: Vec<f64> = (0..1200).map(|cell| if (cell / 30) % 2 == 0 { 60.0 } else { 0.1 }).collect();
    let (radar, skeleton) = (standing.radar.clone(), standing.skeleton.clone());
    let mut seen = Problem::new(radar, skeleton, standing.views.clone(), &[&other, &other]).unwrap();
    for around in standing.neighbours() {
        seen.add_neighbour(1.0 + around.offset_s, &[around.map(0), around.map(1)]).unwrap();
    }
    let loss = |problem: &Problem, speed: f64| {
        let (_, mut params) = person(&mut StdRng::seed_from_u64(1), None);
        params.motion_mut()[1].fill([speed, 0.0, 0.0]);
        let mut window = Window::fitted(problem, &config, Precision::F64, &params).unwrap().unwrap();
        let coordinates = window.coordinates_of(&params);
        let mut loss = WindowLoss::default();
        window.evaluate((problem, &config), Precision::F64, (&coordinates, &params), None, &mut loss);
        loss.em
    };
    let removed = |problem: &Problem| {
        let mut problem = problem.clone();
        problem.static_removed = true;
        problem
    };
    assert_eq!(loss(&hidden, 0.0), loss(&removed(&hidden), 0.0));
    assert_ne!(loss(&hidden, 1.0), loss(&removed(&hidden), 1.0));
    assert_ne!(loss(&seen, 0.0), loss(&removed(&seen), 0.0));
}
