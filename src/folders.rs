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

/// A path as text; one that is no UTF-8, as Unix allows, as `{ bytes = [..] }`.
pub(crate) mod portable_path {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};
    use std::path::{Path, PathBuf};

    #[derive(Serialize, Deserialize)]
    #[serde(untagged)]
    enum Written {
        Text(String),
        Bytes { bytes: Vec<u8> },
    }

    pub(crate) fn serialize<S: Serializer>(path: &Path, out: S) -> Result<S::Ok, S::Error> {
        match path.to_str() {
            Some(text) => out.serialize_str(text),
            None => Written::Bytes { bytes: path.as_os_str().as_encoded_bytes().to_vec() }.serialize(out),
        }
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<PathBuf, D::Error> {
        Ok(match Written::deserialize(from)? {
            Written::Text(text) => text.into(),
            Written::Bytes { bytes } => of_bytes(bytes),
        })
    }

    #[cfg(unix)]
    fn of_bytes(bytes: Vec<u8>) -> PathBuf {
        use std::os::unix::ffi::OsStringExt as _;
        std::ffi::OsString::from_vec(bytes).into()
    }

    /// Such a path is of another machine: what of it is text tells a person where the data lay.
    #[cfg(not(unix))]
    fn of_bytes(bytes: Vec<u8>) -> PathBuf {
        String::from_utf8_lossy(&bytes).into_owned().into()
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use serde::{Deserialize, Serialize};

    #[test]
    fn a_path_that_is_no_text_reads_back() {
        use std::os::unix::ffi::OsStrExt as _;
        #[derive(Serialize, Deserialize, PartialEq, Debug)]
        struct Held {
            #[serde(with = "portable_path")]
            root: PathBuf,
        }
        for bytes in [&b"/data/walk"[..], &b"/data/\xff\xfe walk"[..]] {
            let held = Held { root: std::ffi::OsStr::from_bytes(bytes).into() };
            let text = toml::to_string(&held).unwrap_or_default();
            assert_eq!(toml::from_str::<Held>(&text).ok().as_ref(), Some(&held), "{text}");
            let text = serde_json::to_string(&held).unwrap_or_default();
            assert_eq!(serde_json::from_str::<Held>(&text).ok().as_ref(), Some(&held), "{text}");
        }
    }
}
