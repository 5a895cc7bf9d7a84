//! One setting of [`FitConfig`]: what it is called, what it means, what it may be, who reads it.
//!
//! Sliders, switches and tooltips, the words for a change, studies and sweeps, `FIT.toml`'s errors and the list under `--help`
//! know settings from [`super::FIELDS`] alone.

use super::{ConfigError, FitConfig};

/// Which part of the settings a field belongs to, in the order of the *Fit* pane.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FieldGroup {
    /// What is weighed against what.
    Weights,
    /// The optimiser.
    Optimiser,
    /// The radar's simulation.
    Radar,
    /// Kinematic limits.
    Limits,
    /// What is moved, what a start looks like, and what the paper's objective lacks.
    Model,
    /// Step sizes of single groups of parameters.
    StepSizes,
    /// How a start is found.
    Start,
    /// How a start is perturbed on purpose.
    Perturbation,
}

impl FieldGroup {
    /// Every group, in the order they are shown.
    pub const ALL: [Self; 8] = [
        Self::Weights,
        Self::Optimiser,
        Self::Radar,
        Self::Limits,
        Self::Model,
        Self::StepSizes,
        Self::Start,
        Self::Perturbation,
    ];

    /// The fields of this group, in the order they are shown.
    pub fn fields(self) -> impl Iterator<Item = &'static Field> {
        super::FIELDS.iter().filter(move |field| field.group == self)
    }

    /// The head above them.
    pub fn title(self) -> &'static str {
        match self {
            Self::Weights => "Weights",
            Self::Optimiser => "Optimiser",
            Self::Radar => "Radar simulation",
            Self::Limits => "Kinematic limits",
            Self::Model => "Model",
            Self::StepSizes => "Step sizes",
            Self::Start => "Start",
            Self::Perturbation => "Perturb the start",
        }
    }

    /// What all of them have in common, where the title does not say it.
    pub fn help(self) -> &'static str {
        match self {
            Self::Weights | Self::Optimiser | Self::Radar | Self::Limits | Self::Model => "",
            Self::StepSizes => "Of single groups of parameters, where they are not that of all.",
            Self::Start => "Takes effect when a start is found: Ctrl+R.",
            Self::Perturbation => "The perturbations of the paper's robustness table.",
        }
    }
}

/// Who reads a setting, and so what a change of it asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReadBy {
    /// Who runs the fit: when it ends, not what a step does.
    Run,
    /// The steps alone.
    Steps,
    /// The steps, and a start that asks L_EM which posture or place is best; a change asks for no new start.
    StepsAndStart,
    /// Who finds a start, and nobody later: before the first step a change asks for a new start.
    Start,
    /// Who starts from the result of the frame before.
    WarmStart,
}

impl ReadBy {
    /// Whether a change shows in the next start only.
    pub fn at_start_only(self) -> bool {
        matches!(self, Self::Start | Self::WarmStart)
    }

    /// Whether a start from a frame's own peaks may depend on it.
    pub fn by_cold_start(self) -> bool {
        matches!(self, Self::StepsAndStart | Self::Start)
    }
}

/// What a setting is set to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Value {
    /// A number, in the field's unit.
    Number(f64),
    /// No number, where a field may do without ([`Number::unset`]).
    Unset,
    /// On or off.
    Switch(bool),
    /// An answer, by its place in the list.
    Answer(usize),
}

/// One answer to a choice.
#[derive(Debug, Clone, Copy)]
pub struct Answer {
    /// As in `FIT.toml`.
    pub word: &'static str,
    /// On screen.
    pub label: &'static str,
    /// What it means, and why one would take it.
    pub help: &'static str,
}

/// What a field may be instead of a number.
#[derive(Debug, Clone, Copy)]
pub struct Unset {
    /// What that is called and means.
    pub answer: Answer,
    /// The label of the number beside it.
    pub number: &'static str,
    /// The number that is taken first where there was none.
    pub first: f64,
    /// What `FIT.toml` holds, in words, where that is no plain number.
    pub form: Option<&'static str>,
}

