//! The table of a run: a row a variant, or a row a stratum and their mean.
//!
//! Errors, IoU and convergence are over the frames that could be fitted and whose number of persons is the annotated one
//! (the paper's count-matched evaluation); the others are counted. Sums go through the frames in their order, so that the
//! same rows give the same bytes.

use super::journal::Rows;
use super::kind::StudyKind;
use super::paper::{self, PaperSet};
use super::row::{RunNumbers, RunRow};
use super::spec::RunSpec;
use super::variant::{Method, PaperRow, StartFrom};
use crate::dataset::natural;
use crate::people::{CLASSES, Confusion};
use crate::study::complexity::Stratum;
use serde::Serialize;

/// The variant of the study `robustness` that nothing perturbs: its first.
const UNPERTURBED: usize = 0;

/// Mean, spread and number of a quantity over frames.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Spread {
    /// Mean.
    pub mean: f64,
    /// Standard deviation of the frames (n − 1); 0 for one.
    pub sd: f64,
    /// Frames where it is known.
    pub n: usize,
}

impl Spread {
    fn of(values: impl Iterator<Item = f64>) -> Option<Self> {
        let values: Vec<f64> = values.filter(|x| x.is_finite()).collect();
        let n = values.len();
        if n == 0 {
            return None;
        }
        let mean = values.iter().sum::<f64>() / n as f64;
        let squares: f64 = values.iter().map(|x| (x - mean) * (x - mean)).sum();
        Some(Self { mean, sd: if n > 1 { (squares / (n - 1) as f64).sqrt() } else { 0.0 }, n })
    }

    /// Standard error of the mean.
    pub fn error(&self) -> f64 {
        self.sd / (self.n.max(1) as f64).sqrt()
    }
}

/// How often the number of people is right. Shares, 0..1; `None` without such frames.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CountShares {
    /// By annotated number: 0, 1, 2, 3, 4 and more.
    pub by_people: [Option<f64>; CLASSES],
    /// Frames of each.
    pub frames: [usize; CLASSES],
    /// One, two and three people weighted by 91, 8 and 1 %.
    pub weighted: Option<f64>,
    /// Of all frames.
    pub overall: Option<f64>,
    /// Frames that are off by no more than one person.
    pub within_one: Option<f64>,
}

/// One row of the table. `None` where nothing is known.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TableRow {
    /// A cell for each label column.
    pub labels: Vec<String>,
    /// Index of the variant.
    pub variant: usize,
    /// The stratum, in a table that is cut by it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stratum: Option<&'static str>,
    /// Frames studied.
    pub frames: usize,
    /// Frames without a fit.
    pub failed: usize,
    /// Frames left out because another number of persons was fitted than is annotated.
    pub count_mismatched: usize,
    /// Share of frames whose persons a fit in a window left where they start, 0..1; where there are such.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub held_share: Option<f64>,
    /// MAJPE, mm.
    pub majpe_mm: Option<Spread>,
    /// The median of MAJPE, mm, where starts are compared with the truth: of the frames in which neither fit was held at its start.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub median_majpe_mm: Option<f64>,
    /// PA-MAJPE, mm.
    pub pa_majpe_mm: Option<Spread>,
    /// OSPA of all fitted frames, those with another number of persons among them, mm; where a frame has several persons, or
    /// another number than annotated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ospa_mm: Option<Spread>,
    /// MAJPE of the start, mm.
    pub init_majpe_mm: Option<Spread>,
    /// PA-MAJPE of the start, mm.
    pub init_pa_majpe_mm: Option<Spread>,
    /// Share of frames whose fit is nearer to truth than its start, 0..1.
    pub share_improved: Option<f64>,
    /// Share of these frames whose loss ends below that of the fit from the truth, 0..1, L_given left out: there the loss prefers another
    /// pose. What was held at its start has the loss of no fit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub share_below_truth: Option<f64>,
    /// The same of those whose loss is lower by more than 3 %: two fits that end in one pose differ by less.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub share_clearly_below_truth: Option<f64>,
    /// Forward-consistency IoU, mean over views, 0..1.
    pub iou: Option<Spread>,
    /// Share of frames that met the convergence criterion, 0..1.
    pub converged_share: Option<f64>,
    /// L.
    pub loss: Option<Spread>,
    /// Adam steps taken.
    pub iterations: Option<Spread>,
    /// Joints against key points of an image, px.
    pub reprojection_px: Option<Spread>,
    /// Share of projected joints inside the image's boxes.
    pub box_coverage: Option<Spread>,
    /// Share of joints inside the boxes on the radar maps.
    pub map_box_coverage: Option<Spread>,
    /// Where people were counted and nothing was fitted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub counts: Option<CountShares>,
    /// The paper's figures for the same.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub paper: Option<PaperRow>,
    /// Why it does not differ from the row that it is compared with.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
}

