//! A study: its table, a plot of one quantity over its variants, and from each row the way to its frames.

mod bars;
mod contour;
mod lines;
mod measure;
mod order;
mod parallel;
mod table;

use super::{Blank, Dock, Pane, PaneState, PaneStates, Shared};
use crate::app::commands::{AppAct, CTRL_SHIFT, CommandRow, Menu, SHIFT, UiAction, has_frame};
use crate::app::theme::{self, Tokens};
use crate::app::widgets::{Mark, Named as _};
use crate::session::{Command, Session};
use crate::study::run::{Run, StudyKind};
use crate::study::shard::Subset;
use egui::{Key, RichText, Role, Ui};
use measure::{PlottedQuantity, Values};
use std::sync::Arc;

/// A pane of less than this width, points, has a list of quantities instead of a button for each.
const NARROW: f32 = 460.0;

/// The pane.
pub(in crate::app) static PANE: Pane = Pane {
    key: "Study",
    title: "Study",
    icon: &[
        Mark::Box([1.5, 2.5, 14.5, 13.5]),
        Mark::Line(&[[1.5, 6.0], [14.5, 6.0]]),
        Mark::Line(&[[1.5, 9.8], [14.5, 9.8]]),
        Mark::Line(&[[6.0, 2.5], [6.0, 13.5]]),
    ],
    help: "a study's table and plot",
    dock: Dock::Centre,
    keys: &[],
    margin: 8,
    state: PaneStates::prepare::<State>,
    blank,
    toolbar: Some(|ui, shared, states| {
        order::show(ui, shared, &mut states.of::<State>().order);
        head(ui, shared);
    }),
    ui: |ui, shared, states| show(ui, shared, states.of()),
};

/// Asks for a sweep.
pub(in crate::app) const SWEEP: CommandRow = CommandRow {
    label: "Sweep settings…",
    title: None,
    tooltip: "Type the values of one or two settings that the listed frames are fitted with; Enter runs the study.",
    menu: Menu::Fit,
    keys: &[(SHIFT, Key::S)],
    enabled: has_frame,
    act: |_| UiAction::in_front(&PANE, |states, session| order(states, session).type_sweep()),
};

/// Runs the study that the pane describes.
pub(in crate::app) const RUN_STUDY: CommandRow = CommandRow {
    label: "Run study",
    title: None,
    tooltip: "Run the study that the Study pane describes, on the listed frames; a sweep where nothing else was chosen.",
    menu: Menu::Fit,
    keys: &[(CTRL_SHIFT, Key::Enter)],
    enabled: |s| has_frame(s) && !s.study.work.is_running(),
    act: |_| UiAction::in_front(&PANE, |states, session| order(states, session).ask()),
};

fn order<'a>(states: &'a mut PaneStates, session: &Session) -> &'a mut order::Order {
    states.of::<State>().order.get_or_insert_with(|| order::Order::around(&session.config))
}

/// Which quantity is plotted, and the values that were made from the run.
#[derive(Default)]
struct State {
    measure: PlottedQuantity,
    order: Option<order::Order>,
    /// The scene whose frames are looked at; all of them where none is chosen.
    scene: Option<String>,
    shown: Option<Shown>,
}

/// What was made of a revision of the run: the run or what of it is of the chosen scene, and the values that can be plotted.
struct Shown {
    revision: u64,
    scene: Option<String>,
    run: Arc<Run>,
    values: Vec<(PlottedQuantity, Values)>,
}

impl Shown {
    fn new(revision: u64, run: &Arc<Run>, scene: Option<&str>) -> Self {
        let of_scene = scene.and_then(|scene| run.of_scene(scene).map(Arc::new));
        let scene = scene.filter(|_| of_scene.is_some()).map(str::to_owned);
        let run = of_scene.unwrap_or_else(|| Arc::clone(run));
        Self { revision, scene, values: measure::of_run(&run), run }
    }
}

impl PaneState for State {}

/// What a person asks of a row of the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum RowAsked {
    /// Its frames in the list.
    Frames(usize),
    /// Its settings for the fit on screen.
    Settings(usize),
}

/// How a study is plotted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Picture {
    Bars,
    Lines,
    Contour,
    Parallel,
}

