//! Which frame of the data set each frame of a file is: by its name, by the end of its name, by the name of its file among results,
//! or by its number.

use super::raw::FrameKey;
use crate::dataset::Dataset;
use std::collections::HashMap;

/// The frame of each key; `None` where the data set has none of that name.
pub(super) fn frames_of(dataset: &Dataset, keys: &[&FrameKey]) -> Vec<Option<usize>> {
    let names = Names::of(dataset);
    let by_name: Vec<Option<usize>> = keys.iter().map(|key| names.find(key)).collect();
    let indices: Vec<Option<usize>> = keys
        .iter()
        .map(|key| match key {
            FrameKey::Index(index) => Some(*index),
            // `12`, and `12.0` of a table whose column was made a float.
            FrameKey::Name(name) => name.strip_suffix(".0").unwrap_or(name).parse().ok(),
        })
        .collect();
    let found = |of: &[Option<usize>]| of.iter().filter(|found| found.is_some()).count();
    // Numbers are names of frames where any of them is one, else numbers of frames.
    if found(&by_name) > 0 || found(&indices) < keys.len() {
        return by_name;
    }
    indices.into_iter().map(|index| index.filter(|index| *index < dataset.len())).collect()
}

/// Every way to call a frame, as long as it is the only one called so.
struct Names<'a> {
    whole: HashMap<&'a str, usize>,
    ends: HashMap<&'a str, Option<usize>>,
    files: HashMap<String, usize>,
}

impl<'a> Names<'a> {
    fn of(dataset: &'a Dataset) -> Self {
        let (mut whole, mut ends, mut files) = (HashMap::new(), HashMap::new(), HashMap::new());
        let file_names = dataset.file_names();
        for index in 0..dataset.len() {
            let name = dataset.frame_name(index);
            whole.insert(name, index);
            for (at, _) in name.match_indices('/') {
                let end = &name[at + 1..];
                ends.entry(end).and_modify(|known: &mut Option<usize>| *known = None).or_insert(Some(index));
            }
            files.insert(file_names.of(index, name).into_owned(), index);
        }
        Self { whole, ends, files }
    }

    fn find(&self, key: &FrameKey) -> Option<usize> {
        let FrameKey::Name(name) = key else { return None };
        let name = name.replace('\\', "/");
        let stem = name.rsplit_once('.').map_or(name.as_str(), |(stem, ending)| {
            // A dot inside a name is no ending.
            if ending.len() <= 5 && !ending.contains('/') && !ending.chars().all(|c| c.is_ascii_digit()) {
                stem
            } else {
                &name
            }
        });
        let radar = stem.strip_suffix("_radar");
        let calls = [Some(name.as_str()), Some(stem), radar];
        for call in calls.into_iter().flatten() {
            let whole = self.whole.get(call).copied();
            let by_end = || self.ends.get(call).copied().flatten();
            if let Some(index) = whole.or_else(by_end).or_else(|| self.files.get(call).copied()) {
                return Some(index);
            }
        }
        // A path that leads further up than the data set's folder.
        let mut rest = radar.unwrap_or(stem);
        while let Some((_, after)) = rest.split_once('/') {
            if let Some(index) = self.whole.get(after) {
                return Some(*index);
            }
            rest = after;
        }
        None
    }
}
