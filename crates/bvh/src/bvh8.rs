//! The tree that rays of stored f32 walk: eight-wide nodes over blocks of eight triangles, rows of
//! eight spheres and single other primitives, in the widest registers that the processor has.
//!
//! Nodes and filters decide what is tested and never what is hit: boxes are padded and exits
//! widened, the filter misses a triangle only where its error bounds prove that the exact test does
//! ([`filter`]), and what is left goes through the operations of that test
//! ([`crate::shapes::Triangle`]). So every kernel finds what a scan finds, to the bit.
//!
//! Of a triangle that a ray sees edge-on to within the rounding of f64, a mean of the corners'
//! distances could lie outside its box, and then what was met before would decide. So the exact
//! test takes the distance at an edge then, for scan and tree alike ([`crate::shapes::EDGE_ON`]).

mod collapse;
mod filter;
mod flat;
mod kernel;
mod leaf;
mod optimisation_barrier;
mod packet;
mod projected_ray;
mod query;
mod row;
mod stack;
mod traversal_ray;
mod traversal_simd;
mod traverse;
mod triangle8;
#[cfg(target_arch = "x86_64")]
mod x86;

use core::ops::Range;
use rayon::prelude::*;

use crate::aabb::PaddedBox;
use crate::math::simd::Portable;
pub(crate) use crate::math::simd::{Lanes, WIDTH};
use crate::ray::Visibility;
use crate::shapes::Triangle;
use crate::slot::Slot;

use self::kernel::Chosen;
pub use self::kernel::Kernel;
pub(crate) use self::optimisation_barrier::opaque;
pub(crate) use self::packet::{PacketResult, PacketState, PacketVisitor, RAYS};
pub(crate) use self::query::{HitVisitor, RaySource, TraversalQuery};
pub(crate) use self::row::{Row, RowKind};
pub(crate) use self::traversal_ray::{RayReparametrisation, TraversalRay};
pub(crate) use self::triangle8::LeafHeader;
use self::triangle8::Triangle8;

/// Deepest tree that a traversal has a stack for; what clustering makes deeper is halved.
const MAX_DEPTH: u32 = 64;
/// Each level leaves at most seven siblings behind, and a node's eight children are written at
/// once.
const STACK: usize = (WIDTH - 1) * MAX_DEPTH as usize + WIDTH;

/// An inner child names a node; a leaf a block of triangles, a row of spheres, or the place of one
/// other primitive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(transparent)]
struct Child(u32);

impl Child {
    /// Kinds, in the bits above an index: there are fewer than 2²⁷ primitives.
    const INNER: u32 = 0;
    const BLOCK: u32 = 0b100 << 29;
    const OTHER: u32 = 0b110 << 29;
    const ROW: u32 = 0b111 << 29;
    /// No child: a leaf of nothing.
    const NONE: Self = Self(u32::MAX);

    fn new(kind: u32, index: usize) -> Self {
        Self(kind | index as u32)
    }

    #[inline(always)]
    fn is_leaf(self) -> bool {
        self.0 & Self::BLOCK != 0
    }

    #[inline(always)]
    fn is_block(self) -> bool {
        self.0 & (Self::OTHER ^ Self::BLOCK) == 0
    }

    /// Of a leaf that is something and no block: whether spheres are in it.
    #[inline(always)]
    fn is_row(self) -> bool {
        self.0 & (Self::ROW ^ Self::OTHER) != 0
    }

    /// The same among nodes, blocks, places and rows that begin later by so much.
    fn moved(self, [nodes, blocks, places, rows]: [u32; 4]) -> Self {
        let by = match self {
            Self::NONE => 0,
            child if !child.is_leaf() => nodes,
            child if child.is_block() => blocks,
            child if child.is_row() => rows,
            _ => places,
        };
        Self(self.0 + by)
    }

    /// Of an inner child, the node.
    #[inline(always)]
    fn node(self) -> usize {
        self.0 as usize
    }

