//! A value a term.

use super::{TERMS, TermId};
use serde::de::{IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::marker::PhantomData;
use std::ops::Index;

/// A value for each line of [`TERMS`]: unweighted terms of the loss, or with `Option<f64>` those that are known.
///
/// In files it is a table with the terms' keys. What is missing there is the default: a term that did not exist when the
/// file was written was no part of the loss.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Terms<T = f64>([T; TERMS.len()]);

impl<T: Copy> Terms<T> {
    /// What `value` says of each term.
    pub fn from_fn(mut value: impl FnMut(TermId) -> T) -> Self {
        Self(std::array::from_fn(|place| value(TermId(place))))
    }

    /// Each term with its value, in the order of the table.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = (TermId, T)> {
        TermId::all().zip(self.0)
    }

    /// The value of the term whose key this is.
    pub fn get(&self, key: &str) -> Option<T> {
        TermId::of(key).map(|term| self[term])
    }

    /// Each value through `change`.
    pub fn map<U: Copy>(&self, change: impl FnMut(T) -> U) -> Terms<U> {
        Terms(self.0.map(change))
    }

    pub(in crate::mhp) fn put(&mut self, key: &str, value: T) {
        if let Some(term) = TermId::of(key) {
            self.0[term.0] = value;
        }
    }

    pub(super) fn set(&mut self, place: usize, value: T) {
        self.0[place] = value;
    }
}

impl<T: Copy + Default> Default for Terms<T> {
    fn default() -> Self {
        Self([T::default(); TERMS.len()])
    }
}

impl<T> Index<TermId> for Terms<T> {
    type Output = T;

    fn index(&self, term: TermId) -> &T {
        &self.0[term.0]
    }
}

impl<T: Serialize> Serialize for Terms<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(TERMS.iter().map(|term| term.key).zip(&self.0))
    }
}

impl<'de, T: Deserialize<'de> + Copy + Default> Deserialize<'de> for Terms<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(Reader(PhantomData))
    }
}

struct Reader<T>(PhantomData<T>);

impl<'de, T: Deserialize<'de> + Copy + Default> Visitor<'de> for Reader<T> {
    type Value = Terms<T>;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let keys: Vec<&str> = TERMS.iter().map(|term| term.key).collect();
        write!(f, "the terms of a loss by their keys: {}", keys.join(", "))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
        let mut values = Terms::default();
        while let Some(key) = map.next_key::<String>()? {
            match TermId::of(&key) {
                Some(term) => values.set(term.0, map.next_value()?),
                None => {
                    map.next_value::<IgnoredAny>()?;
                }
            }
        }
        Ok(values)
    }

    /// By their places: `em bone rigid joint sep coll`, as the journals of studies once had them.
    fn visit_seq<A: SeqAccess<'de>>(self, mut values: A) -> Result<Self::Value, A::Error> {
        let mut terms = Terms::default();
        for key in ["em", "bone", "rigid", "joint", "sep", "coll"] {
            let Some(value) = values.next_element()? else { break };
            if let Some(term) = TermId::of(key) {
                terms.set(term.0, value);
            }
        }
        Ok(terms)
    }
}
