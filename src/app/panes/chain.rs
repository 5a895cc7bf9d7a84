//! The radar chain of a capture: samples, range profile, range and Doppler, angle, each with what it resolves; and what the numbers
//! warn of. The stages are computed on a thread of their own, a frame when it is shown.

use super::{Blank, Dock, Pane, PaneState, PaneStates, Shared};
use crate::app::map_image::colorize;
use crate::app::theme::{self, Tokens};
use crate::app::widgets::Mark;
use crate::dataset::DatasetError;
use crate::dataset::adc::{ChainStages, StageLimit};
use crate::radar::sine_deg;
use crate::render::Colormap;
use crate::session::Session;
use crate::task::Job;
use egui::{
    Align2, Color32, FontId, Rect, RichText, Role, Sense, Stroke, TextureHandle, TextureOptions, Ui, pos2, vec2,
};

/// The pane.
pub(super) static PANE: Pane = Pane {
    key: "Chain",
    title: "Radar chain",
    icon: &[
        Mark::Box([1.0, 5.0, 5.0, 11.0]),
        Mark::Box([11.0, 5.0, 15.0, 11.0]),
        Mark::Line(&[[5.0, 8.0], [10.0, 8.0]]),
        Mark::Line(&[[8.0, 6.0], [10.2, 8.0], [8.0, 10.0]]),
    ],
    help: "a capture from its samples to its angles, with what each stage resolves",
    dock: Dock::Centre,
    keys: &[],
    margin: 8,
    state: PaneStates::prepare::<State>,
    blank,
    toolbar: None,
    ui: |ui, shared, states| show(ui, shared, states.of()),
};

/// Levels below the strongest that are shown, dB.
const FLOOR_DB: f64 = -60.0;
/// Room for the numbers beside and below a picture, points.
const LEFT: f32 = 44.0;
const BELOW: f32 = 30.0;
const TITLE: f32 = 18.0;

/// The frame whose stages are shown or under way: data set and index.
type Which = (u64, usize);

/// The stages, and the picture of range and Doppler.
#[derive(Default)]
struct State {
    job: Option<(Which, Job<Option<ChainStages>, DatasetError>)>,
    known: Option<(Which, Result<Option<ChainStages>, String>)>,
    picture: Option<(Which, TextureHandle)>,
}

impl PaneState for State {
    fn is_working(&self) -> bool {
        self.job.is_some()
    }
}

fn blank(session: &Session) -> Option<Blank> {
    let how = "Open a capture (.bin or .pcap) with its .cfg or .mmwave.json: its samples, range profile, speeds and angles appear \
               here, with what each resolves.";
    let capture = session.data.dataset.as_ref().is_some_and(|dataset| dataset.has_samples());
    (!capture || session.data.frame.is_none()).then(|| Blank::new("No samples of a converter", how))
}

fn show(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut State) {
    let data = &shared.session.data;
    let (Some(dataset), Some(frame)) = (&data.dataset, &data.frame) else { return };
    let which = (dataset.id(), frame.index);
    if state.known.as_ref().is_none_or(|(known, _)| *known != which) {
        if state.job.as_ref().is_none_or(|(asked, _)| *asked != which) {
            let (source, index, path) = (std::sync::Arc::clone(dataset), frame.index, dataset.frame_path(frame.index));
            let ctx = ui.ctx().clone();
            let broken = move |message| DatasetError::Internal { message, path: path.clone() };
            let job = Job::start("radar-chain", move |_| source.stages(index), broken, move || ctx.request_repaint());
            state.job = Some((which, job));
        }
        if let Some((asked, job)) = &mut state.job
            && let Some(answer) = job.poll()
        {
            state.known = Some((*asked, answer.map_err(|error| error.to_string())));
            state.job = None;
        }
    }
    // The frame before stays until this one's stages are there: nothing flickers while frames are played.
    match &state.known {
        None => {
            ui.label(RichText::new("Reading the samples …").color(Tokens::of(ui).dim));
        }
        Some((_, Err(why))) => {
            ui.label(RichText::new(why).color(Tokens::of(ui).bad));
        }
        Some((_, Ok(None))) => Blank::new("No samples of a converter", "This data set holds maps only.").show(ui),
        Some((of, Ok(Some(stages)))) => {
            let of = *of;
            if state.picture.as_ref().is_none_or(|(known, _)| *known != of) {
                state.picture = Some((of, range_doppler(ui, shared.session, stages)));
            }
            let picture = state.picture.as_ref().map(|(_, texture)| texture);
            draw(ui, stages, picture);
        }
    }
}

