//! The numbers of a cell of the tuning map, beside it.

use crate::app::theme::{self, Tokens};
use crate::app::widgets::value_row;
use crate::explore::{TunedQuantity, TuningMap};
use crate::session::Session;
use egui::{RichText, Ui};

/// What a screen reader says of a point.
pub(super) fn spoken(map: &TuningMap, point: usize) -> String {
    let known = TunedQuantity::ALL.into_iter().filter_map(|quantity| {
        let (value, _) = map.value(point, quantity)?;
        Some(format!("{} {} {}", quantity.title(), quantity.text(value), quantity.unit()).trim_end().to_owned())
    });
    format!("{}: {}", name(map, point), known.collect::<Vec<_>>().join(", "))
}

/// The settings of a point: `w_em 0.5, tau_pct 10`.
fn name(map: &TuningMap, point: usize) -> String {
    let labels = map.variants.get(point).map(|variant| variant.labels.as_slice()).unwrap_or_default();
    let named = map.grid.iter().zip(labels).map(|(axis, value)| format!("{} {value}", axis.key));
    named.collect::<Vec<_>>().join(", ")
}

/// Of the cell under the pointer, else of the best one.
pub(super) fn show(
    ui: &mut Ui,
    session: &Session,
    map: &TuningMap,
    quantity: TunedQuantity,
    hovered: Option<(usize, Option<usize>)>,
    tokens: &Tokens,
) {
    let (title, point, frame) = match hovered {
        Some((point, frame)) => ("Under the pointer", point, frame),
        None => match map.best(quantity) {
            Some(best) => ("Best", best, None),
            None => return,
        },
    };
    ui.spacing_mut().item_spacing.y = 1.0;
    ui.label(RichText::new(title).small().color(tokens.dim));
    let labels = map.variants.get(point).map(|variant| variant.labels.as_slice()).unwrap_or_default();
    for (axis, value) in map.grid.iter().zip(labels) {
        value_row(ui, &axis.key, value, "");
    }
    ui.add_space(4.0);
    let fits: Vec<_> = match frame {
        Some(frame) => map.fit(point, frame).into_iter().collect(),
        None => map.fits_of(point).collect(),
    };
    for each in TunedQuantity::ALL {
        let values: Vec<f64> = fits.iter().filter_map(|fit| each.of(fit)).collect();
        if values.is_empty() {
            continue;
        }
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        value_row(ui, each.title(), &each.text(mean), if each == TunedQuantity::Settled { "it" } else { each.unit() });
    }
    if let Some(why) = fits.iter().find_map(|fit| fit.row.fit.as_ref().err()) {
        ui.label(RichText::new(why).small().color(tokens.bad));
    }
    if fits.is_empty() {
        ui.label(RichText::new("not fitted yet").small().color(tokens.dim));
    }
    if let Some(place) = frame.and_then(|place| map.frames.get(place)) {
        let name = session.data.dataset.as_ref().map_or("", |dataset| dataset.frame_name(*place as usize));
        ui.add(egui::Label::new(RichText::new(name).font(theme::mono(10.0)).color(tokens.dim)).truncate());
    } else if map.frames.len() > 1 {
        let text = format!("mean of {} of {} frames", fits.len(), map.frames.len());
        ui.label(RichText::new(text).small().color(tokens.dim));
    }
}
