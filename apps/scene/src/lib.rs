//! Scene files: one table of keys that reads TOML, checks it, and documents itself.
//!
//! An application declares what a scene may say **once**, as a static list of [`Stage`]s (TOML tables) and [`Key`]s:
//!
//! ```
//! use stylet_scene::{Bound, Key, Kind, Stage, Table, Value};
//!
//! #[derive(Default, PartialEq, Debug)]
//! struct Scene { mesh: Option<f64> }
//!
//! const TABLE: Table<Scene> = Table {
//!     stages: &[Stage {
//!         name: "mesh",
//!         meaning: "the tissue",
//!         required: false,
//!         enable: |s| { s.mesh.get_or_insert(0.1); },
//!     }],
//!     keys: &[Key {
//!         path: "mesh.side",
//!         kind: Kind::Float { min: Bound::Exclusive(0.0), max: Bound::None },
//!         unit: "m",
//!         default: "0.1",
//!         meaning: "edge length of the block",
//!         set: |s, v| { s.mesh = Some(v.float()?); Ok(()) },
//!         get: |s| s.mesh.map(Value::Float),
//!     }],
//! };
//!
//! let mut scene = Scene::default();
//! TABLE.read("slab.toml", "[mesh]\nside = 0.2\n", &mut scene)?;
//! assert_eq!(scene.mesh, Some(0.2));
//! TABLE.set(&mut scene, "mesh.side=0.3")?;
//!
//! let mut again = Scene::default();
//! TABLE.read("written", &TABLE.write(&scene), &mut again)?;
//! assert_eq!(again, scene);
//!
//! let error = TABLE.read("slab.toml", "[mesh]\nsdie = 0.2\n", &mut scene).unwrap_err();
//! assert_eq!(error.to_string(), "slab.toml:2: mesh.sdie: unknown key; nearest known key is mesh.side");
//! # Ok::<(), stylet_scene::SceneError>(())
//! ```
//!
//! From that one list come the reader ([`Table::read`]), the `--set key=value` of a command line ([`Table::set`]), the
//! reference for the documentation ([`Table::schema`]) and the writer ([`Table::write`]), so that they cannot disagree.
//!
//! A table that is present, even empty, means that its stage exists: [`Stage::enable`] gives it its defaults, then the
//! keys are set. A table that is absent is a stage that does not exist.
//!
//! Every error is one line that names the file and line (or `--set`), the key, what was found and what was expected.
#![warn(missing_docs)]

mod check;
mod error;
mod key;
mod kind;
mod load;
mod nearest;
mod read;
mod schema;
mod set;
mod table;
mod value;
mod words;
mod write;

pub use error::{Place, Problem, SceneError};
pub use kind::{Bound, Column, Kind, number};
pub use load::{MAX_BYTES, load};
pub use nearest::nearest;
pub use read::{has_rows, has_table};
pub use table::{Key, Stage, Table};
pub use value::{Row, Value};
pub use words::Words;

#[cfg(test)]
mod properties;
#[cfg(test)]
mod sample;
