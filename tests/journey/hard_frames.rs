//! What a researcher does with the window, from the data set to the labels that are taken home; without a display.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::scenes::{Scene, write_scenes};
use crate::window::Window;
use egui::{Key, Modifiers};
use mhp_inspector::labels::{Tag, read_acts};
use mhp_inspector::session::StrataStatus;
use mhp_inspector::study::complexity::Stratum;
use std::path::{Path, PathBuf};

const NOTE: &str = "a \"wall\", beside the person; =1+1";

/// Four sequences of six frames: the one with the reflector and the clutter is the hardest.
fn scenes() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let scene = |folder, clutter, reflector| Scene { folder, frames: 6, clutter, reflector };
    let all = [scene("a", 0, false), scene("b", 3, false), scene("c", 12, true), scene("d", 6, false)];
    write_scenes(folder.path(), &all);
    folder
}

fn journal(window: &Window) -> PathBuf {
    window.folder.path().join("mhp-labels/ada.labels.jsonl")
}

fn stratum(window: &Window) -> Option<Stratum> {
    window.session().strata.of(window.frame()).and_then(|complexity| complexity.stratum)
}

/// The window says that a tag is given only once the journal on disk says so.
fn shown_and_written(window: &Window, tag: Tag) -> bool {
    let shown = window.is_on(&format!("Tag {tag}"));
    let frame = window.session().data.frame.as_ref().map(|frame| frame.name.clone()).unwrap_or_default();
    let acts = if journal(window).is_file() { read_acts(&journal(window)).unwrap() } else { Vec::new() };
    let newest = acts.iter().rev().find(|record| record.frame.path == frame);
    let written = newest.is_some_and(|record| record.label.tags.contains(tag));
    assert!(written || !shown, "{tag} is shown and not on disk");
    shown
}

