//! Sheets that ask for a file: one to write, or a session file or a table of results to read.

use super::{Overlay, modal};
use crate::app::TOO_QUICK;
use crate::app::commands::{SaveKind, UiAction};
use crate::app::panes::Shared;
use crate::app::theme::Tokens;
use crate::session::Command;
use egui::{Key, RichText, Ui};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// What a file dialog answered, once it did.
#[derive(Default)]
pub(super) struct FileDialog {
    picked: Arc<Mutex<Option<PathBuf>>>,
    /// It was closed before anybody could have answered it: there is none.
    missing: Arc<AtomicBool>,
}

impl FileDialog {
    /// Shows a dialog on a thread of its own; its answer comes into the field.
    fn browse(&self, ctx: &egui::Context, pick: impl FnOnce() -> Option<PathBuf> + Send + 'static) {
        let (picked, missing, ctx) = (Arc::clone(&self.picked), Arc::clone(&self.missing), ctx.clone());
        let spawned = std::thread::Builder::new().name("file-dialog".into()).spawn(move || {
            let asked = std::time::Instant::now();
            match pick() {
                Some(path) => *picked.lock().unwrap_or_else(PoisonError::into_inner) = Some(path),
                None => missing.store(asked.elapsed() < TOO_QUICK, Ordering::Relaxed),
            }
            ctx.request_repaint();
        });
        if let Err(error) = spawned {
            tracing::error!("no thread for the file dialog: {error}");
        }
    }

