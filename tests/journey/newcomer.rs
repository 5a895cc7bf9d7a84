//! Ten tasks of somebody who sees the window for the first time. What comes of each is the same, whichever hand did it.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::window::Window;
use egui::{Key, Modifiers, vec2};
use mhp_inspector::config::Preset;
use mhp_inspector::session::{FitStatus, StrataStatus};
use mhp_inspector::study::complexity::Stratum;
use mhp_inspector::study::run::StudyKind;
use std::path::{Path, PathBuf};

const CTRL: Modifiers = Modifiers::COMMAND;
const SHIFT: Modifiers = Modifiers::SHIFT;
/// The joint that is moved: COCO's.
const RIGHT_WRIST: usize = 10;
/// The values of the two settings that are swept.
const VALUES: [&str; 2] = ["0.5,2", "5,20"];

/// How the tasks are done.
trait Hands {
    fn run_first_fit(&self, window: &mut Window);
    fn compare_presets(&self, window: &mut Window, taken: Preset);
    fn find_hard_frames(&self, window: &mut Window);
    fn fit_them_all(&self, window: &mut Window);
    fn sweep_two_settings(&self, window: &mut Window);
    /// Gives F1 to these frames of the list.
    fn tag(&self, window: &mut Window, frames: &[usize]);
    fn undo(&self, window: &mut Window);
    fn export(&self, window: &mut Window, path: &Path);
    fn reopen(&self, window: &mut Window, folder: &Path);
    fn move_joint(&self, window: &mut Window);
}

/// With the mouse; keys only to write into a field.
struct Mouse;

/// Without the mouse.
struct Keyboard;

#[test]
fn ten_tasks_by_mouse() {
    journey(&Mouse);
}

#[test]
fn ten_tasks_by_keyboard() {
    journey(&Keyboard);
}

impl Window {
    fn listed(&self) -> Vec<usize> {
        self.session().queue.rows().iter().map(|&row| row as usize).collect()
    }

    fn row(&self, frame: usize) -> String {
        format!("Frame {}", self.session().data.dataset.as_ref().unwrap().frame_name(frame))
    }

    /// Chooses a command by writing it into the palette.
    fn palette(&mut self, words: &str) {
        self.key_with(CTRL, Key::K);
        self.harness.run_steps(2);
        self.type_text(words);
        self.key(Key::Enter);
        self.harness.run_steps(2);
    }

    fn write_into(&mut self, field: &str, text: &str) {
        self.until("the keyboard in the field", |w| w.is_focused(field));
        self.key_with(CTRL, Key::A);
        self.type_text(text);
        assert_eq!(self.value(field), text);
    }
}

impl Hands for Mouse {
    fn run_first_fit(&self, window: &mut Window) {
        window.choose("Fit", "Run or pause");
    }

    fn compare_presets(&self, window: &mut Window, taken: Preset) {
        window.choose("Fit", "Compare presets");
        window.until("both fits", |w| w.named("Take paper"));
        window.click(&format!("Take {}", taken.name()));
    }

    fn find_hard_frames(&self, window: &mut Window) {
        window.click("Hard");
    }

    fn fit_them_all(&self, window: &mut Window) {
        window.click("Fit listed");
    }

    fn sweep_two_settings(&self, window: &mut Window) {
        window.choose("View", "Show Study");
        for (k, values) in VALUES.into_iter().enumerate() {
            let field = format!("Values of setting {}", k + 1);
            window.click(&field);
            window.write_into(&field, values);
        }
        window.click("Run study");
    }

    fn tag(&self, window: &mut Window, frames: &[usize]) {
        let (last, first) = frames.split_last().unwrap();
        for &frame in first {
            let row = window.row(frame);
            window.click_with(CTRL, &row);
        }
        window.click("Tag F1");
        window.click("Clear frame selection");
        let row = window.row(*last);
        window.click(&row);
        window.ready(*last);
        window.click("Tag F1");
    }

    fn undo(&self, window: &mut Window) {
        window.choose("Edit", "Undo");
    }

