//! The one table of user commands: label, tooltip, shortcut, when enabled, what it does. Menus, palette, help sheet and
//! keys all read it; a test holds that no two commands share a key.

use crate::session::{Command, Compare, PickKind, Session, ThemeChoice, ViewState};
use egui::{Key, Modifiers};

/// The menu that a command is in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Menu {
    /// Opening and leaving.
    File,
    /// Frames.
    Frame,
    /// The optimiser.
    Fit,
    /// How things are shown.
    View,
    /// Help.
    Help,
}

impl Menu {
    /// In the order of the menu bar.
    pub(crate) const ALL: [Self; 5] = [Self::File, Self::Frame, Self::Fit, Self::View, Self::Help];

    /// The title on the bar.
    pub(crate) fn title(self) -> &'static str {
        match self {
            Self::File => "File",
            Self::Frame => "Frame",
            Self::Fit => "Fit",
            Self::View => "View",
            Self::Help => "Help",
        }
    }
}

/// What only the window can do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum AppAct {
    /// Close the window.
    Quit,
    /// Show or hide the palette.
    Palette,
    /// Show or hide the help sheet.
    Help,
    /// Show or hide what this program is.
    About,
    /// Type the number of a frame.
    GotoFrame,
    /// Type the path of a data set.
    OpenPath,
    /// The panes as they were at first.
    ResetLayout,
    /// Zoom of maps and curves and the camera as they were at first.
    ResetViews,
    /// Zoom the maps to the person and the camera to the selection.
    Focus,
    /// Look from the radar.
    CameraRadar,
    /// Look from above.
    CameraTop,
    /// Look from the side.
    CameraSide,
    /// Larger interface.
    ZoomIn,
    /// Smaller interface.
    ZoomOut,
    /// Interface at its normal size.
    ZoomReset,
    /// Fill the screen.
    FullScreen,
}

/// What a command does.
#[derive(Debug)]
pub(crate) enum Act {
    /// Change the session.
    Session(Command),
    /// Change the window.
    App(AppAct),
}

/// A key with its modifiers.
pub(crate) type Shortcut = (Modifiers, Key);

/// One command.
pub(crate) struct UserCommand {
    /// Sentence case, unique.
    pub(crate) label: &'static str,
    /// One sentence: what it does.
    pub(crate) tooltip: &'static str,
    /// Its menu.
    pub(crate) menu: Menu,
    /// Its keys; the first is shown.
    pub(crate) keys: &'static [Shortcut],
    /// Whether it would do something now.
    pub(crate) enabled: fn(&Session) -> bool,
    /// What it does.
    pub(crate) act: fn(&Session) -> Act,
}

const NONE: Modifiers = Modifiers::NONE;
const SHIFT: Modifiers = Modifiers::SHIFT;
const CTRL: Modifiers = Modifiers::COMMAND;
const CTRL_SHIFT: Modifiers = Modifiers::COMMAND.plus(Modifiers::SHIFT);

fn always(_: &Session) -> bool {
    true
}

fn has_frames(s: &Session) -> bool {
    s.data.len() > 1
}

fn ready(s: &Session) -> bool {
    s.fit.is_ready()
}

fn has_frame(s: &Session) -> bool {
    s.data.frame.is_some()
}

fn not_first(s: &Session) -> bool {
    s.data.frame_index > 0
}

fn not_last(s: &Session) -> bool {
    s.data.frame_index + 1 < s.data.len()
}

fn view(s: &Session, change: impl FnOnce(&mut ViewState)) -> Act {
    let mut view = s.view.clone();
    change(&mut view);
    Act::Session(Command::SetView(Box::new(view)))
}

fn compare(s: &Session, mode: Compare) -> Act {
    view(s, |v| v.compare = if v.compare == mode { Compare::Flip } else { mode })
}

