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
//! A [`Sweep`] does the same along the path of a moving feature, and coarsens what it leaves behind:
//!
//! ```
//! use stylet_mesh::{Hierarchy, MeshChange, Sweep, generate::kuhn_box};
//!
//! let mut mesh = kuhn_box::<2, 3>([0.0; 2], [1.0; 2], [4; 2])?;
//! let mut hierarchy = Hierarchy::new(&mesh);
//! let mut tip = Sweep::new(0.01).with_hysteresis(0.03);
//! let mut change = MeshChange::default();
//! for step in 0..20 {
//!     let x = 0.04 * f64::from(step);
//!     change.clear();
//!     tip.follow(&mut mesh, [x, 0.43], [x, 0.43], &mut change)?;
//!     hierarchy.apply(&mesh, &change);
//! }
//! tip.withdraw(&mut mesh, &mut change)?;
//! assert_eq!((mesh.n_cells(), mesh.n_vertices()), (32, 25));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | module | what it does |
//! |---|---|
//! | `start`, `manifold`, [`generate`] | start meshes: user input checked at the door, boxes, random Delaunay meshes |
//! | `node`, `complex` | a node of the forest, packed; [`SimplexMesh`]: arrays, neighbours, stars, boundary tags |
//! | `rule`, `longest_edge`, `colouring` | which edge a start cell bisects |
//! | `bisect`, `coarsen` | Maubach's bisection and closure; bisections undone |
//! | `recorder`, `change` | the record of a running operation; the change log |
//! | `refine`, `sweep`, `search`, `locate`, `bounds` | refinement along features, standing or moving; point location |
//! | `hierarchy` | vertices by generation |
//! | `relocate` | moved vertices |
//! | `renumber` | the graph of the vertices; a start mesh under other numbers |
//! | [`remesh`] | vertices and edges along a needle, and the way back |
//! | [`quality`], `invariants` | angles, shapes, histograms; what must hold |
//! | [`random`] | a generator of pseudo-random numbers |
//! | [`check`] | every fault of points and cells as arrays, by ids; repair |
//! | `state`, [`io`], [`import`] | serial form, files, and meshes from what they hold |

mod bisect;
mod bounds;
mod change;
pub mod check;
mod coarsen;
mod colouring;
mod complex;
mod error;
pub mod generate;
pub mod geometry;
mod hierarchy;
mod id;
pub mod import;
mod invariants;
pub mod io;
mod locate;
mod longest_edge;
mod manifold;
mod node;
pub mod quality;
pub mod random;
mod recorder;
mod refine;
mod relocate;
pub mod remesh;
mod renumber;
mod rule;
mod search;
mod start;
mod state;
mod sweep;

pub use change::{MAX_PARENTS, MeshChange, Origin, VertexBirth};
pub use complex::SimplexMesh;
pub use error::{BisectError, BoundaryError, InvariantError, MeshError};
pub use hierarchy::Hierarchy;
pub use id::{CellId, VertexId};
pub use locate::{Configuration, Crossing, Displaced, LocateError, Location, Locator, Positions, SpatialIndex, Walk};
pub use recorder::Work;
pub use relocate::MoveError;
pub use renumber::RenumberError;
pub use rule::Rule;
pub use sweep::Sweep;
