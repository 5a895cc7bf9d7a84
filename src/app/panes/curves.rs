//! Loss, terms, IoU and MAJPE over the iterations, with flags where settings changed and a cursor that can be dragged.

mod along;
mod multiples;
mod series;
mod thin;
mod toolbar;

use super::{Blank, Dock, Pane, PaneState, PaneStates, Shared};
use crate::app::commands::CTRL;
use crate::app::figure;
use crate::app::theme::Tokens;
use crate::app::widgets::Mark;
use crate::mhp::{Scope, TermId, Weight};
use crate::session::{Branch, Command, CurvesShown, FitStatus, IterationRow, PinRow, Session, numbers};
use crate::worker::JobId;
use along::Along;
use egui::{Key, Sense, Ui};
use egui_plot::{GridMark, Line, LineStyle, Plot, PlotPoint, PlotPoints, Points, VLine};
use series::{SeriesCache, series};
use std::borrow::Cow;
use thin::VisibleSpan;

/// Room on the right for half of the last number below the plot, points.
const LAST_NUMBER: f32 = 12.0;

/// Two clicks within this time are one gesture, s.
const DOUBLE_CLICK_S: f64 = 0.6;

/// The pane.
pub(super) static PANE: Pane = Pane {
    key: "Curves",
    title: "Curves",
    icon: &[
        Mark::Line(&[[2.0, 1.5], [2.0, 14.0], [15.0, 14.0]]),
        Mark::Line(&[[4.0, 3.0], [5.5, 7.5], [8.0, 10.0], [11.0, 11.2], [14.5, 11.6]]),
    ],
    help: "loss, its terms, IoU and MAJPE over the iterations",
    dock: Dock::Bottom,
    keys: &[(CTRL, Key::Num1)],
    margin: 8,
    state: PaneStates::prepare::<State>,
    blank,
    toolbar: Some(|ui, shared, _| toolbar::show(ui, shared)),
    ui: |ui, shared, states| show(ui, shared, states.of()),
};

/// What the plot remembers.
#[derive(Default)]
struct State {
    reset: bool,
    /// The shown iteration before the last click, and when that was, s.
    before_click: Option<(usize, f64)>,
    /// What was on screen in the pass before.
    window: Option<VisibleSpan>,
    /// How iterations were laid in the pass before.
    along: Along,
    /// The places that all pictures show, where somebody zoomed.
    zoomed: Option<(f64, f64)>,
    /// Values of the curves of a job's history, as it was built up.
    series: SeriesCache<(JobId, u64)>,
}

impl PaneState for State {
    fn reset_view(&mut self) {
        self.reset = true;
    }
}

/// What is left of the colour of a raw line behind its smoothed one.
const RAW: f32 = 0.4;

/// The pieces of a line.
struct Drawn<'a> {
    pieces: Vec<Vec<PlotPoint>>,
    curve: &'a Curve,
    /// Thin, behind those that are smoothed.
    behind: bool,
}

impl<'a> Drawn<'a> {
    fn behind(pieces: Vec<Vec<PlotPoint>>, curve: &'a Curve) -> Self {
        Self { pieces, curve, behind: true }
    }

    fn in_front(pieces: Vec<Vec<PlotPoint>>, curve: &'a Curve) -> Self {
        Self { pieces, curve, behind: false }
    }
}

/// By how much the wheel was turned to zoom in, as over a map. (A pinch is the plot's own.)
fn wheel(ctx: &egui::Context) -> f32 {
    ctx.input(|i| (i.smooth_scroll_delta().y * 0.004).exp())
}

type Value = Box<dyn Fn(&IterationRow) -> Option<f64>>;

struct Curve {
    key: String,
    name: String,
    value: Value,
    width: f32,
}

fn curve(key: &str, name: &str, width: f32, value: impl Fn(&IterationRow) -> Option<f64> + 'static) -> Curve {
    Curve { key: key.into(), name: name.into(), value: Box::new(value), width }
}

/// The branch on screen, where it has an iteration.
fn begun(session: &Session) -> Option<&Branch> {
    session.fit.branch().filter(|branch| !branch.rows.is_empty())
}

/// The plot stays while the next frame is prepared.
fn blank(session: &Session) -> Option<Blank> {
    let how = "Press Enter to run the fit; loss, IoU and error appear here as it runs.";
    let how = session.data.error.clone().map_or(how.into(), Cow::Owned);
    let nothing = begun(session).is_none() && session.fit.status != FitStatus::Preparing;
    nothing.then(|| Blank::new("No iterations yet", how))
}

