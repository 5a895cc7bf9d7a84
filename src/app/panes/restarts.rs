//! The restart cloud: fits from many starts, their basins in a table, the starts in a picture, the basins' mean skeletons as
//! ghosts in 3-D; a click takes a fit as a branch.

use super::explore::{keep_up, needs_fit, plane, signed};
use super::{Blank, Dock, Pane, PaneState, PaneStates, Shared};
use crate::app::figure;
use crate::app::theme::{self, Tokens};
use crate::app::widgets::{Mark, Named as _, round_step, tick};
use crate::explore::{Basin, ExplorationKind, RestartCloud, RestartSettings, StartFeature};
use crate::mhp::TermId;
use crate::session::{AdoptedFit, Command, Session};
use egui::{Align2, Rect, RichText, Role, Sense, Stroke, Ui, pos2};
use plane::{PlaneArea, PlaneAxis};
use std::sync::Arc;

/// The pane.
pub(super) static PANE: Pane = Pane {
    key: "Restarts",
    title: "Restart cloud",
    icon: &[
        Mark::Dot([3.0, 4.0], 1.6),
        Mark::Dot([8.0, 2.5], 1.6),
        Mark::Dot([13.0, 5.0], 1.6),
        Mark::Dot([4.5, 12.0], 1.6),
        Mark::Ring([10.5, 11.0], 3.5),
    ],
    help: "fits from many starts, and the basins that they end in",
    dock: Dock::BottomTall,
    keys: &[],
    margin: 8,
    state: PaneStates::prepare::<State>,
    blank,
    toolbar: Some(|ui, shared, _| toolbar(ui, shared)),
    ui: |ui, shared, states| show(ui, shared, states.of()),
};

/// A pane of less than this width, points, has numbers instead of sliders, and fewer columns.
const NARROW: f32 = 800.0;
/// So wide must the table be for each of its last two columns, points.
const COLUMNS: [f32; 2] = [250.0, 310.0];
/// Basins that have a colour of their own.
const COLORED: usize = 6;
/// Basins that are listed.
const MOST: usize = 20;

/// What the picture is drawn over, where somebody chose.
#[derive(Default)]
struct State {
    over: Option<StartFeature>,
}

impl PaneState for State {}

fn blank(session: &Session) -> Option<Blank> {
    let how = "Open a frame: its fit is begun from many starts, to tell an ambiguous frame from an unlucky start.";
    needs_fit(session).then(|| Blank::new("No start to spread", how))
}

fn toolbar(ui: &mut Ui, shared: &mut Shared<'_>) {
    let before = shared.session.view.explore.restarts;
    let mut settings = before;
    let narrow = ui.available_width() < NARROW;
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().slider_width = 64.0;
        let [starts, position, yaw, posture, apart] = RestartSettings::RANGES;
        let count =
            egui::DragValue::new(&mut settings.starts).range(starts.0 as usize..=starts.1 as usize).suffix(" starts");
        ui.add(count).named(Role::SpinButton, "Starts").on_hover_text("How many starts are fitted.");
        let slider = |ui: &mut Ui, value: &mut f64, (lo, hi): (f64, f64), name: &str, unit: &str, tip: &str| {
            ui.label(RichText::new(name).small().color(Tokens::of(ui).dim));
            let digits = if hi <= 5.0 { 2 } else { 0 };
            // A slider is not broken into two lines.
            let edit = if narrow {
                let speed = 0.005 * (hi - lo);
                ui.add(egui::DragValue::new(value).range(lo..=hi).suffix(unit).fixed_decimals(digits).speed(speed))
            } else {
                ui.add(egui::Slider::new(value, lo..=hi).suffix(unit).fixed_decimals(digits))
            };
            edit.named(Role::Slider, &format!("Spread of {name}")).on_hover_text(tip);
        };
        slider(
            ui,
            &mut settings.position_m,
            position,
            "place",
            " m",
            "Standard deviation of the place on the floor; in height a quarter.",
        );
        slider(ui, &mut settings.yaw_deg, yaw, "yaw", "°", "Starts are turned by as much to either side at most.");
        slider(ui, &mut settings.posture_deg, posture, "posture", "°", "Standard deviation of the turn of each limb.");
        let far =
            egui::DragValue::new(&mut settings.apart_mm).range(apart.0..=apart.1).suffix(" mm apart").max_decimals(0);
        let tip = "Ends whose joints are farther apart on the mean are of two basins.";
        ui.add(far).named(Role::SpinButton, "Distance of basins").on_hover_text(tip);
        let mut ghosts = shared.session.view.show_basins;
        if ui.checkbox(&mut ghosts, "ghosts").on_hover_text("Draw each basin's mean skeleton in 3-D.").changed() {
            shared.set_view(|view| view.show_basins = ghosts);
        }
        let cost = shared.session.fit_ms().map(|ms| ms * settings.starts as f64);
        keep_up(ui, shared, ExplorationKind::Restarts, cost);
    });
    if settings != before {
        shared.set_view(|view| view.explore.restarts = settings.in_range());
    }
}

