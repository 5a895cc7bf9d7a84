//! `--frames A..B`: which frames, as a range is written in Rust.

use crate::dataset::Dataset;
use crate::study::shard::FrameRanges;
use std::ops::Range;
use std::path::Path;
use std::str::FromStr;

/// The frames asked for; the one that `path` names; or all.
///
/// # Errors
/// Where the range reaches past the end.
pub(super) fn chosen(asked: Option<FrameRange>, path: &Path, dataset: &Dataset) -> anyhow::Result<Range<usize>> {
    let Some(range) = asked else {
        return Ok(dataset.named_frame().map_or(0..dataset.len(), |frame| frame..frame + 1));
    };
    range.within(dataset.len()).map_err(|why| anyhow::anyhow!("{}: --frames: {why}", path.display()))
}

/// The frames of all these ranges; the one that `path` names, or all, where there is none.
///
/// # Errors
/// Where a range reaches past the end.
pub(super) fn chosen_set(asked: &[FrameRange], path: &Path, dataset: &Dataset) -> anyhow::Result<FrameRanges> {
    if asked.is_empty() {
        return Ok(chosen(None, path, dataset)?.into());
    }
    let ranges = asked.iter().map(|range| chosen(Some(*range), path, dataset));
    Ok(FrameRanges::of_ranges(ranges.collect::<anyhow::Result<Vec<_>>>()?))
}

/// A range of frames as typed; the end is open where none was given.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct FrameRange {
    start: usize,
    end: Option<usize>,
}

impl FromStr for FrameRange {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = |part: &str| {
            let part = part.trim();
            let wrong = |_| format!("`{part}` is not a frame number; expected 5..12, 5..=11, 5.., ..12 or 7");
            part.parse::<usize>().map_err(wrong)
        };
        let after = |last: usize| last.checked_add(1).ok_or_else(|| format!("frame {last} is too large"));
        let Some((first, last)) = text.split_once("..") else {
            let one = number(text)?;
            return Ok(Self { start: one, end: Some(after(one)?) });
        };
        let start = if first.trim().is_empty() { 0 } else { number(first)? };
        let end = match last.strip_prefix('=') {
            Some(last) => Some(after(number(last)?)?),
            None if last.trim().is_empty() => None,
            None => Some(number(last)?),
        };
        match end {
            Some(end) if end <= start => Err(format!("{start} to {end} holds no frame; the end is not included")),
            _ => Ok(Self { start, end }),
        }
    }
}

impl FrameRange {
    /// The frames meant in a data set of `count`.
    ///
    /// # Errors
    /// In words, where the range reaches past the end.
    pub(super) fn within(self, count: usize) -> Result<Range<usize>, String> {
        let end = self.end.unwrap_or(count);
        if self.start < count && end <= count {
            return Ok(self.start..end);
        }
        let asked = match self.end {
            Some(end) if end == self.start + 1 => format!("frame {} was", self.start),
            Some(end) => format!("frames {}..{end} were", self.start),
            None => format!("frames {}.. were", self.start),
        };
        Err(format!("{asked} asked for; the data set has {count}, counted from 0"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn within(text: &str, count: usize) -> Result<Range<usize>, String> {
        text.parse::<FrameRange>()?.within(count)
    }

    #[test]
    fn ranges_are_written_as_in_rust() {
        let cases = [("5..12", 5..12), ("5..", 5..20), ("..12", 0..12), ("7", 7..8), ("5..=11", 5..12), ("..", 0..20)];
        for (text, wanted) in cases {
            assert_eq!(within(text, 20), Ok(wanted), "{text}");
        }
        assert_eq!(within("..=3", 20), Ok(0..4));
    }

    #[test]
    fn what_is_no_range_says_what_would_be() {
        for text in ["a..3", "1..b", "", "1-3", "-1..3", "1..=", "99999999999999999999"] {
            let error = within(text, 20).err().unwrap_or_default();
            assert!(error.contains("not a frame number; expected 5..12"), "{text}: {error}");
        }
        assert!(within("18446744073709551615", 20).is_err_and(|e| e.contains("too large")));
        assert!(within("5..5", 20).is_err_and(|e| e.contains("holds no frame")));
        assert!(within("7", 7).is_err_and(|e| e == "frame 7 was asked for; the data set has 7, counted from 0"));
        assert!(within("3..9", 7).is_err_and(|e| e.contains("frames 3..9 were asked for")));
    }
}
