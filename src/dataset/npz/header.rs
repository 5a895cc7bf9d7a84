//! The npy header: guarded first, then parsed by `npyz`.
//!
//! The parser multiplies the shape without a check and recurses on brackets, so a hostile header could panic it or
//! overflow the stack. [`guard`] admits only what numpy writes for arrays that this program can use.

use npyz::{DType, Endianness, NpyHeader, Order, TypeChar};
use std::io::Read;

/// numpy's own limit on the text of a header (`max_header_size`).
const MAX_HEADER: usize = 10_000;
/// Brackets in a header: a plain array has four, a record array two more for each field.
const MAX_BRACKETS: usize = 256;
/// Brackets inside each other.
const MAX_DEPTH: usize = 8;

/// What the bytes of one element are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Scalar {
    Bool,
    Int(usize),
    Uint(usize),
    Float(usize),
    Complex,
    /// UCS-4 text of so many code points.
    Text(usize),
    /// Byte strings of so many bytes.
    Bytes(usize),
    Object,
    Other,
}

impl Scalar {
    /// Bytes of one element, where they are fixed and known.
    fn width(self, total: Option<usize>) -> usize {
        match self {
            Self::Bool => 1,
            Self::Int(n) | Self::Uint(n) | Self::Float(n) | Self::Bytes(n) => n,
            Self::Text(n) => n.saturating_mul(4),
            Self::Complex | Self::Object | Self::Other => total.unwrap_or(0),
        }
    }
}

/// A parsed header.
#[derive(Debug, Clone)]
pub(super) struct Header {
    pub(super) shape: Vec<usize>,
    pub(super) dtype: String,
    pub(super) scalar: Scalar,
    pub(super) width: usize,
    pub(super) big_endian: bool,
    pub(super) fortran: bool,
    /// Bytes of magic, length and text.
    pub(super) bytes: u64,
}

impl Header {
    /// Elements; exact, because [`guard`] has bounded the product.
    pub(super) fn len(&self) -> usize {
        self.shape.iter().product()
    }

    /// Bytes that the data need; saturates, which no file can hold.
    pub(super) fn data_bytes(&self) -> u64 {
        (self.len() as u64).saturating_mul(self.width as u64)
    }
}

/// Reads and parses a header, leaving the reader at the first byte of data.
///
/// # Errors
/// In words, without file and key: the caller adds them.
pub(super) fn read_header(reader: &mut dyn Read) -> Result<Header, String> {
    let bytes = read_text(reader)?;
    let text_at = if bytes.get(6) == Some(&1) { 10 } else { 12 };
    guard(bytes.get(text_at..).unwrap_or_default())?;
    let parsed = NpyHeader::from_reader(bytes.as_slice()).map_err(|error| error.to_string())?;
    let (scalar, big_endian) = scalar_of(&parsed.dtype());
    let shape = parsed.shape().iter().map(|&n| usize::try_from(n).map_err(|_| "dimension too large".to_owned()));
    Ok(Header {
        shape: shape.collect::<Result<_, _>>()?,
        dtype: parsed.dtype().descr().trim_matches('\'').to_owned(),
        width: scalar.width(parsed.dtype().num_bytes()),
        scalar,
        big_endian,
        fortran: parsed.order() == Order::Fortran,
        bytes: bytes.len() as u64,
    })
}

fn read_text(reader: &mut dyn Read) -> Result<Vec<u8>, String> {
    let mut bytes = vec![0_u8; 10];
    reader.read_exact(&mut bytes).map_err(|error| format!("ends before its header does ({error})"))?;
    if bytes.get(..6) != Some(b"\x93NUMPY") {
        return Err(format!("no npy magic; it begins with {}", super::shown(&bytes)));
    }
    let word = |bytes: &[u8], at: usize| usize::from(bytes.get(at).copied().unwrap_or(0));
    let length = match bytes.get(6) {
        Some(1) => word(&bytes, 8) | word(&bytes, 9) << 8,
        Some(2 | 3) => {
            let mut more = [0_u8; 2];
            reader.read_exact(&mut more).map_err(|error| error.to_string())?;
            bytes.extend(more);
            (0..4).map(|i| word(&bytes, 8 + i) << (8 * i)).sum()
        }
        _ => return Err(format!("unsupported npy version {}", word(&bytes, 6))),
    };
    if length > MAX_HEADER {
        return Err(format!("it is {length} bytes long; expected at most {MAX_HEADER}"));
    }
    let start = bytes.len();
    bytes.resize(start + length, 0);
    let text = bytes.get_mut(start..).unwrap_or_default();
    reader.read_exact(text).map_err(|error| format!("ends before its header does ({error})"))?;
    Ok(bytes)
}

