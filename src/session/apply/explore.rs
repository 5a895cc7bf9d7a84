//! Explorations: asked for, filled as they come, and their fits taken as branches.
//!
//! ```text
//! Explore ──▶ Effect::Explore (a thread, latest wins) ──▶ Progress, Grew … Ended
//! DragFit … DragFit ──▶ Refit from the start of that fit ──▶ one branch, rewritten; EndDrag ──▶ one act
//! ```

use crate::explore::{
    AmbiguityRequest, Direction, Exploration, ExplorationKind, Explored, ExploredState, RestartRequest, SliceAlong,
    SliceRequest, TunedFrames, TuningRequest, down_the_gradient, line,
};
use crate::mhp::FitState;
use crate::radar::View;
use crate::session::effect::Effect;
use crate::session::explore::{AdoptedFit, ExploreNews};
use crate::session::pins::Pin;
use crate::session::settings::Drag;
use crate::session::state::{LogLevel, Session};
use crate::session::study::{StudyOrder, StudyRequest};
use crate::study::run::StudyKind;
use std::sync::Arc;

impl Session {
    /// What an exploration of what is on screen would be asked for.
    ///
    /// # Errors
    /// Why there is nothing to explore, for a person.
    pub fn exploration(&self, kind: ExplorationKind) -> Result<Exploration, String> {
        match kind {
            ExplorationKind::Tuning => self.tuning_request().map(Box::new).map(Exploration::Tuning),
            ExplorationKind::Landscape => self.slice_request().map(Box::new).map(Exploration::Landscape),
            ExplorationKind::Ambiguity => {
                let (state, person) = (self.explored_state()?, self.explored_person());
                let region = self.view.explore.ambiguity.region;
                Ok(Exploration::Ambiguity(Box::new(AmbiguityRequest { state, person, region })))
            }
            ExplorationKind::Restarts => self.restart_request().map(Box::new).map(Exploration::Restarts),
        }
    }

    /// The views as the fit on screen sees them: with the range offsets that it measured.
    pub fn seen_views(&self) -> &[View] {
        let stated = self.data.dataset.as_ref().map_or(&[][..], |dataset| &dataset.info().views);
        let config = self.fit.shown.as_ref().map_or(&self.config, |shown| &shown.config);
        let seen = self.fit.problem.as_ref().map(|problem| &problem.views_under(config)[..]);
        // Of another data set that is being opened there is no fit yet.
        let alike = |seen: &&[View]| {
            seen.len() == stated.len()
                && seen.iter().zip(stated).all(|(a, b)| (&a.array, &a.axes) == (&b.array, &b.axes))
        };
        seen.filter(alike).unwrap_or(stated)
    }

    /// The state on screen, as its fit sees it.
    ///
    /// # Errors
    /// Why there is none, for a person.
    pub fn explored_state(&self) -> Result<ExploredState, String> {
        let fit = &self.fit;
        let known = fit.problem.as_ref().zip(fit.shown.as_ref()).zip(fit.region_pose());
        let ((problem, shown), initial) = known.ok_or("there is no fit on screen")?;
        if shown.job != fit.job {
            return Err("the fit of this frame is not there yet".into());
        }
        Ok(ExploredState {
            problem: Arc::clone(problem),
            erased: fit.erased(),
            config: shown.config,
            precision: self.precision,
            initial: initial.clone(),
            params: shown.params.clone(),
        })
    }

    /// The person that is moved: that of the selected joint, else the first.
    fn explored_person(&self) -> usize {
        let joints = self.fit.problem.as_ref().map_or(1, |problem| problem.skeleton.joints.len().max(1));
        self.joint.map_or(0, |joint| joint / joints)
    }

