//! What lies over the panes: palette, help sheet, about, go to, the questions about a bare file's axes and a
//! capture's chirps, notifications.

mod bare;
mod chirps;
mod files;
mod notices;
mod palette;
mod predictions;
mod presets;
mod quit;

use super::commands::{Menu, SaveKind, all, shortcut_text};
use super::panes::Shared;
use super::theme::{self, Tokens};
use crate::session::{Command, LogLevel, Notice, PickKind, PresetCard};
use egui::{Key, RichText, Ui, vec2};
use std::path::PathBuf;

/// Which sheet is open.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Sheet {
    #[default]
    None,
    Palette,
    Help,
    About,
    Goto,
    Path,
    Session,
    Results,
    Study,
    Predictions,
    Save(SaveKind),
    Quit,
}

/// What lies over the panes.
#[derive(Default)]
pub(super) struct Overlay {
    sheet: Sheet,
    query: String,
    /// Shown in an empty field.
    hint: String,
    chosen: usize,
    fresh: bool,
    /// Two presets are compared on a card.
    presets: bool,
    notices: notices::Notices,
    bare: bare::BareQuestion,
    chirps: chirps::ChirpQuestion,
    reading: predictions::ReadingQuestion,
    files: files::FileDialog,
}

impl Overlay {
    pub(super) fn toggle_palette(&mut self) {
        self.toggle(Sheet::Palette);
    }

    pub(super) fn toggle_help(&mut self) {
        self.toggle(Sheet::Help);
    }

    pub(super) fn toggle_about(&mut self) {
        self.toggle(Sheet::About);
    }

    pub(super) fn open_goto(&mut self, current: usize) {
        self.toggle(Sheet::Goto);
        self.hint = current.to_string();
    }

    pub(super) fn open_path(&mut self, start: Option<&PathBuf>) {
        self.toggle(Sheet::Path);
        self.hint = start.map(|path| path.display().to_string()).unwrap_or_default();
    }

    fn toggle(&mut self, sheet: Sheet) {
        self.sheet = if self.sheet == sheet { Sheet::None } else { sheet };
        self.query.clear();
        self.chosen = 0;
        self.fresh = true;
    }

    /// True while keys belong to a sheet.
    pub(super) fn is_modal(&self) -> bool {
        self.sheet != Sheet::None
            || self.bare.is_open()
            || self.chirps.is_open()
            || self.reading.is_open()
            || self.presets
    }

    pub(super) fn notify(&mut self, level: LogLevel, text: String, now: f64) {
        self.tell(Notice { count: 0, level, text, act: None }, now);
    }

    pub(super) fn tell(&mut self, notice: Notice, now: f64) {
        self.notices.tell(notice, now);
    }

    pub(super) fn show(&mut self, ui: &mut Ui, shared: &mut Shared<'_>) {
        self.bare.show(ui, shared);
        self.chirps.show(ui, shared);
        self.reading.show(ui, shared);
        self.notices.show(ui, shared);
        self.presets = !matches!(shared.session.presets, PresetCard::Closed);
        if self.presets && self.sheet == Sheet::None && presets::show(ui, shared) {
            shared.send(Command::ClosePresets);
        }
        let close = match self.sheet {
            Sheet::None => false,
            Sheet::Palette => self.palette(ui, shared),
            Sheet::Help => sheet(ui, "Keys and gestures", 760.0, help),
            Sheet::About => sheet(ui, "About MHP Inspector", 460.0, about),
            Sheet::Goto => self.goto(ui, shared),
            Sheet::Path => self.path(ui, shared),
            Sheet::Session => self.session_path(ui, shared),
            Sheet::Results => self.results_path(ui, shared),
            Sheet::Study => self.study_path(ui, shared),
            Sheet::Predictions => self.predictions_path(ui, shared),
            Sheet::Save(kind) => self.save(ui, shared, kind),
            Sheet::Quit => self.quit(ui, shared),
        };
        if close {
            self.sheet = Sheet::None;
        }
    }

