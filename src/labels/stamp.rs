//! Which of two records of a frame and annotator is the newer one.
//!
//! In one file the order of lines says so, whatever a clock said. Between files it is first whether the file is the
//! annotator's own, then the records' orders; each counts as no earlier than those before it in its file, so that the
//! answer is the same in whichever order the files are read.

use super::Record;
use std::cmp::Reverse;
use std::collections::HashMap;

/// Where and when a record was written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Stamp {
    /// True where the file speaks for the record's annotator.
    pub(super) own: bool,
    /// The record's order, milliseconds since 1970.
    pub(super) order_ms: i64,
    /// The number of its folder; the one that is written is 0.
    pub(super) folder: usize,
    /// The number of its file.
    pub(super) file: usize,
}

impl Stamp {
    /// What sorts records of several files from old to new.
    pub(super) fn rank(self) -> (bool, i64, Reverse<(usize, usize)>) {
        (self.own, self.order_ms, Reverse((self.folder, self.file)))
    }

    /// The stamp of the newer of the newest record so far and one that is read now; `None` where nothing changes.
    pub(super) fn newer_than(self, newest: Option<Self>) -> Option<Self> {
        let Some(newest) = newest else { return Some(self) };
        if newest.file == self.file {
            return Some(Self { order_ms: newest.order_ms.max(self.order_ms), ..self });
        }
        (self.rank() > newest.rank()).then_some(self)
    }
}

/// Makes no record of a frame earlier than those before it in its file: a clock that was set back does not reorder them.
pub(super) fn in_lines_order(acts: &mut [(Stamp, Record)]) {
    let mut newest: HashMap<(usize, &str, &str), i64> = HashMap::new();
    for (stamp, record) in acts {
        let known = newest.entry((stamp.file, &record.annotator, &record.frame.path)).or_insert(i64::MIN);
        *known = (*known).max(stamp.order_ms);
        stamp.order_ms = *known;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The record that is left after reading `(file, time)` in this order; files from 10 on speak for somebody else.
    fn left(records: &[(usize, i64)]) -> Option<(usize, i64)> {
        let mut newest: Option<(Stamp, (usize, i64))> = None;
        for &(file, order_ms) in records {
            let stamp = Stamp { own: file < 10, order_ms, folder: file, file };
            if let Some(stamp) = stamp.newer_than(newest.map(|newest| newest.0)) {
                newest = Some((stamp, (file, order_ms)));
            }
        }
        newest.map(|newest| newest.1)
    }

    #[test]
    fn the_order_in_which_files_are_read_does_not_matter() {
        // A clock that was set back: the later line of file 0 counts as its earlier one, which is after file 1's.
        assert_eq!(left(&[(0, 10), (0, 5), (1, 7)]), Some((0, 5)));
        assert_eq!(left(&[(1, 7), (0, 10), (0, 5)]), Some((0, 5)));
        assert_eq!(left(&[(0, 10), (1, 7), (0, 5)]), Some((0, 5)));
        // Equal times: the folder that is written wins.
        assert_eq!(left(&[(0, 3), (1, 3)]), Some((0, 3)));
        assert_eq!(left(&[(1, 3), (0, 3)]), Some((0, 3)));
        assert_eq!(left(&[(0, 1), (1, 2), (0, 3), (1, 4)]), Some((1, 4)));
        assert_eq!(left(&[(1, 2), (1, 4), (0, 1), (0, 3)]), Some((1, 4)));
    }

    #[test]
    fn a_file_that_is_not_ones_own_never_wins_over_one_that_is() {
        assert_eq!(left(&[(10, i64::MAX), (0, 1)]), Some((0, 1)));
        assert_eq!(left(&[(0, 1), (10, i64::MAX)]), Some((0, 1)));
        assert_eq!(left(&[(10, 7), (11, 5)]), Some((10, 7)), "without one's own, the later");
    }
}
