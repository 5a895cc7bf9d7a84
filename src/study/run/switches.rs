//! The switches in which the presets differ, one place: the rows of the study `switches` are made from this list.

use super::variant::{StartFrom, Variant};
use crate::config::{FitConfig, Preset};

/// A named part of a configuration that another configuration may set otherwise.
pub struct Switch {
    /// The row's name.
    pub name: &'static str,
    /// Takes this part from the second configuration.
    pub take: fn(&mut FitConfig, &FitConfig),
}

/// Every part in which two presets may differ; perturbations and seed belong to a study and not to a preset. A test holds that
/// together they make one preset of the other.
pub const SWITCHES: &[Switch] = &[
    Switch { name: "bones turn", take: |to, from| to.parameterization = from.parameterization },
    Switch { name: "scales and opacities by body part", take: |to, from| to.scatterers = from.scatterers },
    Switch { name: "skin in front of the joints", take: |to, from| to.surface_offset_m = from.surface_offset_m },
    Switch { name: "powers add", take: |to, from| to.summation = from.summation },
    Switch { name: "place", take: |to, from| to.place = from.place },
    Switch { name: "heading from motion", take: |to, from| to.yaw = from.yaw },
    Switch { name: "several starts", take: |to, from| to.starts = from.starts },
    Switch { name: "temporal term", take: |to, from| to.w_time = from.w_time },
    Switch { name: "height from the floor", take: |to, from| to.height = from.height },
    Switch { name: "limbs as learned", take: |to, from| to.limbs = from.limbs },
    Switch { name: "people", take: |to, from| to.people = from.people },
    Switch { name: "softness", take: |to, from| to.softness = from.softness },
    Switch { name: "convergence", take: |to, from| to.convergence = from.convergence },
    Switch { name: "bone tolerance", take: |to, from| to.bone_tolerance_m = from.bone_tolerance_m },
    Switch { name: "frames around", take: |to, from| to.frames_around = from.frames_around },
    Switch { name: "still echoes", take: |to, from| to.init.still = from.init.still },
    Switch { name: "background", take: |to, from| to.init.background = from.init.background },
    Switch { name: "gradient's velocity", take: |to, from| to.init.gradient = from.init.gradient },
    Switch { name: "warm start", take: |to, from| to.warm_start = from.warm_start },
    Switch { name: "threshold", take: |to, from| to.tau_pct = from.tau_pct },
    Switch { name: "EM region", take: |to, from| to.em_region = from.em_region },
    Switch { name: "weights", take: |to, from| (to.w_em, to.w_kine) = (from.w_em, from.w_kine) },
    Switch {
        name: "step sizes",
        take: |to, from| (to.learning_rate, to.learning_rates) = (from.learning_rate, from.learning_rates),
    },
    Switch { name: "iterations", take: |to, from| to.iterations = from.iterations },
    Switch {
        name: "limits",
        take: |to, from| {
            (to.theta_max_deg, to.d_sep_m, to.d_joint_m) = (from.theta_max_deg, from.d_sep_m, from.d_joint_m);
        },
    },
    Switch { name: "operators", take: |to, from| to.operators = from.operators },
    Switch {
        name: "initialiser",
        take: |to, from| {
            to.init.position = from.init.position;
            to.init.velocity = from.init.velocity;
            to.init.velocity_gain_mps = from.init.velocity_gain_mps;
        },
    },
    Switch { name: "early stop", take: |to, from| to.stop_when_converged = from.stop_when_converged },
];

/// Changes a configuration.
type Change = fn(&mut FitConfig);

/// What no preset has, but could help: a name and what it sets on top of `recommended`.
const EXTRAS: &[(&str, Change)] = &[("limbs that turn", |config| config.learning_rates.bone = Some(1e-3))];

/// What a configuration becomes with one part of another; `None` where both have it alike.
fn with(base: &FitConfig, other: &FitConfig, switch: &Switch) -> Option<FitConfig> {
    let mut config = *base;
    (switch.take)(&mut config, other);
    (config != *base).then_some(config)
}

/// `default`, `default` with each switch that `recommended` sets, `recommended`, `recommended` without each of them and with
/// each of the extras that it lacks; then `default` with each switch to the letter of the paper, `default` from the frame before,
/// and `paper`. `base` gives what belongs to the study: the seed.
pub(super) fn variants(base: &FitConfig) -> Vec<Variant> {
    let of = |preset: Preset| {
        let mut config = preset.config();
        config.init.seed = base.init.seed;
        config
    };
    let [plain, paper, best] = [Preset::Default, Preset::Paper, Preset::Recommended].map(of);
    let row =
        |preset: Preset, change: String, config: FitConfig| Variant::cold([preset.name().to_owned(), change], &config);
    let one_by_one = |preset: Preset, from: &FitConfig, to: &FitConfig, how: &str| -> Vec<Variant> {
        let changed = SWITCHES.iter().filter_map(|switch| Some((switch, with(from, to, switch)?)));
        changed.map(|(switch, config)| row(preset, format!("{how} {}", switch.name), config)).collect()
    };
    let mut rows = vec![row(Preset::Default, "as it is".into(), plain)];
    rows.extend(one_by_one(Preset::Default, &plain, &best, "with"));
    rows.push(row(Preset::Recommended, "as it is".into(), best));
    rows.extend(one_by_one(Preset::Recommended, &best, &plain, "without"));
    for (name, set) in EXTRAS {
        let mut config = best;
        set(&mut config);
        if config != best {
            rows.push(row(Preset::Recommended, format!("with {name}"), config));
        }
    }
    rows.extend(one_by_one(Preset::Default, &plain, &paper, "to the letter:"));
    // Only who starts from the frame before notices how, so that these two are compared with each other.
    rows.iter_mut().filter(|row| row.config.warm_start != plain.warm_start).for_each(|row| row.start = StartFrom::Warm);
    rows.push(row(Preset::Default, "from the frame before".into(), plain).warm());
    rows.push(row(Preset::Paper, "as it is".into(), paper));
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_switches_together_make_any_preset_of_any_other() {
        for from in Preset::ALL {
            for to in Preset::ALL {
                let (mut config, to) = (from.config(), to.config());
                for switch in SWITCHES {
                    (switch.take)(&mut config, &to);
                }
                assert_eq!(config, to, "every setting of a preset belongs to a switch");
            }
        }
    }

    #[test]
    fn each_difference_is_added_once_and_removed_once() {
        let rows = variants(&FitConfig::default());
        let count = |start: &str| rows.iter().filter(|row| row.name().starts_with(start)).count();
        assert_eq!((count("default, as"), count("recommended, as"), count("paper, as")), (1, 1, 1));
        assert!(count("default, with ") >= 5);
        assert_eq!(count("default, with "), count("recommended, without "));
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
        let switches = SWITCHES.iter().filter(|switch| names.contains(&switch.name));
        let mut config = FitConfig::default();
        switches.for_each(|switch| (switch.take)(&mut config, &Preset::Paper.config()));
        assert_eq!(config, Preset::Paper.config());
    }
}
