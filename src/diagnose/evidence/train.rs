//! Fitting of the curves: logistic regression with weights that may not be negative, isotonic regression of its z, and the
//! figures that say how good probabilities are.
//!
//! Which of the two a curve is, is decided on what it has not seen: each seed that is learned from is left out in turn, and
//! the lower log loss over all of them wins. The held-out seeds of the report have no say in it.

use super::Measure;
use super::calibration::{CURVES, Curve, Figures, Input};
use crate::labels::Tag;

/// Probabilities are held this far from 0 and 1 in a log loss.
const SURE: f64 = 1e-3;
/// Squared weights count this much against the log likelihood: a quarter of a frame.
const RIDGE: f64 = 0.25;
/// Share of the values beyond each end of a measure's range.
const TAIL: f64 = 0.005;
/// Steps of the descent at most, and the largest change of a weight that ends it.
const STEPS: usize = 200_000;
const STILL: f64 = 1e-9;
/// Frames that a step of an isotonic curve has at least.
const STEP_FRAMES: f64 = 20.0;

/// The uncalibrated score and the measures of F1 to F4; `None` where the mode cannot be judged.
pub type Measured = [Option<(f64, Vec<Measure>)>; 4];

/// A judged fit whose modes are known.
#[derive(Debug, Clone, PartialEq)]
pub struct EvidenceExample {
    /// Seed of its recording.
    pub seed: u64,
    /// The mode that it was made with.
    pub made_with: Option<Tag>,
    /// What was measured.
    pub judged: Measured,
}

impl EvidenceExample {
    /// What is known of a mode.
    pub fn of(&self, mode: Tag) -> Option<&(f64, Vec<Measure>)> {
        let index = Tag::MODES.iter().position(|other| *other == mode)?;
        self.judged.get(index)?.as_ref()
    }
}

/// The measures of one example, and whether it has the mode.
type Row = (Vec<f64>, bool);

/// All curves, learned from some examples and reported on others.
pub fn learn(learned: &[EvidenceExample], held_out: &[EvidenceExample]) -> Vec<Curve> {
    let curve = |(mode, inputs): &(Tag, &[&str])| {
        let mut curve = fitted(*mode, inputs, learned);
        let (mut before, mut after) = (Vec::new(), Vec::new());
        for (raw, measures, with) in chosen(*mode, inputs, held_out) {
            before.push((raw, with));
            after.push((curve.probability(measures).unwrap_or(curve.prior), with));
        }
        (curve.before, curve.after) = (Figures::of(&before), Figures::of(&after));
        curve
    };
    CURVES.iter().map(curve).collect()
}

/// The examples that a curve can judge: uncalibrated score, measures, whether they have the mode.
pub fn chosen<'a>(mode: Tag, inputs: &[&str], examples: &'a [EvidenceExample]) -> Vec<(f64, &'a [Measure], bool)> {
    let judged = examples.iter().filter_map(|example| {
        let (raw, measures) = example.of(mode)?;
        let known = inputs.iter().all(|name| !value(measures, name).is_nan());
        known.then(|| (*raw, measures.as_slice(), example.made_with == Some(mode)))
    });
    judged.collect()
}

