//! Ends in groups: which of them are one, what is known of each, and what of the starts tells them apart.

use super::{Restart, RestartSettings, StartFeature};
use crate::body::Skeleton;
use crate::geometry::{Vec3, add, mean, norm, scale, sub};
use crate::mhp::Terms;
use kodama::{Method, linkage};
use serde::Serialize;
use std::sync::Arc;

/// Fewer starts on a side say nothing of what tells them apart.
const LEAST_TOLD: usize = 5;
/// Nor does a number that orders them hardly better than chance: area under its curve.
const LEAST_AUC: f64 = 0.65;

/// Ends that are one.
#[derive(Debug, Clone, PartialEq)]
pub struct Basin {
    /// Numbers of the starts that end here, that of the lowest loss first.
    pub members: Vec<usize>,
    /// Share of all fits.
    pub share: f64,
    /// The lowest L.
    pub loss: f64,
    /// The mean of L.
    pub mean_loss: f64,
    /// The mean of its unweighted terms.
    pub terms: Terms,
    /// The mean IoU, where known.
    pub iou: Option<f64>,
    /// The mean MAJPE, mm, where there is truth.
    pub majpe_mm: Option<f64>,
    /// The mean joints, m.
    pub mean: Vec<Vec3>,
    /// Where the first person looks: 0 at the radar, degrees to its left; `None` where the skeleton has no sides.
    pub heading_deg: Option<f64>,
    /// How far the ends are from the mean, mm, root mean square over joints and ends.
    pub spread_mm: f64,
    /// What of the starts tells it from the others; `None` where nothing does, or there are too few.
    pub telling: Option<Telling>,
}

/// A number of the starts that tells a basin from the others.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Telling {
    /// Which.
    pub feature: StartFeature,
    /// Its median over the starts that end in the basin.
    pub inside: f64,
    /// Over all others.
    pub outside: f64,
    /// The probability that a start that ends here has a larger one than a start that does not; or a smaller one.
    pub auc: f64,
}

/// Groups the ends of `done` fits.
pub(super) fn group(
    restarts: &[Option<Arc<Restart>>],
    done: usize,
    skeleton: &Skeleton,
    settings: &RestartSettings,
) -> Vec<Basin> {
    let known: Vec<(usize, &Restart)> =
        restarts.iter().enumerate().filter_map(|(k, r)| Some((k, r.as_deref()?))).collect();
    let ends: Vec<&[Vec3]> = known.iter().map(|(_, restart)| restart.end.positions()).collect();
    let mut basins: Vec<Basin> = joined(&ends, settings.apart_mm)
        .into_iter()
        .map(|members| {
            let mut members: Vec<(usize, &Restart)> = members.into_iter().map(|k| known[k]).collect();
            members.sort_by(|a, b| a.1.loss.total_cmp(&b.1.loss).then(a.0.cmp(&b.0)));
            basin(&members, done, skeleton)
        })
        .collect();
    basins.sort_by(|a, b| a.loss.total_cmp(&b.loss).then(a.members.cmp(&b.members)));
    for k in 0..basins.len() {
        basins[k].telling = telling(&known, &basins[k].members);
    }
    basins
}

/// The mean distance of the joints of two poses, mm.
fn apart_mm(a: &[Vec3], b: &[Vec3]) -> f64 {
    let sum: f64 = a.iter().zip(b).map(|(p, q)| norm(sub(*p, *q))).sum();
    1000.0 * sum / a.len().max(1) as f64
}

/// Poses in groups by average linkage, as long as two are nearer than `most_mm`; each in ascending order.
fn joined(poses: &[&[Vec3]], most_mm: f64) -> Vec<Vec<usize>> {
    let n = poses.len();
    let mut groups: Vec<Option<Vec<usize>>> = (0..n).map(|k| Some(vec![k])).collect();
    if n > 1 {
        let pairs = (0..n).flat_map(|i| (i + 1..n).map(move |j| (i, j)));
        let mut distances: Vec<f64> = pairs.map(|(i, j)| apart_mm(poses[i], poses[j])).collect();
        // The cluster that step k makes is called n + k.
        for step in linkage(&mut distances, n, Method::Average).steps() {
            if step.dissimilarity > most_mm {
                groups.push(None);
                continue;
            }
            let mut take = |cluster: usize| groups.get_mut(cluster).and_then(Option::take).unwrap_or_default();
            let mut all = take(step.cluster1);
            all.extend(take(step.cluster2));
            all.sort_unstable();
            groups.push(Some(all));
        }
    }
    groups.into_iter().flatten().collect()
}

