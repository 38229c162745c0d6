//! The tests of the crate from outside, in one program: what is generic is compiled once, not once per file.

/// Tests of properties `fn property<const D: usize, const N: usize>(kind: u8, seed: u64)` in two, three and four dimensions:
/// the kinds of start meshes in up to three and in four dimensions, then each property with its numbers of cases.
macro_rules! in_each_dimension {
    (kinds $kinds:expr, $kinds_4d:expr; $($property:ident, $cases_2d:expr, $cases_3d:expr, $cases_4d:expr;)*) => {$(
        mod $property {
            use super::*;
            proptest! {
                #![proptest_config(ProptestConfig::with_cases($cases_2d))]
                #[test]
                fn in_2d(kind in $kinds, seed: u64) { super::$property::<2, 3>(kind, seed); }
            }
            proptest! {
                #![proptest_config(ProptestConfig::with_cases($cases_3d))]
                #[test]
                fn in_3d(kind in $kinds, seed: u64) { super::$property::<3, 4>(kind, seed); }
            }
            proptest! {
                #![proptest_config(ProptestConfig::with_cases($cases_4d))]
                #[test]
                fn in_4d(kind in $kinds_4d, seed: u64) { super::$property::<4, 5>(kind, seed); }
            }
        }
    )*};
}

mod files_support;
mod support;

mod checks;
mod coarsening;
mod contours;
mod exact_counts;
mod files;
mod files_mutations;
mod files_refused;
mod files_round_trip;
mod files_samples;
mod improving;
mod locate;
mod properties;
mod remesh;
mod remesh_angles;
mod renumbering;
mod rules;
mod start_meshes;
mod stuffing;
mod sweep;
