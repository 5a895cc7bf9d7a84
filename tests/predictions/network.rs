//! `predict`: what a network answers becomes a file of predictions.

use crate::program::{program, text};
use crate::{open, walk};
use mhp_inspector::dataset::{bundled_sample, read_pppr};
use mhp_inspector::geometry::{norm, sub};
use mhp_inspector::network::{Architecture, DenseLayer, Features, ModelCard, PoseNetwork};

/// Answers the joints that it reads, all of them `aside_m` to the left: one layer without weights off its diagonal.
fn echo(joints: &[String], aside_m: f32) -> PoseNetwork {
    let n = 3 * joints.len();
    let weight = (0..n * n).map(|k| if k / n == k % n { 1.0 } else { 0.0 }).collect();
    let bias = (0..n).map(|k| if k % 3 == 1 { aside_m } else { 0.0 }).collect();
    let card = ModelCard {
        features: Features::FitJoints,
        architecture: Architecture::Mlp,
        joints: joints.to_vec(),
        doppler_features: 32,
        maps: Vec::new(),
        centred: false,
        parameters: n * n + n,
        notes: Vec::new(),
    };
    let scales = || [vec![0.0; n], vec![1.0; n]];
    PoseNetwork { card, input: scales(), output: scales(), layers: vec![DenseLayer { inputs: n, weight, bias }] }
}

#[test]
fn a_network_reads_fits_and_its_answers_are_predictions() {
    let (dataset, home) = (walk(), tempfile::tempdir().unwrap());
    let data = bundled_sample().unwrap();
    let data = data.to_str().unwrap();
    let at = |name: &str| home.path().join(name).to_str().unwrap().to_owned();
    let fit = ["fit", data, "--frames", "0..3", "--preset", "baseline", "--iterations", "2", "--out", &at("fits")];
    assert!(program(home.path(), &fit).status.success());
    echo(&dataset.info().skeleton.joints, 0.25).write(&home.path().join("m.safetensors")).unwrap();
    let answer = program(
        home.path(),
        &[
            "predict",
            data,
            "--model",
            &at("m.safetensors"),
            "--frames",
            "0..3",
            "--params",
            &at("fits"),
            "--out",
            &at("p.npz"),
        ],
    );
    assert!(answer.status.success(), "{}", text(&answer));
    assert!(text(&answer).contains("mlp on fit-joints, 2652 parameters") && text(&answer).contains("PA-MAJPE"));
    let source = open(&home.path().join("p.npz"), &dataset).unwrap();
    assert_eq!(source.frames().collect::<Vec<_>>(), [0, 1, 2]);
    let names = dataset.file_names();
    for index in 0..3 {
        let file = home.path().join("fits/pppr").join(format!("{}.npz", names.of(index, dataset.frame_name(index))));
        let params = read_pppr(&file, None).unwrap();
        for (p, fit) in source.frame(index).unwrap().joints.iter().zip(params.positions()) {
            assert!((norm(sub(*p, *fit)) - 0.25).abs() < 1e-5);
        }
    }
    // A model of another skeleton is refused.
    echo(&dataset.info().skeleton.joints[..14], 0.0).write(&home.path().join("other.safetensors")).unwrap();
    let refused = program(home.path(), &["predict", data, "--model", &at("other.safetensors"), "--out", &at("q.npz")]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(
        text(&refused).contains("the model does not fit the data: it reads fits of 14 joints"),
        "{}",
        text(&refused)
    );
}
