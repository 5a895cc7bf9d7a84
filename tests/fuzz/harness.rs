//! Runs a target over its inputs and watches time and memory.

use rand::SeedableRng as _;
use rand::rngs::StdRng;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Longer than this is a hang.
const SLOWEST: Duration = Duration::from_secs(2);
/// An input that is not done after this ends the process, with its name.
const GIVEN_UP: Duration = Duration::from_mins(2);

/// The number of the one input that is to be tried.
const ONLY: &str = "MHP_FUZZ_INPUT";

/// What is done with one input: random numbers, and an empty folder.
pub(crate) type Target = fn(&mut StdRng, &Path);

/// Several targets at once would share the blame for memory and time.
static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

/// Keeps the others waiting.
pub(crate) fn alone() -> MutexGuard<'static, ()> {
    ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Tries `inputs` inputs.
pub(crate) fn run(name: &'static str, inputs: u64, target: Target) {
    let _alone = alone();
    let began = Instant::now();
    let under_way = std::sync::Arc::new((AtomicU64::new(0), AtomicU64::new(0)));
    watch(name, began, &under_way);
    let memory = Path::new("/dev/shm");
    let home = if memory.is_dir() { tempfile::tempdir_in(memory) } else { tempfile::tempdir() }.unwrap();
    let mut faults = Vec::new();
    let (mut slowest, mut slow_input) = (Duration::ZERO, 0);
    let only = std::env::var(ONLY).ok().and_then(|number| number.parse::<u64>().ok());
    for input in only.map_or(0..inputs, |one| one..one + 1) {
        under_way.1.store(input, Ordering::Relaxed);
        under_way.0.store(began.elapsed().as_millis() as u64 + 1, Ordering::Relaxed);
        let mut took = once(home.path(), name, input, target, &mut faults);
        if took > SLOWEST {
            // Somebody else may have had the processor.
            took = once(home.path(), name, input, target, &mut faults).min(took);
        }
        if took > SLOWEST {
            faults.push(format!("input {input} took {took:?}"));
        }
        if took > slowest {
            (slowest, slow_input) = (took, input);
        }
    }
    under_way.0.store(u64::MAX, Ordering::Relaxed);
    println!(
        "{name}: {inputs} inputs in {:.1} s; slowest {slowest:?} (input {slow_input}); {} MiB at most",
        began.elapsed().as_secs_f64(),
        crate::ALLOCATOR.max_allocated() >> 20
    );
    assert!(faults.is_empty(), "{name}: {} faults: {:?}", faults.len(), faults.iter().take(5).collect::<Vec<_>>());
}

fn once(home: &Path, name: &str, input: u64, target: Target, faults: &mut Vec<String>) -> Duration {
    let folder = home.join(input.to_string());
    std::fs::create_dir(&folder).unwrap();
    let seed = name.bytes().fold(input, |seed, byte| seed.wrapping_mul(0x0100_0000_01b3) ^ u64::from(byte));
    let mut random = StdRng::seed_from_u64(seed);
    let began = Instant::now();
    let done = catch_unwind(AssertUnwindSafe(|| target(&mut random, &folder)));
    let took = began.elapsed();
    if done.is_err() {
        faults.push(format!("input {input} panicked"));
    }
    std::fs::remove_dir_all(&folder).unwrap();
    took
}

/// Ends the process where an input never ends.
fn watch(name: &'static str, began: Instant, under_way: &std::sync::Arc<(AtomicU64, AtomicU64)>) {
    let seen = std::sync::Arc::clone(under_way);
    std::thread::spawn(move || {
        loop {
            std::thread::sleep(Duration::from_millis(500));
            let started = seen.0.load(Ordering::Relaxed);
            if started == u64::MAX {
                return;
            }
            let now = began.elapsed().as_millis() as u64;
            if started > 0 && now.saturating_sub(started) > GIVEN_UP.as_millis() as u64 {
                eprintln!("{name}: input {} never ends", seen.1.load(Ordering::Relaxed));
                std::process::abort();
            }
        }
    });
}
