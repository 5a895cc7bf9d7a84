#![doc = include_str!("deviations.md")]