fn fitted(mode: Tag, inputs: &[&str], learned: &[EvidenceExample]) -> Curve {
    let rows = |taken: &dyn Fn(u64) -> bool| -> Vec<Row> {
        let examples: Vec<EvidenceExample> = learned.iter().filter(|example| taken(example.seed)).cloned().collect();
        let of = |measures: &[Measure]| inputs.iter().map(|name| value(measures, name)).collect();
        chosen(mode, inputs, &examples).into_iter().map(|(_, measures, with)| (of(measures), with)).collect()
    };
    let mut seeds: Vec<u64> = learned.iter().map(|example| example.seed).collect();
    seeds.sort_unstable();
    seeds.dedup();
    let (mut logistic, mut isotonic) = (Vec::new(), Vec::new());
    for left_out in seeds {
        let fit = logistic_curve(mode, inputs, &rows(&|seed| seed != left_out));
        let stepped = Curve { steps: steps(&fit, &rows(&|seed| seed != left_out)), ..fit.clone() };
        for (x, with) in rows(&|seed| seed == left_out) {
            let z = linear(&fit, &x);
            logistic.push((fit.at(z), with));
            isotonic.push((stepped.at(z), with));
        }
    }
    let all = rows(&|_| true);
    let mut curve = logistic_curve(mode, inputs, &all);
    curve.log_loss_left_out = [log_loss(&logistic), log_loss(&isotonic)].map(short);
    if curve.log_loss_left_out[1] < curve.log_loss_left_out[0] {
        curve.steps = steps(&curve, &all);
    }
    curve
}

fn value(measures: &[Measure], name: &str) -> f64 {
    measures.iter().find(|measure| measure.name == name).map_or(f64::NAN, |measure| measure.value)
}

/// Ridge logistic regression with weights of 0 or more, by projected gradient descent with Nesterov's momentum.
fn logistic_curve(mode: Tag, names: &[&str], rows: &[Row]) -> Curve {
    let inputs: Vec<Input> = names.iter().enumerate().map(|(k, name)| scaled(name, rows, k)).collect();
    let with = rows.iter().filter(|(_, with)| *with).count() as f64;
    let count = rows.len().max(1) as f64;
    let prior = (with / count).clamp(1.0 / (count + 1.0), 1.0 - 1.0 / (count + 1.0));
    let unfinished = Figures { counts: [0, 0], auc: 0.5, brier: 0.0, log_loss: 0.0, hits: 0.0, false_alarms: 0.0 };
    let mut curve = Curve {
        mode,
        prior: short(prior),
        inputs,
        bias: (prior / (1.0 - prior)).ln(),
        steps: Vec::new(),
        log_loss_left_out: [0.0; 2],
        before: unfinished,
        after: unfinished,
    };
    let x: Vec<(Vec<f64>, f64)> = rows.iter().map(|(x, with)| (units(&curve, x), f64::from(u8::from(*with)))).collect();
    // The curvature of the log likelihood is at most a quarter of Σ (1 + |x|²).
    let curvature = x.iter().map(|(x, _)| 0.25 * (1.0 + x.iter().map(|x| x * x).sum::<f64>())).sum::<f64>() + RIDGE;
    let mut now: Vec<f64> = std::iter::once(curve.bias).chain(names.iter().map(|_| 0.0)).collect();
    let (mut ahead, mut momentum) = (now.clone(), 1.0_f64);
    for _ in 0..STEPS {
        let slope = slope(&ahead, &x);
        let step = |(k, (w, slope)): (usize, (&f64, &f64))| {
            let moved = w - slope / curvature;
            if k == 0 { moved } else { moved.max(0.0) }
        };
        let next: Vec<f64> = ahead.iter().zip(&slope).enumerate().map(step).collect();
        let change = next.iter().zip(&now).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let following = 0.5 * (1.0 + (1.0 + 4.0 * momentum * momentum).sqrt());
        let carried = (momentum - 1.0) / following;
        ahead = next.iter().zip(&now).map(|(next, now)| next + carried * (next - now)).collect();
        (now, momentum) = (next, following);
        if change < STILL {
            break;
        }
    }
    curve.bias = short(now[0]);
    for (input, weight) in curve.inputs.iter_mut().zip(&now[1..]) {
        input.weight = short(*weight);
    }
    curve
}

/// The gradient of −ln likelihood + ridge by bias and weights.
fn slope(w: &[f64], rows: &[(Vec<f64>, f64)]) -> Vec<f64> {
    let mut slope: Vec<f64> = w.iter().enumerate().map(|(k, w)| if k == 0 { 0.0 } else { RIDGE * w }).collect();
    for (x, with) in rows {
        let z = w[0] + w[1..].iter().zip(x).map(|(w, x)| w * x).sum::<f64>();
        let surplus = 1.0 / (1.0 + (-z).exp()) - with;
        slope[0] += surplus;
        for (slope, x) in slope[1..].iter_mut().zip(x) {
            *slope += surplus * x;
        }
    }
    slope
}

