//! Random numbers by address. A number is a function of seed, frame, pixel, replicate, sample, path
//! vertex and purpose; it is never drawn from a stream. So threads, tiles, absent effects and
//! additional numbers cannot change a picture.
//!
//! The default numbers are Owen-scrambled Sobol points (crate `sobol_burley`; Burley, "Practical
//! Hash-based Owen Scrambling", 2020). For each vertex and purpose, the samples of a replicate of a
//! pixel are points of one sequence, with a scramble of its own. They are correlated, which lowers
//! the error of their mean. Replicates have different scrambles and are independent; the error is
//! estimated from them. A sequence has 2¹⁶ points; later samples continue with the next scramble.
//!
//! The numbers are `f32` in every precision, on purpose: a sample has the same position in its
//! pixel, on the lens and on a light, so that pictures of two precisions differ by arithmetic and
//! not by noise. Where the 23 bits of one number are too few, as for choosing among a million
//! emitters, both numbers of a pair are used.
//!
//! The first two of a point's four numbers are the best stratified. The most important decision
//! uses them: a direction, not the choice of its lobe.
//!
//! The other samplers give other numbers for the same addresses. They are lower quality levels
//! (rungs) of the sampler setting.

mod sobol;

use crate::hash::splitmix64;
use crate::settings::SamplerKind;

/// Purpose of random numbers at a path vertex. Each purpose has its own sequence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SamplePurpose {
    /// Position in the pixel.
    Pixel = 0,
    /// Position on the lens.
    Lens = 1,
    /// Choice of an emitter for a hit in Whitted's integrator.
    Emitter = 2,
    /// Point on the emitter chosen with [`SamplePurpose::Emitter`].
    EmitterPoint = 3,
    /// Time within the exposure.
    Time = 4,
    /// Choice of a light for a vertex, and of a point on the light.
    Light = 5,
    /// Scattered direction at a vertex, and Russian roulette.
    Scatter = 6,
    /// Stochastic alpha of a partly transparent surface.
    Coverage = 7,
    /// Wavelength of a path after dispersion.
    Wavelength = 8,
    /// Direction of light on the studio's ground.
    Ground = 9,
    /// Distance of a path in a medium.
    Medium = 10,
    /// Lamp and point of a segment in a thin medium.
    Airlight = 11,
}

/// Number of points of a sequence for one scramble.
const SEQUENCE: u32 = 1 << 16;

/// Address of random numbers: the pixel, the sample and the path vertex that use the numbers. The
/// address and a [`SamplePurpose`] determine the numbers. Additional numbers never shift other
/// numbers, because no counter is involved.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SampleAddress {
    /// Seed of the picture.
    pub seed: u64,
    /// Index of the frame in an animation.
    pub frame: u32,
    /// Column and row of the pixel.
    pub pixel: [u32; 2],
    /// Replicate of the pixel.
    pub replicate: u32,
    /// Index of the sample in its replicate, and of the point in each of its sequences.
    pub index: u32,
    /// Number of path vertices before this vertex, passed surfaces included.
    pub bounce: u32,
    /// Hash that identifies the side branch of a path in Whitted's integrator; zero for the main
    /// path.
    pub branch: u64,
    /// Sampler that maps the address to numbers.
    pub sampler: SamplerKind,
}

/// Kind of a side branch: the second of two rays with which Whitted's integrator continues a path
/// at a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PathBranch {
    /// The reflection of a surface that also refracts.
    Reflected = 1,
    /// The path behind a partly transparent surface.
    Behind = 2,
}

/// Hash of the seed, frame, pixel and replicate of an address, which all vertices of a sample
/// share.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SampleHash(u64);

