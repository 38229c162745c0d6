//! What the argument parser has to say, in one line.

use crate::exit::{Exit, Failure};
use crate::output;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use std::error::Error as _;

/// Prints the help or the version that was asked for, or turns an error into one line.
///
/// # Errors
/// Bad arguments: names the flag, what was found and what was expected.
pub fn answer(error: &clap::Error) -> Result<Exit, Failure> {
    match error.kind() {
        ErrorKind::DisplayHelp | ErrorKind::DisplayVersion | ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            output::print(&error.render().to_string())?;
            Ok(Exit::Done)
        }
        _ => Err(Failure::bad_input(one_line(error))),
    }
}

fn one_line(error: &clap::Error) -> String {
    let text = |kind| error.get(kind).map(shown);
    let argument = || text(ContextKind::InvalidArg).map_or("arguments".to_owned(), |name| flag(&name).to_owned());
    let near = |kind| text(kind).map_or(String::new(), |near| format!("; nearest is {near}"));
    match error.kind() {
        ErrorKind::ValueValidation => {
            let found = text(ContextKind::InvalidValue).unwrap_or_default();
            let expected = error.source().map_or_else(|| "another value".to_owned(), ToString::to_string);
            format!("{}: found {}, expected {expected}", argument(), quoted(&found))
        }
        // A flag at the end of the line, or an empty value.
        ErrorKind::InvalidValue => {
            let found = text(ContextKind::InvalidValue).unwrap_or_default();
            let expected = match text(ContextKind::ValidValue) {
                Some(words) => format!("one of {words}"),
                None => text(ContextKind::InvalidArg).unwrap_or_default(),
            };
            let near = near(ContextKind::SuggestedValue);
            format!("{}: found {}, expected {expected}{near}", argument(), quoted(&found))
        }
        ErrorKind::UnknownArgument => {
            let found = text(ContextKind::InvalidArg).unwrap_or_default();
            let near = near(ContextKind::SuggestedArg);
            format!("{found}: found an argument that does not exist, expected those of `stylet --help`{near}")
        }
        ErrorKind::InvalidSubcommand => {
            let found = text(ContextKind::InvalidSubcommand).unwrap_or_default();
            let near = near(ContextKind::SuggestedSubcommand);
            let expected = match std::env::args().nth(1).as_deref() {
                Some("mesh") => "box, refine, coarsen, quality, convert or remesh",
                _ => "scenes, run, bench, mesh or solve",
            };
            format!("{found}: found a command that does not exist, expected {expected}{near}")
        }
        ErrorKind::MissingRequiredArgument => {
            let missing = text(ContextKind::InvalidArg).unwrap_or_default();
            format!("{missing}: found none, expected one; see `stylet --help`")
        }
        ErrorKind::ArgumentConflict => {
            let other = text(ContextKind::PriorArg).unwrap_or_default();
            let (one, other) = (argument(), flag(&other).to_owned());
            if one == other {
                return format!("{one}: found twice, expected once");
            }
            format!("{one}: found together with {other}, expected only one of the two")
        }
        _ => {
            let rendered = error.to_string();
            let first = rendered.lines().next().unwrap_or("arguments cannot be used");
            first.strip_prefix("error: ").unwrap_or(first).to_owned()
        }
    }
}

fn shown(value: &ContextValue) -> String {
    match value {
        ContextValue::Strings(list) => list.join(", "),
        other => other.to_string(),
    }
}

/// `--threads` of `--threads <N>`.
fn flag(argument: &str) -> &str {
    argument.split(' ').next().unwrap_or(argument)
}

fn quoted(found: &str) -> String {
    if found.is_empty() { "nothing".to_owned() } else { found.to_owned() }
}
