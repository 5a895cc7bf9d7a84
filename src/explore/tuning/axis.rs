//! An axis of a tuning map: a setting, and which of its values.

use crate::config::{Field, FieldKind, FitConfig, Value};
use crate::study::run::GridAxis;
use serde::{Deserialize, Serialize};
use std::str::FromStr;

/// Values that a number's axis begins with, and the most that it may have.
const STEPS: usize = 24;
const MOST: usize = 200;
/// How far from where it is set an axis reaches at first, as a factor.
const REACH: f64 = 6.0;

/// A setting and the values that a map shows of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TuningAxis {
    /// A key of `FIT.toml`.
    pub key: String,
    /// Where its values come from.
    pub values: AxisValues,
}

/// Where the values of an axis come from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AxisValues {
    /// Numbers from one to another, in equal steps or equal factors.
    Range {
        /// The first.
        from: f64,
        /// The last.
        to: f64,
        /// How many.
        steps: usize,
        /// Equal factors instead of equal steps.
        logarithmic: bool,
    },
    /// These, as in `FIT.toml`.
    Listed(Vec<String>),
}

impl TuningAxis {
    /// Values around what a setting is set to, within what the screen offers of it; every answer of a choice.
    pub fn around(field: &Field, config: &FitConfig) -> Self {
        let key = field.key.to_owned();
        let number = match &field.kind {
            FieldKind::Switch => return Self { key, values: AxisValues::Listed(vec!["false".into(), "true".into()]) },
            FieldKind::Choice(answers) => {
                let words = answers.iter().map(|answer| answer.word.to_owned());
                return Self { key, values: AxisValues::Listed(words.collect()) };
            }
            FieldKind::Number(number) => number,
        };
        let set = match field.get(config) {
            Value::Number(x) if x > 0.0 => Some(x),
            _ => number.unset.map(|unset| unset.first).filter(|x| *x > 0.0),
        };
        let (lo, hi) = number.offered;
        let (from, to) = match set {
            Some(x) if number.logarithmic => ((x / REACH).max(number.range.0), (x * REACH).min(number.range.1)),
            _ => (lo, hi),
        };
        // Equal factors need an end above 0.
        let logarithmic = number.logarithmic && from > 0.0;
        Self {
            key,
            values: AxisValues::Range { from: three_digits(from), to: three_digits(to), steps: STEPS, logarithmic },
        }
    }

    /// The setting.
    ///
    /// # Errors
    /// Where there is none of this key.
    pub fn field(&self) -> Result<&'static Field, String> {
        Field::of_key(&self.key).ok_or_else(|| format!("unknown key `{}`", self.key))
    }

    /// Its values as a sweep takes them: each once, in their order.
    ///
    /// # Errors
    /// Where the key is unknown, a value is none of it, or there are none or too many.
    pub fn grid(&self) -> Result<GridAxis, String> {
        let field = self.field()?;
        let mut values: Vec<String> = Vec::new();
        let mut add = |text: String| {
            if !values.contains(&text) {
                values.push(text);
            }
        };
        match &self.values {
            AxisValues::Listed(words) => words.iter().for_each(|word| add(word.clone())),
            &AxisValues::Range { from, to, steps, logarithmic } => {
                let FieldKind::Number(number) = &field.kind else {
                    return Err(format!("{} is no number; expected its answers with commas between", field.key));
                };
                if steps == 0 || steps > MOST {
                    return Err(format!("{}: {steps} values; expected 1 to {MOST}", field.key));
                }
                if logarithmic && (from <= 0.0 || to <= 0.0) {
                    return Err(format!("{}: equal factors need ends above 0", field.key));
                }
                for k in 0..steps {
                    let t = if steps > 1 { k as f64 / (steps - 1) as f64 } else { 0.0 };
                    let x = if logarithmic { from * (to / from).powf(t) } else { from + (to - from) * t };
                    let x = if number.whole { x.round() } else { three_digits(x) };
                    add(field.text(Value::Number(x)));
                }
            }
        }
        for text in &values {
            field.parse(text).map_err(|error| error.to_string())?;
        }
        if values.is_empty() {
            return Err(format!("{}: no value", field.key));
        }
        Ok(GridAxis { key: self.key.clone(), values })
    }
}