impl SampleAddress {
    /// Returns the hash of the seed, frame, pixel and replicate, which all vertices of a sample
    /// share.
    #[inline]
    pub(crate) fn sample_hash(&self) -> SampleHash {
        let words = [
            u64::from(self.pixel[0]) | u64::from(self.pixel[1]) << 32,
            u64::from(self.frame) | u64::from(self.replicate) << 32,
        ];
        SampleHash(
            words
                .into_iter()
                .fold(splitmix64(self.seed), |hash, word| splitmix64(hash ^ word)),
        )
    }

    /// Returns the address of the first vertex on a side branch that starts at this vertex.
    ///
    /// A branch is identified by a 64-bit hash of all vertices at which it left the main path.
    /// Among n vertices of one sample, two share an address with a probability of n²/2⁶⁵.
    #[must_use]
    pub fn side_branch_address(self, branch: PathBranch) -> Self {
        let branch =
            splitmix64(self.branch ^ splitmix64(u64::from(self.bounce) << 8 | branch as u64));
        Self {
            bounce: self.bounce + 1,
            branch,
            ..self
        }
    }
}

/// Sequence of points for the samples of one replicate at one vertex and for one purpose.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SampleSequence {
    key: SequenceKey,
    sampler: SamplerKind,
}

/// Key of a sequence, from which its scramble is computed: together for many sequences, since the
/// hashes take as long as the points.
#[derive(Clone, Copy, Debug, Default)]
struct SequenceKey {
    /// Sample hash, vertex and purpose.
    vertex: u64,
    /// Hash that identifies the side branch of a path.
    branch: u64,
}

impl SequenceKey {
    /// Returns the scramble that identifies the sequence.
    #[inline(always)]
    fn scramble(self) -> u32 {
        splitmix64(splitmix64(self.vertex) ^ self.branch) as u32
    }
}

impl SampleSequence {
    /// Returns the sequence of an address and a purpose. All samples of a pixel in one replicate
    /// share a sequence until its points are used up, so bulk callers compute it once.
    #[inline]
    pub fn from_address(address: SampleAddress, purpose: SamplePurpose) -> Self {
        Self::from_sample_hash(address.sample_hash(), address, purpose)
    }

    /// Returns the sequence as [`Self::from_address`] does, with a known
    /// [`SampleAddress::sample_hash`].
    #[inline(always)]
    pub fn from_sample_hash(
        SampleHash(hash): SampleHash,
        address: SampleAddress,
        purpose: SamplePurpose,
    ) -> Self {
        let vertex = u64::from(address.bounce)
            | u64::from(address.index / SEQUENCE) << 32
            | (purpose as u64) << 56;
        Self {
            key: SequenceKey {
                vertex: hash ^ vertex,
                branch: address.branch,
            },
            sampler: address.sampler,
        }
    }

    /// Returns four numbers in [0, 1) that are stratified together, at little more than the cost of
    /// one: the point `index` of the sequence.
    #[inline]
    pub fn sample_4d(self, index: u32) -> [f32; 4] {
        let (index, scramble) = (index % SEQUENCE, self.key.scramble());
        match self.sampler {
            SamplerKind::Sobol => sobol::eval_point(index, scramble),
            SamplerKind::Stratified => stratified_point(index, scramble),
            SamplerKind::Independent => independent_point(index, scramble),
        }
    }
}

impl SampleSequence {
    /// Returns the hashed numbers of the sample `index`, of which there are as many as needed: for
    /// loops of unknown length, where stratified numbers have no advantage. `salt` tells several
    /// loops apart.
    #[inline]
    pub fn hashed_numbers(self, index: u32, salt: u64) -> HashedNumbers {
        let vertex = splitmix64(self.key.vertex ^ splitmix64(salt));
        HashedNumbers(splitmix64(vertex ^ self.key.branch) ^ u64::from(index))
    }
}

/// Independent numbers in [0, 1) at an address: a function of the address and of their position.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HashedNumbers(u64);

impl Iterator for HashedNumbers {
    type Item = f64;
    #[inline]
    fn next(&mut self) -> Option<f64> {
        const STEP: u64 = 0x9e37_79b9_7f4a_7c15;
        self.0 = self.0.wrapping_add(STEP);
        Some((splitmix64(self.0) >> 11) as f64 / (1_u64 << 53) as f64)
    }
}

