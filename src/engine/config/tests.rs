#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use super::samples::{changed, configs};
use super::*;
use proptest::prelude::*;
use std::collections::BTreeSet;

const FILE: &str = "fit.toml";

fn read(text: &str) -> Result<FitConfig, String> {
    FitConfig::parse(text, Path::new(FILE)).map_err(|error| error.to_string())
}

fn refusal(text: &str) -> String {
    read(text).err().unwrap_or_else(|| "accepted".into())
}

/// `key = value` as a file has it, with the table of the key.
fn line(key: &str, value: &str) -> String {
    match key.split_once('.') {
        Some((table, key)) => format!("[{table}]\n{key} = {value}\n"),
        None => format!("{key} = {value}\n"),
    }
}

#[test]
fn what_is_written_reads_back() {
    let full = FitConfig {
        em_region: EmRegion::Full,
        summation: Summation::Incoherent,
        learning_rate: 3e-3,
        operators: Operators { range: false, ..Operators::default() },
        stop_when_converged: true,
        ..FitConfig::default()
    };
    for config in [FitConfig::default(), full] {
        assert_eq!(read(&config.to_toml()), Ok(config), "{}", config.to_toml());
    }
}

#[test]
fn a_wrong_key_or_value_names_file_line_key_and_expectation() {
    let text = refusal("w_em = 1\nw_kin = 2\n");
    assert!(text.starts_with("fit.toml:2: unknown key `w_kin`; expected one of `w_em`, `w_kine`"), "{text}");
    assert_eq!(refusal("\ntau_pct = 101\n"), "fit.toml:2: tau_pct is 101; expected a number in 0.1 ..= 100");
    assert_eq!(refusal("iterations = -1"), "fit.toml:1: iterations is -1; expected a whole number in 1 ..= 100000");
    assert_eq!(refusal("w_em = \"x\""), "fit.toml:1: w_em is \"x\"; expected a number in 0 ..= 1000");
    assert_eq!(
        refusal("\nsummation = \"loud\""),
        "fit.toml:2: summation is \"loud\"; expected \"coherent\" or \"incoherent\""
    );
    assert_eq!(
        refusal("em_region = \"half\""),
        "fit.toml:1: em_region is \"half\"; expected \"full\" or { half_width_m = METRES } with METRES > 0"
    );
    assert_eq!(refusal("[operators]\nrange = 1"), "fit.toml:2: operators.range is 1; expected true or false");
    let text = refusal("operators = 3");
    assert_eq!(text, "fit.toml:1: operators is 3; expected a table of attenuation, range, doppler, angle");
    let text = refusal("[operators]\nrang = true");
    assert!(text.starts_with("fit.toml:2: unknown key `rang`; expected one of `attenuation`"), "{text}");
    let text = refusal("w_em = 1\n[init]\nseed = 0\n[learning_rates]\nbone = 2\n");
    assert_eq!(text, "fit.toml:5: learning_rates.bone is 2; expected a number in 0 ..= 1");
    assert!(refusal("w_em = ").starts_with("fit.toml:1: "));
    assert!(refusal("softness = nan").starts_with("fit.toml:1: softness is NaN; expected"));
}

/// Every key that a file may hold, as the reader itself tells them.
fn keys_of_the_struct() -> BTreeSet<String> {
    let expected = |text: &str| -> Vec<String> {
        let told = toml::from_str::<FitConfig>(text).unwrap_err().to_string();
        let list = told.split("expected").nth(1).unwrap();
        list.split('`').skip(1).step_by(2).map(str::to_owned).collect()
    };
    let tables = ["operators", "learning_rates", "init"];
    let mut keys: BTreeSet<String> = expected("zzz = 1").into_iter().collect();
    for table in tables {
        assert!(keys.remove(table), "{table}");
        keys.extend(expected(&format!("[{table}]\nzzz = 1")).into_iter().map(|key| format!("{table}.{key}")));
    }
    keys
}

#[test]
fn the_table_is_the_configuration_key_by_key() {
    let keys: Vec<String> = FIELDS.iter().map(|field| field.key.to_owned()).collect();
    let table: BTreeSet<String> = keys.iter().cloned().collect();
    assert_eq!((table.len(), &table), (keys.len(), &keys_of_the_struct()));
    // And what is written by default is in it, with the value that the row tells.
    let written: toml::Table = toml::from_str(&FitConfig::default().to_toml()).unwrap();
    for (key, value) in &written {
        let inner = value.as_table().filter(|_| key != "em_region");
        let leaves: Vec<String> =
            inner.map_or_else(|| vec![key.clone()], |t| t.keys().map(|k| format!("{key}.{k}")).collect());
        assert!(leaves.iter().all(|key| table.contains(key)), "{leaves:?}");
    }
}

