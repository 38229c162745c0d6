//! Random numbers that are the same on every run.

/// A SplitMix64 sequence.
///
/// Source: Steele, Lea & Flood, *Fast splittable pseudorandom number generators*, OOPSLA (2014).
pub(crate) struct SplitMix64(pub u64);

impl SplitMix64 {
    /// 64 random bits.
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// 53 random bits as a number in `0..1`.
    pub fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }
}
