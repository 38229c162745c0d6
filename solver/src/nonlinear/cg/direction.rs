//! Search directions of nonlinear conjugate gradients.

use super::NonlinearCgWorkspace;
use crate::vector::{dot, dot_pair};

/// A gradient that keeps this much of the last one, `|g₁·M⁻¹g₀| / g₁·M⁻¹g₁`, makes Fletcher-Reeves restart.
///
/// Source: Nocedal & Wright, *Numerical Optimization*, 2nd ed. (2006), eq. (5.52).
const STILL_PARALLEL: f64 = 0.1;

/// How the next direction follows from the last one, `d₁ = −M⁻¹g₁ + β d₀`, with `y = g₁ − g₀`.
///
/// Every rule restarts, `d₁ = −M⁻¹g₁`, where the direction that it makes does not descend or the search along it fails; on a
/// quadratic energy with exact steps all are linear conjugate gradients.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Direction {
    /// `β = g₁·M⁻¹g₁ / g₀·M⁻¹g₀`. Restarts where two successive gradients are far from orthogonal,
    /// `|g₁·M⁻¹g₀| ≥ 0.1 g₁·M⁻¹g₁`, without which it may creep. Wants a search with `|φ'(t)| ≤ c₂ |φ'(0)|`, `c₂ < 1/2`.
    ///
    /// Source: Fletcher & Reeves, Comput. J. 7 (1964).
    FletcherReeves,
    /// `β = max(0, g₁·M⁻¹y / g₀·M⁻¹g₀)`: restarts by itself where progress is slow.
    ///
    /// Source: Nocedal & Wright, *Numerical Optimization*, 2nd ed. (2006), eqs. (5.44), (5.45).
    PolakRibierePlus,
    /// `β = max((y·M⁻¹g₁ − 2 (y·M⁻¹y)(d₀·g₁)/(d₀·y)) / (d₀·y), −1 / (‖d₀‖_M min(η, ‖g₀‖_M⁻¹)))`: descends whatever the
    /// search, `g·d ≤ −7/8 g·M⁻¹g` without the truncation. Restarts where `d₀·y ≤ 0`, which the Wolfe conditions exclude.
    ///
    /// Source: Hager & Zhang, SIAM J. Optim. 16 (2005), eqs. (1.3) to (1.6), in the variables `M^½ x`.
    HagerZhang {
        /// `η > 0`, in the unit of `‖g‖_M⁻¹`; published as 0.01.
        eta: f64,
    },
    /// `β = max((y·M⁻¹g₁ − (y·M⁻¹y)(d₀·g₁)/(d₀·y)) / (d₀·y), ½ d₀·g₁ / ‖d₀‖²_M)`: the direction closest to that of the
    /// scaled memoryless BFGS method. Restarts where `d₀·y ≤ 0`.
    ///
    /// Source: Dai & Kou, SIAM J. Optim. 23 (2013), with `τ = s·y/‖s‖²`, in the variables `M^½ x`.
    DaiKou,
    /// The minimiser of the quadratic model over the span of `M⁻¹g₁` and `d₀`, its length included: two Hessian products
    /// and no β. Where the model has no minimiser there, the direction is `−M⁻¹g₁`. [`StepModel`](super::StepModel) then
    /// matters for nothing but the length of that.
    ///
    /// Source: the step of Zhang et al., arXiv 2604.19892 (2026); on a quadratic energy it is conjugate gradients in the
    /// form of Nocedal & Wright, section 5.1.
    Subspace,
}

/// What the rules remember of the last direction.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Memory {
    /// `g·M⁻¹g` at the last iterate.
    pub gz: f64,
    /// `‖d‖²_M`.
    pub dd: f64,
}

impl Memory {
    /// After a restart, `d = −M⁻¹g`.
    pub fn steepest(gz: f64) -> Self {
        Self { gz, dd: gz }
    }
}

/// `β` and the memory that goes with it. The workspace holds the old gradient and its `z = M⁻¹g`, the new ones as trials, and
/// the last direction.
pub(super) fn conjugate(
    direction: Direction,
    memory: Memory,
    new_gz: f64,
    cross: f64,
    ws: &mut NonlinearCgWorkspace,
) -> (f64, Memory) {
    let beta = match direction {
        Direction::FletcherReeves if cross.abs() >= STILL_PARALLEL * new_gz => 0.0,
        Direction::FletcherReeves => new_gz / memory.gz,
        Direction::PolakRibierePlus => ((new_gz - cross) / memory.gz).max(0.0),
        Direction::HagerZhang { eta } => {
            let floor = -1.0 / (memory.dd.sqrt() * eta.min(memory.gz.sqrt()));
            descending(2.0, floor, ws)
        }
        Direction::DaiKou => {
            let floor = 0.5 * dot(&ws.d, &ws.trial_g) / memory.dd;
            descending(1.0, floor, ws)
        }
        Direction::Subspace => 0.0, // made at the next iterate, from the model there
    };
    // A product that overflows restarts.
    let beta = if beta.is_finite() { beta } else { 0.0 };
    // ‖−z + β d‖²_M, where z·M d = g·d.
    let dd = new_gz - 2.0 * beta * dot(&ws.d, &ws.trial_g) + beta * beta * memory.dd;
    (beta, Memory { gz: new_gz, dd: if dd > 0.0 { dd } else { new_gz } })
}

/// `max((y·M⁻¹g₁ − factor (y·M⁻¹y)(d·g₁)/(d·y)) / (d·y), floor)`, zero where `d·y` is not positive.
fn descending(factor: f64, floor: f64, ws: &mut NonlinearCgWorkspace) -> f64 {
    // The trial point and the Hessian product are not needed any more: their places hold y and M⁻¹y.
    let NonlinearCgWorkspace { g, trial_g, z, trial_z, d, trial_x: y, hd: my, .. } = ws;
    difference(trial_g, g, y);
    difference(trial_z, z, my);
    let (dy, yz) = dot_pair(y, d, trial_z);
    if dy <= 0.0 || dy.is_nan() {
        return 0.0;
    }
    let beta = (yz - factor * dot(y, my) * (dot(d, trial_g) / dy)) / dy;
    beta.max(floor)
}

fn difference(a: &[f64], b: &[f64], out: &mut [f64]) {
    for (out, (a, b)) in out.iter_mut().zip(a.iter().zip(b)) {
        *out = a - b;
    }
}

/// Coefficients `(a, b)` of the minimiser `−a z + b d` of `g·p + ½ p·H p`, from `g·z`, `g·d` and the products `z·H z`,
/// `z·H d`, `d·H d`; `None` unless `H` is positive definite on the span, beyond rounding errors.
pub(super) fn plane_minimiser(gz: f64, gd: f64, zhz: f64, zhd: f64, dhd: f64) -> Option<(f64, f64)> {
    let determinant = zhz * dhd - zhd * zhd;
    let definite = zhz > 0.0 && dhd > 0.0 && determinant > 16.0 * f64::EPSILON * zhz * dhd;
    let (a, b) = ((gz * dhd - gd * zhd) / determinant, (gz * zhd - gd * zhz) / determinant);
    (definite && a.is_finite() && b.is_finite()).then_some((a, b))
}
