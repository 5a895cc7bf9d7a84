//! F2, near-field distortion: how near the nearest joint is for an array of this width.
//!
//! The forward model's angles are those of plane waves. A wave from range r deviates from one by π/8 · d_F/r at the edge
//! of an array of width D, where d_F = 2D²/λ is the Fraunhofer distance. The main lobe loses the square of that deviation,
//! hence the raw value compares its square with the customary limit, π/8:
//!
//! ```text
//! raw = φ²/(φ² + (π/8)²) = 1/(1 + (r/d_F)²),   ½ at d_F, 0.8 at half of it, 0.06 at four times of it
//! nearness = ln(d_F/r)
//! ```
//!
//! Nobody publishes D; the point spread tells it. The main lobe of an evenly weighted array has the standard deviation
//! σ_θ = 0.488 λ/D (`radar::main_lobe_sigma_bins`), and a tapered array with the same lobe is wider, so that D, d_F and the
//! raw value are lower bounds. Each view is judged by its finer angle and its own range; the view with the highest value counts.
//! The score rests on the nearness, which is the raw value's own order.

use super::number_text::{joint, length};
use super::resolution::{FWHM, Resolution, echo};
use super::{EvidenceInput, Finding, FindingPlace, Found, Measure, falling};
use crate::body::{Group, Pppr};
use crate::geometry::{Mat3, Vec3, dot, mat_t_vec, norm, rotation_from_quaternion};
use crate::labels::Tag;
use crate::radar::View;

/// σ_θ D/λ of an evenly weighted array: `radar::main_lobe_sigma_bins` of a rectangular window.
const EVEN_SIGMA_BINS: f64 = 0.487_66;
/// Distances are held above this, m.
const NEAREST_M: f64 = 0.01;
/// The deviation from a plane wave at the array's edge at the Fraunhofer distance, degrees: π/8.
const EDGE_PHASE_DEG: f64 = 22.5;

/// One view.
struct Seen<'a> {
    view: &'a View,
    /// The finer σ_θ, rad.
    sigma_rad: f64,
    /// D, m.
    aperture_m: f64,
    /// d_F, m.
    fraunhofer_m: f64,
    /// The nearest joint.
    joint: usize,
    /// Its distance, m.
    range_m: f64,
    raw: f64,
}

pub(super) fn judge(input: &EvidenceInput<'_>) -> Found {
    let wavelength_m = input.problem.radar.wavelength_m();
    let views = input.problem.views.iter();
    let seen: Vec<Seen<'_>> = views.filter_map(|view| look(view, wavelength_m, input.params)).collect();
    // Reversed, because the last of equals would be taken.
    let Some(worst) = seen.iter().rev().max_by(|a, b| a.raw.total_cmp(&b.raw)) else {
        return Found::unknown(Tag::F2, "The array's width is unknown: no view has an angular point spread.");
    };
    let summary = format!(
        "The nearest joint is {} from the radar of {}, {:.2} times the Fraunhofer distance ({}) where the far field begins.",
        length(worst.range_m),
        worst.view.array,
        worst.range_m / worst.fraunhofer_m,
        length(worst.fraunhofer_m)
    );
    let mut findings: Vec<Finding> = seen.iter().flat_map(|seen| [nearest(input, seen), smear(input, seen)]).collect();
    findings.extend(widths(&seen, wavelength_m));
    let nearness = (worst.fraunhofer_m / worst.range_m.max(NEAREST_M)).ln();
    let measures = vec![Measure { name: "nearness".into(), value: nearness }];
    Found { mode: Tag::F2, raw: Some(worst.raw), measures, summary, findings }
}

fn look<'a>(view: &'a View, wavelength_m: f64, params: &Pppr) -> Option<Seen<'a>> {
    let sigmas = [view.psf.azimuth_rad, view.psf.elevation_rad].into_iter().filter(|&s| s.is_finite() && s > 0.0);
    let sigma_rad = sigmas.min_by(f64::total_cmp)?;
    let aperture_m = EVEN_SIGMA_BINS * wavelength_m / sigma_rad;
    let fraunhofer_m = 2.0 * aperture_m * aperture_m / wavelength_m;
    let ranges = params.positions().iter().map(|&p| norm(view.pose.view_from_world(p))).enumerate();
    let (joint, range_m) = ranges.filter(|(_, r)| r.is_finite()).min_by(|a, b| a.1.total_cmp(&b.1))?;
    let raw = falling(range_m / fraunhofer_m);
    raw.is_finite().then_some(Seen { view, sigma_rad, aperture_m, fraunhofer_m, joint, range_m, raw })
}

