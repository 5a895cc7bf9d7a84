//! Metrics of a fit.
