//! The definitions once more, as slowly as they read: sorts for percentiles and ranks, every neighbour of every cell.

use mhp_inspector::study::complexity::ComplexityOptions;

/// Peak density, static dominance, human saliency, hardness and stratum of a frame.
pub(crate) type Row = ([Option<f64>; 3], Option<f64>, Option<&'static str>);

pub(crate) fn percentile(values: &[f64], q: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(|a, b| a.partial_cmp(b).unwrap());
    let at = (sorted.len() - 1) as f64 * (q / 100.0);
    let (below, weight) = (at.floor() as usize, at - at.floor());
    let above = (below + 1).min(sorted.len() - 1);
    let (a, b) = (sorted[below], sorted[above]);
    if weight >= 0.5 { b - (b - a) * (1.0 - weight) } else { a + (b - a) * weight }
}

fn coordinates(shape: &[usize], mut cell: usize) -> Vec<i64> {
    let mut at = vec![0; shape.len()];
    for k in (0..shape.len()).rev() {
        at[k] = (cell % shape[k]) as i64;
        cell /= shape[k];
    }
    at
}

fn are_neighbours(shape: &[usize], a: usize, b: usize) -> bool {
    a != b && coordinates(shape, a).iter().zip(coordinates(shape, b)).all(|(x, y)| (x - y).abs() <= 1)
}

pub(crate) fn fill(map: &mut [f64], shape: &[usize]) {
    while map.iter().any(|x| !x.is_finite()) {
        let before = map.to_vec();
        for cell in 0..map.len() {
            let around: Vec<f64> = (0..map.len())
                .filter(|&b| are_neighbours(shape, cell, b))
                .map(|b| before[b])
                .filter(|x| x.is_finite())
                .collect();
            if !before[cell].is_finite() && !around.is_empty() {
                map[cell] = around.iter().sum::<f64>() / around.len() as f64;
            }
        }
    }
}

fn peak_density(map: &[f64], shape: &[usize], limit: f64) -> f64 {
    let is_peak = |&cell: &usize| {
        map[cell] > limit && (0..map.len()).all(|other| !are_neighbours(shape, cell, other) || map[other] < map[cell])
    };
    (0..map.len()).filter(is_peak).count() as f64 / map.len() as f64
}

fn mean(values: impl Iterator<Item = Option<f64>>) -> Option<f64> {
    let values: Vec<f64> = values.flatten().collect();
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// Sequence and maps; `None` where the frame cannot be read.
pub(crate) type Maps = Option<(usize, Vec<Vec<f64>>)>;

/// `frames`: sequence and maps of each frame, `None` where it cannot be read. `None` in, `None` out.
pub(crate) fn complexity(frames: &[Maps], shapes: &[&[usize]], options: &ComplexityOptions) -> Vec<Option<Row>> {
    let mut frames = frames.to_vec();
    for (_, maps) in frames.iter_mut().flatten() {
        for (map, shape) in maps.iter_mut().zip(shapes) {
            fill(map, shape);
        }
    }
    let above = |map: &[f64], percent: f64| {
        let limit = percentile(map, 100.0 - percent);
        map.iter().map(|&x| x > limit).collect::<Vec<bool>>()
    };
    let statics = |i: usize| {
        let window = options.window;
        let first = (i + 1).checked_sub(window)?;
        let sequence = frames[i].as_ref()?.0;
        let last: Vec<_> = frames[first..=i].iter().map(|frame| frame.as_ref().filter(|f| f.0 == sequence)).collect();
        let last: Vec<_> = last.into_iter().collect::<Option<_>>()?;
        mean((0..shapes.len()).map(|view| {
            let masks: Vec<Vec<bool>> = last.iter().map(|frame| above(&frame.1[view], options.kappa_pct)).collect();
            let own = masks.last().unwrap();
            let strong = own.iter().filter(|&&bit| bit).count();
            let always = (0..own.len()).filter(|&cell| masks.iter().all(|mask| mask[cell])).count();
            (strong > 0).then(|| always as f64 / strong as f64)
        }))
    };
    let statistics: Vec<Option<[Option<f64>; 3]>> = (0..frames.len())
        .map(|i| {
            let (_, maps) = frames[i].as_ref()?;
            let peaks = maps
                .iter()
                .zip(shapes)
                .map(|(map, shape)| Some(peak_density(map, shape, percentile(map, 100.0 - options.kappa_pct))));
            let saliency = maps.iter().map(|map| {
                let mask = above(map, options.tau_pct);
                let sum: f64 = map.iter().sum();
                let part: f64 = map.iter().zip(mask).filter(|(_, inside)| *inside).map(|(x, _)| x).sum();
                (sum != 0.0).then(|| part / sum)
            });
            Some([mean(peaks), statics(i), mean(saliency)])
        })
        .collect();
    let column = |k: usize| -> Vec<Option<f64>> { statistics.iter().map(|s| s.and_then(|s| s[k])).collect() };
    let ranks = [column(0), column(1), column(2)].map(|values| normalised(&values));
    let hardness: Vec<Option<f64>> = (0..frames.len())
        .map(|i| mean([ranks[0][i], ranks[1][i], ranks[2][i].map(|rank| 1.0 - rank)].into_iter()))
        .collect();
    let defined: Vec<f64> = hardness.iter().flatten().copied().collect();
    let stratum = |hardness: f64| {
        if hardness <= percentile(&defined, 100.0 / 3.0) {
            "easy"
        } else if hardness <= percentile(&defined, 200.0 / 3.0) {
            "medium"
        } else {
            "hard"
        }
    };
    statistics.iter().zip(hardness).map(|(s, hardness)| s.map(|s| (s, hardness, hardness.map(stratum)))).collect()
}

/// (average rank − 1)/(n − 1), by counting who is smaller and who is equal.
pub(crate) fn normalised(values: &[Option<f64>]) -> Vec<Option<f64>> {
    let defined: Vec<f64> = values.iter().flatten().copied().collect();
    let rank = |x: f64| {
        let smaller = defined.iter().filter(|&&y| y < x).count() as f64;
        let equal = defined.iter().filter(|&&y| y == x).count() as f64;
        let average = smaller + f64::midpoint(equal, 1.0);
        (defined.len() > 1).then(|| (average - 1.0) / (defined.len() - 1) as f64)
    };
    values.iter().map(|x| x.and_then(rank)).collect()
}
