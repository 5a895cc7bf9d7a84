//! Where fits end that begin at the truth, beside those from the program's own start: whether the loss knows the pose. And where those
//! end whose joints were given a little off.

use super::bed::{Bed, row, table};
use mhp_inspector::config::Preset;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Losses that are nearer to each other than this are of one pose.
const SAME_POSE: f64 = 0.03;

/// Starts at the truth: as the settings are, without what holds a fit there, and given off by so much.
const TRUTH: &str = "truth";
const FREE: &str = "truth, w_given = 0";
const OFF: [&str; 2] = ["truth ± 30 mm", "truth ± 60 mm"];

/// A fit of a frame.
#[derive(Clone, Copy)]
struct Fit {
    /// Its loss but for L_given, which a fit from its own start has none of.
    loss: f64,
    start_mm: f64,
    mm: f64,
    held: bool,
}

/// Of the frames of rows files that are fitted from their own start and from the truth: each fit by where it began.
#[derive(Default)]
struct Pairs {
    /// Frames in which a fit was held at its start.
    held: usize,
    frames: Vec<BTreeMap<String, Fit>>,
}

impl Pairs {
    fn add(&mut self, rows: &Path) {
        let w_given = Preset::Recommended.config().w_given;
        let mut reader = csv::Reader::from_path(rows).unwrap();
        let mut frames: BTreeMap<String, BTreeMap<String, Fit>> = BTreeMap::new();
        for row in reader.deserialize::<BTreeMap<String, String>>() {
            let row = row.unwrap();
            let number = |key: &str| row[key].parse::<f64>().ok();
            let figures = ["loss", "given", "init_majpe_mm", "majpe_mm"].map(number);
            if let (true, [Some(loss), Some(given), Some(start_mm), Some(mm)]) =
                (row["count_matched"] == "true", figures)
            {
                let weight = if row["start"] == FREE { 0.0 } else { w_given };
                let fit = Fit { loss: loss - weight * given, start_mm, mm, held: row["held"] == "true" };
                frames.entry(row["index"].clone()).or_default().insert(row["start"].clone(), fit);
            }
        }
        for of in frames.into_values() {
            let (Some(own), Some(truth)) = (of.get("own"), of.get(TRUTH)) else { continue };
            if own.held || truth.held {
                self.held += 1;
            } else {
                self.frames.push(of);
            }
        }
    }

    /// A number of every frame that has the fits which it is of.
    fn numbers(&self, of: impl Fn(&BTreeMap<String, Fit>) -> Option<f64>) -> Vec<f64> {
        self.frames.iter().filter_map(of).collect()
    }

    fn cells(&self, data: &str) -> Vec<String> {
        let error = |start: &str| median(&self.numbers(|fits| Some(fits.get(start)?.mm)));
        let by = |start: &str| self.numbers(|fits| Some(fits.get("own")?.loss / fits.get(start)?.loss));
        let share = |start: &str, below: f64| {
            let ratios = by(start);
            let count = ratios.iter().filter(|ratio| **ratio < below).count();
            format!("{:.0} %", 100.0 * count as f64 / ratios.len() as f64)
        };
        vec![
            data.to_owned(),
            self.frames.len().to_string(),
            self.held.to_string(),
            format!("{:.0}", error("own")),
            format!("{:.0}", error(TRUTH)),
            format!("{:+.1} %", 100.0 * (median(&by(TRUTH)) - 1.0)).replace('-', "−"),
            share(TRUTH, 1.0),
            share(TRUTH, 1.0 - SAME_POSE),
            format!("{:.0}", error(FREE)),
            share(FREE, 1.0),
        ]
    }

    /// Of each start that is off: its errors before and after the fit, and how often that is better.
    fn refined(&self, data: &str) -> Vec<String> {
        let of_start = |start: &str| {
            let [before, after] = [|fit: &Fit| fit.start_mm, |fit: &Fit| fit.mm]
                .map(|of| mean(&self.numbers(|fits| fits.get(start).filter(|fit| !fit.held).map(of))));
            let better = |fit: &Fit| f64::from(u8::from(fit.mm < fit.start_mm));
            let better = mean(&self.numbers(|fits| fits.get(start).filter(|fit| !fit.held).map(better)));
            [format!("{before:.0} → {after:.0}"), format!("{:.0} %", 100.0 * better)]
        };
        std::iter::once(data.to_owned()).chain(OFF.into_iter().flat_map(of_start)).collect()
    }
}

fn mean(numbers: &[f64]) -> f64 {
    numbers.iter().sum::<f64>() / numbers.len() as f64
}

fn median(numbers: &[f64]) -> f64 {
    let mut sorted = numbers.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
}

/// The table of these data sets, `recommended`.
pub(crate) fn section(bed: &Bed, data: &[(String, Vec<PathBuf>)]) -> String {
    let head = [
        "data",
        "frames",
        "held at a start",
        "own start: median MAJPE, mm",
        "from the truth: median MAJPE, mm",
        "own loss by that, median",
        "own loss below it",
        "by over 3 %",
        "w_given = 0: median MAJPE, mm",
        "own loss below it",
    ];
    let refined = ["data", "30 mm an axis: MAJPE, mm", "better", "60 mm an axis: MAJPE, mm", "better"];
    let (mut rows, mut off) = (vec![row(&head)], vec![row(&refined)]);
    for (name, sets) in data {
        let mut pairs = Pairs::default();
        for set in sets {
            let run = format!("{}-truth", set.file_name().unwrap().to_string_lossy());
            pairs.add(&bed.study("truth", set, &run, &["--preset", "recommended"]).join("rows.csv"));
        }
        rows.push(pairs.cells(name));
        off.push(pairs.refined(name));
    }
    format!(
        "`study truth DATA --preset recommended`: fits that begin at the truth beside those from the program's own start, in the frames \
         where neither is held at its start. L_given holds those that begin at the truth there and is left out of losses; without it \
         (`w_given = 0`) a fit follows what noise and the model's lacks say. Two fits that end in one pose differ in their losses by \
         less than 3 %.\n\n{}\n\
         Joints given with errors, as a network's: before the fit and after it, means of the same frames.\n\n{}",
        table(&rows),
        table(&off)
    )
}
