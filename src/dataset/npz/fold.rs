//! Arrays that hold several numbers of a cell: two radar frames, real and imaginary parts, Doppler bins. They are read in pieces,
//! so that no more than the map is held, and written back with every number of a cell in the same proportion.

use super::archive::{MAX_BYTES, Source, real};
use super::decode::numbers;
use super::form::push;
use super::header::{Header, Scalar};
use super::{Form, NpzArchive, NpzError, shape_text};
use num_complex::Complex;

/// Numbers that are read at a time.
const PIECE: usize = 1 << 16;

/// How an array in C order holds the numbers of a map's cells: (before, cells, after). A cell is √(Σ |x|² / over).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fold {
    /// Numbers of a cell along the axes before the map's.
    pub before: usize,
    /// Cells of the map.
    pub cells: usize,
    /// Numbers of a cell along the axes after the map's.
    pub after: usize,
    /// By what the sum of the squares is divided: 1 for parts and Doppler bins, their number for frames of which the mean power
    /// is meant.
    pub over: usize,
}

impl Fold {
    /// Numbers in all; `None` where there are more than can be counted.
    fn len(&self) -> Option<usize> {
        self.before.checked_mul(self.cells)?.checked_mul(self.after)
    }

    /// The cell of number `at`.
    fn cell(&self, at: usize) -> usize {
        at / self.after.max(1) % self.cells.max(1)
    }
}

/// The map of an array of several numbers a cell.
#[derive(Debug, Clone, PartialEq)]
pub struct Folded {
    /// One number a cell, C order.
    pub data: Vec<f64>,
    /// Whether any number is below zero: amplitudes have no sign, parts of complex numbers do. False for complex dtypes.
    pub has_signs: bool,
    /// Whether the dtype is complex.
    pub is_complex: bool,
    /// The dtype in the file.
    pub dtype: String,
}

impl NpzArchive {
    /// Reads an array of real or complex numbers (C order; of any order where it is real) to its end.
    ///
    /// # Errors
    /// As [`NpzArchive::read`], and where the array has another number of elements than `fold`.
    pub fn read_folded(&mut self, key: &str, fold: Fold) -> Result<Folded, NpzError> {
        let header = self.with_entry(key, |source| Ok(source.header.clone()))?;
        let (is_complex, dtype) = (header.scalar == Scalar::Complex, header.dtype.clone());
        if fold.len() != Some(header.len()) {
            let expected = format!("{} × {} × {} numbers", fold.before, fold.cells, fold.after);
            return Err(self.wrong_shape(key, &header.shape, expected));
        }
        let mut sums = Sums { fold, at: 0, squares: Vec::new(), has_signs: false };
        if is_complex && (header.fortran || !matches!(header.width, 8 | 16)) {
            return Err(self.wrong_type(key, &header, "real numbers, complex64 or complex128, in C order"));
        }
        if header.fortran {
            sums.add(self.read(key)?.data.into_iter());
        } else if !is_complex && numbers(&[], &Header { shape: vec![0], ..header.clone() }).is_none() {
            return Err(self.wrong_type(key, &header, "real or complex numbers"));
        } else {
            self.with_entry(key, |source| sums.read(source))?;
        }
        let over = fold.over.max(1) as f64;
        let data = sums.squares.into_iter().map(|square| (square / over).sqrt()).collect();
        Ok(Folded { data, has_signs: sums.has_signs, is_complex, dtype })
    }
}

/// Sums of squares so far.
struct Sums {
    fold: Fold,
    at: usize,
    squares: Vec<f64>,
    has_signs: bool,
}

impl Sums {
    fn add(&mut self, numbers: impl Iterator<Item = f64>) {
        self.squares.resize(self.fold.cells, 0.0);
        for x in numbers {
            self.has_signs |= x < 0.0;
            let cell = self.fold.cell(self.at);
            if let Some(sum) = self.squares.get_mut(cell) {
                *sum += x * x;
            }
            self.at += 1;
        }
    }

    fn read(&mut self, source: &mut Source<'_>) -> Result<(), NpzError> {
        let Header { width, big_endian, scalar, .. } = source.header;
        let part = Header { shape: Vec::new(), ..source.header.clone() };
        // Of everything no more than a map is held.
        source.check((self.fold.cells.saturating_mul(width)) as u64, MAX_BYTES.saturating_mul(2))?;
        let total = source.header.len();
        while self.at < total {
            let count = (total - self.at).min(PIECE);
            let bytes = source.take((count * width) as u64)?;
            if scalar == Scalar::Complex {
                let both = bytes.chunks_exact(width).map(|number| {
                    let (re, im) = number.split_at(width / 2);
                    real(re, big_endian).hypot(real(im, big_endian))
                });
                self.add(both);
            } else {
                self.add(numbers(&bytes, &part).unwrap_or_default().into_iter());
            }
        }
        source.end()
    }
}

impl Form {
    /// Whether [`Self::with_folded`] takes a map of so many cells.
    ///
    /// # Errors
    /// As it.
    pub fn fits_folded(&self, cells: usize, fold: Fold) -> Result<(), String> {
        let header = self.header();
        if header.fortran {
            return Err("expected C order".into());
        }
        if cells != fold.cells || fold.len() != Some(header.len()) {
            return Err(format!("{cells} cells; the shape {} is another", shape_text(&header.shape)));
        }
        match (header.scalar, header.width) {
            (Scalar::Complex, 8 | 16) => Ok(()),
            (Scalar::Complex, _) => Err("expected complex64 or complex128".into()),
            _ => push(&mut Vec::new(), 0.0, header),
        }
    }

    /// The npy file, header included, of the array with the cells of its map as given. `measured` is the data of the array as it is:
    /// the numbers of a cell keep their ratios, and with them phases. Where all of them are 0 each becomes the same.
    ///
    /// # Errors
    /// In words: where the array is another, or its dtype holds no numbers.
    pub fn with_folded(&self, measured: &[u8], map: &[f64], fold: Fold) -> Result<Vec<u8>, String> {
        self.fits_folded(map.len(), fold)?;
        let header = self.header();
        let (width, complex) = (header.width, header.scalar == Scalar::Complex);
        let part = if complex {
            Header { scalar: Scalar::Float(width / 2), width: width / 2, ..header.clone() }
        } else {
            Header { shape: Vec::new(), ..header.clone() }
        };
        let values = |bytes: &[u8]| -> Vec<f64> {
            let plain = Header { shape: Vec::new(), ..part.clone() };
            numbers(bytes, &plain).unwrap_or_default()
        };
        let stored: Vec<Complex<f64>> = if complex {
            values(measured).chunks_exact(2).map(|pair| Complex::new(pair[0], pair[1])).collect()
        } else {
            values(measured).into_iter().map(Complex::from).collect()
        };
        let mut squares = vec![0.0; fold.cells];
        for (at, x) in stored.iter().enumerate() {
            squares[fold.cell(at)] += x.norm_sqr();
        }
        let over = fold.over.max(1) as f64;
        let each = (over / (fold.before * fold.after).max(1) as f64).sqrt();
        let mut bytes = self.head();
        bytes.reserve(measured.len());
        for (at, x) in stored.iter().enumerate() {
            let (cell, wanted) = (fold.cell(at), map.get(fold.cell(at)).copied().unwrap_or(0.0));
            let factor = wanted / (squares[cell] / over).sqrt();
            let number = if factor.is_finite() { x * factor } else { Complex::new(wanted * each, 0.0) };
            push(&mut bytes, number.re, &part)?;
            if complex {
                push(&mut bytes, number.im, &part)?;
            }
        }
        Ok(bytes)
    }
}
