//! What the fit went through, projected onto a slice, and the poses that are marked on it.

use crate::app::theme::Tokens;
use crate::explore::LossSlice;
use crate::session::Session;
use egui::Color32;

/// States of the way at most.
const MOST: usize = 240;

/// What a mark stands for.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    Start,
    Shown,
    End,
    Pin,
    Truth,
}

/// A pose on the slice.
pub(super) struct Mark {
    pub(super) role: Role,
    pub(super) name: String,
    pub(super) sign: &'static str,
    /// In the axes' units.
    pub(super) at: Vec<f64>,
}

impl Mark {
    pub(super) fn color(&self, tokens: &Tokens) -> Color32 {
        match self.role {
            Role::Start => tokens.dim,
            Role::Shown | Role::End => tokens.text,
            Role::Pin => tokens.pin,
            Role::Truth => tokens.truth,
        }
    }
}

/// The way of the fit, and what is marked.
pub(super) struct Marks {
    /// In the axes' units, from the start to the end.
    pub(super) way: Vec<Vec<f64>>,
    pub(super) places: Vec<Mark>,
}

/// Of the fit on screen.
pub(super) fn of(session: &Session, slice: &LossSlice) -> Marks {
    let mut marks = Marks { way: Vec::new(), places: Vec::new() };
    let Some(problem) = &session.fit.problem else { return marks };
    let project = |pose: &[crate::geometry::Vec3]| slice.project(&problem.skeleton, pose);
    let states: Vec<_> =
        session.fit.history.lineage().into_iter().flatten().filter_map(|row| row.state.as_ref()).collect();
    let stride = states.len().div_ceil(MOST).max(1);
    let last = states.len().saturating_sub(1);
    let thinned = states.iter().enumerate().filter(|(k, _)| k % stride == 0 || *k == last);
    marks.way = thinned.filter_map(|(_, state)| project(state.params.positions())).collect();
    let mut mark = |role: Role, name: &str, sign: &'static str, pose: &[crate::geometry::Vec3]| {
        if let Some(at) = project(pose) {
            marks.places.push(Mark { role, name: name.to_owned(), sign, at });
        }
    };
    if let Some(first) = states.first() {
        mark(Role::Start, "start", "◇", first.params.positions());
    }
    if let Some(end) = states.last().filter(|_| states.len() > 1) {
        mark(Role::End, "end", "■", end.params.positions());
    }
    if let Some(shown) = &session.fit.shown {
        mark(Role::Shown, "on screen", "○", shown.params.positions());
    }
    for pin in session.pins.list().iter().filter(|pin| pin.frame == session.fit.frame) {
        mark(Role::Pin, &pin.name, "▲", pin.params.positions());
    }
    if let Some(truth) = session.data.frame.as_ref().and_then(|frame| frame.truth.as_ref()) {
        mark(Role::Truth, "truth", "+", &truth.joints);
    }
    marks
}
