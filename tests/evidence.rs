//! Evidence for the failure modes on scenes that are made to have each mode and not to have it.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

mod common;

use mhp_inspector::body::{Group, Pppr, PpprShape, Skeleton};
use mhp_inspector::config::{EmRegion, FitConfig};
use mhp_inspector::dataset::{Dataset, Progress};
use mhp_inspector::diagnose::{
    Annotated, EarlierFrame, Evidence, EvidenceInput, Finding, Place, STATIC_FRAMES, evidence,
};
use mhp_inspector::geometry::Pose;
use mhp_inspector::labels::Tag;
use mhp_inspector::mhp::{Masks, Objective, Precision, Problem, masks, simulate};
use mhp_inspector::radar::{Axis, AxisKind, FftSetup, PointSpread, Quantity, RadarConfig, Spacing, View, Window};
use mhp_inspector::study::{BatchOptions, fit_frame, frame_evidence, frames_before};
use proptest::prelude::*;
use std::path::Path;
use std::sync::Arc;

const PSF: PointSpread = PointSpread { range_m: 0.06, azimuth_rad: 0.03, elevation_rad: 0.03, doppler_mps: 0.05 };

fn axis(kind: AxisKind, bins: usize, lo: f64, hi: f64) -> Axis {
    Axis { kind, bins, lo, hi, spacing: Spacing::Linear }
}

fn view(array: &str, axes: [Axis; 2]) -> View {
    View {
        array: array.into(),
        quantity: Quantity::Amplitude,
        psf: PSF,
        pose: Pose::default(),
        axes: axes.into(),
        region: None,
    }
}

/// A horizontal and a vertical map, 6 m deep, 4 m across.
fn cartesian() -> Vec<View> {
    let hori = [axis(AxisKind::DepthH, 72, 6.0, 0.0), axis(AxisKind::Y, 48, 2.0, -2.0)];
    let vert = [axis(AxisKind::DepthV, 72, 6.0, 0.0), axis(AxisKind::Z, 48, -2.0, 2.0)];
    vec![view("hori", hori), view("vert", vert)]
}

/// Range and Doppler, ±2 m/s in steps of 0.125 m/s.
fn doppler() -> Vec<View> {
    vec![view("rd", [axis(AxisKind::Range, 60, 0.0, 6.0), axis(AxisKind::Doppler, 32, -2.0, 2.0)])]
}

/// People who stand at (forward, left), m; coco17.
fn people(places: &[[f64; 2]]) -> Pppr {
    let parts = [("eye", 0.03, 0.68), ("ear", 0.08, 0.66), ("shoulder", 0.2, 0.45), ("elbow", 0.24, 0.15)];
    let parts =
        [parts, [("wrist", 0.26, -0.1), ("hip", 0.12, -0.08), ("knee", 0.12, -0.5), ("ankle", 0.12, -0.9)]].concat();
    let skeleton = Skeleton::preset("coco17").unwrap();
    let mut params = Pppr::zeros(PpprShape { persons: places.len(), joints: 17, doppler_features: 4 });
    for flat in 0..17 * places.len() {
        let name = &skeleton.joints[flat % 17];
        let (_, aside, up) = *parts.iter().find(|(part, ..)| name.ends_with(part)).unwrap_or(&("nose", 0.0, 0.65));
        let [forward, left] = places[flat / 17];
        let aside = if name.starts_with("right") { -aside } else { aside };
        params.set_vec3(Group::Position, flat, [forward, left + aside, up - 0.2]);
        params.set_vec3(Group::LogScale, flat, [0.08_f64.ln(); 3]);
        params.joint_mut(Group::Rotation, flat)[0] = 1.0;
    }
    params
}

fn radar() -> RadarConfig {
    RadarConfig { doppler_features: 4, ..RadarConfig::default() }
}

fn problem(views: &[View], maps: &[Vec<f64>]) -> Arc<Problem> {
    let maps: Vec<&[f64]> = maps.iter().map(Vec::as_slice).collect();
    Arc::new(Problem::new(radar(), Skeleton::preset("coco17").unwrap(), views.to_vec(), &maps).unwrap())
}

