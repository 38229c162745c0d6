//! Reading the text of a scene file.

use std::fs::File;
use std::io::Read as _;
use std::path::Path;

use crate::error::{NAME_LIMIT, Place, Problem, SceneError, one_line};

/// Largest scene file that [`load`] takes, in bytes.
pub const MAX_BYTES: u64 = 16 << 20;

/// The text of a scene file.
///
/// # Errors
/// One line that names the file if it does not exist, is a folder, cannot be read, is empty, is larger than
/// [`MAX_BYTES`], or is not UTF-8 text.
pub fn load(path: impl AsRef<Path>) -> Result<String, SceneError> {
    let path = path.as_ref();
    read(path).map_err(|(problem, line)| {
        let name = one_line(&path.to_string_lossy(), NAME_LIMIT);
        let place = match line {
            Some(line) => Place::Line(name, line),
            None => Place::File(name),
        };
        SceneError { place, problem: Problem::File(problem) }
    })
}

/// The text, or a sentence about what is wrong and the line it is wrong at.
fn read(path: &Path) -> Result<String, (String, Option<usize>)> {
    let io = |error: std::io::Error| match error.kind() {
        std::io::ErrorKind::NotFound => ("no such file, expected a scene in TOML".into(), None),
        _ => (one_line(&format!("cannot be read: {error}"), NAME_LIMIT), None),
    };
    let file = File::open(path).map_err(io)?;
    if file.metadata().map_err(io)?.is_dir() {
        return Err(("is a folder, expected a scene file in TOML".into(), None));
    }
    // A device or pipe has no length to ask for: read one byte beyond the limit instead.
    let mut bytes = Vec::new();
    file.take(MAX_BYTES + 1).read_to_end(&mut bytes).map_err(io)?;
    if bytes.len() as u64 > MAX_BYTES {
        return Err((format!("found more than {MAX_BYTES} bytes, expected a scene file of at most that"), None));
    }
    let text = String::from_utf8(bytes).map_err(|error| {
        let start = error.utf8_error().valid_up_to();
        let byte = error.as_bytes()[start];
        (format!("found byte 0x{byte:02x}, expected UTF-8 text"), Some(line_at(error.as_bytes(), start)))
    })?;
    if let Some(start) = text.find('\0') {
        return Err(("found byte 0x00, expected text".into(), Some(line_at(text.as_bytes(), start))));
    }
    if text.trim().is_empty() {
        return Err(("is empty, expected a scene in TOML".into(), None));
    }
    Ok(text)
}

fn line_at(bytes: &[u8], start: usize) -> usize {
    1 + bytes[..start].iter().filter(|&&byte| byte == b'\n').count()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(path: &Path) -> String {
        load(path).unwrap_err().to_string()
    }

    #[test]
    fn bad_files_are_named_with_what_is_wrong() {
        let folder = std::env::temp_dir().join(format!("stylet-scene-load-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let write = |name: &str, bytes: &[u8]| {
            let path = folder.join(name);
            std::fs::write(&path, bytes).unwrap();
            path
        };
        let good = write("good.toml", b"[mesh]\n");
        assert_eq!(load(&good).unwrap(), "[mesh]\n");
        assert!(message(&good.join("below")).contains("below: cannot be read: "));
        for (path, end) in [
            (folder.join("none.toml"), "none.toml: no such file, expected a scene in TOML"),
            (write("empty.toml", b" \n\t"), "empty.toml: is empty, expected a scene in TOML"),
            (write("latin.toml", b"a = 1\n# \xe9"), "latin.toml:2: found byte 0xe9, expected UTF-8 text"),
            (write("zero.toml", b"\n\n\0"), "zero.toml:3: found byte 0x00, expected text"),
        ] {
            assert!(message(&path).ends_with(end), "{}", message(&path));
        }
        assert!(message(&folder).ends_with(": is a folder, expected a scene file in TOML"));
        let large = write("large.toml", &vec![b'#'; MAX_BYTES as usize + 1]);
        assert!(message(&large).contains("found more than 16777216 bytes"));
        std::fs::write(&large, vec![b'#'; MAX_BYTES as usize]).unwrap();
        assert!(load(&large).is_ok());
        std::fs::remove_dir_all(folder).unwrap();
    }
}
