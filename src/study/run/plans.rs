//! What each study compares: its label columns and its variants, with the paper's figures beside them where it has any for
//! such data.

use super::kind::StudyKind;
use super::paper::{self, PaperSet};
use super::reach;
use super::variant::{Method, PaperRow, Variant};
use super::{GridAxis, RunError, grid, switches};
use crate::config::{FitConfig, InitConfig, Operators};
use crate::radar::View;

/// Iterations of the paper's robustness table.
const ROBUSTNESS_ITERATIONS: usize = 80;
/// Budgets of the study `budget`, ascending.
const BUDGETS: [usize; 8] = [5, 10, 20, 25, 40, 60, 80, 100];
/// What joints that are given are off on purpose, in each direction, m.
const GIVEN_OFF_M: [f64; 2] = [0.03, 0.06];

/// Label columns and variants.
pub(super) struct Compared {
    pub(super) columns: Vec<String>,
    pub(super) variants: Vec<Variant>,
}

/// What `kind` compares on top of `base` on data with these views and this layout ([`crate::dataset::Layout::word`]); `axes`
/// are those of a sweep.
///
/// # Errors
/// Where the grid of a sweep makes no sense.
pub(super) fn compared(
    kind: StudyKind,
    base: &FitConfig,
    axes: &[GridAxis],
    views: &[View],
    layout: &str,
) -> Result<Compared, RunError> {
    let set = PaperSet::beside(kind, layout);
    let named =
        |columns: &[&str], variants| Compared { columns: columns.iter().map(ToString::to_string).collect(), variants };
    Ok(match kind {
        StudyKind::Complexity => named(&["subset"], vec![Variant::cold(["all"], base)]),
        StudyKind::Robustness => named(&["perturbation", "level"], robustness(base, set, views)),
        StudyKind::Operators => named(&["configuration"], operators(base, set)),
        StudyKind::Threshold => named(&["tau"], threshold(base, set)),
        StudyKind::Weights => named(&["w_em / w_kine"], weights(base, set)),
        StudyKind::Init => named(&["configuration"], init(base, set)),
        StudyKind::Budget => named(&["start", "iterations"], budget(base)),
        StudyKind::Switches => named(&["preset", "change"], switches::variants(base)),
        StudyKind::Counting => named(&["method"], counting(base, set)),
        StudyKind::Truth => named(&["start"], truth(base)),
        StudyKind::Sweep => Compared {
            columns: axes.iter().map(|axis| axis.key.clone()).collect(),
            variants: grid::variants(base, axes)?,
        },
    })
}

fn robustness(base: &FitConfig, set: Option<PaperSet>, views: &[View]) -> Vec<Variant> {
    let row = |what: &str, level: &str, paper: [f64; 3], change: &dyn Fn(&mut InitConfig)| {
        let mut config = FitConfig { iterations: ROBUSTNESS_ITERATIONS, ..*base };
        change(&mut config.init);
        let [majpe, pa_majpe, converged] = paper;
        let paper = PaperRow { converged_share: Some(converged), ..PaperRow::errors(majpe, pa_majpe) };
        Variant::cold([what, level], &config).beside(set.map(|_| paper))
    };
    let position = |noise: f64, bias: f64| {
        move |init: &mut InitConfig| (init.position_noise_m, init.position_bias_m) = (noise, bias)
    };
    let velocity = |noise: f64| move |init: &mut InitConfig| init.velocity_noise_mps = noise;
    let dropout = |share: f64| move |init: &mut InitConfig| init.peak_dropout = share;
    let unperturbed = FitConfig { iterations: ROBUSTNESS_ITERATIONS, ..*base };
    let rows = vec![
        Variant::cold(["none", "as found"], &unperturbed),
        row("p noise/bias", "σ_p = 0.02 m, Δp = 0 m", [80.2, 73.1, 0.942], &position(0.02, 0.0)),
        row("p noise/bias", "σ_p = 0.05 m, Δp = 0.05 m", [82.8, 75.4, 0.921], &position(0.05, 0.05)),
        row("p noise/bias", "σ_p = 0.08 m, Δp = 0.10 m", [85.6, 77.9, 0.893], &position(0.08, 0.10)),
        row("v corruption", "v = 0", [83.1, 75.8, 0.910], &|init| init.velocity = false),
        row("v corruption", "σ_v = 0.15 m/s", [82.2, 75.0, 0.924], &velocity(0.15)),
        row("v corruption", "σ_v = 0.30 m/s", [83.9, 76.6, 0.902], &velocity(0.30)),
        row("peak dropout", "r_drop = 0.10", [81.4, 74.2, 0.936], &dropout(0.10)),
        row("peak dropout", "r_drop = 0.20", [83.3, 75.9, 0.917], &dropout(0.20)),
        row("peak dropout", "r_drop = 0.40", [86.7, 78.5, 0.888], &dropout(0.40)),
        row("warm start", "σ_p = 0.05 m, r_drop = 0.20", [79.6, 72.6, 0.953], &|init| {
            (init.position_noise_m, init.peak_dropout) = (0.05, 0.20);
        })
        .warm(),
    ];
    let noted = |row: Variant| Variant { note: reach::silent(&row.config, &unperturbed, row.start, views), ..row };
    rows.into_iter().map(noted).collect()
}

