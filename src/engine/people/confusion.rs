//! How often a count is right.

use super::network::CLASSES;

/// How often there are one, two and three people in the paper's table of counting (91, 8 and 1 %).
pub const PREVALENCE: [(usize, f64); 3] = [(1, 0.91), (2, 0.08), (3, 0.01)];

/// Frames by true and predicted number of people; the last class is 4 and more.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Confusion {
    /// `frames[truth][predicted]`.
    pub frames: [[usize; CLASSES]; CLASSES],
}

impl Confusion {
    /// Takes a frame in.
    pub fn add(&mut self, truth: usize, predicted: usize) {
        self.frames[truth.min(CLASSES - 1)][predicted.min(CLASSES - 1)] += 1;
    }

    /// Frames with a true number of people.
    pub fn of(&self, truth: usize) -> usize {
        self.frames[truth.min(CLASSES - 1)].iter().sum()
    }

    /// Share of the frames with a true number of people that were counted right; `None` without such frames.
    pub fn accuracy(&self, truth: usize) -> Option<f64> {
        let class = truth.min(CLASSES - 1);
        (self.of(class) > 0).then(|| self.frames[class][class] as f64 / self.of(class) as f64)
    }

    /// The accuracies of one, two and three people, weighted by [`PREVALENCE`]; `None` where one of them has no frame.
    pub fn weighted(&self) -> Option<f64> {
        PREVALENCE.iter().map(|&(people, share)| self.accuracy(people).map(|accuracy| share * accuracy)).sum()
    }

    /// Share of all frames whose count is off by no more than one person; 4 and more are one number.
    pub fn within_one(&self) -> Option<f64> {
        let all: usize = (0..CLASSES).map(|class| self.of(class)).sum();
        let near = |(truth, row): (usize, &[usize; CLASSES])| -> usize {
            row.iter().enumerate().filter(|(predicted, _)| truth.abs_diff(*predicted) <= 1).map(|(_, n)| n).sum()
        };
        (all > 0).then(|| self.frames.iter().enumerate().map(near).sum::<usize>() as f64 / all as f64)
    }

    /// Share of all frames counted right.
    pub fn overall(&self) -> Option<f64> {
        let all: usize = (0..CLASSES).map(|class| self.of(class)).sum();
        let right: usize = (0..CLASSES).map(|class| self.frames[class][class]).sum();
        (all > 0).then(|| right as f64 / all as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn accuracies_are_weighted_by_how_often_each_count_occurs() {
        let mut confusion = Confusion::default();
        assert_eq!((confusion.weighted(), confusion.overall()), (None, None));
        for (truth, predicted) in [(1, 1), (1, 1), (2, 2), (2, 1), (3, 3), (7, 9)] {
            confusion.add(truth, predicted);
        }
        assert_eq!(confusion.accuracy(2), Some(0.5));
        assert_eq!(confusion.accuracy(4), Some(1.0), "4 and more are one class");
        assert!(confusion.weighted().is_some_and(|w| (w - (0.91 + 0.04 + 0.01)).abs() < 1e-12));
        assert_eq!(confusion.overall(), Some(5.0 / 6.0));
        assert_eq!(confusion.within_one(), Some(1.0));
        confusion.add(0, 3);
        assert_eq!(confusion.within_one(), Some(6.0 / 7.0));
    }
}
