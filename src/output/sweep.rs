//! Temporary files of processes that were killed: removed by the next one that writes into their folder.

use std::collections::HashSet;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Folders that were swept by this process.
static SWEPT: Mutex<Option<HashSet<PathBuf>>> = Mutex::new(None);

/// Removes what is left of killed processes in `folder`, the first time that this process writes there.
pub(super) fn sweep_once(folder: &Path) {
    let whole = std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned());
    let first = SWEPT.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert_default().insert(whole);
    if first {
        sweep(folder);
    }
}

fn sweep(folder: &Path) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let process = name.to_str().and_then(process_of);
        // A named pipe is not even opened.
        let is_file = entry.file_type().is_ok_and(|kind| kind.is_file());
        if is_file && process.is_some_and(|pid| is_gone(pid, &entry.path())) {
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

/// The process of `.NAME.PID.tmp`.
fn process_of(name: &str) -> Option<u32> {
    let (name, pid) = name.strip_prefix('.')?.strip_suffix(".tmp")?.rsplit_once('.')?;
    let digits = !pid.starts_with('0') && pid.bytes().all(|byte| byte.is_ascii_digit());
    pid.parse().ok().filter(|_| digits && !name.is_empty())
}

/// True where nobody holds the file, on this machine or another, and no process has the id here.
fn is_gone(pid: u32, file: &Path) -> bool {
    let processes = Path::new("/proc");
    let lives = processes.join("self").exists() && processes.join(pid.to_string()).exists();
    !lives && File::open(file).is_ok_and(|file| file.try_lock().is_ok())
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests")]
    use super::*;

    #[test]
    fn only_our_own_names_of_processes_that_are_gone_are_removed() {
        assert_eq!(process_of(".summary.csv.4711.tmp"), Some(4711));
        for other in
            ["summary.csv.4711.tmp", ".4711.tmp", ".a.tmp", ".a.0x1.tmp", ".a.+1.tmp", ".a.1.tmp.gz", ".a.01.tmp"]
        {
            assert_eq!(process_of(other), None, "{other}");
        }
        let folder = tempfile::tempdir().unwrap();
        let (gone, held) = (u32::MAX - 1, u32::MAX - 2);
        let file = |name: String| folder.path().join(name);
        let (left, used) = (file(format!(".a.npz.{gone}.tmp")), file(format!(".b.npz.{held}.tmp")));
        let (own, foreign) = (file(format!(".c.npz.{}.tmp", std::process::id())), file(".notes.tmp".into()));
        for path in [&left, &used, &own, &foreign] {
            std::fs::write(path, "half").unwrap();
        }
        #[cfg(unix)]
        let pipe = folder.path().join(format!(".d.npz.{gone}.tmp"));
        #[cfg(unix)]
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success(), "never waited for");
        let holder = File::open(&used).unwrap();
        holder.lock().unwrap();
        sweep(folder.path());
        assert_eq!([&left, &used, &own, &foreign].map(|path| path.exists()), [false, true, true, true]);
    }
}
