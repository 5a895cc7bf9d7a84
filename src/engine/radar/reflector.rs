//! Point-spread widths measured on data: cuts through the echo of a point reflector, and the Gaussian that is closest to each.
//!
//! A cut runs along one axis of the FFTs (range, sine of an angle, speed) through a local maximum of a map, down to the first minimum
//! on both sides: that is the window's main lobe where the reflector is a point. The width is that of SPEC section 3, the standard
//! deviation of the unit-peak Gaussian closest to it; peak and place between the bins come from a parabola through the logarithms of
//! the three highest. Echoes that are wider than a point's make it too large, never too small, so that of several peaks the narrow
//! ones count.

use super::psf::{closest_sigma, first_null_bins};
use super::window::response;
use super::{
    AxisKind, FftSetup, NativeAxes, PointSpread, Quantity, RadarConfig, View, ViewFft, Window, interpolate, unravel,
};
use std::sync::Arc;

/// Points that a cut has on each side, at most.
const MOST_BINS: usize = 1024;
/// Where a cut must have come down to on both sides for its lobe to be one, of its peak.
const ISOLATED: f64 = 0.4;
/// A rise by less than this share of the peak is no other lobe's.
const RIPPLE: f64 = 0.02;
/// Below this share of the peak a lobe has ended.
const FAINT: f64 = 0.02;
/// Peaks of a map that are measured, at most; down to this share of the strongest.
const MOST_PEAKS: usize = 16;
const LEAST_PEAK: f64 = 0.1;
/// How far from a place that was named the strongest cell is looked for: m, and sine.
const NEAR_M: f64 = 0.4;
const NEAR_SINE: f64 = 0.15;

/// A cut through a peak along one axis of the FFTs.
#[derive(Debug, Clone, PartialEq)]
pub struct LobeCut {
    /// Range, cone, azimuth or elevation (as its sine), or Doppler.
    pub kind: AxisKind,
    /// Places about the peak, m, sine or m/s.
    pub offset: Vec<f64>,
    /// Amplitude there, of the peak's.
    pub measured: Vec<f64>,
    /// Width of the closest Gaussian, same unit; `None` where the echo has no lobe of its own here.
    pub sigma: Option<f64>,
    /// Width that the view states or derives.
    pub model_sigma: f64,
    /// What a bin of an FFT without padding is, and the weights of its window, where the configuration is known.
    pub fft: Option<(f64, Arc<[f64]>)>,
}

impl LobeCut {
    /// The closest Gaussian at an offset; `None` without a width.
    pub fn fitted(&self, offset: f64) -> Option<f64> {
        self.sigma.map(|sigma| gaussian(offset, sigma))
    }

    /// The Gaussian of the view's width at an offset.
    pub fn model(&self, offset: f64) -> f64 {
        gaussian(offset, self.model_sigma)
    }

    /// The main lobe of the window at an offset, where it is known.
    pub fn lobe(&self, offset: f64) -> Option<f64> {
        self.fft.as_ref().map(|(natural, weights)| response(weights, offset / natural))
    }
}

fn gaussian(x: f64, sigma: f64) -> f64 {
    if sigma > 0.0 { (-0.5 * (x / sigma).powi(2)).exp() } else { f64::from(u8::from(x == 0.0)) }
}

/// A local maximum of a map, cut along every axis of its FFTs.
#[derive(Debug, Clone, PartialEq)]
pub struct Reflector {
    /// Where it is: m, sines and m/s along the axes of the FFTs.
    pub coordinates: Vec<(AxisKind, f64)>,
    /// The bins of its strongest cell.
    pub bins: Vec<f64>,
    /// Amplitude of its strongest cell.
    pub level: f64,
    /// One cut an axis.
    pub cuts: Vec<LobeCut>,
}

/// Where a reflector is looked for: range m, sine of the angle, speed m/s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReflectorPlace {
    /// Range, m.
    pub range_m: f64,
    /// Sine of the angle; what a map has no axis for does not count.
    pub sine: f64,
    /// Radial speed, m/s.
    pub speed_mps: Option<f64>,
}

/// A map whose point spread is to be measured.
#[derive(Debug, Clone)]
pub struct ReflectorMap<'a> {
    view: &'a View,
    map: Vec<f64>,
    shape: Vec<usize>,
    native: NativeAxes,
    fft: Option<&'a ViewFft>,
}

impl<'a> ReflectorMap<'a> {
    /// Of a view's map, C order; `fft` is its configuration where it is known.
    ///
    /// # Errors
    /// Where its axes are none that FFTs make, in words.
    pub fn new(view: &'a View, map: &[f64], fft: Option<&'a ViewFft>) -> Result<Self, String> {
        // Only where cells lead to is asked, not how wide lobes are.
        let any = |n| (n, Window::Hann);
        let setup = FftSetup { range: any(256), doppler: any(64), azimuth: Some(any(64)), elevation: Some(any(64)) };
        let native = NativeAxes::of(view, &ViewFft { setup, radar: RadarConfig::default() })?;
        let amplitude = |&x: &f64| if view.quantity == Quantity::Power { x.max(0.0).sqrt() } else { x };
        Ok(Self { view, map: map.iter().map(amplitude).collect(), shape: view.shape(), native, fft })
    }

