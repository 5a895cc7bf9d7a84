//! A target for each reader: what it reads, changed, is an answer or one error.

use crate::material::{self, File};
use crate::mutate;
use mhp_inspector::config::FitConfig;
use mhp_inspector::dataset::npz::{NPY_KEY, NpzArchive};
use mhp_inspector::dataset::{Dataset, Manifest, OpenOptions, RadarPreset, RoomTransforms, read_pppr};
use mhp_inspector::labels::{LabelPlace, LabelStore, read_journal, read_table};
use mhp_inspector::session::SessionFile;
use mhp_inspector::study::read_summary;
use mhp_inspector::study::run::Run;
use mhp_inspector::task::Progress;
use rand::Rng as _;
use rand::rngs::StdRng;
use std::ops::Range;
use std::path::Path;

/// Whatever an archive holds, in every way that it can be asked.
pub(crate) fn archive(random: &mut StdRng, folder: &Path) {
    let mut entries = material::frame();
    if random.random() {
        material::hostile_entry(&mut entries, random);
    }
    let mut bytes = match random.random_range(0..4) {
        0 => entries.swap_remove(0).1,
        which => material::npz(&entries, which == 1),
    };
    if random.random_bool(0.7) {
        mutate::bytes(&mut bytes, random);
    }
    let path = folder.join("a.npz");
    std::fs::write(&path, &bytes).unwrap();
    let Ok(mut file) = NpzArchive::open(&path) else { return };
    let _ = file.entries();
    for key in [file.keys().to_vec(), vec![NPY_KEY.into()]].concat() {
        let read = file.read(&key);
        if let Ok(array) = &read {
            assert_eq!(array.shape.iter().product::<usize>(), array.data.len());
        }
        let _ = (file.entry(&key), file.read_texts(&key), file.read_flags(&key), file.verify(&key));
        let _ = (file.read_slab(&key, 0), file.read_slabs(&key, 1..3), file.read_amplitudes(&key, 8, 3));
    }
}

pub(crate) fn manifest(random: &mut StdRng, _: &Path) {
    let text = mutate::text(material::MANIFEST, random);
    let Ok(text) = String::from_utf8(text) else { return };
    if let Err(error) = Manifest::parse(&text, Path::new("some/dataset.toml")) {
        let told = error.to_string();
        assert!(told.starts_with("some/dataset.toml") && !told.contains('\n'), "{told}");
    }
}

pub(crate) fn fit_configuration(random: &mut StdRng, _: &Path) {
    let text = FitConfig::default().to_toml();
    let Ok(text) = String::from_utf8(mutate::text(&text, random)) else { return };
    match FitConfig::parse(&text, Path::new("FIT.toml")) {
        Ok(config) => assert_eq!(FitConfig::parse(&config.to_toml(), Path::new("again")).unwrap(), config),
        Err(error) => assert!(error.to_string().starts_with("FIT.toml"), "{error}"),
    }
}

/// PPPR parameters of two joints.
pub(crate) fn parameters(random: &mut StdRng, folder: &Path) {
    let array =
        |shape: &str, n: usize| material::npy("<f4", shape, false, &material::f4((0..n).map(|k| k as f32 * 0.1)));
    let mut entries = [
        ("position", array("(1, 2, 3)", 6)),
        ("log_scale", array("(1, 2, 3)", 6)),
        ("rotation", array("(1, 2, 4)", 8)),
        ("velocity", array("(1, 2, 3)", 6)),
        ("beta", array("(1, 2)", 2)),
        ("omega", array("(1, 2, 4)", 8)),
    ];
    if random.random_bool(0.6) {
        material::hostile_entry(&mut entries, random);
    }
    let mut bytes = material::npz(&entries, random.random());
    if random.random_bool(0.5) {
        mutate::bytes(&mut bytes, random);
    }
    let path = folder.join("p.npz");
    std::fs::write(&path, bytes).unwrap();
    if let Ok(params) = read_pppr(&path, None) {
        assert!(params.is_finite());
    }
}

/// Opens a folder and reads all of it, as every command does.
pub(crate) fn read_all(folder: &Path) {
    let Ok(dataset) = Dataset::open(folder, &Progress::new()) else { return };
    for frame in 0..dataset.len().min(20) {
        let _ = (dataset.load(frame), dataset.frame_name(frame), dataset.sequence(frame), dataset.recent_maps(frame));
    }
    let _ = (dataset.maps(0..dataset.len().min(20)).count(), dataset.fingerprint());
}

