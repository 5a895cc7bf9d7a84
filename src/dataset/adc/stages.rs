//! The stages of a capture's processing, as a person looks at them: samples, range profile, range and Doppler, angle; with what
//! each resolves at best and at most, and what the numbers warn of.

use super::AdcSettings;
use crate::radar::{AdcCube, Chain, ChirpSettings, Fmcw};
use num_complex::Complex64;

/// A farther echo than the last bins of the profile should hold is this far above its median, as amplitude.
const FOLDED: f64 = 10.0;
/// Bins at the end of the profile that are looked at, as a share of it.
const LAST_BINS: f64 = 0.03;
/// Power at the fastest speeds by the median over all, from which speeds beyond are likely.
const FAST: f64 = 8.0;
/// How much more energy the far half of the range spectrum must have for I and Q to be called swapped.
const SWAPPED: f64 = 1.2;

/// What one stage resolves.
#[derive(Debug, Clone, PartialEq)]
pub struct StageLimit {
    /// The quantity.
    pub quantity: &'static str,
    /// Of two echoes, how far apart they must be.
    pub resolution: f64,
    /// The largest value without ambiguity.
    pub most: f64,
    /// Unit of both.
    pub unit: &'static str,
    /// The formula of the two.
    pub formula: &'static str,
}

/// A frame on its way from the converter to the maps.
#[derive(Debug, Clone, PartialEq)]
pub struct ChainStages {
    /// The samples of the first chirp of the first channel, least significant bits.
    pub adc: Vec<Complex64>,
    /// Largest value of the converter.
    pub full_scale: f64,
    /// Samples of the frame at its limits, as a share.
    pub clipped: f64,
    /// m a bin of the profiles.
    pub range_step_m: f64,
    /// Amplitude over range, root of the mean power over channels and chirps; to the end of the FFT.
    pub profile: Vec<f64>,
    /// The same without what stands still.
    pub moving: Vec<f64>,
    /// m a bin of range × Doppler.
    pub map_step_m: f64,
    /// m/s a bin of range × Doppler, and its bins.
    pub speed_step_mps: f64,
    /// Doppler bins, from negative to positive.
    pub dopplers: usize,
    /// Range × Doppler, amplitude summed in power over channels, Doppler fastest.
    pub range_doppler: Vec<f64>,
    /// Range m and speed m/s of its strongest cell.
    pub strongest: (f64, f64),
    /// Sine a bin of the angle spectrum.
    pub sine_step: f64,
    /// Amplitude over the sine in the strongest cell, from negative to positive; empty for a single antenna.
    pub angle: Vec<f64>,
    /// What range, speed and angle resolve.
    pub limits: Vec<StageLimit>,
    /// What the numbers warn of, in words.
    pub warnings: Vec<String>,
}