fn show(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut State) {
    let Some(cloud) = shared.session.explore.restarts(shared.session.fit.frame).cloned() else { return };
    let tokens = Tokens::of(ui);
    let title = "Restart cloud: L at the end of each fit";
    let caption =
        figure::of(shared.session, &format!("{title}, {}, starts of seed {}", cloud.verdict(), cloud.settings.seed));
    let rect = figure::print(ui, ui.available_rect_before_wrap(), caption.as_deref());
    if rect.width() < 200.0 || rect.height() < 60.0 {
        return;
    }
    let share = if rect.width() > 560.0 { 0.42 } else { 0.0 };
    let middle = rect.min.x + share * rect.width();
    if share > 0.0 {
        picture(ui, shared, state, &cloud, rect.with_max_x(middle), (title, caption.as_deref()), &tokens);
    }
    let table = rect.with_min_x(middle + 12.0);
    let mut ui = ui.new_child(
        egui::UiBuilder::new().id_salt("table").max_rect(table).layout(egui::Layout::top_down(egui::Align::Min)),
    );
    egui::ScrollArea::both()
        .id_salt("basins")
        .auto_shrink(false)
        .show(&mut ui, |ui| basins(ui, shared, &cloud, &tokens));
}

/// The colour of a basin: the first six have one of their own.
fn color_of(basin: usize, tokens: &Tokens) -> egui::Color32 {
    if basin < COLORED { tokens.person(basin) } else { tokens.dim }
}

/// The number of the starts that tells the best basin, else that which tells most.
fn telling(cloud: &RestartCloud) -> StartFeature {
    let told = || cloud.basins.iter().filter_map(|basin| basin.telling);
    let best = cloud.basins.first().and_then(|basin| basin.telling);
    let most = || told().max_by(|a, b| a.auc.total_cmp(&b.auc));
    best.or_else(most).map_or(StartFeature::Turned, |told| told.feature)
}

