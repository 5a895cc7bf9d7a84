//! What a person does with 100,000 frames, one thing after the other.

use super::meter::{Meter, memory_mib, peak_memory_mib};
use egui::{Event, Key, Modifiers, MouseWheelSource, MouseWheelUnit, Pos2, Rect, TouchPhase, pos2, vec2};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable as _;
use mhp_inspector::app::{InspectorApp, Pane};
use mhp_inspector::config::{FitConfig, Preset};
use mhp_inspector::explore::ExplorationKind;
use mhp_inspector::labels::Tag;
use mhp_inspector::predictions::{WriteFormat, write_predictions};
use mhp_inspector::session::{Command, LabelStatus, Session, Sort, SortKey, StrataStatus, TimelineStrip};
use std::fmt::Write as _;
use std::path::Path;
use std::time::{Duration, Instant};

/// Asks for nothing but the batch.
const BATCH_ONLY: &str = "MHP_LARGE_BATCH_ONLY";
/// How long the first window lets a batch run before it is cancelled.
const UNTIL_CANCELLED: Duration = Duration::from_secs(20);
/// Longer than a batch of every frame may take.
const BATCH_PATIENCE: Duration = Duration::from_mins(40);
/// What a window may take whose batch is as large as MMVR: `src/session/mod.rs` says of what.
const MOST_MEMORY_MIB: f64 = 1024.0;
/// Longer than anything here may take.
const PATIENCE: Duration = Duration::from_mins(5);

