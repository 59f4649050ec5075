//! The tree for rays stored in f32: eight-wide nodes over blocks of eight triangles, rows of eight
//! spheres, and other primitives tested one by one. The widest registers of the processor traverse
//! it.
//!
//! Nodes and filters only decide which primitives are tested, never which are hit. Boxes are padded
//! and exit distances widened. The filter rejects a triangle only if its error bounds prove that
//! the exact test rejects the triangle ([`filter`]). Every remaining triangle goes through the
//! operations of the exact test ([`crate::shapes::Triangle`]). So every kernel finds the hits of a
//! linear scan, to the bit.
//!
//! For a triangle that is edge-on to within f64 rounding, the weighted mean of the corners'
//! distances could lie outside the triangle's box. The hit would then depend on the order of
//! traversal. So the exact test uses the distance at an edge instead, in a scan as in a tree
//! ([`crate::shapes::EDGE_ON_RATIO`]).

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
pub(crate) use crate::math::simd::{MaskLanes, WIDTH};
use crate::ray::Visibility;
use crate::shapes::Triangle;
use crate::slot::PrimitiveSlot;

use self::kernel::AvailableKernel;
pub use self::kernel::Kernel;
pub(crate) use self::optimisation_barrier::{align_stack, optimisation_barrier};
pub(crate) use self::packet::{MAX_RAYS, PacketResult, PacketState, PacketVisitor};
pub(crate) use self::query::{HitVisitor, RaySource, TraversalQuery};
pub(crate) use self::row::{PrimitiveRow, RowKind};
pub(crate) use self::traversal_ray::{RayReparametrisation, TraversalRay};
pub(crate) use self::triangle8::LeafHeader;
use self::triangle8::Triangle8;

/// Greatest depth of a tree that the traversal stack can hold. A deeper tree is rebuilt by median
/// splits.
const MAX_DEPTH: u32 = 64;
/// Number of entries of the traversal stack. Each level leaves at most seven siblings, and the
/// eight children of a node are written at once.
const STACK_SIZE: usize = (WIDTH - 1) * MAX_DEPTH as usize + WIDTH;

/// Reference to a child of a node: an inner node, a block of triangles, a row of spheres, or the
/// position of any other primitive in the tree's order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(transparent)]
struct ChildRef(u32);

impl ChildRef {
    /// Kinds of children, in the bits above the index: inner node, block of triangles, single
    /// primitive, and row of spheres. The index has fewer than 2²⁷ values, the greatest number of
    /// primitives.
    const INNER: u32 = 0;
    const BLOCK: u32 = 0b100 << 29;
    const OTHER: u32 = 0b110 << 29;
    const ROW: u32 = 0b111 << 29;
    /// Reference to no child, which counts as an empty leaf.
    const NONE: Self = Self(u32::MAX);

    fn new(kind: u32, index: usize) -> Self {
        Self(kind | index as u32)
    }

    #[inline(always)]
    fn is_leaf(self) -> bool {
        self.0 & Self::BLOCK != 0
    }

    #[inline(always)]
    fn is_triangle_block(self) -> bool {
        self.0 & (Self::OTHER ^ Self::BLOCK) == 0
    }

    /// Whether a leaf is a row of spheres. Valid only for a leaf that is neither empty nor a block.
    #[inline(always)]
    fn is_sphere_row(self) -> bool {
        self.0 & (Self::ROW ^ Self::OTHER) != 0
    }

    /// Returns the reference after the arrays of its tree were appended to those of another tree:
    /// its index grows by the number of nodes, blocks, positions or rows in front.
    fn offset_index_by(self, [nodes, blocks, places, rows]: [u32; 4]) -> Self {
        let by = match self {
            Self::NONE => 0,
            child if !child.is_leaf() => nodes,
            child if child.is_triangle_block() => blocks,
            child if child.is_sphere_row() => rows,
            _ => places,
        };
        Self(self.0 + by)
    }

    /// Node index of an inner child.
    #[inline(always)]
    fn node_index(self) -> usize {
        self.0 as usize
    }

    /// Returns the index of a leaf's block or row, or the position of its single primitive.
    #[inline(always)]
    fn leaf_index(self) -> usize {
        (self.0 & !Self::ROW) as usize
    }
}