/// The rows of one scene.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SceneTable {
    /// What it is called.
    pub scene: String,
    /// As in the table of all frames.
    pub rows: Vec<TableRow>,
}

/// The different notes of a table, in the order of the rows that bear them: a row's mark is the place of its own, from 1.
pub fn notes(rows: &[TableRow]) -> Vec<&str> {
    let mut notes: Vec<&str> = Vec::new();
    for note in rows.iter().filter_map(|row| row.note.as_deref()) {
        if !notes.contains(&note) {
            notes.push(note);
        }
    }
    notes
}

/// The mark of a row's note among `notes`.
pub fn mark(notes: &[&str], row: &TableRow) -> Option<String> {
    let own = row.note.as_deref()?;
    notes.iter().position(|note| *note == own).map(|k| format!("[{}]", k + 1))
}

/// The table of a run.
pub(super) fn table(spec: &RunSpec, all_rows: &Rows) -> Vec<TableRow> {
    let counted = || all_rows.values().filter(|row| !row.passing);
    if !spec.study.by_stratum() {
        let of_variant = |(k, variant): (usize, &super::Variant)| {
            let rows: Vec<&RunRow> = counted().filter(|row| row.variant == k).collect();
            // A run of an older program does not say what its data were.
            let paper = variant.paper.filter(|_| PaperSet::beside(spec.study, &spec.data.layout).is_some());
            if variant.method == Method::Fit {
                let note = variant.note.clone().or_else(|| unmoved(spec, &rows, all_rows));
                let row = TableRow { paper, note, ..summed(variant.labels.clone(), k, &rows) };
                if spec.study == StudyKind::Truth { beside_truth(row, spec, &rows, all_rows) } else { row }
            } else {
                TableRow { paper, ..counted_right(variant.labels.clone(), k, &rows) }
            }
        };
        return spec.variants.iter().enumerate().map(of_variant).collect();
    }
    let cut = Stratum::ALL.map(Some).into_iter().chain([None]);
    let of_stratum = cut.map(|stratum| {
        let inside = |row: &&RunRow| stratum.is_none() || row.stratum == stratum;
        let rows: Vec<&RunRow> = counted().filter(inside).collect();
        let label = stratum.map_or("mean", Stratum::word).to_owned();
        TableRow {
            stratum: stratum.map(Stratum::word),
            paper: PaperSet::beside(spec.study, &spec.data.layout).map(|_| paper::stratum(stratum)),
            ..summed(vec![label], 0, &rows)
        }
    });
    of_stratum.collect()
}

