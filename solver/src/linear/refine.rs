//! Iterative refinement: a solve by an approximate inverse, checked and mended by the residual.

use crate::LinearOperator;
use crate::precondition::Preconditioner;
use crate::stop::{Stop, StopRule, StopRuleError};
use crate::subspace::Subspace;
use crate::vector::{self, first_not_finite, norm2};

/// A step that leaves more than this part of the residual is the last one.
const PROGRESS: f64 = 0.5;

/// How far a refinement goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RefineSettings {
    /// When the residual is small enough; the external forces are `b`.
    pub stop: StopRule,
    /// Budget of corrections, one product and one application of the inverse each; zero only evaluates the residual.
    pub max_iterations: usize,
}

/// How a refinement went.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RefineReport {
    /// Why it ended.
    pub stop: Stop,
    /// Corrections made; the last one is taken back if it did not help.
    pub iterations: usize,
    /// `‖P_W (b − A x)‖₂` of the iterate returned, evaluated in `f64`.
    pub residual_norm: f64,
    /// `‖(I − P_W)(b − A x)‖₂`: norm of the reaction forces.
    pub reaction_norm: f64,
    /// What the residual norm was last compared with.
    pub threshold: f64,
}

/// Why a refinement could not be carried out.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RefineError {
    /// A vector or the subspace does not fit the operator.
    #[error("operator has dimension {dim}, {what} has length {len}")]
    Shape {
        /// Which argument.
        what: &'static str,
        /// Dimension of the operator.
        dim: usize,
        /// Length of the argument.
        len: usize,
    },
    /// The stopping rule makes no sense.
    #[error(transparent)]
    StopRule(#[from] StopRuleError),
    /// A vector holds NaN or an infinity, or its norm overflows; `A x` and `M⁻¹ r` point at the operator or the inverse.
    #[error("{what} is not finite at iteration {iteration}, first at entry {index:?}")]
    NotFinite {
        /// Which vector.
        what: &'static str,
        /// Its first entry that is not finite; none if only the norm overflows.
        index: Option<usize>,
        /// Iteration, 0 before the first.
        iteration: usize,
    },
}

/// Vectors of a refinement; a second one of the same size allocates nothing.
#[derive(Clone, Debug, Default)]
pub struct RefineWorkspace {
    r: Vec<f64>,
    z: Vec<f64>,
    best: Vec<f64>,
    reaction: Vec<f64>,
}

impl RefineWorkspace {
    /// An empty workspace.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }
}

/// Solves `P_W A x = P_W b` over `x + W`: adds `P_W M⁻¹ r` to `x` until the residual `r = P_W (b − A x)` is small.
///
/// `b` and `x` have length `n = a.dim() = w.dim()`. On entry `x` satisfies the constraints, on exit it holds the iterate with
/// the smallest residual. With an exact factor for `M` this is a direct solve whose residual is known, and one or two
/// corrections reach rounding; with a factor in `f32` each correction gains about six digits, as long as the condition number is
/// below 1e6. `A` need not be definite. A correction that does not halve the residual ends the refinement as
/// [`Stop::Stalled`]: `M` is no inverse, or rounding is reached.
///
/// # Errors
/// See [`RefineError`].
///
/// Source: Higham, *Accuracy and Stability of Numerical Algorithms*, 2nd ed. (2002), chapter 12.
pub fn refine<const B: usize>(
    a: &(impl LinearOperator + ?Sized),
    m: &(impl Preconditioner + ?Sized),
    w: &Subspace<B>,
    b: &[f64],
    x: &mut [f64],
    settings: &RefineSettings,
    ws: &mut RefineWorkspace,
) -> Result<RefineReport, RefineError> {
    check(a.dim(), w.dim(), b, x, settings)?;
    for v in [&mut ws.r, &mut ws.z, &mut ws.best] {
        v.resize(b.len(), 0.0);
    }
    ws.reaction.resize(B * w.n_constrained(), 0.0);
    let external_norm = norm2(b);
    finite(external_norm, "b", b, 0)?;

    let mut best: Option<RefineReport> = None;
    for iteration in 0.. {
        let mut now = evaluate(a, w, b, x, ws, iteration)?;
        now.threshold = settings.stop.threshold(external_norm, now.reaction_norm);
        if let Some(best) = best.filter(|best| now.residual_norm > PROGRESS * best.residual_norm) {
            if now.residual_norm >= best.residual_norm {
                x.copy_from_slice(&ws.best);
                now = best;
            }
            let reached = now.residual_norm <= now.threshold;
            return Ok(RefineReport {
                stop: if reached { Stop::Converged } else { Stop::Stalled },
                iterations: iteration,
                ..now
            });
        }
        if now.residual_norm <= now.threshold {
            return Ok(RefineReport { stop: Stop::Converged, ..now });
        }
        if iteration == settings.max_iterations {
            return Ok(now);
        }
        best = Some(now);
        ws.best.copy_from_slice(x);
        m.apply(&ws.r, &mut ws.z);
        w.project(&mut ws.z);
        finite(norm2(&ws.z), "M⁻¹ r", &ws.z, iteration + 1)?;
        vector::axpy(1.0, &ws.z, x);
    }
    unreachable!("the budget of corrections is finite")
}

fn check(dim: usize, subspace: usize, b: &[f64], x: &[f64], settings: &RefineSettings) -> Result<(), RefineError> {
    settings.stop.validate()?;
    for (what, len) in [("the subspace", subspace), ("b", b.len()), ("x", x.len())] {
        if len != dim {
            return Err(RefineError::Shape { what, dim, len });
        }
    }
    match first_not_finite(x) {
        Some(index) => Err(RefineError::NotFinite { what: "x", index: Some(index), iteration: 0 }),
        None => Ok(()),
    }
}

/// `r ← P_W (b − A x)` and the reactions.
fn evaluate<const B: usize>(
    a: &(impl LinearOperator + ?Sized),
    w: &Subspace<B>,
    b: &[f64],
    x: &[f64],
    ws: &mut RefineWorkspace,
    iteration: usize,
) -> Result<RefineReport, RefineError> {
    a.apply(x, &mut ws.r);
    vector::xpby(b, -1.0, &mut ws.r);
    w.split(&mut ws.r, &mut ws.reaction);
    let (residual_norm, reaction_norm) = (norm2(&ws.r), norm2(&ws.reaction));
    finite(residual_norm, "the residual b - A x", &ws.r, iteration)?;
    finite(reaction_norm, "the reactions", &ws.reaction, iteration)?;
    let (stop, iterations) = (Stop::IterationLimit, iteration);
    Ok(RefineReport { stop, iterations, residual_norm, reaction_norm, threshold: 0.0 })
}

fn finite(norm: f64, what: &'static str, v: &[f64], iteration: usize) -> Result<(), RefineError> {
    if norm.is_finite() {
        return Ok(());
    }
    Err(RefineError::NotFinite { what, index: first_not_finite(v), iteration })
}
