//! Dependencies point down only: what each room may use of the others, read from the sources.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

mod circles;
mod imports;
mod types;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Each room of `src/` and the rooms that it may use besides itself.
const MAY_USE: &[(&str, &[&str])] = &[
    ("digest", &[]),
    ("geometry", &[]),
    ("dense", &[]),
    ("escape", &[]),
    ("folders", &[]),
    ("input", &[]),
    ("task", &[]),
    ("output", &["digest"]),
    ("labels", &["escape", "folders"]),
    ("config", &["input"]),
    ("radar", &["geometry", "config"]),
    ("body", &["geometry", "radar"]),
    ("simulate", &["geometry", "config", "radar", "body"]),
    // The synthetic source is used by the training of the counter alone.
    ("people", &["geometry", "config", "radar", "simulate"]),
    ("mhp", &["dense", "geometry", "config", "radar", "body"]),
    // Diagnoses count people: two who stand close are a failure mode.
    ("diagnose", &["geometry", "config", "radar", "body", "mhp", "people", "labels"]),
    ("dataset", &["digest", "input", "task", "geometry", "folders", "output", "config", "radar", "body"]),
    ("render", &["geometry"]),
    ("start", &["geometry", "config", "radar", "body", "mhp", "people", "dataset"]),
    ("condition", &["geometry", "radar", "body", "mhp"]),
    (
        "predictions",
        &["digest", "input", "geometry", "escape", "folders", "output", "config", "body", "mhp", "dataset", "diagnose"],
    ),
    ("representation", &["geometry", "config", "radar", "body", "mhp", "people"]),
    (
        "network",
        &[
            "digest",
            "input",
            "task",
            "dense",
            "geometry",
            "output",
            "config",
            "radar",
            "body",
            "mhp",
            "dataset",
            "start",
            // Whose joints a person's are.
            "diagnose",
            "predictions",
            "representation",
        ],
    ),
    ("worker", &["task", "geometry", "config", "radar", "body", "mhp", "condition", "dataset", "start", "diagnose"]),
    // The synthetic source is used by the calibration of the evidence alone.
    (
        "study",
        &[
            "digest",
            "input",
            "task",
            "geometry",
            "escape",
            "folders",
            "output",
            "config",
            "radar",
            "body",
            "simulate",
            "mhp",
            "condition",
            "people",
            "dataset",
            "start",
            "diagnose",
            "predictions",
            "representation",
            // Studies across scenes and data sets teach networks.
            "network",
            "labels",
        ],
    ),
    (
        "explore",
        &[
            "task",
            "geometry",
            "config",
            "radar",
            "body",
            "mhp",
            "people",
            "dataset",
            "start",
            "diagnose",
            "study",
            "representation",
            "worker",
        ],
    ),
    (
        "session",
        &[
            "explore",
            "digest",
            "input",
            "task",
            "geometry",
            "escape",
            "folders",
            "output",
            "config",
            "radar",
            "body",
            "mhp",
            "condition",
            "people",
            "dataset",
            "start",
            "diagnose",
            "labels",
            "study",
            "worker",
            "predictions",
        ],
    ),
    (
        "app",
        &[
            "representation",
            "digest",
            "input",
            "task",
            "geometry",
            "folders",
            "output",
            "config",
            "radar",
            "body",
            "mhp",
            "condition",
            "dataset",
            "diagnose",
            "explore",
            "labels",
            "study",
            "worker",
            "session",
            "render",
            "predictions",
        ],
    ),
];

/// Rooms that know no window and no GPU.
const WINDOWLESS: &[&str] = &[
    "digest",
    "task",
    "geometry",
    "folders",
    "output",
    "config",
    "radar",
    "body",
    "mhp",
    "dataset",
    "diagnose",
    "labels",
    "worker",
    "session",
    "study",
    "simulate",
    "people",
    "start",
    "condition",
    "explore",
    "network",
    "predictions",
];

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files(&path));
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// The code of a file, without comments.
fn code(path: &Path) -> String {
    let text = std::fs::read_to_string(path).unwrap();
    let lines = text.lines().map(|line| line.split("//").next().unwrap_or_default());
    lines.collect::<Vec<_>>().join("\n")
}

