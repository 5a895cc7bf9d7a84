//! Several people: how many there are, which is which, and `count`.

#[path = "../common/blob.rs"]
mod blob;

mod cli;
mod counter;
mod identity;
mod starts;
