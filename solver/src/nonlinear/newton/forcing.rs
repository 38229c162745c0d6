//! How accurately Newton's equations are solved.

use crate::nonlinear::progress::Norms;

/// `γ` and `α` of the second choice of Eisenstat & Walker.
const GAMMA: f64 = 0.9;
const ALPHA: f64 = 2.0;
/// The last forcing term holds the next one up while it promises more than this.
const HOLD_ABOVE: f64 = 0.1;

/// The relative residual `η_k` that a linear solve may leave: at most [`NewtonSettings::forcing`](super::NewtonSettings::forcing),
/// and never less than half of what the stopping rule asks for.
///
/// Source: Eisenstat & Walker, SIAM J. Sci. Comput. 17 (1996).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Forcing {
    /// Always the largest: linear convergence, the cheapest for loose tolerances.
    Constant,
    /// `√(|g_k| / |g₀|)`: superlinear convergence, free of units.
    Root,
    /// Choice 2, `0.9 (|g_k| / |g_{k−1}|)²`, held up by `0.9 η²_{k−1}` while that is above 0.1: nearly quadratic convergence.
    Contraction,
}

/// The forcing term from iterate to iterate.
pub(super) struct Accuracy {
    rule: Forcing,
    largest: f64,
    start: f64,
    /// Residual and forcing term of the last iterate.
    last: Option<(f64, f64)>,
}

impl Accuracy {
    pub fn new(rule: Forcing, largest: f64, start: Norms) -> Self {
        Self { rule, largest, start: start.residual, last: None }
    }

    pub fn next(&mut self, norms: Norms, threshold: f64) -> f64 {
        let eta = match (self.rule, self.last) {
            (Forcing::Constant, _) | (Forcing::Contraction, None) => self.largest,
            (Forcing::Root, _) => (norms.residual / self.start).sqrt().min(self.largest),
            (Forcing::Contraction, Some((residual, eta))) => {
                let held = GAMMA * eta.powf(ALPHA);
                let wanted = GAMMA * (norms.residual / residual).powf(ALPHA);
                (if held > HOLD_ABOVE { wanted.max(held) } else { wanted }).min(self.largest)
            }
        };
        self.last = Some((norms.residual, eta));
        eta.max((0.5 * threshold / norms.residual).min(self.largest))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn norms(residual: f64) -> Norms {
        Norms { residual, reaction: 0.0 }
    }

    fn terms(rule: Forcing, residuals: &[f64]) -> Vec<f64> {
        let mut accuracy = Accuracy::new(rule, 0.5, norms(residuals[0]));
        residuals.iter().map(|&r| accuracy.next(norms(r), 1e-9)).collect()
    }

    #[test]
    fn terms_are_those_of_the_formulas() {
        let residuals = [4.0, 2.0, 0.04, 0.0004, 1e-9];
        assert_eq!(terms(Forcing::Constant, &residuals), [0.5; 5]);
        let root = terms(Forcing::Root, &residuals);
        let expected = [0.5, 0.5, 0.1, 0.01, 0.5]; // the last: half of the threshold is enough
        assert!(root.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-15), "{root:?}");
        let second = terms(Forcing::Contraction, &residuals);
        // 0.9 · 0.5² is held, then 0.9 · 0.02² would be below 0.9 · 0.225² = 0.046, which is no longer above 0.1.
        let expected = [0.5, 0.225, 0.9 * 4e-4, 0.9 * 1e-4, 0.5];
        assert!(second.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-15), "{second:?}");
    }
}
