//! What is done to bytes and texts.

use rand::Rng as _;
use rand::rngs::StdRng;
use rand::seq::IndexedRandom as _;

/// Numbers that break arithmetic.
pub(crate) const NUMBERS: [&str; 24] = [
    "0",
    "-0.0",
    "1",
    "-1",
    "2",
    "1e308",
    "-1e308",
    "1e-308",
    "5e-324",
    "nan",
    "inf",
    "-inf",
    "4294967296",
    "2147483647",
    "9223372036854775807",
    "-9223372036854775808",
    "18446744073709551616",
    "1e9",
    "1e-9",
    "0.5",
    "255",
    "65536",
    "1e30",
    "1e-30",
];
/// Texts that break readers.
const TEXTS: [&str; 12] = [
    "\"\"",
    "\"\\u0000\"",
    "[]",
    "{}",
    "null",
    "true",
    "\"..\"",
    "\"/etc/passwd\"",
    "[[]]",
    "\"\u{202e}x\"",
    "'",
    "\"a\\nb\"",
];
const WORDS: [u64; 10] = [0, 1, 0x7f, 0xff, 0x7fff_ffff, 0xffff_ffff, 1 << 28, 1 << 40, i64::MAX as u64, u64::MAX];

/// One to four changes of bytes.
pub(crate) fn bytes(data: &mut Vec<u8>, random: &mut StdRng) {
    for _ in 0..random.random_range(1..=4) {
        let at = random.random_range(0..=data.len());
        match random.random_range(0..8) {
            0 => data.truncate(at),
            1 => data.insert(at, random.random()),
            2 => drop(data.splice(at.., std::iter::empty::<u8>()).take(random.random_range(0..9)).count()),
            3 => {
                let end = (at + random.random_range(0..64)).min(data.len());
                let piece = data[at..end].to_vec();
                data.splice(at..at, piece);
            }
            4 | 5 => {
                let word = WORDS.choose(random).copied().unwrap_or(0).to_le_bytes();
                let width = [1, 2, 4, 8][random.random_range(0..4)];
                for (k, byte) in word.into_iter().take(width).enumerate() {
                    if let Some(there) = data.get_mut(at + k) {
                        *there = byte;
                    }
                }
            }
            _ => {
                if let Some(byte) = data.get_mut(at) {
                    *byte ^= 1 << random.random_range(0..8);
                }
            }
        }
    }
}

/// One to three changes of a text: another number, another value, a line lost or twice; or of its bytes.
pub(crate) fn text(text: &str, random: &mut StdRng) -> Vec<u8> {
    let mut text = text.to_owned();
    for _ in 0..random.random_range(1..=3) {
        match random.random_range(0..8) {
            0..=3 => text = other_number(&text, random),
            4 => {
                let mut lines: Vec<&str> = text.lines().collect();
                let at = random.random_range(0..=lines.len().saturating_sub(1));
                if random.random() && at < lines.len() {
                    lines.remove(at);
                } else if let Some(line) = lines.get(at).copied() {
                    lines.insert(at, line);
                }
                text = lines.join("\n");
            }
            5 => {
                let quoted: Vec<usize> = text.match_indices('"').map(|(at, _)| at).collect();
                if let Some(&[from, to]) =
                    quoted.chunks_exact(2).collect::<Vec<_>>().choose(random).map(|pair| &pair[..])
                {
                    text.replace_range(from..=to, TEXTS.choose(random).copied().unwrap_or(""));
                }
            }
            _ => {
                let mut raw = text.into_bytes();
                bytes(&mut raw, random);
                text = String::from_utf8_lossy(&raw).into_owned();
            }
        }
    }
    text.into_bytes()
}

/// Another number in the place of one.
fn other_number(text: &str, random: &mut StdRng) -> String {
    let digit = |c: char| c.is_ascii_digit() || matches!(c, '.' | 'e' | '-' | '+');
    let mut spans = Vec::new();
    let mut from = None;
    for (at, c) in text.char_indices().chain([(text.len(), ' ')]) {
        match from {
            None if c.is_ascii_digit() => from = Some(at),
            Some(start) if !digit(c) => {
                spans.push(start..at);
                from = None;
            }
            _ => {}
        }
    }
    let Some(span) = spans.choose(random).cloned() else { return text.to_owned() };
    let mut text = text.to_owned();
    text.replace_range(span, NUMBERS.choose(random).copied().unwrap_or("0"));
    text
}
