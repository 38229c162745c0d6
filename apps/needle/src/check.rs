//! Whether the keys of a scene go together; each alone was checked when it was read.

use crate::error::NeedleError;
use crate::motion::Pose;
use crate::needle::Needle;
use crate::scene::{Method, Model, NeedleStage, Scene};

/// How far outside the slab a point may be, in sides: rounding errors of a sine, not a needle that leads away from it.
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
    if mesh.h_ref < mesh.h_start {
        return Err(format!("mesh.h_ref: found {}, expected at least mesh.h_start = {}", mesh.h_ref, mesh.h_start));
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
    check_line(scene, needle)?;
    check_motion(scene, needle)?;
    needle.line_density().map(drop).map_err(|e| format!("needle.density: {e}"))
}

/// The needle enters at the boundary and ends in the slab.
fn check_line(scene: &Scene, needle: &NeedleStage) -> Result<(), String> {
    let side = scene.mesh.side;
    let slack = ROUNDING * side;
    let [x, y] = needle.entry;
    let within = |v: f64| (-slack..=side + slack).contains(&v);
    let on_boundary = [x, y].iter().any(|&v| v.abs() <= slack || (v - side).abs() <= slack);
    if !(within(x) && within(y) && on_boundary) {
        return Err(format!(
            "needle.entry: found [{x}, {y}], expected a point of the slab's boundary, 0 to {side} m each way"
        ));
    }
    check_inside(scene, needle, "needle.depth", Pose { insert: needle.depth, sleeve: 0.0 })?;
    if needle.depth < slack {
        return Err(format!("needle.depth: found {}, expected at least {slack:e} m in this slab", needle.depth));
    }
    if scene.friction.is_some() && runs_along_a_side(scene, needle) {
        return Err(format!(
            "needle.angle: found {}, which takes the needle along a side of the slab, expected one that takes it inside",
            needle.angle
        ));
    }
    Ok(())
}

/// Whether the way of the tip lies on a side of the slab, which it scrapes along and never enters.
fn runs_along_a_side(scene: &Scene, needle: &NeedleStage) -> bool {
    let side = scene.mesh.side;
    let slack = 1e-9 * side;
    let tangent = Needle::new(needle.entry, needle.angle).tangent();
    // As far as a needle can go in the slab, so that a short one is not taken for a level one.
    let far = [0, 1].map(|k| needle.entry[k] + side * tangent[k]);
    let on = |v: f64, edge: f64| (v - edge).abs() <= slack;
    (0..2).any(|k| [0.0, side].iter().any(|&edge| on(needle.entry[k], edge) && on(far[k], edge)))
}

fn check_inside(scene: &Scene, needle: &NeedleStage, key: &str, pose: Pose) -> Result<(), String> {
    let (side, insert) = (scene.mesh.side, pose.insert);
    let mut line = Needle::new(needle.entry, needle.angle);
    line.set_pose(pose);
    let [x, y] = line.tip();
    let slack = ROUNDING * side;
    let within = |v: f64| (-slack..=side + slack).contains(&v);
    if insert > 0.0 && !(within(x) && within(y)) {
        return Err(format!(
            "{key}: found {insert}, which puts the tip at ({x:.4}, {y:.4}) m, expected a tip in the slab, 0 to {side} m each way"
        ));
    }
    Ok(())
}

fn check_motion(scene: &Scene, needle: &NeedleStage) -> Result<(), String> {
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
        check_inside(scene, needle, &format!("needle.motion, insert of row {number}"), pose)?;
    }
    if needle.motion.last().is_some_and(|row| row.depth <= 0.0) {
        return Err("needle.motion: found a travel of 0, expected a last row with a depth above 0".into());
    }
    Ok(())
}

/// Checks the points whose displacement is asked for.
///
/// # Errors
/// [`NeedleError::Probe`] for a point outside the undeformed slab.
pub fn check_probes(scene: &Scene, probes: &[Vec<f64>]) -> Result<(), NeedleError> {
    let side = scene.mesh.side;
    match probes.iter().find(|at| !at.iter().all(|x| (0.0..=side).contains(x))) {
        Some(at) => Err(NeedleError::Probe { at: at.clone(), body: format!("slab, 0 to {side} m each way") }),
        None => Ok(()),
    }
}
