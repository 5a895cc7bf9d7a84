//! H_sim by the signals themselves: the exact version of SPEC section 3, against which the closed form is an approximation.
//!
//! A joint's Gaussian on the axes that FFTs make is, before those FFTs, an exponential over samples, chirps and antennas under a
//! Gaussian taper: the Fourier transform of a Gaussian of covariance C about b is e^{i2π m·b} exp(−½ (2πm)ᵀ C (2πm)), m in cycles a
//! bin. So the path is
//!
//! ```text
//! s(n) = Σ_j A_j e^{iφ_j} e^{i2π m·b_j} exp(−½ (2πm + κ_j)ᵀ C_j (2πm + κ_j)),   m_k = (n_k − (N_k − 1)/2)/L_k
//! H    = |FFT_L(w(n) s(n))|
//! ```
//!
//! with N samples, chirps and elements, their windows w, FFTs of L points (`rustfft`), C_j the joint's own covariance *without* the
//! point spread, which is now the window's own lobe, and κ_j the ramp of 𝓡_j where it belongs: under the blur. A joint without extent
//! gives the window's main lobe, and its peak has the closed form's value, whose weight A_j is that of its own narrowest Gaussian.
//! Cartesian maps and even steps of angle are read from a fine map of range and sines, linearly, as a processing chain does.
//!
//! **How near the closed form comes** (`tests/numerics/signal.rs`: point targets off the bins' centres, up to 50° off boresight, maps
//! of range with angle or speed). SPEC section 3 has one Gaussian, and one Gaussian cannot be a window's lobe down to its first minimum:
//! the closest one to a single axis' Hann lobe is 5 % off there, to a sinc 12 %, and at padding 1 the closed form's I/12 widens it.
//! Largest difference, % of the peak, to half power, down to −10 dB and over the whole main lobe, and the level down to which 3 % hold:
//!
//! | window | padding 2 to 4 | 3 % hold to | padding 1 | 3 % hold to | whole lobe with `lobe = "window"`, padding 1 to 4 |
//! |---|---|---|---|---|---|
//! | Hann | 2.8 · 3.4 · 5.6 | −3.4 dB | 0.5 · 4.0 · 7.2 | −9.8 dB | 0.4 to 0.6 |
//! | Hamming | 2.0 · 2.4 · 3.9 | −21 dB | 2.2 · 4.4 · 7.2 | −6.5 dB | 0.5 to 0.7 |
//! | Blackman | 1.7 · 2.0 · 2.5 | all of it | 0.4 · 3.1 · 3.8 | −9.7 dB | 0.8 to 0.9 |
//! | rectangular | 4.9 · 5.8 · 14.6 | nowhere near half power | 12 · 14 · 22 | the peak is 8 % off | 0.2 to 0.4 |
//!
//! With `lobe = "window"` each joint is a difference of Gaussians an axis ([`Lobe`](crate::radar::Lobe)), which follows the window's
//! own lobe from its peak to its first minimum: 3 % hold over all of it, for every window and padding, and so do gradients. It takes
//! four times the Gaussians of a map of two axes, eight of a cube's. An extent of 3 cm, half a range bin of that radar, leaves 1.4 %
//! (rectangular: 5.3 %, for sidelobes are blurred into the lobe).
//!
//! The place of the peak agrees to 0.1 bin for all of them, where the unpadded rectangular window's peak is told by its own lobe.
//!
//! What stays an approximation: axes are linear about a joint over its own extent, and range, speed and angle do not couple over the
//! length of a chirp or an array (the radar of [`crate::simulate`] has both).

use super::frame_em::{forward_config, skin_of};
use super::gaussian::{WorldGaussian, WorldGaussians};
use super::splat::{ViewModel, spectrum_of};
use super::{FitError, Precision, Problem};
use crate::body::{Group, Pppr};
use crate::config::{FitConfig, Summation};
use crate::geometry::dot;
use crate::mhp::batch::OneJoint;
use crate::mhp::floors::EPSILON;
use crate::radar::{Axis, AxisKind, NativeAxes, Resolved, View, ViewFft, interpolate, unravel};
use num_complex::Complex64;
use rustfft::{Fft, FftPlanner};
use std::f64::consts::TAU;
use std::sync::Arc;

