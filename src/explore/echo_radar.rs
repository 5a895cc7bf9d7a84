//! A radar of antennas and chirps for each view of a data set: what sees a pose independently of the forward model.
//!
//! Where a view's FFTs are known it is theirs. Where only its widths are, it is a radar with those widths: Hann windows, as much
//! bandwidth and as many elements half a wave apart as they ask for.

use crate::radar::{
    AdcCube, AxisKind, Chain, FftSetup, Fmcw, MimoArray, NativeAxes, Quantity, RadarConfig, SPEED_OF_LIGHT, View,
    ViewFft, Window, interpolate, main_lobe_sigma_bins, sine_sigma,
};

/// Samples and chirps of a radar that is only known by its widths, and the fewest and most elements that one is given.
const SAMPLES: usize = 256;
const CHIRPS: usize = 32;
const FEWEST_ELEMENTS: usize = 3;
const MOST_ELEMENTS: usize = 256;
const USUAL_ELEMENTS: usize = 8;
/// Points of the angle FFT for each element, at least, and of the range FFT for each sample.
const FINE_ANGLE: usize = 4;
const FINE_RANGE: usize = 2;

/// The FFT configuration of a view, and whether it is known; else that of a radar with its widths.
pub(super) fn fft_of(view: &View, known: Option<&ViewFft>, radar: &RadarConfig) -> (ViewFft, bool) {
    if let Some(fft) = known {
        return (fft.clone(), true);
    }
    let psf = &view.psf;
    let bandwidth_hz = match psf.range_m {
        width if width > 0.0 => main_lobe_sigma_bins(Window::Hann, SAMPLES) * SPEED_OF_LIGHT / (2.0 * width),
        _ => radar.bandwidth_hz,
    };
    let mut like = RadarConfig { bandwidth_hz, ..radar.clone() };
    let half_wave = like.wavelength_m() / 2.0;
    (like.l_az_m, like.l_el_m) = (half_wave, half_wave);
    let [horizontal, vertical] = ViewFft::angles(view.axes.iter().map(|axis| axis.kind));
    // Widths that are stated along the other angle are those of the same kind of line; without any it is a line of eight.
    let either = psf.azimuth_rad.max(psf.elevation_rad);
    let line = |there: bool, width: f64| {
        let width = if width > 0.0 { width } else { either };
        there.then(|| {
            if width <= 0.0 {
                return (USUAL_ELEMENTS, Window::Hann);
            }
            // A longer line is a narrower one: the first that is narrower, or the one before it.
            let of = |elements: usize| sine_sigma(Window::Hann, elements, half_wave, 2.0 * half_wave);
            let (mut wider, mut narrower) = (FEWEST_ELEMENTS, MOST_ELEMENTS);
            while narrower - wider > 1 {
                let middle = usize::midpoint(wider, narrower);
                if of(middle) > width { wider = middle } else { narrower = middle }
            }
            let off = |elements: usize| (of(elements) - width).abs();
            let elements = if off(wider) < off(narrower) { wider } else { narrower };
            (elements, Window::Hann)
        })
    };
    let setup = FftSetup {
        range: (SAMPLES, Window::Hann),
        doppler: (CHIRPS, Window::Hann),
        azimuth: line(horizontal, psf.azimuth_rad),
        elevation: line(vertical, psf.elevation_rad),
    };
    (ViewFft { setup, radar: like }, false)
}

/// The antennas, chirps and transforms behind a view.
pub(super) struct EchoRadar {
    pub(super) fmcw: Fmcw,
    chain: Chain,
    spacing_m: f64,
    native: NativeAxes,
    /// Along which axes of the view range, sine and speed lie.
    range: usize,
    sine: Option<usize>,
    doppler: Option<usize>,
}

