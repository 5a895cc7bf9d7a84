//! How many people a frame shows by itself, whatever is fitted and annotated.

use super::{EvidenceInput, Past};
use crate::people::{Count, Counter, Scan};

/// The count of the frame with those before it; `None` where the views do not tell places.
pub(super) fn count(input: &EvidenceInput<'_>, past: &[Past<'_>]) -> Option<Count> {
    let views = &input.problem.views;
    let counter = Counter::new(views).inspect_err(|error| tracing::debug!("not counted: {error}")).ok()?;
    let earlier = past.iter().map(|frame| frame.maps.iter().map(AsRef::as_ref).collect::<Vec<&[f64]>>());
    let now = (0..views.len()).map(|view| input.problem.map(view)).collect();
    let mut scans: Vec<Scan> = Vec::new();
    for maps in earlier.chain(std::iter::once(now)) {
        let known: Vec<&Scan> = scans.iter().rev().collect();
        let scan = counter.scan(&maps, &known).inspect_err(|error| tracing::debug!("not counted: {error}")).ok()?;
        scans.push(scan);
    }
    let latest: Vec<&Scan> = scans.iter().rev().collect();
    let (now, before) = latest.split_first()?;
    Some(counter.count(now, before))
}