    /// The strongest echo near a place, or of the whole map; `None` where no cell is finite.
    pub fn strongest(&self, near: Option<ReflectorPlace>) -> Option<Reflector> {
        let inside = |cell: &usize| {
            near.is_none_or(|place| {
                let at = self.coordinates_of(*cell);
                self.native.axes.iter().zip(at).all(|(axis, x)| match axis.kind {
                    AxisKind::Range => (x - place.range_m).abs() <= NEAR_M,
                    AxisKind::Doppler => place.speed_mps.is_none_or(|v| (x - v).abs() <= 3.0 * axis.step().abs()),
                    _ => (x - place.sine).abs() <= NEAR_SINE,
                })
            })
        };
        let cells = (0..self.map.len()).filter(|&cell| self.map[cell].is_finite());
        let best = cells.filter(inside).max_by(|&a, &b| self.map[a].total_cmp(&self.map[b]))?;
        Some(self.cut(best))
    }

    /// The peak that the map climbs to from a place in bins; `None` where that is outside or no number.
    pub fn nearest_peak(&self, bins: &[f64]) -> Option<Reflector> {
        let mut cell = 0;
        for (&size, &bin) in self.shape.iter().zip(bins) {
            cell = cell * size + bin.round().clamp(0.0, (size - 1) as f64) as usize;
        }
        if bins.len() != self.shape.len() || !self.map.get(cell)?.is_finite() {
            return None;
        }
        // Each step is higher than the one before: it ends.
        loop {
            let here = unravel(cell, &self.shape);
            let (mut best, mut stride) = (cell, self.map.len());
            for (k, &size) in self.shape.iter().enumerate() {
                stride /= size;
                let below = (here[k] > 0).then(|| cell - stride);
                let above = (here[k] + 1 < size).then(|| cell + stride);
                best = below
                    .into_iter()
                    .chain(above)
                    .fold(best, |best, at| if self.map[at] > self.map[best] { at } else { best });
            }
            if best == cell {
                return Some(self.cut(cell));
            }
            cell = best;
        }
    }

    /// The peaks of the map that stand alone, strongest first: each comes down to a share of its height on both sides of every axis.
    pub fn isolated(&self) -> Vec<Reflector> {
        let peaks = self.local_maxima();
        let most = peaks.first().map_or(0.0, |&cell| self.map[cell]);
        let strong = peaks.into_iter().take_while(|&cell| self.map[cell] >= LEAST_PEAK * most);
        let alone = |reflector: &Reflector| reflector.cuts.iter().all(|cut| cut.sigma.is_some());
        strong.map(|cell| self.cut(cell)).filter(alone).take(MOST_PEAKS).collect()
    }

    /// Cells that no neighbour along an axis exceeds, strongest first; the edge of the map holds none.
    fn local_maxima(&self) -> Vec<usize> {
        let mut strides = vec![1; self.shape.len()];
        for k in (1..self.shape.len()).rev() {
            strides[k - 1] = strides[k] * self.shape[k];
        }
        let is_peak = |cell: usize| {
            let here = self.map[cell];
            let bins = unravel(cell, &self.shape);
            here.is_finite()
                && (0..self.shape.len()).all(|k| {
                    bins[k] > 0
                        && bins[k] + 1 < self.shape[k]
                        && here > self.map[cell - strides[k]]
                        && here >= self.map[cell + strides[k]]
                })
        };
        let mut peaks: Vec<usize> = (0..self.map.len()).filter(|&cell| is_peak(cell)).collect();
        peaks.sort_by(|&a, &b| self.map[b].total_cmp(&self.map[a]));
        peaks
    }

    fn coordinates_of(&self, cell: usize) -> [f64; 3] {
        let bins: Vec<f64> = unravel(cell, &self.shape).iter().map(|&bin| bin as f64).collect();
        self.native.coordinates(self.view, &bins)
    }

    /// Cuts through a cell.
    fn cut(&self, cell: usize) -> Reflector {
        let bins: Vec<f64> = unravel(cell, &self.shape).iter().map(|&bin| bin as f64).collect();
        let mut centre = self.native.coordinates(self.view, &bins);
        let mut cuts = Vec::new();
        for k in 0..self.native.axes.len() {
            let (cut, at) = self.along(k, &bins, centre);
            cuts.push((cut, at));
        }
        for (k, (_, at)) in cuts.iter().enumerate() {
            centre[k] = *at;
        }
        Reflector {
            coordinates: self.native.axes.iter().zip(centre).map(|(axis, x)| (axis.kind, x)).collect(),
            bins,
            level: self.map[cell],
            cuts: cuts.into_iter().map(|(cut, _)| cut).collect(),
        }
    }

