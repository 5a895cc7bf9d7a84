//! The commands about data, frames, fits and views.

use super::{AppAct, CommandRow, Menu, UiAction};
use crate::app::panes::{maps, scene, study};
use crate::session::{Command, Compare, Live, PickKind, Session, ThemeChoice, ViewState};
use egui::{Key, Modifiers};

pub(crate) const NONE: Modifiers = Modifiers::NONE;
pub(crate) const SHIFT: Modifiers = Modifiers::SHIFT;
pub(crate) const CTRL: Modifiers = Modifiers::COMMAND;
pub(super) const ALT: Modifiers = Modifiers::ALT;
pub(crate) const CTRL_SHIFT: Modifiers = Modifiers::COMMAND.plus(Modifiers::SHIFT);

pub(crate) fn always(_: &Session) -> bool {
    true
}

pub(super) fn has_frames(s: &Session) -> bool {
    s.data.len() > 1
}

pub(super) fn ready(s: &Session) -> bool {
    s.fit.is_ready()
}

pub(crate) fn has_frame(s: &Session) -> bool {
    s.data.frame.is_some()
}

pub(super) fn not_first(s: &Session) -> bool {
    s.data.frame_index > 0
}

pub(super) fn not_last(s: &Session) -> bool {
    s.data.frame_index + 1 < s.data.len()
}

pub(super) fn view(s: &Session, change: impl FnOnce(&mut ViewState)) -> UiAction {
    let mut view = s.view.clone();
    change(&mut view);
    UiAction::Session(Command::SetView(Box::new(view)))
}

pub(super) fn compare(s: &Session, mode: Compare) -> UiAction {
    view(s, |v| v.compare = if v.compare == mode { Compare::Flip } else { mode })
}

