//! What the calibration reaches on held-out seeds: a reliability diagram and tables.

use crate::diagnose::{Calibration, Curve, Figures, chosen_examples};
use crate::labels::Tag;
use crate::simulate::SimulatedLayout;
use crate::study::calibrate::{FITS, JudgedFit, LAYOUTS, SCENARIOS};
use std::fmt::Write as _;

/// Bins of the predicted probability.
const BINS: usize = 10;
/// Side of a panel, and from one to the next, px.
const SIDE: f64 = 150.0;
const PITCH: f64 = 190.0;
/// Above and left of the first panel, px.
const MARGIN: [f64; 2] = [34.0, 42.0];

/// Score and whether the mode is there, of the fits that a curve judges.
fn scores(curve: &Curve, held_out: &[JudgedFit], taken: impl Fn(&JudgedFit) -> bool) -> Vec<(f64, bool)> {
    let examples: Vec<_> = held_out.iter().filter(|one| taken(one)).map(|one| one.example.clone()).collect();
    let names: Vec<&str> = curve.inputs.iter().map(|input| input.name.as_str()).collect();
    let chosen = chosen_examples(curve.mode, &names, &examples).into_iter();
    chosen.map(|(_, measures, with)| (curve.probability(measures).unwrap_or(curve.prior), with)).collect()
}

/// A bin: mean predicted probability, observed share, count.
fn bins(scores: &[(f64, bool)]) -> Vec<(f64, f64, usize)> {
    let bin_of = |p: f64| ((p * BINS as f64) as usize).min(BINS - 1);
    let bin = |k: usize| {
        let of: Vec<&(f64, bool)> = scores.iter().filter(|(p, _)| bin_of(*p) == k).collect();
        let count = of.len() as f64;
        let mean = of.iter().map(|(p, _)| p).sum::<f64>() / count;
        let observed = of.iter().filter(|(_, with)| *with).count() as f64 / count;
        (!of.is_empty()).then_some((mean, observed, of.len()))
    };
    (0..BINS).filter_map(bin).collect()
}

/// 95 % of a share that was seen `count` times (Wilson).
fn interval(share: f64, count: usize) -> [f64; 2] {
    let (n, z) = (count as f64, 1.96_f64);
    let centre = (share + z * z / (2.0 * n)) / (1.0 + z * z / n);
    let half = z / (1.0 + z * z / n) * (share * (1.0 - share) / n + z * z / (4.0 * n * n)).sqrt();
    [(centre - half).max(0.0), (centre + half).min(1.0)]
}

/// The mode, and for its second curves what they are for.
fn title(curve: &Curve) -> String {
    match curve.inputs.first().map(|input| input.name.as_str()) {
        Some("quiet_pair") => "F4, two frames".to_owned(),
        Some("close_pair_coarse") => "F3, coarse array".to_owned(),
        Some("slowness") => "F4, Doppler alone".to_owned(),
        _ => curve.mode.to_string(),
    }
}

/// Observed share by predicted probability, a panel a curve; both of the paper's fit, whose frames are independent.
pub(super) fn diagram(table: &Calibration, held_out: &[JudgedFit]) -> String {
    let width = MARGIN[1] + PITCH * table.curves.len() as f64;
    let height = MARGIN[0] + SIDE + 48.0;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" \
         style=\"max-width:100%;height:auto\" \
         font-family=\"sans-serif\" font-size=\"11\" fill=\"currentColor\" stroke=\"none\" role=\"img\">\n<title>Reliability: \
         observed share of frames with the mode by score, held-out seeds, with 95 % intervals and counts</title>\n"
    );
    for (k, curve) in table.curves.iter().enumerate() {
        let scores = scores(curve, held_out, |one| one.fit == 0);
        panel(&mut svg, MARGIN[1] + PITCH * k as f64, &title(curve), &bins(&scores), k == 0);
    }
    svg + "</svg>\n"
}

fn panel(svg: &mut String, left: f64, title: &str, bins: &[(f64, f64, usize)], first: bool) {
    let (top, bottom) = (MARGIN[0], MARGIN[0] + SIDE);
    let (x, y) = (|p: f64| left + SIDE * p, |p: f64| bottom - SIDE * p);
    let line = |svg: &mut String, from: [f64; 2], to: [f64; 2], style: &str| {
        let [(x1, y1), (x2, y2)] = [from, to].map(|[px, py]| (x(px), y(py)));
        let _ = writeln!(svg, "<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\" {style}></line>");
    };
    let text = |svg: &mut String, at: [f64; 2], anchor: &str, words: &str| {
        let [x, y] = at;
        let _ = writeln!(svg, "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{words}</text>");
    };
    let _ = writeln!(
        svg,
        "<rect x=\"{left}\" y=\"{top}\" width=\"{SIDE}\" height=\"{SIDE}\" fill=\"none\" stroke=\"currentColor\" \
         stroke-opacity=\"0.4\"></rect>"
    );
    line(svg, [0.0, 0.0], [1.0, 1.0], "stroke=\"currentColor\" stroke-opacity=\"0.4\" stroke-dasharray=\"4 3\"");
    line(svg, [0.5, 0.0], [0.5, 1.0], "stroke=\"currentColor\" stroke-opacity=\"0.15\"");
    for &(mean, observed, count) in bins {
        let [low, high] = interval(observed, count);
        line(svg, [mean, low], [mean, high], "stroke=\"#1769c2\" stroke-opacity=\"0.6\"");
        let _ =
            writeln!(svg, "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"3\" fill=\"#1769c2\"></circle>", x(mean), y(observed));
        let _ = writeln!(
            svg,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\" font-size=\"8\">{count}</text>",
            x(mean),
            y(observed.min(0.93)) - 6.0
        );
    }
    text(svg, [x(0.5), top - 10.0], "middle", title);
    for tick in [0.0, 0.5, 1.0] {
        text(svg, [x(tick), bottom + 14.0], "middle", &tick.to_string());
        if first {
            text(svg, [left - 6.0, y(tick) + 4.0], "end", &tick.to_string());
        }
    }
    text(svg, [x(0.5), bottom + 30.0], "middle", "score");
    if first {
        let (cx, cy) = (left - 28.0, y(0.5));
        let _ = writeln!(
            svg,
            "<text x=\"{cx:.1}\" y=\"{cy:.1}\" text-anchor=\"middle\" transform=\"rotate(-90 {cx:.1} {cy:.1})\">observed \
             share</text>"
        );
    }
}

