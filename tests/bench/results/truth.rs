//! Where fits end that begin at the truth, beside those from the program's own start: whether the loss knows the pose.

use super::bed::{Bed, row, table};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Losses that are nearer to each other than this are of one pose.
const SAME_POSE: f64 = 0.03;

/// Of the frames of rows files that are fitted from both starts: errors of both fits, mm, and the own loss by that from the truth.
#[derive(Default)]
struct Pairs {
    /// Frames in which a fit was held at its start.
    held: usize,
    own_mm: Vec<f64>,
    truth_mm: Vec<f64>,
    by_truth: Vec<f64>,
}

impl Pairs {
    fn add(&mut self, rows: &Path) {
        let mut reader = csv::Reader::from_path(rows).unwrap();
        let mut frames: BTreeMap<String, BTreeMap<String, ([f64; 2], bool)>> = BTreeMap::new();
        for row in reader.deserialize::<BTreeMap<String, String>>() {
            let row = row.unwrap();
            let figures = ["loss", "majpe_mm"].map(|key| row[key].parse::<f64>().ok());
            if let (true, [Some(loss), Some(majpe)]) = (row["count_matched"] == "true", figures) {
                frames
                    .entry(row["index"].clone())
                    .or_default()
                    .insert(row["start"].clone(), ([loss, majpe], row["held"] == "true"));
            }
        }
        for of in frames.values() {
            let (Some(own), Some(truth)) = (of.get("own"), of.get("truth")) else { continue };
            if own.1 || truth.1 {
                self.held += 1;
                continue;
            }
            let ([own, own_mm], [truth, truth_mm]) = (&own.0, &truth.0);
            self.own_mm.push(*own_mm);
            self.truth_mm.push(*truth_mm);
            self.by_truth.push(own / truth);
        }
    }

    fn cells(&self, data: &str) -> Vec<String> {
        let share = |below: f64| {
            let count = self.by_truth.iter().filter(|ratio| **ratio < below).count();
            format!("{:.0} %", 100.0 * count as f64 / self.by_truth.len() as f64)
        };
        let [own, truth, margin] = [&self.own_mm, &self.truth_mm, &self.by_truth].map(|numbers| median(numbers));
        vec![
            data.to_owned(),
            self.own_mm.len().to_string(),
            self.held.to_string(),
            format!("{own:.0}"),
            format!("{truth:.0}"),
            format!("{:+.1} %", 100.0 * (margin - 1.0)).replace('-', "−"),
            share(1.0),
            share(1.0 - SAME_POSE),
        ]
    }
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
    ];
    let mut rows = vec![row(&head)];
    for (name, sets) in data {
        let mut pairs = Pairs::default();
        for set in sets {
            let run = format!("{}-truth", set.file_name().unwrap().to_string_lossy());
            pairs.add(&bed.study("truth", set, &run, &["--preset", "recommended"]).join("rows.csv"));
        }
        rows.push(pairs.cells(name));
    }
    format!(
        "`study truth DATA --preset recommended`: fits that begin at the truth beside those from the program's own start, in the frames \
         where neither is held at its start. Two fits that end in one pose differ in their losses by less than 3 %.\n\n{}",
        table(&rows)
    )
}