    /// The cut along axis `k` of the FFTs, and where its peak is.
    fn along(&self, k: usize, bins: &[f64], centre: [f64; 3]) -> (LobeCut, f64) {
        let kind = self.native.axes[k].kind;
        // A view's own axis is cut through its bins, others at half the distance of cells.
        let own = self.native.are_the_views();
        let mut beside = bins.to_vec();
        beside[k] += 1.0;
        let step = (self.native.coordinates(self.view, &beside)[k] - centre[k]).abs() * if own { 1.0 } else { 0.5 };
        let value = |offset: f64| -> f64 {
            let mut at = centre;
            at[k] += offset * step;
            self.native
                .bins(self.view, at)
                .map_or(f64::NAN, |at| interpolate(&self.map, &self.shape, &at[..self.shape.len()]))
        };
        let top = value(0.0);
        let (l, h) = (value(-1.0), value(1.0));
        let bend = l.ln() - 2.0 * top.ln() + h.ln();
        let shift = if bend < 0.0 { (0.5 * (l.ln() - h.ln()) / bend).clamp(-1.0, 1.0) } else { 0.0 };
        let peak = (top.ln() - 0.25 * (l.ln() - h.ln()) * shift).exp();
        let peak = if peak.is_finite() { peak } else { top };
        let resolved = self.fft.and_then(|fft| fft.resolved(kind));
        // A known window says where its lobe ends: bins of a lobe without padding may miss the minimum.
        let null = resolved.map(|resolved| first_null_bins(resolved.window, resolved.count) * resolved.natural / step);
        let most = null.map_or(MOST_BINS, |null| (null.ceil() as usize + 1).min(MOST_BINS));
        // Out to the first minimum on each side; interpolation between cells makes small waves, which are none.
        let side = |sign: f64| {
            let (mut points, mut lowest, mut end) = (Vec::new(), top, 0);
            for offset in (1..=most).map(|n| sign * n as f64) {
                let here = value(offset);
                if !here.is_finite() || here > lowest + RIPPLE * top {
                    break;
                }
                points.push((offset, here));
                if here <= lowest {
                    (lowest, end) = (here, points.len());
                }
                // Sampled at a bin each, a lobe and its sidelobes may fall without a minimum between them.
                if here < FAINT * top {
                    break;
                }
            }
            points.truncate(end);
            (points, lowest / peak)
        };
        let ((left, low), (right, high)) = (side(-1.0), side(1.0));
        let mut points: Vec<(f64, f64)> = left.into_iter().rev().chain([(0.0, top)]).chain(right).collect();
        for (offset, x) in &mut points {
            (*offset, *x) = ((*offset - shift) * step, *x / peak);
        }
        let null = points.iter().map(|point| point.0.abs()).fold(0.0, f64::max);
        let is_lobe = low <= ISOLATED && high <= ISOLATED && points.len() >= 3;
        let sigma = is_lobe.then(|| closest_sigma(&points, null)).filter(|sigma| *sigma > 0.0 && *sigma < 0.99 * null);
        let (offset, measured) = points.into_iter().unzip();
        let cut = LobeCut {
            kind,
            offset,
            measured,
            sigma,
            model_sigma: width_of(&self.view.psf, kind),
            fft: resolved.map(|resolved| (resolved.natural, resolved.window.weights(resolved.count).into())),
        };
        (cut, centre[k] + shift * step)
    }
}

/// The width of a point spread along an axis of the FFTs; that of an angle is of its sine, which it is at boresight.
pub fn width_of(psf: &PointSpread, kind: AxisKind) -> f64 {
    match kind {
        AxisKind::Range | AxisKind::X | AxisKind::DepthH | AxisKind::DepthV => psf.range_m,
        AxisKind::Azimuth | AxisKind::Cone | AxisKind::Y => psf.azimuth_rad,
        AxisKind::Elevation | AxisKind::Z => psf.elevation_rad,
        AxisKind::Doppler => psf.doppler_mps,
    }
}

/// A point spread with the width along an axis of the FFTs replaced.
pub fn with_width(psf: PointSpread, kind: AxisKind, width: f64) -> PointSpread {
    match kind {
        AxisKind::Range | AxisKind::X | AxisKind::DepthH | AxisKind::DepthV => PointSpread { range_m: width, ..psf },
        AxisKind::Azimuth | AxisKind::Cone | AxisKind::Y => PointSpread { azimuth_rad: width, ..psf },
        AxisKind::Elevation | AxisKind::Z => PointSpread { elevation_rad: width, ..psf },
        AxisKind::Doppler => PointSpread { doppler_mps: width, ..psf },
    }
}

/// The widths that reflectors of one view say, a kind of axis each: the lower quartile, for extent only widens. Kinds that none has
/// a lobe along are left out.
pub fn refined_widths(reflectors: &[Reflector]) -> Vec<(AxisKind, f64)> {
    let Some(first) = reflectors.first() else { return Vec::new() };
    let of_axis = |(k, (kind, _)): (usize, &(AxisKind, f64))| {
        let mut widths: Vec<f64> = reflectors.iter().filter_map(|r| r.cuts.get(k)?.sigma).collect();
        widths.sort_by(f64::total_cmp);
        Some((*kind, *widths.get(widths.len() / 4)?))
    };
    first.coordinates.iter().enumerate().filter_map(of_axis).collect()
}
