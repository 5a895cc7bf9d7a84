//! The cascade of four AWR2243 (TI MMWCAS, 12 transmitters and 16 receivers) with which HIBER and RT-Pose were recorded, and what
//! these two data sets make of its samples.
//!
//! **Antennas.** In half waves along the board: receivers at 0–3, 11–14, 46–53; nine transmitters at 0, 4, … 32, which make with
//! them a line of 86 virtual elements; three more at 9, 10 and 11, one, four and six half waves higher.
//!
//! **HIBER** sends one chirp a transmitter and frame, 20 frames a second, so that there is no Doppler; what stands still is taken
//! away by subtracting the frame before, and every 5 cm cell of a plane is formed by itself from the line of 86. Windows are not
//! published: none is taken.
//!
//! **RT-Pose** has Cartesian cubes. Its chirp is not published with them; their 256 steps of 4.53 cm say the bandwidth. The
//! rows of elements at the four heights are formed along y one by one, each divided by the number of its elements, and then along
//! z; powers are summed over Doppler.

use super::Radar;
use crate::geometry::Vec3;
use crate::radar::{
    AdcCube, Axis, AxisKind, Chain, FftSetup, Fmcw, MimoArray, PlanarRows, RadarConfig, SPEED_OF_LIGHT, Spacing, View,
    Window,
};

/// Seconds from one radar frame of HIBER to the next; two make a frame of its annotations.
pub const HIBER_FRAME_S: f64 = 0.05;
/// Cells of HIBER's maps, rows and columns, and their side, m.
pub(super) const HIBER_CELLS: [usize; 2] = [160, 200];
pub(super) const HIBER_CELL_M: f64 = 0.05;
/// z, y, x bins of RT-Pose's cubes, and the first and one past the last coordinate of each, m.
pub(super) const RT_POSE_CUBE: [(AxisKind, usize, f64, f64); 3] =
    [(AxisKind::Z, 32, -5.8, 5.8), (AxisKind::Y, 128, -10.05, 10.05), (AxisKind::X, 256, 0.0, 11.6)];

/// Receivers along the board, half waves.
const RX: [f64; 16] = [11.0, 12.0, 13.0, 14.0, 50.0, 51.0, 52.0, 53.0, 46.0, 47.0, 48.0, 49.0, 0.0, 1.0, 2.0, 3.0];
/// Transmitters along and above it, half waves, in the order in which they send.
const TX: [(f64, f64); 12] = [
    (11.0, 6.0),
    (10.0, 4.0),
    (9.0, 1.0),
    (32.0, 0.0),
    (28.0, 0.0),
    (24.0, 0.0),
    (20.0, 0.0),
    (16.0, 0.0),
    (12.0, 0.0),
    (8.0, 0.0),
    (4.0, 0.0),
    (0.0, 0.0),
];
/// Elements of the line.
const LINE: usize = 86;
/// Of rows at heights of 0, 1, 4 and 6 half waves so many would make an even line as long.
const ROW_SPAN: usize = 7;

/// The array about the middle of its line; y grows along the board.
fn array(spacing_m: f64) -> MimoArray {
    let at = |along: f64, up: f64| -> Vec3 { [0.0, along * spacing_m, up * spacing_m] };
    MimoArray {
        tx: TX.iter().map(|&(along, up)| at(along - 16.0, up)).collect(),
        rx: RX.iter().map(|&along| at(along - 26.5, 0.0)).collect(),
    }
}

/// About x: y becomes z.
const QUARTER: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]];

/// Two cascades, one along y at 77 GHz and one along z at 79 GHz: 38.5 MHz/µs, 256 samples at 8 Msps, chirps of 45 µs.
pub(super) fn hiber() -> Vec<Radar> {
    let of = |name, start_hz: f64| {
        let chirp_s = 256.0 / 8e6;
        let bandwidth_hz = 38.5e12 * chirp_s;
        let spacing_m = SPEED_OF_LIGHT / (start_hz + bandwidth_hz / 2.0) / 2.0;
        let radar = RadarConfig {
            start_hz,
            bandwidth_hz,
            chirp_s,
            frame_s: 12.0 * 45e-6,
            r_max_m: 12.0,
            l_az_m: spacing_m,
            l_el_m: spacing_m,
            doppler_features: 32,
            height_m: None,
        };
        let chain = Chain {
            range_window: Window::Rectangular,
            range_fft: 1024,
            doppler_window: Window::Rectangular,
            doppler_fft: 1,
            angle_window: Window::Rectangular,
            angle_fft: 256,
            still_share: 1.0,
            max_range_m: 13.0,
        };
        let array = if name == "vert" { array(spacing_m).turned(&QUARTER) } else { array(spacing_m) };
        Radar { name, fmcw: Fmcw { radar, samples: 256, loops: 1, array }, spacing_m, chain }
    };
    vec![of("hori", 77e9), of("vert", 79e9)]
}

/// Widths of a map of HIBER: they follow from samples, line and chirp.
pub(super) fn hiber_setup(radar: &Radar) -> FftSetup {
    let along = |name| (radar.name == name).then_some((LINE, radar.chain.angle_window));
    FftSetup {
        range: (radar.fmcw.samples, radar.chain.range_window),
        doppler: (1, Window::Rectangular),
        azimuth: along("hori"),
        elevation: along("vert"),
    }
}

/// The channels of the line of 86, in its order.
fn line() -> Vec<usize> {
    row(0.0).into_iter().map(|(_, channel)| channel).collect()
}

