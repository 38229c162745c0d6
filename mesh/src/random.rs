//! Pseudo-random numbers that are the same on every run and every machine: for start meshes, paths and tests.

/// The generator SplitMix64: a seed is a sequence of `2^64` numbers of 64 bits, each of which occurs once.
///
/// ```
/// use stylet_mesh::random::SplitMix64;
///
/// let mut random = SplitMix64::new(7);
/// let point: [f64; 3] = std::array::from_fn(|_| random.unit());
/// assert!(point.iter().all(|x| (0.0..1.0).contains(x)));
/// ```
///
/// Source: Steele, Lea & Flood, *Fast splittable pseudorandom number generators*, OOPSLA (2014), with the constants of
/// Vigna's `splitmix64.c`: the step is the odd integer next to `2^64` over the golden ratio, the mix Stafford's variant 13.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct SplitMix64 {
    state: u64,
}

impl SplitMix64 {
    /// The sequence of a seed; any seed is as good as another.
    #[must_use]
    pub const fn new(seed: u64) -> Self {
        Self { state: seed }
    }

    /// 64 random bits.
    pub const fn next_u64(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in `0..1`: the upper 53 bits, as many as the mantissa has.
    pub const fn unit(&mut self) -> f64 {
        (self.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::SplitMix64;

    /// What Vigna's `splitmix64.c` prints for the seeds 1234567 and 0.
    #[test]
    fn the_sequence_is_that_of_the_reference() {
        let mut random = SplitMix64::new(1_234_567);
        let first: [u64; 5] = std::array::from_fn(|_| random.next_u64());
        let expected = [
            6_457_827_717_110_365_317,
            3_203_168_211_198_807_973,
            9_817_491_932_198_370_423,
            4_593_380_528_125_082_431,
            16_408_922_859_458_223_821,
        ];
        assert_eq!(first, expected);
        assert_eq!(SplitMix64::new(0).next_u64(), 0xe220_a839_7b1d_cdaf);
    }

    #[test]
    fn units_are_even_and_below_one() {
        let mut random = SplitMix64::new(3);
        let mut counts = [0_u32; 10];
        for _ in 0..100_000 {
            counts[(10.0 * random.unit()) as usize] += 1;
        }
        // Five standard deviations of a binomial count: 5 sqrt(1e5 * 0.1 * 0.9).
        assert!(counts.iter().all(|&n| n.abs_diff(10_000) < 475), "{counts:?}");
    }
}
