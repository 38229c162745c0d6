//! What the writers of both versions share: numbers as text or as bytes, and the entities that regions stand for.

use crate::io::{MeshData, number::Real};
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// The content of a file in the making.
pub(super) struct Out {
    pub bytes: Vec<u8>,
    pub is_binary: bool,
    /// Whether a number stands before, in text.
    is_inside: bool,
}

impl Out {
    /// A file with its header.
    pub fn new(version: &str, is_binary: bool) -> Self {
        let mut out = Self { bytes: Vec::new(), is_binary, is_inside: false };
        out.text(&format!("$MeshFormat\n{version} {} 8\n", u8::from(is_binary)));
        if is_binary {
            out.bytes.extend(1_i32.to_le_bytes());
            out.text("\n");
        }
        out.text("$EndMeshFormat\n");
        out
    }

    /// Text, which is text in binary files as well.
    pub fn text(&mut self, text: &str) {
        self.bytes.extend_from_slice(text.as_bytes());
    }

    pub fn int(&mut self, value: i32) {
        if self.is_binary {
            self.bytes.extend(value.to_le_bytes());
        } else {
            self.word(value);
        }
    }

    pub fn size(&mut self, value: usize) {
        if self.is_binary {
            self.bytes.extend((value as u64).to_le_bytes());
        } else {
            self.word(value);
        }
    }

    pub fn real(&mut self, value: f64) {
        if self.is_binary {
            self.bytes.extend(value.to_le_bytes());
        } else {
            self.word(Real(value));
        }
    }

    fn word(&mut self, value: impl std::fmt::Display) {
        let mut word = String::new();
        // Writing to a string does not fail.
        let _ = write!(word, "{}{value}", if self.is_inside { " " } else { "" });
        self.text(&word);
        self.is_inside = true;
    }

    /// The end of a line of numbers; nothing in binary.
    pub fn end_line(&mut self) {
        if !self.is_binary {
            self.text("\n");
            self.is_inside = false;
        }
    }

    /// The end of a section.
    pub fn end(&mut self, section: &str) {
        if self.is_binary {
            self.text("\n");
        }
        self.text(&format!("$End{section}\n"));
    }
}

/// Gmsh's elements belong to numbered entities, of which ours are the regions of cells of each size: for vertices per cell
/// and region the number, from 1.
pub(super) fn entities(data: &MeshData) -> BTreeMap<(usize, i32), i32> {
    let mut entities: BTreeMap<(usize, i32), i32> = data.cells().map(|(v, region)| ((v.len(), region), 0)).collect();
    let mut next = [1; 5];
    for (&(size, _), number) in &mut entities {
        *number = next[size];
        next[size] += 1;
    }
    entities
}

/// Gmsh takes a negative physical group for the positive one with its elements turned over.
pub(super) fn note_negative(entities: &BTreeMap<(usize, i32), i32>, notes: &mut Vec<String>) {
    let negative = entities.keys().filter(|key| key.1 < 0);
    notes.extend(negative.map(|(size, region)| {
        format!("that region {region} of cells with {size} vertices is not region {}, turned over", -i64::from(*region))
    }));
}

/// Refuses more points or cells than Gmsh's `int` counts.
pub(super) fn check_counts(data: &MeshData) -> Result<(), String> {
    let (points, cells) = (data.points.len(), data.n_cells());
    match i32::try_from(points.max(cells)) {
        Ok(_) => Ok(()),
        Err(_) => Err(format!("{points} points and {cells} cells: it counts with 31 bits")),
    }
}
