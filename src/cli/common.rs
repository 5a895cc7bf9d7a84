//! What several subcommands share: opening, settings, precision, printing.

use crate::config::FitConfig;
use crate::dataset::{Dataset, Manifest, Progress};
use crate::mhp::Precision;
use anyhow::Context as _;
use clap::ValueEnum;
use std::io::{ErrorKind, Write as _};
use std::path::Path;

/// The two precisions as typed.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub(super) enum PrecisionArg {
    /// Double: the oracle.
    F64,
    /// Single: the fast path.
    F32,
}

impl From<PrecisionArg> for Precision {
    fn from(typed: PrecisionArg) -> Self {
        match typed {
            PrecisionArg::F64 => Self::F64,
            PrecisionArg::F32 => Self::F32,
        }
    }
}

/// Opens `path` as it says itself, or as `manifest` says.
///
/// # Errors
/// As [`Dataset::open`] and [`Manifest::from_file`].
pub(super) fn open(path: &Path, manifest: Option<&Path>) -> anyhow::Result<Dataset> {
    let progress = Progress::new();
    Ok(match manifest {
        Some(file) => Dataset::open_with_manifest(path, &Manifest::from_file(file)?, &progress)?,
        None => Dataset::open(path, &progress)?,
    })
}

/// The fit configuration of a file, or the defaults.
///
/// # Errors
/// As [`FitConfig::from_file`].
pub(super) fn config(file: Option<&Path>) -> anyhow::Result<FitConfig> {
    Ok(file.map(FitConfig::from_file).transpose()?.unwrap_or_default())
}

/// Writes to standard output. That nobody reads on (`info … | head`) is no error.
///
/// # Errors
/// Where it cannot be written for another reason.
pub(super) fn print(text: &str) -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        done => done.context("writing to standard output"),
    }
}
