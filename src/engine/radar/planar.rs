//! Both angles of an array whose virtual elements lie in rows above each other: range × sine along z × sine along y, and Cartesian
//! cubes read from it.
//!
//! Every row is transformed along y by itself and divided by the number of its elements, then the rows are summed along z with the
//! phases of their heights; powers are summed over Doppler. Rows need not be evenly spaced: a cascade has them at 0, 1, 4 and 6
//! elements, so that its lobe along z has sidelobes only 6 to 7 dB down at *every* other elevation. They are in the published
//! cubes of such radars too.

use super::{Axis, MimoArray, RangeDoppler};
use num_complex::Complex64;
use rustfft::FftPlanner;
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// Elements of a row that are accepted: a place far away is no antenna's of the same board.
const MOST_ELEMENTS: usize = 1 << 12;
/// Bins of the sine along y at least; and along z.
const SINES: [usize; 2] = [128, 32];

/// The rows of an array.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanarRows {
    /// Height in elements, and (place in elements, channel) of each of its elements, in the order of their places.
    rows: Vec<(f64, Vec<(usize, usize)>)>,
    /// Bins of the sines along y and along z.
    sines: [usize; 2],
    /// Cycles from one element to the next at a sine of 1.
    cycles: f64,
}

/// Power by range, sine along z, sine along y.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanarMap {
    ranges: usize,
    range_step_m: f64,
    sines: [usize; 2],
    cycles: f64,
    power: Vec<f32>,
}

impl PlanarRows {
    /// Of an array whose elements are `spacing_m` apart along y and z; of several channels at one place the first. `None` where
    /// they lie in one row, or farther apart than those of a board.
    pub fn of(array: &MimoArray, spacing_m: f64, wavelength_m: f64) -> Option<Self> {
        let place = |channel: usize, axis: usize| {
            let sum = array.tx[channel / array.rx.len()][axis] + array.rx[channel % array.rx.len()][axis];
            (sum / spacing_m).round()
        };
        let channels = 0..array.channels();
        let lowest = |axis: usize| channels.clone().map(|channel| place(channel, axis)).fold(f64::INFINITY, f64::min);
        let [left, bottom] = [lowest(1), lowest(2)];
        let mut rows: BTreeMap<i64, BTreeMap<usize, usize>> = BTreeMap::new();
        for channel in channels.clone() {
            let row = rows.entry((place(channel, 2) - bottom) as i64).or_default();
            row.entry((place(channel, 1) - left) as usize).or_insert(channel);
        }
        let longest = rows.values().filter_map(|row| row.keys().next_back()).max()? + 1;
        let rows: Vec<_> = rows.into_iter().map(|(up, row)| (up as f64, row.into_iter().collect())).collect();
        let sines = [longest.next_power_of_two().max(SINES[0]), SINES[1]];
        (rows.len() > 1 && longest <= MOST_ELEMENTS).then(|| Self { rows, sines, cycles: spacing_m / wavelength_m })
    }

    /// Elements of an even line as long as the longest row, and as high as the rows.
    pub fn span(&self) -> [usize; 2] {
        let length =
            |row: &[(usize, usize)]| row.first().zip(row.last()).map_or(0, |((first, _), (last, _))| last - first + 1);
        let along = self.rows.iter().map(|(_, row)| length(row)).max().unwrap_or(0);
        let up = self.rows.last().map_or(0.0, |(up, _)| *up) as usize + 1;
        [along, up]
    }

    /// Both angle transforms of a frame, powers summed over Doppler.
    pub fn map(&self, spectra: &RangeDoppler) -> PlanarMap {
        let [sines, heights] = self.sines;
        let along = FftPlanner::new().plan_fft_inverse(sines);
        // A scatterer above has a shorter way to a higher row: with it the phase falls, and is turned back.
        let turns: Vec<Vec<Complex64>> = (0..heights)
            .map(|k| {
                let cycles = (k as f64 - (heights / 2) as f64) / heights as f64;
                self.rows.iter().map(|(row, _)| Complex64::cis(TAU * row * cycles)).collect()
            })
            .collect();
        let mut power = vec![0.0_f32; spectra.ranges * heights * sines];
        let mut lines = vec![vec![Complex64::ZERO; sines]; self.rows.len()];
        for range in 0..spectra.ranges {
            for doppler in 0..spectra.dopplers {
                for (line, (_, row)) in lines.iter_mut().zip(&self.rows) {
                    line.fill(Complex64::ZERO);
                    let share = 1.0 / row.len() as f64;
                    for &(place, channel) in row {
                        let at = (range * spectra.channels + channel) * spectra.dopplers + doppler;
                        line[place] = spectra.data[at] * share;
                    }
                    along.process(line);
                }
                for (height, turns) in turns.iter().enumerate() {
                    let cells = &mut power[(range * heights + height) * sines..][..sines];
                    for (k, cell) in cells.iter_mut().enumerate() {
                        let from = (k + sines / 2) % sines;
                        let sum: Complex64 = lines.iter().zip(turns).map(|(line, turn)| line[from] * turn).sum();
                        *cell += sum.norm_sqr() as f32;
                    }
                }
            }
        }
        let &Self { sines, cycles, .. } = self;
        PlanarMap { ranges: spectra.ranges, range_step_m: spectra.range_step_m, sines, cycles, power }
    }
}

