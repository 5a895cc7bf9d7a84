//! What each joint sends back to each cell: who lit it, with whom he interferes, and the map without him.
//!
//! H_sim is a sum over Gaussians (SPEC section 3). Where the body is its joints each Gaussian is one joint's; where it is skin, a
//! point of skin lies between joints and is theirs by its shares. So a joint's return to a cell is
//!
//! ```text
//! coherent    z_j = Σ_p share_pj A_p K_p e^{iψ_p},   Σ_j z_j = S,  share of the cell Re(z_j S*)/|S|²
//! incoherent  w_j = Σ_p share_pj (A_p K_p)²,         Σ_j w_j = S², share of the cell w_j/S²
//! ```
//!
//! Shares add up to one; a negative one dims the cell. The map without a joint is that of what is left of the sum, the map of it
//! alone that of its own part. Everything is f64: the sums are those of `simulate.rs` to rounding.

use super::floors::EPSILON;
use super::frame_em::{forward_config, skin_of};
use super::gaussian::WorldGaussians;
use super::splat::{Splat, Splats, ViewModel};
use super::{Precision, Problem};
use crate::body::Pppr;
use crate::config::{FitConfig, Summation};
use crate::radar::unravel;
use num_complex::Complex64;
use smallvec::{SmallVec, smallvec};

/// Returns with a smaller ln amplitude are lost under the floor of H_sim.
const LEAST_LN: f64 = -76.0;

/// What one joint sends back to one cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointReturn {
    /// Flat index of the joint.
    pub joint: usize,
    /// Amplitude, in the scale of H_sim.
    pub amplitude: f64,
    /// Phase, rad; 0 where powers are summed.
    pub phase_rad: f64,
    /// Its amplitude among the amplitudes of all joints there, 0..1.
    pub amplitude_share: f64,
    /// What it adds to the cell, of all; negative where it dims the cell. Those of all joints add up to 1.
    pub share: f64,
}

/// Whose returns a map is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum KeptJoints {
    /// Everybody's: H_sim itself.
    All,
    /// Those of this joint alone.
    Only(usize),
    /// All but those of this joint.
    Without(usize),
}

/// The returns of all joints to all cells of a frame's views.
#[derive(Debug)]
pub struct JointReturns {
    joints: usize,
    coherent: bool,
    /// The joints that each Gaussian belongs to.
    shares: Vec<SmallVec<[(usize, f64); 4]>>,
    views: Vec<(Vec<usize>, Splats)>,
}

impl JointReturns {
    /// Of the body that `params` describe, as the views of `problem` see it.
    pub fn new(problem: &Problem, config: &FitConfig, params: &Pppr) -> Self {
        let problem = problem.under(config);
        let joints = params.shape().total_joints();
        let skin = skin_of(config, (&problem.views, &problem.skeleton, &problem.radar)).map(|mut skin| {
            skin.fill(params, Precision::F64);
            skin
        });
        let shares = match &skin {
            None => (0..joints).map(|joint| smallvec![(joint, 1.0)]).collect(),
            Some(skin) => (0..params.shape().persons)
                .flat_map(|person| {
                    let first = person * params.shape().joints;
                    skin.owners().map(move |of| of.iter().map(|&(joint, share)| (first + joint, share)).collect())
                })
                .collect(),
        };
        let config = &forward_config(config, skin.is_some());
        let seen = skin.as_ref().map_or(params, |skin| &skin.points);
        let mut gaussians = WorldGaussians::default();
        gaussians.fill(seen, skin.is_some(), Precision::F64);
        let views = problem.views.iter().map(|view| {
            let mut splats = Splats::default();
            let (model, scratch) = (ViewModel::new(&problem.radar, view, config), &mut Splats::default());
            model.splats_of(&model.lobes(), (seen, &gaussians), Precision::F64, (&mut splats, scratch));
            (view.shape(), splats)
        });
        Self { joints, coherent: config.summation == Summation::Coherent, shares, views: views.collect() }
    }