/// The maps of bodies alone, the largest cell 1, with speckle of one percent that differs from frame to frame.
fn maps(views: &[View], bodies: &Pppr, frame: u64) -> Vec<Vec<f64>> {
    let blank: Vec<Vec<f64>> = views.iter().map(|view| vec![1.0; view.cells()]).collect();
    let mut maps = simulate(&problem(views, &blank), &FitConfig::default(), Precision::F64, bodies);
    let mut state = frame.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    for map in &mut maps {
        let largest = map.iter().copied().fold(0.0, f64::max);
        for cell in map {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            *cell = *cell / largest + 0.01 * (state >> 11) as f64 / (1_u64 << 53) as f64;
        }
    }
    maps
}

/// The same reflector on every map of `cartesian`: `strength` at (`depth`, `across`).
fn reflector(maps: &mut [Vec<f64>], strength: f64, depth: f64, across: [f64; 2]) {
    for (map, (view, across)) in maps.iter_mut().zip(cartesian().iter().zip(across)) {
        for (cell, value) in map.iter_mut().enumerate() {
            let (row, column) = (view.axes[0].at((cell / 48) as f64), view.axes[1].at((cell % 48) as f64));
            let square = ((row - depth).powi(2) + (column - across).powi(2)) / (0.25_f64).powi(2);
            *value += strength * (-square / 2.0).exp();
        }
    }
}

/// A scene: frames oldest first, the last is judged at `fitted`.
struct Scene {
    views: Vec<View>,
    frames: Vec<Vec<Vec<f64>>>,
    fitted: Pppr,
    config: FitConfig,
}

impl Scene {
    fn judge(&self) -> Vec<Evidence> {
        self.judge_with(Annotated::default())
    }

    fn judge_with(&self, annotated: Annotated<'_>) -> Vec<Evidence> {
        let (now, earlier) = self.frames.split_last().unwrap();
        let problem = problem(&self.views, now);
        let masks = masks_at(&problem, &self.config, &self.fitted);
        let before: Vec<EarlierFrame<'_>> = earlier
            .iter()
            .enumerate()
            .map(|(k, maps)| EarlierFrame { index: 40 + k, maps: maps.iter().map(Vec::as_slice).collect() })
            .collect();
        let input = EvidenceInput {
            problem: &problem,
            config: &self.config,
            params: &self.fitted,
            masks: &masks,
            before: &before,
            annotated,
        };
        let found = evidence(&input);
        check(&found, &self.views, self.fitted.shape().total_joints());
        found
    }
}

fn masks_at(problem: &Arc<Problem>, config: &FitConfig, params: &Pppr) -> Vec<Masks> {
    let objective = Objective::new(Arc::clone(problem), *config, Precision::F64, params).unwrap();
    let simulated = simulate(problem, config, Precision::F64, params);
    simulated.iter().enumerate().map(|(view, map)| masks(&objective, view, map)).collect()
}

/// What holds of all evidence: F1 to F4, scores in 0..=1, sentences without NaN, places that exist.
fn check(found: &[Evidence], views: &[View], joints: usize) {
    assert_eq!(found.iter().map(|one| one.mode).collect::<Vec<_>>(), Tag::MODES);
    for one in found {
        assert!(one.score.is_none_or(|score| (0.0..=1.0).contains(&score)), "{one:?}");
        let texts = one.findings.iter().map(|finding| &finding.text).chain([&one.summary]);
        for text in texts {
            let bad = text.split(|c: char| !c.is_alphanumeric()).any(|word| word == "NaN" || word == "inf");
            assert!(text.ends_with('.') && !bad, "{text}");
        }
        for Finding { place, text } in &one.findings {
            match place {
                Some(Place::Cells { view, lo, hi }) => {
                    let shape = views[*view].shape();
                    assert_eq!((lo.len(), hi.len()), (shape.len(), shape.len()));
                    assert!((0..shape.len()).all(|k| lo[k] <= hi[k] && hi[k] < shape[k]), "{text}: {lo:?} {hi:?}");
                }
                Some(Place::Joint(joint)) => assert!(*joint < joints, "{text}"),
                Some(Place::Frame(_)) | None => {}
            }
        }
    }
}

