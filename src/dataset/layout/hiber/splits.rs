//! HIBER's training, validation and test groups, and the finer kinds of its categories (`assets/hiber_splits.toml`).

use super::tree::environment_of;
use crate::dataset::layout::index::Segment;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::sync::OnceLock;

/// The environment that is all of the test set, as the category of that name is.
const TEST_ENVIRONMENT: u32 = 1;
const TEST_CATEGORY: &str = "DARK";

/// Environment to the first and last group of each run of them.
type Runs = BTreeMap<String, Vec<[u32; 2]>>;

#[derive(Debug, Deserialize)]
struct Category {
    groups: Runs,
    val: Vec<String>,
    test: Vec<String>,
}

#[derive(Debug, Deserialize)]
struct Splits {
    kinds: BTreeMap<String, Runs>,
    #[serde(flatten)]
    categories: BTreeMap<String, Category>,
}

/// `None` never, for the file that the program was built with; a test holds it.
fn splits() -> Option<&'static Splits> {
    static SPLITS: OnceLock<Option<Splits>> = OnceLock::new();
    SPLITS.get_or_init(|| toml::from_str(include_str!("../../../../assets/hiber_splits.toml")).ok()).as_ref()
}

/// Environment and group of `01_05`.
fn numbers(group: &str) -> Option<(u32, u32)> {
    environment_of(group)?;
    let (environment, group) = group.split_once('_')?;
    Some((environment.parse().ok()?, group.parse().ok()?))
}

fn holds(runs: &Runs, (environment, group): (u32, u32)) -> bool {
    let runs = runs.get(&environment.to_string()).map(Vec::as_slice).unwrap_or_default();
    runs.iter().any(|[first, last]| (*first..=*last).contains(&group))
}

/// The split of a group of a category, where it is one of the published groups.
pub(super) fn split_of(category: &str, group: &str) -> Option<&'static str> {
    let (of, numbers_of) = (splits()?.categories.get(category)?, numbers(group)?);
    let listed = |list: &[String]| list.iter().any(|known| numbers(known) == Some(numbers_of));
    if listed(&of.val) {
        Some("validation")
    } else if listed(&of.test) || numbers_of.0 == TEST_ENVIRONMENT || category == TEST_CATEGORY {
        holds(&of.groups, numbers_of).then_some("test")
    } else {
        holds(&of.groups, numbers_of).then_some("training")
    }
}

/// What a frame of `WALK/01_05` is: its split, and what is known of the group.
pub(super) fn words(sequence: &str) -> Option<String> {
    let (category, group) = sequence.rsplit_once('/')?;
    let split = split_of(category, group)?;
    let numbers = numbers(group)?;
    let kinds = splits()?.kinds.iter().filter(|(_, runs)| holds(runs, numbers)).map(|(kind, _)| kind.as_str());
    // The numbers of groups are unique in an environment: a kind of another category has none of them.
    let all: Vec<&str> = std::iter::once(category).chain(kinds).collect();
    Some(format!("{} ({split})", all.join(", ")))
}

/// How many of these groups are in which split, in words.
pub(super) fn told(segments: &[Segment]) -> String {
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for segment in segments {
        let split = segment.sequence.rsplit_once('/').and_then(|(category, group)| split_of(category, group));
        *counts.entry(split.unwrap_or("none")).or_default() += 1;
    }
    let count = |split: &str| counts.get(split).copied().unwrap_or(0);
    format!(
        "splits: of {} groups {} are of HIBER's training, {} of validation, {} of test, {} of none",
        segments.len(),
        count("training"),
        count("validation"),
        count("test"),
        count("none")
    )
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests")]

    use super::*;

    /// The numbers of groups that HIBER's loader counts.
    #[test]
    fn the_published_groups_are_in_their_splits() {
        let splits = splits().unwrap();
        let mut counts: BTreeMap<&str, [usize; 3]> = BTreeMap::new();
        for (category, of) in &splits.categories {
            for (environment, runs) in &of.groups {
                for group in runs.iter().flat_map(|[first, last]| *first..=*last) {
                    let name = format!("{environment:0>2}_{group:02}");
                    let split = split_of(category, &name).unwrap();
                    let at = ["training", "validation", "test"].iter().position(|known| *known == split).unwrap();
                    counts.entry(category).or_default()[at] += 1;
                }
            }
            assert!(of.val.iter().chain(&of.test).all(|group| split_of(category, group).is_some()), "{category}");
        }
        // 152, 120, 133, 239 and 31 groups in all.
        assert_eq!(counts["WALK"], [152 - 11 - 41, 11, 41]);
        assert_eq!(counts["MULTI"], [120 - 10 - 18, 10, 18]);
        assert_eq!(counts["ACTION"], [counts["ACTION"].iter().sum::<usize>() - 11 - 31, 11, 31]);
        assert_eq!(counts["OCCLUSION"], [counts["OCCLUSION"].iter().sum::<usize>() - 22 - 28, 22, 28]);
        assert_eq!(counts["DARK"], [0, 0, 31]);
    }

    #[test]
    fn a_group_is_told_with_its_kind() {
        assert_eq!(words("WALK/02_05").as_deref(), Some("WALK (training)"));
        assert_eq!(words("tree/WALK/01_05"), None);
        assert_eq!(
            words("OCCLUSION/01_73").as_deref(),
            Some("OCCLUSION, behind styrofoam, several people behind it (test)")
        );
        assert_eq!(
            (words("WALK/1_99"), words("OTHER/01_05"), split_of("WALK", "07_01")),
            (None, None, Some("validation"))
        );
    }
}
