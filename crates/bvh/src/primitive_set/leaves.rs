//! What a tree makes of a set: which primitives share its leaves, the leaves filled, and the arrays
//! in its order.

use core::mem::take;
use core::ops::Range;

use super::PrimitiveSet;
use crate::build::LeafKind;
use crate::bvh8::{Bvh8, Row, RowKind, WIDTH};
use crate::scalar::{Real, Vector};
use crate::shapes::{AnyShape, Triangle};
use crate::slot::{Kind, Slot};

impl<R: Real> PrimitiveSet<R> {
    /// What a primitive may share a leaf with. A box does not gain by it: the lanes of a node test
    /// eight already, by the boxes' own faces, and what is left of those is nearly always hit.
    pub(crate) fn company(&self, slot: &Slot) -> LeafKind {
        match slot.kind {
            // The lanes of leaves are f32.
            _ if !R::IS_SINGLE => LeafKind::None,
            Kind::Triangle => LeafKind::Triangles,
            Kind::Sphere => LeafKind::Spheres,
            _ => LeafKind::None,
        }
    }

    /// Whether there is a face whose test asks for the plane across the ray.
    pub(crate) fn has_faces(&self) -> bool {
        let is_face =
            |shape: &AnyShape<R>| matches!(shape, AnyShape::Quad(_) | AnyShape::Triangle(_));
        !self.triangles.is_empty()
            || self.shapes.iter().any(is_face)
            || self.placed.iter().any(|p| is_face(p.shape()))
    }

    /// Puts the primitives that come in great numbers into the order of the slots, so that what is
    /// tested one after the other lies side by side; triangles that blocks have taken are left out.
    pub(crate) fn follow(&mut self) {
        fn follow<T: Copy>(list: &mut Vec<T>, slots: &mut [Slot], kind: Kind) {
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
        follow(&mut self.spheres, &mut self.slots, Kind::Sphere);
        follow(&mut self.triangles, &mut self.slots, Kind::Triangle);
    }

    /// Gives the triangles to the blocks of the tree, where it has some, which keeps the only copy.
    /// The slots from `first` on are in its order.
    pub(crate) fn move_triangles(&mut self, bvh: &mut Bvh8, first: usize) {
        if !bvh.has_blocks() {
            return;
        }
        let triangles = take(&mut self.triangles);
        bvh.fill(&mut self.slots, first, |slot| {
            let triangle = triangles[slot.index as usize];
            (
                Triangle {
                    vertices: triangle.vertices.map(Vector::to_f32),
                },
                slot.visibility,
            )
        });
    }

    /// Lets every query test the first slots, which are planes, and those of some spheres, in rows,
    /// and puts the spheres that share leaves of the tree there. The slots from `first` on are in
    /// its order, the spheres first.
    pub(crate) fn make_rows(&self, bvh: &mut Bvh8, planes: usize, first: usize, spheres: usize) {
        for (kind, slots) in [
            (RowKind::Planes, 0..planes),
            (RowKind::Spheres, first..first + spheres),
        ] {
            let firsts = slots.clone().step_by(WIDTH);
            bvh.test_always(
                firsts.map(|first| self.row(kind, first..slots.end.min(first + WIDTH))),
            );
        }
        bvh.fill_rows(first, |slots| self.row(RowKind::Spheres, slots));
    }

    fn row(&self, kind: RowKind, slots: Range<usize>) -> Row {
        let own = |slot: &Slot| {
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
        Row::new(kind, slots.start, self.slots[slots].iter().map(own))
    }
}
