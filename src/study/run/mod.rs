//! Studies: variants of a configuration over the frames of a data set, as a run folder.
//!
//! A [`RunPlan`] says what is compared and in which units it is done; [`execute_run`] does it on all cores and goes on where a
//! killed run stopped; [`merge_runs`] makes one run of its shards; [`Run`] reads it back. From the inside out: `variant.rs` is one
//! configuration, `plans.rs` the studies' rows, `grid.rs` and `switches.rs` two ways to make them, `kind.rs` their names,
//! `paper.rs` the paper's figures beside them and `reach.rs` whether what they perturb can act; `spec.rs` is the file that says
//! what a run is, `plan.rs` its units of work, `fit.rs` one frame, `single.rs` one fit of it by
//! itself, `counting.rs` the people of a frame, `row.rs` what is known of either, `journal.rs` what is done, `engine.rs` the threads, `table.rs` the sums,
//! `output.rs`, `markdown.rs` and `parquet_rows.rs` the files, `folder.rs` all of them together.
//!
//! A run folder: `run.toml` (the specification), `journal.jsonl` (rows as they were done), `rows.csv` and `rows.parquet` (the same,
//! sorted), `table.md` and `table.json`; `timing.csv` and `timing.md`, which alone differ from run to run.
//!
//! **What the studies of the bundled sample show** (a walker, 28 frames; the tables are in `tests/RESULTS.md`), and where that
//! differs from the paper, whose figures are of a network that reads PPPR and not of the fit itself:
//!
//! * `init`: without positions the fit is lost; without velocities nothing changes, because Cartesian maps have no Doppler
//!   axis, where the paper's network loses 3 mm.
//! * `operators`: none matters by more than 1 mm, because Cartesian axes have no operator; the paper loses most without range.
//! * `threshold`: 5 and 10 % are best, 30 % worst; the paper has 10 % best too.
//! * `weights`: the more weight on the electromagnetic term, the higher the IoU and the worse the pose; MAJPE is flat between.
//! * `budget`: from 5 to 100 iterations IoU grows and MAJPE falls by 5 mm, while PA-MAJPE grows: the objective moves the body and
//!   bends its limbs. A warm start is 20 mm better for 25 iterations and hardly better after 80.
//! * `robustness`: noise of positions is partly undone, that of velocities is not: the rigid term turns it into bent limbs. A row
//!   that cannot act with the settings at hand says why.
//! * `switches`: most of what `recommended` gains comes from the heading, then from trying the postures of a stride, then from the
//!   place in the frames around.

mod counting;
mod engine;
mod error;
mod fit;
mod folder;
mod grid;
mod journal;
mod kind;
mod markdown;
mod output;
mod paper;
mod parquet_rows;
mod plan;
mod plans;
mod reach;
mod row;
mod single;
mod spec;
mod switches;
mod table;
mod variant;

pub use error::RunError;
pub use folder::{Run, RunFolder, check_run_folder, execute_run, is_run_folder, merge_runs, seed_run};
pub use grid::GridAxis;
pub use journal::JOURNAL_FILE;
pub use kind::StudyKind;
pub use output::TABLE_FILE;
pub use paper::PaperVerification;
pub use plan::{RunPlan, RunRequest, points, sweep};
pub use row::{RunNumbers, RunRow};
pub use single::{FrameSweep, SweptFit, failed_row};
pub use spec::{RUN_FILE, RunSpec};
pub use table::{CountShares, SceneTable, Spread, TableRow, mark, notes};
pub use variant::{Method, PaperRow, StartFrom, Variant};