/// Every command, in the order of its menu.
pub(crate) const COMMANDS: &[UserCommand] = &[
    UserCommand {
        label: "Open folder…",
        tooltip: "Open a data set: an MMVR tree or any folder inside one, or a folder with dataset.toml.",
        menu: Menu::File,
        keys: &[(CTRL, Key::O)],
        enabled: always,
        act: |_| Act::Session(Command::Pick(PickKind::Folder)),
    },
    UserCommand {
        label: "Open file…",
        tooltip: "Open one *_radar.npz, a dataset.toml, or a bare .npy or .npz of maps.",
        menu: Menu::File,
        keys: &[(CTRL_SHIFT, Key::O)],
        enabled: always,
        act: |_| Act::Session(Command::Pick(PickKind::File)),
    },
    UserCommand {
        label: "Open path…",
        tooltip: "Type or paste the path of a data set; needs no file dialog.",
        menu: Menu::File,
        keys: &[(CTRL, Key::L)],
        enabled: always,
        act: |_| Act::App(AppAct::OpenPath),
    },
    UserCommand {
        label: "Quit",
        tooltip: "Close the window. A fit that runs is stopped after its step.",
        menu: Menu::File,
        keys: &[(CTRL, Key::Q)],
        enabled: always,
        act: |_| Act::App(AppAct::Quit),
    },
    UserCommand {
        label: "Play frames",
        tooltip: "Show one frame after the other at the data set's rate; again to stop.",
        menu: Menu::Frame,
        keys: &[(NONE, Key::Space)],
        enabled: has_frames,
        act: |_| Act::Session(Command::TogglePlay),
    },
    UserCommand {
        label: "Next frame",
        tooltip: "One frame forward.",
        menu: Menu::Frame,
        keys: &[(NONE, Key::ArrowRight)],
        enabled: not_last,
        act: |_| Act::Session(Command::StepFrames(1)),
    },
    UserCommand {
        label: "Previous frame",
        tooltip: "One frame back.",
        menu: Menu::Frame,
        keys: &[(NONE, Key::ArrowLeft)],
        enabled: not_first,
        act: |_| Act::Session(Command::StepFrames(-1)),
    },
    UserCommand {
        label: "Ten frames forward",
        tooltip: "Ten frames forward, at most to the last.",
        menu: Menu::Frame,
        keys: &[(SHIFT, Key::ArrowRight)],
        enabled: not_last,
        act: |_| Act::Session(Command::StepFrames(10)),
    },
    UserCommand {
        label: "Ten frames back",
        tooltip: "Ten frames back, at most to the first.",
        menu: Menu::Frame,
        keys: &[(SHIFT, Key::ArrowLeft)],
        enabled: not_first,
        act: |_| Act::Session(Command::StepFrames(-10)),
    },
    UserCommand {
        label: "Hundred frames forward",
        tooltip: "A hundred frames forward, at most to the last.",
        menu: Menu::Frame,
        keys: &[(NONE, Key::PageDown)],
        enabled: not_last,
        act: |_| Act::Session(Command::StepFrames(100)),
    },
    UserCommand {
        label: "Hundred frames back",
        tooltip: "A hundred frames back, at most to the first.",
        menu: Menu::Frame,
        keys: &[(NONE, Key::PageUp)],
        enabled: not_first,
        act: |_| Act::Session(Command::StepFrames(-100)),
    },
    UserCommand {
        label: "First frame",
        tooltip: "The first frame of the data set.",
        menu: Menu::Frame,
        keys: &[(NONE, Key::Home)],
        enabled: not_first,
        act: |_| Act::Session(Command::GotoFrame(0)),
    },
    UserCommand {
        label: "Last frame",
        tooltip: "The last frame of the data set.",
        menu: Menu::Frame,
        keys: &[(NONE, Key::End)],
        enabled: not_last,
        act: |s| Act::Session(Command::GotoFrame(s.data.len().saturating_sub(1))),
    },
    UserCommand {
        label: "Go to frame…",
        tooltip: "Type a frame's number.",
        menu: Menu::Frame,
        keys: &[(CTRL, Key::J)],
        enabled: has_frames,
        act: |_| Act::App(AppAct::GotoFrame),
    },
    UserCommand {
        label: "Run or pause",
        tooltip: "Run the asked number of iterations in the background, or pause the run after its step.",
        menu: Menu::Fit,
        keys: &[(NONE, Key::Enter)],
        enabled: ready,
        act: |_| Act::Session(Command::ToggleRun),
    },
    UserCommand {
        label: "One step",
        tooltip: "One iteration forward: in the history while an earlier one is shown, else one Adam step.",
        menu: Menu::Fit,
        keys: &[(NONE, Key::Period)],
        enabled: ready,
        act: |_| Act::Session(Command::StepFit(1)),
    },
    UserCommand {
        label: "Ten steps",
        tooltip: "Ten iterations forward: in the history while an earlier one is shown, else ten Adam steps.",
        menu: Menu::Fit,
        keys: &[(SHIFT, Key::Period)],
        enabled: ready,
        act: |_| Act::Session(Command::StepFit(10)),
    },
    UserCommand {
        label: "One step back",
        tooltip: "Show the iteration before. Changing a setting there starts a branch and keeps this one.",
        menu: Menu::Fit,
        keys: &[(NONE, Key::Comma)],
        enabled: |s| s.fit.is_ready() && s.fit.shown_iteration() > 0,
        act: |_| Act::Session(Command::StepBack(1)),
    },
    UserCommand {
        label: "Ten steps back",
        tooltip: "Show the tenth iteration before.",
        menu: Menu::Fit,
        keys: &[(SHIFT, Key::Comma)],
        enabled: |s| s.fit.is_ready() && s.fit.shown_iteration() > 0,
        act: |_| Act::Session(Command::StepBack(10)),
    },
    UserCommand {
        label: "Follow newest iteration",
        tooltip: "Leave the earlier iteration that is shown and follow the run again.",
        menu: Menu::Fit,
        keys: &[(NONE, Key::L)],
        enabled: |s| s.fit.cursor.is_some(),
        act: |_| Act::Session(Command::FollowLive),
    },
    UserCommand {
        label: "Reset fit",
        tooltip: "Forget every iteration of this frame and find a new start pose with the current settings.",
        menu: Menu::Fit,
        keys: &[(CTRL, Key::R)],
        enabled: has_frame,
        act: |_| Act::Session(Command::Reset),
    },
    UserCommand {
        label: "Discard run",
        tooltip: "Remove this branch and go back to where it began; on the first branch, back to the start pose.",
        menu: Menu::Fit,
        keys: &[(CTRL, Key::Backspace)],
        enabled: |s| s.fit.is_ready() && (s.fit.head() > 0),
        act: |_| Act::Session(Command::Discard),
    },
    UserCommand {
        label: "Warm start",
        tooltip: "Start the next frame from this frame's result instead of from its own peaks.",
        menu: Menu::Fit,
        keys: &[],
        enabled: always,
        act: |s| Act::Session(Command::SetWarmStart(!s.warm_start)),
    },
    UserCommand {
        label: "Difference H_sim − H_ori",
        tooltip: "Show the difference in the H_sim pane, colours diverging about zero; again for H_sim.",
        menu: Menu::View,
        keys: &[(NONE, Key::D)],
        enabled: always,
        act: |s| compare(s, Compare::Difference),
    },
    UserCommand {
        label: "Wipe H_ori | H_sim",
        tooltip: "H_ori left of a line that can be dragged, H_sim right of it; again for H_sim.",
        menu: Menu::View,
        keys: &[(NONE, Key::W)],
        enabled: always,
        act: |s| compare(s, Compare::Wipe),
    },
    UserCommand {
        label: "Auto-contrast",
        tooltip: "Set the colour limits to the 2nd and 99.8th percentile again.",
        menu: Menu::View,
        keys: &[(NONE, Key::C)],
        enabled: always,
        act: |s| view(s, |v| v.range = crate::session::ColorRange::default()),
    },
    UserCommand {
        label: "Focus the person",
        tooltip: "Zoom the maps to the region that is fitted and the camera to the selected joint or the person.",
        menu: Menu::View,
        keys: &[(NONE, Key::F)],
        enabled: has_frame,
        act: |_| Act::App(AppAct::Focus),
    },
    UserCommand {
        label: "Reset view",
        tooltip: "Whole maps, whole curves, and the camera as at first.",
        menu: Menu::View,
        keys: &[(NONE, Key::R)],
        enabled: always,
        act: |_| Act::App(AppAct::ResetViews),
    },
    UserCommand {
        label: "View from the radar",
        tooltip: "Put the camera at the radar, looking along its boresight.",
        menu: Menu::View,
        keys: &[(NONE, Key::V)],
        enabled: always,
        act: |_| Act::App(AppAct::CameraRadar),
    },
    UserCommand {
        label: "View from above",
        tooltip: "Put the camera above the scene.",
        menu: Menu::View,
        keys: &[(NONE, Key::T)],
        enabled: always,
        act: |_| Act::App(AppAct::CameraTop),
    },
    UserCommand {
        label: "View from the side",
        tooltip: "Put the camera to the right of the scene.",
        menu: Menu::View,
        keys: &[(NONE, Key::S)],
        enabled: always,
        act: |_| Act::App(AppAct::CameraSide),
    },
    UserCommand {
        label: "Clear selection",
        tooltip: "Select no joint.",
        menu: Menu::View,
        keys: &[(NONE, Key::Escape)],
        enabled: |s| s.joint.is_some(),
        act: |_| Act::Session(Command::SelectJoint(None)),
    },
    UserCommand {
        label: "Light or dark",
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
        tooltip: "Scale everything up.",
        menu: Menu::View,
        keys: &[(CTRL, Key::Plus), (CTRL, Key::Equals)],
        enabled: |s| s.view.zoom < 2.0,
        act: |_| Act::App(AppAct::ZoomIn),
    },
    UserCommand {
        label: "Smaller interface",
        tooltip: "Scale everything down.",
        menu: Menu::View,
        keys: &[(CTRL, Key::Minus)],
        enabled: |s| s.view.zoom > 0.7,
        act: |_| Act::App(AppAct::ZoomOut),
    },
    UserCommand {
        label: "Normal size",
        tooltip: "Scale of 100 %.",
        menu: Menu::View,
        keys: &[(CTRL, Key::Num0)],
        enabled: always,
        act: |_| Act::App(AppAct::ZoomReset),
    },
    UserCommand {
        label: "Full screen",
        tooltip: "Fill the screen; again to leave.",
        menu: Menu::View,
        keys: &[(NONE, Key::F11)],
        enabled: always,
        act: |_| Act::App(AppAct::FullScreen),
    },
    UserCommand {
        label: "Reset layout",
        tooltip: "Put every pane back where it was at first.",
        menu: Menu::View,
        keys: &[],
        enabled: always,
        act: |_| Act::App(AppAct::ResetLayout),
    },
    UserCommand {
        label: "Command palette…",
        tooltip: "Find and do any command by typing.",
        menu: Menu::Help,
        keys: &[(CTRL, Key::K), (CTRL, Key::P)],
        enabled: always,
        act: |_| Act::App(AppAct::Palette),
    },
    UserCommand {
        label: "Keys and gestures",
        tooltip: "Every shortcut on one sheet.",
        menu: Menu::Help,
        keys: &[(SHIFT, Key::Questionmark), (NONE, Key::Questionmark), (SHIFT, Key::Slash), (NONE, Key::F1)],
        enabled: always,
        act: |_| Act::App(AppAct::Help),
    },
    UserCommand {
        label: "About",
        tooltip: "What this program is, its version and its licences.",
        menu: Menu::Help,
        keys: &[],
        enabled: always,
        act: |_| Act::App(AppAct::About),
    },
];

