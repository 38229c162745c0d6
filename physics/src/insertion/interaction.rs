//! What the tissue does to a needle that slides through it or cuts it.

/// Forces between needle and tissue, by place in the undeformed body and by region.
pub trait Interaction: Send + Sync {
    /// Dynamic friction along the shaft, N/m, zero or more.
    fn friction(&self, region: u32, at: &[f64; 3]) -> f64;
    /// Viscous friction along the shaft, N s/m^2, zero or more.
    fn viscosity(&self, region: u32, at: &[f64; 3]) -> f64;
    /// Force that a tip needs to cut on from `at`, N, zero or more: large within skin and capsules.
    fn cutting(&self, region: u32, at: &[f64; 3]) -> f64;
}

/// The same everywhere.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct UniformInteraction {
    /// Dynamic friction, N/m.
    pub friction: f64,
    /// Viscous friction, N s/m^2.
    pub viscosity: f64,
    /// Cutting force, N.
    pub cutting: f64,
}

impl Interaction for UniformInteraction {
    fn friction(&self, _: u32, _: &[f64; 3]) -> f64 {
        self.friction
    }

    fn viscosity(&self, _: u32, _: &[f64; 3]) -> f64 {
        self.viscosity
    }

    fn cutting(&self, _: u32, _: &[f64; 3]) -> f64 {
        self.cutting
    }
}