    fn goto(&mut self, ui: &mut Ui, shared: &mut Shared<'_>) -> bool {
        let last = shared.session.data.len().saturating_sub(1);
        let mut done = false;
        let response = modal(ui, "goto").show(ui.ctx(), |ui| {
            ui.set_width(260.0);
            ui.label(format!("Frame, 0 to {last}"));
            let field =
                ui.add(egui::TextEdit::singleline(&mut self.query).hint_text(&self.hint).desired_width(f32::INFINITY));
            field.widget_info(|| egui::WidgetInfo::labeled(egui::Role::TextInput, true, "Frame number"));
            if self.fresh {
                field.request_focus();
                self.fresh = false;
            }
            let wanted = self.query.trim().parse::<usize>().ok().filter(|n| *n <= last);
            let go = ui.add_enabled(wanted.is_some(), egui::Button::new("Go")).clicked();
            if let Some(index) = wanted.filter(|_| go || ui.input(|i| i.key_pressed(Key::Enter))) {
                shared.send(Command::GotoFrame(index));
                done = true;
            }
        });
        done || response.should_close()
    }

    fn path(&mut self, ui: &mut Ui, shared: &mut Shared<'_>) -> bool {
        let mut done = false;
        let response = modal(ui, "path").show(ui.ctx(), |ui| {
            ui.set_width(width(ui, 560.0));
            ui.label("Path of an MMVR folder, a folder with dataset.toml, a *_radar.npz, or an .npy or .npz of maps");
            let field = ui.add(
                egui::TextEdit::singleline(&mut self.query)
                    .font(egui::TextStyle::Monospace)
                    .desired_width(f32::INFINITY),
            );
            field.widget_info(|| egui::WidgetInfo::labeled(egui::Role::TextInput, true, "Path"));
            if self.fresh {
                field.request_focus();
                self.fresh = false;
            }
            let typed = self.query.trim();
            let open = ui.add_enabled(!typed.is_empty(), egui::Button::new("Open")).clicked();
            if !typed.is_empty() && (open || ui.input(|i| i.key_pressed(Key::Enter))) {
                shared.send(Command::Open(PathBuf::from(typed)));
                done = true;
            }
        });
        done || response.should_close()
    }
}

/// The width of a sheet that wants so much, points: in a small window less.
fn width(ui: &Ui, wanted: f32) -> f32 {
    wanted.min(ui.ctx().content_rect().width() - 60.0).max(120.0)
}

/// A sheet in the middle of the window.
fn modal(ui: &Ui, name: &str) -> egui::Modal {
    egui::Modal::new(egui::Id::unique(name)).frame(egui::Frame::popup(ui.style()).inner_margin(16))
}

/// A sheet with a title that Escape or a click outside closes.
fn sheet(ui: &Ui, title: &str, width: f32, content: fn(&mut Ui)) -> bool {
    let height = ui.ctx().content_rect().height() * 0.8;
    modal(ui, title)
        .show(ui.ctx(), |ui| {
            ui.set_width(width.min(ui.ctx().content_rect().width() - 60.0));
            ui.label(RichText::new(title).font(theme::strong(16.0)));
            ui.add_space(6.0);
            egui::ScrollArea::vertical().max_height(height - 80.0).show(ui, content);
            ui.add_space(6.0);
            ui.button("Close").clicked()
        })
        .pipe_close()
}

trait PipeClose {
    fn pipe_close(self) -> bool;
}

impl PipeClose for egui::ModalResponse<bool> {
    fn pipe_close(self) -> bool {
        self.inner || self.should_close()
    }
}

