//! A model as `predict` runs it, whoever made it.

use super::card::Features;
use super::examples::{ParamsOf, prediction_inputs};
use super::model::{ModelError, PoseNetwork};
use super::onnx::OnnxModel;
use crate::config::FitConfig;
use crate::dataset::Dataset;
use crate::geometry::{Vec3, add};
use std::path::Path;

/// What a model reads at once: of a person, or of a whole frame.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelInput {
    /// The numbers of each tensor, C order.
    pub tensors: Vec<Vec<f32>>,
    /// Where the point is that answered joints are about, m.
    pub about: Vec3,
}

/// What reads frames or their fits and answers joints.
pub trait JointModel {
    /// The joints that it answers, in order.
    fn joints(&self) -> &[String];

    /// Whether a frame must be fitted.
    fn needs_fit(&self) -> bool;

    /// Frames on each side whose fits it reads.
    fn reach(&self) -> usize;

    /// What it reads of a frame: once, or once a person.
    ///
    /// # Errors
    /// Why nothing can be read, in words.
    fn read(&self, dataset: &Dataset, index: usize, params: &ParamsOf) -> Result<Vec<ModelInput>, String>;

    /// The joints of each person that it sees, m, in the radar's frame.
    ///
    /// # Errors
    /// Where it cannot be run, or answers what is no number.
    fn answer(&self, input: &ModelInput) -> Result<Vec<Vec<Vec3>>, String>;

    /// What it is, in a line.
    fn summary(&self) -> String;
}

/// Opens a model for a data set: one in ONNX by the ending of its name, with its description beside it or as `description`; any other
/// as one of `train-pose`. `config` is that of the fits which it reads.
///
/// # Errors
/// Where it cannot be read, or does not fit the data.
pub fn open_model(
    path: &Path,
    description: Option<&Path>,
    dataset: &Dataset,
    config: &FitConfig,
) -> Result<Box<dyn JointModel>, ModelError> {
    if path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("onnx")) {
        return Ok(Box::new(OnnxModel::open(path, description, dataset, config)?));
    }
    let network = PoseNetwork::read(path)?;
    match network.misfit(dataset) {
        Some(message) => Err(ModelError::Misfit { message, path: path.to_owned() }),
        None => Ok(Box::new(network)),
    }
}

impl PoseNetwork {
    /// Why it cannot read such data.
    fn misfit(&self, dataset: &Dataset) -> Option<String> {
        let (card, info) = (&self.card, dataset.info());
        if card.features.needs_fit() && card.joints != info.skeleton.joints {
            let joints = |of: &[String]| format!("{} joints, {}, …", of.len(), of.first().map_or("", String::as_str));
            let (of, is) = (joints(&card.joints), joints(&info.skeleton.joints));
            return Some(format!("it reads fits of {of}; the data set's have {is}"));
        }
        if card.features == Features::Pppr && card.doppler_features != info.radar.doppler_features {
            let (of, is) = (card.doppler_features, info.radar.doppler_features);
            return Some(format!("it reads {of} Doppler features a joint; the data set's radar has {is}"));
        }
        let maps = !card.features.of_joints() && card.maps.len() != info.views.len();
        maps.then(|| format!("it reads {} maps; the data set has {}", card.maps.len(), info.views.len()))
    }
}

impl JointModel for PoseNetwork {
    fn joints(&self) -> &[String] {
        &self.card.joints
    }

    fn needs_fit(&self) -> bool {
        self.card.features.needs_fit()
    }

    fn reach(&self) -> usize {
        self.card.architecture.reach()
    }

    fn read(&self, dataset: &Dataset, index: usize, params: &ParamsOf) -> Result<Vec<ModelInput>, String> {
        let read = prediction_inputs(dataset, index, params, self.card.features, self.card.architecture)?;
        Ok(read.into_iter().map(|(numbers, about)| ModelInput { tensors: vec![numbers], about }).collect())
    }

    fn answer(&self, input: &ModelInput) -> Result<Vec<Vec<Vec3>>, String> {
        let [numbers] = &input.tensors[..] else { return Err("it reads one list of numbers".into()) };
        Ok(vec![PoseNetwork::answer(self, numbers).into_iter().map(|p| add(p, input.about)).collect()])
    }

    fn summary(&self) -> String {
        format!(
            "{} on {}, {} parameters, {:.1} MB",
            self.card.architecture,
            self.card.features,
            self.parameters(),
            4e-6 * self.parameters() as f64,
        )
    }
}