/// Samples of all axes together that are accepted.
const MOST_SAMPLES: usize = 1 << 24;
/// Points of an FFT; beyond, bins are transformed one by one.
const MOST_LENGTH: usize = 1 << 20;
/// How far an FFT's length may be from a whole number, relative.
const WHOLE: f64 = 1e-6;

/// Whether a cell of the map is the FFT's value at its centre, or the mean over its width, which is what the closed form's I/12 is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum CellValue {
    /// The FFT's value, as a radar stores it.
    #[default]
    Centre,
    /// Blurred by the bin's width, variance 1/12, as the closed form is.
    Mean,
}

/// H of every view over its whole map by the signals, C order, f64, in the views' own layout. `ffts` has one configuration a view.
///
/// # Errors
/// Where a view has no FFT configuration, or one that does not resolve its axes.
pub fn simulate_signal(
    problem: &Problem,
    ffts: &[Option<ViewFft>],
    config: &FitConfig,
    params: &Pppr,
    cells: CellValue,
) -> Result<Vec<Vec<f64>>, FitError> {
    let problem = problem.under(config);
    let skin = skin_of(config, (&problem.views, &problem.skeleton, &problem.radar)).map(|mut skin| {
        skin.fill(params, Precision::F64);
        skin
    });
    let config = &forward_config(config, skin.is_some());
    let params = skin.as_ref().map_or(params, |skin| &skin.points);
    let mut gaussians = WorldGaussians::default();
    gaussians.fill(params, skin.is_some(), Precision::F64);
    let of_view = |(k, view): (usize, &View)| {
        let wrong = |reason: String| FitError::WrongView { array: view.array.clone(), reason };
        let unknown = "its FFT configuration is not known, only widths; expected [view.fft] in a manifest";
        let fft = ffts.get(k).and_then(Option::as_ref).ok_or_else(|| wrong(unknown.into()))?;
        let model = ViewModel::new(&problem.radar, view, config);
        let path = SignalPath::new(&model, fft, cells).map_err(wrong)?;
        Ok(path.map(params, &gaussians))
    };
    problem.views.iter().enumerate().map(of_view).collect()
}

/// A joint on the axes of the FFTs, bins.
struct Tone {
    bin: [f64; 3],
    covariance: [[f64; 3]; 3],
    ramp: [f64; 3],
    weight: Complex64,
}

/// The samples of one axis, and their way to its bins.
struct Line {
    weights: Vec<f64>,
    /// Cycles a bin of each sample, about the middle one.
    m: Vec<f64>,
    bins: usize,
    transform: Transform,
}

enum Transform {
    /// An FFT of at least as many points as samples.
    Fft(Arc<dyn Fft<f64>>),
    /// Bins that are on no FFT's grid: rows of the transform, one a bin.
    Rows(Vec<Complex64>),
}

impl Line {
    fn new(axis: &Axis, resolved: Resolved) -> Self {
        let Resolved { count, window, natural } = resolved;
        let length = count as f64 * natural / axis.step().abs();
        let weights = window.weights(count);
        let gain = weights.iter().sum::<f64>();
        let middle = (count as f64 - 1.0) / 2.0;
        let whole = length.round();
        let on_grid = (length - whole).abs() < WHOLE * length && (count..=MOST_LENGTH).contains(&(whole as usize));
        let transform = if on_grid {
            Transform::Fft(FftPlanner::new().plan_fft_forward(whole as usize))
        } else {
            let row = |bin: usize| (0..count).map(move |n| Complex64::cis(-TAU * (bin * n) as f64 / length));
            Transform::Rows((0..axis.bins).flat_map(row).collect())
        };
        Self {
            weights: weights.iter().map(|w| w / gain).collect(),
            m: (0..count).map(|n| (n as f64 - middle) / length).collect(),
            bins: axis.bins,
            transform,
        }
    }

