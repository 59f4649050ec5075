//! Random numbers by address: a number is a function of seed, frame, pixel, replicate, sample,
//! vertex of the path and purpose, never drawn from a stream, so that threads, tiles, absent
//! effects and further draws can't change a picture.
//!
//! Owen-scrambled Sobol points (crate `sobol_burley`; Burley, "Practical Hash-based Owen
//! Scrambling", 2020). The samples of one replicate of a pixel are points of one sequence for each
//! vertex and purpose, each with its own scramble: they depend on each other, and that is what
//! lowers the error of their mean. Replicates have scrambles of their own and so do not: that is
//! what the error is estimated from. The sequence has 2¹⁶ points; later samples continue with the
//! next scramble.
//!
//! The numbers are f32 whatever the precision, and on purpose: a sample has the same place in its
//! pixel, on the lens and on a light in every precision, so that pictures of two precisions differ
//! by their arithmetic and not by their noise. Where the 23 bits of one number are too few, as for
//! picking one of a million emitters, both of a pair are used.
//!
//! Of the four numbers of a point the first two are the evenest together. What matters most asks
//! for them: a direction, not the choice of its lobe.
//!
//! Other samplers are rungs of a ladder: they have the same addresses and make other numbers of
//! them.

mod grid;
mod sobol;

use crate::hash::mix;
use crate::settings::SamplerKind;

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
    /// When the shutter lets the path in.
    Time = 4,
    /// Which light a vertex asks, and where on it.
    Light = 5,
    /// Which way a path leaves a vertex, and whether it goes on.
    Scatter = 6,
    /// Whether a surface that covers a share of what is behind it is there.
    Coverage = 7,
    /// The one wavelength of a path that was bent apart.
    Wavelength = 8,
    /// From where the studio's ground asks for light.
    Ground = 9,
}

/// Points that one scramble of the sequence holds.
const SEQUENCE: u32 = 1 << 16;

/// Which number: nothing else decides its value. Adding a draw anywhere shifts no other one,
/// because nothing is counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Address {
    /// Seed of the picture.
    pub seed: u64,
    /// Number of the picture in its sequence.
    pub frame: u32,
    /// Column and row.
    pub pixel: [u32; 2],
    /// Replicate of the pixel.
    pub replicate: u32,
    /// Sample of the replicate: which point of its sequences.
    pub index: u32,
    /// Vertices of the path before this one, those included that the path passed through.
    pub bounce: u32,
    /// Which of the paths that a sample may divide into: zero for the one that never left by a side
    /// branch.
    pub branch: u64,
    /// What makes numbers of the rest.
    pub sampler: SamplerKind,
}

/// Where a path divides: the side branches, beside the main one that goes on in the loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Branch {
    /// The reflection of a surface that also refracts.
    Reflected = 1,
    /// What is behind a surface that covers it in part.
    Behind = 2,
}

/// The part of an address that all vertices of a sample share, mixed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SampleHash(u64);

impl Address {
    /// What all vertices of its sample share.
    #[inline]
    pub(crate) fn way(&self) -> SampleHash {
        let words = [
            u64::from(self.pixel[0]) | u64::from(self.pixel[1]) << 32,
            u64::from(self.frame) | u64::from(self.replicate) << 32,
        ];
        SampleHash(
            words
                .into_iter()
                .fold(mix(self.seed), |hash, word| mix(hash ^ word)),
        )
    }

    /// The address of the first vertex on a side branch that leaves here.
    ///
    /// A branch is told by a hash of all the places where it left the main path: tracing it takes
    /// no more than a word, however deep. Of n vertices of one sample, two share an address with a
    /// probability of n²/2⁶⁵.
    #[must_use]
    pub fn aside(self, branch: Branch) -> Self {
        let branch = mix(self.branch ^ mix(u64::from(self.bounce) << 8 | branch as u64));
        Self {
            bounce: self.bounce + 1,
            branch,
            ..self
        }
    }
}

