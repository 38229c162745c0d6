//! Bodies in time: implicit steps of Newmark's family.
//!
//! ```text
//! M a + D v + dW/du(u) = f(t),   D = damping.mass M + damping.stiffness K
//! u1 = u^ + cx a1,  v1 = v^ + cv a1     (u^, v^ follow from u0, v0, a0; see [`Scheme`])
//!
//! linearised   (M + cv D + cx K) a1 = f - dW/du(u0) - K (u^ - u0) - D v^
//! Newton       u1 minimises  |u - u^|_M^2 / 2 cx + W(u) - f.u + (cx / 2 cv) v.D v
//! ```
//!
//! The matrix on the left is one block matrix with the pattern of the stiffness; rows whose stiffness has not changed are
//! not written again. The stiffness in `D` is that at the start of the step, in the minimisation too.
//!
//! ```
//! use stylet_mesh::generate::kuhn_box;
//! use stylet_physics::body::{Body, Density, MassKind};
//! use stylet_physics::dynamics::{Drive, DynamicsSettings, Integrator};
//! use stylet_physics::material::NeoHookean;
//! use stylet_solver::{subspace::Subspace, team::Team};
//!
//! let mesh = kuhn_box::<3, 4>([0.0; 3], [0.1; 3], [2, 2, 2])?;
//! let mut body = Body::new(&mesh, NeoHookean::from_young_poisson(34e3, 0.45)?, 1.0)?;
//! body.set_mass(MassKind::Lumped, &Density::Uniform(1000.0))?;
//! let mut weight = vec![0.0; 3 * body.n_vertices()];
//! body.add_gravity(&[0.0, 0.0, -9.81], &mut weight);
//! let mut falls = |_: f64, drive: &mut Drive| drive.load.copy_from_slice(&weight);
//!
//! let subspace = Subspace::new(body.n_vertices()); // nothing holds it
//! let mut integrator = Integrator::new(DynamicsSettings::new(0.01), &Team::serial());
//! let mut state = integrator.start(&mut body, &subspace, &mut falls)?;
//! for _ in 0..10 {
//!     integrator.step(&mut body, &subspace, &mut falls, &mut state)?;
//! }
//! assert!((state.u[2] + 0.5 * 9.81 * 0.1 * 0.1).abs() < 1e-9); // metres
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub(crate) mod attempt;
pub(crate) mod error;
pub(crate) mod following;
mod incremental;
mod integrator;
mod preconditioner;
mod report;
pub(crate) mod scheme;
mod settings;
mod state;
mod times;

pub use error::DynamicsError;
pub use integrator::{Drive, Integrator};
pub use preconditioner::StepPreconditioner;
pub use report::{Balance, StepReport};
pub(crate) use scheme::Coefficients;
pub use scheme::Scheme;
pub use settings::{Adaptive, Damping, DynamicsSettings, Solution};
pub use state::State;
pub use times::{Spent, StageTimes};
