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
    /// Returns the leaf kind of a primitive. Cuboids share no leaves: the node test already
    /// intersects eight of their boxes at once, and a ray that hits a cuboid's box nearly always
    /// hits the cuboid.
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
    /// records), so that primitives tested in sequence are adjacent in memory. Does nothing for
    /// triangles that were moved to blocks.
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

    /// Moves the triangles into the tree's blocks of eight, if the tree has blocks, which then hold
    /// the only copy. The slots (the primitives' records) from `first` on are in the tree's order.
    pub(crate) fn move_triangles_to_blocks(&mut self, bvh: &mut Bvh8, first: usize) {
        if !bvh.has_triangle_blocks() {
            return;
        }
        let triangles = take(&mut self.triangles);
        bvh.fill_triangle_blocks(&mut self.slots, first, |slot| {
            let triangle = triangles[slot.index as usize];
            (
                Triangle {
                    vertices: triangle.vertices.map(Vector::to_f32),
                },
                slot.visibility,
            )
        });
    }

    /// Builds the rows of up to eight planes or spheres. Every query tests the rows of the first
    /// `planes` slots (the primitives' records), and of the `spheres` slots from `first` on. The
    /// other spheres fill the rows of the tree's leaves. The slots from `first` on are in the
    /// tree's order, spheres first.
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
            bvh.add_always_tested_primitive_rows(
                firsts.map(|first| self.build_row(kind, first..slots.end.min(first + WIDTH))),
            );
        }
        bvh.fill_sphere_leaves(first, |slots| self.build_row(RowKind::Spheres, slots));
    }

    /// Builds the row of up to eight spheres or planes in the given slots.
    fn build_row(&self, kind: RowKind, slots: Range<usize>) -> PrimitiveRow {
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
