//! Legal and illegal values of every setting, for tests.

use super::{FIELDS, Field, FieldKind, FitConfig, Value};
use proptest::prelude::*;

impl Field {
    /// Values that it may have: both ends of a range and what lies between, each answer, on and off, nothing.
    pub fn legal(&self) -> Vec<Value> {
        match &self.kind {
            FieldKind::Number(number) => {
                let (lo, hi) = number.range;
                let between = |share: f64| lo + share * (hi.min(lo + 1e3) - lo);
                let numbers = [lo, hi, between(0.25), between(0.5), between(0.8)];
                let numbers = numbers.map(|x| Value::Number(if number.whole { x.round() } else { x }));
                numbers.into_iter().chain(number.unset.map(|_| Value::Unset)).collect()
            }
            FieldKind::Switch => vec![Value::Switch(false), Value::Switch(true)],
            FieldKind::Choice(answers) => (0..answers.len()).map(Value::Answer).collect(),
        }
    }

    /// A legal value other than that of a configuration.
    pub fn another(&self, config: &FitConfig, choice: usize) -> Value {
        let mut values = self.legal();
        values.retain(|value| *value != self.get(config));
        values[choice % values.len()]
    }

    /// Numbers just outside of its range.
    pub fn illegal(&self) -> Vec<f64> {
        let FieldKind::Number(number) = &self.kind else { return Vec::new() };
        let (lo, hi) = number.range;
        let step = if number.whole { 1.0 } else { 0.01 };
        [lo - step, hi + step, f64::NAN, f64::INFINITY].into_iter().filter(|x| !(lo..=hi).contains(x)).collect()
    }
}

/// Any legal configuration.
pub fn configs() -> impl Strategy<Value = FitConfig> {
    prop::collection::vec(any::<prop::sample::Index>(), FIELDS.len()).prop_map(|picks| {
        let mut config = FitConfig::default();
        for (field, pick) in FIELDS.iter().zip(picks) {
            field.set(&mut config, *pick.get(&field.legal()));
        }
        config
    })
}

/// A legal configuration, another that differs from it in some settings, and these, in the order of the table.
pub fn changed() -> impl Strategy<Value = (FitConfig, FitConfig, Vec<&'static Field>)> {
    let picks = prop::collection::vec(prop::option::weighted(0.1, any::<usize>()), FIELDS.len());
    (configs(), picks).prop_map(|(old, picks)| {
        let (mut new, mut changed) = (old, Vec::new());
        for (field, pick) in FIELDS.iter().zip(picks) {
            if let Some(pick) = pick {
                field.set(&mut new, field.another(&old, pick));
                changed.push(field);
            }
        }
        (old, new, changed)
    })
}