    /// Along axis `axis` of `data`, whose sizes are `sizes`: samples become bins.
    fn run(&self, data: &[Complex64], sizes: &mut [usize; 3], axis: usize) -> Vec<Complex64> {
        let (count, bins) = (sizes[axis], self.bins);
        let inner: usize = sizes[axis + 1..].iter().product();
        let outer: usize = sizes[..axis].iter().product();
        let mut out = vec![Complex64::ZERO; outer * bins * inner];
        let length = if let Transform::Fft(plan) = &self.transform { plan.len() } else { count };
        let mut line = vec![Complex64::ZERO; length];
        let mut scratch = match &self.transform {
            Transform::Fft(plan) => vec![Complex64::ZERO; plan.get_inplace_scratch_len()],
            Transform::Rows(_) => Vec::new(),
        };
        for block in 0..outer {
            for column in 0..inner {
                let (from, to) = (block * count * inner + column, block * bins * inner + column);
                line.fill(Complex64::ZERO);
                for (n, cell) in line.iter_mut().enumerate().take(count) {
                    *cell = data[from + n * inner];
                }
                match &self.transform {
                    Transform::Fft(plan) => {
                        plan.process_with_scratch(&mut line, &mut scratch);
                        for bin in 0..bins {
                            out[to + bin * inner] = line[bin % length];
                        }
                    }
                    Transform::Rows(rows) => {
                        for (bin, row) in rows.chunks_exact(count).enumerate() {
                            out[to + bin * inner] = row.iter().zip(&line).map(|(a, b)| a * b).sum();
                        }
                    }
                }
            }
        }
        sizes[axis] = bins;
        out
    }
}

/// The signal-level path of one view.
struct SignalPath<'a> {
    model: &'a ViewModel<'a>,
    cells: CellValue,
    native: NativeAxes,
    lines: Vec<Line>,
}

impl<'a> SignalPath<'a> {
    fn new(model: &'a ViewModel<'a>, fft: &ViewFft, cells: CellValue) -> Result<Self, String> {
        let native = NativeAxes::of(model.view, fft)?;
        let line = |axis: &Axis| {
            let resolved = fft.resolved(axis.kind);
            resolved.map(|resolved| Line::new(axis, resolved)).ok_or_else(|| format!("no {} axis", axis.kind.name()))
        };
        let one = |axis: &Axis| axis.bins.max(fft.resolved(axis.kind).map_or(1, |resolved| resolved.count));
        let most = native.axes.iter().map(one).fold(1_usize, usize::saturating_mul);
        let rows = |axis: &Axis| axis.bins.saturating_mul(fft.resolved(axis.kind).map_or(1, |resolved| resolved.count));
        let most = native.axes.iter().map(rows).fold(most, usize::max);
        if most > MOST_SAMPLES {
            return Err(format!("its FFTs make {most} cells; expected at most {MOST_SAMPLES}"));
        }
        let lines = native.axes.iter().map(line).collect::<Result<Vec<_>, _>>()?;
        let samples = lines.iter().fold(1_usize, |product, line| product.saturating_mul(line.m.len()));
        if samples > MOST_SAMPLES {
            return Err(format!("its FFT configuration makes {samples} samples; expected at most {MOST_SAMPLES}"));
        }
        Ok(Self { model, cells, native, lines })
    }

    fn map(&self, params: &Pppr, gaussians: &WorldGaussians) -> Vec<f64> {
        let shape: Vec<usize> = self.native.axes.iter().map(|axis| axis.bins).collect();
        let cells = shape.iter().product();
        let coherent = self.model.config.summation == Summation::Coherent;
        let mut sum = vec![Complex64::ZERO; cells];
        for joint in 0..gaussians.joints() {
            let gaussian = gaussians.of(OneJoint(joint));
            let tone = match self.model.dims() {
                1 => self.tone::<1>(&gaussian),
                2 => self.tone::<2>(&gaussian),
                _ => self.tone::<3>(&gaussian),
            };
            let mut map = self.spectrum(&tone);
            self.shape_doppler(params.joint(Group::Omega, joint), &shape, &mut map);
            for (sum, x) in sum.iter_mut().zip(map) {
                *sum += if coherent { x } else { Complex64::new(x.norm_sqr(), 0.0) };
            }
        }
        let power = |x: &Complex64| if coherent { x.norm_sqr() } else { x.re };
        let amplitudes: Vec<f64> = sum.iter().map(|x| (power(x) + EPSILON * EPSILON).sqrt()).collect();
        if self.native.are_the_views() { amplitudes } else { self.resampled(&amplitudes, &shape) }
    }