fn at(views: Vec<View>, fitted: Pppr) -> Scene {
    let frames = vec![maps(&views, &fitted, 1)];
    Scene { views, frames, fitted, config: FitConfig::default() }
}

/// `frames` frames of a person who moves `step_m` to the left a frame and ends at y = 0, beside a reflector of `strength`.
fn walk(frames: usize, step_m: f64, strength: f64) -> Scene {
    let views = cartesian();
    let place = |k: usize| [3.0, -step_m * (frames - 1 - k) as f64];
    let made = (0..frames).map(|k| {
        let mut maps = maps(&views, &people(&[place(k)]), k as u64 + 1);
        reflector(&mut maps, strength, 3.3, [0.7, 0.7]);
        maps
    });
    Scene { frames: made.collect(), views, fitted: people(&[[3.0, 0.0]]), config: FitConfig::default() }
}

fn score(scene: &Scene, mode: usize) -> f64 {
    scene.judge()[mode].score.unwrap()
}

fn has(evidence: &Evidence, words: &str) -> bool {
    evidence.findings.iter().any(|finding| finding.text.contains(words))
}

#[test]
fn f1_is_high_where_a_reflector_persists_and_low_where_all_moves() {
    let (moving, persists) = (walk(5, 0.3, 0.0), walk(5, 0.3, 5.0));
    let found = &persists.judge()[0];
    // A person who moves sideways keeps their depth and height: the vertical map stays as it is.
    let hori = |scene: &Scene| scene.judge()[0].findings[0].text.clone();
    println!("{:.3} {:.3}\n{}\n{}", score(&moving, 0), score(&persists, 0), hori(&moving), hori(&persists));
    assert!(found.score.unwrap() > 0.75, "{found:?}");
    assert!(score(&moving, 0) < found.score.unwrap() - 0.25);
    // The patch is where the reflector is, and the fitted body does not explain it.
    let patch = found.findings.iter().find(|f| f.text.contains("hori: the largest static patch")).unwrap();
    let Some(Place::Cells { view: 0, lo, hi }) = &patch.place else { unreachable!("{patch:?}") };
    let view = &persists.views[0];
    let (row, column) = (view.axes[0].bin(3.3).round() as usize, view.axes[1].bin(0.7).round() as usize);
    assert!((lo[0]..=hi[0]).contains(&row) && (lo[1]..=hi[1]).contains(&column), "{patch:?}");
    assert!(patch.text.contains("H_sim does not explain"), "{patch:?}");
    assert!(found.summary.contains("over 5 frames"), "{}", found.summary);
}

#[test]
fn f1_counts_cells_that_stay_bright_in_every_frame() {
    // One view, a region of the whole map, cells lit by hand: the share is known.
    let views = vec![view("xy", [axis(AxisKind::X, 20, 1.0, 5.0), axis(AxisKind::Y, 20, 2.0, -2.0)])];
    let frame = |lit: &[usize]| {
        let mut map: Vec<f64> = (0..400).map(|cell| 1e-3 * f64::from(cell)).collect();
        for &cell in lit {
            map[cell] = 5.0;
        }
        vec![map]
    };
    let always: Vec<usize> = (0..10).collect();
    let lit = |own: std::ops::Range<usize>| always.iter().copied().chain(own).collect::<Vec<_>>();
    let mut scene = Scene {
        frames: (1..=5).map(|k| frame(&lit(30 * k..30 * k + 30))).collect(),
        views,
        fitted: people(&[[3.0, 0.0]]),
        config: FitConfig { em_region: EmRegion::Full, ..FitConfig::default() },
    };
    // The mask is the 40 lit cells; 10 are lit always, and none of the others in two frames.
    assert!((score(&scene, 0) - 0.25).abs() < 1e-12, "{:?}", scene.judge()[0]);
    scene.frames.insert(0, frame(&[]));
    assert!((score(&scene, 0) - 0.25).abs() < 1e-12, "frames beyond the fifth do not count");
    scene.frames[3] = frame(&[]);
    assert_eq!(score(&scene, 0), 0.0, "one frame without them, and they are not static");
}

