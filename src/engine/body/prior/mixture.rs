//! How likely poses are: a Gaussian mixture of the first coefficients.
//!
//! ```text
//! p(c) = (1 − π₀) Σ_k π_k ½ (N(c; μ_k, Σ_k) + N(σ∘c; μ_k, Σ_k)) + π₀ N(c; 0, I),   Σ_k⁻¹ = W_kᵀ W_k,  π₀ = 0.05
//! ρ(c) = −2 ln (p(c)/p̂)
//! ```
//!
//! with σ the signs of the components in the mirror (a component and its mirror image are as likely), and p̂ the largest density in
//! the middle of one of them or of all: who stands, walks or sits does so in their own way, and one Gaussian about all of them
//! calls likely what lies in between. The part with π₀ is for what nobody was recorded doing.

#![expect(
    clippy::inline_always,
    reason = "all of it belongs into the function that is compiled for an instruction set"
)]

use serde::{Deserialize, Serialize};
use smallvec::SmallVec;

/// Coefficients that a mixture is of at most.
pub(super) const MIXTURE_COEFFICIENTS: usize = 28;
/// Members of a mixture of which nothing has to be allocated, mirror images and what nobody does among them.
const MEMBERS: usize = 24;
/// Rows of W whose products are summed side by side.
const ABREAST: usize = 4;
/// π₀
const UNSEEN: f64 = 0.05;
/// A member that is farther than the nearest by this has a chance of less than 1e-9: it is left out.
const NONE: f64 = 42.0;

/// A component of a Gaussian mixture of coefficients, and its mirror image.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MixtureComponent {
    /// π, of both together.
    pub weight: f64,
    /// μ, standard deviations.
    pub mean: Vec<f64>,
    /// W, which makes c − μ white: its rows from the first to the diagonal, one after the other.
    pub whitening: Vec<f64>,
}

impl MixtureComponent {
    /// −2 ln (π ½ N(c; μ, Σ)), but for the constant of the dimensions.
    fn offset(&self) -> f64 {
        let diagonal = (0..self.mean.len()).map(|row| self.whitening[row * (row + 1) / 2 + row]);
        -2.0 * ((0.5 * (1.0 - UNSEEN) * self.weight).ln() + diagonal.map(f64::ln).sum::<f64>())
    }

    /// W in blocks of [`ABREAST`] rows: of each column up to the last row's a number a row.
    fn blocks(&self) -> Vec<[f64; ABREAST]> {
        let number = |row: usize, column: usize| {
            let within = row < self.mean.len() && column <= row;
            if within { self.whitening[row * (row + 1) / 2 + column] } else { 0.0 }
        };
        let block = |first: usize| {
            let columns = 0..(first + ABREAST).min(self.mean.len());
            columns.map(move |column| std::array::from_fn(|k| number(first + k, column)))
        };
        (0..self.mean.len()).step_by(ABREAST).flat_map(block).collect()
    }

    /// W (σ∘c − μ), and its square; `None` where that is more than `most`. `blocks` are those of W.
    #[inline(always)]
    fn white(
        &self,
        blocks: &[[f64; ABREAST]],
        c: &[f64],
        most: f64,
        sign: impl Fn(usize) -> f64,
    ) -> Option<(Point, f64)> {
        let mut off = [0.0; MIXTURE_COEFFICIENTS];
        for (k, (off, (c, mean))) in off.iter_mut().zip(c.iter().zip(&self.mean)).enumerate() {
            *off = sign(k) * c - mean;
        }
        let off = &off[..self.mean.len()];
        let mut white = [0.0; MIXTURE_COEFFICIENTS];
        let (mut square, mut rest) = (0.0, blocks);
        for (block, white) in white.chunks_mut(ABREAST).enumerate() {
            let columns = ((block + 1) * ABREAST).min(off.len());
            let (own, after) = rest.split_at(columns.min(rest.len()));
            let mut sums = [0.0; ABREAST];
            for (numbers, off) in own.iter().zip(off) {
                for k in 0..ABREAST {
                    sums[k] += numbers[k] * off;
                }
            }
            square += sums.iter().map(|x| x * x).sum::<f64>();
            if square > most {
                return None;
            }
            white.copy_from_slice(&sums[..white.len()]);
            rest = after;
        }
        Some((white, square))
    }

    /// Wᵀ `white`.
    #[inline(always)]
    fn back(&self, white: &Point) -> Point {
        let mut bars = [0.0; MIXTURE_COEFFICIENTS];
        let mut rest = self.whitening.as_slice();
        for (row, white) in white.iter().enumerate().take(self.mean.len()) {
            let (own, after) = rest.split_at(row + 1);
            bars.iter_mut().zip(own).for_each(|(bar, a)| *bar += a * white);
            rest = after;
        }
        bars
    }
}