/// Lays out a data set of which one file is changed.
fn changed(files: &[File], random: &mut StdRng, folder: &Path) {
    let chosen = random.random_range(0..files.len());
    let files = files.iter().enumerate().map(|(k, (name, bytes))| {
        let mut bytes = bytes.clone();
        let text = Path::new(name).extension().is_some_and(|ending| ending == "toml" || ending == "json");
        if k == chosen && text {
            bytes = mutate::text(&String::from_utf8_lossy(&bytes), random);
        } else if k == chosen {
            mutate::bytes(&mut bytes, random);
        }
        ((*name).to_owned(), bytes)
    });
    material::lay_out(folder, &files.collect::<Vec<_>>());
}

pub(crate) fn capture(random: &mut StdRng, folder: &Path) {
    changed(&material::capture(random.random_range(0..4)), random, folder);
    read_all(folder);
}

pub(crate) fn sample_cube(random: &mut StdRng, folder: &Path) {
    let mut files = material::sample_cube(random.random());
    hostile_array(&mut files, 1..2, random);
    changed(&files, random, folder);
    read_all(folder);
    read_stages(folder);
}

pub(crate) fn cascade(random: &mut StdRng, folder: &Path) {
    changed(&material::cascade(random.random()), random, folder);
    read_all(folder);
    read_stages(folder);
}

/// A radar's file, and the widths that follow from it.
pub(crate) fn radar(random: &mut StdRng, _: &Path) {
    let Ok(text) = String::from_utf8(mutate::text(material::RADAR, random)) else { return };
    match RadarPreset::parse(&text, Path::new("lab.toml")) {
        Ok(preset) => {
            let _ = preset.view_fft().map(|fft| fft.map(|fft| fft.point_spread()));
            assert!(RadarPreset::parse(&preset.to_toml(), Path::new("again")).is_ok(), "{}", preset.to_toml());
        }
        Err(error) => assert!(error.to_string().starts_with("lab.toml"), "{error}"),
    }
}

pub(crate) fn raw_clip(random: &mut StdRng, folder: &Path) {
    let mut files = material::raw_clip();
    hostile_array(&mut files, 0..2, random);
    changed(&files, random, folder);
    read_all(folder);
    read_stages(folder);
}

pub(crate) fn raw_pair(random: &mut StdRng, folder: &Path) {
    changed(&material::raw_pair(), random, folder);
    read_all(folder);
    read_stages(folder);
}

/// Puts a hostile header before one of some arrays, now and then.
fn hostile_array(files: &mut [File], range: Range<usize>, random: &mut StdRng) {
    if random.random_bool(0.3) {
        let chosen = random.random_range(range);
        let mut entry = [("array", files[chosen].1.clone())];
        material::hostile_entry(&mut entry, random);
        files[chosen].1 = std::mem::take(&mut entry[0].1);
    }
}

/// The stages of the first frames, as the window shows them.
fn read_stages(folder: &Path) {
    let Ok(dataset) = Dataset::open(folder, &Progress::new()) else { return };
    for frame in 0..dataset.len().min(3) {
        let _ = dataset.stages(frame);
    }
}

pub(crate) fn generic(random: &mut StdRng, folder: &Path) {
    let mut entries = material::frame();
    if random.random() {
        material::hostile_entry(&mut entries, random);
    }
    let files = [
        ("dataset.toml", material::MANIFEST.as_bytes().to_vec()),
        ("frames/000000.npz", material::npz(&entries, random.random())),
        ("frames/000001.npz", material::npz(&material::frame(), false)),
    ];
    changed(&files, random, folder);
    read_all(folder);
}

pub(crate) fn mmvr(random: &mut StdRng, folder: &Path) {
    let mut files = material::mmvr();
    if random.random() {
        let mut bbox = [("global_frame_id", material::npy("<U5", "()", false, &[0; 20]))];
        material::hostile_entry(&mut bbox, random);
        files[2].1 = material::npz(&bbox, true);
    }
    changed(&files, random, folder);
    read_all(folder);
}

pub(crate) fn hupr(random: &mut StdRng, folder: &Path) {
    changed(&material::hupr(), random, folder);
    read_all(folder);
}

pub(crate) fn xrf55(random: &mut StdRng, folder: &Path) {
    changed(&material::xrf55(), random, folder);
    read_all(folder);
}