/// The branch on screen; one without an iteration while a fit is prepared.
fn branch_of(session: &Session) -> Cow<'_, Branch> {
    let none = || Branch {
        id: 0,
        parent: None,
        config: session.config,
        rows: Vec::new(),
        flags: Vec::new(),
        edit: None,
        erased: std::sync::Arc::default(),
        stops: Vec::new(),
        around: None,
    };
    begun(session).map_or_else(|| Cow::Owned(none()), Cow::Borrowed)
}

fn show(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut State) {
    let fit = &shared.session.fit;
    let branch = &*branch_of(shared.session);
    let lineage = fit.history.lineage();
    let first = lineage.first().and_then(|rows| rows.first()).map_or(0, |row| row.report.iteration);
    let tab = shared.session.view.curves;
    let curves = curves(shared, branch, tab);
    let along = Along::of(shared.session.view.log_iterations);
    // What was zoomed to on one scale is no place on the other.
    if std::mem::replace(&mut state.along, along) != along {
        state.reset = true;
    }
    if tab == CurvesShown::Each {
        let caption = figure::of(shared.session, "each curve with its own scale");
        let area = figure::print(ui, ui.available_rect_before_wrap(), caption.as_deref());
        ui.interact(area, ui.scope_id().with("curves"), Sense::hover())
            .widget_info(|| figure::spoken("Curves", caption.as_deref()));
        let hidden = &shared.session.view.hidden_curves;
        let visible: Vec<&Curve> = curves.iter().filter(|c| !hidden.contains(&c.key)).collect();
        state.series.begin((fit.job, fit.history.revision()));
        if std::mem::take(&mut state.reset) {
            state.zoomed = None;
        }
        return multiples::show(ui, shared, state, &visible, branch.id, area);
    }
    let log = shared.session.view.log_loss && tab == CurvesShown::Loss;
    let hidden = &shared.session.view.hidden_curves;
    let tokens = Tokens::of(ui);
    let mut plot = Plot::new(("curves", tab == CurvesShown::Loss))
        .x_axis_formatter(move |mark, _| along.tick(mark.value))
        .x_grid_spacer(move |input| along.grid(input))
        .show_grid([true, true])
        .grid_color(tokens.stroke)
        .allow_scroll(false)
        .set_margin_fraction(egui::vec2(0.02, 0.06))
        .include_x(0.0)
        .include_x(along.x(shared.session.config.iterations.min(20_000).max(fit.head()) as f64))
        .y_axis_min_width(44.0)
        .label_formatter(move |hover| label(hover, along, log));
    let what = if tab == CurvesShown::Loss { "L and its unweighted terms" } else { "IoU; MAJPE in m" };
    let caption = figure::of(shared.session, what);
    let area = figure::print(ui, ui.available_rect_before_wrap(), caption.as_deref());
    plot = plot.height(area.height()).width((area.width() - LAST_NUMBER).max(1.0));
    if log {
        plot = plot.y_axis_formatter(|mark, _| power(mark.value)).y_grid_spacer(|input| decades(input.bounds));
    }
    if tab == CurvesShown::Quality {
        plot = plot.include_y(0.0).include_y(1.0);
    }
    if std::mem::take(&mut state.reset) {
        plot = plot.reset();
        state.window = None;
    }
    let State { series, window, .. } = &mut *state;
    let window = window.as_ref();
    series.begin((fit.job, fit.history.revision()));
    let smoothing = shared.session.view.smoothing.weight();
    let mut lines: Vec<Drawn<'_>> = Vec::new();
    for c in curves.iter().filter(|c| !hidden.contains(&c.key)) {
        let raw = series.grown(None, &c.key, first, &lineage, &c.value).pieces(window, along, log);
        let smooth = smoothing.and_then(|weight| series.smoothed(&c.key, weight));
        match smooth.map(|smooth| smooth.pieces(window, along, log)) {
            Some(smooth) => lines.extend([Drawn::behind(raw, c), Drawn::in_front(smooth, c)]),
            None => lines.push(Drawn::in_front(raw, c)),
        }
    }
    lines.sort_by_key(|line| !line.behind);
    let mut others: Vec<(u32, Vec<Vec<PlotPoint>>)> = Vec::new();
    if let Some(c) = curves.first() {
        for b in fit.history.branches().iter().filter(|b| b.id != branch.id) {
            let series = series.grown(Some(b.id), &c.key, b.start(), &[&b.rows], &c.value);
            others.push((b.id, series.pieces(window, along, log)));
        }
    }
    let pinned = pinned(shared, tab, window, (along, log));
    let (shown, flags) = (fit.shown_iteration(), fit.history.flags());
    let response = plot.show(ui, |plot| {
        for (id, pieces) in &others {
            for piece in pieces {
                let line = Line::new(format!("branch {id}"), PlotPoints::Borrowed(piece));
                plot.line(line.color(tokens.dim.gamma_multiply(0.8)).width(1.2));
            }
        }
        for (name, pieces) in &pinned {
            for piece in pieces {
                let line = Line::new(name.clone(), PlotPoints::Borrowed(piece));
                plot.line(line.color(tokens.pin.gamma_multiply(0.8)).width(1.2).style(LineStyle::dashed_loose()));
            }
        }
        for Drawn { pieces, curve: c, behind } in &lines {
            let (faint, width) = if *behind { (RAW, 0.8) } else { (1.0, c.width) };
            let color = tokens.curve(&c.key).gamma_multiply(faint);
            for piece in pieces {
                if let [only] = piece.as_slice() {
                    plot.points(Points::new(c.name.clone(), vec![[only.x, only.y]]).color(color).radius(2.5));
                }
                plot.line(Line::new(c.name.clone(), PlotPoints::Borrowed(piece)).color(color).width(width));
            }
        }
        for (iteration, text) in &flags {
            let line = VLine::new(text.clone(), along.x(*iteration as f64));
            plot.vline(line.color(tokens.warn.gamma_multiply(0.7)).width(1.0));
        }
        plot.vline(VLine::new("shown iteration", along.x(shown as f64)).color(tokens.accent).width(1.0));
        if plot.response().hovered() {
            plot.zoom_bounds_around_hovered(egui::Vec2::splat(wheel(plot.ctx())));
        }
        (plot.pointer_coordinate(), plot.response().clone())
    });
    flag_texts(ui, &response, &flags, along, &tokens);
    let [lo, hi] = response.transform.bounds().range_x().into_inner().into();
    state.window =
        (hi > lo).then(|| VisibleSpan::new(lo, hi, response.transform.frame().width() * ui.pixels_per_point(), along));
    let (pointer, inner) = response.inner;
    inner.widget_info(|| figure::spoken("Curves", caption.as_deref()));
    if inner.double_clicked() {
        // The first click of the two has moved the cursor; the gesture was for the plot.
        // Where both came in one pass there was none to take back.
        let now = ui.input(|i| i.time);
        if let Some((before, _)) = state.before_click.take().filter(|(_, at)| now - at < DOUBLE_CLICK_S) {
            shared.send(Command::GotoIteration(before));
        }
    } else if inner.clicked()
        && let Some(at) = pointer
    {
        state.before_click = Some((shown, ui.input(|i| i.time)));
        shared.send(Command::GotoIteration(along.iteration(at.x).round().clamp(0.0, 1e9) as usize));
    }
}

