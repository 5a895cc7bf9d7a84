//! Taking things home from the window: pictures, and what only the window knows of a session.

use super::InspectorApp;
use super::commands::SaveKind;
use super::layout::PaneLayout;
use super::panes::Pane;
use crate::output::{Sink, portable, replace_file};
use crate::session::{BackgroundTask, Command, Export, LogLevel, OutputCheck, Report, Session};
use egui::{ColorImage, Context, Rect};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

/// What only the window knows of a session.
#[derive(Serialize, Deserialize)]
struct WindowState {
    layout: egui_tiles::Tree<&'static Pane>,
    /// Its borders go with the size of the window.
    #[serde(default)]
    fitted: bool,
    /// What the panes keep, each under its own name.
    panes: Map<String, Value>,
}

/// Pictures that were asked for and are not drawn yet.
#[derive(Default)]
pub(super) struct PendingPictures {
    /// To be drawn with the next pass: the one in which somebody asks still has the dialog or the menu on it.
    asked: Vec<Wanted>,
    drawn: Arc<Mutex<Vec<Drawn>>>,
}

type Drawn = (Wanted, Arc<ColorImage>);

/// What a picture is for.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Wanted {
    /// A file, of the window or a part of it (points).
    File(PathBuf, Option<Rect>),
    /// The clipboard, of the window or a part of it (points).
    Clipboard(Option<Rect>),
}

impl PendingPictures {
    /// Asks for a picture of the next pass.
    fn ask(&mut self, ctx: &Context, wanted: Wanted) {
        self.asked.push(wanted);
        ctx.request_repaint();
    }

    /// A pass begins, of which pictures are taken that were asked for in the one before.
    fn begin_pass(&mut self, ctx: &Context) {
        for wanted in self.asked.drain(..) {
            let drawn = Arc::clone(&self.drawn);
            let waker = ctx.clone();
            ctx.request_screenshot(move |image: Arc<ColorImage>| {
                drawn.lock().unwrap_or_else(PoisonError::into_inner).push((wanted, image));
                waker.request_repaint();
            });
            ctx.request_repaint();
        }
    }

