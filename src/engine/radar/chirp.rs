//! What a capture's configuration says of its chirps, and what follows from it: the FFT chain's radar, and the limits that a
//! person should know of.

use super::{Fmcw, MimoArray, RadarConfig, SPEED_OF_LIGHT};
use crate::geometry::{Vec3, add, scale, sub};
use std::collections::BTreeMap;

/// Transmitters are numbered below this.
const MOST_TRANSMITTER: usize = 128;

/// The chirps of a capture: one profile, sent by one transmitter after the other (TDM-MIMO).
#[derive(Debug, Clone, PartialEq)]
pub struct ChirpSettings {
    /// Frequency at which the ramp begins, Hz.
    pub start_hz: f64,
    /// Slope of the ramp, Hz/s.
    pub slope_hz_per_s: f64,
    /// Pause before the ramp, s.
    pub idle_s: f64,
    /// Begin of sampling after that of the ramp, s.
    pub adc_start_s: f64,
    /// Length of the ramp, s.
    pub ramp_s: f64,
    /// Samples a chirp.
    pub samples: usize,
    /// Samples a second.
    pub sample_rate_hz: f64,
    /// Times that every transmitter sends in a frame.
    pub loops: usize,
    /// Transmitters in the order in which they send, counted from 0.
    pub tx: Vec<usize>,
    /// Receivers.
    pub rx: usize,
    /// From one frame to the next, s.
    pub period_s: f64,
}

impl ChirpSettings {
    /// Bandwidth that is sampled: slope · samples / rate, Hz.
    pub fn bandwidth_hz(&self) -> f64 {
        self.slope_hz_per_s * self.samples as f64 / self.sample_rate_hz
    }

    /// Metres a bin of the range FFT without padding, c·rate / (2·slope·samples).
    pub fn range_step_m(&self) -> f64 {
        SPEED_OF_LIGHT / (2.0 * self.bandwidth_hz())
    }

    /// Range at which the beat frequency reaches the sampling rate (complex samples), m.
    pub fn range_max_m(&self) -> f64 {
        self.samples as f64 * self.range_step_m()
    }

    /// From one chirp of a transmitter to its next, s.
    pub fn loop_s(&self) -> f64 {
        self.tx.len() as f64 * (self.idle_s + self.ramp_s)
    }

    /// Metres a second a bin of the Doppler FFT, λ / (2·loops·loop time).
    pub fn speed_step_mps(&self) -> f64 {
        self.radar(1.0).wavelength_m() / (2.0 * self.loops as f64 * self.loop_s())
    }

    /// Largest radial speed without ambiguity, λ / (4·loop time), m/s.
    pub fn speed_max_mps(&self) -> f64 {
        self.speed_step_mps() * self.loops as f64 / 2.0
    }

    /// Chirp and array for the forward model: the part of the ramp that is sampled, elements half a wave apart.
    pub fn radar(&self, r_max_m: f64) -> RadarConfig {
        let bandwidth_hz = self.bandwidth_hz();
        let start_hz = self.start_hz + self.slope_hz_per_s * self.adc_start_s;
        let half_wave = SPEED_OF_LIGHT / (start_hz + bandwidth_hz / 2.0) / 2.0;
        RadarConfig {
            start_hz,
            bandwidth_hz,
            chirp_s: self.samples as f64 / self.sample_rate_hz,
            frame_s: self.loops as f64 * self.loop_s(),
            r_max_m,
            l_az_m: half_wave,
            l_el_m: half_wave,
            ..RadarConfig::default()
        }
    }

    /// The source and the chain of these chirps with a board's array.
    pub fn fmcw(&self, board: Board, r_max_m: f64) -> Fmcw {
        let mut radar = self.radar(r_max_m);
        let spacing_m = board.spacing_m(radar.l_az_m);
        (radar.l_az_m, radar.l_el_m) = (spacing_m, spacing_m);
        let array = board.array(&self.tx, self.rx, radar.l_az_m).centred(spacing_m);
        Fmcw { radar, samples: self.samples, loops: self.loops, array }
    }

