//! The window: reads the session, sends commands, draws panes. It changes no state of its own but where things are.
//!
//! Each pass: threads' reports become commands, pressed keys become commands, panes are drawn and send commands, all of
//! them are applied at the end. Nothing repaints unless something changed: threads wake the window.

mod closing;
mod commands;
mod figure;
mod layout;
mod locate;
mod map_image;
mod map_plane;
mod menu;
mod overlay;
mod panes;
mod sharing;
mod theme;
mod timeline;
mod widgets;

use crate::config::FitConfig;
use crate::predictions::{Reading, looks_like_predictions};
use crate::session::{Command, LogLevel, PickKind, Report, Runtime, Session, StartAt, ViewState, Wake};
use commands::{AppAct, UiAction};
use layout::PaneLayout;
use overlay::Overlay;
use panes::{PaneStates, Pointed, Shared, predictions, study};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

pub use panes::Pane;

/// The name under which settings are stored.
pub const APP_ID: &str = "mhp-inspector";

/// The window's title without data.
const TITLE: &str = "MHP Inspector";
/// Nobody answers a file dialog faster: there was none.
const TOO_QUICK: std::time::Duration = std::time::Duration::from_millis(250);

const VIEW_KEY: &str = "view";
const RECENT_KEY: &str = "recent";
const LAYOUT_KEY: &str = "layout";
/// Whether the borders of the layout go with the size of the window.
const FITTED_KEY: &str = "layout-fitted";
const ANNOTATOR_KEY: &str = "annotator";

/// What the window begins with.
#[derive(Debug, Clone, Default)]
pub struct Begin {
    /// Data sets; the first one opens, the others become recents.
    pub paths: Vec<PathBuf>,
    /// Where to begin in it.
    pub aim: StartAt,
    /// A table of results for the frame list.
    pub results: Option<PathBuf>,
    /// Files of predictions, and what is told of them.
    pub predictions: Vec<(PathBuf, Reading)>,
    /// The run folder of a study.
    pub study: Option<PathBuf>,
    /// The settings, in force before anything is opened.
    pub config: Option<FitConfig>,
    /// A session file, instead of all that.
    pub session: Option<PathBuf>,
    /// Whether manifests may name frames outside their own folder.
    pub allow_outside: bool,
    /// What is asked instead of the desktop's file dialog.
    pub pick: Option<fn(PickKind) -> Option<PathBuf>>,
}

/// The application behind the window.
pub struct InspectorApp {
    runtime: Runtime,
    layout: PaneLayout,
    panes: PaneStates,
    timeline: timeline::Timeline,
    /// What the pointer was on in the pass before.
    pointed: Pointed,
    gpu: Option<eframe::egui_wgpu::RenderState>,
    overlay: Overlay,
    pictures: sharing::PendingPictures,
    notices_seen: u64,
    last_play: Option<f64>,
    /// When the replay got on last, s.
    last_replay: Option<f64>,
    applied_zoom: f32,
    dropped: Option<PathBuf>,
    /// The title of the window.
    title: String,
    /// Somebody said that the window may close, whatever is under way.
    leaving: bool,
    /// Set where the desktop answered a dialog before anybody could have.
    no_dialog: Arc<AtomicBool>,
}

impl InspectorApp {
    /// The window's application; `paths` are opened, or without one the bundled sample where it can be found.
    pub fn new(cc: &eframe::CreationContext<'_>, paths: &[PathBuf]) -> Self {
        Self::begin(cc, &Begin { paths: paths.to_vec(), ..Begin::default() })
    }