fn blank(session: &Session) -> Option<Blank> {
    let how = "Open a data set to run one here, or a run folder of `mhp-inspector study` with File > Open study.";
    match &session.study {
        study if study.run.is_some() || session.data.dataset.is_some() => None,
        study if study.reading.is_some() => Some(Blank::new("Reading a run…", "")),
        _ => Some(Blank::new("No study yet", how)),
    }
}

fn show(ui: &mut Ui, shared: &mut Shared<'_>, state: &mut State) {
    let study = &shared.session.study;
    let tokens = Tokens::of(ui);
    let Some((_, run)) = study.run.clone() else { return none_yet(ui, study.work.is_running(), &tokens) };
    let revision = study.run.revision();
    if state.shown.as_ref().is_none_or(|shown| shown.revision != revision || shown.scene != state.scene) {
        let shown = Shown::new(revision, &run, state.scene.as_deref());
        state.scene.clone_from(&shown.scene);
        state.shown = Some(shown);
    }
    scenes(ui, &run, &mut state.scene, &tokens);
    let Some(Shown { run, values, .. }) = &state.shown else { return };
    if !values.iter().any(|(measure, _)| *measure == state.measure) {
        state.measure = values.first().map(|(measure, _)| *measure).unwrap_or_default();
    }
    choose(ui, &mut state.measure, values);
    let Some((measure, shown)) = values.iter().find(|(measure, _)| *measure == state.measure) else { return };
    let row = shared.session.study.row;
    let mut asked = None;
    let wide = ui.available_width() > 1000.0;
    // A picture is seen whole; the table below it is scrolled to.
    let height = (ui.available_height() - 8.0).clamp(150.0, 280.0);
    egui::ScrollArea::both().id_salt("study").auto_shrink(false).show(ui, |ui| {
        let plot = |ui: &mut Ui| match picture(run) {
            Picture::Bars => bars::show(ui, run, *measure, shown, row, &tokens),
            Picture::Lines => lines::show(ui, run, *measure, shown, height, &tokens),
            Picture::Contour => contour::show(ui, run, *measure, shown, shared.session, height, &tokens),
            Picture::Parallel => parallel::show(ui, run, *measure, shown, row, shared.session, height, &tokens),
        };
        if wide {
            ui.horizontal_top(|ui| {
                let width = (0.5 * ui.available_width()).clamp(320.0, 640.0);
                let size = egui::vec2(width, ui.available_height());
                let of_plot = ui.allocate_ui(size, |ui| ui.vertical(plot).inner).inner;
                ui.add_space(12.0);
                let of_table = ui.vertical(|ui| table::show(ui, run, row, &tokens)).inner;
                asked = of_plot.map(RowAsked::Frames).or(of_table);
            });
        } else {
            let of_plot = plot(ui);
            ui.add_space(8.0);
            asked = of_plot.map(RowAsked::Frames).or(table::show(ui, run, row, &tokens));
        }
    });
    match asked {
        Some(RowAsked::Frames(row)) => shared.send(Command::ShowStudyRow { row, scene: state.scene.clone() }),
        Some(RowAsked::Settings(row)) => {
            let variant = run.table.get(row).and_then(|row| run.spec.variants.get(row.variant));
            if let Some(variant) = variant {
                shared.send(Command::SetConfig(Box::new(variant.config)));
            }
        }
        None => {}
    }
}

/// Which scene's frames are looked at, where there are several.
fn scenes(ui: &mut Ui, run: &Run, chosen: &mut Option<String>, tokens: &Tokens) {
    if run.scenes.is_empty() {
        return;
    }
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        ui.label(RichText::new("Scene").small().color(tokens.dim));
        let all = ui.selectable_label(chosen.is_none(), RichText::new("all").small());
        if all.named(Role::Button, "All scenes").clicked() {
            *chosen = None;
        }
        for scene in run.scenes.iter().map(|table| &table.scene) {
            let one = ui.selectable_label(chosen.as_ref() == Some(scene), RichText::new(scene).small());
            let tip = "The frames of this scene alone; the paper's figures are of all.";
            if one.named(Role::Button, &format!("Scene {scene}")).on_hover_text(tip).clicked() {
                *chosen = Some(scene.clone());
            }
        }
    });
    ui.add_space(4.0);
}

