//! Runs one bench suite from a program of your own and prints its table:
//!
//! ```text
//! cargo run --release -p stylet-benches --example suite -- density --quick
//! ```

use std::path::PathBuf;
use stylet_benches::{BenchError, BenchOptions, SUITES};

fn main() -> Result<(), BenchError> {
    let name = std::env::args().nth(1).unwrap_or_else(|| "tolerance".to_owned());
    let quick = std::env::args().any(|argument| argument == "--quick");
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let options = BenchOptions { quick, out: Some(PathBuf::from("out/bench")), threads, ..BenchOptions::default() };
    for suite in SUITES.iter().filter(|suite| suite.name == name) {
        let report = (suite.run)(&options, &mut |doing| eprintln!("{doing}"))?;
        print!("{}", report.table());
    }
    Ok(())
}
