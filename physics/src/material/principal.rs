//! Isotropic laws through principal stretches: stress, tangent and its projection from the derivatives of `W(sigma)`.
//!
//! With `F = U diag(sigma) V^T` and `g = dW/dsigma` the stress is `U diag(g) V^T`. In the frame of `U` and `V` the tangent is
//! block diagonal: the Hessian of `W(sigma)` on the stretches ("scaling"), and on each pair of axes the eigenvalues
//! `(g_i - g_k)/(sigma_i - sigma_k)` (symmetric, "flip") and `(g_i + g_k)/(sigma_i + sigma_k)` (antisymmetric, "twist"). Its
//! projection to the semidefinite ones therefore needs the eigenvalues of one `D` x `D` matrix only.
//!
//! Sources: Smith, de Goes & Kim (2019), *Analytic eigensystems for isotropic distortion energies*, section 4; Irving, Teran
//! & Fedkiw (2004), section 4.

use super::{MAX_PAIRS, Tangent};
use crate::lanes::{
    LANES, Lane, Pack, PackMatrix, any_not, array_of, cofactor, determinant_by, lane_of, single, times,
    times_transpose, transpose_times, unpack,
};
use crate::svd::{PackSvd, SMALLEST_PAIR, signed_svd_pack};
use nalgebra::SMatrix;
use pulp::{Arch, NullaryFnOnce};

/// An isotropic law as a symmetric function of the signed singular values of `F`.
pub(super) trait Principal: Sized {
    /// `W(sigma)`, J/m^3.
    fn density<const D: usize, const L: usize>(&self, s: &[Pack<L>; D]) -> Pack<L>;

    /// `dW/dsigma`, Pa.
    fn gradient<const D: usize, const L: usize>(&self, s: &[Pack<L>; D]) -> [Pack<L>; D];

    /// The second derivatives, Pa.
    fn curvature<const D: usize, const L: usize>(&self, s: &[Pack<L>; D]) -> Curvature<D, L>;

    /// Strain energy density at `F`, J/m^3: what a law without a shorter way to it has of its stretches, as below.
    #[inline(always)]
    fn energy<const D: usize, const L: usize>(&self, f: &PackMatrix<D, L>) -> Pack<L> {
        finite_or_infinite(self.density(&signed_svd_pack(f).sigma))
    }

    /// First Piola-Kirchhoff stress, Pa.
    #[inline(always)]
    fn stress<const D: usize, const L: usize>(&self, f: &PackMatrix<D, L>) -> PackMatrix<D, L> {
        let svd = signed_svd_pack(f);
        compose(&svd, &self.gradient(&svd.sigma))
    }

    /// Blocks of the element stiffness, each handed to `put` with its place.
    #[inline(always)]
    fn stiffness<const D: usize, const N: usize, const L: usize>(
        &self,
        f: &PackMatrix<D, L>,
        gradients: &[[Pack<L>; D]; N],
        weight: Pack<L>,
        project: bool,
        mut put: impl FnMut(usize, PackMatrix<D, L>),
    ) {
        let blocks = Elements { law: self, f, gradients, weight, project }.blocks();
        for at in 0..N * (N + 1) / 2 {
            put(at, blocks[at]);
        }
    }
}

/// Infinity for NaN.
#[inline(always)]
pub(super) fn finite_or_infinite<const L: usize>(energy: Pack<L>) -> Pack<L> {
    energy.map(|w| if w.is_nan() { f64::INFINITY } else { w })
}

/// The tangent in the principal frame, Pa.
pub(super) struct Curvature<const D: usize, const L: usize> {
    /// `d2W / dsigma_i dsigma_k`.
    pub scaling: PackMatrix<D, L>,
    /// `(g_i - g_k)/(sigma_i - sigma_k)` for `i != k`, in the limit where both are equal.
    pub flip: PackMatrix<D, L>,
    /// `(g_i + g_k)/(sigma_i + sigma_k)` for `i != k`.
    pub twist: PackMatrix<D, L>,
}

