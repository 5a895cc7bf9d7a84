//! What a pass of the window costs its thread.

use egui_kittest::Harness;
use mhp_inspector::app::InspectorApp;
use std::time::Instant;

/// Time that this thread was on a processor so far, ms. Where the kernel does not tell, the clock on the wall.
fn cpu_ms(since: Instant) -> f64 {
    // The kernel brings the number up to date when the thread offers to wait.
    std::thread::yield_now();
    let told = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let nanoseconds: Option<f64> = told.and_then(|text| text.split(' ').next()?.parse().ok());
    nanoseconds.map_or_else(|| since.elapsed().as_secs_f64() * 1e3, |ns| ns / 1e6)
}

/// The most memory that this process ever had, MiB.
pub(super) fn peak_memory_mib() -> Option<f64> {
    memory("VmHWM:")
}

/// The memory of this process, MiB.
pub(super) fn memory_mib() -> Option<f64> {
    memory("VmRSS:")
}

fn memory(key: &str) -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix(key))?;
    Some(line.trim().trim_end_matches(" kB").parse::<f64>().ok()? / 1024.0)
}

/// Costs of the frames of one activity, ms. A frame is one pass over the panes, or two where something was laid out for the
/// first time and the window asks for its sizes before it is shown.
pub(super) struct Meter {
    name: String,
    begun: Instant,
    /// What each cost, and of how many passes it was.
    frames: Vec<(f64, usize)>,
}

impl Meter {
    pub(super) fn new(name: &str) -> Self {
        Self { name: name.into(), begun: Instant::now(), frames: Vec::new() }
    }

    /// One frame: logic, panes and the triangles that they become; what is sent to the graphics card is not in it.
    pub(super) fn pass(&mut self, harness: &mut Harness<'_, InspectorApp>) {
        self.pass_with(harness, |_| {});
    }

    /// The same, with what is done just before it.
    pub(super) fn pass_with(
        &mut self,
        harness: &mut Harness<'_, InspectorApp>,
        before: impl FnOnce(&mut Harness<'_, InspectorApp>),
    ) {
        let start = cpu_ms(self.begun);
        before(harness);
        harness.step();
        let drawn = cpu_ms(self.begun);
        let shapes = harness.output().shapes.clone();
        let from = cpu_ms(self.begun);
        let triangles = harness.ctx.tessellate(shapes, harness.ctx.pixels_per_point());
        let to = cpu_ms(self.begun);
        drop(triangles);
        let passes = harness.output().platform_output.num_completed_passes;
        self.frames.push((drawn - start + to - from, passes));
    }

    /// Median, 99th percentile and maximum of the frames, and of how many passes the longest were.
    pub(super) fn print(mut self) {
        self.frames.sort_by(|a, b| a.0.total_cmp(&b.0));
        let at = |share: f64| {
            let last = self.frames.len().saturating_sub(1);
            self.frames.get((last as f64 * share).ceil() as usize).map_or(f64::NAN, |frame| frame.0)
        };
        let over = self.frames.iter().filter(|frame| frame.0 > 16.0);
        let passes: Vec<_> = over.map(|(ms, passes)| format!("{ms:.1} of {passes}")).collect();
        println!(
            "{:<44} {:>6} frames  median {:>6.2}  p99 {:>6.2}  max {:>6.2} ms  over 16 ms: {} [{}]  ({:.2} s)",
            self.name,
            self.frames.len(),
            at(0.5),
            at(0.99),
            at(1.0),
            passes.len(),
            passes.join(", "),
            self.begun.elapsed().as_secs_f64(),
        );
    }
}
