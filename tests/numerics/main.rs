//! The mathematics: reference cases, gradients, both precisions, starts and fits, and the radar that is synthesised.

#[path = "../common/cases.rs"]
mod cases;
#[path = "../common/mod.rs"]
mod common;
#[path = "../common/reading.rs"]
mod reading;

mod fitter;
mod gradients;
mod initialisation;
mod mmvr;
mod reference;
mod signal;
mod single_precision;
mod synthesis;
mod walk;
