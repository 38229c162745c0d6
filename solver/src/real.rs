//! The two number formats that matrices and vectors come in.

use pulp::bytemuck::Pod;
use std::fmt::{Debug, Display, LowerExp};
use std::iter::Sum;
use std::ops::{Add, AddAssign, Div, Index, IndexMut, Mul, Neg, Sub, SubAssign};
#[cfg(target_arch = "x86_64")]
use {
    pulp::{bytemuck::cast, x86::V3},
    std::arch::x86_64::__m256,
};

mod sealed {
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

/// Numbers side by side, as many as fit into 32 bytes: what one SIMD register holds.
#[doc(hidden)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C, align(32))]
pub struct Lanes<T, const N: usize>(pub [T; N])
where
    [T; N]: Default;

impl<T, const N: usize> Index<usize> for Lanes<T, N>
where
    [T; N]: Default,
{
    type Output = T;

    #[inline(always)]
    fn index(&self, lane: usize) -> &T {
        &self.0[lane]
    }
}

impl<T, const N: usize> IndexMut<usize> for Lanes<T, N>
where
    [T; N]: Default,
{
    #[inline(always)]
    fn index_mut(&mut self, lane: usize) -> &mut T {
        &mut self.0[lane]
    }
}

/// `f32` or `f64`.
pub trait Real:
    sealed::Sealed
    + Pod
    + Default
    + PartialOrd
    + PartialEq
    + Debug
    + Display
    + LowerExp
    + Send
    + Sync
    + Neg<Output = Self>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + AddAssign
    + SubAssign
    + Sum
    + 'static
{
    /// Numbers side by side.
    #[doc(hidden)]
    type Lanes: Copy + Default + PartialEq + Debug + Send + Sync + IndexMut<usize, Output = Self> + 'static;
    /// How many.
    #[doc(hidden)]
    const LANES: usize;

    /// A number for each lane.
    #[doc(hidden)]
    fn lanes(number: impl Fn(usize) -> Self) -> Self::Lanes;

    /// `sum + a b` lane by lane, rounded twice.
    #[cfg(target_arch = "x86_64")]
    #[doc(hidden)]
    fn add_product(simd: V3, sum: Self::Lanes, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes;

    /// The first two numbers of each block of a lane, sorted by place.
    #[cfg(target_arch = "x86_64")]
    #[doc(hidden)]
    fn sort_pairs(simd: V3, pairs: impl Fn(usize) -> [Self; 2]) -> [Self::Lanes; 2];

    /// 0.
    const ZERO: Self;
    /// 1.
    const ONE: Self;
    /// Distance from 1 to the next larger number.
    const EPSILON: Self;

    /// The nearest number of this format; overflows to an infinity.
    fn from_f64(value: f64) -> Self;

    /// The same number.
    fn to_f64(self) -> f64;

    /// Neither NaN nor infinite.
    fn is_finite(self) -> bool;

    /// The square root.
    fn sqrt(self) -> Self;

    /// The absolute value.
    fn abs(self) -> Self;
}

macro_rules! real {
    ($($t:ty: $lanes:literal $add:ident $mul:ident $sort:ident),*) => {$(
        impl Real for $t {
            type Lanes = Lanes<$t, $lanes>;
            const LANES: usize = $lanes;

            #[inline(always)]
            fn lanes(number: impl Fn(usize) -> Self) -> Self::Lanes {
                Lanes(std::array::from_fn(number))
            }

            #[cfg(target_arch = "x86_64")]
            #[inline(always)]
            fn add_product(simd: V3, sum: Self::Lanes, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes {
                Lanes(cast(simd.$add(cast(sum.0), simd.$mul(cast(a.0), cast(b.0)))))
            }

            #[cfg(target_arch = "x86_64")]
            #[inline(always)]
            fn sort_pairs(simd: V3, pairs: impl Fn(usize) -> [Self; 2]) -> [Self::Lanes; 2] {
                $sort(simd, pairs)
            }

            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            const EPSILON: Self = <$t>::EPSILON;

            #[inline(always)]
            fn from_f64(value: f64) -> Self {
                value as $t
            }

            #[inline(always)]
            fn to_f64(self) -> f64 {
                f64::from(self)
            }

            #[inline(always)]
            fn is_finite(self) -> bool {
                <$t>::is_finite(self)
            }

            #[inline(always)]
            fn sqrt(self) -> Self {
                <$t>::sqrt(self)
            }

            #[inline(always)]
            fn abs(self) -> Self {
                <$t>::abs(self)
            }
        }
    )*};
}

real!(f32: 8 add_f32x8 mul_f32x8 sort_f32, f64: 4 add_f64x4 mul_f64x4 sort_f64);

#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn sort_f64(simd: V3, pairs: impl Fn(usize) -> [f64; 2]) -> [Lanes<f64, 4>; 2] {
    let two = |a: usize, b: usize| simd.avx._mm256_set_m128d(cast(pairs(b)), cast(pairs(a)));
    let (even, odd) = (two(0, 2), two(1, 3));
    [cast(simd.avx._mm256_unpacklo_pd(even, odd)), cast(simd.avx._mm256_unpackhi_pd(even, odd))].map(Lanes)
}

#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn sort_f32(simd: V3, pairs: impl Fn(usize) -> [f32; 2]) -> [Lanes<f32, 8>; 2] {
    // A pair travels as one number of 64 bits.
    let pair = |lane: usize| -> f64 { cast(pairs(lane)) };
    let four = |a: usize| -> __m256 { cast([pair(a), pair(a + 1), pair(a + 4), pair(a + 5)]) };
    let (low, high) = (four(0), four(2));
    let sorted: [__m256; 2] = [
        simd.avx._mm256_shuffle_ps::<0b10_00_10_00>(low, high),
        simd.avx._mm256_shuffle_ps::<0b11_01_11_01>(low, high),
    ];
    sorted.map(|lanes| Lanes(cast(lanes)))
}
