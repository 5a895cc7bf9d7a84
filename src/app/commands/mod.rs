//! The one table of user commands: label, tooltip, shortcut, when enabled, what it does. Menus, palette, help sheet and
//! keys all read it; a test holds that no two commands share a key. The commands that show a pane come from the list of
//! panes.

mod body;
mod labels;
mod search;
mod sharing;
mod table;

pub(crate) use search::found;
pub(crate) use table::{CTRL, CTRL_SHIFT, NONE, SHIFT, always, has_frame};

use super::panes::{Pane, PaneStates};
use crate::session::{Command, Export, Session};
use egui::{Id, Key, KeyboardShortcut, ModifierNames, Modifiers};
use std::borrow::Cow;
use std::path::PathBuf;

/// The menu that a command is in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Menu {
    /// Opening and leaving.
    File,
    /// Undo, redo, select.
    Edit,
    /// Frames.
    Frame,
    /// The optimiser.
    Fit,
    /// The body, moved by hand.
    Body,
    /// Tags and notes.
    Labels,
    /// How things are shown.
    View,
    /// Help.
    Help,
}

impl Menu {
    /// In the order of the menu bar.
    pub(crate) const ALL: [Self; 8] =
        [Self::File, Self::Edit, Self::Frame, Self::Fit, Self::Body, Self::Labels, Self::View, Self::Help];

    /// The title on the bar.
    pub(crate) fn title(self) -> &'static str {
        match self {
            Self::File => "File",
            Self::Edit => "Edit",
            Self::Frame => "Frame",
            Self::Fit => "Fit",
            Self::Body => "Body",
            Self::Labels => "Labels",
            Self::View => "View",
            Self::Help => "Help",
        }
    }
}

/// What only the window can do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum AppAct {
    /// Close the window; ask where something is under way.
    Quit,
    /// Close the window, whatever is under way.
    StopAndQuit,
    /// One step back from what was singled out.
    Back,
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
    /// Larger interface.
    ZoomIn,
    /// Smaller interface.
    ZoomOut,
    /// Interface at its normal size.
    ZoomReset,
    /// Fill the screen.
    FullScreen,
    /// Ask where to write something.
    Save(SaveKind),
    /// Write the session where it was last, or ask.
    SaveSession,
    /// Type the path of a session file.
    OpenSession,
    /// Put the picture of the window, or of one pane, on the clipboard.
    CopyPicture(Option<&'static Pane>),
    /// Bring a pane to the front.
    ShowPane(&'static Pane),
    /// Type the path of a table of results.
    LoadResults,
    /// Type the path of a run folder.
    OpenStudy,
    /// Type the path of a file of predictions.
    OpenPredictions,
    /// Put the frame's path on the clipboard.
    CopyPath,
}

/// What can be written to a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum SaveKind {
    /// What the session knows.
    Export(Export),
    /// The session file.
    Session,
    /// A picture of the window, or of one pane.
    Picture(Option<&'static Pane>),
}

/// What a command does.
pub(crate) enum UiAction {
    /// Change the session.
    Session(Command),
    /// Change the window.
    App(AppAct),
    /// Write something to a file.
    Write(SaveKind, PathBuf),
    /// Change what the panes remember.
    Panes {
        /// The pane that is brought to the front first.
        front: Option<&'static Pane>,
        /// The change.
        change: PaneChange,
    },
}

/// A change of what the panes remember.
pub(crate) type PaneChange = Box<dyn FnOnce(&mut PaneStates, &Session)>;

impl UiAction {
    /// Changes what the panes remember.
    pub(crate) fn panes(change: impl FnOnce(&mut PaneStates, &Session) + 'static) -> Self {
        Self::Panes { front: None, change: Box::new(change) }
    }

    /// Brings a pane to the front and changes what the panes remember.
    pub(crate) fn in_front(pane: &'static Pane, change: impl FnOnce(&mut PaneStates, &Session) + 'static) -> Self {
        Self::Panes { front: Some(pane), change: Box::new(change) }
    }
}

/// A key with its modifiers.
pub(crate) type Shortcut = (Modifiers, Key);

/// A row of the table.
pub(crate) struct CommandRow {
    /// Sentence case, unique.
    pub(crate) label: &'static str,
    /// What its menu says instead where that depends on the session: `Undo: tag F2 on 12 frames`.
    pub(crate) title: Option<fn(&Session) -> String>,
    /// One sentence: what it does.
    pub(crate) tooltip: &'static str,
    /// Its menu.
    pub(crate) menu: Menu,
    /// Its keys; the first is shown.
    pub(crate) keys: &'static [Shortcut],
    /// Whether it would do something now.
    pub(crate) enabled: fn(&Session) -> bool,
    /// What it does.
    pub(crate) act: fn(&Session) -> UiAction,
}

/// A command that a person can give.
#[derive(Clone, Copy)]
pub(crate) enum UserCommand {
    /// As a row of the table says.
    Row(&'static CommandRow),
    /// Bring a pane to the front.
    Show(&'static Pane),
}

impl UserCommand {
    /// Its name, unique.
    pub(crate) fn label(self) -> Cow<'static, str> {
        match self {
            Self::Row(row) => row.label.into(),
            Self::Show(pane) => format!("Show {}", pane.title()).into(),
        }
    }

    /// What a menu says.
    pub(crate) fn text(self, session: &Session) -> Cow<'static, str> {
        match self {
            Self::Row(CommandRow { title: Some(title), .. }) => title(session).into(),
            _ => self.label(),
        }
    }

    /// One sentence: what it does.
    pub(crate) fn tooltip(self) -> Cow<'static, str> {
        match self {
            Self::Row(row) => row.tooltip.into(),
            Self::Show(pane) => format!("Bring the pane {} to the front: {}.", pane.title(), pane.help()).into(),
        }
    }

    /// What it does, and its shortcut.
    pub(crate) fn tip(self) -> String {
        let keys = self.keys().first().map_or_else(String::new, |&keys| format!("\nKey: {}", shortcut_text(keys)));
        format!("{}{keys}", self.tooltip())
    }

    /// Its menu.
    pub(crate) fn menu(self) -> Menu {
        match self {
            Self::Row(row) => row.menu,
            Self::Show(_) => Menu::View,
        }
    }

    /// Its keys; the first is shown.
    pub(crate) fn keys(self) -> &'static [Shortcut] {
        match self {
            Self::Row(row) => row.keys,
            Self::Show(pane) => pane.keys(),
        }
    }

    /// Whether it would do something now.
    pub(crate) fn enabled(self, session: &Session) -> bool {
        match self {
            Self::Row(row) => (row.enabled)(session),
            Self::Show(_) => true,
        }
    }

    /// What it does.
    pub(crate) fn action(self, session: &Session) -> UiAction {
        match self {
            Self::Row(row) => (row.act)(session),
            Self::Show(pane) => UiAction::App(AppAct::ShowPane(pane)),
        }
    }
}

