//! A small stiff body coupled to a big one, as one positive definite system.
//!
//! Each node of the small body is attached to a point of the big one, a weighted mean of its nodes, and some moves relative to
//! that point are left to it: none (it sticks), those along a line (it slides), or all. With `P_i` the projection onto the
//! relative moves of small node `i`, its place is
//!
//! ```text
//! x_i = P_i s_i + (I − P_i) (Σ_j w_ij u_j + g_i)
//! ```
//!
//! (and a resistance `c_i |P_i (s_i − Σ_j w_ij u_j)|² / 2` to that relative move may stand against it, viscous friction for one),
//! where `u` are the big body's moves and `s` the small body's own. The unknowns `(u, s)` satisfy no constraint: the multipliers
//! of the coupled system, and with them its indefiniteness, are gone, and `K = diag(A, 0) + Tᵀ N T`, with `N` the small
//! body's matrix and `T` the map above, is symmetric positive definite.
//!
//! A stiff body would still ruin the convergence of conjugate gradients. The preconditioner inverts the principal block of
//! all unknowns that `N` reaches exactly, the big body's own stiffness there included, and leaves the rest to any
//! preconditioner of the big body: the coupled system then takes about the iterations of the big body alone.

mod block;
mod start;

pub use start::null_space_start;

use super::krylov::{VectorError, check_length, finite};
use super::{CgError, CgReport, CgSettings, CgWorkspace, projected_cg};
use crate::LinearOperator;
use crate::dense::NotPositiveDefinite;
use crate::precondition::{PreconditionRows, Preconditioner};
use crate::sparse::BlockCsr;
use crate::subspace::{Constraint, Subspace, SubspaceError};
use crate::team::Team;
use crate::vector::{dot, norm2};
use block::CoupledBlock;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Why two bodies cannot be coupled, or their system not be solved.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NullSpaceError {
    /// A vector does not fit, or holds what is not a number.
    #[error(transparent)]
    Vector(#[from] VectorError),
    /// A relative motion makes no sense; nodes are those of both bodies, the big one's first.
    #[error(transparent)]
    Subspace(#[from] SubspaceError),
    /// A small node is attached to a big one that does not exist.
    #[error("small node {node} is attached to node {big}: the big body has {n_big} nodes")]
    Attachment {
        /// The small node.
        node: usize,
        /// The big node.
        big: usize,
        /// Nodes of the big body.
        n_big: usize,
    },
    /// A weight is NaN or infinite.
    #[error("the weight of node {big} for small node {node} is not finite")]
    Weight {
        /// The small node.
        node: usize,
        /// The big node.
        big: usize,
    },
    /// A small node is tied, but to nothing.
    #[error("small node {node} is tied and has no attachment")]
    Unattached {
        /// The small node.
        node: usize,
    },
    /// The principal block of the coupled unknowns has no Cholesky factor.
    #[error(
        "pivot {pivot:e} at node {node} of both bodies, the big one's first: the coupled block is not positive definite"
    )]
    NotPositiveDefinite {
        /// The node.
        node: usize,
        /// The pivot that should have been positive.
        pivot: f64,
    },
    /// Conjugate gradients on the coupled system failed; entries are those of both bodies, the big one's first.
    #[error(transparent)]
    Cg(#[from] CgError),
}

/// Where a small node is attached: nodes of the big body and their weights, which sum to one for a point inside it.
pub type Attachment = Vec<(usize, f64)>;

/// How a small body hangs in a big one; see the [module](self).
#[derive(Clone, Debug)]
pub struct NullSpace<const B: usize> {
    n_big: usize,
    small: BlockCsr<B>,
    attachments: Vec<Attachment>,
    /// By small node, what a relative move of it costs.
    resistance: Vec<f64>,
    /// Moves of the big nodes, then those of the small ones relative to their attachments.
    w: Subspace<B>,
    block: CoupledBlock<B>,
}

/// Vectors of a solve; sized by the first one, so that a second one of the same size allocates nothing.
#[derive(Debug, Default)]
pub struct NullSpaceWorkspace {
    cg: CgWorkspace,
    z: Vec<f64>,
    right_side: Vec<f64>,
    start: start::Vectors,
    scratch: Mutex<Scratch>,
}

#[derive(Debug, Default)]
struct Scratch {
    /// Places of the small body's nodes, and forces on them.
    place: Vec<f64>,
    force: Vec<f64>,
    /// A residual of the big body that is zero at the attachments.
    rest: Vec<f64>,
    /// Right side of the coupled block.
    block: Vec<f64>,
}

impl NullSpaceWorkspace {
    /// An empty workspace; solves run on the calling thread.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }
}

/// The vectors of these conjugate gradients, and their team.
impl From<CgWorkspace> for NullSpaceWorkspace {
    fn from(cg: CgWorkspace) -> Self {
        Self { cg, ..Self::default() }
    }
}

impl<const B: usize> NullSpace<B> {
    /// Couples the body with the stiffness `small` to the one with the stiffness `big` and the allowed moves `w`. Node `i` of the
    /// small body is attached by `attachments[i]`, and `free[i]` are the moves that it may make relative to that.
    ///
    /// `small` is symmetric and positive semidefinite; the coupled system must be positive definite. Only the rows of `big` that
    /// belong to attached nodes are read. All nodes that are in an attachment belong to the block that is inverted, whatever the
    /// state of the small node.
    ///
    /// # Errors
    /// [`NullSpaceError`]; lengths that do not fit are [`VectorError::Length`].
    pub fn new(
        big: &BlockCsr<B>,
        w: &Subspace<B>,
        small: BlockCsr<B>,
        attachments: Vec<Attachment>,
        free: &[Constraint<B>],
    ) -> Result<Self, NullSpaceError> {
        let (n_big, n_small) = (big.n_rows(), small.n_rows());
        check_length("the subspace", w.n_nodes(), n_big)?;
        check_length("the list of attachments", attachments.len(), n_small)?;
        check_length("the list of relative motions", free.len(), n_small)?;
        for (node, attachment) in attachments.iter().enumerate() {
            if let Some(&(big, _)) = attachment.iter().find(|(big, _)| *big >= n_big) {
                return Err(NullSpaceError::Attachment { node, big, n_big });
            }
            if let Some(&(big, _)) = attachment.iter().find(|(_, weight)| !weight.is_finite()) {
                return Err(NullSpaceError::Weight { node, big });
            }
        }
        let mut w = w.clone();
        w.resize(n_big + n_small);
        let block = CoupledBlock::new(&attachments, n_big);
        let resistance = vec![0.0; n_small];
        let mut this = Self { n_big, small, attachments, resistance, w, block };
        for (node, free) in free.iter().enumerate() {
            this.tie(node, *free)?;
        }
        this.refresh(big)?;
        Ok(this)
    }

    /// Changes the moves of a small node relative to its attachment, and factors the coupled block again.
    ///
    /// # Errors
    /// [`NullSpaceError::Subspace`] and [`NullSpaceError::Unattached`] leave everything as it was;
    /// [`NullSpaceError::NotPositiveDefinite`] means that a solve needs another change first.
    pub fn set_free(&mut self, node: usize, free: Constraint<B>) -> Result<(), NullSpaceError> {
        self.tie(node, free)?;
        self.factor()
    }

    /// Changes the moves of all small nodes at once, and what stands against them: `resistance[i]`, zero or more, is force by
    /// length of a move relative to the attachment (viscous friction of `c` N s/m adds `c` times the derivative of velocity by
    /// place); only its part along the allowed moves counts. The coupled block is factored again.
    ///
    /// # Errors
    /// As [`set_free`](Self::set_free), [`VectorError::Length`] and [`VectorError::NotFinite`]; nodes before the one at fault
    /// are then changed.
    pub fn set_motions(&mut self, free: &[Constraint<B>], resistance: &[f64]) -> Result<(), NullSpaceError> {
        check_length("the list of relative motions", free.len(), self.small.n_rows())?;
        check_length("the list of resistances", resistance.len(), self.small.n_rows())?;
        finite(resistance.iter().sum(), "the resistances", resistance, 0)?;
        for (node, free) in free.iter().enumerate() {
            self.tie(node, *free)?;
        }
        self.resistance.copy_from_slice(resistance);
        self.factor()
    }

    /// Reads the big body's matrix anew, after its rows of attached nodes changed.
    ///
    /// # Errors
    /// [`VectorError::Length`] if it has another number of rows; [`NullSpaceError::NotPositiveDefinite`].
    pub fn refresh(&mut self, big: &BlockCsr<B>) -> Result<(), NullSpaceError> {
        check_length("the big matrix", big.n_rows(), self.n_big)?;
        self.block.read(big);
        self.factor()
    }

    /// Replaces the small body's matrix by one of the same number of nodes.
    ///
    /// # Errors
    /// As [`refresh`](Self::refresh).
    pub fn set_small(&mut self, small: BlockCsr<B>) -> Result<(), NullSpaceError> {
        check_length("the small matrix", small.n_rows(), self.small.n_rows())?;
        self.small = small;
        self.factor()
    }

    /// The small body's matrix.
    #[must_use]
    pub fn small(&self) -> &BlockCsr<B> {
        &self.small
    }

    /// The moves of a small node relative to its attachment.
    #[must_use]
    pub fn free(&self, node: usize) -> Constraint<B> {
        self.w.get(self.n_big + node)
    }

    /// Number of unknowns in the block that is inverted exactly.
    #[must_use]
    pub fn block_dofs(&self) -> usize {
        self.block.dofs()
    }

    /// Writes `N x − b` of the small body in the tied directions: the force of the big body on each small node. The big body
    /// gets its negative, shared by the weights.
    ///
    /// # Errors
    /// [`VectorError::Length`].
    pub fn constraint_forces(&self, b_small: &[f64], x_small: &[f64], out: &mut [f64]) -> Result<(), NullSpaceError> {
        let n = B * self.small.n_rows();
        for (what, len) in
            [("b of the small body", b_small.len()), ("x of the small body", x_small.len()), ("the forces", out.len())]
        {
            check_length(what, len, n)?;
        }
        self.small.apply(x_small, out);
        let (out, b) = (out.as_chunks_mut::<B>().0, b_small.as_chunks::<B>().0);
        for (node, (out, b)) in out.iter_mut().zip(b).enumerate() {
            *out = tied(&self.free(node), std::array::from_fn(|k| out[k] - b[k]));
        }
        Ok(())
    }

    /// How moves relative to the attachments answer to unit forces between small nodes and their attachments, as far as the exact
    /// block knows: `out[i n + k]` is the relative move `i` under force `k`, each a small node and a direction that is free to it.
    /// All else is held, so that a true answer is larger.
    pub fn relative_compliance(&self, moves: &[(usize, [f64; B])], out: &mut Vec<f64>) {
        let n = moves.len();
        out.clear();
        out.resize(n * n, 0.0);
        let mut x = vec![0.0; self.block.dofs()];
        for (k, &(node, direction)) in moves.iter().enumerate() {
            x.fill(0.0);
            self.block.pull(node, &self.attachments[node], &direction, &mut x);
            self.block.solve_rows(&mut x);
            for (i, (node, direction)) in moves.iter().enumerate() {
                out[i * n + k] = self.block.stretch(*node, &self.attachments[*node], direction, &x);
            }
        }
    }

    fn tie(&mut self, node: usize, free: Constraint<B>) -> Result<(), NullSpaceError> {
        let attached = self.attachments.get(node).is_none_or(|attachment| !attachment.is_empty());
        if !attached && free != Constraint::Free {
            return Err(NullSpaceError::Unattached { node });
        }
        Ok(self.w.set(self.n_big.saturating_add(node), free)?)
    }

    fn factor(&mut self) -> Result<(), NullSpaceError> {
        let Self { block, small, attachments, resistance, w, .. } = self;
        block.factor(small, attachments, resistance, w).map_err(|NotPositiveDefinite { row, pivot }| {
            let node = block.node_of(row);
            NullSpaceError::NotPositiveDefinite { node, pivot }
        })
    }

    /// Sizes the vectors, and leaves the right side `(b, 0) + Tᵀ(b' − N g)` and the start in them; returns the big body's length.
    fn prepare(
        &self,
        a: &(impl LinearOperator + ?Sized),
        (b_big, b_small, g): (&[f64], &[f64], &[f64]),
        (x_big, x_small): (&[f64], &[f64]),
        ws: &mut NullSpaceWorkspace,
    ) -> Result<usize, NullSpaceError> {
        let (n, n_small) = (B * self.n_big, B * self.small.n_rows());
        check_length("the operator", a.dim(), n)?;
        for (what, v, expected) in [
            ("b of the big body", b_big, n),
            ("b of the small body", b_small, n_small),
            ("the offsets", g, n_small),
            ("x of the big body", x_big, n),
            ("x of the small body", x_small, n_small),
        ] {
            check_length(what, v.len(), expected)?;
            finite(norm2(v), what, v, 0)?;
        }
        let NullSpaceWorkspace { z, right_side, scratch, .. } = ws;
        z.resize(n + n_small, 0.0);
        right_side.resize(n + n_small, 0.0);
        let buffers = scratch.get_mut().unwrap_or_else(PoisonError::into_inner);
        for (v, len) in [
            (&mut buffers.place, n_small),
            (&mut buffers.force, n_small),
            (&mut buffers.rest, n),
            (&mut buffers.block, self.block.most_dofs()),
        ] {
            v.resize(len, 0.0);
        }

        // Right side.
        z.fill(0.0);
        self.place(z, Some(g), &mut buffers.place);
        self.small.apply(&buffers.place, &mut buffers.force);
        for (f, b) in buffers.force.iter_mut().zip(b_small) {
            *f = b - *f;
        }
        right_side[..n].copy_from_slice(b_big);
        self.spread(&buffers.force, right_side);

        // Start: the small body's own part of its place.
        z[..n].copy_from_slice(x_big);
        for (node, (z, x)) in z[n..].as_chunks_mut::<B>().0.iter_mut().zip(x_small.as_chunks::<B>().0).enumerate() {
            *z = self.free(node).project(*x);
        }
        Ok(n)
    }

    /// `x ← T (u, s)`, plus the tied part of `g` where there is one.
    fn place(&self, z: &[f64], g: Option<&[f64]>, x: &mut [f64]) {
        let z = z.as_chunks::<B>().0;
        for (node, x) in x.as_chunks_mut::<B>().0.iter_mut().enumerate() {
            let mut mean: [f64; B] = g.map_or([0.0; B], |g| std::array::from_fn(|k| g[node * B + k]));
            for &(big, weight) in &self.attachments[node] {
                (0..B).for_each(|k| mean[k] += weight * z[big][k]);
            }
            let free = self.free(node);
            let (own, carried) = (free.project(z[self.n_big + node]), tied(&free, mean));
            *x = std::array::from_fn(|k| own[k] + carried[k]);
        }
    }

    /// `y ← K z` of a `z` that is zero but in the exact block.
    fn apply_to_block(&self, z: &[f64], y: &mut [f64], scratch: &mut Scratch) {
        y.fill(0.0);
        self.block.add_product(z, y);
        self.place(z, None, &mut scratch.place);
        self.small.apply(&scratch.place, &mut scratch.force);
        self.spread(&scratch.force, y);
        self.resist(z, y);
    }

    /// Adds the forces of the resistances at `z = (u, s)` to `y`; returns their part of `zᵀy`.
    fn resist(&self, z: &[f64], y: &mut [f64]) -> f64 {
        let mut product = 0.0;
        let (z, y) = (z.as_chunks::<B>().0, y.as_chunks_mut::<B>().0);
        for (node, &c) in self.resistance.iter().enumerate().filter(|(_, c)| **c != 0.0) {
            let free = self.free(node);
            let mut relative = z[self.n_big + node];
            for &(big, weight) in &self.attachments[node] {
                (0..B).for_each(|k| relative[k] -= weight * z[big][k]);
            }
            let force = free.project(relative.map(|v| c * v));
            product += (0..B).map(|k| force[k] * relative[k]).sum::<f64>();
            (0..B).for_each(|k| y[self.n_big + node][k] += force[k]);
            for &(big, weight) in &self.attachments[node] {
                (0..B).for_each(|k| y[big][k] -= weight * force[k]);
            }
        }
        product
    }

    /// `y ← y + Tᵀ f` on the big body's entries, `y ← Tᵀ f` on the small one's.
    fn spread(&self, f: &[f64], y: &mut [f64]) {
        let y = y.as_chunks_mut::<B>().0;
        for (node, f) in f.as_chunks::<B>().0.iter().enumerate() {
            let free = self.free(node);
            y[self.n_big + node] = free.project(*f);
            let carried = tied(&free, *f);
            for &(big, weight) in &self.attachments[node] {
                (0..B).for_each(|k| y[big][k] += weight * carried[k]);
            }
        }
    }
}

/// The part of `v` that a small node does not have to itself.
fn tied<const B: usize>(free: &Constraint<B>, v: [f64; B]) -> [f64; B] {
    let own = free.project(v);
    std::array::from_fn(|k| v[k] - own[k])
}

/// Solves `A u = b`, `N x = b'` for two bodies that are coupled, by conjugate gradients on the system without constraints.
///
/// `a` and `m` are the big body's operator and its preconditioner on its allowed moves, of length `n`; `b = (b, b', g)` are the
/// forces on the big and on the small body and the offsets of the small nodes from their attachments, of which only the tied
/// part counts; `x = (u, x')`, used on entry (of `x'` only the relative moves count), holds both bodies' solution on exit.
/// Forces between the bodies are not among `b`: friction is, on both with opposite signs. The stop rule sees the coupled system,
/// whose right side is `(b, 0) + Tᵀ(b' − N g)`.
///
/// # Errors
/// See [`NullSpaceError`].
///
/// Source: Nocedal & Wright, *Numerical Optimization*, 2nd ed. (2006), section 16.2 (null-space method).
pub fn null_space_cg<const B: usize>(
    form: &NullSpace<B>,
    a: &(impl LinearOperator + ?Sized),
    m: &(impl Preconditioner + ?Sized),
    (b_big, b_small, g): (&[f64], &[f64], &[f64]),
    (x_big, x_small): (&mut [f64], &mut [f64]),
    settings: &CgSettings,
    ws: &mut NullSpaceWorkspace,
) -> Result<CgReport, NullSpaceError> {
    let n = form.prepare(a, (b_big, b_small, g), (&*x_big, &*x_small), ws)?;
    let NullSpaceWorkspace { cg, z, right_side, scratch, .. } = ws;
    let coupled = Coupled { form, a, m, scratch };
    let report = projected_cg(&coupled, &coupled, &form.w, right_side, z, settings, cg);
    x_big.copy_from_slice(&z[..n]);
    form.place(z, Some(g), x_small);
    Ok(report?)
}

/// The coupled operator and its preconditioner.
struct Coupled<'a, const B: usize, A: ?Sized, M: ?Sized> {
    form: &'a NullSpace<B>,
    a: &'a A,
    m: &'a M,
    scratch: &'a Mutex<Scratch>,
}