    /// Joints of all persons.
    pub fn joints(&self) -> usize {
        self.joints
    }

    /// Whether joints interfere: their returns have phases.
    pub fn is_coherent(&self) -> bool {
        self.coherent
    }

    /// What every joint sends back to a cell (flat index) of a view, strongest first; empty where there is no such cell.
    pub fn at(&self, view: usize, cell: usize) -> Vec<JointReturn> {
        let Some((shape, splats)) = self.views.get(view) else { return Vec::new() };
        if cell >= shape.iter().product() {
            return Vec::new();
        }
        let at = three(&unravel(cell, shape));
        let mut of = vec![Complex64::ZERO; self.joints];
        for (splat, owners) in splats.iter().zip(self.shares.iter().cycle()) {
            let (ln, phase) = at_cell(&splat, at);
            for &(joint, share) in owners {
                of[joint] += share * self.sent(ln, phase);
            }
        }
        let sum: Complex64 = of.iter().sum();
        let power = sum.norm_sqr();
        let amplitude = |z: &Complex64| if self.coherent { z.norm() } else { z.re.max(0.0).sqrt() };
        let amplitudes: f64 = of.iter().map(amplitude).sum();
        let of_all = |x: f64, all: f64| if all > 0.0 { x / all } else { 0.0 };
        let one = |(joint, z): (usize, &Complex64)| JointReturn {
            joint,
            amplitude: amplitude(z),
            phase_rad: if self.coherent { z.arg() } else { 0.0 },
            amplitude_share: of_all(amplitude(z), amplitudes),
            share: if self.coherent { of_all((z * sum.conj()).re, power) } else { of_all(z.re, sum.re) },
        };
        let mut returns: Vec<JointReturn> = of.iter().enumerate().map(one).collect();
        returns.sort_by(|a, b| b.amplitude.total_cmp(&a.amplitude).then(a.joint.cmp(&b.joint)));
        returns
    }

    /// The map of some of the returns over a box of a view's cells, `[lo, hi)` along each axis; C order, H_sim's scale. Empty
    /// where there is no such view.
    pub fn map(&self, view: usize, bins: &[[usize; 2]], kept: KeptJoints) -> Vec<f64> {
        let Some((shape, splats)) = self.views.get(view).filter(|(shape, _)| shape.len() == bins.len()) else {
            return Vec::new();
        };
        let bins: Vec<[usize; 2]> = bins.iter().zip(shape).map(|(&[lo, hi], &n)| [lo.min(n), hi.min(n)]).collect();
        let mut around = [[0, 1]; 3];
        around[3 - bins.len()..].copy_from_slice(&bins);
        let size = around.map(|[lo, hi]| hi.saturating_sub(lo));
        let mut sum = vec![Complex64::ZERO; size.iter().product()];
        for (splat, owners) in splats.iter().zip(self.shares.iter().cycle()) {
            let share =
                |of: usize| owners.iter().filter(|(joint, _)| *joint == of).map(|(_, share)| share).sum::<f64>();
            let share = match kept {
                KeptJoints::All => 1.0,
                KeptJoints::Only(joint) => share(joint),
                KeptJoints::Without(joint) => 1.0 - share(joint),
            };
            if share > 1e-12 {
                self.add(&splat, share, (around, size), &mut sum);
            }
        }
        let amplitude = |z: &Complex64| {
            let power = if self.coherent { z.norm_sqr() } else { z.re };
            (power + EPSILON * EPSILON).sqrt()
        };
        sum.iter().map(amplitude).collect()
    }

    /// The same over a whole map.
    pub fn whole(&self, view: usize, kept: KeptJoints) -> Vec<f64> {
        let bins: Vec<[usize; 2]> = self.views.get(view).iter().flat_map(|(shape, _)| shape).map(|&n| [0, n]).collect();
        self.map(view, &bins, kept)
    }

