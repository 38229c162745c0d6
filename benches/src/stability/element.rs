//! One tetrahedron, of which a node is pushed through the opposite face.

use super::{POISSON, SIDE, YOUNG, law};
use crate::{BenchOptions, Figure, Numbers, Report, Row};
use stylet_mesh::SimplexMesh;
use stylet_physics::body::{Body, BodyError};
use stylet_physics::material::Solid;

/// How far beyond the face the node is, in heights.
const DEPTHS: [(f64, &str); 3] = [(0.5, "back_0.5"), (1.0, "back_1"), (5.0, "back_5")];
/// On either side of `J = 0`, in heights.
const NEAR: f64 = 1e-9;

pub(super) fn run(_: &BenchOptions, say: &mut dyn FnMut(&str), report: &mut Report) {
    say("J3 one element");
    for poisson in POISSON {
        for model in Solid::MODELS {
            report.rows.push(row(model, poisson));
        }
    }
    let jumps = || report.rows.iter().filter(|row| row.ok).filter_map(|row| row.more.get("jump").copied());
    let jump = jumps().fold(0.0, f64::max);
    report.figures.push(Figure::at_most(
        "J3: largest relative jump of a force at J = 0, laws that bear it",
        jump,
        1e-6,
    ));
}

fn row(model: &str, poisson: f64) -> Row {
    let mut row = Row { case: format!("J3 one element, {model}, ν {poisson}"), threads: 1, ..Row::default() };
    match forces(law(model, poisson)) {
        Err(error) => row.note = error.to_string(),
        Ok(numbers) => {
            row.ok = numbers.values().all(|x| x.is_finite());
            let away: Vec<&str> =
                DEPTHS.iter().filter(|(_, name)| numbers[name] <= 0.0).map(|(_, name)| *name).collect();
            row.note = match (row.ok, away.is_empty()) {
                (false, _) => "outside the domain of the law: the force is not a number".into(),
                (true, true) => String::new(),
                (true, false) => format!("the force points on, not back, at {}", away.join(", ")),
            };
            row.more = numbers;
        }
    }
    row
}

/// Force on the node towards where it came from, over `E` times the square of the height, and the relative jump of it at
/// `J = 0`.
fn forces(solid: Solid) -> Result<Numbers, BodyError> {
    let corners = [[0.0; 3], [SIDE, 0.0, 0.0], [0.0, SIDE, 0.0], [0.0, 0.0, SIDE]];
    let mesh = SimplexMesh::<3, 4>::new(corners.to_vec(), vec![[0, 1, 2, 3]]).expect("a cell with volume");
    let mut body = Body::new(&mesh, solid, 1.0)?;
    let mut back = |beyond: f64| {
        let (mut u, mut internal) = ([0.0; 12], [0.0; 12]);
        u[11] = -(1.0 + beyond) * SIDE;
        body.internal_force(&u, &mut internal);
        -internal[11] / (YOUNG * SIDE * SIDE)
    };
    let mut numbers: Numbers = DEPTHS.iter().map(|&(depth, name)| (name, back(depth))).collect();
    let (before, after) = (back(-NEAR), back(NEAR));
    numbers.insert("jump", (after - before).abs() / before.abs());
    Ok(numbers)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn linear_force_is_that_of_uniaxial_strain() {
        // P33 = (lambda + 2 mu) e with e = -2, times the volume h^3/6 and the gradient 1/h of the node.
        let solid = law("linear", 0.3);
        let (lambda, mu) = (solid.lame().lambda(), solid.lame().mu());
        let back = forces(solid).unwrap()["back_1"];
        assert!((back - (lambda + 2.0 * mu) * 2.0 / 6.0 / YOUNG).abs() < 1e-12, "{back}");
    }

    #[test]
    fn a_law_without_inversion_has_no_force_there() {
        let row = row("neo-hookean", 0.3);
        assert!(!row.ok && row.note.contains("outside the domain"), "{}", row.note);
    }
}
