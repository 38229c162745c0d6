//! Sparse block algebra and projected optimisation for deformable bodies: slices in, slices out.
//!
//! Knows no mesh and no physics: has never heard of a vertex.
//!
//! * [`sparse`]: a dynamic block sparse matrix whose rows are rewritten one at a time, a frozen one for products, and element
//!   contributions that are exchanged lazily;
//! * [`subspace`]: which node may move how, and the orthogonal projection `P_W` onto the allowed moves;
//! * [`team`]: threads that stay awake during a solve;
//! * [`ordering`]: numberings of the nodes: narrow bands, sparse factors;
//! * [`partition`]: nodes in parts with few edges between them, and how a partition ages;
//! * [`vector`]: reductions of a fixed shape, the same bits on any number of threads and any SIMD level;
//! * [`stop`]: the stopping rules (6.8) and (6.9) of Nienhuys (2003);
//! * [`precondition`]: Jacobi, block Jacobi, SSOR, incomplete Cholesky, Chebyshev polynomials, two-level and
//!   smoothed-aggregation cycles with rigid moves, BPX and V-cycle on bisection hierarchies, stale factors, all restricted to
//!   the subspace;
//! * [`linear`]: projected conjugate gradients in one or two precisions, for one and for several right sides; MINRES; systems
//!   with constraints `C x = d`; a stiff body coupled to a soft one; sparse factors and iterative refinement;
//! * [`complementarity`]: forces within bounds, by block pivoting or projected Gauss-Seidel;
//! * [`condensation`]: small dense responses of a body, and exact changes of them;
//! * [`dense`]: Cholesky factors of small matrices;
//! * [`matrix_market`]: matrices and vectors in files;
//! * [`energy`]: what the nonlinear methods know of a problem;
//! * [`nonlinear`]: projected nonlinear conjugate gradients and projected Newton-CG;
//! * [`check`]: Taylor tests for gradients and Hessians.
//!
//! Vectors are flat: node `i` of a problem with block size `B` owns entries `i*B..(i+1)*B`.
//!
//! # Example
//!
//! Two springs of stiffness 1 in a row, `node 0 — node 1 — node 2`: node 0 is held, node 1 slides along the first axis, and
//! node 2 is pulled.
//!
//! ```
//! use stylet_solver::linear::{CgSettings, CgWorkspace, projected_cg};
//! use stylet_solver::precondition::BlockJacobi;
//! use stylet_solver::sparse::BlockCsr;
//! use stylet_solver::stop::{Criterion, Stop, StopRule};
//! use stylet_solver::subspace::{Constraint, Subspace};
//!
//! let k = |s: f64| [[s, 0.0], [0.0, s]];
//! let mut a = BlockCsr::<2>::new(3);
//! a.set_row(0, &[0, 1], &[k(1.0), k(-1.0)])?;
//! a.set_row(1, &[0, 1, 2], &[k(-1.0), k(2.0), k(-1.0)])?;
//! a.set_row(2, &[1, 2], &[k(-1.0), k(1.0)])?;
//!
//! let mut w = Subspace::new(3);
//! w.set(0, Constraint::Fixed)?;
//! w.set(1, Constraint::Line([1.0, 0.0]))?;
//!
//! let b = [0.0, 0.0, 0.0, 0.0, 1.0, 1.0];
//! let mut x = [0.0; 6];
//! let stop = StopRule { tolerance: 1e-10, criterion: Criterion::Reaction, round_floor: 0.0 };
//! let settings = CgSettings { stop, max_iterations: 100 };
//! let m = BlockJacobi::new(&a, &w)?;
//! let report = projected_cg(&a, &m, &w, &b, &mut x, &settings, &mut CgWorkspace::new())?;
//! assert_eq!(report.stop, Stop::Converged);
//! assert!((x[2] - 1.0).abs() < 1e-9 && x[3] == 0.0 && (x[4] - 2.0).abs() < 1e-9 && (x[5] - 1.0).abs() < 1e-9);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Features
//!
//! * `direct` (default): sparse factors by faer, minimum-degree orders, stale factors as preconditioners.
//! * `metis` (default): nested-dissection orders and partitions.

pub mod check;
pub mod complementarity;
pub mod condensation;
pub mod dense;
pub mod energy;
pub mod linear;
pub mod matrix_market;
mod memory;
#[cfg(feature = "metis")]
mod metis_graph;
pub mod nonlinear;
pub mod operator;
pub mod ordering;
pub mod partition;
pub mod precondition;
pub mod real;
mod simd;
pub mod skyline;
pub mod sparse;
pub mod stop;
pub mod subspace;
pub mod team;
pub mod vector;

pub use operator::{Block, LinearOperator};
