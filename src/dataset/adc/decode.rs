//! Words of the converter to samples.

use super::AdcSettings;
use crate::radar::AdcCube;
use num_complex::Complex64;

/// What comes first of a complex sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum IqOrder {
    /// In-phase: mmWave Studio.
    IFirst,
    /// Quadrature: the SDK's command line.
    QFirst,
}

impl IqOrder {
    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::IFirst => "I first",
            Self::QFirst => "Q first",
        }
    }
}

/// The samples of a frame, ordered (loop, channel, sample); channels are (transmitter in the order of sending, receiver). What
/// `bytes` lacks at its end is 0.
pub fn decode(bytes: &[u8], settings: &AdcSettings, iq: IqOrder) -> AdcCube {
    let (chirp, words) = (&settings.chirp, settings.words);
    let (samples, rx) = (chirp.samples, chirp.rx);
    let word = |at: usize| -> f64 {
        let Some(&[lo, hi]) = bytes.get(2 * at..2 * at + 2) else { return 0.0 };
        number([lo, hi], words.bits, words.offset_binary)
    };
    // Where the two words of a sample lie in its chirp.
    let places = |receiver: usize, sample: usize| -> (usize, usize) {
        if !words.complex {
            let at = receiver * samples + sample;
            (at, at)
        } else if words.lanes == 4 {
            let at = sample * 2 * rx + receiver;
            (at, at + rx)
        } else {
            // Two samples' first words, then their second ones.
            let at = 2 * (receiver * samples + sample - sample % 2) + sample % 2;
            (at, at + if samples - (sample - sample % 2) > 1 { 2 } else { 1 })
        }
    };
    let of_chirp = rx * samples * if words.complex { 2 } else { 1 };
    let chirps = chirp.loops * chirp.tx.len();
    let mut data = Vec::with_capacity(chirps * rx * samples);
    for begin in (0..chirps).map(|index| index * of_chirp) {
        for receiver in 0..rx {
            for sample in 0..samples {
                let (first, second) = places(receiver, sample);
                let (first, second) = (word(begin + first), word(begin + second));
                data.push(match (words.complex, iq) {
                    (false, _) => Complex64::new(first, 0.0),
                    (true, IqOrder::IFirst) => Complex64::new(first, second),
                    (true, IqOrder::QFirst) => Complex64::new(second, first),
                });
            }
        }
    }
    AdcCube { loops: chirp.loops, channels: chirp.tx.len() * rx, samples, data }
}

/// A word of the converter: fewer than 16 bits have a sign of their own.
pub(super) fn number(bytes: [u8; 2], bits: u32, offset_binary: bool) -> f64 {
    let word = u16::from_le_bytes(bytes) ^ if offset_binary { 0x8000 } else { 0 };
    let shift = 16_u32.saturating_sub(bits);
    f64::from(((word << shift) as i16) >> shift)
}
