//! Mutated inputs for every reader and for the whole pipeline: no panic, no abort, no hang over two seconds, nothing over a gibibyte.
//!
//! Each target makes its inputs from a number, so that a failure names what brings it back. As ordinary tests they try a few
//! hundred inputs each; `cargo test --release --no-default-features --test fuzz -- --ignored` tries a million; `MHP_FUZZ_INPUT=7` tries one.
#![expect(clippy::unwrap_used, reason = "a test stops where its material cannot be made")]

mod bombs;
mod harness;
mod material;
mod mutate;
mod pipeline;
mod readers;

use cap::Cap;
use std::alloc::System;

/// What every input together may hold; an allocation beyond it ends the process.
#[global_allocator]
static ALLOCATOR: Cap<System> = Cap::new(System, 1 << 30);

/// A target as a short and as a long test: name, inputs in each, what is done with one.
macro_rules! targets {
    ($($name:ident: $few:literal, $many:literal, $target:path;)*) => {
        mod short {
            $(#[test]
            fn $name() {
                crate::harness::run(stringify!($name), $few, $target);
            })*
        }
        mod long {
            $(#[test]
            #[ignore = "a million inputs in all; an hour"]
            fn $name() {
                crate::harness::run(stringify!($name), $many, $target);
            })*
        }
    };
}

targets! {
    archives: 1500, 158_000, crate::readers::archive;
    manifests: 1500, 185_000, crate::readers::manifest;
    fit_configurations: 1000, 40_000, crate::readers::fit_configuration;
    parameters: 400, 60_000, crate::readers::parameters;
    captures: 200, 50_000, crate::readers::capture;
    sample_cubes: 150, 10_000, crate::readers::sample_cube;
    cascades: 100, 20_000, crate::readers::cascade;
    radars: 400, 61_000, crate::readers::radar;
    raw_clips: 150, 5_000, crate::readers::raw_clip;
    raw_pairs: 40, 1_000, crate::readers::raw_pair;
    generic_frames: 200, 50_000, crate::readers::generic;
    mmvr_frames: 200, 12_000, crate::readers::mmvr;
    hupr_frames: 150, 40_000, crate::readers::hupr;
    xrf55_frames: 150, 8_000, crate::readers::xrf55;
    hiber_frames: 150, 40_000, crate::readers::hiber;
    rt_pose_frames: 150, 15_000, crate::readers::rt_pose;
    room_transforms: 300, 50_000, crate::readers::rooms;
    stacked_files: 200, 30_000, crate::readers::stacked;
    label_journals: 200, 60_000, crate::readers::journal;
    label_tables: 300, 60_000, crate::readers::label_table;
    summaries: 300, 30_000, crate::readers::summary;
    sessions: 200, 10_000, crate::readers::session;
    run_folders: 200, 5_000, crate::readers::run_folder;
    pipeline: 60, 5_000, crate::pipeline::whole;
}
