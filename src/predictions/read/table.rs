//! Tables of joints, of CSV and of Parquet. Two forms: long, a row a joint (`frame,person,joint,x,y,z`), and wide, a row a person
//! (`frame,person,nose_x,nose_y,nose_z,…`). A unit may follow the axis: `x_mm`, `nose_x_mm`.

use crate::geometry::Vec3;
use crate::predictions::convention::Unit;
use crate::predictions::error::PredictionError;
use crate::predictions::raw::{FrameKey, RawPredictions};
use std::collections::HashMap;
use std::path::Path;

/// A cell of a table.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Cell {
    Empty,
    Text(String),
    Number(f64),
}

impl Cell {
    fn text(&self) -> String {
        match self {
            Self::Empty => String::new(),
            Self::Text(text) => text.clone(),
            Self::Number(number) => format!("{number}"),
        }
    }

    /// What is no number is `None`; an empty cell and `nan` are not finite.
    fn number(&self) -> Option<f64> {
        match self {
            Self::Empty => Some(f64::NAN),
            Self::Number(number) => Some(*number),
            Self::Text(text) if text.trim().is_empty() => Some(f64::NAN),
            Self::Text(text) => text.trim().parse().ok(),
        }
    }
}

/// Columns and rows.
pub(super) struct Table {
    pub(super) columns: Vec<String>,
    pub(super) rows: Vec<(Option<usize>, Vec<Cell>)>,
    /// CSV or Parquet.
    pub(super) format: &'static str,
    pub(super) unit: Option<String>,
    pub(super) axes: Option<String>,
}

/// A column that is a coordinate: its joint (empty in a long table), axis and unit.
struct Coordinate {
    joint: String,
    axis: usize,
    unit: Option<Unit>,
}

fn coordinate(column: &str) -> Option<Coordinate> {
    let mut rest = column.trim();
    let mut unit = None;
    for known in Unit::ALL {
        if let Some(before) = rest.strip_suffix(known.word()).and_then(|before| before.strip_suffix(['_', '.'])) {
            (rest, unit) = (before, Some(known));
            break;
        }
    }
    let at = rest.len().checked_sub(1).filter(|&at| rest.is_char_boundary(at))?;
    let axis = ["x", "y", "z"].iter().position(|axis| axis.eq_ignore_ascii_case(&rest[at..]))?;
    let joint = &rest[..at];
    let joint = if joint.is_empty() { joint } else { joint.strip_suffix(['_', '.', ' '])? };
    Some(Coordinate { joint: joint.to_owned(), axis, unit })
}

const FRAME: [&str; 5] = ["frame", "frame_name", "name", "image", "image_id"];
const INDEX: [&str; 3] = ["index", "frame_index", "frame_id"];
const PERSON: [&str; 5] = ["person", "person_id", "instance", "track_id", "id"];

impl Table {
    fn column(&self, names: &[&str]) -> Option<usize> {
        names.iter().find_map(|name| self.columns.iter().position(|column| column.trim().eq_ignore_ascii_case(name)))
    }

    /// The joints of all rows.
    pub(super) fn joints(&self, path: &Path) -> Result<RawPredictions, PredictionError> {
        let coordinates: Vec<Option<Coordinate>> = self.columns.iter().map(|column| coordinate(column)).collect();
        let unit = Self::unit(&coordinates, path)?;
        let long = self.column(&["joint", "joint_name", "keypoint"]);
        let mut raw = match long {
            Some(joint) => self.long(joint, &coordinates, path)?,
            None => self.wide(&coordinates, path)?,
        };
        raw.unit = unit.map(|unit| unit.word().to_owned()).or_else(|| self.unit.clone());
        raw.axes.clone_from(&self.axes);
        raw.joint_count = raw.joints.len();
        raw.form = format!("{} {} {}", self.format, if long.is_some() { "long" } else { "wide" }, raw.joints.join(" "));
        Ok(raw)
    }

    fn unit(coordinates: &[Option<Coordinate>], path: &Path) -> Result<Option<Unit>, PredictionError> {
        let mut units: Vec<Unit> = coordinates.iter().flatten().filter_map(|c| c.unit).collect();
        units.dedup();
        match units[..] {
            [] => Ok(None),
            [unit] => Ok(Some(unit)),
            _ => Err(PredictionError::format(path, "columns of several units; expected one unit")),
        }
    }

    /// What the rows' frames are called: a function of the row.
    fn frame_column(&self, path: &Path) -> Result<(usize, bool), PredictionError> {
        if let Some(column) = self.column(&FRAME) {
            return Ok((column, false));
        }
        let missing = || {
            let found = self.columns.iter().take(8).cloned().collect::<Vec<_>>().join(",");
            PredictionError::format(
                path,
                format!(
                    "no column `frame`; expected a header as frame,person,joint,x,y,z or frame,nose_x,nose_y,nose_z,…; found {found}"
                ),
            )
        };
        self.column(&INDEX).map(|column| (column, true)).ok_or_else(missing)
    }

    fn key(cell: &Cell, by_index: bool, line: Option<usize>, path: &Path) -> Result<FrameKey, PredictionError> {
        let text = cell.text();
        if !by_index && !text.trim().is_empty() {
            return Ok(FrameKey::of(&text));
        }
        text.trim().parse().map(FrameKey::Index).map_err(|_| PredictionError::Format {
            message: format!(
                "frame `{}`; expected {}",
                text.escape_debug(),
                if by_index { "a number counted from 0" } else { "a name" }
            ),
            line,
            path: path.to_owned(),
        })
    }

