//! The commands about comparing fits, taking things home, and session files.

use super::table::{CTRL, CTRL_SHIFT, NONE, SHIFT, always, has_frame, view};
use super::{AppAct, CommandRow, Menu, SaveKind, UiAction};
use crate::app::panes::predictions;
use crate::session::{Against, Command, Export, Session};
use egui::Key;

fn save(what: Export) -> UiAction {
    UiAction::App(AppAct::Save(SaveKind::Export(what)))
}

fn fitted(s: &Session) -> bool {
    s.fit.shown.is_some()
}

fn labelled(s: &Session) -> bool {
    s.labels.table().values().any(|records| !records.is_empty())
}

/// Commands about comparing and sharing, in the order of their menus.
pub(super) const COMMANDS: &[CommandRow] = &[
    CommandRow {
        label: "Open session…",
        title: None,
        tooltip: "Open a session file: the same frame, iteration, camera, pins and layout.",
        menu: Menu::File,
        keys: &[],
        enabled: always,
        act: |_| UiAction::App(AppAct::OpenSession),
    },
    CommandRow {
        label: "Load results…",
        title: None,
        tooltip: "Take IoU, convergence, reason and MAJPE of a whole batch into the list: the summary.csv of `fit --out`.",
        menu: Menu::File,
        keys: &[],
        enabled: |s| s.data.dataset.is_some(),
        act: |_| UiAction::App(AppAct::LoadResults),
    },
    predictions::OPEN,
    predictions::START,
    CommandRow {
        label: "Open study…",
        title: None,
        tooltip: "Show the table and the plot of a study: the run folder that `study NAME --out` wrote.",
        menu: Menu::File,
        keys: &[],
        enabled: always,
        act: |_| UiAction::App(AppAct::OpenStudy),
    },
    CommandRow {
        label: "Save session",
        title: None,
        tooltip: "Write frame, iteration, camera, pins and layout to the session file; asks where the first time.",
        menu: Menu::File,
        keys: &[(CTRL, Key::S)],
        enabled: has_frame,
        act: |_| UiAction::App(AppAct::SaveSession),
    },
    CommandRow {
        label: "Save session as…",
        title: None,
        tooltip: "Write frame, iteration, camera, pins and layout to another session file.",
        menu: Menu::File,
        keys: &[],
        enabled: has_frame,
        act: |_| UiAction::App(AppAct::Save(SaveKind::Session)),
    },
    CommandRow {
        label: "Save picture…",
        title: None,
        tooltip: "Save the window, as it is on screen, as PNG. A pane alone: right click on its tab.",
        menu: Menu::File,
        keys: &[(CTRL_SHIFT, Key::S)],
        enabled: always,
        act: |_| UiAction::App(AppAct::Save(SaveKind::Picture(None))),
    },
    CommandRow {
        label: "Export labels as CSV…",
        title: None,
        tooltip: "Every annotator's labels, a row a frame and annotator; in agreement mode only your own.",
        menu: Menu::File,
        keys: &[],
        enabled: labelled,
        act: |_| save(Export::LabelsCsv),
    },
    CommandRow {
        label: "Export labels as JSON…",
        title: None,
        tooltip: "Every annotator's labels with all that was recorded; in agreement mode only your own.",
        menu: Menu::File,
        keys: &[],
        enabled: labelled,
        act: |_| save(Export::LabelsJson),
    },
    CommandRow {
        label: "Export strata as CSV…",
        title: None,
        tooltip: "Hardness, its three parts and the stratum of every frame.",
        menu: Menu::File,
        keys: &[],
        enabled: |s| s.strata.result().is_some(),
        act: |_| save(Export::Strata),
    },
    CommandRow {
        label: "Export curves as CSV…",
        title: None,
        tooltip: "Loss, terms, IoU and MAJPE of every iteration and branch of this fit.",
        menu: Menu::File,
        keys: &[],
        enabled: fitted,
        act: |_| save(Export::Curves),
    },
    CommandRow {
        label: "Export parameters as npz…",
        title: None,
        tooltip: "The PPPR parameters on screen.",
        menu: Menu::File,
        keys: &[],
        enabled: fitted,
        act: |_| save(Export::Parameters),
    },
    CommandRow {
        label: "Export erased cells as JSON…",
        title: None,
        tooltip: "The cells that this fit does not see, as `fit --erase` takes them.",
        menu: Menu::File,
        keys: &[],
        enabled: |s| !s.fit.erased().is_empty(),
        act: |_| save(Export::Erased),
    },
    CommandRow {
        label: "Export Gaussians as PLY…",
        title: None,
        tooltip: "The Gaussians on screen, in the layout of 3-D Gaussian splatting.",
        menu: Menu::File,
        keys: &[],
        enabled: fitted,
        act: |_| save(Export::Gaussians),
    },
    CommandRow {
        label: "Copy picture",
        title: None,
        tooltip: "Put the picture of the window on the clipboard.",
        menu: Menu::Edit,
        keys: &[(CTRL, Key::C)],
        enabled: always,
        act: |_| UiAction::App(AppAct::CopyPicture(None)),
    },
    CommandRow {
        label: "Copy path of the frame",
        title: None,
        tooltip: "Put the path of the frame's file on the clipboard.",
        menu: Menu::Edit,
        keys: &[(CTRL_SHIFT, Key::C)],
        enabled: has_frame,
        act: |_| UiAction::App(AppAct::CopyPath),
    },
    CommandRow {
        label: "Pin this fit",
        title: None,
        tooltip: "Keep the frame, iteration and settings on screen to compare other fits with.",
        menu: Menu::Fit,
        keys: &[(NONE, Key::P)],
        enabled: fitted,
        act: |_| UiAction::Session(Command::PinFit),
    },
    CommandRow {
        label: "Compare with the baseline",
        title: None,
        tooltip: "Flip, wipe and difference show H_sim against the baseline's H_sim; again for H_ori.",
        menu: Menu::View,
        keys: &[(NONE, Key::B)],
        enabled: |s| s.pins.baseline().is_some(),
        act: |s| view(s, |v| v.against = if v.against == Against::Ori { Against::Baseline } else { Against::Ori }),
    },
    CommandRow {
        label: "Figure captions",
        title: None,
        tooltip: "Print units, τ, iteration, seed and version small under every picture, for figures.",
        menu: Menu::View,
        keys: &[(SHIFT, Key::F)],
        enabled: always,
        act: |s| view(s, |v| v.figure = !v.figure),
    },
    CommandRow {
        label: "Select this frame",
        title: None,
        tooltip: "Add the frame on screen to those that tags go to, or take it out.",
        menu: Menu::Edit,
        keys: &[(NONE, Key::X)],
        enabled: has_frame,
        act: |s| {
            let mut frames = s.labels.selection.clone();
            if !frames.remove(&s.data.frame_index) {
                frames.insert(s.data.frame_index);
            }
            UiAction::Session(Command::SelectFrames(frames))
        },
    },
];