    /// What cannot be right, naming the quantity; `None` where nothing is wrong.
    pub fn fault(&self) -> Option<String> {
        let positive = [
            ("start frequency", self.start_hz, 1e6, 1e13),
            ("slope", self.slope_hz_per_s, 1e6, 1e18),
            ("ramp time", self.ramp_s, 1e-9, 1.0),
            ("sampling rate", self.sample_rate_hz, 1.0, 1e12),
            ("frame period", self.period_s, 1e-9, 1e4),
        ];
        let numbers = positive.iter().find(|(_, value, least, most)| !(*least..=*most).contains(value));
        if let Some((what, value, least, most)) = numbers {
            return Some(format!("{what} is {value:e}; expected {least:e} to {most:e}"));
        }
        let times = [("idle time", self.idle_s), ("begin of sampling", self.adc_start_s)];
        if let Some((what, value)) = times.iter().find(|(_, value)| !(0.0..=1.0).contains(value)) {
            return Some(format!("{what} is {value:e} s; expected 0 to 1"));
        }
        let counts =
            [("samples a chirp", self.samples, 1 << 16), ("loops", self.loops, 1 << 14), ("receivers", self.rx, 64)];
        if let Some((what, value, most)) = counts.iter().find(|(_, value, most)| *value == 0 || value > most) {
            return Some(format!("{what}: {value}; expected 1 to {most}"));
        }
        if let Some(tx) = self.tx.iter().find(|tx| **tx >= MOST_TRANSMITTER) {
            return Some(format!("transmitter {tx}; expected 0 to {}", MOST_TRANSMITTER - 1));
        }
        let most = 64;
        (self.tx.is_empty() || self.tx.len() > most)
            .then(|| format!("{} transmitters; expected 1 to {most}", self.tx.len()))
    }

    /// What a person should know before trusting the maps, in words.
    pub fn warnings(&self) -> Vec<String> {
        let mut said = Vec::new();
        let sampled = self.adc_start_s + self.samples as f64 / self.sample_rate_hz;
        if sampled > self.ramp_s * (1.0 + 1e-9) {
            said.push(format!(
                "sampling ends {:.1} µs after the ramp: the last samples are not of the chirp",
                1e6 * (sampled - self.ramp_s)
            ));
        }
        let frame_s = self.loops as f64 * self.loop_s();
        if frame_s > self.period_s * (1.0 + 1e-9) {
            said.push(format!(
                "the chirps of a frame take {:.1} ms, the frame period is {:.1} ms",
                1e3 * frame_s,
                1e3 * self.period_s
            ));
        }
        if self.speed_max_mps() < 2.0 {
            said.push(format!(
                "radial speeds beyond ±{:.2} m/s fold: a walking person's limbs are faster",
                self.speed_max_mps()
            ));
        }
        if self.loops == 1 {
            said.push(
                "one chirp a transmitter and frame: no Doppler, and nothing that stands still can be taken away".into(),
            );
        }
        said
    }

    /// The numbers that follow from the chirp, in one line.
    pub fn words(&self) -> String {
        format!(
            "{} samples at {:.2} Msps over {:.2} GHz: {:.3} cm a range bin, {:.1} m at the most; {} loops of {} transmitter{}: \
             {:.3} m/s a bin, ±{:.2} m/s",
            self.samples,
            self.sample_rate_hz / 1e6,
            self.bandwidth_hz() / 1e9,
            100.0 * self.range_step_m(),
            self.range_max_m(),
            self.loops,
            self.tx.len(),
            if self.tx.len() == 1 { "" } else { "s" },
            self.speed_step_mps(),
            self.speed_max_mps(),
        )
    }
}

/// Where the antennas of a board are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Board {
    /// IWR1443, 1843, 6843ISK and their like: four receivers half a wave apart; the first and third transmitter two waves
    /// apart in their line, the second between them and half a wave higher.
    #[default]
    Isk,
    /// All transmitters in one line, spaced so that the virtual elements are half a wave apart.
    Line,
    /// Four AWR2243 on MMWCAS-RF-EVM: transmitters 3 to 11 and sixteen receivers make a line of 86 elements, transmitters 0 to 2
    /// lie six, four and one element higher. Receivers in the order master, slave 1 to 3.
    Cascade,
}

