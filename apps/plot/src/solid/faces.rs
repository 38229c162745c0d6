//! The faces that a mesh in space shows: the skin of what is left after the cut.

use super::view::{Vec3, cross, dot, minus, unit};

/// A triangle of the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Face {
    /// Its corners.
    pub corners: [u32; 3],
    /// The cell it belongs to, which gives it its colour and its place in the order.
    pub cell: u32,
    /// Outward unit normal; for a surface, the one towards the viewer.
    pub normal: Vec3,
    /// Whether the cut laid it open: there is a cell on its other side, which is not drawn.
    pub is_cut: bool,
}

/// What is drawn of some tetrahedra, and for each facet between two of them which is behind.
pub(super) struct Skin {
    pub faces: Vec<Face>,
    pub pairs: Vec<(u32, u32)>,
}

/// The faces of tetrahedra that turn towards the viewer, of those that are kept.
pub(super) fn skin(points: &[Vec3], cells: &[[u32; 4]], kept: &[bool], towards: Vec3) -> Skin {
    let mut facets: Vec<([u32; 3], u32, u8)> = Vec::with_capacity(4 * cells.len());
    for (cell, v) in cells.iter().enumerate() {
        for opposite in 0..4 {
            let mut key = others(v, opposite);
            key.sort_unstable();
            facets.push((key, cell as u32, opposite as u8));
        }
    }
    facets.sort_unstable();
    let mut skin = Skin { faces: Vec::new(), pairs: Vec::new() };
    for group in facets.chunk_by(|f, g| f.0 == g.0) {
        let n_kept = group.iter().filter(|facet| kept[facet.1 as usize]).count();
        for &(_, cell, opposite) in group {
            let v = &cells[cell as usize];
            let Some(normal) = outward(points, v, opposite.into()) else { continue };
            let faces_viewer = dot(normal, towards) > 0.0;
            if let [f, g] = group
                && faces_viewer
            {
                let other = if f.1 == cell { g.1 } else { f.1 };
                skin.pairs.push((cell, other));
            }
            if kept[cell as usize] && n_kept == 1 && faces_viewer {
                let corners = others(v, opposite.into());
                skin.faces.push(Face { corners, cell, normal, is_cut: group.len() > 1 });
            }
        }
    }
    skin
}

fn others(v: &[u32; 4], opposite: usize) -> [u32; 3] {
    let mut rest = v.iter().enumerate().filter(|&(i, _)| i != opposite).map(|(_, &v)| v);
    std::array::from_fn(|_| rest.next().unwrap_or(0))
}

/// The unit normal of the facet opposite a vertex, away from it.
fn outward(points: &[Vec3], v: &[u32; 4], opposite: usize) -> Option<Vec3> {
    let [a, b, c] = others(v, opposite).map(|i| points[i as usize]);
    let normal = unit(cross(minus(b, a), minus(c, a)))?;
    let inside = dot(normal, minus(points[v[opposite] as usize], a));
    Some(if inside > 0.0 { normal.map(|x| -x) } else { normal })
}

/// The triangles of a surface, seen from either side; those seen edge-on are left out.
pub(super) fn surface(points: &[Vec3], triangles: &[[u32; 3]], kept: &[bool], towards: Vec3) -> Vec<Face> {
    let mut faces = Vec::new();
    for (cell, corners) in triangles.iter().enumerate().filter(|&(cell, _)| kept[cell]) {
        let [a, b, c] = corners.map(|i| points[i as usize]);
        if let Some(normal) = unit(cross(minus(b, a), minus(c, a))) {
            let normal = if dot(normal, towards) < 0.0 { normal.map(|x| -x) } else { normal };
            faces.push(Face { corners: *corners, cell: cell as u32, normal, is_cut: false });
        }
    }
    faces
}
