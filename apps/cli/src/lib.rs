//! The command line `stylet`: scenes, runs, benchmarks, meshes and linear systems.
//!
//! Standard output carries what was asked for and nothing else; progress and errors go to standard error, an error in one
//! line, and exit codes are those of `stylet run --help`.

mod args;
mod bench;
mod exit;
mod facts;
mod interrupt;
mod mesh;
mod output;
mod probe;
mod progress;
mod report;
mod run;
mod scenes;
mod solve;
mod usage;

use args::{Cli, Command};
use clap::{CommandFactory, Parser};
use exit::{Exit, Failure};
use std::process::ExitCode;

/// The whole program: reads the command line, does what it says, and returns the exit code.
#[must_use]
pub fn main() -> ExitCode {
    let exit = match Cli::try_parse() {
        Ok(cli) => execute(cli),
        Err(error) => usage::answer(&error),
    };
    let exit = exit.unwrap_or_else(|failure| {
        output::error_line(&failure.line);
        failure.exit
    });
    ExitCode::from(exit as u8)
}

fn execute(cli: Cli) -> Result<Exit, Failure> {
    match cli.command {
        None => output::print(&Cli::command().render_help().to_string()).map(|()| Exit::Done),
        Some(Command::Scenes(args)) => scenes::execute(&args),
        Some(Command::Run(args)) => run::execute(&args),
        Some(Command::Bench(args)) => bench::execute(&args),
        Some(Command::Mesh(args)) => mesh::execute(&args),
        Some(Command::Solve(args)) => solve::execute(args),
    }
}