fn scaled(name: &str, rows: &[Row], k: usize) -> Input {
    let mut values: Vec<f64> = rows.iter().map(|(x, _)| x[k]).collect();
    values.sort_by(f64::total_cmp);
    let at = |share: f64| values.get((share * values.len().saturating_sub(1) as f64).round() as usize).copied();
    let range = [at(TAIL), at(1.0 - TAIL)].map(|end| short(end.unwrap_or(0.0)));
    let within: Vec<f64> = values.iter().map(|x| x.clamp(range[0], range[1])).collect();
    let count = within.len().max(1) as f64;
    let mean = within.iter().sum::<f64>() / count;
    let deviation = (within.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / count).sqrt();
    let scale = if deviation > 1e-9 { short(deviation) } else { 1.0 };
    Input { name: name.to_owned(), mean: short(mean), scale, range, weight: 0.0 }
}

fn units(curve: &Curve, x: &[f64]) -> Vec<f64> {
    let unit = |(input, x): (&Input, &f64)| (x.clamp(input.range[0], input.range[1]) - input.mean) / input.scale;
    curve.inputs.iter().zip(x).map(unit).collect()
}

fn linear(curve: &Curve, x: &[f64]) -> f64 {
    curve.bias + units(curve, x).iter().zip(&curve.inputs).map(|(x, input)| x * input.weight).sum::<f64>()
}

/// Pools adjacent violators: the steps that rise with z and fit best. A step has [`STEP_FRAMES`] at least, and one of whose
/// frames all have the mode, or none, is held from certainty by half a frame.
fn steps(curve: &Curve, rows: &[Row]) -> Vec<[f64; 2]> {
    let mut sorted: Vec<(f64, f64)> =
        rows.iter().map(|(x, with)| (linear(curve, x), f64::from(u8::from(*with)))).collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    // Lowest z, frames with the mode, frames.
    let mut blocks: Vec<[f64; 3]> = Vec::new();
    let share = |block: &[f64; 3]| block[1] / block[2];
    for (z, with) in sorted {
        match blocks.last_mut() {
            Some(last) if last[0] == z || last[2] < STEP_FRAMES => {
                last[1] += with;
                last[2] += 1.0;
            }
            _ => blocks.push([z, with, 1.0]),
        }
        while let [.., below, last] = &blocks[..] {
            if last[2] < STEP_FRAMES || share(below) < share(last) {
                break;
            }
            let joined = [below[0], below[1] + last[1], below[2] + last[2]];
            blocks.truncate(blocks.len() - 2);
            blocks.push(joined);
        }
    }
    while let [.., below, last] = &blocks[..] {
        if last[2] >= STEP_FRAMES && share(below) < share(last) {
            break;
        }
        let joined = [below[0], below[1] + last[1], below[2] + last[2]];
        blocks.truncate(blocks.len() - 2);
        blocks.push(joined);
    }
    blocks.iter().map(|[z, with, count]| [short(*z), short((with + 0.5) / (count + 1.0))]).collect()
}

/// Five digits: what a table can carry and people can read.
fn short(x: f64) -> f64 {
    format!("{x:.4e}").parse().unwrap_or(x)
}

fn log_loss(of: &[(f64, bool)]) -> f64 {
    let loss = |(p, with): &(f64, bool)| {
        let p = p.clamp(SURE, 1.0 - SURE);
        -(if *with { p } else { 1.0 - p }).ln()
    };
    of.iter().map(loss).sum::<f64>() / of.len().max(1) as f64
}

