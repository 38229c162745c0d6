//! Slots for rows of varying length in one growing array, with a free list per slot size.

/// Where a row lives: `len` of the `capacity` places from `start` on are in use.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Slot {
    pub start: u32,
    pub len: u32,
    pub capacity: u32,
}

impl Slot {
    #[inline(always)]
    pub fn range(self) -> std::ops::Range<usize> {
        let start = self.start as usize;
        start..start + self.len as usize
    }
}

/// Hands out slots of an array of `end` places, in sizes that are multiples of `GRAIN`. Freed slots are handed out again, last in first out, to rows of the same
/// slot size.
#[derive(Clone, Debug, Default)]
pub(super) struct Arena<const GRAIN: usize> {
    end: usize,
    /// `free[k]`: starts of the unused slots of capacity `(k + 1) * GRAIN`.
    free: Vec<Vec<u32>>,
}

impl<const GRAIN: usize> Arena<GRAIN> {
    /// Number of places handed out so far, used or not: the length the arrays must have.
    pub fn end(&self) -> usize {
        self.end
    }

    /// An empty slot with room for `len` places; `None` if the array would exceed `u32` indices.
    pub fn allocate(&mut self, len: usize) -> Option<Slot> {
        if len == 0 {
            return Some(Slot::default());
        }
        let capacity = len.checked_next_multiple_of(GRAIN)?;
        if let Some(start) = self.free_list(capacity).and_then(Vec::pop) {
            let capacity = capacity as u32;
            return Some(Slot { start, len: 0, capacity });
        }
        let slot = Slot { start: u32::try_from(self.end).ok()?, len: 0, capacity: u32::try_from(capacity).ok()? };
        self.end = self.end.checked_add(capacity)?;
        Some(slot)
    }

    /// Takes a slot back.
    pub fn release(&mut self, slot: Slot) {
        let capacity = slot.capacity as usize;
        if capacity == 0 {
            return;
        }
        if self.free.len() < capacity / GRAIN {
            self.free.resize_with(capacity / GRAIN, Vec::new);
        }
        self.free[capacity / GRAIN - 1].push(slot.start);
    }

    fn free_list(&mut self, capacity: usize) -> Option<&mut Vec<u32>> {
        self.free.get_mut(capacity / GRAIN - 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_released_slot_is_used_again_by_a_row_of_its_size() {
        let mut arena = Arena::<4>::default();
        let a = arena.allocate(3).unwrap();
        let b = arena.allocate(9).unwrap();
        assert_eq!((a.start, a.capacity), (0, 4));
        assert_eq!((b.start, b.capacity), (4, 12));
        arena.release(a);
        assert_eq!(arena.allocate(5).unwrap().start, 16); // other size: new place
        assert_eq!(arena.allocate(4).unwrap().start, 0);
        assert_eq!(arena.end(), 24);
        assert_eq!(arena.allocate(0).unwrap().capacity, 0);
    }
}
