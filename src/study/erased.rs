//! Files of erased cells: what a fit is not to see, for `fit --erase` and from the window.
//!
//! ```json
//! {"format": "mhp-erased", "version": 1, "regions": [{"view": "hm_hori", "bins": [[10, 21], [30, 43]]}]}
//! ```
//!
//! `bins` are `[lo, hi)` along each axis of the view; `cells`, where it is there, names those of the box that are meant, as flat
//! indices in C order.

use super::StudyError;
use crate::input::read_bytes;
use crate::mhp::ErasedCells;
use crate::output::replace_file;
use crate::radar::View;
use serde::{Deserialize, Serialize};
use std::path::Path;

const FORMAT: &str = "mhp-erased";
const VERSION: u32 = 1;
const MOST_BYTES: u64 = 64 << 20;

#[derive(Serialize, Deserialize)]
struct ErasedFile {
    format: String,
    version: u32,
    regions: Vec<ErasedRegion>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ErasedRegion {
    view: String,
    bins: Vec<[usize; 2]>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    cells: Vec<usize>,
}

/// Reads the erased cells of a data set with these views.
///
/// # Errors
/// One line that names the file, the key and what was expected.
pub fn read_erased(path: &Path, views: &[View]) -> Result<Vec<ErasedCells>, StudyError> {
    let wrong = |reason: String| StudyError::Erased { reason, path: path.to_owned() };
    let bytes = read_bytes(path, "a file of erased cells", MOST_BYTES).map_err(|error| wrong(error.to_string()))?;
    let file: ErasedFile = serde_json::from_slice(&bytes).map_err(|error| wrong(error.to_string()))?;
    if file.format != FORMAT || file.version != VERSION {
        return Err(wrong(format!(
            "`format` and `version` are {:?} and {}; expected \"{FORMAT}\" and {VERSION}",
            file.format, file.version
        )));
    }
    let of = |(k, region): (usize, ErasedRegion)| {
        let key = |key: &str| format!("`regions[{k}].{key}`");
        let known: Vec<&str> = views.iter().map(|view| view.array.as_str()).collect();
        let view = known.iter().position(|array| *array == region.view).ok_or_else(|| {
            wrong(format!(
                "{}: {:?} is no map of the data set; expected {}",
                key("view"),
                region.view,
                known.join(", ")
            ))
        })?;
        let shape = views[view].shape();
        let fits = region.bins.len() == shape.len()
            && region.bins.iter().zip(&shape).all(|([lo, hi], &bins)| lo < hi && *hi <= bins);
        if !fits {
            return Err(wrong(format!("{}: {:?}; expected [lo, hi) within {shape:?}", key("bins"), region.bins)));
        }
        if region.cells.is_empty() {
            return Ok(ErasedCells { view, bins: region.bins, cells: Vec::new() });
        }
        if let Some(cell) = region.cells.iter().find(|&&cell| cell >= views[view].cells()) {
            return Err(wrong(format!("{}: {cell}; expected less than {}", key("cells"), views[view].cells())));
        }
        ErasedCells::of_cells((view, &views[view]), region.cells)
            .ok_or_else(|| wrong(format!("{}: empty", key("cells"))))
    };
    file.regions.into_iter().enumerate().map(of).collect()
}

/// Writes them, replacing an older file as a whole.
///
/// # Errors
/// Where the file cannot be written.
pub fn write_erased(path: &Path, views: &[View], erased: &[ErasedCells]) -> Result<(), StudyError> {
    let region = |cells: &ErasedCells| {
        let view = views.get(cells.view)?.array.clone();
        Some(ErasedRegion { view, bins: cells.bins.clone(), cells: cells.cells.clone() })
    };
    let file =
        ErasedFile { format: FORMAT.into(), version: VERSION, regions: erased.iter().filter_map(region).collect() };
    let failed = |reason: std::io::Error| StudyError::Write { reason, path: path.to_owned() };
    let text = serde_json::to_vec_pretty(&file).map_err(|error| failed(error.into()))?;
    replace_file(path, |out| out.write_all(&text)).map_err(failed)
}
