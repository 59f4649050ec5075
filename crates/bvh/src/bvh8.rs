//! The tree that rays of stored f32 walk: eight-wide nodes over blocks of eight triangles, rows of eight spheres and single other
//! primitives, in the widest registers that the processor has.
//!
//! Nodes and filters decide what is tested and never what is hit: boxes are padded and exits widened, the filter misses a
//! triangle only where its error bounds prove that the exact test does ([`filter`]), and what is left goes through the
//! operations of that test ([`crate::shapes::Triangle`]). So every kernel finds what a scan finds, to the bit.
//!
//! Of a triangle that a ray sees edge-on to within the rounding of f64, a mean of the corners' distances could lie outside its box, and
//! then what was met before would decide. So the exact test takes the distance at an edge then, for scan and tree alike
//! ([`crate::shapes::EDGE_ON`]).

mod collapse;
mod entries;
mod filter;
mod flat;
mod kernel;
mod optimisation_barrier;
mod packet;
mod projected_ray;
mod reparametrisation;
mod row;
mod sphere_leaf;
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
pub(crate) use crate::math::simd::WIDTH;
use crate::primitive_set::Slot;
use crate::ray::Visibility;
use crate::shapes::Triangle;

use self::kernel::Chosen;
pub use self::kernel::Kernel;
pub(crate) use self::packet::{PacketResult, PacketState, PacketVisitor, RAYS};
pub(crate) use self::projected_ray::TriangleHit;
pub(crate) use self::reparametrisation::RayReparametrisation;
pub(crate) use self::row::{Row, SphereHits};
pub(crate) use self::traversal_ray::TraversalRay;
pub(crate) use self::traverse::HitVisitor;
pub(crate) use self::triangle8::LeafHeader;
use self::triangle8::Triangle8;

/// The most primitives that one tree can address.
pub const MAX_PRIMITIVES: usize = (1 << 27) - 1;
/// Deepest tree that a traversal has a stack for; the builder falls back to a balanced split beyond it.
const MAX_DEPTH: u32 = 64;
/// Each level leaves at most seven siblings behind, and a node's eight children are written at once.
const STACK: usize = (WIDTH - 1) * MAX_DEPTH as usize + WIDTH;

/// An inner child names a node; a leaf a block of triangles, a row of spheres, or the place of one other primitive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(transparent)]
struct Child(u32);

impl Child {
    const LEAF: u32 = 1 << 31;
    const OTHER: u32 = 1 << 30;
    /// Of those that are no blocks. There are fewer than 2²⁷ primitives.
    const ROW: u32 = 1 << 29;
    /// No child: a leaf of nothing.
    const NONE: Self = Self(u32::MAX);

    fn inner(node: usize) -> Self {
        Self(node as u32)
    }

    fn block(block: usize) -> Self {
        Self(Self::LEAF | block as u32)
    }

    fn other(place: usize) -> Self {
        Self(Self::LEAF | Self::OTHER | place as u32)
    }

    fn row(row: usize) -> Self {
        Self(Self::LEAF | Self::OTHER | Self::ROW | row as u32)
    }

    #[inline(always)]
    fn is_leaf(self) -> bool {
        self.0 & Self::LEAF != 0
    }

    #[inline(always)]
    fn is_block(self) -> bool {
        self.0 & Self::OTHER == 0
    }

    /// Of a leaf that is something and no block: whether spheres are in it.
    #[inline(always)]
    fn is_row(self) -> bool {
        self.0 & Self::ROW != 0
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
        (self.0 & !(Self::LEAF | Self::OTHER | Self::ROW)) as usize
    }
}

/// Up to eight children with their boxes, `planes[axis][side][lane]` with side 0 the minima. An absent one has an inverted
/// box, which no ray of finite numbers enters.
#[repr(C, align(64))]
#[derive(Clone, Debug)]
struct Node {
    planes: [[[f32; WIDTH]; 2]; 3],
    children: [Child; WIDTH],
}

impl Node {
    const EMPTY: Self =
        Self { planes: [[[f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]]; 3], children: [Child::NONE; WIDTH] };

    fn set(&mut self, lane: usize, bounds: &PaddedBox, child: Child) {
        for axis in 0..3 {
            self.planes[axis][0][lane] = bounds.min[axis];
            self.planes[axis][1][lane] = bounds.max[axis];
        }
        self.children[lane] = child;
    }
}

/// How many primitives of each kind of leaf there are.
#[derive(Clone, Copy)]
pub(crate) struct PrimitiveCounts {
    pub triangles: u64,
    pub spheres: u64,
    pub others: u64,
}

