//! The maps pane: colour limits by hand and over frames, the cells round the cursor, the coordinates that maps are drawn in.
#![expect(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "tests fail by panicking")]

use crate::window::Window;
use egui::{Key, vec2};
use egui_kittest::kittest::{NodeT as _, Queryable as _};
use mhp_inspector::app::Pane;
use mhp_inspector::session::{ColorRange, Command, MapScale};

/// The limits of a map that were set by hand.
fn limits(window: &Window, array: &str) -> Option<(f64, f64, bool)> {
    window.session().view.limits_of(array).map(|limits| (limits.lo, limits.hi, limits.locked))
}

/// Types a limit in the form that its number opens.
fn type_limit(window: &mut Window, side: &str, array: &str, text: &str) {
    window.click(&format!("{side} limit of {array}"));
    let field = format!("{side} limit of {array} value");
    window.harness.run_steps(2);
    let node = window.harness.get_by_role_and_label(egui::accesskit::Role::TextInput, &field);
    node.focus();
    window.harness.run_steps(1);
    window.key_with(egui::Modifiers::COMMAND, Key::A);
    window.type_text(text);
    window.key(Key::Enter);
    window.harness.run_steps(2);
}

#[test]
fn a_limit_is_dragged_on_the_bar_for_its_row_alone() {
    let mut window = Window::open(2);
    assert_eq!(limits(&window, "hori"), None);
    let handle = window.node("H_ori map of hori lower limit").rect().center();
    window.harness.hover_at(handle);
    window.harness.drag_at(handle);
    window.harness.run_steps(2);
    window.harness.hover_at(handle - vec2(0.0, 30.0));
    window.harness.run_steps(2);
    window.harness.drop_at(handle - vec2(0.0, 30.0));
    window.harness.run_steps(2);
    let (lo, hi, locked) = limits(&window, "hori").expect("set by hand");
    assert!(locked && lo > -60.0 && lo < hi, "{lo} {hi}");
    assert_eq!(limits(&window, "vert"), None);
    assert!(!window.named("H_sim map of hori lower limit"), "H_sim has the same limits, and no bar of its own");
    assert!(window.is_on("Lock the limits of hori over frames") && !window.is_on("Automatic limits of hori"));
    window.click("Automatic limits of hori");
    assert_eq!(limits(&window, "hori"), None);
}

#[test]
fn a_limit_is_typed_and_what_is_no_number_is_told() {
    let mut window = Window::open(1);
    type_limit(&mut window, "Lower", "vert", "−33,5");
    assert_eq!(limits(&window, "vert").map(|(lo, ..)| lo), Some(-33.5));
    window.key(Key::Escape);
    type_limit(&mut window, "Upper", "vert", "loud");
    assert!(window.says("“loud” is not a number."), "{:?}", window.names());
    assert_eq!(limits(&window, "vert").map(|(lo, ..)| lo), Some(-33.5));
    window.key(Key::Escape);
    type_limit(&mut window, "Upper", "vert", "-40");
    assert!(window.says("The lower limit must be below the upper one."));
    window.click("Automatic");
    assert_eq!(limits(&window, "vert"), None);
    window.key(Key::Escape);

    // Below the shown floor: what is shown goes down with it, never the other way round.
    type_limit(&mut window, "Lower", "vert", "-90");
    assert_eq!(
        window.session().view.range_of("vert"),
        ColorRange::Fixed { lo: -90.0, hi: limits(&window, "vert").unwrap().1 }
    );
    window.key(Key::Escape);
    let mut linear = window.session().view.clone();
    linear.scale = MapScale::Linear;
    window.apply(Command::SetView(Box::new(linear)));
    assert_eq!(limits(&window, "vert"), None, "dB mean nothing on a linear scale");
    window.key(Key::C);
    assert!(window.session().view.limits.is_empty());
}

#[test]
fn locked_limits_stay_over_frames_and_others_are_found_again() {
    let mut window = Window::open(3);
    window.click("Lock the limits of hori over frames");
    let held = limits(&window, "hori").expect("those on screen");
    type_limit(&mut window, "Lower", "vert", "-30");
    window.key(Key::Escape);
    window.click("Lock the limits of vert over frames");
    assert!(matches!(limits(&window, "vert"), Some((-30.0, _, false))), "taken from the lock, and still set");
    window.key(Key::ArrowRight);
    window.ready(1);
    assert_eq!(limits(&window, "hori"), Some(held));
    assert_eq!(limits(&window, "vert"), None);
}

