//! What people say of frames: tags, notes, review verdicts; the journal that keeps them, and how far two people agree.
//!
//! A [`Label`] is all that one annotator says of one frame. It is changed by a [`Change`], which names only what is
//! added and removed, so that two windows on one data set merge instead of overwriting each other. Each act appends
//! [`Record`]s to the annotator's [`Journal`]; the newest record of a frame is its label, and a [`LabelStore`] reads those
//! of everybody. Nothing here knows a window, a data set or a fit: frames are names, fits are hashes.
//!
//! The files are a public format, JSON lines; `format.rs` describes all of it.

mod acts;
mod agreement;
mod error;
mod file;
mod format;
mod import;
mod journal;
mod kappa;
mod place;
mod record;
mod stamp;
mod statistics;
mod store;
mod table;
mod tags;
mod tail;
mod verdicts;

pub use acts::{place_acts, read_acts, read_labels};
pub use agreement::{
    Agreement, Dispute, MACHINE_THRESHOLD, MachineAgreement, against_machine, agreement, compare_tags, judged,
    judged_in_acts, standing,
};
pub use error::LabelError;
pub use import::{ImportPlan, is_dated_ahead, plan_import};
pub use journal::{Journal, Outcome, SaidElsewhere};
pub use kappa::{RELIABLE_FRAMES, TagAgreement};
pub use place::LabelPlace;
pub use record::{CellRegion, Change, FrameId, Judged, Label, Record};
pub use statistics::{AnnotatorStatistics, LabelCounts, PAUSE_S, Pace, day, statistics};
pub use store::{LabelStore, read_journal};
pub use table::{COLUMNS, LabelRow, ReadTable, TableError, read_table, write_csv, write_json};
pub use tags::{Tag, Tags, Verdict};
pub use verdicts::{VerdictAgreement, verdict_agreement};
