//! A better start from moves that are known beforehand.

use super::{Coupled, NullSpace, NullSpaceError, NullSpaceWorkspace};
use crate::LinearOperator;
use crate::precondition::Identity;
use crate::vector::{axpy, dot};

/// A guess that adds less than this part of its energy to those before it is left out.
const DEPENDENT: f64 = 1e-10;

/// Moves along guesses, conjugate to those before it and to the block.
#[derive(Debug, Default)]
pub(super) struct Conjugate {
    direction: Vec<f64>,
    /// The operator's product with it, and their product.
    image: Vec<f64>,
    energy: f64,
}

/// Moves the start `x` of [`null_space_cg`](super::null_space_cg), whose other arguments these are, by that combination of moves
/// of the big body that leaves the least energy, the exact block following each. Moves that no combination makes use of cost
/// two products each, and change nothing. Best after [`null_space_start`](super::null_space_start).
///
/// # Errors
/// See [`NullSpaceError`].
///
/// Source: Fischer, *Projection techniques for iterative solution of Ax = b with successive right-hand sides*, Comput. Methods
/// Appl. Mech. Engrg. 163 (1998), whose vectors are those of earlier solutions.
pub fn null_space_guess<const B: usize>(
    form: &NullSpace<B>,
    a: &(impl LinearOperator + ?Sized),
    (b_big, b_small, g): (&[f64], &[f64], &[f64]),
    (x_big, x_small): (&mut [f64], &mut [f64]),
    guesses: &[&[f64]],
    ws: &mut NullSpaceWorkspace,
) -> Result<(), NullSpaceError> {
    let n = form.prepare(a, (b_big, b_small, g), (&*x_big, &*x_small), ws)?;
    for guess in guesses {
        super::check_length("a guess", guess.len(), n)?;
    }
    let NullSpaceWorkspace { cg, z, right_side, residual, guessed, scratch } = ws;
    guessed.resize_with(guesses.len(), Conjugate::default);
    let coupled = Coupled { form, a, m: &Identity, scratch };
    residual.resize(z.len(), 0.0);
    LinearOperator::apply_on(&coupled, cg.team(), z, residual);
    for (r, b) in residual.iter_mut().zip(&*right_side) {
        *r = b - *r;
    }
    form.w.project(residual);
    let mut kept = 0;
    for guess in guesses {
        let (before, rest) = guessed.split_at_mut(kept);
        let Conjugate { direction, image, energy } = &mut rest[0];
        direction.clear();
        direction.extend_from_slice(guess);
        direction.resize(z.len(), 0.0);
        form.w.project(direction);
        image.resize(z.len(), 0.0);
        LinearOperator::apply_on(&coupled, cg.team(), direction, image);
        // The block follows: `right_side` has been used, and is room for its moves.
        right_side.fill(0.0);
        form.block.solve(image, right_side, &mut coupled.scratch().block);
        axpy(-1.0, right_side, direction);
        *energy = LinearOperator::apply_dot_on(&coupled, cg.team(), direction, image);
        let whole = *energy;
        for other in before {
            let part = dot(direction, &other.image) / other.energy;
            axpy(-part, &other.direction, direction);
            axpy(-part, &other.image, image);
        }
        *energy = dot(direction, image);
        if !(*energy > DEPENDENT * whole && energy.is_finite()) {
            continue;
        }
        let step = dot(direction, residual) / *energy;
        axpy(step, direction, z);
        form.w.project(image);
        axpy(-step, image, residual);
        kept += 1;
    }
    x_big.copy_from_slice(&z[..n]);
    form.place(z, Some(g), x_small);
    Ok(())
}