fn basin(members: &[(usize, &Restart)], done: usize, skeleton: &Skeleton) -> Basin {
    let n = members.len().max(1) as f64;
    let average = |of: &dyn Fn(&Restart) -> Option<f64>| {
        let known: Vec<f64> = members.iter().filter_map(|(_, restart)| of(restart)).collect();
        (!known.is_empty()).then(|| known.iter().sum::<f64>() / known.len() as f64)
    };
    let joints = members.first().map_or(0, |(_, restart)| restart.end.positions().len());
    let middle =
        |joint: usize| scale(members.iter().fold([0.0; 3], |sum, (_, r)| add(sum, r.end.position(joint))), 1.0 / n);
    let mean: Vec<Vec3> = (0..joints).map(middle).collect();
    let away = |restart: &Restart| {
        restart.end.positions().iter().zip(&mean).map(|(p, q)| norm(sub(*p, *q)).powi(2)).sum::<f64>()
    };
    let squares: f64 = members.iter().map(|(_, restart)| away(restart)).sum();
    let a_person = skeleton.joints.len();
    Basin {
        members: members.iter().map(|(number, _)| *number).collect(),
        share: members.len() as f64 / done.max(1) as f64,
        loss: members.first().map_or(f64::NAN, |(_, restart)| restart.loss),
        mean_loss: average(&|restart| Some(restart.loss)).unwrap_or(f64::NAN),
        terms: Terms::from_fn(|term| average(&|restart| Some(restart.terms[term])).unwrap_or(0.0)),
        iou: average(&|restart| restart.iou),
        majpe_mm: average(&|restart| restart.majpe_mm),
        heading_deg: mean.get(..a_person).and_then(|person| heading(person, skeleton)),
        spread_mm: 1000.0 * (squares / (n * joints.max(1) as f64)).sqrt(),
        mean,
        telling: None,
    }
}

/// Where a person looks: 0 at the radar, positive to the person's left, degrees in −180 ..= 180. From the hips and shoulders;
/// `None` where the skeleton has none with sides.
pub fn heading(person: &[Vec3], skeleton: &Skeleton) -> Option<f64> {
    let side = |side: &str| {
        let named = person.iter().zip(&skeleton.joints);
        let of: Vec<Vec3> = named
            .filter(|(_, name)| {
                let name = name.to_ascii_lowercase();
                name.starts_with(side) && (name.ends_with("hip") || name.ends_with("shoulder"))
            })
            .map(|(p, _)| *p)
            .collect();
        (!of.is_empty()).then(|| mean(&of))
    };
    let across = sub(side("left")?, side("right")?);
    // Left is to the left of where one looks: forward is left turned clockwise by a quarter, seen from above.
    let forward = [across[1], -across[0]];
    let middle = mean(person);
    let to_radar = [-middle[0], -middle[1]];
    let (s, c) =
        (to_radar[0] * forward[1] - to_radar[1] * forward[0], to_radar[0] * forward[0] + to_radar[1] * forward[1]);
    (s != 0.0 || c != 0.0).then(|| s.atan2(c).to_degrees())
}

/// The number of the starts that orders them best into those that end here and those that do not.
fn telling(known: &[(usize, &Restart)], members: &[usize]) -> Option<Telling> {
    let (inside, outside): (Vec<_>, Vec<_>) = known.iter().partition(|(number, _)| members.contains(number));
    if inside.len() < LEAST_TOLD || outside.len() < LEAST_TOLD {
        return None;
    }
    let told = StartFeature::ALL.map(|feature| {
        let of =
            |side: &[&(usize, &Restart)]| -> Vec<f64> { side.iter().map(|(_, r)| feature.of(&r.offset)).collect() };
        let (a, b) = (of(&inside), of(&outside));
        let larger = area_under_curve(&a, &b);
        Telling { feature, inside: median(a), outside: median(b), auc: larger.max(1.0 - larger) }
    });
    told.into_iter().max_by(|a, b| a.auc.total_cmp(&b.auc)).filter(|told| told.auc >= LEAST_AUC)
}

