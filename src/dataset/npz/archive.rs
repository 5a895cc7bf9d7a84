//! Reading: one type for `.npz` and `.npy`, told apart by their first bytes, not by their names.

use super::decode::{Array, flags, numbers, texts};
use super::header::{Header, Scalar, read_header};
use super::{Form, NpzError, shape_text, shown};
use crate::input::open_file;
use std::fs::File;
use std::io::{BufReader, Read, Seek};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// The key under which the only array of an `.npy` file is known.
pub const NPY_KEY: &str = "array";
/// Elements of an array that are held at once: 2²⁴, 128 MiB once they are `f64`. A cube of 256 × 256 × 256 cells has as many.
pub const MAX_ELEMENTS: usize = 1 << 24;
/// Bytes of an array that are held at once as they lie in the file: elements of text can be wide.
pub(super) const MAX_BYTES: u64 = 8 * MAX_ELEMENTS as u64;
/// Deflate cannot pack tighter than this, so an entry that claims more lies about its size.
const MAX_RATIO: u64 = 1032;
/// Rows of the last axis that are read at a time where an array is read in pieces.
const PIECE_ROWS: usize = 4096;
/// What maps and labels may be made of.
const REAL: &str = "real numbers (float16/32/64, int, uint or bool)";

/// One array of an archive, as its header describes it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Entry {
    /// Its key.
    pub key: String,
    /// Its dtype as in the file, for example `<f4`.
    pub dtype: String,
    /// Its shape.
    pub shape: Vec<usize>,
    /// True for a dtype that [`NpzArchive::read`] accepts.
    pub is_real: bool,
}

enum Kind {
    Npz(zip::ZipArchive<BufReader<File>>),
    Npy(File),
}

/// An open `.npz` archive, or an `.npy` file seen as an archive with the one key [`NPY_KEY`].
pub struct NpzArchive {
    kind: Kind,
    keys: Vec<String>,
    file_bytes: u64,
    path: PathBuf,
}

