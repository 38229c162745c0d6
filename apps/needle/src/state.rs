//! State files: a run cut in two gives the same bits as one in a piece.
//!
//! Layout: eight bytes that name the format and its version, a checksum of the rest (FNV-1a, 64 bit, little endian), and
//! the state in postcard encoding.

use crate::error::NeedleError;
use crate::insertion::InsertionState;
use crate::keys::TABLE;
use crate::scene::Scene;
use crate::summary::HistoryRow;
use serde::{Deserialize, Serialize};
use std::path::Path;
use stylet_scene::Value;

const MAGIC: &[u8; 8] = b"stylet\0\x01";
const HEADER: usize = 16;

/// A run that can be gone on with.
#[derive(Clone, Serialize, Deserialize)]
pub struct State {
    /// The scene.
    pub scene: Scene,
    /// What cannot be derived from it.
    pub experiment: Experiment,
    /// The history so far.
    pub rows: Vec<HistoryRow>,
    /// Frames written so far: step and file name.
    pub frames: Vec<(usize, String)>,
}

/// What a scene is doing.
#[derive(Clone, Serialize, Deserialize)]
pub enum Experiment {
    /// A static load: one solve, which is done afresh.
    Static,
    /// An insertion.
    Insertion(Box<InsertionState<2, 3>>),
}

impl State {
    /// The bytes of a state file.
    ///
    /// # Errors
    /// A sentence, should the encoding fail.
    pub fn to_bytes(&self) -> Result<Vec<u8>, String> {
        let body = postcard::to_stdvec(self).map_err(|e| e.to_string())?;
        let mut bytes = Vec::with_capacity(HEADER + body.len());
        bytes.extend_from_slice(MAGIC);
        bytes.extend_from_slice(&checksum(&body).to_le_bytes());
        bytes.extend_from_slice(&body);
        Ok(bytes)
    }

    /// The state in the bytes of a state file.
    ///
    /// # Errors
    /// What was found and what was expected.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, String> {
        if bytes.len() < HEADER || bytes[..6] != MAGIC[..6] {
            return Err("found something else, expected a state file of stylet".to_owned());
        }
        if bytes[..8] != MAGIC[..] {
            return Err(format!("found state format {}, expected {}", bytes[7], MAGIC[7]));
        }
        let (header, body) = bytes.split_at(HEADER);
        if header[8..] != checksum(body).to_le_bytes() {
            return Err("found a damaged or truncated state file: its checksum does not match".to_owned());
        }
        postcard::from_bytes(body).map_err(|e| format!("found a state that cannot be decoded: {e}"))
    }

    /// Checks that this is a state of `scene`; what it writes while it runs (`[output]`) may differ.
    ///
    /// # Errors
    /// The first key that differs, with what was found and what was expected.
    pub fn check_scene(&self, scene: &Scene) -> Result<(), String> {
        let shown = |value: &Option<Value>| value.as_ref().map_or("no value".to_owned(), |v| v.to_string());
        for key in TABLE.keys.iter().filter(|key| !key.path.starts_with("output.")) {
            let (found, expected) = ((key.get)(&self.scene), (key.get)(scene));
            if found != expected {
                let (found, expected) = (shown(&found), shown(&expected));
                return Err(format!("found the state of a scene with {} = {found}, expected {expected}", key.path));
            }
        }
        Ok(())
    }

    /// Writes a state file; a crash in between leaves the old one.
    ///
    /// # Errors
    /// [`NeedleError::Output`].
    pub fn write(&self, path: &Path) -> Result<(), NeedleError> {
        let fail = |reason: String| NeedleError::Output { path: path.display().to_string(), reason };
        let bytes = self.to_bytes().map_err(fail)?;
        crate::output::write_atomically(path, &bytes)
    }

    /// Reads a state file.
    ///
    /// # Errors
    /// [`NeedleError::State`].
    pub fn read(path: &Path) -> Result<Self, NeedleError> {
        let fail = |reason: String| NeedleError::State { path: path.display().to_string(), reason };
        let bytes = std::fs::read(path).map_err(|e| fail(e.to_string()))?;
        Self::from_bytes(&bytes).map_err(fail)
    }
}

fn checksum(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, &byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn damage_is_noticed() {
        let scene = Scene { name: "x".to_owned(), ..Scene::default() };
        let state = State { scene, experiment: Experiment::Static, rows: Vec::new(), frames: Vec::new() };
        let bytes = state.to_bytes().unwrap();
        assert_eq!(State::from_bytes(&bytes).unwrap().scene, state.scene);
        for cut in 0..bytes.len() {
            assert!(State::from_bytes(&bytes[..cut]).is_err());
        }
        for at in 0..bytes.len() {
            let mut damaged = bytes.clone();
            damaged[at] ^= 0x10;
            assert!(State::from_bytes(&damaged).is_err(), "byte {at}");
        }
    }
}
