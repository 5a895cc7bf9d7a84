//! What stands still around a person: whether a map has it, and how strong each cell of it is.
//!
//! Where static echoes were not removed, levels follow reflectors instead of the body. Over the frames around, the lower quartile
//! of a cell's power is what stands there while a person who walks is elsewhere: it joins the noise under the person
//! (`mhp/levels.rs`). Of somebody who stands it is the body itself, and nothing tells the two apart: under such a body the noise is what
//! lies beside it at each range alone (`mhp/frame_em.rs`).

use crate::mhp::percentile;
use crate::mhp::region::Region;
use crate::radar::Quantity;

/// Of a cell's powers over time, percent: what is there also while a person is elsewhere.
const QUARTILE_PCT: f64 = 25.0;
/// The noise, of a map's powers, percent; and how far above it nothing but an echo is.
const NOISE_PCT: f64 = 30.0;
const ECHO: f64 = 30.0;
/// From this share of the cells beside the person on that are echoes all the time, static echoes were not removed.
const CLUTTERED: f64 = 0.015;

/// The power that stands in each cell of a view, of its `maps` over time, C order.
pub(super) fn background(maps: &[Vec<f64>], quantity: Quantity) -> Vec<f64> {
    let cells = maps.first().map_or(0, Vec::len);
    let mut over_time = Vec::with_capacity(maps.len());
    (0..cells)
        .map(|cell| {
            over_time.clear();
            over_time.extend(maps.iter().map(|map| quantity.power(map[cell])));
            percentile(&over_time, QUARTILE_PCT)
        })
        .collect()
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