impl NpzArchive {
    /// Opens a file and reads its directory, no data.
    ///
    /// # Errors
    /// Where it cannot be opened, is empty, is neither npz nor npy, or is truncated.
    pub fn open(path: &Path) -> Result<Self, NpzError> {
        let read_error = |reason| NpzError::Read { reason, path: path.to_owned() };
        let mut file = open_file(path, "an npz or npy file").map_err(read_error)?;
        let meta = file.metadata().map_err(read_error)?;
        let mut magic = Vec::new();
        (&mut file).take(32).read_to_end(&mut magic).map_err(read_error)?;
        file.rewind().map_err(read_error)?;
        let (kind, keys) = if magic.is_empty() {
            return Err(NpzError::Empty { path: path.to_owned() });
        } else if magic.starts_with(b"PK") {
            let archive = zip::ZipArchive::new(BufReader::new(file))
                .map_err(|error| NpzError::BadArchive { message: error.to_string(), path: path.to_owned() })?;
            let arrays = archive.file_names().filter_map(npyz::npz::array_name_from_file_name);
            let mut keys: Vec<String> = arrays.map(str::to_owned).collect();
            keys.sort();
            (Kind::Npz(archive), keys)
        } else if magic.starts_with(b"\x93NUMPY") {
            (Kind::Npy(file), vec![NPY_KEY.to_owned()])
        } else {
            return Err(NpzError::NotAnArchive { found: shown(&magic), path: path.to_owned() });
        };
        Ok(Self { kind, keys, file_bytes: meta.len(), path: path.to_owned() })
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Every key, sorted.
    pub fn keys(&self) -> &[String] {
        &self.keys
    }

    /// True where `key` exists.
    pub fn contains(&self, key: &str) -> bool {
        self.keys.iter().any(|k| k == key)
    }

    /// Key, dtype and shape of every array, sorted by key, without reading data.
    ///
    /// # Errors
    /// Where a header is damaged.
    pub fn entries(&mut self) -> Result<Vec<Entry>, NpzError> {
        let keys = self.keys.clone();
        keys.iter().map(|key| self.entry(key)).collect()
    }

    /// Key, dtype and shape of one array, without reading data.
    ///
    /// # Errors
    /// Where it is missing or its header is damaged.
    pub fn entry(&mut self, key: &str) -> Result<Entry, NpzError> {
        let header = self.with_entry(key, |source| Ok(source.header.clone()))?;
        let is_real = matches!(header.scalar, Scalar::Bool | Scalar::Int(_) | Scalar::Uint(_) | Scalar::Float(_));
        Ok(Entry { key: key.to_owned(), dtype: header.dtype, shape: header.shape, is_real })
    }

    /// How one array lies in the file, without reading data.
    ///
    /// # Errors
    /// Where it is missing or its header is damaged.
    pub fn form(&mut self, key: &str) -> Result<Form, NpzError> {
        self.with_entry(key, |source| Ok(Form::new(source.header.clone())))
    }

    /// Refuses an array by its header, before a byte of its data is read: `fits` says what was expected where a shape does not.
    ///
    /// # Errors
    /// Where it is missing, its header is damaged, or its shape does not fit.
    pub(crate) fn require(
        &mut self,
        key: &str,
        fits: impl FnOnce(&[usize]) -> Result<(), String>,
    ) -> Result<(), NpzError> {
        let shape = self.with_entry(key, |source| Ok(source.header.shape.clone()))?;
        fits(&shape).map_err(|expected| self.wrong_shape(key, &shape, expected))
    }

    /// As [`Self::require`], for exactly this shape, which `why` explains.
    ///
    /// # Errors
    /// As [`Self::require`].
    pub(crate) fn require_shape(&mut self, key: &str, shape: &[usize], why: &str) -> Result<(), NpzError> {
        let fits = |got: &[usize]| if got == shape { Ok(()) } else { Err(format!("{}{why}", shape_text(shape))) };
        self.require(key, fits)
    }

    /// Refuses an array whose data have more bytes than a caller has use for.
    ///
    /// # Errors
    /// Where it is missing, its header is damaged, or it is larger.
    pub(crate) fn require_bytes(&mut self, key: &str, most: u64) -> Result<(), NpzError> {
        self.with_entry(key, |source| source.check(source.header.data_bytes(), most))
    }

    /// Reads an array to its end without keeping it, so that the archive compares its checksum. An `.npy` file has none.
    ///
    /// # Errors
    /// Where it is missing, or damaged.
    pub fn verify(&mut self, key: &str) -> Result<(), NpzError> {
        if matches!(self.kind, Kind::Npy(_)) {
            return Ok(());
        }
        self.with_entry(key, |source| {
            let read = std::io::copy(&mut source.reader, &mut std::io::sink());
            read.map(drop).map_err(|error| source.corrupt(error.to_string()))
        })
    }

    /// The data of one array as they lie in the file, without its header, to their end.
    ///
    /// # Errors
    /// As [`Self::read`], of any dtype but objects.
    pub fn bytes(&mut self, key: &str) -> Result<Vec<u8>, NpzError> {
        Ok(self.read_bytes(key)?.0)
    }

    /// Reads an array of real numbers to its end, checksum included.
    ///
    /// # Errors
    /// Missing key, object array, complex numbers or text, a size that the file cannot hold or that is beyond
    /// [`MAX_ELEMENTS`], damaged data.
    pub fn read(&mut self, key: &str) -> Result<Array, NpzError> {
        let (bytes, header) = self.read_bytes(key)?;
        let data = numbers(&bytes, &header).ok_or_else(|| self.wrong_type(key, &header, REAL))?;
        Ok(Array { shape: header.shape, data, dtype: header.dtype })
    }

    /// Reads the slab `index` of an array along its first axis: what [`Self::read`] would give, of one dimension less.
    /// In C order only the bytes up to the slab are read, so the archive's checksum is not compared: see [`Self::verify`].
    ///
    /// # Errors
    /// As [`Self::read`], and where the first axis has no such index.
    pub fn read_slab(&mut self, key: &str, index: usize) -> Result<Array, NpzError> {
        let Array { mut shape, data, dtype } = self.read_slabs(key, index..index.saturating_add(1))?;
        shape.remove(0);
        Ok(Array { shape, data, dtype })
    }

    /// Reads consecutive slabs of an array along its first axis in one pass: shape (slabs, …rest).
    ///
    /// # Errors
    /// As [`Self::read_slab`], and for an empty range.
    pub fn read_slabs(&mut self, key: &str, slabs: Range<usize>) -> Result<Array, NpzError> {
        let header = self.with_entry(key, |source| Ok(source.header.clone()))?;
        let inside = |n: usize| slabs.start < slabs.end && slabs.end <= n;
        let Some((_, rest)) = header.shape.split_first().filter(|&(&n, _)| inside(n)) else {
            let expected = format!("a first axis longer than {}", slabs.end.saturating_sub(1));
            return Err(self.wrong_shape(key, &header.shape, expected));
        };
        let cells: usize = rest.iter().product();
        let shape = [&[slabs.len()], rest].concat();
        if header.fortran {
            let whole = self.read(key)?;
            let data = whole.data.get(slabs.start * cells..slabs.end * cells).unwrap_or_default().to_vec();
            return Ok(Array { shape, data, dtype: whole.dtype });
        }
        let bytes = self.with_entry(key, |source| source.slabs(&slabs, cells))?;
        let part = Header { shape: shape.clone(), ..header };
        let data = numbers(&bytes, &part).ok_or_else(|| self.wrong_type(key, &part, REAL))?;
        Ok(Array { shape, data, dtype: part.dtype })
    }

    /// Reads the amplitudes of an array of complex numbers whose last axis has `every` elements, of its element `first` only: an
    /// array of one axis less. The file is read in pieces, so that little more than the result is held.
    ///
    /// # Errors
    /// As [`Self::read`], for any dtype but `complex64` and `complex128`, and where the last axis has another length.
    pub fn read_amplitudes(&mut self, key: &str, every: usize, first: usize) -> Result<Array, NpzError> {
        let header = self.with_entry(key, |source| Ok(source.header.clone()))?;
        if header.scalar != Scalar::Complex || !matches!(header.width, 8 | 16) {
            return Err(self.wrong_type(key, &header, "complex numbers (complex64 or complex128)"));
        }
        if header.shape.last() != Some(&every) || header.fortran {
            let expected = format!("a last axis of {every}, in C order");
            return Err(self.wrong_shape(key, &header.shape, expected));
        }
        let data = self.with_entry(key, |source| source.amplitudes(every, first))?;
        let shape = header.shape.get(..header.shape.len() - 1).unwrap_or_default().to_vec();
        Ok(Array { shape, data, dtype: header.dtype })
    }

    /// Reads an array of flags: shape and elements in C order.
    ///
    /// # Errors
    /// As [`Self::read`], for any dtype but `bool` and `uint8`.
    pub fn read_flags(&mut self, key: &str) -> Result<(Vec<usize>, Vec<bool>), NpzError> {
        let (bytes, header) = self.read_bytes(key)?;
        let data = flags(&bytes, &header).ok_or_else(|| self.wrong_type(key, &header, "bool or uint8"))?;
        Ok((header.shape, data))
    }

    /// Reads every element as text: unicode, bytes, and integers in full.
    ///
    /// # Errors
    /// As [`Self::read`], for complex and structured dtypes.
    pub fn read_texts(&mut self, key: &str) -> Result<Vec<String>, NpzError> {
        let (bytes, header) = self.read_bytes(key)?;
        texts(&bytes, &header).ok_or_else(|| self.wrong_type(key, &header, "text or numbers"))
    }

    /// The error for a shape that the caller did not expect.
    pub(crate) fn wrong_shape(&self, key: &str, got: &[usize], expected: String) -> NpzError {
        NpzError::WrongShape { key: key.to_owned(), got: shape_text(got), expected, path: self.path.clone() }
    }

    pub(super) fn wrong_type(&self, key: &str, header: &Header, expected: &'static str) -> NpzError {
        let (key, path) = (key.to_owned(), self.path.clone());
        if header.scalar == Scalar::Object {
            return NpzError::Pickled { key, path };
        }
        NpzError::WrongType { key, dtype: header.dtype.clone(), expected, path }
    }

    fn read_bytes(&mut self, key: &str) -> Result<(Vec<u8>, Header), NpzError> {
        self.with_entry(key, |source| {
            let bytes = source.all()?;
            Ok((bytes, source.header.clone()))
        })
    }

    /// Calls `read` with the entry, its header parsed and the reader at the first byte of data.
    pub(super) fn with_entry<T>(
        &mut self,
        key: &str,
        read: impl FnOnce(&mut Source<'_>) -> Result<T, NpzError>,
    ) -> Result<T, NpzError> {
        if !self.contains(key) {
            let present = if self.keys.is_empty() { "no arrays".to_owned() } else { self.keys.join(", ") };
            return Err(NpzError::MissingKey { key: key.to_owned(), present, path: self.path.clone() });
        }
        let (path, file_bytes) = (self.path.as_path(), self.file_bytes);
        match &mut self.kind {
            Kind::Npy(file) => {
                file.rewind().map_err(|reason| NpzError::Read { reason, path: path.to_owned() })?;
                let mut reader = BufReader::new(file);
                let header = parse(&mut reader, key, path)?;
                read(&mut Source { reader: &mut reader, header, available: file_bytes, key, path })
            }
            Kind::Npz(archive) => {
                let name = npyz::npz::file_name_from_array_name(key);
                let mut entry = archive
                    .by_name(&name)
                    .map_err(|error| NpzError::BadArchive { message: error.to_string(), path: path.to_owned() })?;
                let packed = entry.compressed_size().min(file_bytes);
                let available = entry.size().min(packed.saturating_mul(MAX_RATIO).saturating_add(64));
                let header = parse(&mut entry, key, path)?;
                read(&mut Source { reader: &mut entry, header, available, key, path })
            }
        }
    }
}

/// Reads one array of real numbers.
///
/// # Errors
/// See [`NpzArchive::open`] and [`NpzArchive::read`].
pub fn read_array(path: &Path, key: &str) -> Result<Array, NpzError> {
    NpzArchive::open(path)?.read(key)
}

/// Four or eight bytes as a float; NaN for any other number of them.
pub(super) fn real(bytes: &[u8], big_endian: bool) -> f64 {
    if let Ok(four) = <[u8; 4]>::try_from(bytes) {
        f64::from(if big_endian { f32::from_be_bytes(four) } else { f32::from_le_bytes(four) })
    } else if let Ok(eight) = <[u8; 8]>::try_from(bytes) {
        if big_endian { f64::from_be_bytes(eight) } else { f64::from_le_bytes(eight) }
    } else {
        f64::NAN
    }
}

fn parse(reader: &mut dyn Read, key: &str, path: &Path) -> Result<Header, NpzError> {
    let bad = |message| NpzError::BadHeader { key: key.to_owned(), message, path: path.to_owned() };
    read_header(reader).map_err(bad)
}

/// One entry, about to be read.
pub(super) struct Source<'a> {
    reader: &'a mut dyn Read,
    pub(super) header: Header,
    /// Bytes that the entry can hold at most, header included.
    available: u64,
    key: &'a str,
    path: &'a Path,
}

impl Source<'_> {
    fn corrupt(&self, message: String) -> NpzError {
        NpzError::Corrupt { key: self.key.to_owned(), message, path: self.path.to_owned() }
    }

