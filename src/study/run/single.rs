//! One frame under the variants of a sweep, a fit at a time and in any order: the very rows that a run would make, for who
//! shows a sweep while it grows.

use super::fit::{LoadedFrame, TimedStart};
use super::row::RunRow;
use super::variant::Variant;
use crate::body::Pppr;
use crate::config::FitConfig;
use crate::dataset::Dataset;
use crate::geometry::Vec3;
use crate::mhp::{ErasedCells, Fitter, Precision, SETTLED_OVER, has_settled};
use crate::start::start_key;
use crate::task::panic_as_error;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// A start that somebody is looking for, or that was found.
type Found = Arc<OnceLock<Result<TimedStart, String>>>;

/// A frame, loaded once, with the starts that its fits share.
pub struct FrameSweep<'a> {
    dataset: &'a Dataset,
    frame: usize,
    loaded: LoadedFrame<'a>,
    starts: Mutex<Vec<(FitConfig, Found)>>,
}

/// One fit of a sweep.
#[derive(Debug, Clone, PartialEq)]
pub struct SweptFit {
    /// The row of a run.
    pub row: RunRow,
    /// Where the fit began; `None` where no start was found.
    pub start: Option<Arc<Pppr>>,
    /// The first iteration at which it had settled; `None` where it never did.
    pub settled_at: Option<usize>,
}

impl<'a> FrameSweep<'a> {
    /// Reads frame `frame`, of which no fit sees the cells that are `erased`.
    ///
    /// # Errors
    /// In one line that names the file.
    pub fn read(dataset: &'a Dataset, frame: usize, erased: &[ErasedCells]) -> Result<Self, String> {
        let loaded = panic_as_error(|| LoadedFrame::read(dataset, frame, erased))?;
        Ok(Self { dataset, frame, loaded, starts: Mutex::default() })
    }

    /// Fits the frame as row `number` of a sweep, from a start of its own peaks; `None` where `go_on` said no between two
    /// steps.
    pub fn fit(
        &self,
        (number, variant): (usize, &Variant),
        precision: Precision,
        go_on: &dyn Fn() -> bool,
    ) -> Option<SweptFit> {
        let start = self.start(&variant.config);
        let found = start.get_or_init(|| panic_as_error(|| self.loaded.cold(&variant.config)));
        let mut watch = Watch::default();
        let mut row = failed_row(self.dataset, (number, self.frame), String::new());
        match found {
            Err(why) => row.fit = Err(why.clone()),
            Ok(start) => {
                let (config, stops) = (&variant.config, [variant.config.iterations]);
                let mut fitter = Err(String::new());
                let answers = panic_as_error(|| {
                    let watch = |fitter: &Fitter| {
                        watch.see(fitter);
                        go_on()
                    };
                    Ok(self.loaded.fit_watched(config, precision, start, &stops, &mut fitter, watch))
                });
                let answer = match answers {
                    Ok(mut answers) => answers.pop()?,
                    Err(why) => Err(why),
                };
                if let Ok(fitter) = &fitter {
                    watch.see(fitter);
                }
                row.init_ms = start.init_ms;
                row.fit_ms = answer.as_ref().ok().map(|stop| stop.fit_ms);
                row.fit = answer.map(|stop| stop.numbers);
            }
        }
        let start = found.as_ref().ok().map(|start| Arc::new(start.params.clone()));
        Some(SweptFit { row, start, settled_at: watch.settled_at })
    }

    /// The place of the start that fits with these settings share.
    fn start(&self, config: &FitConfig) -> Found {
        let key = start_key(config);
        let mut starts = self.starts.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, found)) = starts.iter().find(|(known, _)| *known == key) {
            return Arc::clone(found);
        }
        let found = Found::default();
        starts.push((key, Arc::clone(&found)));
        found
    }
}

/// The row of a fit that there is not: (variant, frame), and why.
pub fn failed_row(dataset: &Dataset, (variant, frame): (usize, usize), why: String) -> RunRow {
    RunRow {
        variant,
        frame,
        name: dataset.frame_name(frame).to_owned(),
        sequence: dataset.sequence(frame).to_owned(),
        origin: dataset.origin(frame),
        stratum: None,
        passing: false,
        fit: Err(why),
        init_ms: None,
        fit_ms: None,
    }
}

/// Looks for the iteration from which on a fit moves no more.
#[derive(Default)]
struct Watch {
    latest: VecDeque<(f64, Vec<Vec3>)>,
    settled_at: Option<usize>,
}

impl Watch {
    fn see(&mut self, fitter: &Fitter) {
        if self.settled_at.is_some() {
            return;
        }
        let now = (fitter.evaluation().loss, fitter.params().positions().to_vec());
        if self.latest.len() == SETTLED_OVER
            && let Some((loss, before)) = self.latest.pop_front()
            && has_settled(fitter.config(), [loss, now.0], [&before, &now.1])
        {
            self.settled_at = Some(fitter.iteration());
        }
        self.latest.push_back(now);
    }
}
