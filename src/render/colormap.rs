//! Colour maps for heatmaps, sampled on the CPU; the window turns a lookup table into a texture.

/// The colour of a cell that is not a number: in none of the maps.
pub const NAN_COLOR: [u8; 3] = [0xB0, 0x4A, 0x9C];

/// A colour map. Perceptually uniform ones first; viridis is the default.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Colormap {
    /// Blue to yellow.
    #[default]
    Viridis,
    /// Black over red to yellow.
    Inferno,
    /// Black over purple to white.
    Magma,
    /// A smooth rainbow; not uniform, for habit.
    Turbo,
    /// Black to white, linear in the sRGB value.
    Grey,
    /// Blue (low) over white (middle) to red (high), for differences with a fixed zero in the middle.
    Diverging,
}

impl Colormap {
    /// Every map, in the order it is offered.
    pub const ALL: [Self; 6] = [Self::Viridis, Self::Inferno, Self::Magma, Self::Turbo, Self::Grey, Self::Diverging];

    /// Its name on screen.
    pub fn name(self) -> &'static str {
        match self {
            Self::Viridis => "Viridis",
            Self::Inferno => "Inferno",
            Self::Magma => "Magma",
            Self::Turbo => "Turbo",
            Self::Grey => "Grey",
            Self::Diverging => "Diverging",
        }
    }

    /// sRGB at `t`, clamped to 0..=1; [`NAN_COLOR`] where `t` is not a number.
    pub fn sample(self, t: f64) -> [u8; 3] {
        if t.is_nan() {
            return NAN_COLOR;
        }
        let t = t.clamp(0.0, 1.0);
        let gradient = match self {
            Self::Viridis => colorous::VIRIDIS,
            Self::Inferno => colorous::INFERNO,
            Self::Magma => colorous::MAGMA,
            Self::Turbo => colorous::TURBO,
            Self::Grey => return [(t * 255.0).round() as u8; 3],
            Self::Diverging => return colorous::RED_BLUE.eval_continuous(1.0 - t).into_array(),
        };
        gradient.eval_continuous(t).into_array()
    }

    /// The map at i/255, i = 0..=255.
    pub fn lut(self) -> [[u8; 3]; 256] {
        std::array::from_fn(|i| self.sample(i as f64 / 255.0))
    }
}
