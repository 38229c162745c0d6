//! Conjugate gradients on several right sides that share their products.

use super::krylov::{
    KrylovReport, KrylovSettings, UNDERFLOW, VERIFY_BELOW, VectorError, check_length, finite, not_positive,
};
use crate::LinearOperator;
use crate::precondition::Preconditioner;
use crate::stop::{Stop, StopRuleError};
use crate::subspace::Subspace;
use crate::team::Team;
use crate::vector::{self, norm2};

/// Why a solve could not be carried out. `x` then holds the last iterates.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ManyCgError {
    /// The lengths do not fit.
    #[error(transparent)]
    Length(VectorError),
    /// The stopping rule makes no sense.
    #[error(transparent)]
    StopRule(#[from] StopRuleError),
    /// A vector of one column holds what is not a number.
    #[error("column {column}: {error}")]
    Vector {
        /// Which right side.
        column: usize,
        /// What is wrong with it.
        error: VectorError,
    },
    /// The operator is not positive definite on the subspace.
    #[error("column {column}: pᵀAp = {curvature:e} at iteration {iteration}: not positive definite on the free space")]
    NotPositiveDefinite {
        /// Which right side.
        column: usize,
        /// Iteration, counted from 1.
        iteration: usize,
        /// The value that should have been positive.
        curvature: f64,
    },
    /// The preconditioner is not positive definite on the subspace.
    #[error(
        "column {column}: rᵀM⁻¹r = {value:e} at iteration {iteration}: the preconditioner is not positive definite"
    )]
    PreconditionerNotPositive {
        /// Which right side.
        column: usize,
        /// Iteration, 0 before the first.
        iteration: usize,
        /// The value that should have been positive.
        value: f64,
    },
}

/// Vectors of a solve; sized by the first one, so that a second one of the same size allocates nothing.
#[derive(Clone, Debug, Default)]
pub struct ManyCgWorkspace {
    team: Team,
    columns: Vec<Column>,
    /// Directions and products of the columns at work, interleaved.
    p: Vec<f64>,
    q: Vec<f64>,
    scratch: Vec<f64>,
    active: Vec<usize>,
}

/// One right side's vectors and numbers.
#[derive(Clone, Debug, Default)]
struct Column {
    r: Vec<f64>,
    p: Vec<f64>,
    q: Vec<f64>,
    z: Vec<f64>,
    best: Vec<f64>,
    reaction: Vec<f64>,
    q_reaction: Vec<f64>,
    external_norm: f64,
    rz: f64,
    verify: bool,
    evaluated: Measure,
    now: Measure,
    products: usize,
    iterations: usize,
    stop: Option<Stop>,
}

/// Residual and reaction norms of an iterate, and the threshold that follows.
#[derive(Clone, Copy, Debug, Default)]
struct Measure {
    residual: f64,
    reaction: f64,
    threshold: f64,
}

impl ManyCgWorkspace {
    /// An empty workspace; solves run on the calling thread.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// An empty workspace; solves run on a team, with the same bits.
    #[must_use]
    pub fn on(team: Team) -> Self {
        Self { team, ..Self::default() }
    }

    fn resize(&mut self, n: usize, k: usize, constrained: usize) {
        self.columns.resize_with(k, Column::default);
        for column in &mut self.columns {
            let Column { r, p, q, z, best, reaction, q_reaction, .. } = column;
            for v in [r, p, q, z, best] {
                v.resize(n, 0.0);
            }
            reaction.resize(constrained, 0.0);
            q_reaction.resize(constrained, 0.0);
        }
        self.p.resize(n * k, 0.0);
        self.q.resize(n * k, 0.0);
        self.scratch.resize(2 * n, 0.0);
        self.active.clear();
        self.active.reserve(k);
    }
}