/// The samples of one replicate for one purpose at one vertex: a sequence of points, and which of
/// them an index means.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sequence {
    scramble: u32,
    sampler: SamplerKind,
}

impl Sequence {
    /// The one that an address lies in. All samples of a pixel in one replicate lie in one until it
    /// is used up, so whoever takes many of them asks once.
    #[inline]
    pub fn of(at: Address, purpose: Purpose) -> Self {
        Self::on(at.way(), at, purpose)
    }

    /// The same where [`Address::way`] is known.
    #[inline(always)]
    pub fn on(SampleHash(way): SampleHash, at: Address, purpose: Purpose) -> Self {
        let vertex =
            u64::from(at.bounce) | u64::from(at.index / SEQUENCE) << 32 | (purpose as u64) << 56;
        Self {
            scramble: mix(mix(way ^ vertex) ^ at.branch) as u32,
            sampler: at.sampler,
        }
    }

    /// Four numbers in [0, 1): they are even together, and cost little more than one.
    #[inline]
    fn four(self, index: u32) -> [f32; 4] {
        let (index, scramble) = (index % SEQUENCE, self.scramble);
        match self.sampler {
            SamplerKind::Sobol => sobol::point(sobol::Which { index, scramble }),
            SamplerKind::Stratified => grid::stratified(index, scramble),
            SamplerKind::Independent => grid::independent(index, scramble),
        }
    }
}

/// Four numbers in [0, 1) for each of many sequences and the indices in them, one after the other:
/// in less time than [`Sequence::four`] of each.
pub(crate) fn fours(asked: impl Iterator<Item = (Sequence, u32)> + Clone, out: &mut Vec<[f32; 4]>) {
    match asked.clone().next() {
        Some((first, _)) if first.sampler == SamplerKind::Sobol => {
            sobol::points(
                asked.map(|(sequence, index)| sobol::Which {
                    index: index % SEQUENCE,
                    scramble: sequence.scramble,
                }),
                out,
            );
        }
        _ => out.extend(asked.map(|(sequence, index)| sequence.four(index))),
    }
}