/// Every command; those of one menu are in its order.
pub(crate) fn all() -> impl Iterator<Item = UserCommand> {
    let rows = table::COMMANDS.iter().chain(body::COMMANDS).chain(labels::COMMANDS).chain(sharing::COMMANDS);
    rows.map(UserCommand::Row).chain(Pane::all().iter().map(|pane| UserCommand::Show(pane)))
}

/// The command called `label`.
pub(crate) fn command(label: &str) -> Option<UserCommand> {
    all().find(|command| command.label() == label)
}

/// A shortcut as it is printed: `Ctrl+Shift+O`.
pub(crate) fn shortcut_text((modifiers, key): Shortcut) -> String {
    // Words for the modifiers, signs for the keys that have one.
    const NAMES: ModifierNames<'_> = ModifierNames { is_short: true, ..ModifierNames::NAMES };
    let text = KeyboardShortcut::new(modifiers, key).format(&NAMES, cfg!(target_os = "macos"));
    // The arrows of egui are in none of the window's fonts.
    let drawn = |sign: char| match sign {
        '⏴' => '←',
        '⏵' => '→',
        '⏶' => '↑',
        '⏷' => '↓',
        other => other,
    };
    text.chars().map(drawn).collect()
}

/// The commands whose keys were pressed in this pass; their key events are taken out of the input.
///
/// While text is being typed nothing is taken except function keys and combinations with Ctrl that text fields do not use.
pub(crate) fn pressed(ctx: &egui::Context) -> Vec<UserCommand> {
    let focused = ctx.memory(egui::Memory::focused);
    let typing = focused.is_some_and(|id| egui::text_edit::TextEditState::load(ctx, id).is_some());
    let was_typing = ctx.data_mut(|data| std::mem::replace(data.get_temp_mut_or_default(Id::unique("typing")), typing));
    let popup = egui::Popup::is_any_open(ctx);
    let mut found = Vec::new();
    ctx.input_mut(|input| {
        input.events.retain(|event| {
            let egui::Event::Key { key, pressed: true, modifiers, .. } = event else { return true };
            let held = (modifiers.command || modifiers.ctrl, modifiers.shift, modifiers.alt);
            if typing
                && !(held.0 && matches!(key, Key::K | Key::P | Key::Q | Key::O | Key::T | Key::S | Key::F)
                    || *key == Key::F1)
            {
                return true;
            }
            // A field gives the keyboard up before the pass that Esc is seen in, and must still see that it was Esc.
            if was_typing && *key == Key::Escape {
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
            let is = |&(m, k): &Shortcut| k == *key && (m.command, m.shift, m.alt) == held;
            let hit = all().find(|command| command.keys().iter().any(is));
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
    fn shortcuts_are_written_in_signs_that_the_fonts_have() {
        for (command, &keys) in all().flat_map(|command| command.keys().iter().map(move |keys| (command, keys))) {
            let text = shortcut_text(keys);
            assert!(
                text.chars().all(|sign| sign.is_ascii() || "←→↑↓−⌘⌃⇧⌥".contains(sign)),
                "{}: {text}",
                command.label()
            );
        }
    }

    #[test]
    fn no_two_commands_share_a_key_or_a_label() {
        let mut keys = HashSet::new();
        let mut labels = HashSet::new();
        for command in all() {
            assert!(labels.insert(command.label()), "two commands are called {}", command.label());
            assert!(!command.tooltip().is_empty(), "{} has no tooltip", command.label());
            for &(m, k) in command.keys() {
                assert!(
                    keys.insert((m.command, m.shift, m.alt, k)),
                    "{} clashes on {}",
                    command.label(),
                    shortcut_text((m, k))
                );
            }
        }
        assert!(all().count() > 60);
    }
}
