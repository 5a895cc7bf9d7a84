//! Parquet: the tables of CSV with types; unit and axes may stand in the file's own key-value metadata.

use super::table::{Cell, Table};
use crate::input::open_file;
use crate::predictions::error::PredictionError;
use crate::predictions::raw::RawPredictions;
use parquet::file::reader::{FileReader as _, SerializedFileReader};
use parquet::record::Field;
use std::path::Path;

/// Rows of a file at most.
const MOST_ROWS: i64 = 50_000_000;

pub(super) fn read(path: &Path) -> Result<RawPredictions, PredictionError> {
    let file = open_file(path, "a Parquet table of joints")
        .map_err(|reason| PredictionError::Read { reason, path: path.to_owned() })?;
    let wrong = |error: parquet::errors::ParquetError| PredictionError::format(path, error.to_string());
    let reader = SerializedFileReader::new(file).map_err(wrong)?;
    let meta = reader.metadata().file_metadata();
    if meta.num_rows() > MOST_ROWS {
        return Err(PredictionError::format(path, format!("{} rows; expected at most {MOST_ROWS}", meta.num_rows())));
    }
    let stated = |key: &str| {
        let pairs = meta.key_value_metadata().map_or(&[][..], Vec::as_slice);
        pairs.iter().find(|pair| pair.key == key).and_then(|pair| pair.value.clone())
    };
    let (unit, axes) = (stated("unit"), stated("axes"));
    let schema = meta.schema_descr();
    let columns: Vec<String> = schema.root_schema().get_fields().iter().map(|field| field.name().to_owned()).collect();
    let mut rows = Vec::new();
    for row in reader.get_row_iter(None).map_err(wrong)? {
        let row = row.map_err(wrong)?;
        let cells: Result<Vec<Cell>, PredictionError> = row
            .get_column_iter()
            .map(|(name, field)| {
                cell(field).ok_or_else(|| {
                    PredictionError::format(
                        path,
                        format!("column `{name}` holds lists or groups; expected numbers and text"),
                    )
                })
            })
            .collect();
        rows.push((None, cells?));
    }
    Table { columns, rows, format: "parquet", unit, axes }.joints(path)
}

fn cell(field: &Field) -> Option<Cell> {
    Some(match field {
        Field::Null => Cell::Empty,
        Field::Bool(flag) => Cell::Number(f64::from(u8::from(*flag))),
        Field::Byte(n) => Cell::Number(f64::from(*n)),
        Field::Short(n) => Cell::Number(f64::from(*n)),
        Field::Int(n) => Cell::Number(f64::from(*n)),
        Field::Long(n) => Cell::Number(*n as f64),
        Field::UByte(n) => Cell::Number(f64::from(*n)),
        Field::UShort(n) => Cell::Number(f64::from(*n)),
        Field::UInt(n) => Cell::Number(f64::from(*n)),
        Field::ULong(n) => Cell::Number(*n as f64),
        Field::Float16(x) => Cell::Number(f64::from(*x)),
        Field::Float(x) => Cell::Number(f64::from(*x)),
        Field::Double(x) => Cell::Number(*x),
        Field::Str(text) => Cell::Text(text.clone()),
        Field::Bytes(bytes) => Cell::Text(String::from_utf8_lossy(bytes.data()).into_owned()),
        _ => return None,
    })
}
