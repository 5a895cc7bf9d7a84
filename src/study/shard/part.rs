//! Part i of n: as typed, as a Slurm array numbers its tasks, and what falls to it.

use crate::dataset::Dataset;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Parts of one whole at most.
const MOST: usize = 100_000;
/// What stands in place of i/n inside a Slurm array.
const AUTO: &str = "auto";
const ID: &str = "SLURM_ARRAY_TASK_ID";
const MIN: &str = "SLURM_ARRAY_TASK_MIN";
const COUNT: &str = "SLURM_ARRAY_TASK_COUNT";
/// Set by Slurm as well, and not needed by arrays without gaps.
const MAX: &str = "SLURM_ARRAY_TASK_MAX";
const STEP: &str = "SLURM_ARRAY_TASK_STEP";

/// Part `index` of `count`, counted from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Shard {
    /// Which part, from 1.
    pub index: usize,
    /// Parts in all.
    pub count: usize,
}

impl std::str::FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || {
            let example = "expected i/n with 1 ≤ i ≤ n, for example 2/4";
            match text.split_once('/').and_then(|(index, count)| Some((index.trim(), count.trim().parse().ok()?))) {
                Some(("0", count @ 1..=MOST)) => format!(
                    "`{text}` is no shard: shards are counted from 1, here 1/{count} to {count}/{count}; {example}, or inside a \
                     Slurm array, whatever it counts from, {AUTO}"
                ),
                _ => format!("`{text}` is no shard; {example}, or {AUTO} inside a Slurm array"),
            }
        };
        let (index, count) = text.split_once('/').ok_or_else(wrong)?;
        let number = |part: &str| part.trim().parse::<usize>().map_err(|_| wrong());
        let shard = Self { index: number(index)?, count: number(count)? };
        let sound = (1..=MOST).contains(&shard.count) && (1..=shard.count).contains(&shard.index);
        sound.then_some(shard).ok_or_else(wrong)
    }
}

impl std::fmt::Display for Shard {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

impl Shard {
    /// As typed: i/n, or `auto` for the task of a Slurm job array, which `variable` tells (the environment's variables by name).
    ///
    /// # Errors
    /// In words: what is wrong or not set, and what was expected.
    pub fn typed(text: &str, variable: impl Fn(&str) -> Option<String>) -> Result<Self, String> {
        if text == AUTO { Self::of_slurm(variable) } else { text.parse() }
    }

    /// The task of a Slurm job array that counts from any number, in steps of any size.
    fn of_slurm(variable: impl Fn(&str) -> Option<String>) -> Result<Self, String> {
        let missing: Vec<&str> = [ID, MIN, COUNT].into_iter().filter(|name| variable(name).is_none()).collect();
        if !missing.is_empty() {
            let (names, are) = (missing.join(", "), if missing.len() == 1 { "is" } else { "are" });
            return Err(format!(
                "`{AUTO}` reads {ID}, {MIN} and {COUNT}, which Slurm sets in a job array (sbatch --array=1-4); {names} {are} not \
                 set: outside of an array give i/n, counted from 1, for example 2/4"
            ));
        }
        let number = |name: &str| {
            let parsed = |text: String| {
                text.trim().parse::<usize>().map_err(|_| format!("{name} is `{text}`; expected a number"))
            };
            variable(name).map(parsed).transpose()
        };
        let known = |name: &str| number(name).map(Option::unwrap_or_default);
        let (id, min, count) = (known(ID)?, known(MIN)?, known(COUNT)?);
        let uneven = || {
            format!(
                "{ID} is {id}, {MIN} {min}, {COUNT} {count}: no task of an array with even steps; expected one such as \
                 sbatch --array=1-4, or give i/n, counted from 1"
            )
        };
        if count == 1 && min > 1 {
            return Err(format!(
                "the array has one task, {id}: `{AUTO}` would take it for the whole; a shard that is done again is given as \
                 i/n, counted from 1, as before"
            ));
        }
        let step = match number(MAX)? {
            Some(max) if count > 1 => {
                max.checked_sub(min).filter(|span| span % (count - 1) == 0).map(|span| span / (count - 1))
            }
            _ => Some(number(STEP)?.unwrap_or(1)),
        };
        let step = step.filter(|&step| step > 0).ok_or_else(uneven)?;
        let steps = id.checked_sub(min).filter(|span| span % step == 0).map(|span| span / step);
        let index = steps.filter(|&steps| steps < count && count <= MOST).ok_or_else(uneven)? + 1;
        Ok(Self { index, count })
    }

    /// Whether the unit of this number, from 0, falls to the shard where units are dealt out one by one.
    pub fn takes(self, number: usize) -> bool {
        number % self.count == self.index - 1
    }

    /// The shard's stretch of `frames`: those of all shards follow one another, none is longer than another by more than a frame,
    /// and some are empty where there are more shards than frames.
    pub fn stretch(self, frames: &Range<usize>) -> Range<usize> {
        let edge = |parts: usize| frames.start + (frames.len() as u128 * parts as u128 / self.count as u128) as usize;
        edge(self.index - 1)..edge(self.index)
    }

