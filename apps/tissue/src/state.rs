//! State files: a run cut in two gives the same bits as one in a piece.
//!
//! Layout: eight bytes that name the format and its version, a checksum of the rest (FNV-1a, 64 bit, little endian), and a
//! [`State`] in postcard encoding.

use crate::error::RunError;
use crate::history::HistoryRow;
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use std::path::Path;
use stylet_scene::{Table, Value};

const MAGIC: &[u8; 8] = b"stylet\0\x06";
const HEADER: usize = 16;

/// What an application saves of a run: its scene and what cannot be derived from that, in an encoding of its own.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Saved {
    /// Which application.
    pub app: String,
    /// Its bytes.
    pub payload: Vec<u8>,
}

impl Saved {
    /// Encodes the state of an application.
    ///
    /// # Errors
    /// A sentence, should the encoding fail.
    pub fn new(app: &str, state: &impl Serialize) -> Result<Self, String> {
        Ok(Self { app: app.to_owned(), payload: postcard::to_stdvec(state).map_err(|e| e.to_string())? })
    }

    /// Decodes the state of the application `app`.
    ///
    /// # Errors
    /// What was found and what was expected.
    pub fn decode<T: DeserializeOwned>(&self, app: &str) -> Result<T, String> {
        if self.app != app {
            return Err(format!("found the state of a {} scene, expected that of a {app} scene", self.app));
        }
        postcard::from_bytes(&self.payload).map_err(|e| format!("found a state that cannot be decoded: {e}"))
    }
}

/// A run that can be gone on with.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct State {
    /// What the application needs.
    pub saved: Saved,
    /// The history so far.
    pub rows: Vec<HistoryRow>,
    /// Frames written so far: step and the time it is listed at.
    pub frames: Vec<(usize, f64)>,
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

    /// Writes a state file; a crash in between leaves the old one.
    ///
    /// # Errors
    /// [`RunError::Output`].
    pub fn write(&self, path: &Path) -> Result<(), RunError> {
        let fail = |reason: String| RunError::Output { path: path.display().to_string(), reason };
        let bytes = self.to_bytes().map_err(fail)?;
        crate::output::write_atomically(path, &bytes)
    }

    /// Reads a state file.
    ///
    /// # Errors
    /// [`RunError::State`].
    pub fn read(path: &Path) -> Result<Self, RunError> {
        let fail = |reason: String| RunError::State { path: path.display().to_string(), reason };
        let bytes = std::fs::read(path).map_err(|e| fail(e.to_string()))?;
        Self::from_bytes(&bytes).map_err(fail)
    }
}

/// Checks that `found`, from a state, is the scene that is asked for; what it writes while it runs (`[output]`) may differ.
///
/// # Errors
/// The first key that differs, with what was found and what was expected.
pub fn check_same_scene<S>(table: &Table<S>, found: &S, expected: &S) -> Result<(), String> {
    let shown = |value: &Option<Value>| value.as_ref().map_or("no value".to_owned(), |v| v.to_string());
    for key in table.keys.iter().filter(|key| !key.path.starts_with("output.")) {
        let (found, expected) = ((key.get)(found), (key.get)(expected));
        if found != expected {
            let (found, expected) = (shown(&found), shown(&expected));
            return Err(format!("found the state of a scene with {} = {found}, expected {expected}", key.path));
        }
    }
    Ok(())
}

fn checksum(bytes: &[u8]) -> u64 {
    Checksum::default().and(bytes.iter().copied()).value()
}

/// FNV-1a, 64 bit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Checksum(u64);

impl Default for Checksum {
    fn default() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }
}

impl Checksum {
    /// Of more bytes.
    #[must_use]
    pub fn and(self, bytes: impl IntoIterator<Item = u8>) -> Self {
        let step = |hash: u64, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        Self(bytes.into_iter().fold(self.0, step))
    }

    /// The number.
    pub fn value(self) -> u64 {
        self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn damage_is_noticed() {
        let saved = Saved::new("sample", &("x", 1.5)).unwrap();
        let state = State { saved, rows: vec![HistoryRow::default()], frames: vec![(1, 0.5)] };
        let bytes = state.to_bytes().unwrap();
        assert_eq!(State::from_bytes(&bytes).unwrap(), state);
        for cut in 0..bytes.len() {
            assert!(State::from_bytes(&bytes[..cut]).is_err());
        }
        for at in 0..bytes.len() {
            let mut damaged = bytes.clone();
            damaged[at] ^= 0x10;
            assert!(State::from_bytes(&damaged).is_err(), "byte {at}");
        }
    }

    #[test]
    fn a_state_of_another_application_is_refused() {
        let saved = Saved::new("needle", &7_u32).unwrap();
        assert_eq!(saved.decode::<u32>("needle"), Ok(7));
        assert!(saved.decode::<u32>("body").unwrap_err().contains("expected that of a body scene"));
    }
}
