//! JSON as pose estimators write it. Three forms, told apart by their keys:
//!
//! * a list of persons, one object each, with the frame (`frame`, `image_id`, `frame_id`, `file_name`) and `keypoints`;
//! * COCO: `images` (id, file_name), `annotations` (image_id, keypoints) and `categories[0].keypoints` with the joints' names;
//! * MMPose: `instance_info` with `frame_id` and `instances`, `meta_info` with `keypoint_id2name`.
//!
//! Keypoints are `[[x, y, z], …]`, `[[x, y, z, score], …]`, or the same in one flat list; `keypoints_3d` comes before `keypoints`.

use super::MOST_BYTES;
use crate::geometry::Vec3;
use crate::input::read_bytes;
use crate::predictions::error::PredictionError;
use crate::predictions::raw::{FrameKey, RawPredictions};
use crate::predictions::reading::Reading;
use serde_json::Value;
use std::collections::HashMap;
use std::path::Path;

const KEYPOINTS: [&str; 4] = ["keypoints_3d", "joints_3d", "keypoints", "joints"];
const FRAME: [&str; 4] = ["frame", "frame_name", "file_name", "image_id"];

pub(super) fn read(path: &Path, reading: &Reading) -> Result<RawPredictions, PredictionError> {
    let bytes = read_bytes(path, "JSON of keypoints", MOST_BYTES)
        .map_err(|reason| PredictionError::Read { reason, path: path.to_owned() })?;
    let whole: Value = serde_json::from_slice(&bytes)
        .map_err(|error| PredictionError::at_line(path, error.line(), error.to_string()))?;
    let mut found = Found {
        path,
        array: reading.array.as_deref(),
        raw: RawPredictions::default(),
        used: String::new(),
        flags: true,
    };
    let form = match &whole {
        Value::Array(persons) => {
            for person in persons {
                let key = found.key(person, None)?;
                found.person(person, key)?;
            }
            "list"
        }
        Value::Object(object) if object.contains_key("instance_info") => {
            found.mmpose(&whole)?;
            "mmpose"
        }
        Value::Object(object) if object.contains_key("annotations") => {
            found.coco(&whole)?;
            "coco"
        }
        Value::Object(object) if object.get("predictions").is_some_and(Value::is_array) => {
            for person in list(&whole, "predictions") {
                let key = found.key(person, None)?;
                found.person(person, key)?;
            }
            "list"
        }
        _ => {
            return Err(PredictionError::format(
                path,
                "expected a list of persons with `keypoints`, COCO's `images` and `annotations`, or MMPose's `instance_info`",
            ));
        }
    };
    let Found { mut raw, used, flags, .. } = found;
    if flags && !raw.frames.is_empty() {
        return Err(PredictionError::format(
            path,
            format!("`{used}` are image points with visibility (every third number is 0, 1 or 2); expected 3-D joints"),
        ));
    }
    let text =
        |key: &str| whole.get(key).or_else(|| whole.get("info")?.get(key)).and_then(Value::as_str).map(str::to_owned);
    (raw.unit, raw.axes) = (text("unit").or_else(|| text("units")), text("axes"));
    if raw.joints.is_empty() {
        raw.joints = names(whole.get("joint_names").or_else(|| whole.get("joints")));
    }
    raw.form = format!("json {form} {used} {}", raw.joint_count);
    Ok(raw)
}

struct Found<'a> {
    path: &'a Path,
    array: Option<&'a str>,
    raw: RawPredictions,
    used: String,
    /// Whether every third number so far is a visibility.
    flags: bool,
}

