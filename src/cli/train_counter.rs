//! `train-counter`: makes the weights of the person counter anew, from synthetic recordings.

use super::common::{at_least_one, print, progress_bar};
use crate::people::train::{CounterExample, CounterLesson, TrainOptions, examples, pooled, recordings, train};
use crate::people::{CLASSES, COMPARED, Confusion, Counter, CounterOptions, FEATURES, HISTORY, Network};
use crate::simulate::{Recording, ScenePreset};
use anyhow::Context as _;
use clap::Args;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Shown under the options of `train-counter --help`.
pub(super) const HELP: &str = "\
Simulates MMVR-like sequences with 0 to 4 people 0.6 to 2 m apart (easy, medium and hard in turn), looks at them as `count`
does, trains the network on the true counts, and tests it on sequences of another seed. The same is done with the network
alone, on statistics of the maps, for comparison. The same options give the same weights.

Examples:
  mhp-inspector train-counter --out assets
      Writes counter.json and counter-alone.json, and prints what they reach.
  mhp-inspector train-counter --out /tmp --sequences 4 --test-sequences 2 --epochs 5
      A quick look at whether it works.";

/// Frames of a sequence that is learnt from. Few: the frames of one teach much the same, and every number of frames to
/// compare with occurs.
const LESSONS: usize = COMPARED + 2;
/// Frames of a sequence that is tested on: the last five have as many frames before them as are looked at.
const TESTS: usize = HISTORY + 5;

/// What `train-counter` is told.
#[derive(Debug, Args)]
pub struct TrainCounterArgs {
    /// Folder for `counter.json` and `counter-alone.json`.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Sequences with one person to learn from, five frames each; half as many with two, a quarter with three, an eighth
    /// with nobody and with four.
    #[arg(long, value_name = "N", default_value_t = 1600, value_parser = at_least_one)]
    sequences: usize,
    /// Sequences to test on, likewise, 24 frames each.
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = at_least_one)]
    test_sequences: usize,
    /// Seed of what is learnt from, and of the training itself.
    #[arg(long, default_value_t = 41)]
    seed: u64,
    /// Seed of what is tested on.
    #[arg(long, default_value_t = 9041)]
    test_seed: u64,
    /// Passes over the lessons.
    #[arg(long, default_value_t = TrainOptions::default().epochs, value_parser = at_least_one)]
    epochs: usize,
}

/// Runs `train-counter`.
///
/// # Errors
/// Where the seeds are the same, or a file cannot be written.
pub(super) fn run(args: &TrainCounterArgs) -> anyhow::Result<ExitCode> {
    anyhow::ensure!(args.seed != args.test_seed, "--test-seed is --seed: a test on what was learnt tells nothing");
    let lessons = simulate(args.seed, args.sequences, LESSONS)?;
    let tests = simulate(args.test_seed, args.test_sequences, TESTS)?;
    let mut report = String::new();
    for (name, pick) in [("counter", pick_counted as Pick), ("counter-alone", pick_alone as Pick)] {
        let options = TrainOptions { epochs: args.epochs, seed: args.seed, ..TrainOptions::default() };
        let chosen: Vec<CounterLesson> = lessons.iter().map(|example| pick(example).clone()).collect();
        let bar = progress_bar(args.epochs);
        let mut network = train(&chosen, &options, |_, _| bar.inc(1))?;
        bar.finish_and_clear();
        network.header = header(args, &network, &lessons, &tests, pick);
        let _ = writeln!(report, "{name}.json\n  {}\n", network.header.join("\n  "));
        write(&args.out.join(format!("{name}.json")), &network)?;
    }
    print(&report)?;
    Ok(ExitCode::SUCCESS)
}

type Pick = fn(&CounterExample) -> &CounterLesson;

fn pick_counted(example: &CounterExample) -> &CounterLesson {
    &example.counted
}

fn pick_alone(example: &CounterExample) -> &CounterLesson {
    &example.alone
}