/// Every fit: a number of its start across, L at its end up, in the colour of its basin.
fn picture(
    ui: &mut Ui,
    shared: &mut Shared<'_>,
    state: &mut State,
    cloud: &Arc<RestartCloud>,
    rect: Rect,
    (title, caption): (&str, Option<&str>),
    tokens: &Tokens,
) {
    let over = state.over.unwrap_or_else(|| telling(cloud));
    let known = || cloud.restarts.iter().enumerate().filter_map(|(k, restart)| Some((k, restart.as_deref()?)));
    let (Some(x), Some((lo, hi))) = (
        plane::limits(known().map(|(_, restart)| over.of(&restart.offset))),
        plane::limits(known().map(|(_, restart)| restart.loss)),
    ) else {
        return;
    };
    let room = 0.06 * (hi - lo);
    let (lo, hi) = (lo - room, hi + room);
    let inner = Rect::from_min_max(
        pos2(rect.min.x + plane::LEFT, rect.min.y + 6.0),
        pos2(rect.max.x - 8.0, rect.max.y - plane::BELOW),
    );
    if !inner.is_positive() {
        return;
    }
    let area = PlaneArea::new(inner, [1, 1]);
    let response = ui.interact(inner, ui.scope_id().with("restarts"), Sense::click());
    let at = |value: f64, loss: f64| {
        let across = ((value - x.0) / (x.1 - x.0)) as f32;
        pos2(
            inner.min.x + (0.02 + 0.96 * across) * inner.width(),
            inner.max.y - ((loss - lo) / (hi - lo)) as f32 * inner.height(),
        )
    };
    let painter = ui.painter().with_clip_rect(ui.clip_rect());
    let step = round_step((hi - lo) / f64::from((inner.height() / 34.0).clamp(1.0, 8.0)));
    for value in ((lo / step).ceil() as i64..).map(|k| k as f64 * step).take_while(|value| *value <= hi).take(20) {
        let y = at(0.0, value).y;
        painter.hline(inner.x_range(), y, Stroke::new(1.0, tokens.stroke));
        painter.text(
            pos2(inner.min.x - 5.0, y),
            Align2::RIGHT_CENTER,
            tick(value, hi - lo),
            theme::mono(10.0),
            tokens.dim,
        );
    }
    let pointer = ui.input(|i| i.pointer.latest_pos()).filter(|_| response.hovered());
    let places: Vec<(usize, egui::Pos2)> =
        known().map(|(k, restart)| (k, at(over.of(&restart.offset), restart.loss))).collect();
    let near = pointer.and_then(|pointer| {
        let nearest = places.iter().map(|&(k, place)| (place.distance(pointer), k)).min_by(|a, b| a.0.total_cmp(&b.0));
        nearest.filter(|(distance, _)| *distance < 14.0).map(|(_, k)| k)
    });
    for &(k, place) in &places {
        let color = cloud.basin_of(k).map_or(tokens.dim, |basin| color_of(basin, tokens));
        painter.circle_filled(place, if near == Some(k) { 5.0 } else { 3.0 }, color.gamma_multiply(0.85));
    }
    if let Some(&(_, own)) = places.iter().find(|(k, _)| *k == 0) {
        painter.circle_stroke(own, 6.0, Stroke::new(1.5, tokens.text));
    }
    let told = near.and_then(|k| Some((k, cloud.restarts.get(k)?.as_deref()?)));
    let said = told.map(|(k, restart)| {
        let basin = cloud.basin_of(k).map_or_else(|| "none".to_owned(), |basin| (basin + 1).to_string());
        format!(
            "start {k}: L {:.4}, basin {basin}, {} {}",
            restart.loss,
            over.title(),
            over.text(over.of(&restart.offset))
        )
    });
    let text = said.as_deref().or(caption);
    response.widget_info(|| figure::spoken(title, text));
    let numbers = |lo: f64, hi: f64| {
        let step = round_step((hi - lo) / f64::from((inner.width() / 60.0).clamp(1.0, 8.0)));
        let values = ((lo / step).ceil() as i64..).map(|k| k as f64 * step).take_while(|value| *value <= hi).take(20);
        let place = |value: f64| f64::from((at(value, lo).x - inner.min.x) / inner.width()) - 0.5;
        values.map(|value| (place(value), tick(value, hi - lo))).collect::<Vec<_>>()
    };
    let across = PlaneAxis { name: over.title().to_owned(), numbers: numbers(x.0, x.1) };
    let up = PlaneAxis { name: "L".into(), numbers: Vec::new() };
    plane::axes(&painter, &area, [&across, &up], tokens);
    shared.points.basin = near.and_then(|k| cloud.basin_of(k)).or(shared.points.basin);
    let clicked = response.clicked();
    if let Some(text) = said {
        response.on_hover_text_at_pointer(format!("{text}\nClick to take this fit as a branch."));
    }
    if clicked && let Some(k) = near {
        adopt(shared, cloud, k);
    }
    over_menu(ui, state, over, inner);
}

/// Which number of the starts goes across, at the lower right below the picture.
fn over_menu(ui: &mut Ui, state: &mut State, over: StartFeature, inner: Rect) {
    let at = Rect::from_min_max(pos2(inner.max.x - 20.0, inner.max.y + 14.0), pos2(inner.max.x, inner.max.y + 32.0));
    let mut ui = ui.new_child(egui::UiBuilder::new().id_salt("at").max_rect(at));
    let response = ui.menu_button("▾", |ui| {
        for feature in StartFeature::ALL {
            if ui.selectable_label(feature == over, feature.title()).clicked() {
                state.over = Some(feature);
                ui.close();
            }
        }
    });
    response.response.named(Role::Button, "Number of the starts");
}

/// A fit of the cloud as a branch.
fn adopt(shared: &mut Shared<'_>, cloud: &RestartCloud, number: usize) {
    let session = shared.session;
    let Some(restart) = cloud.restarts.get(number).and_then(Option::as_deref) else { return };
    let fit = AdoptedFit {
        start: Arc::clone(&restart.start),
        around: session.fit.around(),
        erased: session.fit.erased(),
        config: cloud.config,
        words: format!("restart {number}"),
    };
    shared.send(Command::DragFit(Box::new(fit)));
    shared.send(Command::EndDrag);
}