    /// A joint on the FFTs' axes. About it, those are linear in the view's own.
    fn tone<const D: usize>(&self, gaussian: &WorldGaussian) -> Tone {
        let model = self.model;
        let in_view = model.joint_in_view(gaussian);
        let jacobians = model.jacobians::<f64, D>(&in_view.triad);
        let widths = model.widths(gaussian, &in_view, &jacobians);
        // Without extent: the weight is that of the narrowest Gaussian, whose lobe the window makes here.
        let point = WorldGaussian { spread: [[0.0; 3]; 3], ..*gaussian };
        let seen = model.projected(&point, &in_view, &jacobians);
        let cell = match self.cells {
            CellValue::Centre => 0.0,
            CellValue::Mean => 1.0 / 12.0,
        };
        let mut own = [[0.0; 3]; 3];
        for k in 0..D {
            for l in 0..D {
                own[k][l] = dot(widths[k].own, widths[l].own) + if k == l { cell } else { 0.0 };
            }
        }
        let weight = seen.ln_weight
            + if self.cells == CellValue::Mean { self.ln_cell_gain::<D>(&in_view, &jacobians) } else { 0.0 };
        let (mut bins, mut ramp) = ([0.0; 3], [0.0; 3]);
        bins[..D].copy_from_slice(&seen.bin);
        ramp[..D].copy_from_slice(&seen.kappa);
        let weight = Complex64::from_polar(weight.exp(), seen.phase);
        if self.native.are_the_views() {
            return Tone { bin: bins, covariance: own, ramp, weight };
        }
        let native = |bins: &[f64; 3]| {
            let coordinates = self.native.coordinates(model.view, &bins[..D]);
            let mut on = [0.0; 3];
            for (k, axis) in self.native.axes.iter().enumerate() {
                on[k] = axis.bin(coordinates[k]);
            }
            on
        };
        // ∂native/∂view by central differences of a hundredth of a bin: smooth maps of metres to metres.
        let step = 0.01;
        let mut slope = [[0.0; 3]; 3];
        for l in 0..D {
            let [mut less, mut more] = [bins; 2];
            (less[l], more[l]) = (bins[l] - step, bins[l] + step);
            let (less, more) = (native(&less), native(&more));
            for k in 0..D {
                slope[k][l] = (more[k] - less[k]) / (2.0 * step);
            }
        }
        let mut covariance = [[0.0; 3]; 3];
        for k in 0..D {
            for l in 0..D {
                for a in 0..D {
                    for b in 0..D {
                        covariance[k][l] += slope[k][a] * own[a][b] * slope[l][b];
                    }
                }
            }
        }
        Tone { bin: native(&bins), covariance, ramp: solve_transposed::<D>(&slope, ramp), weight }
    }

    /// ln of what blurring by a bin's width takes from the peak of the point spread, which the closed form's weight has taken already.
    fn ln_cell_gain<const D: usize>(
        &self,
        in_view: &super::splat::JointInView<f64>,
        jacobians: &[super::splat::AxisJacobian<f64>; D],
    ) -> f64 {
        let blur = |k: usize, l: usize| -> f64 {
            let along = |direction| dot(jacobians[k].gradient, direction) * dot(jacobians[l].gradient, direction);
            let triad = [in_view.triad.u, in_view.triad.e_az, in_view.triad.e_el];
            triad.into_iter().zip(in_view.blur).map(|(direction, width)| width * width * along(direction)).sum()
        };
        let matrix = |cell: f64| -> f64 {
            let mut c = [[0.0; 3]; 3];
            for k in 0..3 {
                for l in 0..3 {
                    c[k][l] = if k < D && l < D { blur(k, l) } else { 0.0 };
                }
                c[k][k] += if k < D { self.model.own_variance(k) + cell } else { 1.0 };
            }
            let minor = |a: usize, b: usize| c[1][a] * c[2][b] - c[1][b] * c[2][a];
            c[0][0] * minor(1, 2) - c[0][1] * minor(0, 2) + c[0][2] * minor(0, 1)
        };
        let (with, without) = (matrix(self.model.cell()), matrix(0.0));
        // A point spread without width on an axis: there is nothing to give back.
        if without > 0.0 { 0.5 * (with / without).ln() } else { 0.0 }
    }

