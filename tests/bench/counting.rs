//! How many frames a second the counter takes on one core: detection in both maps, clusters, and the classifier.
//!
//! `cargo bench --no-default-features --bench counting`. A map is the input of one frame: two views of 256 × 128 cells as
//! MMVR has them. Everything runs in this thread (one rayon thread); what is not counted is reading and simulating.
#![expect(clippy::unwrap_used, reason = "a measurement stops where its material cannot be made")]

use mhp_inspector::people::{Counter, HISTORY, Network, Scan, map_statistics};
use mhp_inspector::simulate::{Options, Recording, ScenePreset};
use std::hint::black_box;
use std::time::{Duration, Instant};

/// Frames of each recording, one recording for each number of people.
const FRAMES: usize = 8;
/// How long is measured.
const LASTS: Duration = Duration::from_secs(4);

type Maps = Vec<Vec<f64>>;

fn recordings() -> (Counter, Vec<Vec<Maps>>) {
    let recording = |people: usize| {
        let (presets, seed) = (vec![ScenePreset::Medium], 3 + people as u64);
        let options = Options {
            presets,
            frames: FRAMES,
            sequence_length: FRAMES,
            people: Some(people..=people),
            seed,
            ..Options::default()
        };
        Recording::new(&options).unwrap()
    };
    let all: Vec<Recording> = (0..=3).map(recording).collect();
    let maps = |recording: &Recording| {
        let wide = |map: Vec<f32>| map.into_iter().map(f64::from).collect();
        (0..FRAMES).map(|k| recording.frame(k).maps.into_iter().map(wide).collect()).collect()
    };
    (Counter::new(&all[0].views()).unwrap(), all.iter().map(maps).collect())
}

/// Calls `frame` with every recording again and again; frames a second.
fn rate(recordings: &[Vec<Maps>], mut sequence: impl FnMut(&[Maps])) -> f64 {
    let (begin, mut frames) = (Instant::now(), 0);
    while begin.elapsed() < LASTS {
        for recording in recordings {
            sequence(recording);
            frames += recording.len();
        }
    }
    frames as f64 / begin.elapsed().as_secs_f64()
}

fn borrowed(maps: &Maps) -> Vec<&[f64]> {
    maps.iter().map(Vec::as_slice).collect()
}

fn main() {
    let (counter, recordings) = recordings();
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().unwrap_or(());
    let whole = rate(&recordings, |frames| {
        let mut scans: Vec<Scan> = Vec::new();
        for maps in frames {
            let before: Vec<&Scan> = scans.iter().rev().take(HISTORY).collect();
            let now = counter.scan(&borrowed(maps), &before).unwrap();
            black_box(counter.count(&now, &before));
            scans.push(now);
        }
    });
    println!("counter, two views of 256 x 128, one core: {whole:.0} frames a second");
    let network = Network::alone().unwrap();
    let alone = rate(&recordings, |frames| {
        for maps in frames {
            black_box(network.probabilities(&map_statistics(&borrowed(maps))));
        }
    });
    println!("classifier alone on statistics of the maps, one core: {alone:.0} frames a second");
}
