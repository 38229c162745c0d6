//! `stylet bench`: a suite of runs, as a table or as JSON.

use crate::args::{BenchArgs, threads_or_all};
use crate::exit::{Exit, Failure};
use crate::{interrupt, output};
use std::path::{Path, PathBuf};
use stylet_benches::{BenchError, BenchOptions, SUITES};

/// Runs a suite and prints its report.
///
/// # Errors
/// An unknown suite, a folder that cannot be written, Ctrl-C. A run within the suite that fails is a row of the report.
pub fn execute(args: &BenchArgs) -> Result<Exit, Failure> {
    let suite = SUITES.iter().find(|suite| suite.name == args.suite).ok_or_else(|| unknown(&args.suite))?;
    if let Some(part) = &args.part {
        let parts = suite.parts();
        if !parts.contains(&part.as_str()) {
            let expected =
                if parts.is_empty() { "none: it has no parts".into() } else { format!("one of {}", parts.join(", ")) };
            return Err(Failure::bad_input(format!("bench {}: --part: found {part}, expected {expected}", suite.name)));
        }
    }
    let out = args.out.clone().unwrap_or_else(|| PathBuf::from("out").join(format!("bench-{}", suite.name)));
    std::fs::create_dir_all(&out).map_err(|e| unwritable(&out, &e))?;
    let stop = interrupt::flag();
    let options = BenchOptions {
        quick: args.quick,
        part: args.part.clone(),
        out: Some(out.clone()),
        threads: threads_or_all(args.threads),
        stop: stop.clone(),
    };
    let report = (suite.run)(&options, &mut |line| {
        if !args.quiet {
            output::note(line);
        }
    })?;

    let json = serde_json::to_string_pretty(&report).map_err(|e| Failure::bad_input(format!("report: {e}")))? + "\n";
    let path = out.join(format!("{}.json", suite.name));
    std::fs::write(&path, &json).map_err(|e| unwritable(&path, &e))?;
    output::print(&if args.json { json } else { text(&report.table(), report.failed_rows(), &path) })?;
    if interrupt::is_set(&stop) {
        let line = format!("bench {}: stopped by Ctrl-C; the rows so far are in {}", suite.name, path.display());
        return Err(Failure { line, exit: Exit::Interrupted });
    }
    Ok(Exit::Done)
}

fn text(table: &str, failed: usize, json: &Path) -> String {
    let failures = match failed {
        0 => String::new(),
        1 => "1 run failed; its row says why.\n".to_owned(),
        n => format!("{n} runs failed; their rows say why.\n"),
    };
    format!("{}\nwrote {}\n{failures}", table.trim_end(), json.display())
}

fn unknown(name: &str) -> Failure {
    let names: Vec<&str> = SUITES.iter().map(|suite| suite.name).collect();
    let near = if names.is_empty() {
        String::new()
    } else {
        format!("; nearest is {}", stylet_scene::nearest(name, names.iter().copied()))
    };
    Failure::bad_input(format!("bench: found suite {name}, expected one of {}{near}", names.join(", ")))
}

fn unwritable(path: &Path, error: &std::io::Error) -> Failure {
    Failure::bad_input(format!("{}: {error}", path.display()))
}

impl From<BenchError> for Failure {
    fn from(error: BenchError) -> Self {
        match error {
            BenchError::Needle(error) => error.into(),
            other => Self::bad_input(other.to_string()),
        }
    }
}