impl<const B: usize, A: ?Sized, M: ?Sized> Coupled<'_, B, A, M> {
    fn scratch(&self) -> MutexGuard<'_, Scratch> {
        self.scratch.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<const B: usize, A: LinearOperator + ?Sized, M: Preconditioner + ?Sized> LinearOperator for Coupled<'_, B, A, M> {
    fn dim(&self) -> usize {
        self.form.w.dim()
    }

    fn apply(&self, x: &[f64], y: &mut [f64]) {
        LinearOperator::apply_on(self, &Team::serial(), x, y);
    }

    fn apply_on(&self, team: &Team, x: &[f64], y: &mut [f64]) {
        let n = B * self.form.n_big;
        let Scratch { place, force, .. } = &mut *self.scratch();
        self.a.apply_on(team, &x[..n], &mut y[..n]);
        self.form.place(x, None, place);
        self.form.small.apply(place, force);
        self.form.spread(force, y);
        self.form.resist(x, y);
    }

    fn apply_dot_on(&self, team: &Team, x: &[f64], y: &mut [f64]) -> f64 {
        let n = B * self.form.n_big;
        let Scratch { place, force, .. } = &mut *self.scratch();
        let big = self.a.apply_dot_on(team, &x[..n], &mut y[..n]);
        self.form.place(x, None, place);
        self.form.small.apply(place, force);
        self.form.spread(force, y);
        big + dot(place, force) + self.form.resist(x, y)
    }
}

