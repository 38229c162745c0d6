//! What a moving body conserves, and how far it is from balance.

use super::Body;
use super::element::Group;
use crate::lanes::LANES;
use crate::material::Hyperelastic;
use stylet_solver::vector;

impl<const D: usize, const N: usize, M: Hyperelastic<D>> Body<D, N, M> {
    /// Kinetic energy `v.M v / 2`, J, at the velocity `v` (m/s, flat).
    ///
    /// # Panics
    /// If `v` does not have `D` entries per vertex.
    pub fn kinetic_energy(&self, v: &[f64]) -> f64 {
        let mut momentum = vec![0.0; v.len()];
        self.apply_mass(v, &mut momentum);
        0.5 * vector::dot(v, &momentum)
    }

    /// Linear momentum, kg m/s, at the velocity `v`.
    ///
    /// # Panics
    /// If `v` does not have `D` entries per vertex.
    pub fn momentum(&self, v: &[f64]) -> [f64; D] {
        self.check_len(v);
        let mut total = [0.0; D];
        // Columns of the consistent matrix sum to the lumped masses.
        for (m, v) in self.lumped_mass().iter().zip(v.as_chunks::<D>().0) {
            for k in 0..D {
                total[k] += m * v[k];
            }
        }
        total
    }

    /// Angular momentum about the origin, kg m^2/s, at the displacement `u` (m) and the velocity `v` (m/s) of a body at
    /// rest at `points`: the components `x_i p_j - x_j p_i` for `(i, j)` = (1, 2), (2, 0), (0, 1) in three dimensions, the last of
    /// them alone in two, none in one; entries beyond are zero.
    ///
    /// # Panics
    /// If a length is not that of the body.
    pub fn angular_momentum(&self, points: &[[f64; D]], u: &[f64], v: &[f64]) -> [f64; 3] {
        self.check_len(u);
        assert_eq!(points.len(), self.n_vertices(), "one place at rest per vertex");
        let mut p = vec![0.0; v.len()];
        self.apply_mass(v, &mut p);
        let mut total = [0.0; 3];
        for ((rest, u), p) in points.iter().zip(u.as_chunks::<D>().0).zip(p.as_chunks::<D>().0) {
            let x = |i: usize| rest[i] + u[i];
            let moment = |i: usize, j: usize| x(i) * p[j] - x(j) * p[i];
            if D == 3 {
                total[0] += moment(1, 2);
                total[1] += moment(2, 0);
                total[2] += moment(0, 1);
            } else if D == 2 {
                total[0] += moment(0, 1);
            }
        }
        total
    }

    /// Elastic force that the `load` (N, flat) does not balance at the displacement `u`, written to `residual`: `dW/du - f`.
    ///
    /// # Panics
    /// If a length is not `D` entries per vertex.
    pub fn residual(&mut self, u: &[f64], load: &[f64], residual: &mut [f64]) {
        self.check_len(load);
        self.internal_force(u, residual);
        vector::axpy(-1.0, load, residual);
    }

    /// Size of the rounding errors in elastic forces near rest, N (2-norm over the body): an error of one unit in the last
    /// place of every deformation gradient. No residual comes below a small multiple of it.
    pub fn force_round_off(&self) -> f64 {
        let mut square = 0.0;
        for group in &self.elements.groups {
            let stiffness = self.moduli[group.material as usize].axial;
            for lane in 0..LANES {
                let gradients = group.gradients.iter().flatten().map(|g| g[lane] * g[lane]).sum::<f64>();
                square += (stiffness * group.weight[lane]).powi(2) * gradients;
            }
        }
        f64::EPSILON * square.sqrt()
    }

    /// Size of the rounding errors in the strain energy near rest, J: one unit in the last place of the modulus in every
    /// element, whose terms cancel where little is strained.
    pub fn energy_round_off(&self) -> f64 {
        let of_group =
            |group: &Group<D, N>| self.moduli[group.material as usize].axial * group.weight.iter().sum::<f64>();
        f64::EPSILON * self.elements.groups.iter().map(of_group).sum::<f64>()
    }
}