/// Refuses what the parser could not survive: odd text, deep nesting, a shape whose product does not fit.
fn guard(text: &[u8]) -> Result<(), String> {
    let text = std::str::from_utf8(text).map_err(|_| "not UTF-8".to_owned())?;
    let (mut depth, mut brackets) = (0_usize, 0_usize);
    for c in text.chars() {
        match c {
            '(' | '[' | '{' => {
                depth += 1;
                brackets += 1;
            }
            ')' | ']' | '}' => depth = depth.saturating_sub(1),
            '\\' => return Err("it has a backslash".into()),
            _ => {}
        }
        if depth > MAX_DEPTH || brackets > MAX_BRACKETS {
            return Err("its brackets are nested too deep".into());
        }
    }
    let mut parts = text.split("shape");
    let (Some(_), Some(after), None) = (parts.next(), parts.next(), parts.next()) else {
        return Err("expected exactly one `shape`".into());
    };
    let inside = after.split_once('(').and_then(|(_, rest)| rest.split_once(')')).map(|(inside, _)| inside);
    check_shape(inside.ok_or("`shape` is not a tuple")?)
}

fn check_shape(inside: &str) -> Result<(), String> {
    let mut product = 1_usize;
    for part in inside.split(',').map(str::trim).filter(|part| !part.is_empty()) {
        let size: usize = part.parse().map_err(|_| format!("`{part}` is not a dimension"))?;
        // Zeros count as ones: the parser's strides multiply the other dimensions too.
        let product_now = product.checked_mul(size.max(1)).filter(|&p| p <= isize::MAX as usize / 64);
        product = product_now.ok_or_else(|| format!("shape ({inside}) is too large; refused before allocating"))?;
    }
    Ok(())
}

fn scalar_of(dtype: &DType) -> (Scalar, bool) {
    let DType::Plain(text) = dtype else {
        return (if dtype.uses_pickled_array() { Scalar::Object } else { Scalar::Other }, false);
    };
    let size = usize::try_from(text.size_field()).unwrap_or(usize::MAX);
    let scalar = match text.type_char() {
        TypeChar::Bool => Scalar::Bool,
        TypeChar::Int => Scalar::Int(size),
        TypeChar::Uint => Scalar::Uint(size),
        TypeChar::Float if size <= 8 => Scalar::Float(size),
        TypeChar::Complex => Scalar::Complex,
        TypeChar::UnicodeStr => Scalar::Text(size),
        TypeChar::ByteStr => Scalar::Bytes(size),
        TypeChar::Object => Scalar::Object,
        _ => Scalar::Other,
    };
    (scalar, text.endianness() == Endianness::Big)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn npy(text: &str) -> Vec<u8> {
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((text.len() as u16).to_le_bytes());
        bytes.extend(text.as_bytes());
        bytes
    }

    fn refusal(text: &str) -> String {
        read_header(&mut npy(text).as_slice()).err().unwrap_or_else(|| "accepted".into())
    }

    #[test]
    fn reads_what_numpy_writes() {
        let text = "{'descr': '>f4', 'fortran_order': True, 'shape': (2, 3), }";
        let header = read_header(&mut npy(text).as_slice()).ok();
        let header = header.map(|h| (h.shape, h.dtype, h.scalar, h.width, h.big_endian, h.fortran));
        assert_eq!(header, Some((vec![2, 3], ">f4".to_owned(), Scalar::Float(4), 4, true, true)));
    }

    #[test]
    fn refuses_hostile_headers_without_a_panic() {
        let shape = |s: &str| format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {s}, }}");
        assert!(refusal(&shape("(4294967296, 4294967296, 4294967296)")).contains("too large"));
        assert!(refusal(&shape("(9223372036854775807, 9223372036854775807, 0)")).contains("too large"));
        assert!(refusal(&shape("(-1,)")).contains("not a dimension"));
        assert!(refusal(&shape("12")).contains("not a tuple"));
        assert!(refusal(&"[".repeat(5000)).contains("nested"));
        assert!(refusal("{'sh\\x61pe': (99999999999999,)}").contains("backslash"));
        assert!(refusal("{'shape': (1,), 'shape': (99999999999,99999999999)}").contains("exactly one"));
        assert!(refusal("nonsense").contains("exactly one"));
        assert!(read_header(&mut b"\x93NUMPY\x02\x00\xff\xff\xff\x7f".as_slice()).is_err());
        assert!(read_header(&mut b"\x93NUM".as_slice()).is_err());
    }
}
