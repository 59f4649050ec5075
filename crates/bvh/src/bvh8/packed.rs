//! Blocks whose triangles share corners: less memory, and the same bits.
//!
//! The triangles of a block are neighbours, so eight of a closed mesh have some nine corners in place of 24. Each block has its own short
//! list of them, which its lanes name by a byte; a walk makes the block anew where it meets it. Refused: indices into one list of the whole mesh
//! (12 bytes a triangle and a cache miss a corner), quantised corners (other hits).

use rayon::prelude::*;

use super::triangle8::{LeafHeader, Triangle8};
use super::{Bvh8, WIDTH};
use crate::shapes::Triangle;

/// Blocks that a thread packs at once. Nothing depends on it.
const PIECE: usize = 512;

/// A block by the names of its corners.
#[derive(Clone, Debug)]
struct Named {
    /// [`Triangle8::longest`], rounded up.
    longest: [Above; WIDTH],
    /// Where its corners begin among those of all.
    first: u32,
    /// Which of them a lane has.
    corners: [[u8; 3]; WIDTH],
}

/// The first half of the bits of a number that is no less than one that was given, and larger by less than a 128th of it: all that the filter
/// asks of an edge's length. Infinities stay what they are.
#[derive(Clone, Copy, Debug)]
struct Above(u16);

impl Above {
    /// From a positive number, or an infinity.
    fn of(number: f32) -> Self {
        let bits = number.to_bits();
        Self((bits >> 16) as u16 + u16::from(bits & 0xFFFF != 0))
    }

    #[inline(always)]
    fn number(self) -> f32 {
        f32::from_bits(u32::from(self.0) << 16)
    }
}

/// All blocks of a tree.
#[derive(Clone, Debug, Default)]
pub(super) struct Packed {
    blocks: Vec<Named>,
    corners: Vec<[f32; 3]>,
}

impl Packed {
    /// The most bytes that a block takes: no two of its triangles share a corner.
    pub const MOST_BYTES: usize = size_of::<Named>() + 3 * WIDTH * size_of::<[f32; 3]>();

    fn new(blocks: &[Triangle8], facts: &[LeafHeader]) -> Self {
        let piece = |(blocks, facts): (&[Triangle8], &[LeafHeader])| {
            let mut piece = Self { blocks: Vec::with_capacity(blocks.len()), corners: Vec::new() };
            blocks.iter().zip(facts).for_each(|(block, facts)| piece.push(block, facts.count.into()));
            piece
        };
        let pieces: Vec<_> = blocks.par_chunks(PIECE).zip(facts.par_chunks(PIECE)).map(piece).collect();
        let mut all = Self {
            blocks: Vec::with_capacity(blocks.len()),
            corners: Vec::with_capacity(pieces.iter().map(|piece| piece.corners.len()).sum()),
        };
        for piece in pieces {
            let base = all.corners.len() as u32;
            all.blocks.extend(piece.blocks.into_iter().map(|named| Named { first: named.first + base, ..named }));
            all.corners.extend(piece.corners);
        }
        all
    }

    /// Appends a block of so many triangles. Corners are the same where all bits are.
    fn push(&mut self, block: &Triangle8, count: usize) {
        let first = self.corners.len();
        let mut corners = [[0; 3]; WIDTH];
        for (lane, names) in corners.iter_mut().enumerate().take(count) {
            for (name, corner) in names.iter_mut().zip(block.triangle(lane).vertices) {
                let own = &self.corners[first..];
                let same = |known: &[f32; 3]| known.map(f32::to_bits) == corner.to_array().map(f32::to_bits);
                let at = own.iter().position(same).unwrap_or(own.len());
                *name = at as u8;
                if at == own.len() {
                    self.corners.push(corner.to_array());
                }
            }
        }
        self.blocks.push(Named { longest: block.longest.map(Above::of), first: first as u32, corners });
    }

    /// A block as the kernels read it; a lane that is not in use has some corner three times, and nothing hits it.
    #[inline(always)]
    pub fn block(&self, number: usize) -> Triangle8 {
        let named = &self.blocks[number];
        let mut block = Triangle8 { longest: named.longest.map(Above::number), ..Triangle8::EMPTY };
        let own = &self.corners[named.first as usize..];
        for (lane, names) in named.corners.iter().enumerate() {
            for (side, &name) in names.iter().enumerate() {
                let [x, y, z] = own[usize::from(name)];
                block.corners[0][side][lane] = x;
                block.corners[1][side][lane] = y;
                block.corners[2][side][lane] = z;
            }
        }
        block
    }

