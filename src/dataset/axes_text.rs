//! The axes of a data set in words, so that nobody has to guess which way is up.

use crate::radar::{Axis, AxisKind, Spacing, View};

/// One axis in words, for example `depth 8→0 m, row 0 far` or `y 1→−4 m from left to right`. The numbers are the outer edges
/// of the first and the last bin, with the signs that the map's own ticks have.
pub fn axis_words(axis: &Axis, position: &str) -> String {
    let (first, last) = (axis.shown_at(-0.5), axis.shown_at(axis.bins as f64 - 0.5));
    let (name, unit) = (axis.shown_name(), axis.shown_unit());
    let falling = last < first;
    let space = if unit == "°" { "" } else { " " };
    let span = |a: f64, b: f64, dots: &str| format!("{name} {}{dots}{}{space}{unit}", number(a), number(b));
    let end = |at_low: &str, at_high: &str| {
        format!("{}, {position} 0 {}", span(first, last, "→"), if falling { at_high } else { at_low })
    };
    let words = match axis.kind {
        AxisKind::Y if falling => format!("{} from left to right", span(first, last, "→")),
        AxisKind::Y => format!("{} from right to left", span(first, last, "→")),
        // Columns of a map run from left to right, whatever they measure.
        AxisKind::Z if falling => end("bottom", "top"),
        AxisKind::Z => format!("{} up", span(first, last, "…")),
        AxisKind::Azimuth | AxisKind::Cone => end("right", "left"),
        AxisKind::Elevation => end("low", "high"),
        AxisKind::Doppler => end("approaching", "receding"),
        AxisKind::Range | AxisKind::X | AxisKind::DepthH | AxisKind::DepthV => end("near", "far"),
    };
    if axis.spacing == Spacing::Sine { format!("{words}, uniform in the sine") } else { words }
}

/// The name of axis `k` of `count`: rows and columns of a map, or numbered axes of a cube.
pub fn axis_position(k: usize, count: usize) -> (String, String) {
    match (k, count) {
        (0, 2) => ("rows".into(), "row".into()),
        (1, 2) => ("columns".into(), "column".into()),
        _ => (format!("axis {k}"), "bin".into()),
    }
}

/// Cartesian, polar, or what else the axes make.
pub fn system_words(view: &View) -> &'static str {
    let any = |test: fn(AxisKind) -> bool| view.axes.iter().any(|axis| test(axis.kind));
    let doppler = any(|kind| kind == AxisKind::Doppler);
    let polar = any(|kind| kind == AxisKind::Range || kind.is_angular());
    let cartesian = any(|kind| !(kind == AxisKind::Range || kind == AxisKind::Doppler || kind.is_angular()));
    match (cartesian, polar, doppler) {
        (true, false, false) => "Cartesian",
        (false, true, false) => "polar",
        (false, true, true) => "polar with Doppler",
        (true, false, true) => "Cartesian with Doppler",
        (false, false, _) => "Doppler",
        (true, true, _) => "mixed axes",
    }
}

/// The convention of all views in one line. What the views share is said once.
pub fn axes_badge(views: &[View]) -> String {
    let mut parts: Vec<String> = Vec::new();
    let mut systems: Vec<&str> = views.iter().map(system_words).collect();
    systems.dedup();
    parts.push(systems.join(" / "));
    let same_depth = views.windows(2).all(|w| w[0].axes.len() == w[1].axes.len());
    if !same_depth {
        parts.extend(views.iter().map(|view| format!("{}: {}", view.array, view_words(view))));
        return parts.join(" · ");
    }
    let count = views.first().map_or(0, |view| view.axes.len());
    for k in 0..count {
        let (plural, singular) = axis_position(k, count);
        let told: Vec<(String, &str)> = views
            .iter()
            .filter_map(|view| view.axes.get(k).map(|axis| (axis_words(axis, &singular), view.array.as_str())))
            .collect();
        let same = told.windows(2).all(|w| w[0].0 == w[1].0);
        let text = if same {
            told.first().map(|(words, _)| words.clone()).unwrap_or_default()
        } else {
            told.iter().map(|(words, array)| format!("{words} ({array})")).collect::<Vec<_>>().join(", ")
        };
        parts.push(format!("{plural}: {text}"));
    }
    parts.join(" · ")
}

/// The axes of one view, for example `rows: depth 8→0 m, row 0 far · columns: y −1…4 m to the right`.
pub fn view_words(view: &View) -> String {
    let count = view.axes.len();
    let words = view.axes.iter().enumerate().map(|(k, axis)| {
        let (plural, singular) = axis_position(k, count);
        format!("{plural}: {}", axis_words(axis, &singular))
    });
    words.collect::<Vec<_>>().join(" · ")
}

/// At most two decimals, no trailing zeros, a real minus sign.
fn number(value: f64) -> String {
    let text = format!("{value:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.replace('-', "−") }
}