    fn export(&self, window: &mut Window, path: &Path) {
        window.save_as("Export labels as CSV…", path);
    }

    fn reopen(&self, window: &mut Window, folder: &Path) {
        window.drop_file(folder);
    }

    fn move_joint(&self, window: &mut Window) {
        let scene = window.node("3-D scene").rect();
        let at = window.seen(scene, window.joint(RIGHT_WRIST));
        window.pull(at, vec2(30.0, -20.0));
    }
}

impl Hands for Keyboard {
    fn run_first_fit(&self, window: &mut Window) {
        window.key(Key::Enter);
    }

    fn compare_presets(&self, window: &mut Window, taken: Preset) {
        window.key_with(SHIFT, Key::C);
        window.until("both fits", |w| w.named("Take paper"));
        let button = format!("Take {}", taken.name());
        window.until("the keyboard on the card", |w| w.is_focused("Take recommended"));
        for _ in 0..10 {
            if window.is_focused(&button) {
                break;
            }
            window.key(Key::Tab);
            window.harness.run_steps(2);
        }
        assert!(window.is_focused(&button));
        window.key(Key::Enter);
    }

    fn find_hard_frames(&self, window: &mut Window) {
        window.key_with(CTRL, Key::F);
        window.write_into("Filter frames", "stratum:hard");
        window.key(Key::Enter);
    }

    fn fit_them_all(&self, window: &mut Window) {
        window.key_with(CTRL, Key::Enter);
    }

    fn sweep_two_settings(&self, window: &mut Window) {
        window.key_with(SHIFT, Key::S);
        window.write_into("Values of setting 1", VALUES[0]);
        for _ in 0..4 {
            window.key(Key::Tab);
            window.harness.run_steps(2);
            if window.is_focused("Values of setting 2") {
                break;
            }
        }
        window.write_into("Values of setting 2", VALUES[1]);
        window.key(Key::Enter);
    }

    fn tag(&self, window: &mut Window, frames: &[usize]) {
        window.key(Key::Home);
        window.ready(0);
        for &frame in frames {
            while window.frame() != frame {
                window.key(Key::N);
                let now = window.frame();
                assert!(now <= frame, "{frame} is not along the queue");
                window.ready(now);
            }
            window.key(Key::Num1);
        }
    }

    fn undo(&self, window: &mut Window) {
        window.key_with(CTRL, Key::Z);
    }

    fn export(&self, window: &mut Window, path: &Path) {
        window.palette("export labels as csv");
        window.answer_path("Save to", path);
        window.until("the file", |_| path.is_file());
    }

    fn reopen(&self, window: &mut Window, folder: &Path) {
        window.key_with(CTRL, Key::L);
        window.harness.run_steps(2);
        window.key_with(CTRL, Key::A);
        window.type_text(&folder.display().to_string());
        window.key(Key::Enter);
    }

    fn move_joint(&self, window: &mut Window) {
        while window.session().joint != Some(RIGHT_WRIST) {
            window.key(Key::J);
        }
        window.nudge(Key::PageUp, 3);
    }
}

/// The sample, in a folder that may be written to.
fn sample() -> tempfile::TempDir {
    let (from, folder) = (Path::new(env!("CARGO_MANIFEST_DIR")).join("samples/walk"), tempfile::tempdir().unwrap());
    std::fs::create_dir(folder.path().join("frames")).unwrap();
    for path in std::fs::read_dir(from.join("frames")).unwrap().map(|entry| entry.unwrap().path()) {
        std::fs::copy(&path, folder.path().join("frames").join(path.file_name().unwrap())).unwrap();
    }
    std::fs::copy(from.join("dataset.toml"), folder.path().join("dataset.toml")).unwrap();
    folder
}

