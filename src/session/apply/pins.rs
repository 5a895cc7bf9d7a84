//! Pinning the state on screen, and going back to where a pin was made.

use crate::session::effect::Effect;
use crate::session::pins::{MOST_PINS, Pin, PinRow};
use crate::session::state::{LogLevel, Session};
use crate::worker::Snapshot;
use std::sync::Arc;

impl Session {
    /// Keeps what is on screen: frame, iteration, settings. The first pin becomes the baseline.
    pub(super) fn pin_fit(&mut self) -> Vec<Effect> {
        let (Some(shown), Some(initial), Some(frame)) = (&self.fit.shown, self.fit.region_pose(), &self.data.frame)
        else {
            return Vec::new();
        };
        if self.pins.list.len() >= MOST_PINS {
            self.note(LogLevel::Error, format!("{MOST_PINS} fits are pinned, and no more can be; remove one first"));
            return Vec::new();
        }
        let rows = self.fit.history.lineage().into_iter().flatten();
        let rows = rows.take_while(|row| row.report.iteration <= shown.iteration);
        let rows = rows.map(|row| PinRow { report: row.report.clone(), majpe_mm: row.majpe_mm }).collect();
        let pin = Pin {
            id: self.pins.made,
            name: self.pins.next_name(),
            frame: frame.index,
            frame_name: frame.name.clone(),
            config: shown.config,
            precision: self.precision,
            initial: initial.clone(),
            params: shown.params.clone(),
            rows,
            snapshot: Some(Arc::clone(shown)),
        };
        self.pins.made += 1;
        let text = format!("pinned {}: iteration {} of {}", pin.name, shown.iteration, pin.frame_name);
        if self.pins.baseline.is_none() {
            self.pins.baseline = Some(pin.id);
        }
        self.pins.list.push(pin);
        self.hint(text);
        Vec::new()
    }

    pub(super) fn remove_pin(&mut self, id: u32) -> Vec<Effect> {
        self.pins.list.retain(|pin| pin.id != id);
        if self.pins.baseline == Some(id) {
            self.pins.baseline = self.pins.list.first().map(|pin| pin.id);
        }
        Vec::new()
    }

    pub(super) fn rename_pin(&mut self, id: u32, name: &str) -> Vec<Effect> {
        let name = name.trim();
        if let Some(pin) = self.pins.list.iter_mut().find(|pin| pin.id == id).filter(|_| !name.is_empty()) {
            name.clone_into(&mut pin.name);
        }
        Vec::new()
    }

    pub(super) fn set_baseline(&mut self, id: Option<u32>) -> Vec<Effect> {
        self.pins.baseline = id.filter(|&id| self.pins.get(id).is_some());
        Vec::new()
    }

    /// Maps of a pin from a session file were computed.
    pub(super) fn pin_drawn(&mut self, id: u32, result: Result<Box<Snapshot>, String>) -> Vec<Effect> {
        match result {
            Ok(snapshot) => {
                // Numbers begin anew with every data set: a late answer is told by its parameters.
                let same = |pin: &&mut Pin| pin.id == id && pin.params == snapshot.params;
                if let Some(pin) = self.pins.list.iter_mut().find(same) {
                    pin.snapshot = Some(Arc::new(*snapshot));
                }
            }
            Err(why) => self.note(LogLevel::Warning, format!("a pinned fit has no maps: {why}")),
        }
        Vec::new()
    }
}
