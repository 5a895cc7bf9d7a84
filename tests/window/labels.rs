//! Tags, notes, verdicts, marks and the frame list in the real window, by name and without a display.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::blob;
use crate::window::Window;
use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable as _;
use mhp_inspector::labels::{
    CellRegion, Change, FrameId, Journal, Judged, LabelPlace, Record, Tag, Verdict, read_acts, read_table,
};
use mhp_inspector::session::{Command, LabelMode, LabelStatus};
use std::path::PathBuf;

const CTRL: Modifiers = Modifiers::COMMAND;

/// Ada's window on `frames` frames, with journals and strata read.
fn open(frames: usize) -> Window {
    let folder = tempfile::tempdir().unwrap();
    blob::write_dataset(folder.path(), frames);
    let mut window = Window::on(folder);
    window.at_rest();
    window
}

/// Another window on the same data set.
fn second(window: &Window, annotator: &str) -> Window {
    let harness = Window::empty(&[window.folder.path().into()], [1440.0, 900.0]);
    let mut other = Window { harness, folder: tempfile::tempdir().unwrap() };
    other.apply(Command::SetAnnotator(annotator.into()));
    other.ready(0);
    other.at_rest();
    other
}

fn file(window: &Window, annotator: &str) -> PathBuf {
    window.folder.path().join(format!("mhp-labels/{annotator}.labels.jsonl"))
}

/// The newest record on disk.
fn written(window: &Window) -> Record {
    read_acts(&file(window, "ada")).unwrap().pop().unwrap()
}

/// Presses a key and waits for the tags of the frame on screen.
fn press(window: &mut Window, key: Key, tags: &str) {
    let frame = window.frame();
    window.key(key);
    window.until(tags, |w| w.tags(frame) == tags);
    assert_eq!(written(window).label.tags.to_string(), tags, "on disk");
}

/// Types a filter and leaves the field.
fn filter(window: &mut Window, text: &str) {
    window.click("Filter frames");
    window.key_with(CTRL, Key::A);
    window.type_text(text);
    window.key(Key::Enter);
    assert_eq!(window.session().queue.text, text);
}

fn rows(window: &Window) -> Vec<usize> {
    window.session().queue.rows().iter().map(|&row| row as usize).collect()
}

fn bob_tags(window: &Window, frame: usize, tag: Tag) {
    let dataset = window.session().data.dataset.as_ref().unwrap();
    let place = LabelPlace::in_folder(&window.folder.path().join("mhp-labels"));
    let mut journal = Journal::open(&place, "bob", dataset.fingerprint()).unwrap();
    let id = FrameId { path: dataset.frame_name(frame).into(), index: frame };
    journal.commit("tag", &[(id, Change::adding(tag))], &Judged::default()).unwrap();
}

#[test]
fn digits_toggle_tags_and_clean_takes_the_modes_away() {
    let mut window = open(2);
    press(&mut window, Key::Num1, "F1");
    press(&mut window, Key::Num3, "F1 F3");
    assert!(window.is_on("Tag F1") && window.is_on("Tag F3") && !window.is_on("Tag F2"));
    press(&mut window, Key::Num1, "F3");
    press(&mut window, Key::Num5, "F3 unsure");
    press(&mut window, Key::Num0, "clean unsure");
    press(&mut window, Key::Num4, "F4 unsure");
    window.click("Tag unsure");
    window.until("F4 alone", |w| w.tags(0) == "F4");
    assert!(window.value("Frame frames/000").contains("tagged F4"), "{}", window.value("Frame frames/000"));
    window.key(Key::Delete);
    window.until("no label", |w| w.session().labels.mine(0).is_none());
    window.key_with(CTRL, Key::Z);
    window.until("the label again", |w| w.tags(0) == "F4");
    // Verdicts are for the review of counts.
    window.key(Key::Num6);
    window.harness.run_steps(3);
    assert_eq!(written(&window).label.verdict, None);
}