impl Figures {
    /// Of (score, has the mode).
    pub fn of(scores: &[(f64, bool)]) -> Self {
        let count = |wanted: bool| scores.iter().filter(|(_, with)| *with == wanted).count();
        let above = |wanted: bool| {
            let hits = scores.iter().filter(|(score, with)| *with == wanted && *score > 0.5).count();
            short(hits as f64 / count(wanted).max(1) as f64)
        };
        let brier = scores.iter().map(|(p, with)| (p - f64::from(u8::from(*with))).powi(2)).sum::<f64>();
        Self {
            counts: [count(true), count(false)],
            auc: short(auc(scores)),
            brier: short(brier / scores.len().max(1) as f64),
            log_loss: short(log_loss(scores)),
            hits: above(true),
            false_alarms: above(false),
        }
    }
}

fn auc(scores: &[(f64, bool)]) -> f64 {
    let of = |wanted: bool| scores.iter().filter(move |(_, with)| *with == wanted).map(|(score, _)| *score);
    let pairs = (of(true).count() * of(false).count()) as f64;
    if pairs == 0.0 {
        return 0.5;
    }
    let higher = |a: f64, b: f64| {
        if a > b {
            1.0
        } else if a == b {
            0.5
        } else {
            0.0
        }
    };
    of(true).map(|a| of(false).map(|b| higher(a, b)).sum::<f64>()).sum::<f64>() / pairs
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(x: f64, with: bool) -> Row {
        (vec![x], with)
    }

    #[test]
    fn a_logistic_law_comes_back() {
        // P(x) = 1/(1 + e^(1 − 2x)) on a lattice, each x as often with and without as the law says.
        let mut rows = Vec::new();
        for k in -20..=20 {
            let x = f64::from(k) / 10.0;
            let with = (1000.0 / (1.0 + (1.0 - 2.0 * x).exp())).round() as usize;
            rows.extend((0..1000).map(|n| row(x, n < with)));
        }
        let curve = logistic_curve(Tag::F2, &["nearness"], &rows);
        let p = |x: f64| curve.at(linear(&curve, &[x]));
        for x in [-1.0, 0.0, 0.5, 1.5] {
            assert!((p(x) - 1.0 / (1.0 + (1.0 - 2.0 * x).exp())).abs() < 5e-3, "{x}: {}", p(x));
        }
        assert_eq!(p(50.0), p(2.0), "beyond what was learned from nothing more is claimed");
        let against = rows.iter().map(|(x, with)| row(-x[0], *with)).collect::<Vec<Row>>();
        assert_eq!(logistic_curve(Tag::F2, &["nearness"], &against).inputs[0].weight, 0.0, "never falls");
    }

    #[test]
    fn isotonic_steps_rise_and_keep_the_mean() {
        let rows: Vec<Row> = (0..400).map(|k| row(f64::from(k), (k * 7919 % 400) < k / 2)).collect();
        let curve = logistic_curve(Tag::F2, &["nearness"], &rows);
        let steps = steps(&curve, &rows);
        assert!(steps.len() > 2 && steps.windows(2).all(|pair| pair[0][0] < pair[1][0] && pair[0][1] < pair[1][1]));
        let stepped = Curve { steps, ..curve };
        let mean = rows.iter().map(|(x, _)| stepped.at(linear(&stepped, x))).sum::<f64>() / 400.0;
        let share = rows.iter().filter(|(_, with)| *with).count() as f64 / 400.0;
        assert!((mean - share).abs() < 0.01, "{mean} {share}");
    }

    #[test]
    fn figures_of_a_few_scores_by_hand() {
        let scores = [(0.9, true), (0.6, false), (0.6, true), (0.1, false)];
        let figures = Figures::of(&scores);
        assert_eq!((figures.counts, figures.auc), ([2, 2], 0.875));
        assert_eq!((figures.hits, figures.false_alarms), (1.0, 0.5));
        assert!((figures.brier - (0.01 + 0.36 + 0.16 + 0.01) / 4.0).abs() < 1e-9);
    }
}
