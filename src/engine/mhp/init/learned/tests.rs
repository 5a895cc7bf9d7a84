#![expect(clippy::unwrap_used, reason = "tests")]

use super::*;
use crate::body::Skeleton;
use crate::mhp::template::Template;

fn skeleton(name: &str) -> Skeleton {
    Skeleton::preset(name).unwrap()
}

#[test]
fn the_committed_map_is_sound() {
    let map = LimbMap::bundled().unwrap();
    assert!(map.header.iter().any(|line| line.contains("train-limbs")), "it says how it came about");
    let largest = map.weight.iter().flatten().fold(0.0_f32, |most, w| most.max(w.abs()));
    assert!(largest > 1e-3, "it has learned something");
}

#[test]
fn a_damaged_map_says_what_was_expected() {
    let told = LimbMap::from_json(r#"{"header":[],"mean":[0],"scale":[1],"weight":[[0]],"bias":[0]}"#).unwrap_err();
    assert_eq!(told, format!("expected 39 rows of {INPUTS} finite weights, and scales that are not 0"));
}

#[test]
fn every_skeleton_has_the_parts_and_its_joints_go_with_them() {
    for name in ["coco17", "h36m17", "hupr14"] {
        let skeleton = skeleton(name);
        let parts = Parts::of(&skeleton).unwrap();
        let body = Template::new(&skeleton).joints;
        let places = parts.places(&body);
        for part in 1..PARTS {
            let ([x, y, z], [rx, ry, rz]) = (places[part], places[Parts::mirrored(part)]);
            assert!((x - rx).abs() < 1e-9 && (y + ry).abs() < 1e-9 && (z - rz).abs() < 1e-9, "{name} {part}");
        }
        assert!(places[0][2] > places[1][2] && places[1][2] > places[7][2] && places[7][2] > places[11][2]);
        // Part k moves by k: whoever goes with one part moves as it does.
        let by_part = std::array::from_fn(|part| [part as f64, 0.0, 0.0]);
        let ways: Vec<Vec3> = parts.of_joints(&by_part).collect();
        let of = |joint: &str| ways[skeleton.joints.iter().position(|name| name == joint).unwrap()][0];
        assert_eq!([of("left_shoulder"), of("right_wrist"), of("left_ankle")], [1.0, 6.0, 11.0]);
        for (joint, want) in [("nose", 0.0), ("neck", 1.5), ("thorax", 1.5), ("pelvis", 7.5), ("spine", 4.5)] {
            assert!(!skeleton.joints.iter().any(|name| name == joint) || of(joint) == want, "{name} {joint}");
        }
    }
    let armless = Skeleton { joints: vec!["nose".into(), "left_hip".into()], ..skeleton("coco17") };
    assert!(Parts::of(&armless).is_none());
}

#[test]
fn a_frame_goes_there_and_back() {
    let joints = [[2.0, 1.0, -1.0], [2.2, 1.4, 0.5]];
    let frame = BodyFrame::around(&[[2.1, 1.2, 0.0]; PARTS], &joints);
    assert!((frame.at[2] + 1.0).abs() < 1e-12, "the lowest joint is at height 0");
    for p in [[0.3, -0.2, 1.1], [-0.5, 0.4, 0.0]] {
        let back = frame.local(frame.world(p));
        assert!(norm(sub(back, p)) < 1e-12);
    }
    let [x, y, _] = frame.world([1.0, 0.0, 0.0]);
    assert!(x.hypot(y) > frame.at[0].hypot(frame.at[1]) + 0.99, "away from the radar");
    let [x, y, _] = frame.world([0.0, 1.0, 0.0]);
    assert!(y.atan2(x) > frame.at[1].atan2(frame.at[0]), "left as the radar sees it: a larger azimuth");
}