impl<const D: usize, const L: usize> Curvature<D, L> {
    pub const ZERO: Self =
        Self { scaling: [[Pack::ZERO; D]; D], flip: [[Pack::ZERO; D]; D], twist: [[Pack::ZERO; D]; D] };
}

/// `sigma_i + sigma_k` as a divisor. The rotation of a law that uses one is undefined where this vanishes (the two axes
/// may turn freely against each other), and its derivative grows without bound on the way there: it stops here.
#[inline(always)]
pub(super) fn pair_sum<const L: usize>(a: Pack<L>, b: Pack<L>) -> Pack<L> {
    let sum = a + b;
    let bound = Pack::splat(SMALLEST_PAIR);
    sum.where_less(bound, bound, sum)
}

/// Products of principal stretches.
pub(super) struct Products<const D: usize, const L: usize> {
    /// `J`.
    pub j: Pack<L>,
    /// `dJ/dsigma_i`: the product of the others.
    pub first: [Pack<L>; D],
    /// `d2J/dsigma_i dsigma_k` for `i != k`: the product of all but these two.
    pub second: PackMatrix<D, L>,
}

impl<const D: usize, const L: usize> Products<D, L> {
    #[inline(always)]
    pub fn of(s: &[Pack<L>; D]) -> Self {
        let mut p = Self { j: Pack::ONE, first: [Pack::ONE; D], second: [[Pack::ONE; D]; D] };
        for m in 0..D {
            p.j = p.j * s[m];
            for i in 0..D {
                if i != m {
                    p.first[i] = p.first[i] * s[m];
                }
                for k in 0..D {
                    if i != m && k != m {
                        p.second[i][k] = p.second[i][k] * s[m];
                    }
                }
            }
        }
        p
    }
}

/// `U diag(values) V^T`.
#[inline(always)]
fn compose<const D: usize, const L: usize>(svd: &PackSvd<D, L>, values: &[Pack<L>; D]) -> PackMatrix<D, L> {
    let mut scaled = svd.u;
    for row in &mut scaled {
        for k in 0..D {
            row[k] = row[k] * values[k];
        }
    }
    times_transpose(&scaled, &svd.v)
}

/// The tangent as its parts in the principal frame.
pub(super) struct PrincipalTangent<const D: usize, const L: usize> {
    svd: PackSvd<D, L>,
    curvature: Curvature<D, L>,
}

impl<const D: usize, const L: usize> PrincipalTangent<D, L> {
    /// The tangent at `F`, or its projection to the semidefinite ones.
    #[inline(always)]
    pub fn new(law: &impl Principal, f: &PackMatrix<D, L>, project: bool) -> Self {
        let svd = signed_svd_pack(f);
        let mut curvature = law.curvature(&svd.sigma);
        if project {
            curvature.scaling = semidefinite(&curvature.scaling);
            for i in 0..D {
                for k in 0..D {
                    // In this order NaN stays NaN.
                    curvature.flip[i][k] = Pack::ZERO.max(curvature.flip[i][k]);
                    curvature.twist[i][k] = Pack::ZERO.max(curvature.twist[i][k]);
                }
            }
        }
        Self { svd, curvature }
    }

    /// What multiplies `dF_ik` and `dF_ki` in `dP_ik`, `i != k`.
    #[inline(always)]
    fn shear(&self, i: usize, k: usize) -> (Pack<L>, Pack<L>) {
        let (flip, twist) = (self.curvature.flip[i][k], self.curvature.twist[i][k]);
        ((flip + twist) * 0.5, (flip - twist) * 0.5)
    }

    #[inline(always)]
    fn apply(&self, df: &PackMatrix<D, L>) -> PackMatrix<D, L> {
        let df = times(&transpose_times(&self.svd.u, df), &self.svd.v);
        let mut dp = [[Pack::ZERO; D]; D];
        for i in 0..D {
            for k in 0..D {
                dp[i][i] += self.curvature.scaling[i][k] * df[k][k];
                if i != k {
                    let (direct, crossed) = self.shear(i, k);
                    dp[i][k] = direct * df[i][k] + crossed * df[k][i];
                }
            }
        }
        times_transpose(&times(&self.svd.u, &dp), &self.svd.v)
    }

