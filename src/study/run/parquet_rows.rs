//! `rows.parquet`: the cells of `rows.csv` with their types, without arrow.

use super::row::Cell;
use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::Type;
use std::io::Write;
use std::sync::Arc;

/// Writes one row group with a column for each cell of `rows`, which all have the same columns. Every column may be null.
///
/// # Errors
/// Where `out` cannot be written.
pub(super) fn write(
    out: impl Write + Send,
    columns: &[String],
    kinds: &[Cell],
    rows: &[Vec<Cell>],
) -> Result<(), ParquetError> {
    let fields = columns.iter().zip(kinds).map(|(name, kind)| field(name, kind)).collect::<Result<Vec<_>, _>>()?;
    let schema = Type::group_type_builder("rows").with_fields(fields).build()?;
    // Named here, or the library's version would stand in the file and in its bytes.
    let properties = WriterProperties::builder().set_created_by(format!("mhp-inspector {}", env!("CARGO_PKG_VERSION")));
    let mut writer = SerializedFileWriter::new(out, Arc::new(schema), Arc::new(properties.build()))?;
    let mut group = writer.next_row_group()?;
    for (k, kind) in kinds.iter().enumerate() {
        column(&mut group, kind, rows.iter().filter_map(|row| row.get(k)))?;
    }
    group.close()?;
    writer.close()?;
    Ok(())
}

fn field(name: &str, kind: &Cell) -> Result<Arc<Type>, ParquetError> {
    let (physical, logical) = match kind {
        Cell::Text(_) => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
        Cell::Whole(_) => (Physical::INT64, None),
        Cell::Number(_) => (Physical::DOUBLE, None),
        Cell::Flag(_) => (Physical::BOOLEAN, None),
    };
    let built = Type::primitive_type_builder(name, physical).with_logical_type(logical);
    Ok(Arc::new(built.with_repetition(Repetition::OPTIONAL).build()?))
}

fn column<'a>(
    group: &mut SerializedRowGroupWriter<'_, impl Write + Send>,
    kind: &Cell,
    cells: impl Iterator<Item = &'a Cell> + Clone,
) -> Result<(), ParquetError> {
    // Definition level 1: there; 0: null. Only what is there is among the values.
    macro_rules! put {
        ($variant:ident, $type:ty, $value:expr) => {{
            let known = |cell: &Cell| match cell {
                Cell::$variant(value) => value.clone().map($value),
                _ => None,
            };
            let levels: Vec<i16> = cells.clone().map(|cell| i16::from(known(cell).is_some())).collect();
            let values: Vec<_> = cells.filter_map(known).collect();
            if let Some(mut column) = group.next_column()? {
                column.typed::<$type>().write_batch(&values, Some(&levels), None)?;
                column.close()?;
            }
        }};
    }
    match kind {
        Cell::Text(_) => put!(Text, ByteArrayType, |text: String| ByteArray::from(text.into_bytes())),
        Cell::Whole(_) => put!(Whole, Int64Type, |n: i64| n),
        Cell::Number(_) => put!(Number, DoubleType, |x: f64| x),
        Cell::Flag(_) => put!(Flag, BoolType, |flag: bool| flag),
    }
    Ok(())
}
