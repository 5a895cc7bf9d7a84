//! A synthetic source of radar frames with truth: bodies and rooms to ADC samples to maps.
//!
//! The radar here owes nothing to the forward model that a fit uses. A [`Recording`] is a list of sequences; each has its own
//! people, room and receiver, drawn from the seed. Within a sequence the bodies move on, so that methods that look at
//! consecutive frames find them. Every frame can be made by itself, in any order and on any thread, with the same numbers.
//!
//! From the outside in: `options.rs` is what is asked for, `preset.rs` what a scenario means in numbers, `device.rs` the radars
//! and the processing of each layout, `performers.rs` who moves how and where, `room.rs` what else is there, `sequence.rs` puts them
//! together, `recording.rs` counts the frames, `cascade.rs` has the radars of HIBER and RT-Pose.

mod cascade;
mod device;
mod options;
mod performers;
mod preset;
mod recording;
mod room;
mod sequence;

pub use cascade::HIBER_FRAME_S;
pub use device::{Device, Radar};
pub use options::{Action, Options, SimulateError, SimulatedLayout};
pub use preset::{Recipe, ScenePreset};
pub use recording::Recording;
pub use sequence::{RawFrame, Sequence, SimulatedFrame};

use rand::{SeedableRng, rngs::StdRng};

/// A generator of its own for each sequence and purpose, so that adding one thing does not change another (`splitmix64` of
/// the three numbers).
fn generator(seed: u64, sequence: usize, purpose: u64) -> StdRng {
    let mix = |x: u64| {
        let x = x.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        x ^ (x >> 31)
    };
    StdRng::seed_from_u64(mix(mix(mix(seed) ^ sequence as u64) ^ purpose))
}