fn help(ui: &mut Ui) {
    let tokens = Tokens::of(ui);
    // One below the other where two have no room beside each other.
    let count = if ui.available_width() < 620.0 { 1 } else { 2 };
    ui.columns(count, |columns| {
        for (i, menu) in Menu::ALL.into_iter().enumerate() {
            let ui = &mut columns[usize::from(i >= 4 && count > 1)];
            ui.label(RichText::new(menu.title()).font(theme::strong(13.0)));
            for command in all().filter(|c| c.menu() == menu && !c.keys().is_empty()) {
                key_row(ui, &shortcut_text(command.keys()[0]), &command.label(), &tokens);
            }
            ui.add_space(8.0);
        }
        let ui = &mut columns[count - 1];
        ui.label(RichText::new("Mouse").font(theme::strong(13.0)));
        for (gesture, what) in [
            ("Shift held", "flip H_ori and H_sim under the pointer"),
            ("drag", "pan a map; orbit in 3-D; scrub a strip"),
            ("drag a joint", "move it, on a map or in 3-D; X, Y or Z held: along that axis"),
            ("Ctrl+drag", "mark the cells that a label is about"),
            ("right drag", "pan in 3-D; zoom to a box in the curves"),
            ("wheel", "zoom at the pointer"),
            ("click", "select a joint; show an iteration"),
            ("double click", "one map alone; focus a joint; whole curve"),
        ] {
            key_row(ui, gesture, what, &tokens);
        }
        ui.add_space(8.0);
        ui.label(RichText::new("Small windows").font(theme::strong(13.0)));
        ui.label(
            "Panes give way to icons at the edges, a click shows one: first those left of the maps, then those right of them, \
             then those below. Tabs become icons from the last on.",
        );
    });
}

fn key_row(ui: &mut Ui, key: &str, what: &str, tokens: &Tokens) {
    ui.horizontal(|ui| {
        let layout = egui::Layout::left_to_right(egui::Align::Center);
        ui.allocate_ui_with_layout(vec2(104.0, 18.0), layout, |ui| {
            ui.set_min_width(104.0);
            ui.label(RichText::new(key).font(theme::mono(12.0)).color(tokens.accent));
        });
        ui.add(egui::Label::new(what).wrap());
    });
}

fn about(ui: &mut Ui) {
    ui.label(format!("Version {}", env!("CARGO_PKG_VERSION")));
    ui.label(env!("CARGO_PKG_DESCRIPTION"));
    ui.add_space(6.0);
    ui.label("Licence: MIT OR Apache-2.0. Fonts: Inter and JetBrains Mono, SIL Open Font License 1.1.");
    ui.label("Method: Person Parametric Physics-informed Representation (PPPR) and its pipeline MHP.");
}

/// Shows the desktop's file dialog; blocks, so it is called on a thread of its own.
pub(super) fn pick(kind: PickKind) -> Option<PathBuf> {
    let dialog = rfd::FileDialog::new().set_title("Open a data set");
    match kind {
        PickKind::Folder => dialog.pick_folder(),
        PickKind::File => {
            dialog.add_filter("Radar data", &["npz", "npy", "toml"]).add_filter("All files", &["*"]).pick_file()
        }
    }
}

/// Shows the desktop's dialog for a file to write; blocks, so it is called on a thread of its own.
fn pick_save(suggested: &std::path::Path) -> Option<PathBuf> {
    let mut dialog = rfd::FileDialog::new().set_title("Save as");
    if let Some(folder) = suggested.parent() {
        dialog = dialog.set_directory(folder);
    }
    if let Some(name) = suggested.file_name() {
        dialog = dialog.set_file_name(name.to_string_lossy());
    }
    dialog.save_file()
}

/// Shows the desktop's dialog for a session file; blocks like [`pick`].
fn pick_session() -> Option<PathBuf> {
    let dialog = rfd::FileDialog::new().set_title("Open a session");
    dialog.add_filter("Session", &["mhp-session"]).add_filter("All files", &["*"]).pick_file()
}

/// Shows the desktop's dialog for a run folder; blocks like [`pick`].
fn pick_run() -> Option<PathBuf> {
    rfd::FileDialog::new().set_title("Open study").pick_folder()
}

/// Shows the desktop's dialog for a file of predictions; blocks like [`pick`].
fn pick_predictions() -> Option<PathBuf> {
    let dialog = rfd::FileDialog::new().set_title("Open predictions");
    dialog.add_filter("Joints", &crate::predictions::ENDINGS).add_filter("All files", &["*"]).pick_file()
}

/// Shows the desktop's dialog for a table of results; blocks like [`pick`].
fn pick_results() -> Option<PathBuf> {
    let dialog = rfd::FileDialog::new().set_title("Load results");
    dialog.add_filter("Table", &["csv"]).add_filter("All files", &["*"]).pick_file()
}
