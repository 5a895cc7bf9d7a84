//! Whether a perturbation can act at all under a variant's settings, told from the settings and the views.
//!
//! Velocities reach the joints of a window as the motion that it begins with, and others on two ways: through the simulated map (a Doppler axis, or phases where amplitudes add) and
//! through L_rigid, where joints move by themselves or bones turn. Peaks reach them through the start that reads them.

use super::variant::StartFrom;
use crate::config::{FitConfig, Parameterization, Summation, WarmStart};
use crate::radar::{AxisKind, View};

/// Why what a variant perturbs, beside `base`, cannot move a joint; `None` where it can, or nothing is perturbed.
pub(super) fn silent(config: &FitConfig, base: &FitConfig, start: StartFrom, views: &[View]) -> Option<String> {
    let (perturbed, plain) = (&config.init, &base.init);
    let position =
        perturbed.position_noise_m > plain.position_noise_m || perturbed.position_bias_m > plain.position_bias_m;
    if position {
        return None;
    }
    let mut reasons = Vec::new();
    let velocity = perturbed.velocity_noise_mps > plain.velocity_noise_mps || perturbed.velocity != plain.velocity;
    if velocity {
        reasons.push(deaf_to_velocities(config, views)?);
    }
    if perturbed.peak_dropout > plain.peak_dropout {
        reasons.push(deaf_to_peaks(config, start)?);
    }
    (!reasons.is_empty()).then(|| format!("cannot move a joint: {}", reasons.join("; ")))
}

/// Why velocities do not move a joint.
fn deaf_to_velocities(config: &FitConfig, views: &[View]) -> Option<String> {
    if config.parameterization == Parameterization::Motion {
        // A window begins with the motion that the start's velocities tell.
        return None;
    }
    let axis = views.iter().flat_map(|view| &view.axes).any(|axis| axis.kind == AxisKind::Doppler);
    let map = match config.summation {
        _ if config.w_em <= 0.0 => "the maps have no weight",
        _ if !config.operators.doppler => "the operator `doppler` is off",
        Summation::Incoherent if !axis => "powers add, and no map has a Doppler axis",
        _ => return None,
    };
    let turning = config.learning_rates.bone.unwrap_or(config.learning_rate) > 0.0;
    let bones = match config.parameterization {
        _ if config.w_kine <= 0.0 => "L_rigid has no weight",
        Parameterization::Bones if !turning => "the body moves as one, which leaves L_rigid as it is",
        _ => return None,
    };
    let felt = if config.w_kine > 0.0 { "; the loss feels L_rigid, and with it the convergence test" } else { "" };
    Some(format!("velocities reach none, for {map}, and {bones}{felt}"))
}

/// Why missed peaks do not move a joint.
fn deaf_to_peaks(config: &FitConfig, start: StartFrom) -> Option<String> {
    if start == StartFrom::Warm && config.warm_start == WarmStart::AsLeft {
        return Some("a warm start that is as left reads no peaks".into());
    }
    (!config.init.position).then(|| "positions are not read from the peaks".into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{Operators, Preset};
    use crate::geometry::Pose;
    use crate::radar::{Axis, PointSpread, Quantity, Spacing};

    fn view(kinds: &[AxisKind]) -> View {
        let axis = |&kind| Axis { kind, bins: 8, lo: -1.0, hi: 1.0, spacing: Spacing::Linear };
        View {
            array: "hm".into(),
            quantity: Quantity::Amplitude,
            psf: PointSpread {
                range_m: 0.1,
                azimuth_rad: 0.1,
                elevation_rad: 0.1,
                doppler_mps: 0.1,
                ..PointSpread::default()
            },
            pose: Pose::default(),
            axes: kinds.iter().map(axis).collect(),
            region: None,
        }
    }

    fn perturbed(base: &FitConfig, perturb: impl Fn(&mut FitConfig)) -> FitConfig {
        let mut config = *base;
        perturb(&mut config);
        config
    }

    #[test]
    fn settings_and_axes_decide_and_not_the_presets_name() {
        let flat = [view(&[AxisKind::DepthH, AxisKind::Y])];
        let moving = [view(&[AxisKind::Range, AxisKind::Azimuth, AxisKind::Doppler])];
        let noise = |config: &mut FitConfig| config.init.velocity_noise_mps = 0.3;
        let told = |base: &FitConfig, views: &[View]| silent(&perturbed(base, noise), base, StartFrom::Cold, views);
        assert_eq!(told(&Preset::Recommended.config(), &flat), None, "a window begins with velocities");
        let mut best = FitConfig {
            parameterization: Parameterization::Bones,
            summation: Summation::Incoherent,
            ..FitConfig::default()
        };
        best.learning_rates.bone = Some(0.0);
        let why = told(&best, &flat).unwrap_or_default();
        assert!(why.contains("powers add, and no map has a Doppler axis") && why.contains("moves as one"), "{why}");
        assert_eq!(told(&best, &moving), None, "a Doppler axis shows velocities");
        assert_eq!(told(&FitConfig { summation: Summation::Coherent, ..best }, &flat), None, "phases do");
        assert_eq!(told(&Preset::Baseline.config(), &flat), None);
        assert_eq!(told(&Preset::Paper.config(), &flat), None);
        let mut turning = best;
        turning.learning_rates.bone = Some(1e-3);
        assert_eq!(told(&turning, &flat), None, "L_rigid turns bones");
        let off = FitConfig { operators: Operators { doppler: false, ..best.operators }, w_kine: 0.0, ..best };
        assert!(told(&off, &moving).is_some_and(|why| why.contains("`doppler` is off") && why.contains("L_rigid")));
    }

    #[test]
    fn peaks_act_where_a_start_reads_them() {
        let drop = |config: &mut FitConfig| config.init.peak_dropout = 0.4;
        let told = |base: FitConfig, start| silent(&perturbed(&base, drop), &base, start, &[]);
        for preset in Preset::ALL {
            assert_eq!(told(preset.config(), StartFrom::Cold), None);
        }
        assert_eq!(told(FitConfig::default(), StartFrom::Warm), None, "moved as the echo moved");
        assert!(told(Preset::Paper.config(), StartFrom::Warm).is_some_and(|why| why.contains("as left")));
        let mut blind = FitConfig::default();
        blind.init.position = false;
        assert!(told(blind, StartFrom::Cold).is_some_and(|why| why.contains("not read")));
        assert_eq!(silent(&blind, &blind, StartFrom::Cold, &[]), None, "nothing is perturbed");
    }
}
