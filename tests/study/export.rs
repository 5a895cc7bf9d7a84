//! A state taken home: PLY and CSV, read back by readers that know nothing of the program.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::blob;
use mhp_inspector::body::{Group, Pppr, PpprShape, Skeleton};
use mhp_inspector::dataset::read_pppr;
use mhp_inspector::mhp::{StepReport, Terms};
use mhp_inspector::study::{CurveRow, curves_csv, ply, write_curves, write_ply};
use std::collections::BTreeMap;
use std::process::Command;

/// A PLY as its own header describes it: vertices by property name, and the comments.
struct Ply {
    properties: Vec<(String, String)>,
    vertices: Vec<BTreeMap<String, f64>>,
    comments: Vec<String>,
}

fn read_ply(bytes: &[u8]) -> Ply {
    let end = bytes.windows(11).position(|window| window == b"end_header\n").unwrap() + 11;
    let header = std::str::from_utf8(&bytes[..end]).unwrap();
    assert!(header.is_ascii());
    let mut lines = header.lines();
    assert_eq!((lines.next(), lines.next()), (Some("ply"), Some("format binary_little_endian 1.0")));
    let (mut properties, mut comments, mut count) = (Vec::new(), Vec::new(), 0);
    for line in lines {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            ["comment", ..] => comments.push(line["comment ".len()..].to_owned()),
            ["element", "vertex", n] => count = n.parse().unwrap(),
            ["property", kind, name] => properties.push((kind.to_owned(), name.to_owned())),
            ["end_header"] => {}
            _ => unreachable!("{line}"),
        }
    }
    let mut data = bytes[end..].chunks_exact(4).map(|chunk| <[u8; 4]>::try_from(chunk).unwrap());
    let vertices: Vec<BTreeMap<String, f64>> = (0..count)
        .map(|_| {
            let value = |(kind, name): &(String, String)| {
                let raw = data.next().unwrap();
                let number = match kind.as_str() {
                    "float" => f64::from(f32::from_le_bytes(raw)),
                    "int" => f64::from(i32::from_le_bytes(raw)),
                    _ => unreachable!("{kind}"),
                };
                (name.clone(), number)
            };
            properties.iter().map(value).collect()
        })
        .collect();
    assert_eq!((data.next(), (bytes.len() - end) % 4), (None, 0), "nothing follows the last vertex");
    Ply { properties, vertices, comments }
}

/// Two persons with numbers that are all different.
fn params() -> Pppr {
    let mut params = Pppr::zeros(PpprShape { persons: 2, joints: 17, doppler_features: 3 });
    let mut x = 0.0;
    for group in Group::ALL {
        for value in params.group_mut(group) {
            x += 0.618;
            *value = 3.0 * f64::sin(x);
        }
    }
    params
}

#[test]
fn a_plain_reader_finds_every_gaussian() {
    let (params, skeleton) = (params(), Skeleton::preset("coco17").unwrap());
    let read = read_ply(&ply(&params, &skeleton));
    let splat = "x y z nx ny nz f_dc_0 f_dc_1 f_dc_2 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3";
    let names: Vec<&str> = read.properties.iter().map(|(_, name)| name.as_str()).collect();
    assert_eq!(names[..17].join(" "), splat, "the order that viewers of splats expect");
    assert_eq!(names[17..].join(" "), "vx vy vz person joint");
    assert!(read.properties[..20].iter().all(|(kind, _)| kind == "float"));
    assert_eq!(read.vertices.len(), 34);
    for (flat, vertex) in read.vertices.iter().enumerate() {
        let same = |names: [&str; 3], wanted: [f64; 3]| {
            for (name, wanted) in names.into_iter().zip(wanted) {
                assert!((vertex[name] - wanted).abs() < 1e-6, "{flat} {name}: {} {wanted}", vertex[name]);
            }
        };
        same(["x", "y", "z"], params.position(flat));
        same(["vx", "vy", "vz"], params.velocity(flat));
        same(["nx", "ny", "nz"], [0.0; 3]);
        // As a viewer decodes it.
        same(["scale_0", "scale_1", "scale_2"], params.scale(flat).map(f64::ln));
        let alpha = 1.0 / (1.0 + (-vertex["opacity"]).exp());
        assert!((alpha - params.opacity(flat)).abs() < 1e-6);
        let q = params.rotation(flat);
        let length = q.iter().map(|c| c * c).sum::<f64>().sqrt();
        for (k, c) in q.into_iter().enumerate() {
            assert!((vertex[&format!("rot_{k}")] - c / length).abs() < 1e-6, "w x y z of length 1");
        }
        assert_eq!((vertex["person"], vertex["joint"]), ((flat / 17) as f64, (flat % 17) as f64));
    }
}

