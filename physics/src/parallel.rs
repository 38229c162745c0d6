//! Independent pieces of work on several threads, or one after the other without the feature `rayon`.

/// Both of two pieces of work.
pub(crate) fn join(left: impl FnOnce() + Send, right: impl FnOnce() + Send) {
    #[cfg(feature = "rayon")]
    rayon::join(left, right);
    #[cfg(not(feature = "rayon"))]
    {
        left();
        right();
    }
}

/// Calls `work(k, &mut parts[k])` for every part, on up to `threads` threads.
pub(crate) fn each<P: Send>(parts: &mut [P], threads: usize, work: &(impl Fn(usize, &mut P) + Sync)) {
    each_from(0, parts, threads, work);
}

fn each_from<P: Send>(first: usize, parts: &mut [P], threads: usize, work: &(impl Fn(usize, &mut P) + Sync)) {
    if threads > 1 && parts.len() > 1 {
        let cut = parts.len() / 2;
        let (left, right) = parts.split_at_mut(cut);
        join(
            || each_from(first, left, threads / 2, work),
            || each_from(first + cut, right, threads - threads / 2, work),
        );
        return;
    }
    for (k, part) in parts.iter_mut().enumerate() {
        work(first + k, part);
    }
}

/// Cuts a slice evenly for up to `threads` threads; `work(first, part)` gets each part and the index of its first entry.
pub(crate) fn chunks<T: Send>(all: &mut [T], threads: usize, work: &(impl Fn(usize, &mut [T]) + Sync)) {
    chunks_from(0, all, threads, work);
}

fn chunks_from<T: Send>(first: usize, all: &mut [T], threads: usize, work: &(impl Fn(usize, &mut [T]) + Sync)) {
    if threads > 1 && all.len() > 1 {
        let cut = all.len() * (threads / 2) / threads;
        let (left, right) = all.split_at_mut(cut);
        join(
            || chunks_from(first, left, threads / 2, work),
            || chunks_from(first + cut, right, threads - threads / 2, work),
        );
        return;
    }
    work(first, all);
}