    /// The FFTs of one joint's signal, bins of the FFTs' axes.
    fn spectrum(&self, tone: &Tone) -> Vec<Complex64> {
        let one = [(0.0, Complex64::ONE)];
        let along = |k: usize| -> Vec<(f64, Complex64)> {
            self.lines.get(k).map_or_else(
                || one.to_vec(),
                |line| {
                    let sample =
                        |(m, w): (&f64, &f64)| (TAU * m + tone.ramp[k], Complex64::cis(TAU * m * tone.bin[k]) * w);
                    line.m.iter().zip(&line.weights).map(sample).collect()
                },
            )
        };
        let [first, second, third] = [0, 1, 2].map(along);
        let c = &tone.covariance;
        let mut data = Vec::with_capacity(first.len() * second.len() * third.len());
        for &(x, a) in &first {
            for &(y, b) in &second {
                let (held, on_x, on_z) = (
                    a * b * tone.weight,
                    c[0][0] * x * x + 2.0 * c[0][1] * x * y + c[1][1] * y * y,
                    2.0 * (c[0][2] * x + c[1][2] * y),
                );
                data.extend(third.iter().map(|&(z, e)| held * e * (-0.5 * (on_x + z * (on_z + c[2][2] * z))).exp()));
            }
        }
        let mut sizes = [first.len(), second.len(), third.len()];
        for (axis, line) in self.lines.iter().enumerate() {
            data = line.run(&data, &mut sizes, axis);
        }
        data
    }

    /// The joint's spectrum along a Doppler axis: a factor a bin.
    fn shape_doppler(&self, omega: &[f64], shape: &[usize], map: &mut [Complex64]) {
        for (k, axis) in self.native.axes.iter().enumerate() {
            if axis.kind == AxisKind::Doppler {
                let factors: Vec<f64> = spectrum_of(omega, axis.bins).map(f64::exp).collect();
                let inner: usize = shape[k + 1..].iter().product();
                for (cell, x) in map.iter_mut().enumerate() {
                    *x *= factors[cell / inner % axis.bins];
                }
            }
        }
    }

    /// The view's own cells, read between those of the FFTs.
    fn resampled(&self, amplitudes: &[f64], shape: &[usize]) -> Vec<f64> {
        let (view, native) = (self.model.view, &self.native);
        let bins = view.shape();
        let cell = |index: usize| {
            let at: Vec<f64> = unravel(index, &bins).iter().map(|&bin| bin as f64).collect();
            let coordinates = native.coordinates(view, &at);
            let places: Vec<f64> = native
                .axes
                .iter()
                .zip(coordinates)
                .map(|(axis, coordinate)| {
                    let bin = axis.bin(coordinate);
                    // An FFT is periodic in the sine.
                    if axis.kind.is_angular() { bin.rem_euclid(axis.bins as f64) } else { bin }
                })
                .map(|bin| bin.max(0.0))
                .zip(shape)
                .map(|(bin, &size)| bin.min((size - 1) as f64))
                .collect();
            let value = interpolate(amplitudes, shape, &places);
            // The cell in the radar itself has no angle.
            if value.is_finite() { value } else { EPSILON }
        };
        (0..view.cells()).map(cell).collect()
    }
}

/// x with Mᵀ x = b; 0 where M has no inverse.
fn solve_transposed<const D: usize>(m: &[[f64; 3]; 3], b: [f64; 3]) -> [f64; 3] {
    let mut full = [[0.0; 3]; 3];
    for k in 0..3 {
        for l in 0..3 {
            full[k][l] = if k < D && l < D { m[l][k] } else { f64::from(u8::from(k == l)) };
        }
    }
    let det = |m: &[[f64; 3]; 3]| {
        m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0])
            + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0])
    };
    let whole = det(&full);
    if whole == 0.0 || !whole.is_finite() {
        return [0.0; 3];
    }
    std::array::from_fn(|column| {
        let mut replaced = full;
        for (row, b) in replaced.iter_mut().zip(b) {
            row[column] = b;
        }
        det(&replaced) / whole
    })
}
