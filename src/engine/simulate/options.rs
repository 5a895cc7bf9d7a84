//! What is asked of the synthetic source.

use super::ScenePreset;
use std::ops::RangeInclusive;

/// People in a scene at most: the counter tells up to four.
const MOST_PEOPLE: usize = 4;

/// Whose maps are imitated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SimulatedLayout {
    /// Two Cartesian maps as MMVR's, the bounds symmetric about boresight, in an npz with a manifest; 10 frames a second.
    Mmvr,
    /// MMVR's own bounds and folders, with labels in the camera's pixels; 15 frames a second.
    MmvrTree,
    /// HuPR's cubes: `hori` and `vert`, (16, 64, 64, 8) complex, 10 frames a second.
    Hupr,
    /// XRF55's radar: range × angle and range × Doppler, 20 frames a second.
    Xrf55,
    /// XRF55's published stacks, (17, 256, 128) real a file: taken for 17 maps of range × angle in five
    /// seconds.
    Xrf55Stack,
    /// Polar maps: range × cone angle × Doppler, and range × elevation; 10 frames a second.
    Generic,
    /// HIBER's tree: two Cartesian maps (2, 160, 200), static echoes subtracted, joints in the room's frame; 10 frames a second
    /// of two radar frames each.
    Hiber,
    /// RT-Pose's Cartesian cubes (32, 128, 256), joints in the radar's frame; 10 frames a second.
    RtPose,
}

impl SimulatedLayout {
    /// All.
    pub const ALL: [Self; 8] = [
        Self::Mmvr,
        Self::MmvrTree,
        Self::Hupr,
        Self::Xrf55,
        Self::Xrf55Stack,
        Self::Generic,
        Self::Hiber,
        Self::RtPose,
    ];

    /// The word on the command line.
    pub fn word(self) -> &'static str {
        match self {
            Self::Mmvr => "mmvr",
            Self::MmvrTree => "mmvr-tree",
            Self::Hupr => "hupr",
            Self::Xrf55 => "xrf55",
            Self::Xrf55Stack => "xrf55-stack",
            Self::Generic => "generic",
            Self::Hiber => "hiber",
            Self::RtPose => "rt-pose",
        }
    }

    /// The layout of its files, as a data set's manifest says it.
    pub fn files(self) -> &'static str {
        match self {
            Self::Mmvr | Self::Xrf55 | Self::Generic => "npz",
            Self::MmvrTree => "mmvr",
            Self::Hupr => "hupr",
            Self::Xrf55Stack => "xrf55",
            Self::Hiber => "hiber",
            Self::RtPose => "rt_pose",
        }
    }

    /// Frames a second.
    pub fn frame_rate_hz(self) -> f64 {
        match self {
            Self::Mmvr | Self::Hupr | Self::Generic | Self::Hiber | Self::RtPose => 10.0,
            Self::MmvrTree => 15.0,
            Self::Xrf55 => 20.0,
            Self::Xrf55Stack => 3.4,
        }
    }

    /// What people do, where nothing is asked for and the preset's mixture is not what such a data set shows: of HIBER's categories
    /// `WALK` is written.
    pub(super) fn actions(self) -> Option<Vec<Action>> {
        (self == Self::Hiber).then(|| vec![Action::Walk])
    }

    /// Left and right end of where people may be, y in m.
    pub(super) fn lateral_m(self) -> [f64; 2] {
        match self {
            Self::MmvrTree => [-3.4, 0.9],
            _ => [-2.2, 2.2],
        }
    }
}

/// What people do, where a preset's own mixture is not wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[expect(missing_docs, reason = "the names say it; `body::Motion` has the details")]
pub enum Action {
    Walk,
    Turn,
    Sit,
    Raise,
    Stand,
    Fall,
}

impl Action {
    /// All.
    pub const ALL: [Self; 6] = [Self::Walk, Self::Turn, Self::Sit, Self::Raise, Self::Stand, Self::Fall];