/// Opens one of the samples.
fn sample(name: &str) -> Window {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("samples").join(name);
    let harness = Window::empty(&[folder], [1440.0, 900.0]);
    let mut window = Window { harness, folder: tempfile::tempdir().expect("a folder") };
    window.ready(0);
    window
}

/// What the strip says of a place on a map, shares of its size.
fn told(window: &mut Window, map: &str, at: [f32; 2]) -> String {
    let rect = window.node(map).rect();
    window.harness.hover_at(rect.lerp_inside(vec2(at[0], at[1])));
    window.harness.run_steps(3);
    window.text_of("Cell under the pointer")
}

/// The number after a name in the strip.
fn number(told: &str, name: &str) -> f64 {
    let rest = told.split(&format!("{name} ")).nth(1).unwrap_or_else(|| panic!("{name} in {told}"));
    rest.split([' ', '°']).next().and_then(|text| text.parse().ok()).unwrap_or_else(|| panic!("{name} in {told}"))
}

/// A polar map on metres: what is told of the cell under the pointer is where the pointer is.
#[test]
fn a_polar_map_is_seen_from_above() {
    let mut window = sample("xrf55");
    window.key(Key::F);
    let array = window.session().data.dataset.as_ref().expect("a data set").info().views[0].array.clone();
    let map = format!("H_ori map of {array}");
    let before = window.node(&map).rect();
    window.click("Bird's-eye");
    window.harness.run_steps(3);
    assert!(window.session().view.cube.birds_eye);
    let after = window.node(&map).rect();
    assert!((after.width() / after.height() - before.width() / before.height()).abs() > 0.05, "to scale");
    // The fan is symmetric: ahead is in the middle, and as far to one side as to the other.
    let (left, ahead, right) = (
        told(&mut window, &map, [0.25, 0.35]),
        told(&mut window, &map, [0.5, 0.35]),
        told(&mut window, &map, [0.75, 0.35]),
    );
    assert!(number(&left, "   y") > 0.0 && number(&right, "   y") < 0.0, "{left}\n{right}");
    assert!(number(&ahead, "cone angle").abs() < 2.0 && number(&ahead, "range") < number(&left, "range"));
    let metres = number(&left, "   y") - number(&right, "   y");
    let depth =
        number(&told(&mut window, &map, [0.5, 0.2]), "depth") - number(&told(&mut window, &map, [0.5, 0.7]), "depth");
    let (across, down) = (f64::from(after.width()) * 0.5, f64::from(after.height()) * 0.5);
    assert!((metres / across - depth / down).abs() < 0.06 * depth / down, "{metres} m and {depth} m in {after}");
    window.click("Bird's-eye");
    window.harness.run_steps(2);
    assert_eq!(window.node(&map).rect(), before);
}

/// A map in metres on range and angle, and back; what cannot be drawn otherwise says why.
#[test]
fn a_cartesian_map_is_seen_in_polar_coordinates() {
    let mut window = sample("walk");
    assert!(!window.named("Bird's-eye"));
    window.key(Key::F);
    let array = window.session().data.dataset.as_ref().expect("a data set").info().views[0].array.clone();
    let map = format!("H_ori map of {array}");
    window.click("Polar");
    window.harness.run_steps(3);
    let near = told(&mut window, &map, [0.5, 0.6]);
    let far = told(&mut window, &map, [0.5, 0.3]);
    assert!(number(&far, "range") > number(&near, "range") + 1.0, "{near}\n{far}");
    assert!(number(&near, "azimuth").abs() < 3.0 && number(&far, "azimuth").abs() < 3.0, "{near}\n{far}");
    let side = told(&mut window, &map, [0.3, 0.85]);
    assert!(number(&side, "azimuth") > 20.0, "left of ahead: {side}");
    // A corner where the map has no cell has no read-out.
    assert!(!told(&mut window, &map, [0.02, 0.02]).contains("range"), "beyond the map");
}

