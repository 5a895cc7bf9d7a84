//! What can be wrong with what the counter is given.

/// Why people cannot be counted.
#[derive(Debug, thiserror::Error)]
pub enum PeopleError {
    /// A map is not what its view says.
    #[error("{array}: {got} cells, expected {expected}: the bins of its axes")]
    WrongCells {
        /// The view's array.
        array: String,
        /// Cells given.
        got: usize,
        /// Cells of the view.
        expected: usize,
    },
    /// Not one map a view.
    #[error("{got} maps for {expected} views")]
    WrongMaps {
        /// Maps given.
        got: usize,
        /// Views.
        expected: usize,
    },
    /// A map holds no number at all.
    #[error("{array}: no cell holds a finite number")]
    NoNumbers {
        /// The view's array.
        array: String,
    },
    /// No view tells a direction and a distance.
    #[error(
        "no view has both a distance (range, depth, x) and a direction (azimuth, cone, y, elevation, z): people cannot be placed"
    )]
    NoPlace,
    /// Weights that are not a network of the expected shape.
    #[error("weights of the counter: {message}")]
    Weights {
        /// What is wrong.
        message: String,
    },
}
