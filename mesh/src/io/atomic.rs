//! Files that are either whole or not there.

use super::IoError;
use std::{
    ffi::OsString,
    fs::{self, File},
    io::{self, Write},
    path::{Path, PathBuf},
};

/// Writes `bytes` to a new file beside `path`, and gives it that name once it is on the disk: after a crash `path` holds
/// what it held before, or all of `bytes`.
pub(super) fn write(path: &Path, bytes: &[u8]) -> Result<(), IoError> {
    let temporary = beside(path).map_err(|source| IoError::system(path, source))?;
    let written = write_through(&temporary, bytes).and_then(|()| fs::rename(&temporary, path));
    written.map_err(|source| {
        // The first error is the one to report.
        let _ = fs::remove_file(&temporary);
        IoError::system(path, source)
    })
}

/// A name in the same folder, hence on the same file system, that no other process uses.
fn beside(path: &Path) -> io::Result<PathBuf> {
    let name = path.file_name().ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "not a file name"))?;
    let mut temporary = OsString::from(".");
    temporary.push(name);
    temporary.push(format!(".{}.part", std::process::id()));
    Ok(path.with_file_name(temporary))
}

fn write_through(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut file = File::create(path)?;
    file.write_all(bytes)?;
    file.sync_all()
}