/// What does not fit in the components of a mixture of coefficients of which there are so many; `None` if all does.
pub(super) fn fault(components: &[MixtureComponent], coefficients: usize) -> Option<String> {
    let dimensions = components.first().map_or(0, |component| component.mean.len());
    let most = MIXTURE_COEFFICIENTS.min(coefficients);
    let whitening = dimensions * (dimensions + 1) / 2;
    components.iter().find_map(|component| {
        let [mean, found] = [component.mean.len(), component.whitening.len()];
        let diagonal = || (0..dimensions).map(|row| component.whitening[row * (row + 1) / 2 + row]);
        match () {
            () if mean == 0 || mean > most || mean != dimensions => {
                Some(format!("`mixture`: `mean` has {mean} numbers; expected as many in each component, 1 to {most}"))
            }
            () if found != whitening => Some(format!("`whitening` has {found} numbers; expected {whitening}")),
            () if !component.mean.iter().chain(&component.whitening).all(|number| number.is_finite()) => {
                Some("`mixture`: expected finite numbers".into())
            }
            () if !(component.weight > 0.0 && component.weight <= 1.0) => {
                Some(format!("`weight` is {}; expected one above 0, at most 1", component.weight))
            }
            () if !diagonal().all(|number| number > 0.0) => Some("`whitening`: expected a diagonal above 0".into()),
            () => None,
        }
    })
}

/// A number a coefficient; those beyond a mixture's are 0.
type Point = [f64; MIXTURE_COEFFICIENTS];

/// A component, the other way round or not, or what nobody does, at a point.
struct Member<'a> {
    /// −2 ln of its density there.
    far: f64,
    of: Option<(&'a MixtureComponent, bool)>,
    white: Point,
}

/// A Gaussian mixture of the first coefficients, ready to be asked.
#[derive(Debug, Clone, PartialEq)]
pub struct Mixture {
    /// With −2 ln of the density in its middle, of itself alone, and W in blocks.
    components: Vec<(MixtureComponent, f64, Vec<[f64; ABREAST]>)>,
    /// σ, one a coefficient.
    signs: Vec<f64>,
    /// −2 ln p̂
    least: f64,
}

impl Mixture {
    /// Of components whose lists fit together, before a mirror that gives coefficients these signs.
    pub(super) fn new(components: &[MixtureComponent], signs: &[f64]) -> Self {
        let coefficients = components.first().map_or(0, |component| component.mean.len());
        let with_offset = |component: &MixtureComponent| (component.clone(), component.offset(), component.blocks());
        let mut mixture = Self {
            components: components.iter().map(with_offset).collect(),
            signs: signs[..coefficients.min(signs.len())].to_vec(),
            least: 0.0,
        };
        let origin = [0.0; MIXTURE_COEFFICIENTS];
        let middles = components.iter().map(|component| component.mean.as_slice()).chain([origin.as_slice()]);
        mixture.least = middles.map(|c| mixture.unlikeliness(c, 0.0, &mut [])).fold(f64::INFINITY, f64::min);
        mixture
    }

    /// How many coefficients it is of: the first ones.
    pub fn coefficients(&self) -> usize {
        self.signs.len()
    }

    /// ln of how much likelier the first of these coefficients (standard deviations) are than if each were normal.
    #[cfg(feature = "train")]
    pub fn gain(&self, coefficients: &[f64]) -> f64 {
        let squares: f64 = coefficients[..self.coefficients()].iter().map(|c| c * c).sum();
        0.5 * (squares - self.unlikeliness(coefficients, 0.0, &mut []) - self.least)
    }

    /// ρ of the first of these coefficients (standard deviations); adds `gain` times its gradient to `bars`.
    pub fn unlikeliness(&self, coefficients: &[f64], gain: f64, bars: &mut [f64]) -> f64 {
        pulp::Arch::new().dispatch(Weigh { mixture: self, coefficients, gain, bars })
    }

