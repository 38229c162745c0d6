//! Which node may move how: the orthogonal projection `P_W` onto the allowed moves.
//!
//! Only constrained nodes are stored and visited, so a projection costs their number and not the number of nodes.
//!
//! Source: Nienhuys, *Cutting in deformable objects*, PhD thesis, Utrecht (2003), section 6.6; the per-node filter is that
//! of Baraff & Witkin, *Large steps in cloth simulation*, SIGGRAPH 1998.

use crate::real::Real;
use serde::{Deserialize, Serialize};

/// How far the length of a given direction may be from one before it is refused.
const UNIT_TOLERANCE: f64 = 1e-6;

/// How one node may move.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "RawConstraint", into = "RawConstraint")]
pub enum Constraint<const B: usize> {
    /// In any direction.
    Free,
    /// Not at all.
    Fixed,
    /// Along this unit vector `t`: the projection is `t tᵀ`.
    Line([f64; B]),
    /// Perpendicular to this unit vector `n`: the projection is `I − n nᵀ`.
    Plane([f64; B]),
}

impl<const B: usize> Constraint<B> {
    /// The allowed part of `v`.
    #[inline]
    #[must_use]
    pub fn project(&self, v: [f64; B]) -> [f64; B] {
        match self {
            Self::Free => v,
            Self::Fixed => [0.0; B],
            Self::Line(t) => {
                let s = inner(t, &v);
                t.map(|t| t * s)
            }
            Self::Plane(n) => {
                let s = inner(n, &v);
                std::array::from_fn(|k| v[k] - n[k] * s)
            }
        }
    }

    /// Number of independent moves.
    #[must_use]
    pub fn dofs(&self) -> usize {
        match self {
            Self::Free => B,
            Self::Fixed => 0,
            Self::Line(_) => B.min(1),
            Self::Plane(_) => B.saturating_sub(1),
        }
    }

    /// An orthonormal basis of the allowed moves, and their number: [`dofs`](Self::dofs); vectors beyond it are zero.
    #[must_use]
    pub fn basis(&self) -> ([[f64; B]; B], usize) {
        let mut basis = [[0.0; B]; B];
        match self {
            Self::Free => (0..B).for_each(|k| basis[k][k] = 1.0),
            Self::Fixed => {}
            Self::Line(t) => basis[0] = *t,
            Self::Plane(n) => plane_basis(n, &mut basis),
        }
        (basis, self.dofs())
    }

    /// The same constraint with its direction scaled to unit length; `Err` holds a length that is not one.
    fn normalised(self) -> Result<Self, f64> {
        Ok(match self {
            Self::Free | Self::Fixed => self,
            Self::Line(t) => Self::Line(unit(t)?),
            Self::Plane(n) => Self::Plane(unit(n)?),
        })
    }
}

/// A constraint that cannot be imposed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SubspaceError {
    /// There is no such node.
    #[error("node {node} is out of range: there are {n_nodes} nodes")]
    NodeOutOfRange {
        /// The node asked for.
        node: usize,
        /// Number of nodes.
        n_nodes: usize,
    },
    /// The direction of a line or the normal of a plane is not a unit vector (or holds NaN).
    #[error("direction of the constraint on node {node} has length {length}, not 1")]
    NotUnit {
        /// The node it was meant for.
        node: usize,
        /// Euclidean length of the direction.
        length: f64,
    },
}

/// The subspace `W` of allowed moves of `n` nodes with `B` coordinates each.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "RawSubspace", into = "RawSubspace")]
pub struct Subspace<const B: usize> {
    n_nodes: usize,
    /// Constrained nodes, ascending.
    nodes: Vec<usize>,
    /// One constraint per entry of `nodes`, never `Free`.
    constraints: Vec<Constraint<B>>,
}

/// `clone_from` allocates nothing once there were as many constraints.
impl<const B: usize> Clone for Subspace<B> {
    fn clone(&self) -> Self {
        Self { n_nodes: self.n_nodes, nodes: self.nodes.clone(), constraints: self.constraints.clone() }
    }

    fn clone_from(&mut self, source: &Self) {
        self.n_nodes = source.n_nodes;
        self.nodes.clone_from(&source.nodes);
        self.constraints.clone_from(&source.constraints);
    }
}

impl<const B: usize> Subspace<B> {
    /// All of `n_nodes` nodes free.
    #[must_use]
    pub fn new(n_nodes: usize) -> Self {
        Self { n_nodes, nodes: Vec::new(), constraints: Vec::new() }
    }

