//! Which material a region has.

use super::BodyError;

/// Region numbers, ascending; the material of each has the same index. None: one material for all regions.
#[derive(Clone, Debug, Default)]
pub(super) struct Regions(Vec<u32>);

impl Regions {
    /// One material, whatever the region.
    pub fn all() -> Self {
        Self::default()
    }

    /// Sorts materials by region.
    pub fn sorted<M: Clone>(materials: &[(u32, M)]) -> Result<(Self, Vec<M>), BodyError> {
        if materials.is_empty() {
            return Err(BodyError::NoMaterial);
        }
        let mut order: Vec<&(u32, M)> = materials.iter().collect();
        order.sort_by_key(|entry| entry.0);
        let ids: Vec<u32> = order.iter().map(|entry| entry.0).collect();
        check_once(&ids, "materials")?;
        Ok((Self(ids), order.into_iter().map(|entry| entry.1.clone()).collect()))
    }

    /// The index of the material of a region.
    pub fn index(&self, region: u32) -> Option<u32> {
        if self.0.is_empty() {
            return Some(0);
        }
        self.0.binary_search(&region).ok().map(|index| index as u32)
    }

    /// The region of a material; `None` if it is that of all.
    pub fn id(&self, index: usize) -> Option<u32> {
        self.0.get(index).copied()
    }

    /// The regions that have a material.
    pub fn names(&self) -> String {
        let names: Vec<String> = self.0.iter().map(u32::to_string).collect();
        names.join(", ")
    }
}

/// Refuses a region that ascending numbers name twice.
pub(super) fn check_once(ids: &[u32], what: &'static str) -> Result<(), BodyError> {
    let Some(pair) = ids.windows(2).find(|pair| pair[0] == pair[1]) else { return Ok(()) };
    let times = ids.iter().filter(|&&id| id == pair[0]).count();
    Err(BodyError::RegionListed { region: pair[0], times, what })
}
