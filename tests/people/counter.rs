//! Counting people: what is detected, where it is put, and what is refused.
#![expect(clippy::unwrap_used, reason = "a test that cannot make its input has failed")]

use mhp_inspector::geometry::{Pose, Vec3};
use mhp_inspector::people::{CLASSES, Counter, FEATURES, Network, PeopleError, Scan, map_statistics};
use mhp_inspector::radar::{Axis, AxisKind, PointSpread, Quantity, Spacing, View};
use mhp_inspector::simulate::{Options, Recording, ScenePreset};

fn axis(kind: AxisKind, bins: usize, lo: f64, hi: f64) -> Axis {
    Axis { kind, bins, lo, hi, spacing: Spacing::Linear }
}

fn view(array: &str, axes: Vec<Axis>) -> View {
    View {
        array: array.into(),
        quantity: Quantity::Amplitude,
        psf: PointSpread::default(),
        pose: Pose::default(),
        axes,
        region: None,
    }
}

/// Two Cartesian maps, as MMVR's but coarser.
fn cartesian() -> Vec<View> {
    let depth = |kind| axis(kind, 128, 8.0, 0.0);
    vec![
        view("hori", vec![depth(AxisKind::DepthH), axis(AxisKind::Y, 64, 2.5, -2.5)]),
        view("vert", vec![depth(AxisKind::DepthV), axis(AxisKind::Z, 64, -2.0, 3.0)]),
    ]
}

/// Speckle that no generator of the program made: xorshift, exponential amplitudes.
struct Speckle(u64);

impl Speckle {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        let uniform = ((self.0 >> 11) as f64 + 0.5) / (1u64 << 53) as f64;
        (-uniform.ln()).sqrt()
    }
}

/// Maps of a room that stands still, noise, and bodies at `places`, whose echoes flicker.
fn maps(views: &[View], places: &[Vec3], seed: u64) -> Vec<Vec<f64>> {
    let (mut noise, mut flicker) = (Speckle(seed * 7919 + 17), Speckle(seed * 104_729 + 5));
    let parts: Vec<(Vec3, f64)> = places
        .iter()
        .flat_map(|p| [-0.6, -0.2, 0.2, 0.6].map(|up| [p[0], p[1], p[2] + up]))
        .map(|p| (p, 6.0 * flicker.next()))
        .collect();
    let of = |view: &View| -> Vec<f64> {
        let mut wall = Speckle(99);
        let shape = view.shape();
        let echoes: Vec<(Vec<f64>, f64)> = parts.iter().map(|&(p, strength)| (view.bins_of(p), strength)).collect();
        (0..view.cells())
            .map(|cell| {
                let mut bins = vec![0.0; shape.len()];
                let mut rest = cell;
                for k in (0..shape.len()).rev() {
                    bins[k] = (rest % shape[k]) as f64;
                    rest /= shape[k];
                }
                let near = |at: &[f64]| at.iter().zip(&bins).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
                let bodies: f64 = echoes.iter().map(|(at, strength)| strength * (-near(at) / 8.0).exp()).sum();
                // A wall as bright as a body, the same in every frame.
                let wall = if bins[0] < 8.0 { 6.0 * wall.next() } else { 0.0 };
                0.1 * noise.next() + wall + bodies
            })
            .collect()
    };
    views.iter().map(of).collect()
}

/// Scans `frames` frames of bodies that stand at `places`; the last scan first.
fn scans(counter: &Counter, views: &[View], places: &[Vec3], frames: u64) -> Vec<Scan> {
    let mut scans: Vec<Scan> = Vec::new();
    for seed in 0..frames {
        let maps = maps(views, places, seed);
        let maps: Vec<&[f64]> = maps.iter().map(Vec::as_slice).collect();
        let before: Vec<&Scan> = scans.iter().collect();
        let now = counter.scan(&maps, &before).unwrap();
        scans.insert(0, now);
    }
    scans
}

fn flat(a: Vec3, b: Vec3) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

