//! What the tensors of a model are: a small TOML beside it.

use crate::body::Skeleton;
use crate::input::{MOST_TEXT, read_text};
use crate::network::ModelError;
use crate::predictions::{Axes, Unit};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// What a model reads and gives.
///
/// ```toml
/// [[input]]
/// tensor = "maps"        # the model's own name; may be left out where it has one input
/// is = "map"             # map, pppr-heatmap, pppr-pc, pppr or fit-joints
/// views = ["hm_hori"]    # of maps: which, as channels; all of them unless said
/// frames = [-2, -1, 0]   # which frames beside the one that is asked; [0] unless said
/// normalisation = "max"  # of maps: none, max, standard (mean 0, deviation 1) or db (20 log10 of the maximum, no less than floor_db)
/// size = [224, 224]      # of maps: brought to these rows and columns, bilinear, corners on corners
/// mean = 0.1             # then taken off, and divided by
/// std = 0.25
/// shape = [1, 6, 224, 224] # of the tensor, where the model leaves it open
///
/// [output]
/// tensor = "joints"      # as above; of three numbers a joint, a person after the other
/// skeleton = "hupr14"    # or joints = ["nose", ...], in the model's order
/// unit = "m"
/// axes = "camera"        # as of predictions: radar unless said
/// about = "radar"        # or pelvis, middle: what the model answers is about that point of the fitted body
/// scores = "scores"      # a number a person, if the model gives some; who has less than least_score is nobody
/// least_score = 0.5
/// take = 4               # of several rows (the frames of a clip), the one that counts
/// ```
///
/// Of `fit-joints` an input says `skeleton` or `joints`, `unit`, `axes`, `about` and `mapping` (a joint of the model = a joint of
/// the data set); of `pppr` `about`; of `pppr-pc` how many `points` (x, y, z, radial velocity, intensity; the brightest first, rows of
/// zeros behind). `pppr` has 16 + N_d numbers a joint: position, log scale, rotation, velocity, β, ω, opacity, radial velocity. Values
/// are in the order frame, view, row, column; frame, point; frame, joint.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OnnxDescription {
    /// The tensors that it reads.
    pub input: Vec<InputDescription>,
    /// The joints that it gives.
    pub output: OutputDescription,
}

/// What an input is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum InputKind {
    /// Measured maps.
    Map,
    /// The maps of a fit, in the scale of the measured ones.
    PpprHeatmap,
    /// Points of a fit's maps.
    PpprPc,
    /// The parameters of every joint of a person.
    Pppr,
    /// The joints of a person's fit.
    FitJoints,
}

impl InputKind {
    /// Whether it needs a fit.
    pub fn needs_fit(self) -> bool {
        self != Self::Map
    }

    /// Whether it is of one person, and the model is asked for each of them.
    pub fn of_person(self) -> bool {
        matches!(self, Self::Pppr | Self::FitJoints)
    }
}

/// How a map's values are brought to a scale.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Normalisation {
    /// As they are in the file.
    #[default]
    None,
    /// Divided by the map's largest.
    Max,
    /// Less their mean, by their standard deviation.
    Standard,
    /// Decibels about the map's largest.
    Db,
}

/// The point that joints are about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum About {
    /// The radar.
    #[default]
    Radar,
    /// The middle of the fitted body's hips.
    Pelvis,
    /// The mean of the fitted body's joints.
    Middle,
}

/// One tensor that a model reads; [`OnnxDescription`] has the keys.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InputDescription {
    /// The model's name of it.
    pub tensor: Option<String>,
    /// What it is.
    pub is: InputKind,
    /// Arrays of the data set, as channels.
    #[serde(default)]
    pub views: Vec<String>,
    /// Frames beside the one that is asked.
    #[serde(default = "this_frame")]
    pub frames: Vec<isize>,
    /// The scale of maps.
    #[serde(default)]
    pub normalisation: Normalisation,
    /// The least of decibels.
    #[serde(default = "floor_db")]
    pub floor_db: f64,
    /// Rows and columns of maps.
    pub size: Option<[usize; 2]>,
    /// Taken off every value.
    #[serde(default)]
    pub mean: f64,
    /// What every value is divided by.
    #[serde(default = "one")]
    pub std: f64,
    /// The tensor's shape.
    pub shape: Option<Vec<usize>>,
    /// Points of PPPR-PC.
    #[serde(default = "points")]
    pub points: usize,
    /// A known skeleton whose joints are read.
    pub skeleton: Option<String>,
    /// The joints that are read.
    pub joints: Option<Vec<String>>,
    /// Joints of the model, and what the data set calls them.
    #[serde(default)]
    pub mapping: BTreeMap<String, String>,
    /// The unit of joints.
    pub unit: Option<Unit>,
    /// The axes of joints.
    pub axes: Option<Axes>,
    /// The point that joints are about.
    #[serde(default)]
    pub about: About,
}

