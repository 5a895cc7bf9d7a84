//! A `.npy` of many numbers that is read in pieces: its header once, then what is asked for.

use super::header::{Header, Scalar, read_header};
use super::{NPY_KEY, NpzError};
use num_complex::Complex64;
use std::fs::File;
use std::io::{self, Read as _, Seek as _, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// An array on disk, in C order.
#[derive(Debug)]
pub struct NpyCube {
    path: PathBuf,
    file: Mutex<File>,
    header: Header,
}

impl NpyCube {
    /// Reads the header and compares the file's size with it.
    ///
    /// # Errors
    /// Where the file cannot be read, is no `.npy`, is in Fortran order, or is shorter than its header says.
    pub fn open(path: &Path) -> Result<Self, NpzError> {
        let read = |reason: io::Error| NpzError::Read { reason, path: path.to_owned() };
        let mut file = crate::input::open_file(path, "an array").map_err(read)?;
        let size = file.metadata().map_err(read)?.len();
        let fault = |message: String| NpzError::BadHeader { key: NPY_KEY.into(), message, path: path.to_owned() };
        let header = read_header(&mut file).map_err(fault)?;
        if header.fortran {
            return Err(fault("Fortran order; expected C order, which can be read in pieces".into()));
        }
        let needed = header.bytes.saturating_add(header.data_bytes());
        if size < needed {
            return Err(fault(format!("the file has {size} bytes; its header says {needed}")));
        }
        Ok(Self { path: path.to_owned(), file: Mutex::new(file), header })
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Sizes.
    pub fn shape(&self) -> &[usize] {
        &self.header.shape
    }

    /// The dtype in the header.
    pub fn dtype(&self) -> &str {
        &self.header.dtype
    }

    /// Whether it holds complex numbers of 8 or 16 bytes.
    pub fn is_complex(&self) -> bool {
        self.header.scalar == Scalar::Complex && [8, 16].contains(&self.header.width)
    }

    /// `len` complex numbers from the `from`th on, C order.
    ///
    /// # Errors
    /// Where the file cannot be read, or ends before.
    pub fn read(&self, from: u64, len: usize) -> Result<Vec<Complex64>, NpzError> {
        let width = self.header.width;
        let mut bytes = vec![0; len.saturating_mul(width)];
        let begin = self.header.bytes.saturating_add(from.saturating_mul(width as u64));
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        let done = file.seek(SeekFrom::Start(begin)).and_then(|_| file.read_exact(&mut bytes));
        done.map_err(|reason| NpzError::Read { reason, path: self.path.clone() })?;
        let big = self.header.big_endian;
        let part = |half: &[u8]| -> f64 {
            match (half, big) {
                (&[a, b, c, d], false) => f64::from(f32::from_le_bytes([a, b, c, d])),
                (&[a, b, c, d], true) => f64::from(f32::from_be_bytes([a, b, c, d])),
                (&[a, b, c, d, e, f, g, h], false) => f64::from_le_bytes([a, b, c, d, e, f, g, h]),
                (&[a, b, c, d, e, f, g, h], true) => f64::from_be_bytes([a, b, c, d, e, f, g, h]),
                _ => f64::NAN,
            }
        };
        let number = |bytes: &[u8]| {
            let (re, im) = bytes.split_at(width / 2);
            Complex64::new(part(re), part(im))
        };
        Ok(bytes.chunks_exact(width.max(1)).map(number).collect())
    }
}