    /// Refuses object arrays, sizes that cannot be there, and reading more than `most` bytes at once, before anything is
    /// allocated; `bytes` is what is about to be held.
    pub(super) fn check(&self, bytes: u64, most: u64) -> Result<(), NpzError> {
        let (key, path) = (self.key.to_owned(), self.path.to_owned());
        let elements = usize::try_from(bytes / self.header.width.max(1) as u64).unwrap_or(usize::MAX);
        if self.header.scalar == Scalar::Object {
            return Err(NpzError::Pickled { key, path });
        }
        let declared = self.header.data_bytes();
        let holds = self.available.saturating_sub(self.header.bytes);
        let limit = if declared > holds {
            format!("the file holds at most {holds}; refused before allocating")
        } else if bytes > most || elements > MAX_ELEMENTS {
            let most = most / self.header.width.max(1) as u64;
            format!(
                "at most {} elements of it are read at once; refused before allocating",
                most.min(MAX_ELEMENTS as u64)
            )
        } else {
            return Ok(());
        };
        Err(NpzError::TooLarge { key, shape: shape_text(&self.header.shape), declared, limit, path })
    }

    /// Reads exactly `count` bytes.
    pub(super) fn take(&mut self, count: u64) -> Result<Vec<u8>, NpzError> {
        let mut bytes = Vec::with_capacity(usize::try_from(count).unwrap_or(0));
        let got = (&mut *self.reader).take(count).read_to_end(&mut bytes);
        match got {
            Ok(got) if got as u64 == count => Ok(bytes),
            Ok(got) => Err(self.corrupt(format!("its data end after {got} of {count} bytes"))),
            Err(error) => Err(self.corrupt(error.to_string())),
        }
    }

