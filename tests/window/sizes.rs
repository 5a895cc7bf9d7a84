//! The window at every size and zoom: no word is cut off, controls stand in one grid, nothing lies over something else.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::blob;
use crate::window::Window;
use egui::epaint::{Shape, TextShape};
use egui::{Key, Modifiers, Rect, Role, Vec2, vec2};
use egui_kittest::kittest::{NodeT as _, Queryable as _};
use mhp_inspector::app::Pane;
use mhp_inspector::session::Command;

/// Pixels of the screens, and zooms of the interface, %.
const SCREENS: [[f32; 2]; 6] =
    [[1024.0, 640.0], [1280.0, 800.0], [1440.0, 900.0], [1920.0, 1080.0], [2560.0, 1440.0], [3840.0, 2160.0]];
const ZOOMS: [f32; 4] = [0.8, 1.0, 1.5, 2.0];
/// What is drawn over an edge of less than this is not missed, points.
const SLACK: f32 = 1.5;

/// Every text that was drawn in the last pass, with what it was clipped to.
pub(crate) fn texts(window: &Window) -> Vec<(TextShape, Rect)> {
    fn walk(shape: &Shape, clip: Rect, into: &mut Vec<(TextShape, Rect)>) {
        match shape {
            Shape::Vec(shapes) => shapes.iter().for_each(|shape| walk(shape, clip, into)),
            Shape::Text(text) => into.push((text.clone(), clip)),
            _ => {}
        }
    }
    let mut found = Vec::new();
    for clipped in &window.harness.output().shapes {
        walk(&clipped.shape, clipped.clip_rect, &mut found);
    }
    found
}

/// Words that a reader sees a part of, or that lie beside what they belong to: what is scrolled away above or below is not
/// among them, nor what tables have at their side, which scroll both ways.
fn cut_off(window: &Window) -> Vec<String> {
    let tables = ["Frames", "Compare", "Agreement", "Study", "Statistics", "Joint"];
    let tables = tables.map(|title| window.harness.state().pane_rect(Pane::called(title).unwrap()));
    let screen = window.harness.ctx.content_rect();
    let mut cut = Vec::new();
    for (text, clip) in texts(window) {
        let words = text.galley.text().trim().to_owned();
        let rect = text.visual_bounding_rect();
        let beside = rect.left() < clip.left() - SLACK || rect.right() > clip.right() + SLACK;
        let out = rect.left() < screen.left() - SLACK || rect.right() > screen.right() + SLACK;
        let scrolled = !rect.y_range().intersects(clip.y_range());
        let listed = tables.iter().flatten().any(|table| table.contains_rect(clip.shrink(4.0)));
        if (beside || out) && !scrolled && !listed && !words.is_empty() && clip.is_positive() {
            cut.push(format!("{words:?} at {rect:?} in {clip:?}"));
        }
    }
    cut
}

fn resize(window: &mut Window, size: Vec2) {
    window.harness.set_size(size);
    window.harness.remove_cursor();
    window.harness.run_steps(4);
}

/// A fit, a branch, a tag, a selected joint: everything that has words.
fn busy(window: &mut Window) {
    window.apply(Command::SetAnnotator("ada".into()));
    window.at_rest();
    window.key(Key::Num1);
    window.key(Key::P);
    window.key(Key::J);
    window.until("the tag", |w| w.tags(0) == "F1");
}

#[test]
fn no_word_is_cut_off_at_any_size_and_zoom() {
    let mut window = Window::fitted(3);
    busy(&mut window);
    let mut wrong = Vec::new();
    for screen in SCREENS {
        for zoom in ZOOMS {
            let size = vec2(screen[0], screen[1]) / zoom;
            resize(&mut window, size);
            let cut = cut_off(&window);
            wrong.extend(cut.into_iter().map(|what| format!("{screen:?} at {zoom}: {what}")));
        }
    }
    assert!(wrong.is_empty(), "{}\n{wrong:#?}", wrong.len());
}