#[test]
fn a_bulk_tag_is_one_act() {
    let mut window = open(8);
    window.click("Frame frames/001");
    window.ready(1);
    window.click_with(CTRL, "Frame frames/003");
    window.click_with(Modifiers::SHIFT, "Frame frames/005");
    assert_eq!(
        window.session().labels.selection.iter().copied().collect::<Vec<_>>(),
        [1, 3, 4, 5],
        "with the frame on screen"
    );
    assert_eq!(window.frame(), 1, "selecting shows no other frame");
    window.click_with(CTRL, "Frame frames/001");
    assert!(window.says("Tags go to 3 selected frames"));
    window.key(Key::Num2);
    window.until("three tags", |w| [3, 4, 5].iter().all(|&frame| w.tags(frame) == "F2"));
    assert_eq!(window.tags(1), "", "the frame on screen was taken out");
    assert!(window.menu_says("Edit", "Undo: tag F2 on 3 frames"));
    window.key_with(CTRL, Key::Z);
    window.until("none", |w| [3, 4, 5].iter().all(|&frame| w.tags(frame).is_empty()));
    assert!(window.told("undo: tag F2 on 3 frames"));
    window.key_with(CTRL, Key::Y);
    window.until("three again", |w| [3, 4, 5].iter().all(|&frame| w.tags(frame) == "F2"));

    window.key(Key::Escape);
    assert!(window.session().labels.selection.is_empty() && !window.says("Tags go to"));
    filter(&mut window, "index<2");
    window.key_with(CTRL, Key::A);
    assert_eq!(window.session().labels.selection.iter().copied().collect::<Vec<_>>(), [0, 1], "all that are listed");
    // A click without Ctrl begins anew.
    window.click("Frame frames/000");
    window.ready(0);
    assert!(window.session().labels.selection.is_empty());
}

#[test]
fn a_slip_that_tags_every_frame_is_told_and_taken_back_by_one_click() {
    let mut window = open(24);
    window.key_with(CTRL, Key::A);
    window.until("the count", |w| w.says("24 frames are selected"));
    window.key(Key::Num1);
    window.until("the tags", |w| (0..24).all(|frame| w.tags(frame) == "F1"));
    window.click("Undo tag F1 on 24 frames");
    window.until("no tag", |w| (0..24).all(|frame| w.tags(frame).is_empty()));
    assert!(!window.named("Undo tag F1 on 24 frames"), "what is taken back is not offered");
    // Taken back by the key, or followed by another act, it is not offered either.
    window.key(Key::Num1);
    window.until("the tags", |w| (0..24).all(|frame| w.tags(frame) == "F1"));
    window.until("the offer", |w| w.named("Undo tag F1 on 24 frames"));
    window.key(Key::Escape);
    window.key(Key::Num2);
    window.until("another tag", |w| w.tags(0) == "F1 F2");
    window.harness.step();
    assert!(!window.named("Undo tag F1 on 24 frames"));
}

#[test]
fn who_labels_stands_above_the_tags_and_in_one_line_with_how_much() {
    let mut window = open(2);
    window.harness.set_size(egui::vec2(1024.0, 640.0));
    window.harness.run_steps(3);
    let line = |w: &Window| (w.node("Annotator").rect(), w.harness.get_by_label_contains(" labelled").rect());
    let (name, count) = line(&window);
    assert!(name.bottom() < window.node("Tag F1").rect().top(), "without scrolling, above the tags");
    assert!((name.center().y - count.center().y).abs() < 3.0 && name.right() < count.left(), "{name:?} {count:?}");
    assert!(window.says("0 labelled"));
    press(&mut window, Key::Num1, "F1");
    assert!(window.says("1 labelled"));
    window.click("Annotator");
    window.key_with(CTRL, Key::A);
    window.type_text("grace");
    window.key(Key::Enter);
    window.until("grace's journal", |w| {
        w.session().labels.annotator == "grace" && w.session().labels.status == LabelStatus::Ready
    });
    assert!(window.says("0 labelled"));
}

#[test]
fn next_untagged_and_last_edited_find_their_frames() {
    let mut window = open(4);
    press(&mut window, Key::Num1, "F1");
    window.key(Key::U);
    window.ready(1);
    press(&mut window, Key::Num0, "clean");
    window.key(Key::End);
    window.ready(3);
    press(&mut window, Key::Num2, "F2");
    window.key(Key::U);
    window.ready(2);
    window.key(Key::U);
    window.until("the hint", |w| w.told("no other frame is untagged: all 4 frames"));
    assert_eq!(window.frame(), 2);
    window.key(Key::E);
    window.ready(3);
    filter(&mut window, "-tag:any");
    assert_eq!(rows(&window), [2]);
}