    fn slice_request(&self) -> Result<SliceRequest, String> {
        let settings = &self.view.explore.landscape;
        let mut state = self.explored_state()?;
        let chosen = [Some(settings.along), settings.and.filter(|and| *and != settings.along)];
        if chosen.contains(&Some(SliceAlong::Pins)) {
            state.params = self.pinned(&settings.pins[0])?.params.clone();
        }
        let mut request = SliceRequest { state, directions: Vec::new(), spans: Vec::new() };
        for along in chosen.into_iter().flatten() {
            request.directions.push(self.direction(along)?);
            request.spans.push(along.span().map(|end| end * settings.reach.clamp(0.02, 5.0)));
        }
        Ok(request)
    }

    /// The pin of this name; the baseline where there is none of it.
    fn pinned(&self, name: &str) -> Result<&Pin, String> {
        let here = |pin: &&Pin| pin.frame == self.fit.frame;
        let named = self.pins.list().iter().filter(here).find(|pin| pin.name == name);
        let first = || self.pins.baseline().filter(here).or_else(|| self.pins.list().iter().find(here));
        named.or_else(first).ok_or_else(|| "pin a fit of this frame first: P".to_owned())
    }

    fn direction(&self, along: SliceAlong) -> Result<Direction, String> {
        let (person, shown) = (self.explored_person(), self.fit.shown.as_ref().ok_or("there is no fit on screen")?);
        let skeleton = &self.fit.problem.as_ref().ok_or("there is no fit on screen")?.skeleton;
        let joint = || -> Result<(usize, String), String> {
            let joint = self.joint.ok_or("select a joint: J, or a click on it")?;
            Ok((joint, skeleton.shown_name(joint % skeleton.joints.len().max(1))))
        };
        let of_joint = |axis: usize| joint().map(|(joint, name)| Direction::Joint { joint, axis, name });
        let bone = |lift: bool| {
            let (joint, name) = joint()?;
            let hangs = crate::mhp::Limb::of(skeleton, joint % skeleton.joints.len().max(1)).is_some();
            if hangs {
                Ok(Direction::Bone { joint, lift, name })
            } else {
                Err(format!("{name} is of the trunk: no bone turns it"))
            }
        };
        match along {
            SliceAlong::BodyX => Ok(Direction::Body { person, axis: 0 }),
            SliceAlong::BodyY => Ok(Direction::Body { person, axis: 1 }),
            SliceAlong::BodyZ => Ok(Direction::Body { person, axis: 2 }),
            SliceAlong::BodyYaw => Ok(Direction::Yaw { person }),
            SliceAlong::JointX => of_joint(0),
            SliceAlong::JointY => of_joint(1),
            SliceAlong::JointZ => of_joint(2),
            SliceAlong::BoneTurn => bone(false),
            SliceAlong::BoneLift => bone(true),
            SliceAlong::Gradient => {
                down_the_gradient(&shown.evaluation.gradient).ok_or_else(|| "the gradient moves no joint".to_owned())
            }
            SliceAlong::LastStep => {
                let branch = self.fit.branch().ok_or("there is no fit on screen")?;
                let before =
                    shown.iteration.checked_sub(1).and_then(|at| branch.state_at(at).filter(|(kept, _)| *kept == at));
                let (_, before) =
                    before.ok_or("no step led here that is kept: run the fit, or show another iteration")?;
                line(&before.params, &shown.params, "last step", "steps")
                    .ok_or_else(|| "the last step moved nothing".into())
            }
            SliceAlong::Pins => {
                let names = &self.view.explore.landscape.pins;
                let from = self.pinned(&names[0])?;
                let to = self.pins.list().iter().find(|pin| pin.name == names[1] && pin.frame == self.fit.frame);
                let (name, to) =
                    to.map_or(("the fit on screen", &shown.params), |pin| (pin.name.as_str(), &pin.params));
                let name = format!("from {} to {name}", from.name);
                line(&from.params, to, &name, "").ok_or_else(|| "both ends are the same fit, or of other people".into())
            }
        }
    }