#[test]
fn no_word_of_a_pane_is_cut_off() {
    let mut window = Window::fitted(3);
    busy(&mut window);
    let mut wrong = Vec::new();
    for size in [[1024.0, 640.0], [1280.0, 800.0], [853.0, 533.0]] {
        for pane in Pane::all() {
            window.harness.state_mut().show_pane(pane);
            resize(&mut window, size.into());
            let cut = cut_off(&window);
            wrong.extend(cut.into_iter().map(|what| format!("{} of {size:?}: {what}", pane.title())));
        }
    }
    assert!(wrong.is_empty(), "{}\n{wrong:#?}", wrong.len());
}

#[test]
fn no_word_of_a_sheet_is_cut_off() {
    let mut window = Window::fitted(3);
    let mut wrong = Vec::new();
    for size in [[1280.0, 800.0], [683.0, 427.0], [512.0, 320.0]] {
        resize(&mut window, size.into());
        for (sheet, modifiers, key) in [
            ("palette", Modifiers::COMMAND, Key::K),
            ("help", Modifiers::NONE, Key::F1),
            ("go to", Modifiers::COMMAND, Key::J),
            ("path", Modifiers::COMMAND, Key::L),
            ("save", Modifiers::COMMAND, Key::S),
            ("presets", Modifiers::SHIFT, Key::C),
        ] {
            window.key_with(modifiers, key);
            if sheet == "presets" {
                window.until("both fits", |w| w.named("Take paper"));
            }
            window.harness.run_steps(4);
            let cut = cut_off(&window);
            wrong.extend(cut.into_iter().map(|what| format!("{sheet} of {size:?}: {what}")));
            window.key(Key::Escape);
            window.harness.run_steps(3);
        }
    }
    assert!(wrong.is_empty(), "{}\n{wrong:#?}", wrong.len());
}

/// Boxes of numbers and the beginnings of sliders share their columns, in every section; whole numbers have no decimals.
#[test]
fn settings_stand_in_one_grid() {
    let mut window = Window::open(1);
    resize(&mut window, vec2(1440.0, 5200.0));
    for section in ["Start", "Kinematic limits", "Step sizes", "Perturb the start"] {
        window.click(section);
    }
    window.harness.run_steps(30);
    let pane = window.harness.state().pane_rect(Pane::called("Fit").unwrap()).unwrap();
    let boxes: Vec<(String, Rect, String)> = window
        .harness
        .root()
        .children_recursive()
        .filter(|node| node.accesskit_node().role() == Role::SpinButton && pane.contains(node.rect().center()))
        .map(|node| (node.accesskit_node().label().unwrap_or_default(), node.rect(), node.value().unwrap_or_default()))
        .collect();
    assert!(boxes.len() > 15, "{boxes:?}");
    let sliders: Vec<f32> = ["w_EM", "w_kine", "τ_pct"].map(|name| window.node(name).rect().left()).to_vec();
    assert!(sliders.iter().all(|left| (left - sliders[0]).abs() < 1.0), "{sliders:?}");
    for (name, rect, value) in &boxes {
        assert!(rect.right() <= pane.right(), "{name} ends at {rect:?} in {pane:?}");
        assert!((rect.left() - boxes[0].1.left()).abs() < 1.0, "{name}: {rect:?}, {:?}", boxes[0]);
        assert!(!value.ends_with(".00") && !value.ends_with(".0"), "{name}: {value}");
    }
}

/// The strip of iterations has its handle to itself: no word is over it, whatever is said beside it while a fit runs.
#[test]
fn nothing_is_written_over_the_scrubber() {
    let mut window = Window::open(3);
    window.run_forever();
    window.until("a speed", |w| w.fit().shown.as_ref().is_some_and(|shown| shown.iterations_per_s > 0.0));
    for width in [1440.0, 1024.0, 640.0] {
        resize(&mut window, vec2(width, 640.0));
        for strip in ["Iteration scrubber", "Timeline"] {
            let rect = window.node(strip).rect();
            let over: Vec<String> = texts(&window)
                .into_iter()
                .filter(|(text, _)| text.visual_bounding_rect().shrink(1.0).intersects(rect.shrink(1.0)))
                .map(|(text, _)| text.galley.text().to_owned())
                // The letters of the strata are what the strip of frames shows.
                .filter(|words| words.trim().len() > 1)
                .collect();
            assert!(over.is_empty(), "{strip} of {width}: {over:?}");
        }
    }
}

