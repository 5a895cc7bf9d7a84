//! Writing an array in the form of another: the same dtype, byte order, memory order and shape, in a copy of its archive.

use super::header::{Header, Scalar};
use super::{NPY_KEY, NpzError, shape_text};
use crate::input::open_file;
use crate::output::{Sink, replace_file};
use half::f16;
use num_complex::Complex;
use std::io::{Read as _, Write as _};
use std::path::Path;
use zip::write::FileOptions;

/// How an array lies in a file.
#[derive(Debug, Clone)]
pub struct Form {
    header: Header,
}

impl Form {
    pub(super) fn new(header: Header) -> Self {
        Self { header }
    }

    pub(super) fn header(&self) -> &Header {
        &self.header
    }

    /// Its shape.
    pub fn shape(&self) -> &[usize] {
        &self.header.shape
    }

    /// Its dtype, for example `<f4`.
    pub fn dtype(&self) -> &str {
        &self.header.dtype
    }

    /// The axis along which it holds maps of `axes` axes: its first, or its second where the first has a length of one.
    pub fn stack_axis(&self, axes: usize) -> Option<usize> {
        let shape = self.shape();
        let batched = shape.len() == axes + 2 && shape.first() == Some(&1);
        (shape.len() == axes + 1 || batched).then_some(usize::from(batched))
    }

    /// The same with another length of an axis.
    pub fn with_axis(&self, axis: usize, length: usize) -> Self {
        let mut header = self.header.clone();
        if let Some(size) = header.shape.get_mut(axis) {
            *size = length;
        }
        Self { header }
    }

    /// Whether [`Self::encode`] takes so many cells.
    ///
    /// # Errors
    /// As it.
    pub fn fits(&self, cells: usize) -> Result<(), String> {
        if cells != self.header.len() {
            let shape = shape_text(self.shape());
            return Err(format!("{cells} cells; the shape {shape} holds {}", self.header.len()));
        }
        push(&mut Vec::new(), 0.0, &self.header)
    }

    /// Whether [`Self::with_amplitudes`] takes so many.
    ///
    /// # Errors
    /// As it.
    pub fn fits_amplitudes(&self, amplitudes: usize, levels: usize) -> Result<(), String> {
        let Header { scalar, width, fortran, .. } = &self.header;
        if *scalar != Scalar::Complex || !matches!(width, 8 | 16) || *fortran {
            return Err("expected complex64 or complex128 in C order".into());
        }
        let (got, shape) = (self.header.len(), shape_text(self.shape()));
        let expected = amplitudes.saturating_mul(levels);
        if got == expected {
            Ok(())
        } else {
            Err(format!("the shape {shape} holds {got} elements; expected {expected}"))
        }
    }

    /// The npy file, header included, of an array of complex numbers whose last axis has `levels` elements, with the amplitude of
    /// element `level` of each row as given, and every phase as in `measured` (the data of the array as it is). The other
    /// elements of a row keep their ratio to it, but none becomes larger: where it is the sum of all antennas in phase, no
    /// echo has a larger one. Without a phase the amplitude is a real number, and the rest of the row nothing.
    ///
    /// # Errors
    /// In words: where the array is another, or has no such row.
    pub fn with_amplitudes(
        &self,
        measured: &[u8],
        amplitudes: &[f64],
        levels: usize,
        level: usize,
    ) -> Result<Vec<u8>, String> {
        self.fits_amplitudes(amplitudes.len(), levels)?;
        let numbers = complex_numbers(measured, &self.header);
        let width = self.header.width / 2;
        let part = Header { scalar: Scalar::Float(width), width, ..self.header.clone() };
        let mut bytes = self.head();
        bytes.reserve(measured.len());
        for (row, &amplitude) in numbers.chunks_exact(levels.max(1)).zip(amplitudes) {
            let strongest = row.get(level).map_or(0.0, |x| x.norm());
            for (k, x) in row.iter().enumerate() {
                let scale = amplitude / strongest.max(x.norm());
                let scaled = match (strongest > 0.0 && strongest.is_finite(), k == level) {
                    (true, _) if scale.is_finite() && x.is_finite() => x * scale,
                    (false, true) => Complex::new(amplitude, 0.0),
                    _ => Complex::default(),
                };
                push(&mut bytes, scaled.re, &part)?;
                push(&mut bytes, scaled.im, &part)?;
            }
        }
        Ok(bytes)
    }

    /// The npy file, header included, of `data` in C order. What is beyond the dtype becomes its nearest finite number; whole
    /// numbers are rounded.
    ///
    /// # Errors
    /// In words: where the shape does not hold `data`, or the dtype holds no numbers.
    pub fn encode(&self, data: &[f64]) -> Result<Vec<u8>, String> {
        self.fits(data.len())?;
        let mut bytes = self.head();
        bytes.reserve(data.len() * self.header.width);
        let in_order = in_file_order(data, &self.header);
        let data = in_order.as_deref().unwrap_or(data);
        data.iter().try_for_each(|&x| push(&mut bytes, x, &self.header))?;
        Ok(bytes)
    }

    /// Magic, version, length and text, as numpy writes them: a multiple of 64 bytes.
    pub(super) fn head(&self) -> Vec<u8> {
        let Header { dtype, fortran, shape, .. } = &self.header;
        let order = if *fortran { "True" } else { "False" };
        let mut text = format!("{{'descr': '{dtype}', 'fortran_order': {order}, 'shape': {}, }}", shape_text(shape));
        while !(10 + text.len() + 1).is_multiple_of(64) {
            text.push(' ');
        }
        text.push('\n');
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((text.len() as u16).to_le_bytes());
        bytes.extend(text.into_bytes());
        bytes
    }
}