/// Solves `A x = b` for several `b` on the moves `x + W` at once, each by [`projected_cg`](super::projected_cg).
///
/// `b` and `x` hold `k = reports.len()` columns of length `n = a.dim()`, one after the other. One call of
/// [`apply_many`](LinearOperator::apply_many) an iteration serves all columns that are not done; each column stops by itself,
/// and takes the steps that it would take alone. `A` and `M` as in [`projected_cg`](super::projected_cg).
///
/// # Errors
/// See [`ManyCgError`]; a column that fails ends the solve of all.
pub fn many_cg<const B: usize>(
    a: &(impl LinearOperator + ?Sized),
    m: &(impl Preconditioner + ?Sized),
    w: &Subspace<B>,
    (b, x): (&[f64], &mut [f64]),
    reports: &mut [KrylovReport],
    settings: &KrylovSettings,
    ws: &mut ManyCgWorkspace,
) -> Result<(), ManyCgError> {
    settings.stop.validate()?;
    let (n, k) = (a.dim(), reports.len());
    check_length("the subspace", w.dim(), n).map_err(ManyCgError::Length)?;
    check_length("b", b.len(), n * k).map_err(ManyCgError::Length)?;
    check_length("x", x.len(), n * k).map_err(ManyCgError::Length)?;
    ws.resize(n, k, B * w.n_constrained());
    let solve = Solve { a, m, w, b, settings };
    solve.run(x, ws)?;
    for (report, column) in reports.iter_mut().zip(&ws.columns) {
        *report = KrylovReport {
            stop: column.stop.unwrap_or(Stop::IterationLimit),
            iterations: column.iterations,
            products: column.products,
            residual_norm: column.now.residual,
            reaction_norm: column.now.reaction,
            threshold: column.now.threshold,
        };
    }
    Ok(())
}

struct Solve<'a, const B: usize, A: ?Sized, M: ?Sized> {
    a: &'a A,
    m: &'a M,
    w: &'a Subspace<B>,
    b: &'a [f64],
    settings: &'a KrylovSettings,
}