    /// The window's application, begun as the command line says.
    pub fn begin(cc: &eframe::CreationContext<'_>, begin: &Begin) -> Self {
        theme::install(&cc.egui_ctx);
        let (mut view, mut recent) = (ViewState::default(), Vec::new());
        let mut layout = PaneLayout::default();
        let mut annotator = crate::folders::user_name();
        let mut first_visit = false;
        if let Some(storage) = cc.storage {
            annotator = eframe::get_value(storage, ANNOTATOR_KEY).unwrap_or(annotator);
            let stored = eframe::get_value(storage, VIEW_KEY);
            first_visit = stored.is_none();
            view = stored.unwrap_or_default();
            recent = eframe::get_value(storage, RECENT_KEY).unwrap_or_default();
            if let Some(stored) = eframe::get_value(storage, LAYOUT_KEY) {
                let fitted = eframe::get_value(storage, FITTED_KEY).unwrap_or(false);
                layout = PaneLayout::restored(stored, fitted);
            }
        }
        let ctx = cc.egui_ctx.clone();
        let wake: Wake = Arc::new(move || ctx.request_repaint());
        let mut session = Session::remembered(view, recent);
        if first_visit {
            session = session.first_visit();
        }
        let no_dialog = Arc::new(AtomicBool::new(false));
        let (unanswered, waker) = (Arc::clone(&no_dialog), cc.egui_ctx.clone());
        let dialog = begin.pick.unwrap_or(overlay::pick);
        let pick = move |kind| {
            let asked = std::time::Instant::now();
            let picked = dialog(kind);
            if picked.is_none() && asked.elapsed() < TOO_QUICK {
                unanswered.store(true, Ordering::Relaxed);
                waker.request_repaint();
            }
            picked
        };
        let mut runtime = Runtime::new(session, wake, Some(Arc::new(pick))).allow_outside(begin.allow_outside);
        runtime.apply(Command::SetAnnotator(annotator));
        let mut app = Self {
            runtime,
            layout,
            panes: PaneStates::default(),
            timeline: timeline::Timeline::default(),
            pointed: Pointed::default(),
            gpu: cc.wgpu_render_state.clone(),
            overlay: Overlay::default(),
            pictures: sharing::PendingPictures::default(),
            notices_seen: 0,
            last_play: None,
            last_replay: None,
            applied_zoom: 1.0,
            dropped: None,
            title: String::new(),
            leaving: false,
            no_dialog,
        };
        if let Some(session) = &begin.session {
            app.apply(Command::OpenSession(session.clone()));
            return app;
        }
        if let Some(config) = begin.config {
            app.apply(Command::SetConfig(Box::new(config)));
        }
        let last = app.session().data.recent.first().filter(|path| path.exists()).cloned();
        match begin.paths.first().cloned().or(last).or_else(crate::dataset::bundled_sample) {
            Some(path) => app.apply(Command::OpenAt(path, begin.aim.clone())),
            None => app.runtime.report(Report::Log(
                LogLevel::Info,
                "the bundled sample was not found; open a data set with File > Open folder".into(),
            )),
        }
        if let Some(results) = &begin.results {
            app.apply(Command::LoadResults(results.clone()));
        }
        for (path, reading) in &begin.predictions {
            app.apply(Command::OpenPredictions(path.clone(), Box::new(reading.clone())));
        }
        if let Some(run) = &begin.study {
            app.open_run(run.clone());
        }
        app.apply(Command::OfferPaths(begin.paths.iter().skip(1).cloned().collect()));
        app
    }

    /// The state behind the window, to be read by tests and by `screenshot`.
    pub fn session(&self) -> &Session {
        self.runtime.session()
    }

    /// The title of the window: it names the data, so that windows can be told apart.
    pub fn title(&self) -> &str {
        &self.title
    }

    /// Applies a command as if a person had given it.
    pub fn apply(&mut self, command: Command) {
        self.runtime.apply(command);
    }

    /// Brings a pane to the front.
    pub fn show_pane(&mut self, pane: &'static Pane) {
        self.layout.show_pane(pane);
    }

    /// Draws a pane over all of the window's middle, without the others, as for a figure.
    pub fn show_pane_alone(&mut self, pane: &'static Pane) {
        self.layout.show_alone(pane);
    }

    /// Whether panes wait for something that is computed for them alone.
    pub fn panes_are_working(&self) -> bool {
        self.panes.are_working()
    }

    /// Where a pane was drawn in the last pass, points; `None` where it is behind another tab.
    pub fn pane_rect(&self, pane: &'static Pane) -> Option<egui::Rect> {
        self.layout.rect(pane)
    }

    /// Zooms the maps to the person and the camera to the selection.
    pub fn focus(&mut self) {
        self.panes.focus(self.runtime.session());
    }

    fn act(&mut self, ctx: &egui::Context, act: UiAction) {
        match act {
            UiAction::Session(Command::OpenRun(folder)) => self.open_run(folder),
            UiAction::Session(command) => self.apply(command),
            UiAction::App(act) => self.app_act(ctx, act),
            UiAction::Write(kind, path) => self.save(ctx, kind, path),
            UiAction::Panes { front, change } => {
                if let Some(pane) = front {
                    self.layout.show_pane(pane);
                }
                change(&mut self.panes, self.runtime.session());
            }
        }
    }

