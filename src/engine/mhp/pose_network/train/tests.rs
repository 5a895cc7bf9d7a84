#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use super::super::layers::TOLD;
use super::*;
use crate::body::MotionClip;

fn actors() -> Actors {
    let pose = |k: usize| -> [Vec3; 20] {
        std::array::from_fn(|joint| [0.02 * k as f64, 0.01 * joint as f64, 0.08 * joint as f64])
    };
    let clip = MotionClip {
        group: "walk".into(),
        subject: String::new(),
        own_size: false,
        poses: (0..60).map(pose).collect(),
    };
    let acted = (0..POSE_STRETCH).map(|k| pose(k)[..17].try_into().unwrap()).collect();
    Actors::new(&[clip], vec![acted]).unwrap()
}

fn lessons(actors: &Actors, count: u64) -> Vec<PoseLesson> {
    (0..count).map(|number| PoseLesson::draw(actors, (0.5, 8), number)).collect()
}

#[test]
fn clips_that_are_too_short_are_no_actors() {
    let clip = |samples: usize| MotionClip {
        group: "walk".into(),
        subject: String::new(),
        own_size: false,
        poses: vec![[[0.0; 3]; 20]; samples],
    };
    assert!(Actors::new(&[], vec![]).is_none() && Actors::new(&[clip(9)], vec![]).is_none());
}

#[test]
fn a_lesson_is_what_its_number_says_and_within_the_levels() {
    let actors = actors();
    let (all, again) = (lessons(&actors, 12), lessons(&actors, 12));
    for (a, b) in all.iter().zip(&again) {
        assert_eq!((&a.seen, a.joints), (&b.seen, b.joints));
        let levels = a.seen.horizontal.iter().chain(&a.seen.vertical);
        assert!(levels.clone().all(|x| (-2.1..1.7).contains(x)));
        assert!(a.seen.horizontal.iter().any(|x| *x > 1.6), "the brightest cell is the measure");
        assert!(a.joints.iter().flatten().all(|x| x.abs() < 3.0), "{:?}", a.joints);
    }
    assert!(all.iter().zip(&all[1..]).all(|(a, b)| a.joints != b.joints));
}

#[test]
fn the_gradient_agrees_with_differences_along_it_and_beside_it() {
    let actors = actors();
    let lessons = lessons(&actors, 3);
    let lessons: Vec<&PoseLesson> = lessons.iter().collect();
    let (plan, rng) = (Plan::new(), &mut StdRng::seed_from_u64(2));
    let numbers = plan.first(rng);
    let learned = plan.learn(&numbers, &lessons, None);
    let value = |numbers: &[f32]| plan.learn(numbers, &lessons, None).losses[1];
    for beside in [0.0_f32, 1.0] {
        let way: Vec<f32> =
            learned.gradient.iter().map(|g| g * (1.0 + beside * rng.random_range(-1.0..1.0_f32))).collect();
        let length = way.iter().map(|x| x * x).sum::<f32>().sqrt();
        let slope = learned.gradient.iter().zip(&way).map(|(g, w)| g * w).sum::<f32>() / length;
        let step = 2e-3;
        let at = |by: f32| value(&numbers.iter().zip(&way).map(|(x, w)| x + by * w / length).collect::<Vec<_>>());
        let found = (at(step) - at(-step)) / (2.0 * step);
        assert!((found - slope).abs() < 0.02 * slope.abs(), "{found} by differences, {slope}");
    }
}

/// What is trained is what a fit asks.
#[test]
fn the_network_says_what_training_says() {
    let actors = actors();
    let lesson = &lessons(&actors, 1)[0];
    let (plan, rng) = (Plan::new(), &mut StdRng::seed_from_u64(9));
    let numbers = plan.first(rng);
    let told = Layers::from_numbers(&numbers).unwrap().run(&lesson.seen);
    assert_eq!(told.len(), TOLD);
    let found = learn::unlikely(&told, &lesson.joints, &mut [0.0; TOLD]);
    let trained = plan.learn(&numbers, &[lesson], None).losses;
    assert!(found.iter().zip(trained).all(|(a, b)| (a - b).abs() < 1e-4), "{found:?} {trained:?}");
}

#[test]
fn training_learns_its_lessons_and_tensors_bring_it_back() {
    let actors = actors();
    let options =
        PoseTrainOptions { rounds: 3, lessons: 32, passes: 6, batch: 16, acted: 0.0, ..PoseTrainOptions::default() };
    let mut told = Vec::new();
    let network = train_pose_network(&actors, &options, |_, losses| told.push(losses[1])).unwrap();
    assert!(told[2] < told[0] - 0.1, "{told:?}");
    let reach = pose_network_reach(&network, &actors, &options);
    let again =
        MixtureDensityNetwork::from_bytes(&network.to_bytes(std::collections::HashMap::default()).unwrap()).unwrap();
    let rounded = pose_network_reach(&again, &actors, &options);
    assert!((reach[0] - rounded[0]).abs() < 0.01, "{reach:?} {rounded:?}");
}
