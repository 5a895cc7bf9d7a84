//! Grids over the configuration: `KEY=VALUE,VALUE` becomes variants.
//!
//! Keys and values are those of [`FIELDS`], so that every number, switch and choice can be swept and a wrong one is refused in
//! the configuration's own words.

use super::RunError;
use super::variant::Variant;
use crate::config::{FIELDS, Field, FitConfig};

/// Points of a grid that are accepted.
const MOST: usize = 10_000;

/// One axis of a grid.
#[derive(Debug, Clone, PartialEq)]
pub struct GridAxis {
    /// A key of `FIT.toml`, for example `w_em` or `init.peak_dropout`.
    pub key: String,
    /// Values as typed.
    pub values: Vec<String>,
}

impl std::str::FromStr for GridAxis {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (key, values) = text.split_once('=').ok_or("expected KEY=VALUE,VALUE,…, for example tau_pct=5,10,20")?;
        let values: Vec<String> = values.split(',').map(|value| value.trim().to_owned()).collect();
        if key.trim().is_empty() || values.iter().any(String::is_empty) {
            return Err("expected a key and values without gaps, for example tau_pct=5,10,20".into());
        }
        if let Some(twice) = (0..values.len()).find(|&k| values[..k].contains(&values[k])) {
            return Err(format!("{} is there twice", values[twice]));
        }
        Ok(Self { key: key.trim().to_owned(), values })
    }
}

/// Every combination of the axes' values on top of `base`, the last axis fastest.
///
/// # Errors
/// Where there is no axis, a key comes twice or is unknown, a value is not one of its key, or there are too many points.
pub(super) fn variants(base: &FitConfig, axes: &[GridAxis]) -> Result<Vec<Variant>, RunError> {
    let text = || axes.iter().map(|axis| format!("{}={}", axis.key, axis.values.join(","))).collect::<Vec<_>>();
    let wrong = |message: String| RunError::Grid { text: text().join(" "), message };
    if axes.is_empty() {
        return Err(wrong("expected at least one KEY=VALUE,…".into()));
    }
    if let Some(twice) = (0..axes.len()).find(|&k| axes[..k].iter().any(|axis| axis.key == axes[k].key)) {
        return Err(wrong(format!("the key {} is there twice", axes[twice].key)));
    }
    let points = axes.iter().try_fold(1_usize, |points, axis| points.checked_mul(axis.values.len()));
    let points = points.filter(|&points| points <= MOST);
    let points = points.ok_or_else(|| wrong(format!("it has more than {MOST} points")))?;
    (0..points)
        .map(|mut point| {
            let mut values = Vec::with_capacity(axes.len());
            for axis in axes.iter().rev() {
                values.push(axis.values[point % axis.values.len()].clone());
                point /= axis.values.len();
            }
            values.reverse();
            let config = with(base, axes, &values).map_err(&wrong)?;
            Ok(Variant::cold(values, &config))
        })
        .collect()
}

/// `base` with these values under the axes' keys.
fn with(base: &FitConfig, axes: &[GridAxis], values: &[String]) -> Result<FitConfig, String> {
    let mut config = *base;
    for (axis, value) in axes.iter().zip(values) {
        let field = Field::of_key(&axis.key).ok_or_else(|| {
            let keys: Vec<String> = FIELDS.iter().map(|field| format!("`{}`", field.key)).collect();
            format!("unknown key `{}`; expected one of {}", axis.key, keys.join(", "))
        })?;
        field.set(&mut config, field.parse(value).map_err(|error| error.to_string())?);
    }
    Ok(config)
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests fail by panicking")]
    use super::*;
    use crate::config::{EmRegion, Summation};

    fn grid(axes: &[&str]) -> Result<Vec<Variant>, String> {
        let axes: Result<Vec<GridAxis>, String> = axes.iter().map(|axis| axis.parse()).collect();
        variants(&FitConfig::default(), &axes?).map_err(|error| error.to_string())
    }

    #[test]
    fn a_grid_holds_every_combination() {
        let rows = grid(&["w_em=0.1,1", "summation=coherent,incoherent", "operators.range=false"]).unwrap();
        let names: Vec<String> = rows.iter().map(Variant::name).collect();
        let wanted = ["0.1, coherent, false", "0.1, incoherent, false", "1, coherent, false", "1, incoherent, false"];
        assert_eq!(names, wanted);
        assert_eq!((rows[3].config.w_em, rows[3].config.summation), (1.0, Summation::Incoherent));
        assert!(rows.iter().all(|row| !row.config.operators.range && row.config.operators.doppler));
        let rows = grid(&["em_region=full,0.8", "init.peak_dropout=0.2", "learning_rates.bone=0.01"]).unwrap();
        assert_eq!((rows[0].config.em_region, rows[1].config.em_region), (EmRegion::Full, EmRegion::HalfWidth(0.8)));
        assert_eq!((rows[0].config.init.peak_dropout, rows[0].config.learning_rates.bone), (0.2, Some(0.01)));
    }

    #[test]
    fn what_is_wrong_is_told() {
        let refusal = |axes: &[&str]| grid(axes).err().unwrap_or_default();
        assert!(refusal(&["tau_pct"]).contains("expected KEY=VALUE"));
        assert!(refusal(&["tau_pct=5,"]).contains("without gaps"));
        assert!(refusal(&["tau_pct=5,5"]).contains("5 is there twice"));
        assert!(refusal(&["tau_pct=5", "tau_pct=6"]).contains("key tau_pct is there twice"));
        assert!(refusal(&["tau=5"]).contains("unknown key `tau`"), "{}", refusal(&["tau=5"]));
        assert!(refusal(&["tau_pct=101"]).contains("tau_pct is 101; expected a number in 0.1 ..= 100"));
        let told = "summation is loud; expected \"coherent\" or \"incoherent\"";
        assert!(refusal(&["summation=loud"]).contains(told), "{}", refusal(&["summation=loud"]));
        assert!(refusal(&["iterations=2.5"]).contains("iterations is 2.5; expected a whole number in 1 ..= 100000"));
        assert!(refusal(&["operators.range=off"]).contains("operators.range is off; expected true or false"));
        assert!(refusal(&["w_em.x=1"]).contains("unknown key `w_em.x`"));
        assert!(refusal(&[]).contains("at least one"));
    }

    /// Numbers, switches and choices, the words for no number among them.
    #[test]
    fn any_setting_can_be_swept() {
        for field in FIELDS {
            let values = field.legal();
            let texts: Vec<String> = values.iter().map(|value| field.text(*value)).collect();
            let axis = GridAxis { key: field.key.to_owned(), values: texts.clone() };
            let rows = variants(&FitConfig::default(), &[axis]).unwrap();
            let swept: Vec<_> = rows.iter().map(|row| field.get(&row.config)).collect();
            assert_eq!((swept, rows.iter().map(Variant::name).collect::<Vec<_>>()), (values, texts), "{}", field.key);
        }
    }

    #[cfg(feature = "dummies")]
    #[test]
    fn the_dummy_setting_can_be_swept() {
        assert_eq!(grid(&["w_dummy=0,2"]).unwrap()[1].config.w_dummy, 2.0);
    }
}
