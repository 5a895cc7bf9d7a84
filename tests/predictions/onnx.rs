//! Models in ONNX, exported by PyTorch, give the joints that PyTorch gave (`onnx/make.py`); and each fault is told.

use crate::program::{program, text};
use crate::{open, walk};
use mhp_inspector::config::Preset;
use mhp_inspector::dataset::npz::NpzArchive;
use mhp_inspector::dataset::{Dataset, bundled_sample, read_pppr};
use mhp_inspector::geometry::{Vec3, norm, sub};
use mhp_inspector::network::{JointModel, ParamsOf, open_model};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Frames that PyTorch answered.
const SHOWN: usize = 4;

fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/predictions/onnx").join(name)
}

fn opened(name: &str, description: Option<&Path>, dataset: &Dataset) -> Result<Box<dyn JointModel>, String> {
    open_model(&file(name), description, dataset, &Preset::Baseline.config()).map_err(|error| error.to_string())
}

fn fits(dataset: &Dataset) -> ParamsOf {
    let read = |index: usize| {
        let name = format!("fits/{}.npz", dataset.file_names().of(index, dataset.frame_name(index)));
        (index, Arc::new(read_pppr(&file(&name), None).unwrap()))
    };
    (0..=SHOWN).map(read).collect()
}

/// What PyTorch answered: persons of `joints` joints, frame after frame.
fn answers(key: &str, joints: usize) -> Vec<Vec<Vec3>> {
    let numbers = NpzArchive::open(&file("answers.npz")).unwrap().read(key).unwrap().data;
    numbers.as_chunks::<3>().0.chunks(joints).map(<[Vec3]>::to_vec).collect()
}

/// The persons that a model answers in all frames.
fn answered(model: &dyn JointModel, dataset: &Dataset, params: &ParamsOf) -> Vec<Vec<Vec3>> {
    let of_frame = |index: usize| {
        let read = model.read(dataset, index, params).unwrap();
        read.iter().flat_map(|input| model.answer(input).unwrap()).collect::<Vec<_>>()
    };
    (0..SHOWN).flat_map(of_frame).collect()
}

fn farthest(answered: &[Vec<Vec3>], wanted: &[Vec<Vec3>]) -> f64 {
    assert_eq!(answered.len(), wanted.len());
    let apart = |(a, b): (&Vec<Vec3>, &Vec<Vec3>)| {
        assert_eq!(a.len(), b.len());
        a.iter().zip(b).map(|(a, b)| norm(sub(*a, *b))).fold(0.0, f64::max)
    };
    answered.iter().zip(wanted).map(apart).fold(0.0, f64::max)
}

#[test]
fn a_convolution_over_maps_answers_as_in_pytorch_in_every_opset() {
    let (dataset, wanted) = (walk(), answers("maps", 17));
    assert!(farthest(&wanted[..1], &wanted[1..2]) > 1e-3, "the frames are told apart");
    for opset in 13..=18 {
        let model = opened(&format!("maps-{opset}.onnx"), Some(&file("maps.toml")), &dataset).unwrap();
        assert!(!model.needs_fit() && model.summary().contains(&format!("(opset {opset})")), "{}", model.summary());
        let off = farthest(&answered(&*model, &dataset, &ParamsOf::new()), &wanted);
        assert!(off < 1e-4, "opset {opset}: {off} m");
    }
}

#[test]
fn attention_over_fitted_joints_answers_as_in_pytorch() {
    let dataset = walk();
    let model = opened("lift.onnx", None, &dataset).unwrap();
    assert!(model.needs_fit() && model.reach() == 1 && model.joints().len() == 17);
    let off = farthest(&answered(&*model, &dataset, &fits(&dataset)), &answers("lift", 17));
    assert!(off < 1e-4, "{off} m");
    assert_eq!(model.read(&dataset, 9, &fits(&dataset)).unwrap_err(), "has no fit");
}

