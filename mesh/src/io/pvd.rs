//! ParaView collections: which file shows which time.

use super::{IoError, Problem, ReadError, atomic, cursor::parse, read, vtk::xml};
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

    /// The frames in order: times, and files named relative to the folder of the collection.
    pub fn frames(&self) -> &[(f64, String)] {
        &self.frames
    }

    /// Reads a collection. Frames keep the order of the file; a frame of several parts is several frames of one time.
    /// Whether the files exist is not asked.
    ///
    /// # Errors
    /// [`ReadError`] with the file, the line, what was found and what was expected.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, ReadError> {
        let path = path.as_ref();
        read::load(path).and_then(|bytes| Self::from_bytes(&bytes)).map_err(|error| error.in_file(path))
    }

    /// Reads a collection from the content of a file.
    ///
    /// # Errors
    /// As [`read`](Self::read), without a file name.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, ReadError> {
        let text = String::from_utf8_lossy(bytes);
        let document = xml::parse(&text)?;
        let root = xml::root(&document, "Collection")?;
        let mut frames = Vec::new();
        for node in xml::children(xml::child(root, "Collection")?, "DataSet") {
            let file = xml::attribute(node, "file")?.to_owned();
            // ParaView takes a frame without a time for one at time 0.
            let time = node.attribute("timestep").unwrap_or("0");
            let expected = "a finite time";
            let time = parse::<f64>(time.trim().as_bytes()).filter(|time| time.is_finite());
            let found = || format!("{:?}", node.attribute("timestep").unwrap_or_default());
            let problem = || Problem::Syntax { expected: expected.into(), found: found() };
            frames.push((time.ok_or_else(|| xml::error(node, problem()))?, file));
        }
        Ok(Self { frames })
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
            let file = xml::escape(file);
            xml.push_str(&format!("    <DataSet timestep=\"{time:?}\" part=\"0\" file=\"{file}\"/>\n"));
        }
        xml.push_str("  </Collection>\n</VTKFile>\n");
        xml
    }
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
        assert_eq!(Collection::from_bytes(xml.as_bytes()).unwrap(), collection);
    }

    #[test]
    fn what_is_no_collection_is_refused_with_its_line() {
        let collection =
            |frames: &str| format!("<VTKFile type=\"Collection\">\n<Collection>\n{frames}</Collection></VTKFile>");
        let error = |text: &str| Collection::from_bytes(text.as_bytes()).unwrap_err().to_string();
        assert!(error("").contains("empty"), "{}", error(""));
        assert!(error("<VTKFile type=\"UnstructuredGrid\"/>").contains("\"Collection\""));
        assert!(
            error(&collection("<DataSet timestep=\"nan\" file=\"a\"/>")).starts_with("line 3: expected a finite time")
        );
        assert!(error(&collection("<DataSet timestep=\"1\"/>")).starts_with("line 3: attribute file"));
        assert!(error(&collection("<DataSet>")).starts_with("line 3"));
        let parts = collection(
            "<DataSet timestep=\"1\" part=\"0\" file=\"a\"/><DataSet timestep=\"1\" part=\"1\" file=\"b\"/>",
        );
        assert_eq!(Collection::from_bytes(parts.as_bytes()).unwrap().frames()[1], (1.0, "b".to_owned()));
    }
}