/// Every room named after `crate::`, also in `crate::{a, b::c}`.
fn used_rooms(code: &str) -> BTreeSet<String> {
    let word =
        |text: &str| -> String { text.trim_start().chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect() };
    let mut rooms = BTreeSet::new();
    for (at, _) in code.match_indices("crate::") {
        let rest = &code[at + "crate::".len()..];
        let Some(group) = rest.strip_prefix('{') else {
            rooms.insert(word(rest));
            continue;
        };
        let (mut depth, mut start) = (0, 0);
        for (i, c) in group.char_indices() {
            match c {
                '{' => depth += 1,
                '}' if depth > 0 => depth -= 1,
                ',' | '}' if depth == 0 => {
                    rooms.insert(word(&group[start..i]));
                    start = i + 1;
                    if c == '}' {
                        break;
                    }
                }
                _ => {}
            }
        }
    }
    rooms
}

/// A file's path from its crate's root on: the program's is `src/`, the engine's `src/engine/`.
fn inside(path: &Path) -> &Path {
    let inner = path.strip_prefix(Path::new(env!("CARGO_MANIFEST_DIR")).join("src")).unwrap();
    inner.strip_prefix("engine").unwrap_or(inner)
}

/// Every source file with its room. The rooms of the two crates are one house: the program hands the engine's on.
fn sources() -> Vec<(String, PathBuf)> {
    let room = |path: &Path| {
        let first = inside(path).components().next().unwrap();
        first.as_os_str().to_str().unwrap().trim_end_matches(".rs").to_owned()
    };
    files(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src")).into_iter().map(|path| (room(&path), path)).collect()
}

#[test]
fn rooms_are_found_in_every_form_of_use() {
    let text = "use crate::{body::{Pppr, Group}, radar, mhp::em::x};\nlet a = crate::config::FIELDS; pub(crate) fn f()";
    let expected = ["body", "config", "mhp", "radar"];
    assert_eq!(used_rooms(text).iter().map(String::as_str).collect::<Vec<_>>(), expected);
}

#[test]
fn every_room_uses_only_what_lies_below_it() {
    let mut seen = BTreeSet::new();
    let mut wrong = Vec::new();
    for (room, path) in sources() {
        let Some((_, below)) = MAY_USE.iter().find(|(name, _)| *name == room) else { continue };
        seen.insert(room.clone());
        for used in used_rooms(&code(&path)) {
            let known = MAY_USE.iter().any(|(name, _)| *name == used) || used == "cli";
            if known && used != room && !below.contains(&used.as_str()) {
                wrong.push(format!("{} uses {used}", path.display()));
            }
        }
    }
    assert_eq!(wrong, Vec::<String>::new());
    let expected: BTreeSet<String> = MAY_USE.iter().map(|(room, _)| (*room).to_owned()).collect();
    assert_eq!(seen, expected, "every room of the table exists");
}

#[test]
fn rooms_below_the_window_know_neither_egui_nor_wgpu() {
    let mut wrong = Vec::new();
    for (room, path) in sources() {
        let code = code(&path);
        let banned: &[&str] = match room.as_str() {
            room if WINDOWLESS.contains(&room) => &["egui", "eframe", "wgpu", "rfd::"],
            "render" => &["egui", "eframe::App", "rfd::"],
            _ => &[],
        };
        // wgpu itself is taken from eframe: that is no use of the window.
        let code = code.replace("eframe::wgpu", "wgpu").replace("eframe::egui_wgpu", "wgpu");
        wrong.extend(banned.iter().filter(|word| code.contains(**word)).map(|w| format!("{}: {w}", path.display())));
    }
    assert_eq!(wrong, Vec::<String>::new());
}

/// What a text names that looks like a file or folder of this repository: `kernel.rs`, `mhp/init`, `assets/limbs.json`, `train/`.
fn named_paths(text: &str) -> Vec<String> {
    const ENDINGS: [&str; 5] = ["rs", "wgsl", "json", "toml", "md"];
    let part_of = |c: char| c.is_ascii_alphanumeric() || "_/.-".contains(c);
    let words = text.split(|c: char| !part_of(c)).map(|word| word.trim_matches(['.', '-']));
    let is_path = |word: &&str| {
        let source =
            word.rsplit_once('.').is_some_and(|(stem, ending)| !stem.is_empty() && ENDINGS[..2].contains(&ending));
        let first = word.split('/').next().unwrap_or_default();
        let room = MAY_USE.iter().any(|(room, _)| *room == first)
            || ["src", "tests", "assets", "samples", "cli"].contains(&first);
        let folder = word.contains('/') && room && !word.ends_with("//");
        source || folder
    };
    words.filter(is_path).map(str::to_owned).collect()
}

#[test]
fn paths_are_found_in_a_text() {
    let text = "in `splat.rs` (f64), `tiles/mod.rs` and assets/limbs.json. Weighs and/or m/s, a 3/4 share, mhp/init too; n.rs.";
    assert_eq!(named_paths(text), ["splat.rs", "tiles/mod.rs", "assets/limbs.json", "mhp/init", "n.rs"]);
}

/// A file that moved takes its mention in the documentation along.
#[test]
fn every_path_that_a_module_names_exists() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let (mut wrong, mut seen) = (Vec::new(), 0);
    for (_, file) in sources() {
        let text = std::fs::read_to_string(&file).unwrap();
        let docs: Vec<&str> = text.lines().filter_map(|line| line.trim_start().strip_prefix("//!")).collect();
        let folder = file.parent().unwrap();
        let roots = ["src", "src/engine", ""].map(|place| root.join(place));
        let places = [&[folder.to_owned(), file.with_extension("")], roots.as_slice()].concat();
        for path in named_paths(&docs.join("\n")) {
            seen += 1;
            let there = |place: &PathBuf| place.join(&path).exists() || place.join(format!("{path}.rs")).exists();
            if !places.iter().any(there) {
                wrong.push(format!("{} names {path}", file.strip_prefix(root).unwrap().display()));
            }
        }
    }
    assert!(seen > 50, "{seen} paths are named");
    assert_eq!(wrong, Vec::<String>::new());
}

