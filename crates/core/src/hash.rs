//! The hash function from which all random numbers are computed. So they are the same in every run.

/// Returns a hash of a 64-bit number: the finaliser of SplitMix64 (Steele, Lea, Flood, "Fast
/// Splittable Pseudorandom Number Generators", 2014). It is a permutation in which every bit of the
/// argument affects every bit of the result.
#[inline(always)]
pub(crate) fn splitmix64(z: u64) -> u64 {
    let z = z.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ z >> 31
}

#[cfg(test)]
mod tests {
    use super::splitmix64;

    /// Protects: pictures and scattered objects stay the same. The expected values are the first
    /// numbers of SplitMix64 with seed 0, as printed by its authors' reference program.
    #[test]
    fn numbers_are_those_of_the_reference() {
        const STEP: u64 = 0x9e37_79b9_7f4a_7c15;
        let drawn = [0, STEP, STEP.wrapping_mul(2)].map(splitmix64);
        assert_eq!(
            drawn,
            [
                0xe220_a839_7b1d_cdaf,
                0x6e78_9e6a_a1b9_65f4,
                0x06c4_5d18_8009_454f
            ]
        );
    }
}
