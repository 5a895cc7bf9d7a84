//! What every line of the table keeps, the term that only unit tests have among them.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use super::{Inputs, TERMS, TermGroup, TermId, Terms, WHOLE, Weight, evaluate, formula, weighted_sum_into};
use crate::body::{Group, Pppr, PpprShape, Skeleton};
use crate::config::{Field, FitConfig, Value};
use crate::geometry::Vec3;

const SHAPE: PpprShape = PpprShape { persons: 2, joints: 4, doppler_features: 1 };

fn skeleton() -> Skeleton {
    Skeleton {
        joints: ["a", "b", "c", "d"].map(str::to_owned).to_vec(),
        bones: vec![[0, 1], [1, 2], [2, 3]],
        bone_lengths_m: vec![0.3, 0.4, 0.2],
        angles: vec![[0, 1, 2], [1, 2, 3]],
    }
}

/// A skeleton of one bone of 0.4 m, and one person whose joints are so far apart.
pub(in super::super) fn two_joints(distance_m: f64) -> (Skeleton, Pppr) {
    let skeleton = Skeleton {
        joints: vec!["a".into(), "b".into()],
        bones: vec![[0, 1]],
        bone_lengths_m: vec![0.4],
        angles: vec![],
    };
    let mut params = Pppr::zeros(PpprShape { persons: 1, joints: 2, doppler_features: 1 });
    params.set_vec3(Group::Position, 1, [distance_m, 0.0, 0.0]);
    (skeleton, params)
}

/// Two people in each other's way, with every term above 0.
fn params() -> Pppr {
    let mut params = Pppr::zeros(SHAPE);
    for joint in 0..SHAPE.total_joints() {
        let turn = |k: usize| ((joint * 3 + k) as f64 * 1.7).sin();
        let person = (joint / SHAPE.joints) as f64;
        params.set_vec3(
            Group::Position,
            joint,
            [
                2.5 + 0.04 * turn(0),
                0.06 * person + 0.05 * turn(1),
                0.3 * (joint % SHAPE.joints) as f64 + 0.05 * turn(2),
            ],
        );
        params.set_vec3(Group::Velocity, joint, std::array::from_fn(|k| 0.4 * turn(k + 7)));
    }
    params
}

const ANCHORS: [Vec3; 2] = [[2.4, 0.1, 0.5], [2.6, 0.0, 0.4]];
/// Two joints of the first person and one of the second.
const GIVEN: [Option<Vec3>; 6] =
    [Some([2.4, 0.1, 0.1]), None, Some([2.6, 0.0, 0.7]), None, None, Some([2.5, 0.2, 0.2])];

fn config() -> FitConfig {
    FitConfig {
        w_em: 0.3,
        w_kine: 0.7,
        w_time: 3.0,
        w_given: 0.4,
        w_dummy: 0.2,
        theta_max_deg: 120.0,
        ..FitConfig::default()
    }
}

/// Values and gradients of the terms; that of L_EM is 0.25 and 0.
fn evaluated(params: &Pppr, config: &FitConfig, gains: &[f64; TERMS.len()]) -> (Terms, [Pppr; Weight::COUNT]) {
    let mut gradients = std::array::from_fn(|_| Pppr::zeros(SHAPE));
    let inputs = Inputs { skeleton: &skeleton(), config, params, anchors: &ANCHORS, given: &GIVEN };
    (evaluate(&inputs, 0.25, gains, &mut gradients), gradients)
}

fn differences(params: &Pppr, value: impl Fn(&Pppr) -> f64) -> Pppr {
    const STEP: f64 = 1e-6;
    let mut slopes = Pppr::zeros(SHAPE);
    for group in Group::ALL {
        for i in 0..params.group(group).len() {
            let at = |offset: f64| {
                let mut moved = params.clone();
                moved.group_mut(group)[i] += offset;
                value(&moved)
            };
            slopes.group_mut(group)[i] = (at(STEP) - at(-STEP)) / (2.0 * STEP);
        }
    }
    slopes
}

fn assert_close(what: &str, got: &Pppr, want: &Pppr) {
    for group in Group::ALL {
        for (i, (got, want)) in got.group(group).iter().zip(want.group(group)).enumerate() {
            assert!((got - want).abs() < 1e-6 * want.abs().max(1.0), "{what}, {} [{i}]: {got}, {want}", group.key());
        }
    }
}