/// The table of each scene by itself, where frames come from several; without the paper's figures, which are of all of them.
pub(super) fn by_scene(spec: &RunSpec, all_rows: &Rows) -> Vec<SceneTable> {
    let mut scenes: Vec<&str> = all_rows.values().filter_map(|row| row.origin.scene.as_deref()).collect();
    scenes.sort_by(|a, b| natural(a, b));
    scenes.dedup();
    if scenes.len() < 2 {
        return Vec::new();
    }
    let of = |scene: &str| {
        let inside = |row: &&RunRow| row.origin.scene.as_deref() == Some(scene);
        let rows: Rows = all_rows.iter().filter(|(_, row)| inside(row)).map(|(key, row)| (*key, row.clone())).collect();
        let rows = table(spec, &rows).into_iter().map(|row| TableRow { paper: None, ..row }).collect();
        SceneTable { scene: scene.to_owned(), rows }
    };
    scenes.into_iter().map(of).collect()
}

/// The row with its median, and with how often its loss ends lower than the one from the truth does: of the frames that both fit. No
/// loss has L_given in it.
fn beside_truth(row: TableRow, spec: &RunSpec, rows: &[&RunRow], all_rows: &Rows) -> TableRow {
    let truth = spec.variants.iter().position(|variant| variant.start == StartFrom::Truth);
    let fitted = |of: &RunRow| of.fit.as_ref().ok().filter(|fit| fit.count_matched() && !fit.held).cloned();
    let own = spec.variants.iter().position(|variant| variant.start == StartFrom::Cold);
    let is_own = Some(row.variant) == own;
    let both = |row: &&RunRow| {
        let of = |variant: Option<usize>| fitted(all_rows.get(&(variant?, row.frame))?);
        of(own)?;
        Some((fitted(row)?, of(truth)?))
    };
    let pairs: Vec<(RunNumbers, RunNumbers)> = rows.iter().filter_map(both).collect();
    let mut errors: Vec<f64> = pairs.iter().filter_map(|(fit, _)| fit.majpe_mm).collect();
    errors.sort_by(f64::total_cmp);
    let middle = |k: usize| errors.get(k).copied();
    let median = match errors.len() {
        0 => None,
        n if n % 2 == 1 => middle(n / 2),
        n => middle(n / 2 - 1).zip(middle(n / 2)).map(|(a, b)| f64::midpoint(a, b)),
    };
    // What holds a fit to the truth is no part of what the two are compared by.
    let found = |fit: &RunNumbers, variant: usize| {
        let given = fit.terms.get("given").flatten().unwrap_or_default();
        fit.loss - spec.variants.get(variant).map_or(0.0, |variant| variant.config.w_given) * given
    };
    let is_below = |fit: &RunNumbers, of_truth: &RunNumbers, most: f64| {
        truth.is_some_and(|truth| found(fit, row.variant) < most * found(of_truth, truth))
    };
    let share = |most: f64| {
        let below = pairs.iter().filter(|(fit, of_truth)| is_below(fit, of_truth, most)).count();
        (is_own && !pairs.is_empty()).then(|| below as f64 / pairs.len() as f64)
    };
    let used = rows.iter().filter_map(|row| row.fit.as_ref().ok()).filter(|fit| fit.count_matched());
    TableRow {
        loss: Spread::of(used.map(|fit| found(fit, row.variant))),
        median_majpe_mm: median,
        share_below_truth: share(1.0),
        share_clearly_below_truth: share(1.0 - SAME_POSE),
        ..row
    }
}

/// The share of a loss by which two fits that end in one pose differ.
const SAME_POSE: f64 = 0.03;

/// Errors of joints that differ by less are those of the same joints, mm: the rounding of a sum that is 0 may differ.
const SAME_MM: f64 = 1e-6;