    fn triangle(&self, number: usize, lane: usize) -> Triangle<f32> {
        let named = &self.blocks[number];
        let corner = |side: usize| self.corners[named.first as usize + usize::from(named.corners[lane][side])].into();
        Triangle { vertices: [corner(0), corner(1), corner(2)] }
    }

    pub fn bytes(&self) -> usize {
        size_of_val(self.blocks.as_slice()) + size_of_val(self.corners.as_slice())
    }
}

impl Bvh8 {
    /// Lets the triangles of each block share corners from now on.
    pub(crate) fn pack(&mut self) {
        self.packed = Packed::new(&self.blocks, &self.facts);
        self.blocks = Vec::new();
    }

    /// Whether there are blocks and they are packed.
    #[inline(always)]
    pub(super) fn is_packed(&self) -> bool {
        !self.packed.blocks.is_empty()
    }

    /// A triangle by its number.
    #[inline]
    pub(crate) fn triangle(&self, number: u32) -> Triangle<f32> {
        let (block, lane) = (number as usize / WIDTH, number as usize % WIDTH);
        match self.blocks.get(block) {
            Some(block) => block.triangle(lane),
            None => self.packed.triangle(block, lane),
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    /// Protects: packed blocks have the corners' bits that they were made from, zeros of either sign and lanes not in use included, bounds of
    /// edges that are no less and hardly more, and a fan of eight triangles ten corners: 44 bytes and ten times twelve.
    #[test]
    fn packed_blocks_are_those_that_they_were() {
        let corner = |i: usize| Vec3::new(i as f32, (i * i) as f32, if i.is_multiple_of(2) { 0.0 } else { -0.0 });
        let twins = [Vec3::new(0.0, 1.0, 2.0), Vec3::new(-0.0, 1.0, 2.0), Vec3::ONE];
        let lanes: Vec<[Vec3; 3]> = (0..8).map(|i| [corner(9), corner(i), corner(i + 1)]).collect();
        let fan = [&lanes[..], &[twins, lanes[3]]];
        // So many that they are packed in several pieces, each block in a place of its own.
        let block = |number: usize| {
            let (mut block, triangles) = (Triangle8::EMPTY, fan[number % 2]);
            for (lane, corners) in triangles.iter().enumerate() {
                block.set(lane, corners.map(|p| Vec3::new(p.x, p.y + number as f32, p.z)));
            }
            (block, LeafHeader { count: triangles.len() as u8, ..LeafHeader::default() })
        };
        let (blocks, facts): (Vec<Triangle8>, Vec<LeafHeader>) = (0..2 * PIECE).map(block).unzip();
        let packed = Packed::new(&blocks, &facts);
        assert_eq!(packed.bytes(), PIECE * (2 * 44 + (10 + 6) * 12));
        let bits = |corners: [Vec3; 3]| corners.map(|p| p.to_array().map(f32::to_bits));
        for (number, (block, facts)) in blocks.iter().zip(&facts).enumerate() {
            let again = packed.block(number);
            for (again, longest) in again.longest.into_iter().zip(block.longest) {
                assert!(again >= longest && (again == longest || again <= longest * (1.0 + 1.0 / 128.0)), "{again} of {longest}");
            }
            for lane in 0..usize::from(facts.count) {
                let expected = bits(block.triangle(lane).vertices);
                assert_eq!(bits(again.triangle(lane).vertices), expected, "block {number}, lane {lane}");
                assert_eq!(bits(packed.triangle(number, lane).vertices), expected, "block {number}, lane {lane}");
            }
        }
    }

    /// Protects: bounds by hand: what has no more bits than are kept stays, all else goes up to the next that has, the largest number to
    /// infinity.
    #[test]
    fn lengths_are_rounded_up() {
        let of = |number: f32| Above::of(number).number();
        let kept = [1.0, 0.75, 129.0 / 64.0, f32::INFINITY, f32::NEG_INFINITY];
        assert_eq!(kept.map(of), kept);
        let least = f32::from_bits(1);
        let up = [1.007_812_5, 1.007_812_5, 4.0, f32::INFINITY, f32::from_bits(1 << 16)];
        assert_eq!([1.0_f32.next_up(), 1.007, 3.999, f32::MAX, least].map(of), up);
    }
}