/// The command called `label`.
pub(crate) fn command(label: &str) -> Option<&'static UserCommand> {
    COMMANDS.iter().find(|command| command.label == label)
}

/// A shortcut as it is printed: `Ctrl+Shift+O`.
pub(crate) fn shortcut_text((modifiers, key): Shortcut) -> String {
    let key_text = match key {
        Key::ArrowLeft => "←",
        Key::ArrowRight => "→",
        Key::Period => ".",
        Key::Comma => ",",
        Key::Plus => "+",
        Key::Minus => "−",
        Key::Questionmark => return "?".into(),
        Key::Escape => "Esc",
        Key::PageUp => "Page up",
        Key::PageDown => "Page down",
        Key::Num0 => "0",
        other => other.name(),
    };
    let mut text = String::new();
    if modifiers.command {
        text.push_str(if cfg!(target_os = "macos") { "⌘" } else { "Ctrl+" });
    }
    if modifiers.shift {
        text.push_str("Shift+");
    }
    text + key_text
}

/// Tooltip with the shortcut at its end.
pub(crate) fn tooltip(command: &UserCommand) -> String {
    command.keys.first().map_or_else(
        || command.tooltip.to_owned(),
        |&keys| format!("{}\nKey: {}", command.tooltip, shortcut_text(keys)),
    )
}

