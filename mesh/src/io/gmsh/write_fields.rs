//! Writes fields on nodes and elements, which have the same layout in all versions.

use super::{names::is_quotable, write::Out};
use crate::io::{DataField, MeshData, fields::written_names};

/// Writes the sections. Gmsh knows scalars, vectors and tensors: fields of other sizes get zeros behind.
pub(super) fn write(data: &MeshData, out: &mut Out, notes: &mut Vec<String>) {
    for (section, fields) in [("NodeData", &data.point_fields), ("ElementData", &data.cell_fields)] {
        let names = written_names(fields, &[], is_quotable, notes);
        for (field, name) in fields.iter().zip(&names) {
            let components = match field.components {
                1 => 1,
                2 | 3 => 3,
                4..=9 => 9,
                n => {
                    notes.push(format!("field {name:?} with {n} components: Gmsh has up to 9"));
                    continue;
                }
            };
            if components != field.components {
                let n = field.components;
                notes.push(format!("that field {name:?} has {n} components: zeros behind make {components}"));
            }
            write_field(section, name, field, components, out);
        }
    }
}

fn write_field(section: &str, name: &str, field: &DataField, components: usize, out: &mut Out) {
    // Gmsh leaves out entries without a value, which is what NaN stands for.
    let entries =
        || (1..).zip(field.values.chunks_exact(field.components)).filter(|(_, v)| !v.iter().all(|x| x.is_nan()));
    let n = entries().count();
    out.text(&format!("${section}\n1\n\"{name}\"\n1\n0\n3\n0\n{components}\n{n}\n"));
    for (number, values) in entries() {
        out.int(number);
        (0..components).for_each(|k| out.real(values.get(k).copied().unwrap_or(0.0)));
        out.end_line();
    }
    out.end(section);
}
