//! Bodies of soft tissue: hyperelastic materials, P1 elements, static equilibrium, stick-slip friction.
//!
//! The first layer that joins [`stylet_mesh`] and [`stylet_solver`]; SI units throughout.
//!
//! * [`material`]: strain energy, stress and tangent as functions of the deformation gradient, in two dimensions (plane
//!   strain, plane stress) and three;
//! * [`body`]: elements and stiffness rows that follow a mesh change, as an energy for the solver; loads;
//! * [`statics`]: equilibrium under dead loads, with load steps that adapt;
//! * [`coupling`]: which nodes between a needle and the tissue stick, and which slip;
//! * [`reparameterise`]: what a needle carries along its length, after its nodes have moved;
//! * [`rod`]: discrete elastic rods;
//! * [`numbering`]: numbers and parts of vertices by the graph of a mesh;
//! * [`friction`]: stick-slip states of the nodes along a tool.
//!
//! ```
//! use stylet_mesh::generate::kuhn_box;
//! use stylet_physics::{body::Body, material::{Hyperelastic, NeoHookean, PlaneStress}};
//!
//! let mesh = kuhn_box::<2, 3>([0.0, 0.0], [0.1, 0.1], [8, 8])?;
//! let tissue = PlaneStress::new(NeoHookean::from_young_poisson(34e3, 0.34)?);
//! let body = Body::new(&mesh, tissue, 0.01)?;
//! let stretched: Vec<f64> = mesh.points().iter().flat_map(|x| [0.1 * x[0], 0.0]).collect();
//! let f = body.deformation_gradient(mesh.cells().next().unwrap(), &stretched).unwrap();
//! let expected = tissue.energy_density(&f) * 0.1 * 0.1 * 0.01; // joules
//! assert!((body.strain_energy(&stretched) - expected).abs() < 1e-12 * expected);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Features
//!
//! * `direct` (default): sparse factors among the methods of statics;
//! * `metis`: parts of the vertices by METIS.

pub mod body;
pub mod coupling;
pub mod dynamics;
pub mod friction;
pub mod insertion;
pub mod lanes;
pub mod material;
pub mod numbering;
mod parallel;
pub mod reparameterise;
pub mod rod;
mod small;
pub mod statics;
pub mod svd;
