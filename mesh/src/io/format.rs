//! Which formats there are, and which one a file is in.

use super::{Problem, cursor};
use std::{fmt, path::Path, str::FromStr};

/// A file format, as it is written. Readers tell text from binary, and versions, by the content.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash)]
#[non_exhaustive]
pub enum Format {
    /// Gmsh MSH 2.2, text.
    Msh22,
    /// Gmsh MSH 2.2, binary.
    Msh22Binary,
    /// Gmsh MSH 4.1, text.
    Msh41,
    /// Gmsh MSH 4.1, binary.
    Msh41Binary,
    /// VTK XML unstructured grid, binary.
    Vtu,
    /// Legacy VTK unstructured grid, text.
    Vtk,
    /// Legacy VTK unstructured grid, binary.
    VtkBinary,
    /// TetGen and Triangle: `.node` with `.ele`, `.face` and `.edge` beside it.
    Tetgen,
    /// STL surface, text.
    Stl,
    /// STL surface, binary.
    StlBinary,
}

/// What is read, for messages.
pub(super) const READABLE: &str =
    "Gmsh (.msh), VTK (.vtu, .vtk), TetGen (.node, .ele, .face, .edge) or STL (.stl), by extension or content";

impl Format {
    /// Every format.
    pub const ALL: [Self; 10] = [
        Self::Msh22,
        Self::Msh22Binary,
        Self::Msh41,
        Self::Msh41Binary,
        Self::Vtu,
        Self::Vtk,
        Self::VtkBinary,
        Self::Tetgen,
        Self::Stl,
        Self::StlBinary,
    ];

    /// Its name, as [`from_str`](Self::from_str) takes it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Msh22 => "msh22",
            Self::Msh22Binary => "msh22-binary",
            Self::Msh41 => "msh41",
            Self::Msh41Binary => "msh41-binary",
            Self::Vtu => "vtu",
            Self::Vtk => "vtk",
            Self::VtkBinary => "vtk-binary",
            Self::Tetgen => "tetgen",
            Self::Stl => "stl",
            Self::StlBinary => "stl-binary",
        }
    }

    /// The format that a file of this name is written in unless another is asked for: the binary one where an extension
    /// has two, in its latest version. `None` for an extension that no format has.
    pub fn of_extension(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_str()?.to_ascii_lowercase();
        match extension.as_str() {
            "msh" => Some(Self::Msh41Binary),
            "vtu" => Some(Self::Vtu),
            "vtk" => Some(Self::VtkBinary),
            "node" | "ele" | "face" | "edge" => Some(Self::Tetgen),
            "stl" => Some(Self::StlBinary),
            _ => None,
        }
    }

    /// The extension of its files.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Msh22 | Self::Msh22Binary | Self::Msh41 | Self::Msh41Binary => "msh",
            Self::Vtu => "vtu",
            Self::Vtk | Self::VtkBinary => "vtk",
            Self::Tetgen => "node",
            Self::Stl | Self::StlBinary => "stl",
        }
    }

    /// The format whose mark the content bears, where it has one: TetGen's files have none.
    pub(super) fn of_content(bytes: &[u8]) -> Option<Self> {
        let start = bytes.trim_ascii_start();
        let start = start.strip_prefix(b"\xef\xbb\xbf").unwrap_or(start);
        let begins = |mark: &[u8]| start.len() >= mark.len() && start[..mark.len()].eq_ignore_ascii_case(mark);
        let head = &start[..start.len().min(1000)];
        if begins(b"$") {
            Some(Self::Msh41)
        } else if begins(b"# vtk") {
            Some(Self::Vtk)
        } else if begins(b"<VTKFile") || (begins(b"<") && cursor::find(head, b"<VTKFile").is_some()) {
            Some(Self::Vtu)
        } else if super::stl::is_binary(bytes) {
            Some(Self::StlBinary)
        } else if begins(b"solid") {
            Some(Self::Stl)
        } else {
            None
        }
    }

    /// The reader for a file: by its extension, or by its content if the extension says nothing.
    pub(super) fn of_file(path: &Path, bytes: &[u8]) -> Result<Self, Problem> {
        let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        let is_collection = extension == "pvd";
        let format = Self::of_extension(path).or_else(|| Self::of_content(bytes));
        if let Some(format) = format.filter(|_| !is_collection) {
            return Ok(format);
        }
        let start = cursor::shown(&bytes[..bytes.len().min(40)]);
        let found = if is_collection {
            "a ParaView collection, which names meshes and is none".to_owned()
        } else if extension.is_empty() {
            format!("no extension, and content that begins with {start}")
        } else {
            format!("extension {extension:?}, and content that begins with {start}")
        };
        Err(Problem::Format { found, expected: READABLE })
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// A name that no format has.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("no file format {name:?}: there are {}", Format::ALL.map(Format::name).join(", "))]
pub struct UnknownFormat {
    /// The name.
    pub name: String,
}

impl FromStr for Format {
    type Err = UnknownFormat;

    fn from_str(name: &str) -> Result<Self, UnknownFormat> {
        Self::ALL
            .into_iter()
            .find(|format| format.name() == name)
            .ok_or_else(|| UnknownFormat { name: name.to_owned() })
    }
}
