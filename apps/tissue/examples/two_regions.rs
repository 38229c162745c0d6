//! Writes the mesh of `examples/two-regions`: a block whose lower half is the region `soft` (1) and whose upper half is the
//! region `stiff` (2), with its bottom (3) and its top (4) as named boundaries, in Gmsh's format.
//!
//! ```text
//! cargo run -p stylet-tissue --example two_regions -- examples/two-regions/two-regions.msh
//! ```

use std::error::Error;
use stylet_mesh::SimplexMesh;
use stylet_mesh::generate::kuhn_box;
use stylet_mesh::import::export;
use stylet_mesh::io::{Format, RegionName, write};

/// Side of the block, m.
const SIDE: f64 = 0.05;

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).ok_or("found no argument, expected the file to write")?;
    let mut mesh: SimplexMesh<3, 4> = kuhn_box([0.0; 3], [SIDE; 3], [4, 4, 4])?;
    let facets: Vec<_> = mesh.boundary_facets().collect();
    for (cell, facet) in facets {
        let corners = mesh.corners(cell);
        let all_at = |z: f64| (0..4).filter(|&k| k != facet).all(|k| corners[k][2] == z);
        if let Some(tag) = if all_at(0.0) { Some(3) } else { all_at(SIDE).then_some(4) } {
            mesh.set_boundary_tag(cell, facet, tag)?;
        }
    }
    let (mut data, _) = export(&mesh).ok_or("a mesh in space can be exported")?;
    let points = data.points.clone();
    for block in data.blocks.iter_mut().filter(|block| block.vertices_per_cell == 4) {
        for (cell, region) in block.vertices.chunks_exact(4).zip(&mut block.regions) {
            let height = cell.iter().map(|&v| points[v as usize][2]).sum::<f64>() / 4.0;
            *region = if height < 0.5 * SIDE { 1 } else { 2 };
        }
    }
    let name = |vertices_per_cell, region, name: &str| RegionName { vertices_per_cell, region, name: name.to_owned() };
    data.region_names = vec![name(4, 1, "soft"), name(4, 2, "stiff"), name(3, 3, "bottom"), name(3, 4, "top")];
    write(path, &data, Format::Msh22)?;
    Ok(())
}
