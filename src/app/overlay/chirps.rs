//! The form of a capture that came without a configuration: chirps, words and what is to be made of them; what follows from the
//! chirps is told while they are typed.

use crate::app::panes::Shared;
use crate::app::theme::{self, Tokens};
use crate::app::widgets::Named as _;
use crate::body::Skeleton;
use crate::dataset::ChirpForm;
use crate::dataset::adc::{AdcText, ChirpText};
use crate::session::Command;
use egui::{DragValue, RichText, Role, Ui};
use std::ops::RangeInclusive;
use std::path::PathBuf;

/// The maps that can be asked for.
const VIEWS: [(&str, &str); 6] = [
    ("range_azimuth", "range and azimuth"),
    ("range_elevation", "range and elevation"),
    ("range_doppler", "range and speed"),
    ("cartesian", "Cartesian map"),
    ("cube", "range, azimuth and speed"),
    ("cartesian_cube", "Cartesian cube"),
];
/// Width of the names before the numbers at least, points: those of both grids lie below each other.
const NAME_WIDTH: f32 = 84.0;

/// The form that is being filled in.
#[derive(Default)]
pub(super) struct ChirpQuestion {
    form: Option<(PathBuf, ChirpForm)>,
    /// The transmitters as they are typed.
    tx: String,
}

impl ChirpQuestion {
    pub(super) fn is_open(&self) -> bool {
        self.form.is_some()
    }

    pub(super) fn show(&mut self, ui: &mut Ui, shared: &mut Shared<'_>) {
        let Some(path) = shared.session.data.capture.clone() else {
            self.form = None;
            return;
        };
        if self.form.as_ref().is_none_or(|(known, _)| *known != path) {
            let Ok(form) = ChirpForm::usual() else { return };
            self.tx = form.capture.chirp.as_ref().map_or_else(String::new, |chirp| joined(&chirp.tx));
            self.form = Some((path.clone(), form));
        }
        let Some((_, form)) = &mut self.form else { return };
        let tx = &mut self.tx;
        let mut send = None;
        let response = super::modal(ui, "recording").show(ui.ctx(), |ui| {
            ui.set_width(super::width(ui, 620.0));
            let tokens = Tokens::of(ui);
            ui.label(RichText::new("How was this recorded?").font(theme::strong(16.0)));
            let text = "No .cfg or .mmwave.json lies beside the capture. Your answer is remembered for this file.";
            ui.label(RichText::new(text).small().color(tokens.dim));
            ui.label(RichText::new(path.display().to_string()).font(theme::mono(theme::CAPTION)).color(tokens.dim));
            ui.separator();
            let height = (ui.ctx().content_rect().height() - 300.0).clamp(160.0, 480.0);
            egui::ScrollArea::vertical().max_height(height).auto_shrink([false, true]).show(ui, |ui| {
                let skeleton = &mut form.skeleton;
                if let Some(of) = &mut form.capture.chirp {
                    chirp(ui, of, tx);
                }
                ui.add_space(6.0);
                samples(ui, &mut form.capture);
                ui.add_space(6.0);
                maps(ui, &mut form.capture, skeleton);
            });
            ui.separator();
            let told = form.told();
            match &told {
                Ok(words) => ui.label(RichText::new(words).small().color(tokens.dim)),
                Err(fault) => ui.label(RichText::new(fault).small().color(tokens.bad)),
            };
            for warning in form.warnings() {
                ui.label(RichText::new(format!("△ {warning}")).small().color(tokens.warn));
            }
            ui.add_space(4.0);
            ui.horizontal(|ui| {
                if ui.add_enabled(told.is_ok(), egui::Button::new("Open this capture")).clicked() {
                    send = Some(Command::OpenCapture(path.clone(), Box::new(form.clone())));
                }
                if ui.button("Cancel").clicked() {
                    send = Some(Command::DismissCapture);
                }
                let copy = ui.button("Copy as dataset.toml");
                if copy.on_hover_text("The same as a manifest, to be kept beside the capture.").clicked() {
                    ui.ctx().copy_text(form.to_toml());
                }
            });
        });
        if let Some(command) = send {
            shared.send(command);
        } else if response.should_close() {
            shared.send(Command::DismissCapture);
        }
    }
}

