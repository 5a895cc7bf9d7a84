//! What changes with time, cell by cell.

/// The coefficient of variation of each cell over `maps`, the same view at several times, whose values are about as large as
/// `largest`. The speckle of a person changes from frame to frame, for a chest that breathes moves by wavelengths; a wall's
/// does not.
pub(super) fn coefficients_of_variation(maps: &[&[f64]], largest: f64) -> Vec<f32> {
    let Some((first, others)) = maps.split_first() else { return Vec::new() };
    // A power of two, which costs no digit: squares of what is very large or very small leave the range of numbers.
    let unit = (-largest.log2().round()).clamp(-1000.0, 1000.0).exp2();
    // Sums of differences to the first map: what stands still adds up to nothing, to the last digit.
    let (mut sums, mut squares) = (vec![0.0; first.len()], vec![0.0; first.len()]);
    for map in others {
        for ((sum, square), (then, now)) in sums.iter_mut().zip(&mut squares).zip(map.iter().zip(*first)) {
            let difference = unit * then - unit * now;
            *sum += difference;
            *square += difference * difference;
        }
    }
    let count = maps.len() as f64;
    let of_cell = |((&sum, square), now): ((&f64, f64), &f64)| {
        let (mean, shift) = (unit * now + sum / count, sum / count);
        let spread = (square / count - shift * shift).max(0.0).sqrt();
        let variation = (spread / mean) as f32;
        if mean > 0.0 && variation.is_finite() { variation } else { 0.0 }
    };
    sums.iter().zip(squares).zip(*first).map(of_cell).collect()
}
