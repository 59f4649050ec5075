//! Preparation of a primitive set for its tree: the leaf kind of each primitive, the data of the
//! leaves, and arrays sorted in the tree's order.

use core::mem::take;
use core::ops::Range;

use super::PrimitiveSet;
use crate::build::LeafKind;
use crate::bvh8::{Bvh8, PrimitiveRow, RowKind, WIDTH};
use crate::scalar::{Real, Vector};
use crate::shapes::{AnyShape, Triangle};
use crate::slot::{PrimitiveKind, PrimitiveSlot};

impl<R: Real> PrimitiveSet<R> {
    /// Returns the leaf kind of a primitive. Cuboids share no leaves. The test of a node already
    /// tests eight of their boxes at once, and a ray that hits a cuboid's box nearly always hits
    /// the cuboid.
    pub(crate) fn leaf_kind(&self, slot: &PrimitiveSlot) -> LeafKind {
        match slot.kind {
            // Leaves in lanes exist only for primitives stored in f32.
            _ if !R::IS_SINGLE => LeafKind::None,
            PrimitiveKind::Triangle => LeafKind::Triangles,
            PrimitiveKind::Sphere => LeafKind::Spheres,
            _ => LeafKind::None,
        }
    }

    /// Whether the set has triangles or quads, whose tests project corners onto the plane
    /// perpendicular to the ray.
    pub(crate) fn has_triangles_or_quads(&self) -> bool {
        let is_face =
            |shape: &AnyShape<R>| matches!(shape, AnyShape::Quad(_) | AnyShape::Triangle(_));
        !self.triangles.is_empty()
            || self.shapes.iter().any(is_face)
            || self.transformed_shapes.iter().any(|p| is_face(p.shape()))
    }

    /// Sorts the arrays of spheres and triangles in the order of the slots (the primitives'
    /// records). So primitives that are tested in sequence are adjacent in memory. Triangles that
    /// were moved to a tree's blocks are not sorted.
    pub(crate) fn sort_primitives_by_slot(&mut self) {
        fn sort_list_by_slot<T: Copy>(
            list: &mut Vec<T>,
            slots: &mut [PrimitiveSlot],
            kind: PrimitiveKind,
        ) {
            let before = take(list);
            list.reserve_exact(before.len());
            for slot in slots
                .iter_mut()
                .filter(|slot| slot.kind == kind && !before.is_empty())
            {
                list.push(before[slot.index as usize]);
                slot.index = list.len() as u32 - 1;
            }
        }
        sort_list_by_slot(&mut self.spheres, &mut self.slots, PrimitiveKind::Sphere);
        sort_list_by_slot(
            &mut self.triangles,
            &mut self.slots,
            PrimitiveKind::Triangle,
        );
    }

    /// Moves all triangles into the blocks of the tree, if the tree has blocks. The blocks then
    /// hold the only copy. The slots (the primitives' records) from `first` on must be in the
    /// tree's order.
    pub(crate) fn move_triangles_to_blocks(&mut self, bvh: &mut Bvh8, first: usize) {
        if !bvh.has_triangle_leaves() {
            return;
        }
        let triangles = take(&mut self.triangles);
        bvh.make_triangle_blocks(&mut self.slots, first, |slot| {
            let triangle = triangles[slot.index as usize];
            (
                Triangle {
                    vertices: triangle.vertices.map(Vector::to_f32),
                },
                slot.visibility,
            )
        });
    }

    /// Builds all rows of up to eight planes or spheres. The slots (the primitives' records) must
    /// be in this order: `planes` planes, other unbounded primitives, and from `first` on the
    /// primitives in the tree's order.
    ///
    /// - The first `planes` slots, and the `spheres` slots from `first` on, form rows that every
    ///   query tests.
    /// - The remaining spheres fill the rows of the tree's leaves.
    pub(crate) fn build_primitive_rows(
        &self,
        bvh: &mut Bvh8,
        planes: usize,
        first: usize,
        spheres: usize,
    ) {
        for (kind, slots) in [
            (RowKind::Planes, 0..planes),
            (RowKind::Spheres, first..first + spheres),
        ] {
            let firsts = slots.clone().step_by(WIDTH);
            bvh.add_unculled_rows(
                firsts.map(|first| self.build_leaf_row(kind, first..slots.end.min(first + WIDTH))),
            );
        }
        bvh.fill_sphere_leaves(first, |slots| self.build_leaf_row(RowKind::Spheres, slots));
    }

    /// Builds the row of the spheres or planes (by `kind`) in up to eight slots.
    fn build_leaf_row(&self, kind: RowKind, slots: Range<usize>) -> PrimitiveRow {
        let own = |slot: &PrimitiveSlot| {
            let index = slot.index as usize;
            let numbers = match kind {
                RowKind::Spheres => [
                    self.spheres[index].centre,
                    R::Vec3::splat(self.spheres[index].radius),
                ],
                RowKind::Planes => [self.planes[index].point, self.planes[index].normal],
            };
            (numbers.map(Vector::to_f32), slot.visibility)
        };
        PrimitiveRow::new(kind, slots.start, self.slots[slots].iter().map(own))
    }
}
