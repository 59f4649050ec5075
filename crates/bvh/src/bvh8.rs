//! The tree for primitives stored in f32. Its nodes have eight children. Its leaves are blocks of
//! up to eight triangles, rows of up to eight spheres, and other primitives that are tested one by
//! one. The traversal uses the widest SIMD registers of the processor.
//!
//! Nodes and filters only decide which primitives are tested, never which are hit. Boxes are
//! padded, and exit distances are increased. The filter rejects a triangle only if its error bounds
//! prove that the exact test rejects it ([`filter`]). Every remaining triangle goes through the
//! operations of the exact test ([`crate::shapes::Triangle`]). So every kernel finds the hits of a
//! linear scan, to the bit.
//!
//! One case needs care: a triangle that is edge-on to within f64 rounding. The weighted mean of its
//! corners' distances could lie outside its box, and the hit would depend on the order of
//! traversal. So in this case the exact test uses the distance of the ray's crossing with an edge,
//! in a scan as in a tree ([`crate::shapes::EDGE_ON_RATIO`]).

mod collapse;
mod filter;
mod kernel;
mod leaf;
mod optimisation_barrier;
mod packet;
mod projected_ray;
mod query;
mod row;
mod small_sets;
mod stack;
mod traversal_ray;
mod traversal_simd;
mod traverse;
mod triangle8;
#[cfg(target_arch = "x86_64")]
mod x86;

use core::ops::Range;
use rayon::prelude::*;

use crate::aabb::{Aabb, PaddedBox};
use crate::math::simd::Portable;
pub(crate) use crate::math::simd::{MaskLanes, WIDTH};
use crate::memory::huge_page_vec;
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

/// Greatest depth of a tree for which the traversal stack suffices. A deeper tree is rebuilt by
/// median splits.
const MAX_DEPTH: u32 = 64;
/// Number of entries of the traversal stack. Each level of the tree leaves at most seven siblings
/// on the stack. A node first writes all its eight children.
const STACK_SIZE: usize = (WIDTH - 1) * MAX_DEPTH as usize + WIDTH;

/// Reference to a child of a node, as a kind and an index. The child is an inner node, a block of
/// triangles, a row of spheres, or another primitive at a position in leaf order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(transparent)]
struct ChildRef(u32);

impl ChildRef {
    /// Kinds of children, stored in the bits above the index: inner node, block of triangles,
    /// single primitive, and row of spheres. The index has 27 bits, enough for the greatest number
    /// of primitives.
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

    /// Whether this leaf is a row of spheres, not a single primitive. Other references give a wrong
    /// result.
    #[inline(always)]
    fn is_sphere_row(self) -> bool {
        self.0 & (Self::ROW ^ Self::OTHER) != 0
    }

    /// Returns the reference after its tree was appended to another tree. The four numbers are the
    /// lengths of that tree's arrays. The index increases by the length of the array to which it
    /// refers.
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

    /// Index of the node to which this reference of an inner child refers.
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

/// A node with up to eight children and their boxes. For each axis, `planes` has the eight minima,
/// then the eight maxima. So one offset selects the planes through which a ray enters. An absent
/// child has an inverted box, which no finite ray enters.
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

/// A bounding-volume hierarchy with eight-wide nodes. It also stores the triangles and spheres of
/// its leaves.
#[derive(Clone, Debug, Default)]
pub(crate) struct Bvh8 {
    /// Nodes, the root first. Empty in a structure whose primitives are all tested by every query.
    nodes: Vec<Bvh8Node>,
    /// Blocks of up to eight triangles.
    blocks: Vec<Triangle8>,
    /// Header of each block, with the slots (the records in the set) and visibilities of its
    /// triangles.
    leaf_headers: Vec<LeafHeader>,
    /// Rows of up to eight spheres or planes. Every query tests the first `always_row_count` rows.
    /// The others are leaves of the tree.
    rows: Vec<PrimitiveRow>,
    always_row_count: usize,
    /// In a structure without nodes, positions of the primitives that are tested one by one: those
    /// in no row and no block.
    single_positions: Range<usize>,
    kernel: AvailableKernel,
}

impl Bvh8 {
    /// Makes the blocks of triangles from a set. `triangle_of` returns the triangle and the
    /// visibility of a slot (the record of a primitive). The slots from `first` on must be in leaf
    /// order. The `index` of each triangle's slot becomes its number for [`Bvh8::triangle`].
    pub fn make_triangle_blocks(
        &mut self,
        slots: &mut [PrimitiveSlot],
        first: usize,
        triangle_of: impl Fn(&PrimitiveSlot) -> (Triangle<f32>, Visibility) + Sync,
    ) {
        let fill = |leaf_header: &mut LeafHeader| {
            let mut block = Triangle8::EMPTY;
            leaf_header.first += first as u32;
            for lane in 0..usize::from(leaf_header.count) {
                let (triangle, visibility) = triangle_of(&slots[leaf_header.first as usize + lane]);
                block.set_triangle(lane, triangle.vertices);
                leaf_header.set_visibility(lane, visibility);
            }
            block
        };
        self.blocks = huge_page_vec(self.leaf_headers.len());
        let leaf_headers = self.leaf_headers.par_iter_mut().with_min_len(512);
        self.blocks.par_extend(leaf_headers.map(fill));
        // Done last, since the loop above reads the old index of each slot.
        for (number, leaf_header) in self.leaf_headers.iter().enumerate() {
            for lane in 0..usize::from(leaf_header.count) {
                slots[leaf_header.first as usize + lane].index = (number * WIDTH + lane) as u32;
            }
        }
    }