fn joined(tx: &[usize]) -> String {
    tx.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")
}

/// A number behind its name.
fn number<T: egui::emath::Numeric>(
    ui: &mut Ui,
    (name, spoken, tip): (&str, &str, &str),
    value: &mut T,
    (range, speed, suffix): (RangeInclusive<T>, f64, &str),
) {
    ui.label(name);
    let decimals = if T::INTEGRAL { 0 } else { 4 };
    let drag = DragValue::new(value).range(range).speed(speed).max_decimals(decimals).suffix(suffix.to_owned());
    ui.add_sized([110.0, 18.0], drag).on_hover_text(tip).named(Role::SpinButton, spoken);
}

fn chirp(ui: &mut Ui, of: &mut ChirpText, tx: &mut String) {
    ui.label(RichText::new("Chirp").font(theme::strong(theme::BODY)));
    egui::Grid::new("capture chirp").num_columns(4).min_col_width(NAME_WIDTH).spacing([10.0, 4.0]).show(ui, |ui| {
        let start = ("Start", "Start frequency", "Where the ramp begins: 77 for xWR14xx to 18xx, 60 for xWR68xx.");
        number(ui, start, &mut of.start_ghz, (1.0..=300.0, 0.01, " GHz"));
        let slope = ("Slope", "Slope of the ramp", "profileCfg, field 8.");
        number(ui, slope, &mut of.slope_mhz_per_us, (0.001..=1000.0, 0.05, " MHz/µs"));
        ui.end_row();
        number(ui, ("Idle", "Idle time", "Pause before the ramp."), &mut of.idle_us, (0.0..=1e5, 0.1, " µs"));
        let ramp = ("Ramp end", "End of the ramp", "Length of the ramp, sampling included.");
        number(ui, ramp, &mut of.ramp_us, (0.01..=1e5, 0.1, " µs"));
        ui.end_row();
        let begin = ("ADC start", "Begin of sampling", "After the begin of the ramp.");
        number(ui, begin, &mut of.adc_start_us, (0.0..=1e5, 0.1, " µs"));
        let rate = ("Rate", "Sampling rate", "Thousands of samples a second.");
        number(ui, rate, &mut of.rate_ksps, (1.0..=1e6, 1.0, " ksps"));
        ui.end_row();
        number(ui, ("Samples", "Samples a chirp", "numAdcSamples."), &mut of.samples, (1..=1 << 16, 1.0, ""));
        let loops = ("Loops", "Loops a frame", "Times that every transmitter sends in a frame.");
        number(ui, loops, &mut of.loops, (1..=1 << 14, 1.0, ""));
        ui.end_row();
        ui.label("Transmitters");
        let tip = "Counted from 0, in the order in which they send: 0, 2, 1 where the raised one is last.";
        let field = ui.add_sized([110.0, 18.0], egui::TextEdit::singleline(tx));
        if field.on_hover_text(tip).named(Role::TextInput, "Transmitters").changed() {
            let parsed: Result<Vec<usize>, _> = tx.split(',').map(|word| word.trim().parse()).collect();
            of.tx = parsed.unwrap_or_default();
        }
        number(ui, ("Receivers", "Receivers", "4 of one chip, 16 of a cascade."), &mut of.rx, (1..=64, 0.1, ""));
        ui.end_row();
        let period = ("Period", "Frame period", "From one frame to the next.");
        number(ui, period, &mut of.period_ms, (0.001..=1e6, 1.0, " ms"));
        ui.end_row();
    });
}

/// One of several words; the first is meant where nothing is said.
fn choice(ui: &mut Ui, name: &str, value: &mut Option<String>, words: &[(Option<&str>, &str)]) {
    ui.label(name);
    let shown = words.iter().find(|(word, _)| *word == value.as_deref()).map_or("", |(_, shown)| shown);
    let combo = egui::ComboBox::from_id_salt(("recording", name)).width(150.0).selected_text(shown).show_ui(ui, |ui| {
        for (word, shown) in words {
            ui.selectable_value(value, word.map(str::to_owned), *shown);
        }
    });
    combo.response.named(Role::ComboBox, name);
}

