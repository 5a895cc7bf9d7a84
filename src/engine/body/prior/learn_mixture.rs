//! A Gaussian mixture of coefficients by expectation and maximisation, its components beside their mirror images.

use super::clusters::clusters;
use super::mixture::{MIXTURE_COEFFICIENTS, MixtureComponent};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Components, each with its mirror image.
const COMPONENTS: usize = 8;
/// Added to each variance: people differ more than forty of them tell.
const MARGIN: f64 = 0.2;
/// Rounds at most, and the gain in ln p of a window below which there are no more.
const ROUNDS: usize = 80;
const GAIN: f64 = 1e-3;
/// Of so many first coefficients are the clusters that it begins with: what ends likeliest counts.
const CLUSTERED: [usize; 5] = [4, 8, 12, 20, 28];

/// π, μ and Σ.
struct Component {
    weight: f64,
    mean: DVector<f64>,
    covariance: DMatrix<f64>,
}

impl Component {
    fn cholesky(&self) -> Option<Cholesky<f64, Dyn>> {
        Cholesky::new(self.covariance.clone())
    }
}

/// Of windows' coefficients, each window there mirrored, too, with the weights of windows; the signs are those of coefficients in
/// the mirror. Without components where there are too few windows.
pub(super) fn learn_mixture(coefficients: &[Vec<f64>], weights: &[f64], signs: &[f64]) -> Vec<MixtureComponent> {
    let dimensions = MIXTURE_COEFFICIENTS.min(signs.len());
    let signs = DVector::from_column_slice(&signs[..dimensions]);
    let points: Vec<DVector<f64>> = coefficients.iter().map(|c| DVector::from_column_slice(&c[..dimensions])).collect();
    let ends = CLUSTERED.into_iter().filter_map(|clustered| {
        let members = clusters(coefficients, weights, clustered, 2 * COMPONENTS);
        settled(first(&points, weights, &signs, &members), &points, weights, &signs)
    });
    let (_, components) = ends.max_by(|(a, _), (b, _)| a.total_cmp(b)).unwrap_or_default();
    let mut learned: Vec<MixtureComponent> = components.iter().filter_map(whitened).collect();
    learned.sort_by(|a, b| b.weight.total_cmp(&a.weight));
    learned
}

/// Where components end, and ln p of a window there.
fn settled(
    mut components: Vec<Component>,
    points: &[DVector<f64>],
    weights: &[f64],
    signs: &DVector<f64>,
) -> Option<(f64, Vec<Component>)> {
    let total: f64 = weights.iter().sum();
    let mut before = f64::NEG_INFINITY;
    for _ in 0..ROUNDS {
        let (likelihood, chances) = expected(&components, points, weights, signs)?;
        for (component, chances) in components.iter_mut().zip(&chances) {
            component.maximise(points, chances, total);
        }
        let now = likelihood / total;
        if now < before + GAIN {
            break;
        }
        before = now;
    }
    Some((before, components))
}

/// The largest of these clusters, of one that is another's mirror image the larger.
fn first(points: &[DVector<f64>], weights: &[f64], signs: &DVector<f64>, members: &[usize]) -> Vec<Component> {
    let mut all: Vec<(f64, DVector<f64>)> = vec![(0.0, DVector::zeros(signs.len())); 2 * COMPONENTS];
    for ((point, weight), &member) in points.iter().zip(weights).zip(members) {
        all[member].0 += weight;
        all[member].1.axpy(*weight, point, 1.0);
    }
    all.retain(|(weight, _)| *weight > 0.0);
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    let means: Vec<DVector<f64>> = all.iter().map(|(weight, sum)| sum / *weight).collect();
    let image = |of: usize| {
        let mirrored = means[of].component_mul(signs);
        let far = |other: &usize| (&means[*other] - &mirrored).norm_squared();
        (0..means.len()).min_by(|a, b| far(a).total_cmp(&far(b))).unwrap_or(of)
    };
    let own = (0..means.len()).filter(|&k| image(k) >= k || image(image(k)) != k).take(COMPONENTS);
    let half = DMatrix::identity(signs.len(), signs.len()) * 0.5;
    own.map(|k| Component { weight: 1.0 / COMPONENTS as f64, mean: means[k].clone(), covariance: half.clone() })
        .collect()
}

