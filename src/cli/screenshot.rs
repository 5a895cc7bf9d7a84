//! `screenshot`: the real window, drawn offscreen after a number of iterations.

use super::common::{PeopleArg, outside_allowed, presets, settings};
use super::sources::SourceFile;
use crate::app::{Begin, InspectorApp, Pane};
use crate::config::Preset;
use crate::explore::ExplorationKind;
use crate::output::{Sink, replace_file};
use crate::session::{Command, FitStatus, LabelStatus, StrataStatus, ThemeChoice};
use anyhow::{Context as _, bail};
use clap::{Args, ValueEnum};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable as _;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant};

/// How long a data set may take to open, or a fit to do its iterations.
const PATIENCE: Duration = Duration::from_mins(5);

/// Shown under the options of `screenshot --help`.
pub(super) const HELP: &str = "\
Needs no display, but a graphics adapter (Mesa's lavapipe will do).
Exit codes: 0 the picture is written; 2 bad input, or nothing can be drawn.

Examples:
  mhp-inspector screenshot data/mmvr --iterations 60 --out fit.png
      The window after 60 Adam steps on the first frame.
  mhp-inspector screenshot data/mmvr --iterations 0 --size 1920x1080 --theme light --focus --out start.png
      The start pose, the maps zoomed to the fitted region.
  mhp-inspector screenshot --session talk.mhp-session --pane Maps --figure --scale 2 --out h_sim.png
      One pane of a saved session, with a caption, for a figure.";

/// What `screenshot` is told.
#[derive(Debug, Args)]
pub struct ScreenshotArgs {
    /// An MMVR tree or any folder inside one, a `*_radar.npz`, a folder with `dataset.toml`, or an `.npy`/`.npz` of maps.
    #[arg(required_unless_present = "session")]
    path: Option<PathBuf>,
    /// A session file instead of a data set; frame, iterations, settings and theme are then its own.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["path", "frame", "iterations", "config", "preset", "people", "focus", "joint"])]
    session: Option<PathBuf>,
    /// Show the run folder of a study in its pane.
    #[arg(long, value_name = "RUN")]
    study: Option<PathBuf>,
    /// Show predictions of others beside the fit: FILE, NAME=FILE or NAME#RRGGBB=FILE; several times for several sources.
    #[arg(long = "pred", value_name = "[NAME[#RRGGBB]=]FILE")]
    predictions: Vec<SourceFile>,
    /// The frame, counted from 0.
    #[arg(long, value_name = "I", default_value_t = 0)]
    frame: usize,
    /// Adam steps to take first, instead of the settings' own.
    #[arg(long, value_name = "K")]
    iterations: Option<usize>,
    /// Settings with a name.
    #[arg(long, value_name = "NAME", default_value = Preset::default().name(), value_parser = presets())]
    preset: Preset,
    /// Fit configuration instead of a preset.
    #[arg(long, value_name = "FIT.toml")]
    config: Option<PathBuf>,
    #[command(flatten)]
    people: PeopleArg,
    /// Where the picture is written.
    #[arg(long, value_name = "X.png")]
    out: PathBuf,
    /// Width and height in points.
    #[arg(long, value_name = "WxH", default_value = "1440x900", value_parser = parse_size)]
    size: (u32, u32),
    /// Pixels a point: 2 for a high-density screen.
    #[arg(long, value_name = "S", default_value_t = 1.0)]
    scale: f32,
    /// Theme; without it that of the session file, or dark.
    #[arg(long, value_enum)]
    theme: Option<ThemeArg>,
    /// Save this pane alone, called as on its tab, for example Maps; it takes all of the window between the bars.
    #[arg(long, value_name = "NAME")]
    pane: Option<String>,
    /// Print units, τ, iteration, seed and version small under every picture.
    #[arg(long)]
    figure: bool,
    /// Zoom the maps to the fitted region.
    #[arg(long)]
    focus: bool,
    /// Select this joint, for example left_wrist.
    #[arg(long, value_name = "NAME")]
    joint: Option<String>,
}

/// The themes as typed.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum ThemeArg {
    /// Dark.
    Dark,
    /// Light.
    Light,
}

fn parse_size(text: &str) -> Result<(u32, u32), String> {
    let (w, h) = text.split_once('x').ok_or("expected WIDTHxHEIGHT, for example 1440x900")?;
    let side = |s: &str| s.parse::<u32>().map_err(|e| e.to_string());
    let (w, h) = (side(w)?, side(h)?);
    if (320..=8192).contains(&w) && (240..=8192).contains(&h) {
        Ok((w, h))
    } else {
        Err("expected 320x240 to 8192x8192".into())
    }
}

