//! What can be drawn of the fits of a map.

use crate::study::run::SweptFit;
use serde::{Deserialize, Serialize};

/// A number of a fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TunedQuantity {
    /// L at the end.
    #[default]
    Loss,
    /// L_EM at the end.
    Em,
    /// Mean forward-consistency IoU.
    Iou,
    /// MAJPE, mm.
    Majpe,
    /// PA-MAJPE, mm.
    PaMajpe,
    /// Joints against key points of an image, px.
    Reprojection,
    /// The first iteration at which the fit had settled.
    Settled,
}

impl TunedQuantity {
    /// All of them.
    pub const ALL: [Self; 7] =
        [Self::Loss, Self::Em, Self::Iou, Self::Majpe, Self::PaMajpe, Self::Reprojection, Self::Settled];

    /// The word on the command line and in JSON.
    pub fn key(self) -> &'static str {
        match self {
            Self::Loss => "loss",
            Self::Em => "em",
            Self::Iou => "iou",
            Self::Majpe => "majpe",
            Self::PaMajpe => "pa_majpe",
            Self::Reprojection => "reprojection",
            Self::Settled => "settled",
        }
    }

    /// The quantity with this key.
    pub fn of_key(key: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|quantity| quantity.key() == key)
    }

    /// On buttons.
    pub fn title(self) -> &'static str {
        match self {
            Self::Loss => "L",
            Self::Em => "L_EM",
            Self::Iou => "IoU",
            Self::Majpe => "MAJPE",
            Self::PaMajpe => "PA-MAJPE",
            Self::Reprojection => "Reprojection",
            Self::Settled => "Settled at",
        }
    }

    /// Unit, or "".
    pub fn unit(self) -> &'static str {
        match self {
            Self::Loss | Self::Em | Self::Iou => "",
            Self::Majpe | Self::PaMajpe => "mm",
            Self::Reprojection => "px",
            Self::Settled => "iterations",
        }
    }

    /// What it is.
    pub fn help(self) -> &'static str {
        match self {
            Self::Loss => "L at the end of each fit. Not comparable between weights.",
            Self::Em => "L_EM at the end, unweighted. Not comparable between objectives, regions and τ.",
            Self::Iou => "Forward-consistency IoU at the end, mean over views. Larger is better.",
            Self::Majpe => "Mean joint position error against truth at the end, mm; persons paired best.",
            Self::PaMajpe => "The same after rotation, translation and scale of each person, mm.",
            Self::Reprojection => "Joints projected into the camera against the key points of the image's labels, px.",
            Self::Settled => {
                "The first iteration at which L changed by less than 0.1 % over ten and no joint moved more than a fifth of \
                 what the learning rate lets it."
            }
        }
    }

    /// Whether a small number is a good one.
    pub fn less_is_better(self) -> bool {
        self != Self::Iou
    }

    /// As a number in a table.
    pub fn text(self, value: f64) -> String {
        match self {
            Self::Loss | Self::Em => format!("{value:.4}"),
            Self::Iou => format!("{value:.3}"),
            Self::Majpe | Self::PaMajpe | Self::Reprojection => format!("{value:.1}"),
            Self::Settled => format!("{value:.0}"),
        }
    }

    /// Of a fit; `None` where it is not known.
    pub fn of(self, fit: &SweptFit) -> Option<f64> {
        let numbers = fit.row.fit.as_ref().ok()?;
        match self {
            Self::Loss => Some(numbers.loss),
            Self::Em => numbers.terms.get("em").flatten(),
            Self::Iou => numbers.mean_iou(),
            Self::Majpe => numbers.majpe_mm,
            Self::PaMajpe => numbers.pa_majpe_mm,
            Self::Reprojection => numbers.reprojection_px,
            Self::Settled => fit.settled_at.map(|at| at as f64),
        }
    }
}
