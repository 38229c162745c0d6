//! `[[load]]`: dead forces, by node.

use super::geometry::{Geometry, fixed};
use super::material::Tissue;
use super::select::{Picked, pick, region_number, selects};
use stylet_physics::body::{facet_area, segment_load};
use stylet_scene::Row;

/// One row, ready for use: nodal forces, N.
#[derive(Clone, Debug)]
pub(super) struct Force {
    pub nodal: Vec<f64>,
    /// Time from which it is there no more, s.
    pub until: f64,
}

/// Checks a row, as far as it can be checked alone.
pub(super) fn check_row(row: &Row) -> Result<(), String> {
    let kinds: Vec<&str> =
        ["gravity", "traction", "force"].into_iter().filter(|name| row.value(name).is_some()).collect();
    let [kind] = kinds[..] else {
        let found = if kinds.is_empty() { "none".to_owned() } else { kinds.join(" and ") };
        return Err(format!("found {found}, expected one of gravity, traction or force"));
    };
    let segment = row.value("from").is_some() || row.value("to").is_some();
    if segment && (row.value("from").is_none() || row.value("to").is_none() || kind != "force" || selects(row)) {
        return Err("from and to: found one alone or beside a place, expected both with force and no place".into());
    }
    if kind == "gravity" {
        let places = ["side", "box", "plane", "tag", "group"];
        if let Some(name) = places.iter().find(|name| row.value(name).is_some()) {
            return Err(format!("found {name} beside gravity, expected no place or a region"));
        }
    } else if !segment && !selects(row) {
        return Err(format!("found {kind} without a place, expected one of side, box, plane, region, tag or group"));
    }
    Ok(())
}

impl Force {
    /// The nodal forces of a row.
    ///
    /// # Errors
    /// The column, what was found and what was expected.
    pub fn of<const D: usize, const N: usize>(
        row: &Row,
        geometry: &Geometry<D, N>,
        regions: &[Row],
        tissues: &[Tissue],
        thickness: f64,
    ) -> Result<Self, String> {
        let vector = |key: &str| row.value(key).map(|value| fixed::<D>(key, value.floats()?)).transpose();
        let mut nodal = vec![0.0; D * geometry.mesh.n_vertex_slots()];
        if let Some(gravity) = vector("gravity")? {
            let only = row.value("region").map(|name| region_number(name.text()?, regions)).transpose()?;
            add_gravity(geometry, only, tissues, thickness, &gravity, &mut nodal);
        } else if let Some(traction) = vector("traction")? {
            add_traction(geometry, &pick(row, geometry, regions)?, thickness, &traction, &mut nodal)?;
        } else if let (Some(from), Some(to), Some(force)) = (vector("from")?, vector("to")?, vector("force")?) {
            let length = (0..D).map(|k| (to[k] - from[k]).powi(2)).sum::<f64>().sqrt();
            let density = 1.0 / length;
            let profile = [(0.0, density), (length, density)];
            segment_load(&geometry.mesh, &from, &to, &profile, &force, &mut nodal)
                .map_err(|e| format!("from and to: {e}"))?;
        } else if let Some(force) = vector("force")? {
            let picked = pick(row, geometry, regions)?;
            let n = picked.vertices().count() as f64;
            for v in picked.vertices() {
                (0..D).for_each(|k| nodal[D * v.index() + k] += force[k] / n);
            }
        }
        Ok(Self { nodal, until: row.get("until").unwrap_or(f64::INFINITY) })
    }
}

/// The weight of each cell in equal shares to its nodes, which is exact for linear displacements.
fn add_gravity<const D: usize, const N: usize>(
    geometry: &Geometry<D, N>,
    only: Option<u32>,
    tissues: &[Tissue],
    thickness: f64,
    gravity: &[f64; D],
    nodal: &mut [f64],
) {
    let mesh = &geometry.mesh;
    for cell in mesh.cells().filter(|&cell| only.is_none_or(|region| mesh.region(cell) == region)) {
        let density = tissues[mesh.region(cell) as usize].density;
        let share = density * mesh.volume(cell) * thickness / N as f64;
        for v in mesh.cell(cell) {
            (0..D).for_each(|k| nodal[D * v.index() + k] += share * gravity[k]);
        }
    }
}

/// A uniform traction on the boundary facets that are picked.
fn add_traction<const D: usize, const N: usize>(
    geometry: &Geometry<D, N>,
    picked: &Picked,
    thickness: f64,
    traction: &[f64; D],
    nodal: &mut [f64],
) -> Result<(), String> {
    let mesh = &geometry.mesh;
    let mut area = 0.0;
    for (cell, opposite) in mesh.boundary_facets() {
        let vertices = mesh.cell(cell);
        let corners = (0..N).filter(|&k| k != opposite).map(|k| vertices[k]);
        let chosen = match &picked.facets {
            Some(facets) => facets.contains(&(cell, opposite)),
            None => true,
        };
        if !chosen || !corners.clone().all(|v| picked.nodes[v.index()]) {
            continue;
        }
        let own = facet_area(&mesh.corners(cell), opposite) * thickness;
        area += own;
        for v in corners {
            (0..D).for_each(|k| nodal[D * v.index() + k] += own / D as f64 * traction[k]);
        }
    }
    if area > 0.0 {
        Ok(())
    } else {
        Err("traction: found no boundary facet in its place, expected at least one".into())
    }
}
