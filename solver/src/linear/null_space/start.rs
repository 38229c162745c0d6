//! Where to start from: the exact block solved for, and moves that are known beforehand made use of.

use super::{Coupled, NullSpace, NullSpaceError, NullSpaceWorkspace, finite};
use crate::LinearOperator;
use crate::precondition::Identity;
use crate::vector::{axpy, dot, norm2};

/// A guess that adds less than this part of its energy to the block and the guesses before it is left out.
const DEPENDENT: f64 = 1e-10;
/// Solutions for the exact block: the second one mends what the first has lost to the stiffness of the small body.
const REFINED: usize = 2;

/// Vectors of a start.
#[derive(Debug, Default)]
pub(super) struct Vectors {
    residual: Vec<f64>,
    /// A move of the exact block, zero elsewhere, and the operator's product with it.
    follow: Vec<f64>,
    product: Vec<f64>,
    guessed: Vec<Conjugate>,
}

/// Moves along guesses, conjugate to those before it and to the block.
#[derive(Debug, Default)]
struct Conjugate {
    direction: Vec<f64>,
    /// The operator's product with it, and their product.
    image: Vec<f64>,
    energy: f64,
}

/// Moves the start `x` of [`null_space_cg`](super::null_space_cg), whose other arguments these are: solves for the unknowns of
/// the exact block, the others held; then adds that combination of `guesses`, moves of the big body, that leaves the least
/// energy, the exact block following each. Costs one product, and one for each guess; a guess that no combination makes use of
/// changes nothing. `a` is the operator of the matrix that the form has read last.
///
/// Returns the norm of the forces that the exact block alone leaves on the big body, a scale for the tolerance. The right side
/// is none: what prescribes the place of a stiff body is a force by its stiffness.
///
/// # Errors
/// See [`NullSpaceError`].
///
/// Source of the combination: Fischer, *Projection techniques for iterative solution of Ax = b with successive right-hand
/// sides*, Comput. Methods Appl. Mech. Engrg. 163 (1998), whose vectors are those of earlier solutions.
pub fn null_space_start<const B: usize>(
    form: &NullSpace<B>,
    a: &(impl LinearOperator + ?Sized),
    (b_big, b_small, g): (&[f64], &[f64], &[f64]),
    (x_big, x_small): (&mut [f64], &mut [f64]),
    guesses: &[&[f64]],
    ws: &mut NullSpaceWorkspace,
) -> Result<f64, NullSpaceError> {
    let n = form.prepare(a, (b_big, b_small, g), (&*x_big, &*x_small), ws)?;
    for guess in guesses {
        super::check_length("a guess", guess.len(), n)?;
    }
    let NullSpaceWorkspace { cg, z, right_side, start, scratch } = ws;
    let coupled = Coupled { form, a, m: &Identity, scratch };
    let Vectors { residual, follow, product, guessed } = start;
    residual.resize(z.len(), 0.0);
    product.resize(z.len(), 0.0);
    follow.clear();
    follow.resize(z.len(), 0.0);
    LinearOperator::apply_on(&coupled, cg.team(), z, residual);
    for (r, b) in residual.iter_mut().zip(&*right_side) {
        *r = b - *r;
    }
    let mut solve_block = |force: &mut [f64], sign: f64, moved: &mut [f64]| {
        let scratch = &mut *coupled.scratch();
        form.block.solve(force, follow, &mut scratch.block);
        form.apply_to_block(follow, product, scratch);
        axpy(-1.0, product, force);
        axpy(sign, follow, moved);
    };
    for _ in 0..REFINED {
        solve_block(residual, 1.0, z);
    }
    form.w.project(residual);
    let scale = finite(norm2(residual), "the residual", residual, 0)?;

    guessed.resize_with(guesses.len(), Conjugate::default);
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
        let whole = dot(direction, image);
        for _ in 0..REFINED {
            solve_block(image, -1.0, direction);
        }
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
    Ok(scale)
}
