//! What can be typed after `simulate`.

use crate::simulate::{Action, Options, ScenePreset, SimulatedLayout};
use anyhow::Context as _;
use clap::ValueEnum;
use std::fmt::Write as _;
use std::ops::RangeInclusive;
use std::path::PathBuf;

/// Shown under the options of `simulate --help`.
pub const HELP: &str = "\
Presets: easy, medium, hard rise in distance, clutter and noise and fall in motion; f1 static reflectors, f2 near field, f3 people \
side by side, f4 people who stand still. Sequences take the presets in turn.

Examples:
  mhp-inspector simulate data/train --preset easy,medium,hard --frames 600 --seed 42
      600 frames with one person, in sequences of 20, as two Cartesian maps.
  mhp-inspector simulate data/crowd --people 0..=4 --frames 5000 --preset medium
      Nobody to four people, drawn anew for each sequence.
  mhp-inspector simulate data/pairs --people 2..=3 --action walk --preset easy
      Two or three people who walk, 0.6 to 2 m apart.
  mhp-inspector simulate data/hupr --layout hupr --frames 40
      HuPR's folders and cubes.
  mhp-inspector simulate data/hiber --layout hiber --frames 200 --sequence-length 50
      HIBER's tree, and where each environment's radars stand; `calibrate-room data/hiber` finds it again.
  mhp-inspector simulate data/worst --preset hard --bits 16 --noise-db 6 --still-share 1
      A better converter, twice the noise, walls not attenuated.";

/// Write a synthetic data set with truth: people and rooms before an FMCW radar, from scatterers to ADC samples to maps.
#[derive(Debug, clap::Args)]
pub struct SimulateArgs {
    /// Folder to write into; it is made if it does not exist.
    pub out: PathBuf,
    /// Whose maps and files.
    #[arg(long, value_enum, default_value_t = LayoutArg::Mmvr)]
    pub layout: LayoutArg,
    /// Scenarios, separated by commas; sequences take them in turn.
    #[arg(long, value_enum, value_delimiter = ',', default_value = "easy")]
    pub preset: Vec<PresetArg>,
    /// Frames in all.
    #[arg(long, default_value_t = 100)]
    pub frames: usize,
    /// Frames a sequence: one body, room and motion.
    #[arg(long, default_value_t = 20)]
    pub sequence_length: usize,
    /// People: a number, or a range such as 0..=4 to draw from for each sequence; without it, the preset's own number.
    #[arg(long, value_name = "N", value_parser = people)]
    pub people: Option<RangeInclusive<usize>>,
    /// What they do, separated by commas; without it, the preset's own mixture (hiber: they walk, as in its WALK).
    #[arg(long, value_enum, value_delimiter = ',')]
    pub action: Vec<ActionArg>,
    /// Seed of everything; the same seed gives the same bytes.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Bits of the converter: 12, 14 or 16.
    #[arg(long, default_value_t = 12)]
    pub bits: u32,
    /// What is kept of the echo of all that stands still, 0 to 1; without it, the preset's own share.
    #[arg(long, value_name = "SHARE")]
    pub still_share: Option<f64>,
    /// Echoes by way of walls and floor; without it, as the preset has them.
    #[arg(long, value_name = "BOOL")]
    pub multipath: Option<bool>,
    /// People hide what stands still behind them.
    #[arg(long)]
    pub shadows: bool,
    /// Name of the data set; without it, layout and presets.
    #[arg(long)]
    pub name: Option<String>,
    /// Store complex64 instead of complex128 (hupr), float16 instead of float32 (xrf55-stack, rt-pose), float32 instead of
    /// float64 (hiber): half the bytes.
    #[arg(long)]
    pub narrow: bool,
    /// More (or less) thermal noise than the preset has, dB.
    #[arg(long, value_name = "DB", default_value_t = 0.0, allow_negative_numbers = true)]
    pub noise_db: f64,
    /// One room for all sequences of a preset, drawn from this seed: a scene, which the manifest names. Without it each sequence has
    /// a room of its own.
    #[arg(long, value_name = "S")]
    pub room_seed: Option<u64>,
    /// Height of the radar above the floor, m, which the manifest tells; `any` draws one for each sequence, untold.
    #[arg(long, value_name = "M", default_value = "1", value_parser = radar_height)]
    pub radar_height: RadarHeight,
}

/// Metres; `None` is `any`.
#[derive(Debug, Clone, Copy)]
pub struct RadarHeight(pub Option<f64>);

fn radar_height(text: &str) -> Result<RadarHeight, String> {
    if text == "any" {
        return Ok(RadarHeight(None));
    }
    let height_m = text.parse().map_err(|_| format!("`{text}` is neither a number of metres nor `any`"))?;
    Ok(RadarHeight(Some(height_m)))
}

/// A layout as typed.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum LayoutArg {
    /// Two Cartesian maps as MMVR's, one npz a frame.
    Mmvr,
    /// MMVR's own folders and label files.
    MmvrTree,
    /// HuPR's folders of complex cubes.
    Hupr,
    /// Range × angle and range × Doppler of XRF55's radar, one npz a frame.
    Xrf55,
    /// XRF55's published stacks.
    Xrf55Stack,
    /// Polar maps with a Doppler axis, one npz a frame.
    Generic,
    /// HIBER's tree of Cartesian maps, with joints in the room's frame.
    Hiber,
    /// RT-Pose's Cartesian cubes, with joints in the radar's frame.
    RtPose,
}

