//! Tapers for the FFTs: symmetric about the middle of the samples, largest value 1.
//!
//! Symmetric rather than periodic, because the same taper also weighs the elements of an array, and because a symmetric
//! taper has a real spectrum about its middle, which is what [`super::psf`] fits.

use std::f64::consts::{PI, TAU};

/// A window function.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Window {
    /// All ones: narrowest main lobe (first null at 1 bin), sidelobes at −13 dB.
    Rectangular,
    /// ½ − ½ cos: first null at 2 bins, sidelobes at −31 dB, falling fast.
    Hann,
    /// 0.54 − 0.46 cos: first null at 2 bins, sidelobes at −43 dB, nearly level.
    Hamming,
    /// 0.42 − 0.5 cos + 0.08 cos 2: first null at 3 bins, sidelobes at −58 dB.
    Blackman,
    /// Dolph–Chebyshev: the narrowest main lobe for sidelobes that all lie `sidelobe_db` below it (positive number).
    Chebyshev {
        /// Sidelobe level below the main lobe, dB, positive.
        sidelobe_db: f64,
    },
}

impl Window {
    /// The names in manifests: those of [`Self::named`].
    pub const NAMES: &str =
        "\"rectangular\", \"hann\", \"hamming\", \"blackman\" or \"chebyshev-30\" (sidelobes 30 dB down)";

    /// The window of a name in manifests.
    pub fn named(name: &str) -> Option<Self> {
        let level = |text: &str| text.parse().ok().filter(|db| (10.0..=120.0).contains(db));
        match name {
            "rectangular" => Some(Self::Rectangular),
            "hann" => Some(Self::Hann),
            "hamming" => Some(Self::Hamming),
            "blackman" => Some(Self::Blackman),
            other => {
                other.strip_prefix("chebyshev-").and_then(level).map(|sidelobe_db| Self::Chebyshev { sidelobe_db })
            }
        }
    }

    /// The name in manifests.
    pub fn name(self) -> String {
        match self {
            Self::Rectangular => "rectangular".into(),
            Self::Hann => "hann".into(),
            Self::Hamming => "hamming".into(),
            Self::Blackman => "blackman".into(),
            Self::Chebyshev { sidelobe_db } => format!("chebyshev-{sidelobe_db}"),
        }
    }

    /// The `n` weights. One sample has weight 1; none gives an empty vector.
    pub fn weights(self, n: usize) -> Vec<f64> {
        if n < 2 {
            return vec![1.0; n];
        }
        match self {
            Self::Rectangular => vec![1.0; n],
            Self::Hann => cosine_sum(n, &[0.5, 0.5]),
            Self::Hamming => cosine_sum(n, &[0.54, 0.46]),
            Self::Blackman => cosine_sum(n, &[0.42, 0.5, 0.08]),
            Self::Chebyshev { sidelobe_db } => chebyshev(n, sidelobe_db.abs()),
        }
    }

    /// Amplitude of the spectrum of the `n` weights at a frequency of `bins` cycles over the n samples, relative to its
    /// value at 0.
    pub fn response(self, n: usize, bins: f64) -> f64 {
        response(&self.weights(n), bins)
    }
}

/// Amplitude of the spectrum of symmetric `weights` at `bins` cycles over their number, relative to the value at 0.
pub(super) fn response(weights: &[f64], bins: f64) -> f64 {
    let n = weights.len() as f64;
    let middle = (n - 1.0) / 2.0;
    let sum: f64 = weights.iter().enumerate().map(|(i, w)| w * (TAU * bins * (i as f64 - middle) / n).cos()).sum();
    (sum / weights.iter().sum::<f64>()).abs()
}

/// a₀ − a₁ cos(2πi/(n−1)) + a₂ cos(4πi/(n−1)) − …
fn cosine_sum(n: usize, coefficients: &[f64]) -> Vec<f64> {
    let term = |i: usize, k: usize, a: f64| {
        let sign = if k.is_multiple_of(2) { 1.0 } else { -1.0 };
        sign * a * (TAU * (k * i) as f64 / (n - 1) as f64).cos()
    };
    (0..n).map(|i| coefficients.iter().enumerate().map(|(k, &a)| term(i, k, a)).sum()).collect()
}

/// The inverse DFT of T_{n−1}(x₀ cos(πk/n)) about the middle sample, T the Chebyshev polynomial.
fn chebyshev(n: usize, sidelobe_db: f64) -> Vec<f64> {
    let order = (n - 1) as f64;
    let ripple = 10f64.powf(sidelobe_db / 20.0);
    let x0 = (ripple.acosh() / order).cosh();
    let spectrum: Vec<f64> =
        (1..=(n - 1) / 2).map(|k| chebyshev_polynomial(n - 1, x0 * (PI * k as f64 / n as f64).cos())).collect();
    let weight = |i: usize| {
        let offset = i as f64 - order / 2.0;
        let harmonics = spectrum.iter().zip(1..);
        ripple + 2.0 * harmonics.map(|(s, k)| s * (TAU * f64::from(k) * offset / n as f64).cos()).sum::<f64>()
    };
    let weights: Vec<f64> = (0..n).map(weight).collect();
    let largest = weights.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    weights.iter().map(|w| w / largest).collect()
}

fn chebyshev_polynomial(order: usize, x: f64) -> f64 {
    let m = order as f64;
    if x.abs() <= 1.0 {
        (m * x.acos()).cos()
    } else {
        let sign = if x < 0.0 && order % 2 == 1 { -1.0 } else { 1.0 };
        sign * (m * x.abs().acosh()).cosh()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Window; 5] =
        [Window::Rectangular, Window::Hann, Window::Hamming, Window::Blackman, Window::Chebyshev { sidelobe_db: 30.0 }];

    #[test]
    fn names_are_read_back() {
        for window in ALL {
            assert_eq!(Window::named(&window.name()), Some(window), "{window:?}");
        }
        assert!(
            ["Hann", "", "chebyshev-", "chebyshev-nan", "chebyshev-1e9"]
                .iter()
                .all(|name| Window::named(name).is_none())
        );
    }

    #[test]
    fn weights_are_symmetric_and_at_most_one() {
        for window in ALL {
            for n in [2, 7, 24, 65] {
                let w = window.weights(n);
                assert_eq!(w.len(), n);
                for i in 0..n {
                    assert!((w[i] - w[n - 1 - i]).abs() < 1e-12, "{window:?} {n} {i}");
                    assert!(w[i] <= 1.0 + 1e-12 && w[i] > -1e-12);
                }
            }
        }
    }

    #[test]
    fn chebyshev_sidelobes_are_level_at_the_stated_depth() {
        for (n, db) in [(24, 30.0), (33, 50.0)] {
            let window = Window::Chebyshev { sidelobe_db: db };
            let null = n as f64 / PI
                * ((PI / (2.0 * (n - 1) as f64)).cos() / ((10f64.powf(db / 20.0)).acosh() / (n - 1) as f64).cosh())
                    .acos();
            let highest = (0..4000)
                .map(|i| null + i as f64 * (n as f64 / 2.0 - null) / 4000.0)
                .map(|bins| window.response(n, bins))
                .fold(0.0, f64::max);
            assert!((20.0 * highest.log10() + db).abs() < 0.01, "{n}: {}", 20.0 * highest.log10());
        }
    }
}