/// Files that say whose maps are imitated, or whose figures the paper has: names of data sets, not of their files.
const NAME_DATA_SETS: [&str; 6] = [
    "src/engine/simulate/",
    "src/cli/simulate/",
    "src/study/calibrate.rs",
    "src/study/radars.rs",
    "src/study/run/paper.rs",
    "src/study/run/plans.rs",
];

/// The layouts of published data sets, read from the files that implement them: `mmvr`, `hupr`…
fn published_layouts(root: &Path) -> Vec<String> {
    let code = files(&root.join("src/dataset/layout")).into_iter().map(|path| code(&path));
    let word = |code: String| {
        let after = code.split_once("fn word(&self)")?.1;
        code.contains("fn preset_text").then(|| after.split('"').nth(1).map(str::to_owned)).flatten()
    };
    code.filter_map(word).collect()
}

/// What is asked of a layout is a method of its trait: another one is a file and a line in the registry.
#[test]
fn layouts_are_known_by_name_in_their_own_files_alone() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let layouts = published_layouts(root);
    assert!(["mmvr", "hupr", "xrf55", "dummy"].iter().all(|word| layouts.iter().any(|l| l == word)), "{layouts:?}");
    let mut wrong = Vec::new();
    for (_, path) in sources() {
        let place = path.strip_prefix(root).unwrap().display().to_string();
        if place.starts_with("src/dataset/layout/") || NAME_DATA_SETS.iter().any(|known| place.starts_with(known)) {
            continue;
        }
        let code = code(&path);
        for word in layouts.iter().filter(|word| *word != "dummy") {
            let (head, tail) = word.split_at(1);
            let named = [format!("\"{word}\""), format!("{}{tail}", head.to_uppercase()), format!("{word}::")];
            // In the middle of a word it is another word.
            let begins = |at: usize| !code[..at].ends_with(|c: char| c.is_alphanumeric());
            let is_there = |name: &&String| code.match_indices(name.as_str()).any(|(at, _)| begins(at));
            wrong.extend(named.iter().filter(is_there).map(|name| format!("{place}: {name}")));
        }
    }
    assert_eq!(wrong, Vec::<String>::new());
}

/// The front page leads only to what is there.
#[test]
fn every_link_of_the_readme_leads_somewhere() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(root.join("README.md")).unwrap();
    let links: Vec<&str> = text.split("](").skip(1).filter_map(|rest| rest.split(')').next()).collect();
    let inside: Vec<&str> = links.into_iter().filter(|link| !link.contains("://")).collect();
    let broken: Vec<&&str> = inside.iter().filter(|link| !root.join(link).exists()).collect();
    assert!(inside.len() > 10, "{inside:?}");
    assert!(broken.is_empty(), "{broken:?}");
    assert!(text.len() <= 9 * 1024, "{} bytes", text.len());
}
