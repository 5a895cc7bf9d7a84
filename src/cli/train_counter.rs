//! `train-counter`: makes the weights of the person counter anew, from synthetic recordings.

use super::common::{at_least_one, epochs_bar, print, progress_bar};
use crate::people::train::{
    CounterExample, CounterLesson, MapLesson, TrainOptions, examples, pooled, recordings, train, train_on_maps,
};
use crate::people::{CLASSES, COMPARED, Confusion, Counter, CounterOptions, FEATURES, HISTORY, Network};
use crate::simulate::{Recording, ScenePreset};
use anyhow::Context as _;
use clap::{Args, ValueEnum as _};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Shown under the options of `train-counter --help`.
pub(super) const HELP: &str = "\
Simulates MMVR-like sequences with 0 to 4 people 0.6 to 2 m apart (easy, medium and hard in turn), looks at them as `count`
does, trains the network on the true counts, and tests it on sequences of another seed. The same is done with what it is
compared with: the network alone, on statistics of the maps, and a convolutional network on the maps themselves. The same
options give the same weights.

Examples:
  mhp-inspector train-counter --out assets
      Writes counter.json, counter-alone.json and counter-maps.json, and prints what they reach.
  mhp-inspector train-counter --out assets --only maps --sequences 800 --epochs 20
      The convolutional network alone, as it is committed.
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
    /// Folder for `counter.json`, `counter-alone.json` and `counter-maps.json`.
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
    /// Only this network: `counter`, `alone` or `maps`.
    #[arg(long, value_name = "NETWORK")]
    only: Option<Taught>,
}

/// A network that counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Taught {
    /// On clusters: the counter.
    Counter,
    /// On statistics of the maps.
    Alone,
    /// On the maps themselves.
    Maps,
}

impl Taught {
    const ALL: [Self; 3] = [Self::Counter, Self::Alone, Self::Maps];

    fn file(self) -> &'static str {
        match self {
            Self::Counter => "counter.json",
            Self::Alone => "counter-alone.json",
            Self::Maps => "counter-maps.json",
        }
    }

    /// As `--only` has it.
    fn word(self) -> String {
        self.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default()
    }

    /// What it learns of a frame; of the maps themselves that is [`CounterExample::maps`].
    fn lesson(self, example: &CounterExample) -> &CounterLesson {
        if self == Self::Counter { &example.counted } else { &example.alone }
    }

    /// Whether the frames of a sequence agree on a number; else each is counted by itself.
    fn agrees(self) -> bool {
        self == Self::Counter
    }
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
    for taught in Taught::ALL.into_iter().filter(|taught| args.only.is_none_or(|only| only == *taught)) {
        let options = TrainOptions { epochs: args.epochs, seed: args.seed, ..TrainOptions::default() };
        let bar = epochs_bar(args.epochs);
        let told = |_, _| bar.inc(1);
        let of = |answer: &dyn Fn(&CounterExample) -> Probabilities| header(args, taught, &lessons, &tests, answer);
        let header = if taught == Taught::Maps {
            let chosen: Vec<&MapLesson> = lessons.iter().map(|example| &example.maps).collect();
            let mut network = train_on_maps(&chosen, &options, told)?;
            network.header = of(&|example| network.probabilities(&example.maps.image));
            write(&args.out.join(taught.file()), &network)?;
            network.header
        } else {
            let chosen: Vec<CounterLesson> = lessons.iter().map(|example| taught.lesson(example).clone()).collect();
            let mut network = train(&chosen, &options, told)?;
            network.header = of(&|example| taught.lesson(example).answer(&network));
            write(&args.out.join(taught.file()), &network)?;
            network.header
        };
        bar.finish_and_clear();
        let _ = writeln!(report, "{}\n  {}\n", taught.file(), header.join("\n  "));
    }
    print(&report)?;
    Ok(ExitCode::SUCCESS)
}

/// Of 0, 1, 2, 3, and 4 or more people.
type Probabilities = [f64; CLASSES];

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
    taught: Taught,
    lessons: &[CounterExample],
    tests: &[CounterExample],
    answer: &dyn Fn(&CounterExample) -> Probabilities,
) -> Vec<String> {
    let TrainCounterArgs { sequences, test_sequences, seed, test_seed, epochs, .. } = args;
    let (learnt, answers) = (answers(lessons, taught, answer), answers(tests, taught, answer));
    let confusion = |of: &[Answer], taken: &dyn Fn(&Answer) -> bool| {
        let mut confusion = Confusion::default();
        of.iter().filter(|answer| taken(answer)).for_each(|answer| confusion.add(answer.people, answer.said));
        confusion
    };
    let full = |answer: &Answer| answer.history >= HISTORY;
    let mut lines = vec![
        format!(
            "cargo run --release --no-default-features --features train -- train-counter --out assets --sequences \
             {sequences} --test-sequences {test_sequences} --seed {seed} --test-seed {test_seed} --epochs {epochs}{}",
            if args.only.is_some() { format!(" --only {}", taught.word()) } else { String::new() }
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

/// What is said of every frame: by the counter what the frames agree on, by the others each by itself.
fn answers(
    examples: &[CounterExample],
    taught: Taught,
    answer: &dyn Fn(&CounterExample) -> Probabilities,
) -> Vec<Answer> {
    let mut said: Vec<Probabilities> = Vec::new();
    let of = |example: &CounterExample| {
        if example.history == 0 || !taught.agrees() {
            said.clear();
        }
        said.push(answer(example));
        let CounterExample { history, preset, .. } = *example;
        Answer { people: example.maps.people, said: most_probable(&pooled(&said)), history, preset }
    };
    examples.iter().map(of).collect()
}

fn most_probable(p: &Probabilities) -> usize {
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

fn write(path: &Path, network: &impl serde::Serialize) -> anyhow::Result<()> {
    let text = serde_json::to_string(network)?.replace("],[", "],\n[").replace("\",\"", "\",\n\"") + "\n";
    std::fs::write(path, text).with_context(|| format!("{}: cannot be written", path.display()))
}