fn operators(base: &FitConfig, set: Option<PaperSet>) -> Vec<Variant> {
    let row = |name: &str, operators: Operators, majpe: f64, pa_majpe: f64| {
        let paper = set.map(|_| PaperRow::errors(majpe, pa_majpe));
        Variant::cold([name], &FitConfig { operators, ..*base }).beside(paper)
    };
    let full = base.operators;
    vec![
        row("full pipeline", full, 64.71, 58.91),
        row("without range", Operators { range: false, ..full }, 90.30, 84.17),
        row("without Doppler", Operators { doppler: false, ..full }, 89.00, 82.66),
        row("without array phase", Operators { angle: false, ..full }, 70.92, 65.05),
        row("without path attenuation", Operators { attenuation: false, ..full }, 66.84, 60.27),
    ]
}

fn threshold(base: &FitConfig, set: Option<PaperSet>) -> Vec<Variant> {
    let row = |k: usize, tau_pct: f64, name: &str| {
        let paper = set.map(|set| PaperRow::of_pair(paper::threshold(set)[k]));
        Variant::cold([name], &FitConfig { tau_pct, ..*base }).beside(paper)
    };
    vec![
        row(0, 5.0, "5 %"),
        row(1, 10.0, "10 %"),
        row(2, 30.0, "30 %"),
        row(3, 70.0, "70 %"),
        row(4, 100.0, "100 % (no masking)"),
    ]
}

fn weights(base: &FitConfig, set: Option<PaperSet>) -> Vec<Variant> {
    let row = |k: usize, w_em: f64, w_kine: f64, name: &str| {
        let paper = set.map(|set| PaperRow::of_pair(paper::weights(set)[k]));
        Variant::cold([name], &FitConfig { w_em, w_kine, ..*base }).beside(paper)
    };
    vec![
        row(0, 0.3, 0.7, "0.3 / 0.7"),
        row(1, 0.5, 0.5, "0.5 / 0.5"),
        row(2, 0.7, 0.3, "0.7 / 0.3"),
        row(3, 0.0, 1.0, "0 / 1 (pure kinematic)"),
        row(4, 1.0, 0.0, "1 / 0 (pure electromagnetic)"),
    ]
}

fn init(base: &FitConfig, set: Option<PaperSet>) -> Vec<Variant> {
    let row = |k: usize, name: &str, position: bool, velocity: bool| {
        let init = InitConfig { position, velocity, ..base.init };
        let paper = set.map(|set| PaperRow { majpe_mm: Some(paper::init(set)[k]), ..PaperRow::default() });
        Variant::cold([name], &FitConfig { init, ..*base }).beside(paper)
    };
    vec![
        row(0, "full (P + V)", true, true),
        row(1, "without position (P)", false, true),
        row(2, "without velocity (V)", true, false),
    ]
}

fn counting(base: &FitConfig, set: Option<PaperSet>) -> Vec<Variant> {
    let row = |name: &str, method: Method, accuracy: f64| {
        let paper = set.map(|_| PaperRow { count_accuracy: Some(accuracy), ..PaperRow::default() });
        Variant::cold([name], base).counting(method).beside(paper)
    };
    vec![
        row("CFAR + DBSCAN + MLP", Method::Counter, 0.994),
        row("MLP alone", Method::Alone, 0.946),
        row("CNN", Method::Maps, 0.975),
    ]
}