#[test]
fn from_the_hard_frames_to_the_labels_at_home() {
    let mut window = Window::on(scenes());
    window.until("the strata", |w| w.session().strata.status == StrataStatus::Ready);
    assert!(window.says("all 24 frames"));

    // Led to the hard frames.
    window.click("Hard");
    assert_eq!(window.value("Filter frames"), "stratum:hard");
    let hard: Vec<usize> = window.session().queue.rows().iter().map(|&row| row as usize).collect();
    assert_eq!(hard.len(), window.session().strata.count(Stratum::Hard));
    assert!((6..=10).contains(&hard.len()), "about a third: {hard:?}");
    assert!(window.says(&format!("{} of 24 frames match “stratum:hard”", hard.len())));
    let row = |w: &Window, frame: usize| {
        let name = w.session().data.dataset.as_ref().unwrap().frame_name(frame).to_owned();
        w.named(&format!("Frame {name}"))
    };
    window.harness.run_steps(2);
    assert!((0..24).all(|frame| row(&window, frame) == hard.contains(&frame)), "the list has the hard frames");

    // To one with five frames behind it; N goes along the queue.
    let judged = |w: &Window, frame: usize| w.session().strata.of(frame).unwrap().statistics.static_dominance.is_some();
    while !(hard.contains(&window.frame()) && judged(&window, window.frame())) {
        let before = window.frame();
        window.key(Key::N);
        assert!(window.frame() > before, "no hard frame has a static dominance: {hard:?}");
        let now = window.frame();
        window.ready(now);
    }
    let (frame, name) = (window.frame(), window.session().data.frame.as_ref().unwrap().name.clone());
    assert_eq!(stratum(&window), Some(Stratum::Hard));
    assert!(hard.last() > Some(&frame), "there is a next one");

    // Forty iterations, and what they say of F1.
    for k in 1..=4 {
        window.key_with(Modifiers::SHIFT, Key::Period);
        window.paused_at(10 * k);
    }
    window.at_rest();
    let card = window.text_of("F1 card");
    let shown = card.strip_prefix("score ").and_then(|text| text.split(". ").next()).unwrap().to_owned();
    let score = window.session().evidence_of(frame).unwrap()[0].score.unwrap();
    assert_eq!(shown, format!("{score:.2}"));
    assert!((0.0..=1.0).contains(&score), "{card}");
    assert!(card.contains("of the mask is static over 5 frames"), "{card}");

    // Where it is seen.
    assert!(!window.says("show where F1"));
    window.click("Findings of F1");
    window.until("the findings", |w| w.says("show where F1 is seen"));
    let link = window.names().into_iter().find(|name| name.starts_with("show where F1 is seen")).unwrap();
    window.click(&link);
    let fit = window.session().shown_hashes().cloned().unwrap();

    // A tag, a note, undo and redo.
    assert!(!window.is_on("Tag F1") && !journal(&window).is_file());
    window.harness.key_press(Key::Num1);
    window.until("the tag", |w| shown_and_written(w, Tag::F1));
    window.key(Key::M);
    window.until("the text cursor", |w| w.is_focused("Note"));
    window.type_text(NOTE);
    window.key(Key::Enter);
    window.until("the note", |w| w.session().labels.label(frame).note == NOTE);
    assert_eq!(window.value("Note"), NOTE);
    assert!(window.menu_says("Edit", "Undo: note"));
    window.key_with(Modifiers::COMMAND, Key::Z);
    window.until("the note gone", |w| w.session().labels.label(frame).note.is_empty());
    assert!(window.is_on("Tag F1") && window.value("Note").is_empty());
    assert!(window.menu_says("Edit", "Undo: tag F1") && window.menu_says("Edit", "Redo: note"));
    window.key_with(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    window.until("the note again", |w| w.session().labels.label(frame).note == NOTE);

    // On to the next hard frame.
    window.key(Key::N);
    let next = *hard.iter().find(|&&row| row > frame).unwrap();
    window.ready(next);
    assert_eq!(stratum(&window), Some(Stratum::Hard));
    assert!(!window.is_on("Tag F1") && window.value("Note").is_empty());

    // And home.
    let out = tempfile::tempdir().unwrap();
    let table = out.path().join("labels.csv");
    window.save_as("Export labels as CSV…", &table);
    let dataset = window.session().data.dataset.as_ref().unwrap().fingerprint().to_owned();
    let (index, score) = (frame.to_string(), score.to_string());
    check_table(
        &table,
        &[
            ("frame", name.as_str()),
            ("index", index.as_str()),
            ("annotator", "ada"),
            ("F1", "1"),
            ("F2", "0"),
            ("F3", "0"),
            ("F4", "0"),
            ("clean", "0"),
            ("unsure", "0"),
            ("verdict", ""),
            ("person", ""),
            ("region", ""),
            ("note", NOTE),
            ("judged_fit", fit.fit.as_str()),
            ("judged_config", fit.config.as_str()),
            ("judged_iteration", "40"),
            ("machine_F1", score.as_str()),
            ("machine_shown", "1"),
            ("dataset", dataset.as_str()),
            ("program", env!("CARGO_PKG_VERSION")),
        ],
    );
}

/// The table has one row with these cells.
fn check_table(path: &Path, expected: &[(&str, &str)]) {
    let mut table = csv::Reader::from_path(path).unwrap();
    let header = table.headers().unwrap().clone();
    let rows: Vec<csv::StringRecord> = table.records().map(Result::unwrap).collect();
    assert_eq!(rows.len(), 1, "{rows:?}");
    let cell = |name: &str| {
        let at = header.iter().position(|column| column == name);
        rows[0].get(at.unwrap()).unwrap()
    };
    for &(column, value) in expected {
        assert_eq!(cell(column), value, "column {column}");
    }
    assert!(cell("act").contains("note"), "{}", cell("act"));
    assert!(cell("time").ends_with('Z'), "{}", cell("time"));
}