#[test]
fn arrows_obey_the_filter_and_say_so_at_its_end() {
    let mut window = open(8);
    filter(&mut window, "index>=2 index<=4 -index=3");
    window.key(Key::ArrowRight);
    window.ready(2);
    window.key(Key::ArrowRight);
    window.ready(4);
    window.key(Key::ArrowRight);
    window.until("the hint", |w| w.told("no frame further that way: 2 of 8 frames match"));
    assert!(window.says("no frame further that way"));
    window.key(Key::N);
    window.until("the hint", |w| w.told("this is the end of the queue"));
    window.key(Key::ArrowLeft);
    window.ready(2);
    assert!(window.says("1 of 2"));
    filter(&mut window, "index>>2");
    assert!(window.says("is not a number"), "what is wrong is told");
    assert_eq!(rows(&window), [2, 4], "and the last filter holds");
}

#[test]
fn a_saved_view_keeps_the_rule_and_not_the_frames() {
    let mut window = open(4);
    filter(&mut window, "tag:none");
    window.click("Views");
    window.click("Name of the view");
    window.type_text("to do");
    window.click("Keep");
    press(&mut window, Key::Num1, "F1");
    assert_eq!(rows(&window), [1, 2, 3], "what is tagged leaves the list");
    filter(&mut window, "index=0");
    assert_eq!(rows(&window), [0]);
    window.click("Views");
    window.click("to do");
    assert_eq!((window.session().queue.text.as_str(), rows(&window)), ("tag:none", vec![1, 2, 3]));
    assert_eq!(window.value("Filter frames"), "tag:none");
    window.key(Key::N);
    window.ready(1);
    press(&mut window, Key::Num1, "F1");
    assert_eq!(rows(&window), [2, 3]);
    window.key(Key::N);
    window.ready(2);
}

#[test]
fn the_list_sorts_both_ways_with_the_undefined_last() {
    use mhp_inspector::dataset::npz::{ArrayView, write};
    let folder = tempfile::tempdir().unwrap();
    blob::write_dataset(folder.path(), 7);
    let nan = vec![f64::NAN; 48 * 32];
    let maps = [("hori", ArrayView::f64(&[48, 32], &nan)), ("vert", ArrayView::f64(&[48, 32], &nan))];
    write(&folder.path().join("frames/002.npz"), &maps).unwrap();
    let mut window = Window::on(folder);
    window.at_rest();
    let hardness = |w: &Window| rows(w).iter().map(|&row| w.session().frame_row(row).hardness).collect::<Vec<_>>();
    window.click("Columns");
    window.click("Hardness");
    window.key(Key::Escape);
    window.harness.run_steps(2);
    window.click("Sort by Hardness");
    let up = hardness(&window);
    assert!(window.is_on("Sort by Hardness") && !window.is_on("Sort by Index"));
    assert!(up[..6].is_sorted_by_key(|hardness| hardness.unwrap()), "{up:?}");
    window.click("Sort by Hardness");
    let down = hardness(&window);
    assert!(down[..6].is_sorted_by(|a, b| a.unwrap() >= b.unwrap()), "{down:?}");
    assert_eq!((up[6], down[6]), (None, None));
    // The queue goes along the rows.
    let order = rows(&window);
    window.click(&format!("Frame frames/{:03}", order[0]));
    window.ready(order[0]);
    window.key(Key::N);
    window.ready(order[1]);
    let graded = window.session().frame_row(order[1]).stratum.unwrap().word();
    assert!(window.value(&format!("Frame frames/{:03}", order[1])).starts_with(graded));
}

#[test]
fn labelling_for_agreement_hides_what_could_sway() {
    let mut window = open(3);
    bob_tags(&window, 1, Tag::F3);
    window.key(Key::ArrowRight);
    window.ready(1);
    window.until("bob's tag", |w| w.says("bob: F3"));
    window.at_rest();
    assert!(window.value("Frame frames/001").contains("tagged F3") && window.named("F1 card"));

    window.choose("Labels", "Label for agreement");
    assert_eq!(window.session().view.label_mode, LabelMode::Agreement);
    assert!(window.says("Labels of 1 other are hidden") && window.says("Hidden until you have tagged this frame"));
    assert!(!window.named("F1 card") && !window.says("bob: F3"));
    assert!(!window.value("Frame frames/001").contains("F3"));
    press(&mut window, Key::Num2, "F2");
    let record = written(&window);
    assert!(!record.judged.machine_shown, "the scores were hidden when it was judged");
    assert_eq!(record.frame.path, "frames/001");
    assert!(window.named("F1 card"), "shown once it is judged");
    assert!(window.value("Frame frames/001").ends_with("tagged F2") && !window.says("bob: F3"));
    let out = tempfile::tempdir().unwrap();
    let table = out.path().join("mine.csv");
    window.save_as("Export labels as CSV…", &table);
    let names: Vec<String> = read_table(&table).unwrap().rows.into_iter().map(|row| row.record.annotator).collect();
    assert_eq!(names, ["ada"], "nothing hidden leaves by the back door");

    window.key(Key::ArrowRight);
    window.ready(2);
    window.at_rest();
    assert!(!window.named("F1 card"));
    window.click("blind");
    assert!(window.named("F1 card"));
    press(&mut window, Key::Num1, "F1");
    assert!(written(&window).judged.machine_shown);
    window.click("Explore");
    window.key(Key::ArrowLeft);
    window.ready(1);
    assert!(window.says("bob: F3"));
}

