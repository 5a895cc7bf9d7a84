//! Manifests that are accepted, maps of any finite or infinite numbers, settings anywhere in their ranges: through start, fit,
//! evidence, count and strata.

use crate::material;
use crate::mutate::NUMBERS;
use mhp_inspector::config::{FIELDS, FieldKind, FitConfig, Number, Parameterization, Preset, Value};
use mhp_inspector::dataset::Dataset;
use mhp_inspector::mhp::Precision;
use mhp_inspector::study::complexity::{ComplexityOptions, compute};
use mhp_inspector::study::count::count_frames;
use mhp_inspector::study::{BatchOptions, fit_frame, frame_evidence};
use mhp_inspector::task::Progress;
use rand::Rng as _;
use rand::rngs::StdRng;
use rand::seq::IndexedRandom as _;
use std::fmt::Write as _;
use std::path::Path;

/// One data set, from opening to evidence.
pub(crate) fn whole(random: &mut StdRng, folder: &Path) {
    let precision = if random.random() { Precision::F32 } else { Precision::F64 };
    let room = if precision == Precision::F64 { MOST_CELLS / 10 } else { MOST_CELLS };
    let views: Vec<Vec<Axis>> = (0..random.random_range(1..=2)).map(|_| view(random, room)).collect();
    let frames = random.random_range(1..=3);
    let mut files = vec![("dataset.toml".to_owned(), manifest(&views, random).into_bytes())];
    for frame in 0..frames {
        let maps: Vec<(String, Vec<u8>)> =
            views.iter().enumerate().map(|(k, axes)| (format!("v{k}"), map(axes, random))).collect();
        let entries: Vec<(&str, Vec<u8>)> = maps.iter().map(|(key, bytes)| (key.as_str(), bytes.clone())).collect();
        files.push((format!("frames/{frame:03}.npz"), material::npz(&entries, false)));
    }
    material::lay_out(folder, &files);
    let dataset = match Dataset::open(folder, &Progress::new()) {
        Ok(dataset) => dataset,
        Err(error) => {
            assert!(!error.to_string().contains('\n'), "{error}");
            return;
        }
    };
    let config = config(random);
    let options = BatchOptions {
        config,
        precision,
        warm_start: false,
        params_folder: None,
        ply: false,
        curves_folder: None,
        ..BatchOptions::default()
    };
    let frame = frames - 1;
    if let Ok(fit) = fit_frame(&dataset, frame, &options, None) {
        assert!(fit.params.is_finite(), "a fit that succeeds is finite");
    }
    if let Ok(all) = frame_evidence(&dataset, frame, &options, None).evidence {
        assert!(all.iter().all(|evidence| evidence.score.is_none_or(|score| (0.0..=1.0).contains(&score))));
    }
    if let Ok(counts) = count_frames(&dataset, 0..frames, || ()) {
        let counted = counts.iter().filter_map(|row| row.count.as_ref().ok());
        for count in counted {
            assert!(count.probabilities.iter().all(|p| (0.0..=1.0).contains(p)), "{:?}", count.probabilities);
        }
    }
    let _ = compute(&dataset, &ComplexityOptions::default(), None, &Progress::new());
}

/// Cells of a map; a tenth of them in double precision. What takes long because it is large is no hang: the oracle takes every cell
/// by every joint of up to eight people, and nothing is fast without optimisation.
const MOST_CELLS: usize = if cfg!(debug_assertions) { 8_000 } else { 20_000 };

/// People whose motion is searched, at most.
const MOST_PEOPLE: usize = if cfg!(debug_assertions) { 2 } else { 4 };

struct Axis {
    kind: &'static str,
    bins: usize,
    lo: f64,
    hi: f64,
    sine: bool,
}

/// Two or three axes that a manifest may have, mostly of a few bins, now and then of thousands.
fn view(random: &mut StdRng, mut room: usize) -> Vec<Axis> {
    const KINDS: [&str; 10] = ["range", "azimuth", "elevation", "doppler", "cone", "x", "y", "z", "depth_h", "depth_v"];
    let long = random.random_range(0..12);
    (0..random.random_range(2..=3))
        .map(|k| {
            let kind = KINDS.choose(random).copied().unwrap_or("range");
            let angular = matches!(kind, "azimuth" | "elevation" | "cone");
            let sine = angular && random.random();
            let most = if sine {
                1.0
            } else if angular {
                3.0
            } else {
                *[1e-3, 1.0, 8.0, 1000.0].choose(random).unwrap_or(&8.0)
            };
            let (lo, hi) = match random.random_range(0..4) {
                0 => (0.0, most),
                1 => (most, 0.0),
                2 => (-most, most),
                _ => (random.random_range(-most..most), random.random_range(-most..most)),
            };
            let bins = if k == long { random.random_range(1000..20_000) } else { random.random_range(1..14) };
            let bins: usize = bins.min(room);
            room = (room / bins).max(1);
            Axis { kind, bins, lo, hi, sine }
        })
        .collect()
}

