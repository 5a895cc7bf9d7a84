//! Bytes of an array to numbers, flags or text in C order.

use super::header::{Header, Scalar};
use half::f16;

/// An array read from disk: C order, cast to `f64`.
#[derive(Debug, Clone, PartialEq)]
pub struct Array {
    /// Its shape; empty for a scalar.
    pub shape: Vec<usize>,
    /// Elements, last axis fastest. NaN and infinities as stored; flags are 0 and 1.
    pub data: Vec<f64>,
    /// The dtype in the file, for example `<f4`.
    pub dtype: String,
}

/// Real numbers and flags as `f64`; `None` for any other dtype.
pub(super) fn numbers(bytes: &[u8], header: &Header) -> Option<Vec<f64>> {
    macro_rules! cast {
        ($type:ty) => {{
            const N: usize = size_of::<$type>();
            let elements = bytes.chunks_exact(N).map(|chunk| <[u8; N]>::try_from(chunk).unwrap_or([0; N]));
            if header.big_endian {
                elements.map(|e| f64::from(<$type>::from_be_bytes(e))).collect()
            } else {
                elements.map(|e| f64::from(<$type>::from_le_bytes(e))).collect()
            }
        }};
    }
    let long = |signed: bool| -> Vec<f64> {
        let elements = bytes.chunks_exact(8).map(|chunk| <[u8; 8]>::try_from(chunk).unwrap_or([0; 8]));
        let words = elements.map(|e| if header.big_endian { u64::from_be_bytes(e) } else { u64::from_le_bytes(e) });
        if signed { words.map(|w| w as i64 as f64).collect() } else { words.map(|w| w as f64).collect() }
    };
    let data: Vec<f64> = match header.scalar {
        Scalar::Bool | Scalar::Uint(1) => bytes.iter().map(|&b| f64::from(b)).collect(),
        Scalar::Uint(2) => cast!(u16),
        Scalar::Uint(4) => cast!(u32),
        Scalar::Uint(8) => long(false),
        Scalar::Int(1) => cast!(i8),
        Scalar::Int(2) => cast!(i16),
        Scalar::Int(4) => cast!(i32),
        Scalar::Int(8) => long(true),
        Scalar::Float(2) => cast!(f16),
        Scalar::Float(4) => cast!(f32),
        Scalar::Float(8) => cast!(f64),
        _ => return None,
    };
    Some(in_c_order(data, header))
}

/// Flags; any byte but 0 is true. `None` for a dtype other than `bool` and `uint8`.
pub(super) fn flags(bytes: &[u8], header: &Header) -> Option<Vec<bool>> {
    matches!(header.scalar, Scalar::Bool | Scalar::Uint(1))
        .then(|| in_c_order(bytes.iter().map(|&b| b != 0).collect(), header))
}

/// Every element as text: strings as they are, integers in full, floats in their shortest form. `None` for other dtypes.
pub(super) fn texts(bytes: &[u8], header: &Header) -> Option<Vec<String>> {
    let word = |chunk: &[u8]| {
        let bytes = <[u8; 4]>::try_from(chunk).unwrap_or([0; 4]);
        if header.big_endian { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) }
    };
    let long = |chunk: &[u8]| {
        let bytes = <[u8; 8]>::try_from(chunk).unwrap_or([0; 8]);
        if header.big_endian { u64::from_be_bytes(bytes) } else { u64::from_le_bytes(bytes) }
    };
    let ucs4 = |chunk: &[u8]| -> String {
        chunk.chunks_exact(4).map(word).take_while(|&c| c != 0).filter_map(char::from_u32).collect()
    };
    let texts = match header.scalar {
        Scalar::Text(0) | Scalar::Bytes(0) => vec![String::new(); header.len()],
        Scalar::Text(n) => bytes.chunks_exact(n.saturating_mul(4)).map(ucs4).collect(),
        Scalar::Bytes(n) => {
            let text = |c: &[u8]| String::from_utf8_lossy(c).trim_end_matches('\0').to_owned();
            bytes.chunks_exact(n).map(text).collect()
        }
        Scalar::Int(8) => bytes.chunks_exact(8).map(|c| (long(c) as i64).to_string()).collect(),
        Scalar::Uint(8) => bytes.chunks_exact(8).map(|c| long(c).to_string()).collect(),
        _ => return numbers(bytes, header).map(|data| data.iter().map(f64::to_string).collect()),
    };
    Some(in_c_order(texts, header))
}

/// Elements in file order to C order.
fn in_c_order<T: Clone>(data: Vec<T>, header: &Header) -> Vec<T> {
    let shape = &header.shape;
    if !header.fortran || shape.len() < 2 || data.is_empty() {
        return data;
    }
    // The stride of axis k in the file is the product of the sizes before it.
    let strides: Vec<usize> =
        shape.iter().scan(1_usize, |stride, &size| Some(std::mem::replace(stride, *stride * size))).collect();
    let mut index = vec![0_usize; shape.len()];
    let mut at = 0_usize;
    let mut sorted = Vec::with_capacity(data.len());
    for _ in 0..data.len() {
        sorted.extend(data.get(at).cloned());
        for ((i, &size), &stride) in index.iter_mut().zip(shape).zip(&strides).rev() {
            *i += 1;
            at += stride;
            if *i < size {
                break;
            }
            at -= stride * size;
            *i = 0;
        }
    }
    sorted
}
