//! Progress on standard error: a bar on a terminal, now and then a line elsewhere.

use crate::output;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal as _;
use std::time::{Duration, Instant};
use stylet_tissue::Simulation;
use stylet_tissue::history::HistoryRow;

/// The bar is drawn ten times a second.
const DRAW_AFTER: Duration = Duration::from_millis(100);
/// The first line comes after this time, so that a short run says nothing, the others at the longer interval.
const FIRST_LINE_AFTER: Duration = Duration::from_secs(2);
const LINE_AFTER: Duration = Duration::from_secs(5);
const BAR_STEPS: u64 = 1000;

/// How far a run has come.
pub struct Progress(Meter);

impl Progress {
    /// Begins to show the progress of a simulation.
    pub fn start(simulation: &dyn Simulation, quiet: bool) -> Self {
        Self(Meter::start(simulation.name(), Some(simulation.progress()), quiet))
    }

    /// Takes note of a cycle. Costs a glance at the clock unless something is to be shown.
    pub fn tick(&mut self, row: &HistoryRow, simulation: &dyn Simulation) {
        self.0.tick(|| Place {
            share: Some(simulation.progress()),
            text: simulation.place(row),
            is_last: simulation.finished(),
        });
    }

    /// Takes the bar away.
    pub fn end(self) {
        self.0.end();
    }
}

/// What is shown.
pub struct Place {
    /// The part of the work that is done, if it is known.
    pub share: Option<f64>,
    /// Where the work is, in words.
    pub text: String,
    /// Whether the work is done, so that its report follows at once.
    pub is_last: bool,
}

/// How far some work has come.
pub struct Meter {
    kind: Kind,
    name: String,
    due: Instant,
    began: Instant,
    share_at_start: f64,
}

enum Kind {
    Bar(ProgressBar),
    Lines,
    Quiet,
}

impl Meter {
    /// Begins to show the progress of work of this name, of which a part is done or no part can be told.
    pub fn start(name: &str, share: Option<f64>, quiet: bool) -> Self {
        let began = Instant::now();
        let (kind, due) = if quiet {
            (Kind::Quiet, began)
        } else if std::io::stderr().is_terminal() {
            (Kind::Bar(bar(name, share.is_some())), began)
        } else {
            (Kind::Lines, began + FIRST_LINE_AFTER)
        };
        Self { kind, name: name.to_owned(), due, began, share_at_start: share.unwrap_or(0.0) }
    }

    /// Takes note of a step. Costs a glance at the clock unless something is to be shown, which only then is asked for.
    pub fn tick(&mut self, place: impl FnOnce() -> Place) {
        let now = Instant::now();
        if matches!(self.kind, Kind::Quiet) || now < self.due {
            return;
        }
        let Place { share, text, is_last } = place();
        match &self.kind {
            Kind::Bar(bar) => {
                self.due = now + DRAW_AFTER;
                bar.set_message(text);
                bar.set_position((share.unwrap_or(0.0) * BAR_STEPS as f64) as u64);
            }
            Kind::Lines if !is_last => {
                self.due = now + LINE_AFTER;
                let left = share.and_then(|share| self.seconds_left(share, now));
                let left = left.map_or(String::new(), |s| format!(", about {s:.0} s left"));
                let percent = share.map_or(String::new(), |share| format!("{:.0} %, ", 100.0 * share));
                output::note(&format!("{}: {percent}{text}{left}", self.name));
            }
            _ => {}
        }
    }

    fn seconds_left(&self, share: f64, now: Instant) -> Option<f64> {
        let done = share - self.share_at_start;
        (done > 0.0).then(|| (now - self.began).as_secs_f64() * (1.0 - share) / done)
    }

    /// Takes the bar away.
    pub fn end(self) {
        if let Kind::Bar(bar) = self.kind {
            bar.finish_and_clear();
        }
    }
}

fn bar(name: &str, is_measured: bool) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(BAR_STEPS), ProgressDrawTarget::stderr_with_hz(10));
    let template = if is_measured {
        "{prefix} [{bar:30}] {percent:>3} %  {elapsed} + {eta} left  {msg}"
    } else {
        "{prefix} {spinner} {elapsed}  {msg}"
    };
    // The template is a constant; should it be refused, the default style serves.
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style.progress_chars("=> "));
    }
    bar.set_prefix(name.to_owned());
    // Shows that the program is alive while one long piece of work is under way.
    bar.enable_steady_tick(DRAW_AFTER);
    bar
}