#[test]
fn counts_are_reviewed_by_keys() {
    let mut window = open(2);
    window.choose("Labels", "Review counts");
    assert!(window.says("Annotated persons 1"));
    let keys = [Key::Num6, Key::Num7, Key::Num8, Key::Num9];
    for (key, verdict) in keys.into_iter().zip(Verdict::ALL) {
        window.key(key);
        window.until("the verdict", |w| w.is_on(&format!("Verdict {verdict}")));
        assert_eq!(written(&window).label.verdict, Some(verdict));
    }
    assert!(window.value("Frame frames/000").contains("verdict true-negative"));
    assert!(window.menu_says("Edit", "Undo: verdict true-negative"));
    window.key(Key::Num9);
    window.until("no verdict", |w| w.session().labels.label(0).verdict.is_none());
    window.key_with(CTRL, Key::Z);
    window.until("the verdict again", |w| w.is_on("Verdict true-negative"));
}

#[test]
fn a_journal_that_cannot_be_opened_is_told_and_nothing_is_tagged() {
    for (broken, words) in [("a folder", "ada.labels.jsonl"), ("a newer one", "version 9")] {
        let folder = tempfile::tempdir().unwrap();
        blob::write_dataset(folder.path(), 1);
        let path = folder.path().join("mhp-labels/ada.labels.jsonl");
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        if broken == "a folder" {
            std::fs::create_dir(&path).unwrap();
        } else {
            std::fs::write(&path, "{\"format\":\"mhp-labels\",\"version\":9}\n").unwrap();
        }
        let mut window = Window::on(folder);
        window.until("the error", |w| matches!(w.session().labels.status, LabelStatus::Failed(_)));
        assert!(window.says("labels cannot be written") && window.says(words), "{broken}: {:?}", window.names());
        window.key(Key::Num1);
        window.until("the refusal", |w| w.told("nothing was tagged"));
        assert!(!window.is_on("Tag F1") && window.tags(0).is_empty());
    }
}

#[test]
fn a_journal_that_breaks_on_the_way_shows_nothing_that_is_not_written() {
    let mut window = open(1);
    press(&mut window, Key::Num1, "F1");
    let path = file(&window, "ada");
    std::fs::rename(&path, path.with_extension("aside")).unwrap();
    std::fs::create_dir(&path).unwrap();
    window.key(Key::Num2);
    window.until("the error", |w| w.told("“tag F2” was not written and is not done"));
    assert!(window.says("was not written and is not done") && !window.is_on("Tag F2"));
    std::fs::remove_dir(&path).unwrap();
    std::fs::rename(path.with_extension("aside"), &path).unwrap();
    press(&mut window, Key::Num2, "F1 F2");
}

#[test]
fn two_windows_on_one_data_set_see_each_other() {
    let mut ada = open(4);
    let mut again = second(&ada, "ada");
    let mut bob = second(&ada, "bob");
    press(&mut ada, Key::Num1, "F1");
    // An act of one's own must not swallow the news of the others'.
    bob.key(Key::Num2);
    bob.until("bob's tag", |w| w.tags(0) == "F2");
    bob.key(Key::ArrowRight);
    bob.until("ada's tag", |w| w.session().labels.others(0).any(|record| record.label.tags.contains(Tag::F1)));
    assert!(bob.value("Frame frames/000").contains("tagged F1 F2"));
    again.key(Key::ArrowRight);
    again.ready(1);
    again.until("the tag of the other window", |w| w.tags(0) == "F1");
    again.key(Key::ArrowLeft);
    again.ready(0);
    assert!(again.is_on("Tag F1") && again.says("bob: F2"));
    again.key(Key::Num3);
    again.until("both", |w| w.tags(0) == "F1 F3");
    ada.key(Key::ArrowRight);
    ada.until("the other window's", |w| w.tags(0) == "F1 F3");
}