/// What switches Mesa's layer for the choice of a device off.
#[cfg(unix)]
const NO_SELECTION: &str = "NODEVICE_SELECT";

/// Starts the program once more without Mesa's layer for the choice of a device, where that would only complain.
///
/// The layer asks the Wayland server which device it draws on, and libwayland writes to stderr where `XDG_RUNTIME_DIR` does
/// not say where one is, as in a container or a job of a cluster. The choice is ours in any case: adapters in software come
/// first. The layer reads its switch from the environment, which a running process cannot change safely.
#[cfg(unix)]
pub(super) fn without_device_selection() {
    use std::os::unix::process::CommandExt as _;
    let told = std::env::var_os("XDG_RUNTIME_DIR").is_some_and(|folder| std::path::Path::new(&folder).is_absolute());
    if told || std::env::var_os(NO_SELECTION).is_some() {
        return;
    }
    let Ok(program) = std::env::current_exe() else { return };
    let failed = std::process::Command::new(program).args(std::env::args_os().skip(1)).env(NO_SELECTION, "1").exec();
    tracing::debug!("not started again without {NO_SELECTION}: {failed}");
}

/// Runs `screenshot`.
///
/// # Errors
/// Where the data set or frame cannot be read, the fit fails, there is no graphics adapter, or the picture cannot be
/// written.
pub(super) fn run(args: &ScreenshotArgs) -> anyhow::Result<ExitCode> {
    let begin = Begin {
        paths: args.path.iter().cloned().collect(),
        study: args.study.clone(),
        predictions: args.predictions.iter().map(|source| (source.path.clone(), source.reading())).collect(),
        config: Some(args.people.of(&settings(args.config.as_deref(), args.preset, None)?)),
        session: args.session.clone(),
        allow_outside: outside_allowed(),
        ..Begin::default()
    };
    let pane = args.pane.as_deref().map(pane_called).transpose()?;
    let mut harness = Harness::builder()
        .with_size([args.size.0 as f32, args.size.1 as f32])
        .with_pixels_per_point(args.scale)
        .with_accessibility_check(false)
        .allow_missing_glyphs()
        .with_render_cursor(false)
        .wgpu()
        .build_eframe(|cc| InspectorApp::begin(cc, &begin));
    set_up(&mut harness, args)?;
    if let Some(dataset) = &harness.state().session().data.dataset {
        let named = [args.path.as_deref(), args.session.as_deref(), args.config.as_deref()];
        dataset.inputs().with_named(named).check_file(&args.out)?;
    }
    if let Some(pane) = pane {
        harness.state_mut().show_pane_alone(pane);
        // One of an exploration is drawn with it, however long it takes.
        if let Some(kind) =
            ExplorationKind::ALL.into_iter().find(|kind| pane.title().eq_ignore_ascii_case(kind.title()))
        {
            harness.state_mut().apply(Command::Explore(kind));
        }
    }
    harness.run_steps(3);
    // A test waits for somebody to ask for it.
    if let Some(button) = pane.and_then(|_| harness.query_by_label("Test this pose")) {
        button.click();
        harness.run_steps(1);
    }
    until(&mut harness, "the panes", |app| !app.panes_are_working() && !app.session().explore.any_running())?;
    harness.run_steps(1);
    let mut picture = harness.render().map_err(|e| anyhow::anyhow!("the window cannot be drawn: {e}"))?;
    if let Some(pane) = pane {
        let rect = harness.state().pane_rect(pane).with_context(|| format!("the pane {} is not open", pane.title()))?;
        let px = |x: f32| (x * args.scale).round() as u32;
        let (x, y, width, height) = (px(rect.min.x), px(rect.min.y), px(rect.width()), px(rect.height()));
        picture = image::imageops::crop_imm(&picture, x, y, width, height).to_image();
    }
    let cannot = || format!("{}: cannot be written", args.out.display());
    let format = image::ImageFormat::from_path(&args.out).with_context(cannot)?;
    let write = |mut out: &mut dyn Sink| picture.write_to(&mut out, format).map_err(std::io::Error::other);
    replace_file(&args.out, write).with_context(cannot)?;
    Ok(ExitCode::SUCCESS)
}

