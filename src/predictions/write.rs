//! Predictions on their way out, in each of the formats that are read; metres, the radar's axes, and both stated in the file.

use super::error::PredictionError;
use crate::dataset::NpzError;
use crate::dataset::npz::{ArrayView, write as write_npz};
use crate::escape::to_cell;
use crate::geometry::Vec3;
use crate::output::replace_file;
use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;
use serde_json::json;
use std::io::Write;
use std::path::Path;
use std::sync::Arc;

/// A format to write.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WriteFormat {
    /// `joints` (frames, persons, joints, 3), NaN where nobody is; `frames`, `joint_names`, `unit`, `axes`.
    Npz,
    /// A row a person.
    Csv,
    /// COCO's `images`, `annotations` and `categories`.
    Json,
    /// The table of CSV.
    Parquet,
}

impl WriteFormat {
    /// By the ending of a file's name.
    pub fn of(path: &Path) -> Option<Self> {
        let ending = path.extension()?.to_string_lossy().to_ascii_lowercase();
        Some(match ending.as_str() {
            "npz" => Self::Npz,
            "csv" => Self::Csv,
            "json" => Self::Json,
            "parquet" => Self::Parquet,
            _ => return None,
        })
    }
}

/// Frames by name, each with its persons' joints (m, world frame), on joints called `names`.
///
/// # Errors
/// Where the file cannot be written.
pub fn write_predictions(
    path: &Path,
    format: WriteFormat,
    names: &[String],
    frames: &[(String, Vec<Vec<Vec3>>)],
) -> Result<(), PredictionError> {
    let failed = |reason| PredictionError::Write { reason, path: path.to_owned() };
    match format {
        WriteFormat::Npz => npz(path, names, frames).map_err(PredictionError::from),
        WriteFormat::Csv => replace_file(path, |out| csv_to(out, names, frames)).map_err(failed),
        WriteFormat::Json => {
            let text =
                serde_json::to_string(&coco(names, frames)).map_err(|error| failed(std::io::Error::other(error)))?;
            replace_file(path, |out| out.write_all(text.as_bytes())).map_err(failed)
        }
        WriteFormat::Parquet => {
            let mut bytes = Vec::new();
            parquet_to(&mut bytes, names, frames).map_err(|error| failed(std::io::Error::other(error)))?;
            replace_file(path, |out| out.write_all(&bytes)).map_err(failed)
        }
    }
}

fn npz(path: &Path, names: &[String], frames: &[(String, Vec<Vec<Vec3>>)]) -> Result<(), NpzError> {
    let persons = frames.iter().map(|(_, persons)| persons.len()).max().unwrap_or(0).max(1);
    let mut joints = vec![[f64::NAN; 3]; frames.len() * persons * names.len()];
    for (frame, (_, of_frame)) in frames.iter().enumerate() {
        for (person, points) in of_frame.iter().enumerate() {
            let at = (frame * persons + person) * names.len();
            joints[at..at + names.len()].copy_from_slice(points);
        }
    }
    let shape = [frames.len(), persons, names.len(), 3];
    let frame_names: Vec<String> = frames.iter().map(|(name, _)| name.clone()).collect();
    let arrays = [
        ("joints", ArrayView::f64(&shape, joints.as_flattened())),
        ("frames", ArrayView::texts(&frame_names)),
        ("joint_names", ArrayView::texts(names)),
        ("unit", ArrayView::text("m")),
        ("axes", ArrayView::text("x,y,z")),
    ];
    write_npz(path, &arrays)
}

fn columns(names: &[String]) -> Vec<String> {
    let coordinates = names.iter().flat_map(|name| ["x", "y", "z"].map(|axis| format!("{name}_{axis}_m")));
    ["frame".to_owned(), "person".to_owned()].into_iter().chain(coordinates).collect()
}

fn csv_to(out: &mut dyn Write, names: &[String], frames: &[(String, Vec<Vec<Vec3>>)]) -> std::io::Result<()> {
    out.write_all(b"# axes = x,y,z\n")?;
    let mut table = csv::Writer::from_writer(out);
    table.write_record(columns(names))?;
    for (frame, persons) in frames {
        for (person, points) in persons.iter().enumerate() {
            let numbers = points.iter().flatten().map(f64::to_string);
            table.write_record([to_cell(frame).into_owned(), person.to_string()].into_iter().chain(numbers))?;
        }
    }
    table.flush()
}

fn coco(names: &[String], frames: &[(String, Vec<Vec<Vec3>>)]) -> serde_json::Value {
    let image = |(id, (name, _)): (usize, &(String, _))| json!({ "id": id, "file_name": name });
    let images: Vec<_> = frames.iter().enumerate().map(image).collect();
    let mut annotations = Vec::new();
    for (image, (_, persons)) in frames.iter().enumerate() {
        for points in persons {
            annotations
                .push(json!({ "id": annotations.len(), "image_id": image, "category_id": 1, "keypoints_3d": points }));
        }
    }
    json!({
        "info": { "unit": "m", "axes": "x,y,z" },
        "images": images,
        "annotations": annotations,
        "categories": [{ "id": 1, "name": "person", "keypoints": names }],
    })
}

fn parquet_to(
    out: impl Write + Send,
    names: &[String],
    frames: &[(String, Vec<Vec<Vec3>>)],
) -> Result<(), ParquetError> {
    let columns = columns(names);
    let field = |(k, name): (usize, &String)| {
        let (physical, logical) = match k {
            0 => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
            1 => (Physical::INT64, None),
            _ => (Physical::DOUBLE, None),
        };
        let built = Type::primitive_type_builder(name, physical).with_logical_type(logical);
        built.with_repetition(Repetition::REQUIRED).build().map(Arc::new)
    };
    let fields = columns.iter().enumerate().map(field).collect::<Result<Vec<_>, _>>()?;
    let schema = Type::group_type_builder("joints").with_fields(fields).build()?;
    let stated = [("unit", "m"), ("axes", "x,y,z")].map(|(key, value)| KeyValue::new(key.to_owned(), value.to_owned()));
    let properties = WriterProperties::builder()
        .set_created_by(format!("mhp-inspector {}", env!("CARGO_PKG_VERSION")))
        .set_key_value_metadata(Some(stated.to_vec()))
        .build();
    let mut writer = SerializedFileWriter::new(out, Arc::new(schema), Arc::new(properties))?;
    let mut group = writer.next_row_group()?;
    let rows: Vec<(&str, usize, &Vec<Vec3>)> = frames
        .iter()
        .flat_map(|(name, persons)| {
            persons.iter().enumerate().map(move |(person, points)| (name.as_str(), person, points))
        })
        .collect();
    for k in 0..columns.len() {
        let Some(mut column) = group.next_column()? else { break };
        match k {
            0 => {
                let values: Vec<ByteArray> =
                    rows.iter().map(|(name, ..)| ByteArray::from(name.as_bytes().to_vec())).collect();
                column.typed::<ByteArrayType>().write_batch(&values, None, None)?;
            }
            1 => {
                let values: Vec<i64> = rows.iter().map(|(_, person, _)| *person as i64).collect();
                column.typed::<Int64Type>().write_batch(&values, None, None)?;
            }
            _ => {
                let values: Vec<f64> = rows.iter().map(|(.., points)| points[(k - 2) / 3][(k - 2) % 3]).collect();
                column.typed::<DoubleType>().write_batch(&values, None, None)?;
            }
        }
        column.close()?;
    }
    group.close()?;
    writer.close()?;
    Ok(())
}