    fn take(&self) -> Vec<Drawn> {
        std::mem::take(&mut self.drawn.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

/// The part of a picture inside `rect`, points.
fn cropped(image: &ColorImage, rect: Option<Rect>, scale: f32) -> ColorImage {
    rect.map_or_else(|| image.clone(), |rect| image.region(&rect, Some(scale)))
}

fn write_png(image: &ColorImage, path: &Path, check: &OutputCheck) -> Result<String, String> {
    check.file(path)?;
    let [width, height] = image.size;
    let bytes: Vec<u8> = image.pixels.iter().flat_map(egui::Color32::to_array).collect();
    let failed = |reason: String| format!("{}: cannot be written: {reason}", path.display());
    let picture = image::RgbaImage::from_raw(width as u32, height as u32, bytes);
    let picture = picture.ok_or_else(|| failed("the picture is empty".into()))?;
    let write =
        |mut out: &mut dyn Sink| picture.write_to(&mut out, image::ImageFormat::Png).map_err(std::io::Error::other);
    replace_file(path, write).map_err(|error| failed(error.to_string()))?;
    Ok(format!("picture of {width} × {height} pixels written to {}", path.display()))
}

/// Where something would be written, unless a person says otherwise: beside what was written last, else in the folder that
/// the program was started in.
fn suggestion(session: &Session, kind: SaveKind) -> PathBuf {
    let folder = session.session_path.as_ref().and_then(|path| path.parent().map(Path::to_path_buf));
    let folder = folder.or_else(|| std::env::current_dir().ok()).unwrap_or_default();
    let dataset = session.data.dataset.as_ref().map_or("session", |dataset| dataset.info().name.as_str());
    let frame = session.data.frame.as_ref().map_or("", |frame| frame.name.as_str());
    let iteration = session.fit.shown_iteration();
    let of_frame = |ending: &str| format!("{dataset}-{frame}-it{iteration}.{ending}");
    let name = match kind {
        SaveKind::Session => format!("{dataset}.mhp-session"),
        SaveKind::Picture(None) => of_frame("png"),
        SaveKind::Picture(Some(pane)) => format!("{dataset}-{frame}-it{iteration}-{}.png", pane.title()),
        SaveKind::Export(what @ (Export::LabelsCsv | Export::LabelsJson)) => {
            format!("{dataset}-labels.{}", what.ending())
        }
        SaveKind::Export(Export::Strata) => format!("{dataset}-strata.csv"),
        SaveKind::Export(Export::Erased) => of_frame("erased.json"),
        SaveKind::Export(what) => of_frame(what.ending()),
    };
    let plain = |c: char| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '-' };
    let name: String = name.chars().map(plain).collect();
    let (stem, ending) = name.rsplit_once('.').unwrap_or((name.as_str(), ""));
    folder.join(format!("{}.{ending}", portable(stem)))
}

impl InspectorApp {
    /// Asks where to write something.
    pub(super) fn ask_save(&mut self, kind: SaveKind) {
        let path = suggestion(self.runtime.session(), kind);
        self.overlay.open_save(kind, &path);
    }

    /// Writes the session where it was last, or asks.
    pub(super) fn save_session_again(&mut self, ctx: &Context) {
        match self.session().session_path.clone() {
            Some(path) => self.save(ctx, SaveKind::Session, path),
            None => self.ask_save(SaveKind::Session),
        }
    }

    /// Writes something.
    pub(super) fn save(&mut self, ctx: &Context, kind: SaveKind, path: PathBuf) {
        match kind {
            SaveKind::Export(what) => self.apply(Command::Export(what, path)),
            SaveKind::Session => {
                let layout = self.layout.stored().clone();
                let fitted = self.layout.is_fitted();
                let window = self.panes.stored().map(|panes| WindowState { layout, fitted, panes });
                match window.and_then(serde_json::to_value) {
                    Ok(window) => self.apply(Command::SaveSession(path, window)),
                    Err(error) => {
                        self.runtime
                            .report(Report::Log(LogLevel::Error, format!("the session was not saved: {error}")));
                    }
                }
            }
            SaveKind::Picture(pane) => {
                let rect = pane.and_then(|pane| self.layout.rect(pane));
                self.pictures.ask(ctx, Wanted::File(path, rect));
            }
        }
    }

    /// Puts the picture of the window, or of one pane, on the clipboard.
    pub(super) fn copy_picture(&mut self, ctx: &Context, pane: Option<&'static Pane>) {
        let rect = pane.and_then(|pane| self.layout.rect(pane));
        self.pictures.ask(ctx, Wanted::Clipboard(rect));
    }

    /// Puts the path of the frame's file on the clipboard.
    pub(super) fn copy_path(&mut self, ctx: &Context) {
        if let (Some(dataset), Some(frame)) = (&self.session().data.dataset, &self.session().data.frame) {
            ctx.copy_text(dataset.frame_path(frame.index).display().to_string());
            self.overlay.notify(LogLevel::Info, "path copied".into(), ctx.input(|i| i.time));
        }
    }

    /// Carries out what was asked of the pictures that are drawn by now.
    pub(super) fn take_pictures(&mut self, ctx: &Context) {
        let scale = ctx.pixels_per_point();
        self.pictures.begin_pass(ctx);
        for (wanted, image) in self.pictures.take() {
            match wanted {
                Wanted::File(path, rect) => {
                    let image = cropped(&image, rect, scale);
                    let check = self.session().output_check();
                    self.apply(Command::RunTask(BackgroundTask::new(move || write_png(&image, &path, &check))));
                }
                Wanted::Clipboard(rect) => {
                    ctx.copy_image(cropped(&image, rect, scale));
                    self.overlay.notify(LogLevel::Info, "picture copied".into(), ctx.input(|i| i.time));
                }
            }
        }
    }

    /// Puts back what a session file says of the window.
    pub(super) fn take_restored(&mut self) {
        let Some(window) = self.runtime.take_restored_window() else { return };
        let restored = serde_json::from_value::<WindowState>(window).and_then(|state| {
            self.panes.restore(state.panes, self.runtime.session())?;
            Ok((state.layout, state.fitted))
        });
        match restored {
            Ok((layout, fitted)) => self.layout = PaneLayout::restored(layout, fitted),
            Err(error) => {
                let text = format!("camera and layout of the session could not be put back: {error}");
                self.runtime.report(Report::Log(LogLevel::Warning, text));
            }
        }
    }
}
