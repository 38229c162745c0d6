//! The keys of a scene file: the one table that reads, checks, writes and documents them.

use crate::scene::*;
use stylet_scene::{Bound, Column, Key, Kind, Row, Stage, Table, Value, Words, key};

impl Words for Model {
    const WORDS: &'static [(&'static str, Self)] = &[
        (Self::Linear.name(), Self::Linear),
        (Self::StVenantKirchhoff.name(), Self::StVenantKirchhoff),
        (Self::NeoHookean.name(), Self::NeoHookean),
    ];
}

impl Words for Method {
    const WORDS: &'static [(&'static str, Self)] =
        &[("cg", Self::Cg), ("nonlinear-cg", Self::NonlinearCg), ("newton-cg", Self::NewtonCg)];
}

impl Words for PreconditionerKind {
    const WORDS: &'static [(&'static str, Self)] =
        &[("none", Self::None), ("jacobi", Self::Jacobi), ("block-jacobi", Self::BlockJacobi)];
}

impl Words for CriterionKind {
    const WORDS: &'static [(&'static str, Self)] = &[("external", Self::External), ("reaction", Self::Reaction)];
}

impl Words for Tissue {
    const WORDS: &'static [(&'static str, Self)] = &[("slab", Self::Slab), ("cube", Self::Cube)];
}

impl Words for Side {
    const WORDS: &'static [(&'static str, Self)] = &[
        ("left", Self::Left),
        ("right", Self::Right),
        ("bottom", Self::Bottom),
        ("top", Self::Top),
        ("front", Self::Front),
        ("back", Self::Back),
    ];
}

impl Words for Rearrange {
    const WORDS: &'static [(&'static str, Self)] = &[("once", Self::Once), ("settle", Self::Settle)];
}

impl Words for Distribution {
    const WORDS: &'static [(&'static str, Self)] = &[("lumped", Self::Lumped), ("consistent", Self::Consistent)];
}

fn needle(scene: &mut Scene) -> &mut NeedleStage {
    scene.needle.get_or_insert_default()
}

fn load(scene: &mut Scene) -> &mut LoadStage {
    scene.load.get_or_insert_default()
}

fn friction(scene: &mut Scene) -> &mut FrictionStage {
    scene.friction.get_or_insert_default()
}

fn output(scene: &mut Scene) -> &mut OutputStage {
    scene.output.get_or_insert_default()
}

const STAGES: &[Stage<Scene>] = &[
    Stage::optional("mesh", "a square slab of right triangles, or a cube of tetrahedra", |_| {}),
    Stage::optional("material", "the tissue; a slab is in plane stress", |_| {}),
    Stage::optional("support", "how the tissue is held", |_| {}),
    Stage::optional("solver", "how an equilibrium is found", |_| {}),
    Stage::optional("needle", "a rigid needle, and the force density along its shaft", |s| {
        needle(s);
    }),
    Stage::optional("load", "the force density applied at once, as a static load", |s| {
        load(s);
    }),
    Stage::optional("friction", "stick-slip friction: the needle is inserted step by step", |s| {
        friction(s);
    }),
    Stage::optional("output", "what is written while the scene runs", |s| {
        output(s);
    }),
];

const DENSITY: &[Column] = &[
    Column {
        name: "distance",
        kind: Kind::between(Bound::Inclusive(0.0), Bound::Inclusive(10.0)),
        unit: "m",
        required: true,
        meaning: "behind the tip, increasing",
    },
    Column {
        name: "force",
        kind: Kind::between(Bound::Inclusive(0.0), Bound::Inclusive(1e9)),
        unit: "N/m",
        required: true,
        meaning: "per length of the shaft",
    },
];

const MOTION: &[Column] = &[
    Column {
        name: "depth",
        kind: Kind::between(Bound::Inclusive(0.0), Bound::Inclusive(100.0)),
        unit: "m",
        required: true,
        meaning: "travel of the base since the start, increasing",
    },
    Column {
        name: "insert",
        kind: Kind::between(Bound::Inclusive(-1.0), Bound::Inclusive(1.0)),
        unit: "m",
        required: false,
        meaning: "insertion of the tip along the axis; left out: as in the row before",
    },
    Column {
        name: "sleeve",
        kind: Kind::between(Bound::Inclusive(-1.0), Bound::Inclusive(1.0)),
        unit: "m",
        required: false,
        meaning: "offset of the base to its left; left out: as in the row before",
    },
];

fn density_rows(value: &Value) -> Result<Vec<DensityRow>, String> {
    let number = |row: &Row, name| row.get(name).ok_or_else(|| format!("a row has no {name}"));
    value
        .rows()?
        .iter()
        .map(|r| Ok(DensityRow { distance: number(r, "distance")?, force: number(r, "force")? }))
        .collect()
}

