//! Working memory of a preconditioner, whose `apply` takes it by shared reference.

use std::sync::{Mutex, MutexGuard, PoisonError};

/// Memory behind a lock: two threads that apply the same preconditioner take turns.
#[derive(Debug, Default)]
pub(super) struct Scratch<S>(Mutex<S>);

impl<S> Scratch<S> {
    /// A panic while the memory was lent leaves numbers that the next user overwrites, so it is no reason to refuse.
    pub fn lock(&self) -> MutexGuard<'_, S> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Without locking.
    pub fn get_mut(&mut self) -> &mut S {
        self.0.get_mut().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<S: Clone> Clone for Scratch<S> {
    fn clone(&self) -> Self {
        Self(Mutex::new(self.lock().clone()))
    }
}
