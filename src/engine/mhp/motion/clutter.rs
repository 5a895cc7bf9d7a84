//! What stands still around a person: whether a map has it, and how strong each cell of it is.
//!
//! Where static echoes were not removed, levels follow reflectors instead of the body. Over the frames around, the lower quartile
//! of a cell's power is what stands there while a person who walks is elsewhere: it joins the noise under the person
//! (`mhp/levels.rs`). Of somebody who stands it is the body itself, and nothing tells the two apart: under such a body the noise is what
//! lies beside it at each range alone (`mhp/frame_em.rs`).

use crate::mhp::percentile::{between, percentile, place};
use crate::mhp::region::Region;
use crate::radar::Quantity;

/// Of a cell's powers over time, percent: what is there also while a person is elsewhere.
const QUARTILE_PCT: f64 = 25.0;
/// The noise, of a map's powers, percent; and how far above it nothing but an echo is.
const NOISE_PCT: f64 = 30.0;
const ECHO: f64 = 30.0;
/// From this share of the cells beside the person on that are echoes all the time, static echoes were not removed.
const CLUTTERED: f64 = 0.015;

/// The power that stands in each cell of a view, of its `maps` over time, C order. All cells are sorted at once, as far as the
/// quartile needs it: map by map the smaller power of each cell changes places with the larger one.
pub(super) fn background(mut maps: Vec<Vec<f64>>, quantity: Quantity) -> Vec<f64> {
    let Some(last) = maps.len().checked_sub(1) else { return Vec::new() };
    maps.iter_mut().flatten().for_each(|h| *h = quantity.power(*h));
    let (lower, weight) = place(last, QUARTILE_PCT);
    let upper = (lower + 1).min(last);
    for rank in 0..=upper {
        let (sorted, rest) = maps.split_at_mut(rank + 1);
        let Some(least) = sorted.last_mut() else { continue };
        for map in rest {
            for (a, b) in least.iter_mut().zip(map) {
                (*a, *b) = if *b < *a { (*b, *a) } else { (*a, *b) };
            }
        }
    }
    maps[lower].iter().zip(&maps[upper]).map(|(&a, &b)| between(a, b, weight)).collect()
}

/// Whether a background of this shape has echoes beside the person's region.
pub(super) fn is_cluttered(background: &[f64], shape: &[usize], region: &Region) -> bool {
    let mut beside = vec![true; background.len()];
    for cell in region.indices(shape) {
        beside[cell] = false;
    }
    let echo = ECHO * percentile(background, NOISE_PCT);
    let (count, echoes) = background
        .iter()
        .zip(beside)
        .filter(|(_, beside)| *beside)
        .fold((0_usize, 0_usize), |(count, echoes), (&power, _)| (count + 1, echoes + usize::from(power > echo)));
    count > 0 && echoes as f64 > CLUTTERED * count as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_background_is_the_percentile_of_each_cell() {
        let mut state = 7_u64;
        for frames in 1..=14 {
            let mut number = || {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                f64::from((state >> 40) as u32 % 50)
            };
            // The last cell was erased.
            let maps: Vec<Vec<f64>> =
                (0..frames).map(|_| (0..9).map(|_| number()).chain([f64::NAN]).collect()).collect();
            let found = background(maps.clone(), Quantity::Amplitude);
            for cell in 0..9 {
                let over_time: Vec<f64> = maps.iter().map(|map| map[cell] * map[cell]).collect();
                assert_eq!(found[cell], percentile(&over_time, QUARTILE_PCT), "{frames} {cell}");
            }
            assert!(found[9].is_nan());
        }
        assert!(background(Vec::new(), Quantity::Power).is_empty());
    }
}
