//! `hrnet_annot_<split>.json`: key points and boxes in the pixels of a 256 × 256 image.
//!
//! The file is a list of sequences, each a list of blocks, and does not name its sequences: they come in the order of the split in
//! HuPR's configuration (`assets/hupr_splits.toml`). A list of another length is taken for the sequence folders that are there,
//! in their order, where their number fits. Files are read when the first frame is: the largest has 50 MB.
//!
//! Who was recorded in which sequence HuPR does not publish; a `subjects.csv` beside the sequences, a line `7,anna` each (or
//! `single_7,anna`), says it, and is told with the split of every frame.

use crate::dataset::ImageAnnotations;
use crate::dataset::Origin;
use crate::dataset::layout::index::Segment;
use crate::dataset::natural::natural;
use crate::input::{MOST_TEXT, open_file, read_text};
use serde::Deserialize;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// Width and height of the images, px.
pub(super) const IMAGE_SIZE: [usize; 2] = [256, 256];
const JOINTS: usize = 14;
/// Bytes of a file that are read: the largest that is published has 50 MB.
const MOST_BYTES: u64 = 128 << 20;
const SPLITS: [&str; 3] = ["train", "val", "test"];
/// The file that says who was recorded.
const SUBJECTS: &str = "subjects.csv";

/// The label files of a data set.
#[derive(Debug)]
pub(super) struct Annotations {
    /// Split and file.
    files: Vec<(&'static str, PathBuf)>,
    /// Sequence folders, in order.
    folders: Vec<String>,
    /// The number of a sequence to who was recorded in it.
    subjects: HashMap<u32, String>,
    read: OnceLock<Labels>,
}

/// Key points and box (x0, y0, x1, y1), px.
type Label = ([[f32; 2]; JOINTS], [f32; 4]);

#[derive(Debug, Default)]
struct Labels {
    /// (sequence, frame) to key points and box.
    frames: HashMap<(u32, u32), Label>,
    /// What is wrong with the files.
    faults: Vec<String>,
}

#[derive(Deserialize)]
struct Block {
    image: String,
    joints: Vec<[f32; 2]>,
    bbox: [f32; 4],
}

#[derive(Debug, Deserialize)]
struct Splits {
    train: Vec<u32>,
    val: Vec<u32>,
    test: Vec<u32>,
}

impl Annotations {
    /// Looks for label files in `root` and the folders above its sequences; reads none.
    pub(super) fn beside(root: &Path, sequences: &[Segment]) -> Self {
        let mut places: Vec<&Path> = vec![root];
        places.extend(sequences.first().and_then(|segment| segment.path.parent()));
        places.extend(root.parent());
        let found = |split: &&'static str| {
            let name = format!("hrnet_annot_{split}.json");
            places.iter().map(|place| place.join(&name)).find(|path| path.is_file()).map(|path| (*split, path))
        };
        let subjects = places.iter().map(|place| place.join(SUBJECTS)).find(|path| path.is_file());
        let subjects = subjects.map_or_else(HashMap::new, |path| subjects_in(&path));
        let mut folders: Vec<String> = sequences.iter().map(|segment| segment.sequence.clone()).collect();
        folders.sort_by(|a, b| natural(a, b));
        Self { files: SPLITS.iter().filter_map(found).collect(), folders, subjects, read: OnceLock::new() }
    }

    /// The label files.
    pub(super) fn paths(&self) -> impl Iterator<Item = &Path> {
        self.files.iter().map(|(_, path)| path.as_path())
    }

    /// The split of a sequence, and who was recorded in it where that is said.
    pub(super) fn who(&self, sequence: &str) -> Option<String> {
        let number = number(sequence)?;
        let split = splits().and_then(|splits| splits.of(number)).map(|split| format!("{split} split"));
        let subject = self.subjects.get(&number).map(|name| format!("subject {name}"));
        let all: Vec<String> = subject.into_iter().chain(split).collect();
        (!all.is_empty()).then(|| all.join(", "))
    }

    /// The recording of a sequence, and who is in it where that is said.
    pub(super) fn origin(&self, sequence: &str) -> Origin {
        let number = number(sequence);
        let subject = number.and_then(|number| self.subjects.get(&number).cloned());
        Origin { subject, session: number.map(|number| number.to_string()), ..Origin::default() }
    }

    /// The labels of a frame; what is wrong with the files goes to `notes`.
    pub(super) fn of(&self, sequence: &str, stem: &str, notes: &mut Vec<String>) -> Option<ImageAnnotations> {
        if self.files.is_empty() {
            notes.push("hrnet_annot_train.json, _val and _test are missing: no key points".into());
            return None;
        }
        let labels = self.read.get_or_init(|| self.all());
        notes.extend(labels.faults.iter().cloned());
        let (number, frame) = (number(sequence)?, stem.parse::<u32>().ok()?);
        let Some((joints, bbox)) = labels.frames.get(&(number, frame)) else {
            notes.push("no key points of this frame in the annotations".into());
            return None;
        };
        let [x0, y0, x1, y1] = bbox.map(f64::from);
        Some(ImageAnnotations {
            size: IMAGE_SIZE,
            keypoints: vec![joints.iter().map(|&[x, y]| [f64::from(x), f64::from(y), 1.0]).collect()],
            keypoint_skeleton: "hupr14".into(),
            boxes: vec![[x0, y0, x1, y1, 1.0]],
            masks: Vec::new(),
        })
    }