/// Nobody touches the second window.
#[test]
fn another_windows_tag_is_seen_without_a_touch() {
    let mut ada = open(2);
    let mut again = second(&ada, "ada");
    press(&mut ada, Key::Num1, "F1");
    again.until("the tag of the other window", |w| w.tags(0) == "F1");
    assert!(again.is_on("Tag F1"));
}

#[test]
fn a_new_fit_leaves_the_tag_and_says_that_it_was_judged_on_another() {
    let mut window = open(1);
    window.key_with(Modifiers::SHIFT, Key::Period);
    window.paused_at(10);
    window.at_rest();
    press(&mut window, Key::Num1, "F1");
    let fit = written(&window).judged.fit;
    assert_eq!(fit, window.session().shown_hashes().map(|hashes| hashes.fit.clone()));
    assert!(!window.says("judged on another fit"));
    window.key(Key::Period);
    window.paused_at(11);
    assert!(window.says("judged on another fit (iteration 10)") && window.is_on("Tag F1"));
    window.type_value("w_EM value", "2");
    window.key_with(CTRL, Key::R);
    window.until("a new start", |w| w.fit().is_ready() && w.fit().head() == 0 && w.fit().shown.is_some());
    window.until("the remark", |w| w.says("judged on another fit (iteration 10, other settings)"));
    assert_eq!((window.tags(0).as_str(), written(&window).judged.fit), ("F1", fit));
}

#[test]
fn a_drag_with_ctrl_marks_cells() {
    let mut window = open(1);
    window.key(Key::F);
    let map = window.node("H_ori map of hori").rect();
    // 48 bins of depth from the top, 32 across from the left.
    let cell = |row: f32, column: f32| {
        map.min + egui::vec2((column + 0.5) / 32.0 * map.width(), (row + 0.5) / 48.0 * map.height())
    };
    window.harness.event(egui::Event::ModifiersChanged(CTRL));
    window.harness.hover_at(cell(12.0, 8.0));
    window.harness.drag_at(cell(12.0, 8.0));
    for k in 1..=4 {
        window.harness.hover_at(cell(12.0 + 3.0 * k as f32, 8.0 + 2.0 * k as f32));
    }
    window.harness.drop_at(cell(24.0, 16.0));
    window.harness.event(egui::Event::ModifiersChanged(Modifiers::NONE));
    window.harness.step();
    window.until("the region", |w| w.session().labels.label(0).region.is_some());
    let region = CellRegion { view: "hori".into(), lo: vec![12, 8], hi: vec![24, 16] };
    assert_eq!(written(&window).label.region, Some(region));
    assert!(window.value("Marked cells") == "hori[12..=24, 8..=16]" && window.menu_says("Edit", "Undo: mark cells"));
    window.click("Unmark cells");
    window.until("no region", |w| w.session().labels.label(0).region.is_none());
    // The same by G, and a drag without either pans.
    window.key(Key::G);
    window.drag("H_ori map of hori", 0.25, 0.75);
    window.until("the region", |w| w.session().labels.label(0).region.is_some());
    let marked = read_acts(&file(&window, "ada")).unwrap().len();
    window.drag("H_ori map of hori", 0.25, 0.75);
    assert_eq!(read_acts(&file(&window, "ada")).unwrap().len(), marked);
}

#[test]
fn keys_work_after_the_mouse_and_a_note_stays_with_its_frame() {
    let mut window = open(4);
    window.type_value("w_EM value", "2");
    press(&mut window, Key::Num1, "F1");
    window.drag("w_EM", 0.4, 0.6);
    press(&mut window, Key::Num2, "F1 F2");
    window.click("Frame frames/002");
    window.ready(2);
    press(&mut window, Key::Num3, "F3");
    // The mouse goes to another frame while the note is being typed.
    window.key(Key::M);
    window.until("the text cursor", |w| w.is_focused("Note"));
    window.type_text("1 wall");
    assert_eq!(window.tags(2), "F3", "digits are text there");
    window.click("Frame frames/003");
    window.ready(3);
    window.until("the note", |w| w.session().labels.label(2).note == "1 wall");
    assert!(window.session().labels.mine(3).is_none() && window.value("Note").is_empty());
    // Esc takes back what was typed.
    window.key(Key::M);
    window.until("the text cursor", |w| w.is_focused("Note"));
    window.type_text("no");
    window.key(Key::Escape);
    window.harness.run_steps(3);
    assert!(window.session().labels.mine(3).is_none() && window.value("Note").is_empty());
    press(&mut window, Key::Num1, "F1");
}