    fn restart_request(&self) -> Result<RestartRequest, String> {
        let start = self.fit.region_pose().ok_or("there is no start to spread")?;
        let problem = self.fit.problem.as_ref().ok_or("there is no fit on screen")?;
        let state = ExploredState {
            problem: Arc::clone(problem),
            erased: self.fit.erased(),
            config: self.config,
            precision: self.precision,
            initial: start.clone(),
            params: start.clone(),
        };
        let truth = self.data.frame.as_ref().and_then(|frame| frame.truth.as_ref());
        let truth = truth.map(|truth| truth.joints.clone().into());
        Ok(RestartRequest { state, settings: self.view.explore.restarts.in_range(), truth })
    }

    fn tuning_request(&self) -> Result<TuningRequest, String> {
        let (dataset, frame) = self.data.dataset.clone().zip(self.data.frame.as_ref()).ok_or("no frame is open")?;
        let settings = &self.view.explore.tuning;
        let frames: Arc<[u32]> = match settings.frames {
            TunedFrames::Shown => [u32::try_from(frame.index).unwrap_or(u32::MAX)].into(),
            TunedFrames::Selected => self.label_targets(),
            TunedFrames::Listed => self.queue.rows().into(),
        };
        if frames.is_empty() {
            return Err("no frame matches the filter".into());
        }
        let axes = settings.axes_around(&self.config);
        let grid = axes.iter().map(crate::explore::TuningAxis::grid).collect::<Result<Vec<_>, _>>()?;
        // What the axes set is the same in every cell, whatever is set now.
        let mut base = self.config;
        if !self.along {
            // As the fit on screen begins: its frame by itself.
            base.decode_frames = 0;
        }
        for field in axes.iter().filter_map(|axis| axis.field().ok()) {
            field.set(&mut base, field.default());
        }
        // What was erased by hand is of the frame on screen.
        let erased = if settings.frames == TunedFrames::Shown { self.fit.erased() } else { Arc::default() };
        Ok(TuningRequest { dataset, frames, base, precision: self.precision, grid, erased })
    }

    /// Whether what was asked last of an exploration is what would be asked now.
    pub fn is_explored(&self, kind: ExplorationKind) -> bool {
        let now = self.exploration(kind);
        now.is_ok_and(|now| self.explore.asked(kind).is_some_and(|asked| asked.is_same(&now)))
    }

    /// Begins an exploration; one of its kind that is under way is given up.
    pub(super) fn explore(&mut self, kind: ExplorationKind) -> Vec<Effect> {
        let what = match self.exploration(kind) {
            Ok(what) => what,
            Err(why) => {
                self.explore.change(kind).fault = Some(why);
                return Vec::new();
            }
        };
        self.explore.requests += 1;
        let number = self.explore.requests;
        let frame = self.data.frame_index;
        let state = self.explore.change(kind);
        state.frame = frame;
        state.asked = Some((number, what.clone()));
        state.fault = None;
        state.work.begin(0);
        vec![Effect::Explore(number, Box::new(what))]
    }

    /// Gives an exploration up; what was found stays on screen.
    pub(super) fn stop_exploring(&mut self, kind: ExplorationKind) -> Vec<Effect> {
        if self.explore.is_running(kind) { vec![Effect::StopExploring(kind)] } else { Vec::new() }
    }

    /// Another data set is open: nothing of the explorations is of it.
    pub(super) fn forget_explorations(&mut self) -> Vec<Effect> {
        let stop = self.explore.under_way().into_iter().map(Effect::StopExploring).collect();
        self.explore.forget();
        stop
    }

