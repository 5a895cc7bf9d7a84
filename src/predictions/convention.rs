//! What numbers of a file mean: their unit, and which way its axes point.

use crate::geometry::Vec3;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// The unit of lengths.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Unit {
    /// Metres.
    M,
    /// Centimetres.
    Cm,
    /// Millimetres.
    Mm,
}

impl Unit {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::M, Self::Cm, Self::Mm];

    /// Metres in one of it.
    pub fn metres(self) -> f64 {
        match self {
            Self::M => 1.0,
            Self::Cm => 0.01,
            Self::Mm => 0.001,
        }
    }

    /// As it is written: `mm`.
    pub fn word(self) -> &'static str {
        match self {
            Self::M => "m",
            Self::Cm => "cm",
            Self::Mm => "mm",
        }
    }
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.word())
    }
}

impl FromStr for Unit {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.trim().to_ascii_lowercase().as_str() {
            "m" | "meter" | "meters" | "metre" | "metres" => Ok(Self::M),
            "cm" | "centimeter" | "centimeters" | "centimetre" | "centimetres" => Ok(Self::Cm),
            "mm" | "millimeter" | "millimeters" | "millimetre" | "millimetres" => Ok(Self::Mm),
            _ => Err(format!("unit \"{}\"; expected m, cm or mm", text.escape_debug())),
        }
    }
}

/// Which axis of a file each axis of the radar's frame (x forward, y to the left, z up) is, and its sign.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Axes([(usize, bool); 3]);

impl Axes {
    /// The radar's own frame: x forward, y to the left, z up.
    pub const WORLD: Self = Self([(0, true), (1, true), (2, true)]);
    /// A camera's as in computer vision: x to the right, y down, z forward.
    pub const CAMERA: Self = Self([(2, true), (0, false), (1, false)]);
    /// x to the right, y forward, z up.
    pub const RIGHT_FORWARD: Self = Self([(1, true), (0, false), (2, true)]);
    /// Names for the common ones.
    pub const NAMED: [(&'static str, Self); 3] =
        [("radar", Self::WORLD), ("camera", Self::CAMERA), ("right-forward-up", Self::RIGHT_FORWARD)];

    /// A point of the file in the radar's frame.
    pub fn world(self, p: Vec3) -> Vec3 {
        self.0.map(|(axis, positive)| if positive { p[axis] } else { -p[axis] })
    }

    /// A point of the radar's frame as the file has it.
    pub fn file(self, p: Vec3) -> Vec3 {
        let mut out = [0.0; 3];
        for (k, (axis, positive)) in self.0.into_iter().enumerate() {
            out[axis] = if positive { p[k] } else { -p[k] };
        }
        out
    }
}

impl fmt::Display for Axes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let one =
            |(axis, positive): (usize, bool)| format!("{}{}", if positive { "" } else { "-" }, ["x", "y", "z"][axis]);
        f.write_str(&self.0.map(one).join(","))
    }
}

impl From<Axes> for String {
    fn from(axes: Axes) -> Self {
        axes.to_string()
    }
}

impl TryFrom<String> for Axes {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl FromStr for Axes {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || {
            let names = Self::NAMED.map(|(name, _)| name).join(", ");
            let text = text.escape_debug();
            format!(
                "axes \"{text}\"; expected {names}, or three signed axes of the file for forward, left and up, as z,-x,-y"
            )
        };
        let lower = text.trim().to_ascii_lowercase();
        if let Some((_, axes)) = Self::NAMED.into_iter().find(|(name, _)| *name == lower) {
            return Ok(axes);
        }
        let parts: Vec<&str> = lower.split(',').map(str::trim).collect();
        let [a, b, c] = parts[..] else { return Err(wrong()) };
        let axis = |part: &str| {
            let (positive, letter) = match part.strip_prefix('-') {
                Some(rest) => (false, rest),
                None => (true, part.strip_prefix('+').unwrap_or(part)),
            };
            ["x", "y", "z"].iter().position(|name| *name == letter).map(|axis| (axis, positive))
        };
        let (Some(a), Some(b), Some(c)) = (axis(a), axis(b), axis(c)) else { return Err(wrong()) };
        let different = a.0 != b.0 && b.0 != c.0 && a.0 != c.0;
        let axes = Self([a, b, c]);
        // A mirror exchanges left and right of every body.
        let [x, y, z] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|e| axes.world(e));
        let handed = crate::geometry::dot(crate::geometry::cross(x, y), z);
        match (different, handed > 0.0) {
            (false, _) => Err(wrong()),
            (true, false) => {
                Err(format!("axes \"{}\" mirror the body: left would be right; change one sign", text.escape_debug()))
            }
            (true, true) => Ok(axes),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_read_back_and_turn_there_and_back() {
        for (name, axes) in Axes::NAMED {
            assert_eq!(name.parse(), Ok(axes));
            assert_eq!(axes.to_string().parse(), Ok(axes));
            assert_eq!(axes.file(axes.world([1.0, 2.0, 3.0])), [1.0, 2.0, 3.0], "{name}");
        }
        // Of a camera: two metres ahead, one to the right, half a metre down.
        assert_eq!(Axes::CAMERA.world([1.0, 0.5, 2.0]), [2.0, -1.0, -0.5]);
    }

    #[test]
    fn what_is_no_frame_of_axes_is_told() {
        for text in ["", "x,y", "x,x,z", "a,b,c", "x,y,z,x"] {
            assert!(text.parse::<Axes>().is_err_and(|why| why.contains("expected radar, camera")), "{text}");
        }
        assert!("x,-y,z".parse::<Axes>().is_err_and(|why| why.contains("mirror")));
        assert_eq!("MM".parse(), Ok(Unit::Mm));
        assert!("feet".parse::<Unit>().is_err_and(|why| why.contains("expected m, cm or mm")));
    }
}
