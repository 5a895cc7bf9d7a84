//! What changed since the frames before: the map that is searched for people.
//!
//! A room stands still to the last digit of its echoes, a person never does: a millimetre of breath turns the phase of an
//! echo at 77 GHz by half a cycle, and with it how the echoes of one body add up. The mean square of the differences to the
//! frames before therefore shows people and hardly any room. It is averaged over about the main lobe, because
//! differences of speckle are speckle too. Without frames before, the map itself is taken.

use crate::radar::Quantity;

/// Amplitudes up to here, and down to one by it, are taken as they are: single precision holds sums of their squares.
const HELD: i32 = 40;
/// log₂ of the largest amplitude that is kept.
const LARGEST: i32 = 50;

/// log₂ of what 1 stands for among the amplitudes of these maps: 0, but where their largest leaves what single precision
/// holds squared (a map of 10³⁰ is as good as any).
pub(super) fn unit_of<'a>(maps: impl IntoIterator<Item = (&'a [f64], Quantity)>) -> i32 {
    let largest = |(map, quantity): (&[f64], Quantity)| {
        let largest = map.iter().copied().filter(|x| x.is_finite()).fold(0.0, f64::max);
        if quantity == Quantity::Power { largest.sqrt() } else { largest }
    };
    let largest = maps.into_iter().map(largest).fold(0.0, f64::max);
    let log2 = if largest > 0.0 { largest.log2().round() as i32 } else { 0 };
    if log2.abs() > HELD { log2 } else { 0 }
}

/// Amplitudes of a map, in units of 2^`unit`; what is no positive number is 0.
pub(super) fn amplitudes_of(map: &[f64], quantity: Quantity, unit: i32) -> Vec<f32> {
    let squared = quantity == Quantity::Power;
    // In two factors: one alone may lie beyond the largest number.
    let by = if squared { 2 * unit } else { unit };
    let factors = [by / 2, by - by / 2].map(|log2| f64::from(-log2).exp2());
    let held = |x: f64| ((x * factors[0] * factors[1]) as f32).max(0.0);
    let most = (LARGEST as f32).exp2();
    let amplitude = |x: f64| if squared { held(x).sqrt() } else { held(x) };
    map.iter().map(|&x| amplitude(x).min(most)).collect()
}

/// Where a plane lies in a map.
pub(super) struct Cells {
    pub(super) start: usize,
    pub(super) row_stride: usize,
    pub(super) column_stride: usize,
}

/// Mean square of the differences between `now` and each of `before` on a plane of `[rows, columns]`; the squares of
/// `now` where there is nothing before.
pub(super) fn change(now: &[f32], before: &[&[f32]], [rows, columns]: [usize; 2], cells: &Cells, plane: &mut Vec<f32>) {
    plane.clear();
    plane.resize(rows * columns, 0.0);
    let share = 1.0 / before.len().max(1) as f32;
    for (row, line) in plane.chunks_exact_mut(columns.max(1)).enumerate() {
        let first = cells.start + row * cells.row_stride;
        if cells.column_stride == 1 {
            let here = now.get(first..first + columns).unwrap_or_default();
            if before.is_empty() {
                line.iter_mut().zip(here).for_each(|(out, x)| *out = x * x);
            }
            for then in before {
                let then = then.get(first..first + columns).unwrap_or_default();
                line.iter_mut().zip(here.iter().zip(then)).for_each(|(out, (x, y))| *out += share * (x - y) * (x - y));
            }
        } else {
            for (column, out) in line.iter_mut().enumerate() {
                let cell = first + column * cells.column_stride;
                let x = now.get(cell).copied().unwrap_or(0.0);
                let squares = before.iter().filter_map(|then| then.get(cell)).map(|y| (x - y) * (x - y));
                *out = if before.is_empty() { x * x } else { share * squares.sum::<f32>() };
            }
        }
    }
}

/// Means over boxes of half widths `half`; at the border over what is there.
pub(super) fn smooth(plane: &mut [f32], [rows, columns]: [usize; 2], half: [usize; 2], scratch: &mut Vec<f32>) {
    scratch.clear();
    scratch.resize(plane.len(), 0.0);
    // Across first, then along depth: sums of shifted lines, which the compiler turns into vector code.
    for (line, out) in plane.chunks_exact(columns.max(1)).zip(scratch.chunks_exact_mut(columns.max(1))) {
        for shift in 0..=half[1].min(columns.saturating_sub(1)) {
            out[shift..].iter_mut().zip(line).for_each(|(out, x)| *out += x);
            if shift > 0 {
                out.iter_mut().zip(&line[shift..]).for_each(|(out, x)| *out += x);
            }
        }
    }
    let width = |at: usize, half: usize, most: usize| (at + half + 1).min(most) - at.saturating_sub(half);
    let inverse: Vec<f32> = (0..columns).map(|column| 1.0 / width(column, half[1], columns) as f32).collect();
    for (row, line) in plane.chunks_exact_mut(columns.max(1)).enumerate() {
        line.fill(0.0);
        for near in row.saturating_sub(half[0])..(row + half[0] + 1).min(rows) {
            let from = scratch.get(near * columns..(near + 1) * columns).unwrap_or_default();
            line.iter_mut().zip(from).for_each(|(out, x)| *out += x);
        }
        let inverse_rows = 1.0 / width(row, half[0], rows) as f32;
        line.iter_mut().zip(&inverse).for_each(|(out, inverse)| *out *= inverse * inverse_rows);
    }
}

