//! Text that comes from data, on its way to a terminal or into a table.
//!
//! Names of frames and arrays, paths, annotators, notes and manifests may hold anything: a sequence that a terminal obeys, a
//! line break that forges a line, a sign that turns a line around, a formula that a spreadsheet computes. All of it passes
//! one of the functions here where it is printed or written. Ordinary text of any script, and emoji, pass as they are.

use std::borrow::Cow;
use std::fmt::Write as _;
use std::sync::atomic::{AtomicBool, Ordering};

/// True for what is not seen but does something: control characters (C0, DEL, C1), line and paragraph separators, marks that
/// turn the direction of writing.
fn is_hidden(c: char) -> bool {
    c.is_control()
        || matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// The text with everything hidden shown: `\n`, `\t`, `\u{1b}`. It is one line, whatever it was: for a cell of a table, a
/// name, an error.
pub fn one_line(text: &str) -> Cow<'_, str> {
    shown(text, is_hidden)
}

/// As [`one_line`], for text of several lines whose parts from data are in one line each already.
pub fn lines(text: &str) -> Cow<'_, str> {
    shown(text, |c| c != '\n' && is_hidden(c))
}

fn shown(text: &str, hidden: impl Fn(char) -> bool) -> Cow<'_, str> {
    if !text.contains(&hidden) {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        if hidden(c) { out.extend(c.escape_default()) } else { out.push(c) }
    }
    Cow::Owned(out)
}

/// JSON with everything hidden in its strings as `\u009b`: serde escapes the control characters up to U+001F only. It says
/// the same as before.
pub fn json(text: &str) -> Cow<'_, str> {
    // Between strings there are none but line breaks.
    let hidden = |c: char| c > '\u{1f}' && is_hidden(c);
    if !text.contains(hidden) {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        if hidden(c) {
            // All of them are below U+10000, hence one unit of UTF-16.
            let _ = write!(out, "\\u{:04x}", u32::from(c));
        } else {
            out.push(c);
        }
    }
    Cow::Owned(out)
}

/// Text cells of tables are written, and read, as they are.
static PLAIN: AtomicBool = AtomicBool::new(false);

/// Switches the protection of [`to_cell`] and [`from_cell`] off: what `--csv-plain` asks for, before anything is written.
pub fn plain_cells() {
    PLAIN.store(true, Ordering::Relaxed);
}

/// True for text that a spreadsheet takes for a formula, whatever number of apostrophes is before it.
fn is_formula(text: &str) -> bool {
    let text = text.trim_start_matches('\'');
    text.starts_with(['=', '+', '-', '@', '\t', '\r', '\n', '＝', '＋', '－', '＠'])
}

/// A text for a cell of a CSV: one apostrophe before what a spreadsheet would compute. Never for numbers.
pub fn to_cell(text: &str) -> Cow<'_, str> {
    if PLAIN.load(Ordering::Relaxed) || !is_formula(text) {
        return Cow::Borrowed(text);
    }
    Cow::Owned(format!("'{text}"))
}

/// The text of a cell that [`to_cell`] made: exactly what it was.
pub fn from_cell(cell: &str) -> &str {
    let inner = cell.strip_prefix('\'').filter(|_| !PLAIN.load(Ordering::Relaxed));
    inner.filter(|inner| is_formula(inner)).unwrap_or(cell)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_terminal_obeys_is_shown_and_the_rest_is_left() {
        for plain in ["d1s1/000/00383", "é τ 中文 עברית 👩‍👩‍👧 “x” \\ '", "C:\\data", ""] {
            assert!(matches!(one_line(plain), Cow::Borrowed(text) if text == plain), "{plain}");
            assert!(matches!(json(plain), Cow::Borrowed(_)), "{plain}");
        }
        assert_eq!(one_line("\u{1b}]0;x\u{7}\u{9b}2J\u{7f}"), "\\u{1b}]0;x\\u{7}\\u{9b}2J\\u{7f}");
        assert_eq!(one_line("a\r\nerror: b\tc\u{2028}d"), "a\\r\\nerror: b\\tc\\u{2028}d");
        assert_eq!(one_line("\u{202e}fdp.exe\u{2066}"), "\\u{202e}fdp.exe\\u{2066}");
        assert_eq!(lines("a\n\u{1b}[2Jb\n"), "a\n\\u{1b}[2Jb\n");
    }

    #[test]
    fn json_says_the_same_as_before() {
        for text in ["\u{1b}[2J\u{9b}31m\u{7f}\u{202e}\n\t", "é 👩‍👩‍👧 \" \\u0041 \\"] {
            let written = serde_json::to_string_pretty(&[text]).unwrap_or_default();
            let escaped = json(&written);
            assert_eq!(serde_json::from_str::<[String; 1]>(&escaped).unwrap_or_default(), [text]);
            assert!(!escaped.contains(|c: char| c != '\n' && is_hidden(c)), "{escaped}");
        }
    }

    #[test]
    fn every_cell_comes_back_as_it_was() {
        for text in ["=1+1", "+1", "-3 dB", "@x", "\tx", "\rx", "\nx", "'=1", "''=1", "＝1"] {
            assert_eq!(to_cell(text), format!("'{text}"));
            assert_eq!(from_cell(&to_cell(text)), text);
        }
        for text in ["", "'", "''", "'quoted'", "x=1", " =1", "d1s1/000", "'x"] {
            assert_eq!(to_cell(text), text);
            assert_eq!(from_cell(text), text);
        }
        assert_eq!(from_cell("=1"), "=1", "a table of another program");
    }
}