/// Nine cells round the cursor, in a place of their own.
#[test]
fn the_nine_cells_round_the_cursor_are_told() {
    let mut window = Window::open(1);
    let map = "H_ori map of hori";
    let before = window.node(map).rect();
    window.click("3 × 3 cells");
    window.harness.run_steps(2);
    assert!(window.session().view.neighbours && window.is_on("3 × 3 cells"));
    assert!(window.node(map).rect().height() < before.height(), "they have room of their own");
    let one = told(&mut window, map, [0.5, 0.5]);
    let grid = window.text_of("Nine cells of H_ori");
    assert_eq!(grid.lines().count(), 3, "{grid}");
    assert!(grid.lines().all(|line| line.split_whitespace().count() == 3), "{grid}");
    let middle: f64 =
        grid.lines().nth(1).and_then(|line| line.split_whitespace().nth(1)?.parse().ok()).expect("a number");
    let shown = one.lines().nth(1).and_then(|line| line.split("  ").nth(1)).expect("a value").to_owned();
    assert!(shown.starts_with(&format!("{middle:.2}")), "{middle} in {shown}");
    assert!(window.named("Nine cells of H_sim"));
}

/// Three linked cuts through a cube: a click in one moves the others, a joint that is selected is gone to, and a session file
/// keeps the place.
#[test]
fn cuts_through_a_cube_are_linked() {
    let sample = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("samples/hupr");
    let harness = Window::empty(&[sample], [1440.0, 900.0]);
    let mut window = Window { harness, folder: tempfile::tempdir().unwrap() };
    window.ready(0);
    window.harness.state_mut().show_pane(Pane::called("Orthoview").unwrap());
    window.harness.run_steps(3);
    let told = |w: &Window| {
        let mut texts = w.harness.root().children_recursive().filter_map(|node| node.value());
        texts.find(|text| text.starts_with("At the place: ")).unwrap()
    };
    let cuts =
        ["Cut of range over radial velocity", "Cut of range over cone angle", "Cut of cone angle over radial velocity"];
    for cut in cuts {
        assert!(window.named(cut), "{cut}: {:#?}", window.names());
    }
    let peak = told(&window);
    assert!(peak.contains("H_ori") && peak.contains("0.00 dB re max"), "{peak}");
    // A click near the lower left corner of a cut: near and approaching; the third axis stays.
    let rect = window.node(cuts[0]).rect();
    let corner = rect.left_bottom() + vec2(2.0, -2.0);
    window.harness.hover_at(corner);
    window.harness.drag_at(corner);
    window.harness.drop_at(corner);
    window.harness.run_steps(3);
    let moved = told(&window);
    let bins = |text: &str| -> Vec<usize> {
        text.split("bin ").skip(1).map(|t| t.split_whitespace().next().unwrap().parse().unwrap()).collect()
    };
    let (before, after) = (bins(&peak), bins(&moved));
    assert_eq!((after[0], after[1], after[2]), (0, 63, before[2]), "{moved}");
    // A joint.
    window.key(Key::J);
    window.harness.run_steps(3);
    let at_joint = bins(&told(&window));
    assert!(at_joint != after, "the nose is elsewhere");
    window.click("To the peak");
    window.harness.run_steps(2);
    assert_eq!(bins(&told(&window)), before);
    window.click("Cuts through H_sim");
    window.click("largest");
    window.harness.run_steps(2);
    assert!(cuts.iter().all(|cut| window.named(cut)), "H_sim is there, the fit is ready");
    // Kept in a session file, and taken out of it.
    let path = window.folder.path().join("cuts.mhp-session");
    window.apply(Command::GotoFrame(0));
    window.key_with(egui::Modifiers::COMMAND, Key::S);
    window.answer_path("Save to", &path);
    window.until("the file", |_| path.is_file());
    let kept: serde_json::Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    let of_cuts = format!("{kept}");
    assert!(of_cuts.contains("\"ortho\":{") && of_cuts.contains("\"largest\":true"), "{of_cuts}");
    // Maps of two axes have no cuts.
    let mut flat = Window::open(1);
    flat.harness.state_mut().show_pane(Pane::called("Orthoview").unwrap());
    flat.harness.run_steps(3);
    assert!(flat.says("No map with three axes"));
}
