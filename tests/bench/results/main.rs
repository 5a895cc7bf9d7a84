//! Writes `tests/RESULTS.md`: how exact, how good and how fast the program is, each figure by the command beside it.
//!
//! `cargo bench --no-default-features --bench results` measures all sections; `… --bench results -- fits speed` those that are
//! named, and leaves the others as they stand. Data are simulated into a temporary folder; what the shared folder beside the
//! checkout holds (real frames, another simulator, the peer for speed) is used where it is there, and said to be missing where
//! not. `MHP_PEER` is a Python that has jax, for the peer; `MHP_PROGRAM` another build of the program to be measured.
#![expect(clippy::unwrap_used, clippy::panic, reason = "a measurement stops where its material cannot be made")]

mod bed;
mod fits;
mod networks;
mod people;
mod reference;
mod rooms;
mod speed;
mod studies;
mod truth;

use bed::Bed;
use std::fmt::Write as _;
use std::path::Path;

/// A part of the file: its heading and what writes it.
struct Section {
    key: &'static str,
    heading: &'static str,
    write: fn(&Bed) -> String,
}

const SECTIONS: &[Section] = &[
    Section { key: "reference", heading: "Reference cases", write: reference::section },
    Section { key: "fits", heading: "Fits against truth", write: fits::section },
    Section { key: "rooms", heading: "Real joints in a room: HIBER and RT-Pose", write: rooms::section },
    Section { key: "people", heading: "Several people", write: people::several },
    Section { key: "networks", heading: "Networks beside the fit", write: networks::section },
    Section { key: "counting", heading: "Counting", write: people::counting },
    Section { key: "studies", heading: "Studies of the bundled sample", write: studies::section },
    Section { key: "speed", heading: "Speed", write: speed::section },
    Section { key: "growth", heading: "How an iteration grows", write: speed::growth },
    Section { key: "watched", heading: "What being watched costs", write: speed::watched },
    Section { key: "live", heading: "How a fit follows a finger", write: speed::live },
    Section { key: "explorations", heading: "Explorations", write: speed::explorations },
    Section { key: "large", heading: "A batch as large as MMVR", write: speed::large },
    Section { key: "fuzz", heading: "Mutated inputs", write: speed::fuzz },
];

const TITLE: &str = "\
# Results

Written by `cargo bench --no-default-features --bench results`; after `--` the sections may be named that are to be measured again.
Evidence scores and the counter's training have their own: [`assets/evidence.md`](../assets/evidence.md).
";

/// The text of a section in a file of before, without its heading.
fn before(file: &str, heading: &str) -> Option<String> {
    let start = file.find(&format!("\n## {heading}\n"))?;
    let text = &file[start + 1..];
    let text = &text[text.find('\n')? + 1..];
    Some(text[..text.find("\n## ").unwrap_or(text.len())].trim().to_owned())
}

fn main() {
    let asked: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with("--")).collect();
    let known = |word: &String| SECTIONS.iter().any(|section| section.key == word);
    if let Some(wrong) = asked.iter().find(|word| !known(word)) {
        let keys: Vec<&str> = SECTIONS.iter().map(|section| section.key).collect();
        panic!("no section `{wrong}`; expected one of {}", keys.join(", "));
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/RESULTS.md");
    let mut file = std::fs::read_to_string(&path).unwrap_or_default();
    let bed = Bed::new();
    // Written after each section: a measurement that is stopped leaves those before it.
    for section in SECTIONS.iter().filter(|section| asked.is_empty() || asked.iter().any(|word| word == section.key)) {
        eprintln!("{} ...", section.key);
        let measured = format!("{}\n\n{}", bed.machine(), (section.write)(&bed).trim());
        let mut text = TITLE.to_owned();
        for each in SECTIONS {
            let body = if each.key == section.key { Some(measured.clone()) } else { before(&file, each.heading) };
            let body = body.unwrap_or_else(|| "Not measured yet.".to_owned());
            writeln!(text, "\n## {}\n\n{body}", each.heading).unwrap();
        }
        std::fs::write(&path, &text).unwrap();
        file = text;
    }
    eprintln!("{}", path.display());
}