fn journey(hands: &dyn Hands) {
    let mut window = Window::on(sample());
    window.until("the strata", |w| w.session().strata.status == StrataStatus::Ready);

    // 1. A first fit.
    hands.run_first_fit(&mut window);
    window.until("the end of the run", |w| w.fit().status == FitStatus::Paused && w.fit().head() > 0);
    let error = |w: &Window| w.fit().shown_row().and_then(|row| row.majpe_mm).unwrap();
    assert!(error(&window) < 400.0, "{}", error(&window));

    // 2. Two presets beside each other; either can be taken.
    for preset in [Preset::Paper, Preset::Recommended] {
        hands.compare_presets(&mut window, preset);
        window.until("the preset", |w| w.session().config == preset.config() && !w.named("Take paper"));
        window.until("its fit", |w| w.fit().is_ready() && w.fit().status == FitStatus::Paused);
    }

    // 3. The hard frames.
    hands.find_hard_frames(&mut window);
    window.until("the hard frames", |w| w.listed().len() == w.session().strata.count(Stratum::Hard));
    let hard = window.listed();
    assert!(hard.len() > 4 && hard.len() < 14, "about a third of 28: {hard:?}");
    assert_eq!(window.value("Filter frames"), "stratum:hard");

    // 4. All of them fitted.
    hands.fit_them_all(&mut window);
    window.until("the batch", |w| w.session().batch.fitted() == hard.len());
    let mean = hard.iter().map(|&frame| window.session().frame_row(frame).majpe_mm.unwrap()).sum::<f64>();
    assert!(mean / (hard.len() as f64) < 250.0, "{mean}");

    // 5. Two settings swept over them.
    hands.sweep_two_settings(&mut window);
    window.until("the study", |w| w.session().study.shown().is_some_and(|run| run.complete));
    let run = window.session().study.shown().unwrap();
    assert_eq!((run.spec.study, run.table.len()), (StudyKind::Sweep, 4));
    assert!(run.table.iter().all(|row| row.frames == hard.len()));
    window.harness.run_steps(3);
    assert!(window.named("Study row 0.5, 5") && window.named("Study row 2, 20"), "{:#?}", window.names());

    // 6. Three of them tagged; 7. the last act taken back.
    hands.tag(&mut window, &hard[1..4]);
    window.until("the tags", |w| hard[1..4].iter().all(|&frame| w.tags(frame) == "F1"));
    hands.undo(&mut window);
    window.until("the last act gone", |w| w.tags(hard[3]).is_empty());
    assert!(window.session().redo_name().unwrap().starts_with("tag F1"));

    // 8. The labels at home.
    let out = tempfile::tempdir().unwrap();
    let table: PathBuf = out.path().join("labels.csv");
    let labelled = hard.iter().filter(|&&frame| !window.tags(frame).is_empty()).count();
    hands.export(&mut window, &table);
    assert_eq!(csv::Reader::from_path(&table).unwrap().records().count(), labelled);
    let tags: Vec<String> = hard.iter().map(|&frame| window.tags(frame)).collect();

    // 9. The window closed, and the data opened in another one: labels and fits are there.
    let Window { harness, folder } = window;
    drop(harness);
    let mut window = Window { harness: Window::empty(&[], [1440.0, 900.0]), folder };
    let folder = window.folder.path().to_owned();
    hands.reopen(&mut window, &folder);
    window.ready(0);
    window.apply(mhp_inspector::session::Command::SetAnnotator("ada".into()));
    window.at_rest();
    // They are read by another thread, which nothing on screen waits for.
    window.until("the labels of before", |w| hard.iter().map(|&frame| w.tags(frame)).eq(tags.iter().cloned()));
    window.until("the fits of before", |w| hard.iter().all(|&frame| w.session().frame_row(frame).iou.is_some()));

    // 10. A joint moved by hand: a branch of its own.
    window.key(Key::R);
    window.harness.run_steps(2);
    let (from, branches) = (window.joint(RIGHT_WRIST), window.fit().history.branches().len());
    hands.move_joint(&mut window);
    window.until("a joint that moved", |w| !w.session().is_dragging() && w.joint(RIGHT_WRIST) != from);
    assert_eq!(window.fit().history.branches().len(), branches + 1);
    assert!(window.session().undo_name().unwrap().starts_with("right wrist moved 0."));
}
