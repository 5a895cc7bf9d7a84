//! Networks taught on one scene or data set and asked on others: the paper's 5.2.2 and 5.2.3, on data with joints in metres.
//!
//! Of the part that is learned from whole sequences are kept back: every fifth to validate with, every fifth to ask, which is the row
//! "within" of the tables. Each input is read by the same perceptron (paper A.6), so that what differs is the input. Where two data
//! sets have other joints the errors are over those in common. Of several people each is read and answered by themselves.

use super::FileError;
use crate::body::Skeleton;
use crate::dataset::{Dataset, natural};
use crate::diagnose::{majpe_mm, pa_majpe_mm};
use crate::geometry::{Vec3, add};
use crate::network::{
    Architecture, Example, ExampleSet, Features, ModelCard, ParamsOf, PoseNetwork, TrainFault, TrainPoseOptions,
    TrainedEpoch, examples, input_width, train_pose,
};
use crate::output::replace_file;
use crate::predictions::JointMap;
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

/// Every so many sequences one is kept to validate with, and one to ask.
const KEPT: usize = 5;

/// What is compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CrossKind {
    /// Scenes of one radar.
    Scene,
    /// Data sets of several radars.
    Dataset,
}

impl CrossKind {
    /// The word on the command line.
    pub fn word(self) -> &'static str {
        match self {
            Self::Scene => "cross-scene",
            Self::Dataset => "cross-dataset",
        }
    }

    /// What the paper has for the same question.
    fn paper(self) -> &'static str {
        match self {
            Self::Scene => {
                "The paper's 5.2.2 (RETR, learned on MMVR's scene 1, asked on scenes 2 to 5): heatmap 89.1, PPPR 73.9 mm MAJPE; with several \
                 people (5.3.4) 113.0 and 92.1. Those are measured maps, rooms and networks, these are not: compare which input is the \
                 better one, not sizes."
            }
            Self::Dataset => {
                "The paper's 5.2.3 (RETR, learned on MMVR), MAJPE / PA-MAJPE: within MMVR heatmap 88.7 / 81.2, PPPR 69.3 / 63.5; on XRF55 \
                 218.7 / 201.3 and 85.9 / 78.4; on HuPR 203.4 / 187.9 and 82.6 / 75.1. Those are measured maps, rooms and networks, these are \
                 not: compare which input is the better one, not sizes."
            }
        }
    }
}

/// An input of the tables.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CrossInput {
    /// As the paper calls it.
    pub name: &'static str,
    /// What is read.
    pub features: Features,
    /// How the network is built.
    pub architecture: Architecture,
}

/// The paper's inputs, and PPPR without the mean over the joints.
pub const CROSS_INPUTS: [CrossInput; 4] = [
    CrossInput { name: "Heatmap", features: Features::Heatmap, architecture: Architecture::Mlp },
    CrossInput { name: "PPPR", features: Features::Pppr, architecture: Architecture::MlpJoints },
    CrossInput { name: "PPPR, mean over joints (A.6)", features: Features::Pppr, architecture: Architecture::Mlp },
    CrossInput { name: "PPPR-Heatmap", features: Features::PpprHeatmap, architecture: Architecture::Mlp },
];

/// A scene or a data set.
#[derive(Debug)]
pub struct CrossPart<'a> {
    /// What it is called.
    pub name: String,
    /// The frames are of.
    pub dataset: &'a Dataset,
    /// Fits of its frames.
    pub params: &'a ParamsOf,
    /// Its scene; all frames where none is said.
    pub scene: Option<String>,
}

/// The parts of data sets: their scenes, or each whole.
pub fn cross_parts<'a>(kind: CrossKind, sets: &'a [(Dataset, ParamsOf)]) -> Vec<CrossPart<'a>> {
    let of = |(dataset, params): &'a (Dataset, ParamsOf)| -> Vec<CrossPart<'a>> {
        let name = dataset.info().name.clone();
        let mut scenes: Vec<String> = (0..dataset.len()).filter_map(|frame| dataset.origin(frame).scene).collect();
        scenes.sort_by(|a, b| natural(a, b));
        scenes.dedup();
        if kind == CrossKind::Dataset || scenes.is_empty() {
            return vec![CrossPart { name, dataset, params, scene: None }];
        }
        let part = |scene: String| CrossPart { name: scene.clone(), dataset, params, scene: Some(scene) };
        scenes.into_iter().map(part).collect()
    };
    sets.iter().flat_map(of).collect()
}