impl<const B: usize, A: LinearOperator + ?Sized, M: Preconditioner + ?Sized> Solve<'_, B, A, M> {
    fn run(&self, x: &mut [f64], ws: &mut ManyCgWorkspace) -> Result<(), ManyCgError> {
        let n = self.a.dim();
        let ManyCgWorkspace { team, columns, p, q, scratch, active } = ws;
        for (c, column) in columns.iter_mut().enumerate() {
            self.start(team, c, &x[c * n..(c + 1) * n], column)?;
        }
        for _ in 0..self.settings.max_iterations {
            active.clear();
            active.extend((0..columns.len()).filter(|c| columns[*c].stop.is_none()));
            let k = active.len();
            if k == 0 {
                return Ok(());
            }
            let (p, q) = (&mut p[..n * k], &mut q[..n * k]);
            for (place, &c) in active.iter().enumerate() {
                gather(k, place, &columns[c].p, p);
            }
            self.a.apply_many(team, k, p, q, scratch);
            for (place, &c) in active.iter().enumerate() {
                scatter(k, place, q, &mut columns[c].q);
                self.step(team, c, &mut x[c * n..(c + 1) * n], &mut columns[c])?;
            }
        }
        Ok(())
    }

    /// Residual and first direction of a column.
    fn start(&self, team: &Team, c: usize, x: &[f64], column: &mut Column) -> Result<(), ManyCgError> {
        let b = self.right_side(c);
        column.external_norm = finite(norm2(b), "b", b, 0).map_err(at(c))?;
        (column.iterations, column.products, column.stop) = (0, 0, None);
        if let Some(index) = vector::first_not_finite(x) {
            let error = VectorError::NotFinite { what: "x", index, iteration: 0 };
            return Err(ManyCgError::Vector { column: c, error });
        }
        self.evaluate(team, c, x, column)?;
        column.evaluated = column.now;
        column.verify =
            self.settings.stop.tolerance < VERIFY_BELOW || column.now.threshold < VERIFY_BELOW * column.now.residual;
        if column.now.residual <= column.now.threshold {
            column.stop = Some(Stop::Converged);
            return Ok(());
        }
        column.best.copy_from_slice(x);
        self.precondition(team, c, column)?;
        column.p.copy_from_slice(&column.z);
        Ok(())
    }

    /// One iteration of a column, its product in `q`.
    fn step(&self, team: &Team, c: usize, x: &mut [f64], column: &mut Column) -> Result<(), ManyCgError> {
        // Step.
        column.iterations += 1;
        column.products += 1;
        let iteration = column.iterations;
        let curvature = team.dot(&column.p, &column.q);
        if !(curvature > 0.0 && curvature.is_finite()) {
            finite(curvature, "A p", &column.q, iteration).map_err(at(c))?;
            return Err(ManyCgError::NotPositiveDefinite { column: c, iteration, curvature });
        }
        let alpha = column.rz / curvature;
        self.w.split(&mut column.q, &mut column.q_reaction);
        let rr = vector::step_residual(alpha, &column.p, &column.q, x, &mut column.r);
        vector::axpy(-alpha, &column.q_reaction, &mut column.reaction);
        self.measure(rr, c, column)?;

        // Stop?
        let mut restart = false;
        let small = column.now.residual <= column.now.threshold;
        if small && !column.verify {
            column.stop = Some(Stop::Converged);
            return Ok(());
        }
        if small || column.now.residual <= 0.1 * f64::EPSILON * column.evaluated.residual {
            restart = self.verify(team, c, x, column)?;
            if column.stop.is_some() {
                return Ok(());
            }
        }

        // Next direction.
        let rz_before = column.rz;
        self.precondition(team, c, column)?;
        let beta = if restart { 0.0 } else { column.rz / rz_before };
        team.xpby(&column.z, beta, &mut column.p);
        Ok(())
    }

    /// Evaluates the residual of a column that seems done; `true` if it is to go on from there.
    fn verify(&self, team: &Team, c: usize, x: &mut [f64], column: &mut Column) -> Result<bool, ManyCgError> {
        self.evaluate(team, c, x, column)?;
        if column.now.residual <= column.now.threshold {
            column.stop = Some(Stop::Converged);
            return Ok(false);
        }
        if column.now.residual > 0.5 * column.evaluated.residual {
            if column.now.residual > column.evaluated.residual {
                x.copy_from_slice(&column.best);
                self.evaluate(team, c, x, column)?;
            }
            column.stop = Some(Stop::Stalled);
            return Ok(false);
        }
        column.evaluated = column.now;
        column.best.copy_from_slice(x);
        Ok(true)
    }

    /// `r ← P_W (b − A x)` and the reactions, from scratch.
    fn evaluate(&self, team: &Team, c: usize, x: &[f64], column: &mut Column) -> Result<(), ManyCgError> {
        self.a.apply_on(team, x, &mut column.r);
        column.products += 1;
        team.xpby(self.right_side(c), -1.0, &mut column.r);
        self.w.split(&mut column.r, &mut column.reaction);
        let rr = team.dot(&column.r, &column.r);
        self.measure(rr, c, column)
    }

    fn measure(&self, rr: f64, c: usize, column: &mut Column) -> Result<(), ManyCgError> {
        let iteration = column.iterations;
        let residual = finite(rr, "the residual b - A x", &column.r, iteration).map_err(at(c))?.sqrt();
        let reaction = norm2(&column.reaction);
        let reaction = finite(reaction, "the reactions", &column.reaction, iteration).map_err(at(c))?;
        let threshold = self.settings.stop.threshold(column.external_norm, reaction);
        column.now = Measure { residual, reaction, threshold };
        Ok(())
    }

    /// `z ← P_W M⁻¹ r` and `rᵀz`; a column whose `rᵀz` underflows is done.
    fn precondition(&self, team: &Team, c: usize, column: &mut Column) -> Result<(), ManyCgError> {
        self.m.apply_on(team, &column.r, &mut column.z);
        self.w.project(&mut column.z);
        let (iteration, value) = (column.iterations, team.dot(&column.r, &column.z));
        column.rz = finite(value, "M⁻¹ r", &column.z, iteration).map_err(at(c))?;
        if not_positive(value, column.now.residual * column.now.residual) {
            return Err(ManyCgError::PreconditionerNotPositive { column: c, iteration, value });
        }
        if value < UNDERFLOW {
            column.stop = Some(Stop::Stalled);
        }
        Ok(())
    }

    fn right_side(&self, c: usize) -> &[f64] {
        let n = self.a.dim();
        &self.b[c * n..(c + 1) * n]
    }
}

fn at(column: usize) -> impl Fn(VectorError) -> ManyCgError {
    move |error| ManyCgError::Vector { column, error }
}

/// Writes `v` into place `place` of `k` interleaved vectors.
fn gather(k: usize, place: usize, v: &[f64], many: &mut [f64]) {
    for (group, v) in many.chunks_exact_mut(k).zip(v) {
        group[place] = *v;
    }
}

/// The reverse of [`gather`].
fn scatter(k: usize, place: usize, many: &[f64], v: &mut [f64]) {
    for (group, v) in many.chunks_exact(k).zip(v) {
        *v = group[place];
    }
}
