//! Opening what others made: regular files only, and never more of them in memory than stated.
//!
//! A named pipe in a data set makes whoever opens it wait for ever, a device never ends, and a text of gigabytes takes the memory of
//! everything else. All files that a data set, an annotator or a user hands over are opened here; the caller's error adds the path.

use std::fs::{File, FileType};
use std::io::{self, Read as _};
use std::path::Path;

/// Bytes of a manifest or a configuration that are read.
pub const MOST_TEXT: u64 = 4 << 20;

/// Where in a file something is, as errors name it: its path, and the line where one is known.
pub fn place(path: &Path, line: Option<usize>) -> String {
    line.map_or_else(|| path.display().to_string(), |line| format!("{}:{line}", path.display()))
}

/// Opens a regular file, or a link to one; `expected` is what it should have been, for the message.
///
/// # Errors
/// Where it is not there, cannot be opened, or is a folder, a named pipe, a socket or a device.
pub fn open_file(path: &Path, expected: &str) -> io::Result<File> {
    let kind = std::fs::metadata(path)?.file_type();
    if !kind.is_file() {
        return Err(io::Error::other(format!("it is a {}; expected {expected}", kind_words(kind))));
    }
    File::open(path)
}

/// The bytes of a regular file that has at most `most` of them.
///
/// # Errors
/// As [`open_file`], and where it is larger.
pub fn read_bytes(path: &Path, expected: &str, most: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    open_file(path, expected)?.take(most.saturating_add(1)).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most {
        return Err(io::Error::other(format!("it has more than {most} bytes; expected {expected}")));
    }
    Ok(bytes)
}

/// As [`read_bytes`], of UTF-8.
///
/// # Errors
/// As [`read_bytes`], and where it is not UTF-8.
pub fn read_text(path: &Path, expected: &str, most: u64) -> io::Result<String> {
    let bytes = read_bytes(path, expected, most)?;
    String::from_utf8(bytes).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        io::Error::new(io::ErrorKind::InvalidData, format!("byte {at} is not UTF-8; expected {expected}"))
    })
}

/// What something that is no regular file is called.
fn kind_words(kind: FileType) -> &'static str {
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt as _;
        if kind.is_fifo() {
            return "named pipe";
        } else if kind.is_socket() {
            return "socket";
        } else if kind.is_char_device() || kind.is_block_device() {
            return "device";
        }
    }
    if kind.is_dir() { "folder" } else { "special file" }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refusal<T>(result: io::Result<T>) -> String {
        result.err().map_or_else(|| "accepted".into(), |error| error.to_string())
    }

    #[test]
    fn only_regular_files_of_the_stated_size_are_read() {
        let Ok(home) = tempfile::tempdir() else { unreachable!("a folder for a test") };
        let file = home.path().join("f");
        assert!(std::fs::write(&file, b"12345").is_ok());
        assert_eq!(read_bytes(&file, "five bytes", 5).ok(), Some(b"12345".to_vec()));
        assert_eq!(refusal(read_bytes(&file, "four bytes", 4)), "it has more than 4 bytes; expected four bytes");
        assert_eq!(refusal(open_file(home.path(), "a file")), "it is a folder; expected a file");
        assert!(std::fs::write(&file, b"ab\xff").is_ok());
        assert_eq!(refusal(read_text(&file, "a text", 9)), "byte 2 is not UTF-8; expected a text");
        assert!(open_file(&home.path().join("none"), "a file").is_err_and(|e| e.kind() == io::ErrorKind::NotFound));
    }

    #[cfg(unix)]
    #[test]
    fn a_device_is_refused_and_a_link_is_followed() {
        assert_eq!(refusal(open_file(Path::new("/dev/zero"), "a file")), "it is a device; expected a file");
        let Ok(home) = tempfile::tempdir() else { unreachable!("a folder for a test") };
        let (file, link) = (home.path().join("f"), home.path().join("l"));
        assert!(std::fs::write(&file, b"x").is_ok() && std::os::unix::fs::symlink(&file, &link).is_ok());
        assert!(open_file(&link, "a file").is_ok());
    }
}
