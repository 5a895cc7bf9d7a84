//! How well a fit follows a finger: `w_EM` is dragged over its whole range in two seconds on the bundled sample, in the real
//! window, drawn by whatever adapter there is.
//!
//! `cargo bench --locked --bench live`. Prints what `tests/RESULTS.md` says of it. What a pass costs is time on a processor, so
//! that another program beside it does not count; how many fits are shown is by the clock.
#![expect(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a bench says what it measured, and stops where it cannot"
)]

use egui::Role;
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT as _, Queryable as _};
use mhp_inspector::app::{Begin, InspectorApp};
use mhp_inspector::config::Preset;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// The app, and what its last pass cost: not what the harness does after it, which reads the tree of a screen reader.
struct Timed {
    app: InspectorApp,
    pass: Duration,
}

impl eframe::App for Timed {
    fn logic(&mut self, ctx: &egui::Context, frame: &mut eframe::Frame) {
        let (began, before) = (Instant::now(), on_processor());
        self.app.logic(ctx, frame);
        self.pass = passed(began, before);
    }

    fn ui(&mut self, ui: &mut egui::Ui, frame: &mut eframe::Frame) {
        let (began, before) = (Instant::now(), on_processor());
        self.app.ui(ui, frame);
        self.pass += passed(began, before);
    }
}

const DRAG: Duration = Duration::from_secs(2);

fn main() {
    let sample = Path::new(env!("CARGO_MANIFEST_DIR")).join("samples/walk");
    for preset in [Preset::Recommended, Preset::Baseline] {
        let begin = Begin { paths: vec![sample.clone()], config: Some(preset.config()), ..Begin::default() };
        let mut harness = Harness::builder()
            .with_size([1280.0, 800.0])
            .with_max_steps(400)
            .wgpu()
            .build_eframe(|cc| Timed { app: InspectorApp::begin(cc, &begin), pass: Duration::ZERO });
        let began = Instant::now();
        while harness.state().app.session().fit.shown.is_none() && began.elapsed() < Duration::from_mins(1) {
            harness.step();
        }
        let session = harness.state().app.session();
        println!(
            "{}: a fit takes about {:.1} ms; live: {}",
            preset.name(),
            session.fit_ms().unwrap(),
            session.is_live()
        );
        drag(&mut harness, true);
        drag(&mut harness, false);
    }
}

/// Time that this thread was on a processor so far, where the kernel tells.
fn on_processor() -> Option<Duration> {
    // The kernel brings the number up to date when the thread offers to wait.
    std::thread::yield_now();
    let told = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    Some(Duration::from_nanos(told.split(' ').next()?.parse().ok()?))
}

/// Time on a processor since `before`; else by the clock on the wall since `began`.
fn passed(began: Instant, before: Option<Duration>) -> Duration {
    before.zip(on_processor()).map_or_else(|| began.elapsed(), |(before, now)| now.saturating_sub(before))
}

fn drag(harness: &mut Harness<'_, Timed>, painted: bool) {
    let slider = |node: &egui_kittest::Node<'_>| node.accesskit_node().role() == Role::Slider;
    let rect = harness.query_all_by_label("w_EM").find(slider).unwrap().rect();
    let at = |share: f32| egui::pos2(rect.left() + 4.0 + share * (rect.width() - 8.0), rect.center().y);
    harness.hover_at(at(0.0));
    harness.drag_at(at(0.0));
    harness.run_steps(2);
    let (mut passes, mut painting) = (Vec::new(), Vec::new());
    let (mut shown, mut last) = (0, None::<Arc<mhp_inspector::worker::Snapshot>>);
    let began = Instant::now();
    while began.elapsed() < DRAG {
        let share = began.elapsed().as_secs_f32() / DRAG.as_secs_f32();
        harness.hover_at(at(share));
        harness.step();
        passes.push(harness.state().pass);
        if painted {
            let paint = Instant::now();
            harness.render().unwrap();
            painting.push(paint.elapsed());
        }
        let now = harness.state().app.session().fit.shown.clone();
        if now.as_ref().map(Arc::as_ptr) != last.as_ref().map(Arc::as_ptr) {
            shown += 1;
            last = now;
        }
    }
    harness.drop_at(at(1.0));
    harness.run_steps(3);
    let seconds = began.elapsed().as_secs_f64();
    let told = |mut times: Vec<Duration>| {
        times.sort();
        if times.is_empty() {
            return "left out".to_owned();
        }
        let at = |q: f64| times[((times.len() - 1) as f64 * q) as usize].as_secs_f64() * 1e3;
        format!("median {:.1}, 95 % {:.1} ms", at(0.5), at(0.95))
    };
    let fits = f64::from(shown) / seconds;
    println!("  {} passes in {seconds:.2} s, {fits:.1} other fits a second shown in them", passes.len());
    println!("  a pass of the window {}; painting it {}", told(passes), told(painting));
    let session = harness.state().app.session();
    println!(
        "  left: {} branches, {:?}",
        session.fit.history.branches().len(),
        session.log.back().map(|line| &line.text)
    );
}
