//! Random numbers that depend on a seed alone, so that a mangled file can be made again.

/// A stream of numbers (Steele, Lea, Flood, "Fast Splittable Pseudorandom Number Generators",
/// 2014).
pub struct Random(u64);

impl Random {
    /// The stream of a seed, of the place of a file in its list and of how often that file was
    /// mangled before.
    pub fn new(seed: u64, file: usize, round: u64) -> Self {
        let start = Self(seed).next()
            ^ Self(file as u64).next().rotate_left(21)
            ^ Self(round).next().rotate_left(42);
        Self(start)
    }

    /// Any number.
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    /// Below a bound; zero where there is nothing below it.
    pub fn below(&mut self, bound: usize) -> usize {
        (self.next() % bound.max(1) as u64) as usize
    }

    /// One of several; there must be one.
    pub fn of<'a, T>(&mut self, list: &'a [T]) -> &'a T {
        &list[self.below(list.len())]
    }
}