/// Where a perturbed start, against the settings, left every joint where it is without.
fn unmoved(spec: &RunSpec, rows: &[&RunRow], all_rows: &Rows) -> Option<String> {
    let of_another = |row: &&RunRow| row.variant != UNPERTURBED;
    if spec.study != StudyKind::Robustness || rows.is_empty() || !rows.iter().all(of_another) {
        return None;
    }
    let errors = |fit: &RunNumbers| [fit.majpe_mm, fit.pa_majpe_mm, fit.init_majpe_mm, fit.init_pa_majpe_mm];
    let unmoved = |(a, b): (Option<f64>, Option<f64>)| a.zip(b).map_or(a == b, |(a, b)| (a - b).abs() <= SAME_MM);
    let same = |row: &&RunRow| match (all_rows.get(&(UNPERTURBED, row.frame)).map(|plain| &plain.fit), &row.fit) {
        (Some(Ok(plain)), Ok(fit)) if fit.majpe_mm.is_some() => errors(plain).into_iter().zip(errors(fit)).all(unmoved),
        (Some(plain), fit) => plain == fit,
        (None, _) => false,
    };
    rows.iter().all(same).then(|| "moved no joint: every frame's are where they are without it".to_owned())
}

fn summed(labels: Vec<String>, variant: usize, rows: &[&RunRow]) -> TableRow {
    let fitted: Vec<&RunNumbers> = rows.iter().filter_map(|row| row.fit.as_ref().ok()).collect();
    let used: Vec<&RunNumbers> = fitted.iter().copied().filter(|fit| fit.count_matched()).collect();
    let spread = |get: fn(&RunNumbers) -> Option<f64>| Spread::of(used.iter().filter_map(|fit| get(fit)));
    let several = fitted.iter().any(|fit| !fit.count_matched() || fit.annotated.is_some_and(|people| people > 1));
    let share = |known: Vec<bool>| {
        (!known.is_empty()).then(|| known.iter().filter(|&&yes| yes).count() as f64 / known.len() as f64)
    };
    TableRow {
        labels,
        variant,
        stratum: None,
        frames: rows.len(),
        failed: rows.len() - fitted.len(),
        count_mismatched: fitted.len() - used.len(),
        held_share: share(used.iter().map(|fit| fit.held).collect()).filter(|&share| share > 0.0),
        majpe_mm: spread(|fit| fit.majpe_mm),
        median_majpe_mm: None,
        pa_majpe_mm: spread(|fit| fit.pa_majpe_mm),
        ospa_mm: Spread::of(fitted.iter().filter(|_| several).filter_map(|fit| fit.ospa_mm)),
        init_majpe_mm: spread(|fit| fit.init_majpe_mm),
        init_pa_majpe_mm: spread(|fit| fit.init_pa_majpe_mm),
        share_improved: share(used.iter().filter_map(|fit| fit.improved()).collect()),
        share_below_truth: None,
        share_clearly_below_truth: None,
        iou: spread(RunNumbers::mean_iou),
        converged_share: share(used.iter().map(|fit| fit.converged).collect()),
        loss: spread(|fit| Some(fit.loss)),
        iterations: spread(|fit| Some(fit.iterations as f64)),
        reprojection_px: spread(|fit| fit.reprojection_px),
        box_coverage: spread(|fit| fit.box_coverage),
        map_box_coverage: spread(|fit| fit.map_box_coverage),
        counts: None,
        paper: None,
        note: None,
    }
}

