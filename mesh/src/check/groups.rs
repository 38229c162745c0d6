//! Disjoint sets of small numbers, merged two by two.

/// Disjoint sets; each is known by its least member.
///
/// Source: Tarjan & van Leeuwen, *Worst-case analysis of set union algorithms*, J. ACM 31 (1984): path halving.
pub(super) struct Groups(Vec<u32>);

impl Groups {
    /// `n` sets of one member each.
    pub fn new(n: usize) -> Self {
        Self((0..n as u32).collect())
    }

    /// The least member of the set of `i`.
    pub fn root(&mut self, i: u32) -> u32 {
        let mut at = i;
        while self.0[at as usize] != at {
            let above = self.0[self.0[at as usize] as usize];
            self.0[at as usize] = above;
            at = above;
        }
        at
    }

    /// Merges the sets of `i` and `j`.
    pub fn join(&mut self, i: u32, j: u32) {
        let (a, b) = (self.root(i), self.root(j));
        self.0[a.max(b) as usize] = a.min(b);
    }

    /// The sets among `members` (ascending), each ascending, by their first members.
    pub fn among(&mut self, members: impl Iterator<Item = u32>) -> Vec<Vec<u32>> {
        let mut named: Vec<(u32, u32)> = members.map(|i| (self.root(i), i)).collect();
        named.sort_unstable();
        named.chunk_by(|a, b| a.0 == b.0).map(|group| group.iter().map(|&(_, i)| i).collect()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_are_listed_in_order() {
        let mut groups = Groups::new(7);
        for (i, j) in [(5, 3), (6, 5), (1, 4)] {
            groups.join(i, j);
        }
        assert_eq!(groups.among(0..7), [vec![0], vec![1, 4], vec![2], vec![3, 5, 6]]);
    }
}
