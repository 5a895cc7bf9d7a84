//! Where the program keeps what is the user's: settings and labels in the data folder, what can be made again in the
//! cache folder.

use std::path::PathBuf;

/// Names a folder that replaces both, for tests and for machines without a home.
pub const HOME_VARIABLE: &str = "MHP_INSPECTOR_HOME";

fn named() -> Option<PathBuf> {
    std::env::var_os(HOME_VARIABLE).filter(|home| !home.is_empty()).map(PathBuf::from)
}

fn platform() -> Option<directories::ProjectDirs> {
    directories::ProjectDirs::from("", "", "mhp-inspector")
}

/// The user's data folder: `$MHP_INSPECTOR_HOME`, else the platform's. `None` where there is no home.
pub fn user_data() -> Option<PathBuf> {
    named().or_else(|| platform().map(|dirs| dirs.data_dir().to_owned()))
}

/// What can be made again: `$MHP_INSPECTOR_HOME/cache`, else the platform's cache folder. `None` where there is no home.
pub fn user_cache() -> Option<PathBuf> {
    named().map(|home| home.join("cache")).or_else(|| platform().map(|dirs| dirs.cache_dir().to_owned()))
}

/// What the operating system calls the user; `annotator` where it does not say.
pub fn user_name() -> String {
    let named = ["USER", "LOGNAME", "USERNAME"].into_iter().filter_map(|name| std::env::var(name).ok());
    named.map(|name| name.trim().to_owned()).find(|name| !name.is_empty()).unwrap_or_else(|| "annotator".into())
}
