//! A team of threads that stays awake during a solve.
//!
//! An iteration of a solver is a few passes of microseconds each over the same vectors. Handing such a pass to a thread pool
//! costs about as much as the pass; the members of a [`Team`] watch one counter instead, and start within a fraction of a
//! microsecond. A member that has no core at that moment is not waited for: the others do its share. Two milliseconds after
//! the last pass members sleep.
//!
//! Everything that a team computes has the bits that one thread computes: vectors are cut at whole chunks of
//! [`vector::CHUNK`](crate::vector::CHUNK) entries, and their sums are added in order by the thread that asked.

mod members;
mod pace;
mod vectors;

use members::Members;
pub(crate) use pace::Pace;
use std::fmt;
use std::ops::Range;
use std::sync::Arc;

/// Threads that work through the passes of a solve together; clones are the same team.
///
/// A call that finds the team at work for another thread, or that a member makes from within a pass, is done by the calling
/// thread alone: teams can be shared freely, and never wait for each other.
#[derive(Clone, Default)]
pub struct Team {
    /// Absent: the calling thread alone.
    members: Option<Arc<Members>>,
}

impl Team {
    /// More members than this are not made.
    pub const MAX_MEMBERS: usize = 16;

    /// The calling thread alone.
    #[must_use]
    pub const fn serial() -> Self {
        Self { members: None }
    }

    /// A team of up to `threads` members, the calling thread being one of them; 0 and 1 both mean [`serial`](Self::serial).
    /// Threads that the system does not grant are done without. More members than the machine has cores are allowed:
    /// they give way to each other instead of spinning.
    #[must_use]
    pub fn new(threads: usize) -> Self {
        let threads = threads.clamp(1, Self::MAX_MEMBERS);
        Self { members: (threads > 1).then(|| Arc::new(Members::start(threads))) }
    }

    /// Number of members, at least one.
    #[must_use]
    pub fn size(&self) -> usize {
        self.members.as_ref().map_or(1, |members| members.size())
    }

    /// Calls `pass(i, &mut parts[i])` once for every part, and returns when all are done. With one part for each member, member
    /// `k` takes part `k`, unless it is late and another one has taken it.
    ///
    /// # Panics
    /// If `pass` does; the other members finish theirs first.
    pub fn each<P: Send>(&self, parts: &mut [P], pass: impl Fn(usize, &mut P) + Sync) {
        if let Some(members) = &self.members
            && parts.len() > 1
            && members.each(parts, &pass)
        {
            return;
        }
        for (i, part) in parts.iter_mut().enumerate() {
            pass(i, part);
        }
    }

    /// The entries of a vector of `len` that each member takes: as many ranges as there are members, of whole chunks.
    pub(crate) fn share(&self, len: usize, member: usize) -> Range<usize> {
        vectors::share(len, member, self.size())
    }
}

impl fmt::Debug for Team {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Team").field("size", &self.size()).finish()
    }
}

#[cfg(test)]
mod tests;
