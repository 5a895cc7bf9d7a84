//! No circles: between files of different rooms, and between the stages of `mhp`.

use crate::MAY_USE;
use crate::imports::{Module, Sources};
use std::collections::{BTreeMap, BTreeSet};

/// The stages of a fit from the ground up, and the files and folders of `src/mhp/` in each: a stage uses itself and those
/// before it.
const STAGES: &[(&str, &[&str])] = &[
    ("the terms of the loss", &["terms"]),
    ("numbers", &["types", "percentile", "fill", "scalar", "lanes", "batch", "floors"]),
    ("a joint in a view", &["triad", "gaussian", "splat", "adjoint", "skin"]),
    ("cells and masks", &["kernel", "tiles", "cell_box", "level_rows", "levels", "em"]),
    ("what maps and frames around show", &["region", "sidelobes", "template", "context"]),
    ("a frame", &["frame_em", "problem", "reduced", "erased", "simulate", "returns", "signal"]),
    ("what a network expects", &["pose_network"]),
    ("the objective", &["objective"]),
    ("a window of frames", &["motion", "em_around"]),
    ("the fit", &["convergence", "articulation", "adam", "fitter"]),
    ("the start", &["init"]),
];

type Graph = BTreeMap<Module, BTreeSet<Module>>;

/// Every file from which a walk from `from` along the names it takes comes by.
fn reached(graph: &Graph, from: &Module) -> BTreeSet<Module> {
    let (mut found, mut open) = (BTreeSet::new(), vec![from]);
    while let Some(module) = open.pop() {
        for next in graph.get(module).into_iter().flatten() {
            if found.insert(next.clone()) {
                open.push(next);
            }
        }
    }
    found
}

#[test]
fn every_room_lies_below_those_that_use_it() {
    for (index, (room, below)) in MAY_USE.iter().enumerate() {
        let before: Vec<&str> = MAY_USE[..index].iter().map(|(room, _)| *room).collect();
        let later: Vec<&&str> = below.iter().filter(|room| !before.contains(room)).collect();
        assert!(later.is_empty(), "{room} may use {later:?}, which come after it");
    }
}

#[test]
fn files_of_different_rooms_form_no_circle() {
    let sources = Sources::read();
    let graph = sources.graph();
    // What the crate's root lists is no use of it.
    let inside: Graph = graph.into_iter().filter(|(module, _)| !module.is_empty()).collect();
    let reached: BTreeMap<&Module, BTreeSet<Module>> =
        inside.keys().map(|module| (module, reached(&inside, module))).collect();
    let mut wrong = Vec::new();
    for (a, from_a) in &reached {
        for b in from_a.iter().filter(|b| b.first() != a.first() && a < b) {
            if reached.get(b).is_some_and(|from_b| from_b.contains(*a)) {
                wrong.push(format!("{} and {}", sources.shown(a), sources.shown(b)));
            }
        }
    }
    assert_eq!(wrong, Vec::<String>::new());
}

#[test]
fn the_stages_of_a_fit_use_only_those_before_them() {
    let sources = Sources::read();
    let stage = |module: &Module| STAGES.iter().position(|(_, files)| files.contains(&module[1].as_str()));
    let (mut wrong, mut seen) = (Vec::new(), BTreeSet::new());
    for (module, targets) in sources.graph().iter().filter(|(module, _)| module.len() > 1 && module[0] == "mhp") {
        let Some(own) = stage(module) else {
            wrong.push(format!("{} is in no stage", sources.shown(module)));
            continue;
        };
        seen.insert(module[1].clone());
        for target in targets.iter().filter(|target| target.first().is_some_and(|room| room == "mhp")) {
            match (target.len() > 1).then(|| stage(target)).flatten() {
                Some(other) if other <= own => {}
                Some(other) => wrong.push(format!(
                    "{} ({}) uses {} ({})",
                    sources.shown(module),
                    STAGES[own].0,
                    sources.shown(target),
                    STAGES[other].0
                )),
                None => wrong.push(format!("{} uses {}", sources.shown(module), sources.shown(target))),
            }
        }
    }
    assert_eq!(wrong, Vec::<String>::new());
    let expected: BTreeSet<String> =
        STAGES.iter().flat_map(|(_, files)| *files).map(|file| (*file).to_owned()).collect();
    assert_eq!(seen, expected, "every file of the table exists");
}
