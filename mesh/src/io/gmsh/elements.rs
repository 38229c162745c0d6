//! Gmsh's numbers of element types.

use crate::io::Problem;
use std::borrow::Cow;

/// The types that are read: number and vertices.
const SIMPLICES: [(i64, usize); 4] = [(15, 1), (1, 2), (2, 3), (4, 4)];

/// The vertices of an element of a type; an error, with the number of such elements, if it is no simplex of first order.
pub(super) fn vertices_per_cell(kind: i64, count: impl Fn() -> u64) -> Result<usize, Problem> {
    let known = SIMPLICES.into_iter().find(|&(known, _)| known == kind);
    known.map(|(_, size)| size).ok_or_else(|| Problem::Element { kind: name(kind), count: count() })
}

/// The number of the type with so many vertices.
pub(super) fn type_of(size: usize) -> i32 {
    SIMPLICES.into_iter().find(|&(_, vertices)| vertices == size).map_or(0, |(kind, _)| kind as i32)
}

fn name(kind: i64) -> Cow<'static, str> {
    let name = match kind {
        3 => "quadrangle",
        5 => "hexahedron",
        6 => "prism",
        7 => "pyramid",
        8 => "line with 3 nodes",
        9 => "triangle with 6 nodes",
        10 => "quadrangle with 9 nodes",
        11 => "tetrahedron with 10 nodes",
        12 => "hexahedron with 27 nodes",
        13 => "prism with 18 nodes",
        14 => "pyramid with 14 nodes",
        16 => "quadrangle with 8 nodes",
        17 => "hexahedron with 20 nodes",
        18 => "prism with 15 nodes",
        19 => "pyramid with 13 nodes",
        20 => "incomplete triangle with 9 nodes",
        21 => "triangle with 10 nodes",
        26 => "line with 4 nodes",
        29 => "tetrahedron with 20 nodes",
        _ => return format!("number {kind}").into(),
    };
    format!("{name} (number {kind})").into()
}