    /// A return of this ln amplitude and phase as it is summed.
    fn sent(&self, ln: f64, phase: f64) -> Complex64 {
        if self.coherent { Complex64::from_polar(ln.exp(), phase) } else { Complex64::new((2.0 * ln).exp(), 0.0) }
    }

    fn add(&self, splat: &Splat<'_>, share: f64, (around, size): ([[usize; 2]; 3], [usize; 3]), sum: &mut [Complex64]) {
        let [[a0, a1], [b0, b1], [c0, _]] = around;
        for a in a0..a1 {
            for b in b0..b1 {
                let row = ((a - a0) * size[1] + (b - b0)) * size[2];
                let Some(cells) = sum.get_mut(row..row + size[2]) else { return };
                // The most that any cell of the row gets.
                if on_row(splat, [a, b]) < LEAST_LN {
                    continue;
                }
                for (k, cell) in cells.iter_mut().enumerate() {
                    let (ln, phase) = at_cell(splat, [a, b, c0 + k]);
                    if ln > LEAST_LN {
                        *cell += share * self.sent(ln, phase);
                    }
                }
            }
        }
    }
}

/// Indices along three axes; those that are missing come first.
fn three(index: &[usize]) -> [usize; 3] {
    let mut at = [0; 3];
    at[3 - index.len().min(3)..].copy_from_slice(&index[..index.len().min(3)]);
    at
}

fn spectrum(splat: &Splat<'_>, k: usize, at: usize) -> f64 {
    splat.spectrum[k].get(at).copied().unwrap_or(0.0)
}

/// ln of a Gaussian's amplitude in a cell, and its phase.
fn at_cell(splat: &Splat<'_>, at: [usize; 3]) -> (f64, f64) {
    let [d0, d1, d2]: [f64; 3] = std::array::from_fn(|k| at[k] as f64 - splat.bin[k]);
    let ([w0, w1, w2], [s10, s20, s21]) = (splat.weight, splat.skew);
    let (e1, e2) = (d1 + s10 * d0, d2 + s20 * d0 + s21 * d1);
    let spectra: f64 = (0..3).map(|k| spectrum(splat, k, at[k])).sum();
    let ln = splat.ln_weight + spectra - 0.5 * (w0 * d0 * d0 + w1 * e1 * e1 + w2 * e2 * e2);
    (ln, splat.phase + splat.kappa[0] * d0 + splat.kappa[1] * d1 + splat.kappa[2] * d2)
}

