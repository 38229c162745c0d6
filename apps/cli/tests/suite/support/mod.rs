//! Running the binary in a folder of its own.

// Each test file uses its part of this.
#![allow(dead_code)]

use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};

/// A folder that is removed when the test is over.
pub struct Folder(PathBuf);

impl Folder {
    pub fn new() -> Self {
        static COUNT: AtomicUsize = AtomicUsize::new(0);
        let name = format!("stylet-cli-{}-{}", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed));
        let path = std::env::temp_dir().join(name);
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    pub fn path(&self) -> &Path {
        &self.0
    }

    /// A file with this content.
    pub fn file(&self, name: &str, content: impl AsRef<[u8]>) -> String {
        let path = self.0.join(name);
        std::fs::write(&path, content).unwrap();
        path.display().to_string()
    }

    /// `stylet` with arguments separated by spaces, to be run in this folder.
    pub fn command(&self, arguments: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_stylet"));
        command.args(arguments.split_whitespace()).current_dir(&self.0).stdin(Stdio::null());
        command
    }

    pub fn run(&self, arguments: &str) -> Output {
        self.command(arguments).output().unwrap()
    }

    /// Runs, expects success, and returns what standard output says.
    pub fn succeed(&self, arguments: &str) -> String {
        let output = self.run(arguments);
        assert_eq!(output.status.code(), Some(0), "stylet {arguments}: {}", stderr(&output));
        String::from_utf8(output.stdout).unwrap()
    }

    pub fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.0.join(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    pub fn has(&self, name: &str) -> bool {
        self.0.join(name).exists()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

pub fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Expects exit code 2, nothing on standard output, and one line on standard error that says all of `parts`.
pub fn refuses(folder: &Folder, arguments: &str, parts: &[&str]) {
    expect_refusal(&folder.run(arguments), arguments, parts);
}

pub fn expect_refusal(output: &Output, arguments: &str, parts: &[&str]) {
    let line = stderr(output);
    assert_eq!(output.status.code(), Some(2), "stylet {arguments}: {line}");
    assert!(output.stdout.is_empty(), "stylet {arguments} printed {}", String::from_utf8_lossy(&output.stdout));
    assert!(line.ends_with('\n') && line.lines().count() == 1, "stylet {arguments}: not one line:\n{line}");
    for part in parts {
        assert!(line.contains(part), "stylet {arguments}: no `{part}` in: {line}");
    }
}

pub fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|e| panic!("{e} in {text}"))
}

/// A history file as its head and its rows.
pub fn table(text: &str) -> (Vec<String>, Vec<Vec<String>>) {
    let cells = |line: &str| line.split(',').map(str::to_owned).collect::<Vec<String>>();
    let mut lines = text.lines();
    let head = cells(lines.next().expect("a head"));
    let rows: Vec<_> = lines.map(cells).collect();
    assert!(rows.iter().all(|row| row.len() == head.len()), "ragged rows");
    (head, rows)
}

/// The rows of a history without the seconds of stages, which no two runs share.
pub fn without_seconds(text: &str) -> Vec<Vec<String>> {
    let (head, rows) = table(text);
    let timed = |column: usize| head[column].ends_with("_s") && head[column] != "time_s";
    let keep =
        |row: Vec<String>| row.into_iter().enumerate().filter(|(k, _)| !timed(*k)).map(|(_, cell)| cell).collect();
    rows.into_iter().map(keep).collect()
}