fn samples(ui: &mut Ui, of: &mut AdcText) {
    ui.label(RichText::new("Samples").font(theme::strong(theme::BODY)));
    egui::Grid::new("capture samples").num_columns(4).min_col_width(NAME_WIDTH).spacing([10.0, 4.0]).show(ui, |ui| {
        let iq = [
            (None, "the first frame tells"),
            (Some("i_first"), "I first (Studio)"),
            (Some("q_first"), "Q first (SDK)"),
        ];
        choice(ui, "I and Q", &mut of.iq, &iq);
        let board = [
            (None, "as the files say"),
            (Some("isk"), "xWR ISK, BOOST"),
            (Some("line"), "one line"),
            (Some("cascade"), "cascade"),
        ];
        choice(ui, "Board", &mut of.board, &board);
        ui.end_row();
        let mount = [(None, "flat"), (Some("upright"), "upright: its line is height")];
        choice(ui, "Mount", &mut of.mount, &mount);
        ui.label("Converter");
        ui.horizontal(|ui| {
            for bits in [12, 14, 16] {
                let on = of.bits.unwrap_or(16) == bits;
                if ui.selectable_label(on, format!("{bits} bits")).clicked() {
                    of.bits = Some(bits);
                }
            }
        });
        ui.end_row();
        ui.label("LVDS lanes");
        ui.horizontal(|ui| {
            for lanes in [2, 4] {
                let on = of.lanes.unwrap_or(2) == lanes;
                if ui.selectable_label(on, lanes.to_string()).named(Role::Button, &format!("{lanes} lanes")).clicked() {
                    of.lanes = Some(lanes);
                }
            }
        });
        ui.label("");
        ui.horizontal(|ui| {
            let mut real = !of.complex.unwrap_or(true);
            if ui.checkbox(&mut real, "real samples").changed() {
                of.complex = Some(!real);
            }
            let mut offset = of.offset_binary.unwrap_or(false);
            let tip = "0 is the lowest value, not the middle: TSW1400 and some old captures.";
            if ui.checkbox(&mut offset, "offset binary").on_hover_text(tip).changed() {
                of.offset_binary = Some(offset);
            }
        });
        ui.end_row();
    });
}

fn maps(ui: &mut Ui, of: &mut AdcText, skeleton: &mut String) {
    ui.label(RichText::new("Maps").font(theme::strong(theme::BODY)));
    let mut views = of.views.clone().unwrap_or_else(|| vec!["range_azimuth".into(), "range_doppler".into()]);
    let before = views.clone();
    ui.horizontal_wrapped(|ui| {
        for (name, shown) in VIEWS {
            let mut on = views.iter().any(|view| view == name);
            if ui.checkbox(&mut on, shown).changed() {
                views.retain(|view| view != name);
                if on {
                    views.push(name.to_owned());
                }
            }
        }
    });
    if views != before && !views.is_empty() {
        // In the table's order, however they were ticked.
        views.sort_by_key(|view| VIEWS.iter().position(|(name, _)| name == view));
        of.views = Some(views);
    }
    ui.horizontal_wrapped(|ui| {
        let mut still = of.remove_static.unwrap_or(true);
        let tip = "The mean over the chirps of a frame, the echo of what stands still.";
        if ui.checkbox(&mut still, "take away what stands still").on_hover_text(tip).changed() {
            of.remove_static = Some(still);
        }
        let mut most = of.max_range_m.unwrap_or(10.0);
        ui.label("up to");
        let drag = DragValue::new(&mut most).range(0.5..=1000.0).speed(0.1).suffix(" m");
        if ui.add(drag).named(Role::SpinButton, "Largest range").changed() {
            of.max_range_m = Some(most);
        }
        ui.label("Skeleton");
        let combo = egui::ComboBox::from_id_salt("capture skeleton").selected_text(&*skeleton).show_ui(ui, |ui| {
            for name in Skeleton::PRESETS {
                ui.selectable_value(skeleton, name.to_owned(), name);
            }
        });
        combo.response.named(Role::ComboBox, "Skeleton of a capture");
    });
}
