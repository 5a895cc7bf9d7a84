#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use super::glimpse::{ACROSS, CHANNELS, RANGES, UP, about, across_m, range_m, up_m};
use super::*;
use crate::body::{PpprShape, Skeleton};
use crate::geometry::Pose;
use crate::radar::{Axis, AxisKind, PointSpread, Quantity, RadarConfig, Spacing, View};
use rand::rngs::StdRng;
use rand::{Rng as _, SeedableRng as _};

/// What maps are over.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Over {
    Polar,
    Cartesian,
    Cube,
}

/// A map of 20 mm and 0.4° cells, or of 20 mm and 20 mm, or of 50 mm and 1.2° by 1.2°, with noise of 1 and the echo of a point.
fn problem(over: Over, at: Vec3, frames: usize) -> Problem {
    let axis = |kind, bins, lo, hi| Axis { kind, bins, lo, hi, spacing: Spacing::Linear };
    let wide = 60_f64.to_radians();
    let axes = |up: bool| match (over, up) {
        (Over::Polar, false) => vec![axis(AxisKind::Range, 250, 0.0, 5.0), axis(AxisKind::Cone, 300, -wide, wide)],
        (Over::Polar, true) => vec![axis(AxisKind::Elevation, 300, wide, -wide), axis(AxisKind::Range, 250, 5.0, 0.0)],
        (Over::Cartesian, false) => vec![axis(AxisKind::DepthH, 250, 5.0, 0.0), axis(AxisKind::Y, 200, 2.0, -2.0)],
        (Over::Cartesian, true) => vec![axis(AxisKind::DepthV, 250, 5.0, 0.0), axis(AxisKind::Z, 200, -2.0, 2.0)],
        (Over::Cube, _) => vec![
            axis(AxisKind::Azimuth, 100, -wide, wide),
            axis(AxisKind::Range, 100, 0.0, 5.0),
            axis(AxisKind::Elevation, 100, wide, -wide),
        ],
    };
    let view = |up: bool| View {
        array: if up { "v" } else { "h" }.into(),
        quantity: Quantity::Amplitude,
        psf: PointSpread::default(),
        pose: Pose::default(),
        axes: axes(up),
        region: None,
    };
    let views = if over == Over::Cube { vec![view(false)] } else { vec![view(false), view(true)] };
    let map = |view: &View| -> Vec<f64> {
        let bins = view.bins_of(at);
        let shape = view.shape();
        (0..view.cells())
            .map(|cell| {
                let of = crate::radar::unravel(cell, &shape);
                let off: f64 = zip(of, &bins).map(|(bin, at)| (bin as f64 - at).powi(2)).sum();
                1.0 + 1e3 * (-off / 32.0).exp()
            })
            .collect()
    };
    let maps: Vec<Vec<f64>> = views.iter().map(map).collect();
    let skeleton = Skeleton::preset("coco17").unwrap();
    let maps: Vec<&[f64]> = maps.iter().map(Vec::as_slice).collect();
    let mut problem = Problem::new(RadarConfig::default(), skeleton, views, &maps).unwrap();
    for k in 1..frames {
        problem.add_neighbour(0.1 * k as f64, &maps).unwrap();
    }
    problem
}