/// The main curve of each pinned fit: L, or the mean IoU.
fn pinned(
    shared: &Shared<'_>,
    tab: CurvesShown,
    window: Option<&VisibleSpan>,
    (along, log): (Along, bool),
) -> Vec<(String, Vec<Vec<PlotPoint>>)> {
    let pins = shared.session.pins.list().iter();
    pins.map(|pin| {
        let value = |row: &PinRow| match tab {
            CurvesShown::Each | CurvesShown::Loss => Some(row.report.loss),
            CurvesShown::Quality => numbers(&row.report, None)[1],
        };
        let what = if tab == CurvesShown::Loss { "L" } else { "mean IoU" };
        let first = pin.rows.first().map_or(0, |row| row.report.iteration);
        let pieces = series(first, pin.rows.iter().map(value)).pieces(window, along, log);
        (format!("{} · {what}", pin.name), pieces)
    })
    .collect()
}

/// What changed at each flag, where there is room: a dragged slider leaves many. Painted over the plot, not in it, so
/// that no text takes part in the plot's bounds.
fn flag_texts<R>(
    ui: &Ui,
    response: &egui_plot::PlotResponse<R>,
    flags: &[(usize, String)],
    along: Along,
    tokens: &Tokens,
) {
    let frame = *response.transform.frame();
    let painter = ui.painter().with_clip_rect(frame.intersect(ui.clip_rect()));
    let font = egui::FontId::proportional(10.0);
    let shown = flags.iter().filter_map(|(iteration, text)| {
        let x = response.transform.position_from_point(&PlotPoint::new(along.x(*iteration as f64), 0.0)).x;
        let text = format!("◆ {text}");
        let inside = (frame.left()..=frame.right()).contains(&x);
        inside.then(|| (x + 3.0, painter.layout_no_wrap(text, font.clone(), tokens.warn)))
    });
    let shown: Vec<_> = shown.collect();
    let wanted: Vec<(f32, f32)> = shown.iter().map(|(x, galley)| (*x, galley.size().x)).collect();
    for (left, (_, galley)) in apart(&wanted, frame.right() - 3.0).into_iter().zip(shown) {
        if let Some(left) = left {
            painter.galley(egui::pos2(left, frame.top() + 2.0), galley, tokens.warn);
        }
    }
}

