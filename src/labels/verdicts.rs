//! How far two annotators agree in their verdicts on the count (appendix A.3; the paper reports κ = 0.91): apart from the tags, which
//! a verdict says nothing of.

use super::{Record, Verdict};
use serde::Serialize;
use std::collections::BTreeMap;

/// How two annotators judged the frames whose numbers of people differ.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VerdictAgreement {
    /// Frames with a verdict of both.
    pub frames: usize,
    /// Cohen's kappa over the four verdicts; `None` without a frame, or where both gave one and the same everywhere.
    pub kappa: Option<f64>,
    /// Share of equal verdicts; `None` without a frame.
    pub raw: Option<f64>,
    /// Frames by the verdict of the first (rows) and of the second (columns), in the order of [`Verdict::ALL`].
    pub table: [[usize; 4]; 4],
}

/// Compares the verdicts of two annotators, by the newest record of each frame.
pub fn verdict_agreement<'a>(
    a: impl IntoIterator<Item = &'a Record>,
    b: impl IntoIterator<Item = &'a Record>,
) -> VerdictAgreement {
    let (a, b) = (by_frame(a), by_frame(b));
    let mut table = [[0; 4]; 4];
    let place = |verdict: Verdict| Verdict::ALL.iter().position(|known| *known == verdict).unwrap_or(0);
    for (frame, verdict) in &a {
        if let Some(other) = b.get(frame) {
            table[place(*verdict)][place(*other)] += 1;
        }
    }
    let frames: usize = table.iter().flatten().sum();
    let same: usize = (0..4).map(|k| table[k][k]).sum();
    let row = |k: usize| table[k].iter().sum::<usize>();
    let column = |k: usize| table.iter().map(|row| row[k]).sum::<usize>();
    // In whole numbers up to one division: κ = (n Σ_k n_kk − Σ_k r_k c_k)/(n² − Σ_k r_k c_k).
    let chance: usize = (0..4).map(|k| row(k) * column(k)).sum();
    let (above, below) = ((frames * same) as f64 - chance as f64, (frames * frames) as f64 - chance as f64);
    let raw = (frames > 0).then(|| same as f64 / frames as f64);
    VerdictAgreement { frames, kappa: (below > 0.0).then(|| above / below), raw, table }
}

fn by_frame<'a>(records: impl IntoIterator<Item = &'a Record>) -> BTreeMap<&'a str, Verdict> {
    let mut newest = BTreeMap::new();
    for record in records {
        let frame = record.frame.path.as_str();
        match record.label.verdict {
            Some(verdict) => newest.insert(frame, verdict),
            // Taken back.
            None => newest.remove(frame),
        };
    }
    newest
}
