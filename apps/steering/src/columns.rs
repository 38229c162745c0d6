//! The columns of `[[region]]`, `[[needle]]`, `[[friction.region]]`, `[[friction.membrane]]` and `[[markers.point]]`.

use stylet_physics::material::Solid;
use stylet_scene::{Bound, Column, Kind};

/// Sides of the box around a body, by axis and end.
pub(crate) const SIDES: [&str; 6] = ["left", "right", "front", "back", "bottom", "top"];

pub(crate) const ANY: Kind = Kind::between(Bound::None, Bound::None);
pub(crate) const NOT_NEGATIVE: Kind = Kind::between(Bound::Inclusive(0.0), Bound::Inclusive(1e9));
pub(crate) const POSITIVE: Kind = Kind::between(Bound::Exclusive(0.0), Bound::Inclusive(1e15));
pub(crate) const LENGTH: Kind = Kind::between(Bound::Inclusive(1e-6), Bound::Inclusive(1e3));
pub(crate) const POINT: Kind = Kind::Point { dim_min: 3, dim_max: 3 };
pub(crate) const YOUNG: Kind = Kind::between(Bound::Inclusive(1e-3), Bound::Inclusive(1e15));
pub(crate) const POISSON: Kind = Kind::between(Bound::Exclusive(-1.0), Bound::Exclusive(0.5));
pub(crate) const DENSITY: Kind = Kind::between(Bound::Exclusive(0.0), Bound::Inclusive(1e6));
const TAG: Kind = Kind::Int { min: i32::MIN as i64, max: i32::MAX as i64 };

const fn optional(name: &'static str, kind: Kind, unit: &'static str, meaning: &'static str) -> Column {
    Column { name, kind, unit, required: false, meaning }
}

const fn required(name: &'static str, kind: Kind, unit: &'static str, meaning: &'static str) -> Column {
    Column { name, kind, unit, required: true, meaning }
}

/// `[[region]]`
pub(crate) const REGION: &[Column] = &[
    required("name", Kind::Text, "", "a region of the shape or of the mesh file"),
    optional("tag", TAG, "", "cells with this number in a mesh file, which the name is then given to"),
    optional("model", Kind::Choice(&Solid::MODELS), "", "constitutive law; left out: that of [material]"),
    optional(
        "young",
        YOUNG,
        "Pa",
        "Young's modulus; left out: that of the shape, or of [material]; so are those below",
    ),
    optional("poisson", POISSON, "", "Poisson's ratio"),
    optional("density", DENSITY, "kg/m^3", "density"),
    optional("damping_time", NOT_NEGATIVE, "s", "viscosity over elasticity; left out: that of [material]"),
    optional("fixed", Kind::Bool, "", "whether its nodes are held; left out: as the shape says"),
];

/// `[[needle.motion]]`
pub(crate) const MOTION: &[Column] = &[
    required("t", NOT_NEGATIVE, "s", "time, not before that of the row above; two rows of one time are a jump"),
    optional("insert", ANY, "m/s", "speed out of the sleeve, negative: back"),
    optional("sleeve", POINT, "m/s", "velocity of the sleeve"),
    optional("spin", ANY, "rad/s", "turning of the base about its axis"),
];

/// `[[needle]]`
pub(crate) const NEEDLE: &[Column] = &[
    required("base", POINT, "m", "mouth of the sleeve, outside the tissue"),
    required("direction", POINT, "", "where the sleeve points"),
    optional("length", LENGTH, "m", "what is out of the sleeve at the start; left out: 0.02"),
    optional(
        "edge",
        LENGTH,
        "m",
        "length of the edges there, 1000 of them at most in all that is pushed out; left out: 0.005",
    ),
    optional("young", POSITIVE, "Pa", "Young's modulus; left out: 60e9, nitinol"),
    optional("poisson", POISSON, "", "Poisson's ratio; left out: 0.33"),
    optional("density", DENSITY, "kg/m^3", "density; left out: 6450"),
    optional("diameter", LENGTH, "m", "outer diameter; left out: 0.83e-3"),
    optional("inner_diameter", NOT_NEGATIVE, "m", "of a tube, below the outer; left out: 0, a wire"),
    optional(
        "bending",
        POSITIVE,
        "N m^2",
        "EI, instead of what follows from the material; without any, a string, a needle cannot be pushed",
    ),
    optional("twisting", NOT_NEGATIVE, "N m^2", "GJ, instead of what follows from the material"),
    optional("stretching", POSITIVE, "N", "EA, instead of what follows from the material"),
    optional("linear_density", POSITIVE, "kg/m", "mass by length, instead of what follows from the material"),
    optional(
        "bevel",
        Kind::between(Bound::Exclusive(-1.2), Bound::Exclusive(1.2)),
        "rad",
        "psi: the tip moves by tan psi across for each unit along; left out: 0, a symmetric tip",
    ),
    optional(
        "bevel_direction",
        POINT,
        "",
        "across the needle, where the bevel bends it at the start; left out: up, or y along z",
    ),
    optional(
        "curvature",
        Kind::between(Bound::Inclusive(-1e4), Bound::Inclusive(1e4)),
        "1/m",
        "natural curvature towards bevel_direction: a needle that is bent beforehand; left out: 0, a straight one",
    ),
    optional("curved_length", LENGTH, "m", "how much of it is bent, from the tip; left out: all of it"),
    optional(
        "friction_ratio",
        Kind::between(Bound::Inclusive(1.0), Bound::Inclusive(1e6)),
        "",
        "static over dynamic friction; left out: 1",
    ),
    optional("damping", NOT_NEGATIVE, "s", "stiffness-proportional damping of the needle; left out: 0"),
    optional(
        "friction_factor",
        Kind::Rows(&[
            required("from", NOT_NEGATIVE, "m", "distance to the tip from which it holds, ascending"),
            required("factor", NOT_NEGATIVE, "", "of the friction by length and of the viscosity"),
        ]),
        "",
        "segments of another friction, such as a coating",
    ),
    optional(
        "release",
        Kind::Point { dim_min: 1, dim_max: 200 },
        "m",
        "depths at which a seed is left at the tip while the needle is withdrawn",
    ),
    required(
        "motion",
        Kind::Rows(MOTION),
        "",
        "[[needle.motion]]: motion of the base, linear between rows, the last one beyond them",
    ),
];

/// `[[friction.region]]`
pub(crate) const FRICTION_REGION: &[Column] = &[
    required("name", Kind::Text, "", "the region"),
    optional("per_length", NOT_NEGATIVE, "N/m", "dynamic friction; left out: that of [friction]; so are those below"),
    optional("viscosity", NOT_NEGATIVE, "N s/m^2", "viscous friction"),
    optional("cutting", NOT_NEGATIVE, "N", "cutting force"),
];

/// `[[friction.membrane]]`
pub(crate) const MEMBRANE: &[Column] = &[
    required("of", Kind::Text, "", "\"body\" for the skin, or the region whose capsule it is"),
    required("thickness", LENGTH, "m", "how far it reaches inwards from that surface in the undeformed body"),
    required("cutting", NOT_NEGATIVE, "N", "cutting force of a tip within it, if above that of the tissue"),
];

/// `[[markers.point]]`
pub(crate) const MARKER: &[Column] = &[
    required("name", Kind::Text, "", "what tables call it; no commas"),
    required("at", POINT, "m", "where it is in the undeformed body"),
];
