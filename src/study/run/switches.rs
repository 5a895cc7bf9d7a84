//! The switches beside the paper's setting, one place: the rows of the study `switches` are made from this list.

use super::variant::Variant;
use crate::config::{FitConfig, Preset};

/// A named part of a configuration that another configuration may set otherwise.
pub struct Switch {
    /// The row's name.
    pub name: &'static str,
    /// Takes this part from the second configuration.
    pub take: fn(&mut FitConfig, &FitConfig),
}

/// Every part in which two presets may differ. A test holds that together they make one preset of the other.
pub const SWITCHES: &[Switch] = &[
    Switch { name: "bones turn", take: |to, from| to.parameterization = from.parameterization },
    Switch { name: "scales and opacities by body part", take: |to, from| to.scatterers = from.scatterers },
    Switch { name: "skin in front of the joints", take: |to, from| to.surface_offset_m = from.surface_offset_m },
    Switch { name: "powers add", take: |to, from| to.summation = from.summation },
    Switch { name: "place from counting", take: |to, from| to.place = from.place },
    Switch { name: "heading from motion", take: |to, from| to.yaw = from.yaw },
    Switch { name: "several starts", take: |to, from| to.starts = from.starts },
    Switch { name: "temporal term", take: |to, from| to.w_time = from.w_time },
    Switch { name: "height from the floor", take: |to, from| to.height = from.height },
    Switch { name: "limbs as learned", take: |to, from| to.limbs = from.limbs },
    Switch { name: "people", take: |to, from| to.people = from.people },
    Switch { name: "softness", take: |to, from| to.softness = from.softness },
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
    Switch { name: "initialiser", take: |to, from| to.init = same_spoiling(from, to) },
    Switch { name: "early stop", take: |to, from| to.stop_when_converged = from.stop_when_converged },
];

/// The other's initialiser with this one's perturbations and seed: those belong to the study and not to a preset.
fn same_spoiling(from: &FitConfig, to: &FitConfig) -> crate::config::InitConfig {
    crate::config::InitConfig {
        position_noise_m: to.init.position_noise_m,
        position_bias_m: to.init.position_bias_m,
        velocity_noise_mps: to.init.velocity_noise_mps,
        peak_dropout: to.init.peak_dropout,
        seed: to.init.seed,
        ..from.init
    }
}

/// Changes a configuration.
type Change = fn(&mut FitConfig);

/// What no preset has, but could help: a name and what it sets on top of `recommended`.
const EXTRAS: &[(&str, Change)] = &[("limbs that turn", |config| config.learning_rates.bone = Some(1e-3))];

/// `paper`, `paper` with each switch that `recommended` sets, `recommended`, `recommended` without each of them, and with
/// each of the extras that it lacks. `base` gives what belongs to the study: the seed.
pub(super) fn variants(base: &FitConfig) -> Vec<Variant> {
    let preset = |preset: Preset| {
        let mut config = preset.config();
        config.init.seed = base.init.seed;
        config
    };
    let (paper, best) = (preset(Preset::Paper), preset(Preset::Recommended));
    let row =
        |preset: Preset, change: String, config: FitConfig| Variant::cold([preset.name().to_owned(), change], &config);
    let with = |base: &FitConfig, other: &FitConfig, switch: &Switch| {
        let mut config = *base;
        (switch.take)(&mut config, other);
        (config != *base).then_some(config)
    };
    let mut rows = vec![row(Preset::Paper, "as it is".into(), paper)];
    for switch in SWITCHES {
        let added = with(&paper, &best, switch);
        rows.extend(added.map(|config| row(Preset::Paper, format!("with {}", switch.name), config)));
    }
    rows.push(row(Preset::Recommended, "as it is".into(), best));
    for switch in SWITCHES {
        let removed = with(&best, &paper, switch);
        rows.extend(removed.map(|config| row(Preset::Recommended, format!("without {}", switch.name), config)));
    }
    for (name, set) in EXTRAS {
        let mut config = best;
        set(&mut config);
        if config != best {
            rows.push(row(Preset::Recommended, format!("with {name}"), config));
        }
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_switches_together_make_one_preset_of_the_other() {
        let (paper, best) = (Preset::Paper.config(), Preset::Recommended.config());
        let mut config = paper;
        for switch in SWITCHES {
            (switch.take)(&mut config, &best);
        }
        assert_eq!(config, best, "every setting of a preset belongs to a switch");
    }

    #[test]
    fn each_difference_is_added_once_and_removed_once() {
        let rows = variants(&FitConfig::default());
        let count = |start: &str| rows.iter().filter(|row| row.name().starts_with(start)).count();
        assert_eq!(count("paper, as"), 1);
        assert_eq!(count("recommended, as"), 1);
        assert!(count("paper, with ") >= 5);
        assert_eq!(count("paper, with "), count("recommended, without "));
        let names: std::collections::BTreeSet<String> = rows.iter().map(Variant::name).collect();
        assert_eq!(names.len(), rows.len(), "no two rows have one name");
    }
}
