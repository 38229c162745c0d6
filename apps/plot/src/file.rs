//! Writing a file all at once or not at all.

use std::fs;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use crate::PlotError;

/// Writes `text` to a temporary file in the same folder, then renames it: a reader sees the old file or the new one,
/// and an interrupted run leaves no half picture.
pub(crate) fn write_atomic(path: &Path, text: &str) -> Result<(), PlotError> {
    let failed = |error| PlotError::Write { path: path.to_owned(), error };
    let temporary = temporary_beside(path).map_err(failed)?;
    let written = write_synced(&temporary, text).and_then(|()| fs::rename(&temporary, path));
    written.map_err(|error| {
        // The first error is the one to report; the temporary file may not exist.
        let _ = fs::remove_file(&temporary);
        failed(error)
    })
}

/// A name that no other writer, of this process or another one, has.
fn temporary_beside(path: &Path) -> io::Result<PathBuf> {
    let name = path.file_name().ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "not a file name"))?;
    let mut hidden = std::ffi::OsString::from(".");
    hidden.push(name);
    static WRITERS: AtomicU64 = AtomicU64::new(0);
    hidden.push(format!(".{}-{}.tmp", std::process::id(), WRITERS.fetch_add(1, Ordering::Relaxed)));
    Ok(path.with_file_name(hidden))
}

fn write_synced(path: &Path, text: &str) -> io::Result<()> {
    let mut file = fs::File::create(path)?;
    file.write_all(text.as_bytes())?;
    file.sync_all()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("stylet-plot-{name}-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        folder
    }

    #[test]
    fn a_file_is_replaced_and_nothing_else_is_left() {
        let folder = folder("replace");
        let path = folder.join("a.svg");
        write_atomic(&path, "old").unwrap();
        write_atomic(&path, "new").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "new");
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn errors_name_the_path_and_leave_no_temporary_file() {
        let folder = folder("errors");
        let missing = folder.join("no/such/folder/a.svg");
        assert!(write_atomic(&missing, "x").unwrap_err().to_string().contains("no/such/folder/a.svg"));
        // A folder stands in the way of the rename.
        fs::create_dir(folder.join("b.svg")).unwrap();
        assert!(write_atomic(&folder.join("b.svg"), "x").unwrap_err().to_string().contains("b.svg"));
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);
        assert!(write_atomic(Path::new(".."), "x").is_err());
        fs::remove_dir_all(folder).unwrap();
    }
}
