//! The table: a row a variant; its name puts its frames into the list.

use super::RowAsked;
use crate::app::theme::{self, Tokens};
use crate::app::widgets::Named as _;
use crate::config::from_preset;
use crate::study::run::{Run, Spread, TableRow, mark, notes};
use egui::{Align, Layout, RichText, Role, Ui};

type Cell = fn(&TableRow) -> Option<String>;

/// Head, what it means, and its text.
const COLUMNS: [(&str, &str, Cell); 23] = [
    ("frames", "Frames studied.", |row| Some(row.frames.to_string())),
    ("failed", "Frames that could not be fitted.", |row| count(row.failed)),
    ("mismatch", "Frames left out: another number of persons was fitted than is annotated.", |row| {
        count(row.count_mismatched)
    }),
    ("MAJPE", "Mean joint position error, mm.", |row| mean(row.majpe_mm, 1)),
    ("PA", "PA-MAJPE: after rotation, translation and scale of each person, mm.", |row| mean(row.pa_majpe_mm, 1)),
    ("start", "MAJPE of the start, mm.", |row| mean(row.init_majpe_mm, 1)),
    ("start PA", "PA-MAJPE of the start, mm.", |row| mean(row.init_pa_majpe_mm, 1)),
    ("better", "Share of frames nearer to truth than their start.", |row| percent(row.share_improved)),
    ("IoU", "Forward-consistency IoU, mean over views.", |row| mean(row.iou, 3)),
    ("conv.", "Share of frames that met the convergence criterion.", |row| percent(row.converged_share)),
    ("0 right", "Share of frames with nobody that were counted right.", |row| percent(row.counts?.by_people[0])),
    ("1 right", "Share of frames with one person that were counted right.", |row| percent(row.counts?.by_people[1])),
    ("2 right", "Share of frames with two people that were counted right.", |row| percent(row.counts?.by_people[2])),
    ("3 right", "Share of frames with three people that were counted right.", |row| percent(row.counts?.by_people[3])),
    ("weighted", "One, two and three people weighted by 91, 8 and 1 %.", |row| percent(row.counts?.weighted)),
    ("exact", "Share of all frames that were counted right.", |row| percent(row.counts?.overall)),
    ("within 1", "Share of all frames that are off by no more than one person.", |row| percent(row.counts?.within_one)),
    ("paper weighted", "The paper's weighted accuracy on cleaned MMVR.", |row| percent(row.paper?.count_accuracy)),
    ("px", "Joints projected into the camera against key points, px: the calibration is uncertain.", |row| {
        mean(row.reprojection_px, 1)
    }),
    ("in boxes", "Share of joints inside the labelled boxes on the radar maps.", |row| {
        percent(row.map_box_coverage.map(|share| share.mean))
    }),
    ("paper", "The paper's MAJPE, mm: of a network that reads PPPR, not of the fit.", |row| {
        row.paper?.majpe_mm.map(|x| format!("{x:.1}"))
    }),
    ("paper PA", "The paper's PA-MAJPE, mm: of a network that reads PPPR, not of the fit.", |row| {
        row.paper?.pa_majpe_mm.map(|x| format!("{x:.1}"))
    }),
    ("paper conv.", "The paper's convergence rate.", |row| percent(row.paper?.converged_share)),
];

fn count(n: usize) -> Option<String> {
    (n > 0).then(|| n.to_string())
}

fn mean(spread: Option<Spread>, digits: usize) -> Option<String> {
    spread.map(|spread| format!("{:.digits$}", spread.mean))
}

fn percent(share: Option<f64>) -> Option<String> {
    share.map(|share| format!("{:.1} %", 100.0 * share))
}

/// Draws the table; answers what is asked of which row.
pub(super) fn show(ui: &mut Ui, run: &Run, chosen: Option<usize>, tokens: &Tokens) -> Option<RowAsked> {
    let notes = notes(&run.table);
    let shown: Vec<_> = COLUMNS.iter().filter(|(.., cell)| run.table.iter().any(|row| cell(row).is_some())).collect();
    let mut asked = None;
    let grid = egui::Grid::new("study table")
        .num_columns(3 + shown.len() + usize::from(!notes.is_empty()))
        .spacing([12.0, 2.0])
        .striped(true);
    grid.show(ui, |ui| {
        ui.label(RichText::new(run.spec.columns.join(", ")).small().color(tokens.dim));
        ui.label("");
        for (head, tip, _) in &shown {
            right(ui, |ui| ui.label(RichText::new(*head).small().color(tokens.dim)).on_hover_text(*tip));
        }
        if !notes.is_empty() {
            let tip = "Why a row does not differ from the one it is compared with; told below.";
            ui.label(RichText::new("note").small().color(tokens.dim)).on_hover_text(tip);
        }
        ui.end_row();
        for (k, row) in run.table.iter().enumerate() {
            let name = row.labels.join(", ");
            let label = ui.selectable_label(chosen == Some(k), RichText::new(&name).small());
            let label = label.named(Role::Button, &format!("Study row {name}"));
            if label.on_hover_text("Put these frames into the list, with what this row says of each.").clicked() {
                asked = Some(RowAsked::Frames(k));
            }
            let take = ui.small_button("Take").named(Role::Button, &format!("Take settings of {name}"));
            if take.on_hover_text(taken(run, row)).clicked() {
                asked = Some(RowAsked::Settings(k));
            }
            for (.., cell) in &shown {
                let text = cell(row);
                let color = if text.is_some() { tokens.text } else { tokens.dim };
                let text = RichText::new(text.unwrap_or_else(|| "–".into())).font(theme::mono(theme::CAPTION));
                right(ui, |ui| ui.label(text.color(color)));
            }
            // The last column of a grid takes what room there is: one without a number.
            if let Some(mark) = mark(&notes, row) {
                ui.label(RichText::new(mark).small()).on_hover_text(row.note.as_deref().unwrap_or_default());
            }
            ui.label("");
            ui.end_row();
        }
    });
    for (k, note) in notes.iter().enumerate() {
        ui.label(RichText::new(format!("[{}] {note}.", k + 1)).small().color(tokens.dim));
    }
    if let Some(why) = run.spec.paper_missing() {
        ui.label(RichText::new(why).small().color(tokens.dim));
    }
    asked
}

/// What taking the settings of a row means.
fn taken(run: &Run, row: &TableRow) -> String {
    let settings = run.spec.variants.get(row.variant).map(|variant| from_preset(&variant.config));
    format!("Take these settings for the fit on screen: {}.", settings.unwrap_or_default())
}

fn right<R>(ui: &mut Ui, add: impl FnOnce(&mut Ui) -> R) -> R {
    ui.with_layout(Layout::right_to_left(Align::Center), add).inner
}