/// A node with up to eight children and their boxes. Each axis has the eight minima first, then the
/// maxima, so that a single offset selects the near or the far planes. An absent child has an
/// inverted box, which no finite ray enters.
#[repr(C, align(64))]
#[derive(Clone, Debug)]
struct Bvh8Node {
    planes: [[f32; 2 * WIDTH]; 3],
    children: [ChildRef; WIDTH],
}

impl Bvh8Node {
    const EMPTY: Self = {
        let mut planes = [[f32::INFINITY; 2 * WIDTH]; 3];
        let mut index = 0;
        while index < 3 * WIDTH {
            planes[index / WIDTH][WIDTH + index % WIDTH] = f32::NEG_INFINITY;
            index += 1;
        }
        Self {
            planes,
            children: [ChildRef::NONE; WIDTH],
        }
    };

    fn set_child(&mut self, lane: usize, bounds: &PaddedBox, child: ChildRef) {
        for axis in 0..3 {
            self.planes[axis][lane] = bounds.min[axis];
            self.planes[axis][WIDTH + lane] = bounds.max[axis];
        }
        self.children[lane] = child;
    }
}

/// A bounding-volume hierarchy with eight-wide nodes over primitives, and the storage of its
/// triangles.
#[derive(Clone, Debug, Default)]
pub(crate) struct Bvh8 {
    /// Nodes, the root first; empty if every query tests every primitive.
    nodes: Vec<Bvh8Node>,
    /// Blocks of up to eight triangles.
    blocks: Vec<Triangle8>,
    /// Header of each block: slots, lanes in use, and visibilities of its triangles.
    leaf_headers: Vec<LeafHeader>,
    /// Rows of up to eight spheres or planes: first `always_row_count` rows that every query tests,
    /// then the rows of leaves.
    rows: Vec<PrimitiveRow>,
    always_row_count: usize,
    /// In a structure without nodes, the positions of the primitives that are in no row and no
    /// block.
    single_positions: Range<usize>,
    kernel: AvailableKernel,
}

impl Bvh8 {
    /// Moves triangles into the blocks. `triangle_of` returns the triangle and the visibility of a
    /// slot. The slots from `first` on are in leaf order. Afterwards the index of a triangle's slot
    /// is its number in [`Bvh8::triangle`].
    pub fn fill_triangle_blocks(
        &mut self,
        slots: &mut [PrimitiveSlot],
        first: usize,
        triangle_of: impl Fn(&PrimitiveSlot) -> (Triangle<f32>, Visibility) + Sync,
    ) {
        let blocks = self
            .blocks
            .par_iter_mut()
            .zip(&mut self.leaf_headers)
            .with_min_len(512);
        blocks.for_each(|(block, leaf_header)| {
            leaf_header.first += first as u32;
            for lane in 0..usize::from(leaf_header.count) {
                let (triangle, visibility) = triangle_of(&slots[leaf_header.first as usize + lane]);
                block.set_triangle(lane, triangle.vertices);
                leaf_header.set_visibility(lane, visibility);
            }
        });
        // Done last, since the loop above reads the old index of each slot.
        for (number, leaf_header) in self.leaf_headers.iter().enumerate() {
            for lane in 0..usize::from(leaf_header.count) {
                slots[leaf_header.first as usize + lane].index = (number * WIDTH + lane) as u32;
            }
        }
    }

    /// Fills the rows of leaves. `row` builds a row from the slots in a range. The tree's first
    /// slot is `first`.
    pub fn fill_sphere_leaves(&mut self, first: usize, row: impl Fn(Range<usize>) -> PrimitiveRow) {
        for own in &mut self.rows[self.always_row_count..] {
            let start = first + own.leaf_header.first as usize;
            *own = row(start..start + usize::from(own.leaf_header.count));
        }
    }

    /// Creates a structure without nodes: rows of spheres, blocks of triangles, then other
    /// primitives, in this order of positions. Its rows and blocks are still empty.
    pub fn new_without_nodes(spheres: usize, triangles: usize, others: usize) -> Self {
        let end = spheres + triangles;
        let block = |first: usize| LeafHeader::new(first, (end - first).min(WIDTH));
        let leaf_headers: Vec<LeafHeader> = (spheres..end).step_by(WIDTH).map(block).collect();
        Self {
            blocks: vec![Triangle8::EMPTY; leaf_headers.len()],
            leaf_headers,
            single_positions: end..end + others,
            ..Self::default()
        }
    }

