//! Cohen's kappa of one yes-or-no decision, from the 2×2 table of two annotators.
//!
//! `κ = (p_o − p_e)/(1 − p_e)`: `p_o` is the share of equal decisions, `p_e` the share expected if both had decided at
//! random with their own frequencies (Cohen 1960). In counts `κ = 1 − n (b + c)/(A·B̄ + Ā·B)` with the disputed `b` and
//! `c`, and yes and no totals `A`, `Ā` and `B`, `B̄`: integers up to one division, hence exact to the last digits. Where
//! both decided the same one way every time it is 0/0, and undefined rather than 1.

use serde::Serialize;

/// Below this many frames with a tag (or without) in either file, one frame more or less moves κ a lot.
pub const RELIABLE_FRAMES: usize = 10;

/// How two annotators used one tag on the frames that both judged.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TagAgreement {
    /// Cohen's kappa; `None` where undefined: no frame, or the same one answer by both on all.
    pub kappa: Option<f64>,
    /// Share of equal decisions; `None` without a frame.
    pub raw: Option<f64>,
    /// Decisions where both say yes.
    pub both: usize,
    /// Where only the first does.
    pub only_a: usize,
    /// Where only the second does.
    pub only_b: usize,
    /// Where neither does.
    pub neither: usize,
    /// Share of yes in the first; `None` without a frame.
    pub prevalence_a: Option<f64>,
    /// Share of yes in the second.
    pub prevalence_b: Option<f64>,
    /// Why κ should not be trusted.
    pub unreliable: Option<String>,
}

impl TagAgreement {
    /// From the decisions, (first's, second's).
    pub fn of(decisions: impl IntoIterator<Item = (bool, bool)>) -> Self {
        let mut counts = [0; 4];
        for (a, b) in decisions {
            let cell = match (a, b) {
                (true, true) => 0,
                (true, false) => 1,
                (false, true) => 2,
                (false, false) => 3,
            };
            counts[cell] += 1;
        }
        Self::of_counts(counts)
    }

    /// From how often both, only the first, only the second and neither said yes.
    pub fn of_counts([both, only_a, only_b, neither]: [usize; 4]) -> Self {
        let total = both + only_a + only_b + neither;
        let share = |part: usize| (total > 0).then(|| part as f64 / total as f64);
        let kappa = kappa(both, only_a, only_b, neither);
        Self {
            kappa,
            raw: share(both + neither),
            both,
            only_a,
            only_b,
            neither,
            prevalence_a: share(both + only_a),
            prevalence_b: share(both + only_b),
            unreliable: unreliable(total, total - neither, total - both, kappa),
        }
    }

    /// Decisions in all.
    pub fn total(&self) -> usize {
        self.both + self.only_a + self.only_b + self.neither
    }
}

fn kappa(both: usize, only_a: usize, only_b: usize, neither: usize) -> Option<f64> {
    let [both, only_a, only_b, neither] = [both, only_a, only_b, neither].map(|n| n as u128);
    let (yes_a, no_a) = (both + only_a, only_b + neither);
    let (yes_b, no_b) = (both + only_b, only_a + neither);
    let by_chance = yes_a * no_b + no_a * yes_b;
    let disputed = (yes_a + no_a) * (only_a + only_b);
    // As a difference of integers: where κ is near 0 nothing cancels.
    let above = by_chance as i128 - disputed as i128;
    (by_chance > 0).then(|| above as f64 / by_chance as f64)
}

/// `yes` and `no` count the decisions where at least one said so.
fn unreliable(total: usize, yes: usize, no: usize, kappa: Option<f64>) -> Option<String> {
    let (rare, verb) = if yes <= no { (yes, "have it") } else { (no, "lack it") };
    if total == 0 {
        Some("nothing was judged by both".into())
    } else if kappa.is_none() {
        let always = if yes == 0 { "neither used it" } else { "both gave it every time" };
        Some(format!("{always}: κ is undefined"))
    } else if rare < RELIABLE_FRAMES {
        Some(format!("only {rare} of {total} {verb} in A or B; κ needs {RELIABLE_FRAMES} or more"))
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_textbook_table_gives_the_textbook_kappa() {
        // Fifty grant proposals, two readers: p_o = 0.7, p_e = 0.5.
        let table = TagAgreement::of_counts([20, 5, 10, 15]);
        assert!((table.kappa.unwrap_or(f64::NAN) - 0.4).abs() < 1e-15);
        assert_eq!((table.raw, table.prevalence_a, table.prevalence_b), (Some(0.7), Some(0.5), Some(0.6)));
        assert_eq!(table.unreliable, None);
    }

    #[test]
    fn one_category_is_undefined_and_nothing_is_nothing() {
        for counts in [[7, 0, 0, 0], [0, 0, 0, 7]] {
            let table = TagAgreement::of_counts(counts);
            assert_eq!((table.kappa, table.raw), (None, Some(1.0)));
            assert!(table.unreliable.is_some_and(|why| why.contains("undefined")));
        }
        let nothing = TagAgreement::of([]);
        assert_eq!((nothing.kappa, nothing.raw, nothing.total()), (None, None, 0));
        assert_eq!(TagAgreement::of_counts([0, 5, 0, 0]).kappa, Some(0.0), "one says always, the other never");
    }

    #[test]
    fn what_is_rare_either_way_is_flagged() {
        let flagged = |counts| TagAgreement::of_counts(counts).unreliable;
        assert!(flagged([3, 3, 3, 500]).is_some_and(|why| why.starts_with("only 9 of 509 have it")));
        assert!(flagged([500, 3, 3, 3]).is_some_and(|why| why.starts_with("only 9 of 509 lack it")));
        assert_eq!(flagged([3, 4, 3, 500]), None);
    }

    #[test]
    fn counts_too_large_for_floats_do_not_overflow() {
        let n = usize::MAX / 4;
        assert_eq!(TagAgreement::of_counts([n, 0, 0, n]).kappa, Some(1.0));
    }
}
