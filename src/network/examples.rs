//! Examples of a data set: what a network reads of each frame, and the joints that are there.

use super::card::{Architecture, Features};
use super::features::person_input;
use crate::body::Pppr;
use crate::dataset::{Dataset, Frame};
use crate::diagnose::person_pairs;
use crate::geometry::{Vec3, mean, sub};
use crate::start::problem_alone;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;

/// The parameters of each frame by index, where there is a fit.
pub type ParamsOf = BTreeMap<usize, Arc<Pppr>>;

/// One person of one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Example {
    /// The frame.
    pub frame: usize,
    /// What is read.
    pub input: Vec<f32>,
    /// The joints, as the network is to answer them, m.
    pub target: Vec<f32>,
    /// Where the fitted body's middle is, where joints are about it, m.
    pub middle: Vec3,
}

/// Examples of one sequence.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ExampleSet {
    /// The data set and the sequence.
    pub sequence: String,
    /// In the order of the frames.
    pub examples: Vec<Example>,
}

/// Examples of all people of frames with as many fitted as annotated, by sequence; and how many frames were left out, by why. Who is
/// who is the best pairing of the fit with the annotation.
///
/// # Errors
/// Where no frame is left, in words.
pub fn examples(
    dataset: &Dataset,
    params: &ParamsOf,
    features: Features,
    architecture: Architecture,
) -> Result<(Vec<ExampleSet>, BTreeMap<&'static str, usize>), String> {
    let joints = dataset.info().skeleton.joints.len();
    let made: Vec<Result<Vec<Example>, &'static str>> = (0..dataset.len())
        .into_par_iter()
        .map(|index| {
            let frame = dataset.load(index).map_err(|_| "cannot be read")?;
            let truth = frame.truth.as_ref().ok_or("has no joints in metres")?;
            if truth.persons == 0 {
                return Err("shows nobody");
            }
            let inputs = inputs_of(dataset, &frame, params, features, architecture)?;
            if inputs.len() != truth.persons {
                return Err("is fitted with another number of people than annotated");
            }
            let fitted = params.get(&index).filter(|fitted| fitted.shape().persons == truth.persons);
            let pairs = match fitted {
                Some(fitted) => person_pairs(fitted.positions(), &truth.joints, joints),
                None => (0..inputs.len()).map(|person| (person, person)).collect(),
            };
            let example = |((input, middle), (_, person)): ((Vec<f32>, Vec3), (usize, usize))| {
                let own = &truth.joints[person * joints..(person + 1) * joints];
                let target = own.iter().flat_map(|&p| sub(p, middle)).map(|x| x as f32).collect();
                Example { frame: index, input, target, middle }
            };
            Ok(inputs.into_iter().zip(pairs).map(example).collect())
        })
        .collect();
    let (mut sets, mut left_out) = (Vec::<ExampleSet>::new(), BTreeMap::new());
    for (index, of_frame) in made.into_iter().enumerate() {
        match of_frame {
            Err(why) => *left_out.entry(why).or_default() += 1,
            Ok(of_frame) => {
                let sequence = format!("{}/{}", dataset.info().name, dataset.sequence(index));
                match sets.last_mut() {
                    Some(set) if set.sequence == sequence => set.examples.extend(of_frame),
                    _ => sets.push(ExampleSet { sequence, examples: of_frame }),
                }
            }
        }
    }
    if sets.is_empty() {
        let why: Vec<String> = left_out.iter().map(|(why, n)| format!("{n} {why}")).collect();
        return Err(format!("{}: no frame can teach anything: {}", dataset.info().root.display(), why.join(", ")));
    }
    Ok((sets, left_out))
}

/// What is read of each person of a frame, and where its middle is.
///
/// # Errors
/// Why nothing can be read.
pub fn prediction_inputs(
    dataset: &Dataset,
    index: usize,
    params: &ParamsOf,
    features: Features,
    architecture: Architecture,
) -> Result<Vec<(Vec<f32>, Vec3)>, &'static str> {
    let frame = dataset.load(index).map_err(|_| "cannot be read")?;
    inputs_of(dataset, &frame, params, features, architecture)
}

fn inputs_of(
    dataset: &Dataset,
    frame: &Frame,
    params: &ParamsOf,
    features: Features,
    architecture: Architecture,
) -> Result<Vec<(Vec<f32>, Vec3)>, &'static str> {
    let own = params.get(&frame.index);
    if features.needs_fit() && own.is_none() {
        return Err("has no fit");
    }
    let centred = features.of_joints() && architecture != Architecture::Mlp;
    let persons = own.map_or(1, |own| own.shape().persons).max(1);
    let reach = architecture.reach() as isize;
    let mut inputs = Vec::with_capacity(persons);
    for person in 0..persons {
        let mut input = Vec::new();
        for other in (-reach..=reach).map(|step| beside(dataset, frame.index, step)) {
            let beside = (other != frame.index).then(|| dataset.load(other).ok()).flatten();
            let shown = beside.as_ref().unwrap_or(frame);
            // A frame that shows other people tells nothing of this one: the frame itself stands for it.
            let of = params.get(&shown.index).filter(|of| own.is_none_or(|own| own.shape() == of.shape())).or(own);
            let same = |of: &Pppr| match own {
                // Persons are in the order of each frame's own count.
                Some(own) if persons > 1 => {
                    let pairs = person_pairs(own.positions(), of.positions(), own.shape().joints);
                    pairs.into_iter().find(|(mine, _)| *mine == person).map_or(person, |(_, theirs)| theirs)
                }
                _ => person,
            };
            let of = of.map(|of| (of.as_ref(), same(of)));
            let problem = if features == Features::PpprHeatmap || (features == Features::Heatmap && persons > 1) {
                Some(Arc::new(problem_alone(dataset, shown).map_err(|_| "has no finite cell")?))
            } else {
                None
            };
            let read = person_input(features, architecture, of, &shown.maps, problem.as_ref());
            input.extend(read.ok_or("has no fit")?);
        }
        let middle = own.filter(|_| centred).map_or([0.0; 3], |own| mean(own.person(person)));
        inputs.push((input, middle));
    }
    Ok(inputs)
}

/// The frame `step` after one (before it where negative): at an end of its sequence the last one.
pub(super) fn beside(dataset: &Dataset, index: usize, step: isize) -> usize {
    let sequence = dataset.sequence(index);
    let inside = |other: &usize| *other < dataset.len() && dataset.sequence(*other) == sequence;
    let wanted = |distance: usize| index.checked_add_signed(step.signum() * distance as isize);
    (0..=step.unsigned_abs()).rev().find_map(|distance| wanted(distance).filter(inside)).unwrap_or(index)
}
