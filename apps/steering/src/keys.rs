//! The keys of a scene of flexible needles: the one table that reads, checks, writes and documents them.

use crate::columns::{
    DENSITY, FRICTION_REGION, LENGTH, MARKER, MEMBRANE, NEEDLE, NOT_NEGATIVE, POINT, POISSON, REGION, YOUNG,
};
use crate::scene::*;
use crate::{motion, needle};
use stylet_physics::material::Solid;
use stylet_scene::{Bound, Kind, Row, Stage, Table, Value, Words, key, rows};
use stylet_tissue::order::VertexOrder;

const STAGES: &[Stage<Scene>] = &[
    Stage::optional("mesh", "the tissue: a shape, a mesh file, or a box of right tetrahedra", |_| {}),
    Stage::optional(
        "material",
        "what neither a [[region]] nor the shape says; a key that no region takes is refused",
        |_| {},
    ),
    Stage::optional("support", "what is held, besides fixed regions", |_| {}),
    Stage::optional("time", "steps", |_| {}),
    Stage::optional("solver", "friction states and the coupled system", |_| {}),
    Stage::optional("friction", "forces between needle and tissue", |_| {}),
    Stage::optional("markers", "points of the body that are tracked, besides those of the shape", |_| {}),
    Stage::optional("output", "what is written while the scene runs", |_| {}),
];

const TOLERANCE: Kind = Kind::between(Bound::Inclusive(1e-14), Bound::Exclusive(1.0));