/// An echo is where the network is told that it is, whatever the axes of the maps.
#[test]
fn an_echo_lies_in_its_cell_of_every_layout() {
    let (place, at) = ([2.8, 0.6, 0.0], [3.0, 0.8, 0.3]);
    let layouts = [Over::Polar, Over::Cartesian, Over::Cube];
    for (over, frames) in layouts.into_iter().flat_map(|over| [(over, 1), (over, 5)]) {
        let glimpse = Glimpse::at(&problem(over, at, frames), &FitConfig::default(), place).unwrap();
        let distance = 2.8_f64.hypot(0.6);
        let loudest = |map: &[f32], columns: usize| {
            let cell = (0..RANGES * columns).max_by(|a, b| map[*a].total_cmp(&map[*b])).unwrap();
            (cell / columns, cell % columns)
        };
        let (row, column) = loudest(&glimpse.seen.horizontal, ACROSS);
        assert!((distance + range_m(row) - norm(at)).abs() < 0.05, "{over:?}: row {row}");
        let left = (0.8 / norm(at) - 0.6 / distance) * distance;
        assert!((across_m(column) - left).abs() < 0.06, "{over:?}: column {column}");
        let (row, column) = loudest(&glimpse.seen.vertical, UP);
        assert!((distance + range_m(row) - norm(at)).abs() < 0.05, "{over:?}: row {row}");
        assert!((up_m(column) - 0.3 / norm(at) * distance).abs() < 0.06, "{over:?}: column {column}");
        assert_eq!(glimpse.seen.about, about(distance, 0.6 / distance, 1.0));
        // What stands there is known of some frames only, and then the same as in each.
        let cells = RANGES * ACROSS;
        let (own, standing) = (&glimpse.seen.horizontal[..cells], &glimpse.seen.horizontal[(CHANNELS - 1) * cells..]);
        if frames == 1 {
            let floor = glimpse::nothing(1)[0];
            assert!(standing.iter().all(|level| *level == floor));
        } else {
            assert_eq!(own, standing);
        }
    }
}

#[test]
fn of_several_people_nobody_is_expected_to_be_another() {
    let places = [[2.8, 0.6, 0.0], [3.2, 0.6, 0.5], [3.0, 4.0, 0.0]];
    let of = |trunk: Vec3| [0, 1, 2, 3].map(|person| belongs(trunk, &places, person));
    assert_eq!(of([2.9, 0.9, 0.3]), [true, false, false, false]);
    assert_eq!(of([3.1, 0.2, -0.3]), [false, true, false, false]);
    assert!(belongs([9.0, 9.0, 9.0], &places[..1], 0), "who is alone is nobody else");
    let problem = problem(Over::Cartesian, [3.0, 0.8, 0.3], 5);
    let trunk = |body: &ExpectedBody| mean(&TRUNK.map(|joint| body.joints[joint].map_or([f64::NAN; 3], |(at, _)| at)));
    for person in 0..2 {
        let Some(found) = Expected::about(&problem, &FitConfig::default(), &places, person) else { continue };
        assert!(found.bodies.iter().all(|body| belongs(trunk(body), &places, person)));
        let chances: f64 = found.bodies.iter().map(|body| body.ln_chance.exp()).sum();
        assert!((chances - 1.0).abs() < 1e-6, "those that are left are all");
    }
    assert!(Expected::about(&problem, &FitConfig::default(), &places, 3).is_none());
}

#[test]
fn what_no_view_shows_is_empty_and_a_map_without_angle_says_nothing() {
    let mut one = problem(Over::Cartesian, [3.0, 0.8, 0.3], 1);
    let of = |problem: &Problem| Glimpse::at(problem, &FitConfig::default(), [2.8, 0.6, 0.0]);
    one.views = vec![one.views[0].clone()].into();
    assert_eq!(of(&one).unwrap().seen.vertical, glimpse::nothing(UP));
    let mut view = one.views[0].clone();
    view.axes[1].kind = AxisKind::Doppler;
    one.views = vec![view].into();
    assert!(of(&one).is_none());
    assert!(Expected::about(&one, &FitConfig::default(), &[[2.8, 0.6, 0.0]], 0).is_none());
}

