//! Random numbers by address: a number is a function of pixel, sample, purpose and seed, never drawn from a stream, so that
//! threads, tiles and absent effects can't change a picture.
//!
//! Owen-scrambled Sobol points (crate `sobol_burley`; Burley, "Practical Hash-based Owen Scrambling", 2020), each pixel and
//! purpose with its own scramble. The sequence has 2¹⁶ points; later samples continue with the next scramble.

/// What a pair of numbers is for. Each purpose has dimensions of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// Position in the pixel.
    Pixel = 0,
    /// Position on the lens.
    Lens = 1,
}

/// Points that one scramble of the sequence holds.
const SEQUENCE: u32 = 1 << 16;

/// Two numbers in [0, 1) for a sample of a pixel.
pub fn pair(pixel: [u32; 2], sample: u32, purpose: Purpose, seed: u64) -> [f32; 2] {
    let block = u64::from(sample / SEQUENCE);
    let address = mix(u64::from(pixel[0]) | u64::from(pixel[1]) << 32);
    let scramble = mix(address ^ mix(seed ^ block << 40 ^ (purpose as u64) << 32)) as u32;
    [0, 1].map(|dimension| sobol_burley::sample(sample % SEQUENCE, dimension, scramble))
}

/// The finaliser of SplitMix64 (Steele, Lea, Flood, "Fast Splittable Pseudorandom Number Generators", 2014).
fn mix(mut z: u64) -> u64 {
    z = z.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ z >> 31
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: numbers stay in [0, 1), also at the ends of the sequence and beyond them, and pixels differ.
    #[test]
    fn pairs_are_in_range_and_differ_between_pixels() {
        for sample in [0, 1, 255, SEQUENCE - 1, SEQUENCE, 3 * SEQUENCE + 7, u32::MAX] {
            for pixel in [[0, 0], [1, 0], [0, 1], [65535, 65535]] {
                let p = pair(pixel, sample, Purpose::Pixel, 5);
                assert!(p.iter().all(|x| (0.0..1.0).contains(x)), "{p:?}");
            }
        }
        assert_ne!(pair([1, 2], 0, Purpose::Pixel, 0), pair([2, 1], 0, Purpose::Pixel, 0));
        assert_ne!(pair([1, 2], 0, Purpose::Pixel, 0), pair([1, 2], 0, Purpose::Lens, 0));
        assert_ne!(pair([1, 2], 0, Purpose::Pixel, 0), pair([1, 2], SEQUENCE, Purpose::Pixel, 0));
    }

    /// Protects: the first 16 points of a pixel are stratified, one in each cell of the 4 × 4 grid.
    #[test]
    fn sixteen_points_are_stratified() {
        let mut cells = [0; 16];
        for sample in 0..16 {
            let [x, y] = pair([7, 9], sample, Purpose::Pixel, 1);
            cells[(x * 4.0) as usize + 4 * (y * 4.0) as usize] += 1;
        }
        assert_eq!(cells, [1; 16]);
    }
}