/// Σ weight · ln p, and of each component the weight that it has of each window as it is; mirror images are windows, too.
fn expected(
    components: &[Component],
    points: &[DVector<f64>],
    weights: &[f64],
    signs: &DVector<f64>,
) -> Option<(f64, Vec<Vec<f64>>)> {
    let roots: Vec<(Cholesky<f64, Dyn>, f64)> = components
        .iter()
        .map(|component| {
            let root = component.cholesky()?;
            let offset = component.weight.ln() - root.l_dirty().diagonal().map(f64::ln).sum();
            Some((root, offset))
        })
        .collect::<Option<_>>()?;
    let ln_density = |(component, (root, offset)): (&Component, &(Cholesky<f64, Dyn>, f64)), point: &DVector<f64>| {
        let mut off = point - &component.mean;
        root.l_dirty().solve_lower_triangular_mut(&mut off);
        offset - 0.5 * off.norm_squared()
    };
    let (mut likelihood, mut chances) = (0.0, vec![Vec::with_capacity(points.len()); components.len()]);
    for (point, weight) in points.iter().zip(weights) {
        let mirrored = point.component_mul(signs);
        let both: Vec<[f64; 2]> =
            components.iter().zip(&roots).map(|of| [point, &mirrored].map(|point| ln_density(of, point))).collect();
        let most = both.iter().flatten().copied().fold(f64::NEG_INFINITY, f64::max);
        let sum: f64 = both.iter().flatten().map(|ln| (ln - most).exp()).sum();
        likelihood += weight * (most + sum.ln());
        for (chances, [own, _]) in chances.iter_mut().zip(&both) {
            chances.push(weight * (own - most).exp() / sum);
        }
    }
    Some((likelihood, chances))
}

impl Component {
    /// What makes these windows likeliest, each with the weight that this component has of it.
    fn maximise(&mut self, points: &[DVector<f64>], chances: &[f64], total: f64) {
        let own: f64 = chances.iter().sum();
        if own <= 0.0 {
            return;
        }
        let dimensions = self.mean.len();
        let mut mean = DVector::zeros(dimensions);
        for (point, chance) in points.iter().zip(chances) {
            mean.axpy(chance / own, point, 1.0);
        }
        let mut covariance = DMatrix::identity(dimensions, dimensions) * MARGIN;
        for (point, chance) in points.iter().zip(chances) {
            if *chance > 1e-6 * total / points.len() as f64 {
                let off = point - &mean;
                covariance.ger(chance / own, &off, &off, 1.0);
            }
        }
        // Of mirror images the component's own has half.
        *self = Self { weight: 2.0 * own / total, mean, covariance };
    }
}

/// With W = L⁻¹, Σ = L Lᵀ.
fn whitened(component: &Component) -> Option<MixtureComponent> {
    let dimensions = component.mean.len();
    let inverse = component.cholesky()?.l().solve_lower_triangular(&DMatrix::identity(dimensions, dimensions))?;
    let rows = (0..dimensions).flat_map(|row| (0..=row).map(move |column| (row, column)));
    Some(MixtureComponent {
        weight: component.weight,
        mean: component.mean.iter().copied().collect(),
        whitening: rows.map(|at| inverse[at]).collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points about a line that stands askew, and about a heap, all mirrored, too: what they are about, and how far along which way
    /// they lie, is found once, and not again for the mirror image.
    #[test]
    fn heaps_are_found_with_their_spread_and_not_twice() {
        let wave = |k: usize, step: f64| 2.0 * (step * k as f64).fract() - 1.0;
        let own = |k: usize| {
            let (along, across) = (wave(k, 0.618_034), 0.02 * wave(k, 0.414_214));
            if k.is_multiple_of(4) { [-6.0 + across, across] } else { [4.0 + 3.0 * along, 5.0 + 3.0 * along + across] }
        };
        let points: Vec<Vec<f64>> = (0..2000).map(own).flat_map(|[x, y]| [vec![x, y], vec![x, -y]]).collect();
        let weights = vec![1.0 / points.len() as f64; points.len()];
        let learned = learn_mixture(&points, &weights, &[1.0, -1.0]);
        let weight = |of: fn(&MixtureComponent) -> bool| -> f64 {
            learned.iter().filter(|component| of(component)).map(|component| component.weight).sum()
        };
        assert!((weight(|_| true) - 1.0).abs() < 1e-9);
        assert!((weight(|component| component.mean[0] < -5.0) - 0.25).abs() < 1e-3, "{learned:?}");
        for component in learned.iter().filter(|component| component.mean[0] > 0.0) {
            let [x, y] = [component.mean[0], component.mean[1].abs()];
            assert!((y - x - 1.0).abs() < 0.02, "it lies on the line: {learned:?}");
            let [a, b, d] = [component.whitening[0], component.whitening[1], component.whitening[2]];
            assert!(a > 0.0 && d > 0.0 && b * component.mean[1] < 0.0, "x and y go together: {learned:?}");
        }
        assert_eq!(learn_mixture(&points, &weights, &[1.0, -1.0]), learned, "the same every time");
    }

    #[test]
    fn nothing_has_no_mixture() {
        assert!(learn_mixture(&[], &[], &[1.0]).is_empty());
    }
}
