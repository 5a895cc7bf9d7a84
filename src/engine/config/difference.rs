//! Settings in words: what differs between two configurations, and the list of all.

use super::{FIELDS, FieldGroup, FieldKind, FitConfig, Preset};
use std::fmt::Write as _;

/// What differs between two configurations, in words: `τ_pct 10 → 15`; empty where nothing does.
pub fn difference(old: &FitConfig, new: &FitConfig) -> String {
    let changed = FIELDS.iter().filter_map(|field| field.change(field.get(old), field.get(new)));
    changed.collect::<Vec<_>>().join(", ")
}

/// The preset that a configuration is nearest to, and what it sets otherwise: `recommended, τ_pct 10 → 15`.
pub fn from_preset(config: &FitConfig) -> String {
    let nearest = Preset::nearest(config);
    match difference(&nearest.config(), config) {
        text if text.is_empty() => nearest.name().to_owned(),
        text => format!("{}, {text}", nearest.name()),
    }
}

/// Every setting: key, default, what is accepted, meaning; for `--help`.
pub fn listing() -> String {
    let mut text = "Settings, the keys of FIT.toml, with their defaults and what is accepted:\n".to_owned();
    for group in FieldGroup::ALL {
        let _ = writeln!(text, "\n  {}", group.title());
        for field in group.fields() {
            let _ = write!(text, "    {} = {}", field.key, field.text(field.default()));
            let FieldKind::Choice(answers) = field.kind else {
                let _ = writeln!(text, ": {}. {}", field.expected(), field.help);
                continue;
            };
            let _ = writeln!(text, ": {}", field.help);
            for answer in answers {
                let _ = writeln!(text, "      {:?}: {}", answer.word, answer.help);
            }
        }
    }
    text
}