#[test]
fn f1_needs_five_frames_in_a_row_and_says_which_this_is() {
    let found = &walk(3, 0.3, 5.0).judge()[0];
    assert_eq!(found.score, None);
    assert_eq!(found.summary, "It needs 5 frames of the sequence in a row, this is number 3.");
    assert!(has(found, "bright in each of 3 frames"));
    let mut broken = walk(5, 0.3, 5.0);
    broken.frames[2][0].fill(f64::NAN);
    assert!(broken.judge()[0].summary.ends_with("this is number 2."), "a frame that cannot be used breaks the row");
    broken.frames[2][0][7] = 1.0;
    assert!(broken.judge()[0].score.is_some(), "missing cells are filled");
}

#[test]
fn f1_tells_a_person_who_stands_from_a_reflector() {
    let standing = &walk(5, 0.0, 0.0).judge()[0];
    let beside = &walk(5, 0.3, 5.0).judge()[0];
    assert!(standing.score.unwrap() > 0.9, "{standing:?}");
    assert!(has(standing, "a person who stands still looks like this too"), "{standing:?}");
    let on_joints = |found: &Evidence| {
        let text = &found
            .findings
            .iter()
            .find(|f| f.text.starts_with("hori") && f.text.contains("fitted joint"))
            .unwrap()
            .text;
        text.split_whitespace().nth(1).unwrap().parse::<f64>().unwrap()
    };
    assert!(on_joints(standing) > 50.0 && on_joints(beside) < 20.0, "{standing:?} {beside:?}");
}

#[test]
fn f1_without_a_mask_has_no_score() {
    let mut scene = walk(5, 0.3, 0.0);
    for map in scene.frames.iter_mut().flatten() {
        map.fill(1.0);
    }
    let found = &scene.judge()[0];
    assert_eq!((found.score, found.summary.contains("mask of H_ori is empty")), (None, true));
}

#[test]
fn f2_rises_as_the_person_comes_nearer() {
    let far = score(&at(cartesian(), people(&[[3.0, 0.0]])), 1);
    let near = score(&at(cartesian(), people(&[[0.4, 0.0]])), 1);
    assert!(near > 0.9 && far < 0.4, "{near} {far}");
    let mut last = 1.0;
    for step in 1..40 {
        let score = score(&at(cartesian(), people(&[[0.25 * f64::from(step), 0.0]])), 1);
        assert!(score < last, "{step}: {score} after {last}");
        last = score;
    }
}

#[test]
fn f2_is_one_half_at_the_fraunhofer_distance_of_an_even_array() {
    let radar = radar();
    let even = FftSetup {
        range: (64, Window::Hann),
        doppler: (16, Window::Hann),
        azimuth: Some((32, Window::Rectangular)),
        elevation: None,
    };
    let mut views = cartesian();
    views.truncate(1);
    views[0].psf = even.point_spread(&radar);
    let aperture = 32.0 * radar.l_az_m;
    let fraunhofer = 2.0 * aperture * aperture / radar.wavelength_m();
    let mut one = people(&[[3.0, 0.0]]);
    for joint in 0..17 {
        one.set_vec3(Group::Position, joint, [fraunhofer + 0.1 * f64::from(joint as u8), 0.0, 0.0]);
    }
    let found = &at(views, one).judge()[1];
    assert!((found.score.unwrap() - 0.5).abs() < 2e-3, "{found:?}");
    assert_eq!(found.findings[0].place, Some(Place::Joint(0)), "the nearest joint");
    assert!(found.summary.contains("1.00 times the Fraunhofer distance"), "{}", found.summary);
    // 22.5° at the Fraunhofer distance: rounded either way.
    assert!(has(found, "A wave from there is 22° off") || has(found, "A wave from there is 23° off"), "{found:?}");
}

#[test]
fn f2_says_where_the_models_smear_is_narrower_than_the_array() {
    assert!(has(&at(cartesian(), people(&[[0.4, 0.0]])).judge()[1], "narrower than the array itself"));
    assert!(!has(&at(cartesian(), people(&[[4.0, 0.0]])).judge()[1], "narrower than the array itself"));
}

