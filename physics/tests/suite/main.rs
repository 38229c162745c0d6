//! The tests of this crate in one program: laws and bodies are compiled once for all of them.

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
mod numbering;
mod patch;
mod plane_stress;
mod regions;
mod slab_load;
mod solid_loads;
mod stability;
mod statics;
mod time_stepping;
mod viscous;
