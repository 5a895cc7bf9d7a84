//! How iterations are laid along the horizontal axis.

use egui_plot::{GridInput, GridMark, uniform_grid_spacer};

/// Evenly, or with as much room for the first ten as for the next ninety.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Along {
    #[default]
    Even,
    /// log₁₀(1 + iteration): the start has a place too.
    Log,
}

impl Along {
    /// As a view says.
    pub(super) fn of(log: bool) -> Self {
        if log { Self::Log } else { Self::Even }
    }

    /// Where an iteration is.
    pub(super) fn x(self, iteration: f64) -> f64 {
        match self {
            Self::Even => iteration,
            Self::Log => (1.0 + iteration.max(0.0)).log10(),
        }
    }

    /// The iteration at a place, perhaps between two.
    pub(super) fn iteration(self, x: f64) -> f64 {
        match self {
            Self::Even => x,
            Self::Log => 10f64.powf(x.clamp(0.0, 18.0)) - 1.0,
        }
    }

    /// Whole iterations, at least 1, that lie on a column of this width from `iteration` on.
    pub(super) fn iterations_on(self, column: f64, iteration: usize) -> usize {
        let width = match self {
            Self::Even => column,
            Self::Log => (1.0 + iteration as f64) * (10f64.powf(column) - 1.0),
        };
        (width as usize).max(1)
    }

    /// The lines of the grid.
    pub(super) fn grid(self, input: GridInput) -> Vec<GridMark> {
        match self {
            Self::Even => uniform_grid_spacer(|input| iterations(input.base_step_size))(input),
            Self::Log => log_iterations(input.bounds),
        }
    }

    /// What is written at a line of the grid.
    pub(super) fn tick(self, x: f64) -> String {
        let iteration = self.iteration(x);
        let whole = (iteration - iteration.round()).abs() < 1e-6 * iteration.abs().max(1.0);
        if whole { format!("{}", iteration.round()) } else { String::new() }
    }
}

/// Steps of the grid along the iterations: between lines, between those with a number (1, 2 or 5 times a power of ten, which
/// leaves room for it), and between the strongest; `base` are those that the plot would draw at most.
fn iterations(base: f64) -> [f64; 3] {
    // The plot asks for lines that are 8 points apart or more, and writes numbers 80 points apart.
    let wanted = (10.0 * base).max(1.0);
    let decade = 10f64.powf(wanted.log10().floor());
    let round = [(1.0, 0.2), (2.0, 0.5), (5.0, 1.0), (10.0, 2.0)];
    let (numbered, line) = round.into_iter().find(|(step, _)| step * decade >= wanted).unwrap_or((10.0, 2.0));
    [(line * decade).max(1.0), numbered * decade, 10.0 * numbered * decade]
}

/// The start, powers of ten, and 2 and 5 times these.
fn log_iterations((lo, hi): (f64, f64)) -> Vec<GridMark> {
    let decades = (0..19).map(|power| 10f64.powi(power));
    let marks = decades.flat_map(|ten| [(ten, 1.0), (2.0 * ten, 0.3), (5.0 * ten, 0.3)]);
    let all = std::iter::once((0.0, 1.0)).chain(marks);
    let placed = all.map(|(iteration, step_size)| GridMark { value: Along::Log.x(iteration), step_size });
    placed.filter(|mark| (lo..=hi).contains(&mark.value)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_along_the_iterations_are_round_and_have_room() {
        assert_eq!(iterations(0.01), [1.0, 1.0, 10.0], "nothing lies between two iterations");
        assert_eq!(iterations(0.75), [2.0, 10.0, 100.0]);
        assert_eq!(iterations(16.0), [50.0, 200.0, 2000.0]);
        assert_eq!(iterations(160.0), [500.0, 2000.0, 20_000.0]);
        assert_eq!(iterations(30.0), [100.0, 500.0, 5000.0]);
    }

    #[test]
    fn places_and_iterations_are_each_others_inverse_and_the_start_has_a_place() {
        for along in [Along::Even, Along::Log] {
            for k in [0.0, 1.0, 9.0, 99.0, 12_345.0] {
                assert!((along.iteration(along.x(k)) - k).abs() < 1e-6, "{along:?} {k}");
            }
        }
        let ticks: Vec<String> = log_iterations((0.0, 2.1)).iter().map(|mark| Along::Log.tick(mark.value)).collect();
        assert_eq!(ticks, ["0", "1", "2", "5", "10", "20", "50", "100"]);
        assert_eq!(Along::Even.tick(2.5), "");
    }

    #[test]
    fn far_out_a_column_of_a_log_axis_holds_more() {
        assert_eq!(Along::Even.iterations_on(3.7, 90_000), 3);
        assert_eq!(Along::Log.iterations_on(0.005, 0), 1);
        let far = Along::Log.iterations_on(0.005, 99_999);
        assert!((1100..1200).contains(&far), "{far}");
    }
}
