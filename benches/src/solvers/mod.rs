//! The solver core: products against what memory gives, methods and preconditioners against each other and against other
//! libraries, and what each of them should reach.

mod baseline;
mod coupled;
mod grid;
mod methods;
mod multilevel;
mod page;
mod patch;
mod products;
mod systems;
mod targets;
mod triad;

pub(crate) use systems::jittered_cube;

use crate::{BenchError, BenchOptions, Report};

pub(crate) fn run(options: &BenchOptions, say: &mut dyn FnMut(&str)) -> Result<Report, BenchError> {
    let mut report = Report::new("solvers", options.threads);
    products::run(options, say, &mut report);
    grid::run(options, say, &mut report)?;
    targets::add(&mut report);
    for part in [patch::run, coupled::run, multilevel::run] {
        if options.stopped() {
            break;
        }
        part(options, say, &mut report);
    }
    if let Some(folder) = &options.out {
        let page = page::markdown(&report, crate::page::today());
        report.write(folder, "solvers.md", &page)?;
    }
    Ok(report)
}

/// A number of threads in words.
fn threads_text(count: usize) -> String {
    if count == 1 { "one thread".to_owned() } else { format!("{count} threads") }
}
