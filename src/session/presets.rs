//! One frame fitted with two presets, to choose between them.

use crate::config::{FitConfig, Preset};
use crate::dataset::{Dataset, Frame};
use crate::mhp::Precision;
use crate::study::{BatchOptions, FrameFit, fit_frame};
use crate::task::panic_as_error;
use std::sync::Arc;

/// The presets that are compared: the paper to the letter, and what this program recommends.
pub(super) const COMPARED: [Preset; 2] = [Preset::Paper, Preset::Recommended];

/// The card on which two presets are compared.
#[derive(Debug, Clone, Default)]
pub enum PresetCard {
    /// Not on screen.
    #[default]
    Closed,
    /// The frame is being fitted.
    Fitting,
    /// Both fits, or why there are none.
    Shown(Arc<PresetFits>),
}

/// A frame, fitted with each of two presets.
#[derive(Debug)]
pub struct PresetFits {
    /// The frame.
    pub frame: Arc<Frame>,
    /// Its fits, or why there is none.
    pub fits: Vec<(Preset, Result<FrameFit, String>)>,
}

impl PresetFits {
    /// Fits a frame of a data set; slow.
    pub(super) fn of(dataset: &Dataset, frame: &Arc<Frame>, precision: Precision) -> Self {
        let fits = COMPARED.map(|preset| {
            let options = BatchOptions {
                // As the window fits: each frame by itself.
                config: FitConfig { decode_frames: 0, ..preset.config() },
                precision,
                warm_start: false,
                params_folder: None,
                ply: false,
                curves_folder: None,
                ..BatchOptions::default()
            };
            (preset, panic_as_error(|| fit_frame(dataset, frame.index, &options, None)))
        });
        Self { frame: Arc::clone(frame), fits: fits.into() }
    }
}
