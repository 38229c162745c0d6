//! The keys of a scene file of a body: the one table that reads, checks, writes and documents them.

use super::columns::{CONSTRAINT, DENSITY, LOAD, NOT_NEGATIVE, POISSON, REGION, VECTOR, YOUNG};
use super::scene::*;
use super::{constraint, load, material};
use crate::order::VertexOrder;
use stylet_physics::material::Solid;
use stylet_scene::{Bound, Kind, Stage, Table, Value, Words, key, rows};

fn statics(scene: &mut Scene) -> &mut StaticsStage {
    scene.statics.get_or_insert_default()
}

fn time(scene: &mut Scene) -> &mut TimeStage {
    scene.time.get_or_insert_default()
}

fn start(scene: &mut Scene) -> &mut StartStage {
    scene.start.get_or_insert_default()
}

fn output(scene: &mut Scene) -> &mut OutputStage {
    scene.output.get_or_insert_default()
}

const STAGES: &[Stage<Scene>] = &[
    Stage::optional("mesh", "a box of right simplices, or a file", |_| {}),
    Stage::optional("material", "what is in no [[region]]", |_| {}),
    Stage::optional("statics", "the body comes to rest; instead of [time]", |s| {
        statics(s);
    }),
    Stage::optional("time", "the body moves; instead of [statics]", |s| {
        time(s);
    }),
    Stage::optional("solver", "how systems of equations are solved", |_| {}),
    Stage::optional("start", "where free nodes are at the start", |s| {
        start(s);
    }),
    Stage::optional("output", "what is written while the scene runs", |s| {
        output(s);
    }),
];

const CELLS: Kind = Kind::Point { dim_min: 2, dim_max: 3 };