#[test]
fn people_with_a_score_are_those_of_pytorch() {
    let (dataset, params) = (walk(), ParamsOf::new());
    let wanted = answers("set", 14);
    let model = opened("set.onnx", None, &dataset).unwrap();
    let off = farthest(&answered(&*model, &dataset, &params), &wanted);
    assert!(off < 1e-4, "{off} m");
    // Who has a lower score than asked is nobody.
    let scores = NpzArchive::open(&file("answers.npz")).unwrap().read("set_scores").unwrap().data;
    let mut sorted = scores.clone();
    sorted.sort_by(f64::total_cmp);
    let least = 0.5 * (sorted[3] + sorted[4]);
    let home = tempfile::tempdir().unwrap();
    let strict = home.path().join("strict.toml");
    let text = std::fs::read_to_string(file("set.onnx.toml")).unwrap();
    std::fs::write(&strict, text.replace("least_score = 0.0", &format!("least_score = {least}"))).unwrap();
    let model = opened("set.onnx", Some(&strict), &dataset).unwrap();
    let there: Vec<Vec<Vec3>> =
        wanted.iter().zip(&scores).filter(|(_, score)| **score >= least).map(|(joints, _)| joints.clone()).collect();
    assert_eq!(there.len(), 4);
    assert!(farthest(&answered(&*model, &dataset, &params), &there) < 1e-4);
}

#[test]
fn parameters_of_every_joint_are_read_as_described() {
    let dataset = walk();
    let model = opened("pppr.onnx", None, &dataset).unwrap();
    let off = farthest(&answered(&*model, &dataset, &fits(&dataset)), &answers("pppr", 17));
    assert!(off < 1e-4, "{off} m");
}

/// The maps and points of a fit are those that `export` writes.
#[test]
fn maps_and_points_of_a_fit_are_what_export_writes() {
    let (dataset, home) = (walk(), tempfile::tempdir().unwrap());
    let data = bundled_sample().unwrap();
    let out = home.path().join("out");
    let fits_folder = file("fits");
    let exported = program(
        home.path(),
        &[
            &["export", data.to_str().unwrap(), "--what", "heatmap,pc", "--frames", "0..1", "--format", "npz"]
                as &[&str],
            &["--params", fits_folder.to_str().unwrap(), "--out", out.to_str().unwrap()],
        ]
        .concat(),
    );
    assert!(exported.status.success(), "{}", text(&exported));
    let read = |is: &str, shape: &str| {
        let path = home.path().join(format!("{is}.toml"));
        let input = format!("[[input]]\nis = \"{is}\"\npoints = 4096\nshape = {shape}\n");
        std::fs::write(&path, format!("{input}[output]\nskeleton = \"coco17\"\nunit = \"m\"\n")).unwrap();
        let model = open_model(&file("open.onnx"), Some(&path), &dataset, &Preset::default().config()).unwrap();
        let read = model.read(&dataset, 0, &fits(&dataset)).unwrap();
        let numbers = &read[0].tensors[0];
        let mean = numbers.iter().map(|x| f64::from(*x)).sum::<f64>() / numbers.len() as f64;
        let [got, ..] = model.answer(&read[0]).unwrap()[0][0];
        assert!((got - mean).abs() < 1e-3 * mean.abs().max(1.0), "{got} for {mean}");
        numbers.clone()
    };
    let maps = read("pppr-heatmap", "[1, 2, 256, 128]");
    let written = Dataset::open(&out.join("heatmap"), &mhp_inspector::task::Progress::new()).unwrap().load(0).unwrap();
    let wanted = written.maps.iter().flat_map(|map| &map.data).map(|x| *x as f32);
    assert!(maps.iter().zip(wanted).all(|(got, wanted)| (got - wanted).abs() <= 1e-6 * wanted.abs()));
    // The brightest first; x, y, z, radial velocity, intensity.
    let points = read("pppr-pc", "[1, 1, 4096, 5]");
    let name = dataset.file_names().of(0, dataset.frame_name(0)).into_owned();
    let mut cloud = NpzArchive::open(&out.join("pc").join(format!("{name}.npz"))).unwrap();
    let mut wanted: Vec<Vec<f64>> = cloud.read("points").unwrap().data.chunks(5).map(<[f64]>::to_vec).collect();
    wanted.sort_by(|a, b| b[4].total_cmp(&a[4]));
    assert!(!wanted.is_empty() && points[5 * wanted.len()..].iter().all(|x| *x == 0.0));
    for (got, wanted) in points.chunks(5).zip(&wanted) {
        assert!(
            got.iter().zip(wanted).all(|(got, wanted)| (f64::from(*got) - wanted).abs() < 1e-5),
            "{got:?} {wanted:?}"
        );
    }
}

