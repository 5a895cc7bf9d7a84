//! What `complexity` prints and writes.

use super::Named;
use crate::escape::one_line;
use crate::study::complexity::{Complexity, FrameComplexity, Stratum};
use std::fmt::Write as _;

/// Frames in the list of the hardest.
const HARDEST: usize = 10;

/// A number of a frame.
type Column = fn(&FrameComplexity) -> Option<f64>;

/// Counts, quantiles and the hardest frames, for people.
pub(super) fn summary(named: &Named<'_>, complexity: &Complexity) -> String {
    let counts = &complexity.counts;
    let counted = |n: usize, what: &str| format!("{n} {what}{}", if n == 1 { "" } else { "s" });
    let (frames, sequences) = (counted(complexity.frames.len(), "frame"), counted(named.sequences, "sequence"));
    let mut text = format!("{}: {frames} in {sequences}\n", one_line(named.data_set));
    for stratum in Stratum::ALL {
        let _ = writeln!(text, "  {:<12}{:>8}", stratum.word(), counts.in_stratum(stratum));
    }
    for (word, count) in [("no hardness", counts.unranked), ("unreadable", counts.failed)] {
        if count > 0 {
            let _ = writeln!(text, "  {word:<12}{count:>8}");
        }
    }
    let _ = writeln!(text, "\n{:<18}{}  defined", "", ["min", "25 %", "median", "75 %", "max"].map(right).concat());
    let columns: [(&str, Column); 4] = [
        ("peak_density", |frame| frame.statistics.peak_density),
        ("static_dominance", |frame| frame.statistics.static_dominance),
        ("human_saliency", |frame| frame.statistics.human_saliency),
        ("hardness", |frame| frame.hardness),
    ];
    for (name, of) in columns {
        let values: Vec<f64> = complexity.frames.iter().flatten().filter_map(of).collect();
        let quantiles = crate::mhp::percentiles(&values, [0.0, 25.0, 50.0, 75.0, 100.0], &mut Vec::new());
        let cells = quantiles.map(|x| right(&number(Some(x).filter(|x| !x.is_nan())))).concat();
        let _ = writeln!(text, "{name:<18}{cells}  {:>7}", values.len());
    }
    hardest(named, complexity, &mut text);
    text
}

fn hardest(named: &Named<'_>, complexity: &Complexity, text: &mut String) {
    let hardness = |(i, frame): (usize, &Option<FrameComplexity>)| Some((frame.as_ref()?.hardness?, i));
    let mut order: Vec<(f64, usize)> = complexity.frames.iter().enumerate().filter_map(hardness).collect();
    order.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let lines: Vec<(String, &FrameComplexity)> = order
        .iter()
        .take(HARDEST)
        .filter_map(|&(_, i)| Some((one_line((named.frame)(i)).into_owned(), complexity.frame(i)?)))
        .collect();
    let width = lines.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0).max("the hardest".len());
    let head = ["hardness", "peaks", "static", "human"].map(right).concat();
    let _ = writeln!(text, "\n{:<width$}{head}", "the hardest");
    for (name, frame) in lines {
        let s = &frame.statistics;
        let cells = [frame.hardness, s.peak_density, s.static_dominance, s.human_saliency];
        let _ = writeln!(text, "{name:<width$}{}", cells.map(|x| right(&number(x))).concat());
    }
}

/// Two spaces and ten columns.
fn right(text: &str) -> String {
    format!("  {text:>10}")
}

fn number(x: Option<f64>) -> String {
    x.map_or_else(|| "-".into(), |x| format!("{x:.6}"))
}