#[test]
fn every_row_is_whole() {
    let (mut labels, mut names) = (BTreeSet::new(), BTreeSet::new());
    for field in FIELDS {
        let default = field.default();
        assert!(!field.help.is_empty() && !field.label.is_empty() && field.check(default).is_ok(), "{}", field.key);
        assert!(labels.insert(field.label) && names.insert(field.name), "{}: named as another", field.key);
        assert!(field.tip().contains(field.key) && field.tip().contains(field.help));
        match &field.kind {
            FieldKind::Choice(answers) => {
                assert_eq!(default, Value::Answer(0), "{}: the default comes first", field.key);
                for answer in *answers {
                    assert!(field.answer_tip(answer).contains(answer.word) && !answer.help.is_empty());
                    let config = read(&line(field.key, &format!("\"{}\"", answer.word))).unwrap();
                    assert_eq!(field.answer(field.get(&config)).unwrap().word, answer.word);
                }
                let mut same = FitConfig::default();
                field.set(&mut same, Value::Answer(answers.len()));
                assert_eq!(same, FitConfig::default(), "{}: no such answer", field.key);
                assert!(field.check(Value::Answer(answers.len())).is_err());
            }
            FieldKind::Number(number) => {
                let ((lo, hi), (from, to)) = (number.range, number.offered);
                assert!(lo <= from && from < to && to <= hi, "{}", field.key);
                assert!(number.unset.is_none_or(|unset| field.check(Value::Number(unset.first)).is_ok()));
            }
            FieldKind::Switch => assert!(matches!(default, Value::Switch(_))),
        }
        for value in field.legal() {
            assert!(field.check(value).is_ok(), "{}: {value:?}", field.key);
            assert_eq!(field.parse(&field.text(value)).ok(), Some(value), "{}: {value:?}", field.key);
        }
        assert!(field.parse("no such word").is_err());
    }
    assert_eq!(FieldGroup::ALL.into_iter().flat_map(FieldGroup::fields).count(), FIELDS.len(), "each is shown once");
}

#[test]
fn out_of_range_is_refused_by_key_and_range() {
    for field in FIELDS {
        for x in field.illegal() {
            let mut config = FitConfig::default();
            field.set(&mut config, Value::Number(x));
            // A count of less than nothing is none, and no longer wrong.
            if field.check(field.get(&config)).is_ok() {
                continue;
            }
            let told = config.validated().unwrap_err().to_string();
            assert!(told.starts_with(&format!("{} is ", field.key)) && told.contains(&field.expected()), "{told}");
            let told = field.parse(&x.to_string()).unwrap_err().to_string();
            assert!(told.starts_with(&format!("{} is ", field.key)) && told.contains(&field.expected()), "{told}");
        }
    }
    let (least, most) = (refusal("starts = 0"), refusal("starts = 26"));
    assert_eq!([least, most].map(|told| told.ends_with("expected a whole number in 1 ..= 25")), [true; 2]);
}

/// What only tests know is in everything that is made from the table, for nobody had to list it.
#[test]
fn a_new_setting_shows_up_by_its_row() {
    let (plain, other) = (FitConfig::default(), FitConfig { w_dummy: 2.0, ..FitConfig::default() });
    assert!(FieldGroup::Weights.fields().any(|field| field.label == "w_dummy"));
    assert_eq!(plain.changes(&other).map(|field| field.key).collect::<Vec<_>>(), ["w_dummy"]);
    assert_eq!(difference(&plain, &other), "w_dummy 0 → 2");
    assert_eq!(from_preset(&other), "baseline, w_dummy 0 → 2");
    assert_eq!(read(&other.to_toml()), Ok(other));
    assert_eq!(refusal("w_dummy = -1"), "fit.toml:1: w_dummy is -1; expected a number in 0 ..= 1000");
    assert!(listing().contains("w_dummy = 0: a number in 0 ..= 1000. Weight of a term that only tests know."));
}

#[test]
fn changes_are_told_in_the_words_of_the_pane() {
    let plain = FitConfig::default();
    let best = Preset::Recommended.config();
    assert_eq!(from_preset(&best), "recommended");
    let near = FitConfig { tau_pct: 15.0, ..best };
    assert_eq!(from_preset(&near), "recommended, τ_pct 10 → 15");
    let operators = Operators { doppler: false, ..Operators::default() };
    let init = InitConfig { position: false, ..InitConfig::default() };
    let rates = LearningRates { bone: Some(0.0), ..LearningRates::default() };
    let other = FitConfig {
        operators,
        init,
        em_region: EmRegion::Full,
        learning_rates: rates,
        summation: Summation::Incoherent,
        stop_when_converged: true,
        ..plain
    };
    let told = "stop when converged on, Doppler off, sum coherent → incoherent, EM region 1.25 → whole map, η_bone as all → 0, P off";
    assert_eq!(difference(&plain, &other), told);
    let close = FitConfig { w_em: 0.500_001, ..plain };
    assert_eq!(difference(&plain, &close), "w_EM 0.5 → 0.500001");
}

proptest! {
    /// Any settings may change to any others that are legal: the change is told, field by field, and no file loses it.
    #[test]
    fn any_change_is_told_and_kept((old, new, fields) in changed()) {
        let keys = |fields: &[&Field]| fields.iter().map(|field| field.key).collect::<Vec<_>>();
        prop_assert_eq!(keys(&old.changes(&new).collect::<Vec<_>>()), keys(&fields));
        prop_assert_eq!(old != new, !fields.is_empty());
        let told = difference(&old, &new);
        let parts: Vec<&str> = if told.is_empty() { Vec::new() } else { told.split(", ").collect() };
        prop_assert_eq!(parts.len(), fields.len(), "{}", told);
        for (part, field) in parts.iter().zip(&fields) {
            prop_assert!(part.to_lowercase().starts_with(&field.name.to_lowercase()), "{}: {}", field.key, part);
        }
        prop_assert!(new.validated().is_ok());
        prop_assert_eq!(read(&new.to_toml()), Ok(new));
        // Taken one by one, the changed fields make the one of the other.
        let mut taken = old;
        for field in &fields {
            field.take(&mut taken, &new);
        }
        prop_assert_eq!(taken, new);
    }

    #[test]
    fn any_configuration_reads_back(config in configs()) {
        prop_assert_eq!(read(&config.to_toml()), Ok(config));
    }
}
