//! A pane for tests: that this file and its line in the list are all that a pane takes.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use super::{Dock, PANES, Pane, PaneState, PaneStates, Shared};
use crate::app::commands::{UserCommand, command, found};
use crate::app::layout::PaneLayout;
use crate::app::theme;
use crate::app::widgets::Mark;
use crate::session::Session;
use egui_tiles::{Container, Tile, Tree};

/// The pane.
pub(super) static PANE: Pane = Pane {
    key: "Dummy",
    title: "Dummy pane",
    icon: &[Mark::Dot([8.0, 8.0], 6.0)],
    help: "how often it was drawn",
    dock: Dock::RightTop,
    keys: &[],
    margin: 8,
    state: PaneStates::prepare::<State>,
    blank: |_| None,
    toolbar: None,
    ui: |ui, _, states| {
        states.of::<State>().drawn += 1;
        ui.label("dummy");
    },
};

#[derive(Default)]
struct State {
    drawn: usize,
}

impl PaneState for State {}

/// The titles of the tabs that a pane is one of.
fn tabs_with(tree: &Tree<&'static Pane>, pane: &'static Pane) -> Vec<&'static str> {
    let tiles = &tree.tiles;
    let Some(parent) = tiles.find_pane(&pane).and_then(|id| tiles.parent_of(id)) else { return Vec::new() };
    let Some(Tile::Container(Container::Tabs(tabs))) = tiles.get(parent) else { return Vec::new() };
    let title = |id| if let Some(Tile::Pane(pane)) = tiles.get(id) { pane.title() } else { "" };
    tabs.children.iter().map(|&id| title(id)).collect()
}

#[test]
fn a_pane_of_the_list_has_a_command_in_the_menu_and_the_palette() {
    let show = command("Show Dummy pane").unwrap();
    assert!(matches!(show, UserCommand::Show(pane) if *pane == PANE));
    assert_eq!(show.tooltip(), "Bring the pane Dummy pane to the front: how often it was drawn.");
    assert_eq!(found("dummy").first().map(|command| command.label()).as_deref(), Some("Show Dummy pane"));
    assert!(PANES.iter().all(|pane| command(&format!("Show {}", pane.title)).is_some()));
}

#[test]
fn a_pane_of_the_list_is_in_the_default_layout_at_its_place() {
    assert_eq!(tabs_with(PaneLayout::default().stored(), &PANE), ["Fit", "Joint", "Dummy pane"]);
    assert_eq!(Pane::called("dummy PANE"), Some(&PANE));
}

#[test]
fn a_layout_survives_json_and_ron_and_one_from_before_gets_the_pane() {
    let default = PaneLayout::default();
    let json = serde_json::to_string(default.stored()).unwrap();
    let tree: Tree<&'static Pane> = serde_json::from_str(&json).unwrap();
    assert_eq!(tree, *default.stored());
    let text = ron::to_string(default.stored()).unwrap();
    assert!(text.contains("Pane(Maps)"), "keys are written as they always were: {text}");
    let tree: Tree<&'static Pane> = ron::from_str(&text).unwrap();
    assert_eq!(tree, *default.stored());
    // A tree from before the pane, and one with a pane that there is no longer.
    let mut older = tree;
    let id = older.tiles.find_pane(&&PANE).unwrap();
    older.remove_recursively(id);
    assert_eq!(tabs_with(&older, &PANE), [""; 0]);
    assert_eq!(tabs_with(PaneLayout::restored(older, false).stored(), &PANE), ["Fit", "Joint", "Dummy pane"]);
    let unknown: Result<Tree<&'static Pane>, _> = serde_json::from_str(&json.replace("Dummy", "Gone"));
    assert!(unknown.unwrap_err().to_string().contains("no pane has the key Gone"));
}

#[test]
fn a_pane_of_the_list_is_drawn_where_it_is_in_front() {
    let (ctx, session) = (egui::Context::default(), Session::default());
    theme::install(&ctx);
    let (mut layout, mut states, mut acts) = (PaneLayout::default(), PaneStates::default(), Vec::new());
    let mut pass = |layout: &mut PaneLayout| {
        let (pointed, mut points) = (super::Pointed::default(), super::Pointed::default());
        let pane = egui::Rect::NOTHING;
        let mut shared = Shared { session: &session, acts: &mut acts, gpu: None, pane, pointed, points: &mut points };
        let size = egui::Rect::from_min_size(egui::Pos2::ZERO, egui::vec2(1440.0, 900.0));
        let input = egui::RawInput { screen_rect: Some(size), ..Default::default() };
        ctx.run_ui(input, |ui| layout.show(ui, &mut shared, &mut states)).textures_delta.clear();
        states.of::<State>().drawn
    };
    assert_eq!(pass(&mut layout), 0, "another tab is in front");
    layout.show_pane(&PANE);
    assert!(pass(&mut layout) > 0);
    assert!(layout.rect(&PANE).is_some());
    for pane in PANES {
        layout.show_pane(pane);
        pass(&mut layout);
        assert!(layout.rect(pane).is_some(), "{pane:?} is drawn without a data set");
    }
}

#[test]
fn no_two_panes_share_a_key_or_a_title() {
    for (i, pane) in PANES.iter().enumerate() {
        let others = &PANES[i + 1..];
        assert!(others.iter().all(|other| other.key != pane.key && other.title != pane.title), "{pane:?}");
    }
}
