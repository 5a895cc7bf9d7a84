//! What was found of a person, in words.

use super::Person;
use super::velocity::{Radial, Source};
use crate::config::{FitConfig, GradientVelocity, Yaw};

/// What was found of a person, in words.
pub(super) fn notes_of(person: &Person, config: &FitConfig) -> Vec<String> {
    let at = person.at;
    let walking = person.track.as_ref().filter(|track| config.yaw == Yaw::Motion && track.heading.is_some());
    let mut notes = vec![match walking {
        Some(track) => format!(
            "{} at x {:.2} m, y {:.2} m, facing where it goes: {:.2} m/s over {} frames",
            person.posture.words(),
            at[0],
            at[1],
            track.velocity[0].hypot(track.velocity[1]),
            track.sightings.len()
        ),
        None => format!("{} at x {:.2} m, y {:.2} m, facing the radar", person.posture.words(), at[0], at[1]),
    }];
    notes.push(match person.expected.map(|expected| (expected.extent_m, expected.middle_m)) {
        Some((Some([low, high]), _)) => format!("feet at z {low:.2} m and head at {high:.2} m seen"),
        Some((None, middle)) => format!("no feet and head seen: middle of the body expected at z {middle:.2} m"),
        None => "position not read from the peaks: the middle of the views".to_owned(),
    });
    notes.push(match person.radial {
        _ if !config.init.velocity => "velocity 0: not read from the maps".to_owned(),
        Some(Radial { mps, source: Source::Doppler, .. }) => {
            format!("radial velocity {mps:.2} m/s from the Doppler axis")
        }
        Some(Radial { mps, source: Source::Gradient, .. }) if walking.is_none() => match config.init.gradient {
            GradientVelocity::Flow => format!("radial velocity {mps:.2} m/s from the intensity gradient"),
            GradientVelocity::Magnitude => {
                format!("radial velocity {mps:.2} m/s, the magnitude of the intensity gradient: it has no sign")
            }
        },
        _ if walking.is_some() => "velocity from the frames around".to_owned(),
        _ => "velocity 0: no Doppler axis and no frame around".to_owned(),
    });
    notes
}
