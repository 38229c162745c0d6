//! A tree of bounding boxes over items that do not change: the cells of the start mesh.

/// A node of more items than this is divided.
const LEAF_SIZE: usize = 8;
/// Halving 2^32 items ends before.
const MAX_DEPTH: usize = 32;
/// More than the rounding of a coordinate between 0 and 1 to single precision.
const ROUNDING: f64 = 1.2e-7;

/// An axis-aligned box.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Bounds<const D: usize> {
    pub lower: [f64; D],
    pub upper: [f64; D],
}

impl<const D: usize> Bounds<D> {
    /// The box that contains nothing.
    pub const EMPTY: Self = Self { lower: [f64::INFINITY; D], upper: [f64::NEG_INFINITY; D] };

    /// The box of some points, grown on every side by `margin` times the sum of its extents.
    pub fn of(points: &[[f64; D]], margin: f64) -> Self {
        let mut bounds = Self::EMPTY;
        for p in points {
            bounds.join(&Self { lower: *p, upper: *p });
        }
        let grow = margin * (0..D).map(|k| bounds.upper[k] - bounds.lower[k]).sum::<f64>();
        Self { lower: bounds.lower.map(|x| x - grow), upper: bounds.upper.map(|x| x + grow) }
    }

    /// Grows the box so that it contains another.
    #[inline]
    pub fn join(&mut self, other: &Self) {
        for k in 0..D {
            self.lower[k] = self.lower[k].min(other.lower[k]);
            self.upper[k] = self.upper[k].max(other.upper[k]);
        }
    }

    /// Whether the closed box contains a point.
    #[inline]
    pub fn contains(&self, p: &[f64; D]) -> bool {
        // Without a branch per axis.
        (0..D).fold(true, |inside, k| inside & (p[k] >= self.lower[k]) & (p[k] <= self.upper[k]))
    }

    /// Whether the closed segment from `a` to `b`, which may be a point, meets the box grown on all sides by `reach`.
    pub fn meets(&self, a: &[f64; D], b: &[f64; D], reach: f64) -> bool {
        let (mut from, mut to) = (0.0_f64, 1.0_f64);
        for k in 0..D {
            let (lower, upper) = (self.lower[k] - reach, self.upper[k] + reach);
            let slope = b[k] - a[k];
            if slope == 0.0 {
                if a[k] < lower || a[k] > upper {
                    return false;
                }
                continue;
            }
            let (t0, t1) = ((lower - a[k]) / slope, (upper - a[k]) / slope);
            from = from.max(t0.min(t1));
            to = to.min(t0.max(t1));
        }
        from <= to
    }

    /// Whether two closed boxes meet.
    pub fn overlaps(&self, other: &Self) -> bool {
        (0..D).all(|k| self.lower[k] <= other.upper[k] && other.lower[k] <= self.upper[k])
    }

    /// The sum of the extents along the axes.
    #[inline]
    pub fn extent(&self) -> f64 {
        (0..D).map(|k| self.upper[k] - self.lower[k]).sum()
    }
}

/// A box in coordinates of the tree, where the whole is the unit cube, in single precision: what a search has to load is
/// what it costs.
type UnitBox<const D: usize> = [[f32; D]; 2];

/// Finds, among many items with boxes, those that may meet a point or a segment.
///
/// Unlike a uniform grid it neither grows nor slows down when the cells differ much in size. All leaves of the tree are
/// of one depth, node `i` has the children `2 i` and `2 i + 1`, and leaf `j` of `n` the `j`-th of `n` equal parts of the
/// items: only boxes are stored.
///
/// Coordinates are mapped to those of the tree by operations that keep their order (`x <= y` before implies `x <= y`
/// after, rounding included), so that no point within a box falls out of it.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct BoundingTree<const D: usize> {
    origin: [f64; D],
    scale: [f64; D],
    n_items: usize,
    depth: u32,
    /// By node; the root is node 1.
    boxes: Vec<UnitBox<D>>,
}

/// What the division of the items into parts needs to know of one.
#[derive(Clone, Copy)]
struct Centre<const D: usize> {
    /// The bits of floating-point numbers that are not negative are ordered as the numbers are.
    key: [u32; D],
    item: u32,
}