#[test]
fn the_gradient_by_the_joints_agrees_with_central_differences() {
    let rng = &mut StdRng::seed_from_u64(4);
    let mut drawn = || -> Vec3 { std::array::from_fn(|_| rng.random_range(-0.3..0.3)) };
    let mut joint = |k: usize| {
        let at = drawn();
        (k != 3).then_some((at, 0.05 + 0.02 * k as f64))
    };
    let bodies = [-0.4, -1.1].map(|ln_chance| ExpectedBody::new(ln_chance, (0..6).map(&mut joint).collect()));
    let best = -ln_sum_exp(bodies.iter().map(|body| body.ln_chance - APART * body.narrowness));
    let expected = Expected { bodies: bodies.into_iter().collect(), best };
    let joints: Vec<Vec3> =
        (0..6).filter_map(|k| if k == 3 { Some([0.1; 3]) } else { joint(k).map(|(at, _)| at) }).collect();
    let mut bars = vec![[0.0; 3]; 6];
    let value = expected.misfit(&joints, 2.0, &mut bars);
    assert!(value > 0.0);
    assert_eq!(bars[3], [0.0; 3], "the network does not know it");
    for joint in 0..6 {
        for k in 0..3 {
            let at = |offset: f64| {
                let mut moved = joints.clone();
                moved[joint][k] += offset;
                2.0 * expected.misfit(&moved, 0.0, &mut [[0.0; 3]; 6])
            };
            let slope = (at(1e-6) - at(-1e-6)) / 2e-6;
            assert!((bars[joint][k] - slope).abs() < 1e-6 * (1.0 + slope.abs()), "{joint} {k}: {bars:?} {slope}");
        }
    }
    let mut best = vec![[0.0; 3]; 6];
    let of_body =
        |body: &ExpectedBody| body.joints.iter().map(|at| at.map_or([0.0; 3], |(at, _)| at)).collect::<Vec<_>>();
    let there = of_body(&expected.bodies[0]);
    assert!(expected.misfit(&there, 1.0, &mut best) < value, "less likely than what is expected");
}

#[test]
fn what_is_seen_in_a_mirror_is_the_same_with_left_and_right_exchanged() {
    let network = MixtureDensityNetwork::committed().unwrap();
    let problem = problem(Over::Cartesian, [3.0, 0.8, 0.3], 5);
    let seen = Glimpse::at(&problem, &FitConfig::default(), [2.8, 0.6, 0.0]).unwrap().seen;
    assert_ne!(seen.mirrored(), seen);
    assert_eq!(seen.mirrored().mirrored(), seen);
    let (here, there) = (network.said(&seen), network.said_mirrored(&seen.mirrored()));
    let (left, right) = (5, 6);
    for ((ln_chance, joints), other) in zip(here, there) {
        assert_eq!(ln_chance, other.0);
        let ([x, y, z], b) = joints[left];
        assert_eq!(other.1[right], ([x, -y, z], b));
    }
}

#[test]
fn the_committed_network_is_whole_and_a_damaged_one_is_told() {
    assert!(MixtureDensityNetwork::committed().is_some());
    let problem = problem(Over::Cartesian, [3.0, 0.8, 0.3], 5);
    let expected = Expected::about(&problem, &FitConfig::default(), &[[2.8, 0.6, 0.0]], 0).unwrap();
    let chances: f64 = expected.bodies.iter().map(|body| body.ln_chance.exp()).sum();
    assert!((chances - 1.0).abs() < 1e-6);
    let params = Pppr::zeros(PpprShape { persons: 1, joints: 17, doppler_features: 1 });
    let starts: Vec<(f64, Pppr)> = expected.starts(0, &params).collect();
    assert!((1..=MOST).contains(&starts.len()) && starts.iter().all(|(ln_chance, _)| *ln_chance > LEAST.ln()));
    assert!(starts.is_sorted_by(|a, b| a.0 >= b.0), "the likeliest first");
    for (_, start) in starts {
        assert!(norm(sub(start.position(11), [2.8, 0.6, 0.0])) < 1.5, "{:?}", start.position(11));
    }
    let bytes = include_bytes!("../../../../assets/pose-network.safetensors");
    assert!(MixtureDensityNetwork::from_bytes(&bytes[..bytes.len() - 2]).is_err());
    let renamed = String::from_utf8_lossy(&bytes[..4000]).find("horizontal.1.bias").unwrap();
    let mut other = bytes.to_vec();
    other[renamed] = b'H';
    assert!(MixtureDensityNetwork::from_bytes(&other).unwrap_err().contains("horizontal.1.bias"));
}
