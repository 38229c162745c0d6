//! `stylet run`: one scene from start to end.

use crate::args::{RunArgs, threads_or_all};
use crate::exit::{Exit, Failure};
use crate::progress::Progress;
use crate::{interrupt, output, probe, report, scenes};
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use stylet_tissue::output::Recorder;
use stylet_tissue::state::State;
use stylet_tissue::summary::Summary;
use stylet_tissue::{RunError, Scenario, Simulation};

/// Why the cycles ended.
enum End {
    /// The scene's end, or the last cycle that was asked for.
    Reached,
    /// Ctrl-C.
    Interrupted,
    /// A cycle that cannot be completed.
    Failed(RunError),
    /// A file that cannot be written any more.
    Unwritable(RunError),
}

/// Runs a scene and prints its summary.
///
/// # Errors
/// Bad input, a run that cannot converge, Ctrl-C: one line and the exit code.
pub fn execute(args: &RunArgs) -> Result<Exit, Failure> {
    let scene = scenes::open(&args.scene, &args.set)?;
    let probes = probe::parse(&args.probe, scene.dim())?;
    scene.check_probes(&probes)?;
    // Before a run that may be long, or senseless.
    for warning in scene.warnings() {
        output::error_line(&format!("{}: warning: {warning}", scene.name()));
    }
    let stop = interrupt::flag();
    let (mut simulation, mut recorder) = open(args, scene.as_ref())?;
    let end = cycles(simulation.as_mut(), recorder.as_mut(), args, &stop);

    let mut summary = simulation.summary(&probes);
    summary.converged = matches!(end, End::Reached) && summary.solver.unconverged_solves == 0;
    if let End::Failed(error) = &end {
        summary.failure = Some(error.to_string());
    }

    let written = recorder.as_mut().map_or(Ok(()), |recorder| {
        // What failed has left the last good state.
        if matches!(end, End::Interrupted | End::Failed(_)) {
            recorder.keep_last_state();
        }
        recorder.finish(simulation.as_ref(), &summary)
    });
    let folder = recorder.as_ref().map(Recorder::folder);
    let text = if args.json { json(&summary)? } else { report::text(&summary, folder) };
    output::print(&text)?;
    exit_of(end, written, &summary, scene.as_ref(), folder)
}

/// The simulation, new or resumed, and what writes its files. The folder is made last: bad input leaves none behind.
fn open(args: &RunArgs, scene: &dyn Scenario) -> Result<(Box<dyn Simulation>, Option<Recorder>), Failure> {
    let threads = threads_or_all(args.threads);
    let (mut simulation, rows, frames) = match &args.resume {
        None => (scene.start(threads)?, Vec::new(), Vec::new()),
        Some(path) => {
            let State { saved, mut rows, mut frames } = State::read(path)?;
            let resumed = scene.resume(&saved, threads).map_err(|error| match error {
                RunError::State { reason, .. } => RunError::State { path: path.display().to_string(), reason },
                other => other,
            })?;
            // A static load is solved afresh, and comes to its one row again.
            rows.retain(|row| row.step <= resumed.steps());
            frames.retain(|frame| frame.0 <= resumed.steps());
            (resumed, rows, frames)
        }
    };
    if args.no_files {
        simulation.forgo_pictures();
        return Ok((simulation, None));
    }
    let folder = args.out.clone().unwrap_or_else(|| PathBuf::from("out").join(scene.name()));
    let recorder =
        Recorder::resume(&folder, &simulation.columns(), scene.frames_every(), args.save_state, rows, frames)?;
    Ok((simulation, Some(recorder)))
}

/// Goes on cycle by cycle until the scene, the steps, the user or an error makes an end.
fn cycles(
    simulation: &mut dyn Simulation,
    mut recorder: Option<&mut Recorder>,
    args: &RunArgs,
    stop: &AtomicBool,
) -> End {
    let last = args.steps.unwrap_or(usize::MAX);
    let mut progress = Progress::start(simulation, args.quiet);
    let end = loop {
        if simulation.finished() || simulation.steps() >= last {
            break End::Reached;
        }
        if interrupt::is_set(stop) {
            break End::Interrupted;
        }
        let row = match simulation.step() {
            Ok(row) => row,
            Err(error) => break End::Failed(error),
        };
        if let Some(recorder) = recorder.as_deref_mut()
            && let Err(error) = recorder.record(&row, simulation)
        {
            break End::Unwritable(error);
        }
        progress.tick(&row, simulation);
    };
    progress.end();
    end
}

/// The exit code, with a line for standard error where it is not 0. What stopped the run comes before what went wrong
/// while its files were written.
fn exit_of(
    end: End,
    written: Result<(), RunError>,
    summary: &Summary,
    scene: &dyn Scenario,
    folder: Option<&Path>,
) -> Result<Exit, Failure> {
    let kept = folder.map_or(String::new(), |folder| format!("; files kept in {}", folder.display()));
    let name = &summary.scene;
    match end {
        End::Failed(error) => {
            let line = format!("{name}: {error}{kept}");
            Err(Failure { line, exit: Exit::NotConverged })
        }
        End::Unwritable(error) => Err(error.into()),
        End::Interrupted => {
            let resume = folder.map_or(String::new(), |folder| {
                format!(
                    "; go on with --resume {}",
                    folder.join(format!("state/step_{:06}.state", summary.steps)).display()
                )
            });
            let line =
                format!("{name}: stopped by Ctrl-C after {} {}{resume}", report::step_word(summary), summary.steps);
            Err(Failure { line, exit: Exit::Interrupted })
        }
        End::Reached => {
            written?;
            let (count, first) = (summary.solver.unconverged_solves, summary.solver.first_unconverged_cycle);
            if count == 0 {
                return Ok(Exit::Done);
            }
            let solves = if count == 1 { "1 solve".to_owned() } else { format!("{count} solves") };
            let line = format!(
                "{name}: {solves} did not reach {}, the first in {} {first}{kept}",
                scene.unreached(),
                report::step_word(summary)
            );
            Err(Failure { line, exit: Exit::NotConverged })
        }
    }
}

fn json(summary: &Summary) -> Result<String, Failure> {
    let text = serde_json::to_string_pretty(summary);
    text.map(|text| text + "\n").map_err(|e| Failure::bad_input(format!("summary: {e}")))
}
