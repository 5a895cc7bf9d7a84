//! The real window without a display: panes, commands, labels, studies, journeys through all of it, and 100,000 frames.
#![cfg(feature = "viewer")]

#[path = "../common/blob.rs"]
mod blob;
#[path = "../journey/mod.rs"]
mod journey;
mod rests_on;
#[path = "../common/scenes.rs"]
mod scenes;
#[path = "../common/tree.rs"]
mod tree;
#[path = "../common/window.rs"]
mod window;

mod breakpoints;
mod compare;
mod erase;
mod explore;
mod hand;
mod labels;
mod large;
mod lit;
mod maps;
mod pictures;
mod predictions;
mod radar;
mod results;
mod seen;
mod sizes;
mod study;
mod ui;
mod visits;