fn set_up(harness: &mut Harness<'_, InspectorApp>, args: &ScreenshotArgs) -> anyhow::Result<()> {
    until(harness, "the data set", |app| app.session().data.dataset.is_some() && app.session().data.opening.is_none())?;
    let mut view = harness.state().session().view.clone();
    match args.theme {
        Some(ThemeArg::Dark) => view.theme = ThemeChoice::Dark,
        Some(ThemeArg::Light) => view.theme = ThemeChoice::Light,
        None => {}
    }
    view.figure |= args.figure;
    harness.state_mut().apply(Command::SetView(Box::new(view)));
    if args.session.is_none() {
        fit(harness, args)?;
    }
    until(harness, "the fit, strata, labels and evidence", |app| {
        let session = app.session();
        let graded = !matches!(session.strata.status, StrataStatus::Running { .. });
        let labelled = session.labels.status != LabelStatus::Opening;
        let settled = session.fit.is_ready() && !session.fit.is_running() && !session.evidence_is_stale();
        // A file that asks something is waited for by nobody.
        let asked = args.predictions.len().min(crate::session::MOST_SOURCES);
        let sources = session.sources.list();
        let compared = session.sources.question.is_some()
            || (sources.len() >= asked && sources.iter().all(|source| source.errors.is_some()));
        let read = session.study.reading.is_none() && compared;
        let drawn = session.pins.list().iter().all(|pin| pin.snapshot.is_some());
        graded && labelled && settled && drawn && read
    })?;
    if args.focus {
        harness.state_mut().focus();
    }
    Ok(())
}

fn pane_called(name: &str) -> anyhow::Result<&'static Pane> {
    Pane::called(name).with_context(|| {
        let titles: Vec<&str> = Pane::all().iter().map(|pane| pane.title()).collect();
        format!("no pane is called {name}; expected one of {}", titles.join(", "))
    })
}

/// Goes to the frame and takes the asked iterations.
fn fit(harness: &mut Harness<'_, InspectorApp>, args: &ScreenshotArgs) -> anyhow::Result<()> {
    let frames = harness.state().session().data.len();
    if args.frame >= frames {
        let path = args.path.clone().unwrap_or_default();
        bail!("{}: frame {} was asked for; expected 0 ..= {}", path.display(), args.frame, frames - 1);
    }
    harness.state_mut().apply(Command::GotoFrame(args.frame));
    until(harness, "the start pose", |app| {
        let fit = &app.session().fit;
        fit.frame == args.frame && fit.is_ready() && fit.shown.is_some()
    })?;
    let iterations = args.iterations.unwrap_or(harness.state().session().config.iterations);
    if iterations > 0 {
        harness.state_mut().apply(Command::StepFit(iterations));
        until(harness, "the iterations", |app| {
            let fit = &app.session().fit;
            fit.status == FitStatus::Paused && fit.shown.as_ref().is_some_and(|s| s.iteration == fit.head())
        })?;
    }
    if let Some(name) = &args.joint {
        let problem = harness.state().session().fit.problem.clone();
        let joint = problem.as_ref().and_then(|p| p.skeleton.joint(name));
        let Some(joint) = joint else { bail!("no joint is called {name}") };
        harness.state_mut().apply(Command::SelectJoint(Some(joint)));
    }
    Ok(())
}

/// Draws passes until something holds; the session's newest error ends the wait.
fn until(
    harness: &mut Harness<'_, InspectorApp>,
    what: &str,
    done: impl Fn(&InspectorApp) -> bool,
) -> anyhow::Result<()> {
    let began = Instant::now();
    loop {
        harness.step();
        if done(harness.state()) {
            return Ok(());
        }
        let session = harness.state().session();
        if let FitStatus::Failed(why) = &session.fit.status {
            bail!("{why}");
        }
        if let Some(why) = &session.data.error {
            bail!("{why}");
        }
        if let Some((_, catalog)) = &session.data.bare {
            bail!("{catalog}");
        }
        if session.data.dataset.is_none() && session.data.opening.is_none() {
            let why = session.log.iter().rev().find(|line| line.level == crate::session::LogLevel::Error);
            bail!("{}", why.map_or("nothing was opened", |line| line.text.as_str()));
        }
        if began.elapsed() > PATIENCE {
            bail!("waiting for {what} took longer than {} s", PATIENCE.as_secs());
        }
        std::thread::sleep(Duration::from_millis(2));
    }
}