/// All keys of a scene of flexible needles.
pub const TABLE: Table<Scene> = Table {
    stages: STAGES,
    keys: &[
        key!("mesh.shape", Kind::Text, "", "none", "prostate, two-cylinders, gel-block, ellipsoid, or a TOML file of shapes relative to the scene file",
            text: |s| s.mesh.shape, |s| s.mesh.shape.clone().map(Value::Text)),
        key!("mesh.resolution", LENGTH, "m", "the shape's own", "edge of the lattice's cubes at the borders of the shape; all others in proportion",
            float: |s| s.mesh.resolution, |s| s.mesh.resolution.map(Value::Float)),
        key!("mesh.file", Kind::Text, "", "none", "Gmsh, VTU, VTK or TetGen file with its regions, relative to the scene file",
            text: |s| s.mesh.file, |s| s.mesh.file.clone().map(Value::Text)),
        key!("mesh.size", POINT, "m", "[0.1, 0.1, 0.1]", "sides of a box, whose one region is tissue",
            floats: |s| s.mesh.size, |s| Some(Value::Floats(s.mesh.size.clone()))),
        key!("mesh.origin", POINT, "m", "[0.0, 0.0, 0.0]", "lower corner of the box",
            floats: |s| s.mesh.origin, |s| Some(Value::Floats(s.mesh.origin.clone()))),
        key!("mesh.cells", POINT, "", "[8, 8, 8]", "parts along each side of the box, each of 6 tetrahedra (Kuhn)",
            floats: |s| s.mesh.cells, |s| Some(Value::Floats(s.mesh.cells.clone()))),
        key!("mesh.order", &["made", "rcm"], "\"rcm\"", "numbers of the vertices, also in frames: as they were made or read; or reverse Cuthill-McKee, by which threads share few elements",
            VertexOrder: |s| s.mesh.order, |s| s.mesh.order.write()),
        key!("material.model", Kind::Choice(&Solid::MODELS), "", "\"fixed-corotated\"", "constitutive law; corotated as published",
            text: |s| s.material.model, |s| s.material.model.clone().map(Value::Text)),
        key!("material.young", YOUNG, "Pa", "15000.0", "Young's modulus",
            float: |s| s.material.young, |s| s.material.young.map(Value::Float)),
        key!("material.poisson", POISSON, "", "0.45", "Poisson's ratio",
            float: |s| s.material.poisson, |s| s.material.poisson.map(Value::Float)),
        key!("material.density", DENSITY, "kg/m^3", "1000.0", "density",
            float: |s| s.material.density, |s| s.material.density.map(Value::Float)),
        key!("material.damping_time", NOT_NEGATIVE, "s", "0.01", "viscosity over elasticity, as in Kelvin and Voigt's solid",
            float: |s| s.material.damping_time, |s| s.material.damping_time.map(Value::Float)),
        rows!("region", REGION, "a material of its own", regions, |_| Ok(()), name_of),
        key!("support.sides", Kind::Text, "", "none", "sides of the box around the body whose nodes are held, of left, right, front, back, bottom, top, with commas between",
            text: |s| s.support.sides, |s| (!s.support.sides.is_empty()).then(|| Value::Text(s.support.sides.clone()))),
        key!("time.dt", Kind::between(Bound::Inclusive(1e-6), Bound::Inclusive(1.0)), "s", "0.02", "step",
            float: |s| s.time.dt, |s| Some(Value::Float(s.time.dt))),
        key!("time.end", Kind::between(Bound::Exclusive(0.0), Bound::Inclusive(1e5)), "s", "the last row of a motion at time.pace", "end of the run",
            float: |s| s.time.end, |s| s.time.end.map(Value::Float)),
        key!("time.pace", Kind::between(Bound::Inclusive(1e-3), Bound::Inclusive(1e3)), "", "1.0", "how many times as fast as written needles go their way: times of all motions are divided by it, velocities multiplied; time.end is not",
            float: |s| s.time.pace, |s| Some(Value::Float(s.time.pace))),
        key!("time.scheme", &["newmark", "trapezoid", "backward-euler"], "\"trapezoid\"", "how displacement and velocity of the tissue follow from the acceleration",
            SchemeKind: |s| s.time.scheme, |s| s.time.scheme.write()),
        key!("time.beta", Kind::between(Bound::Exclusive(0.0), Bound::Inclusive(0.5)), "", "0.25", "Newmark's beta",
            float: |s| s.time.beta, |s| Some(Value::Float(s.time.beta))),
        key!("time.gamma", Kind::between(Bound::Inclusive(0.5), Bound::Inclusive(1.0)), "", "0.5", "Newmark's gamma; above 1/2 it damps",
            float: |s| s.time.gamma, |s| Some(Value::Float(s.time.gamma))),
        key!("time.damping", &["tangent", "viscosity"], "\"tangent\"", "what resists deformation by its rate: the stiffness at the start of the step times material.damping_time, where all regions have the same; or viscosity, evaluated in each step",
            DampingKind: |s| s.time.damping, |s| s.time.damping.write()),
        key!("time.twist", &["explicit", "implicit"], "\"explicit\"", "when the twist of needles that are bent by nature is taken: at the start of a step, as published, or at its end",
            TwistKind: |s| s.time.twist, |s| s.time.twist.write()),
        key!("time.lazy", NOT_NEGATIVE, "", "0.05", "change of an element, as time.lazy_measure has it, up to which its stiffness is kept; 0: none is",
            float: |s| s.time.lazy, |s| Some(Value::Float(s.time.lazy))),
        key!("time.lazy_measure", &["strain", "stiffness", "rotation"], "\"strain\"", "|F - F0| / |F0|; the change of its stiffness, N/m; eq. (12) of Chentanez et al. (2009), N/m",
            LazyWord: |s| s.time.lazy_measure, |s| s.time.lazy_measure.write()),
        key!("time.partition", &["numbers", "metis"], "\"numbers\"", "which thread sums which forces and rows of the tissue: by the numbers of its vertices, or by METIS; the result has the same bits",
            PartitionKind: |s| s.time.partition, |s| s.time.partition.write()),
        key!("time.reach", LENGTH, "m", "a fifth of an edge of the mesh", "how far a needle may slide past the tissue in a step; one that slides further is made in parts",
            float: |s| s.time.reach, |s| s.time.reach.map(Value::Float)),
        key!("solver.coupling", &["null-space", "kkt-cg", "kkt-minres", "constraint"], "\"null-space\"", "how the coupled system is solved: moves that satisfy the constraints, with the exact block of the needles; conjugate gradients or MINRES on the indefinite matrix; projected conjugate gradients with a constraint preconditioner",
            Coupling: |s| s.solver.coupling, |s| s.solver.coupling.write()),
        key!("solver.preconditioner", &["block-jacobi", "two-level"], "\"block-jacobi\"", "what the tissue is preconditioned with",
            PreconditionerKind: |s| s.solver.preconditioner, |s| s.solver.preconditioner.write()),
        key!("solver.tolerance", TOLERANCE, "", "1e-5", "residual of the solution by the forces of the step, or those between needle and tissue where larger",
            float: |s| s.solver.tolerance, |s| Some(Value::Float(s.solver.tolerance))),
        key!("solver.check_tolerance", TOLERANCE, "", "1e-3", "relative residual at which friction states are judged first",
            float: |s| s.solver.check_tolerance, |s| Some(Value::Float(s.solver.check_tolerance))),
        key!("solver.max_trials", Kind::Int { min: 1, max: 1000 }, "", "10", "sets of friction states that are tried",
            int: |s| s.solver.max_trials, |s| Some(Value::Int(s.solver.max_trials))),
        key!("solver.search", &["trials", "published", "condensed"], "\"trials\"", "how friction states are found: trials that the exact block of the needles helps along; Algorithm 3 of Chentanez et al. (2009); a complementarity solve on the condensed system",
            SearchKind: |s| s.solver.search, |s| s.solver.search.write()),
        key!("solver.max_iterations", Kind::Int { min: 1, max: 1_000_000_000 }, "", "10000", "most iterations of a linear solve",
            int: |s| s.solver.max_iterations, |s| Some(Value::Int(s.solver.max_iterations))),
        rows!("needle", NEEDLE, "a flexible needle", needles, check_needle),
        key!("friction.per_length", NOT_NEGATIVE, "N/m", "12.0", "dynamic friction along the shaft",
            float: |s| s.friction.per_length, |s| Some(Value::Float(s.friction.per_length))),
        key!("friction.viscosity", NOT_NEGATIVE, "N s/m^2", "200.0", "viscous friction along the shaft",
            float: |s| s.friction.viscosity, |s| Some(Value::Float(s.friction.viscosity))),
        key!("friction.cutting", NOT_NEGATIVE, "N", "1.0", "force that the tip needs to cut",
            float: |s| s.friction.cutting, |s| Some(Value::Float(s.friction.cutting))),
        rows!("friction.region", FRICTION_REGION, "other forces in a region", friction_regions, |_| Ok(()), name_of),
        rows!(
            "friction.membrane",
            MEMBRANE,
            "a skin or a capsule: a layer that takes more force to cut, as a field in space",
            membranes,
            |_| Ok(())
        ),
        key!("markers.file", Kind::Text, "", "none", "CSV of measured positions: time_s, then NAME_x,NAME_y,NAME_z for each of its markers, m; relative to the scene file",
            text: |s| s.marker_file, |s| s.marker_file.clone().map(Value::Text)),
        rows!("markers.point", MARKER, "a point of the body to track", points, |_| Ok(()), name_of),
        key!("output.frames", Kind::Int { min: 0, max: 1_000_000_000 }, "steps", "0", "VTU frames of tissue and needles every so many steps; 0: the last state only",
            int: |s| s.output.frames, |s| Some(Value::Int(s.output.frames))),
    ],
};

/// The name that a row gives itself.
pub(crate) fn name_of(row: &Row) -> &str {
    row.value("name").and_then(|value| value.text().ok()).unwrap_or("")
}

/// Checks a row of `[[needle]]` by itself.
fn check_needle(row: &Row) -> Result<(), String> {
    motion::Motion::of(row)?;
    needle::release(row)?;
    needle::settings(row).map(|_| ())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_of_keys_is_sound() {
        assert_eq!(TABLE.check(), Ok(()));
    }
}
