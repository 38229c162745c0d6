//! Scenes of flexible needles, run as the command line runs them, on coarse meshes.

mod bad_input;
mod built_in;
mod resume;
mod runs;
mod support;