#[test]
fn f2_without_an_angular_point_spread_has_no_score() {
    let mut views = cartesian();
    for view in &mut views {
        (view.psf.azimuth_rad, view.psf.elevation_rad) = (0.0, 0.0);
    }
    let found = &at(views, people(&[[3.0, 0.0]])).judge()[1];
    assert_eq!((found.score, found.findings.len()), (None, 0));
    assert!(found.summary.contains("no view has an angular point spread"));
}

#[test]
fn f3_falls_as_two_people_part() {
    let apart = |metres: f64| score(&at(cartesian(), people(&[[3.0, -metres / 2.0], [3.0, metres / 2.0]])), 2);
    assert!(apart(0.0) > 0.999, "{}", apart(0.0));
    let scores: Vec<f64> = (0..=20).map(|k| apart(0.1 * f64::from(k))).collect();
    assert!(scores.windows(2).all(|pair| pair[1] <= pair[0] + 1e-12), "{scores:?}");
    assert!(scores[2] > 0.5 && scores[20] < 0.01, "{scores:?}");
    // Beside each other they still share the vertical map, and the findings say so.
    let beside = &at(cartesian(), people(&[[3.0, -1.0], [3.0, 1.0]])).judge()[2];
    assert!(has(beside, "vert: they share 100 % of their echo") || has(beside, "vert: they share 9"), "{beside:?}");
    let behind = score(&at(cartesian(), people(&[[2.0, 0.0], [4.5, 0.8]])), 2);
    assert!(behind < 0.05, "{behind}");
}

#[test]
fn f3_judges_the_closest_pair_and_tells_resolution_cells() {
    let found = &at(cartesian(), people(&[[2.0, -1.0], [4.5, 1.0], [4.6, 1.1]])).judge()[2];
    assert!(found.summary.starts_with("Persons 2 and 3, 14 cm apart,"), "{}", found.summary);
    let text = &found.findings[0].text;
    // Ranges 4.62 and 4.75 m about; the half-value width of the range is 0.141 m.
    assert!(text.contains("range cells") && text.contains("azimuth cells"), "{text}");
    let cells: f64 = text.split("middles are ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    assert!((cells - 0.8).abs() < 0.25, "{text}");
    assert!(matches!(found.findings[0].place, Some(Place::Cells { view: 0, .. })));
}

#[test]
fn f3_of_one_person_asks_the_labels() {
    let scene = at(cartesian(), people(&[[3.0, 0.0]]));
    let alone = &scene.judge()[2];
    assert_eq!((alone.score, alone.summary.starts_with("One person is fitted")), (Some(0.0), true));
    let two = Annotated { persons: Some(2), ..Annotated::default() };
    let unknown = &scene.judge_with(two)[2];
    assert_eq!(unknown.score, None);
    assert!(unknown.summary.starts_with("2 people are annotated and 1 fitted"), "{unknown:?}");
    let boxes = [vec![[10.0, 10.0, 20.0, 20.0], [15.0, 10.0, 25.0, 20.0]], vec![[10.0, 10.0, 20.0, 20.0]]];
    let boxed = &scene.judge_with(Annotated { map_boxes: &boxes, image_boxes: Some(2), ..two })[2];
    assert_eq!(boxed.score, Some(0.5), "half of the smaller box is common");
    let place = Place::Cells { view: 0, lo: vec![10, 10], hi: vec![25, 20] };
    assert_eq!(boxed.findings[0].place, Some(place));
    assert!(has(boxed, "2 by its count of people, 2 by the boxes on hori, 1 by the boxes on vert, 2 in the camera"));
}

/// A person who moves radially at `mps`, seen by a Doppler view.
fn moving(mps: f64) -> Scene {
    let mut one = people(&[[3.0, 0.0]]);
    for joint in 0..17 {
        let p = one.position(joint);
        let d = (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]).sqrt();
        one.set_vec3(Group::Velocity, joint, p.map(|x| x / d * mps));
    }
    at(doppler(), one)
}

