//! Second derivatives of `J` and of the polar rotation, contracted with shape gradients: parts of element stiffnesses that
//! need no singular values.

use super::principal::{Elements, Principal, balanced_stiffness, is_definite};
use crate::lanes::{Pack, PackMatrix, any_not, cofactor, determinant_by, matrix_of, times_transpose};

/// `M g` for the gradients of vertices `1..N`.
#[inline(always)]
pub(super) fn mapped<const D: usize, const N: usize, const L: usize>(
    m: &PackMatrix<D, L>,
    g: &[[Pack<L>; D]; N],
) -> [[Pack<L>; D]; N] {
    let mut h = [[Pack::ZERO; D]; N];
    for a in 1..N {
        for i in 0..D {
            for k in 0..D {
                h[a][i] += m[i][k] * g[a][k];
            }
        }
    }
    h
}

/// Adds `scale (x . y) I`.
#[inline(always)]
pub(super) fn add_isotropic<const D: usize, const L: usize>(
    k: &mut PackMatrix<D, L>,
    scale: Pack<L>,
    x: &[Pack<L>; D],
    y: &[Pack<L>; D],
) {
    let mut dot = x[0] * y[0];
    for i in 1..D {
        dot += x[i] * y[i];
    }
    for i in 0..D {
        k[i][i] += scale * dot;
    }
}

/// Adds `scale x y^T`.
#[inline(always)]
pub(super) fn add_dyad<const D: usize, const L: usize>(
    k: &mut PackMatrix<D, L>,
    scale: Pack<L>,
    x: &[Pack<L>; D],
    y: &[Pack<L>; D],
) {
    for i in 0..D {
        let row = scale * x[i];
        for j in 0..D {
            k[i][j] += row * y[j];
        }
    }
}

/// Adds `scale g_a . (d2J/dF2) . g_b`: in space the cross product with `w = F (g_a x g_b)`, `K_ik = e_ikm w_m`.
#[inline(always)]
pub(super) fn add_volume_curvature<const D: usize, const L: usize>(
    k: &mut PackMatrix<D, L>,
    scale: Pack<L>,
    f: &PackMatrix<D, L>,
    ga: &[Pack<L>; D],
    gb: &[Pack<L>; D],
) {
    if D == 2 {
        let w = scale * (ga[0] * gb[1] - ga[1] * gb[0]);
        k[0][1] += w;
        k[1][0] -= w;
        return;
    }
    let cross = cross(ga, gb);
    for m in 0..D {
        let (i, j) = ((m + 1) % D, (m + 2) % D);
        let mut w = f[m][0] * cross[0];
        for n in 1..D {
            w += f[m][n] * cross[n];
        }
        let w = scale * w;
        k[i][j] += w;
        k[j][i] -= w;
    }
}

#[inline(always)]
fn cross<const D: usize, const L: usize>(x: &[Pack<L>; D], y: &[Pack<L>; D]) -> [Pack<L>; D] {
    let mut c = [Pack::ZERO; D];
    for m in 0..D {
        let (i, j) = ((m + 1) % D, (m + 2) % D);
        c[m] = x[i] * y[j] - x[j] * y[i];
    }
    c
}

/// The derivative of the polar rotation: `dR = [omega] R`, where `Q^-1 omega` is the axial vector of `dF R^T - R dF^T` and
/// `Q^-1 = tr(B) I - B` for the left stretch `B = F R^T`.
pub(super) struct RotationGradient<const D: usize, const L: usize> {
    /// In the plane the only entry is `1 / tr B`, the first one.
    q: PackMatrix<D, L>,
    /// `Q^-1`, likewise.
    inverse: PackMatrix<D, L>,
}