/// The commands whose keys were pressed in this pass; their key events are taken out of the input.
///
/// While text is being typed nothing is taken except function keys and combinations with Ctrl that text fields do not use.
pub(crate) fn pressed(ctx: &egui::Context) -> Vec<&'static UserCommand> {
    let focused = ctx.memory(egui::Memory::focused);
    let typing = focused.is_some_and(|id| egui::text_edit::TextEditState::load(ctx, id).is_some());
    let popup = egui::Popup::is_any_open(ctx);
    let mut found = Vec::new();
    ctx.input_mut(|input| {
        input.events.retain(|event| {
            let egui::Event::Key { key, pressed: true, modifiers, .. } = event else { return true };
            let held = (modifiers.command || modifiers.ctrl, modifiers.shift);
            if modifiers.alt {
                return true;
            }
            if typing && !(held.0 && matches!(key, Key::K | Key::P | Key::Q | Key::O | Key::T) || *key == Key::F1) {
                return true;
            }
            // An open menu keeps the keys that close it and move in it.
            if popup && !held.0 {
                return true;
            }
            // A widget that has the keyboard keeps its own keys.
            if focused.is_some() && !held.0 && matches!(key, Key::Space | Key::Enter | Key::Escape | Key::Tab) {
                return true;
            }
            let hit = COMMANDS
                .iter()
                .find(|command| command.keys.iter().any(|(m, k)| k == key && (m.command, m.shift) == held));
            found.extend(hit);
            hit.is_none()
        });
    });
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn no_two_commands_share_a_key_or_a_label() {
        let mut keys = HashSet::new();
        let mut labels = HashSet::new();
        for command in COMMANDS {
            assert!(labels.insert(command.label), "two commands are called {}", command.label);
            assert!(!command.tooltip.is_empty(), "{} has no tooltip", command.label);
            for &(m, k) in command.keys {
                assert!(keys.insert((m.command, m.shift, k)), "{} clashes on {}", command.label, shortcut_text((m, k)));
            }
        }
        assert!(COMMANDS.len() > 30);
    }
}