    fn app_act(&mut self, ctx: &egui::Context, act: AppAct) {
        match act {
            AppAct::Quit => self.quit(ctx),
            AppAct::StopAndQuit => self.stop_and_quit(ctx),
            AppAct::Palette => self.overlay.toggle_palette(),
            AppAct::Help => self.overlay.toggle_help(),
            AppAct::About => self.overlay.toggle_about(),
            AppAct::GotoFrame => self.overlay.open_goto(self.session().data.frame_index),
            AppAct::OpenPath => self.overlay.open_path(self.runtime.session().data.recent.first()),
            AppAct::ResetLayout => self.layout = PaneLayout::default(),
            AppAct::ResetViews => self.panes.reset_views(),
            AppAct::Back => self.back(),
            AppAct::Focus => self.panes.toggle_focus(self.runtime.session()),
            AppAct::ZoomIn => self.set_zoom(self.session().view.zoom + 0.1),
            AppAct::ZoomOut => self.set_zoom(self.session().view.zoom - 0.1),
            AppAct::ZoomReset => self.set_zoom(1.0),
            AppAct::Save(kind) => self.ask_save(kind),
            AppAct::SaveSession => self.save_session_again(ctx),
            AppAct::OpenSession => self.overlay.open_session(),
            AppAct::CopyPicture(pane) => self.copy_picture(ctx, pane),
            AppAct::ShowPane(pane) => self.layout.show_pane(pane),
            AppAct::LoadResults => self.overlay.load_results(),
            AppAct::OpenStudy => self.overlay.open_study(),
            AppAct::OpenPredictions => self.overlay.open_predictions(),
            AppAct::CopyPath => self.copy_path(ctx),
            AppAct::FullScreen => {
                let full = ctx.input(|i| i.viewport().fullscreen.unwrap_or(false));
                ctx.send_viewport_cmd(egui::ViewportCommand::Fullscreen(!full));
            }
        }
    }

    /// One step back from what was singled out: a map alone, selected frames, a joint.
    fn back(&mut self) {
        if self.panes.back() {
            return;
        }
        let clear = if self.session().labels.selection.is_empty() {
            Command::SelectJoint(None)
        } else {
            Command::SelectFrames(std::collections::BTreeSet::new())
        };
        self.apply(clear);
    }

    fn set_zoom(&mut self, zoom: f32) {
        let mut view = self.session().view.clone();
        view.zoom = (zoom.clamp(0.7, 2.0) * 10.0).round() / 10.0;
        self.apply(Command::SetView(Box::new(view)));
    }

    /// Reads a run folder and brings its pane to the front.
    fn open_run(&mut self, folder: PathBuf) {
        self.layout.show_pane(&study::PANE);
        self.apply(Command::OpenRun(folder));
    }

    /// Files dropped on the window: joints are predictions, a table is results, a run folder a study, anything else a data set.
    fn take_drops(&mut self, ctx: &egui::Context) {
        let dropped = ctx.input(|i| {
            i.raw
                .dropped_files
                .iter()
                .find_map(|file| Some(file.path().to_path_buf()).filter(|p| !p.as_os_str().is_empty()))
        });
        if dropped != self.dropped
            && let Some(path) = dropped.clone()
        {
            let table = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("csv"));
            if looks_like_predictions(&path) {
                self.layout.show_pane(&predictions::PANE);
                self.apply(Command::OpenPredictions(path, Box::default()));
            } else if crate::study::run::is_run_folder(&path) {
                self.open_run(path);
            } else {
                self.apply(if table { Command::LoadResults(path) } else { Command::Open(path) });
            }
        }
        self.dropped = dropped;
    }

    /// Plays frames at the data set's rate, never faster than they can be read.
    fn play(&mut self, ctx: &egui::Context) {
        if !self.session().data.playing {
            self.last_play = None;
            return;
        }
        let rate = self.session().data.dataset.as_ref().and_then(|d| d.info().frame_rate_hz).unwrap_or(10.0);
        let pause = 1.0 / rate.clamp(0.1, 60.0);
        let now = ctx.input(|i| i.time);
        let since = self.last_play.map_or(f64::INFINITY, |last| now - last);
        if since >= pause && self.session().data.loading.is_none() {
            self.last_play = Some(now);
            self.apply(Command::StepFrames(1));
        }
        if self.session().data.playing {
            let wait = (pause - since).clamp(0.001, pause);
            ctx.request_repaint_after(std::time::Duration::from_secs_f64(wait));
        }
    }

    /// Plays the iterations of a fit at the speed that runs are watched at.
    fn replay(&mut self, ctx: &egui::Context) {
        if self.session().fit.replay.is_none() {
            self.last_replay = None;
            return;
        }
        let now = ctx.input(|i| i.time);
        if let Some(last) = self.last_replay.replace(now) {
            self.apply(Command::PlayOn(now - last));
        }
        ctx.request_repaint();
    }

    /// The title names the data, so that windows can be told apart.
    fn name_window(&mut self, ctx: &egui::Context) {
        let data = &self.session().data;
        let title = match (&data.dataset, &data.frame) {
            (Some(dataset), Some(frame)) => format!("{} · {} – {TITLE}", dataset.info().name, frame.name),
            (Some(dataset), None) => format!("{} – {TITLE}", dataset.info().name),
            (None, _) => TITLE.to_owned(),
        };
        if title != self.title {
            ctx.send_viewport_cmd(egui::ViewportCommand::Title(title.clone()));
            self.title = title;
        }
    }

    /// Where the desktop shows no file dialog, a path can be typed.
    fn take_missing_dialog(&mut self, ctx: &egui::Context) {
        if self.no_dialog.swap(false, Ordering::Relaxed) {
            self.overlay.open_path(self.runtime.session().data.recent.first());
            let text = "this desktop shows no file dialog: type the path, or drop the file on the window";
            self.overlay.notify(LogLevel::Warning, text.into(), ctx.input(|i| i.time));
        }
    }

    /// Settings stay under the finger until it is lifted.
    fn lift_finger(&mut self, ctx: &egui::Context) {
        // What arrow keys move is held by the key that they are pressed with.
        if self.session().is_dragging() && !ctx.input(|i| i.pointer.any_down() || i.modifiers.alt) {
            self.apply(Command::EndDrag);
        }
    }

    /// Errors and warnings that appeared since the last pass become notifications.
    fn take_notices(&mut self, ctx: &egui::Context) {
        if let Some(notice) = &self.runtime.session().notice
            && notice.count > self.notices_seen
        {
            self.notices_seen = notice.count;
            self.overlay.tell(notice.clone(), ctx.input(|i| i.time));
        }
    }
}