impl<const D: usize> BoundingTree<D> {
    /// The tree over some boxes, and the order of the items in it.
    pub fn new(boxes: &[Bounds<D>]) -> (Self, Vec<u32>) {
        let mut whole = Bounds::EMPTY;
        boxes.iter().for_each(|bounds| whole.join(bounds));
        let parts = boxes.len().div_ceil(LEAF_SIZE).next_power_of_two();
        let scale = std::array::from_fn(|k| {
            let extent = whole.upper[k] - whole.lower[k];
            if extent > 0.0 { 1.0 / extent } else { 1.0 }
        });
        let mut tree = Self {
            origin: whole.lower,
            scale,
            n_items: boxes.len(),
            depth: parts.trailing_zeros(),
            boxes: vec![[[f32::INFINITY; D], [f32::NEG_INFINITY; D]]; 2 * parts],
        };
        let centre = |(item, bounds): (usize, &Bounds<D>)| {
            let middle = std::array::from_fn(|k| 0.5 * bounds.lower[k] + 0.5 * bounds.upper[k]);
            Centre { key: tree.unit(&middle).map(|x| x.max(0.0).to_bits()), item: item as u32 }
        };
        let mut centres: Vec<Centre<D>> = boxes.iter().enumerate().map(centre).collect();
        tree.divide(0, 0, &mut centres);
        let order: Vec<u32> = centres.iter().map(|c| c.item).collect();
        for part in 0..parts {
            for &item in &order[tree.items(part)] {
                let bounds = &boxes[item as usize];
                let unit = [tree.unit(&bounds.lower), tree.unit(&bounds.upper)];
                join(&mut tree.boxes[parts + part], &unit);
            }
        }
        for node in (1..parts).rev() {
            let (low, high) = (tree.boxes[2 * node], tree.boxes[2 * node + 1]);
            join(&mut tree.boxes[node], &low);
            join(&mut tree.boxes[node], &high);
        }
        (tree, order)
    }