/// What a model gives; [`OnnxDescription`] has the keys.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OutputDescription {
    /// The model's name of the joints.
    pub tensor: Option<String>,
    /// A known skeleton whose joints are given.
    pub skeleton: Option<String>,
    /// The joints that are given.
    pub joints: Option<Vec<String>>,
    /// The unit.
    pub unit: Unit,
    /// The axes.
    #[serde(default = "world")]
    pub axes: Axes,
    /// The point that joints are about.
    #[serde(default)]
    pub about: About,
    /// The model's name of a number a person.
    pub scores: Option<String>,
    /// Who has less is nobody.
    #[serde(default = "half")]
    pub least_score: f64,
    /// The one row of several that counts.
    pub take: Option<usize>,
}

fn this_frame() -> Vec<isize> {
    vec![0]
}

fn floor_db() -> f64 {
    -60.0
}

fn one() -> f64 {
    1.0
}

fn half() -> f64 {
    0.5
}

fn points() -> usize {
    1024
}

fn world() -> Axes {
    Axes::WORLD
}

impl OnnxDescription {
    /// Where the description of a model lies unless it is said: `M.onnx.toml`.
    pub fn beside(model: &Path) -> PathBuf {
        let mut name = model.as_os_str().to_owned();
        name.push(".toml");
        PathBuf::from(name)
    }

    /// A description.
    ///
    /// # Errors
    /// Where it cannot be read, or a key is none or has no meaning.
    pub fn from_file(path: &Path) -> Result<Self, ModelError> {
        let text = read_text(path, "a description of a model", MOST_TEXT)
            .map_err(|reason| ModelError::Read { reason, path: path.to_owned() })?;
        let wrong = |message: String, line| ModelError::Description { message, line, path: path.to_owned() };
        let read: Self = toml::from_str(&text).map_err(|error| {
            let line = error.span().map(|span| text.get(..span.start).unwrap_or_default().matches('\n').count() + 1);
            wrong(error.message().to_owned(), line)
        })?;
        read.fault().map_or(Ok(read), |message| Err(wrong(message, None)))
    }

    /// The joints that the model gives, in its order.
    pub fn joints(&self) -> Vec<String> {
        joints_of(self.output.skeleton.as_deref(), self.output.joints.as_ref()).unwrap_or_default()
    }

    /// Whether the model is asked for each person of a fit.
    pub fn of_person(&self) -> bool {
        self.output.about != About::Radar || self.input.iter().any(|input| input.is.of_person())
    }

    /// Whether a fit must be there.
    pub fn needs_fit(&self) -> bool {
        self.of_person() || self.input.iter().any(|input| input.is.needs_fit())
    }