fn nearest(input: &EvidenceInput<'_>, seen: &Seen<'_>) -> Finding {
    let text = format!(
        "{}: {} is nearest, {}; the far field begins at 2D²/λ = {}. A wave from there is {:.0}° off a plane one at the \
         array's edge (22.5° is the customary limit).",
        seen.view.array,
        joint(input.problem, input.params, seen.joint),
        length(seen.range_m),
        length(seen.fraunhofer_m),
        EDGE_PHASE_DEG * seen.fraunhofer_m / seen.range_m.max(NEAREST_M)
    );
    Finding::new(text, Some(FindingPlace::Joint(seen.joint)))
}

/// Where D comes from, once for all views of one width.
fn widths(seen: &[Seen<'_>], wavelength_m: f64) -> Vec<Finding> {
    let mut told: Vec<f64> = Vec::new();
    let mut findings = Vec::new();
    for one in seen {
        if told.contains(&one.sigma_rad) {
            continue;
        }
        told.push(one.sigma_rad);
        let alike = seen.iter().filter(|other| other.sigma_rad == one.sigma_rad);
        let arrays: Vec<String> = alike.map(|other| other.view.array.clone()).collect();
        let text = format!(
            "{}: D = 0.488 λ/σ_θ = {} from the point spread σ_θ = {:.2}° and λ = {}, as of an evenly weighted array; a tapered \
             one is wider, and its far field farther.",
            arrays.join(", "),
            length(one.aperture_m),
            one.sigma_rad.to_degrees(),
            length(wavelength_m)
        );
        findings.push(Finding::new(text, None));
    }
    findings
}

/// How far the model spreads the joint across, against the joint's own size and the array's.
fn smear(input: &EvidenceInput<'_>, seen: &Seen<'_>) -> Finding {
    let name = joint(input.problem, input.params, seen.joint);
    let at = Resolution::new(seen.view, echo(seen.view, input.config, input.params, seen.joint));
    let across = if at.sigma_m[2] > at.sigma_m[1] { 2 } else { 1 };
    let smear_m = FWHM * at.sigma_m[across];
    let axes = seen.view.axes.iter().zip(at.cross_range_cells(seen.view));
    let widest = axes.max_by(|a, b| a.1.total_cmp(&b.1));
    let on_map =
        widest.map_or_else(String::new, |(axis, cells)| format!(", {cells:.1} cells of {}", axis.shown_name()));
    let own_m = FWHM * own_sigma_m(&seen.view.pose.rotation, input.params, seen.joint, at.directions[across]);
    let narrow = if smear_m < seen.aperture_m {
        " That is narrower than the array itself, which no unfocused array resolves."
    } else {
        ""
    };
    let text = format!(
        "{}: there the model smears it by {} across{on_map} (half-value width); {name} itself is {} wide.{narrow}",
        seen.view.array,
        length(smear_m),
        length(own_m)
    );
    Finding::new(text, Some(FindingPlace::Joint(seen.joint)))
}

/// Standard deviation of a joint's own Gaussian along `direction` of the view frame, m: √(eᵀ R S Sᵀ Rᵀ e).
fn own_sigma_m(view_rotation: &Mat3, params: &Pppr, joint: usize, direction: Vec3) -> f64 {
    let world = mat_t_vec(view_rotation, direction);
    let rotation = rotation_from_quaternion(params.rotation(joint));
    let inside = mat_t_vec(&rotation, world);
    let scales = params.vec3(Group::LogScale, joint).map(f64::exp);
    let spread: Vec3 = std::array::from_fn(|k| inside[k] * scales[k]);
    dot(spread, spread).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radar::{Window, main_lobe_sigma_bins};

    #[test]
    fn the_width_of_an_even_array_comes_back() {
        assert!((main_lobe_sigma_bins(Window::Rectangular, 256) - EVEN_SIGMA_BINS).abs() < 1e-5);
        assert_eq!((falling(0.0), falling(1.0), falling(2.0)), (1.0, 0.5, 0.2));
    }
}