    /// All bytes of the data; the read past them makes the archive check its sum.
    fn all(&mut self) -> Result<Vec<u8>, NpzError> {
        self.check(self.header.data_bytes(), MAX_BYTES)?;
        let bytes = self.take(self.header.data_bytes())?;
        self.end()?;
        Ok(bytes)
    }

    /// The read past the data, which must give nothing.
    pub(super) fn end(&mut self) -> Result<(), NpzError> {
        match self.reader.read(&mut [0_u8]) {
            Ok(0) => Ok(()),
            Ok(_) => Err(self.corrupt("it goes on after the declared shape is full".into())),
            Err(error) => Err(self.corrupt(error.to_string())),
        }
    }

    /// |x| of every `every`th complex number from `first` on.
    fn amplitudes(&mut self, every: usize, first: usize) -> Result<Vec<f64>, NpzError> {
        let rows = self.header.len() / every.max(1);
        let row = (every * self.header.width) as u64;
        let (width, big_endian) = (self.header.width, self.header.big_endian);
        // One number of a row is kept, of half the width of a complex one or more.
        self.check((rows * width) as u64, MAX_BYTES.saturating_mul(2))?;
        let mut data = Vec::with_capacity(rows);
        while data.len() < rows {
            let count = (rows - data.len()).min(PIECE_ROWS);
            let bytes = self.take(count as u64 * row)?;
            let picked = bytes.chunks_exact(every * width).map(|row| {
                let number = row.get(first * width..(first + 1) * width).unwrap_or_default();
                let (re, im) = number.split_at(number.len() / 2);
                real(re, big_endian).hypot(real(im, big_endian))
            });
            data.extend(picked);
        }
        self.end()?;
        Ok(data)
    }

    /// The bytes of these slabs, of `cells` elements each.
    fn slabs(&mut self, slabs: &Range<usize>, cells: usize) -> Result<Vec<u8>, NpzError> {
        let slab = (cells as u64).saturating_mul(self.header.width as u64);
        let count = slab.saturating_mul(slabs.len() as u64);
        self.check(count, MAX_BYTES)?;
        let skip = slab.saturating_mul(slabs.start as u64);
        let skipped = std::io::copy(&mut (&mut *self.reader).take(skip), &mut std::io::sink());
        match skipped {
            Ok(got) if got == skip => self.take(count),
            Ok(got) => Err(self.corrupt(format!("its data end after {got} bytes"))),
            Err(error) => Err(self.corrupt(error.to_string())),
        }
    }
}
