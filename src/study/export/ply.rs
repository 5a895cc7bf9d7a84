//! Gaussians as PLY, binary little endian, with the vertex layout that viewers of 3-D Gaussian splats read (Kerbl et al. 2023).
//!
//! Per joint, all float32: `x y z` (m, world frame: x forward, y left, z up) · `nx ny nz` (0; readers expect them) ·
//! `f_dc_0..2` (colour c as (c − ½)/C₀, C₀ = 1/(2√π): the zeroth spherical harmonic) · `opacity` (β; the reader takes the
//! sigmoid) · `scale_0..2` (ln s, s in m; the reader takes exp) · `rot_0..3` (w, x, y, z, of length 1). SPEC section 2 stores
//! opacity, scale and rotation the same way, so nothing is lost but digits. Properties that splat viewers skip follow:
//! `vx vy vz` (m/s), and `person`, `joint` (int32, from 0). Units and joint names stand in the header's comments.

use crate::body::{Group, Pppr, Side, Skeleton};
use crate::output::replace_file;
use crate::study::StudyError;
use std::fmt::Write as _;
use std::path::Path;

/// C₀ = 1/(2√π), the zeroth spherical harmonic.
const SH_C0: f64 = 0.282_094_791_773_878_14;
/// sRGB of left, right and middle joints: the window's colours on a dark ground.
const LEFT: [u8; 3] = [0x4D, 0xA3, 0xFF];
const RIGHT: [u8; 3] = [0xFF, 0x9F, 0x45];
const MIDDLE: [u8; 3] = [0x9A, 0xA3, 0xAF];
/// The float32 properties that readers of splats know, and those of this program.
const FLOATS: [&str; 20] = [
    "x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0", "scale_1", "scale_2", "rot_0",
    "rot_1", "rot_2", "rot_3", "vx", "vy", "vz",
];
const INTEGERS: [&str; 2] = ["person", "joint"];

/// The file's bytes: a vertex a joint, person by person.
pub fn ply(params: &Pppr, skeleton: &Skeleton) -> Vec<u8> {
    let shape = params.shape();
    let mut bytes = header(params, skeleton).into_bytes();
    for flat in 0..shape.total_joints() {
        let joint = flat % shape.joints.max(1);
        for number in floats(params, flat, skeleton.side(joint)) {
            // Beyond float32 the largest number stands for it: a reader has no use for an infinity.
            let number = number.clamp(-f64::from(f32::MAX), f64::from(f32::MAX)) as f32;
            bytes.extend_from_slice(&number.to_le_bytes());
        }
        for number in [flat / shape.joints.max(1), joint] {
            bytes.extend_from_slice(&(number as i32).to_le_bytes());
        }
    }
    bytes
}

/// Writes [`ply`], atomically.
///
/// # Errors
/// Where the file cannot be written; an existing one is then untouched.
pub fn write_ply(path: &Path, params: &Pppr, skeleton: &Skeleton) -> Result<(), StudyError> {
    let written = replace_file(path, |out| out.write_all(&ply(params, skeleton)));
    written.map_err(|reason| StudyError::Write { reason, path: path.to_owned() })
}

fn header(params: &Pppr, skeleton: &Skeleton) -> String {
    let mut text = format!(
        "ply\nformat binary_little_endian 1.0\n\
         comment mhp-inspector {} PPPR: one 3-D Gaussian a joint\n\
         comment metres and m/s; world frame: x forward, y left, z up, radar at the origin\n\
         comment opacity = logit(alpha), scale = ln(metres), rot = w x y z, f_dc = (sRGB - 0.5) / 0.28209479\n\
         comment colours: left blue, right orange, middle grey\n",
        env!("CARGO_PKG_VERSION")
    );
    for (joint, name) in skeleton.joints.iter().enumerate() {
        // Headers are ASCII lines: what is not is made so, or a name could end the header.
        let name: String = name.chars().map(|c| if c.is_ascii_graphic() { c } else { '_' }).collect();
        let _ = writeln!(text, "comment joint {joint} {name}");
    }
    let _ = writeln!(text, "element vertex {}", params.shape().total_joints());
    for name in FLOATS {
        let _ = writeln!(text, "property float {name}");
    }
    for name in INTEGERS {
        let _ = writeln!(text, "property int {name}");
    }
    text + "end_header\n"
}

fn floats(params: &Pppr, joint: usize, side: Side) -> [f64; 20] {
    let ([x, y, z], [vx, vy, vz]) = (params.position(joint), params.velocity(joint));
    let [s0, s1, s2] = params.vec3(Group::LogScale, joint);
    let [r, g, b] = colour(side).map(|c| (f64::from(c) / 255.0 - 0.5) / SH_C0);
    let [qw, qx, qy, qz] = unit(params.rotation(joint));
    let beta = params.joint(Group::Beta, joint).first().copied().unwrap_or_default();
    [x, y, z, 0.0, 0.0, 0.0, r, g, b, beta, s0, s1, s2, qw, qx, qy, qz, vx, vy, vz]
}

fn colour(side: Side) -> [u8; 3] {
    match side {
        Side::Left => LEFT,
        Side::Right => RIGHT,
        Side::Middle => MIDDLE,
    }
}

/// Of length 1, because not every reader normalises; the zero quaternion is no rotation, as in the forward model.
fn unit(q: [f64; 4]) -> [f64; 4] {
    let length = q.iter().map(|c| c * c).sum::<f64>().sqrt();
    if length == 0.0 { [1.0, 0.0, 0.0, 0.0] } else { q.map(|c| c / length) }
}
