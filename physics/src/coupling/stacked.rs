//! The coupled system with its multipliers, for methods that solve it as it stands.
//!
//! ```text
//! [ A   0   C_t' ] [a_tissue]   [b_tissue]      C_t z_t + C_n z_n = d: tissue and needle agree across the needle, and
//! [ 0   N   C_n' ] [a_needle] = [b_needle]      along it where a node sticks; friction of sliding nodes is on the right
//! [ C_t C_n  0   ] [ lambda ]   [   d    ]
//! ```
//!
//! Source: Chentanez et al. (2009), eq. (7). Nothing of the coupled part is assembled.

use super::CouplingError;
use super::shaft::{inner, triple};
use super::system::Link;
use super::{CouplingMethod, SlipState};
use stylet_solver::LinearOperator;
use stylet_solver::linear::{
    ConstrainedWorkspace, ConstraintPreconditioner, Constraints, KktOperator, KktWorkspace, KrylovSettings,
    SchurDiagonal, constrained_cg, kkt_cg, kkt_minres,
};
use stylet_solver::sparse::{BlockCsr, SparseError};
use stylet_solver::stop::{Criterion, Stop, StopRule};
use stylet_solver::subspace::{Constraint, Subspace};
use stylet_solver::team::Team;

/// Vectors of both bodies one after the other, and the multipliers.
#[derive(Debug, Default)]
pub(super) struct Stacked {
    pub x: Vec<f64>,
    pub b: Vec<f64>,
    lambda: Vec<f64>,
    /// By link, its first multiplier.
    rows: Vec<usize>,
    kkt: KktWorkspace,
    constrained: ConstrainedWorkspace,
}

/// Both bodies, and viscous friction between them.
struct Both<'a, A: ?Sized> {
    big: &'a A,
    small: &'a BlockCsr<3>,
    links: &'a [Link],
    resistance: &'a [f64],
}

impl<A: LinearOperator + ?Sized> LinearOperator for Both<'_, A> {
    fn dim(&self) -> usize {
        self.big.dim() + 3 * self.small.n_rows()
    }

    fn apply(&self, x: &[f64], y: &mut [f64]) {
        self.apply_on(&Team::serial(), x, y);
    }

    fn apply_on(&self, team: &Team, x: &[f64], y: &mut [f64]) {
        let n = self.big.dim();
        self.big.apply_on(team, &x[..n], &mut y[..n]);
        self.small.apply(&x[n..], &mut y[n..]);
        for link in self.links {
            let c = self.resistance[link.small];
            if c == 0.0 {
                continue;
            }
            let (tissue, needle) = (triple(&x[..n], link.vertex), triple(&x[n..], link.small));
            let force = c * (inner(&link.tangent, &needle) - inner(&link.tangent, &tissue));
            for k in 0..3 {
                y[n + 3 * link.small + k] += force * link.tangent[k];
                y[3 * link.vertex + k] -= force * link.tangent[k];
            }
        }
    }
}

/// What the system is made of; right sides hold the friction of the states.
pub(super) struct Parts<'a, A: ?Sized> {
    pub big: &'a A,
    pub big_matrix: &'a BlockCsr<3>,
    pub w: &'a Subspace<3>,
    pub small: &'a BlockCsr<3>,
    pub links: &'a [Link],
    pub resistance: &'a [f64],
    pub offsets: &'a [f64],
}

impl Stacked {
    /// Solves until the residual is at most `threshold` (N), from the `x` at hand; returns iterations, the residual, and leaves the
    /// forces along `t` on the tissue of sticking nodes in `forces`.
    pub fn solve<A: LinearOperator + ?Sized>(
        &mut self,
        method: CouplingMethod,
        parts: &Parts<'_, A>,
        states: &[SlipState],
        (threshold, max_iterations): (f64, usize),
        forces: &mut Vec<f64>,
    ) -> Result<(usize, f64), CouplingError> {
        let constraints = self.constrain(parts, states)?;
        let operator = Both { big: parts.big, small: parts.small, links: parts.links, resistance: parts.resistance };
        let mut w = parts.w.clone();
        w.resize(parts.w.n_nodes() + parts.small.n_rows());
        let diagonal =
            diagonal(parts).map_err(crate::body::BodyError::from).map_err(crate::dynamics::DynamicsError::from)?;
        let m = ConstraintPreconditioner::new(&diagonal, &w, &constraints)?;
        let stop = StopRule { tolerance: f64::MIN_POSITIVE, criterion: Criterion::External, round_floor: threshold };
        let settings = KrylovSettings { stop, max_iterations };
        let Self { x, b, lambda, kkt, constrained, .. } = self;
        lambda.resize(constraints.n_rows(), 0.0);
        let (stop, iterations, residual) = match method {
            CouplingMethod::ConstraintPreconditioned => {
                let report = constrained_cg(&operator, &m, b, x, lambda, &settings, constrained)?;
                (report.stop, report.iterations, report.residual_norm)
            }
            CouplingMethod::KktCg | CouplingMethod::KktMinres | CouplingMethod::NullSpace => {
                let k = KktOperator::new(&operator, &w, &constraints)?;
                let report = if method == CouplingMethod::KktMinres {
                    kkt_minres(&k, &SchurDiagonal(&m), b, x, lambda, &settings, kkt)?
                } else {
                    kkt_cg(&k, &SchurDiagonal(&m), b, x, lambda, &settings, kkt)?
                };
                (report.stop, report.iterations, report.residual_norm)
            }
        };
        if stop != Stop::Converged && residual > threshold {
            return Err(CouplingError::IterationLimit { iterations, residual, threshold });
        }
        forces.clear();
        forces.extend(self.rows.iter().zip(states).map(|(&row, state)| match state {
            SlipState::Static => -self.lambda[row],
            _ => 0.0,
        }));
        Ok((iterations, residual))
    }

    fn constrain<A: LinearOperator + ?Sized>(
        &mut self,
        parts: &Parts<'_, A>,
        states: &[SlipState],
    ) -> Result<Constraints, CouplingError> {
        let n = parts.big.dim();
        let mut constraints = Constraints::new(n + 3 * parts.small.n_rows());
        self.rows.clear();
        for (link, state) in parts.links.iter().zip(states) {
            self.rows.push(constraints.n_rows());
            let (across, _) = Constraint::Plane(link.tangent).basis();
            let along = (*state == SlipState::Static).then_some(link.tangent);
            for direction in along.into_iter().chain([across[0], across[1]]) {
                let (tissue, needle) = (3 * link.vertex, n + 3 * link.small);
                let columns = [tissue, tissue + 1, tissue + 2, needle, needle + 1, needle + 2];
                let [x, y, z] = direction;
                let d = -inner(&direction, &triple(parts.offsets, link.small));
                constraints.push(&columns, &[x, y, z, -x, -y, -z], d)?;
            }
        }
        Ok(constraints)
    }
}

/// The diagonal blocks of both bodies: all that the preconditioner reads.
fn diagonal<A: ?Sized>(parts: &Parts<'_, A>) -> Result<BlockCsr<3>, SparseError> {
    let n = parts.big_matrix.n_rows();
    let mut diagonal = BlockCsr::new(n + parts.small.n_rows());
    let zero = [[0.0; 3]; 3];
    for row in 0..n + parts.small.n_rows() {
        let block = match row.checked_sub(n) {
            None => parts.big_matrix.get(row, row),
            Some(small) => parts.small.get(small, small),
        };
        diagonal.set_row(row, &[row as u32], &[*block.unwrap_or(&zero)])?;
    }
    Ok(diagonal)
}
