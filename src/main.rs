//! Parse, log, window or headless.

use cap::Cap;
use clap::Parser;
use mhp_inspector::cli::bench::{Meter, count_bytes_with};
use mhp_inspector::cli::{Cli, EXIT_BAD_INPUT, WindowArgs, begin_again, run};
use mhp_inspector::output;
use std::alloc::System;
use std::io::IsTerminal as _;
use std::process::ExitCode;

/// Counts bytes for `bench`, and limits nothing.
#[global_allocator]
static ALLOCATOR: Cap<System> = Cap::new(System, usize::MAX);

fn main() -> ExitCode {
    tracing_subscriber::fmt()
        .with_env_filter(
            tracing_subscriber::EnvFilter::try_from_default_env()
                .unwrap_or_else(|_| "warn,winit=error,wgpu_hal=error,mhp_inspector=info".into()),
        )
        .with_writer(std::io::stderr)
        .with_ansi(std::io::stderr().is_terminal())
        .with_target(false)
        .init();
    count_bytes_with(Meter { total_bytes: || ALLOCATOR.total_allocated(), peak_bytes: || ALLOCATOR.max_allocated() });
    if let Err(error) = output::survive_size_limit() {
        tracing::warn!("a file that reaches the limit of its size will end the program: {error}");
    }
    let cli = Cli::parse();
    begin_again(cli.command.as_ref());
    output::allow_into_data(cli.into_data);
    let done = match cli.command {
        Some(command) => run(command),
        None => open_window(cli.window),
    };
    done.unwrap_or_else(|error| {
        eprintln!("error: {error:#}");
        ExitCode::from(EXIT_BAD_INPUT)
    })
}

#[cfg(feature = "viewer")]
fn open_window(args: WindowArgs) -> anyhow::Result<ExitCode> {
    mhp_inspector::app::run(args.begin()?).map(|()| ExitCode::SUCCESS)
}

#[cfg(not(feature = "viewer"))]
fn open_window(_: WindowArgs) -> anyhow::Result<ExitCode> {
    anyhow::bail!("this build has no window (it was made without the feature `viewer`); try --help")
}
