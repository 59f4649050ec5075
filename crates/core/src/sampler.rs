//! Random numbers by address: a number is a function of pixel, sample, purpose and seed, never drawn from a stream, so that
//! threads, tiles and absent effects can't change a picture.
//!
//! Owen-scrambled Sobol points (crate `sobol_burley`; Burley, "Practical Hash-based Owen Scrambling", 2020), each pixel and
//! purpose with its own scramble. The sequence has 2¹⁶ points; later samples continue with the next scramble.
//!
//! The numbers are f32 whatever the precision, and on purpose: a sample has the same place in its pixel, on the lens and on a
//! light in every precision, so that pictures of two precisions differ by their arithmetic and not by their noise. Where the
//! 23 bits of one number are too few, as for picking one of a million emitters, both of a pair are used.

use crate::hash::mix;

/// What a pair of numbers is for. Each purpose has dimensions of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// Position in the pixel.
    Pixel = 0,
    /// Position on the lens.
    Lens = 1,
    /// Which emissive surface lights a hit.
    Emitter = 2,
    /// Where on that surface.
    EmitterPoint = 3,
}

/// Points that one scramble of the sequence holds.
const SEQUENCE: u32 = 1 << 16;

/// Which sample of which pixel a number is for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Address {
    /// Column and row.
    pub pixel: [u32; 2],
    /// Sample of the pixel.
    pub sample: u32,
    /// Seed of the picture.
    pub seed: u64,
}

/// Two numbers in [0, 1) for a sample of a pixel.
pub fn pair(at: Address, purpose: Purpose) -> [f32; 2] {
    pair_of(at, purpose, 0)
}

/// The pair number `turn` of those that a sample uses for one purpose: the hits of a path take turns.
pub fn pair_of(Address { pixel, sample, seed }: Address, purpose: Purpose, turn: u32) -> [f32; 2] {
    let block = u64::from(sample / SEQUENCE);
    let address = mix(u64::from(pixel[0]) | u64::from(pixel[1]) << 32);
    let use_of_it = (purpose as u64) << 32 | u64::from(turn);
    let scramble = mix(address ^ mix(seed ^ mix(block << 40 ^ use_of_it))) as u32;
    [0, 1].map(|dimension| sobol_burley::sample(sample % SEQUENCE, dimension, scramble))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(pixel: [u32; 2], sample: u32, purpose: Purpose, seed: u64) -> [f32; 2] {
        pair(Address { pixel, sample, seed }, purpose)
    }

    /// Protects: numbers stay in [0, 1), also at the ends of the sequence and beyond them, and pixels differ.
    #[test]
    fn pairs_are_in_range_and_differ_between_pixels() {
        for sample in [0, 1, 255, SEQUENCE - 1, SEQUENCE, 3 * SEQUENCE + 7, u32::MAX] {
            for pixel in [[0, 0], [1, 0], [0, 1], [65535, 65535]] {
                let p = at(pixel, sample, Purpose::Pixel, 5);
                assert!(p.iter().all(|x| (0.0..1.0).contains(x)), "{p:?}");
            }
        }
        assert_ne!(at([1, 2], 0, Purpose::Pixel, 0), at([2, 1], 0, Purpose::Pixel, 0));
        assert_ne!(at([1, 2], 0, Purpose::Pixel, 0), at([1, 2], 0, Purpose::Lens, 0));
        assert_ne!(at([1, 2], 0, Purpose::Pixel, 0), at([1, 2], SEQUENCE, Purpose::Pixel, 0));
        let turn = |turn| pair_of(Address::default(), Purpose::Emitter, turn);
        assert_ne!(turn(0), turn(1));
    }

    /// Protects: the first 16 points of a pixel are stratified, one in each cell of the 4 × 4 grid.
    #[test]
    fn sixteen_points_are_stratified() {
        let mut cells = [0; 16];
        for sample in 0..16 {
            let [x, y] = at([7, 9], sample, Purpose::Pixel, 1);
            cells[(x * 4.0) as usize + 4 * (y * 4.0) as usize] += 1;
        }
        assert_eq!(cells, [1; 16]);
    }
}