/// Where texts of these places and widths, from left to right, are written: none over another, none beyond `end`; one that
/// has no room is left out.
fn apart(wanted: &[(f32, f32)], end: f32) -> Vec<Option<f32>> {
    let mut free_from = f32::NEG_INFINITY;
    let place = |&(at, width): &(f32, f32)| {
        let left = at.min(end - width);
        (left >= free_from && width <= end).then(|| {
            free_from = left + width + 6.0;
            left
        })
    };
    wanted.iter().map(place).collect()
}

fn curves(shared: &Shared<'_>, branch: &Branch, tab: CurvesShown) -> Vec<Curve> {
    let arrays: Vec<String> =
        shared.session.fit.problem.iter().flat_map(|p| &p.views).map(|view| view.array.clone()).collect();
    let losses = || {
        let fit = &shared.session.fit;
        loss_curves(fit.initial.as_ref().map_or(1, |p| p.shape().persons), fit.history.branches())
    };
    match tab {
        CurvesShown::Each => {
            let quality = self::curves(shared, branch, CurvesShown::Quality);
            losses().into_iter().chain(quality).collect()
        }
        CurvesShown::Loss => losses(),
        CurvesShown::Quality => {
            let common = common_prefix(&arrays);
            let mut curves: Vec<Curve> = arrays
                .iter()
                .enumerate()
                .map(|(i, array)| {
                    let short = &array[common..];
                    curve(&format!("iou {i}"), &format!("IoU {short}"), 1.5, move |r| {
                        r.report.iou.get(i).copied().flatten()
                    })
                })
                .collect();
            if branch.rows.last().is_some_and(|row| row.majpe_mm.is_some()) {
                curves.push(curve("majpe", "MAJPE / m", 1.5, |r| r.majpe_mm.map(|mm| mm / 1000.0)));
            }
            curves
        }
    }
}

/// Length of what all of several names begin with, up to an underscore: `hm_` of `hm_hori` and `hm_vert`.
fn common_prefix(names: &[String]) -> usize {
    let [first, others @ ..] = names else { return 0 };
    let same = |at: usize| others.iter().all(|name| name.len() > at && name.starts_with(&first[..at]));
    let ends = first.match_indices('_').map(|(at, _)| at + 1).filter(|&at| at < first.len() && same(at));
    if others.is_empty() { 0 } else { ends.max().unwrap_or(0) }
}

/// L, and each of its terms that can be other than 0 with so many persons under the settings of these branches.
fn loss_curves(persons: usize, branches: &[Branch]) -> Vec<Curve> {
    let weighed = |weight: Weight| {
        let settings = branches.iter().flat_map(|b| b.flags.iter().map(|flag| &flag.config).chain([&b.config]));
        settings.into_iter().any(|config| weight.of(config) > 0.0)
    };
    let shown = TermId::all().filter(|term| match term.scope {
        Scope::Always => true,
        Scope::People => persons > 1,
        Scope::Weighed => weighed(term.weight),
        Scope::Given => {
            weighed(term.weight) && branches.iter().flat_map(|b| &b.rows).any(|row| row.report.terms[*term] > 0.0)
        }
    });
    let terms = shown.map(|term| curve(term.key, term.label, 1.5, move |r: &IterationRow| Some(r.report.terms[term])));
    [curve("total", "L", 2.0, |r| Some(r.report.loss))].into_iter().chain(terms).collect()
}