fn manifest(views: &[Vec<Axis>], random: &mut StdRng) -> String {
    let mut number = |usual: &str, extremes: &[&str]| -> String {
        if random.random_bool(0.2) { (*extremes.choose(random).unwrap_or(&usual)).to_owned() } else { usual.to_owned() }
    };
    let mut text = format!(
        "name = \"case\"\nlayout = \"npz\"\nframes = \"frames/*.npz\"\nframe_rate_hz = {}\nskeleton = \"{}\"\n[radar]\nstart_hz = {}\n\
         bandwidth_hz = {}\nchirp_s = {}\nframe_s = {}\nr_max_m = {}\nl_az_m = {}\nl_el_m = {}\ndoppler_features = {}\n",
        number("10.0", &["1e-6", "1e6"]),
        number("coco17", &["hupr14", "h36m17"]),
        number("77e9", &["1e6", "1e13"]),
        number("2.5e9", &["1.0", "1e13"]),
        number("60e-6", &["1e-12", "1e3"]),
        number("0.0128", &["1e-12", "1e3"]),
        number("12.0", &["1e-3", "1e5"]),
        number("0.0019", &["1e-9", "1e3"]),
        number("0.0019", &["1e-9", "1e3"]),
        number("4", &["1", "64"]),
    );
    for (k, axes) in views.iter().enumerate() {
        let psf = ["0.06", "0.03", "0.03", "0.1"].map(|usual| number(usual, &["0", "1e-300", "6.0"]));
        let at = number("0", &["1000", "-1000"]);
        let turned = number("[[1, 0, 0], [0, 1, 0], [0, 0, 1]]", &["[[0, 1, 0], [-1, 0, 0], [0, 0, 1]]"]);
        let [range, azimuth, elevation, doppler] = psf;
        let _ = write!(
            text,
            "[[view]]\narray = \"v{k}\"\npsf = {{ range_m = {range}, azimuth_rad = {azimuth}, elevation_rad = {elevation}, doppler_mps = \
             {doppler} }}\ntranslation = [{at}, 0, 0]\nrotation = {turned}\naxes = ["
        );
        for axis in axes {
            let spacing = if axis.sine { ", spacing = \"sine\"" } else { "" };
            let Axis { kind, bins, lo, hi, .. } = axis;
            let _ = write!(text, "{{ kind = \"{kind}\", bins = {bins}, lo = {lo:e}, hi = {hi:e}{spacing} }}, ");
        }
        text.push_str("]\n");
    }
    text
}

/// A map in double precision: one echo, constants, spikes, extremes, holes.
fn map(axes: &[Axis], random: &mut StdRng) -> Vec<u8> {
    let cells: usize = axes.iter().map(|axis| axis.bins).product();
    let shape = axes.iter().map(|axis| axis.bins.to_string()).collect::<Vec<_>>().join(", ");
    let extreme = NUMBERS.choose(random).and_then(|text| text.parse::<f64>().ok()).unwrap_or(1.0);
    let kind = random.random_range(0..7);
    let echo = random.random_range(0..cells.max(1));
    let numbers = (0..cells).flat_map(|cell| {
        let value = match kind {
            0 => extreme,
            1 => f64::from(u8::from(cell == echo)) * extreme,
            2 if cell % 3 == 0 => extreme,
            3 if cell % 2 == 0 => f64::NAN,
            4 => f64::from_bits(random.random()),
            _ => 0.1 + 5.0 * (-(cell as f64 - echo as f64).powi(2) / 8.0).exp(),
        };
        value.to_le_bytes()
    });
    material::npy("<f8", &format!("({shape})"), false, &numbers.collect::<Vec<u8>>())
}

/// A preset, of which some numbers lie at the ends of their ranges, and some switches and choices anywhere.
fn config(random: &mut StdRng) -> FitConfig {
    let mut config = Preset::ALL.choose(random).map(|preset| preset.config()).unwrap_or_default();
    for field in FIELDS {
        if random.random_bool(0.1) {
            let value = match &field.kind {
                FieldKind::Number(Number { range, .. }) => {
                    Value::Number(if random.random() { range.0 } else { range.1 })
                }
                FieldKind::Switch => Value::Switch(random.random()),
                FieldKind::Choice(answers) => Value::Answer(random.random_range(0..answers.len())),
            };
            field.set(&mut config, value);
        }
    }
    config.iterations = random.random_range(0..=3);
    // A search of the motion of eight people takes seconds without optimisation, as large maps do.
    if config.parameterization == Parameterization::Motion {
        config.people = config.people.min(MOST_PEOPLE);
    }
    config.validated().unwrap_or_default()
}