/// A bounding-volume hierarchy over places in an order that its build returned, with the triangles among them.
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
    /// Puts the triangles into the blocks: `taken` says what a slot's is and how it takes part. The slots from `first` on are in
    /// the order of the leaves; those of triangles get the numbers by which [`Bvh8::triangle`] knows them.
    pub fn fill(&mut self, slots: &mut [Slot], first: usize, taken: impl Fn(&Slot) -> (Triangle<f32>, Visibility) + Sync) {
        const PIECE: usize = 512;
        let (mut rest, mut done) = (&mut slots[first..], 0);
        let mut pieces = Vec::with_capacity(self.blocks.len() / PIECE + 1);
        for (number, (blocks, facts)) in self.blocks.chunks_mut(PIECE).zip(self.facts.chunks_mut(PIECE)).enumerate() {
            let end = facts.last().map_or(done, |last| last.first as usize + usize::from(last.count));
            let (own, after) = rest.split_at_mut(end - done);
            pieces.push((number * PIECE, done, own, blocks, facts));
            (rest, done) = (after, end);
        }
        pieces.into_par_iter().for_each(|(number, start, slots, blocks, facts)| {
            for (at, (block, facts)) in blocks.iter_mut().zip(facts).enumerate() {
                for lane in 0..usize::from(facts.count) {
                    let slot = &mut slots[facts.first as usize - start + lane];
                    let (triangle, visibility) = taken(slot);
                    slot.index = ((number + at) * WIDTH + lane) as u32;
                    block.set(lane, triangle.vertices);
                    facts.set(lane, visibility);
                }
                facts.first += first as u32;
            }
        });
    }

    /// No nodes: rows of so many spheres, then blocks of so many triangles and others one by one, in this order of places. Rows and
    /// blocks are still to be filled.
    pub fn flat(spheres: usize, triangles: usize, others: usize) -> Self {
        let end = spheres + triangles;
        let block =
            |first: usize| LeafHeader { first: first as u32, count: (end - first).min(WIDTH) as u8, ..LeafHeader::default() };
        let facts: Vec<LeafHeader> = (spheres..end).step_by(WIDTH).map(block).collect();
        Self { blocks: vec![Triangle8::EMPTY; facts.len()], facts, others: end..end + others, ..Self::default() }
    }

    /// Adds rows that every query tests, before anything else.
    pub fn test_always(&mut self, rows: impl IntoIterator<Item = Row>) {
        let before = self.rows.len();
        self.rows.splice(self.always..self.always, rows);
        self.always += self.rows.len() - before;
    }

    /// A triangle by its number.
    #[inline]
    pub fn triangle(&self, number: u32) -> Triangle<f32> {
        self.blocks[number as usize / WIDTH].triangle(number as usize % WIDTH)
    }

    /// The facts of a block.
    #[inline(always)]
    pub fn facts(&self, block: usize) -> &LeafHeader {
        &self.facts[block]
    }

    /// Which code walks it.
    pub fn kernel(&self) -> Kernel {
        self.kernel.name()
    }

    /// Lets other code walk it; the portable one where the processor can't run that.
    pub fn set_kernel(&mut self, kernel: Kernel) {
        self.kernel = Chosen::new(kernel).unwrap_or(Chosen::PORTABLE);
    }

    /// Bytes of nodes and blocks.
    pub fn bytes(&self) -> usize {
        size_of_val(self.nodes.as_slice())
            + size_of_val(self.blocks.as_slice())
            + size_of_val(self.facts.as_slice())
            + size_of_val(self.rows.as_slice())
    }

    /// Bytes of the rows of so many spheres or planes.
    pub fn bytes_of_rows(count: u64) -> u64 {
        count.div_ceil(WIDTH as u64).saturating_mul(size_of::<Row>() as u64)
    }

    /// Bytes of the blocks of so many triangles where they are filled one after the other.
    pub fn bytes_of_full_blocks(triangles: u64) -> u64 {
        triangles.div_ceil(WIDTH as u64).saturating_mul((size_of::<Triangle8>() + size_of::<LeafHeader>()) as u64)
    }

    /// The most bytes that the tree over so many triangles and other primitives takes.
    ///
    /// A node with room left has leaves alone, or it would have opened a child. Of t nodes let f have an inner child: these were
    /// full, so they had 8f − (t − 1) leaves. The others have nine triangles at least, or another primitive and one lane
    /// more. So t ≤ n/7 + 1 for n triangles, t ≤ (4n + 3)/7 for n others, and t ≤ n/7 + m + 1 for both. Blocks of fewer than three
    /// triangles are alone in their node, which then has seven inner children, or beside those that they don't fit into: there
    /// are at most n/3 + n/49 blocks, and one more for each other primitive that may stand between them.
    pub fn most_bytes(PrimitiveCounts { triangles, spheres, others }: PrimitiveCounts) -> u64 {
        let few = |count: u64| count.saturating_mul(4).saturating_add(3) / 7;
        let all = [triangles, spheres, others].into_iter().fold(0, u64::saturating_add);
        // The most of one company are the triangles of the argument above, whatever they are.
        let most = triangles.max(spheres);
        let nodes = if most == 0 { few(others) } else { (most / 7).saturating_add(all - most).saturating_add(1) };
        let leaves = Self::most_bytes_of_leaves(spheres, all - spheres);
        let others = all - triangles;
        let blocks = triangles.min((triangles / 5).saturating_mul(2).saturating_add(others).saturating_add(2));
        let each = (size_of::<Triangle8>() + size_of::<LeafHeader>()) as u64;
        blocks.saturating_mul(each).saturating_add(nodes.saturating_mul(size_of::<Node>() as u64)).saturating_add(leaves)
    }
}
