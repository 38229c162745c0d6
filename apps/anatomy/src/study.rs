//! The organs of a file, and reading by what the file is.

use crate::{
    error::{Problem, ReadError, StudyError},
    json, rt,
};
use std::{fs, io::Read, path::Path};
use stylet_mesh::generate::contours::{ContourError, ContourSet, ContourSettings, Drawing, Repair};

/// Files beyond this are refused: a structure set of a hundred organs has some ten megabytes, and reading takes up to thirty
/// times the file's size.
const LARGEST: u64 = 64 << 20;

/// What a file holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Study {
    /// Its organs, in the file's order: the first has precedence where two overlap.
    pub drawings: Vec<Drawing>,
    /// What was left out of it, each with its reason.
    pub notes: Vec<String>,
}

impl Study {
    /// The organs of these names only, in this order of precedence.
    ///
    /// # Errors
    /// [`StudyError`] for a name that no organ has, or several have.
    pub fn select(&self, names: &[&str]) -> Result<Self, StudyError> {
        let pick = |name: &&str| {
            let mut found = self.drawings.iter().filter(|drawing| drawing.name == *name);
            match (found.next(), found.count()) {
                (Some(drawing), 0) => Ok(drawing.clone()),
                (Some(_), more) => Err(StudyError::Ambiguous { name: (*name).into(), count: more + 1 }),
                (None, _) => {
                    let has = self.drawings.iter().map(|drawing| drawing.name.clone()).collect();
                    Err(StudyError::Unknown { name: (*name).into(), has })
                }
            }
        };
        Ok(Self { drawings: names.iter().map(pick).collect::<Result<_, _>>()?, notes: self.notes.clone() })
    }

    /// The organs, checked, and what was repaired.
    ///
    /// # Errors
    /// As [`ContourSet::new`].
    pub fn check(&self, settings: &ContourSettings) -> Result<(ContourSet, Vec<Repair>), ContourError> {
        ContourSet::new(&self.drawings, settings)
    }
}

/// Reads a DICOM RT structure set or contours as JSON, whichever the file is by its first bytes.
///
/// # Errors
/// [`ReadError`], which names the file, what was found in it and what was expected.
pub fn read(path: &Path) -> Result<Study, ReadError> {
    let bytes = load(path).map_err(|source| ReadError::System { path: path.into(), source })?;
    let problem = |problem| ReadError::File { path: path.into(), problem: Box::new(problem) };
    if bytes.len() as u64 > LARGEST {
        let found = fs::metadata(path).map_or(bytes.len() as u64, |m| m.len());
        return Err(problem(Problem::TooLarge { found, limit: LARGEST }));
    }
    read_bytes(&bytes).map_err(problem)
}

/// The file, or a little more than the most that is read of it.
fn load(path: &Path) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    fs::File::open(path)?.take(LARGEST + 1).read_to_end(&mut bytes)?;
    Ok(bytes)
}

fn read_bytes(bytes: &[u8]) -> Result<Study, Problem> {
    if rt::is_dicom(bytes) {
        return rt::read(bytes);
    }
    match bytes.trim_ascii_start().first() {
        Some(b'{') => json::read(bytes),
        _ => {
            let shown = bytes[..bytes.len().min(16)].escape_ascii().to_string();
            Err(Problem::Unknown { found: if shown.is_empty() { "nothing".into() } else { format!("\"{shown}\"") } })
        }
    }
}