pub(crate) fn hiber(random: &mut StdRng, folder: &Path) {
    let mut files = material::hiber();
    if random.random_bool(0.3) {
        let chosen = random.random_range(1..3);
        let mut entry = [("array", files[chosen].1.clone())];
        material::hostile_entry(&mut entry, random);
        files[chosen].1 = std::mem::take(&mut entry[0].1);
    }
    changed(&files, random, folder);
    read_all(folder);
    let Ok(dataset) = Dataset::open(folder, &Progress::new()) else { return };
    if let Some(rooms) = dataset.room_joints() {
        for i in 0..dataset.len().min(20) {
            let _ = std::hint::black_box((rooms.environment(i).is_some(), rooms.joints(i)));
        }
    }
}

pub(crate) fn rt_pose(random: &mut StdRng, folder: &Path) {
    let mut files = material::rt_pose();
    if random.random_bool(0.3) {
        let mut entry = [("array", files[1].1.clone())];
        material::hostile_entry(&mut entry, random);
        files[1].1 = std::mem::take(&mut entry[0].1);
    }
    changed(&files, random, folder);
    read_all(folder);
}

/// A file of room transforms.
pub(crate) fn rooms(random: &mut StdRng, folder: &Path) {
    std::fs::write(folder.join("rooms.toml"), mutate::text(material::ROOMS, random)).unwrap();
    let read = RoomTransforms::of(folder, None);
    if let Some(room) = read.of_environment("01") {
        assert!(room.radar_from_room.translation.iter().all(|x| x.is_finite()));
    }
}

/// A file of frames along the first axis, with the manifest that describes it.
pub(crate) fn stacked(random: &mut StdRng, folder: &Path) {
    let stack: Vec<u8> = (0..3).flat_map(|_| material::map()).collect();
    let mut entries = [
        ("hori", material::npy("<f4", "(3, 12, 8)", false, &stack)),
        ("vert", material::npy("<f4", "(3, 12, 8)", false, &stack)),
    ];
    if random.random() {
        material::hostile_entry(&mut entries, random);
    }
    let mut bytes = material::npz(&entries, random.random());
    if random.random() {
        mutate::bytes(&mut bytes, random);
    }
    let path = folder.join("stack.npz");
    std::fs::write(&path, bytes).unwrap();
    let Ok(manifest) = Manifest::parse(material::MANIFEST, Path::new("dataset.toml")) else { return };
    let options = OpenOptions { manifest: Some(&manifest), ..OpenOptions::default() };
    let Ok(dataset) = Dataset::open_with(&path, options, &Progress::new()) else { return };
    for frame in 0..dataset.len().min(10) {
        let _ = dataset.load(frame);
    }
    let _ = dataset.maps(0..dataset.len().min(10)).count();
}

const JOURNAL: &str = r#"{"format":"mhp-labels","version":1,"annotator":"ada","dataset":"9f0c","created":"2026-03-01T09:30:00.000Z","program":"0.1.0"}
{"dataset":"9f0c","frame":{"path":"d1s1/000/00383","index":383},"label":{"tags":["F1"],"note":"wall"},"annotator":"ada","time":"2026-03-01T09:31:12.345Z","act":"tag F1","program":"0.1.0","judged":{"fit":"aa","iteration":40,"machine":{"F1":0.82}}}
{"dataset":"9f0c","frame":{"path":"d1s1/000/00384","index":384},"label":{"tags":["F2","F3"],"unsure":true},"annotator":"ada","time":"2026-03-01T09:32:12.345Z","act":"tag F2","program":"0.1.0"}
"#;

pub(crate) fn journal(random: &mut StdRng, folder: &Path) {
    let path = folder.join("ada.labels.jsonl");
    std::fs::write(&path, mutate::text(JOURNAL, random)).unwrap();
    let _ = read_journal(&path);
    if let Ok(mut store) = LabelStore::read(&LabelPlace::in_folder(folder)) {
        let names: Vec<String> = store.annotators().map(str::to_owned).collect();
        for name in names {
            let _ = store.records(&name).count();
        }
        let _ = store.refresh();
    }
}

const TABLE: &str = "frame,index,annotator,time,F1,F2,F3,F4,clean,unsure,person,region,note,machine_F1\na/1,1,ada,2026-03-01T09:31:12.345Z,1,0,0,0,0,\
    0,2,,\"two\nlines\",0.5\n";

fn json_table() -> String {
    format!("[{}]", JOURNAL.lines().nth(1).unwrap_or_default())
}

pub(crate) fn label_table(random: &mut StdRng, folder: &Path) {
    let csv: bool = random.random();
    let (name, text) = if csv { ("t.csv", TABLE.to_owned()) } else { ("t.json", json_table()) };
    let path = folder.join(name);
    std::fs::write(&path, mutate::text(&text, random)).unwrap();
    let _ = read_table(&path);
}

