//! The real window without a display, driven by the names that a screen reader would say.
#![expect(clippy::unwrap_used, clippy::panic, reason = "a test stops where the window does not do as it is told")]

use super::blob;
use egui::accesskit::Toggled;
use egui::{Key, Modifiers, Role, pos2};
use egui_kittest::kittest::{NodeT as _, Queryable as _};
use egui_kittest::{Harness, Node};
use mhp_inspector::app::InspectorApp;
use mhp_inspector::session::{Command, Fit, FitStatus, LabelStatus, Session, StrataStatus};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Nothing here takes seconds; where it does, the machine is busy, not the program wrong.
const PATIENCE: Duration = Duration::from_mins(1);

/// The window on a data set of its own.
pub(crate) struct Window {
    pub(crate) harness: Harness<'static, InspectorApp>,
    pub(crate) folder: tempfile::TempDir,
}

impl Window {
    pub(crate) fn empty(paths: &[PathBuf], size: [f32; 2]) -> Harness<'static, InspectorApp> {
        Harness::builder()
            .with_size(size)
            .with_step_dt(1.0 / 60.0)
            .with_max_steps(200)
            .build_eframe(|cc| InspectorApp::new(cc, paths))
    }

    /// Frame 0 of `frames` is on screen and its fit is ready.
    pub(crate) fn open(frames: usize) -> Self {
        let folder = tempfile::tempdir().unwrap();
        blob::write_dataset(folder.path(), frames);
        let harness = Self::empty(&[folder.path().into()], [1440.0, 900.0]);
        let mut window = Self { harness, folder };
        window.ready(0);
        window
    }

    pub(crate) fn session(&self) -> &Session {
        self.harness.state().session()
    }

    pub(crate) fn fit(&self) -> &Fit {
        &self.session().fit
    }

    /// Passes until something holds.
    pub(crate) fn until(&mut self, what: &str, done: impl Fn(&Self) -> bool) {
        let deadline = Instant::now() + PATIENCE;
        while !done(self) {
            let log: Vec<&str> = self.session().log.iter().map(|line| line.text.as_str()).collect();
            let fit = self.fit();
            let at = (fit.frame, &fit.status, fit.head(), fit.cursor);
            assert!(Instant::now() < deadline, "waited for {what}; frame, status, head, cursor {at:?}; log {log:#?}");
            self.harness.step();
        }
        self.harness.step();
    }

    /// Frame `index` is on screen and what is shown is its newest iteration.
    pub(crate) fn ready(&mut self, index: usize) {
        self.until("a fit that is ready", |w| {
            let frame = w.session().data.frame.as_ref().map(|frame| frame.index);
            let shown = w.fit().shown.as_ref().map(|shown| shown.iteration);
            frame == Some(index) && w.fit().is_ready() && shown == Some(w.fit().head())
        });
    }

    pub(crate) fn apply(&mut self, command: Command) {
        self.harness.state_mut().apply(command);
    }

    /// The frames are graded, the journals are open, the evidence is that of the fit on screen.
    pub(crate) fn at_rest(&mut self) {
        self.until("strata, labels and evidence", |w| {
            let session = w.session();
            session.strata.status == StrataStatus::Ready
                && session.labels.status == LabelStatus::Ready
                && session.evidence_of(session.data.frame_index).is_some()
                && !session.evidence_is_stale()
        });
    }

    pub(crate) fn paused_at(&mut self, iteration: usize) {
        self.until("the end of the run", |w| {
            w.fit().status == FitStatus::Paused
                && w.fit().head() == iteration
                && w.fit().shown.as_ref().is_some_and(|shown| shown.iteration == iteration)
        });
    }

    pub(crate) fn named(&self, name: &str) -> bool {
        self.harness.query_all_by_label(name).next().is_some()
    }

    pub(crate) fn says(&self, words: &str) -> bool {
        self.harness.query_all_by_label_contains(words).next().is_some()
    }

    /// Clicks the one enabled button of this name with the mouse.
    pub(crate) fn click(&mut self, name: &str) {
        self.reveal(name);
        self.node(name).click();
        self.harness.step();
        self.harness.remove_cursor();
        self.harness.step();
    }

    /// The one thing of this name that can be used.
    pub(crate) fn node<'a>(&'a self, name: &'a str) -> Node<'a> {
        let usable =
            |node: &Node<'_>| node.accesskit_node().role() != Role::Label && !node.accesskit_node().is_disabled();
        let found: Vec<Node<'_>> = self.harness.query_all_by_label(name).filter(usable).collect();
        match found[..] {
            [one] => one,
            [] => panic!("nothing usable is called {name:?}: {:?}", self.names()),
            _ => panic!("{} things are called {name:?}: {found:?}", found.len()),
        }
    }

    /// Scrolls a thing into view and waits until it stands still.
    pub(crate) fn reveal(&mut self, name: &str) {
        self.node(name).scroll_to_me();
        self.harness.run_steps(2);
        let mut still = 0;
        while still < 3 {
            let before = self.node(name).rect();
            self.harness.step();
            still = if self.node(name).rect() == before { still + 1 } else { 0 };
        }
    }

    pub(crate) fn names(&self) -> Vec<String> {
        self.harness.root().children_recursive().filter_map(|node| node.accesskit_node().label()).collect()
    }

    pub(crate) fn key(&mut self, key: Key) {
        self.harness.key_press(key);
        self.harness.step();
    }

    pub(crate) fn key_with(&mut self, modifiers: Modifiers, key: Key) {
        self.harness.key_press_modifiers(modifiers, key);
        self.harness.step();
    }

    pub(crate) fn type_text(&mut self, text: &str) {
        // After an event egui draws twice: what depends on the text is there in the second pass.
        self.harness.event(egui::Event::Text(text.into()));
        self.harness.run_steps(2);
    }

    /// Clicks a number, types another and confirms it with Enter.
    pub(crate) fn type_value(&mut self, name: &str, value: &str) {
        self.click(name);
        self.key_with(Modifiers::COMMAND, Key::A);
        self.type_text(value);
        self.key(Key::Enter);
        self.harness.step();
    }

    /// Presses the mouse at a share of a thing's width and lets it go at another.
    pub(crate) fn drag(&mut self, name: &str, from: f32, to: f32) {
        self.reveal(name);
        let rect = self.node(name).rect();
        let at = |share: f32| pos2(rect.left() + share * rect.width(), rect.center().y);
        self.harness.hover_at(at(from));
        self.harness.drag_at(at(from));
        for k in 1..=4 {
            self.harness.hover_at(at(from + (to - from) * k as f32 / 4.0));
        }
        self.harness.drop_at(at(to));
        self.harness.step();
    }

    /// From now on settings count from the next step on, instead of fitting anew at once.
    pub(crate) fn switch_live_off(&mut self) {
        if self.session().is_live() {
            self.key_with(Modifiers::SHIFT, Key::L);
        }
        assert!(!self.session().is_live());
    }

    /// Opens a folder that is there already.
    pub(crate) fn on(folder: tempfile::TempDir) -> Self {
        let harness = Self::empty(&[folder.path().into()], [1440.0, 900.0]);
        let mut window = Self { harness, folder };
        window.apply(Command::SetAnnotator("ada".into()));
        window.ready(0);
        window
    }

    /// What a screen reader says of a thing besides its name.
    pub(crate) fn value(&self, name: &str) -> String {
        self.node(name).value().unwrap_or_default()
    }

    /// As [`Self::value`], of a thing that is only read.
    pub(crate) fn text_of(&self, name: &str) -> String {
        self.harness.get_by_label(name).value().unwrap_or_default()
    }

    pub(crate) fn is_focused(&self, name: &str) -> bool {
        self.node(name).is_focused()
    }

    /// True where a chip, a check box or a row is on.
    pub(crate) fn is_on(&self, name: &str) -> bool {
        self.node(name).accesskit_node().toggled() == Some(Toggled::True)
    }

    /// Holds keys while the one thing of this name is clicked.
    pub(crate) fn click_with(&mut self, modifiers: Modifiers, name: &str) {
        self.reveal(name);
        self.node(name).click_modifiers(modifiers);
        self.harness.step();
        self.harness.remove_cursor();
        self.harness.step();
    }

    /// Opens a menu of the bar.
    pub(crate) fn open_menu(&mut self, menu: &str) {
        let bar: Vec<_> = self.harness.query_all_by_label(menu).map(|node| node.rect()).collect();
        let top = bar.into_iter().min_by(|a, b| a.top().total_cmp(&b.top())).unwrap();
        self.harness.hover_at(top.center());
        self.harness.drag_at(top.center());
        self.harness.drop_at(top.center());
        self.harness.run_steps(2);
    }

    /// Chooses what a menu has under this name.
    pub(crate) fn choose(&mut self, menu: &str, item: &str) {
        self.open_menu(menu);
        let names = self.names();
        let full = names.iter().find(|name| name.starts_with(item)).unwrap_or_else(|| panic!("{item}: {names:?}"));
        self.reveal(full);
        self.node(full).click();
        self.harness.run_steps(2);
        self.harness.remove_cursor();
        self.harness.step();
    }

    /// Brings a pane to the front.
    pub(crate) fn show(&mut self, title: &str) {
        self.harness.state_mut().show_pane(mhp_inspector::app::Pane::called(title).unwrap());
        self.harness.run_steps(3);
    }

    /// What a menu says, without choosing anything.
    pub(crate) fn menu_says(&mut self, menu: &str, words: &str) -> bool {
        self.open_menu(menu);
        let says = self.says(words);
        self.key(Key::Escape);
        self.harness.remove_cursor();
        self.harness.run_steps(2);
        says
    }

    /// Answers the sheet that asks for a file: types the path and confirms it with Enter.
    pub(crate) fn answer_path(&mut self, field: &str, path: &Path) {
        self.until("the sheet", |w| w.named(field));
        self.key_with(Modifiers::COMMAND, Key::A);
        self.type_text(&path.display().to_string());
        assert_eq!(self.value(field), path.display().to_string());
        self.key(Key::Enter);
        self.harness.run_steps(2);
        assert!(!self.named(field), "the sheet is still there");
    }

    /// Writes something with the sheet of File > `item`, and waits until it says so.
    pub(crate) fn save_as(&mut self, item: &str, path: &Path) {
        self.choose("File", item);
        self.answer_path("Save to", path);
        let words = path.display().to_string();
        self.until("the file", |w| w.session().log.iter().any(|line| line.text.contains(&words)));
        let last = self.session().log.iter().rev().find(|line| line.text.contains(&words)).unwrap();
        assert!(last.text.contains("written to") || last.text.contains("saved to"), "{}", last.text);
    }

    /// Closes every notification.
    pub(crate) fn dismiss_all(&mut self) {
        while self.named("Dismiss notification") {
            if let Some(button) = self.harness.query_all_by_label("Dismiss notification").next() {
                button.click();
            }
            self.harness.run_steps(2);
        }
        self.harness.remove_cursor();
        self.harness.step();
    }

    /// What a screen reader says of all things of this name.
    pub(crate) fn texts_of(&self, name: &str) -> String {
        let values = self.harness.query_all_by_label(name).filter_map(|node| node.value());
        values.collect::<Vec<_>>().join("\n")
    }

    /// The newest error or hint contains these words.
    pub(crate) fn told(&self, words: &str) -> bool {
        self.session().notice.as_ref().is_some_and(|notice| notice.text.contains(words))
    }

    pub(crate) fn frame(&self) -> usize {
        self.session().data.frame_index
    }

    /// Tags of a frame as the window shows them of this annotator.
    pub(crate) fn tags(&self, frame: usize) -> String {
        self.session().labels.label(frame).tags.to_string()
    }

    pub(crate) fn drop_file(&mut self, path: &Path) {
        let file: Arc<dyn egui::DroppedFile + Send + Sync> = Arc::new(Dropped(path.into()));
        self.harness.input_mut().dropped_files.push(file);
        self.harness.step();
    }

    /// Runs until a run of 20 iterations has ended.
    pub(crate) fn fitted(frames: usize) -> Self {
        let mut window = Self::open(frames);
        window.type_value("Iterations value", "20");
        assert_eq!(window.session().config.iterations, 20);
        window.key(Key::Enter);
        window.paused_at(20);
        window
    }

    /// Fits in double precision from now on: a hundred thousand iterations then outlast an unoptimised window.
    pub(crate) fn slowly(&mut self) {
        let frame = self.session().data.frame_index;
        self.click("f64");
        self.ready(frame);
    }

    /// Begins a run that takes longer than any test.
    pub(crate) fn run_forever(&mut self) {
        self.slowly();
        self.type_value("Iterations value", "100000");
        self.key(Key::Enter);
        self.until("some iterations", |w| w.fit().is_running() && w.fit().head() > 3);
    }
}

#[derive(Debug)]
struct Dropped(PathBuf);

impl egui::DroppedFile for Dropped {
    fn path(&self) -> &Path {
        &self.0
    }

    fn bytes(&self) -> Result<Vec<u8>, String> {
        std::fs::read(&self.0).map_err(|error| error.to_string())
    }
}
