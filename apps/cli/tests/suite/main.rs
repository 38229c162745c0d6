//! The tests of the command line, through the binary, in one program.

mod support;

mod bad_bodies;
mod bad_input;
mod bodies;
mod body_meshes;
mod body_time;
mod cube;
mod generate;
mod mesh;
mod mesh_files;
mod mesh_undo;
mod runs;
mod schema;
mod sheets;
mod solve;
mod steering;
mod streams;
