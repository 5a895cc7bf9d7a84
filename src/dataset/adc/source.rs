//! Where the samples of a capture come from: one file of words, the four files of a cascade, or a cube of numbers (`.npy`).
//!
//! A cascade of four chips (MMWCAS) writes one file a chip, `master_0000_data.bin`, `slave1_…` to `slave3_…`: frame, loop, chirp,
//! sample, its four receivers, I and Q. Cubes are (loops, channels, samples), or (frames, loops, channels, samples), channels
//! (transmitter in the order of sending, receiver), complex; or (frames, transmitters, samples, receivers, loops), as XRF55 publishes
//! its segmented captures. Some were stored as if the words had been read without sign
//! (`OpenRadar`'s own), which values above 32767 tell, and are wrapped.

use super::{AdcSettings, IqOrder, Payload, decode, number};
use crate::dataset::DatasetError;
use crate::dataset::npz::NpyCube;
use crate::radar::AdcCube;
use num_complex::Complex64;
use std::path::{Path, PathBuf};

/// What begins the names of a cascade's files, in the order of their receivers.
const CHIPS: [&str; 4] = ["master", "slave1", "slave2", "slave3"];

/// The samples of a capture, frame by frame.
#[derive(Debug)]
pub enum SampleSource {
    /// Words of the converter, in one file.
    Words(Payload),
    /// Words of a cascade's chips, a file each.
    Cascade(Vec<Payload>),
    /// Samples as numbers.
    Numbers {
        /// The file.
        cube: NpyCube,
        /// Whether numbers above 32767 are negative ones that lost their sign.
        wrapped: bool,
        /// How its axes follow each other after that of the frames, if it has one.
        order: CubeOrder,
    },
}

/// The axes of a frame in a cube of samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CubeOrder {
    /// (loop, channel, sample).
    Loops,
    /// (transmitter, sample, receiver, loop).
    Transmitters,
}

impl SampleSource {
    /// Opens the files of a capture: one, or a cascade's four in the order of their chips. Reads headers only.
    ///
    /// # Errors
    /// Where one cannot be read, or a cube has not the sizes that `settings` says.
    pub fn open(files: &[PathBuf], settings: &AdcSettings) -> Result<Self, DatasetError> {
        match files {
            [one] if is_npy(one) => {
                let cube = NpyCube::open(one)?;
                let chirp = &settings.chirp;
                let sizes = cube.shape();
                let plain = [chirp.loops, chirp.tx.len() * chirp.rx, chirp.samples];
                let segmented = [chirp.tx.len(), chirp.samples, chirp.rx, chirp.loops];
                let order = match sizes {
                    [_, rest @ ..] if sizes.len() == 5 && *rest == segmented => Some(CubeOrder::Transmitters),
                    [_, rest @ ..] if sizes.len() == 4 && *rest == plain => Some(CubeOrder::Loops),
                    all if *all == plain => Some(CubeOrder::Loops),
                    _ => None,
                };
                let Some(order) = order.filter(|_| cube.is_complex()) else {
                    let message = format!(
                        "an array {sizes:?} of {}; expected complex numbers, (loops, transmitters · receivers, samples) = {plain:?} as \
                         its configuration says, frames of them, or frames of (transmitters, samples, receivers, loops) = \
                         {segmented:?}",
                        cube.dtype()
                    );
                    return Err(DatasetError::Frame { message, path: one.clone() });
                };
                let empty = sizes.contains(&0);
                let first = if empty { Vec::new() } else { cube.read(0, plain.iter().product())? };
                let wrapped = first.iter().any(|x| x.re > 32_767.0 || x.im > 32_767.0);
                Ok(Self::Numbers { cube, wrapped, order })
            }
            [one] => Payload::open(one).map(Self::Words),
            several => several.iter().map(|path| Payload::open(path)).collect::<Result<_, _>>().map(Self::Cascade),
        }
    }

    /// The main file.
    pub fn path(&self) -> &Path {
        match self {
            Self::Words(payload) => payload.path(),
            Self::Cascade(chips) => chips.first().map_or(Path::new(""), Payload::path),
            Self::Numbers { cube, .. } => cube.path(),
        }
    }

    /// All of its files.
    pub fn files(&self) -> Vec<PathBuf> {
        match self {
            Self::Cascade(chips) => chips.iter().map(|chip| chip.path().to_owned()).collect(),
            _ => vec![self.path().to_owned()],
        }
    }

    /// Its whole frames, and the bytes of a file that are left over.
    pub fn frames(&self, settings: &AdcSettings) -> (u64, u64) {
        match self {
            Self::Words(payload) => {
                let bytes = settings.frame_bytes().max(1);
                (payload.len() / bytes, payload.len() % bytes)
            }
            Self::Cascade(chips) => {
                let bytes = (settings.frame_bytes() / chips.len().max(1) as u64).max(1);
                let shortest = chips.iter().map(Payload::len).min().unwrap_or(0);
                (shortest / bytes, chips.iter().map(|chip| chip.len() - shortest / bytes * bytes).max().unwrap_or(0))
            }
            Self::Numbers { cube, .. } => (if cube.shape().len() > 3 { cube.shape()[0] as u64 } else { 1 }, 0),
        }
    }