/// Commands about data, frames, fits and views, in the order of their menus.
pub(super) const COMMANDS: &[CommandRow] = &[
    CommandRow {
        label: "Open folder…",
        title: None,
        tooltip: "Open a data set: an MMVR tree or any folder inside one, or a folder with dataset.toml.",
        menu: Menu::File,
        keys: &[(CTRL, Key::O)],
        enabled: always,
        act: |_| UiAction::Session(Command::Pick(PickKind::Folder)),
    },
    CommandRow {
        label: "Open file…",
        title: None,
        tooltip: "Open one *_radar.npz, a dataset.toml, a capture (.bin, .pcap), or a bare .npy or .npz of maps.",
        menu: Menu::File,
        keys: &[(CTRL_SHIFT, Key::O)],
        enabled: always,
        act: |_| UiAction::Session(Command::Pick(PickKind::File)),
    },
    CommandRow {
        label: "Open path…",
        title: None,
        tooltip: "Type or paste the path of a data set; needs no file dialog.",
        menu: Menu::File,
        keys: &[(CTRL, Key::L)],
        enabled: always,
        act: |_| UiAction::App(AppAct::OpenPath),
    },
    CommandRow {
        label: "Quit",
        title: None,
        tooltip: "Close the window; asks first while a fit runs or a file is being written.",
        menu: Menu::File,
        keys: &[(CTRL, Key::Q)],
        enabled: always,
        act: |_| UiAction::App(AppAct::Quit),
    },
    CommandRow {
        label: "Play frames",
        title: None,
        tooltip: "Show one frame after the other at the data set's rate; again to stop.",
        menu: Menu::Frame,
        keys: &[(NONE, Key::Space)],
        enabled: has_frames,
        act: |_| UiAction::Session(Command::TogglePlay),
    },
    CommandRow {
        label: "Next frame",
        title: None,
        tooltip: "One frame forward.",
        menu: Menu::Frame,
        keys: &[(NONE, Key::ArrowRight)],
        enabled: not_last,
        act: |_| UiAction::Session(Command::StepFrames(1)),
    },
    CommandRow {
        label: "Previous frame",
        title: None,
        tooltip: "One frame back.",
        menu: Menu::Frame,
        keys: &[(NONE, Key::ArrowLeft)],
        enabled: not_first,
        act: |_| UiAction::Session(Command::StepFrames(-1)),
    },
    CommandRow {
        label: "Ten frames forward",
        title: None,
        tooltip: "Ten frames forward, at most to the last.",
        menu: Menu::Frame,
        keys: &[(SHIFT, Key::ArrowRight)],
        enabled: not_last,
        act: |_| UiAction::Session(Command::StepFrames(10)),
    },
    CommandRow {
        label: "Ten frames back",
        title: None,
        tooltip: "Ten frames back, at most to the first.",
        menu: Menu::Frame,
        keys: &[(SHIFT, Key::ArrowLeft)],
        enabled: not_first,
        act: |_| UiAction::Session(Command::StepFrames(-10)),
    },
    CommandRow {
        label: "Hundred frames forward",
        title: None,
        tooltip: "A hundred frames forward, at most to the last.",
        menu: Menu::Frame,
        keys: &[(NONE, Key::PageDown)],
        enabled: not_last,
        act: |_| UiAction::Session(Command::StepFrames(100)),
    },
    CommandRow {
        label: "Hundred frames back",
        title: None,
        tooltip: "A hundred frames back, at most to the first.",
        menu: Menu::Frame,
        keys: &[(NONE, Key::PageUp)],
        enabled: not_first,
        act: |_| UiAction::Session(Command::StepFrames(-100)),
    },
    CommandRow {
        label: "First frame",
        title: None,
        tooltip: "The first frame of the data set.",
        menu: Menu::Frame,
        keys: &[(NONE, Key::Home)],
        enabled: not_first,
        act: |_| UiAction::Session(Command::GotoFrame(0)),
    },
    CommandRow {
        label: "Last frame",
        title: None,
        tooltip: "The last frame of the data set.",
        menu: Menu::Frame,
        keys: &[(NONE, Key::End)],
        enabled: not_last,
        act: |s| UiAction::Session(Command::GotoFrame(s.data.len().saturating_sub(1))),
    },
    CommandRow {
        label: "Go to frame…",
        title: None,
        tooltip: "Type a frame's number.",
        menu: Menu::Frame,
        keys: &[(CTRL, Key::J)],
        enabled: has_frames,
        act: |_| UiAction::App(AppAct::GotoFrame),
    },
    CommandRow {
        label: "Run or pause",
        title: None,
        tooltip: "Run the asked number of iterations in the background, or pause the run after its step.",
        menu: Menu::Fit,
        keys: &[(NONE, Key::Enter)],
        enabled: ready,
        act: |_| UiAction::Session(Command::ToggleRun),
    },
    CommandRow {
        label: "One step",
        title: None,
        tooltip: "One iteration forward: in the history while an earlier one is shown, else one Adam step.",
        menu: Menu::Fit,
        keys: &[(NONE, Key::Period)],
        enabled: ready,
        act: |_| UiAction::Session(Command::StepFit(1)),
    },
    CommandRow {
        label: "Ten steps",
        title: None,
        tooltip: "Ten iterations forward: in the history while an earlier one is shown, else ten Adam steps.",
        menu: Menu::Fit,
        keys: &[(SHIFT, Key::Period)],
        enabled: ready,
        act: |_| UiAction::Session(Command::StepFit(10)),
    },
    CommandRow {
        label: "One step back",
        title: None,
        tooltip: "Show the iteration before. Changing a setting there starts a branch and keeps this one.",
        menu: Menu::Fit,
        keys: &[(NONE, Key::Comma)],
        enabled: |s| s.fit.is_ready() && s.fit.shown_iteration() > 0,
        act: |_| UiAction::Session(Command::StepBack(1)),
    },
    CommandRow {
        label: "Ten steps back",
        title: None,
        tooltip: "Show the tenth iteration before.",
        menu: Menu::Fit,
        keys: &[(SHIFT, Key::Comma)],
        enabled: |s| s.fit.is_ready() && s.fit.shown_iteration() > 0,
        act: |_| UiAction::Session(Command::StepBack(10)),
    },
    CommandRow {
        label: "Follow newest iteration",
        title: None,
        tooltip: "Leave the earlier iteration that is shown and follow the run again.",
        menu: Menu::Fit,
        keys: &[(NONE, Key::L)],
        enabled: |s| s.fit.cursor.is_some(),
        act: |_| UiAction::Session(Command::FollowLive),
    },
    CommandRow {
        label: "Compare presets",
        title: None,
        tooltip: "Fit this frame with the paper's and the recommended settings, and show both side by side.",
        menu: Menu::Fit,
        keys: &[(SHIFT, Key::C)],
        enabled: has_frame,
        act: |_| UiAction::Session(Command::ComparePresets),
    },
    CommandRow {
        label: "Fit listed frames",
        title: Some(|s| match s.labels.selection.len() {
            0 => format!("Fit {} listed frames", s.queue.rows().len()),
            n => format!("Fit {n} selected frames"),
        }),
        tooltip: "Fit the selected frames, or all in the list, on all cores; the results come into the list and are kept.",
        menu: Menu::Fit,
        keys: &[(CTRL, Key::Enter)],
        enabled: |s| !s.batch.is_running() && !s.queue.rows().is_empty(),
        act: |_| UiAction::Session(Command::FitListed),
    },
    study::SWEEP,
    study::RUN_STUDY,
    CommandRow {
        label: "Pause batch",
        title: None,
        tooltip: "Let the fits of many frames wait, or go on.",
        menu: Menu::Fit,
        keys: &[],
        enabled: |s| s.batch.is_running(),
        act: |_| UiAction::Session(Command::PauseBatch),
    },
    CommandRow {
        label: "Cancel batch",
        title: None,
        tooltip: "Stop the fits of many frames; what was fitted is kept.",
        menu: Menu::Fit,
        keys: &[],
        enabled: |s| s.batch.is_running(),
        act: |_| UiAction::Session(Command::CancelBatch),
    },
    CommandRow {
        label: "Replay",
        title: None,
        tooltip: "Show the iterations of the branch on screen one after the other, at the speed of runs; again to stop.",
        menu: Menu::Fit,
        keys: &[(SHIFT, Key::Enter)],
        enabled: |s| ready(s) && !s.fit.is_running() && s.fit.branch().is_some_and(|branch| branch.rows.len() > 1),
        act: |_| UiAction::Session(Command::ToggleReplay),
    },
    CommandRow {
        label: "Live fit",
        title: None,
        tooltip: "Fit anew while a setting is dragged; or let settings count from the next step on.",
        menu: Menu::Fit,
        keys: &[(SHIFT, Key::L)],
        enabled: always,
        act: |s| {
            let live = s.is_live();
            view(s, |view| view.live = if live { Live::Off } else { Live::On })
        },
    },
    maps::ERASE_CELLS,
    CommandRow {
        label: "Reset fit",
        title: None,
        tooltip: "Forget every iteration of this frame and find a new start pose with the current settings.",
        menu: Menu::Fit,
        keys: &[(CTRL, Key::R)],
        enabled: has_frame,
        act: |_| UiAction::Session(Command::Reset),
    },
    CommandRow {
        label: "Discard run",
        title: None,
        tooltip: "Remove this branch and go back to where it began; on the first branch, back to the start pose.",
        menu: Menu::Fit,
        keys: &[(CTRL, Key::Backspace)],
        enabled: |s| s.fit.is_ready() && (s.fit.head() > 0),
        act: |_| UiAction::Session(Command::Discard),
    },
    CommandRow {
        label: "Warm start",
        title: None,
        tooltip: "Start the next frame from this frame's result instead of from its own peaks.",
        menu: Menu::Fit,
        keys: &[],
        enabled: always,
        act: |s| UiAction::Session(Command::SetWarmStart(!s.warm_start)),
    },
    CommandRow {
        label: "Start along the sequence",
        title: None,
        tooltip: "The frames around decide with each frame which body is fitted, as in runs over many frames.",
        menu: Menu::Fit,
        keys: &[],
        enabled: always,
        act: |s| UiAction::Session(Command::SetAlong(!s.along)),
    },
    CommandRow {
        label: "Difference H_sim − H_ori",
        title: None,
        tooltip: "Show the difference in the place of H_sim, colours diverging about zero; again for H_sim.",
        menu: Menu::View,
        keys: &[(NONE, Key::D)],
        enabled: always,
        act: |s| compare(s, Compare::Difference),
    },
    CommandRow {
        label: "Wipe H_ori | H_sim",
        title: None,
        tooltip: "H_ori left of a line that can be dragged, H_sim right of it; again for H_sim.",
        menu: Menu::View,
        keys: &[(NONE, Key::W)],
        enabled: always,
        act: |s| compare(s, Compare::Wipe),
    },
    CommandRow {
        label: "Auto-contrast",
        title: None,
        tooltip: "Set the colour limits of every map to the 2nd and 99.8th percentile again.",
        menu: Menu::View,
        keys: &[(NONE, Key::C)],
        enabled: always,
        act: |s| view(s, crate::session::ViewState::auto_contrast),
    },
    CommandRow {
        label: "Person or whole",
        title: None,
        tooltip: "Zoom the maps to the person and the camera to the selected joint or the person; again for all of the maps and the room.",
        menu: Menu::View,
        keys: &[(NONE, Key::F)],
        enabled: has_frame,
        act: |_| UiAction::App(AppAct::Focus),
    },
    CommandRow {
        label: "Reset view",
        title: None,
        tooltip: "Whole maps, whole curves, and the camera as at first.",
        menu: Menu::View,
        keys: &[(NONE, Key::R)],
        enabled: always,
        act: |_| UiAction::App(AppAct::ResetViews),
    },
    maps::ENLARGE,
    maps::ISOLATE,
    CommandRow {
        label: "Bird's-eye",
        title: None,
        tooltip: "Draw maps of range and angle on metres, with range rings; again for their own axes.",
        menu: Menu::View,
        keys: &[],
        enabled: always,
        act: |s| view(s, |v| v.cube.birds_eye = !v.cube.birds_eye),
    },
    CommandRow {
        label: "Polar",
        title: None,
        tooltip: "Draw maps in metres on range and angle; again for their own axes.",
        menu: Menu::View,
        keys: &[],
        enabled: always,
        act: |s| view(s, |v| v.cube.polar = !v.cube.polar),
    },
    CommandRow {
        label: "Cells round the cursor",
        title: None,
        tooltip: "Tell the nine cells round the cursor under the maps; again to tell one.",
        menu: Menu::View,
        keys: &[],
        enabled: always,
        act: |s| view(s, |v| v.neighbours = !v.neighbours),
    },
    CommandRow {
        label: "Logarithmic losses",
        title: None,
        tooltip: "Lay the losses on a logarithmic axis; again for a linear one.",
        menu: Menu::View,
        keys: &[],
        enabled: always,
        act: |s| view(s, |v| v.log_loss = !v.log_loss),
    },
    CommandRow {
        label: "Logarithmic iterations",
        title: None,
        tooltip: "Lay the iterations on a logarithmic axis; again for a linear one.",
        menu: Menu::View,
        keys: &[],
        enabled: always,
        act: |s| view(s, |v| v.log_iterations = !v.log_iterations),
    },
    scene::FROM_RADAR,
    scene::FROM_ABOVE,
    scene::FROM_SIDE,
    CommandRow {
        label: "Clear selection",
        title: None,
        tooltip: "From one map alone back to all; else select no frame for tagging any more; again to select no joint.",
        menu: Menu::View,
        keys: &[(NONE, Key::Escape)],
        enabled: has_frame,
        act: |_| UiAction::App(AppAct::Back),
    },
    CommandRow {
        label: "Light or dark",
        title: None,
        tooltip: "Switch between the light and the dark theme.",
        menu: Menu::View,
        keys: &[(CTRL, Key::T)],
        enabled: always,
        act: |s| {
            view(s, |v| {
                v.theme = if v.theme == ThemeChoice::Light { ThemeChoice::Dark } else { ThemeChoice::Light };
            })
        },
    },
    CommandRow {
        label: "Larger interface",
        title: None,
        tooltip: "Scale everything up.",
        menu: Menu::View,
        keys: &[(CTRL, Key::Plus), (CTRL, Key::Equals)],
        enabled: |s| s.view.zoom < 2.0,
        act: |_| UiAction::App(AppAct::ZoomIn),
    },
    CommandRow {
        label: "Smaller interface",
        title: None,
        tooltip: "Scale everything down.",
        menu: Menu::View,
        keys: &[(CTRL, Key::Minus)],
        enabled: |s| s.view.zoom > 0.7,
        act: |_| UiAction::App(AppAct::ZoomOut),
    },
    CommandRow {
        label: "Normal size",
        title: None,
        tooltip: "Scale of 100 %.",
        menu: Menu::View,
        keys: &[(CTRL, Key::Num0)],
        enabled: always,
        act: |_| UiAction::App(AppAct::ZoomReset),
    },
    CommandRow {
        label: "Full screen",
        title: None,
        tooltip: "Fill the screen; again to leave.",
        menu: Menu::View,
        keys: &[(NONE, Key::F11)],
        enabled: always,
        act: |_| UiAction::App(AppAct::FullScreen),
    },
    CommandRow {
        label: "Reset layout",
        title: None,
        tooltip: "Put every pane back where it was at first.",
        menu: Menu::View,
        keys: &[],
        enabled: always,
        act: |_| UiAction::App(AppAct::ResetLayout),
    },
    CommandRow {
        label: "Command palette…",
        title: None,
        tooltip: "Find and do any command by typing.",
        menu: Menu::Help,
        keys: &[(CTRL, Key::K), (CTRL, Key::P)],
        enabled: always,
        act: |_| UiAction::App(AppAct::Palette),
    },
    CommandRow {
        label: "Keys and gestures",
        title: None,
        tooltip: "Every shortcut on one sheet.",
        menu: Menu::Help,
        keys: &[(NONE, Key::Questionmark), (SHIFT, Key::Questionmark), (SHIFT, Key::Slash), (NONE, Key::F1)],
        enabled: always,
        act: |_| UiAction::App(AppAct::Help),
    },
    CommandRow {
        label: "About",
        title: None,
        tooltip: "What this program is, its version and its licences.",
        menu: Menu::Help,
        keys: &[],
        enabled: always,
        act: |_| UiAction::App(AppAct::About),
    },
];