    /// As [`Self::stretch`], of whole sequences: each goes to the shard in whose stretch it begins.
    pub fn sequences(self, dataset: &Dataset, frames: &Range<usize>) -> Range<usize> {
        let begins = |frame: &usize| *frame == frames.start || dataset.sequence(*frame) != dataset.sequence(frame - 1);
        let edge = |frame: usize| (frame..frames.end).find(begins).unwrap_or(frames.end);
        let Range { start, end } = self.stretch(frames);
        edge(start)..edge(end)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_are_written_as_i_of_n() {
        assert_eq!("2/4".parse(), Ok(Shard { index: 2, count: 4 }));
        for text in ["0/4", "5/4", "1", "a/b", "1/0", "0/0", "-1/2", "1/99999999", "auto"] {
            assert!(text.parse::<Shard>().is_err_and(|why| why.contains("expected i/n")), "{text}");
        }
        let zero = "0/4".parse::<Shard>().err().unwrap_or_default();
        assert!(zero.contains("counted from 1, here 1/4 to 4/4"), "{zero}");
    }

    /// The shard that a task of an array takes; variables as `(id, min, max, count, step)`.
    fn of_array((id, min, max, count, step): (usize, usize, usize, usize, usize)) -> Result<Shard, String> {
        let told = [(ID, id), (MIN, min), (MAX, max), (COUNT, count), (STEP, step)];
        Shard::typed(AUTO, |name| told.iter().find(|(known, _)| *known == name).map(|(_, value)| value.to_string()))
    }

    #[test]
    fn an_array_counts_from_any_number_in_steps_of_any_size() {
        for (task, index) in [(0, 1), (3, 4)] {
            assert_eq!(of_array((task, 0, 3, 4, 1)), Ok(Shard { index, count: 4 }), "--array=0-3");
        }
        for (task, index) in [(1, 1), (4, 4)] {
            assert_eq!(of_array((task, 1, 4, 4, 1)), Ok(Shard { index, count: 4 }), "--array=1-4");
        }
        for (task, index) in [(10, 1), (15, 2), (20, 3)] {
            assert_eq!(of_array((task, 10, 20, 3, 5)), Ok(Shard { index, count: 3 }), "--array=10-20:5");
            assert_eq!(of_array((task, 10, 20, 3, 1)), Ok(Shard { index, count: 3 }), "--array=10,15,20");
        }
        assert_eq!(of_array((0, 0, 0, 1, 1)), Ok(Shard { index: 1, count: 1 }));
        let told = [(ID, "6"), (MIN, "2"), (COUNT, "3"), (STEP, "2")];
        let without_max =
            |name: &str| told.iter().find(|(known, _)| *known == name).map(|(_, value)| (*value).to_owned());
        assert_eq!(Shard::typed(AUTO, without_max), Ok(Shard { index: 3, count: 3 }));
    }

    #[test]
    fn what_is_no_even_array_is_refused_in_words() {
        let none = Shard::typed(AUTO, |_| None).err().unwrap_or_default();
        assert!(
            none.contains("SLURM_ARRAY_TASK_ID, SLURM_ARRAY_TASK_MIN, SLURM_ARRAY_TASK_COUNT are not set"),
            "{none}"
        );
        let one = Shard::typed(AUTO, |name| (name != COUNT).then(|| "1".to_owned())).err().unwrap_or_default();
        assert!(
            one.contains("SLURM_ARRAY_TASK_COUNT is not set: outside of an array give i/n, counted from 1"),
            "{one}"
        );
        let words = Shard::typed(AUTO, |_| Some("x".to_owned())).err().unwrap_or_default();
        assert!(words.contains("SLURM_ARRAY_TASK_ID is `x`; expected a number"), "{words}");
        // --array=1,2,5,10: the tasks that stand where no even step leads.
        assert!(of_array((2, 1, 10, 4, 1)).is_err_and(|why| why.contains("even steps")));
        for told in [(1, 1, 6, 4, 1), (0, 1, 4, 4, 1), (5, 1, 4, 4, 1), (1, 1, 1, 4, 1), (1, 1, 1, 0, 1)] {
            assert!(of_array(told).is_err_and(|why| why.contains("even steps")), "{told:?}");
        }
        assert!(of_array((3, 3, 3, 1, 1)).is_err_and(|why| why.contains("the array has one task, 3")));
    }

    #[test]
    fn stretches_and_dealt_units_cover_everything_once() {
        for (frames, count) in [(0..10, 3), (5..7, 4), (3..3, 2), (0..355_500, 7)] {
            let shards = (1..=count).map(|index| Shard { index, count });
            let mut next = frames.start;
            for stretch in shards.clone().map(|shard| shard.stretch(&frames)) {
                assert!(stretch.start == next && stretch.len().abs_diff(frames.len() / count) <= 1, "{stretch:?}");
                next = stretch.end;
            }
            assert_eq!(next, frames.end);
            assert!(frames.clone().take(100).all(|unit| shards.clone().filter(|shard| shard.takes(unit)).count() == 1));
        }
    }
}
