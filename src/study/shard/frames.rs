//! Which frames of a data set: ranges, as they are written on the command line and in `run.toml`.

use serde::{Deserialize, Serialize};
use std::fmt;
use std::ops::Range;

/// Frames of a data set by their indices: ranges that ascend and do not touch. As text `0..5,7,9..12`, the ends not included.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub struct FrameRanges(Vec<Range<usize>>);

impl FrameRanges {
    /// The frames of any of these ranges.
    pub fn of_ranges(ranges: impl IntoIterator<Item = Range<usize>>) -> Self {
        let mut ranges: Vec<Range<usize>> = ranges.into_iter().filter(|range| !range.is_empty()).collect();
        ranges.sort_by_key(|range| range.start);
        let mut joined: Vec<Range<usize>> = Vec::with_capacity(ranges.len());
        for range in ranges {
            match joined.last_mut() {
                Some(last) if range.start <= last.end => last.end = last.end.max(range.end),
                _ => joined.push(range),
            }
        }
        Self(joined)
    }

    /// These frames, in any order.
    pub fn of_frames(frames: impl IntoIterator<Item = usize>) -> Self {
        Self::of_ranges(frames.into_iter().map(|frame| frame..frame + 1))
    }

    /// From the first to one past the last frame; empty where there is none.
    pub fn hull(&self) -> Range<usize> {
        let ends = self.0.first().zip(self.0.last());
        ends.map_or(0..0, |(first, last)| first.start..last.end)
    }

    /// The frames, ascending.
    pub fn iter(&self) -> impl Iterator<Item = usize> + '_ {
        self.0.iter().cloned().flatten()
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.0.iter().map(ExactSizeIterator::len).sum()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Whether frames are left out between the first and the last.
    pub fn has_gaps(&self) -> bool {
        self.0.len() > 1
    }
}

impl From<Range<usize>> for FrameRanges {
    fn from(range: Range<usize>) -> Self {
        Self::of_ranges([range])
    }
}

impl fmt::Display for FrameRanges {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (k, range) in self.0.iter().enumerate() {
            let comma = if k > 0 { "," } else { "" };
            match range.len() {
                1 => write!(f, "{comma}{}", range.start)?,
                _ => write!(f, "{comma}{}..{}", range.start, range.end)?,
            }
        }
        Ok(())
    }
}

impl From<FrameRanges> for String {
    fn from(frames: FrameRanges) -> Self {
        frames.to_string()
    }
}

impl TryFrom<String> for FrameRanges {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let range = |part: &str| {
            let number = |text: &str| text.parse::<usize>().ok();
            let range = match part.split_once("..") {
                Some((first, end)) => number(first).zip(number(end)).map(|(first, end)| first..end),
                None => number(part).and_then(|frame| Some(frame..frame.checked_add(1)?)),
            };
            range.ok_or_else(|| format!("`{part}` is no range of frames; expected for example 0..5,7,9..12"))
        };
        Ok(Self::of_ranges(text.split(',').map(range).collect::<Result<Vec<_>, _>>()?))
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests fail by panicking")]
    use super::*;

    #[test]
    fn frames_are_joined_to_ranges_and_read_back() {
        let frames = FrameRanges::of_frames([7, 1, 0, 2, 9, 10, 2]);
        assert_eq!((frames.to_string().as_str(), frames.len(), frames.hull()), ("0..3,7,9..11", 6, 0..11));
        assert_eq!(frames.iter().collect::<Vec<_>>(), [0, 1, 2, 7, 9, 10]);
        assert!(frames.has_gaps() && !FrameRanges::from(3..9).has_gaps());
        assert_eq!(FrameRanges::try_from(frames.to_string()).unwrap(), frames);
        assert_eq!(FrameRanges::of_ranges([4..6, 0..4, 9..9]).to_string(), "0..6");
        assert!(FrameRanges::default().is_empty() && FrameRanges::default().hull().is_empty());
        assert!(FrameRanges::try_from("0..3,x".to_owned()).is_err_and(|why| why.contains("`x` is no range")));
    }
}