/// Two numbers in [0, 1) for one purpose at one vertex of a sample's path: of four that are even
/// together.
pub fn pair(at: Address, purpose: Purpose) -> [f32; 2] {
    let [x, y, ..] = Sequence::of(at, purpose).four(at.index);
    [x, y]
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    /// Protects: numbers stay in [0, 1), also at the ends of the sequence and beyond them, and each
    /// part of the address counts.
    #[test]
    fn m11_every_part_of_the_address_counts() {
        for index in [
            0,
            1,
            255,
            SEQUENCE - 1,
            SEQUENCE,
            3 * SEQUENCE + 7,
            u32::MAX,
        ] {
            for pixel in [[0, 0], [1, 0], [0, 1], [65535, 65535]] {
                let p = pair(
                    Address {
                        pixel,
                        index,
                        seed: 5,
                        ..Address::default()
                    },
                    Purpose::Pixel,
                );
                assert!(p.iter().all(|x| (0.0..1.0).contains(x)), "{p:?}");
            }
        }
        let base = Address {
            pixel: [1, 2],
            ..Address::default()
        };
        let others = [
            Address { seed: 1, ..base },
            Address {
                seed: 1 << 40,
                ..base
            },
            Address { frame: 1, ..base },
            Address {
                pixel: [2, 1],
                ..base
            },
            Address {
                replicate: 1,
                ..base
            },
            Address { index: 1, ..base },
            Address {
                index: SEQUENCE,
                ..base
            },
            Address { bounce: 1, ..base },
            Address { branch: 1, ..base },
            Address {
                sampler: SamplerKind::Stratified,
                ..base
            },
            Address {
                sampler: SamplerKind::Independent,
                ..base
            },
        ];
        let purposes = [
            Purpose::Pixel,
            Purpose::Lens,
            Purpose::Emitter,
            Purpose::EmitterPoint,
            Purpose::Time,
            Purpose::Light,
            Purpose::Scatter,
            Purpose::Coverage,
            Purpose::Wavelength,
            Purpose::Ground,
        ];
        let numbers = others
            .iter()
            .map(|&at| pair(at, Purpose::Pixel))
            .chain(purposes.map(|purpose| pair(base, purpose)));
        let distinct: BTreeSet<_> = numbers.map(|p| p.map(f32::to_bits)).collect();
        assert_eq!(distinct.len(), others.len() + purposes.len());
    }

    /// Protects: numbers are multiples of 2⁻²³ below one, by each sampler, alone and side by side.
    /// So none can become one, and rays at random would need millions of numbers to see one that
    /// does.
    #[test]
    fn m01_numbers_have_23_bits() {
        for sampler in [
            SamplerKind::Sobol,
            SamplerKind::Stratified,
            SamplerKind::Independent,
        ] {
            let at = |index: u32| Address {
                pixel: [index.wrapping_mul(7919), !index],
                index,
                sampler,
                ..Address::default()
            };
            let asked = (0..10_000).map(|index| (Sequence::of(at(index), Purpose::Scatter), index));
            let mut many = Vec::new();
            fours(asked.clone(), &mut many);
            for x in asked
                .map(|(sequence, index)| sequence.four(index))
                .chain(many)
                .flatten()
            {
                let steps = x * 8_388_608.0;
                assert!(
                    (0.0..8_388_608.0).contains(&steps) && steps.fract() == 0.0,
                    "{sampler:?}: {:08x}",
                    x.to_bits()
                );
            }
        }
    }

    /// Protects: no two pixels share a sequence, be they at the ends of the largest picture or one
    /// bit apart.
    #[test]
    fn m11_no_pixels_share_a_sequence() {
        let ends = [0, 1, 65_534, 65_535];
        let corners = ends.iter().flat_map(|&x| ends.map(|y| [x, y]));
        let pixels: BTreeSet<[u32; 2]> = corners
            .chain((1..16).flat_map(|bit| [[1 << bit, 0], [0, 1 << bit]]))
            .collect();
        let scramble = |&pixel: &[u32; 2]| {
            Sequence::of(
                Address {
                    pixel,
                    ..Address::default()
                },
                Purpose::Pixel,
            )
            .scramble
        };
        assert_eq!(
            pixels.iter().map(scramble).collect::<BTreeSet<_>>().len(),
            pixels.len()
        );
    }

    /// Protects: the vertices of a path that divides three ways at each of twelve vertices all have
    /// addresses of their own.
    #[test]
    fn branches_never_share_an_address() {
        let mut level = vec![Address::default()];
        let mut all = BTreeSet::new();
        for _ in 0..12 {
            assert!(level.iter().all(|at| all.insert((at.bounce, at.branch))));
            let children = |&at: &Address| {
                [
                    Address {
                        bounce: at.bounce + 1,
                        ..at
                    },
                    at.aside(Branch::Reflected),
                    at.aside(Branch::Behind),
                ]
            };
            level = level.iter().flat_map(children).collect();
        }
        assert_eq!(all.len(), (3_usize.pow(12) - 1) / 2);
    }

    /// Protects: the first 16 points of each replicate are stratified, one in each cell of the 4 ×
    /// 4 grid.
    #[test]
    fn m11_sixteen_points_are_stratified() {
        for replicate in 0..4 {
            let mut cells = [0; 16];
            for index in 0..16 {
                let at = Address {
                    pixel: [7, 9],
                    replicate,
                    index,
                    seed: 1,
                    ..Address::default()
                };
                let [x, y] = pair(at, Purpose::Pixel);
                cells[(x * 4.0) as usize + 4 * (y * 4.0) as usize] += 1;
            }
            assert_eq!(cells, [1; 16]);
        }
    }
}