    /// Of the block, the row or the place.
    #[inline(always)]
    fn index(self) -> usize {
        (self.0 & !Self::ROW) as usize
    }
}

/// Up to eight children with their boxes: of each axis the minima, then the maxima, so that the
/// place of either is all that a traversal has to keep of a side. An absent one has an inverted
/// box, which no ray of finite numbers enters.
#[repr(C, align(64))]
#[derive(Clone, Debug)]
struct Node {
    planes: [[f32; 2 * WIDTH]; 3],
    children: [Child; WIDTH],
}

impl Node {
    const EMPTY: Self = {
        let mut planes = [[f32::INFINITY; 2 * WIDTH]; 3];
        let mut place = 0;
        while place < 3 * WIDTH {
            planes[place / WIDTH][WIDTH + place % WIDTH] = f32::NEG_INFINITY;
            place += 1;
        }
        Self {
            planes,
            children: [Child::NONE; WIDTH],
        }
    };

    fn set(&mut self, lane: usize, bounds: &PaddedBox, child: Child) {
        for axis in 0..3 {
            self.planes[axis][lane] = bounds.min[axis];
            self.planes[axis][WIDTH + lane] = bounds.max[axis];
        }
        self.children[lane] = child;
    }
}

/// A bounding-volume hierarchy over places in an order that its build returned, with the triangles
/// among them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Bvh8 {
    /// Root first; none where everything is tested.
    nodes: Vec<Node>,
    blocks: Vec<Triangle8>,
    /// Of each block.
    facts: Vec<LeafHeader>,
    /// First those that every query tests, then those of leaves.
    rows: Vec<Row>,
    always: usize,
    /// Without nodes: the places of what is in no row and in no block.
    others: Range<usize>,
    kernel: Chosen,
}

impl Bvh8 {
    /// Puts the triangles into the blocks: `taken` says what a slot's is and how it takes part. The
    /// slots from `first` on are in the order of the leaves; those of triangles get the numbers by
    /// which [`Bvh8::triangle`] knows them.
    pub fn fill(
        &mut self,
        slots: &mut [Slot],
        first: usize,
        taken: impl Fn(&Slot) -> (Triangle<f32>, Visibility) + Sync,
    ) {
        let blocks = self
            .blocks
            .par_iter_mut()
            .zip(&mut self.facts)
            .with_min_len(512);
        blocks.for_each(|(block, facts)| {
            facts.first += first as u32;
            for lane in 0..usize::from(facts.count) {
                let (triangle, visibility) = taken(&slots[facts.first as usize + lane]);
                block.set(lane, triangle.vertices);
                facts.set(lane, visibility);
            }
        });
        // Afterwards, since up to here a slot's number says where its triangle is taken from.
        for (number, facts) in self.facts.iter().enumerate() {
            for lane in 0..usize::from(facts.count) {
                slots[facts.first as usize + lane].index = (number * WIDTH + lane) as u32;
            }
        }
    }

    /// Fills leaves of spheres; `row` makes one of some slots, of which the tree's begin at
    /// `first`.
    pub fn fill_rows(&mut self, first: usize, row: impl Fn(Range<usize>) -> Row) {
        for own in &mut self.rows[self.always..] {
            let start = first + own.facts.first as usize;
            *own = row(start..start + usize::from(own.facts.count));
        }
    }

    /// No nodes: rows of so many spheres, then blocks of so many triangles and others one by one,
    /// in this order of places. Rows and blocks are still to be filled.
    pub fn flat(spheres: usize, triangles: usize, others: usize) -> Self {
        let end = spheres + triangles;
        let block = |first: usize| LeafHeader::new(first, (end - first).min(WIDTH));
        let facts: Vec<LeafHeader> = (spheres..end).step_by(WIDTH).map(block).collect();
        Self {
            blocks: vec![Triangle8::EMPTY; facts.len()],
            facts,
            others: end..end + others,
            ..Self::default()
        }
    }

