//! Energy of a rod under load as a function of its positions, its angles in equilibrium.

use super::{HeldEnds, Rod, RodError, RodLoad, Tangent};
use stylet_solver::LinearOperator;
use stylet_solver::energy::{BlockHessian, Energy};
use stylet_solver::sparse::BlockCsr;

/// Bending, stretch and twist of a rod and the potential of its load, for the methods that minimise.
///
/// At each position the angles are [settled](Rod::settle_angles) first, so that the energy is a function of positions. Where
/// they do not settle the energy is infinite and the forces are NaN. Where a rod has more than one equilibrium of angles the energy
/// may jump.
#[derive(Debug)]
pub struct RodPotential<'a> {
    rod: &'a mut Rod,
    base_director: [f64; 3],
    load: &'a RodLoad,
    ends: &'a HeldEnds,
    twist: Twist<'a>,
    matrix: BlockCsr<3>,
    /// Angle of the last edge about the axis of the couple.
    turned: f64,
    round_off: f64,
}

/// What twist is to the positions.
#[derive(Clone, Copy, Debug)]
pub(super) enum Twist<'a> {
    /// Part of the energy.
    Implicit,
    /// These forces, whatever the positions.
    Explicit(&'a [f64]),
}

impl<'a> RodPotential<'a> {
    /// A rod under load, its base director (see [`Rod::energy`]) and how its ends are kept from spinning.
    ///
    /// # Errors
    /// [`RodError::Shape`] if the load does not fit, [`RodError::Entry`] if it is not finite.
    pub fn new(
        rod: &'a mut Rod,
        base_director: [f64; 3],
        load: &'a RodLoad,
        ends: &'a HeldEnds,
    ) -> Result<Self, RodError> {
        super::error::shape("loads", load.forces.len(), 3 * rod.n_nodes())?;
        super::check_finite("load", &load.forces)?;
        super::check_finite("couple", &load.couple)?;
        let matrix = BlockCsr::new(0);
        Ok(Self { rod, base_director, load, ends, twist: Twist::Implicit, matrix, turned: 0.0, round_off: 0.0 })
    }

    pub(super) fn with(mut self, twist: Twist<'a>, matrix: BlockCsr<3>) -> Self {
        (self.twist, self.matrix) = (twist, matrix);
        self
    }

    pub(super) fn matrix_mut(&mut self) -> &mut BlockCsr<3> {
        &mut self.matrix
    }

    pub(super) fn into_matrix(self) -> BlockCsr<3> {
        self.matrix
    }

    fn settles(&mut self, x: &[f64]) -> bool {
        self.rod.settle_held(x, &self.base_director, self.ends).is_ok()
    }
}

impl Energy for RodPotential<'_> {
    fn dim(&self) -> usize {
        3 * self.rod.n_nodes()
    }

    fn value(&mut self, x: &[f64]) -> f64 {
        if !self.settles(x) {
            return f64::INFINITY;
        }
        let mut energy = self.rod.energy(x, &self.base_director);
        if let Twist::Explicit(force) = self.twist {
            energy -= self.rod.twist_energy() + force.iter().zip(x).map(|(f, x)| f * x).sum::<f64>();
        }
        let dead: f64 = self.load.forces.iter().zip(x).map(|(f, x)| (f * x).abs()).sum();
        self.round_off = 4.0 * f64::EPSILON * dead;
        let total = energy + self.load.potential(x, self.turned);
        if total.is_nan() { f64::INFINITY } else { total }
    }

    fn gradient(&mut self, x: &[f64], g: &mut [f64]) {
        if !self.settles(x) {
            return g.fill(f64::NAN);
        }
        // Whole turns are told by where the iteration has come by.
        self.turned = self.load.angle(x, self.turned);
        g.fill(0.0);
        self.rod.add_force(x, &self.base_director, g);
        match self.twist {
            Twist::Implicit => self.rod.add_twist_force(x, &self.base_director, g),
            Twist::Explicit(force) => g.iter_mut().zip(force).for_each(|(g, f)| *g += f),
        }
        self.load.add_force(x, g);
        g.iter_mut().for_each(|g| *g = -*g);
    }

    fn linearize(&mut self, x: &[f64]) {
        // Angles that do not settle here did not in the gradient either: the tangent at those there are is as good as any.
        let _ = self.settles(x);
        let implicit = matches!(self.twist, Twist::Implicit);
        self.rod.tangent(x, &self.base_director, Tangent::Exact, implicit, &mut self.matrix);
        self.load.add_tangent(x, &mut self.matrix);
    }

    fn hessian_apply(&self, p: &[f64], hp: &mut [f64]) {
        self.matrix.apply(p, hp);
    }

    fn value_round_off(&self) -> f64 {
        self.round_off
    }
}

impl BlockHessian<3> for RodPotential<'_> {
    fn matrix(&self) -> &BlockCsr<3> {
        &self.matrix
    }
}
