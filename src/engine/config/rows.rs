//! How a row of [`super::FIELDS`] is written.

use super::field::{Access, Answer, Field, FieldGroup, FieldKind, Number, ReadBy, Unset};

/// A number in a range.
pub(super) const fn number(
    group: FieldGroup,
    key: &'static str,
    label: &'static str,
    read_by: ReadBy,
    range: (f64, f64),
    access: Access,
) -> Field {
    let number = Number { unit: "", range, offered: range, logarithmic: false, whole: false, zero: None, unset: None };
    row(group, key, label, read_by, FieldKind::Number(number), access)
}

/// On or off.
pub(super) const fn switch(
    group: FieldGroup,
    key: &'static str,
    label: &'static str,
    read_by: ReadBy,
    access: Access,
) -> Field {
    row(group, key, label, read_by, FieldKind::Switch, access)
}

/// One of a few answers.
pub(super) const fn choice(
    group: FieldGroup,
    key: &'static str,
    label: &'static str,
    read_by: ReadBy,
    answers: &'static [Answer],
    access: Access,
) -> Field {
    row(group, key, label, read_by, FieldKind::Choice(answers), access)
}

const fn row(
    group: FieldGroup,
    key: &'static str,
    label: &'static str,
    read_by: ReadBy,
    kind: FieldKind,
    access: Access,
) -> Field {
    Field { key, group, label, name: label, help: "", read_by, row: None, kind, access }
}

/// How rows are written.
impl Field {
    const fn with(self, number: Number) -> Self {
        Self { kind: FieldKind::Number(number), ..self }
    }

    #[expect(clippy::panic, reason = "only a table that is wrong gets there, and it does not compile")]
    const fn as_number(&self) -> Number {
        match self.kind {
            FieldKind::Number(number) => number,
            FieldKind::Switch | FieldKind::Choice(_) => panic!("only a number has a unit and a range"),
        }
    }

    pub(super) const fn unit(self, unit: &'static str) -> Self {
        let number = Number { unit, ..self.as_number() };
        self.with(number)
    }

    pub(super) const fn logarithmic(self) -> Self {
        let number = Number { logarithmic: true, ..self.as_number() };
        self.with(number)
    }

    pub(super) const fn whole(self) -> Self {
        let number = Number { whole: true, ..self.as_number() };
        self.with(number)
    }

    /// What 0 means, in a word.
    pub(super) const fn zero(self, zero: &'static str) -> Self {
        let number = Number { zero: Some(zero), ..self.as_number() };
        self.with(number)
    }

    /// The part of the range that is offered on screen.
    pub(super) const fn offered(self, lo: f64, hi: f64) -> Self {
        let number = Number { offered: (lo, hi), ..self.as_number() };
        self.with(number)
    }

    /// What it may be instead of a number.
    pub(super) const fn or(self, unset: Unset) -> Self {
        let number = Number { unset: Some(unset), ..self.as_number() };
        self.with(number)
    }

    /// What it is called where a change of it is told, if not by its label.
    pub(super) const fn called(self, name: &'static str) -> Self {
        Self { name, ..self }
    }

    /// Its row in the study `switches`; settings of one row are taken together.
    pub(super) const fn row(self, row: &'static str) -> Self {
        Self { row: Some(row), ..self }
    }
}

/// Access to a number.
macro_rules! number_at {
    ($($field:ident).+) => {
        (
            |c: &FitConfig| Value::Number(c.$($field).+),
            |c: &mut FitConfig, value: Value| {
                if let Value::Number(x) = value {
                    c.$($field).+ = x;
                }
            },
        )
    };
}

/// Access to a count.
macro_rules! count_at {
    ($($field:ident).+) => {
        (
            |c: &FitConfig| Value::Number(c.$($field).+ as f64),
            |c: &mut FitConfig, value: Value| {
                if let Value::Number(x) = value {
                    c.$($field).+ = x.round().max(0.0) as _;
                }
            },
        )
    };
}

/// Access to a number that may be missing.
macro_rules! maybe_at {
    ($($field:ident).+) => {
        (
            |c: &FitConfig| c.$($field).+.map_or(Value::Unset, Value::Number),
            |c: &mut FitConfig, value: Value| match value {
                Value::Number(x) => c.$($field).+ = Some(x),
                Value::Unset => c.$($field).+ = None,
                Value::Switch(_) | Value::Answer(_) => {}
            },
        )
    };
}

/// Access to a flag.
macro_rules! flag_at {
    ($($field:ident).+) => {
        (
            |c: &FitConfig| Value::Switch(c.$($field).+),
            |c: &mut FitConfig, value: Value| {
                if let Value::Switch(on) = value {
                    c.$($field).+ = on;
                }
            },
        )
    };
}

/// Access to one of several values, in the order of the answers.
macro_rules! one_of_at {
    ($($field:ident).+, [$($value:expr),+ $(,)?]) => {
        (
            |c: &FitConfig| {
                Value::Answer([$($value),+].iter().position(|value| *value == c.$($field).+).unwrap_or(usize::MAX))
            },
            |c: &mut FitConfig, value: Value| {
                if let Value::Answer(k) = value
                    && let Some(value) = [$($value),+].get(k)
                {
                    c.$($field).+ = *value;
                }
            },
        )
    };
}

pub(super) use {count_at, flag_at, maybe_at, number_at, one_of_at};