#[test]
fn sides_have_their_colours_and_joints_their_names() {
    let skeleton = Skeleton::preset("coco17").unwrap();
    let read = read_ply(&ply(&params(), &skeleton));
    let colour = |name: &str| {
        let vertex = &read.vertices[skeleton.joint(name).unwrap()];
        ["f_dc_0", "f_dc_1", "f_dc_2"].map(|key| ((vertex[key] * 0.282_094_79 + 0.5) * 255.0).round() as u8)
    };
    assert_eq!(colour("left_wrist"), [0x4D, 0xA3, 0xFF]);
    assert_eq!(colour("right_wrist"), [0xFF, 0x9F, 0x45]);
    assert_eq!(colour("nose"), [0x9A, 0xA3, 0xAF]);
    assert!(read.comments.contains(&"joint 9 left_wrist".to_owned()), "{:?}", read.comments);
    assert!(read.comments.iter().any(|line| line.contains("x forward, y left, z up")));
}

#[test]
fn odd_numbers_and_names_stay_readable() {
    let mut skeleton = Skeleton::preset("coco17").unwrap();
    skeleton.joints[0] = "näse\nend_header\nproperty int x".into();
    let mut params = params();
    params.joint_mut(Group::Rotation, 0).fill(0.0);
    params.joint_mut(Group::Beta, 0)[0] = 1e300;
    let read = read_ply(&ply(&params, &skeleton));
    assert_eq!(read.vertices.len(), 34);
    assert_eq!(["rot_0", "rot_1", "rot_2", "rot_3"].map(|key| read.vertices[0][key]), [1.0, 0.0, 0.0, 0.0]);
    assert!(read.vertices.iter().flat_map(BTreeMap::values).all(|x| x.is_finite()));
}

fn report(iteration: usize, loss: f64, iou: Vec<Option<f64>>) -> StepReport {
    let terms = Terms::from_fn(|term| match term.key {
        "em" => 0.1 + 0.2,
        "bone" => 1e-17,
        "time" => 6.0,
        _ => 0.0,
    });
    StepReport { iteration, loss, terms, iou: iou.into(), converged: iteration > 0 }
}