#[test]
fn f4_falls_with_the_radial_velocity() {
    let scores: Vec<f64> = (0..=10).map(|k| score(&moving(0.1 * f64::from(k)), 3)).collect();
    assert_eq!(scores[0], 1.0);
    assert!(scores.windows(2).all(|pair| pair[1] < pair[0]) && scores[10] < 0.05, "{scores:?}");
    // A step of 0.125 m/s is wider than the point spread's 0.118 m/s: it is the cell.
    let found = &moving(-0.125).judge()[3];
    assert!((found.score.unwrap() - 0.5).abs() < 1e-9, "{found:?}");
    assert_eq!(found.summary, "The joints' radial velocity is 0.12 m/s (root mean square), 1.0 Doppler cells.");
    assert!(matches!(found.findings[0].place, Some(Place::Joint(_))));
}

#[test]
fn f4_without_doppler_looks_at_the_change_of_the_map() {
    let still = &walk(2, 0.0, 0.5).judge()[3];
    let moved = &walk(2, 0.15, 0.5).judge()[3];
    assert!(still.score.unwrap() > 0.9 && moved.score.unwrap() < 0.3, "{still:?} {moved:?}");
    let scores: Vec<f64> = (0..=6).map(|k| score(&walk(2, 0.025 * f64::from(k), 0.5), 3)).collect();
    assert!(scores.windows(2).all(|pair| pair[1] <= pair[0]), "{scores:?}");
    let change =
        moved.findings.iter().find(|f| f.text.contains("times as much a cell as the rest of the map")).unwrap();
    assert_eq!(change.place, Some(Place::Frame(40)));
    assert!(has(moved, "No axis of these maps measures velocity") && has(moved, "λ/(2 T_frame) = 0.15 m/s"));
    let alone = &walk(1, 0.0, 0.5).judge()[3];
    assert_eq!(alone.score, None);
    assert!(alone.summary.contains("needs a Doppler axis or the frame before"), "{alone:?}");
}

#[test]
fn f4_has_no_score_where_nothing_lies_outside_the_region() {
    let mut scene = walk(2, 0.1, 0.5);
    scene.config.em_region = EmRegion::Full;
    let found = &scene.judge()[3];
    assert_eq!((found.score, found.summary.contains("the whole map")), (None, true), "{found:?}");
}

