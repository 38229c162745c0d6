//! A tree of bounding boxes over the cells of the start mesh.

/// Boxes in one node that is not divided any further.
const LEAF_SIZE: usize = 4;
/// A median split halves the items, so that no tree over 32-bit indices is deeper.
const MAX_DEPTH: usize = 34;

/// An axis-aligned box.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Bounds<const D: usize> {
    pub lower: [f64; D],
    pub upper: [f64; D],
}

impl<const D: usize> Bounds<D> {
    const EMPTY: Self = Self { lower: [f64::INFINITY; D], upper: [f64::NEG_INFINITY; D] };

    /// The box of some points, grown on every side by `margin` times the sum of its extents.
    pub fn of(points: &[[f64; D]], margin: f64) -> Self {
        let mut bounds = Self::EMPTY;
        for p in points {
            bounds.join(&Self { lower: *p, upper: *p });
        }
        let grow = margin * (0..D).map(|k| bounds.upper[k] - bounds.lower[k]).sum::<f64>();
        Self { lower: bounds.lower.map(|x| x - grow), upper: bounds.upper.map(|x| x + grow) }
    }

    fn join(&mut self, other: &Self) {
        for k in 0..D {
            self.lower[k] = self.lower[k].min(other.lower[k]);
            self.upper[k] = self.upper[k].max(other.upper[k]);
        }
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
}

#[derive(Clone, Copy, PartialEq, Debug)]
struct BoxNode<const D: usize> {
    bounds: Bounds<D>,
    /// The range of `items` below this node.
    range: [u32; 2],
    /// The second child, the first is the next node; 0 in a leaf.
    second: u32,
}

/// Finds, among many boxes, those that meet a segment.
///
/// Unlike a uniform grid it neither grows nor slows down when the cells differ much in size.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct BoundingTree<const D: usize> {
    nodes: Vec<BoxNode<D>>,
    items: Vec<u32>,
    /// By item.
    boxes: Vec<Bounds<D>>,
}

impl<const D: usize> Default for BoundingTree<D> {
    fn default() -> Self {
        Self { nodes: Vec::new(), items: Vec::new(), boxes: Vec::new() }
    }
}

impl<const D: usize> BoundingTree<D> {
    pub fn new(boxes: Vec<Bounds<D>>) -> Self {
        let items = (0..boxes.len() as u32).collect();
        let mut tree = Self { nodes: Vec::new(), items, boxes };
        tree.divide(0, tree.items.len());
        tree
    }

    /// Appends the subtree over `items[start..end]`, split at the median of the axis along which it is widest.
    fn divide(&mut self, start: usize, end: usize) {
        let mut bounds = Bounds::EMPTY;
        for &item in &self.items[start..end] {
            bounds.join(&self.boxes[item as usize]);
        }
        let node = self.nodes.len();
        self.nodes.push(BoxNode { bounds, range: [start as u32, end as u32], second: 0 });
        if end - start <= LEAF_SIZE {
            return;
        }
        let extent = |k: &usize| bounds.upper[*k] - bounds.lower[*k];
        let axis = (0..D).max_by(|i, j| extent(i).total_cmp(&extent(j))).unwrap_or(0);
        let boxes = &self.boxes;
        let centre = |item: u32| boxes[item as usize].lower[axis] + boxes[item as usize].upper[axis];
        let middle = (end - start) / 2;
        self.items[start..end].select_nth_unstable_by(middle, |&i, &j| centre(i).total_cmp(&centre(j)).then(i.cmp(&j)));
        self.divide(start, start + middle);
        self.nodes[node].second = self.nodes.len() as u32;
        self.divide(start + middle, end);
    }

    /// Calls `visit` with every item whose box is within `reach` (along each axis) of the closed segment from `a` to `b`,
    /// in no order to rely on.
    pub fn visit(&self, a: &[f64; D], b: &[f64; D], reach: f64, mut visit: impl FnMut(u32)) {
        let mut stack = [0_u32; MAX_DEPTH];
        let mut depth = usize::from(!self.nodes.is_empty());
        while depth > 0 {
            depth -= 1;
            let at = stack[depth] as usize;
            let node = &self.nodes[at];
            if !node.bounds.meets(a, b, reach) {
                continue;
            }
            if node.second != 0 {
                stack[depth] = node.second;
                stack[depth + 1] = at as u32 + 1;
                depth += 2;
                continue;
            }
            for &item in &self.items[node.range[0] as usize..node.range[1] as usize] {
                if self.boxes[item as usize].meets(a, b, reach) {
                    visit(item);
                }
            }
        }
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
        let tree = BoundingTree::new(boxes.clone());
        for (a, b) in [([3.0, 5.0], [3.0, 5.0]), ([0.0, 0.0], [100.0, 60.0]), ([50.0, 90.0], [50.0, -1.0])] {
            let mut found = Vec::new();
            tree.visit(&a, &b, 0.5, |item| found.push(item));
            found.sort_unstable();
            let scan: Vec<u32> = (0..300).filter(|&i| boxes[i as usize].meets(&a, &b, 0.5)).collect();
            assert_eq!(found, scan);
        }
    }
}
