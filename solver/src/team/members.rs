//! The threads of a team: how a pass gets to them, and how they wait.
#![allow(unsafe_code)]
// The one place of this crate that hands a borrowed closure to threads that outlive it. A safe scope starts threads anew,
// 20 µs each, and a pool hands over in 7 to 10 µs; a pass takes 2 to 20 µs (criterion bench `team`).

use std::any::Any;
use std::cell::UnsafeCell;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle, Thread};

/// Looks at a counter before a waiting thread gives its core away, about 30 µs.
const SPINS: u32 = 1 << 12;
/// Further looks, giving way to other threads each time, before a member sleeps: one to two milliseconds, so that it is awake
/// throughout the steps of a simulation, whose serial parts take less. One that is woken instead is as like as not put on
/// the core of the thread that woke it.
const YIELDS: u32 = 1 << 12;

/// A counter that shares no cache line with another one.
#[derive(Default)]
#[repr(align(128))]
struct Padded<T>(T);

/// A pass, its type erased: calls `run(data, unit)`.
#[derive(Clone, Copy)]
struct Pass {
    run: unsafe fn(*const (), usize),
    data: *const (),
    /// Units of work, at most 64.
    units: usize,
}

/// Set in the state while a pass may be entered.
const OPEN: u64 = 1 << 16;
/// Members inside the present pass.
const INSIDE: u64 = OPEN - 1;
/// The number of the present pass stands above this bit.
const NUMBER: u32 = 17;

struct Shared {
    /// Number of the pass, [`OPEN`], and how many members are inside. A member enters by raising the count while the pass is
    /// open; the leader closes the pass and waits until nobody is inside. So a member that gets no core in time is not waited
    /// for: others do its share.
    state: Padded<AtomicU64>,
    /// One bit for each unit that somebody has taken.
    taken: Padded<AtomicU64>,
    /// Written by the leader while the pass is closed and nobody is inside, read by members inside.
    pass: UnsafeCell<Pass>,
    /// `asleep[k]`: member `k + 1` is about to park, or parked.
    asleep: Vec<Padded<AtomicBool>>,
    /// There will be no more passes.
    dismissed: AtomicBool,
    /// What a member panicked with.
    panic: Mutex<Option<Box<dyn Any + Send>>>,
    /// Members, the leader included.
    size: usize,
    /// Looks before giving way: none where members outnumber cores.
    spins: u32,
}

// SAFETY: `pass` is the only field that is not `Sync` by itself. The leader writes it while no member is inside (the count of
// `state` is zero, acquired, and the pass closed), and publishes it by the release of `state`; members read it inside alone. Its
// pointer is to a `Sync` closure and used inside alone, and the leader's call returns when nobody is.
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
            state: Padded::default(),
            taken: Padded::default(),
            pass: UnsafeCell::new(Pass { run: nothing, data: std::ptr::null(), units: 0 }),
            asleep: (1..size).map(|_| Padded::default()).collect(),
            dismissed: AtomicBool::new(false),
            panic: Mutex::new(None),
            size,
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
        let units = parts.len().min(64);
        let job = Job { parts: parts.as_mut_ptr(), len: parts.len(), units, pass };
        self.run(Pass { run: Job::<P, F>::run, data: (&raw const job).cast(), units });
        true
    }

    /// Opens a pass, takes the leader's share of it and what others have not begun, and waits for who is inside.
    fn run(&self, pass: Pass) {
        let shared = &*self.shared;
        // SAFETY: the last pass is closed and nobody is inside (its leader waited for that); the lock `leader` keeps other
        // leaders away.
        unsafe { *shared.pass.get() = pass };
        shared.taken.0.store(0, Ordering::Relaxed);
        let number = (shared.state.0.load(Ordering::Relaxed) >> NUMBER) + 1;
        shared.state.0.store(number << NUMBER | OPEN, Ordering::SeqCst);
        for (thread, asleep) in self.threads.iter().zip(&shared.asleep) {
            if asleep.0.load(Ordering::SeqCst) {
                thread.unpark();
            }
        }
        let own = catch_unwind(AssertUnwindSafe(|| shared.take_units(pass, 0)));
        shared.state.0.fetch_and(!OPEN, Ordering::AcqRel);
        let mut looks = 0;
        while shared.state.0.load(Ordering::Acquire) & INSIDE > 0 {
            wait(&mut looks, shared.spins);
        }
        let theirs = shared.panic.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).take();
        if let Some(panic) = own.err().or(theirs) {
            resume_unwind(panic);
        }
    }
}