/// Errors of one network on one part.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CrossRow {
    /// What was learned from.
    pub trained_on: String,
    /// What was asked.
    pub tested_on: String,
    /// The input.
    pub input: &'static str,
    /// Weights of the network.
    pub parameters: usize,
    /// Frames that were asked.
    pub frames: usize,
    /// People in them.
    pub people: usize,
    /// Sequences that they are of.
    pub sequences: usize,
    /// Joints that are compared.
    pub joints: usize,
    /// Mean over the people, mm.
    pub majpe_mm: Option<f64>,
    /// The same after alignment, mm.
    pub pa_majpe_mm: Option<f64>,
    /// Why there are none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why: Option<String>,
}

/// Why nothing could be compared.
#[derive(Debug, thiserror::Error)]
pub enum CrossError {
    /// Too little to learn from or to ask.
    #[error("{0}")]
    Nothing(String),
    /// Training failed.
    #[error(transparent)]
    Train(#[from] TrainFault),
    /// A file cannot be written.
    #[error(transparent)]
    File(#[from] FileError),
}

/// Teaches a network an input on the first part and asks it on all; the networks, their checkpoints and the tables lie in `folder`. A
/// study that was killed goes on where its last epoch ended. `told` hears of every epoch.
///
/// # Errors
/// Where there are fewer than two parts, the first has too few sequences, or a file cannot be written.
pub fn cross(
    kind: CrossKind,
    parts: &[CrossPart<'_>],
    options: &TrainPoseOptions,
    folder: &Path,
    mut told: impl FnMut(&CrossInput, &TrainedEpoch),
) -> Result<Vec<CrossRow>, CrossError> {
    let [first, others @ ..] = parts else { return Err(CrossError::Nothing("no data".into())) };
    if others.is_empty() {
        let what = if kind == CrossKind::Scene { "scene" } else { "data set" };
        return Err(CrossError::Nothing(format!("one {what}, `{}`; expected two or more", first.name)));
    }
    let mut rows = Vec::new();
    for (number, input) in CROSS_INPUTS.iter().enumerate() {
        let sets = sets_of(first, input).map_err(CrossError::Nothing)?;
        if sets.len() < KEPT {
            let n = sets.len();
            return Err(CrossError::Nothing(format!(
                "{}: {n} sequences to learn from; expected {KEPT} or more: neighbours are alike",
                first.name
            )));
        }
        let kept = |part: usize| {
            let of = sets.iter().enumerate().filter(move |(k, _)| part == (k % KEPT).min(2));
            of.flat_map(|(_, set)| &set.examples).collect::<Vec<&Example>>()
        };
        let (validation, train) = (kept(0), kept(2));
        let within: Vec<ExampleSet> = sets.iter().skip(1).step_by(KEPT).cloned().collect();
        let inside = folder.join("networks").join(format!("{}-{}", number + 1, input.features));
        std::fs::create_dir_all(&inside).map_err(FileError::writing(&inside))?;
        let mut card = ModelCard::of_data(first.dataset.info(), input.features, input.architecture);
        card.notes = vec![format!("mhp-inspector {}, learned on {}", env!("CARGO_PKG_VERSION"), first.name)];
        let (network, _) =
            train_pose(&card, &train, &validation, options, Some(&inside.join("checkpoint.safetensors")), |epoch| {
                told(input, epoch);
                true
            })?;
        network.write(&inside.join("model.safetensors")).map_err(TrainFault::Model)?;
        let mut row = |tested_on: String, skeleton: &Skeleton, of: Result<Vec<ExampleSet>, String>| {
            rows.push(asked(&network, input, [first.name.clone(), tested_on], skeleton, of));
        };
        row(format!("{} (within)", first.name), &first.dataset.info().skeleton, Ok(within));
        for part in others {
            let sets = readable(&network, part, input).and_then(|()| sets_of(part, input));
            row(part.name.clone(), &part.dataset.info().skeleton, sets);
        }
    }
    let text = markdown(kind, &rows);
    let json =
        serde_json::to_string_pretty(&serde_json::json!({ "study": kind.word(), "rows": rows })).unwrap_or_default();
    for (name, text) in [("table.md", text), ("table.json", json + "\n")] {
        let file = folder.join(name);
        replace_file(&file, |out| out.write_all(text.as_bytes())).map_err(FileError::writing(&file))?;
    }
    Ok(rows)
}

/// Examples of a part by sequence.
fn sets_of(part: &CrossPart<'_>, input: &CrossInput) -> Result<Vec<ExampleSet>, String> {
    let (mut sets, _) = examples(part.dataset, part.params, input.features, input.architecture)?;
    if part.scene.is_some() {
        for set in &mut sets {
            set.examples.retain(|example| part.dataset.origin(example.frame).scene == part.scene);
        }
        sets.retain(|set| !set.examples.is_empty());
    }
    Ok(sets)
}

/// Whether a network can read a part at all.
fn readable(network: &PoseNetwork, part: &CrossPart<'_>, input: &CrossInput) -> Result<(), String> {
    let info = part.dataset.info();
    let (joints, maps) = (info.skeleton.joints.len(), info.views.len());
    let width = input_width(input.features, input.architecture, joints, info.radar.doppler_features, maps);
    let same_joints = input.architecture == Architecture::Mlp || network.card.joints == info.skeleton.joints;
    if width == network.inputs() && same_joints {
        return Ok(());
    }
    Err(match input.features {
        Features::Heatmap | Features::PpprHeatmap => format!("it reads {} maps, not {maps}", network.card.maps.len()),
        _ => format!("it reads {} joints of other names", network.card.joints.len()),
    })
}

fn asked(
    network: &PoseNetwork,
    input: &CrossInput,
    [trained_on, tested_on]: [String; 2],
    skeleton: &Skeleton,
    sets: Result<Vec<ExampleSet>, String>,
) -> CrossRow {
    let map = JointMap::new(&network.card.joints, skeleton);
    let empty = CrossRow {
        trained_on,
        tested_on,
        input: input.name,
        parameters: network.parameters(),
        frames: 0,
        people: 0,
        sequences: 0,
        joints: 0,
        majpe_mm: None,
        pa_majpe_mm: None,
        why: None,
    };
    let (sets, map) = match sets.and_then(|sets| Ok((sets, map?))) {
        Ok(found) => found,
        Err(why) => return CrossRow { why: Some(why), ..empty },
    };
    let (mut errors, mut aligned) = (Vec::new(), Vec::new());
    for example in sets.iter().flat_map(|set| &set.examples) {
        let place = |p: Vec3| add(p, example.middle);
        let answer: Vec<Vec3> = network.answer(&example.input).into_iter().map(place).collect();
        let truth = example.target.as_chunks::<3>().0;
        let truth: Vec<Vec3> = map.known.iter().map(|&joint| place(truth[joint].map(f64::from))).collect();
        let answer = map.apply(&answer);
        errors.extend(majpe_mm(&answer, &truth));
        aligned.extend(pa_majpe_mm(&answer, &truth));
    }
    let mean = |of: &[f64]| (!of.is_empty()).then(|| of.iter().sum::<f64>() / of.len() as f64);
    CrossRow {
        people: errors.len(),
        frames: sets.iter().map(|set| set.examples.chunk_by(|a, b| a.frame == b.frame).count()).sum(),
        sequences: sets.len(),
        joints: map.known.len(),
        majpe_mm: mean(&errors),
        pa_majpe_mm: mean(&aligned),
        ..empty
    }
}

/// The table: a row a part, a pair of columns an input.
pub fn markdown(kind: CrossKind, rows: &[CrossRow]) -> String {
    let mut parts: BTreeMap<usize, Vec<&CrossRow>> = BTreeMap::new();
    let mut order: Vec<&str> = Vec::new();
    for row in rows {
        let at = order.iter().position(|name| *name == row.tested_on).unwrap_or_else(|| {
            order.push(&row.tested_on);
            order.len() - 1
        });
        parts.entry(at).or_default().push(row);
    }
    let number = |x: Option<f64>| x.map_or_else(|| "–".to_owned(), |x| format!("{x:.1}"));
    let escaped = |text: &str| text.replace('|', "\\|").replace('\n', " ");
    let mut text = format!("# {}\n\n", kind.word());
    let first = rows.first().map_or("", |row| row.trained_on.as_str());
    let several = rows.iter().any(|row| row.people > row.frames);
    let of = if several { "the people of frames with as many fitted as annotated" } else { "frames with one person" };
    let _ = writeln!(text, "Learned on {}. MAJPE / PA-MAJPE, mm, means over {of}.\n", escaped(first));
    let heads: Vec<&str> = CROSS_INPUTS.iter().map(|input| input.name).collect();
    let _ = writeln!(text, "| asked on | frames in sequences | {} |", heads.join(" | "));
    let _ = writeln!(text, "| --- | ---: |{}", " ---: |".repeat(heads.len()));
    let line = |name: &str, of: &[&CrossRow]| {
        let most = of.iter().max_by_key(|row| row.frames);
        let cell = |row: &&CrossRow| format!("{} / {}", number(row.majpe_mm), number(row.pa_majpe_mm));
        let cells: Vec<String> = of.iter().map(cell).collect();
        let (frames, people, sequences) = most.map_or((0, 0, 0), |row| (row.frames, row.people, row.sequences));
        let people = if several { format!(" ({people} people)") } else { String::new() };
        format!("| {} | {frames} in {sequences}{people} | {} |\n", escaped(name), cells.join(" | "))
    };
    for (at, of) in &parts {
        text += &line(order[*at], of);
    }
    if parts.len() > 2 {
        let mean = |input: &CrossInput, get: fn(&CrossRow) -> Option<f64>| {
            let others = rows.iter().filter(|row| row.input == input.name && row.tested_on != order[0]);
            let known: Vec<f64> = others.filter_map(get).collect();
            (!known.is_empty()).then(|| known.iter().sum::<f64>() / known.len() as f64)
        };
        let cell = |input: &CrossInput| {
            format!("{} / {}", number(mean(input, |row| row.majpe_mm)), number(mean(input, |row| row.pa_majpe_mm)))
        };
        let cells: Vec<String> = CROSS_INPUTS.iter().map(cell).collect();
        let _ = writeln!(text, "| mean of the others | | {} |", cells.join(" | "));
    }
    if rows.iter().any(|row| row.why.is_some()) {
        text.push('\n');
    }
    for row in rows.iter().filter(|row| row.why.is_some()) {
        let why = row.why.as_deref().unwrap_or_default();
        let _ = writeln!(text, "{} on {}: {}.", row.input, escaped(&row.tested_on), escaped(why));
    }
    let fewer = rows.iter().filter(|row| row.joints > 0).map(|row| row.joints).collect::<Vec<_>>();
    if fewer.iter().any(|joints| Some(joints) != fewer.first()) {
        let told: Vec<String> = order
            .iter()
            .filter_map(|name| rows.iter().find(|row| row.tested_on == *name && row.joints > 0))
            .map(|row| format!("{} {}", escaped(&row.tested_on), row.joints))
            .collect();
        let _ = writeln!(text, "Joints that are compared: {}.", told.join(", "));
    }
    let _ = writeln!(text, "\n{}", kind.paper());
    text
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "a test stops where a data set is missing")]
    use super::*;
    use crate::body::{Group, Pppr, PpprShape};
    use crate::dataset::{MANIFEST_NAME, bundled_sample};
    use crate::task::Progress;
    use std::sync::Arc;

    /// The bundled sample as six sequences of two scenes, by links to its frames; its fits are the truth.
    fn walk(folder: &Path) -> (Dataset, ParamsOf) {
        let sample = bundled_sample().unwrap();
        for (k, scene) in ["lab", "lab", "lab", "lab", "lab", "hall"].into_iter().enumerate() {
            let inside = folder.join(format!("frames/{scene}-{k}"));
            std::fs::create_dir_all(&inside).unwrap();
            for frame in 4 * k..4 * k + 4 {
                let name = format!("{frame:06}.npz");
                std::fs::copy(sample.join("frames").join(&name), inside.join(&name)).unwrap();
            }
        }
        let text = std::fs::read_to_string(sample.join(MANIFEST_NAME)).unwrap();
        let text = text.replace("frames/*.npz", "frames/*/*.npz");
        let said = "\n[[origin]]\nframes = \"*lab*\"\nscene = \"lab\"\n[[origin]]\nscene = \"hall\"\n";
        std::fs::write(folder.join(MANIFEST_NAME), text + said).unwrap();
        let dataset = Dataset::open(folder, &Progress::new()).unwrap();
        let fit = |index: usize| {
            let truth = dataset.load(index).unwrap().truth.unwrap().joints;
            let mut params = Pppr::zeros(PpprShape { persons: 1, joints: truth.len(), doppler_features: 32 });
            for (joint, p) in truth.into_iter().enumerate() {
                params.set_vec3(Group::Position, joint, p);
                params.set_vec3(Group::LogScale, joint, [-2.5; 3]);
                params.joint_mut(Group::Rotation, joint)[0] = 1.0;
            }
            (index, Arc::new(params))
        };
        let params = (0..dataset.len()).map(fit).collect();
        (dataset, params)
    }

    #[test]
    fn each_input_is_learned_on_one_scene_and_asked_on_the_other() {
        let home = tempfile::tempdir().unwrap();
        let sets = vec![walk(&home.path().join("data"))];
        let parts = cross_parts(CrossKind::Scene, &sets);
        assert_eq!(parts.iter().map(|part| part.name.as_str()).collect::<Vec<_>>(), ["hall", "lab"]);
        let options = TrainPoseOptions { epochs: 12, hidden: vec![24], ..TrainPoseOptions::default() };
        let run = home.path().join("run");
        let parts: Vec<CrossPart> = parts.into_iter().rev().collect();
        let rows = cross(CrossKind::Scene, &parts, &options, &run, |_, _| {}).unwrap();
        let of = |input: &str, on: &str| rows.iter().find(|row| row.input == input && row.tested_on == on).unwrap();
        assert_eq!(rows.len(), 2 * CROSS_INPUTS.len());
        for input in CROSS_INPUTS {
            let (within, other) = (of(input.name, "lab (within)"), of(input.name, "hall"));
            assert_eq!((within.frames, within.sequences, other.frames, other.joints), (4, 1, 4, 17), "{}", input.name);
            assert!(other.majpe_mm.unwrap() > 0.0 && other.pa_majpe_mm.unwrap() <= other.majpe_mm.unwrap());
        }
        // What reads the truth itself learns it sooner than what reads maps.
        assert!(of("PPPR", "hall").majpe_mm < of("Heatmap", "hall").majpe_mm);
        let text = std::fs::read_to_string(run.join("table.md")).unwrap();
        assert!(text.contains("| hall | 4 in 1 |") && text.contains("compare which input"), "{text}");
        // The same again goes on from its checkpoints, to the same.
        let again = cross(CrossKind::Scene, &parts, &options, &run, |_, _| {}).unwrap();
        assert_eq!(again, rows);
        let one = cross(CrossKind::Scene, &parts[..1], &options, &run, |_, _| {});
        assert!(one.unwrap_err().to_string().contains("one scene, `lab`; expected two or more"));
        let few = cross(
            CrossKind::Scene,
            &[&parts[1], &parts[0]].map(|part| CrossPart {
                name: part.name.clone(),
                scene: part.scene.clone(),
                ..*part
            }),
            &options,
            &home.path().join("few"),
            |_, _| {},
        );
        assert!(few.unwrap_err().to_string().contains("hall: 1 sequences to learn from; expected 5 or more"));
    }

    #[test]
    fn another_radar_is_asked_what_it_can_be_asked() {
        let home = tempfile::tempdir().unwrap();
        let [one, other] = ["one", "other"].map(|name| home.path().join(name));
        let mut sets = vec![walk(&one), walk(&other)];
        // The other has one map.
        let text = std::fs::read_to_string(other.join(MANIFEST_NAME)).unwrap();
        let (views, origins) = (text.match_indices("[[view]]").nth(1).unwrap().0, text.find("\n[[origin]]").unwrap());
        let text = format!("{}{}", &text[..views], &text[origins..]).replace("name = \"walk\"", "name = \"other\"");
        std::fs::write(other.join(MANIFEST_NAME), text).unwrap();
        sets[1].0 = Dataset::open(&other, &Progress::new()).unwrap();
        let parts = cross_parts(CrossKind::Dataset, &sets);
        assert_eq!(parts.iter().map(|part| part.name.as_str()).collect::<Vec<_>>(), ["walk", "other"]);
        let options = TrainPoseOptions { epochs: 6, hidden: vec![24], ..TrainPoseOptions::default() };
        let run = home.path().join("run");
        let rows = cross(CrossKind::Dataset, &parts, &options, &run, |_, _| {}).unwrap();
        for input in CROSS_INPUTS {
            let on = |part: &str| rows.iter().find(|row| row.input == input.name && row.tested_on == part).unwrap();
            let (within, there) = (on("walk (within)"), on("other"));
            assert_eq!((within.frames, within.sequences), (4, 1), "every fifth of six sequences, from the second on");
            if input.features.of_joints() {
                assert_eq!((there.frames, there.sequences, there.joints), (24, 6, 17), "{}", input.name);
                assert!(there.majpe_mm.is_some() && there.why.is_none());
            } else {
                assert_eq!((there.frames, there.majpe_mm), (0, None));
                assert_eq!(there.why.as_deref(), Some("it reads 2 maps, not 1"));
            }
        }
        let text = std::fs::read_to_string(run.join("table.md")).unwrap();
        assert!(
            text.starts_with("# cross-dataset\n") && text.contains("Heatmap on other: it reads 2 maps, not 1."),
            "{text}"
        );
        assert!(text.contains("218.7 / 201.3"), "{text}");
    }
}
