//! Converts a mesh from one file format to another: `convert IN OUT [FORMAT]`.
//!
//! The format is that of the extension of `OUT` unless it is named; what it cannot hold is listed on standard error.

use std::{path::Path, process::ExitCode};
use stylet_mesh::io::{Format, read_with_notes, write};

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match convert(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("convert: {error}");
            ExitCode::from(2)
        }
    }
}

fn convert(arguments: &[String]) -> Result<(), Box<dyn std::error::Error>> {
    let (from, to, format) = match arguments {
        [from, to] => (from, to, Format::of_extension(Path::new(to)).ok_or("no format has the extension of OUT")?),
        [from, to, format] => (from, to, format.parse()?),
        _ => return Err("usage: convert IN OUT [FORMAT]".into()),
    };
    let (data, unread) = read_with_notes(from)?;
    unread.iter().for_each(|note| eprintln!("not read: {note}"));
    let unwritten = write(to, &data, format)?;
    unwritten.iter().for_each(|note| eprintln!("not written: {note}"));
    println!("{} points, {} cells, {} dimensions", data.points.len(), data.n_cells(), data.dimension);
    Ok(())
}
