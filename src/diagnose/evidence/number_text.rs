//! Numbers as people read them.

use crate::body::Pppr;
use crate::mhp::Problem;
use crate::radar::{Axis, View};

/// `24 %`; one decimal below 10 %.
pub(super) fn percent(share: f64) -> String {
    let pct = 100.0 * share;
    if pct > 0.0 && pct < 9.95 { format!("{pct:.1} %") } else { format!("{pct:.0} %") }
}

/// Metres, centimetres or millimetres, whichever reads best.
pub(super) fn length(metres: f64) -> String {
    match metres.abs() {
        m if m >= 0.995 => format!("{metres:.2} m"),
        m if m >= 0.0995 => format!("{:.0} cm", metres * 100.0),
        m if m >= 0.00995 => format!("{:.1} cm", metres * 100.0),
        _ => format!("{:.2} mm", metres * 1000.0),
    }
}

/// `1 cell`, `12 cells`.
pub(super) fn cells(count: usize) -> String {
    if count == 1 { "1 cell".into() } else { format!("{count} cells") }
}

/// `depth 2.75 to 2.94 m, y −0.20 to 0.31 m`: the centres of the first and last cell along each axis.
pub(super) fn cell_box(view: &View, lo: &[usize], hi: &[usize]) -> String {
    let spans = view.axes.iter().zip(lo.iter().zip(hi)).map(|(axis, (&lo, &hi))| span(axis, lo, hi));
    spans.collect::<Vec<_>>().join(", ")
}

fn span(axis: &Axis, lo: usize, hi: usize) -> String {
    let (a, b) = (axis.shown_at(lo as f64), axis.shown_at(hi as f64));
    let (low, high) = if a <= b { (a, b) } else { (b, a) };
    let number = |x: f64| if axis.kind.is_angular() { signed(format!("{x:.1}")) } else { signed(format!("{x:.2}")) };
    let unit = if axis.kind.is_angular() { "°".to_owned() } else { format!(" {}", axis.shown_unit()) };
    if lo == hi {
        return format!("{} {}{unit}", axis.shown_name(), number(low));
    }
    format!("{} {} to {}{unit}", axis.shown_name(), number(low), number(high))
}

/// A true minus sign, and none before a zero.
fn signed(number: String) -> String {
    match number.strip_prefix('-') {
        Some(rest) if rest.chars().any(|c| c.is_ascii_digit() && c != '0') => format!("−{rest}"),
        Some(rest) => rest.to_owned(),
        None => number,
    }
}

/// `left wrist`, with the person where there are several.
pub(super) fn joint(problem: &Problem, params: &Pppr, joint: usize) -> String {
    let (persons, joints) = (params.shape().persons, params.shape().joints.max(1));
    let name = problem.skeleton.shown_name(joint % joints);
    if persons > 1 { format!("{name} of person {}", joint / joints + 1) } else { name }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radar::{AxisKind, Spacing};

    #[test]
    fn numbers_have_the_digits_that_matter() {
        assert_eq!([percent(0.0), percent(0.034), percent(0.24), percent(1.0)], ["0 %", "3.4 %", "24 %", "100 %"]);
        assert_eq!(
            [length(2.0), length(0.35), length(0.034), length(0.0038)],
            ["2.00 m", "35 cm", "3.4 cm", "3.80 mm"]
        );
        assert_eq!([cells(1), cells(3)], ["1 cell", "3 cells"]);
    }

    #[test]
    fn a_falling_axis_reads_upwards() {
        let depth = Axis { kind: AxisKind::DepthH, bins: 8, lo: 8.0, hi: 0.0, spacing: Spacing::Linear };
        let azimuth = Axis { kind: AxisKind::Azimuth, bins: 4, lo: 1.0, hi: -1.0, spacing: Spacing::Sine };
        assert_eq!(span(&depth, 2, 4), "depth 4.00 to 6.00 m");
        assert_eq!(span(&depth, 2, 2), "depth 6.00 m");
        assert_eq!(span(&azimuth, 1, 3), "azimuth −30.0 to 30.0°");
        assert_eq!(signed("-0.00".into()), "0.00");
    }
}
