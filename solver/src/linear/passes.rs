//! The passes over vectors of an iteration of conjugate gradients, each shared by a team.

use crate::precondition::{PreconditionRows, Preconditioner};
use crate::real::Real;
use crate::subspace::Subspace;
use crate::team::Team;
use crate::vector::{self, CHUNK, Sums, group_len};

/// Shorter vectors are left to the calling thread.
const CROSSOVER: usize = 3000;

/// The vectors of an iteration: iterate, residual and preconditioned residual, which stays empty where `M` is the identity.
pub(super) struct Vectors<'a, T> {
    pub x: &'a mut [T],
    pub r: &'a mut [T],
    pub z: &'a mut [T],
}

/// `x ← x + α p`, `r ← r − α q`, `z ← P_W M⁻¹ r`; returns `(rᵀr, rᵀz)`.
pub(super) fn step<const B: usize, T: Real>(
    team: &Team,
    m: &(impl Preconditioner<T> + ?Sized),
    w: &Subspace<B>,
    alpha: T,
    p: &[T],
    q: &[T],
    v: Vectors<T>,
) -> (f64, f64) {
    let Vectors { x, r, z } = v;
    if let Some(rows) = m.by_rows()
        && CHUNK.is_multiple_of(B)
    {
        let (rr, rz) = step_by_rows(team, rows, w, alpha, p, q, Vectors { x, r: &mut *r, z: &mut *z });
        return (rr, if rows.is_finished_later() { rz + rows.finish_rows(r, z) } else { rz });
    }
    let rr = step_residual(team, alpha, p, q, x, r);
    if m.is_identity() {
        return (rr, rr);
    }
    (rr, precondition(team, m, w, r, z))
}

/// `z ← P_W M⁻¹ r`; returns `rᵀz`.
pub(super) fn precondition<const B: usize, T: Real>(
    team: &Team,
    m: &(impl Preconditioner<T> + ?Sized),
    w: &Subspace<B>,
    r: &[T],
    z: &mut [T],
) -> f64 {
    m.apply_on(team, r, z);
    w.project_part(0, z);
    team.dot(r, z)
}

/// What one member of the team works on.
struct Part<'a, T> {
    x: &'a mut [T],
    r: &'a mut [T],
    z: &'a mut [T],
    rr: &'a mut [f64],
    rz: &'a mut [f64],
}

/// All of it in one pass: a chunk of the residual is preconditioned and summed while it is in the first-level cache.
fn step_by_rows<const B: usize, T: Real>(
    team: &Team,
    rows: &dyn PreconditionRows<T>,
    w: &Subspace<B>,
    alpha: T,
    p: &[T],
    q: &[T],
    v: Vectors<T>,
) -> (f64, f64) {
    let n = p.len();
    let group = group_len(n);
    let pass = |first: usize, part: &mut Part<T>| {
        let Part { x, r, z, rr, rz } = part;
        rr.fill(0.0);
        rz.fill(0.0);
        let chunks = x.chunks_mut(CHUNK).zip(r.chunks_mut(CHUNK)).zip(z.chunks_mut(CHUNK));
        for (k, ((x, r), z)) in chunks.enumerate() {
            let at = first + k * CHUNK;
            let range = at..at + x.len();
            let group = k * CHUNK / group;
            let mut sum = [0.0];
            vector::step_residual_groups(CHUNK, alpha, &p[range.clone()], &q[range], x, r, &mut sum);
            rr[group] += sum[0];
            rows.apply_rows(at, r, z);
            w.project_part(at, z);
            vector::dot_groups(CHUNK, r, z, &mut sum);
            rz[group] += sum[0];
        }
    };
    let (mut rr, mut rz) = (Sums::new(), Sums::new());
    if n < CROSSOVER || team.size() == 1 {
        pass(0, &mut Part { x: v.x, r: v.r, z: v.z, rr: rr.groups(), rz: rz.groups() });
    } else {
        let mut x = team.split(v.x).into_iter();
        let mut r = team.split(v.r).into_iter();
        let mut z = team.split(v.z).into_iter();
        let mut rz = team.split_sums(n, &mut rz).into_iter();
        let mut parts = team.split_sums(n, &mut rr).map(|rr| Part {
            x: x.next().unwrap_or_default(),
            r: r.next().unwrap_or_default(),
            z: z.next().unwrap_or_default(),
            rr,
            rz: rz.next().unwrap_or_default(),
        });
        team.each(&mut parts[..team.size()], |member, part| pass(team.share(n, member).start, part));
    }
    (rr.total(n), rz.total(n))
}

/// `x ← x + α p`, `r ← r − α q`; returns `rᵀr`.
fn step_residual<T: Real>(team: &Team, alpha: T, p: &[T], q: &[T], x: &mut [T], r: &mut [T]) -> f64 {
    let n = p.len();
    if n < CROSSOVER || team.size() == 1 {
        return vector::step_residual(alpha, p, q, x, r);
    }
    let mut sums = Sums::new();
    let mut x = team.split(x).into_iter();
    let mut r = team.split(r).into_iter();
    let mut parts =
        team.split_sums(n, &mut sums).map(|sums| (x.next().unwrap_or_default(), r.next().unwrap_or_default(), sums));
    team.each(&mut parts[..team.size()], |member, (x, r, sums)| {
        let range = team.share(n, member);
        vector::step_residual_groups(group_len(n), alpha, &p[range.clone()], &q[range], x, r, sums);
    });
    sums.total(n)
}