    /// The word on the command line.
    pub fn word(self) -> &'static str {
        match self {
            Self::Walk => "walk",
            Self::Turn => "turn",
            Self::Sit => "sit",
            Self::Raise => "raise",
            Self::Stand => "stand",
            Self::Fall => "fall",
        }
    }
}

/// Everything that decides a recording. Two recordings of equal options are equal in every number.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Whose maps.
    pub layout: SimulatedLayout,
    /// Scenarios; the sequences take them in turn.
    pub presets: Vec<ScenePreset>,
    /// Frames in all.
    pub frames: usize,
    /// Frames a sequence; the last one may be shorter.
    pub sequence_length: usize,
    /// People a sequence, drawn evenly; `None` is the preset's own number.
    pub people: Option<RangeInclusive<usize>>,
    /// What they do, drawn evenly; empty is the preset's own mixture (HIBER's people walk).
    pub actions: Vec<Action>,
    /// Seed of everything.
    pub seed: u64,
    /// Bits of the converter, sign included.
    pub bits: u32,
    /// What is kept of the echo of all that stands still; `None` is the preset's own.
    pub still_share: Option<f64>,
    /// Echoes by way of walls and floor; `None` is the preset's own.
    pub multipath: Option<bool>,
    /// Whether people hide what stands still behind them.
    pub shadows: bool,
    /// More thermal noise than the preset has, dB.
    pub noise_db: f64,
    /// One room for all sequences of a preset, drawn from this; without it each sequence has a room of its own.
    pub room_seed: Option<u64>,
    /// Height of the radar above the floor, m; `None` draws one for each sequence, 0.9 to 1.1.
    pub radar_height_m: Option<f64>,
}

impl Default for Options {
    /// 20 frames of an easy scene with one person, MMVR-like.
    fn default() -> Self {
        Self {
            layout: SimulatedLayout::Mmvr,
            presets: vec![ScenePreset::Easy],
            frames: 20,
            sequence_length: 20,
            people: None,
            actions: Vec::new(),
            seed: 1,
            bits: 12,
            still_share: None,
            multipath: None,
            shadows: false,
            noise_db: 0.0,
            room_seed: None,
            radar_height_m: None,
        }
    }
}

/// Why nothing can be simulated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SimulateError {
    /// A number outside its range.
    #[error("{name} is {value}; expected {expected}")]
    OutOfRange {
        /// Which.
        name: &'static str,
        /// As asked for.
        value: String,
        /// What would do.
        expected: &'static str,
    },
}

impl Options {
    /// Checks the ranges.
    ///
    /// # Errors
    /// Names the first number that makes no sense.
    pub fn check(&self) -> Result<(), SimulateError> {
        let out = |name, value: String, expected| Err(SimulateError::OutOfRange { name, value, expected });
        if self.frames == 0 || self.frames > 1_000_000 {
            return out("frames", self.frames.to_string(), "1 to 1000000");
        }
        if self.sequence_length == 0 {
            return out("sequence length", "0".into(), "1 or more");
        }
        if self.presets.is_empty() {
            return out("presets", "empty".into(), "at least one");
        }
        if let Some(people) = self.people.as_ref().filter(|p| p.is_empty() || *p.end() > MOST_PEOPLE) {
            return out("people", format!("{}..={}", people.start(), people.end()), "a number or a range within 0..=4");
        }
        if ![12, 14, 16].contains(&self.bits) {
            return out("bits", self.bits.to_string(), "12, 14 or 16");
        }
        if let Some(share) = self.still_share.filter(|share| !(0.0..=1.0).contains(share)) {
            return out("still share", share.to_string(), "0 to 1");
        }
        if let Some(height_m) = self.radar_height_m.filter(|height_m| !(0.3..=3.0).contains(height_m)) {
            return out("radar height", height_m.to_string(), "0.3 to 3 m");
        }
        if !(-40.0..=40.0).contains(&self.noise_db) {
            return out("noise", self.noise_db.to_string(), "-40 to 40 dB");
        }
        Ok(())
    }

    /// Sequences in all.
    pub fn sequences(&self) -> usize {
        self.frames.div_ceil(self.sequence_length.max(1))
    }
}