    /// What is to be said of what is missing or mended, in words.
    pub fn notes(&self) -> Vec<String> {
        let of_gaps = |payload: &Payload| {
            let gaps = payload.gaps();
            let s = if gaps.count == 1 { "" } else { "s" };
            (gaps.count > 0)
                .then(|| format!("{} bytes in {} gap{s} were lost on the way; they are 0", gaps.bytes, gaps.count))
        };
        match self {
            Self::Words(payload) => of_gaps(payload).into_iter().collect(),
            Self::Cascade(chips) => chips.iter().filter_map(of_gaps).collect(),
            Self::Numbers { wrapped: true, .. } => {
                vec!["samples were stored without their sign (above 32767); it was put back".into()]
            }
            Self::Numbers { .. } => Vec::new(),
        }
    }

    /// Whether I and Q are words whose order is to be known.
    pub fn has_words(&self) -> bool {
        !matches!(self, Self::Numbers { .. })
    }

    /// The samples of a frame, ordered (loop, channel, sample).
    ///
    /// # Errors
    /// Where the file cannot be read.
    pub fn samples(&self, frame: u64, settings: &AdcSettings, iq: IqOrder) -> Result<AdcCube, DatasetError> {
        let chirp = &settings.chirp;
        let channels = chirp.tx.len() * chirp.rx;
        match self {
            Self::Words(payload) => {
                let len = settings.frame_bytes();
                Ok(decode(&payload.read(frame * len, len as usize)?, settings, iq))
            }
            Self::Cascade(chips) => {
                let len = settings.frame_bytes() / chips.len().max(1) as u64;
                let bytes = chips.iter().map(|chip| chip.read(frame * len, len as usize));
                Ok(decode_cascade(&bytes.collect::<Result<Vec<_>, _>>()?, settings, iq))
            }
            Self::Numbers { cube, wrapped, order } => {
                let len = chirp.loops * channels * chirp.samples;
                let mut data = cube.read(frame * len as u64, len)?;
                if *wrapped {
                    let signed = |x: f64| if x > 32_767.0 { x - 65_536.0 } else { x };
                    for x in &mut data {
                        *x = Complex64::new(signed(x.re), signed(x.im));
                    }
                }
                if *order == CubeOrder::Transmitters {
                    data = by_loops(&data, [chirp.tx.len(), chirp.samples, chirp.rx, chirp.loops]);
                }
                Ok(AdcCube { loops: chirp.loops, channels, samples: chirp.samples, data })
            }
        }
    }
}

/// A frame of (transmitter, sample, receiver, loop) as one of (loop, channel, sample).
fn by_loops(data: &[Complex64], [tx, samples, rx, loops]: [usize; 4]) -> Vec<Complex64> {
    let mut out = Vec::with_capacity(data.len());
    for turn in 0..loops {
        for transmitter in 0..tx {
            for receiver in 0..rx {
                let at = |sample: usize| ((transmitter * samples + sample) * rx + receiver) * loops + turn;
                out.extend((0..samples).map(|sample| data.get(at(sample)).copied().unwrap_or_default()));
            }
        }
    }
    out
}

/// The words of a cascade's chips: (loop, transmitter, sample, receiver, I and Q) each; what is missing at an end is 0.
fn decode_cascade(chips: &[Vec<u8>], settings: &AdcSettings, iq: IqOrder) -> AdcCube {
    let (chirp, words) = (&settings.chirp, settings.words);
    let (samples, tx) = (chirp.samples, chirp.tx.len());
    let rx = chirp.rx / chips.len().max(1);
    let word = |bytes: &[u8], at: usize| -> f64 {
        let Some(&[lo, hi]) = bytes.get(2 * at..2 * at + 2) else { return 0.0 };
        number([lo, hi], words.bits, words.offset_binary)
    };
    let mut data = Vec::with_capacity(chirp.loops * tx * chirp.rx * samples);
    for turn in 0..chirp.loops * tx {
        for bytes in chips {
            for receiver in 0..rx {
                for sample in 0..samples {
                    let at = 2 * ((turn * samples + sample) * rx + receiver);
                    let (first, second) = (word(bytes, at), word(bytes, at + 1));
                    data.push(match iq {
                        IqOrder::IFirst => Complex64::new(first, second),
                        IqOrder::QFirst => Complex64::new(second, first),
                    });
                }
            }
        }
    }
    AdcCube { loops: chirp.loops, channels: tx * chirp.rx, samples, data }
}

/// Whether a file is a cube of numbers by its name.
pub(in crate::dataset) fn is_npy(file: &Path) -> bool {
    file.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("npy"))
}

/// The chip of a cascade that a file is of, and the number of its piece: `master_0000_data.bin` is (0, `0000`).
pub(in crate::dataset) fn chip_of(file: &Path) -> Option<(usize, &str)> {
    let name = file.file_name()?.to_str()?;
    let (chip, rest) = name.split_once('_')?;
    let piece = rest.strip_suffix("_data.bin")?;
    Some((CHIPS.iter().position(|known| *known == chip)?, piece))
}

/// The files of the cascade's piece that `file` is of, in the order of its chips.
///
/// # Errors
/// Where one of the four is missing, naming it.
pub(in crate::dataset) fn cascade_of(file: &Path) -> Result<Option<Vec<PathBuf>>, DatasetError> {
    let Some((_, piece)) = chip_of(file) else { return Ok(None) };
    let files: Vec<PathBuf> =
        CHIPS.iter().map(|chip| file.with_file_name(format!("{chip}_{piece}_data.bin"))).collect();
    if let Some(missing) = files.iter().find(|path| !path.is_file()) {
        let name = missing.file_name().unwrap_or_default().to_string_lossy();
        let message = format!("{name} is not beside it; expected the files of all four chips of a cascade");
        return Err(DatasetError::Frame { message, path: file.to_owned() });
    }
    Ok(Some(files))
}
