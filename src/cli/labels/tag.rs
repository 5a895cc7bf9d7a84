//! `labels tag`: the journal that the window writes, from a command line or from a script that reads acknowledgements.

use super::request::{Frames, Request};
use crate::cli::common::{open, print, print_json};
use crate::cli::frames::FrameRange;
use crate::dataset::Dataset;
use crate::escape::one_line;
use crate::labels::{Change, FrameId, Journal, Judged, LabelPlace, Tag, Verdict};
use anyhow::{Context as _, anyhow, bail};
use serde_json::json;
use std::io::BufRead as _;
use std::path::PathBuf;
use std::process::ExitCode;
use std::str::FromStr;

/// Shown under the options of `labels tag --help`.
pub(super) const HELP: &str = "\
`clean` and F1 to F4 exclude each other: adding one removes the other.

With --from-stdin each line is a JSON object {\"frame\": name or index, \"add\": [tags], \"remove\": [tags], \"note\": text,
\"person\": number or null, \"verdict\": verdict or null}; all but `frame` may be left out. After each, when it is on disk,
one line {\"frame\": name, \"tags\": [tags], \"ack\": line} is written to standard output.

A verdict says why a frame is annotated with another number of people than is counted: annotation-error (the annotation is
wrong: another number of people, or joints given to the wrong person), detection-error (the count is), both-incorrect,
true-negative (both are right: the numbers differ only by a variation of the tracking that passes).

Exit codes: 0 on disk; 2 bad input, or it cannot be written.

Examples:
  mhp-inspector labels tag data/mmvr --annotator anna --frame 383 --add F1 --add F3 --note 'two at the wall'
      One frame, two tags and a note.
  mhp-inspector labels tag data/mmvr --annotator anna --frames 100..200 --remove F4
      A hundred frames in one act.
  mhp-inspector labels tag data/mmvr --annotator anna --from-stdin < requests.jsonl
      A line an act, each acknowledged.";

/// A value, or `none` to take it back.
#[derive(Debug, Clone)]
struct OrNone<T>(Option<T>);

impl<T: FromStr<Err: std::fmt::Display>> FromStr for OrNone<T> {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text.eq_ignore_ascii_case("none") {
            return Ok(Self(None));
        }
        text.parse().map(|value| Self(Some(value))).map_err(|why: T::Err| format!("{why}; or `none`"))
    }
}

/// What `labels tag` is told.
#[derive(Debug, clap::Args)]
pub struct TagArgs {
    /// The data set.
    path: PathBuf,
    /// Who tags.
    #[arg(long, value_name = "NAME")]
    annotator: String,
    /// A frame, by its name or, where none has that name, by its index from 0. May be given several times.
    #[arg(long, value_name = "F")]
    frame: Vec<String>,
    /// Frames by index, as `5..12`, `5..=11`, `5..` or `..12`.
    #[arg(long, value_name = "A..B")]
    frames: Option<FrameRange>,
    /// A tag to add: F1, F2, F3, F4, clean, unsure. May be given several times.
    #[arg(long, value_name = "TAG")]
    add: Vec<Tag>,
    /// A tag to remove. May be given several times.
    #[arg(long, value_name = "TAG")]
    remove: Vec<Tag>,
    /// The note; empty to remove it.
    #[arg(long, value_name = "TEXT")]
    note: Option<String>,
    /// The person meant, from 0; `none` for nobody in particular.
    #[arg(long, value_name = "N")]
    person: Option<OrNone<u32>>,
    /// annotation-error, detection-error, both-incorrect, true-negative; `none` to take it back.
    #[arg(long, value_name = "V")]
    verdict: Option<OrNone<Verdict>>,
    /// Read what to do from standard input, a JSON object a line.
    #[arg(long, conflicts_with_all = ["frame", "frames", "add", "remove", "note", "person", "verdict"])]
    from_stdin: bool,
    /// A manifest (as `dataset.toml`) that says what PATH is, instead of its own or the preset.
    #[arg(long, value_name = "FILE")]
    manifest: Option<PathBuf>,
}

/// Commits one act, or one a line of standard input.
///
/// # Errors
/// Where the data set cannot be opened, a frame is not in it, a request is not understood, or the journal cannot be
/// written. What was acknowledged before stays.
pub(super) fn run(args: &TagArgs) -> anyhow::Result<ExitCode> {
    let dataset = open(&args.path, args.manifest.as_deref())?;
    let frames = Frames::new(&dataset);
    if args.from_stdin {
        return from_stdin(&mut journal(args, &dataset)?, &frames);
    }
    let change = args.request().change().map_err(|why| anyhow!("{why}"))?;
    if change == Change::default() {
        bail!("nothing to do; expected --add, --remove, --note, --person, --verdict or --from-stdin");
    }
    let chosen = args.chosen(&frames)?;
    if chosen.is_empty() {
        bail!("no frame; expected --frame, --frames or --from-stdin");
    }
    let act = act_words(&change, &chosen);
    let mut journal = journal(args, &dataset)?;
    let changes: Vec<_> = chosen.into_iter().map(|frame| (frame, change.clone())).collect();
    let outcomes = journal.commit(&act, &changes, &Judged::default())?;
    let done = format!("{act}: {} changed, in {}", counted(outcomes.len()), journal.path().display());
    print(&(one_line(&done).into_owned() + "\n"))?;
    Ok(ExitCode::SUCCESS)
}

/// The journal that is written.
fn journal(args: &TagArgs, dataset: &Dataset) -> anyhow::Result<Journal> {
    let place = LabelPlace::of(&dataset.info().root, dataset.fingerprint())?;
    if let Some(reason) = &place.reason {
        tracing::warn!("labels are kept in {}, because {reason}", place.folder.display());
    }
    let journal = Journal::open(&place, &args.annotator, dataset.fingerprint())?;
    journal.warnings().iter().for_each(|warning| tracing::warn!("{warning}"));
    Ok(journal)
}

impl TagArgs {
    fn request(&self) -> Request {
        Request {
            frame: None,
            add: self.add.clone(),
            remove: self.remove.clone(),
            note: self.note.clone(),
            person: self.person.clone().map(|person| person.0),
            verdict: self.verdict.clone().map(|verdict| verdict.0),
        }
    }

    /// The frames that are named, each once, in the order of the data set.
    fn chosen(&self, frames: &Frames<'_>) -> anyhow::Result<Vec<FrameId>> {
        let mut chosen = self.frame.iter().map(|name| frames.find(name)).collect::<Result<Vec<_>, _>>();
        let chosen = chosen.as_mut().map_err(|why| anyhow!("--frame: {why}"))?;
        if let Some(range) = self.frames {
            let range = range.within(frames.len()).map_err(|why| anyhow!("--frames: {why}"))?;
            chosen.extend(range.map(|index| frames.at(index)));
        }
        chosen.sort_unstable_by(|a, b| (a.index, &a.path).cmp(&(b.index, &b.path)));
        chosen.dedup();
        Ok(std::mem::take(chosen))
    }
}

/// The act as the journal tells it: `tag F2 on 12 frames`.
fn act_words(change: &Change, frames: &[FrameId]) -> String {
    let mut words = Vec::new();
    // What `clean` and the failure modes take away from each other goes without saying.
    if !change.add.is_empty() {
        words.push(format!("tag {}", change.add));
    } else if !change.remove.is_empty() {
        words.push(format!("untag {}", change.remove));
    }
    words.extend(change.note.as_ref().map(|_| "note".to_owned()));
    words.extend(change.person.map(|person| person.map_or("no person".into(), |person| format!("person {person}"))));
    words.extend(change.verdict.map(|verdict| verdict.map_or("no verdict".into(), |verdict| verdict.to_string())));
    let on = match frames {
        [one] => one.path.clone(),
        many => counted(many.len()),
    };
    format!("{} on {on}", words.join(", "))
}

fn counted(frames: usize) -> String {
    format!("{frames} {}", if frames == 1 { "frame" } else { "frames" })
}

fn from_stdin(journal: &mut Journal, frames: &Frames<'_>) -> anyhow::Result<ExitCode> {
    for (k, line) in std::io::stdin().lock().lines().enumerate() {
        let place = || format!("standard input, line {}", k + 1);
        let line = line.with_context(place)?;
        if line.trim().is_empty() {
            continue;
        }
        let request: Request = serde_json::from_str(&line).with_context(place)?;
        let change = request.change().map_err(|why| anyhow!("{why}")).with_context(place)?;
        let name = request.frame.context("missing field `frame`").with_context(place)?;
        let frame = frames.find(&name).map_err(|why| anyhow!("{why}")).with_context(place)?;
        let act = act_words(&change, std::slice::from_ref(&frame));
        let path = frame.path.clone();
        journal.commit(&act, &[(frame, change)], &Judged::default())?;
        let tags = journal.label(&path).map(|label| label.tags).unwrap_or_default();
        print_json(&format!("{}\n", json!({ "frame": path, "tags": tags, "ack": k + 1 })))?;
    }
    Ok(ExitCode::SUCCESS)
}
