//! What several subcommands share: opening, settings, precision, printing.

use crate::config::{FitConfig, Preset};
use crate::dataset::{Dataset, Manifest, OpenOptions};
use crate::escape;
use crate::mhp::{ErasedCells, Precision};
use crate::output::Inputs;
use crate::study::read_erased;
use crate::task::Progress;
use anyhow::Context as _;
use clap::ValueEnum;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use indicatif::{ProgressBar, ProgressStyle};
use std::io::{ErrorKind, IsTerminal as _, Write as _};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

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

/// Reads a preset as typed; `--help` lists them with a line each.
pub(super) fn presets() -> impl TypedValueParser<Value = Preset> {
    let named =
        Preset::ALL.map(|preset| PossibleValue::new(preset.name()).aliases(preset.former_names()).help(preset.help()));
    PossibleValuesParser::new(named).try_map(|name| Preset::named(&name).ok_or("no such preset"))
}

/// Whether manifests may name frames outside their own folder.
static ALLOW_OUTSIDE: AtomicBool = AtomicBool::new(false);

/// Says for the whole process whether manifests may name frames outside their own folder.
pub fn allow_outside(allowed: bool) {
    ALLOW_OUTSIDE.store(allowed, Ordering::Relaxed);
}

/// What [`allow_outside`] said.
pub(super) fn outside_allowed() -> bool {
    ALLOW_OUTSIDE.load(Ordering::Relaxed)
}

/// Opens `path` as it says itself, or as `manifest` says.
///
/// # Errors
/// As [`Dataset::open`] and [`Manifest::from_file`].
pub(super) fn open(path: &Path, manifest: Option<&Path>) -> anyhow::Result<Dataset> {
    let progress = Progress::new();
    let manifest = manifest.map(Manifest::from_file).transpose()?;
    let options = OpenOptions { manifest: manifest.as_ref(), allow_outside: outside_allowed() };
    Ok(Dataset::open_with(path, options, &progress)?)
}

/// What must not be written: the data set that `path` opened, and the files that flags `named`.
pub(super) fn inputs<'a>(dataset: &'a Dataset, path: &Path, named: &[Option<&Path>]) -> Inputs<'a> {
    dataset.inputs().with_folder(path).with_named([Some(path)]).with_named(named.iter().copied())
}

/// The fit configuration of a file, or the baseline.
///
/// # Errors
/// As [`FitConfig::from_file`].
pub(super) fn config(file: Option<&Path>) -> anyhow::Result<FitConfig> {
    Ok(file.map(FitConfig::from_file).transpose()?.unwrap_or_default())
}

/// The configuration of a file, or the preset's, with the number of Adam steps that the command line gives.
///
/// # Errors
/// As [`config`], or where the number is out of range.
pub(super) fn settings(file: Option<&Path>, preset: Preset, iterations: Option<usize>) -> anyhow::Result<FitConfig> {
    let config = file.map(FitConfig::from_file).transpose()?.unwrap_or_else(|| preset.config());
    match iterations {
        Some(iterations) => FitConfig { iterations, ..config }.validated().context("--iterations"),
        None => Ok(config),
    }
}

/// How many persons a fit has.
#[derive(Debug, Clone, Copy, clap::Args)]
pub(super) struct PeopleArg {
    /// Persons that are fitted at once, instead of the configuration's; 0 fits as many as are counted.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(0..=8))]
    people: Option<u8>,
}

impl PeopleArg {
    /// The configuration with that number, where one is given.
    pub(super) fn of(self, config: &FitConfig) -> FitConfig {
        FitConfig { people: self.people.map_or(config.people, usize::from), ..*config }
    }
}

/// What a fit is not to see.
#[derive(Debug, Clone, clap::Args)]
pub(super) struct EraseArg {
    /// Cells that no fit is to see, as the window's File > Export > erased cells writes them.
    #[arg(long, value_name = "FILE.json")]
    erase: Option<PathBuf>,
}

impl EraseArg {
    /// The file, if one is named.
    pub(super) fn file(&self) -> Option<&Path> {
        self.erase.as_deref()
    }

    /// The cells, of the views of a data set; none without a file.
    ///
    /// # Errors
    /// As [`read_erased`].
    pub(super) fn read(&self, dataset: &Dataset) -> anyhow::Result<Vec<ErasedCells>> {
        Ok(self.file().map(|file| read_erased(file, &dataset.info().views)).transpose()?.unwrap_or_default())
    }
}

/// How text stands in the CSV files of a command.
#[derive(Debug, Clone, Copy, clap::Args)]
pub(super) struct CsvArgs {
    /// Write and read text cells of CSV as they are. Without it, text that a spreadsheet would compute (it begins with = + - @,
    /// tab or line break) has an apostrophe before it, which this program takes away again when it reads the file.
    #[arg(long)]
    csv_plain: bool,
}

impl CsvArgs {
    /// Before anything is read or written.
    pub(super) fn apply(self) {
        if self.csv_plain {
            escape::plain_cells();
        }
    }
}

/// On standard error, and only where somebody can see it move.
pub(super) fn progress_bar(frames: usize) -> ProgressBar {
    if !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template("{bar:30} {pos}/{len} frames, {elapsed} gone, {eta} to go");
    let bar = ProgressBar::new(frames as u64).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar.tick();
    bar
}

/// A bar of a training on standard error: epochs, what its message says, and when the last of them would be done.
#[cfg(feature = "train")]
pub(super) fn epochs_bar(epochs: usize) -> ProgressBar {
    if !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template("{bar:30} {pos}/{len} epochs, {elapsed} gone, {eta} to go  {msg}");
    ProgressBar::new(epochs as u64).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}

/// Writes text to standard output, what a terminal would obey as it is spelt. Parts that come from data are in one line
/// each before they are here. That nobody reads on (`info … | head`) is no error.
///
/// # Errors
/// Where it cannot be written for another reason.
pub(super) fn print(text: &str) -> anyhow::Result<()> {
    write_out(escape::lines(text).as_bytes())
}

/// As [`print()`], of JSON, which stays the same JSON.
///
/// # Errors
/// As [`print()`].
pub(super) fn print_json(text: &str) -> anyhow::Result<()> {
    write_out(escape::json(text).as_bytes())
}

/// Writes a table for another program, byte by byte; on a terminal as [`print()`] does.
///
/// # Errors
/// As [`print()`].
pub(super) fn print_table(text: &str) -> anyhow::Result<()> {
    if std::io::stdout().is_terminal() { print(text) } else { write_out(text.as_bytes()) }
}

fn write_out(bytes: &[u8]) -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(bytes).and_then(|()| out.flush()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        done => done.context("writing to standard output"),
    }
}

/// Tells something in one line on standard error.
pub(super) fn complain(text: &str) {
    eprintln!("{}", escape::one_line(text));
}

/// Reads a count that is not 0.
///
/// # Errors
/// In words.
#[cfg(feature = "train")]
pub(super) fn at_least_one(text: &str) -> Result<usize, String> {
    text.parse::<usize>().ok().filter(|&n| n > 0).ok_or_else(|| "expected a whole number, 1 or more".to_owned())
}