    /// Blocks of the element stiffness for `a <= b`, each handed to `put` with its place, of shape functions whose
    /// gradients sum to zero: those of vertex 0 are what balances the others.
    #[inline(always)]
    pub fn element_stiffness<const N: usize>(
        &self,
        gradients: &[[Pack<L>; D]; N],
        weight: Pack<L>,
        put: impl FnMut(usize, PackMatrix<D, L>),
    ) {
        // V^T g.
        let mut g = [[Pack::ZERO; D]; N];
        for a in 1..N {
            for i in 0..D {
                for k in 0..D {
                    g[a][i] += self.svd.v[k][i] * gradients[a][k];
                }
            }
        }
        let (mut scaling, mut direct, mut crossed) =
            (self.curvature.scaling, [[Pack::ZERO; D]; D], [[Pack::ZERO; D]; D]);
        for i in 0..D {
            for k in 0..D {
                scaling[i][k] = scaling[i][k] * weight;
                if i != k {
                    let (same, other) = self.shear(i, k);
                    (direct[i][k], crossed[i][k]) = (same * weight, other * weight);
                }
            }
        }
        balanced_stiffness::<D, L, N>(
            #[inline(always)]
            |a, b| {
                let mut k = [[Pack::ZERO; D]; D];
                for i in 0..D {
                    k[i][i] = scaling[i][i] * (g[a][i] * g[b][i]);
                    for j in 0..D {
                        if j != i {
                            k[i][i] += direct[i][j] * (g[a][j] * g[b][j]);
                            k[i][j] = scaling[i][j] * (g[a][i] * g[b][j]) + crossed[i][j] * (g[a][j] * g[b][i]);
                        }
                    }
                }
                times_transpose(&times(&self.svd.u, &k), &self.svd.u)
            },
            put,
        );
    }
}

/// The upper blocks of a stiffness whose rows sum to zero, from those of vertices `1..N`.
#[inline(always)]
pub(super) fn balanced_stiffness<const D: usize, const L: usize, const N: usize>(
    mut block: impl FnMut(usize, usize) -> PackMatrix<D, L>,
    mut put: impl FnMut(usize, PackMatrix<D, L>),
) {
    let (mut first_row, mut corner) = ([[[Pack::ZERO; D]; D]; N], [[Pack::ZERO; D]; D]);
    let mut at = N;
    for a in 1..N {
        for b in a..N {
            let k = block(a, b);
            for i in 0..D {
                for j in 0..D {
                    first_row[b][i][j] -= k[i][j];
                    if a != b {
                        first_row[a][i][j] -= k[j][i];
                    }
                }
            }
            put(at, k);
            at += 1;
        }
    }
    for b in 1..N {
        for i in 0..D {
            for j in 0..D {
                // The transpose too, so that the corner is symmetric.
                corner[i][j] -= (first_row[b][i][j] + first_row[b][j][i]) * 0.5;
            }
        }
        put(b, first_row[b]);
    }
    put(0, corner);
}

/// The nearest positive semidefinite matrix to a symmetric one.
#[inline(always)]
fn semidefinite<const D: usize, const L: usize>(a: &PackMatrix<D, L>) -> PackMatrix<D, L> {
    let definite = is_definite(a);
    if !any_not(&definite) {
        return *a;
    }
    // Shifted by its norm the matrix is semidefinite, and its singular vectors are its eigenvectors.
    let mut square = Pack::ZERO;
    for row in a {
        for x in row {
            square += *x * *x;
        }
    }
    let shift = square.sqrt();
    let mut shifted = *a;
    for i in 0..D {
        shifted[i][i] += shift;
    }
    let svd = signed_svd_pack(&shifted);
    let values = array_of(|i| Pack::ZERO.max(svd.sigma[i] - shift));
    let projected = compose(&PackSvd { u: svd.v, ..svd }, &values);
    let mut out = *a;
    for i in 0..D {
        for k in 0..D {
            for l in 0..L {
                if !definite[l] {
                    out[i][k].0[l] = projected[i][k].0[l];
                }
            }
        }
    }
    out
}