impl From<LayoutArg> for SimulatedLayout {
    fn from(typed: LayoutArg) -> Self {
        match typed {
            LayoutArg::Mmvr => Self::Mmvr,
            LayoutArg::MmvrTree => Self::MmvrTree,
            LayoutArg::Hupr => Self::Hupr,
            LayoutArg::Xrf55 => Self::Xrf55,
            LayoutArg::Xrf55Stack => Self::Xrf55Stack,
            LayoutArg::Generic => Self::Generic,
            LayoutArg::Hiber => Self::Hiber,
            LayoutArg::RtPose => Self::RtPose,
        }
    }
}

/// A preset as typed.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum PresetArg {
    Easy,
    Medium,
    Hard,
    F1,
    F2,
    F3,
    F4,
}

impl From<PresetArg> for ScenePreset {
    fn from(typed: PresetArg) -> Self {
        match typed {
            PresetArg::Easy => Self::Easy,
            PresetArg::Medium => Self::Medium,
            PresetArg::Hard => Self::Hard,
            PresetArg::F1 => Self::F1,
            PresetArg::F2 => Self::F2,
            PresetArg::F3 => Self::F3,
            PresetArg::F4 => Self::F4,
        }
    }
}

/// An action as typed.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum ActionArg {
    Walk,
    Turn,
    Sit,
    Raise,
    Stand,
    Fall,
}

impl From<ActionArg> for Action {
    fn from(typed: ActionArg) -> Self {
        match typed {
            ActionArg::Walk => Self::Walk,
            ActionArg::Turn => Self::Turn,
            ActionArg::Sit => Self::Sit,
            ActionArg::Raise => Self::Raise,
            ActionArg::Stand => Self::Stand,
            ActionArg::Fall => Self::Fall,
        }
    }
}

/// `2`, `0..=4` or `0..5`.
fn people(text: &str) -> Result<RangeInclusive<usize>, String> {
    let fault = || format!("`{text}` is no number of people; expected a number such as 1, or a range such as 0..=4");
    let number = |text: &str| text.trim().parse::<usize>().map_err(|_| fault());
    let range = if let Some((low, high)) = text.split_once("..=") {
        number(low)?..=number(high)?
    } else if let Some((low, high)) = text.split_once("..") {
        number(low)?..=number(high)?.checked_sub(1).ok_or_else(fault)?
    } else {
        let one = number(text)?;
        one..=one
    };
    if range.is_empty() { Err(fault()) } else { Ok(range) }
}

impl SimulateArgs {
    /// As the library takes it.
    ///
    /// # Errors
    /// Where a number makes no sense.
    pub fn options(&self) -> anyhow::Result<Options> {
        let options = Options {
            layout: self.layout.into(),
            presets: self.preset.iter().map(|&preset| preset.into()).collect(),
            frames: self.frames,
            sequence_length: self.sequence_length,
            people: self.people.clone(),
            actions: self.action.iter().map(|&action| action.into()).collect(),
            seed: self.seed,
            bits: self.bits,
            still_share: self.still_share,
            multipath: self.multipath,
            shadows: self.shadows,
            noise_db: self.noise_db,
            room_seed: self.room_seed,
            radar_height_m: self.radar_height.0,
        };
        options.check().context("simulate")?;
        Ok(options)
    }

    /// The command that makes the data set again, without the folder.
    pub fn typed(&self) -> String {
        let words = |words: Vec<&str>| words.join(",");
        let mut text = format!(
            "mhp-inspector simulate DIR --layout {} --preset {} --frames {} --sequence-length {}",
            SimulatedLayout::from(self.layout).word(),
            words(self.preset.iter().map(|&preset| ScenePreset::from(preset).word()).collect()),
            self.frames,
            self.sequence_length
        );
        // Writing to a text does not fail.
        if let Some(people) = &self.people {
            let _ = write!(text, " --people {}..={}", people.start(), people.end());
        }
        if !self.action.is_empty() {
            let _ = write!(text, " --action {}", words(self.action.iter().map(|&a| Action::from(a).word()).collect()));
        }
        if let Some(share) = self.still_share {
            let _ = write!(text, " --still-share {share}");
        }
        if let Some(multipath) = self.multipath {
            let _ = write!(text, " --multipath {multipath}");
        }
        if self.shadows {
            text.push_str(" --shadows");
        }
        if self.noise_db != 0.0 {
            let _ = write!(text, " --noise-db {}", self.noise_db);
        }
        if let Some(seed) = self.room_seed {
            let _ = write!(text, " --room-seed {seed}");
        }
        match self.radar_height.0 {
            None => text.push_str(" --radar-height any"),
            Some(1.0) => {}
            Some(height_m) => {
                let _ = write!(text, " --radar-height {height_m}");
            }
        }
        if let Some(name) = &self.name {
            let _ = write!(text, " --name {name}");
        }
        if self.narrow {
            text.push_str(" --narrow");
        }
        let _ = write!(text, " --bits {} --seed {}", self.bits, self.seed);
        text
    }
}
