//! `stylet solve`: a linear system from files.
//!
//! The work is done on a thread of its own, so that Ctrl-C ends it at any moment, in the middle of a factorisation too.

pub mod args;
mod coordinates;
mod files;
mod input;
mod methods;
mod preconditioners;
mod report;
mod saddle;

use crate::exit::{Exit, Failure};
use crate::interrupt;
use crate::progress::{Meter, Place};
use args::SolveArgs;
use input::Problem;
use report::Report;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};

/// How often Ctrl-C is looked for.
const LOOK_EVERY: Duration = Duration::from_millis(50);

/// What the working thread has to say.
enum Message {
    /// What it is about to do.
    Stage(&'static str),
    Done(Box<Result<Report, Failure>>),
}

/// Reads, solves, reports.
///
/// # Errors
/// Bad input, a system that was not solved, Ctrl-C: one line and the exit code.
pub fn execute(args: Box<SolveArgs>) -> Result<Exit, Failure> {
    let (sender, receiver) = channel();
    let for_work = args.clone();
    let worker = std::thread::spawn(move || {
        let report = work(&for_work, &sender);
        // The other end waits for this, unless the program is about to end.
        let _ = sender.send(Message::Done(Box::new(report)));
    });
    let report = wait(&args, &receiver)?.unwrap_or_else(|| match worker.join() {
        Err(panic) => std::panic::resume_unwind(panic),
        Ok(()) => unreachable!("a report is the last thing that the thread sends"),
    })?;
    if let Some(path) = &args.out {
        files::write_vector(path, &report.x)?;
    }
    report.print(&args)?;
    match &report.reason {
        None => Ok(Exit::Done),
        Some(reason) => {
            let line = format!("{}: {reason}", args.matrix.display());
            Err(Failure { line, exit: Exit::NotConverged })
        }
    }
}

/// The result of the work; `None` if the thread ended without one.
fn wait(args: &SolveArgs, receiver: &Receiver<Message>) -> Result<Option<Result<Report, Failure>>, Failure> {
    let stop = interrupt::flag();
    let began = Instant::now();
    let mut stage = "begins";
    let mut meter = Meter::start("solve", None, args.quiet);
    let result = loop {
        match receiver.recv_timeout(LOOK_EVERY) {
            Ok(Message::Stage(next)) => stage = next,
            Ok(Message::Done(result)) => break Ok(Some(*result)),
            Err(RecvTimeoutError::Disconnected) => break Ok(None),
            Err(RecvTimeoutError::Timeout) => {}
        }
        if interrupt::is_set(&stop) {
            let line = format!("{}: stopped by Ctrl-C while it {stage}; nothing was written", args.matrix.display());
            break Err(Failure { line, exit: Exit::Interrupted });
        }
        meter.tick(|| {
            let seconds = began.elapsed().as_secs_f64();
            Place { share: None, text: format!("{stage}, {seconds:.0} s"), is_last: false }
        });
    };
    meter.end();
    result
}

fn work(args: &SolveArgs, sender: &Sender<Message>) -> Result<Report, Failure> {
    // Nobody listens any more after Ctrl-C.
    let stage = |what| drop(sender.send(Message::Stage(what)));
    stage("reads files");
    let began = Instant::now();
    let problem = Problem::read(args)?;
    let read_s = began.elapsed().as_secs_f64();
    let solution = match problem.block {
        1 => methods::solve::<1, 1>(&problem, args, &stage),
        2 => methods::solve::<2, 3>(&problem, args, &stage),
        _ => methods::solve::<3, 6>(&problem, args, &stage),
    }?;
    Ok(Report::new(&problem, args, solution, read_s))
}