/// All keys of a scene of a body.
pub const TABLE: Table<Scene> = Table {
    stages: STAGES,
    keys: &[
        key!("mesh.file", Kind::Text, "", "none", "Gmsh, VTU, VTK or TetGen file with its regions and tags, relative to the scene file",
            text: |s| s.mesh.file, |s| s.mesh.file.clone().map(Value::Text)),
        key!("mesh.size", VECTOR, "m", "[0.1, 0.1, 0.1]", "sides of the box; their number is that of the dimensions",
            floats: |s| s.mesh.size, |s| Some(Value::Floats(s.mesh.size.clone()))),
        key!("mesh.origin", VECTOR, "m", "zero", "lower corner of the box",
            floats: |s| s.mesh.origin, |s| (!s.mesh.origin.is_empty()).then(|| Value::Floats(s.mesh.origin.clone()))),
        key!("mesh.cells", CELLS, "", "[4, 4, 4]", "parts along each side, each of 2 triangles or 6 tetrahedra (Kuhn)",
            floats: |s| s.mesh.cells, |s| Some(Value::Floats(s.mesh.cells.clone()))),
        key!("mesh.thickness", Kind::between(Bound::Inclusive(1e-6), Bound::Inclusive(1e3)), "m", "1.0", "thickness in two dimensions",
            float: |s| s.mesh.thickness, |s| Some(Value::Float(s.mesh.thickness))),
        key!("mesh.repair", Kind::Bool, "", "false", "put right what has one remedy in a file, such as duplicate cells",
            bool: |s| s.mesh.repair, |s| Some(Value::Bool(s.mesh.repair))),
        key!("mesh.order", &["made", "rcm"], "\"made\"", "numbers of the vertices of a box, also in frames: as they were made; or reverse Cuthill-McKee, by which threads share few elements; those of a file stay",
            VertexOrder: |s| s.mesh.order, |s| s.mesh.order.write()),
        key!("material.model", Kind::Choice(&Solid::MODELS), "", "\"neo-hookean\"", "constitutive law",
            text: |s| s.material.model, |s| s.material.model.clone().map(Value::Text)),
        key!("material.young", YOUNG, "Pa", "34000.0", "Young's modulus",
            float: |s| s.material.young, |s| s.material.young.map(Value::Float)),
        key!("material.poisson", POISSON, "", "0.34", "Poisson's ratio",
            float: |s| s.material.poisson, |s| s.material.poisson.map(Value::Float)),
        key!("material.density", DENSITY, "kg/m^3", "1000.0", "density, for gravity and motion",
            float: |s| s.material.density, |s| s.material.density.map(Value::Float)),
        key!("material.damping_time", NOT_NEGATIVE, "s", "0.0", "in motion: viscosity over elasticity, as in Kelvin and Voigt's solid; acts on rates of stretching alone",
            float: |s| s.material.damping_time, |s| s.material.damping_time.map(Value::Float)),
        key!("material.plane", &["stress", "strain"], "\"stress\"",
            "in two dimensions only: stress for a thin sheet, whose thickness adjusts, strain for a slice of a long body; the same for all regions",
            PlaneKind: |s| s.material.plane, |s| s.material.plane.and_then(PlaneKind::write)),
        rows!("region", REGION, "a material of its own, later rows over earlier ones", regions, material::check_row),
        rows!(
            "constraint",
            CONSTRAINT,
            "what the nodes of a place may do; held in all directions if nothing else is said",
            constraints,
            constraint::check_row
        ),
        rows!("load", LOAD, "a force that does not turn with the body", loads, load::check_row),
        key!("statics.method", &["cg", "llt", "ldlt", "newton-cg", "polak-ribiere", "fletcher-reeves", "hager-zhang", "l-bfgs"],
            "cg for linear, newton-cg for others", "how the equilibrium is found; the first three for linear materials only",
            Method: |s| statics(s).method, |s| s.statics.as_ref()?.method.and_then(Method::write)),
        key!("statics.first_step", Kind::between(Bound::Exclusive(0.0), Bound::Inclusive(1.0)), "", "1.0", "first load step as a share of the load; doubled after a success, halved after a failure",
            float: |s| statics(s).first_step, |s| s.statics.as_ref().map(|t| Value::Float(t.first_step))),
        key!("statics.smallest_step", Kind::between(Bound::Exclusive(0.0), Bound::Inclusive(1.0)), "", "1/1024", "load step below which the solve gives up",
            float: |s| statics(s).smallest_step, |s| s.statics.as_ref().map(|t| Value::Float(t.smallest_step))),
        key!("time.dt", Kind::between(Bound::Inclusive(1e-9), Bound::Inclusive(1e3)), "s", "0.01", "step; the first one of adaptive steps",
            float: |s| time(s).dt, |s| s.time.as_ref().map(|t| Value::Float(t.dt))),
        key!("time.end", Kind::between(Bound::Exclusive(0.0), Bound::Inclusive(1e6)), "s", "1.0", "end of the run",
            float: |s| time(s).end, |s| s.time.as_ref().map(|t| Value::Float(t.end))),
        key!("time.scheme", &["newmark", "trapezoid", "backward-euler"], "\"trapezoid\"", "how displacement and velocity follow from the acceleration",
            SchemeKind: |s| time(s).scheme, |s| s.time.as_ref().and_then(|t| t.scheme.write())),
        key!("time.beta", Kind::between(Bound::Exclusive(0.0), Bound::Inclusive(0.5)), "", "0.25", "Newmark's beta",
            float: |s| time(s).beta, |s| s.time.as_ref().map(|t| Value::Float(t.beta))),
        key!("time.gamma", Kind::between(Bound::Inclusive(0.5), Bound::Inclusive(1.0)), "", "0.5", "Newmark's gamma; above 1/2 it damps",
            float: |s| time(s).gamma, |s| s.time.as_ref().map(|t| Value::Float(t.gamma))),
        key!("time.newton", &["one", "full"], "\"one\"", "one linearised step as published, or Newton's method to solver.tolerance",
            NewtonKind: |s| time(s).newton, |s| s.time.as_ref().and_then(|t| t.newton.write())),
        key!("time.newton_iterations", Kind::Int { min: 1, max: 100_000 }, "", "50", "Newton steps after which a time step is halved",
            int: |s| time(s).newton_iterations, |s| s.time.as_ref().map(|t| Value::Int(t.newton_iterations))),
        key!("time.damping_mass", NOT_NEGATIVE, "1/s", "0.0", "damping in proportion to the mass",
            float: |s| time(s).damping_mass, |s| s.time.as_ref().map(|t| Value::Float(t.damping_mass))),
        key!("time.damping_stiffness", NOT_NEGATIVE, "s", "0.0", "damping in proportion to the stiffness",
            float: |s| time(s).damping_stiffness, |s| s.time.as_ref().map(|t| Value::Float(t.damping_stiffness))),
        key!("time.mass", &["lumped", "consistent"], "\"lumped\"", "how mass is given to the nodes",
            MassWord: |s| time(s).mass, |s| s.time.as_ref().and_then(|t| t.mass.write())),
        key!("time.lazy", NOT_NEGATIVE, "", "0.0", "change of an element, as time.lazy_measure has it, up to which its stiffness is kept; 0: none is",
            float: |s| time(s).lazy, |s| s.time.as_ref().map(|t| Value::Float(t.lazy))),
        key!("time.lazy_measure", &["strain", "stiffness", "rotation"], "\"strain\"", "|F - F0| / |F0|; the change of its stiffness, N/m; eq. (12) of Chentanez et al. (2009), N/m",
            LazyWord: |s| time(s).lazy_measure, |s| s.time.as_ref().and_then(|t| t.lazy_measure.write())),
        key!("time.adaptive", NOT_NEGATIVE, "m", "0.0", "displacement error that one step may make; 0: steps of one length",
            float: |s| time(s).adaptive, |s| s.time.as_ref().map(|t| Value::Float(t.adaptive))),
        key!("solver.preconditioner", &["none", "jacobi", "block-jacobi", "ssor", "ic0", "chebyshev", "aggregation", "factor"],
            "\"block-jacobi\"", "what iterations are preconditioned with; in [time] block-jacobi alone",
            PreconditionerKind: |s| s.solver.preconditioner, |s| s.solver.preconditioner.write()),
        key!("solver.tolerance", Kind::between(Bound::Inclusive(1e-14), Bound::Exclusive(1.0)), "", "1e-6", "relative tolerance of the residual force",
            float: |s| s.solver.tolerance, |s| Some(Value::Float(s.solver.tolerance))),
        key!("solver.max_iterations", Kind::Int { min: 1, max: 1_000_000_000 }, "", "20000", "most iterations per load step or time step",
            int: |s| s.solver.max_iterations, |s| Some(Value::Int(s.solver.max_iterations))),
        key!("start.shape", &["rest", "point", "plane", "line", "scramble"], "\"rest\"", "free nodes collapsed to the middle, its plane or its line across or along the last axis, or thrown about",
            Shape: |s| start(s).shape, |s| s.start.as_ref().and_then(|t| t.shape.write())),
        key!("start.seed", Kind::Int { min: 0, max: i64::MAX }, "", "1", "which scramble",
            int: |s| start(s).seed, |s| s.start.as_ref().map(|t| Value::Int(t.seed))),
        key!("output.frames", Kind::Int { min: 0, max: 1_000_000_000 }, "steps", "0", "a VTU frame every so many steps; 0: the last state only",
            int: |s| output(s).frames, |s| s.output.as_ref().map(|o| Value::Int(o.frames))),
        key!("output.instants", Kind::Point { dim_min: 1, dim_max: 8 }, "s", "none", "ascending times, 0 for the start, whose states stand side by side in instants.svg",
            floats: |s| output(s).instants,
            |s| s.output.as_ref().filter(|o| !o.instants.is_empty()).map(|o| Value::Floats(o.instants.clone()))),
    ],
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_of_keys_is_sound() {
        assert_eq!(TABLE.check(), Ok(()));
    }
}