impl eframe::App for InspectorApp {
    fn logic(&mut self, ctx: &egui::Context, _frame: &mut eframe::Frame) {
        theme::apply(ctx, self.session().view.theme);
        if self.applied_zoom != self.session().view.zoom {
            self.applied_zoom = self.session().view.zoom;
            ctx.set_zoom_factor(self.applied_zoom);
        }
        self.runtime.poll();
        self.take_close(ctx);
        self.take_restored();
        self.take_pictures(ctx);
        self.take_drops(ctx);
        self.play(ctx);
        self.replay(ctx);
        self.name_window(ctx);
        self.take_missing_dialog(ctx);
        self.lift_finger(ctx);
        if self.runtime.is_busy() {
            ctx.request_repaint_after(std::time::Duration::from_millis(100));
        }
        // While the mouse has the body, keys say along which axis it goes.
        let in_hand = self.session().is_moving() && ctx.input(|i| i.pointer.any_down());
        if !self.overlay.is_modal() && !in_hand {
            for command in commands::pressed(ctx) {
                if command.enabled(self.runtime.session()) {
                    let act = command.action(self.runtime.session());
                    self.act(ctx, act);
                }
            }
        }
        self.take_notices(ctx);
    }

    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        let mut acts: Vec<UiAction> = Vec::new();
        let mut points = Pointed::default();
        {
            let gpu = self.gpu.as_ref();
            let (session, pointed) = (self.runtime.session(), self.pointed);
            let pane = egui::Rect::NOTHING;
            let mut shared = Shared { session, acts: &mut acts, gpu, pane, pointed, points: &mut points };
            menu::bar(ui, &mut shared);
            timeline::show(ui, &mut shared, &mut self.timeline);
            self.layout.show(ui, &mut shared, &mut self.panes);
            self.overlay.show(ui, &mut shared);
        }
        let ctx = ui.ctx().clone();
        if std::mem::replace(&mut self.pointed, points) != points {
            ctx.request_repaint();
        }
        acts.extend(self.layout.take_asked().map(UiAction::App));
        for act in acts {
            self.act(&ctx, act);
        }
        // A command given in this pass is seen in the next one.
        self.take_notices(&ctx);
    }

    fn save(&mut self, storage: &mut dyn eframe::Storage) {
        eframe::set_value(storage, VIEW_KEY, &self.session().view);
        eframe::set_value(storage, RECENT_KEY, &self.session().data.recent);
        eframe::set_value(storage, ANNOTATOR_KEY, &self.session().labels.annotator);
        eframe::set_value(storage, LAYOUT_KEY, self.layout.stored());
        eframe::set_value(storage, FITTED_KEY, &self.layout.is_fitted());
    }
}

/// Opens the window, with a table of results of the first data set where there is one, and returns when it is closed.
///
/// # Errors
/// Where there is no display or no graphics adapter.
pub fn run(begin: Begin) -> anyhow::Result<()> {
    let options = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default()
            .with_app_id(APP_ID)
            .with_title(TITLE)
            .with_inner_size([1440.0, 900.0])
            .with_min_inner_size([960.0, 600.0])
            .with_drag_and_drop(true),
        renderer: eframe::Renderer::Wgpu,
        ..Default::default()
    };
    eframe::run_native(APP_ID, options, Box::new(move |cc| Ok(Box::new(InspectorApp::begin(cc, &begin)))))
        .map_err(|error| anyhow::anyhow!("the window cannot be opened: {error}"))
}