/// Elements in the order of a Fortran file; `None` where C order will do.
fn in_file_order(data: &[f64], header: &Header) -> Option<Vec<f64>> {
    let shape = &header.shape;
    if !header.fortran || shape.len() < 2 || data.is_empty() {
        return None;
    }
    let mut strides = vec![1_usize; shape.len()];
    for k in (0..shape.len() - 1).rev() {
        strides[k] = strides[k + 1] * shape[k + 1];
    }
    let mut index = vec![0_usize; shape.len()];
    let mut turned = Vec::with_capacity(data.len());
    for _ in 0..data.len() {
        let at: usize = index.iter().zip(&strides).map(|(i, stride)| i * stride).sum();
        turned.extend(data.get(at));
        for (i, &size) in index.iter_mut().zip(shape) {
            *i += 1;
            if *i < size {
                break;
            }
            *i = 0;
        }
    }
    Some(turned)
}

/// The elements of an array of complex numbers, in the order of the file.
fn complex_numbers(bytes: &[u8], header: &Header) -> Vec<Complex<f64>> {
    let part = |bytes: &[u8]| super::archive::real(bytes, header.big_endian);
    let number = |bytes: &[u8]| {
        let (re, im) = bytes.split_at(bytes.len() / 2);
        Complex::new(part(re), part(im))
    };
    bytes.chunks_exact(header.width.max(1)).map(number).collect()
}

pub(super) fn push(bytes: &mut Vec<u8>, x: f64, header: &Header) -> Result<(), String> {
    macro_rules! put {
        ($value:expr) => {{
            let value = $value;
            if header.big_endian { bytes.extend(value.to_be_bytes()) } else { bytes.extend(value.to_le_bytes()) }
        }};
    }
    let finite = |most: f64| if x.is_finite() { x.clamp(-most, most) } else { x };
    // A cast from float to whole saturates, and a NaN becomes 0.
    let whole = x.round();
    match (header.scalar, header.width) {
        (Scalar::Bool, _) => bytes.push(u8::from(x != 0.0)),
        (Scalar::Float(2), _) => put!(f16::from_f64(finite(f64::from(f16::MAX)))),
        (Scalar::Float(4), _) => put!(finite(f64::from(f32::MAX)) as f32),
        (Scalar::Float(8), _) => put!(x),
        (Scalar::Int(1), _) => put!(whole as i8),
        (Scalar::Int(2), _) => put!(whole as i16),
        (Scalar::Int(4), _) => put!(whole as i32),
        (Scalar::Int(8), _) => put!(whole as i64),
        (Scalar::Uint(1), _) => put!(whole as u8),
        (Scalar::Uint(2), _) => put!(whole as u16),
        (Scalar::Uint(4), _) => put!(whole as u32),
        (Scalar::Uint(8), _) => put!(whole as u64),
        _ => return Err(format!("dtype {} holds no numbers that can be written", header.dtype)),
    }
    Ok(())
}

/// Writes a copy of the npz or npy file `from` to `to`, with the arrays of `replaced` (key, npy file) in the place of its
/// own; every other entry is copied as it is, compressed as it is.
///
/// # Errors
/// Where `from` cannot be read or `to` cannot be written; an existing file is then untouched.
pub fn copy_with(from: &Path, to: &Path, replaced: &[(String, Vec<u8>)]) -> Result<(), NpzError> {
    let reading = |reason| NpzError::Read { reason, path: from.to_owned() };
    let mut file = open_file(from, "an npz or npy file").map_err(reading)?;
    let mut magic = [0_u8; 2];
    file.read_exact(&mut magic).map_err(reading)?;
    let written = if &magic == b"PK" {
        replace_file(to, |out| copy_archive(std::io::BufReader::new(file), out, replaced))
    } else {
        let array = replaced.iter().find(|(key, _)| key == NPY_KEY).map(|(_, bytes)| bytes.as_slice());
        replace_file(to, |out| out.write_all(array.unwrap_or_default()))
    };
    written.map_err(|reason| NpzError::Write { reason, path: to.to_owned() })
}

fn copy_archive(
    from: std::io::BufReader<std::fs::File>,
    out: &mut dyn Sink,
    replaced: &[(String, Vec<u8>)],
) -> std::io::Result<()> {
    let mut archive = zip::ZipArchive::new(from)?;
    let mut copy = zip::ZipWriter::new(out);
    for k in 0..archive.len() {
        let entry = archive.by_index_raw(k)?;
        let key = npyz::npz::array_name_from_file_name(entry.name()).map(str::to_owned);
        let Some((_, bytes)) = replaced.iter().find(|(name, _)| Some(name) == key.as_ref()) else {
            copy.raw_copy_file(entry)?;
            continue;
        };
        let options = FileOptions::default()
            .compression_method(entry.compression())
            .last_modified_time(entry.last_modified())
            .large_file(bytes.len() as u64 > u64::from(u32::MAX / 2));
        let name = entry.name().to_owned();
        drop(entry);
        copy.start_file(name, options)?;
        copy.write_all(bytes)?;
    }
    copy.finish()?;
    Ok(())
}