struct Window(Harness<'static, InspectorApp>);

/// Opens the tree and does everything; `warm` where the statistics and labels of a run before are on disk.
pub(super) fn measure(tree: &Path, warm: bool) {
    let mut window = Window::open(tree, warm);
    if std::env::var_os(BATCH_ONLY).is_some() {
        window.until("labels", |s| s.labels.status == LabelStatus::Ready);
        window.batch(warm);
        print_memory();
        let peak = peak_memory_mib();
        assert!(peak.is_none_or(|peak| peak < MOST_MEMORY_MIB), "{peak:?} MiB of {MOST_MEMORY_MIB}");
        return;
    }
    if !warm {
        window.measured("grading, cold", |s| s.strata.status == StrataStatus::Ready, Some(Command::ComputeStrata));
    }
    window.until("labels", |s| s.labels.status == LabelStatus::Ready);
    window.repeat("idle", 200, |_, _| {});
    window.scroll();
    window.filter();
    window.sort();
    window.timeline();
    window.strips();
    window.bulk();
    window.panes();
    window.fit();
    window.explorations();
    window.heights();
    window.explore();
    window.batch(warm);
    window.results(tree);
    print_memory();
}

fn print_memory() {
    println!(
        "memory: {:.0} MiB now, {:.0} MiB at the most",
        memory_mib().unwrap_or(f64::NAN),
        peak_memory_mib().unwrap_or(f64::NAN)
    );
}

impl Window {
    fn open(tree: &Path, warm: bool) -> Self {
        let begun = Instant::now();
        let paths = [tree.to_path_buf()];
        let harness = Harness::builder()
            .with_size([1440.0, 900.0])
            .with_step_dt(1.0 / 60.0)
            .build_eframe(|cc| InspectorApp::new(cc, &paths));
        let mut window = Self(harness);
        println!("the window is there after {:.0} ms", begun.elapsed().as_secs_f64() * 1e3);
        let mut meter = Meter::new("opening");
        window.passes_until(&mut meter, |s| !s.data.is_empty());
        println!("the list is there after {:.0} ms", begun.elapsed().as_secs_f64() * 1e3);
        window.passes_until(&mut meter, |s| s.data.frame.is_some());
        println!("the first frame is there after {:.0} ms", begun.elapsed().as_secs_f64() * 1e3);
        window.passes_until(&mut meter, |s| s.labels.status == LabelStatus::Ready);
        println!("labels are there after {:.0} ms", begun.elapsed().as_secs_f64() * 1e3);
        if warm && std::env::var_os(BATCH_ONLY).is_none() {
            window.passes_until(&mut meter, |s| s.strata.status == StrataStatus::Ready);
            println!("strata of the run before are there after {:.0} ms", begun.elapsed().as_secs_f64() * 1e3);
        }
        meter.print();
        window
    }

    fn session(&self) -> &Session {
        self.0.state().session()
    }

    fn apply(&mut self, command: Command) {
        self.0.state_mut().apply(command);
    }

    fn passes_until(&mut self, meter: &mut Meter, done: impl Fn(&Session) -> bool) {
        let deadline = Instant::now() + PATIENCE;
        while !done(self.session()) {
            assert!(Instant::now() < deadline, "it takes too long; the log says {:#?}", self.session().log);
            meter.pass(&mut self.0);
        }
        meter.pass(&mut self.0);
    }

    fn until(&mut self, name: &str, done: impl Fn(&Session) -> bool) {
        self.passes_until(&mut Meter::new(name), done);
    }

    /// A command, and passes until it has had its effect.
    fn measured(&mut self, name: &str, done: impl Fn(&Session) -> bool, command: Option<Command>) {
        let mut meter = Meter::new(name);
        meter.pass_with(&mut self.0, |harness| command.into_iter().for_each(|c| harness.state_mut().apply(c)));
        self.passes_until(&mut meter, done);
        meter.print();
    }

    fn repeat(&mut self, name: &str, passes: usize, mut act: impl FnMut(&mut Harness<'_, InspectorApp>, usize)) {
        let mut meter = Meter::new(name);
        for k in 0..passes {
            meter.pass_with(&mut self.0, |harness| act(harness, k));
        }
        meter.print();
    }

    fn rect(&self, name: &str) -> Rect {
        self.0.query_all_by_label(name).next().unwrap().rect()
    }

    fn click(&mut self, name: &str) {
        self.0.query_all_by_label(name).next().unwrap().click();
        self.0.run_steps(2);
        self.0.remove_cursor();
        self.0.step();
    }

    /// The wheel over the list, from its first row to its last.
    fn scroll(&mut self) {
        let over = self.rect("Filter frames").center() + vec2(0.0, 300.0);
        self.0.hover_at(over);
        self.0.run_steps(2);
        let passes = 600;
        let step = -(self.session().data.len() as f32 * 20.0) / passes as f32;
        self.repeat("scrolling from end to end", passes, |harness, _| {
            harness.event(Event::MouseWheel {
                unit: MouseWheelUnit::Point,
                delta: vec2(0.0, step * 1.1),
                phase: TouchPhase::Move,
                source: MouseWheelSource::Unknown,
                modifiers: Modifiers::NONE,
            });
        });
        let last = self.0.query_all_by_label_contains("Frame d1s1/099/").count();
        println!("rows of the last sequence in sight: {last}");
        self.0.remove_cursor();
        self.0.run_steps(2);
    }

    /// Types a filter letter by letter and takes it away again.
    fn filter(&mut self) {
        self.click("Filter frames");
        let mut meter = Meter::new("typing a filter");
        for letter in "stratum:hard iou<0.5 -tag:F1 00042".chars() {
            meter.pass_with(&mut self.0, |harness| harness.event(Event::Text(letter.into())));
            (0..3).for_each(|_| meter.pass(&mut self.0));
        }
        meter.print();
        let mut meter = Meter::new("taking it away letter by letter");
        while !self.session().queue.text.is_empty() {
            meter.pass_with(&mut self.0, |harness| harness.key_press(Key::Backspace));
            (0..2).for_each(|_| meter.pass(&mut self.0));
        }
        meter.print();
        for (name, text) in [
            ("filter: a part of a name", "42"),
            ("filter: stratum and tags", "stratum:hard -tag:F1"),
            ("filter: scene", "scene:d1s1/05"),
            ("filter: annotator and note", "-by:nobody -note:wall"),
        ] {
            self.measured(name, |s| s.queue.text == text, Some(Command::SetFilter(text.into())));
        }
        self.measured("filter: none", |s| s.queue.text.is_empty(), Some(Command::SetFilter(String::new())));
        self.0.key_press(Key::Escape);
        self.0.run_steps(2);
    }

    fn sort(&mut self) {
        for key in [
            SortKey::Stratum,
            SortKey::Hardness,
            SortKey::PeakDensity,
            SortKey::StaticDominance,
            SortKey::HumanSaliency,
            SortKey::Iou,
            SortKey::Converged,
            SortKey::Majpe,
            SortKey::Tags,
            SortKey::Annotator,
            SortKey::Index,
        ] {
            for descending in [true, false] {
                let sort = Sort { key, descending };
                self.measured(&format!("sorting {sort:?}"), |s| s.view.sort == sort, Some(Command::SetSort(sort)));
            }
        }
    }

    fn timeline(&mut self) {
        let rect = self.rect("Timeline");
        let at = |share: f32| pos2(rect.left() + share * rect.width(), rect.center().y);
        self.0.hover_at(at(0.01));
        self.0.drag_at(at(0.01));
        self.repeat("dragging the timeline", 200, |harness, k| harness.hover_at(at(0.01 + 0.98 * k as f32 / 200.0)));
        self.0.drop_at(at(0.99));
        self.0.remove_cursor();
        self.0.run_steps(2);
        self.until("the frame", |s| s.data.loading.is_none());
        self.apply(Command::GotoFrame(0));
        self.until("frame 0", |s| s.data.loading.is_none() && s.fit.is_ready());
    }

    fn strips(&mut self) {
        for strip in [TimelineStrip::Iou, TimelineStrip::Tags, TimelineStrip::Stratum] {
            self.repeat(&format!("strip of {strip:?}"), 30, |harness, k| {
                if k == 0 {
                    let mut view = harness.state().session().view.clone();
                    view.strip = strip;
                    harness.state_mut().apply(Command::SetView(Box::new(view)));
                }
            });
        }
    }

    /// Tags every frame, takes it back, does it again; and two tags without a breath between.
    fn bulk(&mut self) {
        let frames = self.session().data.len();
        self.repeat("selecting every frame", 10, |harness, k| {
            if k == 0 {
                harness.key_press_modifiers(Modifiers::COMMAND, Key::A);
            }
        });
        assert_eq!(self.session().labels.selection.len(), frames);
        self.repeat("idle, every frame selected", 60, |_, _| {});
        let tagged = |s: &Session, tag| s.labels.label(0).tags.contains(tag);
        let had = tagged(self.session(), Tag::F1);
        self.measured("tag F1 on every frame", |s| tagged(s, Tag::F1) != had, Some(Command::ToggleTag(Tag::F1)));
        self.measured("undo", |s| tagged(s, Tag::F1) == had, Some(Command::Undo));
        self.measured("redo", |s| tagged(s, Tag::F1) != had, Some(Command::Redo));
        let (second, third) = (tagged(self.session(), Tag::F2), tagged(self.session(), Tag::F3));
        self.apply(Command::ToggleTag(Tag::F2));
        let ends = |s: &Session| tagged(s, Tag::F2) != second && tagged(s, Tag::F3) != third;
        self.measured("tag F3 while F2 is being written", ends, Some(Command::ToggleTag(Tag::F3)));
        self.repeat("idle, every frame selected and tagged", 60, |_, _| {});
        self.measured("clearing the selection", |s| s.labels.selection.is_empty(), {
            Some(Command::SelectFrames(std::collections::BTreeSet::new()))
        });
        let one = |s: &Session| tagged(s, Tag::F4);
        self.measured("tag F4 on one of 100,000 tagged frames", one, Some(Command::ToggleTag(Tag::F4)));
        self.measured("its undo", |s| !one(s), Some(Command::Undo));
        self.measured("filter: tag:F2", |s| s.queue.text == "tag:F2", Some(Command::SetFilter("tag:F2".into())));
        self.scroll();
        let rule = "-by:nobody -note:wall";
        self.measured("filter: annotator and note", |s| s.queue.text == rule, Some(Command::SetFilter(rule.into())));
        let by = Sort { key: SortKey::Annotator, descending: true };
        self.measured("sorting by annotator", |s| s.view.sort == by, Some(Command::SetSort(by)));
        let tags = Sort { key: SortKey::Tags, descending: true };
        self.measured("sorting by tags", |s| s.view.sort == tags, Some(Command::SetSort(tags)));
        self.apply(Command::SetSort(Sort::default()));
        self.apply(Command::SetFilter(String::new()));
        self.strips();
    }

    /// Agreement and statistics of 100,000 labels.
    fn panes(&mut self) {
        for pane in ["Agreement", "Statistics"] {
            self.show(pane);
            let one = |s: &Session| s.labels.label(0).tags.contains(Tag::F4);
            let name = format!("tag F4 on one frame before {pane}");
            self.measured(&name, one, Some(Command::ToggleTag(Tag::F4)));
            self.measured("its undo", |s| !one(s), Some(Command::Undo));
        }
    }

    /// Clicks a pane's tab.
    fn show(&mut self, pane: &str) {
        let tab = self.rect(pane).center();
        let mut meter = Meter::new(&format!("showing {pane}"));
        meter.pass_with(&mut self.0, |harness| harness.hover_at(tab));
        meter.pass_with(&mut self.0, |harness| harness.drag_at(tab));
        meter.pass_with(&mut self.0, |harness| harness.drop_at(tab));
        (0..60).for_each(|_| meter.pass(&mut self.0));
        meter.print();
    }

    /// What a fit rests on, while it is asked for and while a run goes on.
    fn explorations(&mut self) {
        self.apply(Command::AddBreakpoint("iou<-1".into()));
        for pane in ["Who lit it", "Radar knows", "Closure test", "Radar what-if", "Breakpoints"] {
            self.show(pane);
            if pane == "Closure test" {
                let button = self.rect("Test this pose").center();
                let mut meter = Meter::new("the closure test is run");
                meter.pass_with(&mut self.0, |harness| harness.hover_at(button));
                meter.pass_with(&mut self.0, |harness| harness.drag_at(button));
                meter.pass_with(&mut self.0, |harness| harness.drop_at(button));
                (0..200).for_each(|_| meter.pass(&mut self.0));
                meter.print();
            }
            let (mut meter, head) = (Meter::new(&format!("a run beside {pane}")), self.0.state().session().fit.head());
            meter.pass_with(&mut self.0, |harness| harness.state_mut().apply(Command::StepFit(200)));
            self.passes_until(&mut meter, |s| s.fit.head() >= head + 200 && !s.fit.is_running());
            meter.print();
        }
        self.show("Maps");
        let map = self.rect("H_sim map of hm_hori");
        let mut meter = Meter::new("hovering cells with what lights them");
        for k in 0..120 {
            let at = map.min + map.size() * vec2((k % 12) as f32 / 12.0, (k / 12) as f32 / 10.0);
            meter.pass_with(&mut self.0, |harness| harness.hover_at(at));
        }
        meter.print();
        self.hand();
        self.predictions();
    }

    /// τ under the finger, and cells under the brush, each with the fit that follows it.
    fn hand(&mut self) {
        self.show("Fit");
        let ribbon = self.rect("IoU at every τ");
        let stroke = |k: usize| ribbon.min + ribbon.size() * vec2(0.1 + 0.006 * k as f32, 0.5);
        self.drag("τ dragged over its ribbon", 100, stroke);
        self.click("Erase cells");
        self.click("Erase by brush");
        let map = self.rect("H_ori map of hm_hori");
        let stroke = |k: usize| map.min + map.size() * vec2(0.3 + 0.002 * k as f32, 0.3 + 0.001 * k as f32);
        self.drag("cells under the brush", 100, stroke);
        self.apply(Command::Undo);
        self.click("Erase cells");
    }

    /// Takes hold of something and moves it.
    fn drag(&mut self, name: &str, passes: usize, at: impl Fn(usize) -> Pos2) {
        let mut meter = Meter::new(name);
        meter.pass_with(&mut self.0, |harness| harness.hover_at(at(0)));
        meter.pass_with(&mut self.0, |harness| harness.drag_at(at(0)));
        for k in 0..passes {
            meter.pass_with(&mut self.0, |harness| harness.hover_at(at(k)));
        }
        meter.pass_with(&mut self.0, |harness| harness.drop_at(at(passes)));
        self.passes_until(&mut meter, |s| !s.is_dragging() && !s.fit.is_running());
        meter.print();
    }

    /// Two networks beside the fit, of the first thousand frames.
    fn predictions(&mut self) {
        let dataset = self.session().data.dataset.clone().unwrap();
        let joints = &dataset.info().skeleton.joints;
        let folder = tempfile::tempdir().unwrap();
        for (name, aside) in [("near", 0.0), ("far", 0.3)] {
            let frame = |index: usize| {
                let body = (0..joints.len()).map(|k| [3.0, aside + 0.02 * k as f64, 0.8 - 0.1 * k as f64]).collect();
                (dataset.frame_name(index).to_owned(), vec![body])
            };
            let frames: Vec<_> = (0..dataset.len().min(1000)).map(frame).collect();
            let path = folder.path().join(format!("{name}.npz"));
            write_predictions(&path, WriteFormat::of(&path).unwrap(), joints, &frames).unwrap();
            let known = self.session().sources.list().len();
            let read = |s: &Session| s.sources.list().get(known).is_some();
            self.measured(
                &format!("opening the predictions {name}"),
                read,
                Some(Command::OpenPredictions(path, Box::default())),
            );
        }
        self.show("Predictions");
        self.repeat("idle, two networks beside the fit", 60, |_, _| {});
        let mut meter = Meter::new("from frame to frame with two networks");
        for frame in 1..40 {
            meter.pass_with(&mut self.0, |harness| harness.state_mut().apply(Command::GotoFrame(frame)));
            (0..3).for_each(|_| meter.pass(&mut self.0));
        }
        meter.print();
        self.apply(Command::GotoFrame(0));
        self.until("frame 0", |s| s.data.loading.is_none() && s.fit.is_ready());
    }

    /// A run while the list is filtered by what the run changes.
    fn fit(&mut self) {
        self.apply(Command::SetFilter("-iou>2".into()));
        self.until("a fit", |s| s.fit.is_ready());
        let mut meter = Meter::new("a run of 300 iterations under -iou>2");
        meter.pass_with(&mut self.0, |harness| harness.state_mut().apply(Command::StepFit(300)));
        self.passes_until(&mut meter, |s| s.fit.head() >= 300 && !s.fit.is_running());
        meter.print();
        self.show("Curves");
        assert!(self.0.state().pane_rect(Pane::called("Curves").unwrap()).is_some(), "the curves are on screen");
        let mut meter = Meter::new("a run of 100,000 iterations");
        meter.pass_with(&mut self.0, |harness| harness.state_mut().apply(Command::StepFit(100_000 - 300)));
        self.passes_until(&mut meter, |s| s.fit.head() >= 100_000 && !s.fit.is_running());
        meter.print();
        self.repeat("idle, curves of 100,000 iterations", 60, |_, _| {});
        self.apply(Command::SetFilter(String::new()));
    }

    /// Panes of another height below the maps, in turn: everything above them is laid out anew.
    fn heights(&mut self) {
        let panes = ["Curves", "Breakpoints", "Loss landscape"].map(|name| Pane::called(name).unwrap());
        self.repeat("panes of other heights in turn", 300, |harness, k| {
            harness.state_mut().show_pane(panes[k % panes.len()]);
        });
    }

    /// Each exploration on screen while it fills.
    fn explore(&mut self) {
        self.apply(Command::GotoFrame(0));
        self.until("frame 0", |s| s.data.loading.is_none() && s.fit.is_ready() && !s.fit.is_running());
        self.apply(Command::SetConfig(Box::new(Preset::Baseline.config())));
        self.until("its fit", |s| s.fit.is_ready() && !s.fit.is_running() && s.fit.shown.is_some());
        for kind in ExplorationKind::ALL {
            let pane = Pane::all().iter().find(|pane| pane.title().eq_ignore_ascii_case(kind.title())).unwrap();
            self.0.state_mut().show_pane(pane);
            let mut meter = Meter::new(&format!("a {} fills", kind.title()));
            meter.pass_with(&mut self.0, |harness| harness.state_mut().apply(Command::Explore(kind)));
            self.passes_until(&mut meter, |s| !s.explore.is_running(kind) && s.explore.is_current(kind));
            meter.print();
            self.repeat(&format!("idle, a {} on screen", kind.title()), 60, |_, _| {});
        }
    }

    /// Every frame fitted for one iteration: cancelled in the first window, gone on with in the second.
    fn batch(&mut self, warm: bool) {
        let config = FitConfig { iterations: 1, ..Preset::Baseline.config() };
        self.apply(Command::SetConfig(Box::new(config)));
        self.until("the fit on screen", |s| s.fit.is_ready());
        let known = self.session().batch.fitted();
        let mut meter = Meter::new("a batch of every frame");
        meter.pass_with(&mut self.0, |harness| harness.key_press_modifiers(Modifiers::COMMAND, Key::Enter));
        self.passes_until(&mut meter, |s| s.batch.is_running());
        let begun = Instant::now();
        let patience = if warm { BATCH_PATIENCE } else { UNTIL_CANCELLED };
        // A small tree is fitted in less: half of it is left for the second window.
        let enough = |s: &Session| !warm && 2 * (s.batch.fitted() - known) > s.data.len();
        while self.session().batch.is_running() && begun.elapsed() < patience && !enough(self.session()) {
            meter.pass(&mut self.0);
        }
        meter.print();
        let (fitted, all) = (self.session().batch.fitted(), self.session().data.len());
        let new = (fitted - known) as f64 / begun.elapsed().as_secs_f64();
        println!("{fitted} of {all} frames are fitted, {known} of them before: {new:.0} frames a second");
        if warm {
            assert!(known > 0, "the window before has left fits");
            assert_eq!(fitted, all);
            self.repeat("idle, every frame fitted", 60, |_, _| {});
        } else {
            self.measured("cancelling it", |s| !s.batch.is_running(), Some(Command::CancelBatch));
            assert!(self.session().batch.fitted() < all, "there is something left to do");
        }
    }

    /// A table with a row for every frame, as `fit --out` writes it.
    fn results(&mut self, tree: &Path) {
        let dataset = self.session().data.dataset.clone().unwrap();
        let mut text = "frame,iterations,converged,reason,loss,iou_hm_hori,iou_hm_vert,majpe_mm\n".to_owned();
        for index in 0..dataset.len() {
            let iou = (index % 997) as f64 / 997.0;
            let (name, yes) = (dataset.frame_name(index), index % 3 == 0);
            let (loss, majpe) = (5.0 - iou, 900.0 - iou * 800.0);
            writeln!(text, "{name},40,{yes},iterations,{loss},{iou},{iou},{majpe}").unwrap();
        }
        let table = tree.join("../summary.csv");
        std::fs::write(&table, text).unwrap();
        let all = |s: &Session| s.summaries.len() == s.data.len();
        self.measured("loading results of every frame", all, Some(Command::LoadResults(table.clone())));
        self.repeat("idle, every frame with a result", 60, |_, _| {});
        for rule in ["iou<0.5", "stratum:hard iou<0.5 converged:no -tag:F1 00042"] {
            let name = format!("filter: {rule}");
            self.measured(&name, |s| s.queue.text == rule, Some(Command::SetFilter(rule.into())));
        }
        self.apply(Command::SetFilter(String::new()));
        for key in [SortKey::Iou, SortKey::Converged, SortKey::Majpe] {
            let sort = Sort { key, descending: true };
            self.measured(&format!("sorting {sort:?}"), |s| s.view.sort == sort, Some(Command::SetSort(sort)));
        }
        let before = self.session().summaries.revision();
        let again = |s: &Session| s.summaries.revision() > before;
        self.measured("loading them again, sorted by MAJPE", again, Some(Command::LoadResults(table)));
        self.strips();
        self.scroll();
    }
}
