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

/// Costs of the passes of one activity, ms.
pub(super) struct Meter {
    name: String,
    begun: Instant,
    passes: Vec<f64>,
}

impl Meter {
    pub(super) fn new(name: &str) -> Self {
        Self { name: name.into(), begun: Instant::now(), passes: Vec::new() }
    }

    /// One pass: logic, panes and the triangles that they become; what is sent to the graphics card is not in it.
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
        self.passes.push(drawn - start + to - from);
    }

    /// Median, 99th percentile and maximum.
    pub(super) fn print(mut self) {
        self.passes.sort_by(f64::total_cmp);
        let at = |share: f64| {
            let last = self.passes.len().saturating_sub(1);
            self.passes.get((last as f64 * share).ceil() as usize).copied().unwrap_or(f64::NAN)
        };
        let over = self.passes.iter().filter(|&&ms| ms > 16.0).count();
        println!(
            "{:<44} {:>6} passes  median {:>6.2}  p99 {:>6.2}  max {:>6.2} ms  over 16 ms: {over}  ({:.2} s)",
            self.name,
            self.passes.len(),
            at(0.5),
            at(0.99),
            at(1.0),
            self.begun.elapsed().as_secs_f64(),
        );
    }
}
