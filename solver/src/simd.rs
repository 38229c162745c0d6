//! Kernels compiled for the instructions that the processor has.
#![allow(unsafe_code)]
// Calling a function that was compiled for more instructions than the program at large has no safe form. What it pays, one
// thread, 33,902 blocks of 3x3: product in f32 27.4 us with AVX2 (sixteen registers), 24.9 us with AVX-512 (thirty-two).
// `pulp` could dispatch to AVX-512 as well, but its feature for that reaches other crates: see the workspace's Cargo.toml.

use pulp::{Arch, NullaryFnOnce};

/// Runs `kernel`, whose `call` must be `#[inline(always)]`, compiled for AVX-512 where the processor has it, and for what `pulp`
/// knows elsewhere. The bits do not depend on that: no multiplication and addition are fused.
#[inline]
pub(crate) fn dispatch<K: NullaryFnOnce>(kernel: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    if x86::has_avx512() {
        // SAFETY: the processor has the instructions.
        return unsafe { x86::with_avx512(kernel) };
    }
    Arch::new().dispatch(kernel)
}

/// [`dispatch`] of a closure, which must be `#[inline(always)]`.
///
/// It must be one that can be called again: what the compiler makes to call any closure once is not inlined, and would be
/// compiled for the instructions of the program at large. A cycle of smoothed aggregation in `f32`, 280,000 tetrahedra, two
/// threads: 5.9 ms with restriction and prolongation compiled so, 5.2 ms with them in here.
#[inline]
pub(crate) fn run(kernel: impl FnMut()) {
    dispatch(Closure(kernel));
}

struct Closure<F>(F);

impl<F: FnMut()> NullaryFnOnce for Closure<F> {
    type Output = ();

    #[inline(always)]
    fn call(mut self) {
        (self.0)();
    }
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use pulp::NullaryFnOnce;
    use std::sync::LazyLock;

    static AVX512: LazyLock<bool> = LazyLock::new(|| {
        is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512bw")
            && is_x86_feature_detected!("avx512cd")
            && is_x86_feature_detected!("avx512dq")
            && is_x86_feature_detected!("avx512vl")
            && pulp::x86::V3::try_new().is_some()
    });

    pub fn has_avx512() -> bool {
        *AVX512
    }

    /// Needs the instructions that [`has_avx512`] looks for.
    #[target_feature(enable = "avx512f,avx512bw,avx512cd,avx512dq,avx512vl,avx2,bmi1,bmi2,f16c,fma,lzcnt,popcnt")]
    pub fn with_avx512<K: NullaryFnOnce>(kernel: K) -> K::Output {
        kernel.call()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Sum<'a>(&'a [f64]);

    impl NullaryFnOnce for Sum<'_> {
        type Output = f64;

        #[inline(always)]
        fn call(self) -> f64 {
            self.0.iter().sum()
        }
    }

    #[test]
    fn a_kernel_runs_and_returns() {
        let numbers: Vec<f64> = (0..100).map(f64::from).collect();
        assert_eq!(dispatch(Sum(&numbers)), 4950.0);
    }
}
