//! The commands about data, frames, fits and views.

use super::{Act, AppAct, Menu, UserCommand};
use crate::session::{Command, Compare, PickKind, Session, ThemeChoice, ViewState};
use egui::{Key, Modifiers};

pub(super) const NONE: Modifiers = Modifiers::NONE;
pub(super) const SHIFT: Modifiers = Modifiers::SHIFT;
pub(super) const CTRL: Modifiers = Modifiers::COMMAND;
pub(super) const CTRL_SHIFT: Modifiers = Modifiers::COMMAND.plus(Modifiers::SHIFT);

pub(super) fn always(_: &Session) -> bool {
    true
}

pub(super) fn has_frames(s: &Session) -> bool {
    s.data.len() > 1
}

pub(super) fn ready(s: &Session) -> bool {
    s.fit.is_ready()
}

pub(super) fn has_frame(s: &Session) -> bool {
    s.data.frame.is_some()
}

pub(super) fn not_first(s: &Session) -> bool {
    s.data.frame_index > 0
}

pub(super) fn not_last(s: &Session) -> bool {
    s.data.frame_index + 1 < s.data.len()
}

pub(super) fn view(s: &Session, change: impl FnOnce(&mut ViewState)) -> Act {
    let mut view = s.view.clone();
    change(&mut view);
    Act::Session(Command::SetView(Box::new(view)))
}

pub(super) fn compare(s: &Session, mode: Compare) -> Act {
    view(s, |v| v.compare = if v.compare == mode { Compare::Flip } else { mode })
}

