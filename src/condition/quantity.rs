//! The numbers of an iteration that a breakpoint can ask for.

use crate::body::Group;
use crate::geometry::{Vec3, dot, norm, sub};
use crate::mhp::{Fitter, TermId, Weight};

/// A number of an iteration.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Quantity {
    Iteration,
    Loss,
    Term(TermId),
    /// Mean over the views.
    Iou,
    IouOf(String),
    /// The longest way of a joint from the iteration before, mm.
    StepMm,
    /// Length of the gradient in the joints' positions, 1/m.
    Gradient,
    /// Cosine between the gradients of two weighed sums in the joints' positions.
    Angle(Weight, Weight),
    MajpeMm,
}

/// What is known of an iteration.
pub(super) struct Iteration<'a> {
    pub(super) fitter: &'a Fitter,
    /// Where the joints were in the iteration before.
    pub(super) before: &'a [Vec3],
    pub(super) majpe_mm: Option<f64>,
}

/// Names of the numbers that are no term of the loss.
const NAMES: [(&str, Quantity); 6] = [
    ("iteration", Quantity::Iteration),
    ("loss", Quantity::Loss),
    ("iou", Quantity::Iou),
    ("step_mm", Quantity::StepMm),
    ("grad", Quantity::Gradient),
    ("majpe", Quantity::MajpeMm),
];

/// A weight's sum by its name in a cosine: `em`, `kine`, …
fn sum_of(name: &str) -> Option<Weight> {
    Weight::ALL.iter().copied().find(|weight| weight.key().trim_start_matches("w_") == name)
}

/// Everything that [`Quantity::of`] knows, in words.
pub(super) fn known() -> String {
    let terms: Vec<String> = TermId::all().map(|term| format!("l_{}", term.key)).collect();
    let names: Vec<&str> = NAMES.iter().map(|(name, _)| *name).collect();
    let sums: Vec<&str> = Weight::ALL.iter().map(|weight| weight.key().trim_start_matches("w_")).collect();
    format!(
        "{}, iou_ARRAY, {}, or a cosine of two gradients such as em·kine (of {})",
        names.join(", "),
        terms.join(", "),
        sums.join(", ")
    )
}

impl Quantity {
    /// The number of this name, in capitals or not.
    pub(super) fn of(name: &str) -> Result<Self, String> {
        let lower = name.to_lowercase();
        let unknown = || format!("`{name}` is no number of an iteration; expected {}", known());
        if let Some((_, quantity)) = NAMES.iter().find(|(known, _)| *known == lower) {
            return Ok(quantity.clone());
        }
        if let Some((a, b)) = lower.split_once(['·', '*']) {
            let pair = sum_of(a.trim()).zip(sum_of(b.trim()));
            return pair.map(|(a, b)| Self::Angle(a, b)).ok_or_else(unknown);
        }
        let key = lower.strip_prefix("l_").unwrap_or(&lower);
        if let Some(term) = TermId::all().find(|term| term.key == key) {
            return Ok(Self::Term(term));
        }
        // The arrays are the data set's: in its own letters.
        match name.get(..4).filter(|head| head.eq_ignore_ascii_case("iou_")) {
            Some(_) => Ok(Self::IouOf(name[4..].to_owned())),
            None => Err(unknown()),
        }
    }

    /// Its value; `None` where the iteration has none.
    pub(super) fn value(&self, now: &Iteration<'_>) -> Option<f64> {
        let evaluation = now.fitter.evaluation();
        let params = now.fitter.params();
        match self {
            Self::Iteration => Some(now.fitter.iteration() as f64),
            Self::Loss => Some(evaluation.loss),
            Self::Term(term) => Some(evaluation.terms[*term]),
            Self::Iou => {
                let known: Vec<f64> = evaluation.iou.iter().flatten().copied().collect();
                (!known.is_empty()).then(|| known.iter().sum::<f64>() / known.len() as f64)
            }
            Self::IouOf(array) => {
                let view = now.fitter.objective().problem().views.iter().position(|view| view.array == *array)?;
                *evaluation.iou.get(view)?
            }
            Self::StepMm => {
                let ways = now.before.iter().zip(params.positions()).map(|(a, b)| 1000.0 * norm(sub(*a, *b)));
                (!now.before.is_empty()).then(|| ways.fold(0.0, f64::max))
            }
            Self::Gradient => Some(norm_of(evaluation.gradient.group(Group::Position))),
            Self::Angle(a, b) => {
                let [a, b] = [*a, *b].map(|weight| evaluation.gradients[weight as usize].group(Group::Position));
                let product: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
                let lengths = norm_of(a) * norm_of(b);
                (lengths > 0.0).then(|| product / lengths)
            }
            Self::MajpeMm => now.majpe_mm,
        }
    }
}

fn norm_of(of: &[f64]) -> f64 {
    of.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Whether each joint lies in the EM region of every view.
pub(super) fn inside(fitter: &Fitter) -> Vec<bool> {
    let objective = fitter.objective();
    let views = objective.problem().views.iter().zip(objective.regions());
    let views: Vec<_> = views.collect();
    let is_inside = |p: &Vec3| {
        let finite = dot(*p, *p).is_finite();
        finite
            && views.iter().all(|(view, region)| {
                let bins = view.bins_of(*p);
                // Of a Doppler axis a place says nothing.
                let axes = view.axes.iter().zip(&bins).zip(&region.bins);
                axes.filter(|((axis, _), _)| axis.kind != crate::radar::AxisKind::Doppler)
                    .all(|((_, &bin), &[lo, hi])| bin >= lo as f64 - 0.5 && bin <= hi as f64 - 0.5)
            })
    };
    fitter.params().positions().iter().map(is_inside).collect()
}