#[test]
fn curves_read_back_exactly() {
    let arrays = ["hori".to_owned(), "a, \"b\"".to_owned()];
    let reports = [report(0, 1.0 / 3.0, vec![Some(0.25), None]), report(1, f64::NAN, vec![Some(0.5), Some(1.0)])];
    let rows = [
        CurveRow { branch: 0, report: &reports[0], majpe_mm: None, flag: None },
        CurveRow { branch: 2, report: &reports[1], majpe_mm: Some(81.5), flag: Some("τ 10 → 5 %, \"w_em\"\n0.7") },
    ];
    let table = curves_csv(&arrays, rows).unwrap();
    let mut reader = csv::Reader::from_reader(table.as_slice());
    let terms = ["em", "bone", "rigid", "joint", "sep", "coll", "time", "prior", "net", "given"];
    let last = ["iou_hori", "iou_a, \"b\"", "majpe_mm", "converged", "flag"];
    let head: Vec<&str> = ["iteration", "branch", "loss"].into_iter().chain(terms).chain(last).collect();
    assert_eq!(reader.headers().unwrap().iter().collect::<Vec<_>>(), head);
    let read: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
    assert_eq!(read.len(), 2);
    assert_eq!(read[0][2].parse(), Ok(1.0 / 3.0));
    assert_eq!([3, 4, 9].map(|k| read[0][k].parse()), [Ok(0.1 + 0.2), Ok(1e-17), Ok(6.0)]);
    assert_eq!(read[0].iter().skip(13).collect::<Vec<_>>(), ["0.25", "", "", "false", ""]);
    assert_eq!((&read[1][0], &read[1][1], &read[1][2]), ("1", "2", ""), "what is not finite is empty");
    assert_eq!(read[1].iter().skip(13).collect::<Vec<_>>(), ["0.5", "1", "81.5", "true", "τ 10 → 5 %, \"w_em\"\n0.7"]);
    let empty = curves_csv(&arrays, []).unwrap();
    assert_eq!(String::from_utf8(empty).unwrap().lines().count(), 1, "a head and nothing else");
}

#[test]
fn a_file_that_cannot_be_written_leaves_the_old_one() {
    let folder = tempfile::tempdir().unwrap();
    let nowhere = folder.path().join("none/a.ply");
    let error = write_ply(&nowhere, &params(), &Skeleton::preset("coco17").unwrap()).unwrap_err().to_string();
    assert!(error.contains("a.ply: cannot be written"), "{error}");
    let error = write_curves(&folder.path().join("none/a.csv"), &[], []).unwrap_err().to_string();
    assert!(error.contains("a.csv: cannot be written"), "{error}");
    let file = folder.path().join("a.ply");
    std::fs::write(&file, "old").unwrap();
    write_ply(&file, &params(), &Skeleton::preset("coco17").unwrap()).unwrap();
    assert_eq!(read_ply(&std::fs::read(&file).unwrap()).vertices.len(), 34);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "no temporary file stays");
}

#[test]
fn fit_writes_both_beside_the_parameters() {
    let folder = tempfile::tempdir().unwrap();
    blob::write_dataset(folder.path(), 2);
    let out = tempfile::tempdir().unwrap();
    let out = out.path().join("out");
    let fit = |args: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_mhp-inspector"));
        command.arg("fit").arg(folder.path()).args(["--iterations", "3"]).args(args).output().unwrap()
    };
    let output = fit(&["--out", out.to_str().unwrap(), "--ply", "--curves"]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    for frame in ["frames_000", "frames_001"] {
        let params = read_pppr(&out.join(format!("pppr/{frame}.npz")), None).unwrap();
        let read = read_ply(&std::fs::read(out.join(format!("pppr/{frame}.ply"))).unwrap());
        assert_eq!(read.vertices.len(), 17);
        assert!((read.vertices[3]["x"] - params.position(3)[0]).abs() < 1e-6);
        let mut reader = csv::Reader::from_path(out.join(format!("curves/{frame}.csv"))).unwrap();
        let rows: Vec<BTreeMap<String, String>> = reader.deserialize().map(Result::unwrap).collect();
        assert_eq!(rows.iter().map(|row| row["iteration"].as_str()).collect::<Vec<_>>(), ["0", "1", "2", "3"]);
        let mut summary = csv::Reader::from_path(out.join("summary.csv")).unwrap();
        let summary: Vec<BTreeMap<String, String>> = summary.deserialize().map(Result::unwrap).collect();
        let last = summary.iter().find(|row| row["frame"].replace('/', "_") == frame).unwrap();
        for column in ["loss", "em", "bone", "time", "iou_hori", "iou_vert", "majpe_mm"] {
            assert_eq!(rows[3][column], last[column], "{column}");
        }
        assert_ne!(rows[0]["loss"], rows[3]["loss"]);
    }
    let alone = fit(&["--ply"]);
    assert_eq!(alone.status.code(), Some(2), "--ply needs --out");
}