impl PlanarMap {
    /// Amplitudes on Cartesian axes (z, y, x), C order; 0 beyond the last range.
    pub fn cartesian(&self, [z, y, x]: [&Axis; 3]) -> Vec<f64> {
        let mut cube = Vec::with_capacity(z.bins * y.bins * x.bins);
        for up in (0..z.bins).map(|bin| z.at(bin as f64)) {
            for left in (0..y.bins).map(|bin| y.at(bin as f64)) {
                for ahead in (0..x.bins).map(|bin| x.at(bin as f64)) {
                    let range = ahead.hypot(left).hypot(up);
                    cube.push(self.at(range, left / range, up / range).sqrt());
                }
            }
        }
        cube
    }

    /// Power at a range and the sines along y and z, linear between bins; 0 beyond the last range. Both sines are periodic.
    fn at(&self, range_m: f64, left: f64, up: f64) -> f64 {
        let [sines, heights] = self.sines;
        let r = range_m / self.range_step_m;
        if !(r.is_finite() && left.is_finite() && up.is_finite()) || r + 1.0 >= self.ranges as f64 {
            return 0.0;
        }
        let split = |x: f64| (x.floor(), x - x.floor());
        let ((r0, r), (s0, s)) = (split(r), split((left * self.cycles + 0.5) * sines as f64));
        let (h0, h) = split((up * self.cycles + 0.5) * heights as f64);
        let cell = |range: f64, height: f64, sine: f64| {
            let (range, height) = (range as usize, (height as i64).rem_euclid(heights as i64) as usize);
            let sine = (sine as i64).rem_euclid(sines as i64) as usize;
            f64::from(self.power[(range * heights + height) * sines + sine])
        };
        let mix = |share: f64, a: f64, b: f64| (1.0 - share) * a + share * b;
        let line = |range: f64, height: f64| mix(s, cell(range, height, s0), cell(range, height, s0 + 1.0));
        let plane = |range: f64| mix(h, line(range, h0), line(range, h0 + 1.0));
        mix(r, plane(r0), plane(r0 + 1.0))
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests")]

    use super::*;
    use crate::radar::{AxisKind, Board, Chain, ChirpSettings, Echo, Spacing, Window};

    /// A still point before a cascade: its Cartesian cell is the strongest, whatever the order in which transmitters send.
    #[test]
    fn a_point_is_where_it_stands() {
        for backwards in [false, true] {
            let mut tx: Vec<usize> = (0..12).collect();
            if backwards {
                tx.reverse();
            }
            let chirp = ChirpSettings {
                start_hz: 76e9,
                slope_hz_per_s: 50e12,
                idle_s: 5e-6,
                adc_start_s: 5e-6,
                ramp_s: 50e-6,
                samples: 64,
                sample_rate_hz: 2e6,
                loops: 1,
                tx,
                rx: 16,
                period_s: 0.1,
            };
            let fmcw = chirp.fmcw(Board::Cascade, 12.0);
            let rows = PlanarRows::of(&fmcw.array, fmcw.radar.l_az_m, fmcw.radar.wavelength_m()).unwrap();
            assert_eq!(rows.span(), [86, 7]);
            let at = [2.4, 0.9, 0.5];
            let adc = fmcw.synthesise(&fmcw.loop_of(&[Echo::still(at, Complex64::ONE)]), &[]);
            let chain = Chain {
                range_window: Window::Hann,
                range_fft: 128,
                doppler_window: Window::Rectangular,
                doppler_fft: 1,
                angle_window: Window::Rectangular,
                angle_fft: 128,
                still_share: 1.0,
                max_range_m: 5.0,
            };
            let map = rows.map(&chain.range_doppler(&fmcw, &adc));
            let axis = |kind, bins, lo, hi| Axis { kind, bins, lo, hi, spacing: Spacing::Linear };
            let axes =
                [axis(AxisKind::Z, 20, -2.0, 2.0), axis(AxisKind::Y, 40, 2.0, -2.0), axis(AxisKind::X, 40, 1.0, 4.0)];
            let cube = map.cartesian([&axes[0], &axes[1], &axes[2]]);
            let best = (0..cube.len()).max_by(|&a, &b| cube[a].total_cmp(&cube[b])).unwrap();
            let found =
                [axes[2].at((best % 40) as f64), axes[1].at((best / 40 % 40) as f64), axes[0].at((best / 1600) as f64)];
            let off: Vec<f64> = found.iter().zip(at).map(|(a, b)| (a - b).abs()).collect();
            assert!(off[0] < 0.1 && off[1] < 0.11 && off[2] < 0.31, "{backwards}: {found:?}");
        }
        let line = Board::Line.array(&[0, 1], 4, 0.002);
        assert_eq!(PlanarRows::of(&line, 0.002, 0.004), None);
    }
}
