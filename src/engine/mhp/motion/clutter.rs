//! What stands still around a person: whether a map has it, and how strong each cell of it is.
//!
//! Where static echoes were not removed, levels follow reflectors instead of the body. Two things bound what stands in a cell over
//! the frames around. While a person who walks is elsewhere nothing else is there: the lower quartile of its powers. And what
//! does not change has no variance: a constant echo of power A under one that fluctuates as speckle does, of mean power S, has
//! the mean A + S and the variance 2 A S + S², so that A = √(mean² − variance) (moments of a Rice distribution). The smaller of the two
//! joins the noise under the person (`mhp/levels.rs`). A trunk that stands still does not fluctuate either: where somebody who
//! does not walk stands, nothing is taken for background (`spare`), and the noise is what lies beside at each range alone
//! (`mhp/frame_em.rs`); and where noise and background explain the maps without anybody ([`HIDDEN`]), none is.
//!
//! What a person hides of what stands behind is left in: of the same scenes with shadows and without (`simulate --shadows`) fits are
//! as far off.

use super::ReducedViews;
use crate::config::{Clutter, EmRegion, FitConfig};
use crate::geometry::Vec3;
use crate::mhp::percentile::{between, percentile, place};
use crate::mhp::region::{self, Region};
use crate::mhp::{FitError, Problem};
use crate::radar::{AxisKind, Quantity, View};
use std::borrow::Cow;

/// Of a cell's powers over time, percent: what is there also while a person is elsewhere.
const QUARTILE_PCT: f64 = 25.0;
/// The noise, of a map's powers, percent; and how far above it nothing but an echo is.
const NOISE_PCT: f64 = 30.0;
const ECHO: f64 = 30.0;
/// Frames from which on a background is known around somebody who does not walk: fewer say little of what fluctuates.
const FEWEST_STANDING: usize = 5;
/// L_EM with nobody, below which a background hides whoever stands before it: little is left that a body could explain.
pub(super) const HIDDEN: f64 = 0.28;
/// Half the depth and width of a trunk, m.
const TRUNK_M: f64 = 0.15;
/// From this share of the cells beside the person on that are echoes all the time, static echoes were not removed.
const CLUTTERED: f64 = 0.015;

/// The power that stands in each cell of each view around persons who stand at `centres`, or walk away from them, with these regions;
/// `None` where it is not asked for, cannot be known, or nothing stands there.
///
/// # Errors
/// Where a centre is not finite.
pub(super) fn known<'a>(
    (problem, config): (&Problem, &FitConfig),
    reduced: &'a ReducedViews,
    regions: &[Region],
    (centres, walk): (&[Vec3], bool),
) -> Result<Option<Cow<'a, [Vec<f64>]>>, FitError> {
    let frames = problem.neighbours_in(config.frames_around).len() + 1;
    let asked = config.clutter == Clutter::Modelled && !problem.static_removed;
    if !asked || frames < if walk { 2 } else { FEWEST_STANDING } {
        return Ok(None);
    }
    let of_view = |view: &View, maps| background(maps, view.quantity);
    let backgrounds = reduced.maps.backgrounds(problem, config.frames_around, of_view);
    let mut seen = reduced.views().iter().zip(backgrounds).zip(regions);
    if !seen.any(|((view, background), region)| is_cluttered(background, &view.shape(), region)) {
        return Ok(None);
    }
    let mut known = Cow::Borrowed(backgrounds);
    if !walk {
        spare(known.to_mut(), reduced.views(), centres)?;
    }
    Ok(Some(known))
}

/// The power that stands in each cell of a view, of its `maps` over time, C order.
fn background(mut maps: Vec<Vec<f64>>, quantity: Quantity) -> Vec<f64> {
    maps.iter_mut().flatten().for_each(|h| *h = quantity.power(*h));
    let constant = constant(&maps);
    let mut standing = quartile(maps);
    standing.iter_mut().zip(constant).for_each(|(power, constant)| *power = power.min(constant));
    standing
}

