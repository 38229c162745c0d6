//! The threads of a team: how a pass gets to them, and how they wait.
#![allow(unsafe_code)]
// The one place of this crate that hands a borrowed closure to threads that outlive it. A safe scope starts threads anew,
// 20 µs each, and a pool hands over in 7 to 10 µs; a pass takes 2 to 20 µs (criterion bench `team`).

use std::any::Any;
use std::cell::UnsafeCell;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle, Thread};

/// Looks at a counter before a waiting thread gives its core away, about 30 µs.
const SPINS: u32 = 1 << 12;
/// Further looks, giving way to other threads each time, before a member sleeps.
const YIELDS: u32 = 64;

/// A counter that shares no cache line with another one.
#[derive(Default)]
#[repr(align(128))]
struct Padded<T>(T);

/// A pass, its type erased: calls `run(data, member)`.
#[derive(Clone, Copy)]
struct Pass {
    run: unsafe fn(*const (), usize),
    data: *const (),
}

struct Shared {
    /// Number of passes given out; a member that sees it change takes the pass.
    given: Padded<AtomicUsize>,
    /// Members that have not finished the present pass.
    pending: Padded<AtomicUsize>,
    /// Written by the leader while `pending` is zero, read by members after they saw `given` change.
    pass: UnsafeCell<Pass>,
    /// `asleep[k]`: member `k + 1` is about to park, or parked.
    asleep: Vec<Padded<AtomicBool>>,
    /// There will be no more passes.
    closed: AtomicBool,
    /// What a member panicked with.
    panic: Mutex<Option<Box<dyn Any + Send>>>,
    /// Looks before giving way: none where members outnumber cores.
    spins: u32,
}

// SAFETY: `pass` is the only field that is not `Sync` by itself. The leader writes it while no member reads it (`pending` is
// zero, acquired), and publishes it by the release of `given`. Its pointer is to a `Sync` closure and used only before the
// leader's call returns.
unsafe impl Sync for Shared {}
// SAFETY: as above; nothing is tied to a thread.
unsafe impl Send for Shared {}

pub(super) struct Members {
    shared: Arc<Shared>,
    threads: Vec<Thread>,
    handles: Vec<JoinHandle<()>>,
    /// Held by the thread whose pass is being run.
    leader: Mutex<()>,
}

impl Members {
    /// The calling thread and `size - 1` others, or as many as the system grants.
    pub fn start(size: usize) -> Self {
        let cores = thread::available_parallelism().map_or(1, usize::from);
        fn nothing(_: *const (), _: usize) {}
        let shared = Arc::new(Shared {
            given: Padded::default(),
            pending: Padded::default(),
            pass: UnsafeCell::new(Pass { run: nothing, data: std::ptr::null() }),
            asleep: (1..size).map(|_| Padded::default()).collect(),
            closed: AtomicBool::new(false),
            panic: Mutex::new(None),
            spins: if size > cores { 0 } else { SPINS },
        });
        let mut handles = Vec::new();
        for member in 1..size {
            let shared = Arc::clone(&shared);
            let builder = thread::Builder::new().name(format!("team {member}"));
            match builder.spawn(move || shared.work(member)) {
                Ok(handle) => handles.push(handle),
                Err(_) => break, // the system grants no more
            }
        }
        let threads = handles.iter().map(|handle| handle.thread().clone()).collect();
        Self { shared, threads, handles, leader: Mutex::new(()) }
    }

    pub fn size(&self) -> usize {
        self.threads.len() + 1
    }

    /// Runs `pass` on all parts; `false` if the team is at work for someone else, and nothing was done.
    pub fn each<P: Send, F: Fn(usize, &mut P) + Sync>(&self, parts: &mut [P], pass: &F) -> bool {
        // A poisoned lock tells of a pass that panicked; the team itself is as good as before.
        let _leader = match self.leader.try_lock() {
            Ok(guard) => guard,
            Err(std::sync::TryLockError::Poisoned(poisoned)) => poisoned.into_inner(),
            Err(std::sync::TryLockError::WouldBlock) => return false,
        };
        let size = self.size();
        let job = Job { parts: parts.as_mut_ptr(), len: parts.len(), size, pass };
        self.run(Pass { run: Job::<P, F>::run, data: (&raw const job).cast() }, parts.len());
        true
    }

