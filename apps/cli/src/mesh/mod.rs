//! `stylet mesh`: boxes, meshes of shapes and contours, refinement and coarsening, quality, conversion, needle remeshing.

pub mod args;
mod boxes;
mod coarsen;
mod convert;
mod feature;
mod files;
mod generate;
mod path;
mod picture;
mod quality;
mod refine;
mod remesh;
mod source;

use crate::args::Cli;
use crate::exit::{Exit, Failure};
use crate::output;
use args::{MeshArgs, MeshCommand};
use clap::CommandFactory as _;

/// Does what was asked for.
///
/// # Errors
/// Bad input, Ctrl-C: one line and the exit code.
pub fn execute(args: &MeshArgs) -> Result<Exit, Failure> {
    match &args.command {
        None => help(),
        Some(MeshCommand::Box(args)) => boxes::execute(args),
        Some(MeshCommand::Generate(args)) => generate::execute(args),
        Some(MeshCommand::Refine(args)) => refine::execute(args),
        Some(MeshCommand::Quality(args)) => quality::execute(args),
        Some(MeshCommand::Coarsen(args)) => coarsen::execute(args),
        Some(MeshCommand::Convert(args)) => convert::execute(args),
        Some(MeshCommand::Remesh(args)) => remesh::execute(args),
    }
}

fn help() -> Result<Exit, Failure> {
    let mut command = Cli::command();
    let help = command.find_subcommand_mut("mesh").map(|mesh| mesh.render_help().to_string());
    output::print(&help.unwrap_or_default()).map(|()| Exit::Done)
}