fn label(hover: &egui_plot::HoverPosition<'_>, along: Along, log: bool) -> Option<String> {
    match hover {
        egui_plot::HoverPosition::NearDataPoint { plot_name, position, .. } => {
            let y = if log { 10f64.powf(position.y) } else { position.y };
            Some(format!("{plot_name}\niteration {}\n{y:.5}", along.iteration(position.x).round()))
        }
        egui_plot::HoverPosition::Elsewhere { .. } => None,
    }
}

/// The grid of a log₁₀ axis: decades, and 2 and 5 between them where no more than three are seen.
fn decades((lo, hi): (f64, f64)) -> Vec<GridMark> {
    let between: &[f64] = if hi - lo < 3.0 { &[2.0, 5.0] } else { &[] };
    let (first, last) = (lo.floor().max(-40.0) as i32, hi.ceil().min(40.0) as i32);
    (first..=last)
        .flat_map(|decade| {
            let base = f64::from(decade);
            let fine = between.iter().map(move |m| GridMark { value: base + m.log10(), step_size: 0.3 });
            std::iter::once(GridMark { value: base, step_size: 1.0 }).chain(fine)
        })
        .filter(|mark| (lo..=hi).contains(&mark.value))
        .collect()
}

/// A tick of a log₁₀ axis.
fn power(exponent: f64) -> String {
    let value = 10f64.powf(exponent);
    if !(0.001..10_000.0).contains(&value) {
        format!("{value:.0e}")
    } else if value < 0.1 {
        format!("{value:.3}")
    } else {
        format!("{value:.2}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_are_called_by_what_tells_them_apart() {
        let of = |names: &[&str]| common_prefix(&names.iter().map(ToString::to_string).collect::<Vec<_>>());
        assert_eq!(of(&["hm_hori", "hm_vert"]), 3);
        assert_eq!(of(&["radar_1_range", "radar_1_doppler"]), 8);
        assert_eq!((of(&["hm_hori"]), of(&["hori", "vert"]), of(&["a_", "a_b"]), of(&[])), (0, 0, 0, 0));
    }

    #[test]
    fn what_is_told_of_flags_never_overlaps() {
        let wanted = [(0.0, 40.0), (10.0, 40.0), (46.0, 40.0), (95.0, 40.0), (180.0, 30.0), (182.0, 30.0)];
        let places = apart(&wanted, 200.0);
        assert_eq!(places, [Some(0.0), None, Some(46.0), Some(95.0), Some(170.0), None]);
        // Two at the right edge are both moved to the left: the second would be over the first.
        assert_eq!(apart(&[(190.0, 50.0), (195.0, 60.0)], 200.0), [Some(150.0), None]);
    }
}

#[cfg(all(test, feature = "dummies"))]
mod dummy_tests {
    use super::*;
    use crate::{
        config::FitConfig,
        mhp::{StepReport, Terms},
    };

    /// The keys of the curves of a fit of one person, and what they show of a row.
    fn shown(config: &FitConfig) -> Vec<(String, Option<f64>)> {
        let terms = Terms::from_fn(|term| if term.key == "dummy" { 0.7 } else { 0.1 });
        let report = StepReport { iteration: 0, loss: 1.0, terms, iou: vec![None].into(), converged: false };
        let row = IterationRow { report, state: None, majpe_mm: None };
        let mut history = crate::session::History::new(*config);
        history.push(0, row.clone());
        let branch = history.branches()[0].clone();
        loss_curves(1, &[branch]).into_iter().map(|curve| (curve.key, (curve.value)(&row))).collect()
    }

    #[test]
    fn the_dummy_term_has_a_curve_where_it_has_a_weight() {
        let weighed = FitConfig { w_time: 8.0, w_dummy: 1.0, ..FitConfig::default() };
        let keys = |config: &FitConfig| shown(config).into_iter().map(|(key, _)| key).collect::<Vec<_>>();
        assert_eq!(keys(&FitConfig::default()), ["total", "em", "bone", "rigid", "joint"]);
        assert_eq!(keys(&weighed), ["total", "em", "bone", "rigid", "joint", "time", "dummy"]);
        assert!(shown(&weighed).contains(&("dummy".to_owned(), Some(0.7))));
    }
}