#[test]
fn bodies_are_found_where_they_stand_and_walls_are_not() {
    let (views, places) = (cartesian(), [[3.0, -0.7, 0.0], [4.5, 0.8, 0.1]]);
    let counter = Counter::new(&views).unwrap();
    let scans = scans(&counter, &views, &places, 5);
    let before: Vec<&Scan> = scans.iter().skip(1).collect();
    let count = counter.count(&scans[0], &before);
    assert_eq!(count.clusters.len(), 2, "{:?}", count.clusters.iter().map(|c| c.cluster.centroid).collect::<Vec<_>>());
    for place in places {
        let nearest = count.clusters.iter().map(|c| flat(c.cluster.centroid, place)).fold(f64::INFINITY, f64::min);
        assert!(nearest < 0.2, "{nearest} m from {place:?}");
    }
    for seed in count.seeds(2) {
        assert!(places.iter().any(|&place| flat(seed, place) < 0.3), "{seed:?}");
    }
    assert!((count.probabilities.iter().sum::<f64>() - 1.0).abs() < 1e-6);
}

#[test]
fn an_empty_room_holds_nobody() {
    let views = cartesian();
    let counter = Counter::new(&views).unwrap();
    let scans = scans(&counter, &views, &[], 5);
    let before: Vec<&Scan> = scans.iter().skip(1).collect();
    let count = counter.count(&scans[0], &before);
    assert_eq!(count.people(), 0, "{:?}", count.probabilities);
}

#[test]
fn every_kind_of_view_puts_a_body_where_it_is() {
    let sine = |kind, bins, lo, hi| Axis { kind, bins, lo, hi, spacing: Spacing::Sine };
    let range = || axis(AxisKind::Range, 120, 0.0, 7.2);
    let layouts: Vec<(&str, Vec<View>)> = vec![
        ("polar", vec![view("ra", vec![range(), axis(AxisKind::Azimuth, 64, -1.0, 1.0)])]),
        ("angle first", vec![view("ar", vec![axis(AxisKind::Azimuth, 64, 1.0, -1.0), range()])]),
        ("cone, sine", vec![view("rc", vec![range(), sine(AxisKind::Cone, 64, -0.9, 0.9)])]),
        (
            "with elevation",
            vec![
                view("ra", vec![range(), axis(AxisKind::Azimuth, 64, -1.0, 1.0)]),
                view("re", vec![range(), axis(AxisKind::Elevation, 48, -0.7, 0.7)]),
            ],
        ),
        (
            "cube",
            vec![view(
                "rae",
                vec![range(), axis(AxisKind::Azimuth, 40, -1.0, 1.0), axis(AxisKind::Elevation, 6, -0.4, 0.4)],
            )],
        ),
        ("ground plan", vec![view("xy", vec![axis(AxisKind::X, 100, 0.0, 6.0), axis(AxisKind::Y, 60, 2.0, -2.0)])]),
    ];
    let place = [3.4, 0.9, 0.0];
    for (name, views) in layouts {
        let counter = Counter::new(&views).unwrap();
        let scans = scans(&counter, &views, &[place], 4);
        let strongest = scans[0].points.first().unwrap();
        assert!(flat(strongest.position, place) < 0.25, "{name}: {:?}", strongest.position);
    }
}

#[test]
fn a_turned_and_moved_view_still_tells_the_world() {
    let mut views = cartesian();
    // A radar at (0.5, −0.4, 0.2) that looks 30° to the left.
    let (sin, cos) = std::f64::consts::FRAC_PI_6.sin_cos();
    let rotation = [[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]];
    let origin = [0.5, -0.4, 0.2];
    let translation = rotation.map(|row: Vec3| -(row[0] * origin[0] + row[1] * origin[1] + row[2] * origin[2]));
    for view in &mut views {
        view.pose = Pose { rotation, translation };
    }
    let place = [3.2, 1.5, 0.1];
    let counter = Counter::new(&views).unwrap();
    let scans = scans(&counter, &views, &[place], 4);
    assert!(flat(scans[0].points.first().unwrap().position, place) < 0.25, "{:?}", scans[0].points.first());
}

#[test]
fn the_first_frame_of_a_sequence_is_counted_too() {
    let views = cartesian();
    let counter = Counter::new(&views).unwrap();
    let scans = scans(&counter, &views, &[[3.0, 0.0, 0.0]], 1);
    let count = counter.count(&scans[0], &[]);
    assert!(count.people() < CLASSES);
    assert!(!scans[0].moving && !scans[0].points.is_empty());
}

