//! Numbers of nodes and elements, which may be any, as indices.

/// Finds the index that a number stands for.
pub(super) enum Ids {
    /// One after the other from the first.
    Dense { first: u64, n: u64 },
    /// Numbers with their index, ascending.
    Sparse(Vec<(u64, u32)>),
}

impl Ids {
    /// The numbers of the things with indices 0, 1, ...
    ///
    /// # Errors
    /// A number that occurs twice, and the index of its second occurrence.
    pub fn new(ids: &[u64]) -> Result<Self, (u64, usize)> {
        let first = ids.first().copied().unwrap_or(0);
        if ids.iter().enumerate().all(|(i, &id)| id.checked_sub(first) == Some(i as u64)) {
            return Ok(Self::Dense { first, n: ids.len() as u64 });
        }
        let mut sorted: Vec<(u64, u32)> = ids.iter().copied().zip(0..).collect();
        sorted.sort_unstable();
        match sorted.windows(2).find(|pair| pair[0].0 == pair[1].0) {
            Some(pair) => Err((pair[0].0, pair[1].1 as usize)),
            None => Ok(Self::Sparse(sorted)),
        }
    }

    /// The index of a number.
    pub fn index(&self, id: u64) -> Option<u32> {
        match self {
            Self::Dense { first, n } => id.checked_sub(*first).filter(|i| i < n).map(|i| i as u32),
            Self::Sparse(sorted) => sorted.binary_search_by_key(&id, |&(id, _)| id).ok().map(|at| sorted[at].1),
        }
    }

    /// What there is, for messages.
    pub fn range(&self) -> String {
        match self {
            Self::Dense { n: 0, .. } => "none".to_owned(),
            Self::Dense { first, n } => format!("{first} to {}", first + (n - 1)),
            Self::Sparse(sorted) => {
                format!("{} between {} and {}", sorted.len(), sorted[0].0, sorted[sorted.len() - 1].0)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dense_and_sparse_numbers() {
        for ids in [vec![5, 6, 7], vec![7, 5, 1000], vec![u64::MAX, 0], vec![], vec![u64::MAX]] {
            let map = Ids::new(&ids).unwrap();
            for (i, &id) in ids.iter().enumerate() {
                assert_eq!(map.index(id), Some(i as u32));
            }
            assert_eq!(map.index(4), None);
            assert!(!map.range().is_empty());
        }
        assert_eq!(Ids::new(&[3, 1, 3]).err(), Some((3, 2)));
    }
}