    /// Gives out a pass, takes the leader's share of it and waits for the others.
    fn run(&self, pass: Pass, n_parts: usize) {
        let shared = &*self.shared;
        // SAFETY: `pending` is zero (the last call waited for that), so no member reads `pass`; the lock `leader` keeps other
        // leaders away.
        unsafe { *shared.pass.get() = pass };
        shared.pending.0.store(self.threads.len(), Ordering::Relaxed);
        shared.given.0.fetch_add(1, Ordering::SeqCst);
        for (thread, asleep) in self.threads.iter().zip(&shared.asleep) {
            if asleep.0.load(Ordering::SeqCst) {
                thread.unpark();
            }
        }
        debug_assert!(n_parts > 1);
        // SAFETY: the data outlive this call, which waits for all members; member 0 is this thread alone.
        let own = catch_unwind(AssertUnwindSafe(|| unsafe { (pass.run)(pass.data, 0) }));
        let mut looks = 0;
        while shared.pending.0.load(Ordering::Acquire) > 0 {
            wait(&mut looks, shared.spins);
        }
        if let Err(panic) = own {
            resume_unwind(panic);
        }
        let panic = shared.panic.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).take();
        if let Some(panic) = panic {
            resume_unwind(panic);
        }
    }
}

impl Drop for Members {
    fn drop(&mut self) {
        self.shared.closed.store(true, Ordering::SeqCst);
        self.shared.given.0.fetch_add(1, Ordering::SeqCst);
        for thread in &self.threads {
            thread.unpark();
        }
        for handle in self.handles.drain(..) {
            drop(handle.join());
        }
    }
}

impl Shared {
    /// The life of a member.
    fn work(&self, member: usize) {
        let mut seen = 0;
        loop {
            seen = self.next(member, seen);
            if self.closed.load(Ordering::SeqCst) {
                return;
            }
            // SAFETY: `given` changed, which publishes `pass`; the leader does not write it until `pending` is zero.
            let pass = unsafe { *self.pass.get() };
            // SAFETY: the leader keeps the data alive until `pending` is zero, and no other thread has this number.
            let done = catch_unwind(AssertUnwindSafe(|| unsafe { (pass.run)(pass.data, member) }));
            if let Err(panic) = done {
                *self.panic.lock().unwrap_or_else(|poisoned| poisoned.into_inner()) = Some(panic);
            }
            self.pending.0.fetch_sub(1, Ordering::Release);
        }
    }

    /// Waits until `given` is not `seen` any more, and returns it: spins, then gives way, then sleeps.
    fn next(&self, member: usize, seen: usize) -> usize {
        let mut looks = 0;
        loop {
            let given = self.given.0.load(Ordering::Acquire);
            if given != seen {
                return given;
            }
            if wait(&mut looks, self.spins) < YIELDS {
                continue;
            }
            // The leader raises `given` and then looks at `asleep`; this thread the other way round: one sees the other.
            let asleep = &self.asleep[member - 1].0;
            asleep.store(true, Ordering::SeqCst);
            while self.given.0.load(Ordering::SeqCst) == seen {
                thread::park();
            }
            asleep.store(false, Ordering::SeqCst);
        }
    }
}

/// One look's pause; returns how often this thread has given way so far.
fn wait(looks: &mut u32, spins: u32) -> u32 {
    *looks = looks.saturating_add(1);
    if *looks <= spins {
        std::hint::spin_loop();
        return 0;
    }
    thread::yield_now();
    *looks - spins
}

/// A pass over parts.
struct Job<'a, P, F> {
    parts: *mut P,
    len: usize,
    size: usize,
    pass: &'a F,
}

impl<P: Send, F: Fn(usize, &mut P) + Sync> Job<'_, P, F> {
    /// # Safety
    /// `job` points to a live `Job` whose parts are borrowed for as long as any member runs, and no two threads run with the
    /// same `member`.
    unsafe fn run(job: *const (), member: usize) {
        // SAFETY: by contract.
        let job = unsafe { &*job.cast::<Self>() };
        for i in (member..job.len).step_by(job.size) {
            // SAFETY: `i` is in bounds, and every `i` belongs to one member alone.
            let part = unsafe { &mut *job.parts.add(i) };
            (job.pass)(i, part);
        }
    }
}