impl<const D: usize, const L: usize> RotationGradient<D, L> {
    #[inline(always)]
    pub fn new(f: &PackMatrix<D, L>, r: &PackMatrix<D, L>) -> Self {
        let b = times_transpose(f, r);
        let mut trace = Pack::ZERO;
        for i in 0..D {
            trace += b[i][i];
        }
        let mut q = [[Pack::ZERO; D]; D];
        if D == 2 {
            q[0][0] = Pack::ONE / trace;
            let mut inverse = q;
            inverse[0][0] = trace;
            return Self { q, inverse };
        }
        for i in 0..D {
            for k in 0..D {
                // The mean of both halves: symmetric to the last bit.
                q[i][k] = (b[i][k] + b[k][i]) * -0.5;
            }
            q[i][i] += trace;
        }
        let adjugate = cofactor(&q);
        let reciprocal = Pack::ONE / determinant_by(&q, &adjugate);
        Self { q: matrix_of(|i, k| adjugate[i][k] * reciprocal), inverse: q }
    }

    /// Whether `I + scale dR/dF` is positive definite, given `unit` times it: each eigenvalue of `Q` says so of one axis.
    #[inline(always)]
    pub fn is_definite_with(&self, unit: f64, scale: Pack<L>) -> [bool; L] {
        // On the twist about an axis of Q with eigenvalue q: unit + 2 q scale > 0.
        let mut shifted: PackMatrix<D, L> = matrix_of(|i, k| self.inverse[i][k] * unit);
        if D == 2 {
            return (shifted[0][0] + scale + scale).above(0.0);
        }
        for i in 0..D {
            shifted[i][i] += scale + scale;
        }
        is_definite(&shifted)
    }

    /// Adds `scale g_a . (dR/dF) . g_b = scale [h_a]^T Q [h_b]` with the matrices of the cross product with `h = R g`.
    #[inline(always)]
    pub fn add(&self, k: &mut PackMatrix<D, L>, scale: Pack<L>, ha: &[Pack<L>; D], hb: &[Pack<L>; D]) {
        if D == 2 {
            return add_dyad(k, scale * self.q[0][0], &turned(ha), &turned(hb));
        }
        // Row i of Q [h_b] is q_i x h_b; column j of [h_a]^T M is -h_a x m_j.
        let mut m = self.q;
        for row in &mut m {
            *row = cross(row, hb);
        }
        for j in 0..D {
            let mut column = [Pack::ZERO; D];
            for i in 0..D {
                column[i] = m[i][j];
            }
            let c = cross(&column, ha);
            for i in 0..D {
                k[i][j] += scale * c[i];
            }
        }
    }
}

/// A vector turned by a right angle.
#[inline(always)]
fn turned<const D: usize, const L: usize>(x: &[Pack<L>; D]) -> [Pack<L>; D] {
    let mut t = [Pack::ZERO; D];
    (t[0], t[1]) = (-x[1], x[0]);
    t
}

/// A stiffness from blocks in closed form in the lanes that are `trusted`, and from principal stretches in the others.
///
/// Which of both a lane takes depends on that lane alone.
#[inline(always)]
pub(super) fn closed_or_principal<const D: usize, const L: usize, const N: usize>(
    elements: Elements<'_, D, L, N, impl Principal>,
    trusted: &[bool; L],
    block: impl FnMut(usize, usize) -> PackMatrix<D, L>,
    mut put: impl FnMut(usize, PackMatrix<D, L>),
) {
    let pairs = N * (N + 1) / 2;
    let mut blocks = [[[Pack::ZERO; D]; D]; super::MAX_PAIRS];
    if trusted.contains(&true) {
        balanced_stiffness::<D, L, N>(
            block,
            #[inline(always)]
            |at, k| blocks[at] = k,
        );
    }
    if any_not(trusted) {
        let slow = elements.blocks();
        for at in 0..pairs {
            for i in 0..D {
                for j in 0..D {
                    for l in 0..L {
                        if !trusted[l] {
                            blocks[at][i][j].0[l] = slow[at][i][j].0[l];
                        }
                    }
                }
            }
        }
    }
    for at in 0..pairs {
        put(at, blocks[at]);
    }
}