/// Appends four numbers in [0, 1) for each of many sequences and indices, in order; faster than
/// [`SampleSequence::sample_4d`] for each.
pub(crate) fn sample_4d_batch(
    requested: impl Iterator<Item = (SampleSequence, u32)> + Clone,
    out: &mut Vec<[f32; 4]>,
) {
    match requested.clone().next() {
        Some((first, _)) if first.sampler == SamplerKind::Sobol => {
            sobol::eval_points(
                requested.map(|(sequence, index)| (sequence.key, index % SEQUENCE)),
                out,
            );
        }
        _ => out.extend(requested.map(|(sequence, index)| sequence.sample_4d(index))),
    }
}

/// Returns two numbers in [0, 1) at an address, for one purpose. They are the first two of four
/// numbers that are stratified together.
pub fn sample_2d(address: SampleAddress, purpose: SamplePurpose) -> [f32; 2] {
    let [x, y, ..] = SampleSequence::from_address(address, purpose).sample_4d(address.index);
    [x, y]
}

// Samplers simpler than Sobol points, for comparison: independent random numbers, and jittered
// grids.

/// Number of random bits in a number in [0, 1), as for Sobol points.
const BITS: u32 = 23;

/// Returns four independent numbers in [0, 1) for the point `index` of a sequence. `scramble`
/// identifies the sequence.
#[inline]
pub(super) fn independent_point(index: u32, scramble: u32) -> [f32; 4] {
    hash_bits(index, scramble).map(bits_to_unit)
}

/// Returns four numbers in [0, 1) for the point `index` of a sequence: two stratified pairs (Cook,
/// "Stochastic Sampling in Computer Graphics", 1986). `scramble` identifies the sequence.
///
/// Points come in groups of sixteen. In each group, each of the two pairs has a point in every cell
/// of a 4 × 4 grid, jittered within the cell. The order of the cells is random, and differs between
/// the pairs.
#[inline]
pub(super) fn stratified_point(index: u32, scramble: u32) -> [f32; 4] {
    let grid = splitmix64(u64::from(scramble) << 32 | u64::from(index / 16) | 1 << 31);
    let jitter = hash_bits(index, scramble);
    let cells = [
        permute_cell(index % 16, grid as u32),
        permute_cell(index % 16, (grid >> 32) as u32),
    ];
    let places = [cells[0] % 4, cells[0] / 4, cells[1] % 4, cells[1] / 4];
    core::array::from_fn(|k| bits_to_unit(places[k] << (BITS - 2) | jitter[k] >> 2))
}

/// Returns four independent hashes of 23 bits.
#[inline]
fn hash_bits(index: u32, scramble: u32) -> [u32; 4] {
    let a = splitmix64(u64::from(scramble) << 32 | u64::from(index));
    let b = splitmix64(a);
    [a, a >> 32, b, b >> 32].map(|word| word as u32 >> (u32::BITS - BITS))
}

#[inline]
fn bits_to_unit(bits: u32) -> f32 {
    bits as f32 / (1 << BITS) as f32
}

