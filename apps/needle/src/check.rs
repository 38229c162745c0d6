//! Whether the keys of a scene go together; each alone was checked when it was read.

use crate::error::NeedleError;
use crate::motion::Pose;
use crate::scene::{Method, Model, NeedleStage, Scene, Side, Tissue};

/// How far outside the tissue a point may be, in sides: rounding errors of a sine, not a needle that leads away from it.
const ROUNDING: f64 = 1e-12;

/// Checks a scene. `source_name` is the file or built-in scene that errors name.
///
/// # Errors
/// [`NeedleError::Inconsistent`] names the key, what was found and what was expected.
pub fn check(scene: &Scene, source_name: &str) -> Result<(), NeedleError> {
    reason(scene).map_err(|reason| NeedleError::Inconsistent { source_name: source_name.to_owned(), reason })
}

fn reason(scene: &Scene) -> Result<(), String> {
    let mesh = &scene.mesh;
    if mesh.kind == Tissue::Slab && mesh.h_ref < mesh.h_start {
        return Err(format!("mesh.h_ref: found {}, expected at least mesh.h_start = {}", mesh.h_ref, mesh.h_start));
    }
    if mesh.kind == Tissue::Slab && matches!(scene.support.clamped, Side::Front | Side::Back) {
        return Err(
            "support.clamped: found a side that a slab does not have, expected left, right, bottom or top".into()
        );
    }
    if scene.solver.method == Some(Method::Cg) && scene.material.model != Model::Linear {
        return Err("solver.method: found cg, expected nonlinear-cg or newton-cg for a nonlinear material.model".into());
    }
    let Some(needle) = &scene.needle else {
        return Err("needle: found no such stage, expected [needle] with either [load] or [friction]".into());
    };
    match (&scene.load, &scene.friction) {
        (Some(_), Some(_)) => return Err("friction: found beside [load], expected only one of the two".into()),
        (None, None) => return Err("needle: found without [load] and [friction], expected one of the two".into()),
        (Some(_), None) if !needle.motion.is_empty() => {
            return Err(
                "needle.motion: found in a scene with [load], expected [friction]: a static needle is in place".into(),
            );
        }
        _ => {}
    }
    check_shaft(scene, needle)?;
    match mesh.kind {
        Tissue::Slab => check_way::<2>(scene, needle)?,
        Tissue::Cube => check_way::<3>(scene, needle)?,
    }
    needle.line_density().map(drop).map_err(|e| format!("needle.density: {e}"))
}

/// The shaft suits the tissue.
fn check_shaft(scene: &Scene, needle: &NeedleStage) -> Result<(), String> {
    let (side, radius) = (scene.mesh.side, needle.radius);
    match scene.mesh.kind {
        Tissue::Slab if radius != 0.0 => {
            return Err(format!("needle.radius: found {radius} in a slab, where a needle is a line, expected 0"));
        }
        Tissue::Slab if needle.elevation != 0.0 => {
            return Err(format!("needle.elevation: found {} in a slab, expected 0", needle.elevation));
        }
        Tissue::Cube if radius > 0.25 * side => {
            return Err(format!("needle.radius: found {radius}, expected at most a quarter of mesh.side = {side}"));
        }
        _ => {}
    }
    if radius > 0.0 && needle.relocate {
        return Err(
            "needle.relocate: found true for a needle with a radius, expected false or needle.radius = 0".into()
        );
    }
    let (found, expected) = (needle.entry.len(), scene.mesh.dimensions());
    if found != expected {
        return Err(format!(
            "needle.entry: found {found} coordinates, expected {expected} in a {}",
            name(scene.mesh.kind)
        ));
    }
    Ok(())
}

fn name(kind: Tissue) -> &'static str {
    match kind {
        Tissue::Slab => "slab",
        Tissue::Cube => "cube",
    }
}

fn check_way<const D: usize>(scene: &Scene, needle: &NeedleStage) -> Result<(), String> {
    check_line::<D>(scene, needle)?;
    check_motion::<D>(scene, needle)
}