/// What the pane is for, while nothing is on screen.
fn none_yet(ui: &mut Ui, running: bool, tokens: &Tokens) {
    let text = if running {
        "The table grows here as frames are fitted."
    } else {
        "A study fits the listed frames with several settings and puts their errors side by side. A sweep takes any two \
         settings; the others ask what the paper asks. A run folder of the command line is shown with File > Open study."
    };
    ui.label(RichText::new(text).small().color(tokens.dim));
}

/// Numbers along one axis are a curve, along two a map, along more or beside words parallel lines; names are bars.
fn picture(run: &Run) -> Picture {
    let numeric = |column: usize| {
        let label = |row: &crate::study::run::TableRow| row.labels.get(column).and_then(|text| number(text));
        run.table.iter().all(|row| label(row).is_some())
    };
    match (run.spec.study, run.spec.columns.len()) {
        (StudyKind::Threshold | StudyKind::Budget, _) => Picture::Lines,
        (StudyKind::Sweep, 1) if numeric(0) => Picture::Lines,
        (StudyKind::Sweep, 2) if numeric(0) && numeric(1) && grown(run) => Picture::Contour,
        (StudyKind::Sweep, columns) if columns > 1 => Picture::Parallel,
        _ => Picture::Bars,
    }
}

/// Whether both axes of a map have more than one value: else there is nothing to draw a line through.
fn grown(run: &Run) -> bool {
    (0..2).all(|column| measure::levels(run, column).len() > 1)
}

/// The number that a label begins with: `100 % (no masking)` is 100.
fn number(label: &str) -> Option<f64> {
    label.split_whitespace().next()?.parse().ok().filter(|x: &f64| x.is_finite())
}

fn head(ui: &mut Ui, shared: &mut Shared<'_>) {
    let Some((folder, run)) = shared.session.study.run.clone() else { return };
    let tokens = Tokens::of(ui);
    let (spec, data) = (&run.spec, &run.spec.data);
    ui.horizontal_wrapped(|ui| {
        ui.label(RichText::new(spec.study.title()).font(theme::strong(theme::TITLE)));
        let growing = shared.session.study.work.is_running();
        if !run.complete && !growing {
            let text = format!("△ not finished: {} fits so far", run.rows.len());
            ui.label(RichText::new(text).small().color(tokens.warn));
        }
        if !growing
            && ui
                .small_button("Read again")
                .on_hover_text("Read the run folder again: what a running study has done since.")
                .clicked()
        {
            shared.send(Command::OpenRun(folder.clone()));
        }
        // Where there is hardly room the menu has it.
        if ui.available_width() > 120.0
            && ui.small_button("Open study…").on_hover_text("Show another run folder.").clicked()
        {
            shared.app(AppAct::OpenStudy);
        }
    });
    let subset = if data.subset == Subset::Hard { "hard frames" } else { "frames" };
    let text = format!("{} · {} {subset} · based on {} · seed {}", data.name, data.frames, spec.base, spec.seed);
    let tip = format!("{}\nmhp-inspector {}", folder.display(), spec.version);
    ui.add(egui::Label::new(RichText::new(text).small().color(tokens.dim)).truncate()).on_hover_text(tip);
    let open = shared.session.data.dataset.as_ref();
    if open.is_none_or(|dataset| !shared.session.study.is_of(dataset)) {
        ui.horizontal_wrapped(|ui| {
            let text = "△ Another data set is open: rows cannot show their frames.";
            ui.label(RichText::new(text).small().color(tokens.warn));
            let button = ui.small_button("Open its data set").on_hover_text(data.root.display().to_string());
            if button.clicked() {
                shared.send(Command::Open(data.root.clone()));
            }
        });
    }
}

fn choose(ui: &mut Ui, chosen: &mut PlottedQuantity, values: &[(PlottedQuantity, Values)]) {
    if ui.available_width() < NARROW {
        let menu = egui::ComboBox::from_id_salt("measure").width(130.0).selected_text(chosen.title());
        let response = menu.show_ui(ui, |ui| {
            for (measure, _) in values {
                ui.selectable_value(chosen, *measure, measure.title()).on_hover_text(measure.help());
            }
        });
        response.response.named(Role::ComboBox, "Plotted quantity");
        return;
    }
    ui.horizontal_wrapped(|ui| {
        for (measure, _) in values {
            let button = ui.selectable_value(chosen, *measure, RichText::new(measure.short()).small());
            button.named(Role::Button, &format!("Plot {}", measure.short())).on_hover_text(measure.help());
        }
    });
}
