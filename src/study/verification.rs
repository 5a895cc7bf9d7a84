//! The count-matched protocol (paper A.3): frames where counter, annotation and, of those that somebody reviewed, the reviewers agree.
//!
//! N_pred is what the counting module says, N_GT the annotation, N_verified a verdict: whoever calls the annotation, the count or both
//! wrong takes the frame out of the evaluation, whatever the two numbers are. Annotations that no body has (paper A.3: limbs that span
//! less than 2 cm) are told beside it, where joints are in metres.

use super::count::{FrameCount, count_frames};
use crate::dataset::Dataset;
use crate::geometry::{norm, sub};
use crate::labels::{Label, Record, Verdict};
use crate::people::PeopleError;
use rayon::prelude::*;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// A limb that spans less is none, m.
const LEAST_BONE_M: f64 = 0.02;
/// Bones that are meant to be longer are looked at, m: those of a face are shorter.
const LOOKED_AT_M: f64 = 0.15;
/// A bone may differ so much from its median in the sequence, m (paper A.4).
const BAND_M: f64 = 0.05;

/// A person's annotation that is no body.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ImplausibleAnnotation {
    /// The frame.
    pub frame: String,
    /// The person, counted from 0.
    pub person: usize,
    /// The bone that is farthest from what it should be, by its joints.
    pub bone: [String; 2],
    /// Its length, m.
    pub length_m: f64,
    /// Its median in the sequence, m.
    pub median_m: f64,
}

/// The protocol on one data set.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Verification {
    /// The data set.
    pub data: String,
    /// Its layout.
    pub layout: &'static str,
    /// Frames whose people are counted and annotated; those of several annotated people.
    pub frames: [usize; 2],
    /// Of these, frames where N_pred = N_GT and no reviewer objects.
    pub kept: [usize; 2],
    /// Frames where N_pred ≠ N_GT.
    pub mismatched: usize,
    /// Of the mismatched ones, frames with each verdict, in the order of [`Verdict::ALL`].
    pub verdicts: [usize; Verdict::ALL.len()],
    /// Frames of whose verdict the reviewers are not of one mind; they are not kept.
    pub disputed: usize,
    /// Frames where N_pred = N_GT that a verdict takes out.
    pub overruled: usize,
    /// Annotations that are no bodies.
    pub implausible: Vec<ImplausibleAnnotation>,
}

impl Verification {
    /// Mismatched frames with a verdict.
    pub fn reviewed(&self) -> usize {
        self.verdicts.iter().sum()
    }

    /// Shares of the frames that are kept, 0..1: of all, and of those with several people; `None` without such frames.
    pub fn retention(&self) -> [Option<f64>; 2] {
        [0, 1].map(|k| (self.frames[k] > 0).then(|| self.kept[k] as f64 / self.frames[k] as f64))
    }
}

/// The verdict of each frame by name; `None` where those who gave one are not of one mind.
pub fn verdicts(acts: &[Record]) -> HashMap<&str, Option<Verdict>> {
    let mut newest: BTreeMap<(&str, &str), &Label> = BTreeMap::new();
    for record in acts {
        newest.insert((&record.frame.path, &record.annotator), &record.label);
    }
    let mut verdicts: HashMap<&str, Option<Verdict>> = HashMap::new();
    for ((frame, _), label) in newest {
        let Some(verdict) = label.verdict else { continue };
        verdicts
            .entry(frame)
            .and_modify(|known| *known = known.filter(|known| *known == verdict))
            .or_insert(Some(verdict));
    }
    verdicts
}

/// Frames that a verdict takes out of an evaluation: annotation, count or both are wrong, or the reviewers differ.
pub fn taken_out(acts: &[Record]) -> BTreeSet<&str> {
    let out = |verdict: &Option<Verdict>| *verdict != Some(Verdict::TrueNegative);
    verdicts(acts).into_iter().filter(|(_, verdict)| out(verdict)).map(|(frame, _)| frame).collect()
}

/// Counts every frame and looks at its annotation; `done` hears of every frame.
///
/// # Errors
/// As [`count_frames`].
pub fn verify(dataset: &Dataset, acts: &[Record], done: impl Fn() + Sync) -> Result<Verification, PeopleError> {
    let rows = count_frames(dataset, 0..dataset.len(), done)?;
    let implausible = implausible(dataset);
    Ok(Verification { implausible, ..matched(dataset, &rows, acts) })
}

