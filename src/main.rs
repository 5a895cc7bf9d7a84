//! Parse, log, window or headless.

use clap::Parser;
use mhp_inspector::cli::{Cli, EXIT_BAD_INPUT, run};
use std::process::ExitCode;

fn main() -> ExitCode {
    tracing_subscriber::fmt()
        .with_env_filter(
            tracing_subscriber::EnvFilter::try_from_default_env().unwrap_or_else(|_| "warn,mhp_inspector=info".into()),
        )
        .with_writer(std::io::stderr)
        .init();
    let cli = Cli::parse();
    let done = match cli.command {
        Some(command) => run(command),
        None => open_window(&cli.paths),
    };
    done.unwrap_or_else(|error| {
        eprintln!("error: {error:#}");
        ExitCode::from(EXIT_BAD_INPUT)
    })
}

fn open_window(_paths: &[std::path::PathBuf]) -> anyhow::Result<ExitCode> {
    anyhow::bail!("this build has no window")
}
