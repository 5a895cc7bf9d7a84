//! A TI SDK `.cfg`: one command a line, numbers after it.

use super::{AdcSettings, WordOrder, transmitter};
use crate::dataset::DatasetError;
use crate::radar::ChirpSettings;
use std::path::Path;

/// A command with its numbers, and its line counted from 1.
struct Line<'a> {
    number: usize,
    words: Vec<&'a str>,
}

/// What a `.cfg` says. Numbers may be fractional; `%` begins a comment; the last of a repeated command counts.
///
/// # Errors
/// Naming the line and the field.
pub fn parse_cfg(text: &str, path: &Path) -> Result<AdcSettings, DatasetError> {
    let lines: Vec<Line<'_>> = text
        .lines()
        .zip(1..)
        .map(|(line, number)| Line { number, words: line.split('%').next().unwrap_or("").split_whitespace().collect() })
        .filter(|line| !line.words.is_empty())
        .collect();
    let fault = |line: Option<usize>, message: String| DatasetError::Manifest { message, line, path: path.to_owned() };
    let last = |command: &str| lines.iter().rev().find(|line| line.words[0] == command);
    let needed = |command: &str| {
        last(command).ok_or_else(|| fault(None, format!("no `{command}`; expected a radar's configuration (.cfg)")))
    };
    let value = |line: &Line<'_>, field: usize, name: &str| -> Result<f64, DatasetError> {
        let word = line.words.get(field).copied().unwrap_or("");
        let number: Option<f64> = word.parse().ok().filter(|x: &f64| x.is_finite());
        number.ok_or_else(|| {
            let message = format!("`{}`: field {field}, {name}, is \"{word}\"; expected a number", line.words[0]);
            fault(Some(line.number), message)
        })
    };
    let count = |line: &Line<'_>, field: usize, name: &str| -> Result<usize, DatasetError> {
        let number = value(line, field, name)?;
        if number.fract() == 0.0 && (0.0..=1e6).contains(&number) {
            return Ok(number as usize);
        }
        let message = format!("`{}`: field {field}, {name}, is {number}; expected a whole number", line.words[0]);
        Err(fault(Some(line.number), message))
    };

    let frame = needed("frameCfg")?;
    let (first, end) = (count(frame, 1, "first chirp")?, count(frame, 2, "last chirp")?);
    if end < first || end - first >= 64 {
        return Err(fault(
            Some(frame.number),
            format!("`frameCfg`: chirps {first} to {end}; expected 1 to 64 of them"),
        ));
    }
    let mut tx = Vec::new();
    let mut profile = None;
    for chirp in first..=end {
        let mut found = None;
        for line in lines.iter().filter(|line| line.words[0] == "chirpCfg") {
            let (from, to) = (count(line, 1, "first chirp")?, count(line, 2, "last chirp")?);
            if (from..=to).contains(&chirp) {
                found = Some(line);
            }
        }
        let line =
            found.ok_or_else(|| fault(Some(frame.number), format!("`frameCfg`: chirp {chirp} has no `chirpCfg`")))?;
        let mask = count(line, 8, "transmitters")? as u32;
        tx.push(transmitter(mask).map_err(|why| fault(Some(line.number), format!("`chirpCfg`: {why}")))?);
        let of = count(line, 3, "profile")?;
        if *profile.get_or_insert(of) != of {
            let message = "`chirpCfg`: chirps of a frame have different profiles; expected one".to_owned();
            return Err(fault(Some(line.number), message));
        }
    }
    let profile = profile.unwrap_or(0);
    let mut found = None;
    for line in lines.iter().filter(|line| line.words[0] == "profileCfg") {
        if count(line, 1, "number")? == profile {
            found = Some(line);
        }
    }
    let line =
        found.ok_or_else(|| fault(None, format!("no `profileCfg {profile}`; the chirps of the frame name it")))?;
    let chirp = ChirpSettings {
        start_hz: 1e9 * value(line, 2, "start, GHz")?,
        idle_s: 1e-6 * value(line, 3, "idle, µs")?,
        adc_start_s: 1e-6 * value(line, 4, "begin of sampling, µs")?,
        ramp_s: 1e-6 * value(line, 5, "end of the ramp, µs")?,
        slope_hz_per_s: 1e12 * value(line, 8, "slope, MHz/µs")?,
        samples: count(line, 10, "samples")?,
        sample_rate_hz: 1e3 * value(line, 11, "rate, ksps")?,
        loops: count(frame, 3, "loops")?,
        tx,
        rx: match last("channelCfg") {
            Some(line) => (count(line, 1, "receivers")? as u32).count_ones() as usize,
            None => 4,
        },
        period_s: 1e-3 * value(frame, 5, "period, ms")?,
    };
    if let Some(message) = chirp.fault() {
        return Err(fault(None, message));
    }
    let (bits, complex) = match last("adcCfg") {
        Some(line) => (bits_of(count(line, 1, "bits")?), count(line, 2, "format")? != 0),
        None => (Some(16), true),
    };
    let bits =
        bits.ok_or_else(|| fault(last("adcCfg").map(|line| line.number), "`adcCfg`: bits; expected 0, 1 or 2".into()))?;
    // Whether I or Q comes first depends on the tool that began the capture too: the samples tell.
    Ok(AdcSettings { chirp, words: WordOrder { complex, bits, ..WordOrder::default() } })
}

/// Bits of the converter, as the number in configurations says them.
pub(super) fn bits_of(code: usize) -> Option<u32> {
    [12, 14, 16].get(code).copied()
}