    /// Adds rows that every query tests, before anything else.
    pub fn test_always(&mut self, rows: impl IntoIterator<Item = Row>) {
        let before = self.rows.len();
        self.rows.splice(self.always..self.always, rows);
        self.always += self.rows.len() - before;
    }

    /// Whether triangles are in it.
    #[inline(always)]
    pub fn has_blocks(&self) -> bool {
        !self.blocks.is_empty()
    }

    /// A triangle by its number.
    #[inline]
    pub fn triangle(&self, number: u32) -> Triangle<f32> {
        self.blocks[number as usize / WIDTH].triangle(number as usize % WIDTH)
    }

    /// Which code walks it.
    pub fn kernel(&self) -> Kernel {
        match self.kernel {
            Chosen::Portable(_) => Kernel::Portable,
            Chosen::Avx2(_) => Kernel::Avx2,
            Chosen::Avx512(_) => Kernel::Avx512,
        }
    }

    /// Lets other code walk it; the portable one where the processor can't run that.
    pub fn set_kernel(&mut self, kernel: Kernel) {
        self.kernel = Chosen::new(kernel).unwrap_or(Chosen::Portable(Portable));
    }

    /// Bytes of nodes and blocks.
    pub fn bytes(&self) -> usize {
        size_of_val(self.nodes.as_slice())
            + size_of_val(self.blocks.as_slice())
            + size_of_val(self.facts.as_slice())
            + size_of_val(self.rows.as_slice())
    }

    /// Bytes of the rows of so many spheres or planes, and of the blocks of so many triangles where
    /// they are filled one after the other.
    pub fn bytes_of_flat(spheres: u64, triangles: u64) -> u64 {
        let eights =
            |count: u64, bytes: usize| count.div_ceil(WIDTH as u64).saturating_mul(bytes as u64);
        let blocks = eights(triangles, size_of::<Triangle8>() + size_of::<LeafHeader>());
        eights(spheres, size_of::<Row>()).saturating_add(blocks)
    }

    /// The most bytes that the tree over so many spheres, triangles and other primitives takes.
    ///
    /// A node with room left has leaves alone, or it would have opened a child. Of t nodes let f
    /// have an inner child: these were full, so they had 8f − (t − 1) leaves. The others have nine
    /// triangles at least, or another primitive and one lane more. So t ≤ n/7 + 1 for n triangles,
    /// t ≤ (4n + 3)/7 for n others, and t ≤ n/7 + m + 1 for both. Blocks of fewer than three
    /// triangles are alone in their node, which then has seven inner children, or beside those that
    /// they don't fit into: there are at most n/3 + n/49 blocks, and one more for each other
    /// primitive that may stand between them.
    pub fn most_bytes([spheres, triangles, others]: [u64; 3]) -> u64 {
        let few = |count: u64| count.saturating_mul(4).saturating_add(3) / 7;
        let all = [triangles, spheres, others]
            .into_iter()
            .fold(0, u64::saturating_add);
        // The most of one company are the triangles of the argument above, whatever they are.
        let most = triangles.max(spheres);
        let nodes = if most == 0 {
            few(others)
        } else {
            (most / 7).saturating_add(all - most).saturating_add(1)
        };
        // Of a sphere beside others of other kinds, few leaves are full.
        let leaves = (spheres / 2).min(
            (spheres / 5)
                .saturating_mul(2)
                .saturating_add(all - spheres)
                .saturating_add(2),
        );
        let leaves = leaves.saturating_mul(size_of::<Row>() as u64);
        let others = all - triangles;
        let blocks = triangles.min(
            (triangles / 5)
                .saturating_mul(2)
                .saturating_add(others)
                .saturating_add(2),
        );
        let each = (size_of::<Triangle8>() + size_of::<LeafHeader>()) as u64;
        blocks
            .saturating_mul(each)
            .saturating_add(nodes.saturating_mul(size_of::<Node>() as u64))
            .saturating_add(leaves)
    }
}