/// A row of counts: nothing was fitted, so that nothing else is known.
fn counted_right(labels: Vec<String>, variant: usize, rows: &[&RunRow]) -> TableRow {
    let mut confusion = Confusion::default();
    for numbers in rows.iter().filter_map(|row| row.fit.as_ref().ok()) {
        if let Some(annotated) = numbers.annotated {
            confusion.add(annotated, numbers.persons);
        }
    }
    let counts = CountShares {
        by_people: std::array::from_fn(|people| confusion.accuracy(people)),
        frames: std::array::from_fn(|people| confusion.of(people)),
        weighted: confusion.weighted(),
        overall: confusion.overall(),
        within_one: confusion.within_one(),
    };
    let failed = rows.iter().filter(|row| row.fit.is_err()).count();
    TableRow { frames: rows.len(), failed, counts: Some(counts), ..summed(labels, variant, &[]) }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests fail by panicking")]
    use super::*;
    use crate::dataset::Origin;

    fn row(frame: usize, majpe_mm: f64, fitted: usize) -> RunRow {
        let fit = RunNumbers {
            majpe_mm: Some(majpe_mm),
            init_majpe_mm: Some(100.0),
            iou: vec![Some(0.2), None, Some(0.6)],
            persons: fitted,
            annotated: Some(1),
            converged: majpe_mm < 95.0,
            ..RunNumbers::default()
        };
        RunRow {
            variant: 0,
            frame,
            name: format!("f{frame}"),
            sequence: "s".into(),
            origin: Origin::default(),
            stratum: None,
            passing: false,
            fit: Ok(fit),
            init_ms: None,
            fit_ms: None,
        }
    }

    #[test]
    fn failed_mismatched_and_passing_frames_are_counted_and_left_out() {
        let failed = RunRow { fit: Err("no".into()), ..row(2, 0.0, 1) };
        let rows = [row(0, 80.0, 1), row(1, 110.0, 1), failed, row(3, 5000.0, 2)];
        let rows: Vec<&RunRow> = rows.iter().collect();
        let summed = summed(vec![], 0, &rows);
        assert_eq!((summed.frames, summed.failed, summed.count_mismatched), (4, 1, 1));
        let majpe = summed.majpe_mm.unwrap();
        assert_eq!((majpe.mean, majpe.n), (95.0, 2));
        assert!((majpe.sd - 450.0_f64.sqrt()).abs() < 1e-9);
        assert_eq!((summed.share_improved, summed.converged_share), (Some(0.5), Some(0.5)));
        assert!((summed.iou.unwrap().mean - 0.4).abs() < 1e-12);
        assert_eq!(summed.reprojection_px, None);
    }

    /// Of fits that one of both held at its start nobody knows whose loss would be lower.
    #[test]
    fn whom_a_fit_held_is_not_compared_with_the_truth() {
        let text = "id = ''\nstudy = 'truth'\nversion = ''\nprecision = 'f32'\nbase = ''\nseed = 1\ncolumns = ['start']\n\
            [data]\nname = ''\nroot = ''\nfingerprint = ''\ncontent = ''\narrays = ['hm']\nfirst = 0\nend = 4\n\
            frames = 4\nsubset = 'all'\n[[variant]]\nlabels = ['own']\n[variant.config]\n\
            [[variant]]\nlabels = ['truth']\nstart = 'truth'\n[variant.config]\n";
        let spec: RunSpec = toml::from_str(text).unwrap();
        let of = |variant, frame, (majpe_mm, loss, held)| {
            let mut row = RunRow { variant, ..row(frame, majpe_mm, 1) };
            row.fit = row.fit.map(|fit| RunNumbers { loss, held, ..fit });
            ((variant, frame), row)
        };
        let own = [(60.0, 0.10, false), (90.0, 0.11, false), (300.0, 0.2, true), (80.0, 0.1, false)];
        let truth = [(40.0, 0.12, false), (30.0, 0.10, false), (0.0, 0.3, true), (0.0, 0.3, true)];
        let all = [own, truth].into_iter().enumerate();
        let rows: Rows =
            all.flat_map(|(k, fits)| fits.into_iter().enumerate().map(move |(n, fit)| of(k, n, fit))).collect();
        let table = table(&spec, &rows);
        assert_eq!(table.iter().map(|row| row.median_majpe_mm).collect::<Vec<_>>(), [Some(75.0), Some(35.0)]);
        assert_eq!(table.iter().map(|row| row.share_below_truth).collect::<Vec<_>>(), [Some(0.5), None]);
        assert_eq!(table.iter().map(|row| row.held_share).collect::<Vec<_>>(), [Some(0.25), Some(0.5)]);
        let without: Rows = rows.into_iter().filter(|(key, _)| *key != (1, 0)).collect();
        let alone = super::table(&spec, &without);
        assert_eq!((alone[0].median_majpe_mm, alone[0].share_below_truth), (Some(90.0), Some(0.0)), "both or neither");
    }
}
