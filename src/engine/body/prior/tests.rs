#![expect(clippy::unwrap_used, reason = "tests")]

use super::*;
use crate::geometry::{Vec3, norm, sub};
use std::sync::OnceLock;

fn tiny() -> MotionPrior {
    MotionPrior {
        header: vec!["made up, \"as [it\", is],".into(), "},{".into()],
        times_s: vec![-0.1, 0.0],
        joints: vec!["nose".into()],
        ln_size: [0.07, 0.05],
        mean: vec![0.1, 0.2, 0.3, 0.1, 0.25, 0.3],
        components: vec![vec![0.0, 1.0, 0.0, 0.0, 1.0, 0.0], vec![0.5, 0.0, 0.0, -0.5, 0.0, 0.0]],
        starts: vec![MotionStart { share: 0.75, hip_height: 0.8, coefficients: vec![1.0, -2.0] }],
        mixture: vec![MixtureComponent { weight: 1.0, mean: vec![0.5], whitening: vec![1.25] }],
        likelihood: OnceLock::new(),
        signs: OnceLock::new(),
    }
}

#[test]
fn a_prior_is_read_as_it_was_written() {
    let text = tiny().to_json().unwrap();
    assert_eq!(MotionPrior::from_json(&text).unwrap(), tiny());
    assert!(text.lines().count() > 5, "a line a list: {text}");
}

#[test]
fn what_does_not_fit_is_told() {
    let told = |change: fn(&mut MotionPrior)| {
        let mut prior = tiny();
        change(&mut prior);
        MotionPrior::from_json(&serde_json::to_string(&prior).unwrap()).unwrap_err()
    };
    assert_eq!(told(|prior| prior.mean.truncate(5)), "`mean` has 5 numbers; expected 6");
    assert_eq!(told(|prior| prior.components[1].push(0.0)), "`components` has 7 numbers; expected 6");
    assert_eq!(told(|prior| prior.starts[0].coefficients.clear()), "`coefficients` has 0 numbers; expected 2");
    assert_eq!(told(|prior| prior.times_s.reverse()), "`times_s`: expected each time after the one before");
    assert_eq!(told(|prior| prior.ln_size[1] = 0.0), "`ln_size` has the standard deviation 0; expected one above 0");
    assert_eq!(told(|prior| prior.starts[0].share = 1.5), "`share` is 1.5; expected 0 to 1");
    assert_eq!(told(|prior| prior.mixture[0].weight = 0.0), "`weight` is 0; expected one above 0, at most 1");
    assert_eq!(told(|prior| prior.mixture[0].whitening[0] = -1.0), "`whitening`: expected a diagonal above 0");
    assert_eq!(told(|prior| prior.mixture[0].whitening.push(0.0)), "`whitening` has 2 numbers; expected 1");
    let wide = told(|prior| prior.mixture[0].mean = vec![0.0; 3]);
    assert_eq!(wide, "`mixture`: `mean` has 3 numbers; expected as many in each component, 1 to 2");
    assert!(told(|prior| prior.components.clear()).contains("0 components"));
    assert!(told(|prior| prior.joints.push("nose".into())).contains("listed twice"));
    let infinite = tiny().to_json().unwrap().replace("0.25", "1e999");
    assert!(MotionPrior::from_json(&infinite).is_err());
    assert!(MotionPrior::from_json("{}").is_err());
}

/// A joint of a pose, of the mean or a component.
fn at(prior: &MotionPrior, window: &[f64], time: usize, name: &str) -> Vec3 {
    let from = 3 * (time * prior.joints().len() + prior.joint(name).unwrap());
    std::array::from_fn(|k| window[from + k])
}

/// The name on the other side of the body.
fn twin(name: &str) -> String {
    let other = |from: &str, to: &str| name.strip_prefix(from).map(|rest| format!("{to}{rest}"));
    other("left_", "right_").or_else(|| other("right_", "left_")).unwrap_or_else(|| name.to_owned())
}

#[test]
fn the_committed_prior_is_of_people() {
    let prior = MotionPrior::committed().unwrap();
    assert!(prior.header()[0].contains("train-motion"), "it says how it came about");
    assert_eq!((prior.times_s().len(), prior.components().len(), prior.starts().len()), (9, 64, 24));
    assert!((prior.starts().iter().map(|start| start.share).sum::<f64>() - 1.0).abs() < 1e-3);
    let size = prior.ln_size()[0].exp();
    assert!((1.0..1.15).contains(&size), "{size} m");
    // The mean of arms in all directions is short: its bones bound those of people from below. The legs hardly are.
    let bones = [
        ("left_hip", "left_knee", 0.33..0.48),
        ("left_knee", "left_ankle", 0.33..0.48),
        ("left_hip", "right_hip", 0.12..0.32),
        ("left_shoulder", "right_shoulder", 0.25..0.42),
        ("left_shoulder", "left_elbow", 0.14..0.33),
        ("left_elbow", "left_wrist", 0.08..0.30),
        ("neck", "head_top", 0.20..0.36),
        ("pelvis", "neck", 0.40..0.62),
    ];
    for (from, to, sensible) in bones {
        for time in 0..9 {
            let length = size * norm(sub(at(prior, prior.mean(), time, from), at(prior, prior.mean(), time, to)));
            assert!(sensible.contains(&length), "{from} to {to} at {time}: {length} m");
        }
    }
    let middle = prior.times_s().iter().position(|&time| time == 0.0).unwrap();
    assert!(norm(at(prior, prior.mean(), middle, "pelvis")) < 1e-4, "the hips' middle is the origin");
    assert!(at(prior, prior.mean(), middle, "left_hip")[1] > 0.05, "left is left");
    assert!(at(prior, prior.mean(), middle, "nose")[0] > 0.05, "the person faces +x");
}

#[test]
fn the_committed_prior_knows_no_side() {
    let prior = MotionPrior::committed().unwrap();
    let mirrored = |window: &[f64]| -> Vec<f64> {
        let places = (0..9).flat_map(|time| prior.joints().iter().map(move |name| (time, name)));
        places.map(|(time, name)| at(prior, window, time, &twin(name))).flat_map(|[x, y, z]| [x, -y, z]).collect()
    };
    let apart =
        |a: &[f64], b: &[f64], sign: f64| a.iter().zip(b).map(|(a, b)| (a - sign * b).abs()).fold(0.0, f64::max);
    assert!(apart(prior.mean(), &mirrored(prior.mean()), 1.0) < 2e-5, "the mean is symmetric");
    for (index, component) in prior.components().iter().enumerate() {
        let other = mirrored(component);
        let odd = apart(component, &other, 1.0).min(apart(component, &other, -1.0));
        assert!(odd < 1e-3, "component {index} is either symmetric or its own opposite: {odd}");
    }
}
