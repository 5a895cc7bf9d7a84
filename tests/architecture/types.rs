//! One name, one public type.

use crate::{code, sources};
use std::collections::BTreeMap;

/// Names that several public types may have, and why.
const SHARED: &[(&str, &str)] = &[];

/// The public types and traits that a file's code declares, but for those of its tests.
fn declared(code: &str) -> Vec<String> {
    let program = code.split("\nmod tests {").next().unwrap_or_default();
    let name_of = |line: &str| -> Option<String> {
        let mut words = line.trim_start().strip_prefix("pub ")?.split_whitespace();
        let kind = words.next()?;
        let declares = ["struct", "enum", "trait", "type", "union"].contains(&kind);
        let name = declares.then(|| words.next()).flatten()?;
        Some(name.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect())
    };
    program.lines().filter_map(name_of).collect()
}

#[test]
fn declarations_are_found() {
    let text = "pub struct A<T> {\n    pub b: u8,\n}\n  pub enum C {}\npub(crate) struct D;\npub trait E: Copy {}\npub fn type_of() {}\npub type F = u8;";
    assert_eq!(declared(text), ["A", "C", "E", "F"]);
}

#[test]
fn no_two_public_types_have_one_name() {
    let mut places: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for (_, path) in sources() {
        for name in declared(&code(&path)) {
            places.entry(name).or_default().push(path.display().to_string());
        }
    }
    assert!(places.len() > 300, "{} types are found", places.len());
    let twice: Vec<_> = places
        .iter()
        .filter(|(name, places)| places.len() > 1 && !SHARED.iter().any(|(shared, _)| shared == *name))
        .collect();
    assert!(twice.is_empty(), "{twice:#?}");
    for (name, reason) in SHARED {
        assert!(places.get(*name).is_some_and(|places| places.len() > 1), "{name} is one type now ({reason})");
    }
}