/// The power in each cell that does not change, of its `powers` over time: √(mean² − variance), or nothing.
fn constant(powers: &[Vec<f64>]) -> Vec<f64> {
    let mut moments = vec![[0.0; 2]; powers.first().map_or(0, Vec::len)];
    for map in powers {
        for ([sum, squares], &power) in moments.iter_mut().zip(map) {
            *sum += power;
            *squares += power * power;
        }
    }
    let count = powers.len() as f64;
    let of_cell = |[sum, squares]: [f64; 2]| {
        let mean = sum / count;
        let variance = (squares - sum * mean).max(0.0) / (count - 1.0).max(1.0);
        // An erased cell stays NaN.
        let left = mean * mean - variance;
        if left < 0.0 { 0.0 } else { left.sqrt() }
    };
    moments.into_iter().map(of_cell).collect()
}

/// The lower quartile of each cell's powers over time. All cells are sorted at once, as far as that needs it: map by map the smaller
/// power of each cell changes places with the larger one.
fn quartile(mut maps: Vec<Vec<f64>>) -> Vec<f64> {
    let Some(last) = maps.len().checked_sub(1) else { return Vec::new() };
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

/// Takes from a background of each view what stands where the trunks of persons around `centres` (world frame, m) do; over their whole
/// height, for above and below at that depth are they, too.
///
/// # Errors
/// Where a centre is not finite.
fn spare(backgrounds: &mut [Vec<f64>], views: &[View], centres: &[Vec3]) -> Result<(), FitError> {
    for centre in centres {
        let (trunks, _) = region::regions(views, EmRegion::HalfWidth(TRUNK_M), &[*centre])?;
        for ((view, background), mut trunk) in views.iter().zip(&mut *backgrounds).zip(trunks) {
            for (bins, axis) in trunk.bins.iter_mut().zip(&view.axes) {
                if matches!(axis.kind, AxisKind::Z | AxisKind::Elevation) {
                    *bins = [0, axis.bins];
                }
            }
            trunk.indices(&view.shape()).into_iter().for_each(|cell| background[cell] = 0.0);
        }
    }
    Ok(())
}

/// Whether a background of this shape has echoes beside the person's region.
fn is_cluttered(background: &[f64], shape: &[usize], region: &Region) -> bool {
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
    fn the_background_is_no_more_than_the_quartile_and_what_does_not_change() {
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
                let mean = over_time.iter().sum::<f64>() / f64::from(frames);
                let squares = over_time.iter().map(|power| (power - mean).powi(2)).sum::<f64>();
                let variance = squares / f64::from(frames - 1).max(1.0);
                let constant = (mean * mean - variance).max(0.0).sqrt();
                let quartile = percentile(&over_time, QUARTILE_PCT);
                let expected = quartile.min(constant);
                let slack = 1e-6 * (1.0 + mean);
                assert!((found[cell] - expected).abs() < slack, "{frames} {cell}: {} {expected}", found[cell]);
            }
            assert!(found[9].is_nan());
        }
        assert!(background(Vec::new(), Quantity::Power).is_empty());
    }

    /// A reflector under speckle: the quartile has a share of the speckle, the moments have the reflector.
    #[test]
    fn what_does_not_change_is_told_from_what_fluctuates() {
        // Speckle around a full turn of phase against the reflector, its power exponential by quantiles.
        let frames: Vec<f64> = (0..64).map(f64::from).collect();
        let cell = |reflector: f64, speckle: f64| -> Vec<Vec<f64>> {
            let of = |&k: &f64| {
                let power = -speckle * (1.0 - (k + 0.5) / 64.0).ln();
                let (sin, cos) = (k * 2.4).sin_cos();
                let (re, im) = (reflector.sqrt() + power.sqrt() * cos, power.sqrt() * sin);
                vec![re.hypot(im)]
            };
            frames.iter().map(of).collect()
        };
        let constant = |reflector, speckle| {
            let powers: Vec<Vec<f64>> = cell(reflector, speckle).into_iter().map(|map| vec![map[0] * map[0]]).collect();
            super::constant(&powers)[0]
        };
        assert!((constant(4.0, 1.0) - 4.0).abs() < 0.4, "{}", constant(4.0, 1.0));
        assert!((constant(4.0, 0.0) - 4.0).abs() < 1e-6);
        assert!(constant(0.0, 1.0) < 0.35, "{}", constant(0.0, 1.0));
    }
}