    /// Constrains one node, or frees it. Directions are scaled to unit length exactly.
    ///
    /// # Errors
    /// [`SubspaceError::NodeOutOfRange`]; [`SubspaceError::NotUnit`] if a direction's length differs from one by more
    /// than 1e-6 or is NaN. The subspace is then unchanged.
    pub fn set(&mut self, node: usize, constraint: Constraint<B>) -> Result<(), SubspaceError> {
        if node >= self.n_nodes {
            let n_nodes = self.n_nodes;
            return Err(SubspaceError::NodeOutOfRange { node, n_nodes });
        }
        let constraint = constraint.normalised().map_err(|length| SubspaceError::NotUnit { node, length })?;
        match (self.nodes.binary_search(&node), constraint) {
            (Ok(at), Constraint::Free) => {
                self.nodes.remove(at);
                self.constraints.remove(at);
            }
            (Ok(at), _) => self.constraints[at] = constraint,
            (Err(_), Constraint::Free) => {}
            (Err(at), _) => {
                self.nodes.insert(at, node);
                self.constraints.insert(at, constraint);
            }
        }
        Ok(())
    }

    /// The constraint on `node`; nodes that do not exist are free.
    #[must_use]
    pub fn get(&self, node: usize) -> Constraint<B> {
        match self.nodes.binary_search(&node) {
            Ok(at) => self.constraints[at],
            Err(_) => Constraint::Free,
        }
    }

    /// Changes the number of nodes: new ones are free, dropped ones take their constraints with them.
    pub fn resize(&mut self, n_nodes: usize) {
        let kept = self.nodes.partition_point(|&node| node < n_nodes);
        self.nodes.truncate(kept);
        self.constraints.truncate(kept);
        self.n_nodes = n_nodes;
    }

    /// Number of nodes, free and constrained.
    #[must_use]
    pub fn n_nodes(&self) -> usize {
        self.n_nodes
    }

    /// Length of a vector of the whole space, `B` per node.
    #[must_use]
    pub fn dim(&self) -> usize {
        self.n_nodes * B
    }

    /// Number of constrained nodes.
    #[must_use]
    pub fn n_constrained(&self) -> usize {
        self.nodes.len()
    }

    /// Dimension of the subspace: number of independent moves of all nodes.
    #[must_use]
    pub fn dofs(&self) -> usize {
        let removed: usize = self.constraints.iter().map(|c| B - c.dofs()).sum();
        self.dim() - removed
    }

    /// Constrained nodes in ascending order, each with its constraint.
    pub fn constrained(&self) -> impl ExactSizeIterator<Item = (usize, &Constraint<B>)> {
        self.nodes.iter().copied().zip(&self.constraints)
    }

    /// `v ← P_W v`.
    ///
    /// # Panics
    /// If `v` is not [`dim`](Self::dim) long.
    pub fn project(&self, v: &mut [f64]) {
        let v = self.nodal_mut(v);
        for (node, constraint) in self.constrained() {
            v[node] = constraint.project(v[node]);
        }
    }

    /// `v ← P_W v` for the part of a vector that begins with entry `first`, made of whole nodes.
    pub(crate) fn project_part<T: Real>(&self, first: usize, v: &mut [T]) {
        let nodes = first / B..(first + v.len()) / B;
        let v = v.as_chunks_mut::<B>().0;
        let from = self.nodes.partition_point(|&node| node < nodes.start);
        for (&node, constraint) in self.nodes[from..].iter().zip(&self.constraints[from..]) {
            if node >= nodes.end {
                return;
            }
            let v = &mut v[node - nodes.start];
            *v = constraint.project(v.map(T::to_f64)).map(T::from_f64);
        }
    }

    /// Writes `(I − P_W) v` of the constrained nodes, `B` entries each in the order of [`constrained`](Self::constrained).
    ///
    /// # Panics
    /// If `v` is not [`dim`](Self::dim) long, or `out` not `B` times [`n_constrained`](Self::n_constrained).
    pub fn project_complement(&self, v: &[f64], out: &mut [f64]) {
        assert_eq!(v.len(), self.dim(), "vector does not fit the subspace");
        assert_eq!(out.len(), B * self.n_constrained());
        let v = v.as_chunks::<B>().0;
        let out = out.as_chunks_mut::<B>().0;
        for ((node, constraint), out) in self.constrained().zip(out) {
            let allowed = constraint.project(v[node]);
            *out = std::array::from_fn(|k| v[node][k] - allowed[k]);
        }
    }

    /// Splits `v` in one pass: `out ← (I − P_W) v` as in [`project_complement`](Self::project_complement), then
    /// `v ← P_W v`.
    ///
    /// # Panics
    /// As [`project_complement`](Self::project_complement).
    pub fn split(&self, v: &mut [f64], out: &mut [f64]) {
        assert_eq!(out.len(), B * self.n_constrained());
        let v = self.nodal_mut(v);
        let out = out.as_chunks_mut::<B>().0;
        for ((node, constraint), out) in self.constrained().zip(out) {
            let allowed = constraint.project(v[node]);
            *out = std::array::from_fn(|k| v[node][k] - allowed[k]);
            v[node] = allowed;
        }
    }

