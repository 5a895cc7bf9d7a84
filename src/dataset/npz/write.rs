//! Writing: stored, not deflated (20 to 40 times faster) unless asked for, and atomic ([`replace_file`]).

use super::NpzError;
use crate::output::replace_file;
use npyz::WriterBuilder;
use num_complex::Complex;
use std::io::Write;
use std::path::Path;
use zip::write::FileOptions;

/// What an array is made of.
#[derive(Debug, Clone, Copy)]
enum Elements<'a> {
    F64(&'a [f64]),
    F32(&'a [f32]),
    F16(&'a [half::f16]),
    Complex128(&'a [Complex<f64>]),
    Complex64(&'a [Complex<f32>]),
    I64(&'a [i64]),
    Flags(&'a [bool]),
    Text(&'a str),
    Texts(&'a [String]),
}

/// An array to be written, C order.
#[derive(Debug, Clone)]
pub struct ArrayView<'a> {
    shape: Vec<u64>,
    elements: Elements<'a>,
}

impl<'a> ArrayView<'a> {
    fn new(shape: &[usize], elements: Elements<'a>) -> Self {
        Self { shape: shape.iter().map(|&n| n as u64).collect(), elements }
    }

    /// `float64`; `shape` may be empty for a scalar.
    pub fn f64(shape: &[usize], data: &'a [f64]) -> Self {
        Self::new(shape, Elements::F64(data))
    }

    /// `float32`.
    pub fn f32(shape: &[usize], data: &'a [f32]) -> Self {
        Self::new(shape, Elements::F32(data))
    }

    /// `float16`.
    pub fn f16(shape: &[usize], data: &'a [half::f16]) -> Self {
        Self::new(shape, Elements::F16(data))
    }

    /// `complex128`.
    pub fn complex128(shape: &[usize], data: &'a [Complex<f64>]) -> Self {
        Self::new(shape, Elements::Complex128(data))
    }

    /// `complex64`.
    pub fn complex64(shape: &[usize], data: &'a [Complex<f32>]) -> Self {
        Self::new(shape, Elements::Complex64(data))
    }

    /// `int64`.
    pub fn i64(shape: &[usize], data: &'a [i64]) -> Self {
        Self::new(shape, Elements::I64(data))
    }

    /// `bool`.
    pub fn flags(shape: &[usize], data: &'a [bool]) -> Self {
        Self::new(shape, Elements::Flags(data))
    }

    /// A 0-d unicode string.
    pub fn text(text: &'a str) -> Self {
        Self::new(&[], Elements::Text(text))
    }

    /// A list of unicode strings.
    pub fn texts(texts: &'a [String]) -> Self {
        Self::new(&[texts.len()], Elements::Texts(texts))
    }

    fn len(&self) -> usize {
        match self.elements {
            Elements::F64(data) => data.len(),
            Elements::F32(data) => data.len(),
            Elements::F16(data) => data.len(),
            Elements::Complex128(data) => data.len(),
            Elements::Complex64(data) => data.len(),
            Elements::I64(data) => data.len(),
            Elements::Flags(data) => data.len(),
            Elements::Text(_) => 1,
            Elements::Texts(texts) => texts.len(),
        }
    }

    fn write_to(&self, out: &mut dyn Write) -> std::io::Result<()> {
        fn plain<T: npyz::AutoSerialize + Copy>(out: &mut dyn Write, shape: &[u64], data: &[T]) -> std::io::Result<()> {
            let mut writer = npyz::WriteOptions::new().default_dtype().shape(shape).writer(out).begin_nd()?;
            writer.extend(data)?;
            writer.finish()
        }
        fn strings(out: &mut dyn Write, shape: &[u64], texts: &[&str]) -> std::io::Result<()> {
            let longest = texts.iter().map(|text| text.chars().count()).max().unwrap_or(0).max(1);
            let dtype = format!("<U{longest}").parse().map_err(std::io::Error::other)?;
            let options = npyz::WriteOptions::<str>::new().dtype(npyz::DType::Plain(dtype)).shape(shape);
            let mut writer = options.writer(out).begin_nd()?;
            for text in texts {
                writer.push(text)?;
            }
            writer.finish()
        }
        if self.shape.iter().product::<u64>() != self.len() as u64 {
            let message = format!("shape {:?} does not hold {} elements", self.shape, self.len());
            return Err(std::io::Error::new(std::io::ErrorKind::InvalidInput, message));
        }
        match self.elements {
            Elements::F64(data) => plain(out, &self.shape, data),
            Elements::F32(data) => plain(out, &self.shape, data),
            Elements::F16(data) => plain(out, &self.shape, data),
            Elements::Complex128(data) => plain(out, &self.shape, data),
            Elements::Complex64(data) => plain(out, &self.shape, data),
            Elements::I64(data) => plain(out, &self.shape, data),
            Elements::Flags(data) => plain(out, &self.shape, data),
            Elements::Text(text) => strings(out, &self.shape, &[text]),
            Elements::Texts(texts) => {
                let texts: Vec<&str> = texts.iter().map(String::as_str).collect();
                strings(out, &self.shape, &texts)
            }
        }
    }
}

/// Writes an npz of these arrays, in this order, each under its key. The same arrays give the same bytes.
///
/// # Errors
/// Where the file cannot be written or a shape does not hold its elements; an existing file is then untouched.
pub fn write(path: &Path, arrays: &[(&str, ArrayView<'_>)]) -> Result<(), NpzError> {
    write_with(path, arrays, zip::CompressionMethod::Stored)
}

/// As [`write()`], deflated: slow, for files that are kept or sent.
///
/// # Errors
/// As [`write()`].
pub fn write_deflated(path: &Path, arrays: &[(&str, ArrayView<'_>)]) -> Result<(), NpzError> {
    write_with(path, arrays, zip::CompressionMethod::Deflated)
}

fn write_with(path: &Path, arrays: &[(&str, ArrayView<'_>)], method: zip::CompressionMethod) -> Result<(), NpzError> {
    replace_file(path, |out| {
        let options = FileOptions::default()
            .compression_method(method)
            .last_modified_time(zip::DateTime::default())
            .large_file(true);
        let mut archive = zip::ZipWriter::new(out);
        for (key, array) in arrays {
            archive.start_file(npyz::npz::file_name_from_array_name(key), options)?;
            array.write_to(&mut archive)?;
        }
        archive.finish()?;
        Ok(())
    })
    .map_err(|reason| NpzError::Write { reason, path: path.to_owned() })
}

/// Writes one array as `.npy`.
///
/// # Errors
/// As [`write()`].
pub fn write_npy(path: &Path, array: &ArrayView<'_>) -> Result<(), NpzError> {
    replace_file(path, |out| array.write_to(out)).map_err(|reason| NpzError::Write { reason, path: path.to_owned() })
}
