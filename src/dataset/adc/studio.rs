//! The JSON that mmWave Studio writes of a device: `*.mmwave.json`.

use super::ti_cfg::bits_of;
use super::{AdcSettings, WordOrder, transmitter};
use crate::dataset::DatasetError;
use crate::radar::ChirpSettings;
use serde_json::Value;
use std::path::Path;

/// What an mmWave Studio JSON says of its device, or of the four chips of a cascade: transmitter n of chip c is 3 c + n, and the
/// chirps are those of the first.
///
/// # Errors
/// Naming the key and what was expected there.
pub fn parse_studio(text: &str, path: &Path) -> Result<AdcSettings, DatasetError> {
    read(text).map_err(|(message, line)| DatasetError::Manifest { message, line, path: path.to_owned() })
}

type Fault = (String, Option<usize>);

fn read(text: &str) -> Result<AdcSettings, Fault> {
    let json: Value = serde_json::from_str(text).map_err(|error| (format!("not JSON: {error}"), Some(error.line())))?;
    let root = At { value: &json, path: String::new() };
    let devices = root.get("mmWaveDevices")?;
    let device = devices.at(0)?;
    let rf = device.get("rfConfig")?;
    let frame = rf.get("rlFrameCfg_t")?;
    let (first, end) = (frame.get("chirpStartIdx")?.count()?, frame.get("chirpEndIdx")?.count()?);
    if end < first || end - first >= 64 {
        return Err((format!("`{}`: chirps {first} to {end}; expected 1 to 64 of them", frame.path), None));
    }
    let mut tx = Vec::new();
    let mut profile = None;
    let chirps = rf.get("rlChirps")?;
    for chirp in first..=end {
        let found = chirp_of(&chirps, chirp)?;
        let mut mask = found.get("txEnable")?.mask()?;
        for chip in 1..devices.len().min(4) {
            let chirps = devices.at(chip)?.get("rfConfig")?.get("rlChirps")?;
            mask |= chirp_of(&chirps, chirp)?.get("txEnable")?.mask()?.checked_shl(3 * chip as u32).unwrap_or(0);
        }
        tx.push(transmitter(mask).map_err(|why| (format!("`{}.txEnable`: {why}", found.path), None))?);
        let of = found.get("profileId")?;
        if *profile.get_or_insert(of.count()?) != of.count()? {
            return Err((format!("`{}`: chirps of a frame have different profiles; expected one", of.path), None));
        }
    }
    let profiles = rf.get("rlProfiles")?;
    let mut found = None;
    for k in 0..profiles.len() {
        let of = profiles.at(k)?.get("rlProfileCfg_t")?;
        if Some(of.get("profileId")?.count()?) == profile {
            found = Some(of);
        }
    }
    let of =
        found.ok_or_else(|| (format!("`{}`: the profile of the frame's chirps is not there", profiles.path), None))?;
    // The chips of a cascade have receivers each.
    let mut rx = 0;
    for chip in 0..devices.len().min(4) {
        let channels = devices.at(chip)?.get("rfConfig")?.get("rlChanCfg_t")?.get("rxChannelEn")?;
        rx += channels.mask()?.count_ones() as usize;
    }
    let chirp = ChirpSettings {
        start_hz: 1e9 * of.get("startFreqConst_GHz")?.number()?,
        slope_hz_per_s: 1e12 * of.get("freqSlopeConst_MHz_usec")?.number()?,
        idle_s: 1e-6 * of.get("idleTimeConst_usec")?.number()?,
        adc_start_s: 1e-6 * of.get("adcStartTimeConst_usec")?.number()?,
        ramp_s: 1e-6 * of.get("rampEndTime_usec")?.number()?,
        samples: of.get("numAdcSamples")?.count()?,
        sample_rate_hz: 1e3 * of.get("digOutSampleRate")?.number()?,
        loops: frame.get("numLoops")?.count()?,
        tx,
        rx,
        period_s: 1e-3 * frame.get("framePeriodicity_msec")?.number()?,
    };
    if let Some(message) = chirp.fault() {
        return Err((message, None));
    }
    let format = rf.get("rlAdcOutCfg_t")?.get("fmt")?;
    let code = format.get("b2AdcBits")?;
    let bits = bits_of(code.count()?).ok_or_else(|| (format!("`{}`: expected 0, 1 or 2", code.path), None))?;
    let complex = format.get("b2AdcOutFmt")?.count()? != 0;
    if devices.len() > 1 {
        // A file a chip, whose order is its own.
        return Ok(AdcSettings { chirp, words: WordOrder { complex, bits, ..WordOrder::default() } });
    }
    let lanes = device.get("rawDataCaptureConfig")?.get("rlDevLaneEnable_t")?.get("laneEn")?;
    let lanes = match lanes.mask()?.count_ones() {
        n @ (2 | 4) => n as usize,
        n => return Err((format!("`{}`: {n} lanes; expected 2 or 4", lanes.path), None)),
    };
    Ok(AdcSettings { chirp, words: WordOrder { lanes, complex, bits, ..WordOrder::default() } })
}

/// The settings of a chirp of the frame.
fn chirp_of<'a>(chirps: &At<'a>, chirp: usize) -> Result<At<'a>, Fault> {
    let mut found = None;
    for k in 0..chirps.len() {
        let of = chirps.at(k)?.get("rlChirpCfg_t")?;
        if (of.get("chirpStartIdx")?.count()?..=of.get("chirpEndIdx")?.count()?).contains(&chirp) {
            found = Some(of);
        }
    }
    found.ok_or_else(|| (format!("`{}`: chirp {chirp} of the frame is not there", chirps.path), None))
}

/// A value and the keys that lead to it.
struct At<'a> {
    value: &'a Value,
    path: String,
}

impl<'a> At<'a> {
    fn get(&self, key: &str) -> Result<At<'a>, Fault> {
        let path = if self.path.is_empty() { key.to_owned() } else { format!("{}.{key}", self.path) };
        let value = self.value.get(key).ok_or_else(|| (format!("missing key `{path}`"), None))?;
        Ok(At { value, path })
    }

    fn at(&self, index: usize) -> Result<At<'a>, Fault> {
        let path = format!("{}[{index}]", self.path);
        let value = self.value.get(index).ok_or_else(|| (format!("missing `{path}`; expected a list"), None))?;
        Ok(At { value, path })
    }

    fn len(&self) -> usize {
        self.value.as_array().map_or(0, Vec::len)
    }

    fn number(&self) -> Result<f64, Fault> {
        self.value.as_f64().ok_or_else(|| (format!("`{}` is {}; expected a number", self.path, self.value), None))
    }

    fn count(&self) -> Result<usize, Fault> {
        let whole = self.value.as_u64().and_then(|n| usize::try_from(n).ok()).filter(|n| *n <= 1_000_000);
        whole.ok_or_else(|| (format!("`{}` is {}; expected a whole number", self.path, self.value), None))
    }

    /// A number, or its hexadecimal digits in a text: `"0x7"`.
    fn mask(&self) -> Result<u32, Fault> {
        let of_text = |text: &str| u32::from_str_radix(text.trim_start_matches("0x"), 16).ok();
        let number = self.value.as_str().and_then(of_text);
        number
            .or_else(|| self.value.as_u64().and_then(|n| u32::try_from(n).ok()))
            .ok_or_else(|| (format!("`{}` is {}; expected bits such as \"0x7\"", self.path, self.value), None))
    }
}