/// One sign stands for one thing: ▶ plays the frames and nothing else, and the signs of frames are not those of iterations.
#[test]
fn a_sign_stands_for_one_thing() {
    let mut window = Window::fitted(3);
    window.harness.run_steps(2);
    let signs = |sign: &str| texts(&window).iter().filter(|(text, _)| text.galley.text().trim() == sign).count();
    for sign in ["▶", "∂ Fit", "◂", "▸", "|◂", "▸|", "⇥"] {
        assert_eq!(signs(sign), 1, "{sign}");
    }
}

/// What gave way is whole: icons with their names, and icons alone where the names have no room.
#[test]
fn strips_have_room_for_what_is_on_them() {
    let mut window = Window::open(2);
    for (size, right_is_named) in [([853.0, 533.0], true), ([640.0, 540.0], true), ([512.0, 320.0], false)] {
        resize(&mut window, size.into());
        let entries: Vec<(String, Rect)> = Pane::all()
            .iter()
            .map(|pane| format!("{} on the strip", pane.title()))
            .filter(|name| window.named(name))
            .map(|name| (name.clone(), window.node(&name).rect()))
            .collect();
        assert!(entries.len() > 1, "{size:?}: {entries:?}");
        // Between the menus and the strips of frames and iterations.
        let whole = Rect::from_min_max(egui::pos2(0.0, 24.0), egui::pos2(size[0], size[1] - 56.0));
        for (k, (name, rect)) in entries.iter().enumerate() {
            assert!(whole.contains_rect(*rect), "{name} at {rect:?} of {size:?}");
            assert!(entries[..k].iter().all(|(_, other)| !other.shrink(0.5).intersects(*rect)), "{name} of {size:?}");
        }
        let words = texts(&window).into_iter().any(|(text, _)| text.galley.text() == "Image plane");
        assert_eq!(words, right_is_named, "{size:?}");
    }
}

/// Where a row of tabs has no room for all names the last ones are icons, which lead to their panes all the same.
#[test]
fn tabs_without_room_are_icons() {
    let mut window = Window::open(2);
    let centre = ["Maps", "Study", "Statistics", "Agreement"];
    let drawn = |w: &Window| -> Vec<&str> {
        let shown = |title: &&str| texts(w).iter().any(|(text, _)| text.galley.text() == *title);
        centre.into_iter().filter(shown).collect()
    };
    resize(&mut window, vec2(1920.0, 1080.0));
    assert_eq!(drawn(&window), centre);
    resize(&mut window, vec2(1024.0, 640.0));
    let named = drawn(&window);
    assert!(named.len() < centre.len() && named == centre[..named.len()] && named.contains(&"Maps"), "{named:?}");
    window.click("Agreement");
    window.harness.run_steps(3);
    assert!(window.harness.state().pane_rect(Pane::called("Agreement").unwrap()).is_some());
    assert!(drawn(&window).contains(&"Agreement"), "what is in front has its name");
}

/// The name of an array that has no room is shortened; what the map shows is said whole, in one line.
#[test]
fn titles_of_maps_stay_in_one_line() {
    let sample = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("samples/generic");
    let harness = Window::empty(&[sample], [1024.0, 640.0]);
    let mut window = Window { harness, folder: tempfile::tempdir().unwrap() };
    window.ready(0);
    for size in [[2560.0, 1440.0], [1024.0, 640.0], [853.0, 533.0], [640.0, 400.0]] {
        resize(&mut window, size.into());
        for content in ["H_ori", "H_sim", "IoU 0"] {
            let titles: Vec<TextShape> = texts(&window)
                .into_iter()
                .map(|(text, _)| text)
                .filter(|text| text.galley.text().contains(content) && text.galley.text().contains("range_"))
                .collect();
            assert!(titles.len() >= 2, "{content} of {size:?}");
            let broken: Vec<&str> =
                titles.iter().filter(|t| t.galley.rows.len() > 1).map(|t| t.galley.text()).collect();
            assert!(broken.is_empty(), "{size:?}: {broken:?}");
        }
    }
}

