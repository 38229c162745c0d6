//! What memory gives: the triad of STREAM.

use std::hint::black_box;
use stylet_solver::team::Team;

/// `a ← b + 3 c` on arrays that hold a given number of bytes together, shared by a team.
///
/// Source: McCalpin, *Memory bandwidth and machine balance in current high performance computers*, IEEE TCCA Newsletter
/// (1995); the bytes counted are those of the three arrays, without what the cache reads before it writes.
pub(super) struct Triad {
    team: Team,
    a: Vec<f64>,
    b: Vec<f64>,
    c: Vec<f64>,
}

impl Triad {
    /// Arrays of `bytes` together.
    pub fn new(team: &Team, bytes: usize) -> Self {
        let n = (bytes / 24).max(1);
        Self { team: team.clone(), a: vec![0.0; n], b: vec![1.0; n], c: vec![2.0; n] }
    }

    /// One pass.
    pub fn run(&mut self) {
        let Self { team, a, b, c } = self;
        let share = a.len().div_ceil(team.size());
        let mut parts: Vec<&mut [f64]> = a.chunks_mut(share).collect();
        team.each(&mut parts, |k, a| {
            let from = k * share;
            for ((a, b), c) in a.iter_mut().zip(&b[from..]).zip(&c[from..]) {
                *a = b + 3.0 * c;
            }
        });
        black_box(a);
    }
}
