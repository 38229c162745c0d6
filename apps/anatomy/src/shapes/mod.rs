//! Scene files of shapes: a box, solids in it in order of precedence, and how finely they are to be meshed.
//!
//! ```
//! use stylet_anatomy::shapes::ShapeScene;
//!
//! let scene = ShapeScene::parse("gland.toml", r#"
//! [domain]
//! low = [-0.05, -0.05, -0.05]
//! high = [0.05, 0.05, 0.05]
//! size = 0.007
//!
//! [[shape]]
//! name = "capsule"
//! kind = "ellipsoid"
//! centre = [0, 0, 0]
//! semi_axes = [0.025, 0.020, 0.0175]
//!
//! [[shape]]
//! name = "canal"
//! kind = "capsule"
//! from = [0, 0, -0.04]
//! to = [0, 0, 0.04]
//! radius = 0.003
//!
//! [[shape]]
//! name = "gland"
//! kind = "difference"
//! of = "capsule, canal"
//!
//! [[region]]
//! name = "prostate"
//! shape = "gland"
//! young = 60e3
//! "#, "".as_ref())?;
//! let strata = scene.strata();
//! assert_eq!(strata.region(&[0.01, 0.0, 0.0]), 0);
//! assert_eq!(strata.region(&[0.0, 0.0, 0.0]), strata.background());
//! assert_eq!(scene.regions[0].material.young, Some(60e3));
//! # Ok::<(), stylet_scene::SceneError>(())
//! ```
//!
//! `[[shape]]` rows state shapes; those that are made of others name them in `of`, separated by commas, and stand behind
//! them. `[[region]]` rows give shapes their place in the order: where several hold a point it belongs to the first row, where
//! none does to the background, whose material is `[material]`. [`TABLE`] lists all keys, with their units and meanings.
//!
//! | module | what it does |
//! |---|---|
//! | `keys` | the keys |
//! | `kinds` | which parameters each kind of shape has |
//! | `build` | shapes from rows |
//! | `scene` | the scene |

mod build;
mod keys;
mod kinds;
mod scene;
#[cfg(test)]
mod tests;

pub use keys::TABLE;
pub use scene::{Draft, Marker, Material, Refinement, Region, ShapeScene};