    fn take(&self) -> Option<PathBuf> {
        self.picked.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

fn what(kind: SaveKind) -> (&'static str, &'static str) {
    match kind {
        SaveKind::Session => {
            ("Save the session", "Frame, iteration, fit, pins, camera and layout. Data are not copied.")
        }
        SaveKind::Picture(None) => ("Save a picture of the window", "PNG, as it is on screen."),
        SaveKind::Picture(Some(_)) => ("Save a picture of the pane", "PNG, as it is on screen."),
        SaveKind::Export(what) => match what {
            crate::session::Export::Curves => ("Export curves", "CSV: every iteration and branch of this fit."),
            crate::session::Export::Gaussians => ("Export Gaussians", "PLY: the layout of 3-D Gaussian splatting."),
            crate::session::Export::Parameters => ("Export parameters", "npz: PPPR of the iteration on screen."),
            crate::session::Export::LabelsCsv => ("Export labels", "CSV: a row a frame and annotator."),
            crate::session::Export::LabelsJson => ("Export labels", "JSON: everything that was recorded."),
            crate::session::Export::Erased => ("Export erased cells", "JSON: what fit --erase takes."),
            crate::session::Export::Strata => ("Export strata", "CSV: hardness and its parts of every frame."),
        },
    }
}

impl Overlay {
    /// Asks where to write something.
    pub(in crate::app) fn open_save(&mut self, kind: SaveKind, suggested: &Path) {
        self.toggle(super::Sheet::Save(kind));
        self.query = suggested.display().to_string();
        self.files = FileDialog::default();
    }

    /// Asks for a session file.
    pub(in crate::app) fn open_session(&mut self) {
        self.toggle(super::Sheet::Session);
        self.files = FileDialog::default();
    }

    /// Asks for a table of results.
    pub(in crate::app) fn load_results(&mut self) {
        self.toggle(super::Sheet::Results);
        self.files = FileDialog::default();
    }

    /// Asks for a run folder.
    pub(in crate::app) fn open_study(&mut self) {
        self.toggle(super::Sheet::Study);
        self.files = FileDialog::default();
    }

    /// Asks for a file of predictions.
    pub(in crate::app) fn open_predictions(&mut self) {
        self.toggle(super::Sheet::Predictions);
        self.files = FileDialog::default();
    }

    pub(super) fn predictions_path(&mut self, ui: &mut Ui, shared: &mut Shared<'_>) -> bool {
        let tokens = Tokens::of(ui);
        let mut done = false;
        let response = modal(ui, "predictions").show(ui.ctx(), |ui| {
            ui.set_width(super::width(ui, 620.0));
            ui.label(RichText::new("Open predictions").font(crate::app::theme::strong(16.0)));
            let how = "Joints of a network or an earlier run: npz, npy, CSV, JSON (COCO, MMPose), Parquet, or the folder of \
                       `fit --out`. What the file does not say of itself is asked for, and remembered.";
            ui.label(RichText::new(how).small().color(tokens.dim));
            let browse = |_: PathBuf| super::pick_predictions;
            if let Some(path) = self.path_field(ui, "File of predictions", "Open", browse) {
                shared.acts.push(UiAction::App(crate::app::commands::AppAct::ShowPane(&crate::app::panes::predictions::PANE)));
                shared.send(Command::OpenPredictions(path, Box::default()));
                done = true;
            }
        });
        done || response.should_close()
    }

    pub(super) fn save(&mut self, ui: &mut Ui, shared: &mut Shared<'_>, kind: SaveKind) -> bool {
        let tokens = Tokens::of(ui);
        let (title, how) = what(kind);
        let mut done = false;
        let response = modal(ui, "save").show(ui.ctx(), |ui| {
            ui.set_width(super::width(ui, 620.0));
            ui.label(RichText::new(title).font(crate::app::theme::strong(16.0)));
            ui.label(RichText::new(how).small().color(tokens.dim));
            let browse = |suggested: PathBuf| move || super::pick_save(&suggested);
            let chosen = self.path_field(ui, "Save to", "Save", browse);
            if Path::new(self.query.trim()).is_file() {
                ui.label(RichText::new("△ The file is there already and will be replaced.").small().color(tokens.warn));
            }
            if let Some(path) = chosen {
                shared.acts.push(UiAction::Write(kind, path));
                done = true;
            }
        });
        done || response.should_close()
    }

    pub(super) fn session_path(&mut self, ui: &mut Ui, shared: &mut Shared<'_>) -> bool {
        let mut done = false;
        let response = modal(ui, "session").show(ui.ctx(), |ui| {
            ui.set_width(super::width(ui, 620.0));
            ui.label(RichText::new("Open a session").font(crate::app::theme::strong(16.0)));
            let browse = |_: PathBuf| super::pick_session;
            if let Some(path) = self.path_field(ui, "Session file", "Open", browse) {
                shared.send(Command::OpenSession(path));
                done = true;
            }
        });
        done || response.should_close()
    }

    pub(super) fn results_path(&mut self, ui: &mut Ui, shared: &mut Shared<'_>) -> bool {
        let tokens = Tokens::of(ui);
        let mut done = false;
        let response = modal(ui, "results").show(ui.ctx(), |ui| {
            ui.set_width(super::width(ui, 620.0));
            ui.label(RichText::new("Load results").font(crate::app::theme::strong(16.0)));
            let how =
                "The summary.csv of `mhp-inspector fit --out`. Frames that were fitted in this window keep theirs.";
            ui.label(RichText::new(how).small().color(tokens.dim));
            let browse = |_: PathBuf| super::pick_results;
            if let Some(path) = self.path_field(ui, "Table of results", "Load", browse) {
                shared.send(Command::LoadResults(path));
                done = true;
            }
        });
        done || response.should_close()
    }

    pub(super) fn study_path(&mut self, ui: &mut Ui, shared: &mut Shared<'_>) -> bool {
        let tokens = Tokens::of(ui);
        let mut done = false;
        let response = modal(ui, "study").show(ui.ctx(), |ui| {
            ui.set_width(super::width(ui, 620.0));
            ui.label(RichText::new("Open a study").font(crate::app::theme::strong(16.0)));
            let how = "The run folder of `mhp-inspector study NAME --out RUN`, finished or not.";
            ui.label(RichText::new(how).small().color(tokens.dim));
            let browse = |_: PathBuf| super::pick_run;
            if let Some(path) = self.path_field(ui, "Run folder", "Open", browse) {
                shared.send(Command::OpenRun(path));
                done = true;
            }
        });
        done || response.should_close()
    }

    /// A field for a path with a button that does it and one that browses; answers the path when it is to be used.
    fn path_field<P: FnOnce() -> Option<PathBuf> + Send + 'static>(
        &mut self,
        ui: &mut Ui,
        name: &str,
        verb: &str,
        browse: impl FnOnce(PathBuf) -> P,
    ) -> Option<PathBuf> {
        if let Some(path) = self.files.take() {
            self.query = path.display().to_string();
        }
        let field = egui::TextEdit::singleline(&mut self.query).font(egui::TextStyle::Monospace);
        let field = ui.add(field.desired_width(f32::INFINITY));
        field.widget_info(|| egui::WidgetInfo::labeled(egui::Role::TextInput, true, name));
        if std::mem::take(&mut self.fresh) {
            field.request_focus();
        }
        let typed = self.query.trim().to_owned();
        let mut clicked = false;
        ui.horizontal(|ui| {
            clicked = ui.add_enabled(!typed.is_empty(), egui::Button::new(verb)).clicked();
            if ui.button("Browse…").on_hover_text("The desktop's file dialog.").clicked() {
                self.files.browse(ui.ctx(), browse(PathBuf::from(&typed)));
            }
        });
        if self.files.missing.load(Ordering::Relaxed) {
            let text = "▲ This desktop shows no file dialog: type the path.";
            ui.label(RichText::new(text).small().color(Tokens::of(ui).warn));
        }
        let enter = ui.input(|i| i.key_pressed(Key::Enter));
        (!typed.is_empty() && (clicked || enter)).then(|| PathBuf::from(typed))
    }
}
