//! The arguments.

use crate::mesh::args::MeshArgs;
use crate::solve::args::SolveArgs;
use clap::{Args, Parser, Subcommand};
use std::path::PathBuf;

/// More threads than this are a typing error.
const MOST_THREADS: usize = 1024;

const EXAMPLES: &str = "\
Examples:
  stylet run slab2d-insertion                       push a needle 70 mm into a slab
  stylet run slab2d-insertion --set mesh.h_ref=7    the same with finer triangles
  stylet scenes --show slab2d-static > mine.toml    a scene file to start from
  stylet run mine.toml --probe 0.05,0.05 --json     displacement at a point, as JSON
  stylet bench density --quick                      run time and error beside published ones
  stylet mesh refine --start kuhn3 --point 0.3,0.3,0.6 --size 0.01
  stylet solve A.mtx b.mtx --precond ic0 --out x.mtx

Units are SI everywhere: m, kg, s, N, Pa, rad.
Exit codes: 0 done; 2 bad input; 3 the run cannot converge; 130 stopped by Ctrl-C.";

/// Needle insertion into soft tissue that deforms and refines its mesh as it is pierced.
#[derive(Parser, Debug)]
#[command(name = "stylet", version, after_help = EXAMPLES, disable_help_subcommand = true)]
pub struct Cli {
    /// What to do; the help if left out.
    #[command(subcommand)]
    pub command: Option<Command>,
}

/// The commands.
#[derive(Subcommand, Debug)]
pub enum Command {
    /// List the built-in scenes, show one as TOML, or explain every key.
    Scenes(ScenesArgs),
    /// Run a scene: summary, history, frames for ParaView, pictures.
    Run(RunArgs),
    /// Measure run time against error; print a table beside published values.
    Bench(BenchArgs),
    /// Make, refine, check, draw and convert meshes.
    Mesh(MeshArgs),
    /// Solve a symmetric linear system from Matrix Market files, with or without constraints.
    Solve(Box<SolveArgs>),
}

const SCENES_EXAMPLES: &str = "\
Examples:
  stylet scenes                                     a line for each built-in scene
  stylet scenes --show slab2d-insertion > my.toml   a file to start from
  stylet scenes --schema                            every key: type, range, unit, default, meaning";

/// `stylet scenes`
#[derive(Args, Debug)]
#[command(after_help = SCENES_EXAMPLES)]
pub struct ScenesArgs {
    /// Print this built-in scene as TOML.
    #[arg(long, value_name = "NAME", conflicts_with = "schema")]
    pub show: Option<String>,
    /// Print every key of a scene file with its type, range, unit, default and meaning.
    #[arg(long)]
    pub schema: bool,
}

const RUN_EXAMPLES: &str = "\
Examples:
  stylet run slab2d-insertion
  stylet run slab2d-sideways --set material.model=linear --out out/linear
  stylet run slab2d-insertion --set output.frames=50          a ParaView frame every 50 cycles
  stylet run slab2d-static --probe 0.05,0.05 --probe 0.02,0.08 --no-files --json
  stylet run slab2d-insertion --steps 500 --save-state 500    stop after cycle 500, then go on:
  stylet run slab2d-insertion --resume out/slab2d-insertion/state/step_000500.state

Exit codes: 0 done; 2 bad input; 3 the run cannot converge (files are kept); 130 stopped by Ctrl-C, which
finishes the cycle at hand and writes summary, state and pictures (a second Ctrl-C ends at once).";

/// `stylet run`
#[derive(Args, Debug)]
#[command(after_help = RUN_EXAMPLES)]
pub struct RunArgs {
    /// A built-in scene (see `stylet scenes`) or a TOML file; a file named like a built-in scene is reached as ./NAME.
    #[arg(value_name = "SCENE")]
    pub scene: String,
    /// Set a key of the scene, as in --set mesh.h_ref=7; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Folder for the files [default: out/SCENE].
    #[arg(long, value_name = "DIR", value_parser = folder, conflicts_with = "no_files")]
    pub out: Option<PathBuf>,
    /// Stop after this cycle of the scene, counted from its start.
    #[arg(long, value_name = "N", value_parser = count, allow_negative_numbers = true)]
    pub steps: Option<usize>,
    /// Most threads to use [default: one for each core]; their number does not change the results.
    #[arg(long, value_name = "N", value_parser = threads, allow_negative_numbers = true)]
    pub threads: Option<usize>,
    /// Report the displacement at this point of the undeformed body, in m; may be repeated.
    #[arg(long, value_name = "X,Y[,Z]", allow_hyphen_values = true)]
    pub probe: Vec<String>,
    /// Print the summary as one JSON object.
    #[arg(long)]
    pub json: bool,
    /// No progress on standard error.
    #[arg(long)]
    pub quiet: bool,
    /// Write no files at all.
    #[arg(long)]
    pub no_files: bool,
    /// Save the whole state every N cycles and at the end.
    #[arg(long, value_name = "N", value_parser = count, allow_negative_numbers = true, conflicts_with = "no_files")]
    pub save_state: Option<usize>,
    /// Go on from a saved state of this scene, with the same bits as the run that was cut there.
    #[arg(long, value_name = "FILE")]
    pub resume: Option<PathBuf>,
}

/// `stylet bench`
#[derive(Args, Debug)]
#[command(after_help = bench_help())]
pub struct BenchArgs {
    /// The suite.
    #[arg(value_name = "SUITE")]
    pub suite: String,
    /// A subset that takes about a minute.
    #[arg(long)]
    pub quick: bool,
    /// One part of the suite stability: crush, element, contrast, hostile, threads, incompressible, endurance, extremes, violence,
    /// friction, paths or needle-threads.
    #[arg(long, value_name = "NAME")]
    pub part: Option<String>,
    /// Folder for plots and JSON [default: out/bench-SUITE].
    #[arg(long, value_name = "DIR", value_parser = folder)]
    pub out: Option<PathBuf>,
    /// Print the report as one JSON object.
    #[arg(long)]
    pub json: bool,
    /// Most threads to use [default: one for each core].
    #[arg(long, value_name = "N", value_parser = threads, allow_negative_numbers = true)]
    pub threads: Option<usize>,
    /// No progress on standard error.
    #[arg(long)]
    pub quiet: bool,
}

fn bench_help() -> String {
    let width = stylet_benches::SUITES.iter().map(|suite| suite.name.len()).max().unwrap_or(0);
    let lines = stylet_benches::SUITES.iter().map(|suite| format!("\n  {:<width$}  {}", suite.name, suite.about));
    format!("Suites:{}", lines.collect::<String>())
}

/// The threads that may be used.
pub fn threads_or_all(asked: Option<usize>) -> usize {
    asked.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from).min(MOST_THREADS))
}

/// A number of threads.
pub fn threads(text: &str) -> Result<usize, String> {
    let number = text.parse().ok().filter(|n| (1..=MOST_THREADS).contains(n));
    number.ok_or_else(|| format!("a whole number from 1 to {MOST_THREADS}"))
}

/// A number of things.
pub fn count(text: &str) -> Result<usize, String> {
    text.parse().ok().filter(|&n| n > 0).ok_or_else(|| "a whole number, at least 1".to_owned())
}

fn folder(text: &str) -> Result<PathBuf, String> {
    if text.is_empty() { Err("a folder".to_owned()) } else { Ok(text.into()) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_declaration_is_sound() {
        Cli::command().debug_assert();
    }
}