/// Half the logarithm of every cell: the logarithm of an amplitude. What is not positive counts as the smallest number.
pub(super) fn logarithms(plane: &mut [f32]) {
    for x in plane {
        *x = 0.5 * fast_ln(x.clamp(f32::MIN_POSITIVE, f32::MAX));
    }
}

/// ln x for a positive, normal x, within 2e-5: the logarithms of a frame cost more than all else together otherwise.
#[inline]
fn fast_ln(x: f32) -> f32 {
    let bits = x.to_bits();
    // Mantissa in [√½, √2), where the series of artanh converges quickly.
    let exponent = (bits.wrapping_sub(0x3f35_04f3) as i32) >> 23;
    let m = f32::from_bits(bits.wrapping_sub((exponent as u32) << 23));
    let s = (m - 1.0) / (m + 1.0);
    let t = s * s;
    exponent as f32 * std::f32::consts::LN_2 + s * (2.0 + t * (0.666_666_7 + t * (0.4 + t * 0.285_714_3)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_quick_logarithm_is_a_logarithm() {
        for k in -300..300 {
            let x = 1.37_f32.powf(k as f32 * 0.9);
            if x.is_normal() {
                assert!((fast_ln(x) - x.ln()).abs() < 2e-5 * x.ln().abs().max(1.0), "{x}");
            }
        }
    }

    #[test]
    fn amplitudes_of_any_size_are_held() {
        for size in [1e-320, 1e-300, 1e-20, 1.0, 1e19, 1e30, 1e300] {
            for quantity in [Quantity::Amplitude, Quantity::Power] {
                let map = [size, 0.25 * size, 0.0, -size];
                let got = amplitudes_of(&map, quantity, unit_of([(&map[..], quantity)]));
                let ratio = if quantity == Quantity::Power { 2.0 } else { 4.0 };
                assert!((got[0] / got[1] - ratio).abs() < 1e-2, "{size} {quantity:?}: {got:?}");
                assert!((got[0] * got[0]).is_normal() && got[2..] == [0.0, 0.0], "{size} {quantity:?}: {got:?}");
            }
        }
        let ordinary = [3.5, 1e-9, 7e11];
        assert_eq!(unit_of([(&ordinary[..], Quantity::Amplitude)]), 0);
        assert_eq!(amplitudes_of(&ordinary, Quantity::Amplitude, 0), ordinary.map(|x| x as f32));
        assert!(amplitudes_of(&[f64::MAX, f64::INFINITY], Quantity::Amplitude, 0).iter().all(|x| (x * x).is_finite()));
    }

    #[test]
    fn a_box_mean_keeps_a_constant_and_spreads_a_spike() {
        let mut plane = vec![2.0; 35];
        smooth(&mut plane, [5, 7], [1, 2], &mut Vec::new());
        assert!(plane.iter().all(|x| (x - 2.0).abs() < 1e-6));
        let mut spike = vec![0.0; 35];
        spike[2 * 7 + 3] = 15.0;
        smooth(&mut spike, [5, 7], [1, 2], &mut Vec::new());
        assert!((spike[2 * 7 + 3] - 1.0).abs() < 1e-6 && (spike[7 + 2] - 1.0).abs() < 1e-6 && spike[0] == 0.0);
    }

    #[test]
    fn what_stands_still_does_not_change() {
        let (now, then) = ([3.0, 1.0, 2.0, 2.0], [3.0, 1.0, 2.0, 5.0]);
        let cells = Cells { start: 0, row_stride: 2, column_stride: 1 };
        let mut plane = Vec::new();
        change(&now, &[&then, &now], [2, 2], &cells, &mut plane);
        assert_eq!(plane, [0.0, 0.0, 0.0, 4.5]);
        change(&now, &[], [2, 2], &cells, &mut plane);
        assert_eq!(plane, [9.0, 1.0, 4.0, 4.0]);
        // The same values, column by column.
        let turned = Cells { start: 0, row_stride: 1, column_stride: 2 };
        change(&now, &[], [2, 2], &turned, &mut plane);
        assert_eq!(plane, [9.0, 4.0, 1.0, 4.0]);
    }
}