/// Places of the cascade's transmitters (across, up) and receivers (across), in half waves at [`CASCADE_HZ`], by their numbers.
const CASCADE_TX: [[f64; 2]; 12] = [
    [11.0, 6.0],
    [10.0, 4.0],
    [9.0, 1.0],
    [32.0, 0.0],
    [28.0, 0.0],
    [24.0, 0.0],
    [20.0, 0.0],
    [16.0, 0.0],
    [12.0, 0.0],
    [8.0, 0.0],
    [4.0, 0.0],
    [0.0, 0.0],
];
const CASCADE_RX: [f64; 16] =
    [11.0, 12.0, 13.0, 14.0, 50.0, 51.0, 52.0, 53.0, 46.0, 47.0, 48.0, 49.0, 0.0, 1.0, 2.0, 3.0];
/// The frequency that the cascade's antennas are spaced for.
const CASCADE_HZ: f64 = 76.8e9;

impl Board {
    /// The name in manifests.
    pub fn name(self) -> &'static str {
        match self {
            Self::Isk => "isk",
            Self::Line => "line",
            Self::Cascade => "cascade",
        }
    }

    /// Distance of neighbouring virtual elements, m, where half a wave is `half_wave_m`.
    pub fn spacing_m(self, half_wave_m: f64) -> f64 {
        if self == Self::Cascade { SPEED_OF_LIGHT / CASCADE_HZ / 2.0 } else { half_wave_m }
    }

    /// The board of that name.
    pub fn named(name: &str) -> Option<Self> {
        [Self::Isk, Self::Line, Self::Cascade].into_iter().find(|board| board.name() == name)
    }

    /// Transmitters in the order in which they send, and receivers, m; elements are `spacing_m` apart. y grows from the first
    /// element to the last.
    pub fn array(self, tx: &[usize], rx: usize, spacing_m: f64) -> MimoArray {
        let at = |y: f64, z: f64| -> Vec3 { [0.0, y * spacing_m, z * spacing_m] };
        let transmitter = |&tx: &usize| match (self, tx) {
            (Self::Isk, 1) => at(2.0, 1.0),
            (Self::Isk, 2) => at(4.0, 0.0),
            (Self::Cascade, n) => CASCADE_TX.get(n).map_or(at(0.0, 0.0), |&[across, up]| at(across, up)),
            (Self::Isk | Self::Line, n) => at((n * rx) as f64, 0.0),
        };
        let receiver = |n: usize| match self {
            Self::Cascade => at(CASCADE_RX.get(n).copied().unwrap_or(n as f64), 0.0),
            _ => at(n as f64, 0.0),
        };
        MimoArray { tx: tx.iter().map(transmitter).collect(), rx: (0..rx).map(receiver).collect() }
    }
}

impl MimoArray {
    /// With the middle of its longest line along y at the origin: angles and ranges are seen from there.
    #[must_use]
    pub fn centred(mut self, spacing_m: f64) -> Self {
        let line = self.lines(1, spacing_m).into_iter().next().unwrap_or_default();
        let place = |&channel: &usize| add(self.tx[channel / self.rx.len()], self.rx[channel % self.rx.len()]);
        let sum = line.iter().map(place).fold([0.0; 3], add);
        // Half of a virtual element's place is the transmitter's share, half the receiver's.
        let middle = scale(sum, 0.5 / line.len().max(1) as f64);
        self.tx.iter_mut().chain(&mut self.rx).for_each(|at| *at = sub(*at, middle));
        self
    }

    /// The longest even lines of virtual elements along y (`axis` 1) or z (2), channel by channel, `spacing_m` between
    /// neighbours; several where lines beside each other are as long.
    pub fn lines(&self, axis: usize, spacing_m: f64) -> Vec<Vec<usize>> {
        let other = 3 - axis;
        let mut rows: BTreeMap<i64, Vec<(i64, usize)>> = BTreeMap::new();
        let first = self.tx.first().zip(self.rx.first()).map_or([0.0; 3], |(tx, rx)| add(*tx, *rx));
        for channel in 0..self.channels() {
            let (tx, rx) = (self.tx[channel / self.rx.len()], self.rx[channel % self.rx.len()]);
            let place = |k: usize| ((tx[k] + rx[k] - first[k]) / spacing_m).round() as i64;
            let row = rows.entry(place(other)).or_default();
            // Two channels at one place measure the same: the first is taken.
            if row.iter().all(|(known, _)| *known != place(axis)) {
                row.push((place(axis), channel));
            }
        }
        let lines: Vec<Vec<usize>> = rows.into_values().map(longest_run).collect();
        let most = lines.iter().map(Vec::len).max().unwrap_or(0);
        lines.into_iter().filter(|line| line.len() == most).collect()
    }
}