fn simulate(seed: u64, sequences: usize, frames: usize) -> anyhow::Result<Vec<CounterExample>> {
    let recordings = recordings(seed, sequences)?;
    let views = recordings.first().map(Recording::views).unwrap_or_default();
    // Only the detections and clusters are wanted: any weights do.
    let counter = Counter::with(&views, CounterOptions::default(), Network::untrained(FEATURES))?;
    let bar = progress_bar(recordings.iter().map(Recording::sequences).sum::<usize>() * frames);
    let found = examples(&recordings, frames, &counter, || bar.inc(1))?;
    bar.finish_and_clear();
    Ok(found)
}

/// How the weights came about and what they reach, for people.
fn header(
    args: &TrainCounterArgs,
    network: &Network,
    lessons: &[CounterExample],
    tests: &[CounterExample],
    pick: Pick,
) -> Vec<String> {
    let TrainCounterArgs { sequences, test_sequences, seed, test_seed, epochs, .. } = args;
    let (learnt, answers) = (answers(lessons, network, pick), answers(tests, network, pick));
    let confusion = |of: &[Answer], taken: &dyn Fn(&Answer) -> bool| {
        let mut confusion = Confusion::default();
        of.iter().filter(|answer| taken(answer)).for_each(|answer| confusion.add(answer.people, answer.said));
        confusion
    };
    let full = |answer: &Answer| answer.history >= HISTORY;
    let mut lines = vec![
        format!(
            "cargo run --release --no-default-features --features train -- train-counter --out assets --sequences \
             {sequences} --test-sequences {test_sequences} --seed {seed} --test-seed {test_seed} --epochs {epochs}"
        ),
        format!("learnt from {} frames, tested on {} frames of another seed", lessons.len(), tests.len()),
    ];
    lines.extend(told("learnt", &confusion(&learnt, &|_| true)));
    lines.extend(told("test, all frames", &confusion(&answers, &|_| true)));
    for first in [0, 1, COMPARED] {
        let name = format!("test, frame {} of a sequence", first + 1);
        lines.extend(told(&name, &confusion(&answers, &|answer| answer.history == first)));
    }
    lines.extend(told("test, frames with enough frames before them", &confusion(&answers, &full)));
    for preset in [ScenePreset::Easy, ScenePreset::Medium, ScenePreset::Hard] {
        let of = confusion(&answers, &|answer| full(answer) && answer.preset == preset);
        lines.extend(told(&format!("test, {}, likewise", preset.word()), &of));
    }
    lines
}

/// What is said of a frame.
struct Answer {
    people: usize,
    said: usize,
    history: usize,
    preset: ScenePreset,
}

/// What is said of every frame: of the counter's lessons what the frames agree on, of the classifier alone each by itself.
fn answers(examples: &[CounterExample], network: &Network, pick: Pick) -> Vec<Answer> {
    let mut said: Vec<[f64; CLASSES]> = Vec::new();
    let of = |example: &CounterExample| {
        let lesson = pick(example);
        if example.history == 0 || !lesson.placed {
            said.clear();
        }
        said.push(lesson.answer(network));
        let CounterExample { history, preset, .. } = *example;
        Answer { people: lesson.people, said: most_probable(&pooled(&said)), history, preset }
    };
    examples.iter().map(of).collect()
}

fn most_probable(p: &[f64; CLASSES]) -> usize {
    (0..CLASSES).fold(0, |best, n| if p[n] > p[best] { n } else { best })
}

fn told(what: &str, confusion: &Confusion) -> Vec<String> {
    let share = |x: Option<f64>| x.map_or_else(|| "-".into(), |x| format!("{:.2} %", 100.0 * x));
    let each: Vec<String> = (0..CLASSES).map(|n| share(confusion.accuracy(n))).collect();
    vec![
        format!("{what}: right for 0, 1, 2, 3, 4+ people {}", each.join(", ")),
        format!("{what}: weighted 91/8/1 % {}, confusion {:?}", share(confusion.weighted()), confusion.frames),
    ]
}

fn write(path: &Path, network: &Network) -> anyhow::Result<()> {
    let text = serde_json::to_string(network)?.replace("],[", "],\n[").replace("\",\"", "\",\n\"") + "\n";
    std::fs::write(path, text).with_context(|| format!("{}: cannot be written", path.display()))
}
