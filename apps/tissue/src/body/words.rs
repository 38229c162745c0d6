//! The words of a scene file for each value of an enumeration.

use super::scene::*;
use stylet_scene::Words;

impl Words for Method {
    const WORDS: &'static [(&'static str, Self)] = &[
        ("cg", Self::Cg),
        ("llt", Self::Llt),
        ("ldlt", Self::Ldlt),
        ("newton-cg", Self::NewtonCg),
        ("polak-ribiere", Self::PolakRibiere),
        ("fletcher-reeves", Self::FletcherReeves),
        ("hager-zhang", Self::HagerZhang),
        ("l-bfgs", Self::Lbfgs),
    ];
}

impl Words for PlaneKind {
    const WORDS: &'static [(&'static str, Self)] = &[("stress", Self::Stress), ("strain", Self::Strain)];
}

impl Words for PreconditionerKind {
    const WORDS: &'static [(&'static str, Self)] = &[
        ("none", Self::None),
        ("jacobi", Self::Jacobi),
        ("block-jacobi", Self::BlockJacobi),
        ("ssor", Self::Ssor),
        ("ic0", Self::IncompleteCholesky),
        ("chebyshev", Self::Chebyshev),
        ("aggregation", Self::Aggregation),
        ("factor", Self::Factor),
    ];
}

impl Words for SchemeKind {
    const WORDS: &'static [(&'static str, Self)] =
        &[("newmark", Self::Newmark), ("trapezoid", Self::Trapezoid), ("backward-euler", Self::BackwardEuler)];
}

impl Words for LazyWord {
    const WORDS: &'static [(&'static str, Self)] =
        &[("strain", Self::Strain), ("stiffness", Self::Stiffness), ("rotation", Self::Rotation)];
}

impl Words for NewtonKind {
    const WORDS: &'static [(&'static str, Self)] = &[("one", Self::One), ("full", Self::Full)];
}

impl Words for MassWord {
    const WORDS: &'static [(&'static str, Self)] = &[("lumped", Self::Lumped), ("consistent", Self::Consistent)];
}

impl Words for Shape {
    const WORDS: &'static [(&'static str, Self)] = &[
        ("rest", Self::Rest),
        ("point", Self::Point),
        ("plane", Self::Plane),
        ("line", Self::Line),
        ("scramble", Self::Scramble),
    ];
}
