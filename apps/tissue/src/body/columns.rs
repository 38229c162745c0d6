//! The columns of `[[region]]`, `[[constraint]]` and `[[load]]`.

use stylet_physics::material::Solid;
use stylet_scene::{Bound, Column, Kind};

/// Sides of the box around a body, by axis and end; front and back are those of the second axis in space.
pub(super) const SIDES: &[&str] = &["left", "right", "front", "back", "bottom", "top"];

pub(super) const ANY: Kind = Kind::between(Bound::None, Bound::None);
pub(super) const NOT_NEGATIVE: Kind = Kind::between(Bound::Inclusive(0.0), Bound::None);
pub(super) const VECTOR: Kind = Kind::Point { dim_min: 2, dim_max: 3 };
pub(super) const YOUNG: Kind = Kind::between(Bound::Inclusive(1e-3), Bound::Inclusive(1e15));
pub(super) const POISSON: Kind = Kind::between(Bound::Exclusive(-1.0), Bound::Exclusive(0.5));
pub(super) const DENSITY: Kind = Kind::between(Bound::Exclusive(0.0), Bound::Inclusive(1e6));
const TAG: Kind = Kind::Int { min: i32::MIN as i64, max: i32::MAX as i64 };

const fn optional(name: &'static str, kind: Kind, unit: &'static str, meaning: &'static str) -> Column {
    Column { name, kind, unit, required: false, meaning }
}

const fn required(name: &'static str, kind: Kind, unit: &'static str, meaning: &'static str) -> Column {
    Column { name, kind, unit, required: true, meaning }
}

const BOX: Column = optional(
    "box",
    Kind::Point { dim_min: 4, dim_max: 6 },
    "m",
    "what lies in the box from the first corner to the second, corners in a row",
);

/// `[[region]]`
pub(super) const REGION: &[Column] = &[
    required("name", Kind::Text, "", "what constraints and loads call it; alone: the cells of that name in the file"),
    optional("tag", TAG, "", "cells with this number in the file"),
    optional("group", Kind::Text, "", "cells with this name in the file"),
    BOX,
    optional("model", Kind::Choice(&Solid::MODELS), "", "constitutive law; left out: that of [material], as below"),
    optional("young", YOUNG, "Pa", "Young's modulus"),
    optional("poisson", POISSON, "", "Poisson's ratio"),
    optional("density", DENSITY, "kg/m^3", "density"),
    optional("damping_time", NOT_NEGATIVE, "s", "viscosity over elasticity"),
];

const SIDE: Column = optional("side", Kind::Choice(SIDES), "", "a side of the box around the body");
const PLANE: Column = optional(
    "plane",
    Kind::Point { dim_min: 3, dim_max: 4 },
    "",
    "normal n and offset c of the plane n.x = c, nodes within 1e-9 of the body's size",
);
const BY_REGION: Column = optional("region", Kind::Text, "", "nodes of the cells of this [[region]]");
const BY_TAG: Column = optional("tag", TAG, "", "boundary (or points, edges) with this number in the file");
const BY_GROUP: Column = optional("group", Kind::Text, "", "boundary (or points, edges) with this name in the file");
const UNTIL: Column = optional("until", NOT_NEGATIVE, "s", "time from which it is there no more");

/// `[[constraint]]`: a place, and what nodes there may do.
pub(super) const CONSTRAINT: &[Column] = &[
    SIDE,
    BOX,
    PLANE,
    BY_REGION,
    BY_TAG,
    BY_GROUP,
    optional("components", VECTOR, "", "1 for each axis along which nodes are held, 0 for the others; left out: all"),
    optional("normal", VECTOR, "", "nodes slide in planes across this direction"),
    optional("direction", VECTOR, "", "nodes slide along this direction"),
    optional("offset", VECTOR, "m", "prescribed displacement at the end"),
    optional("angle", ANY, "rad", "prescribed rotation at the end"),
    optional("axis", VECTOR, "", "axis of the rotation, in space"),
    optional("through", VECTOR, "m", "point of the axis; left out: the centre of the nodes"),
    optional(
        "motion",
        Kind::Rows(&[
            required("t", NOT_NEGATIVE, "s", "time; in statics the share of the load"),
            required("share", ANY, "", "share of offset and angle, linear between rows"),
        ]),
        "",
        "how offset and angle are gone through; left out: evenly, up to the end",
    ),
    UNTIL,
];

/// `[[load]]`: a place, and what acts there.
pub(super) const LOAD: &[Column] = &[
    SIDE,
    BOX,
    PLANE,
    BY_REGION,
    BY_TAG,
    BY_GROUP,
    optional("gravity", VECTOR, "m/s^2", "on the whole body, or on the region"),
    optional("traction", VECTOR, "Pa", "on boundary facets whose nodes are picked"),
    optional("force", VECTOR, "N", "in all, shared equally by the nodes, or along the segment"),
    optional("from", VECTOR, "m", "start of a loaded segment, instead of a place"),
    optional("to", VECTOR, "m", "its end"),
    UNTIL,
];