    /// What has no meaning.
    fn fault(&self) -> Option<String> {
        if self.input.is_empty() {
            return Some("no [[input]]; expected one for each tensor that the model reads".into());
        }
        for input in &self.input {
            let of = input.tensor.as_deref().map_or(String::new(), |name| format!(" of `{name}`"));
            if input.frames.is_empty() {
                return Some(format!("frames{of} = []; expected at least one, 0 for the frame that is asked"));
            }
            if input.frames.len() > MOST_FRAMES {
                return Some(format!("frames{of}: {}; expected no more than {MOST_FRAMES}", input.frames.len()));
            }
            if input.frames.iter().any(|frame| frame.unsigned_abs() > MOST_FRAMES) {
                return Some(format!("frames{of}: expected none beyond {MOST_FRAMES} from the one that is asked"));
            }
            if !(input.std.is_finite() && input.std != 0.0 && input.mean.is_finite()) {
                return Some(format!(
                    "mean{of} = {}, std = {}; expected finite numbers, std not 0",
                    input.mean, input.std
                ));
            }
            if !(input.floor_db.is_finite() && input.floor_db < 0.0) {
                return Some(format!("floor_db{of} = {}; expected a number below 0", input.floor_db));
            }
            if input.size.is_some_and(|size| size.iter().any(|bins| !(1..=MOST_BINS).contains(bins))) {
                return Some(format!("size{of}: expected rows and columns of 1 to {MOST_BINS}"));
            }
            if !(1..=MOST_POINTS).contains(&input.points) {
                return Some(format!("points{of} = {}; expected 1 to {MOST_POINTS}", input.points));
            }
            if input.is == InputKind::FitJoints
                && let Err(why) = joints_of(input.skeleton.as_deref(), input.joints.as_ref())
            {
                return Some(format!("input{of}: {why}"));
            }
        }
        match joints_of(self.output.skeleton.as_deref(), self.output.joints.as_ref()) {
            Ok(joints) if joints.is_empty() => {
                Some("[output] joints = []; expected the joints in the model's order".into())
            }
            Ok(_) if !self.output.least_score.is_finite() => Some("least_score: expected a finite number".into()),
            Ok(_) => None,
            Err(why) => Some(format!("[output]: {why}")),
        }
    }
}

/// Frames on a side, cells of a side and points that are read at most.
const MOST_FRAMES: usize = 512;
const MOST_BINS: usize = 4096;
const MOST_POINTS: usize = 1 << 16;

/// The joints by name, in order.
pub(super) fn joints_of(skeleton: Option<&str>, joints: Option<&Vec<String>>) -> Result<Vec<String>, String> {
    match (skeleton, joints) {
        (_, Some(joints)) => Ok(joints.clone()),
        (Some(name), None) => Skeleton::preset(name)
            .map(|skeleton| skeleton.joints)
            .ok_or_else(|| format!("skeleton \"{}\"; expected {}", name.escape_debug(), Skeleton::PRESETS.join(", "))),
        (None, None) => Err(format!(
            "nothing says the joints; expected joints = [...] or skeleton = {}",
            Skeleton::PRESETS.join(", ")
        )),
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "a test stops where a file cannot be written")]
    use super::*;

    #[test]
    fn every_wrong_key_is_told_once_with_what_was_expected() {
        let home = tempfile::tempdir().unwrap();
        let file = home.path().join("m.onnx.toml");
        let told = |text: &str| {
            std::fs::write(&file, text).unwrap();
            OnnxDescription::from_file(&file).unwrap_err().to_string()
        };
        let output = "[output]\nskeleton = \"coco17\"\nunit = \"m\"\n";
        for (text, expected) in [
            ("", "missing field `input`"),
            (&format!("[[input]]\nis = \"map\"\nsize = 3\n{output}") as &str, "m.onnx.toml:3"),
            (&format!("[[input]]\nis = \"maps\"\n{output}"), "unknown variant `maps`, expected one of `map`"),
            (&format!("[[input]]\nis = \"map\"\nstd = 0.0\n{output}"), "std not 0"),
            (&format!("[[input]]\nis = \"map\"\nframes = []\n{output}"), "expected at least one"),
            (&format!("[[input]]\nis = \"fit-joints\"\n{output}"), "nothing says the joints"),
            ("[[input]]\nis = \"map\"\n[output]\nunit = \"m\"\nskeleton = \"smpl\"\n", "expected coco17"),
            ("[[input]]\nis = \"map\"\n[output]\njoints = []\nunit = \"m\"\n", "in the model's order"),
            ("[[input]]\nis = \"map\"\n[output]\nskeleton = \"coco17\"\nunit = \"feet\"\n", "unknown variant `feet`"),
            (&format!("[[input]]\nis = \"map\"\nfloor_db = 3.0\n{output}"), "below 0"),
        ] {
            let why = told(text);
            assert!(why.contains(expected) && why.contains("m.onnx.toml"), "{why}");
        }
    }
}