/// The basins, the best first.
fn basins(ui: &mut Ui, shared: &mut Shared<'_>, cloud: &Arc<RestartCloud>, tokens: &Tokens) {
    let dim = |text: &str| RichText::new(text).small().color(tokens.dim);
    let mono = |text: String| RichText::new(text).font(theme::mono(theme::CAPTION));
    if cloud.is_complete() {
        ui.add(egui::Label::new(RichText::new(cloud.verdict()).small()).wrap());
    } else {
        let fitted = dim(&format!("{} of {} starts are fitted", cloud.done, cloud.restarts.len()));
        ui.add(egui::Label::new(fitted).wrap());
    }
    let errors = cloud.basins.iter().any(|basin| basin.majpe_mm.is_some());
    let [looks, spread] = COLUMNS.map(|least| ui.available_width() >= least);
    egui::Grid::new("basins").num_columns(7).spacing([10.0, 3.0]).show(ui, |ui| {
        let titles = ["", "Share", "L", "IoU"].into_iter().chain(errors.then_some("mm"));
        for title in titles.chain(looks.then_some("Looks")).chain(spread.then_some("Spread")) {
            ui.label(dim(title));
        }
        ui.end_row();
        for (k, basin) in cloud.basins.iter().enumerate().take(MOST) {
            let name = format!("Take basin {}", k + 1);
            let own = if basin.members.contains(&0) { "●" } else { "○" };
            let link = ui.link(RichText::new(format!("{own} {}", k + 1)).color(color_of(k, tokens)));
            let link = link.named(Role::Link, &name);
            if link.hovered() {
                shared.points.basin = Some(k);
            }
            let tip = "Click to take its lowest fit as a branch.\n● is where the fit's own start ends.";
            if link.on_hover_text(tip).clicked()
                && let Some(&first) = basin.members.first()
            {
                adopt(shared, cloud, first);
            }
            ui.label(mono(format!("{:.0} %", 100.0 * basin.share)));
            ui.label(mono(format!("{:.4}", basin.loss))).on_hover_text(format!("mean {:.4}", basin.mean_loss));
            ui.label(mono(basin.iou.map_or_else(|| "–".into(), |iou| format!("{iou:.3}"))));
            if errors {
                ui.label(mono(basin.majpe_mm.map_or_else(|| "–".into(), |mm| format!("{mm:.0}"))));
            }
            if looks {
                let looks = basin.heading_deg.map_or_else(|| "–".into(), |deg| signed(format!("{deg:+.0}°")));
                ui.label(mono(looks)).on_hover_text("0° looks at the radar; positive to its own left.");
            }
            if spread {
                ui.label(mono(format!("{:.0} mm", basin.spread_mm)));
            }
            ui.end_row();
        }
    });
    ui.add_space(4.0);
    ui.label(dim("What decides between them"));
    for (k, basin) in cloud.basins.iter().enumerate().take(MOST) {
        let said = decides(cloud, basin, k);
        if said.is_empty() {
            continue;
        }
        let label = ui.add(egui::Label::new(dim(&format!("{}  {said}", k + 1))).wrap());
        if let Some(told) = basin.telling {
            label.on_hover_text(format!(
                "It orders a start in the basin and one outside rightly with a probability of {:.2}.",
                told.auc
            ));
        }
    }
    if let Some(rest) = cloud.basins.get(MOST..).filter(|rest| !rest.is_empty()) {
        let share: f64 = rest.iter().map(|basin| basin.share).sum();
        ui.label(dim(&format!("and {} basins more with {:.0} % of the starts", rest.len(), 100.0 * share)));
    }
    if cloud.diverged() > 0 {
        ui.label(dim(&format!("{} fits diverged", cloud.diverged())));
    }
}

/// What of the starts, and which term at the end, tells a basin from the others.
fn decides(cloud: &RestartCloud, basin: &Basin, number: usize) -> String {
    let start = basin.telling.map(|told| {
        let text = |value| told.feature.text(value);
        format!("{} {} against {}", told.feature.title(), text(told.inside), text(told.outside))
    });
    let best = cloud.basins.first().filter(|_| number > 0);
    let end = best.and_then(|best| {
        let more = |term: TermId| term.weight.of(&cloud.config) * (basin.terms[term] - best.terms[term]);
        let term = TermId::all().max_by(|a, b| more(*a).abs().total_cmp(&more(*b).abs()))?;
        (more(term) != 0.0).then(|| signed(format!("{} {:+.4}", term.label, more(term))))
    });
    start.into_iter().chain(end).collect::<Vec<_>>().join("; ")
}