/// How a number is edited and checked.
#[derive(Debug, Clone, Copy)]
pub struct Number {
    /// Unit, or "".
    pub unit: &'static str,
    /// Inclusive range that is accepted.
    pub range: (f64, f64),
    /// The part of the range that is offered on screen.
    pub offered: (f64, f64),
    /// Whether the slider is logarithmic.
    pub logarithmic: bool,
    /// Whether it counts something.
    pub whole: bool,
    /// What 0 means, where that is no number.
    pub zero: Option<&'static str>,
    /// What it may be instead.
    pub unset: Option<Unset>,
}

/// What a setting may be.
#[derive(Debug, Clone, Copy)]
pub enum FieldKind {
    /// A number in a range.
    Number(Number),
    /// On or off.
    Switch,
    /// One of a few answers, the default first.
    Choice(&'static [Answer]),
}

/// Reads a setting, and writes it; a value of another kind changes nothing.
pub(super) type Access = (fn(&FitConfig) -> Value, fn(&mut FitConfig, Value));

/// A setting of [`FitConfig`].
#[derive(Debug, Clone, Copy)]
pub struct Field {
    /// The key in `FIT.toml`; `table.key` inside a table.
    pub key: &'static str,
    /// Where it is shown.
    pub group: FieldGroup,
    /// The label on screen, in the paper's notation.
    pub label: &'static str,
    /// What it is called where a change of it is told.
    pub name: &'static str,
    /// Meaning and formula.
    pub help: &'static str,
    /// Who reads it.
    pub read_by: ReadBy,
    /// The row of the study `switches` that takes it from another preset; `None` for what belongs to a study and not to a
    /// preset.
    pub row: Option<&'static str>,
    /// What it may be.
    pub kind: FieldKind,
    pub(super) access: Access,
}

impl Field {
    /// The field with this key.
    pub fn of_key(key: &str) -> Option<&'static Self> {
        super::FIELDS.iter().find(|field| field.key == key)
    }

    /// What a configuration sets it to.
    pub fn get(&self, config: &FitConfig) -> Value {
        (self.access.0)(config)
    }

    /// Sets it; a value of another kind changes nothing.
    pub fn set(&self, config: &mut FitConfig, value: Value) {
        (self.access.1)(config, value);
    }

    /// What it is by default.
    pub fn default(&self) -> Value {
        self.get(&FitConfig::default())
    }

    /// Takes it from another configuration.
    pub fn take(&self, to: &mut FitConfig, from: &FitConfig) {
        self.set(to, self.get(from));
    }

