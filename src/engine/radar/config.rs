//! The chirp and the array, as far as the forward model needs them.

use serde::{Deserialize, Serialize};

/// Speed of light in vacuum, m/s.
pub const SPEED_OF_LIGHT: f64 = 299_792_458.0;

/// One radar's chirp and array; SPEC section 3 and the `[radar]` table of SPEC section 6.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RadarConfig {
    /// Start frequency of the chirp, Hz.
    pub start_hz: f64,
    /// Swept bandwidth B, Hz.
    pub bandwidth_hz: f64,
    /// Chirp duration T_c, s.
    pub chirp_s: f64,
    /// Coherent processing interval T_frame, s.
    pub frame_s: f64,
    /// Maximum detection range, m: the attenuation is (r_max/d)⁴.
    pub r_max_m: f64,
    /// Horizontal element spacing, m.
    pub l_az_m: f64,
    /// Vertical element spacing, m.
    pub l_el_m: f64,
    /// Length N_d of a joint's Doppler features ω.
    #[serde(default = "default_doppler_features")]
    pub doppler_features: usize,
    /// Height of the radar above the floor, m, where it is known: only the floor term and the starts of fits that have one
    /// read it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub height_m: Option<f64>,
}

fn default_doppler_features() -> usize {
    32
}

impl Default for RadarConfig {
    /// A 77 GHz radar with 2.5 GHz of bandwidth and half-wave spacing: used where a data set does not publish its chirp.
    fn default() -> Self {
        Self {
            start_hz: 77e9,
            bandwidth_hz: 2.5e9,
            chirp_s: 60e-6,
            frame_s: 0.0128,
            r_max_m: 12.0,
            l_az_m: 0.0019,
            l_el_m: 0.0019,
            doppler_features: default_doppler_features(),
            height_m: None,
        }
    }
}

impl RadarConfig {
    /// Wavelength at the centre of the sweep, λ = c/(f_start + B/2), m.
    pub fn wavelength_m(&self) -> f64 {
        SPEED_OF_LIGHT / (self.start_hz + self.bandwidth_hz / 2.0)
    }

    /// Chirp slope S = B/T_c, Hz/s.
    pub fn slope_hz_per_s(&self) -> f64 {
        self.bandwidth_hz / self.chirp_s
    }

    /// Range resolution c/(2B), m.
    pub fn range_resolution_m(&self) -> f64 {
        SPEED_OF_LIGHT / (2.0 * self.bandwidth_hz)
    }
}