    /// Adds to `v` what [`split`](Self::split) or [`project_complement`](Self::project_complement) took out of it.
    ///
    /// # Panics
    /// As [`project_complement`](Self::project_complement).
    pub fn add_complement(&self, complement: &[f64], v: &mut [f64]) {
        assert_eq!(complement.len(), B * self.n_constrained());
        let v = self.nodal_mut(v);
        for (&node, c) in self.nodes.iter().zip(complement.as_chunks::<B>().0) {
            for k in 0..B {
                v[node][k] += c[k];
            }
        }
    }

    fn nodal_mut<'a>(&self, v: &'a mut [f64]) -> &'a mut [[f64; B]] {
        assert_eq!(v.len(), self.dim(), "vector does not fit the subspace");
        v.as_chunks_mut::<B>().0
    }
}

#[inline]
fn inner<const B: usize>(a: &[f64; B], b: &[f64; B]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Columns of the reflection that takes the unit vector `n` to an axis; that axis' own column is left out.
fn plane_basis<const B: usize>(n: &[f64; B], basis: &mut [[f64; B]; B]) {
    let axis = (0..B).fold(0, |best, k| if n[k].abs() > n[best].abs() { k } else { best });
    let mut v = *n;
    v[axis] += n[axis].signum();
    let square = inner(&v, &v);
    for (vector, column) in basis.iter_mut().zip((0..B).filter(|k| *k != axis)) {
        *vector = std::array::from_fn(|k| f64::from(k == column) - 2.0 * v[k] * v[column] / square);
    }
}

/// `v / |v|`, or the length that is not one. A vector that is a unit vector up to rounding stays as it is, so that
/// reading back a stored subspace changes no bit.
fn unit<const B: usize>(v: [f64; B]) -> Result<[f64; B], f64> {
    let square = inner(&v, &v);
    let length = square.sqrt();
    if (length - 1.0).abs() > UNIT_TOLERANCE || length.is_nan() {
        return Err(length);
    }
    if (square - 1.0).abs() <= 4.0 * f64::EPSILON {
        return Ok(v);
    }
    Ok(v.map(|x| x / length))
}

/// Serialised form: arrays of generic length are not known to serde.
#[derive(Serialize, Deserialize)]
enum RawConstraint {
    Free,
    Fixed,
    Line(Vec<f64>),
    Plane(Vec<f64>),
}

impl<const B: usize> From<Constraint<B>> for RawConstraint {
    fn from(constraint: Constraint<B>) -> Self {
        match constraint {
            Constraint::Free => Self::Free,
            Constraint::Fixed => Self::Fixed,
            Constraint::Line(t) => Self::Line(t.to_vec()),
            Constraint::Plane(n) => Self::Plane(n.to_vec()),
        }
    }
}

impl<const B: usize> TryFrom<RawConstraint> for Constraint<B> {
    type Error = String;

    fn try_from(raw: RawConstraint) -> Result<Self, String> {
        let array =
            |v: Vec<f64>| <[f64; B]>::try_from(v).map_err(|v| format!("direction has {} entries, not {B}", v.len()));
        let constraint = match raw {
            RawConstraint::Free => Self::Free,
            RawConstraint::Fixed => Self::Fixed,
            RawConstraint::Line(t) => Self::Line(array(t)?),
            RawConstraint::Plane(n) => Self::Plane(array(n)?),
        };
        constraint.normalised().map_err(|length| format!("direction has length {length}, not 1"))
    }
}

#[derive(Serialize, Deserialize)]
struct RawSubspace {
    n_nodes: usize,
    constrained: Vec<(usize, RawConstraint)>,
}

impl<const B: usize> From<Subspace<B>> for RawSubspace {
    fn from(w: Subspace<B>) -> Self {
        Self { n_nodes: w.n_nodes, constrained: w.constrained().map(|(i, &c)| (i, c.into())).collect() }
    }
}

impl<const B: usize> TryFrom<RawSubspace> for Subspace<B> {
    type Error = String;

    fn try_from(raw: RawSubspace) -> Result<Self, String> {
        if raw.n_nodes.checked_mul(B).is_none() {
            return Err(format!("{} nodes are too many", raw.n_nodes));
        }
        let mut w = Self::new(raw.n_nodes);
        for (node, constraint) in raw.constrained {
            w.set(node, constraint.try_into()?).map_err(|e| e.to_string())?;
        }
        Ok(w)
    }
}

#[cfg(test)]
mod tests;
