//! What is wrong with a configuration: always the key, what was found and what was expected, and the line where there is one.

use super::{FIELDS, FitConfig};
use crate::input::place;
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// What is wrong with a configuration.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// A setting that may not be so.
    #[error("{key} is {found}; expected {expected}")]
    Value {
        /// The key.
        key: &'static str,
        /// What was given.
        found: String,
        /// What is accepted.
        expected: String,
    },
    /// A file that is not TOML, has a wrong key or a wrong value.
    #[error("{place}: {message}", place = place(path, *line))]
    Invalid {
        /// What is wrong, naming the key.
        message: String,
        /// The line, counted from 1, where one can be named.
        line: Option<usize>,
        /// The file.
        path: PathBuf,
    },
    /// The file could not be read.
    #[error("{path}: cannot be read: {reason}", path = path.display())]
    Read {
        /// What the operating system said.
        reason: std::io::Error,
        /// The file.
        path: PathBuf,
    },
}

/// Reads the text of a `FIT.toml`.
///
/// # Errors
/// As [`FitConfig::parse`].
pub(super) fn parse(text: &str, path: &Path) -> Result<FitConfig, ConfigError> {
    let invalid = |message: String, at: Option<usize>| ConfigError::Invalid {
        message,
        line: at.map(|at| 1 + text.bytes().take(at).filter(|&byte| byte == b'\n').count()),
        path: path.to_owned(),
    };
    let parsed = toml::from_str::<FitConfig>(text).map_err(|error| {
        let at = error.span().map(|span| span.start);
        let told = at.and_then(|at| misfit(text, at)).unwrap_or_else(|| in_our_words(error.message()));
        invalid(told, at)
    })?;
    parsed.validated().map_err(|error| {
        let at = match &error {
            ConfigError::Value { key, .. } => value_of(text, key).map(|(span, _)| span.start),
            ConfigError::Invalid { .. } | ConfigError::Read { .. } => None,
        };
        invalid(error.to_string(), at)
    })
}

/// What is wrong with the value that stands at this byte, in the words of its field.
fn misfit(text: &str, at: usize) -> Option<String> {
    let found = |key: &str| {
        let (span, is_table) = value_of(text, key)?;
        let here = span.contains(&at);
        Some((text.get(span)?.lines().collect::<Vec<_>>().join(" "), is_table)).filter(|_| here)
    };
    FIELDS.iter().find_map(|field| {
        if let Some((found, _)) = found(field.key) {
            return Some(format!("{} is {found}; expected {}", field.key, field.expected()));
        }
        let (table, _) = field.key.split_once('.')?;
        let (found, _) = found(table).filter(|(_, is_table)| !is_table)?;
        let keys = FIELDS.iter().filter_map(|field| field.key.strip_prefix(table)?.strip_prefix('.'));
        Some(format!("{table} is {found}; expected a table of {}", keys.collect::<Vec<_>>().join(", ")))
    })
}

/// Where the value of a key stands, and whether it is a table.
fn value_of(text: &str, key: &str) -> Option<(Range<usize>, bool)> {
    let document = DeTable::parse(text).ok()?;
    let mut value: Option<&Spanned<DeValue<'_>>> = None;
    for part in key.split('.') {
        let table = value.map_or(Some(document.get_ref()), |value| value.get_ref().as_table())?;
        value = Some(table.get(part)?);
    }
    value.map(|value| (value.span(), value.get_ref().is_table()))
}

/// `unknown field` is the parser's word; a configuration has keys.
fn in_our_words(message: &str) -> String {
    let message = message.trim_end().replace('\n', "; ");
    match message.strip_prefix("unknown field ") {
        Some(rest) => format!("unknown key {}", rest.replacen(", expected", "; expected", 1)),
        None => message,
    }
}
