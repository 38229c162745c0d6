//! The initialisation by colours: an order of the vertices of each start cell for which Maubach's rule closes at bounded
//! cost, whatever the start mesh.
//!
//! Vertices get colours so that the ends of every edge differ; each cell lists its vertices by ascending colour, except
//! that a vertex of the last of all colours comes first. Shapes play no part in it: expect flatter cells than from the
//! longest edge. On a Kuhn cube, greedy colours meet the diagonal last: a short edge is bisected first.
//!
//! Source: Diening, Gehring & Storn, *Adaptive mesh refinement for arbitrary initial triangulations*, Found. Comput.
//! Math. (2025), Algorithm 4.

use crate::node::Node;

/// The cells around each vertex, ascending: those of vertex `v` are `cells[offsets[v]..offsets[v + 1]]`.
pub(crate) struct Stars {
    offsets: Vec<u32>,
    cells: Vec<u32>,
}

impl Stars {
    pub fn new<const N: usize>(n_vertices: usize, cells: &[Node<N>]) -> Self {
        let mut offsets = vec![0_u32; n_vertices + 1];
        for &v in cells.iter().flat_map(|node| &node.v) {
            offsets[v as usize + 1] += 1;
        }
        for v in 0..n_vertices {
            offsets[v + 1] += offsets[v];
        }
        let mut next = offsets.clone();
        let mut list = vec![0; N * cells.len()];
        for (cell, node) in cells.iter().enumerate() {
            for &v in &node.v {
                let at = &mut next[v as usize];
                list[*at as usize] = cell as u32;
                *at += 1;
            }
        }
        Self { offsets, cells: list }
    }

    pub fn of(&self, vertex: u32) -> &[u32] {
        let v = vertex as usize;
        &self.cells[self.offsets[v] as usize..self.offsets[v + 1] as usize]
    }
}

/// Puts the vertices of the start cells into the order of their colours.
pub(crate) fn order_by_colour<const N: usize>(n_vertices: usize, cells: &mut [Node<N>]) {
    let colours = greedy_colours(&Stars::new(n_vertices, cells), n_vertices, cells);
    let last = colours.iter().copied().max().unwrap_or(0);
    for node in cells {
        order(node, |v| {
            let colour = colours[v as usize];
            (colour != last, colour)
        });
    }
}

/// The smallest colour that no neighbour of smaller id has, by vertex.
fn greedy_colours<const N: usize>(stars: &Stars, n_vertices: usize, cells: &[Node<N>]) -> Vec<u32> {
    let mut colours = vec![0_u32; n_vertices];
    // Taken by a neighbour of the vertex whose number, plus one, stands here.
    let mut taken_for: Vec<u32> = Vec::new();
    for v in 0..n_vertices as u32 {
        for &neighbor in stars.of(v).iter().flat_map(|&cell| &cells[cell as usize].v).filter(|&&w| w < v) {
            let colour = colours[neighbor as usize] as usize;
            if colour >= taken_for.len() {
                taken_for.resize(colour + 1, 0);
            }
            taken_for[colour] = v + 1;
        }
        let free = taken_for.iter().position(|&taken| taken != v + 1);
        colours[v as usize] = free.unwrap_or(taken_for.len()) as u32;
    }
    colours
}

/// Sorts the vertices of a start cell, and its links alike, by a key that differs for each.
fn order<const N: usize>(node: &mut Node<N>, key: impl Fn(u32) -> (bool, u32)) {
    for i in 1..N {
        for j in (1..=i).rev() {
            if key(node.v[j]) < key(node.v[j - 1]) {
                node.v.swap(j, j - 1);
                node.links.swap(j, j - 1);
                node.flip();
            }
        }
    }
}