    /// Fills the rows of the tree's leaves. `row` builds a row from a range of slot indices.
    /// `first` is the slot index of the tree's first primitive.
    pub fn fill_sphere_leaves(&mut self, first: usize, row: impl Fn(Range<usize>) -> PrimitiveRow) {
        for own in &mut self.rows[self.always_row_count..] {
            let start = first + own.leaf_header.first as usize;
            *own = row(start..start + usize::from(own.leaf_header.count));
        }
    }

    /// Creates a structure without nodes. The leaf order of its primitives is: spheres, triangles,
    /// others. Its blocks and its rows are not created yet.
    pub fn new_without_nodes(spheres: usize, triangles: usize, others: usize) -> Self {
        let end = spheres + triangles;
        let block = |first: usize| LeafHeader::new(first, (end - first).min(WIDTH));
        let leaf_headers: Vec<LeafHeader> = (spheres..end).step_by(WIDTH).map(block).collect();
        Self {
            leaf_headers,
            single_positions: end..end + others,
            ..Self::default()
        }
    }

    /// Adds rows that every query tests before it traverses the tree.
    pub fn add_unculled_rows(&mut self, rows: impl IntoIterator<Item = PrimitiveRow>) {
        let before = self.rows.len();
        self.rows
            .splice(self.always_row_count..self.always_row_count, rows);
        self.always_row_count += self.rows.len() - before;
    }

    /// Whether leaves refer to blocks of triangles, which may not be made yet.
    pub fn has_triangle_leaves(&self) -> bool {
        !self.leaf_headers.is_empty()
    }

    /// Whether the structure stores triangles in blocks.
    #[inline(always)]
    pub fn has_triangle_blocks(&self) -> bool {
        !self.blocks.is_empty()
    }

    /// Returns the triangle with a given number: eight times the index of its block, plus its lane.
    #[inline]
    pub fn triangle(&self, number: u32) -> Triangle<f32> {
        self.blocks[number as usize / WIDTH].triangle(number as usize % WIDTH)
    }

    /// Returns the corners of the block that holds the triangle with a given number, as
    /// `corners[axis][corner][lane]`, and the triangle's lane.
    #[inline(always)]
    pub fn block_corners(&self, number: u32) -> (&[[[f32; WIDTH]; 3]; 3], usize) {
        let number = number as usize;
        (&self.blocks[number / WIDTH].corners, number % WIDTH)
    }

    /// Calls `visit` with the slots of each leaf that may meet a box, until it returns true. Returns
    /// whether it did; `None` in a structure without nodes. `first` is the slot of the first position.
    pub fn visit_leaves_in_box(
        &self,
        bounds: &Aabb,
        first: usize,
        visit: &mut impl FnMut(Range<usize>) -> bool,
    ) -> Option<bool> {
        let mut open = vec![ChildRef(0)];
        self.nodes.first()?;
        while let Some(child) = open.pop() {
            let (index, header) = (child.leaf_index(), LeafHeader::default());
            let header = match child {
                _ if !child.is_leaf() => {
                    let node = &self.nodes[child.node_index()];
                    open.extend((0..WIDTH).filter_map(|lane| {
                        let meets = (0..3).all(|axis| {
                            f64::from(node.planes[axis][lane]) <= bounds.max[axis]
                                && bounds.min[axis] <= f64::from(node.planes[axis][WIDTH + lane])
                        });
                        meets.then_some(node.children[lane])
                    }));
                    header
                }
                _ if child.is_triangle_block() => self.leaf_headers[index],
                _ if child.is_sphere_row() => self.rows[self.always_row_count + index].leaf_header,
                _ => LeafHeader::new(first + index, 1),
            };
            let start = header.first as usize;
            if header.count > 0 && visit(start..start + usize::from(header.count)) {
                return Some(true);
            }
        }
        Some(false)
    }

    /// Returns the selected kernel.
    pub fn kernel(&self) -> Kernel {
        match self.kernel {
            AvailableKernel::Portable(_) => Kernel::Portable,
            AvailableKernel::Avx2(_) => Kernel::Avx2,
            AvailableKernel::Avx512(_) => Kernel::Avx512,
        }
    }

    /// Selects a kernel. If the processor can't run it, the portable kernel is selected.
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

    /// Returns the bytes of a structure without nodes, for `spheres` spheres and planes and
    /// `triangles` triangles. Partly filled rows and blocks count as whole.
    pub fn memory_bytes_without_nodes(spheres: u64, triangles: u64) -> u64 {
        let eights =
            |count: u64, bytes: usize| count.div_ceil(WIDTH as u64).saturating_mul(bytes as u64);
        let blocks = eights(triangles, size_of::<Triangle8>() + size_of::<LeafHeader>());
        eights(spheres, size_of::<PrimitiveRow>()).saturating_add(blocks)
    }

    /// Returns an upper bound of the bytes of a tree, for given numbers of spheres, triangles and
    /// other primitives.
    ///
    /// **Nodes.** A node with an unused lane (child position) has no inner child: the collapse
    /// would have replaced that child by its children. Let t be the number of nodes, and f the
    /// number of nodes with an inner child. These f nodes have no unused lane, so they have 8f − (t
    /// − 1) leaves. A node without an inner child has at least nine triangles, or another primitive
    /// and one more lane. Let n be the number of triangles, and m that of other primitives. Then:
    ///
    /// - t ≤ n/7 + 1 for triangles alone,
    /// - t ≤ (4m + 3)/7 for other primitives alone,
    /// - t ≤ n/7 + m + 1 for both.
    ///
    /// **Blocks.** A block of fewer than three triangles has one of two reasons. It is the only
    /// block of its node, whose seven other children are inner nodes. Or the other blocks of its
    /// node have no room for its triangles. So at most n/3 + n/49 blocks exist, plus one for each
    /// other primitive between triangles.
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
