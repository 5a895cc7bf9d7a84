//! The state behind the window and the worker thread, without a window.

#[path = "../common/blob.rs"]
mod blob;

mod acts;
mod labels;
mod state;
mod worker;
