//! What a step did.

/// Energies and momentum of a body in motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Balance<const D: usize> {
    /// Strain energy, J.
    pub strain: f64,
    /// Kinetic energy, J.
    pub kinetic: f64,
    /// `-f.u`, J: the potential of the load, gravity in it.
    pub load: f64,
    /// Linear momentum, kg m/s.
    pub momentum: [f64; D],
}

impl<const D: usize> Balance<D> {
    /// All energies, J: constant without damping under a dead load.
    pub fn total(&self) -> f64 {
        self.strain + self.kinetic + self.load
    }
}

/// What a step did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepReport<const D: usize> {
    /// Time at its end, s.
    pub t: f64,
    /// Its length, s.
    pub dt: f64,
    /// Parts that it was made of: 1 unless it had to be halved.
    pub substeps: u32,
    /// How often an attempt was given up and its length halved, for failure or (in adaptive steps) for its error.
    pub halvings: u32,
    /// Residual of the last solve, N.
    pub residual: f64,
    /// What it was compared with, N.
    pub threshold: f64,
    /// Iterations of conjugate gradients.
    pub iterations: usize,
    /// Newton steps; one for each linearised part.
    pub newton_iterations: usize,
    /// Parts whose Newton iteration ended above the tolerance, and were accepted because elements are inverted there.
    pub unconverged: u32,
    /// Element stiffnesses that were evaluated.
    pub elements_updated: u64,
    /// Estimate of the displacement error that the last part has added, m.
    pub error: f64,
    /// Energies and momentum at the end, if asked for.
    pub balance: Option<Balance<D>>,
}