impl ChainStages {
    /// Those of a frame; `line` are the channels of its longest line of antennas.
    pub fn of(adc: &AdcCube, settings: &AdcSettings, (fmcw, chain): (&Fmcw, &Chain), line: &[usize]) -> Self {
        let top = 2f64.powi(settings.words.bits as i32 - 1) - 1.0;
        let at_limit = |x: &&Complex64| x.re.abs() >= top || x.im.abs() >= top;
        let clipped = adc.data.iter().filter(at_limit).count() as f64 / adc.data.len().max(1) as f64;
        let (profile, moving) = adc.range_profiles(chain.range_window);
        let complex = settings.words.complex;
        let half = |mut profile: Vec<f64>| {
            // Of real samples the upper half is the lower one's mirror image.
            profile.truncate(if complex { profile.len() } else { profile.len() / 2 + 1 });
            profile
        };
        let (profile, moving) = (half(profile), half(moving));
        let spectra = chain.range_doppler(fmcw, adc);
        let range_doppler = spectra.amplitudes();
        let best = range_doppler.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)).map_or(0, |(at, _)| at);
        let (range, doppler) = (best / spectra.dopplers.max(1), best % spectra.dopplers.max(1));
        let strongest = (
            range as f64 * spectra.range_step_m,
            (doppler as f64 - (spectra.dopplers / 2) as f64) * spectra.doppler_step_mps,
        );
        let angle =
            if line.len() > 1 { chain.angle_spectrum(&spectra.of_channels(line), range, doppler) } else { vec![] };
        let wavelength = fmcw.radar.wavelength_m();
        let mut stages = Self {
            adc: adc.data.iter().take(adc.samples).copied().collect(),
            full_scale: top,
            clipped,
            range_step_m: fmcw.unambiguous_range_m() / adc.samples.max(1) as f64,
            profile,
            moving,
            map_step_m: spectra.range_step_m,
            speed_step_mps: spectra.doppler_step_mps,
            dopplers: spectra.dopplers,
            range_doppler,
            strongest,
            sine_step: wavelength / (fmcw.radar.l_az_m * angle.len().max(1) as f64),
            angle,
            limits: limits(&settings.chirp, complex, line.len(), wavelength / fmcw.radar.l_az_m),
            warnings: settings.chirp.warnings(),
        };
        stages.warn(adc, complex);
        stages
    }

    /// What the samples themselves warn of.
    fn warn(&mut self, adc: &AdcCube, complex: bool) {
        if self.clipped > 0.0 {
            self.warnings
                .push(format!("{:.2} % of the samples are at the converter's limit: clipped", 100.0 * self.clipped));
        }
        if complex {
            let ratio = adc.upper_to_lower();
            if ratio > SWAPPED {
                self.warnings.push(format!(
                    "I/Q swapped? The far half of the range spectrum has {ratio:.1} times the energy of the near one"
                ));
            }
        }
        let last = ((self.profile.len() as f64 * LAST_BINS) as usize).max(2);
        let middle = median(&self.profile);
        // The very last bins are those beside range 0: leakage of the transmitters, and the window.
        let end = self.profile.len().saturating_sub(if complex { 4 } else { 1 });
        let far = self.profile.get(end.saturating_sub(last)..end).unwrap_or_default();
        let far = far.iter().copied().fold(0.0, f64::max);
        if far > FOLDED * middle {
            self.warnings.push(format!(
                "range folded? An echo lies at the end of the profile, {:.0} dB above its median: farther ones come back near",
                20.0 * (far / middle).log10()
            ));
        }
        if self.dopplers >= 8 {
            let power = |bins: &mut dyn Iterator<Item = usize>| {
                let (mut sum, mut count) = (0.0, 0.0);
                for bin in bins {
                    let column = self.range_doppler.iter().skip(bin).step_by(self.dopplers);
                    sum += column.map(|x| x * x).sum::<f64>();
                    count += 1.0;
                }
                sum / f64::max(count, 1.0)
            };
            let columns: Vec<f64> = (0..self.dopplers).map(|bin| power(&mut std::iter::once(bin))).collect();
            let edge = self.dopplers / 16 + 1;
            let fast = power(&mut (0..edge).chain(self.dopplers - edge..self.dopplers));
            let typical = median(&columns);
            if fast > FAST * typical {
                self.warnings.push(format!(
                    "speed ambiguous? At ±{:.2} m/s is {:.0} dB more than in the median: faster ones come back as slow",
                    self.speed_step_mps * self.dopplers as f64 / 2.0,
                    10.0 * (fast / typical).log10()
                ));
            }
        }
    }
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(0.0).max(f64::MIN_POSITIVE)
}

/// What the chirp and a line of `elements` antennas resolve; `circle` is the sine after which angles repeat.
pub fn limits(chirp: &ChirpSettings, complex: bool, elements: usize, circle: f64) -> Vec<StageLimit> {
    let range = StageLimit {
        quantity: "range",
        resolution: chirp.range_step_m(),
        most: chirp.range_max_m() * if complex { 1.0 } else { 0.5 },
        unit: "m",
        formula: if complex { "c/2B · c·fs/2S" } else { "c/2B · c·fs/4S (real samples)" },
    };
    let speed = StageLimit {
        quantity: "speed",
        resolution: chirp.speed_step_mps(),
        most: chirp.speed_max_mps(),
        unit: "m/s",
        formula: "λ/2T · λ/4·(chirps of a loop)",
    };
    let sine = circle / elements.max(1) as f64;
    let angle = StageLimit {
        quantity: "angle",
        resolution: sine.min(1.0).asin().to_degrees(),
        most: (0.5 * circle).min(1.0).asin().to_degrees(),
        unit: "°",
        formula: "asin λ/(N·l) at boresight · asin λ/2l",
    };
    let mut all = vec![range];
    if chirp.loops > 1 {
        all.push(speed);
    }
    if elements > 1 {
        all.push(angle);
    }
    all
}
