//! Work on slices, shared by a team of threads.

use stylet_solver::team::Team;

/// Cuts a slice evenly, one piece for each member; `work(first, piece)` gets each piece and the index of its first entry.
pub(crate) fn chunks<T: Send>(team: &Team, all: &mut [T], work: &(impl Fn(usize, &mut [T]) + Sync)) {
    let n = team.size();
    if n == 1 {
        return work(0, all);
    }
    let mut pieces = split(n, all);
    team.each(&mut pieces[..n], |_, (first, piece)| work(*first, piece));
}

/// The even pieces of a slice, and where each begins; beyond the first `n` they are empty.
pub(crate) fn split<T>(n: usize, all: &mut [T]) -> [(usize, &mut [T]); Team::MAX_MEMBERS] {
    let len = all.len();
    let mut rest = all;
    std::array::from_fn(|k| {
        let (start, end) = (len * k.min(n) / n, len * (k + 1).min(n) / n);
        let (piece, after) = std::mem::take(&mut rest).split_at_mut(end - start);
        rest = after;
        (start, piece)
    })
}
