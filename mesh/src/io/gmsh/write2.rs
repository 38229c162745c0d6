//! Writes version 2.2.

use super::{
    elements::type_of,
    names,
    write::{Out, check_counts, entities, note_negative},
    write_fields,
};
use crate::io::MeshData;

/// The bytes of a file.
///
/// # Errors
/// What does not fit: more points or cells than 31 bits count.
pub(in crate::io) fn write(data: &MeshData, is_binary: bool, notes: &mut Vec<String>) -> Result<Vec<u8>, String> {
    check_counts(data)?;
    let mut out = Out::new("2.2", is_binary);
    out.text(&names::section(data, notes));
    out.text(&format!("$Nodes\n{}\n", data.points.len()));
    for (number, point) in (1..).zip(&data.points) {
        out.int(number);
        point.iter().for_each(|&x| out.real(x));
        out.end_line();
    }
    out.end("Nodes");
    out.text(&format!("$Elements\n{}\n", data.n_cells()));
    let (entities, mut number) = (entities(data), 0);
    note_negative(&entities, notes);
    for block in data.blocks.iter().filter(|block| block.n_cells() > 0) {
        let size = block.vertices_per_cell;
        if is_binary {
            [type_of(size), block.n_cells() as i32, 2].into_iter().for_each(|value| out.int(value));
        }
        for (vertices, &region) in block.vertices.chunks_exact(size).zip(&block.regions) {
            number += 1;
            out.int(number);
            if !is_binary {
                out.int(type_of(size));
                out.int(2);
            }
            out.int(region);
            out.int(entities[&(size, region)]);
            vertices.iter().for_each(|&v| out.int(v as i32 + 1));
            out.end_line();
        }
    }
    out.end("Elements");
    write_fields::write(data, &mut out, notes);
    Ok(out.bytes)
}
