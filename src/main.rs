//! Parse, log, window or headless.

use cap::Cap;
use clap::Parser;
use mhp_inspector::cli::bench::{Meter, count_bytes_with};
use mhp_inspector::cli::{Cli, EXIT_BAD_INPUT, WindowArgs, allow_outside, begin_again, run};
use mhp_inspector::{escape, output};
use std::alloc::System;
use std::io::IsTerminal as _;
use std::process::ExitCode;
use tracing_subscriber::field::MakeExt as _;
use tracing_subscriber::filter::{LevelFilter, Targets};
use tracing_subscriber::fmt::FormatFields;
use tracing_subscriber::fmt::format::debug_fn;
use tracing_subscriber::layer::SubscriberExt as _;
use tracing_subscriber::util::SubscriberInitExt as _;

/// Counts bytes for `bench`, and limits nothing.
#[global_allocator]
static ALLOCATOR: Cap<System> = Cap::new(System, usize::MAX);

fn main() -> ExitCode {
    let lines = tracing_subscriber::fmt::layer()
        .with_writer(std::io::stderr)
        .with_ansi(std::io::stderr().is_terminal())
        .with_target(false)
        .fmt_fields(fields());
    tracing_subscriber::registry().with(lines).with(told()).init();
    count_bytes_with(Meter { total_bytes: || ALLOCATOR.total_allocated(), peak_bytes: || ALLOCATOR.max_allocated() });
    if let Err(error) = output::survive_size_limit() {
        tracing::warn!("a file that reaches the limit of its size will end the program: {error}");
    }
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => return refuse(error),
    };
    begin_again(cli.command.as_ref());
    output::allow_into_data(cli.into_data);
    allow_outside(cli.allow_outside);
    let done = match cli.command {
        Some(command) => run(command),
        None => open_window(cli.window),
    };
    done.unwrap_or_else(|error| {
        eprintln!("{}", escape::one_line(&format!("error: {error:#}")));
        ExitCode::from(EXIT_BAD_INPUT)
    })
}

/// What the log tells: as `RUST_LOG` says, `level` and `target=level`, else warnings and what this program informs of.
fn told() -> Targets {
    let asked = std::env::var("RUST_LOG").ok().and_then(|text| text.parse().ok());
    asked.unwrap_or_else(|| {
        let quiet = ["winit", "wgpu_hal"].map(|target| (target, LevelFilter::ERROR));
        Targets::new()
            .with_default(LevelFilter::WARN)
            .with_targets(quiet)
            .with_target("mhp_inspector", LevelFilter::INFO)
            .with_target("mhp_engine", LevelFilter::INFO)
    })
}

/// Messages and fields of the log, each in one line: they tell names from data.
fn fields() -> impl for<'w> FormatFields<'w> + 'static {
    debug_fn(|out, field, value| {
        let value = format!("{value:?}");
        let text = escape::one_line(&value);
        if field.name() == "message" { write!(out, "{text}") } else { write!(out, "{field}={text}") }
    })
    .delimited(" ")
}

/// Help and version as clap shows them. What is wrong repeats what was typed, perhaps names that a shell found: it is what
/// clap says of the same words with everything hidden shown.
fn refuse(error: clap::Error) -> ExitCode {
    if !error.use_stderr() {
        error.exit();
    }
    let shown = std::env::args_os().map(|word| escape::one_line(&word.to_string_lossy()).into_owned());
    let error = Cli::try_parse_from(shown).err().unwrap_or(error);
    eprint!("{}", escape::lines(&error.render().to_string()));
    ExitCode::from(EXIT_BAD_INPUT)
}

#[cfg(feature = "viewer")]
fn open_window(args: WindowArgs) -> anyhow::Result<ExitCode> {
    mhp_inspector::app::run(args.begin()?).map(|()| ExitCode::SUCCESS)
}

#[cfg(not(feature = "viewer"))]
fn open_window(_: WindowArgs) -> anyhow::Result<ExitCode> {
    anyhow::bail!("this build has no window (it was made without the feature `viewer`); try --help")
}
