//! The settings in which the presets differ, one place: the rows of the study `switches` are made from the table of settings.

use super::variant::{StartFrom, Variant};
use crate::config::{EmLoss, FIELDS, Field, FitConfig, Preset};

/// The order of the rows in the runs that exist; a row that is not named here follows in the order of the table of settings.
const ORDER: &[&str] = &[
    "objective",
    "body",
    "clutter",
    "static echo",
    "motion",
    "network",
    "decoding along the sequence",
    "bones turn",
    "scales and opacities by body part",
    "skin in front of the joints",
    "powers add",
    "place",
    "heading from motion",
    "several starts",
    "range offsets measured",
    "sidelobes removed",
    "temporal term",
    "height from the floor",
    "convergence",
    "bone tolerance",
    "frames around",
    "still echoes",
    "background",
    "gradient's velocity",
    "warm start",
    "EM region",
    "step sizes",
];

/// Settings that another configuration may set otherwise, all of them together.
struct Switch {
    /// The row's name.
    name: &'static str,
    fields: Vec<&'static Field>,
}

impl Switch {
    /// Takes these settings from another configuration.
    fn take(&self, to: &mut FitConfig, from: &FitConfig) {
        self.fields.iter().for_each(|field| field.take(to, from));
    }
}

/// Every row; perturbations and seed belong to a study and not to a preset, and to no row. A test holds that together they make
/// one preset of the other.
fn switches() -> Vec<Switch> {
    let mut rows: Vec<Switch> = Vec::new();
    for (name, field) in FIELDS.iter().filter_map(|field| Some((field.row?, field))) {
        match rows.iter_mut().find(|row| row.name == name) {
            Some(row) => row.fields.push(field),
            None => rows.push(Switch { name, fields: vec![field] }),
        }
    }
    rows.sort_by_key(|row| ORDER.iter().position(|name| *name == row.name).unwrap_or(ORDER.len()));
    rows
}

/// Changes a configuration.
type Change = fn(&mut FitConfig);

/// What no preset has, but could help: a name and what it sets on top of `recommended`.
const EXTRAS: &[(&str, Change)] = &[("the likelihood of speckle", |config| config.objective = EmLoss::Gamma)];

/// What a configuration becomes with one part of another; `None` where both have it alike.
fn with(base: &FitConfig, other: &FitConfig, switch: &Switch) -> Option<FitConfig> {
    let mut config = *base;
    switch.take(&mut config, other);
    (config != *base).then_some(config)
}

/// `baseline`, `baseline` with each switch that `recommended` sets, `recommended`, `recommended` without each of them and with
/// each of the extras that it lacks; then `baseline` with each switch to the letter of the paper, `baseline` from the frame before,
/// and `paper`. `base` gives what belongs to the study: the seed.
pub(super) fn variants(base: &FitConfig) -> Vec<Variant> {
    let of = |preset: Preset| {
        let mut config = preset.config();
        config.init.seed = base.init.seed;
        config
    };
    let [plain, paper, best] = [Preset::Baseline, Preset::Paper, Preset::Recommended].map(of);
    let switches = switches();
    let row =
        |preset: Preset, change: String, config: FitConfig| Variant::cold([preset.name().to_owned(), change], &config);
    let one_by_one = |preset: Preset, from: &FitConfig, to: &FitConfig, how: &str| -> Vec<Variant> {
        let changed = switches.iter().filter_map(|switch| Some((switch, with(from, to, switch)?)));
        changed.map(|(switch, config)| row(preset, format!("{how} {}", switch.name), config)).collect()
    };
    let mut rows = vec![row(Preset::Baseline, "as it is".into(), plain)];
    rows.extend(one_by_one(Preset::Baseline, &plain, &best, "with"));
    rows.push(row(Preset::Recommended, "as it is".into(), best));
    rows.extend(one_by_one(Preset::Recommended, &best, &plain, "without"));
    for (name, set) in EXTRAS {
        let mut config = best;
        set(&mut config);
        if config != best {
            rows.push(row(Preset::Recommended, format!("with {name}"), config));
        }
    }
    rows.extend(one_by_one(Preset::Baseline, &plain, &paper, "to the letter:"));
    // Only who starts from the frame before notices how, so that these two are compared with each other.
    rows.iter_mut().filter(|row| row.config.warm_start != plain.warm_start).for_each(|row| row.start = StartFrom::Warm);
    rows.push(row(Preset::Baseline, "from the frame before".into(), plain).warm());
    rows.push(row(Preset::Paper, "as it is".into(), paper));
    rows
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::FieldGroup;

    #[test]
    fn the_switches_together_make_any_preset_of_any_other() {
        for from in Preset::ALL {
            for to in Preset::ALL {
                let (mut config, to) = (from.config(), to.config());
                for switch in switches() {
                    switch.take(&mut config, &to);
                }
                assert_eq!(config, to, "every setting of a preset belongs to a switch");
            }
        }
    }

    #[test]
    fn each_difference_is_added_once_and_removed_once() {
        let rows = variants(&FitConfig::default());
        let count = |start: &str| rows.iter().filter(|row| row.name().starts_with(start)).count();
        assert_eq!((count("baseline, as"), count("recommended, as"), count("paper, as")), (1, 1, 1));
        assert!(count("baseline, with ") >= 5);
        assert_eq!(count("baseline, with "), count("recommended, without "));
        let names: std::collections::BTreeSet<String> = rows.iter().map(Variant::name).collect();
        assert_eq!(names.len(), rows.len(), "no two rows have one name");
    }

    /// A row for each place where the default leaves the paper's words; together they are the paper.
    #[test]
    fn each_deviation_has_a_row_of_its_own() {
        let rows = variants(&FitConfig::default());
        let letters: Vec<&Variant> = rows.iter().filter(|row| row.labels[1].starts_with("to the letter:")).collect();
        let names: Vec<&str> = letters.iter().filter_map(|row| row.labels[1].split(": ").nth(1)).collect();
        let expected = [
            "place",
            "convergence",
            "bone tolerance",
            "frames around",
            "still echoes",
            "background",
            "gradient's velocity",
            "warm start",
            "EM region",
        ];
        assert_eq!(names, expected);
        let letters = switches().into_iter().filter(|switch| names.contains(&switch.name));
        let mut config = FitConfig::default();
        letters.for_each(|switch| switch.take(&mut config, &Preset::Paper.config()));
        assert_eq!(config, Preset::Paper.config());
    }

    /// A setting that a later change brings is compared without a word here.
    #[test]
    fn every_setting_of_a_preset_is_in_one_row() {
        let rows = switches();
        assert!(ORDER.iter().all(|name| rows.iter().any(|row| row.name == *name)), "no row is named that is not there");
        for field in FIELDS {
            let of: Vec<&str> =
                rows.iter().filter(|row| row.fields.iter().any(|of| of.key == field.key)).map(|row| row.name).collect();
            assert_eq!(of.len(), usize::from(field.group != FieldGroup::Perturbation), "{}: {of:?}", field.key);
        }
    }

    #[cfg(feature = "dummies")]
    #[test]
    fn the_dummy_setting_is_in_the_row_of_the_weights() {
        let rows = switches();
        let (plain, other) = (FitConfig::default(), FitConfig { w_dummy: 2.0, ..FitConfig::default() });
        let changed: Vec<&str> =
            rows.iter().filter(|row| with(&plain, &other, row).is_some()).map(|row| row.name).collect();
        assert_eq!(changed, ["weights"]);
    }
}