/// The channels of the elements at a height, half waves: place along the board and channel; of several at one place the first.
fn row(height: f64) -> Vec<(usize, usize)> {
    let mut elements: Vec<(usize, usize)> = Vec::new();
    for (tx, &(along, _)) in TX.iter().enumerate().filter(|(_, (_, up))| *up == height) {
        for (rx, &receiver) in RX.iter().enumerate() {
            let place = (along + receiver) as usize;
            if elements.iter().all(|(known, _)| *known != place) {
                elements.push((place, tx * RX.len() + rx));
            }
        }
    }
    elements.sort_unstable();
    elements
}

/// The maps of the radar frames of an annotation, from these and the one before them: each less the one before it. Of one alone
/// nothing is taken away.
pub(super) fn hiber_planes(radar: &Radar, view: &View, frames: &[AdcCube]) -> Vec<Vec<f64>> {
    let [depth, lateral] = &view.axes[..] else { return Vec::new() };
    let of = |adc: &AdcCube| {
        let spectra = radar.chain.range_doppler(&radar.fmcw, adc).of_channels(&line());
        radar.chain.polar_of(&radar.fmcw, radar.spacing_m, &spectra).cartesian(depth, lateral)
    };
    let less = |now: &AdcCube, before: &AdcCube| AdcCube {
        data: now.data.iter().zip(&before.data).map(|(now, before)| now - before).collect(),
        ..*now
    };
    match frames {
        [alone] => vec![of(alone)],
        frames => frames.windows(2).map(|pair| of(&less(&pair[1], &pair[0]))).collect(),
    }
}

/// The map of planes: the root of their mean power.
pub(super) fn root_mean_square(planes: &[Vec<f64>]) -> Vec<f64> {
    let cells = planes.first().map_or(0, Vec::len);
    let power = |cell: usize| planes.iter().filter_map(|plane| plane.get(cell)).map(|h| h * h).sum::<f64>();
    (0..cells).map(|cell| (power(cell) / planes.len().max(1) as f64).sqrt()).collect()
}

/// One cascade that sends sixteen chirps a transmitter and frame.
pub(super) fn rt_pose() -> Vec<Radar> {
    let (samples, loops) = (256, 16);
    let range_step_m = 11.6 / 256.0;
    let bandwidth_hz = SPEED_OF_LIGHT / (2.0 * range_step_m);
    let spacing_m = SPEED_OF_LIGHT / (77e9 + bandwidth_hz / 2.0) / 2.0;
    let radar = RadarConfig {
        start_hz: 77e9,
        bandwidth_hz,
        chirp_s: 32e-6,
        frame_s: loops as f64 * 12.0 * 40e-6,
        r_max_m: 12.0,
        l_az_m: spacing_m,
        l_el_m: spacing_m,
        doppler_features: 32,
        height_m: None,
    };
    let chain = Chain {
        range_window: Window::Hann,
        range_fft: samples,
        doppler_window: Window::Hann,
        doppler_fft: loops,
        angle_window: Window::Rectangular,
        angle_fft: 128,
        still_share: 1.0,
        max_range_m: 11.6,
    };
    vec![Radar { name: "hori", fmcw: Fmcw { radar, samples, loops, array: array(spacing_m) }, spacing_m, chain }]
}

/// Widths of a cube of RT-Pose.
pub(super) fn rt_pose_setup(radar: &Radar) -> FftSetup {
    FftSetup {
        range: (radar.fmcw.samples, radar.chain.range_window),
        doppler: (radar.fmcw.loops, radar.chain.doppler_window),
        azimuth: Some((LINE, Window::Rectangular)),
        elevation: Some((ROW_SPAN, Window::Rectangular)),
    }
}

/// A cube of RT-Pose: amplitudes, z, y, x.
pub(super) fn rt_pose_cube(radar: &Radar, view: &View, chain: &Chain, adc: &AdcCube) -> Vec<f64> {
    let [z, y, x] = &view.axes[..] else { return Vec::new() };
    let rows = PlanarRows::of(&radar.fmcw.array, radar.spacing_m, radar.fmcw.radar.wavelength_m());
    rows.map_or_else(Vec::new, |rows| rows.map(&chain.range_doppler(&radar.fmcw, adc)).cartesian([z, y, x]))
}

/// The bounds of HIBER's maps: outer edges along the rows, far first, and along the columns.
pub(super) fn hiber_axes(depth: AxisKind, across: AxisKind) -> Vec<Axis> {
    let axis = |kind, bins: usize, first: f64| {
        let lo = first - 0.5 * HIBER_CELL_M;
        Axis { kind, bins, lo, hi: lo - bins as f64 * HIBER_CELL_M, spacing: Spacing::Linear }
    };
    vec![axis(depth, HIBER_CELLS[0], 8.0), axis(across, HIBER_CELLS[1], 5.0)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nine_transmitters_make_a_whole_line_of_86() {
        let elements = row(0.0);
        assert_eq!(elements.iter().map(|(place, _)| *place).collect::<Vec<_>>(), (0..LINE).collect::<Vec<_>>());
        assert!([1.0, 4.0, 6.0].iter().all(|&height| row(height).len() == 16));
        let spacing_m = 0.0019;
        let array = array(spacing_m);
        let places: Vec<f64> = line().into_iter().map(|c| array.tx[c / 16][1] + array.rx[c % 16][1]).collect();
        assert!((places[0] + places[85]).abs() < 1e-12, "about the origin");
        assert!(places.windows(2).all(|pair| (pair[1] - pair[0] - spacing_m).abs() < 1e-12));
    }
}
