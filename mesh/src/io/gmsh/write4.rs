//! Writes version 4.1.

use super::{
    elements::type_of,
    names,
    write::{Out, check_counts, entities, note_negative},
    write_fields,
};
use crate::io::MeshData;
use std::collections::BTreeMap;

/// The bytes of a file. Cells keep their order: each run of one size and region is a block of elements.
///
/// # Errors
/// What does not fit: more points or cells than 31 bits count, which fields are numbered with.
pub(in crate::io) fn write(data: &MeshData, is_binary: bool, notes: &mut Vec<String>) -> Result<Vec<u8>, String> {
    check_counts(data)?;
    let mut out = Out::new("4.1", is_binary);
    out.text(&names::section(data, notes));
    let mut entities = entities(data);
    note_negative(&entities, notes);
    if entities.is_empty() {
        // Nodes have to belong to something.
        entities.insert((1, 0), 1);
    }
    write_entities(data, &entities, &mut out);
    write_nodes(data, &entities, &mut out);
    write_elements(data, &entities, &mut out);
    write_fields::write(data, &mut out, notes);
    Ok(out.bytes)
}

fn write_entities(data: &MeshData, entities: &BTreeMap<(usize, i32), i32>, out: &mut Out) {
    let mut boxes: BTreeMap<(usize, i32), [[f64; 3]; 2]> = BTreeMap::new();
    for (vertices, region) in data.cells() {
        let first = data.points[vertices[0] as usize];
        let [low, high] = boxes.entry((vertices.len(), region)).or_insert([first; 2]);
        for point in vertices.iter().map(|&v| data.points[v as usize]) {
            for axis in 0..3 {
                low[axis] = low[axis].min(point[axis]);
                high[axis] = high[axis].max(point[axis]);
            }
        }
    }
    out.text("$Entities\n");
    for size in 1..=4 {
        out.size(entities.keys().filter(|key| key.0 == size).count());
    }
    out.end_line();
    for (key, &number) in entities {
        let &(size, region) = key;
        let bounds = boxes.get(key).copied().unwrap_or_default();
        out.int(number);
        let used = if size == 1 { &bounds[..1] } else { &bounds[..] };
        used.as_flattened().iter().for_each(|&x| out.real(x));
        out.size(usize::from(region != 0));
        if region != 0 {
            out.int(region);
        }
        if size > 1 {
            out.size(0); // entities that bound it
        }
        out.end_line();
    }
    out.end("Entities");
}

fn write_nodes(data: &MeshData, entities: &BTreeMap<(usize, i32), i32>, out: &mut Out) {
    let n = data.points.len();
    out.text("$Nodes\n");
    [1, n, usize::from(n > 0), n].into_iter().for_each(|value| out.size(value));
    out.end_line();
    // All in one block, which keeps their order; it belongs to an entity of the highest dimension.
    let largest = entities.keys().map(|key| key.0).max().unwrap_or(1);
    [largest as i32 - 1, 1, 0].into_iter().for_each(|value| out.int(value));
    out.size(n);
    out.end_line();
    for number in 1..=n {
        out.size(number);
        out.end_line();
    }
    for point in &data.points {
        point.iter().for_each(|&x| out.real(x));
        out.end_line();
    }
    out.end("Nodes");
}

fn write_elements(data: &MeshData, entities: &BTreeMap<(usize, i32), i32>, out: &mut Out) {
    let cells: Vec<(&[u32], i32)> = data.cells().collect();
    let runs = || cells.chunk_by(|a, b| (a.0.len(), a.1) == (b.0.len(), b.1));
    let n = cells.len();
    out.text("$Elements\n");
    [runs().count(), n, usize::from(n > 0), n].into_iter().for_each(|value| out.size(value));
    out.end_line();
    let mut number = 0;
    for run in runs() {
        let (size, region) = (run[0].0.len(), run[0].1);
        [size as i32 - 1, entities[&(size, region)], type_of(size)].into_iter().for_each(|value| out.int(value));
        out.size(run.len());
        out.end_line();
        for (vertices, _) in run {
            number += 1;
            out.size(number);
            vertices.iter().for_each(|&v| out.size(v as usize + 1));
            out.end_line();
        }
    }
    out.end("Elements");
}