/// Commands about data, frames, fits and views, in the order of their menus.
pub(super) const COMMANDS: &[UserCommand] = &[
    UserCommand {
        label: "Open folder…",
        title: None,
        tooltip: "Open a data set: an MMVR tree or any folder inside one, or a folder with dataset.toml.",
        menu: Menu::File,
        keys: &[(CTRL, Key::O)],
        enabled: always,
        act: |_| Act::Session(Command::Pick(PickKind::Folder)),
    },
    UserCommand {
        label: "Open file…",
        title: None,
        tooltip: "Open one *_radar.npz, a dataset.toml, or a bare .npy or .npz of maps.",
        menu: Menu::File,
        keys: &[(CTRL_SHIFT, Key::O)],
        enabled: always,
        act: |_| Act::Session(Command::Pick(PickKind::File)),
    },
    UserCommand {
        label: "Open path…",
        title: None,
        tooltip: "Type or paste the path of a data set; needs no file dialog.",
        menu: Menu::File,
        keys: &[(CTRL, Key::L)],
        enabled: always,
        act: |_| Act::App(AppAct::OpenPath),
    },
    UserCommand {
        label: "Quit",
        title: None,
        tooltip: "Close the window. A fit that runs is stopped after its step.",
        menu: Menu::File,
        keys: &[(CTRL, Key::Q)],
        enabled: always,
        act: |_| Act::App(AppAct::Quit),
    },
    UserCommand {
        label: "Play frames",
        title: None,
        tooltip: "Show one frame after the other at the data set's rate; again to stop.",
        menu: Menu::Frame,
        keys: &[(NONE, Key::Space)],
        enabled: has_frames,
        act: |_| Act::Session(Command::TogglePlay),
    },
    UserCommand {
        label: "Next frame",
        title: None,
        tooltip: "One frame forward.",
        menu: Menu::Frame,
        keys: &[(NONE, Key::ArrowRight)],
        enabled: not_last,
        act: |_| Act::Session(Command::StepFrames(1)),
    },
    UserCommand {
        label: "Previous frame",
        title: None,
        tooltip: "One frame back.",
        menu: Menu::Frame,
        keys: &[(NONE, Key::ArrowLeft)],
        enabled: not_first,
        act: |_| Act::Session(Command::StepFrames(-1)),
    },
    UserCommand {
        label: "Ten frames forward",
        title: None,
        tooltip: "Ten frames forward, at most to the last.",
        menu: Menu::Frame,
        keys: &[(SHIFT, Key::ArrowRight)],
        enabled: not_last,
        act: |_| Act::Session(Command::StepFrames(10)),
    },
    UserCommand {
        label: "Ten frames back",
        title: None,
        tooltip: "Ten frames back, at most to the first.",
        menu: Menu::Frame,
        keys: &[(SHIFT, Key::ArrowLeft)],
        enabled: not_first,
        act: |_| Act::Session(Command::StepFrames(-10)),
    },
    UserCommand {
        label: "Hundred frames forward",
        title: None,
        tooltip: "A hundred frames forward, at most to the last.",
        menu: Menu::Frame,
        keys: &[(NONE, Key::PageDown)],
        enabled: not_last,
        act: |_| Act::Session(Command::StepFrames(100)),
    },
    UserCommand {
        label: "Hundred frames back",
        title: None,
        tooltip: "A hundred frames back, at most to the first.",
        menu: Menu::Frame,
        keys: &[(NONE, Key::PageUp)],
        enabled: not_first,
        act: |_| Act::Session(Command::StepFrames(-100)),
    },
    UserCommand {
        label: "First frame",
        title: None,
        tooltip: "The first frame of the data set.",
        menu: Menu::Frame,
        keys: &[(NONE, Key::Home)],
        enabled: not_first,
        act: |_| Act::Session(Command::GotoFrame(0)),
    },
    UserCommand {
        label: "Last frame",
        title: None,
        tooltip: "The last frame of the data set.",
        menu: Menu::Frame,
        keys: &[(NONE, Key::End)],
        enabled: not_last,
        act: |s| Act::Session(Command::GotoFrame(s.data.len().saturating_sub(1))),
    },
    UserCommand {
        label: "Go to frame…",
        title: None,
        tooltip: "Type a frame's number.",
        menu: Menu::Frame,
        keys: &[(CTRL, Key::J)],
        enabled: has_frames,
        act: |_| Act::App(AppAct::GotoFrame),
    },
    UserCommand {
        label: "Run or pause",
        title: None,
        tooltip: "Run the asked number of iterations in the background, or pause the run after its step.",
        menu: Menu::Fit,
        keys: &[(NONE, Key::Enter)],
        enabled: ready,
        act: |_| Act::Session(Command::ToggleRun),
    },
    UserCommand {
        label: "One step",
        title: None,
        tooltip: "One iteration forward: in the history while an earlier one is shown, else one Adam step.",
        menu: Menu::Fit,
        keys: &[(NONE, Key::Period)],
        enabled: ready,
        act: |_| Act::Session(Command::StepFit(1)),
    },
    UserCommand {
        label: "Ten steps",
        title: None,
        tooltip: "Ten iterations forward: in the history while an earlier one is shown, else ten Adam steps.",
        menu: Menu::Fit,
        keys: &[(SHIFT, Key::Period)],
        enabled: ready,
        act: |_| Act::Session(Command::StepFit(10)),
    },
    UserCommand {
        label: "One step back",
        title: None,
        tooltip: "Show the iteration before. Changing a setting there starts a branch and keeps this one.",
        menu: Menu::Fit,
        keys: &[(NONE, Key::Comma)],
        enabled: |s| s.fit.is_ready() && s.fit.shown_iteration() > 0,
        act: |_| Act::Session(Command::StepBack(1)),
    },
    UserCommand {
        label: "Ten steps back",
        title: None,
        tooltip: "Show the tenth iteration before.",
        menu: Menu::Fit,
        keys: &[(SHIFT, Key::Comma)],
        enabled: |s| s.fit.is_ready() && s.fit.shown_iteration() > 0,
        act: |_| Act::Session(Command::StepBack(10)),
    },
    UserCommand {
        label: "Follow newest iteration",
        title: None,
        tooltip: "Leave the earlier iteration that is shown and follow the run again.",
        menu: Menu::Fit,
        keys: &[(NONE, Key::L)],
        enabled: |s| s.fit.cursor.is_some(),
        act: |_| Act::Session(Command::FollowLive),
    },
    UserCommand {
        label: "Reset fit",
        title: None,
        tooltip: "Forget every iteration of this frame and find a new start pose with the current settings.",
        menu: Menu::Fit,
        keys: &[(CTRL, Key::R)],
        enabled: has_frame,
        act: |_| Act::Session(Command::Reset),
    },
    UserCommand {
        label: "Discard run",
        title: None,
        tooltip: "Remove this branch and go back to where it began; on the first branch, back to the start pose.",
        menu: Menu::Fit,
        keys: &[(CTRL, Key::Backspace)],
        enabled: |s| s.fit.is_ready() && (s.fit.head() > 0),
        act: |_| Act::Session(Command::Discard),
    },
    UserCommand {
        label: "Warm start",
        title: None,
        tooltip: "Start the next frame from this frame's result instead of from its own peaks.",
        menu: Menu::Fit,
        keys: &[],
        enabled: always,
        act: |s| Act::Session(Command::SetWarmStart(!s.warm_start)),
    },
    UserCommand {
        label: "Difference H_sim − H_ori",
        title: None,
        tooltip: "Show the difference in the H_sim pane, colours diverging about zero; again for H_sim.",
        menu: Menu::View,
        keys: &[(NONE, Key::D)],
        enabled: always,
        act: |s| compare(s, Compare::Difference),
    },
    UserCommand {
        label: "Wipe H_ori | H_sim",
        title: None,
        tooltip: "H_ori left of a line that can be dragged, H_sim right of it; again for H_sim.",
        menu: Menu::View,
        keys: &[(NONE, Key::W)],
        enabled: always,
        act: |s| compare(s, Compare::Wipe),
    },
    UserCommand {
        label: "Auto-contrast",
        title: None,
        tooltip: "Set the colour limits to the 2nd and 99.8th percentile again.",
        menu: Menu::View,
        keys: &[(NONE, Key::C)],
        enabled: always,
        act: |s| view(s, |v| v.range = crate::session::ColorRange::default()),
    },
    UserCommand {
        label: "Focus the person",
        title: None,
        tooltip: "Zoom the maps to the region that is fitted and the camera to the selected joint or the person.",
        menu: Menu::View,
        keys: &[(NONE, Key::F)],
        enabled: has_frame,
        act: |_| Act::App(AppAct::Focus),
    },
    UserCommand {
        label: "Reset view",
        title: None,
        tooltip: "Whole maps, whole curves, and the camera as at first.",
        menu: Menu::View,
        keys: &[(NONE, Key::R)],
        enabled: always,
        act: |_| Act::App(AppAct::ResetViews),
    },
    UserCommand {
        label: "View from the radar",
        title: None,
        tooltip: "Put the camera at the radar, looking along its boresight.",
        menu: Menu::View,
        keys: &[(NONE, Key::V)],
        enabled: always,
        act: |_| Act::App(AppAct::CameraRadar),
    },
    UserCommand {
        label: "View from above",
        title: None,
        tooltip: "Put the camera above the scene.",
        menu: Menu::View,
        keys: &[(NONE, Key::T)],
        enabled: always,
        act: |_| Act::App(AppAct::CameraTop),
    },
    UserCommand {
        label: "View from the side",
        title: None,
        tooltip: "Put the camera to the right of the scene.",
        menu: Menu::View,
        keys: &[(NONE, Key::S)],
        enabled: always,
        act: |_| Act::App(AppAct::CameraSide),
    },
    UserCommand {
        label: "Clear selection",
        title: None,
        tooltip: "Select no frame for tagging any more; again to select no joint.",
        menu: Menu::View,
        keys: &[(NONE, Key::Escape)],
        enabled: |s| s.joint.is_some() || !s.labels.selection.is_empty(),
        act: |s| {
            Act::Session(if s.labels.selection.is_empty() {
                Command::SelectJoint(None)
            } else {
                Command::SelectFrames(std::collections::BTreeSet::new())
            })
        },
    },
    UserCommand {
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
    UserCommand {
        label: "Larger interface",
        title: None,
        tooltip: "Scale everything up.",
        menu: Menu::View,
        keys: &[(CTRL, Key::Plus), (CTRL, Key::Equals)],
        enabled: |s| s.view.zoom < 2.0,
        act: |_| Act::App(AppAct::ZoomIn),
    },
    UserCommand {
        label: "Smaller interface",
        title: None,
        tooltip: "Scale everything down.",
        menu: Menu::View,
        keys: &[(CTRL, Key::Minus)],
        enabled: |s| s.view.zoom > 0.7,
        act: |_| Act::App(AppAct::ZoomOut),
    },
    UserCommand {
        label: "Normal size",
        title: None,
        tooltip: "Scale of 100 %.",
        menu: Menu::View,
        keys: &[(CTRL, Key::Num0)],
        enabled: always,
        act: |_| Act::App(AppAct::ZoomReset),
    },
    UserCommand {
        label: "Full screen",
        title: None,
        tooltip: "Fill the screen; again to leave.",
        menu: Menu::View,
        keys: &[(NONE, Key::F11)],
        enabled: always,
        act: |_| Act::App(AppAct::FullScreen),
    },
    UserCommand {
        label: "Reset layout",
        title: None,
        tooltip: "Put every pane back where it was at first.",
        menu: Menu::View,
        keys: &[],
        enabled: always,
        act: |_| Act::App(AppAct::ResetLayout),
    },
    UserCommand {
        label: "Command palette…",
        title: None,
        tooltip: "Find and do any command by typing.",
        menu: Menu::Help,
        keys: &[(CTRL, Key::K), (CTRL, Key::P)],
        enabled: always,
        act: |_| Act::App(AppAct::Palette),
    },
    UserCommand {
        label: "Keys and gestures",
        title: None,
        tooltip: "Every shortcut on one sheet.",
        menu: Menu::Help,
        keys: &[(SHIFT, Key::Questionmark), (NONE, Key::Questionmark), (SHIFT, Key::Slash), (NONE, Key::F1)],
        enabled: always,
        act: |_| Act::App(AppAct::Help),
    },
    UserCommand {
        label: "About",
        title: None,
        tooltip: "What this program is, its version and its licences.",
        menu: Menu::Help,
        keys: &[],
        enabled: always,
        act: |_| Act::App(AppAct::About),
    },
];