    /// Takes in what a thread tells of the request of this number.
    pub(super) fn explored(&mut self, kind: ExplorationKind, number: u64, news: ExploreNews) -> Vec<Effect> {
        let state = self.explore.change(kind);
        if state.asked.as_ref().is_none_or(|(asked, _)| *asked != number) {
            return Vec::new();
        }
        match news {
            ExploreNews::Progress(done, total) => state.work.advance(done, total),
            ExploreNews::Grew(found) => {
                state.found = Some((number, found));
                state.found_frame = state.frame;
            }
            ExploreNews::Ended(result) => {
                state.work = crate::session::Work::default();
                match result {
                    Ok(Some(found)) => {
                        let share = match &found {
                            Explored::Restarts(cloud) => cloud.best_share(),
                            _ => None,
                        };
                        state.found = Some((number, found));
                        state.found_frame = state.frame;
                        let frame = state.frame;
                        if let Some(share) = share {
                            self.best_basins.change().insert(frame, share);
                        }
                    }
                    Ok(None) => {}
                    Err(why) => {
                        state.fault = Some(why.clone());
                        self.note(LogLevel::Warning, format!("no {}: {why}", kind.title()));
                    }
                }
            }
        }
        Vec::new()
    }

    /// A fit of an exploration under a finger: it is made again from its start, on a branch of its own.
    pub(super) fn drag_fit(&mut self, fit: AdoptedFit) -> Vec<Effect> {
        if !self.fit.is_ready() {
            self.hint("there is no fit beside which this one could be put".into());
            return Vec::new();
        }
        if !fit.start.is_finite()
            || self.fit.initial.as_ref().is_none_or(|initial| {
                let shape = |pose: &crate::body::Pppr| (pose.shape().joints, pose.shape().doppler_features);
                shape(initial) != shape(&fit.start)
            })
        {
            self.hint("this start is none of the frame on screen".into());
            return Vec::new();
        }
        let Some(first) = self.fit.history.branches().first() else { return Vec::new() };
        let (root, row) = (first.id, first.rows.first().cloned());
        let (before, from) = (self.config, self.fit.history.active_id());
        self.config = fit.config;
        let drag = self.drag.get_or_insert(Drag { before, from, live: None, erasing: None, adopted: None });
        drag.adopted = Some(fit.words.clone());
        let known = drag.live.filter(|(branch, _)| self.fit.history.branch(*branch).is_some());
        let state = Arc::new(FitState::at_start((*fit.start).clone()));
        let branch = known.map_or_else(
            || {
                let branch = self.fit.history.begin(Some((root, 0)), self.config);
                // Until the worker answers, the branch is the state that it begins at.
                if let Some(mut row) = row {
                    row.state = Some(Arc::clone(&state));
                    self.fit.history.push(branch, row);
                }
                branch
            },
            |(branch, _)| branch,
        );
        self.fit.history.set_sight(branch, fit.erased, fit.around);
        self.fit.history.edit(branch, fit.words);
        if let Some(drag) = &mut self.drag {
            drag.live = Some((branch, 0));
        }
        self.run_anew(branch, (0, state))
    }

    /// Keeps the tuning map as the run folder that a sweep of its grid would write: what is fitted is not fitted again.
    pub(super) fn keep_tuning(&mut self) -> Vec<Effect> {
        let Some(map) = self.explore.tuning().cloned() else { return Vec::new() };
        let order = StudyOrder { study: StudyKind::Sweep, grid: map.grid.clone() };
        let mut effects = self.study_of(order, &map.frames);
        for effect in &mut effects {
            if let Effect::StartStudy(request) = effect {
                let StudyRequest { run, known, .. } = request.as_mut();
                run.erased = Arc::clone(&map.erased);
                // Its rows are of these settings only as long as nothing else was set otherwise since.
                let same = |mut config: crate::config::FitConfig| {
                    for axis in &map.grid {
                        if let Some(field) = crate::config::Field::of_key(&axis.key) {
                            field.set(&mut config, field.default());
                        }
                    }
                    config
                };
                if same(run.base) == same(map.base) && run.precision == self.precision {
                    *known = map.rows();
                }
            }
        }
        effects
    }

    /// What was found of the tuning map as far as it is of the frame on screen: its place among the map's frames.
    pub fn tuned_frame(&self) -> Option<usize> {
        let map = self.explore.tuning()?;
        map.frames.iter().position(|&frame| frame as usize == self.data.frame_index)
    }
}
