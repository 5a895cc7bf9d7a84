//! What stands before the radars of the sample: the walker, the room, the two arrays and their receivers.

use crate::body::{BodySurface, Walker};
use crate::geometry::Vec3;
use crate::radar::{
    Axis, AxisKind, Chain, FftSetup, Fmcw, LinearArray, PointSpread, RadarConfig, Receiver, Scatterer, Spacing, Window,
};
use num_complex::Complex64;
use rand::{Rng, SeedableRng, rngs::StdRng};
use rand_distr::StandardNormal;

/// Frames a second.
pub const FRAME_RATE_HZ: f64 = 10.0;
const SAMPLES: usize = 256;
const CHIRPS: usize = 64;
const ELEMENTS: usize = 24;
const SPACING_M: f64 = 0.0019;
const SKIN_POINTS: usize = 700;
/// Taper over the elements: level sidelobes, as a calibrated array leaves them.
const ANGLE_WINDOW: Window = Window::Chebyshev { sidelobe_db: 30.0 };

/// Windows and FFT lengths of both arrays. What stands still is attenuated to 0.3 (−10 dB), not removed: rooms stay visible, as
/// in MMVR's maps, and the walker stands out.
pub const CHAIN: Chain = Chain {
    range_window: Window::Hann,
    range_fft: 1024,
    doppler_window: Window::Hann,
    doppler_fft: 64,
    angle_window: ANGLE_WINDOW,
    angle_fft: 256,
    still_share: 0.3,
    max_range_m: 9.5,
};

/// Noise that leaves the walker's peak 17 to 40 dB above the median of the map (measured on the 32 frames of seed 7); a full scale
/// that nothing exceeds where the walker is nearest.
const RECEIVER: Receiver = Receiver { noise: 0.1, full_scale: 2.0, bits: 12 };

/// The chirp of both radars.
pub fn radar() -> RadarConfig {
    RadarConfig {
        start_hz: 77e9,
        bandwidth_hz: 3e9,
        chirp_s: 60e-6,
        frame_s: 0.0128,
        r_max_m: 12.0,
        l_az_m: SPACING_M,
        l_el_m: SPACING_M,
        doppler_features: 32,
    }
}

/// The two arrays, and so the two maps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Plane {
    /// Elements along y: depth_h × y.
    Horizontal,
    /// Elements along z: depth_v × z.
    Vertical,
}

impl Plane {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Horizontal, Self::Vertical];

    /// The key of the map in a frame's npz.
    pub fn array(self) -> &'static str {
        match self {
            Self::Horizontal => "hm_hori",
            Self::Vertical => "hm_vert",
        }
    }

    /// Chirp, samples and elements.
    pub fn fmcw(self) -> Fmcw {
        let direction = match self {
            Self::Horizontal => [0.0, 1.0, 0.0],
            Self::Vertical => [0.0, 0.0, 1.0],
        };
        let array = LinearArray { direction, elements: ELEMENTS, spacing_m: SPACING_M };
        Fmcw { radar: radar(), samples: SAMPLES, chirps: CHIRPS, array }
    }

    /// Depth from 8 m down to the radar; across, 2.5 m left to 2.5 m right, or 2 m down to 3 m up. Pixel centres half a
    /// step from the edges, like MMVR's.
    pub fn axes(self) -> [Axis; 2] {
        let cells = |kind, bins: usize, from: f64, to: f64| {
            let half = (to - from) / bins as f64 / 2.0;
            Axis { kind, bins, lo: from + half, hi: to + half, spacing: Spacing::Linear }
        };
        match self {
            Self::Horizontal => [cells(AxisKind::DepthH, 256, 8.0, 0.0), cells(AxisKind::Y, 128, 2.5, -2.5)],
            Self::Vertical => [cells(AxisKind::DepthV, 256, 8.0, 0.0), cells(AxisKind::Z, 128, -2.0, 3.0)],
        }
    }

    /// The point-spread widths that follow from the FFT set-up.
    pub fn point_spread(self) -> PointSpread {
        let line = Some((ELEMENTS, ANGLE_WINDOW));
        FftSetup {
            range: (SAMPLES, CHAIN.range_window),
            doppler: (CHIRPS, CHAIN.doppler_window),
            azimuth: line.filter(|_| self == Self::Horizontal),
            elevation: line.filter(|_| self == Self::Vertical),
        }
        .point_spread(&radar())
    }

    /// The Cartesian map of a frame of ADC samples, row-major.
    pub fn map(self, adc: &crate::radar::AdcCube) -> Vec<f64> {
        let [depth, lateral] = self.axes();
        CHAIN.polar(&self.fmcw(), adc).cartesian(&depth, &lateral)
    }
}