/// Whether each lane is positive definite, by its leading minors.
#[inline(always)]
pub(super) fn is_definite<const D: usize, const L: usize>(a: &PackMatrix<D, L>) -> [bool; L] {
    let minor = a[0][0] * a[1][1] - a[0][1] * a[1][0];
    let last = if D == 2 { minor } else { determinant_by(a, &cofactor(a)) };
    let mut definite = [false; L];
    for l in 0..L {
        definite[l] = a[0][0].0[l] > 0.0 && minor.0[l] > 0.0 && last.0[l] > 0.0;
    }
    definite
}

/// `dP` at `F` in the direction `dF`.
pub(super) fn stress_differential<const D: usize>(
    law: &impl Principal,
    f: &SMatrix<f64, D, D>,
    df: &SMatrix<f64, D, D>,
) -> SMatrix<f64, D, D> {
    lane_of(&PrincipalTangent::new(law, &single(f), false).apply(&single(df)), 0)
}

/// The whole tangent, or its projection.
pub(super) fn tangent<const D: usize>(law: &impl Principal, f: &SMatrix<f64, D, D>, project: bool) -> Tangent<D> {
    let parts = PrincipalTangent::new(law, &single(f), project);
    Tangent::from_columns(|df| lane_of(&parts.apply(&single(df)), 0))
}

/// Blocks of an element stiffness, the first `N (N + 1) / 2` of them.
pub(super) type Blocks<const D: usize, const L: usize> = [PackMatrix<D, L>; MAX_PAIRS];

/// Elements whose stiffness is wanted.
pub(super) struct Elements<'a, const D: usize, const L: usize, const N: usize, P> {
    pub law: &'a P,
    pub f: &'a PackMatrix<D, L>,
    pub gradients: &'a [[Pack<L>; D]; N],
    pub weight: Pack<L>,
    pub project: bool,
}

impl<const D: usize, const L: usize, const N: usize, P: Principal> Elements<'_, D, L, N, P> {
    /// The blocks by principal stretches. Out of line, like the singular values.
    #[inline(never)]
    pub fn blocks(self) -> Blocks<D, L> {
        if L == 1 { self.call() } else { Arch::new().dispatch(self) }
    }
}

impl<const D: usize, const L: usize, const N: usize, P: Principal> NullaryFnOnce for Elements<'_, D, L, N, P> {
    type Output = Blocks<D, L>;
    #[inline(always)]
    fn call(self) -> Blocks<D, L> {
        let mut blocks = [[[Pack::ZERO; D]; D]; MAX_PAIRS];
        let tangent = PrincipalTangent::new(self.law, self.f, self.project);
        tangent.element_stiffness(
            self.gradients,
            self.weight,
            #[inline(always)]
            |at, k| blocks[at] = k,
        );
        blocks
    }
}

/// Where [`PrincipalTangent::element_stiffness`] puts the blocks of one element.
#[inline(always)]
pub(super) fn put_one<const D: usize, const N: usize>(
    upper: &mut [[[f64; D]; D]],
) -> impl FnMut(usize, PackMatrix<D, 1>) {
    assert_eq!(upper.len(), N * (N + 1) / 2, "one block for each pair a <= b");
    #[inline(always)]
    |at, k| upper[at] = k.map(|row| row.map(|x| x.0[0]))
}

/// The same for a group.
#[inline(always)]
pub(super) fn put_lanes<const D: usize, const N: usize>(
    upper: &mut [[[Lane; D]; D]],
) -> impl FnMut(usize, PackMatrix<D, LANES>) {
    assert_eq!(upper.len(), N * (N + 1) / 2, "one block for each pair a <= b");
    #[inline(always)]
    |at, k| upper[at] = unpack(k)
}

