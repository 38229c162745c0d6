//! The keys of a scene of shapes.

use super::kinds::{self, WORDS};
use super::scene::{Draft, name_of};
use stylet_scene::{Bound, Column, Kind, Stage, Table, Value, key, rows};

const POINT: Kind = Kind::Point { dim_min: 3, dim_max: 3 };
const ANY: Kind = Kind::between(Bound::None, Bound::None);
const LENGTH: Kind = Kind::between(Bound::Inclusive(1e-9), Bound::Inclusive(1e6));
const THICKNESS: Kind = Kind::between(Bound::Inclusive(0.0), Bound::Inclusive(1e6));
const YOUNG: Kind = Kind::between(Bound::Inclusive(1e-3), Bound::Inclusive(1e15));
const POISSON: Kind = Kind::between(Bound::Exclusive(-1.0), Bound::Exclusive(0.5));
const DENSITY: Kind = Kind::between(Bound::Exclusive(0.0), Bound::Inclusive(1e6));

const fn optional(name: &'static str, kind: Kind, unit: &'static str, meaning: &'static str) -> Column {
    Column { name, kind, unit, required: false, meaning }
}

const fn required(name: &'static str, kind: Kind, unit: &'static str, meaning: &'static str) -> Column {
    Column { name, kind, unit, required: true, meaning }
}

/// `[[shape]]`
const SHAPE: &[Column] = &[
    required("name", Kind::Text, "", "what other shapes and regions call it; no commas"),
    required("kind", Kind::Choice(WORDS), "", "what it is; placed is another one turned and moved"),
    optional("centre", POINT, "m", "sphere, ellipsoid, torus-arc: its centre"),
    optional("radius", LENGTH, "m", "sphere, capsule, cylinder: its radius"),
    optional("semi_axes", POINT, "m", "ellipsoid: half its extents along x, y and z"),
    optional("from", POINT, "m", "capsule, cylinder: one end of its axis"),
    optional("to", POINT, "m", "capsule, cylinder: the other end"),
    optional("axis", POINT, "", "torus-arc: direction across its plane"),
    optional("start", POINT, "", "torus-arc: direction from the centre to where it begins"),
    optional("angle", ANY, "rad", "torus-arc: how far it runs about the axis, by the right-hand rule"),
    optional("ring", LENGTH, "m", "torus-arc: radius of the circle that it follows"),
    optional("tube", LENGTH, "m", "torus-arc: radius across"),
    optional("low", POINT, "m", "box: its lowest corner"),
    optional("high", POINT, "m", "box: its highest corner"),
    optional("point", POINT, "m", "half-space: a point of its plane"),
    optional("normal", POINT, "", "half-space: direction out of it"),
    optional("file", Kind::Text, "", "surface: STL or other file of triangles that close, relative to the scene file"),
    optional("unit", LENGTH, "m", "surface: length of the file's unit; left out: 1"),
    optional(
        "of",
        Kind::Text,
        "",
        "the shapes that it is made of, from rows above, with commas between; difference: the first without the others",
    ),
    optional("inside", THICKNESS, "m", "shell: thickness below the surface; left out: 0"),
    optional("outside", THICKNESS, "m", "shell: thickness above the surface; left out: 0"),
    optional("reach", LENGTH, "m", "smooth-union: difference of distances up to which a dent is filled"),
    optional("turn", ANY, "rad", "angle by which it is turned about the origin"),
    optional("turn_axis", POINT, "", "direction that it is turned about"),
    optional("shift", POINT, "m", "by how much it is moved, after it is turned"),
];

/// `[[region]]`
const REGION: &[Column] = &[
    required("name", Kind::Text, "", "what the mesh calls it"),
    required("shape", Kind::Text, "", "name of its [[shape]]"),
    optional("conform", Kind::Bool, "", "whether facets of the mesh follow its surface; left out: true"),
    optional("size", LENGTH, "m", "largest lattice cube that touches it; left out: by domain.coarsest"),
    optional("fixed", Kind::Bool, "", "whether its nodes are held; left out: false"),
    optional("model", Kind::Text, "", "constitutive law; left out: that of [material], as below"),
    optional("young", YOUNG, "Pa", "Young's modulus"),
    optional("poisson", POISSON, "", "Poisson's ratio"),
    optional("density", DENSITY, "kg/m^3", "density"),
];

/// `[[refine]]`
const REFINE: &[Column] = &[
    required("shape", Kind::Text, "", "name of the [[shape]] where cells are small"),
    required("size", LENGTH, "m", "largest lattice cube that touches it"),
];

/// `[[marker]]`
const MARKER: &[Column] = &[
    required("name", Kind::Text, "", "what tables call it"),
    required("at", POINT, "m", "where it is in the undeformed body, within the box"),
];

/// All keys of a scene of shapes.
pub const TABLE: Table<Draft> = Table {
    stages: &[
        Stage { name: "domain", meaning: "the box that is meshed", required: true, enable: |_| {} },
        Stage::optional("material", "what is in no [[region]]", |_| {}),
    ],
    keys: &[
        key!("domain.low", POINT, "m", "[0, 0, 0]", "lowest corner of the box",
            floats: |s| s.low, |s| Some(Value::Floats(s.low.clone()))),
        key!("domain.high", POINT, "m", "[0.1, 0.1, 0.1]", "highest corner of the box",
            floats: |s| s.high, |s| Some(Value::Floats(s.high.clone()))),
        key!("domain.size", LENGTH, "m", "0.01", "edge of the lattice's cubes where borders conform",
            float: |s| s.size, |s| Some(Value::Float(s.size))),
        key!("domain.coarsest", LENGTH, "m", "4 domain.size", "edge of the largest cubes, away from everything",
            float: |s| s.coarsest, |s| s.coarsest.map(Value::Float)),
        key!("domain.background", Kind::Bool, "", "true", "whether what is in no [[region]] is meshed",
            bool: |s| s.background, |s| Some(Value::Bool(s.background))),
        rows!("shape", SHAPE, "a shape, for regions and for other shapes", shapes, kinds::check_row, name_of),
        rows!("region", REGION, "a shape that is meshed, earlier rows over later ones", regions, |_| Ok(()), name_of),
        rows!("refine", REFINE, "a place with small cells", refinements, |_| Ok(()), name_of),
        rows!(
            "marker",
            MARKER,
            "a point of the body that is looked at: a target, a fiducial marker",
            markers,
            |_| Ok(()),
            name_of
        ),
        key!("material.model", Kind::Text, "", "none", "constitutive law",
            text: |s| s.material.model, |s| s.material.model.clone().map(Value::Text)),
        key!("material.young", YOUNG, "Pa", "none", "Young's modulus",
            float: |s| s.material.young, |s| s.material.young.map(Value::Float)),
        key!("material.poisson", POISSON, "", "none", "Poisson's ratio",
            float: |s| s.material.poisson, |s| s.material.poisson.map(Value::Float)),
        key!("material.density", DENSITY, "kg/m^3", "none", "density",
            float: |s| s.material.density, |s| s.material.density.map(Value::Float)),
    ],
};
