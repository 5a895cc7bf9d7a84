//! Conditions in words: the language of the frame list's filter (`stratum:hard iou<0.5 -tag:F1`) and, in the same language, the
//! breakpoints of a run (`iou<0.4`, `l_bone rises 5`).
//!
//! Terms are separated by spaces and must all hold; a `-` before a term negates it; what stands in quotes is one word.

mod breakpoint;
mod language;
mod quantity;

pub use breakpoint::{Breakpoint, Watch, syntax};
pub(crate) use language::{Comparison, comparison, split};
