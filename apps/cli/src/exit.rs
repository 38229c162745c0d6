//! How the program ends.

use stylet_tissue::RunError;

/// Exit codes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(u8)]
pub enum Exit {
    /// All was done.
    Done = 0,
    /// An argument, a scene, a file or a folder cannot be used.
    BadInput = 2,
    /// The run cannot converge.
    NotConverged = 3,
    /// Ctrl-C, as shells report it: 128 + SIGINT.
    Interrupted = 130,
}

/// An end that needs a word: what standard error says, in one line, and the exit code.
#[derive(Debug)]
pub struct Failure {
    /// Names the file, the key or the flag, what was found and what was expected.
    pub line: String,
    /// The exit code.
    pub exit: Exit,
}

impl Failure {
    /// Something that was given cannot be used.
    pub fn bad_input(line: impl Into<String>) -> Self {
        Self { line: line.into(), exit: Exit::BadInput }
    }
}

impl From<RunError> for Failure {
    fn from(error: RunError) -> Self {
        let exit = if error.is_bad_input() { Exit::BadInput } else { Exit::NotConverged };
        Self { line: error.to_string(), exit }
    }
}