/// Returns the image of `number` under a permutation of 0..16. `key` chooses the permutation. Each
/// step is itself a permutation.
#[inline]
fn permute_cell(number: u32, key: u32) -> u32 {
    (0..4).fold(number, |x, round| {
        let part = key >> (8 * round);
        let x = (x * (part & 15 | 1) + (part >> 4)) & 15;
        x ^ x >> 2
    })
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    /// Protects: numbers stay in [0, 1), also at the ends of the sequence and beyond, and each part
    /// of the address matters.
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
                let p = sample_2d(
                    SampleAddress {
                        pixel,
                        index,
                        seed: 5,
                        ..SampleAddress::default()
                    },
                    SamplePurpose::Pixel,
                );
                assert!(p.iter().all(|x| (0.0..1.0).contains(x)), "{p:?}");
            }
        }
        let base = SampleAddress {
            pixel: [1, 2],
            ..SampleAddress::default()
        };
        let others = [
            SampleAddress { seed: 1, ..base },
            SampleAddress {
                seed: 1 << 40,
                ..base
            },
            SampleAddress { frame: 1, ..base },
            SampleAddress {
                pixel: [2, 1],
                ..base
            },
            SampleAddress {
                replicate: 1,
                ..base
            },
            SampleAddress { index: 1, ..base },
            SampleAddress {
                index: SEQUENCE,
                ..base
            },
            SampleAddress { bounce: 1, ..base },
            SampleAddress { branch: 1, ..base },
            SampleAddress {
                sampler: SamplerKind::Stratified,
                ..base
            },
            SampleAddress {
                sampler: SamplerKind::Independent,
                ..base
            },
        ];
        let purposes = [
            SamplePurpose::Pixel,
            SamplePurpose::Lens,
            SamplePurpose::Emitter,
            SamplePurpose::EmitterPoint,
            SamplePurpose::Time,
            SamplePurpose::Light,
            SamplePurpose::Scatter,
            SamplePurpose::Coverage,
            SamplePurpose::Wavelength,
            SamplePurpose::Ground,
            SamplePurpose::Medium,
            SamplePurpose::Airlight,
        ];
        let numbers = others
            .iter()
            .map(|&address| sample_2d(address, SamplePurpose::Pixel))
            .chain(purposes.map(|purpose| sample_2d(base, purpose)));
        let distinct: BTreeSet<_> = numbers.map(|p| p.map(f32::to_bits)).collect();
        assert_eq!(distinct.len(), others.len() + purposes.len());
    }

    /// Protects: numbers are multiples of 2⁻²³ below one, for each sampler, alone and side by side.
    /// So none can become one, which random rays would reveal only after millions of numbers.
    #[test]
    fn m01_numbers_have_23_bits() {
        for sampler in [
            SamplerKind::Sobol,
            SamplerKind::Stratified,
            SamplerKind::Independent,
        ] {
            let at = |index: u32| SampleAddress {
                pixel: [index.wrapping_mul(7919), !index],
                index,
                sampler,
                ..SampleAddress::default()
            };
            let requested = (0..10_000).map(|index| {
                (
                    SampleSequence::from_address(at(index), SamplePurpose::Scatter),
                    index,
                )
            });
            let mut many = Vec::new();
            sample_4d_batch(requested.clone(), &mut many);
            for x in requested
                .map(|(sequence, index)| sequence.sample_4d(index))
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

    /// Protects: no two pixels share a sequence, at the ends of the largest picture or one bit
    /// apart.
    #[test]
    fn m11_no_pixels_share_a_sequence() {
        let ends = [0, 1, 65_534, 65_535];
        let corners = ends.iter().flat_map(|&x| ends.map(|y| [x, y]));
        let pixels: BTreeSet<[u32; 2]> = corners
            .chain((1..16).flat_map(|bit| [[1 << bit, 0], [0, 1 << bit]]))
            .collect();
        let scramble = |&pixel: &[u32; 2]| {
            SampleSequence::from_address(
                SampleAddress {
                    pixel,
                    ..SampleAddress::default()
                },
                SamplePurpose::Pixel,
            )
            .key
            .scramble()
        };
        assert_eq!(
            pixels.iter().map(scramble).collect::<BTreeSet<_>>().len(),
            pixels.len()
        );
    }

    /// Protects: all vertices of a path that divides in three at each of twelve vertices have
    /// distinct addresses.
    #[test]
    fn branches_never_share_an_address() {
        let mut level = vec![SampleAddress::default()];
        let mut all = BTreeSet::new();
        for _ in 0..12 {
            assert!(
                level
                    .iter()
                    .all(|address| all.insert((address.bounce, address.branch)))
            );
            let children = |&address: &SampleAddress| {
                [
                    SampleAddress {
                        bounce: address.bounce + 1,
                        ..address
                    },
                    address.side_branch_address(PathBranch::Reflected),
                    address.side_branch_address(PathBranch::Behind),
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
                let address = SampleAddress {
                    pixel: [7, 9],
                    replicate,
                    index,
                    seed: 1,
                    ..SampleAddress::default()
                };
                let [x, y] = sample_2d(address, SamplePurpose::Pixel);
                cells[(x * 4.0) as usize + 4 * (y * 4.0) as usize] += 1;
            }
            assert_eq!(cells, [1; 16]);
        }
    }
}

#[cfg(test)]
mod grid_tests {
    use super::*;

    /// Protects: of every sixteen points each pair has one in each cell; the pairs visit the cells
    /// in different orders, and another sixteen in further orders.
    #[test]
    fn each_cell_has_one() {
        let mut orders = std::collections::BTreeSet::new();
        for (scramble, block) in [(0, 0), (7, 0), (7, 1), (u32::MAX, 4095)] {
            for pair in [0, 2] {
                let value_of = |i: u32| {
                    let point = stratified_point(16 * block + i, scramble);
                    (4.0 * point[pair]) as usize + 4 * (4.0 * point[pair + 1]) as usize
                };
                let order: Vec<usize> = (0..16).map(value_of).collect();
                let mut sorted = order.clone();
                sorted.sort_unstable();
                assert_eq!(
                    sorted,
                    (0..16).collect::<Vec<_>>(),
                    "{scramble} {block} {pair}"
                );
                orders.insert(order);
            }
        }
        assert_eq!(orders.len(), 8, "all in orders of their own");
    }

    /// Protects: numbers are uniform in [0, 1) and independent, by the means of numbers, squares
    /// and products: 1/2, 1/3 and 1/4; products across stratified pairs behave as for independent
    /// numbers.
    #[test]
    fn m11_numbers_are_even() {
        const COUNT: u32 = 1 << 16;
        for draw in [independent_point, stratified_point] {
            let (mut mean, mut square, mut product) = ([0.0; 4], [0.0; 4], 0.0);
            for index in 0..COUNT {
                let point = draw(index, 99).map(f64::from);
                assert!(point.iter().all(|x| (0.0..1.0).contains(x)), "{point:?}");
                for k in 0..4 {
                    mean[k] += point[k] / f64::from(COUNT);
                    square[k] += point[k] * point[k] / f64::from(COUNT);
                }
                product += point[0] * point[2] / f64::from(COUNT);
            }
            // Five standard errors of independent numbers.
            let allowed = |variance: f64| 5.0 * (variance / f64::from(COUNT)).sqrt();
            assert!(
                mean.iter().all(|m| (m - 0.5).abs() < allowed(1.0 / 12.0)),
                "{mean:?}"
            );
            assert!(
                square
                    .iter()
                    .all(|s| (s - 1.0 / 3.0).abs() < allowed(4.0 / 45.0)),
                "{square:?}"
            );
            assert!((product - 0.25).abs() < allowed(7.0 / 144.0), "{product}");
        }
    }

    /// Protects: independent points fall into cells by chance: of sixteen cells 16·(15/16)¹⁶ are
    /// empty on average.
    #[test]
    fn independent_points_are_not_stratified() {
        let empty = |scramble: u32| {
            let hit = (0..16).fold(0_u32, |hit, i| {
                let [x, y, ..] = independent_point(i, scramble);
                hit | 1 << ((4.0 * x) as u32 + 4 * (4.0 * y) as u32)
            });
            f64::from(hit.count_zeros() - 16)
        };
        let mean = (0..4096).map(empty).sum::<f64>() / 4096.0;
        assert!(
            (mean - 16.0 * (15.0_f64 / 16.0).powi(16)).abs() < 0.1,
            "{mean}"
        );
    }
}