    /// Adds rows that every query tests before it traverses the tree.
    pub fn add_always_tested_primitive_rows(
        &mut self,
        rows: impl IntoIterator<Item = PrimitiveRow>,
    ) {
        let before = self.rows.len();
        self.rows
            .splice(self.always_row_count..self.always_row_count, rows);
        self.always_row_count += self.rows.len() - before;
    }

    /// Whether the tree stores triangles in blocks.
    #[inline(always)]
    pub fn has_triangle_blocks(&self) -> bool {
        !self.blocks.is_empty()
    }

    /// Returns the triangle with the given number: eight times its block's index, plus its lane.
    #[inline]
    pub fn triangle(&self, number: u32) -> Triangle<f32> {
        self.blocks[number as usize / WIDTH].triangle(number as usize % WIDTH)
    }

    /// Returns the selected kernel.
    pub fn kernel(&self) -> Kernel {
        match self.kernel {
            AvailableKernel::Portable(_) => Kernel::Portable,
            AvailableKernel::Avx2(_) => Kernel::Avx2,
            AvailableKernel::Avx512(_) => Kernel::Avx512,
        }
    }

    /// Selects a kernel; the portable kernel if the processor can't run `kernel`.
    pub fn set_kernel(&mut self, kernel: Kernel) {
        self.kernel = AvailableKernel::new(kernel).unwrap_or(AvailableKernel::Portable(Portable));
    }

    /// Memory of nodes, blocks and rows, in bytes.
    pub fn memory_bytes(&self) -> usize {
        size_of_val(self.nodes.as_slice())
            + size_of_val(self.blocks.as_slice())
            + size_of_val(self.leaf_headers.as_slice())
            + size_of_val(self.rows.as_slice())
    }

    /// Bytes of a structure without nodes: full rows for `spheres` spheres or planes, and full
    /// blocks for `triangles` triangles.
    pub fn memory_bytes_without_nodes(spheres: u64, triangles: u64) -> u64 {
        let eights =
            |count: u64, bytes: usize| count.div_ceil(WIDTH as u64).saturating_mul(bytes as u64);
        let blocks = eights(triangles, size_of::<Triangle8>() + size_of::<LeafHeader>());
        eights(spheres, size_of::<PrimitiveRow>()).saturating_add(blocks)
    }

    /// Upper bound of the bytes of a tree over the given numbers of spheres, triangles and other
    /// primitives.
    ///
    /// A node with an unused lane has only leaves, since the collapse would otherwise have replaced
    /// an inner child by its children. Let t be the number of nodes, and f the number of nodes with
    /// an inner child. These f nodes are full, so they have 8f − (t − 1) leaves. Every node without
    /// an inner child has at least nine triangles, or another primitive and one more lane. So t ≤
    /// n/7 + 1 for n triangles, t ≤ (4m + 3)/7 for m other primitives, and t ≤ n/7 + m + 1 for
    /// both. A block of fewer than three triangles is either the only block of its node, which then
    /// has seven inner children, or beside blocks that its triangles do not fit into. So there are
    /// at most n/3 + n/49 blocks, plus one for each other primitive that may stand between them.
    pub fn max_tree_bytes([spheres, triangles, others]: [u64; 3]) -> u64 {
        let few = |count: u64| count.saturating_mul(4).saturating_add(3) / 7;
        let all = [triangles, spheres, others]
            .into_iter()
            .fold(0, u64::saturating_add);
        // The larger count has the role of the triangles in the proof above.
        let maximum = triangles.max(spheres);
        let nodes = if maximum == 0 {
            few(others)
        } else {
            (maximum / 7)
                .saturating_add(all - maximum)
                .saturating_add(1)
        };
        // Among primitives of other kinds, few rows of spheres are full.
        let leaves = (spheres / 2).min(
            (spheres / 5)
                .saturating_mul(2)
                .saturating_add(all - spheres)
                .saturating_add(2),
        );
        let leaves = leaves.saturating_mul(size_of::<PrimitiveRow>() as u64);
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
            .saturating_add(nodes.saturating_mul(size_of::<Bvh8Node>() as u64))
            .saturating_add(leaves)
    }
}