    /// The answer that a choice is given.
    pub fn answer(&self, value: Value) -> Option<&'static Answer> {
        match (&self.kind, value) {
            (FieldKind::Choice(answers), Value::Answer(k)) => answers.get(k),
            _ => None,
        }
    }

    /// Whether a value is one that it may have.
    ///
    /// # Errors
    /// Names the key, the value and what is expected.
    pub fn check(&self, value: Value) -> Result<(), ConfigError> {
        let sound = match (&self.kind, value) {
            (FieldKind::Number(number), Value::Number(x)) => {
                (number.range.0..=number.range.1).contains(&x) && (!number.whole || x.fract() == 0.0)
            }
            (FieldKind::Number(number), Value::Unset) => number.unset.is_some(),
            (FieldKind::Switch, Value::Switch(_)) => true,
            (FieldKind::Choice(answers), Value::Answer(k)) => k < answers.len(),
            _ => false,
        };
        if sound { Ok(()) } else { Err(self.refusal(self.text(value))) }
    }

    /// The value that a text means, as in `FIT.toml` but without quotation marks; no number is its word.
    ///
    /// # Errors
    /// As [`Self::check`].
    pub fn parse(&self, text: &str) -> Result<Value, ConfigError> {
        let value = match &self.kind {
            FieldKind::Number(Number { unset: Some(unset), .. }) if text == unset.answer.word => Some(Value::Unset),
            FieldKind::Number(_) => text.parse().ok().map(Value::Number),
            FieldKind::Switch => text.parse().ok().map(Value::Switch),
            FieldKind::Choice(answers) => answers.iter().position(|answer| answer.word == text).map(Value::Answer),
        };
        let value = value.ok_or_else(|| self.refusal(text.to_owned()))?;
        self.check(value).map(|()| value)
    }

    /// A value as [`Self::parse`] reads it.
    pub fn text(&self, value: Value) -> String {
        match (value, &self.kind) {
            (Value::Number(x), _) => plainly(x),
            (Value::Switch(on), _) => on.to_string(),
            (Value::Unset, FieldKind::Number(Number { unset: Some(unset), .. })) => unset.answer.word.to_owned(),
            (Value::Answer(k), FieldKind::Choice(answers)) if k < answers.len() => answers[k].word.to_owned(),
            (Value::Answer(k), _) => format!("answer {k}"),
            (Value::Unset, _) => "nothing".to_owned(),
        }
    }

    /// A value on screen: numbers with at most four significant digits.
    pub fn told(&self, value: Value) -> String {
        match (value, &self.kind) {
            (Value::Number(0.0), FieldKind::Number(Number { zero: Some(word), .. })) => (*word).to_owned(),
            (Value::Number(x), _) => short(x),
            (Value::Switch(on), _) => if on { "on" } else { "off" }.to_owned(),
            (Value::Unset, FieldKind::Number(Number { unset: Some(unset), .. })) => unset.answer.label.to_owned(),
            _ => self.answer(value).map_or_else(|| self.text(value), |answer| answer.label.to_owned()),
        }
    }

    /// What `FIT.toml` may hold under the key.
    pub fn expected(&self) -> String {
        match &self.kind {
            FieldKind::Number(Number { unset: Some(Unset { form: Some(form), .. }), .. }) => (*form).to_owned(),
            FieldKind::Number(number) => {
                let (lo, hi) = (plainly(number.range.0), plainly(number.range.1));
                format!("a {}number in {lo} ..= {hi}", if number.whole { "whole " } else { "" })
            }
            FieldKind::Switch => "true or false".into(),
            FieldKind::Choice(answers) => {
                let words: Vec<String> = answers.iter().map(|answer| format!("{:?}", answer.word)).collect();
                words.join(" or ")
            }
        }
    }

    /// How a value differs from another one, in words: `τ_pct 10 → 15`, `Doppler off`; `None` where it does not.
    pub fn change(&self, old: Value, new: Value) -> Option<String> {
        if old == new {
            return None;
        }
        if let Value::Switch(_) = new {
            return Some(format!("{} {}", self.name, self.told(new)));
        }
        let told = [old, new].map(|value| self.told(value));
        // Where four digits do not tell them apart, all do.
        let [was, is] = if told[0] == told[1] { [old, new].map(|value| self.text(value)) } else { told };
        let name = if let FieldKind::Choice(_) = self.kind { &self.name.to_lowercase() } else { self.name };
        Some(format!("{name} {was} → {is}"))
    }

    /// For tooltips: its meaning, default, unit, key, and when a change takes effect.
    pub fn tip(&self) -> String {
        let default = self.default();
        let (told, unit) = match (&self.kind, default) {
            (FieldKind::Number(number), Value::Number(x)) => (x.to_string(), number.unit),
            _ => (self.told(default), ""),
        };
        let space = if unit.is_empty() { "" } else { " " };
        let help = if self.help.is_empty() { String::new() } else { format!("{}\n", self.help) };
        format!("{help}Default {told}{space}{unit}. FIT.toml: {}{}", self.key, self.when())
    }

    /// The same for one of a few answers.
    pub fn answer_tip(&self, answer: &Answer) -> String {
        format!("{}{}\nFIT.toml: {} = \"{}\"", answer.help, self.when(), self.key, answer.word)
    }

    fn when(&self) -> &'static str {
        if self.read_by.at_start_only() { " Takes effect when a start is found." } else { "" }
    }

    fn refusal(&self, found: String) -> ConfigError {
        ConfigError::Value { key: self.key, found, expected: self.expected() }
    }
}

/// A number as somebody would write it: not with three hundred zeros.
fn plainly(value: f64) -> String {
    let size = value.abs();
    if size != 0.0 && !(1e-6..1e15).contains(&size) { format!("{value:e}") } else { value.to_string() }
}

/// A number with at most four significant digits.
fn short(x: f64) -> String {
    if x == 0.0 || !(1e-6..1e15).contains(&x.abs()) {
        return plainly(x);
    }
    let digits = (3 - x.abs().log10().floor() as i32).clamp(0, 9) as usize;
    let text = format!("{x:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}