    /// The memory that the tree takes: entries times size.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.boxes[..])
    }

    /// Sorts items into the parts that the subtree of part `part` at some depth divides them into: at each step by the
    /// median along the axis along which they spread most.
    fn divide(&self, depth: u32, part: usize, centres: &mut [Centre<D>]) {
        if depth == self.depth {
            return;
        }
        let (mut lower, mut upper) = ([u32::MAX; D], [0; D]);
        for centre in &*centres {
            for k in 0..D {
                lower[k] = lower[k].min(centre.key[k]);
                upper[k] = upper[k].max(centre.key[k]);
            }
        }
        let spread = |k: &usize| f64::from(f32::from_bits(upper[*k]) - f32::from_bits(lower[*k])) / self.scale[*k];
        let axis = (0..D).max_by(|i, j| spread(i).total_cmp(&spread(j))).unwrap_or(0);
        // Where the part after the middle begins, from where this one does.
        let begin = |part: usize, depth: u32| (part * self.n_items) >> depth;
        let middle = begin(2 * part + 1, depth + 1) - begin(part, depth);
        if 0 < middle && middle < centres.len() {
            centres.select_nth_unstable_by_key(middle, |c| (c.key[axis], c.item));
        }
        let (low, high) = centres.split_at_mut(middle);
        self.divide(depth + 1, 2 * part, low);
        self.divide(depth + 1, 2 * part + 1, high);
    }

    /// The items of a leaf.
    #[inline]
    fn items(&self, part: usize) -> std::ops::Range<usize> {
        (part * self.n_items) >> self.depth..((part + 1) * self.n_items) >> self.depth
    }

    /// A point in coordinates of the tree.
    #[inline]
    fn unit(&self, p: &[f64; D]) -> [f32; D] {
        std::array::from_fn(|k| ((p[k] - self.origin[k]) * self.scale[k]) as f32)
    }

    /// Calls `visit` with ranges, in the order that [`new`](Self::new) returned, of the items that may have a point.
    #[inline]
    pub fn visit_at(&self, p: &[f64; D], visit: impl FnMut(std::ops::Range<usize>)) {
        let p = self.unit(p);
        // Without a branch per axis.
        let contains = |[lower, upper]: &UnitBox<D>| {
            (0..D).fold(true, |inside, k| inside & (p[k] >= lower[k]) & (p[k] <= upper[k]))
        };
        self.visit_where(contains, visit);
    }

    /// Calls `visit` with ranges, in the order that [`new`](Self::new) returned, of the items that may be within `reach`
    /// (along each axis) of the closed segment from `a` to `b`.
    pub fn visit(&self, a: &[f64; D], b: &[f64; D], reach: f64, visit: impl FnMut(std::ops::Range<usize>)) {
        let unit = |p: &[f64; D]| -> [f64; D] { std::array::from_fn(|k| (p[k] - self.origin[k]) * self.scale[k]) };
        let (a, b) = (unit(a), unit(b));
        let meets = |[lower, upper]: &UnitBox<D>| {
            let grow = |k: usize| reach * self.scale[k] + ROUNDING;
            let lower = std::array::from_fn(|k| f64::from(lower[k]) - grow(k));
            let upper = std::array::from_fn(|k| f64::from(upper[k]) + grow(k));
            Bounds::<D> { lower, upper }.meets(&a, &b, 0.0)
        };
        self.visit_where(meets, visit);
    }

    #[inline]
    fn visit_where(&self, meets: impl Fn(&UnitBox<D>) -> bool, mut visit: impl FnMut(std::ops::Range<usize>)) {
        if !meets(&self.boxes[1]) {
            return;
        }
        let first_leaf = 1 << self.depth;
        let mut stack = [0; MAX_DEPTH];
        let (mut depth, mut node) = (0, 1);
        loop {
            if node >= first_leaf {
                visit(self.items(node - first_leaf));
            } else {
                let low = meets(&self.boxes[2 * node]);
                let high = meets(&self.boxes[2 * node + 1]);
                if low | high {
                    // Which of the two it is cannot be predicted: it is computed, not branched on.
                    stack[depth] = 2 * node + 1;
                    depth += usize::from(low & high);
                    node = 2 * node + usize::from(!low);
                    continue;
                }
            }
            if depth == 0 {
                return;
            }
            depth -= 1;
            node = stack[depth];
        }
    }
}

fn join<const D: usize>(bounds: &mut UnitBox<D>, other: &UnitBox<D>) {
    for k in 0..D {
        bounds[0][k] = bounds[0][k].min(other[0][k]);
        bounds[1][k] = bounds[1][k].max(other[1][k]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tree_finds_what_a_scan_finds() {
        let boxes: Vec<Bounds<2>> = (0..300_u32)
            .map(|i| {
                let corner = [f64::from(i * 37 % 101), f64::from(i * 53 % 97)];
                Bounds::of(&[corner, [corner[0] + f64::from(i % 7), corner[1] + 0.5]], 0.0)
            })
            .collect();
        let (tree, order) = BoundingTree::new(&boxes);
        for (a, b) in [([3.0, 5.0], [3.0, 5.0]), ([0.0, 0.0], [100.0, 60.0]), ([50.0, 90.0], [50.0, -1.0])] {
            let meets = |i: &u32| boxes[*i as usize].meets(&a, &b, 0.5);
            let mut found: Vec<u32> = Vec::new();
            tree.visit(&a, &b, 0.5, |range| found.extend(order[range].iter().filter(|i| meets(i))));
            found.sort_unstable();
            let scan: Vec<u32> = (0..300).filter(meets).collect();
            assert_eq!(found, scan);

            let contains = |i: &u32| boxes[*i as usize].contains(&a);
            let mut found: Vec<u32> = Vec::new();
            tree.visit_at(&a, |range| found.extend(order[range].iter().filter(|i| contains(i))));
            found.sort_unstable();
            let scan: Vec<u32> = (0..300).filter(contains).collect();
            assert_eq!(found, scan);
        }
        let (empty, order) = BoundingTree::<2>::new(&[]);
        assert!(order.is_empty());
        empty.visit_at(&[0.0; 2], |range| assert!(range.is_empty()));
        empty.visit(&[0.0; 2], &[1.0; 2], 0.5, |range| assert!(range.is_empty()));
    }
}
