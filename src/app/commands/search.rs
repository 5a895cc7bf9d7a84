//! Which commands fit what was typed, the best first.

use super::{UserCommand, all};
use nucleo_matcher::pattern::{AtomKind, CaseMatching, Normalization, Pattern};
use nucleo_matcher::{Config, Matcher};
use std::cmp::Reverse;

/// Commands whose label has the letters of every word in their order, the best first; then those whose label, menu and
/// tooltip together have every word. All of them, in the order of the table, where nothing was typed.
pub(crate) fn found(query: &str) -> Vec<UserCommand> {
    let pattern = |kind| Pattern::new(query, CaseMatching::Ignore, Normalization::Smart, kind);
    let (letters, words) = (pattern(AtomKind::Fuzzy), pattern(AtomKind::Substring));
    let mut matcher = Matcher::new(Config::DEFAULT);
    let mut score =
        |pattern: &Pattern, text: String| pattern.match_list([text], &mut matcher).first().map(|(_, score)| *score);
    let mut fitting: Vec<(Option<u32>, UserCommand)> = all()
        .filter_map(|command| {
            let by_label = score(&letters, command.label().into_owned());
            let text = || format!("{} {} {}", command.label(), command.menu().title(), command.tooltip());
            (by_label.is_some() || score(&words, text()).is_some()).then_some((by_label, command))
        })
        .collect();
    fitting.sort_by_key(|(score, _)| Reverse(*score));
    fitting.into_iter().map(|(_, command)| command).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(query: &str) -> Vec<String> {
        found(query).iter().map(|command| command.label().into_owned()).collect()
    }

    #[test]
    fn the_label_counts_more_than_what_is_told_of_a_command() {
        assert_eq!(labels("wipe")[0], "Wipe H_ori | H_sim");
        assert_eq!(labels("WIPE")[0], "Wipe H_ori | H_sim");
        assert_eq!(labels("nxt untg")[0], "Next untagged");
        let found = labels("clipboard");
        assert!(found.contains(&"Copy picture".to_owned()), "by its tooltip: {found:?}");
        assert_eq!(labels("no such command"), Vec::<String>::new());
    }

    #[test]
    fn everything_is_listed_in_its_order_until_something_is_typed() {
        let every: Vec<String> = all().map(|command| command.label().into_owned()).collect();
        assert_eq!(labels("  "), every);
    }
}