#[test]
fn every_gradient_is_that_of_its_value() {
    let (params, config) = (params(), config());
    // That of a window's prior is held beside the window.
    for term in TermId::all().filter(|term| !term.is_of_maps() && !term.is_of_windows()) {
        let (values, gradients) = evaluated(&params, &config, &term.alone());
        assert!(values[term] > 0.0, "{} says nothing here", term.label);
        let want = differences(&params, |params| evaluated(params, &config, &WHOLE).0[term]);
        assert_close(term.label, &gradients[term.weight as usize], &want);
    }
}

#[test]
fn loss_and_gradient_are_the_weighted_sums_the_dummy_term_among_them() {
    let (params, config) = (params(), config());
    let (values, gradients) = evaluated(&params, &config, &WHOLE);
    let sum: f64 = values.iter().map(|(term, value)| term.weight.of(&config) * value).sum();
    assert!((values.loss(&config) - sum).abs() < 1e-12);
    let without = FitConfig { w_dummy: 0.0, ..config };
    let (fewer, _) = evaluated(&params, &without, &WHOLE);
    assert!(fewer.get("dummy") == Some(0.0) && fewer.loss(&without) < values.loss(&config) - 1.0);
    let mut total = Pppr::zeros(SHAPE);
    weighted_sum_into(&config, &gradients, &mut total);
    assert_close("L", &total, &differences(&params, |params| evaluated(params, &config, &WHOLE).0.loss(&config)));
}

#[test]
fn a_line_of_the_table_says_all_there_is_to_say() {
    for term in TermId::all() {
        assert_eq!(TermId::of(term.key), Some(term), "{} twice", term.key);
        assert!(term.label.starts_with("L_") && !term.formula.is_empty() && term.help.ends_with('.'), "{}", term.key);
    }
    for &weight in Weight::ALL {
        let field = Field::of_key(weight.key()).unwrap();
        let mut config = FitConfig::default();
        field.set(&mut config, Value::Number(0.375));
        assert_eq!(weight.of(&config), 0.375, "{}", weight.key());
        assert!(weight.terms().next().is_some(), "{} weighs nothing", weight.key());
        assert!(weight.terms().all(|term| !term.scope.needs_weight() || weight.of(&FitConfig::default()) == 0.0));
    }
    let grouped: usize = TermGroup::ALL.iter().map(|group| group.terms().count()).sum();
    assert_eq!(grouped, TERMS.len());
    let known = "L = w_EM·L_EM + w_kine·(L_bone + L_rigid + L_joint + L_sep + L_coll) + w_time·L_time + w_prior·L_prior + w_net·L_net + w_given·L_given + w_dummy·L_dummy";
    assert_eq!(formula(), known);
}

#[test]
fn values_read_back_by_their_keys_the_dummy_term_too() {
    let values = Terms::from_fn(|term| term.key.len() as f64 + 0.1);
    let text = serde_json::to_string(&values).unwrap();
    assert!(text.starts_with("{\"em\":2.1,") && text.contains("\"dummy\":5.1"), "{text}");
    assert_eq!(serde_json::from_str::<Terms>(&text).unwrap(), values);
    let known = values.map(|value| Some(value).filter(|value| *value > 4.0));
    assert_eq!(serde_json::from_str::<Terms<Option<f64>>>(&serde_json::to_string(&known).unwrap()).unwrap(), known);
}

/// A pin had no L_time once, a journal of a study wrote the terms by their places.
#[test]
fn older_files_are_read() {
    let pin: Terms =
        serde_json::from_str("{\"em\":0.5,\"bone\":1,\"rigid\":2,\"joint\":3,\"sep\":4,\"coll\":5}").unwrap();
    assert_eq!((pin.get("coll"), pin.get("time")), (Some(5.0), Some(0.0)));
    let row: Terms<Option<f64>> = serde_json::from_str("[0.5,1,2,3,4,5.5]").unwrap();
    assert_eq!((row.get("em"), row.get("coll"), row.get("time")), (Some(Some(0.5)), Some(Some(5.5)), Some(None)));
    let later: Terms = serde_json::from_str("{\"em\":0.5,\"unheard_of\":[1]}").unwrap();
    assert_eq!(later.get("em"), Some(0.5));
    let wrong = serde_json::from_str::<Terms>("3").unwrap_err().to_string();
    assert!(wrong.contains("the terms of a loss by their keys: em, bone"), "{wrong}");
}
