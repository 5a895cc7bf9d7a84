//! HuPR's processing of a frame of ADC samples, step by step as its published script does it.
//!
//! No windows anywhere. The mean over the chirps is subtracted; the FFT over chirps and samples follows; the four antennas of the
//! raised transmitter are put under antennas 2 to 5 of the line; the elevation FFT is taken at those four antennas only, the azimuth
//! FFT everywhere; of 256 range bins 94 down to 31 are kept, of 64 Doppler bins the middle 16. The Doppler phase between the
//! transmitters' turns is *not* taken out, as in the original.

use super::AdcCube;
use num_complex::Complex64;
use rustfft::FftPlanner;
use std::f64::consts::TAU;

/// Doppler, range, azimuth, elevation bins of a cube.
pub const HUPR_SHAPE: [usize; 4] = [16, 64, 64, 8];
/// The first and the last range bin that are kept, in their order.
const RANGE_BINS: [usize; 2] = [94, 31];
/// The elevation bin at which all twelve antennas are summed: zero frequency, after the shift and the flip.
const LEVEL: usize = 3;

/// The cube of a frame of an array of 3 transmitters (line, raised, line) and 4 receivers, 64 loops, 256 samples.
pub fn hupr_cube(adc: &AdcCube) -> Vec<Complex64> {
    let [dopplers, ranges, azimuths, elevations] = HUPR_SHAPE;
    let spectra = range_doppler(adc);
    let azimuth = FftPlanner::new().plan_fft_forward(azimuths);
    let mut cube = vec![Complex64::ZERO; dopplers * ranges * azimuths * elevations];
    let mut line = vec![Complex64::ZERO; azimuths];
    for doppler in 0..dopplers {
        for range in 0..ranges {
            let at = |tx: usize, rx: usize| spectra[((tx * 4 + rx) * ranges + range) * dopplers + doppler];
            for elevation in 0..elevations {
                line.fill(Complex64::ZERO);
                let turn = Complex64::cis(-TAU * elevation as f64 / elevations as f64);
                for (antenna, cell) in line.iter_mut().enumerate().take(8) {
                    let level = if antenna < 4 { at(0, antenna) } else { at(2, antenna - 4) };
                    *cell = match antenna {
                        2..=5 => level + at(1, antenna - 2) * turn,
                        // Without the elevation FFT only the first of the eight rows holds anything.
                        _ if elevation == 0 => level,
                        _ => Complex64::ZERO,
                    };
                }
                azimuth.process(&mut line);
                // Shift, then flip: bin k of n goes to n − 1 − ((k + n/2) mod n).
                let out_elevation = elevations - 1 - (elevation + elevations / 2) % elevations;
                for (k, x) in line.iter().enumerate() {
                    let out = azimuths - 1 - (k + azimuths / 2) % azimuths;
                    cube[((doppler * ranges + range) * azimuths + out) * elevations + out_elevation] = *x;
                }
            }
        }
    }
    cube
}

/// (channel, kept range, kept Doppler), unnormalised.
fn range_doppler(adc: &AdcCube) -> Vec<Complex64> {
    let [dopplers, ranges, ..] = HUPR_SHAPE;
    let mut planner = FftPlanner::new();
    let (fast, slow) = (planner.plan_fft_forward(adc.samples), planner.plan_fft_forward(adc.loops));
    let mut lines: Vec<Complex64> = adc.data.clone();
    let block = adc.channels * adc.samples;
    let mut mean = vec![Complex64::ZERO; block];
    for chirp in lines.chunks_exact(block) {
        mean.iter_mut().zip(chirp).for_each(|(sum, x)| *sum += x / adc.loops as f64);
    }
    for chirp in lines.chunks_exact_mut(block) {
        chirp.iter_mut().zip(&mean).for_each(|(x, mean)| *x -= mean);
    }
    fast.process(&mut lines);
    let mut kept = vec![Complex64::ZERO; adc.channels * ranges * dopplers];
    let mut buffer = vec![Complex64::ZERO; adc.loops];
    for channel in 0..adc.channels {
        for range in 0..ranges {
            let bin = RANGE_BINS[0] - range;
            for (index, x) in buffer.iter_mut().enumerate() {
                *x = lines[index * block + channel * adc.samples + bin];
            }
            slow.process(&mut buffer);
            for doppler in 0..dopplers {
                let signed = (doppler + adc.loops - dopplers / 2) % adc.loops;
                kept[(channel * ranges + range) * dopplers + doppler] = buffer[signed];
            }
        }
    }
    debug_assert_eq!(RANGE_BINS[0] - RANGE_BINS[1] + 1, ranges);
    kept
}

/// What the loader takes of a cube as the map: the amplitude in elevation bin 3, (16, 64, 64).
pub fn hupr_amplitudes(cube: &[Complex64]) -> Vec<f64> {
    cube.iter().skip(LEVEL).step_by(HUPR_SHAPE[3]).map(|x| x.norm()).collect()
}