/// The needle enters at the boundary and ends in the tissue.
fn check_line<const D: usize>(scene: &Scene, needle: &NeedleStage) -> Result<(), String> {
    let (side, tissue) = (scene.mesh.side, name(scene.mesh.kind));
    let slack = ROUNDING * side;
    let entry = &needle.entry;
    let within = |v: f64| (-slack..=side + slack).contains(&v);
    let on_boundary = entry.iter().any(|&v| v.abs() <= slack || (v - side).abs() <= slack);
    if !(entry.iter().all(|&v| within(v)) && on_boundary) {
        return Err(format!(
            "needle.entry: found {entry:?}, expected a point of the {tissue}'s boundary, 0 to {side} m each way"
        ));
    }
    check_inside::<D>(scene, needle, "needle.depth", Pose { insert: needle.depth, sleeve: 0.0 })?;
    if needle.depth < slack {
        return Err(format!("needle.depth: found {}, expected at least {slack:e} m in this {tissue}", needle.depth));
    }
    if scene.friction.is_some() && runs_along_a_side::<D>(scene, needle) {
        return Err(format!(
            "needle.angle: found {}, which takes the needle along a side of the {tissue}, expected one that takes it inside",
            needle.angle
        ));
    }
    Ok(())
}

/// Whether the way of the tip lies on a side of the tissue, which it scrapes along and never enters.
fn runs_along_a_side<const D: usize>(scene: &Scene, needle: &NeedleStage) -> bool {
    let side = scene.mesh.side;
    let slack = 1e-9 * side;
    let line = needle.needle::<D>();
    let (entry, tangent) = (line.base(), line.tangent());
    // As far as a needle can go in the tissue, so that a short one is not taken for a level one.
    let far: [f64; D] = std::array::from_fn(|k| entry[k] + side * tangent[k]);
    let on = |v: f64, edge: f64| (v - edge).abs() <= slack;
    (0..D).any(|k| [0.0, side].iter().any(|&edge| on(entry[k], edge) && on(far[k], edge)))
}

fn check_inside<const D: usize>(scene: &Scene, needle: &NeedleStage, key: &str, pose: Pose) -> Result<(), String> {
    let (side, insert) = (scene.mesh.side, pose.insert);
    let mut line = needle.needle::<D>();
    line.set_pose(pose);
    let tip = line.tip();
    let slack = ROUNDING * side;
    let within = |v: f64| (-slack..=side + slack).contains(&v);
    if insert > 0.0 && !tip.iter().all(|&v| within(v)) {
        let tip = tip.map(|x| format!("{x:.4}")).join(", ");
        return Err(format!(
            "{key}: found {insert}, which puts the tip at ({tip}) m, expected a tip in the {}, 0 to {side} m each way",
            name(scene.mesh.kind)
        ));
    }
    Ok(())
}

fn check_motion<const D: usize>(scene: &Scene, needle: &NeedleStage) -> Result<(), String> {
    for (index, row) in needle.motion.iter().enumerate() {
        let number = index + 1;
        if index > 0 && row.depth <= needle.motion[index - 1].depth {
            let last = needle.motion[index - 1].depth;
            return Err(format!(
                "needle.motion: found depth {} in row {number}, expected more than {last} of the row before",
                row.depth
            ));
        }
        if row.depth == 0.0 && (row.insert > 0.0 || row.sleeve != 0.0) {
            return Err(format!(
                "needle.motion: found insert {} and sleeve {} in row {number} at depth 0, expected a needle that starts outside, at its entry",
                row.insert, row.sleeve
            ));
        }
        let pose = Pose { insert: row.insert, sleeve: row.sleeve };
        check_inside::<D>(scene, needle, &format!("needle.motion, insert of row {number}"), pose)?;
    }
    if needle.motion.last().is_some_and(|row| row.depth <= 0.0) {
        return Err("needle.motion: found a travel of 0, expected a last row with a depth above 0".into());
    }
    Ok(())
}

/// Checks the points whose displacement is asked for.
///
/// # Errors
/// [`NeedleError::Probe`] for a point outside the undeformed tissue.
pub fn check_probes(scene: &Scene, probes: &[Vec<f64>]) -> Result<(), NeedleError> {
    let side = scene.mesh.side;
    match probes.iter().find(|at| !at.iter().all(|x| (0.0..=side).contains(x))) {
        Some(at) => Err(NeedleError::Probe {
            at: at.clone(),
            body: format!("{}, 0 to {side} m each way", name(scene.mesh.kind)),
        }),
        None => Ok(()),
    }
}
