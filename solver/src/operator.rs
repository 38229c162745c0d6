//! What a solver knows of a matrix.

use crate::real::Real;
use crate::team::Team;
use crate::vector;

/// A dense `B x B` block, rows first: `block[i][j]` is row `i`, column `j`.
pub type Block<const B: usize, T = f64> = [[T; B]; B];

/// A square linear map, known only by what it does to a vector.
pub trait LinearOperator<T: Real = f64>: Sync {
    /// Number of rows, equal to the number of columns.
    fn dim(&self) -> usize;

    /// Overwrites `y` with `A x`; both have length [`dim`](Self::dim).
    fn apply(&self, x: &[T], y: &mut [T]);

    /// Overwrites `y` with `A x` and returns `xᵀA x`, summed in the shape of [`vector::dot`].
    fn apply_dot(&self, x: &[T], y: &mut [T]) -> f64 {
        self.apply(x, y);
        vector::dot(x, y)
    }

    /// [`apply`](Self::apply) by all members of a team, with the same bits.
    fn apply_on(&self, team: &Team, x: &[T], y: &mut [T]) {
        let _ = team;
        self.apply(x, y);
    }

    /// Overwrites `y` with the products of `k` vectors, all interleaved: entry `i` of vector `c` is `x[i * k + c]`. Each product
    /// has the bits of [`apply`](Self::apply). `scratch` holds at least `2 dim` entries and is overwritten.
    ///
    /// This default takes one vector after the other; an operator whose matrix is read once for all of them is faster.
    ///
    /// # Panics
    /// If `scratch` is too short.
    fn apply_many(&self, team: &Team, k: usize, x: &[T], y: &mut [T], scratch: &mut [T]) {
        let n = self.dim();
        let (one, product) = scratch[..2 * n].split_at_mut(n);
        for c in 0..k {
            for (one, group) in one.iter_mut().zip(x.chunks_exact(k)) {
                *one = group[c];
            }
            self.apply_on(team, one, product);
            for (product, group) in product.iter().zip(y.chunks_exact_mut(k)) {
                group[c] = *product;
            }
        }
    }

    /// [`apply_dot`](Self::apply_dot) by all members of a team, with the same bits.
    fn apply_dot_on(&self, team: &Team, x: &[T], y: &mut [T]) -> f64 {
        self.apply_on(team, x, y);
        team.dot(x, y)
    }
}
