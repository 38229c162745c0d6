//! Ctrl-C: the first asks the run to stop after the step at hand, the second ends the program at once.

use crate::exit::Exit;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Wrappers such as `timeout` send the signal to the program and to its group: both count as one.
const ONE_PRESS: Duration = Duration::from_millis(300);

/// A flag that Ctrl-C sets.
pub fn flag() -> Arc<AtomicBool> {
    let stop = Arc::new(AtomicBool::new(false));
    let set = Arc::clone(&stop);
    let mut first: Option<Instant> = None;
    // Where no handler can be set, Ctrl-C ends the program as it does by default.
    let _ = ctrlc::set_handler(move || {
        set.store(true, Ordering::Relaxed);
        if first.get_or_insert_with(Instant::now).elapsed() >= ONE_PRESS {
            std::process::exit(Exit::Interrupted as i32);
        }
    });
    stop
}

/// Whether Ctrl-C was pressed.
pub fn is_set(stop: &AtomicBool) -> bool {
    stop.load(Ordering::Relaxed)
}
