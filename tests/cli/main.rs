//! The command line as a person meets it: what it writes, what it refuses, and what a terminal is shown.

#[path = "../common/blob.rs"]
mod blob;
#[path = "../common/mod.rs"]
mod common;
#[path = "../common/reading.rs"]
mod reading;

mod bad_input;
mod evidence;
mod explore;
mod fit;
mod hostile_text;
mod rests_on;
mod score;