#[test]
fn what_is_no_frame_of_these_views_is_refused() {
    let views = cartesian();
    let counter = Counter::new(&views).unwrap();
    let good = vec![1.0; views[0].cells()];
    let (short, nan) = (vec![1.0; 5], vec![f64::NAN; views[0].cells()]);
    let told = |maps: &[&[f64]]| counter.scan(maps, &[]).unwrap_err().to_string();
    assert!(told(&[&good]).contains("1 maps for 2 views"));
    assert!(told(&[&good, &short]).contains("vert: 5 cells, expected 8192"));
    assert!(told(&[&nan, &good]).contains("hori: no cell holds a finite number"));
    let doppler = view("rd", vec![axis(AxisKind::Range, 8, 0.0, 4.0), axis(AxisKind::Doppler, 8, -1.0, 1.0)]);
    assert!(matches!(Counter::new(&[doppler]), Err(PeopleError::NoPlace)));
    assert!(matches!(Counter::new(&[]), Err(PeopleError::NoPlace)));
}

#[test]
fn strange_maps_do_not_stop_the_counter() {
    let views = cartesian();
    let counter = Counter::new(&views).unwrap();
    let cells = views[0].cells();
    for value in [0.0, -3.0, 1e300, 1e-300, f64::MAX] {
        let level = vec![value; cells];
        let scan = counter.scan(&[&level, &level], &[]).unwrap();
        let again = counter.scan(&[&level, &level], &[&scan]).unwrap();
        let count = counter.count(&again, &[&scan]);
        assert!(count.probabilities.iter().all(|p| p.is_finite()), "{value}");
        assert_eq!(count.clusters.len(), 0, "a level map of {value} shows nobody");
    }
    let tiny = vec![view("one", vec![axis(AxisKind::Range, 1, 1.0, 2.0), axis(AxisKind::Azimuth, 1, 0.0, 0.1)])];
    let counter = Counter::new(&tiny).unwrap();
    assert!(counter.scan(&[&[1.0]], &[]).unwrap().points.is_empty());
}

#[test]
fn damaged_weights_are_told() {
    let good = serde_json::to_string(&Network::bundled().unwrap()).unwrap();
    assert!(Network::from_json(&good, FEATURES).is_ok());
    let mut network = Network::bundled().unwrap();
    network.layers[1].weight.pop();
    let told = |text: &str| Network::from_json(text, FEATURES).unwrap_err().to_string();
    assert!(told(&serde_json::to_string(&network).unwrap()).contains("expected a layer of 32 by 64"));
    assert!(told(&good[..good.len() / 2]).starts_with("weights of the counter"));
    let mut network = Network::bundled().unwrap();
    network.scale[3] = 0.0;
    assert!(told(&serde_json::to_string(&network).unwrap()).contains("scale is zero"));
}

#[test]
fn simulated_people_are_counted() {
    for people in 0..=2_usize {
        let options = Options {
            presets: vec![ScenePreset::Easy],
            frames: 5,
            sequence_length: 5,
            people: Some(people..=people),
            seed: 77_001,
            ..Options::default()
        };
        let recording = Recording::new(&options).unwrap();
        let (counter, sequence) = (Counter::new(&recording.views()).unwrap(), recording.sequence(0));
        let mut scans: Vec<Scan> = Vec::new();
        let (mut truth, mut alone) = (Vec::new(), [0.0; 12]);
        for k in 0..5 {
            let frame = sequence.frame(k);
            let maps: Vec<Vec<f64>> =
                frame.maps.iter().map(|map| map.iter().map(|&x| f64::from(x)).collect()).collect();
            let maps: Vec<&[f64]> = maps.iter().map(Vec::as_slice).collect();
            let before: Vec<&Scan> = scans.iter().collect();
            let now = counter.scan(&maps, &before).unwrap();
            scans.insert(0, now);
            (truth, alone) = (frame.joints, map_statistics(&maps));
        }
        let before: Vec<&Scan> = scans.iter().skip(1).collect();
        let count = counter.count(&scans[0], &before);
        assert_eq!(count.people(), people, "{:?}", count.probabilities);
        let seeds = count.seeds(people);
        for joints in &truth {
            let hips = [0, 1, 2].map(|k| f64::midpoint(joints[11][k], joints[12][k]));
            assert!(seeds.iter().any(|&seed| flat(seed, hips) < 0.35), "{hips:?} is not among {seeds:?}");
        }
        assert!(Network::alone().unwrap().probabilities(&alone).iter().all(|p| p.is_finite()));
    }
}
