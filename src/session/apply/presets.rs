//! The frame on screen is fitted with two presets, to choose between them.

use crate::session::effect::Effect;
use crate::session::presets::{PresetCard, PresetFits};
use crate::session::state::Session;
use std::sync::Arc;

impl Session {
    pub(super) fn compare_presets(&mut self) -> Vec<Effect> {
        let shown = self.data.dataset.clone().zip(self.data.frame.clone());
        let Some((dataset, frame)) = shown else { return Vec::new() };
        self.presets = PresetCard::Fitting;
        vec![Effect::FitPresets(dataset, frame, self.precision)]
    }

    /// The fits are there; of another frame than the one on screen, or after the card was closed, nobody asks.
    pub(super) fn presets_fitted(&mut self, fits: Arc<PresetFits>) -> Vec<Effect> {
        let same = self.data.frame.as_ref().is_some_and(|frame| Arc::ptr_eq(frame, &fits.frame));
        if matches!(self.presets, PresetCard::Fitting) && same {
            self.presets = PresetCard::Shown(fits);
        }
        Vec::new()
    }
}
