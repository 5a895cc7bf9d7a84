//! The real window without a display: panes, commands, labels, studies, a journey through all of it, and 100,000 frames.
#![cfg(feature = "viewer")]

#[path = "../common/blob.rs"]
mod blob;
#[path = "../common/scenes.rs"]
mod scenes;
#[path = "../common/tree.rs"]
mod tree;
#[path = "../common/window.rs"]
mod window;

mod compare;
mod hand;
mod journey;
mod labels;
mod large;
mod maps;
mod results;
mod study;
mod ui;