/// One frame: the truth at its middle, and the maps in the order of [`Plane::ALL`].
#[derive(Debug, Clone, PartialEq)]
pub struct SampleFrame {
    /// Seconds from the first frame.
    pub timestamp_s: f64,
    /// COCO joints, m, world frame.
    pub joints: [Vec3; 17],
    /// m/s.
    pub velocities: [Vec3; 17],
    /// 256 × 128 amplitudes each, in steps of the converter times the FFTs' gain.
    pub maps: [Vec<f64>; 2],
    /// Share of the ADC's I and Q values that clipped.
    pub clipped: f64,
}

/// Everything that a seed decides.
#[derive(Debug, Clone)]
pub struct Scene {
    /// Who walks.
    pub walker: Walker,
    skin: BodySurface,
    room: Vec<Scatterer>,
    seed: u64,
}

impl Scene {
    /// The scene of a seed: its skin, its room and its noise.
    pub fn new(seed: u64) -> Self {
        let walker = Walker::default();
        let skin = BodySurface::new(&walker, SKIN_POINTS, &mut generator(seed, 0));
        Self { walker, skin, room: room(&mut generator(seed, 1)), seed }
    }

    /// Synthesises frame `index`; frames are independent of each other and of the order they are made in.
    pub fn frame(&self, index: usize) -> SampleFrame {
        let t = index as f64 / FRAME_RATE_HZ;
        let mut clipped = 0.0;
        let maps = Plane::ALL.map(|plane| {
            let fmcw = plane.fmcw();
            let mut adc = fmcw.synthesise(&self.room, |dt| self.body_at(t + dt));
            let mut noise = generator(self.seed, 2 + 2 * index as u64 + plane as u64);
            let count = adc.digitise(&RECEIVER, &mut noise);
            clipped += count as f64 / (4 * adc.data.len()) as f64;
            plane.map(&adc)
        });
        let (joints, velocities) = (self.walker.pose(t).joints, self.walker.velocities(t));
        SampleFrame { timestamp_s: t, joints, velocities, maps, clipped }
    }

    fn body_at(&self, t: f64) -> Vec<Scatterer> {
        let seen = self.skin.seen(&self.walker.pose(t));
        seen.into_iter().map(|(position, reflectivity)| Scatterer { position, reflectivity }).collect()
    }
}

/// A generator of its own for each purpose, so that adding one thing does not change another.
fn generator(seed: u64, purpose: u64) -> StdRng {
    StdRng::seed_from_u64(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15).wrapping_add(purpose))
}

/// Back wall, side wall on the left, a metal shelf behind on the right, the edge of a table on the right. Units of the
/// amplitudes: the echo at 1 m.
fn room(rng: &mut StdRng) -> Vec<Scatterer> {
    let mut points = Vec::new();
    let mut surface = |from: Vec3, to: Vec3, counts: [usize; 3], amplitude: f64| {
        for cell in 0..counts[0] * counts[1] * counts[2] {
            let index = [cell % counts[0], cell / counts[0] % counts[1], cell / (counts[0] * counts[1])];
            let mut place = |k: usize| {
                let share = (index[k] as f64 + rng.random_range(0.0..1.0)) / counts[k] as f64;
                from[k] + (to[k] - from[k]) * share
            };
            let position = [place(0), place(1), place(2)];
            let speckle = Complex64::new(rng.sample(StandardNormal), rng.sample(StandardNormal));
            points.push(Scatterer { position, reflectivity: speckle * (amplitude / 2f64.sqrt()) });
        }
    };
    surface([6.20, -3.0, -1.0], [6.23, 3.0, 1.5], [1, 40, 10], 0.9);
    surface([0.8, 2.30, -1.0], [6.2, 2.33, 1.5], [36, 1, 5], 0.12);
    surface([5.0, -2.0, -1.0], [5.3, -1.3, 0.9], [2, 4, 6], 0.6);
    surface([3.0, -1.92, -0.28], [3.8, -1.90, -0.25], [24, 1, 1], 0.15);
    points
}
