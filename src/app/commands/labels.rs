//! The commands about the queue, tags, notes and the undoing of them.

use super::table::{CTRL, CTRL_SHIFT, NONE, SHIFT, always, has_frame, has_frames, view};
use super::{CommandRow, Menu, UiAction};
use crate::app::panes::{frames, maps, modes};
use crate::labels::{Tag, Verdict};
use crate::session::{Command, LabelMode, Session};
use egui::Key;

fn toggle(tag: Tag) -> UiAction {
    UiAction::Session(Command::ToggleTag(tag))
}

fn judge(s: &Session, verdict: Verdict) -> UiAction {
    let now = s.labels.label(s.data.frame_index).verdict;
    UiAction::Session(Command::SetVerdict((now != Some(verdict)).then_some(verdict)))
}

fn mode(s: &Session, mode: LabelMode) -> UiAction {
    view(s, |v| v.label_mode = mode)
}

fn reviewing(s: &Session) -> bool {
    has_frame(s) && s.view.label_mode == LabelMode::CountReview
}

/// Commands about labels, in the order of their menus.
pub(super) const COMMANDS: &[CommandRow] = &[
    CommandRow {
        label: "Undo",
        title: Some(|s| s.undo_name().map_or_else(|| "Undo".into(), |name| format!("Undo: {name}"))),
        tooltip: "Take the last act back: of labelling, on settings, or on the body.",
        menu: Menu::Edit,
        keys: &[(CTRL, Key::Z)],
        enabled: |s| s.undo_name().is_some(),
        act: |_| UiAction::Session(Command::Undo),
    },
    CommandRow {
        label: "Redo",
        title: Some(|s| s.redo_name().map_or_else(|| "Redo".into(), |name| format!("Redo: {name}"))),
        tooltip: "Do the last act again that was taken back.",
        menu: Menu::Edit,
        keys: &[(CTRL_SHIFT, Key::Z), (CTRL, Key::Y)],
        enabled: |s| s.redo_name().is_some(),
        act: |_| UiAction::Session(Command::Redo),
    },
    CommandRow {
        label: "Select all listed frames",
        title: None,
        tooltip: "Select every frame of the list, to tag them together.",
        menu: Menu::Edit,
        keys: &[(CTRL, Key::A)],
        enabled: |s| !s.queue.rows().is_empty(),
        act: |s| UiAction::Session(Command::SelectFrames(s.queue.rows().iter().map(|&row| row as usize).collect())),
    },
    frames::FILTER,
    CommandRow {
        label: "Next in queue",
        title: None,
        tooltip: "The next frame of the list, in its order and under its filter.",
        menu: Menu::Frame,
        keys: &[(NONE, Key::N)],
        enabled: has_frames,
        act: |_| UiAction::Session(Command::StepQueue(1)),
    },
    CommandRow {
        label: "Previous in queue",
        title: None,
        tooltip: "The frame before in the list, in its order and under its filter.",
        menu: Menu::Frame,
        keys: &[(SHIFT, Key::N)],
        enabled: has_frames,
        act: |_| UiAction::Session(Command::StepQueue(-1)),
    },
    CommandRow {
        label: "Next untagged",
        title: None,
        tooltip: "The next frame of the list that you have not judged yet; from the top again after the end.",
        menu: Menu::Frame,
        keys: &[(NONE, Key::U)],
        enabled: has_frames,
        act: |_| UiAction::Session(Command::NextUntagged),
    },
    CommandRow {
        label: "Last edited",
        title: None,
        tooltip: "The frame that you labelled last.",
        menu: Menu::Frame,
        keys: &[(NONE, Key::E)],
        enabled: |s| s.labels.last_edited.is_some(),
        act: |_| UiAction::Session(Command::GotoLastEdited),
    },
    CommandRow {
        label: "Tag F1: static reflector dominance",
        title: None,
        tooltip: "Tag the frame, or all selected frames, with F1; again to take it away.",
        menu: Menu::Labels,
        keys: &[(NONE, Key::Num1)],
        enabled: has_frame,
        act: |_| toggle(Tag::F1),
    },
    CommandRow {
        label: "Tag F2: near-field distortion",
        title: None,
        tooltip: "Tag the frame, or all selected frames, with F2; again to take it away.",
        menu: Menu::Labels,
        keys: &[(NONE, Key::Num2)],
        enabled: has_frame,
        act: |_| toggle(Tag::F2),
    },
    CommandRow {
        label: "Tag F3: close multi-person superposition",
        title: None,
        tooltip: "Tag the frame, or all selected frames, with F3; again to take it away.",
        menu: Menu::Labels,
        keys: &[(NONE, Key::Num3)],
        enabled: has_frame,
        act: |_| toggle(Tag::F3),
    },
    CommandRow {
        label: "Tag F4: low-motion ambiguity",
        title: None,
        tooltip: "Tag the frame, or all selected frames, with F4; again to take it away.",
        menu: Menu::Labels,
        keys: &[(NONE, Key::Num4)],
        enabled: has_frame,
        act: |_| toggle(Tag::F4),
    },
    CommandRow {
        label: "Tag clean",
        title: None,
        tooltip: "Say that the fit does not fail; takes F1 to F4 away.",
        menu: Menu::Labels,
        keys: &[(NONE, Key::Num0)],
        enabled: has_frame,
        act: |_| toggle(Tag::Clean),
    },
    CommandRow {
        label: "Tag unsure",
        title: None,
        tooltip: "Say that you cannot tell.",
        menu: Menu::Labels,
        keys: &[(NONE, Key::Num5)],
        enabled: has_frame,
        act: |_| toggle(Tag::Unsure),
    },
    modes::WRITE_NOTE,
    maps::MARK_CELLS,
    CommandRow {
        label: "Clear label",
        title: None,
        tooltip: "Say nothing of the frame, or of all selected frames, any more: tags, note, verdict, cells.",
        menu: Menu::Labels,
        keys: &[(NONE, Key::Delete)],
        enabled: |s| s.label_targets().iter().any(|&frame| s.labels.mine(frame as usize).is_some()),
        act: |_| UiAction::Session(Command::ClearLabel),
    },
    CommandRow {
        label: "Verdict: annotation error",
        title: None,
        tooltip: Verdict::AnnotationError.words(),
        menu: Menu::Labels,
        keys: &[(NONE, Key::Num6)],
        enabled: reviewing,
        act: |s| judge(s, Verdict::AnnotationError),
    },
    CommandRow {
        label: "Verdict: detection error",
        title: None,
        tooltip: Verdict::DetectionError.words(),
        menu: Menu::Labels,
        keys: &[(NONE, Key::Num7)],
        enabled: reviewing,
        act: |s| judge(s, Verdict::DetectionError),
    },
    CommandRow {
        label: "Verdict: both incorrect",
        title: None,
        tooltip: Verdict::BothIncorrect.words(),
        menu: Menu::Labels,
        keys: &[(NONE, Key::Num8)],
        enabled: reviewing,
        act: |s| judge(s, Verdict::BothIncorrect),
    },
    CommandRow {
        label: "Verdict: true negative",
        title: None,
        tooltip: Verdict::TrueNegative.words(),
        menu: Menu::Labels,
        keys: &[(NONE, Key::Num9)],
        enabled: reviewing,
        act: |s| judge(s, Verdict::TrueNegative),
    },
    CommandRow {
        label: "Explore",
        title: None,
        tooltip: "Show everything while labelling: evidence and other people's labels.",
        menu: Menu::Labels,
        keys: &[],
        enabled: always,
        act: |s| mode(s, LabelMode::Explore),
    },
    CommandRow {
        label: "Label for agreement",
        title: None,
        tooltip: "Hide other people's labels, and the evidence until you have tagged the frame.",
        menu: Menu::Labels,
        keys: &[],
        enabled: always,
        act: |s| mode(s, LabelMode::Agreement),
    },
    CommandRow {
        label: "Review counts",
        title: None,
        tooltip: "Give verdicts on frames whose number of people is disputed.",
        menu: Menu::Labels,
        keys: &[],
        enabled: always,
        act: |s| mode(s, LabelMode::CountReview),
    },
];