    fn all(&self) -> Labels {
        let mut labels = Labels::default();
        for (split, path) in &self.files {
            if let Err(fault) = self.add(split, path, &mut labels) {
                labels.faults.push(format!("{}: {fault}; its key points are left out", path.display()));
            }
        }
        labels
    }

    fn add(&self, split: &str, path: &Path, labels: &mut Labels) -> Result<(), String> {
        let file = open_file(path, "a list of annotations").map_err(|error| error.to_string())?;
        let bytes = file.metadata().map_err(|error| error.to_string())?.len();
        if bytes > MOST_BYTES {
            return Err(format!("it has {bytes} bytes; expected at most {MOST_BYTES}"));
        }
        let read: Vec<Vec<Block>> =
            serde_json::from_reader(std::io::BufReader::new(file)).map_err(|error| error.to_string())?;
        let numbers = self.sequences_of(split, read.len())?;
        for (sequence, blocks) in numbers.into_iter().zip(read) {
            for block in blocks {
                // "000000123.jpg": the last four characters are the ending.
                let stem = block.image.rsplit('/').next().and_then(|name| name.split('.').next()).unwrap_or_default();
                let frame = stem.parse::<u32>().map_err(|_| format!("image \"{}\" names no frame", block.image))?;
                let joints = <[[f32; 2]; JOINTS]>::try_from(block.joints).map_err(|joints| {
                    format!("{} joints of image \"{}\"; expected {JOINTS}", joints.len(), block.image)
                })?;
                labels.frames.insert((sequence, frame), (joints, block.bbox));
            }
        }
        Ok(())
    }

    /// The numbers of the sequences that a list of `count` stands for.
    fn sequences_of(&self, split: &str, count: usize) -> Result<Vec<u32>, String> {
        let splits = splits().ok_or("HuPR's splits are not known")?;
        let ids = match split {
            "train" => &splits.train,
            "val" => &splits.val,
            _ => &splits.test,
        };
        if ids.len() == count {
            return Ok(ids.clone());
        }
        let folders: Vec<u32> = self.folders.iter().filter_map(|name| number(name)).collect();
        if self.files.len() == 1 && folders.len() == count {
            return Ok(folders);
        }
        Err(format!("it lists {count} sequences; expected the {} of HuPR's split \"{split}\"", ids.len()))
    }
}

/// Which of these sequences are in which of HuPR's splits, in words.
pub(super) fn splits_of(segments: &[Segment]) -> String {
    let numbers: Vec<u32> = segments.iter().filter_map(|segment| number(&segment.sequence)).collect();
    let Some(splits) = splits() else { return "splits are not known".into() };
    let count = |ids: &[u32]| numbers.iter().filter(|number| ids.contains(number)).count();
    let [train, val, test] = [&splits.train, &splits.val, &splits.test].map(|ids| count(ids));
    let none = segments.len() - (train + val + test).min(segments.len());
    format!(
        "splits: of {} sequences {train} are of HuPR's training, {val} of validation, {test} of test, {none} of none",
        segments.len()
    )
}

/// `None` never, for the file that the program was built with.
fn splits() -> Option<&'static Splits> {
    static SPLITS: OnceLock<Option<Splits>> = OnceLock::new();
    SPLITS.get_or_init(|| toml::from_str(include_str!("../../../../assets/hupr_splits.toml")).ok()).as_ref()
}

impl Splits {
    fn of(&self, number: u32) -> Option<&'static str> {
        let all = [(&self.train, "training"), (&self.val, "validation"), (&self.test, "test")];
        all.into_iter().find(|(ids, _)| ids.contains(&number)).map(|(_, name)| name)
    }
}

/// Who was recorded, by the number of the sequence; lines that say something else are passed over.
fn subjects_in(path: &Path) -> HashMap<u32, String> {
    let text = read_text(path, "who was recorded (CSV)", MOST_TEXT).unwrap_or_default();
    let one = |line: &str| {
        let (sequence, name) = line.trim().split_once(',')?;
        let name = name.trim();
        (!name.is_empty()).then_some((number(sequence.trim())?, name.to_owned()))
    };
    text.lines().filter_map(one).collect()
}

/// `7` of `single_7`.
fn number(sequence: &str) -> Option<u32> {
    sequence.rsplit('_').next()?.parse().ok()
}