/// The colour map that maps are shown with.
pub(super) fn colormap(session: &Session) -> Colormap {
    let named = Colormap::ALL.into_iter().find(|map| map.name().eq_ignore_ascii_case(&session.view.colormap));
    named.unwrap_or_default()
}

/// Range upward, speed across, dB.
fn range_doppler(ui: &Ui, session: &Session, stages: &ChainStages) -> TextureHandle {
    let (columns, rows) = (stages.dopplers.max(1), stages.range_doppler.len() / stages.dopplers.max(1));
    let most = stages.range_doppler.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    let level = |x: f64| (20.0 * (x / most).log10()).max(FLOOR_DB);
    let upward = (0..rows).rev().flat_map(|row| &stages.range_doppler[row * columns..(row + 1) * columns]);
    let values: Vec<f64> = upward.map(|&x| level(x)).collect();
    let image = colorize([columns, rows], &values, (FLOOR_DB, 0.0), colormap(session), false, theme::NAN_CELL);
    ui.ctx().load_texture("range and Doppler of the chain", image, TextureOptions::NEAREST)
}

fn draw(ui: &mut Ui, stages: &ChainStages, picture: Option<&TextureHandle>) {
    let tokens = Tokens::of(ui);
    for warning in &stages.warnings {
        let text = RichText::new(format!("△ {warning}")).small().color(tokens.warn);
        ui.label(text);
    }
    let limits: Vec<String> = stages.limits.iter().map(limit_words).collect();
    let strongest = format!("strongest: {:.2} m, {:+.2} m/s", stages.strongest.0, stages.strongest.1);
    let line = RichText::new(format!("{}   ·   {strongest}", limits.join("   ·   "))).small().color(tokens.dim);
    let formulas: Vec<String> =
        stages.limits.iter().map(|limit| format!("{}: {}", limit.quantity, limit.formula)).collect();
    ui.label(line)
        .on_hover_text(format!("Resolution, and the largest value without ambiguity.\n{}", formulas.join("\n")));
    ui.add_space(4.0);
    let area = ui.available_rect_before_wrap();
    let size = vec2((area.width() - 12.0) / 2.0, (area.height() - 8.0) / 2.0);
    if size.x < 80.0 || size.y < 60.0 {
        return;
    }
    let cell = |column: f32, row: f32| {
        Rect::from_min_size(area.min + vec2(column * (size.x + 12.0), row * (size.y + 8.0)), size)
    };
    samples(ui, cell(0.0, 0.0), stages, &tokens);
    profile(ui, cell(1.0, 0.0), stages, &tokens);
    speeds(ui, cell(0.0, 1.0), stages, picture, &tokens);
    angles(ui, cell(1.0, 1.0), stages, &tokens);
}

fn limit_words(limit: &StageLimit) -> String {
    let StageLimit { quantity, resolution, most, unit, .. } = limit;
    let digits = |x: f64| {
        if x < 0.1 {
            4
        } else if x < 10.0 {
            2
        } else {
            1
        }
    };
    let most_words = format!("{}{most:.*}", if *quantity == "range" { "" } else { "±" }, digits(*most));
    format!("{quantity} {resolution:.*} {unit}, to {most_words} {unit}", digits(*resolution))
}

/// The place for the drawing itself, and what it is over.
struct Frame<'a> {
    plot: Rect,
    x: (f64, f64),
    y: (f64, f64),
    painter: egui::Painter,
    tokens: &'a Tokens,
}