#[test]
fn predict_writes_what_a_model_in_onnx_answers() {
    let (dataset, home) = (walk(), tempfile::tempdir().unwrap());
    let data = bundled_sample().unwrap();
    let (model, out) = (file("maps-17.onnx"), home.path().join("p.npz"));
    let (model, described) = (model.to_str().unwrap(), file("maps.toml"));
    let run = |extra: &[&str]| {
        let all =
            ["predict", data.to_str().unwrap(), "--model", model, "--frames", "0..4", "--out", out.to_str().unwrap()];
        program(home.path(), &[&all, extra].concat())
    };
    let undescribed = run(&[]);
    assert_eq!(undescribed.status.code(), Some(2));
    let said = text(&undescribed);
    assert!(said.contains("maps-17.onnx.toml") && said.contains("--description") && said.contains("`maps`"), "{said}");
    let answer = run(&["--description", described.to_str().unwrap()]);
    assert!(answer.status.success(), "{}", text(&answer));
    assert!(text(&answer).contains("maps-17.onnx in ONNX (opset 17), ") && text(&answer).contains("PA-MAJPE"));
    let (source, wanted) = (open(&out, &dataset).unwrap(), answers("maps", 17));
    for (index, wanted) in wanted.iter().enumerate() {
        let off = farthest(&[source.frame(index).unwrap().joints.clone()], std::slice::from_ref(wanted));
        assert!(off < 1e-4);
    }
}

#[test]
fn what_is_wrong_with_a_model_is_told() {
    let (dataset, home) = (walk(), tempfile::tempdir().unwrap());
    let why = opened("det.onnx", None, &dataset).err().unwrap();
    assert!(why.contains("det.onnx") && why.contains("operators that are not known here: `Det` (opset 13)"), "{why}");
    let good = std::fs::read(file("maps-17.onnx")).unwrap();
    let path = home.path().join("m.onnx");
    let told = |bytes: &[u8]| {
        std::fs::write(&path, bytes).unwrap();
        let opened = open_model(&path, Some(&file("maps.toml")), &dataset, &Preset::Baseline.config());
        opened.err().map(|error| error.to_string())
    };
    assert_eq!(told(&good), None);
    for bytes in [&good[..good.len() / 2], b"", b"no model at all"] {
        let why = told(bytes).unwrap();
        assert!(why.contains("m.onnx: no model in ONNX") && !why.contains('\n'), "{why}");
    }
    // Whatever is damaged: an answer or a message, never the end of the program.
    let mut seed = 1u64;
    for _ in 0..300 {
        let mut bytes = good.clone();
        for _ in 0..4 {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            let at = (seed >> 33) as usize % bytes.len();
            bytes[at] = (seed >> 20) as u8;
        }
        std::fs::write(&path, &bytes).unwrap();
        if let Ok(model) = open_model(&path, Some(&file("maps.toml")), &dataset, &Preset::Baseline.config()) {
            let read = model.read(&dataset, 0, &ParamsOf::new()).unwrap();
            let _ = model.answer(&read[0]);
        }
    }
    for (from, to, expected) in [
        ("is = \"map\"", "is = \"map\"\nviews = [\"front\"]", "the map `front`; the data set has hm_hori, hm_vert"),
        ("[64, 32]", "[64, 64]", "is [1, 2, 64, 32]; the data give 8192 numbers"),
        ("is = \"map\"", "is = \"map\"\ntensor = \"x\"", "no [[input]] has tensor = \"maps\""),
        ("unit = \"m\"", "unit = \"m\"\ntensor = \"y\"", "it gives no `y`"),
        ("is = \"map\"", "is = \"map\"\nshape = [1, 4, 32, 32]", "the model's is [?, 2, 64, 32]"),
        (
            "is = \"map\"",
            "is = \"map\"\nshape = [9000000000000000000, 2, 64, 32]",
            "is [9000000000000000000, 2, 64, 32]; the data give",
        ),
        ("\"coco17\"", "\"hupr14\"", "it answers [1, 17, 3]; expected a multiple of 14 x 3"),
    ] {
        let described = home.path().join("d.toml");
        std::fs::write(&described, std::fs::read_to_string(file("maps.toml")).unwrap().replace(from, to)).unwrap();
        let why = match opened("maps-17.onnx", Some(&described), &dataset) {
            Err(why) => why,
            Ok(model) => model.answer(&model.read(&dataset, 0, &ParamsOf::new()).unwrap()[0]).unwrap_err(),
        };
        assert!(why.contains(expected), "{why}");
    }
}