/// A row of maps that is low keeps its colour bar.
#[test]
fn a_low_row_of_maps_keeps_its_colour_bar() {
    let mut window = Window::open(1);
    for size in [[1280.0, 800.0], [853.0, 533.0], [683.0, 427.0]] {
        resize(&mut window, size.into());
        for limit in ["H_ori map of hori lower limit", "H_ori map of vert upper limit"] {
            assert!(window.named(limit), "{limit} of {size:?}");
        }
    }
}

/// What is told does not lie over the chips that tags are given with.
#[test]
fn notifications_leave_the_chips_alone() {
    let mut window = Window::open(3);
    window.at_rest();
    let missing = window.folder.path().join("nothing");
    for size in [[1440.0, 900.0], [1280.0, 800.0], [1024.0, 640.0]] {
        resize(&mut window, size.into());
        window.apply(Command::Open(missing.clone()));
        window.until("the notification", |w| w.named("Dismiss notification"));
        window.harness.run_steps(10);
        let told: Vec<Rect> =
            window.harness.query_all_by_label("Dismiss notification").map(|node| node.rect().expand(8.0)).collect();
        let words = window.harness.query_all_by_label_contains("no such file").map(|node| node.rect());
        let told: Vec<Rect> = told.into_iter().chain(words).collect();
        for chip in ["Tag F1", "Tag F2", "Tag F3", "Tag F4"] {
            let chip = window.node(chip).rect();
            assert!(told.iter().all(|rect| !rect.intersects(chip)), "{chip:?} under {told:?}");
        }
        window.dismiss_all();
    }
}

/// What a menu offers most is on top, what ends the window last, and no more than a handful stand together.
#[test]
fn menus_are_in_groups_and_quit_is_last() {
    let mut window = Window::open(2);
    for menu in ["File", "View"] {
        window.open_menu(menu);
        let open = window.harness.query_all_by_label(menu).map(|node| node.rect()).find(|rect| rect.top() < 30.0);
        let left = open.unwrap().left();
        let mut items: Vec<(f32, f32, String)> = window
            .harness
            .root()
            .children_recursive()
            .filter(|node| node.accesskit_node().role() == Role::Button && node.rect().top() > 28.0)
            .filter(|node| (node.rect().left() - left).abs() < 12.0 && node.rect().width() > 120.0)
            .filter_map(|node| Some((node.rect().top(), node.rect().bottom(), node.accesskit_node().label()?)))
            .collect();
        items.sort_by(|a, b| a.0.total_cmp(&b.0));
        items.dedup_by(|a, b| (a.0 - b.0).abs() < 1.0);
        let least = items.windows(2).map(|pair| pair[1].0 - pair[0].1).fold(f32::INFINITY, f32::min);
        // The list of panes is as long as there are panes.
        let pane = |item: &(f32, f32, String)| item.2.starts_with("Show ");
        let groups = items.chunk_by(|a, b| b.0 - a.1 < least + 3.0);
        let groups = groups.filter(|group| !group.iter().all(pane)).map(<[_]>::len).collect::<Vec<_>>();
        assert!(groups.len() > 2 && groups.iter().all(|&n| n <= 12), "{menu}: {groups:?} {items:#?}");
        if menu == "File" {
            assert!(items.last().unwrap().2.starts_with("Quit"), "{items:#?}");
        }
        window.key(Key::Escape);
        window.harness.run_steps(2);
    }
}

/// The list of frames takes no more room than its columns want.
#[test]
fn the_list_is_no_wider_than_its_columns() {
    let folder = tempfile::tempdir().unwrap();
    blob::write_dataset(folder.path(), 3);
    let harness = Window::empty(&[folder.path().into()], [3840.0, 2160.0]);
    let mut window = Window { harness, folder };
    window.ready(0);
    window.at_rest();
    let pane = window.harness.state().pane_rect(Pane::called("Frames").unwrap()).unwrap();
    assert!(pane.width() <= 340.0, "{pane:?}");
    resize(&mut window, vec2(1024.0, 640.0));
    let pane = window.harness.state().pane_rect(Pane::called("Frames").unwrap()).unwrap();
    assert!(pane.width() <= 230.0, "{pane:?}");
}