impl<'a> Frame<'a> {
    /// Title, frame, and the numbers at the ends and in the middle of both axes.
    fn new(
        ui: &mut Ui,
        rect: Rect,
        (title, unit_x, unit_y): (&str, &str, &str),
        (x, y): ((f64, f64), (f64, f64)),
        tokens: &'a Tokens,
    ) -> Self {
        let plot = Rect::from_min_max(rect.min + vec2(LEFT, TITLE), rect.max - vec2(6.0, BELOW));
        let painter = ui.painter().clone();
        painter.text(rect.min + vec2(LEFT, 0.0), Align2::LEFT_TOP, title, theme::strong(theme::CAPTION), tokens.text);
        painter.rect(plot, 2.0, tokens.canvas, Stroke::new(1.0, tokens.stroke), egui::StrokeKind::Inside);
        let font = || theme::mono(10.0);
        for share in [0.0, 0.5, 1.0f32] {
            let at = |(lo, hi): (f64, f64)| lo + f64::from(share) * (hi - lo);
            let place = pos2(plot.left() + share * plot.width(), plot.bottom() + 3.0);
            let anchor = if share == 0.0 {
                Align2::LEFT_TOP
            } else if share == 1.0 {
                Align2::RIGHT_TOP
            } else {
                Align2::CENTER_TOP
            };
            painter.text(place, anchor, number(at(x), x.1 - x.0), font(), tokens.dim);
            let place = pos2(plot.left() - 4.0, plot.bottom() - share * plot.height());
            let anchor = if share == 0.0 {
                Align2::RIGHT_BOTTOM
            } else if share == 1.0 {
                Align2::RIGHT_TOP
            } else {
                Align2::RIGHT_CENTER
            };
            painter.text(place, anchor, number(at(y), y.1 - y.0), font(), tokens.dim);
        }
        let small = FontId::proportional(10.0);
        painter.text(plot.center_bottom() + vec2(0.0, 15.0), Align2::CENTER_TOP, unit_x, small.clone(), tokens.dim);
        painter.text(pos2(plot.right(), rect.min.y + 2.0), Align2::RIGHT_TOP, unit_y, small, tokens.dim);
        let response = ui.interact(plot, ui.scope_id().with(("chain", title)), Sense::hover());
        response.widget_info(|| egui::WidgetInfo::labeled(Role::Canvas, true, title));
        let painter = painter.with_clip_rect(plot.intersect(ui.clip_rect()));
        let frame = Self { plot, x, y, painter, tokens };
        if let Some(pointer) = response.hover_pos() {
            let share = (pointer - plot.min) / plot.size();
            let at_x = x.0 + f64::from(share.x) * (x.1 - x.0);
            let at_y = y.1 + f64::from(share.y) * (y.0 - y.1);
            response.on_hover_text_at_pointer(format!("{at_x:.3} {unit_x}\n{at_y:.3} {unit_y}"));
        }
        frame
    }

    fn at(&self, x: f64, y: f64) -> egui::Pos2 {
        let share = |v: f64, (lo, hi): (f64, f64)| ((v - lo) / (hi - lo)) as f32;
        pos2(
            self.plot.left() + share(x, self.x) * self.plot.width(),
            self.plot.bottom() - share(y, self.y) * self.plot.height(),
        )
    }

    fn curve(&self, points: impl Iterator<Item = (f64, f64)>, color: Color32, width: f32) {
        let line: Vec<egui::Pos2> = points.map(|(x, y)| self.at(x, y)).collect();
        self.painter.line(line, Stroke::new(width, color));
    }

    /// What the colours are, in the upper right corner.
    fn legend(&self, entries: &[(&str, Color32)]) {
        let mut right = self.plot.right() - 6.0;
        for (word, color) in entries.iter().rev() {
            let at = pos2(right, self.plot.top() + 4.0);
            let drawn = self.painter.text(at, Align2::RIGHT_TOP, word, FontId::proportional(10.0), *color);
            right = drawn.left() - 10.0;
        }
    }
}

fn number(x: f64, span: f64) -> String {
    let digits = if span >= 100.0 {
        0
    } else if span >= 10.0 {
        1
    } else {
        2
    };
    let text = format!("{x:.digits$}");
    let text =
        if text.trim_start_matches('-').chars().all(|c| c == '0' || c == '.') { text.replace('-', "") } else { text };
    text.replace('-', "−")
}