impl Found<'_> {
    fn wrong(&self, message: String) -> PredictionError {
        PredictionError::format(self.path, message)
    }

    fn key(&self, of: &Value, images: Option<&HashMap<u64, FrameKey>>) -> Result<FrameKey, PredictionError> {
        let known = images.and_then(|images| images.get(&of.get("image_id")?.as_u64()?));
        if let Some(key) = known {
            return Ok(key.clone());
        }
        for name in FRAME {
            match of.get(name) {
                Some(Value::String(text)) => return Ok(FrameKey::of(text)),
                Some(Value::Number(number)) => return Ok(FrameKey::of(&number.to_string())),
                _ => {}
            }
        }
        let index = ["index", "frame_index", "frame_id"].iter().find_map(|name| of.get(name)?.as_u64());
        let missing = || self.wrong("a person without frame; expected `frame`, `image_id` or `frame_id`".into());
        index.map(|index| FrameKey::Index(index as usize)).ok_or_else(missing)
    }

    fn person(&mut self, of: &Value, key: FrameKey) -> Result<(), PredictionError> {
        let known = match self.array {
            Some(asked) => of.get(asked).map(|points| (asked, points)),
            None => KEYPOINTS.iter().find_map(|&name| Some((name, of.get(name)?))),
        };
        let Some((name, points)) = known else {
            let expected = self.array.unwrap_or("keypoints");
            return Err(self.wrong(format!("frame {key}: a person without `{expected}`")));
        };
        if self.used.is_empty() {
            name.clone_into(&mut self.used);
        }
        let points = self.points(points, name, &key)?;
        self.flags &= points.iter().all(|p| p[2] == 0.0 || p[2] == 1.0 || p[2] == 2.0);
        if self.raw.joint_count == 0 {
            self.raw.joint_count = points.len();
        } else if points.len() != self.raw.joint_count {
            let (found, before) = (points.len(), self.raw.joint_count);
            return Err(self.wrong(format!("frame {key}: a person with {found} joints; those before have {before}")));
        }
        self.raw.push(key, points);
        Ok(())
    }

    fn points(&self, of: &Value, name: &str, key: &FrameKey) -> Result<Vec<Vec3>, PredictionError> {
        let wrong =
            || self.wrong(format!("frame {key}: `{name}`; expected [[x, y, z], …], with a score behind z or not"));
        let number = |value: &Value| if value.is_null() { Some(f64::NAN) } else { value.as_f64() };
        let items = of.as_array().ok_or_else(wrong)?;
        // Some write a person's points in one more list.
        if let [Value::Array(inner)] = &items[..]
            && inner.first().is_some_and(Value::is_array)
        {
            return self.points(&items[0], name, key);
        }
        if items.iter().all(Value::is_array) {
            let point = |item: &Value| {
                let numbers: Vec<f64> = item.as_array()?.iter().map(number).collect::<Option<_>>()?;
                matches!(numbers.len(), 3 | 4).then(|| [numbers[0], numbers[1], numbers[2]])
            };
            return items.iter().map(point).collect::<Option<_>>().ok_or_else(wrong);
        }
        let flat: Vec<f64> = items.iter().map(number).collect::<Option<_>>().ok_or_else(wrong)?;
        // Four numbers a joint where there are as many names, else three.
        let names = self.raw.joints.len();
        let width = if names > 0 && flat.len() == 4 * names { 4 } else { 3 };
        if flat.is_empty() || !flat.len().is_multiple_of(width) {
            return Err(wrong());
        }
        Ok(flat.chunks_exact(width).map(|p| [p[0], p[1], p[2]]).collect())
    }

    fn coco(&mut self, whole: &Value) -> Result<(), PredictionError> {
        let image = |image: &Value| {
            let id = image.get("id")?.as_u64()?;
            let name = image.get("file_name").or_else(|| image.get("name")).and_then(Value::as_str);
            Some((id, name.map_or(FrameKey::Index(id as usize), FrameKey::of)))
        };
        let images: HashMap<u64, FrameKey> = list(whole, "images").iter().filter_map(image).collect();
        self.raw.joints = names(list(whole, "categories").first().and_then(|category| category.get("keypoints")));
        for person in list(whole, "annotations") {
            let key = self.key(person, Some(&images))?;
            self.person(person, key)?;
        }
        Ok(())
    }

    fn mmpose(&mut self, whole: &Value) -> Result<(), PredictionError> {
        if let Some(Value::Object(by_id)) = whole.get("meta_info").and_then(|meta| meta.get("keypoint_id2name")) {
            let mut named: Vec<(usize, String)> =
                by_id.iter().filter_map(|(id, name)| Some((id.parse().ok()?, name.as_str()?.to_owned()))).collect();
            named.sort();
            self.raw.joints = named.into_iter().map(|(_, name)| name).collect();
        }
        for frame in list(whole, "instance_info") {
            let key = self.key(frame, None)?;
            for person in list(frame, "instances") {
                self.person(person, key.clone())?;
            }
        }
        Ok(())
    }
}

fn list<'v>(of: &'v Value, key: &str) -> &'v [Value] {
    of.get(key).and_then(Value::as_array).map_or(&[], Vec::as_slice)
}

fn names(of: Option<&Value>) -> Vec<String> {
    let all =
        of.and_then(Value::as_array).map(|names| names.iter().map(|name| name.as_str().map(str::to_owned)).collect());
    all.flatten().unwrap_or_default()
}
