//! A scene of a flexible needle by name or from a file, run from a program instead of the command line:
//!
//! ```text
//! cargo run --release -p stylet-steering --example scene -- gel-single-bend out/gel
//! ```

use stylet_steering::{SCENES, open};
use stylet_tissue::output::Recorder;
use stylet_tissue::{RunError, Scenario, source};

fn main() -> Result<(), RunError> {
    let mut arguments = std::env::args().skip(1);
    let name = arguments.next().unwrap_or_else(|| "gel-single-bend".to_owned());
    let folder = arguments.next().unwrap_or_else(|| format!("out/{name}"));
    let assignments: Vec<String> = arguments.collect();

    let scene = open(&source::find(&name, SCENES)?, &assignments)?;
    let mut run = scene.start(1)?;
    let mut recorder = Recorder::create(folder.as_ref(), &run.columns(), scene.frames_every(), None)?;
    let mut result = Ok(());
    while !run.finished() && result.is_ok() {
        result = run.step().and_then(|row| recorder.record(&row, run.as_ref()));
    }
    let summary = run.summary(&[]);
    recorder.finish(run.as_ref(), &summary)?;
    if let Some(steering) = &summary.steering {
        println!("{} steps, {:.2} s: {steering:#?}", summary.steps, summary.wall_s);
    }
    result
}