/// The channels of the longest run of neighbours.
fn longest_run(mut elements: Vec<(i64, usize)>) -> Vec<usize> {
    elements.sort_unstable();
    let mut best: &[(i64, usize)] = &[];
    let mut from = 0;
    for to in 1..=elements.len() {
        if to == elements.len() || elements[to].0 != elements[to - 1].0 + 1 {
            if to - from > best.len() {
                best = &elements[from..to];
            }
            from = to;
        }
    }
    best.iter().map(|(_, channel)| *channel).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The configuration of a real IWR6843ISK capture.
    fn real() -> ChirpSettings {
        ChirpSettings {
            start_hz: 60e9,
            slope_hz_per_s: 29.837e12,
            idle_s: 280e-6,
            adc_start_s: 6e-6,
            ramp_s: 134e-6,
            samples: 512,
            sample_rate_hz: 4e6,
            loops: 85,
            tx: vec![0, 1, 2],
            rx: 4,
            period_s: 0.15,
        }
    }

    #[test]
    fn resolutions_follow_from_the_chirp() {
        let chirp = real();
        assert!((chirp.range_step_m() - 0.0393).abs() < 1e-4, "{}", chirp.range_step_m());
        assert!((chirp.range_max_m() - 20.1).abs() < 0.05);
        // λ/(4·3·414 µs).
        assert!((chirp.speed_max_mps() - 0.972).abs() < 1e-3, "{}", chirp.speed_max_mps());
        let said = chirp.warnings();
        assert!(said.len() == 1 && said[0].contains("fold"), "{said:?}");
        assert_eq!(chirp.fault(), None);
        let late = ChirpSettings { adc_start_s: 20e-6, period_s: 0.1, loops: 1, ..real() };
        let said = late.warnings().join("; ");
        assert!(said.contains("after the ramp") && said.contains("one chirp"), "{said}");
        let long = ChirpSettings { period_s: 0.1, ..real() };
        assert!(long.warnings().iter().any(|said| said.contains("frame period")));
        let far = ChirpSettings { tx: vec![0, 1 << 26], ..real() };
        assert!(far.fault().is_some_and(|said| said.contains("transmitter 67108864; expected 0 to 127")));
        assert!(ChirpSettings { loops: 0, ..real() }.fault().is_some_and(|said| said.contains("loops")));
        assert!(ChirpSettings { idle_s: f64::NAN, ..real() }.fault().is_some_and(|said| said.contains("idle")));
    }

    #[test]
    fn the_line_of_a_board_is_found_in_every_order_of_its_transmitters() {
        let line = |board: Board, tx: &[usize]| board.array(tx, 4, 0.002).lines(1, 0.002).concat();
        assert_eq!(line(Board::Isk, &[0, 1, 2]), [0, 1, 2, 3, 8, 9, 10, 11]);
        assert_eq!(line(Board::Isk, &[0, 2, 1]), [0, 1, 2, 3, 4, 5, 6, 7]);
        assert_eq!(line(Board::Isk, &[0]), [0, 1, 2, 3]);
        assert_eq!(line(Board::Line, &[0, 1]), (0..8).collect::<Vec<_>>());
        // One above the other, four times beside each other.
        let upward = Board::Isk.array(&[0, 1, 2], 4, 0.002).lines(2, 0.002);
        assert_eq!(upward, [[2, 4], [3, 5], [8, 6], [9, 7]]);
    }

    #[test]
    fn the_cascade_has_a_line_of_86_elements() {
        let tx: Vec<usize> = (0..12).rev().collect();
        let array = Board::Cascade.array(&tx, 16, Board::Cascade.spacing_m(1.0));
        let spacing_m = Board::Cascade.spacing_m(1.0);
        assert!((spacing_m - 0.001_951_8).abs() < 1e-6);
        let lines = array.lines(1, spacing_m);
        assert_eq!((lines.len(), lines[0].len()), (1, 86));
        for pair in lines[0].windows(2) {
            let y = |channel: usize| array.tx[channel / 16][1] + array.rx[channel % 16][1];
            assert!((y(pair[1]) - y(pair[0]) - spacing_m).abs() < 1e-12);
        }
    }
}