/// ln of the largest amplitude on a row of cells.
fn on_row(splat: &Splat<'_>, at: [usize; 2]) -> f64 {
    let [d0, d1]: [f64; 2] = std::array::from_fn(|k| at[k] as f64 - splat.bin[k]);
    let e1 = d1 + splat.skew[0] * d0;
    let spectra: f64 = (0..2).map(|k| spectrum(splat, k, at[k])).sum();
    let last = splat.spectrum[2].iter().copied().fold(0.0, f64::max);
    splat.ln_weight + spectra + last - 0.5 * (splat.weight[0] * d0 * d0 + splat.weight[1] * e1 * e1)
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests")]

    use super::*;
    use crate::body::{Group, PpprShape, Skeleton};
    use crate::config::{BodyModel, Preset};
    use crate::mhp::simulate;
    use crate::radar::{Axis, AxisKind, PointSpread, Quantity, RadarConfig, Spacing, View};

    fn scene(summation: Summation, body: BodyModel) -> (Problem, FitConfig, Pppr) {
        let axis = |kind, bins, lo, hi| Axis { kind, bins, lo, hi, spacing: Spacing::Linear };
        let view = |array: &str, axes| View {
            array: array.into(),
            quantity: Quantity::Amplitude,
            psf: PointSpread {
                range_m: 0.05,
                azimuth_rad: 0.06,
                elevation_rad: 0.06,
                doppler_mps: 0.2,
                ..PointSpread::default()
            },
            pose: crate::geometry::Pose::default(),
            axes,
            region: None,
        };
        let views = vec![
            view("h", vec![axis(AxisKind::DepthH, 60, 1.0, 4.0), axis(AxisKind::Y, 30, 1.5, -1.5)]),
            view(
                "c",
                vec![
                    axis(AxisKind::Range, 40, 1.0, 4.0),
                    axis(AxisKind::Azimuth, 20, -0.6, 0.6),
                    axis(AxisKind::Doppler, 8, -2.0, 2.0),
                ],
            ),
        ];
        let radar = RadarConfig { doppler_features: 6, ..RadarConfig::default() };
        let skeleton = Skeleton::preset("coco17").unwrap();
        let maps: Vec<Vec<f64>> = views.iter().map(|view| vec![1.0; view.cells()]).collect();
        let maps: Vec<&[f64]> = maps.iter().map(Vec::as_slice).collect();
        let mut params = Pppr::zeros(PpprShape { persons: 1, joints: 17, doppler_features: 6 });
        for joint in 0..17 {
            let t = joint as f64;
            let at = [2.4 + 0.02 * t, 0.3 - 0.04 * t, 0.8 - 0.09 * t];
            params.set_vec3(Group::Position, joint, at);
            params.set_vec3(Group::LogScale, joint, [-2.6, -2.4, -2.5]);
            params.set_vec3(Group::Velocity, joint, [0.4, 0.1 * t - 0.6, 0.0]);
            params.joint_mut(Group::Rotation, joint)[0] = 1.0;
            params.joint_mut(Group::Omega, joint).iter_mut().enumerate().for_each(|(k, x)| *x = 0.1 * k as f64);
        }
        let config = FitConfig { body, summation, ..Preset::Baseline.config() };
        (Problem::new(radar, skeleton, views, &maps).unwrap(), config, params)
    }

    /// Joints and points of skin, amplitudes and powers: all of it together is H_sim, and of each cell the shares add up to one.
    #[test]
    fn all_returns_together_are_the_simulated_map() {
        for summation in [Summation::Coherent, Summation::Incoherent] {
            for body in [BodyModel::Joints, BodyModel::Skin] {
                let (problem, config, params) = scene(summation, body);
                let returns = JointReturns::new(&problem, &config, &params);
                let whole = simulate(&problem, &config, Precision::F64, &params);
                for (view, expected) in whole.iter().enumerate() {
                    let most = expected.iter().copied().fold(0.0, f64::max);
                    let map = returns.whole(view, KeptJoints::All);
                    assert!(
                        map.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9 * most),
                        "{summation:?} {body:?}"
                    );
                    let cell = expected.iter().position(|x| *x == most).unwrap();
                    let at = returns.at(view, cell);
                    let sum: f64 = at.iter().map(|of| of.share).sum();
                    assert!((sum - 1.0).abs() < 1e-9 && at.len() == 17, "{sum}");
                    assert!(at.windows(2).all(|two| two[0].amplitude >= two[1].amplitude));
                }
            }
        }
    }

    /// The map of a joint alone has that joint's amplitude, and powers of with and without add up.
    #[test]
    fn a_map_without_a_joint_lacks_what_it_sent() {
        let (problem, config, params) = scene(Summation::Incoherent, BodyModel::Skin);
        let returns = JointReturns::new(&problem, &config, &params);
        let [all, only, without] =
            [KeptJoints::All, KeptJoints::Only(13), KeptJoints::Without(13)].map(|kept| returns.whole(0, kept));
        for ((all, only), without) in all.iter().zip(&only).zip(&without) {
            assert!((all * all - only * only - without * without).abs() <= 1e-9 * all * all + 1e-30);
        }
        let most = only.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)).unwrap();
        let at = returns.at(0, most.0).into_iter().find(|of| of.joint == 13).unwrap();
        assert!((at.amplitude - most.1).abs() < 1e-9 * most.1, "{at:?} {most:?}");
    }
}