impl EchoRadar {
    /// Of a view with this FFT configuration; what stands still is taken away where `still_removed`.
    ///
    /// # Errors
    /// In words, where the view is none of range with at most one angle and a speed.
    pub(super) fn new(view: &View, fft: &ViewFft, still_removed: bool) -> Result<Self, String> {
        let native = NativeAxes::of(view, fft).map_err(|why| format!("{}: {why}", view.array))?;
        let find = |wanted: fn(AxisKind) -> bool| native.axes.iter().position(|axis| wanted(axis.kind));
        let angles = native.axes.iter().filter(|axis| axis.kind.is_angular()).count();
        let none = || {
            format!(
                "{}: its axes are not range, at most one angle, and speed: no line of antennas makes such a map",
                view.array
            )
        };
        let range = find(|kind| kind == AxisKind::Range).filter(|_| angles <= 1).ok_or_else(none)?;
        let (sine, doppler) = (find(AxisKind::is_angular), find(|kind| kind == AxisKind::Doppler));
        let setup = &fft.setup;
        let vertical = sine.is_some_and(|k| native.axes[k].kind == AxisKind::Elevation);
        let (line, spacing_m, direction) = if vertical {
            (setup.elevation, fft.radar.l_el_m, [0.0, 0.0, 1.0])
        } else {
            (setup.azimuth, fft.radar.l_az_m, [0.0, 1.0, 0.0])
        };
        let (elements, angle_window) = line.filter(|_| sine.is_some()).unwrap_or((1, Window::Rectangular));
        let (samples, chirps) = (setup.range.0, setup.doppler.0.max(1));
        let fmcw = Fmcw {
            radar: fft.radar.clone(),
            samples,
            loops: chirps,
            array: MimoArray::line(direction, 1, elements, spacing_m),
        };
        let chain = Chain {
            range_window: setup.range.1,
            range_fft: FINE_RANGE * samples,
            doppler_window: setup.doppler.1,
            doppler_fft: chirps.next_power_of_two(),
            angle_window,
            angle_fft: (FINE_ANGLE * elements).next_power_of_two().max(32),
            still_share: if still_removed && chirps > 1 { 0.0 } else { 1.0 },
            max_range_m: 0.98 * fmcw.unambiguous_range_m(),
        };
        Ok(Self { fmcw, chain, spacing_m, native, range, sine, doppler })
    }

    /// The map of a view that its samples make, C order.
    pub(super) fn map(&self, view: &View, adc: &AdcCube) -> Vec<f64> {
        let shape = view.shape();
        // Range × sine, range × speed, or range × speed × sine.
        let (data, sizes, steps): (Vec<f64>, Vec<usize>, [f64; 3]) = match (self.sine, self.doppler) {
            (_, None) => {
                let polar = self.chain.polar(&self.fmcw, self.spacing_m, adc);
                (polar.data, vec![polar.ranges, polar.sines], [polar.range_step_m, 0.0, polar.sine_step])
            }
            (sine, Some(_)) => {
                let cube = self.chain.cube(&self.fmcw, self.spacing_m, adc);
                let steps = [cube.range_step_m, cube.doppler_step_mps, cube.sine_step];
                let amplitudes: Vec<f64> = cube.data.iter().map(|z| z.norm()).collect();
                let sizes = vec![cube.ranges, cube.dopplers, cube.sines];
                if sine.is_some() {
                    (amplitudes, sizes, steps)
                } else {
                    let of = |bin: &[f64]| bin.iter().map(|x| x * x).sum::<f64>().sqrt();
                    let summed = amplitudes.chunks_exact(cube.sines.max(1)).map(of).collect();
                    (summed, sizes[..2].to_vec(), steps)
                }
            }
        };
        let cell = |index: usize| {
            let bins: Vec<f64> = crate::radar::unravel(index, &shape).iter().map(|&bin| bin as f64).collect();
            let at = self.native.coordinates(view, &bins);
            let middle = |n: usize| (n / 2) as f64;
            let mut places = vec![at[self.range] / steps[0]];
            if let Some(k) = self.doppler {
                places.push((at[k] / steps[1] + middle(sizes[1])).rem_euclid(sizes[1] as f64));
            }
            match self.sine {
                Some(k) => places.push(
                    (at[k] / steps[2] + middle(sizes[sizes.len() - 1])).rem_euclid(sizes[sizes.len() - 1] as f64),
                ),
                None if self.doppler.is_none() => places.push(middle(sizes[1])),
                None => {}
            }
            for (place, &size) in places.iter_mut().zip(&sizes) {
                *place = place.clamp(0.0, (size - 1) as f64);
            }
            let value = interpolate(&data, &sizes, &places);
            let value = if value.is_finite() { value } else { 0.0 };
            if view.quantity == Quantity::Power { value * value } else { value }
        };
        (0..view.cells()).map(cell).collect()
    }
}
