//! Progress on standard error: a bar on a terminal, now and then a line elsewhere.

use crate::output;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal as _;
use std::time::{Duration, Instant};
use stylet_needle::simulation::Simulation;
use stylet_needle::summary::HistoryRow;

/// The bar is drawn ten times a second.
const DRAW_AFTER: Duration = Duration::from_millis(100);
/// The first line comes after this time, so that a short run says nothing, the others at the longer interval.
const FIRST_LINE_AFTER: Duration = Duration::from_secs(2);
const LINE_AFTER: Duration = Duration::from_secs(5);
const BAR_STEPS: u64 = 1000;

/// How far a run has come.
pub struct Progress {
    kind: Kind,
    due: Instant,
    began: Instant,
    share_at_start: f64,
}

enum Kind {
    Bar(ProgressBar),
    Lines,
    Quiet,
}

impl Progress {
    /// Begins to show the progress of a simulation.
    pub fn start(simulation: &dyn Simulation, quiet: bool) -> Self {
        let began = Instant::now();
        let (kind, due) = if quiet {
            (Kind::Quiet, began)
        } else if std::io::stderr().is_terminal() {
            (Kind::Bar(bar(&simulation.scene().name)), began)
        } else {
            (Kind::Lines, began + FIRST_LINE_AFTER)
        };
        Self { kind, due, began, share_at_start: simulation.progress() }
    }

    /// Takes note of a cycle. Costs a glance at the clock unless something is to be shown.
    pub fn tick(&mut self, row: &HistoryRow, simulation: &dyn Simulation) {
        if matches!(self.kind, Kind::Quiet) {
            return;
        }
        let now = Instant::now();
        if now < self.due {
            return;
        }
        let share = simulation.progress();
        let place = format!("cycle {}, {:.1} mm in, {} triangles", row.step, 1e3 * row.depth_m, row.elements);
        match &self.kind {
            Kind::Bar(bar) => {
                self.due = now + DRAW_AFTER;
                bar.set_message(place);
                bar.set_position((share * BAR_STEPS as f64) as u64);
            }
            // The summary follows at once.
            Kind::Lines if simulation.finished() => {}
            Kind::Lines => {
                self.due = now + LINE_AFTER;
                let name = &simulation.scene().name;
                let left = self.seconds_left(share, now).map_or(String::new(), |s| format!(", about {s:.0} s left"));
                output::note(&format!("{name}: {:.0} %, {place}{left}", 100.0 * share));
            }
            Kind::Quiet => {}
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

fn bar(name: &str) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(BAR_STEPS), ProgressDrawTarget::stderr_with_hz(10));
    // The template is a constant; should it be refused, the default style serves.
    if let Ok(style) = ProgressStyle::with_template("{prefix} [{bar:30}] {percent:>3} %  {elapsed} + {eta} left  {msg}")
    {
        bar.set_style(style.progress_chars("=> "));
    }
    bar.set_prefix(name.to_owned());
    // Shows that the program is alive while one long solve is under way.
    bar.enable_steady_tick(DRAW_AFTER);
    bar
}