/// The probability that one of `a` is larger than one of `b`; a tie counts half.
fn area_under_curve(a: &[f64], b: &[f64]) -> f64 {
    let wins: f64 = a
        .iter()
        .flat_map(|x| {
            b.iter().map(move |y| {
                if x > y {
                    1.0
                } else if x == y {
                    0.5
                } else {
                    0.0
                }
            })
        })
        .sum();
    wins / (a.len() * b.len()).max(1) as f64
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests fail by panicking")]
    use super::*;
    use crate::body::{Group, Pppr, PpprShape};
    use crate::explore::restarts::StartOffset;

    fn skeleton() -> Skeleton {
        Skeleton::preset("coco17").unwrap()
    }

    /// Somebody 3 m before the radar who looks at it, moved to the left.
    fn person(left_m: f64) -> Pppr {
        let skeleton = skeleton();
        let mut params = Pppr::zeros(PpprShape { persons: 1, joints: 17, doppler_features: 1 });
        for joint in 0..17 {
            // Who looks at the radar has his left at the radar's right.
            let side = if skeleton.joints[joint].starts_with("left") { -0.2 } else { 0.2 };
            params.set_vec3(Group::Position, joint, [3.0, left_m + side, 0.1 * joint as f64]);
        }
        params
    }

    fn restart(left_m: f64, loss: f64, yaw_deg: f64) -> Arc<Restart> {
        let end = Arc::new(person(left_m));
        let offset = StartOffset { yaw_deg, ..StartOffset::default() };
        let (start, terms) = (Arc::clone(&end), Terms::default());
        Arc::new(Restart { offset, start, end, loss, terms, iou: Some(0.5), majpe_mm: None })
    }

    #[test]
    fn ends_are_grouped_and_the_lowest_is_the_best() {
        let mut restarts: Vec<_> =
            (0..12).map(|k| Some(restart(0.002 * f64::from(k), 0.5, 170.0 - f64::from(k)))).collect();
        restarts.extend(
            (0..8).map(|k| Some(restart(1.0 + 0.002 * f64::from(k), 0.4 - 0.001 * f64::from(k), f64::from(k)))),
        );
        restarts.push(None);
        let settings = RestartSettings::default();
        let basins = group(&restarts, 21, &skeleton(), &settings);
        assert_eq!(basins.iter().map(|basin| basin.members.len()).collect::<Vec<_>>(), [8, 12]);
        assert_eq!((basins[0].members[0], basins[0].loss), (19, 0.393));
        assert!((basins[0].share - 8.0 / 21.0).abs() < 1e-12, "one that diverged counts as a start");
        let told = basins[0].telling.unwrap();
        assert_eq!((told.auc, told.inside), (1.0, 4.0));
        assert!(matches!(told.feature, StartFeature::Yaw | StartFeature::Turned));
        assert!(basins[0].heading_deg.unwrap().abs() < 25.0, "{:?}", basins[0].heading_deg);
        let one = group(&restarts, 21, &skeleton(), &RestartSettings { apart_mm: 2000.0, ..settings });
        assert_eq!(one.len(), 1);
    }

    #[test]
    fn the_heading_is_told_from_the_sides() {
        let skeleton = skeleton();
        let apart = |a: f64, b: f64| ((a - b + 180.0).rem_euclid(360.0) - 180.0).abs();
        assert!(heading(person(0.0).positions(), &skeleton).unwrap().abs() < 2.0);
        for turn in [90.0, -60.0, 180.0] {
            let mut params = person(0.0);
            crate::explore::move_person(&mut params, &skeleton, 0, [0.0; 3], f64::to_radians(turn));
            let found = heading(params.positions(), &skeleton).unwrap();
            assert!(apart(found, turn) < 2.0, "{turn}: {found}");
        }
    }
}