/// Figures, reliability and confusion as Markdown.
pub(super) fn tables(table: &Calibration, held_out: &[JudgedFit]) -> String {
    let mut text = format!("Made by `{}`", table.command);
    for set in &table.sets {
        let seeds: Vec<String> = set.seeds.iter().map(ToString::to_string).collect();
        let _ = write!(text, "; {}: {} frames, {} fits, seeds {}", set.role, set.frames, set.fits, seeds.join(", "));
    }
    text += ".\n\nHeld-out seeds, all fits; *before* is the uncalibrated score. 0.5 is even odds where *prior* is the share of frames \
             with the mode.\n\n| mode | prior | fits with / without | | AUC | Brier | log loss | hits at 0.5 | false alarms at 0.5 \
             |\n|---|---|---|---|---|---|---|---|---|\n";
    for curve in &table.curves {
        let [with, without] = curve.after.counts;
        let head = format!("| {} | {:.3} | {with} / {without} |", title(curve), curve.prior);
        let _ = writeln!(text, "{head} before | {}", figures(&curve.before));
        let _ = writeln!(text, "| | | | after | {}", figures(&curve.after));
    }
    text += "\nAUC after, by layout and by fit:\n\n| mode |";
    let columns = LAYOUTS.map(SimulatedLayout::word).into_iter().chain(FITS);
    let columns: Vec<&str> = columns.collect();
    let _ = writeln!(text, " {} |\n|---|{}", columns.join(" | "), "---|".repeat(columns.len()));
    for curve in &table.curves {
        let by_layout = LAYOUTS.map(|layout| scores(curve, held_out, |one| one.layout == layout));
        let by_fit = [0, 1].map(|fit| scores(curve, held_out, |one| one.fit == fit));
        let cell = |of: &Vec<(f64, bool)>| {
            let found = Figures::of(of);
            if found.counts.contains(&0) { "–".to_owned() } else { format!("{:.2}", found.auc) }
        };
        let cells: Vec<String> = by_layout.iter().chain(&by_fit).map(cell).collect();
        let _ = writeln!(text, "| {} | {} |", title(curve), cells.join(" | "));
    }
    confusion(&mut text, table, held_out);
    reliability(&mut text, table, held_out);
    text
}

fn figures(figures: &Figures) -> String {
    let Figures { auc, brier, log_loss, hits, false_alarms, .. } = figures;
    let [hits, false_alarms] = [hits, false_alarms].map(|share| 100.0 * share);
    format!("{auc:.3} | {brier:.3} | {log_loss:.3} | {hits:.0} % | {false_alarms:.1} % |")
}

/// Rows: what was simulated; columns: share of the fits of which each mode scores above 0.5.
fn confusion(text: &mut String, table: &Calibration, held_out: &[JudgedFit]) {
    *text += "\nShare of the fits that score above 0.5, before → after, by what was simulated (–: never judged):\n\n\
              | simulated | F1 | F2 | F3 | F4 |\n|---|---|---|---|---|\n";
    for (scenario, (name, ..)) in SCENARIOS.iter().enumerate() {
        let cell = |mode: &Tag| {
            let (mut before, mut after) = (Vec::new(), Vec::new());
            for one in held_out.iter().filter(|one| one.scenario == scenario) {
                let Some((raw, measures)) = one.example.of(*mode) else { continue };
                let Some(curve) = table.curve(*mode, measures) else { continue };
                before.push(*raw);
                after.push(curve.probability(measures).unwrap_or(curve.prior));
            }
            let share =
                |of: &[f64]| 100.0 * of.iter().filter(|score| **score > 0.5).count() as f64 / of.len().max(1) as f64;
            if after.is_empty() {
                "–".to_owned()
            } else {
                format!("{:.0} → {:.0} %", share(&before), share(&after))
            }
        };
        let cells: Vec<String> = Tag::MODES.iter().map(cell).collect();
        let _ = writeln!(text, "| {name} | {} |", cells.join(" | "));
    }
}

fn reliability(text: &mut String, table: &Calibration, held_out: &[JudgedFit]) {
    *text += "\nReliability on held-out seeds, the paper's fit: mean score of a bin → observed share (frames):\n\n| mode | bins |\n|---|---|\n";
    for curve in &table.curves {
        let found = scores(curve, held_out, |one| one.fit == 0);
        let cell = |(mean, observed, count): &(f64, f64, usize)| format!("{mean:.2} → {observed:.2} ({count})");
        let cells: Vec<String> = bins(&found).iter().map(cell).collect();
        let _ = writeln!(text, "| {} | {} |", title(curve), cells.join(", "));
    }
}
