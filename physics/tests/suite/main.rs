//! The tests of this crate in one program: laws and bodies are compiled once for all of them.

mod insertion;
mod support;

mod antiplane;
mod body_change;
mod cantilever;
mod convergence;
mod cook;
mod crush;
mod custom_material;
mod diagnosis;
mod energy;
mod loads;
mod material_derivatives;
mod material_inversion;
mod material_points;
mod patch;
mod plane_stress;
mod regions;
mod rod_angles;
mod rod_buckling;
mod rod_derivatives;
mod rod_dynamics;
mod rod_statics;
mod slab_load;
mod solid_loads;
mod stability;
mod statics;
mod stick_slip;
mod time_stepping;
mod viscous;
