//! Where the time of steps goes.

use std::time::Instant;

/// Seconds and calls of one stage.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spent {
    /// Wall time, s.
    pub seconds: f64,
    /// How often it was entered.
    pub calls: u64,
}

impl Spent {
    /// Adds a call that began at `since`, and returns the present.
    #[inline]
    pub(crate) fn add(&mut self, since: Instant) -> Instant {
        let now = Instant::now();
        self.seconds += (now - since).as_secs_f64();
        self.calls += 1;
        now
    }
}

/// What an [`Integrator`](super::Integrator) has spent, by stage. Stages do not overlap; what is in none of them is the
/// arithmetic on whole vectors.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StageTimes {
    /// Elastic forces, and in Newton's method energies.
    pub forces: Spent,
    /// The stiffness of the body, whole or lazy.
    pub linearize: Spent,
    /// Following the stiffness: the matrix of the step and the preconditioner of a linearised step.
    pub matrix: Spent,
    /// Solving: conjugate gradients, in Newton's method with its preconditioner and line search.
    pub solve: Spent,
}

impl StageTimes {
    /// Adds those of one Newton iteration that began at `since`: what is not of its parts was spent solving.
    pub(super) fn add_newton(&mut self, parts: &Self, since: Instant) {
        let mut rest = since.elapsed().as_secs_f64();
        let pairs = [
            (&mut self.forces, parts.forces),
            (&mut self.linearize, parts.linearize),
            (&mut self.matrix, parts.matrix),
        ];
        for (sum, part) in pairs {
            *sum = Spent { seconds: sum.seconds + part.seconds, calls: sum.calls + part.calls };
            rest -= part.seconds;
        }
        self.solve = Spent { seconds: self.solve.seconds + rest.max(0.0), calls: self.solve.calls + 1 };
    }
}
