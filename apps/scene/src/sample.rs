//! A small scene with one key of every kind, for the tests of this crate.

use crate::{Bound, Column, Key, Kind, Row, Stage, Table, Value};

#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Scene {
    pub title: String,
    pub mesh: Mesh,
    pub needle: Option<Needle>,
}

#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Mesh {
    pub h_start: usize,
    pub poisson: f64,
    pub corner: Vec<f64>,
    pub smooth: bool,
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Needle {
    pub method: String,
    pub force: Option<f64>,
    pub motion: Vec<Row>,
    pub rod: Option<f64>,
}

impl Default for Needle {
    fn default() -> Self {
        Self { method: "cg".into(), force: None, motion: Vec::new(), rod: None }
    }
}

fn needle(scene: &mut Scene) -> &mut Needle {
    scene.needle.get_or_insert_default()
}

pub(crate) const TABLE: Table<Scene> = Table {
    stages: &[
        Stage { name: "mesh", meaning: "the tissue", required: true, enable: |_| {} },
        Stage {
            name: "needle",
            meaning: "the needle",
            required: false,
            enable: |s| {
                needle(s);
            },
        },
        Stage {
            name: "needle.rod",
            meaning: "a shaft that bends",
            required: false,
            enable: |s| {
                needle(s).rod.get_or_insert(1.0);
            },
        },
    ],
    keys: &[
        Key {
            path: "title",
            kind: Kind::Text,
            unit: "",
            default: "\"\"",
            meaning: "shown above pictures",
            set: |s, v| {
                s.title = v.text()?.into();
                Ok(())
            },
            get: |s| (!s.title.is_empty()).then(|| Value::Text(s.title.clone())),
        },
        Key {
            path: "mesh.h_start",
            kind: Kind::Int { min: 0, max: 12 },
            unit: "level",
            default: "0",
            meaning: "legs of side * 2^-k",
            set: |s, v| {
                s.mesh.h_start = v.count()?;
                Ok(())
            },
            get: |s| Some(Value::Int(s.mesh.h_start as i64)),
        },
        Key {
            path: "mesh.poisson",
            kind: Kind::Float { min: Bound::Inclusive(0.0), max: Bound::Exclusive(0.5) },
            unit: "",
            default: "0.0",
            meaning: "Poisson's ratio | nu",
            set: |s, v| {
                s.mesh.poisson = v.float()?;
                Ok(())
            },
            get: |s| Some(Value::Float(s.mesh.poisson)),
        },
        Key {
            path: "mesh.corner",
            kind: Kind::Point { dim_min: 0, dim_max: 3 },
            unit: "m",
            default: "[]",
            meaning: "lower corner",
            set: |s, v| {
                if v.floats()?.first() == Some(&-1.0) {
                    return Err("the corner\nmust not be at -1".into());
                }
                s.mesh.corner = v.floats()?.to_vec();
                Ok(())
            },
            get: |s| Some(Value::Floats(s.mesh.corner.clone())),
        },
        Key {
            path: "mesh.smooth",
            kind: Kind::Bool,
            unit: "",
            default: "false",
            meaning: "smooth the boundary",
            set: |s, v| {
                s.mesh.smooth = v.bool()?;
                Ok(())
            },
            get: |s| Some(Value::Bool(s.mesh.smooth)),
        },
        Key {
            path: "needle.method",
            kind: Kind::Choice(&["cg", "newton", "direct"]),
            unit: "",
            default: "\"cg\"",
            meaning: "how to solve",
            set: |s, v| {
                needle(s).method = v.text()?.into();
                Ok(())
            },
            get: |s| s.needle.as_ref().map(|n| Value::Text(n.method.clone())),
        },
        Key {
            path: "needle.force",
            kind: Kind::Float { min: Bound::Exclusive(0.0), max: Bound::None },
            unit: "N",
            default: "by stage",
            meaning: "puncture force",
            set: |s, v| {
                needle(s).force = Some(v.float()?);
                Ok(())
            },
            get: |s| s.needle.as_ref()?.force.map(Value::Float),
        },
        Key {
            path: "needle.motion",
            kind: Kind::Rows(&[
                Column {
                    name: "t",
                    kind: Kind::Float { min: Bound::Inclusive(0.0), max: Bound::None },
                    unit: "s",
                    required: true,
                    meaning: "time",
                },
                Column {
                    name: "insert",
                    kind: Kind::Float { min: Bound::None, max: Bound::None },
                    unit: "m/s",
                    required: false,
                    meaning: "velocity along the shaft",
                },
                Column { name: "note", kind: Kind::Text, unit: "", required: false, meaning: "what happens" },
                Column {
                    name: "way",
                    kind: Kind::Rows(&[Column {
                        name: "to",
                        kind: Kind::Point { dim_min: 2, dim_max: 3 },
                        unit: "m",
                        required: true,
                        meaning: "a point passed",
                    }]),
                    unit: "",
                    required: false,
                    meaning: "points on the way",
                },
            ]),
            unit: "",
            default: "[]",
            meaning: "motion of the base",
            set: |s, v| {
                needle(s).motion = v.rows()?.to_vec();
                Ok(())
            },
            get: |s| s.needle.as_ref().map(|n| Value::Rows(n.motion.clone())),
        },
        Key {
            path: "needle.rod.stiffness",
            kind: Kind::Float { min: Bound::Inclusive(0.0), max: Bound::None },
            unit: "N m^2",
            default: "1.0",
            meaning: "bending stiffness",
            set: |s, v| {
                needle(s).rod = Some(v.float()?);
                Ok(())
            },
            get: |s| s.needle.as_ref()?.rod.map(Value::Float),
        },
    ],
};