/// The rows of the big body's preconditioner, if it works by rows; then the exact block.
impl<const B: usize, A: LinearOperator + ?Sized, M: Preconditioner + ?Sized> PreconditionRows for Coupled<'_, B, A, M> {
    fn apply_rows(&self, first: usize, r: &[f64], z: &mut [f64]) {
        let n = (B * self.form.n_big).saturating_sub(first).min(r.len());
        if let Some(rows) = self.m.by_rows().filter(|_| n > 0) {
            rows.apply_rows(first, &r[..n], &mut z[..n]);
        }
        z[n..].fill(0.0);
    }

    fn is_finished_later(&self) -> bool {
        true
    }

    fn finish_rows(&self, r: &[f64], z: &mut [f64]) -> f64 {
        let before = self.form.block.product(r, z);
        self.form.block.solve(r, z, &mut self.scratch().block);
        self.form.block.product(r, z) - before
    }
}

impl<const B: usize, A: LinearOperator + ?Sized, M: Preconditioner + ?Sized> Preconditioner for Coupled<'_, B, A, M> {
    fn apply(&self, r: &[f64], z: &mut [f64]) {
        Preconditioner::apply_on(self, &Team::serial(), r, z);
    }

    fn by_rows(&self) -> Option<&dyn PreconditionRows> {
        self.m.by_rows().map(|_| self as &dyn PreconditionRows)
    }

    fn apply_on(&self, team: &Team, r: &[f64], z: &mut [f64]) {
        let n = B * self.form.n_big;
        let Scratch { rest, block, .. } = &mut *self.scratch();
        rest.copy_from_slice(&r[..n]);
        self.form.block.clear(rest);
        self.m.apply_on(team, rest, &mut z[..n]);
        self.form.block.solve(r, z, block);
    }
}
