//! Which of two records of a frame is the newer one.
//!
//! In one file the order of lines says so, whatever a clock said. Between files only the times can; each counts as no
//! earlier than those before it in its file, so that the answer is the same in whichever order the files are read.

/// Where and when a record was written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Stamp {
    /// Milliseconds since 1970.
    pub(super) time_ms: i64,
    /// The number of its folder; the one that is written is 0.
    pub(super) folder: usize,
    /// The number of its file.
    pub(super) file: usize,
}

impl Stamp {
    /// The stamp of the newer of the newest record so far and one that is read now; `None` where nothing changes.
    pub(super) fn newer_than(self, newest: Option<Self>) -> Option<Self> {
        let Some(newest) = newest else { return Some(self) };
        if newest.file == self.file {
            return Some(Self { time_ms: newest.time_ms.max(self.time_ms), ..self });
        }
        let rank = |stamp: Self| (stamp.time_ms, std::cmp::Reverse((stamp.folder, stamp.file)));
        (rank(self) > rank(newest)).then_some(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The record that is left after reading `(file, time)` in this order.
    fn left(records: &[(usize, i64)]) -> Option<(usize, i64)> {
        let mut newest: Option<(Stamp, (usize, i64))> = None;
        for &(file, time_ms) in records {
            let stamp = Stamp { time_ms, folder: file, file };
            if let Some(stamp) = stamp.newer_than(newest.map(|newest| newest.0)) {
                newest = Some((stamp, (file, time_ms)));
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
}