fn samples(ui: &mut Ui, rect: Rect, stages: &ChainStages, tokens: &Tokens) {
    let most = stages.adc.iter().fold(1.0f64, |most, x| most.max(x.re.abs()).max(x.im.abs())) * 1.05;
    let last = stages.adc.len().saturating_sub(1).max(1) as f64;
    let title = format!("ADC: first chirp, {:.0} % of full scale", 100.0 * most / 1.05 / stages.full_scale);
    let frame = Frame::new(ui, rect, (&title, "sample", "counts"), ((0.0, last), (-most, most)), tokens);
    frame.curve([(0.0, 0.0), (last, 0.0)].into_iter(), tokens.stroke, 1.0);
    let complex = stages.adc.iter().any(|x| x.im != 0.0);
    if complex {
        frame.curve(stages.adc.iter().enumerate().map(|(n, x)| (n as f64, x.im)), tokens.right, 1.2);
    }
    frame.curve(stages.adc.iter().enumerate().map(|(n, x)| (n as f64, x.re)), tokens.left, 1.2);
    let (both, one) = ([("I", tokens.left), ("Q", tokens.right)], [("real", tokens.left)]);
    frame.legend(if complex { &both } else { &one });
}

/// dB about the largest of `all`.
fn decibels<'a>(values: &'a [f64], all: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
    let most = all.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    values.iter().map(move |x| (20.0 * (x / most).max(1e-12).log10()).max(FLOOR_DB))
}

fn profile(ui: &mut Ui, rect: Rect, stages: &ChainStages, tokens: &Tokens) {
    let most = stages.profile.len() as f64 * stages.range_step_m;
    let frame = Frame::new(ui, rect, ("Range profile", "range, m", "dB"), ((0.0, most), (FLOOR_DB, 0.0)), tokens);
    let at = |(bin, level): (usize, f64)| (bin as f64 * stages.range_step_m, level);
    let still = tokens.dim;
    frame.curve(decibels(&stages.profile, &stages.profile).enumerate().map(at), still, 1.2);
    frame.curve(decibels(&stages.moving, &stages.profile).enumerate().map(at), tokens.accent, 1.5);
    frame.legend(&[("all", still), ("what moves", tokens.accent)]);
}

fn speeds(ui: &mut Ui, rect: Rect, stages: &ChainStages, picture: Option<&TextureHandle>, tokens: &Tokens) {
    let rows = stages.range_doppler.len() / stages.dopplers.max(1);
    let (far, step) = (rows as f64 * stages.map_step_m, stages.speed_step_mps);
    let lo = -((stages.dopplers / 2) as f64 + 0.5) * step;
    let x = (lo, lo + stages.dopplers as f64 * step);
    let title = "Range and Doppler, all antennas";
    let frame = Frame::new(ui, rect, (title, "radial speed, m/s", "range, m"), (x, (0.0, far)), tokens);
    if let Some(texture) = picture {
        let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
        frame.painter.image(texture.id(), frame.plot.shrink(1.0), whole, Color32::WHITE);
    }
    let at = frame.at(stages.strongest.1, stages.strongest.0 + 0.5 * stages.map_step_m);
    frame.painter.circle_stroke(at, 6.0, Stroke::new(1.5, frame.tokens.warn));
}

fn angles(ui: &mut Ui, rect: Rect, stages: &ChainStages, tokens: &Tokens) {
    let title = "Angle spectrum in the strongest cell";
    let frame = Frame::new(
        ui,
        rect,
        (title, "angle, °  (left positive)", "dB"),
        ((90.0, -90.0), (FLOOR_DB / 2.0, 0.0)),
        tokens,
    );
    if stages.angle.is_empty() {
        let font = FontId::proportional(theme::CAPTION);
        frame.painter.text(frame.plot.center(), Align2::CENTER_CENTER, "one antenna: no angle", font, tokens.dim);
        return;
    }
    let half = (stages.angle.len() / 2) as f64;
    let inside = |(bin, level): (usize, f64)| {
        let sine = (bin as f64 - half) * stages.sine_step;
        (sine.abs() <= 1.0).then(|| (sine_deg(sine), level.max(FLOOR_DB / 2.0)))
    };
    frame.curve(decibels(&stages.angle, &stages.angle).enumerate().filter_map(inside), tokens.accent, 1.5);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_the_digits_of_their_axis() {
        assert_eq!(
            [(0.0, 120.0), (-0.5, 1.0), (9.91, 20.0), (-0.001, 5.0)].map(|(x, s)| number(x, s)),
            ["0", "−0.50", "9.9", "0.00"]
        );
    }

    #[test]
    fn limits_are_told_with_their_unit() {
        let limit = StageLimit { quantity: "speed", resolution: 0.0229, most: 0.972, unit: "m/s", formula: "" };
        assert_eq!(limit_words(&limit), "speed 0.0229 m/s, to ±0.97 m/s");
    }
}