const SUMMARY: &str = "frame,iterations,converged,reason,loss,em,bone,rigid,joint,sep,coll,iou_hori,majpe_mm,pa_majpe_mm,init_ms,fit_ms\n\
     a/1,100,true,done,0.3,0.2,0.1,0,0,0,0,0.6,178.2,93.1,1.4,4.2\na/2,3,false,error: x,,,,,,,,,,,,\n";

pub(crate) fn summary(random: &mut StdRng, folder: &Path) {
    let path = folder.join("summary.csv");
    std::fs::write(&path, mutate::text(SUMMARY, random)).unwrap();
    let _ = read_summary(&path);
}

pub(crate) fn session(random: &mut StdRng, folder: &Path) {
    let path = folder.join("a.mhp-session");
    std::fs::write(&path, mutate::text(&crate::material::session(), random)).unwrap();
    let _ = SessionFile::read(&path);
}

/// A run folder as a study of the sample leaves it, one file changed.
pub(crate) fn run_folder(random: &mut StdRng, folder: &Path) {
    let files = crate::material::run_folder();
    let chosen = random.random_range(0..files.len());
    for (k, (name, text)) in files.iter().enumerate() {
        let bytes = if k == chosen { mutate::text(text, random) } else { text.clone().into_bytes() };
        std::fs::write(folder.join(name), bytes).unwrap();
    }
    if let Ok(run) = Run::read(folder) {
        let _ = (run.markdown(), run.json(), run.table.iter().map(|row| run.rows_of(row).count()).sum::<usize>());
    }
}

/// A target that begins with something that no reader takes would show nothing.
#[test]
fn what_the_mutations_begin_with_is_sound() {
    let _alone = crate::harness::alone();
    let home = tempfile::tempdir().unwrap();
    let generic = [
        ("dataset.toml", material::MANIFEST.as_bytes().to_vec()),
        ("frames/000000.npz", material::npz(&material::frame(), true)),
    ];
    let sets = [
        ("generic", generic.to_vec()),
        ("mmvr", material::mmvr()),
        ("hupr", material::hupr()),
        ("xrf55", material::xrf55()),
        ("hiber", material::hiber()),
        ("rt_pose", material::rt_pose()),
    ];
    for (name, files) in sets {
        let folder = home.path().join(name);
        material::lay_out(
            &folder,
            &files.into_iter().map(|(file, bytes)| (file.to_owned(), bytes)).collect::<Vec<_>>(),
        );
        let dataset = Dataset::open(&folder, &Progress::new()).unwrap();
        for frame in 0..dataset.len() {
            dataset.load(frame).unwrap();
        }
        let frame = dataset.load(0).unwrap();
        assert!(frame.truth.is_some() && (name == "xrf55" || frame.notes.is_empty()), "{name}: {:?}", frame.notes);
    }
    let captures = [
        ("cube", material::sample_cube(false)),
        ("segmented", material::sample_cube(true)),
        ("clips", material::raw_clip()),
        ("cascade", material::cascade(false)),
        ("rt_pose raw", material::cascade(true)),
        ("hupr raw", material::raw_pair()),
    ];
    for (name, files) in captures {
        let folder = home.path().join(name);
        let files: Vec<_> = files.into_iter().map(|(file, bytes)| (file.to_owned(), bytes)).collect();
        material::lay_out(&folder, &files);
        let dataset = Dataset::open(&folder, &Progress::new()).unwrap();
        assert!(!dataset.is_empty(), "{name}");
        assert!((0..dataset.len()).all(|frame| dataset.load(frame).is_ok() && dataset.stages(frame).is_ok()), "{name}");
    }
    RadarPreset::parse(material::RADAR, Path::new("lab.toml")).unwrap();
    let file = |name: &str, text: &str| {
        let path = home.path().join(name);
        std::fs::write(&path, text).unwrap();
        path
    };
    assert_eq!(read_journal(&file("ada.labels.jsonl", JOURNAL)).unwrap().len(), 2);
    assert_eq!(read_summary(&file("summary.csv", SUMMARY)).unwrap().len(), 2);
    assert_eq!(read_table(&file("t.csv", TABLE)).unwrap().rows.len(), 1);
    assert_eq!(read_table(&file("t.json", &json_table())).unwrap().rows.len(), 1);
    SessionFile::read(&file("a.mhp-session", &material::session())).unwrap();
    let run = home.path().join("run");
    std::fs::create_dir(&run).unwrap();
    for (name, text) in material::run_folder() {
        std::fs::write(run.join(name), text).unwrap();
    }
    assert_eq!(Run::read(&run).unwrap().rows.len(), 4);
}
