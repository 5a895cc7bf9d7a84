//! Where the bundled sample is: beside the program, in the working folder, or in the source tree it was built from.

use super::MANIFEST_NAME;
use std::path::{Path, PathBuf};

/// The bundled data set's folder, relative to the project.
const SAMPLE: &str = "samples/walk";

/// The folder of the bundled sample, or `None` where the program was installed without it.
pub fn bundled_sample() -> Option<PathBuf> {
    let beside = std::env::current_exe().ok();
    let beside = beside.iter().flat_map(|program| program.ancestors().skip(1)).map(Path::to_path_buf);
    let here = std::env::current_dir().ok();
    let built = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    here.into_iter()
        .chain(beside)
        .chain([built])
        .map(|root| root.join(SAMPLE))
        .find(|path| path.join(MANIFEST_NAME).is_file())
}
