//! Random numbers determined by a seed, so that a mangled file can be reproduced.

/// A random stream (Steele, Lea, Flood, "Fast Splittable Pseudorandom Number Generators", 2014).
pub struct MangleRng(u64);

impl MangleRng {
    /// Creates the stream for a seed, the index of a file in its list, and the number of earlier
    /// rounds.
    pub fn new(seed: u64, file: usize, round: u64) -> Self {
        let start = Self(seed).next()
            ^ Self(file as u64).next().rotate_left(21)
            ^ Self(round).next().rotate_left(42);
        Self(start)
    }

    /// Returns the next 64 bits.
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    /// Returns a number below a bound; zero for a bound of zero.
    pub fn below(&mut self, bound: usize) -> usize {
        (self.next() % bound.max(1) as u64) as usize
    }

    /// Returns a random element of a list that must not be empty.
    pub fn choose<'a, T>(&mut self, list: &'a [T]) -> &'a T {
        &list[self.below(list.len())]
    }
}