fn matched(dataset: &Dataset, rows: &[FrameCount], acts: &[Record]) -> Verification {
    let (verdicts, out) = (verdicts(acts), taken_out(acts));
    let mut found = Verification {
        data: dataset.info().name.clone(),
        layout: dataset.info().layout.word(),
        frames: [0; 2],
        kept: [0; 2],
        mismatched: 0,
        verdicts: [0; Verdict::ALL.len()],
        disputed: 0,
        overruled: 0,
        implausible: Vec::new(),
    };
    for row in rows {
        let (Ok(count), Some(annotated)) = (&row.count, row.annotated) else { continue };
        let several = annotated > 1;
        // The counter's last class is 4 and more.
        let equal = count.people == annotated.min(crate::people::CLASSES - 1);
        let name = row.frame.as_str();
        found.frames[0] += 1;
        found.frames[1] += usize::from(several);
        let keeps = equal && !out.contains(name);
        found.kept[0] += usize::from(keeps);
        found.kept[1] += usize::from(keeps && several);
        found.mismatched += usize::from(!equal);
        found.overruled += usize::from(equal && !keeps);
        match verdicts.get(name) {
            Some(None) => found.disputed += 1,
            Some(Some(verdict)) if !equal => {
                let counts = found.verdicts.iter_mut().zip(Verdict::ALL);
                counts.filter(|(_, known)| known == verdict).for_each(|(count, _)| *count += 1);
            }
            _ => {}
        }
    }
    found
}

/// The annotations in metres that are no bodies, the worst bone of each.
fn implausible(dataset: &Dataset) -> Vec<ImplausibleAnnotation> {
    let skeleton = &dataset.info().skeleton;
    let joints = skeleton.joints.len();
    let bones: Vec<usize> = (0..skeleton.bones.len()).filter(|&b| skeleton.bone_lengths_m[b] > LOOKED_AT_M).collect();
    let lengths = |frame: usize| -> Option<(usize, Vec<Vec<f64>>)> {
        let truth = dataset.load(frame).ok()?.truth?;
        let of = |person: &[crate::geometry::Vec3]| {
            bones.iter().map(|&b| norm(sub(person[skeleton.bones[b][0]], person[skeleton.bones[b][1]]))).collect()
        };
        Some((frame, truth.joints.chunks_exact(joints).map(of).collect()))
    };
    let all: Vec<(usize, Vec<Vec<f64>>)> = (0..dataset.len()).into_par_iter().filter_map(lengths).collect();
    let mut found = Vec::new();
    for sequence in all.chunk_by(|(a, _), (b, _)| dataset.sequence(*a) == dataset.sequence(*b)) {
        // Persons are in the order of the annotation, which need not be the same in every frame: the median is of all of them.
        let median = |bone: usize| {
            let mut of: Vec<f64> = sequence.iter().flat_map(|(_, persons)| persons.iter().map(|p| p[bone])).collect();
            of.sort_by(f64::total_cmp);
            of[of.len() / 2]
        };
        let several = sequence.iter().any(|(_, persons)| persons.len() > 1);
        let medians: Vec<f64> = if sequence.iter().all(|(_, persons)| persons.is_empty()) {
            continue;
        } else {
            (0..bones.len()).map(median).collect()
        };
        for (frame, persons) in sequence {
            for (person, lengths) in persons.iter().enumerate() {
                // Two people differ by more than one person's bone.
                let wrong =
                    |k: &usize| lengths[*k] < LEAST_BONE_M || (!several && (lengths[*k] - medians[*k]).abs() > BAND_M);
                let off = |k: &usize| (lengths[*k] - medians[*k]).abs();
                let worst = (0..bones.len()).filter(wrong).max_by(|a, b| off(a).total_cmp(&off(b)));
                let Some(worst) = worst else { continue };
                found.push(ImplausibleAnnotation {
                    frame: dataset.frame_name(*frame).to_owned(),
                    person,
                    bone: skeleton.bones[bones[worst]].map(|joint| skeleton.joints[joint].clone()),
                    length_m: lengths[worst],
                    median_m: medians[worst],
                });
            }
        }
    }
    found
}