/// The methods of [`Hyperelastic`](super::Hyperelastic) of a law whose `energy`, `stress` and `stiffness` are written for
/// packs.
macro_rules! methods_by_packs {
    ($d:ident) => {
        #[inline(always)]
        fn energy_density(&self, f: &SMatrix<f64, $d, $d>) -> f64 {
            self.energy(&single(f)).0[0]
        }

        #[inline(always)]
        fn first_piola_kirchhoff(&self, f: &SMatrix<f64, $d, $d>) -> SMatrix<f64, $d, $d> {
            lane_of(&self.stress(&single(f)), 0)
        }

        fn element_stiffness<const N: usize>(
            &self,
            f: &SMatrix<f64, $d, $d>,
            gradients: &[[f64; $d]; N],
            weight: f64,
            upper: &mut [[[f64; $d]; $d]],
        ) {
            let put = principal::put_one::<$d, N>(upper);
            self.stiffness(
                &single(f),
                &matrix_of::<N, $d, 1>(|a, i| Pack([gradients[a][i]])),
                Pack([weight]),
                false,
                put,
            );
        }

        #[inline(always)]
        fn energy_lanes(&self, f: &[[Lane; $d]; $d]) -> Lane {
            self.energy(&pack(f)).0
        }

        #[inline(always)]
        fn stress_lanes(&self, f: &[[Lane; $d]; $d]) -> [[Lane; $d]; $d] {
            unpack(self.stress(&pack(f)))
        }

        #[inline(always)]
        fn element_stiffness_lanes<const N: usize>(
            &self,
            f: &[[Lane; $d]; $d],
            gradients: &[[Lane; $d]; N],
            weight: &Lane,
            project: bool,
            upper: &mut [[[Lane; $d]; $d]],
        ) {
            let put = principal::put_lanes::<$d, N>(upper);
            self.stiffness(
                &pack(f),
                &matrix_of::<N, $d, { crate::lanes::LANES }>(|a, i| Pack(gradients[a][i])),
                Pack(*weight),
                project,
                put,
            );
        }
    };
}
pub(super) use methods_by_packs;

/// The methods of [`Hyperelastic`](super::Hyperelastic) that a law gets from its [`Principal`] derivatives.
macro_rules! differentials_by_principal_stretches {
    ($d:ident) => {
        fn stress_differential(&self, f: &SMatrix<f64, $d, $d>, df: &SMatrix<f64, $d, $d>) -> SMatrix<f64, $d, $d> {
            principal::stress_differential(self, f, df)
        }

        fn tangent(&self, f: &SMatrix<f64, $d, $d>) -> Tangent<$d> {
            principal::tangent(self, f, false)
        }

        fn projected_tangent(&self, f: &SMatrix<f64, $d, $d>) -> Tangent<$d> {
            principal::tangent(self, f, true)
        }
    };
}
pub(super) use differentials_by_principal_stretches;

/// The projected tangent of a law that has every other method in closed form.
macro_rules! projection_by_principal_stretches {
    ($d:ident) => {
        fn projected_tangent(&self, f: &SMatrix<f64, $d, $d>) -> Tangent<$d> {
            principal::tangent(self, f, true)
        }

        #[inline(always)]
        fn element_stiffness_lanes<const N: usize>(
            &self,
            f: &[[Lane; $d]; $d],
            gradients: &[[Lane; $d]; N],
            weight: &Lane,
            project: bool,
            upper: &mut [[[Lane; $d]; $d]],
        ) {
            if !project {
                return lane_by_lane(
                    upper,
                    #[inline(always)]
                    |lane, blocks| {
                        let g = lane_gradients(gradients, lane);
                        self.element_stiffness(&lane_matrix(f, lane), &g, weight[lane], blocks);
                    },
                );
            }
            let g = matrix_of::<N, $d, { crate::lanes::LANES }>(|a, i| Pack(gradients[a][i]));
            let blocks =
                principal::Elements { law: self, f: &pack(f), gradients: &g, weight: Pack(*weight), project: true }
                    .blocks();
            let mut put = principal::put_lanes::<$d, N>(upper);
            for at in 0..N * (N + 1) / 2 {
                put(at, blocks[at]);
            }
        }
    };
}
pub(super) use projection_by_principal_stretches;