    #[inline(always)]
    fn weighed(&self, coefficients: &[f64], gain: f64, bars: &mut [f64]) -> f64 {
        let c = &coefficients[..self.coefficients()];
        let mut white = [0.0; MIXTURE_COEFFICIENTS];
        white[..c.len()].copy_from_slice(c);
        let mut nearest = c.iter().map(|c| c * c).sum::<f64>() - 2.0 * UNSEEN.ln();
        let mut members: SmallVec<[Member; MEMBERS]> = SmallVec::new();
        members.push(Member { far: nearest, of: None, white });
        for (component, offset, blocks) in &self.components {
            for mirrored in [false, true] {
                let sign = |k: usize| if mirrored { self.signs[k] } else { 1.0 };
                if let Some((white, square)) = component.white(blocks, c, nearest + NONE - offset, sign) {
                    nearest = nearest.min(offset + square);
                    members.push(Member { far: offset + square, of: Some((component, mirrored)), white });
                }
            }
        }
        let chance = |member: &Member| (-0.5 * (member.far - nearest)).exp();
        let total: f64 = members.iter().map(chance).sum();
        for member in &members {
            if member.far > nearest + NONE {
                continue;
            }
            let share = chance(member) / total;
            let by_c = member.of.map_or(member.white, |(component, _)| component.back(&member.white));
            let mirrored = member.of.is_some_and(|(_, mirrored)| mirrored);
            for ((bar, by_c), sign) in bars.iter_mut().zip(by_c).zip(&self.signs) {
                *bar += 2.0 * gain * share * if mirrored { sign * by_c } else { by_c };
            }
        }
        nearest - 2.0 * total.ln() - self.least
    }
}

/// [`Mixture::unlikeliness`], compiled for the widest registers that the machine has.
struct Weigh<'a> {
    mixture: &'a Mixture,
    coefficients: &'a [f64],
    gain: f64,
    bars: &'a mut [f64],
}

impl pulp::WithSimd for Weigh<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> f64 {
        self.mixture.weighed(self.coefficients, self.gain, self.bars)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mixture() -> Mixture {
        let components = [
            MixtureComponent { weight: 0.7, mean: vec![0.5, -1.0], whitening: vec![2.0, 0.5, 1.5] },
            MixtureComponent { weight: 0.3, mean: vec![-1.0, 0.0], whitening: vec![1.0, -0.2, 4.0] },
        ];
        Mixture::new(&components, &[1.0, -1.0, 1.0])
    }

    /// The density itself, by the covariances.
    fn density([x, y]: [f64; 2]) -> f64 {
        let normal = |[x, y]: [f64; 2], mean: [f64; 2], [a, b, d]: [f64; 3]| {
            let off = [x - mean[0], y - mean[1]];
            let white = [a * off[0], b * off[0] + d * off[1]];
            a * d * (-0.5 * (white[0] * white[0] + white[1] * white[1])).exp()
        };
        let both = |mean, whitening| 0.5 * (normal([x, y], mean, whitening) + normal([x, -y], mean, whitening));
        let seen = 0.7 * both([0.5, -1.0], [2.0, 0.5, 1.5]) + 0.3 * both([-1.0, 0.0], [1.0, -0.2, 4.0]);
        0.95 * seen + 0.05 * (-0.5 * (x * x + y * y)).exp()
    }

    #[test]
    fn it_is_the_density_of_a_mixture_and_of_its_mirror_image() {
        let middles = [[0.5, -1.0], [-1.0, 0.0], [0.0, 0.0]];
        let (mixture, best) = (mixture(), middles.map(density).into_iter().fold(0.0, f64::max));
        for c in [[0.5, -1.0], [0.5, 1.0], [-1.0, 0.1], [3.0, 2.0], [-9.0, 14.0]] {
            let found = mixture.unlikeliness(&[c[0], c[1], 7.0], 0.0, &mut []);
            let expected = -2.0 * (density(c) / best).ln();
            assert!((found - expected).abs() < 1e-9 * (1.0 + expected.abs()), "{c:?}: {found}, {expected}");
            assert!((found - mixture.unlikeliness(&[c[0], -c[1], 7.0], 0.0, &mut [])).abs() < 1e-9);
        }
    }

    #[test]
    fn its_gradient_is_the_slope() {
        let mixture = mixture();
        for c in [[0.4, -0.7, 1.0], [-0.2, 0.3, 0.0], [2.0, -3.0, 0.5]] {
            let mut bars = [1.0; 3];
            mixture.unlikeliness(&c, 3.0, &mut bars);
            for k in 0..3 {
                let at = |step: f64| {
                    let mut moved = c;
                    moved[k] += step;
                    mixture.unlikeliness(&moved, 0.0, &mut [])
                };
                let slope = 3.0 * (at(1e-5) - at(-1e-5)) / 2e-5;
                assert!((bars[k] - 1.0 - slope).abs() < 1e-6 * (1.0 + slope.abs()), "{c:?} {k}: {} {slope}", bars[k]);
            }
        }
    }
}
