//! ParaView collections: which file shows which time.

use super::{IoError, atomic};
use std::path::Path;

/// The frames of an animation, for a `.pvd` file.
#[derive(Clone, Default, PartialEq, Debug)]
pub struct Collection {
    frames: Vec<(f64, String)>,
}

impl Collection {
    /// Adds a file, named relative to the folder of the collection, that shows time `time` (s, or whatever orders the
    /// frames).
    pub fn push(&mut self, time: f64, file: impl Into<String>) {
        self.frames.push((time, file.into()));
    }

    /// Number of frames.
    pub fn len(&self) -> usize {
        self.frames.len()
    }

    /// Whether there are no frames.
    pub fn is_empty(&self) -> bool {
        self.frames.is_empty()
    }

    /// Writes the collection whole; it can be written again after each frame, so that a running scene can be watched.
    ///
    /// # Errors
    /// [`IoError::Time`] for a time that is not finite, [`IoError::System`].
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), IoError> {
        let path = path.as_ref();
        if let Some((time, file)) = self.frames.iter().find(|(time, _)| !time.is_finite()) {
            return Err(IoError::Time { path: path.to_path_buf(), file: file.clone(), time: *time });
        }
        atomic::write(path, self.to_xml().as_bytes())
    }

    fn to_xml(&self) -> String {
        let mut xml = String::from(
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" byte_order=\"LittleEndian\">\n  \
             <Collection>\n",
        );
        for (time, file) in &self.frames {
            // The shortest form that reads back as the same number.
            let file = escape(file);
            xml.push_str(&format!("    <DataSet timestep=\"{time:?}\" part=\"0\" file=\"{file}\"/>\n"));
        }
        xml.push_str("  </Collection>\n</VTKFile>\n");
        xml
    }
}

/// Text within an XML attribute.
fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            c => escaped.push(c),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_escaped_and_times_are_exact() {
        let mut collection = Collection::default();
        collection.push(0.1 + 0.2, "a&\"b\".vtu");
        let xml = collection.to_xml();
        assert!(xml.contains("timestep=\"0.30000000000000004\""));
        assert!(xml.contains("file=\"a&amp;&quot;b&quot;.vtu\""));
    }
}