impl Drop for Members {
    fn drop(&mut self) {
        self.shared.dismissed.store(true, Ordering::SeqCst);
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
        let mut last = 0;
        while let Some(number) = self.enter(member, last) {
            last = number;
            // SAFETY: inside an open pass, which publishes `pass`; the leader does not write it while somebody is inside.
            let pass = unsafe { *self.pass.get() };
            let done = catch_unwind(AssertUnwindSafe(|| self.take_units(pass, member)));
            if let Err(panic) = done {
                *self.panic.lock().unwrap_or_else(|poisoned| poisoned.into_inner()) = Some(panic);
            }
            self.state.0.fetch_sub(1, Ordering::Release);
        }
    }

    /// Works through the units of the present pass that nobody has taken, the member's own share first.
    fn take_units(&self, pass: Pass, member: usize) {
        let first = member * pass.units / self.size;
        for k in 0..pass.units {
            let unit = (first + k) % pass.units;
            if self.taken.0.fetch_or(1 << unit, Ordering::Relaxed) & (1 << unit) == 0 {
                // SAFETY: this thread is inside the pass (or its leader), so the data live; it alone has taken the unit.
                unsafe { (pass.run)(pass.data, unit) };
            }
        }
    }

    /// Waits for another pass than `last` and enters it: spins, then gives way, then sleeps. `None` if the team is dismissed.
    fn enter(&self, member: usize, last: u64) -> Option<u64> {
        let mut looks = 0;
        loop {
            if let Some(number) = self.try_enter(last) {
                return Some(number);
            }
            if self.dismissed.load(Ordering::Relaxed) {
                return None;
            }
            if wait(&mut looks, self.spins) < YIELDS {
                continue;
            }
            // The leader opens a pass and then looks at `asleep`; this thread the other way round: one sees the other.
            let asleep = &self.asleep[member - 1].0;
            asleep.store(true, Ordering::SeqCst);
            while !self.is_due(last) && !self.dismissed.load(Ordering::SeqCst) {
                thread::park();
            }
            asleep.store(false, Ordering::SeqCst);
            looks = 0;
        }
    }

    /// Whether a pass other than `last` is open.
    fn is_due(&self, last: u64) -> bool {
        let state = self.state.0.load(Ordering::SeqCst);
        state & OPEN > 0 && state >> NUMBER != last
    }

    /// Enters the present pass, if it is open and not `last`; returns its number.
    fn try_enter(&self, last: u64) -> Option<u64> {
        let state = self.state.0.load(Ordering::Acquire);
        if state & OPEN == 0 || state >> NUMBER == last {
            return None;
        }
        let entered = self.state.0.compare_exchange(state, state + 1, Ordering::AcqRel, Ordering::Relaxed);
        entered.is_ok().then_some(state >> NUMBER)
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

/// A pass over parts: unit `k` is made of the parts `k`, `k + units`, ….
struct Job<'a, P, F> {
    parts: *mut P,
    len: usize,
    units: usize,
    pass: &'a F,
}

impl<P: Send, F: Fn(usize, &mut P) + Sync> Job<'_, P, F> {
    /// # Safety
    /// `job` points to a live `Job` whose parts are borrowed for as long as any member runs, and no two calls have the same
    /// `unit`.
    unsafe fn run(job: *const (), unit: usize) {
        // SAFETY: by contract.
        let job = unsafe { &*job.cast::<Self>() };
        for i in (unit..job.len).step_by(job.units) {
            // SAFETY: `i` is in bounds, and every `i` belongs to one unit alone.
            let part = unsafe { &mut *job.parts.add(i) };
            (job.pass)(i, part);
        }
    }
}
