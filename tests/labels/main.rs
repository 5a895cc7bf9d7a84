//! Labels: the journal through kills and damage, where it lies, the labels of several annotators in tables, and agreement.

#[path = "../common/blob.rs"]
mod blob;
#[path = "../common/labels.rs"]
mod labels;

mod agreement;
mod damage;
mod exchange;
mod journal;
mod place;
mod table;
