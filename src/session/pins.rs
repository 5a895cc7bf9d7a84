//! Pinned fits: states that are kept to compare others with.

use crate::body::Pppr;
use crate::config::FitConfig;
use crate::mhp::{Precision, StepReport};
use crate::worker::Snapshot;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Pins that are kept at most: each holds its simulated maps.
pub const MOST_PINS: usize = 24;

/// One iteration of a pinned fit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PinRow {
    /// Loss, terms, IoU.
    pub report: StepReport,
    /// MAJPE, mm, where there is truth.
    pub majpe_mm: Option<f64>,
}

/// A state of a fit with the lineage that led to it.
#[derive(Debug, Clone)]
pub struct Pin {
    /// Its number.
    pub id: u32,
    /// Its name: a letter, until it is given another.
    pub name: String,
    /// The data set's frame.
    pub frame: usize,
    /// The frame's name.
    pub frame_name: String,
    /// Settings in force there.
    pub config: FitConfig,
    /// Scalar of the kernel.
    pub precision: Precision,
    /// The pose that fixes the EM region.
    pub initial: Pppr,
    /// The parameters.
    pub params: Pppr,
    /// Every iteration up to it.
    pub rows: Vec<PinRow>,
    /// Maps and masks; `None` until they are computed again from a session file.
    pub snapshot: Option<Arc<Snapshot>>,
}

impl Pin {
    /// The last iteration.
    pub fn iteration(&self) -> usize {
        self.rows.last().map_or(0, |row| row.report.iteration)
    }

    /// L, mean IoU and MAJPE at the pinned iteration.
    pub fn numbers(&self) -> [Option<f64>; 3] {
        self.rows.last().map_or([None; 3], |row| numbers(&row.report, row.majpe_mm))
    }
}

/// L, mean IoU and MAJPE of an iteration.
pub fn numbers(report: &StepReport, majpe_mm: Option<f64>) -> [Option<f64>; 3] {
    [Some(report.loss), super::apply::mean_known(&report.iou), majpe_mm]
}

/// The pins of the open data set.
#[derive(Debug, Default)]
pub struct Pins {
    pub(super) list: Vec<Pin>,
    /// The one that others are compared with.
    pub(super) baseline: Option<u32>,
    pub(super) made: u32,
}

impl Pins {
    /// In the order that they were made.
    pub fn list(&self) -> &[Pin] {
        &self.list
    }

    /// The pin called so.
    pub fn get(&self, id: u32) -> Option<&Pin> {
        self.list.iter().find(|pin| pin.id == id)
    }

    /// The one that others are compared with.
    pub fn baseline(&self) -> Option<&Pin> {
        self.get(self.baseline?)
    }

    /// A name that no pin has: A to Z, then A2 …, from the number of pins that were made on.
    pub(super) fn next_name(&self) -> String {
        let name = |made: u32| {
            let (letter, round) = (char::from(b'A' + (made % 26) as u8), made / 26);
            if round == 0 { letter.to_string() } else { format!("{letter}{}", round + 1) }
        };
        let free = |name: &String| self.list.iter().all(|pin| pin.name != *name);
        (self.made..=u32::MAX).map(name).find(free).unwrap_or_default()
    }
}
