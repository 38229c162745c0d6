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

    /// [`apply_dot`](Self::apply_dot) by all members of a team, with the same bits.
    fn apply_dot_on(&self, team: &Team, x: &[T], y: &mut [T]) -> f64 {
        self.apply_on(team, x, y);
        team.dot(x, y)
    }
}