    fn value(&self, row: &[Cell], column: usize, line: Option<usize>, path: &Path) -> Result<f64, PredictionError> {
        let cell = row.get(column).unwrap_or(&Cell::Empty);
        cell.number().ok_or_else(|| PredictionError::Format {
            message: format!("column `{}`: `{}` is no number", self.columns[column], cell.text().escape_debug()),
            line,
            path: path.to_owned(),
        })
    }

    fn wide(&self, coordinates: &[Option<Coordinate>], path: &Path) -> Result<RawPredictions, PredictionError> {
        let (frame, by_index) = self.frame_column(path)?;
        let mut raw = RawPredictions::default();
        let mut places: Vec<[Option<usize>; 3]> = Vec::new();
        for (column, coordinate) in coordinates.iter().enumerate() {
            let Some(Coordinate { joint, axis, .. }) = coordinate else { continue };
            let known = raw.joints.iter().position(|known| known == joint);
            let at = known.unwrap_or_else(|| {
                raw.joints.push(joint.clone());
                places.push([None; 3]);
                places.len() - 1
            });
            places[at][*axis] = Some(column);
        }
        let mut columns: Vec<[usize; 3]> = Vec::with_capacity(places.len());
        for (place, joint) in places.iter().zip(&raw.joints) {
            let [Some(x), Some(y), Some(z)] = *place else {
                return Err(PredictionError::format(
                    path,
                    format!("joint `{joint}` lacks a column; expected {joint}_x, {joint}_y, {joint}_z: joints are 3-D"),
                ));
            };
            columns.push([x, y, z]);
        }
        if columns.is_empty() {
            return Err(PredictionError::format(
                path,
                "no columns of joints; expected nose_x,nose_y,nose_z,… or joint,x,y,z",
            ));
        }
        for (line, row) in &self.rows {
            let key = Self::key(row.get(frame).unwrap_or(&Cell::Empty), by_index, *line, path)?;
            let mut person: Vec<Vec3> = Vec::with_capacity(columns.len());
            for xyz in &columns {
                let mut p = [0.0; 3];
                for (value, &column) in p.iter_mut().zip(xyz) {
                    *value = self.value(row, column, *line, path)?;
                }
                person.push(p);
            }
            raw.push(key, person);
        }
        Ok(raw)
    }

    fn long(
        &self,
        joint_column: usize,
        coordinates: &[Option<Coordinate>],
        path: &Path,
    ) -> Result<RawPredictions, PredictionError> {
        let (frame, by_index) = self.frame_column(path)?;
        let person_column = self.column(&PERSON);
        let axis = |axis: usize| {
            let of_axis = |c: &Option<Coordinate>| c.as_ref().is_some_and(|c| c.joint.is_empty() && c.axis == axis);
            coordinates.iter().position(of_axis)
        };
        let (Some(x), Some(y), Some(z)) = (axis(0), axis(1), axis(2)) else {
            return Err(PredictionError::format(
                path,
                "no columns x, y, z beside `joint`; expected all three: joints are 3-D",
            ));
        };
        let mut joints: Vec<String> = Vec::new();
        let mut known: HashMap<String, usize> = HashMap::new();
        let mut order: Vec<(FrameKey, String)> = Vec::new();
        let mut persons: HashMap<(FrameKey, String), Vec<(usize, Vec3)>> = HashMap::new();
        for (line, row) in &self.rows {
            let cell = |column: usize| row.get(column).unwrap_or(&Cell::Empty);
            let key = Self::key(cell(frame), by_index, *line, path)?;
            let name = cell(joint_column).text();
            let joint = *known.entry(name.clone()).or_insert_with(|| {
                joints.push(name.clone());
                joints.len() - 1
            });
            let mut p = [0.0; 3];
            for (value, column) in p.iter_mut().zip([x, y, z]) {
                *value = self.value(row, column, *line, path)?;
            }
            let who = (key, person_column.map_or_else(String::new, |column| cell(column).text()));
            let person = persons.entry(who.clone()).or_insert_with(|| {
                order.push(who.clone());
                Vec::new()
            });
            if person.iter().any(|(other, _)| *other == joint) {
                let message =
                    format!("joint `{name}` of frame {} is there twice; a column `person` tells people apart", who.0);
                return Err(PredictionError::Format { message, line: *line, path: path.to_owned() });
            }
            person.push((joint, p));
        }
        let mut raw = RawPredictions { joints, ..RawPredictions::default() };
        for who in order {
            let mut person = vec![[f64::NAN; 3]; raw.joints.len()];
            for (joint, p) in persons.remove(&who).unwrap_or_default() {
                person[joint] = p;
            }
            raw.push(who.0, person);
        }
        Ok(raw)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_are_told_by_their_names() {
        let of = |column: &str| coordinate(column).map(|c| (c.joint, c.axis, c.unit));
        assert_eq!(of("nose_x"), Some(("nose".into(), 0, None)));
        assert_eq!(of("left_hip_z_mm"), Some(("left_hip".into(), 2, Some(Unit::Mm))));
        assert_eq!(of("y"), Some((String::new(), 1, None)));
        assert_eq!(of("x_m"), Some((String::new(), 0, Some(Unit::M))));
        assert_eq!(of("LHip.Y"), Some(("LHip".into(), 1, None)));
        for other in ["frame", "index", "", "score", "é"] {
            assert_eq!(of(other), None, "{other}");
        }
    }
}
