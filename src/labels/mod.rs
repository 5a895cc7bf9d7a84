//! What people say of frames: tags, notes, review verdicts; the journal that keeps them, and how far two people agree.
//!
//! A [`Label`] is all that one annotator says of one frame. It is changed by a [`Change`], which names only what is
//! added and removed, so that two windows on one data set merge instead of overwriting each other. Each act appends
//! [`Record`]s to the annotator's journal; the newest record of a frame is its label. Nothing here knows a window, a
//! data set or a fit: frames are names, fits are hashes.

mod agreement;
mod import;
mod kappa;
mod record;
mod statistics;
mod table;

pub use agreement::{Agreement, Dispute, MachineAgreement, against_machine, agreement, current, judgements};
pub use import::{ImportPlan, plan_import};
pub use kappa::{RELIABLE_FRAMES, TagAgreement};
pub use record::{CellRegion, Change, FrameId, Judged, Label, Record, Tag, Tags, Verdict};
pub use statistics::{AnnotatorStatistics, LabelCounts, PAUSE_S, Pace, statistics};
pub use table::{COLUMNS, Row, Table, TableError, read_table, write_csv, write_json};
