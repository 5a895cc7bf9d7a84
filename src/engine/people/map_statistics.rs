//! The comparison: the same classifier alone, without detection, clusters or earlier frames.
//!
//! It sees six statistics of each of the first two maps. That is what a small network can be given without looking where
//! the echoes are; it shows what detection and clustering are worth.

/// Numbers of a frame.
pub const STATISTICS: usize = 12;
/// Statistics of a map: mean, standard deviation and skewness of ln H; how far the largest lies above the mean; the
/// shares of the cells that are 2 and 3 standard deviations above it.
const OF_A_MAP: usize = STATISTICS / 2;

/// Twelve numbers of a frame: six of each of the first two maps, zeros for a map that is not there.
pub fn map_statistics(maps: &[&[f64]]) -> [f32; STATISTICS] {
    let mut all = [0.0; STATISTICS];
    for (map, out) in maps.iter().zip(all.chunks_exact_mut(OF_A_MAP)) {
        out.copy_from_slice(&statistics(map));
    }
    all
}

fn statistics(map: &[f64]) -> [f32; OF_A_MAP] {
    let ln: Vec<f64> = map.iter().filter(|x| x.is_finite()).map(|x| x.max(f64::MIN_POSITIVE).ln()).collect();
    if ln.is_empty() {
        return [0.0; OF_A_MAP];
    }
    let n = ln.len() as f64;
    let mean = ln.iter().sum::<f64>() / n;
    let moment = |k: i32| ln.iter().map(|x| (x - mean).powi(k)).sum::<f64>() / n;
    let deviation = moment(2).sqrt().max(1e-12);
    let above = |k: f64| ln.iter().filter(|&&x| x > mean + k * deviation).count() as f64 / n;
    let top = ln.iter().copied().fold(f64::NEG_INFINITY, f64::max) - mean;
    [mean, deviation, moment(3) / deviation.powi(3), top, above(2.0), above(3.0)].map(|x| x as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_that_is_missing_is_zeros_and_a_level_one_has_no_spread() {
        let s = map_statistics(&[&[std::f64::consts::E; 8]]);
        assert!((s[0] - 1.0).abs() < 1e-6 && s[1] < 1e-6 && s[3].abs() < 1e-6);
        assert_eq!(s[6..], [0.0; 6]);
        assert_eq!(map_statistics(&[&[f64::NAN; 3]]), [0.0; 12]);
    }
}