/// Every row from the truth follows the one from the program's own start that it is compared with ([`super::table`]).
fn truth(base: &FitConfig) -> Vec<Variant> {
    let exact = InitConfig { position_noise_m: 0.0, position_bias_m: 0.0, velocity_noise_mps: 0.0, ..base.init };
    let given = |label: String, config: &FitConfig| Variant::cold([label], config).started_at_truth();
    let whole = [Variant::cold(["own"], base), given("truth".into(), &FitConfig { init: exact, ..*base })];
    let base = &FitConfig { init: exact, ..*base };
    let free = (base.w_given > 0.0).then(|| given("truth, w_given = 0".into(), &FitConfig { w_given: 0.0, ..*base }));
    let off = GIVEN_OFF_M.map(|noise_m| {
        let init = InitConfig { position_noise_m: noise_m, ..exact };
        given(format!("truth ± {:.0} mm", 1e3 * noise_m), &FitConfig { init, ..*base })
    });
    whole.into_iter().chain(free).chain(off).collect()
}

fn budget(base: &FitConfig) -> Vec<Variant> {
    let row = |start: &str, iterations: usize| {
        Variant::cold([start.to_owned(), iterations.to_string()], &FitConfig { iterations, ..*base })
    };
    let cold = BUDGETS.map(|iterations| row("cold", iterations));
    let warm = BUDGETS.map(|iterations| row("warm", iterations).warm());
    cold.into_iter().chain(warm).collect()
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests fail by panicking")]
    use super::*;

    fn rows(kind: StudyKind) -> Vec<Variant> {
        compared(kind, &FitConfig::default(), &[], &[], "mmvr").unwrap().variants
    }

    #[test]
    fn every_study_has_the_papers_rows_and_valid_settings() {
        let counts = [
            (StudyKind::Complexity, 1, 0),
            (StudyKind::Robustness, 11, 10),
            (StudyKind::Operators, 5, 5),
            (StudyKind::Threshold, 5, 5),
            (StudyKind::Weights, 5, 5),
            (StudyKind::Init, 3, 3),
            (StudyKind::Budget, 16, 0),
            (StudyKind::Counting, 3, 3),
            (StudyKind::Truth, 4, 0),
        ];
        for (kind, all, of_paper) in counts {
            let rows = rows(kind);
            assert_eq!(rows.len(), all, "{kind}");
            assert_eq!(rows.iter().filter(|row| row.paper.is_some()).count(), of_paper, "{kind}");
        }
        for kind in StudyKind::ALL.into_iter().filter(|kind| *kind != StudyKind::Sweep) {
            let compared = compared(kind, &FitConfig::default(), &[], &[], "mmvr").unwrap();
            for variant in compared.variants {
                assert_eq!(variant.labels.len(), compared.columns.len(), "{kind}: {}", variant.name());
                assert!(variant.config.validated().is_ok(), "{kind}: {}", variant.name());
            }
        }
    }

    #[test]
    fn other_data_have_no_figures_of_the_paper() {
        for kind in StudyKind::ALL.into_iter().filter(|kind| *kind != StudyKind::Sweep) {
            let rows = compared(kind, &FitConfig::default(), &[], &[], "npz").unwrap().variants;
            assert!(rows.iter().all(|row| row.paper.is_none()), "{kind}");
        }
        let hupr = compared(StudyKind::Threshold, &FitConfig::default(), &[], &[], "hupr").unwrap().variants;
        assert_eq!(hupr[1].paper.and_then(|paper| paper.majpe_mm), Some(73.74), "HuPR's own column");
    }

    #[test]
    fn the_rows_differ_from_the_base_as_they_say() {
        let robust = rows(StudyKind::Robustness);
        assert!(robust.iter().all(|row| row.config.iterations == 80));
        assert_eq!(robust.iter().filter(|row| row.start == super::super::StartFrom::Warm).count(), 1);
        let last = rows(StudyKind::Threshold).pop().unwrap();
        assert_eq!(last.config.tau_pct, 100.0);
        let pure = rows(StudyKind::Weights);
        assert_eq!((pure[3].config.w_em, pure[3].config.w_kine), (0.0, 1.0));
        assert_eq!(rows(StudyKind::Init).iter().filter(|row| row.config.init.position).count(), 2);
    }
}