fn motion_rows(value: &Value) -> Result<Vec<MotionRow>, String> {
    let mut last = MotionRow { depth: 0.0, insert: 0.0, sleeve: 0.0 };
    let mut rows = Vec::new();
    for row in value.rows()? {
        last.depth = row.get("depth").ok_or("a row has no depth")?;
        last.insert = row.get("insert").unwrap_or(last.insert);
        last.sleeve = row.get("sleeve").unwrap_or(last.sleeve);
        rows.push(last);
    }
    Ok(rows)
}

/// All keys of a needle scene.
pub const TABLE: Table<Scene> = Table {
    stages: STAGES,
    keys: &[
        key!("mesh.kind", &["slab", "cube"], "\"slab\"", "what the needle is pushed into",
            Tissue: |s| s.mesh.kind, |s| s.mesh.kind.write()),
        key!("mesh.side", Kind::between(Bound::Inclusive(1e-6), Bound::Inclusive(1e3)), "m", "0.1", "side of the slab or cube",
            float: |s| s.mesh.side, |s| Some(Value::Float(s.mesh.side))),
        key!("mesh.thickness", Kind::between(Bound::Inclusive(1e-6), Bound::Inclusive(1e3)), "m", "0.01", "thickness of the slab",
            float: |s| s.mesh.thickness, |s| Some(Value::Float(s.mesh.thickness))),
        key!("mesh.h_start", Kind::Int { min: 1, max: 10 }, "level", "3", "starting mesh: triangles with legs of side * 2^-h_start",
            int: |s| s.mesh.h_start, |s| Some(Value::Int(s.mesh.h_start))),
        key!("mesh.h_ref", Kind::Int { min: 1, max: 14 }, "level", "6", "legs of side * 2^-h_ref around the needle; at least h_start",
            int: |s| s.mesh.h_ref, |s| Some(Value::Int(s.mesh.h_ref))),
        key!("mesh.fold", Kind::Int { min: 0, max: 36 }, "bisections", "12", "of a cube's six tetrahedra where the needle touches them",
            int: |s| s.mesh.fold, |s| Some(Value::Int(s.mesh.fold))),
        key!("material.model", &["linear", "st-venant-kirchhoff", "neo-hookean"], "\"linear\"", "constitutive law",
            Model: |s| s.material.model, |s| s.material.model.write()),
        key!("material.young", Kind::between(Bound::Inclusive(1e-3), Bound::Inclusive(1e15)), "Pa", "34000.0", "Young's modulus",
            float: |s| s.material.young, |s| Some(Value::Float(s.material.young))),
        key!("material.poisson", Kind::between(Bound::Inclusive(0.0), Bound::Exclusive(0.5)), "", "0.34", "Poisson's ratio",
            float: |s| s.material.poisson, |s| Some(Value::Float(s.material.poisson))),
        key!("support.clamped", &["left", "right", "bottom", "top", "front", "back"], "\"right\"", "side whose nodes are fixed; the last axis points up, front and back are those of a cube",
            Side: |s| s.support.clamped, |s| s.support.clamped.write()),
        key!("solver.method", &["cg", "nonlinear-cg", "newton-cg"], "cg for linear, newton-cg for others", "how an equilibrium is found",
            Method: |s| s.solver.method, |s| s.solver.method.and_then(Method::write)),
        key!("solver.preconditioner", &["none", "jacobi", "block-jacobi"], "\"block-jacobi\"", "what conjugate gradients are preconditioned with",
            PreconditionerKind: |s| s.solver.preconditioner, |s| s.solver.preconditioner.write()),
        key!("solver.tolerance", Kind::between(Bound::Inclusive(1e-14), Bound::Exclusive(1.0)), "", "1e-6", "relative tolerance of the residual force",
            float: |s| s.solver.tolerance, |s| Some(Value::Float(s.solver.tolerance))),
        key!("solver.max_iterations", Kind::Int { min: 1, max: 1_000_000_000 }, "", "10000", "most iterations of one solve; the iterate is kept when they run out",
            int: |s| s.solver.max_iterations, |s| Some(Value::Int(s.solver.max_iterations))),
        key!("solver.criterion", &["external", "reaction"], "\"reaction\"", "residual against external forces (6.8), or against those and the reactions (6.9)",
            CriterionKind: |s| s.solver.criterion, |s| s.solver.criterion.write()),
        key!("solver.round_off", Kind::between(Bound::Inclusive(0.0), Bound::Inclusive(1e-2)), "", "1e-8", "tolerance for rounding errors, eps_round of (6.9)",
            float: |s| s.solver.round_off, |s| Some(Value::Float(s.solver.round_off))),
        Key {
            path: "needle.entry",
            kind: Kind::Point { dim_min: 2, dim_max: 3 },
            unit: "m",
            default: "[0.0, 0.05]",
            meaning: "point of the boundary where the needle enters",
            set: |s, value| {
                needle(s).entry = value.floats()?.to_vec();
                Ok(())
            },
            get: |s| s.needle.as_ref().map(|n| Value::Floats(n.entry.to_vec())),
        },
        key!("needle.angle", Kind::between(Bound::Inclusive(-7.0), Bound::Inclusive(7.0)), "rad", "0.0", "direction of the needle, from the x axis",
            float: |s| needle(s).angle, |s| s.needle.as_ref().map(|n| Value::Float(n.angle))),
        key!("needle.elevation", Kind::between(Bound::Inclusive(-1.6), Bound::Inclusive(1.6)), "rad", "0.0", "direction of the needle in a cube, from the plane of x and y upwards",
            float: |s| needle(s).elevation, |s| s.needle.as_ref().map(|n| Value::Float(n.elevation))),
        key!("needle.radius", Kind::between(Bound::Inclusive(0.0), Bound::Inclusive(1.0)), "m", "0.0", "radius of the shaft in a cube: tetrahedra that touch it are refined, nodes within are taken",
            float: |s| needle(s).radius, |s| s.needle.as_ref().map(|n| Value::Float(n.radius))),
        key!("needle.depth", Kind::between(Bound::Exclusive(0.0), Bound::Inclusive(1e3)), "m", "0.07", "length of the needle in the tissue at the end; needle.motion takes its place",
            float: |s| needle(s).depth, |s| s.needle.as_ref().map(|n| Value::Float(n.depth))),
        key!("needle.speed", Kind::between(Bound::Inclusive(1e-4), Bound::Inclusive(1e3)), "h_ref/cycle", "0.1", "travel of the base per cycle, in legs of level mesh.h_ref, in a cube in side * 2^(-fold / 3); above 1, tissue is passed before it is loaded",
            float: |s| needle(s).speed, |s| s.needle.as_ref().map(|n| Value::Float(n.speed))),
        key!("needle.rearrange", &["once", "settle"], "\"settle\"", "the needle moves on after one rearrangement, as published, or when no state changes",
            Rearrange: |s| needle(s).rearrange, |s| s.needle.as_ref().and_then(|n| n.rearrange.write())),
        key!("needle.relocate", Kind::Bool, "", "false", "move needle nodes onto the needle within the mesh",
            bool: |s| needle(s).relocate, |s| s.needle.as_ref().map(|n| Value::Bool(n.relocate))),
        Key {
            path: "needle.density",
            kind: Kind::Rows(DENSITY),
            unit: "",
            default: "0, 90, 45 N/m at 0, 2, 4 mm",
            meaning: "force per length along the shaft, linear between rows: load, or dynamic friction",
            set: |s, value| {
                needle(s).density = density_rows(value)?;
                Ok(())
            },
            get: |s| {
                let rows = &s.needle.as_ref()?.density;
                Some(Value::Rows(
                    rows.iter().map(|r| Row::from_iter([("distance", r.distance), ("force", r.force)])).collect(),
                ))
            },
        },
        Key {
            path: "needle.motion",
            kind: Kind::Rows(MOTION),
            unit: "",
            default: "straight in to needle.depth",
            meaning: "motion of the base, linear between rows",
            set: |s, value| {
                needle(s).motion = motion_rows(value)?;
                Ok(())
            },
            get: |s| {
                let rows = &s.needle.as_ref()?.motion;
                if rows.is_empty() {
                    return None;
                }
                let row =
                    |r: &MotionRow| Row::from_iter([("depth", r.depth), ("insert", r.insert), ("sleeve", r.sleeve)]);
                Some(Value::Rows(rows.iter().map(row).collect()))
            },
        },
        key!("load.distribution", &["lumped", "consistent"], "\"consistent\"", "nodal forces from the density at the node, or integrated against the shape functions",
            Distribution: |s| load(s).distribution, |s| s.load.as_ref().and_then(|l| l.distribution.write())),
        key!("friction.static_ratio", Kind::between(Bound::Inclusive(1.0), Bound::Inclusive(1e6)), "", "2.0", "static over dynamic threshold",
            float: |s| friction(s).static_ratio, |s| s.friction.as_ref().map(|f| Value::Float(f.static_ratio))),
        key!("friction.restick", Kind::between(Bound::Inclusive(0.0), Bound::Inclusive(1.0)), "", "0.02", "a slipping node sticks when its force falls below 1 + restick times its dynamic threshold",
            float: |s| friction(s).restick, |s| s.friction.as_ref().map(|f| Value::Float(f.restick))),
        key!("output.frames", Kind::Int { min: 0, max: 1_000_000_000 }, "cycles", "0", "a VTU frame every so many cycles; 0: the last state only",
            int: |s| output(s).frames, |s| s.output.as_ref().map(|o| Value::Int(o.frames))),
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
