//! The thread that looks at fits from outside the worker: gathers evidence, of which only the newest request counts, and
//! computes the maps of pinned fits.

use super::Wake;
use crate::body::Pppr;
use crate::mhp::{Objective, Precision, masks, simulate};
use crate::session::effect::PinRequest;
use crate::session::evidence::EvidenceRequest;
use crate::session::report::Report;
use crate::start::problem_alone;
use crate::task::panic_as_error;
use crate::worker::Snapshot;
use crossbeam_channel::{Receiver, Sender, unbounded};
use std::sync::Arc;

/// What is asked of the thread.
pub(super) enum Ask {
    Evidence(Box<EvidenceRequest>),
    Pin(Box<PinRequest>),
}

/// The window's end.
pub(super) struct EvidenceKeeper {
    requests: Sender<Ask>,
    answers: Receiver<Report>,
}

impl EvidenceKeeper {
    /// Starts the thread `evidence`; it ends with its keeper.
    pub(super) fn start(wake: &Wake) -> Self {
        let (requests, inbox) = unbounded();
        let (told, answers) = unbounded();
        let waker = Arc::clone(wake);
        let spawned = std::thread::Builder::new().name("evidence".into()).spawn(move || {
            while let Ok(ask) = inbox.recv() {
                let mut asks = vec![ask];
                asks.extend(inbox.try_iter());
                for ask in newest(asks) {
                    if told.send(answer(ask)).is_err() {
                        return;
                    }
                    waker();
                }
            }
        });
        if let Err(reason) = spawned {
            tracing::error!("no thread for evidence: {reason}");
        }
        Self { requests, answers }
    }

    pub(super) fn ask(&self, ask: Ask) {
        // Without a thread there is no evidence, as was logged.
        let _ = self.requests.send(ask);
    }

    pub(super) fn poll(&self) -> Option<Report> {
        self.answers.try_recv().ok()
    }
}

/// All pins, and of the requests for evidence the last.
fn newest(asks: Vec<Ask>) -> Vec<Ask> {
    let (mut pins, mut evidence) = (Vec::new(), None);
    for ask in asks {
        match ask {
            Ask::Pin(_) => pins.push(ask),
            Ask::Evidence(_) => evidence = Some(ask),
        }
    }
    evidence.into_iter().chain(pins).collect()
}

fn answer(ask: Ask) -> Report {
    match ask {
        Ask::Evidence(request) => {
            let found = panic_as_error(|| Ok(request.gather()));
            Report::EvidenceFound(request.frame.index, request.fit, found)
        }
        Ask::Pin(request) => Report::PinDrawn(request.pin.id, panic_as_error(|| drawn(&request).map(Box::new))),
    }
}

/// The maps and masks of a pin.
fn drawn(request: &PinRequest) -> Result<Snapshot, String> {
    let PinRequest { dataset, pin } = request;
    let frame = dataset.load(pin.frame).map_err(|error| error.to_string())?;
    let in_file = |error: &dyn std::fmt::Display| format!("{}: {error}", dataset.frame_path(pin.frame).display());
    let problem = Arc::new(problem_alone(dataset, &frame).map_err(|error| in_file(&error))?);
    let check = |params: &Pppr| problem.check(params).map_err(|error| in_file(&error));
    check(&pin.initial)?;
    check(&pin.params)?;
    let objective = Objective::new(Arc::clone(&problem), pin.config, pin.precision, &pin.initial);
    let mut objective = objective.map_err(|error| in_file(&error))?;
    let evaluation = objective.evaluate(&pin.params);
    // Pictures are in single precision, as the worker's: a pin looks the same before and after it was kept in a file.
    let h_sim = simulate(&problem, &pin.config, Precision::F32, &pin.params);
    let masks = h_sim.iter().enumerate().map(|(view, map)| masks(&objective, view, map)).collect();
    Ok(Snapshot {
        job: 0,
        branch: 0,
        iteration: pin.iteration(),
        live: false,
        config: pin.config,
        params: pin.params.clone(),
        evaluation,
        h_sim,
        masks,
        iterations_per_s: 0.0,
    })
}
