//! Adaptive simplicial meshes in any dimension: bisection, location, quality, files.
//!
//! Knows no force and no matrix. Cells have `N` vertices in `D` dimensions; what a mesh change did is a value,
//! [`MeshChange`], that bodies, tools and viewers apply to their own data.
//!
//! ```
//! use stylet_mesh::{MeshChange, generate::kuhn_box, quality};
//!
//! // Tetrahedra in a cube, down to 2^-7 around a point.
//! let mut mesh = kuhn_box::<3, 4>([0.0; 3], [1.0; 3], [1; 3])?;
//! let mut temperature: Vec<f64> = mesh.points().iter().map(|p| p[2]).collect();
//! let mut change = MeshChange::default();
//! mesh.refine_around([0.3141, 0.2718, 0.5772], 2_f64.powi(-7), &mut change)?;
//! assert_eq!((mesh.n_cells(), mesh.n_vertices()), (2_104, 417));
//!
//! // A field follows the change.
//! change.carry_field::<1>(&mut temperature);
//! assert!(mesh.points().iter().zip(&temperature).all(|(p, t)| p[2] == *t));
//! assert_eq!(quality::shapes(&mesh), 3);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | module | what it does |
//! |---|---|
//! | `start`, `manifold`, [`generate`] | start meshes: user input checked at the door, boxes |
//! | `complex` | [`SimplexMesh`]: arrays, neighbours, stars |
//! | `bisect`, `longest_edge` | Maubach's bisection, which edge comes first, closure |
//! | `refine`, `search`, `locate`, `bounds` | refinement along features, point location |
//! | `change` | the change log |
//! | `relocate` | moved vertices |
//! | [`quality`], `invariants` | angles, shapes; what must hold |
//! | `state`, [`io`] | serial form, VTK files |

mod bisect;
mod bounds;
mod change;
mod complex;
mod error;
pub mod generate;
pub mod geometry;
mod id;
mod invariants;
pub mod io;
mod locate;
mod longest_edge;
mod manifold;
pub mod quality;
mod refine;
mod relocate;
mod search;
mod start;
mod state;

pub use change::{MAX_PARENTS, MeshChange, Origin, VertexBirth};
pub use complex::SimplexMesh;
pub use error::{BisectError, InvariantError, MeshError};
pub use id::{CellId, VertexId};
pub use locate::Location;
pub use relocate::MoveError;
