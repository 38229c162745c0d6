//! The program; all of it is in the library, which is compiled beside the crates that it uses and not after them.

use std::process::ExitCode;

fn main() -> ExitCode {
    stylet_cli::main()
}