/// `KEY=V,V,…` or `KEY=FROM..TO:STEPS`, with `log` at the end for equal factors.
impl FromStr for TuningAxis {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (key, values) =
            text.split_once('=').ok_or("expected KEY=FROM..TO:STEPS or KEY=V,V,…, for example tau_pct=2..40:24log")?;
        let key = key.trim().to_owned();
        let Some((from, rest)) = values.split_once("..") else {
            let axis: GridAxis = text.parse()?;
            return Ok(Self { key, values: AxisValues::Listed(axis.values) });
        };
        let (to, steps) = rest.split_once(':').unwrap_or((rest, "24"));
        let (steps, logarithmic) = steps.strip_suffix("log").map_or((steps, false), |steps| (steps, true));
        let number = |text: &str| text.trim().parse::<f64>().map_err(|_| format!("`{text}` is no number"));
        let steps = if steps.is_empty() { "24" } else { steps };
        let steps = steps.trim().parse().map_err(|_| format!("`{steps}` is no number of values"))?;
        let axis = Self { key, values: AxisValues::Range { from: number(from)?, to: number(to)?, steps, logarithmic } };
        axis.grid().map(|_| axis)
    }
}

/// The nearest number of three digits that count.
fn three_digits(x: f64) -> f64 {
    if x == 0.0 || !x.is_finite() {
        return x;
    }
    let place = 2 - x.abs().log10().floor() as i32;
    // Divided by a power of ten rather than multiplied: the nearest double is then the one that is written.
    if place >= 0 {
        (x * 10f64.powi(place)).round() / 10f64.powi(place)
    } else {
        (x / 10f64.powi(-place)).round() * 10f64.powi(-place)
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests fail by panicking")]
    use super::*;
    use crate::config::{FIELDS, Preset};

    #[test]
    fn every_setting_has_an_axis_that_can_be_swept() {
        for preset in Preset::ALL {
            let config = preset.config();
            for field in FIELDS {
                let axis = TuningAxis::around(field, &config);
                let grid = axis.grid().unwrap();
                assert!(grid.values.len() > 1 && grid.values.len() <= STEPS, "{}: {:?}", field.key, grid.values);
                crate::study::run::sweep(&config, &[grid]).unwrap();
            }
        }
    }

    #[test]
    fn an_axis_is_typed_as_a_range_or_a_list() {
        let values = |text: &str| text.parse::<TuningAxis>().and_then(|axis| axis.grid()).map(|grid| grid.values);
        assert_eq!(values("tau_pct=5..20:4").unwrap(), ["5", "10", "15", "20"]);
        assert_eq!(values("tau_pct=2.5..40:5log").unwrap(), ["2.5", "5", "10", "20", "40"]);
        assert_eq!(values("iterations=1..5:9").unwrap(), ["1", "2", "3", "4", "5"], "whole numbers, each once");
        assert_eq!(values("summation=coherent,incoherent").unwrap(), ["coherent", "incoherent"]);
        assert_eq!(values("w_em=0.1,1").unwrap(), ["0.1", "1"]);
        for (text, told) in [
            ("tau_pct", "expected KEY=FROM..TO:STEPS"),
            ("tau=1..2:3", "unknown key `tau`"),
            ("tau_pct=0..20:4log", "ends above 0"),
            ("tau_pct=1..x:4", "`x` is no number"),
            ("tau_pct=1..200:4", "tau_pct is 134"),
            ("summation=1..2:3", "is no number"),
            ("w_em=1..2:1000", "expected 1 to 200"),
        ] {
            let error = values(text).unwrap_err();
            assert!(error.contains(told), "{text}: {error}");
        }
    }
}