#[test]
fn wrong_sizes_count_as_absent() {
    let scene = walk(5, 0.3, 5.0);
    let problem = problem(&scene.views, &scene.frames[4]);
    let short: Vec<f64> = vec![1.0; 7];
    let before = [EarlierFrame { index: 0, maps: vec![&short, &short] }, EarlierFrame { index: 1, maps: Vec::new() }];
    let mut masks = masks_at(&problem, &scene.config, &scene.fitted);
    masks[1].ori.pop();
    masks.truncate(2);
    for masks in [&masks[..], &[]] {
        let input = EvidenceInput {
            problem: &problem,
            config: &scene.config,
            params: &scene.fitted,
            masks,
            before: &before,
            annotated: Annotated::default(),
        };
        let found = evidence(&input);
        check(&found, &scene.views, 17);
        assert_eq!((found[0].score, found[3].score), (None, None));
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    #[test]
    fn scores_stay_within_bounds_whatever_comes(
        seed in any::<u64>(),
        persons in 1_usize..4,
        frames in 1_usize..7,
        spread in prop::sample::select(vec![1e-3, 1.0, 30.0]),
        magnitude in prop::sample::select(vec![0.0, 1e-300, 1.0, 1e300]),
        holes in 0.0_f64..0.5,
    ) {
        let views = vec![
            view("h", [axis(AxisKind::DepthH, 12, 6.0, 0.0), axis(AxisKind::Y, 10, 2.0, -2.0)]),
            view("rd", [axis(AxisKind::Range, 9, 0.0, 6.0), axis(AxisKind::Doppler, 8, -2.0, 2.0)]),
            view("ae", [axis(AxisKind::Cone, 8, 1.0, -1.0), axis(AxisKind::Elevation, 7, -1.0, 1.0)]),
        ];
        let mut state = seed | 1;
        let mut draw = || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        let mut fitted = people(&vec![[0.0, 0.0]; persons]);
        for group in Group::ALL {
            for x in fitted.group_mut(group) {
                *x = spread * (2.0 * draw() - 1.0);
            }
        }
        let shapes: Vec<usize> = views.iter().map(View::cells).collect();
        let made = (0..frames).map(|_| shapes.iter().map(|&cells| {
            let mut map: Vec<f64> =
                (0..cells).map(|_| if draw() < holes { f64::NAN } else { magnitude * (draw() - 0.1) }).collect();
            map[0] = magnitude;
            map
        }).collect());
        let scene = Scene { frames: made.collect(), views, fitted, config: FitConfig::default() };
        let boxes = vec![vec![[draw() * 9.0, draw() * 9.0, draw() * 9.0, draw() * 9.0]; 2]; 3];
        let found = scene.judge_with(Annotated { persons: Some(frames), map_boxes: &boxes, image_boxes: None });
        prop_assert!(found[0].score.is_none() || frames >= STATIC_FRAMES);
        prop_assert!(found[3].score.is_some(), "there is a Doppler axis");
    }
}

fn options(iterations: usize) -> BatchOptions {
    BatchOptions {
        config: FitConfig { iterations, ..FitConfig::default() },
        precision: Precision::F64,
        warm_start: false,
        params_folder: None,
        ply: false,
        curves_folder: None,
    }
}

#[test]
fn on_the_bundled_walk_a_fit_on_the_reflector_stands_out() {
    let dataset =
        Dataset::open(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/samples/walk")), &Progress::new()).unwrap();
    assert_eq!(
        (frames_before(&dataset, 0), frames_before(&dataset, 3), frames_before(&dataset, 9)),
        (0..0, 0..3, 5..9)
    );
    // A fit of frame 6 moved to the strongest echo behind the walker, which is the wall.
    let view = &dataset.info().views[0];
    let map = &dataset.load(6).unwrap().maps[0];
    let behind = |cell: usize| view.axes[0].at((cell / 128) as f64) > 4.0;
    let strongest = (0..map.data.len()).filter(|&cell| behind(cell));
    let strongest = strongest.max_by(|&a, &b| map.data[a].total_cmp(&map.data[b])).unwrap();
    let wall = [view.axes[0].at((strongest / 128) as f64), view.axes[1].at((strongest % 128) as f64)];
    let mut on_wall = fit_frame(&dataset, 6, &options(20), None).unwrap().params;
    let from = on_wall.position(11);
    for joint in 0..17 {
        let [x, y, z] = on_wall.position(joint);
        on_wall.set_vec3(Group::Position, joint, [x - from[0] + wall[0], y - from[1] + wall[1], z]);
    }
    let scores = |params: Option<&Pppr>| {
        let found = frame_evidence(&dataset, 6, &options(20), params).evidence.unwrap();
        check(&found, &dataset.info().views, 17);
        println!("{}\n{}", found[0].summary, found[3].summary);
        [found[0].score.unwrap(), found[3].score.unwrap()]
    };
    let ([wall_f1, wall_f4], [walker_f1, walker_f4]) = (scores(Some(&on_wall)), scores(None));
    assert!(wall_f1 > 0.9 && walker_f1 < 0.4, "F1 {wall_f1} {walker_f1}");
    assert!(wall_f4 > 0.9 && walker_f4 < 0.2, "F4 {wall_f4} {walker_f4}");
}

#[test]
fn the_real_mmvr_frame_says_what_it_lacks() {
    let Some(shared) = common::shared() else { return };
    let dataset = Dataset::open(&shared.join("data/mmvr"), &Progress::new()).unwrap();
    let found = frame_evidence(&dataset, 0, &options(5), None).evidence.unwrap();
    check(&found, &dataset.info().views, 17);
    assert_eq!((found[0].score, found[3].score), (None, None), "one frame alone");
    assert!(found[0].summary.ends_with("this is number 1."));
    assert_eq!(found[2].score, Some(0.0));
    assert!(found[1].score.is_some_and(|score| (0.3..0.6).contains(&score)), "{:?}", found[1]);
}
