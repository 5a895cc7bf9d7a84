//! Starts of as many as are counted: with the frames before that the counter was taught with, whatever was counted before.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use mhp_inspector::body::{Group, Pppr};
use mhp_inspector::config::{EmLoss, FitConfig, FramesAround, Parameterization, Preset};
use mhp_inspector::dataset::Dataset;
use mhp_inspector::mhp::{Fitter, Precision};
use mhp_inspector::start::{FoundStart, count_people, find_start_along, find_start_in, problem_of};
use mhp_inspector::study::count::count_frames;
use mhp_inspector::task::Progress;
use std::path::Path;
use std::sync::Arc;

fn sample(name: &str) -> Dataset {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("samples").join(name);
    Dataset::open(&path, &Progress::new()).unwrap()
}

fn started(dataset: &Dataset, frame: usize, config: &FitConfig) -> FoundStart {
    let problem = Arc::new(problem_of(dataset, &dataset.load(frame).unwrap()).unwrap());
    find_start_in(dataset, frame, &problem, config).unwrap()
}

#[test]
fn a_frame_is_counted_alike_in_every_order_and_by_every_command() {
    let dataset = sample("walk");
    let rows = count_frames(&dataset, 0..dataset.len(), || {}).unwrap();
    // Onward, backward, and one alone.
    let onward: Vec<_> = (0..dataset.len()).map(|frame| count_people(&dataset, frame).unwrap()).collect();
    for frame in (0..dataset.len()).rev().step_by(5) {
        assert_eq!(count_people(&dataset, frame).unwrap(), onward[frame], "frame {frame}");
    }
    for (row, count) in rows.iter().zip(&onward) {
        assert_eq!(row.count.as_ref().unwrap().probabilities, count.probabilities, "{}", row.frame);
        assert_eq!(count.people(), 1, "{}", row.frame);
    }
    // Another data set that a thread goes on with is not taken for this one.
    let other = sample("f3");
    assert_eq!(count_people(&other, 1).unwrap().people(), 2);
    assert_eq!(count_people(&dataset, 2).unwrap(), onward[2]);
}

#[test]
fn the_recommended_settings_fit_one_counted_person_as_one_that_is_asked_for() {
    let dataset = sample("walk");
    let counted = FitConfig { starts: 1, ..Preset::Recommended.config() };
    assert_eq!(counted.people, 0);
    for frame in [0, 13, 27] {
        let found = started(&dataset, frame, &counted);
        let one = started(&dataset, frame, &FitConfig { people: 1, ..counted });
        assert_eq!(found.initialisation.params, one.initialisation.params, "frame {frame}");
        assert!(found.count.is_some_and(|count| count.people() == 1) && one.count.is_none());
        assert!(found.initialisation.notes[0].starts_with("1 counted (p = 0.9"), "{:?}", found.initialisation.notes);
    }
    // Several are as many bodies.
    let several = started(&sample("f3"), 1, &counted);
    assert_eq!(several.initialisation.params.shape().persons, 2);
    // A frame that is to be taken alone is counted alone.
    let alone = FitConfig { frames_around: FramesAround::None, ..counted };
    let found = started(&dataset, 13, &alone);
    assert!(found.count.is_none_or(|count| count.alone));
}

#[test]
fn a_start_along_a_sequence_is_the_same_in_every_order() {
    // Each opening is another data set to whoever keeps what was searched.
    let along = |dataset: &Dataset, frame: usize, config: &FitConfig| {
        let problem = Arc::new(problem_of(dataset, &dataset.load(frame).unwrap()).unwrap());
        find_start_along(dataset, frame, &problem, config).unwrap().initialisation
    };
    let config = FitConfig { decode_frames: 2, starts: 3, ..Preset::Recommended.config() };
    let (onward, back) = (sample("walk"), sample("walk"));
    let first: Vec<_> = [10, 11, 14].map(|frame| along(&onward, frame, &config)).into();
    for (&frame, found) in [10, 11, 14].iter().zip(&first).rev() {
        assert_eq!(along(&back, frame, &config), *found, "frame {frame}");
    }
    let along_note = |note: &Option<Result<String, &str>>| match note {
        Some(Ok(note)) => note.split("along ").nth(1).map(str::to_owned),
        _ => None,
    };
    assert_eq!(along_note(&first[0].motion).as_deref(), Some("5 frames"), "{:?}", first[0].motion);
    // At the beginning of a sequence there are fewer, in the past alone too, and by itself a frame has none.
    assert_eq!(along_note(&along(&onward, 0, &config).motion).as_deref(), Some("3 frames"));
    let past = FitConfig { frames_around: FramesAround::Past, ..config };
    assert_eq!(along_note(&along(&onward, 10, &past).motion).as_deref(), Some("3 frames"));
    let alone = FitConfig { decode_frames: 0, ..config };
    assert_eq!(along(&onward, 10, &alone), started(&onward, 10, &config).initialisation);
}

#[test]
fn what_is_said_of_a_start_is_the_posture_that_it_has() {
    let dataset = sample("walk");
    let config = FitConfig { parameterization: Parameterization::Joints, starts: 9, ..Preset::Recommended.config() };
    let walking = |frame: usize| {
        let notes = started(&dataset, frame, &config).initialisation.notes;
        notes.iter().any(|note| note.starts_with("walking at x"))
    };
    assert!([4, 10, 16, 22].into_iter().any(walking), "somebody who walks is started in a stride");
}

#[test]
fn a_fit_is_held_where_its_start_is_not_the_body_that_the_maps_show() {
    let (dataset, config) = (sample("walk"), Preset::Recommended.config());
    let problem = Arc::new(problem_of(&dataset, &dataset.load(12).unwrap()).unwrap());
    let near = find_start_along(&dataset, 12, &problem, &config).unwrap().initialisation.params;
    let mut far = near.clone();
    for joint in 0..far.shape().total_joints() {
        let [x, y, z] = far.position(joint);
        far.set_vec3(Group::Position, joint, [x, y + 1.5, z]);
    }
    let held = |start: &Pppr, config: FitConfig| {
        Fitter::new(Arc::clone(&problem), config, Precision::F64, start.clone()).unwrap().is_held()
    };
    assert!(!held(&near, config));
    assert!(held(&far, config), "1.5 m beside the echo");
    assert!(!held(&far, FitConfig { objective: EmLoss::Iou, ..config }), "masks hold nobody");
    let joints = FitConfig { parameterization: Parameterization::Joints, ..config };
    assert!(!held(&far, joints), "joints that move by themselves");
}
