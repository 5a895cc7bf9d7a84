//! Raw captures of a radar's converter: which bytes belong to the signal, what they are, and the maps that the FFT chain
//! makes of them, a frame when it is asked for.
//!
//! ```text
//! file (.bin, .pcap) ──▶ Payload: bytes of the converter ──▶ decode: samples (loop, channel, sample) ──▶ Chain ──▶ maps
//! .cfg, .mmwave.json ──▶ AdcSettings ────────────────────────▲
//! ```
//!
//! Files, orders and keys: `notes/datasets.md` section 5. Nothing is held of a capture but where its packets are.

mod decode;
mod payload;
mod source;
mod stages;
mod studio;
mod ti_cfg;

use decode::number;
pub use decode::{IqOrder, decode};
pub use payload::{Gaps, Payload};
pub use source::{CubeOrder, SampleSource};
pub(in crate::dataset) use source::{cascade_of, chip_of, is_npy};
pub use stages::{ChainStages, StageLimit, limits};
pub use studio::parse_studio;
pub use ti_cfg::parse_cfg;

use crate::radar::ChirpSettings;
use serde::{Deserialize, Serialize};

/// How the converter's words follow each other in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WordOrder {
    /// LVDS lanes: 2 puts two I before two Q, a receiver after the other; 4 puts all receivers' I of a sample before their Q.
    pub lanes: usize,
    /// Whether samples are complex; else only I is there, a receiver after the other.
    pub complex: bool,
    /// What comes first of a complex sample; `None` where the first frame is to tell.
    pub iq: Option<IqOrder>,
    /// Bits of the converter: 12, 14 or 16.
    pub bits: u32,
    /// Whether 0 is the middle of the converter's range, instead of two's complement.
    pub offset_binary: bool,
}

impl Default for WordOrder {
    /// What most captures are: two lanes, complex, 16 bits.
    fn default() -> Self {
        Self { lanes: 2, complex: true, iq: None, bits: 16, offset_binary: false }
    }
}

/// What a configuration file says of a capture.
#[derive(Debug, Clone, PartialEq)]
pub struct AdcSettings {
    /// Its chirps.
    pub chirp: ChirpSettings,
    /// How its words follow each other.
    pub words: WordOrder,
}

impl AdcSettings {
    /// Bytes of a frame.
    pub fn frame_bytes(&self) -> u64 {
        let chirp = &self.chirp;
        let parts = if self.words.complex { 2 } else { 1 };
        2 * parts * (chirp.samples * chirp.rx * chirp.tx.len() * chirp.loops) as u64
    }
}

/// The transmitters of a chirp's mask, one bit each; more than one bit is all of them at once.
fn transmitter(mask: u32) -> Result<usize, String> {
    match mask.count_ones() {
        1 => Ok(mask.trailing_zeros() as usize),
        0 => Err("no transmitter is on in a chirp; expected one".into()),
        n => Err(format!("{n} transmitters send at once in a chirp; expected one after the other (TDM)")),
    }
}

/// The table `[capture]` of a manifest: what no configuration file says, or says wrongly; all of it may be left out.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AdcText {
    /// The configuration, relative to the folder: a `.cfg` or a `.mmwave.json`; else the one beside the capture.
    pub config: Option<String>,
    /// Its chirps, where there is no such file.
    pub chirp: Option<ChirpText>,
    /// `isk`, `line` or `cascade`: where the antennas are.
    pub board: Option<String>,
    /// `flat`, or `upright` where the board stands on its side and its line of antennas measures height.
    pub mount: Option<String>,
    /// `i_first` or `q_first`; else the first frame tells.
    pub iq: Option<String>,
    /// LVDS lanes: 2 or 4.
    pub lanes: Option<usize>,
    /// Whether samples are complex.
    pub complex: Option<bool>,
    /// Bits of the converter: 12, 14 or 16.
    pub bits: Option<u32>,
    /// Whether 0 is the middle of the converter's range.
    pub offset_binary: Option<bool>,
    /// Whether the mean over the chirps of a frame, the echo of what stands still, is taken away; so it is where nothing is
    /// said.
    pub remove_static: Option<bool>,
    /// A window's name, over samples and chirps; or `{ range = …, doppler = …, angle = … }`. Hann, and none over the antennas,
    /// where nothing is said.
    pub window: Option<toml::Value>,
    /// Length of an FFT in multiples of its samples and chirps, 1 to 4; or `{ range = …, doppler = …, angle = … }`.
    pub padding: Option<toml::Value>,
    /// Ranges beyond this are dropped, m; 10 where nothing is said.
    pub max_range_m: Option<f64>,
    /// What maps are made: `range_azimuth`, `range_elevation`, `range_doppler`, `cartesian`, `cube`, `cartesian_cube`.
    pub views: Option<Vec<String>>,
}

/// The chirps of a capture as a person writes them, in the units of configuration files.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChirpText {
    /// Frequency at which the ramp begins, GHz.
    pub start_ghz: f64,
    /// Slope, MHz/µs.
    pub slope_mhz_per_us: f64,
    /// Pause before the ramp, µs.
    pub idle_us: f64,
    /// Begin of sampling, µs.
    pub adc_start_us: f64,
    /// End of the ramp, µs.
    pub ramp_us: f64,
    /// Samples a chirp.
    pub samples: usize,
    /// Samples a second, thousands.
    pub rate_ksps: f64,
    /// Times that every transmitter sends in a frame.
    pub loops: usize,
    /// Transmitters in the order in which they send, counted from 0.
    pub tx: Vec<usize>,
    /// Receivers.
    pub rx: usize,
    /// From one frame to the next, ms.
    pub period_ms: f64,
}

impl ChirpText {
    /// In SI units.
    pub fn settings(&self) -> ChirpSettings {
        ChirpSettings {
            start_hz: 1e9 * self.start_ghz,
            slope_hz_per_s: 1e12 * self.slope_mhz_per_us,
            idle_s: 1e-6 * self.idle_us,
            adc_start_s: 1e-6 * self.adc_start_us,
            ramp_s: 1e-6 * self.ramp_us,
            samples: self.samples,
            sample_rate_hz: 1e3 * self.rate_ksps,
            loops: self.loops,
            tx: self.tx.clone(),
            rx: self.rx,
            period_s: 1e-3 * self.period_ms,
        }
    }
}
