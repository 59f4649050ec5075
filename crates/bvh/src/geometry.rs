//! A primitive set with its accelerator, ready for queries.
//!
//! A [`PrimitiveSet`] collects primitives; [`Geometry`] adds the accelerator. An instance is a
//! primitive that places another geometry by an affine map. So a scene with repeated geometry has
//! two levels of trees, and any other scene has one level.

use core::mem::take;

use rayon::prelude::*;

use crate::aabb::{Aabb, BoundingSphere, PaddedBox, TASK_SIZE};
use crate::build::{AcceleratorKind, BoxTree, BuildWork, StopCheck, build_box_tree};
use crate::bvh8::{Bvh8, Kernel};
use crate::memory::{filled_huge_page_vec, huge_page_vec};
use crate::primitive_set::{PrimitiveSet, max_linear_scan_size};
use crate::scalar::{Real, Vector};
use crate::shapes::Triangle;
use crate::slot::{PrimitiveKind, PrimitiveSlot};

/// A primitive set with its accelerator, for queries by rays.
#[derive(Clone, Debug)]
#[doc(alias("RTCScene", "BVHAggregate", "Aggregate"))]
pub struct Geometry<R: Real> {
    /// The primitives. Their slots (the records of the primitives) are sorted into three groups:
    ///
    /// - unbounded primitives, which every query tests;
    /// - bounded primitives, in the accelerator's order;
    /// - instances of empty geometries, which no query tests.
    pub(crate) primitives: PrimitiveSet<R>,
    /// Number of unbounded primitives. Their slots come first.
    pub(crate) unbounded: usize,
    /// Number of planes that are tested in rows of eight. Their slots come first among the
    /// unbounded primitives.
    pub(crate) planes: usize,
    /// Accelerator over the bounded primitives. For a linear scan it has no nodes.
    pub(crate) bvh: Bvh8,
    /// Cost of the build; `None` for a linear scan.
    work: Option<BuildWork>,
    /// Whether the set has triangles or quads, whose tests project corners onto the plane
    /// perpendicular to the ray.
    pub(crate) has_faces: bool,
    /// Union of the boxes of the bounded primitives, before padding.
    bounds: Aabb,
    /// Bounding sphere of the bounded primitives.
    pub(crate) sphere: BoundingSphere,
}

/// Slots of the primitives, divided by how queries test the primitive.
struct PrimitivePartition {
    /// Slots of unbounded primitives, which every query tests.
    unbounded: Vec<PrimitiveSlot>,
    bounded: Vec<PrimitiveSlot>,
    /// Slots of instances of empty geometries, which no query tests.
    untested: Vec<PrimitiveSlot>,
    /// Box of each slot in `bounded`.
    boxes: Vec<PaddedBox>,
    /// Union of the boxes of the bounded primitives, before padding.
    bounds: Aabb,
}

impl PrimitivePartition {
    /// Divides the slots of a set into bounded, unbounded and untested ones, and computes the
    /// boxes. An instance of an empty geometry is untested. A primitive whose box no tree can hold
    /// counts as unbounded, so every query tests it and it does not disappear silently.
    fn new<R: Real>(group: &mut PrimitiveSet<R>) -> Self {
        let all = take(&mut group.slots);
        let mut boxes = filled_huge_page_vec(all.len(), PaddedBox::EMPTY);
        let within = |slot: &PrimitiveSlot, own_bounds: Aabb| match slot.kind {
            PrimitiveKind::Instance => {
                let instance = &group.instances[slot.index as usize];
                instance.tighten_bounds(own_bounds, &group.parts[instance.part as usize].sphere)
            }
            _ => own_bounds,
        };
        let piece = |(boxes, slots): (&mut [PaddedBox], &[PrimitiveSlot])| {
            let (mut bounds, mut odd) = (Aabb::EMPTY, false);
            for (padded, slot) in boxes.iter_mut().zip(slots) {
                match group
                    .bounds(slot)
                    .map(|own_bounds| (own_bounds, within(slot, own_bounds).to_padded()))
                {
                    Some((own_bounds, Some(own_padded))) => {
                        // No ray hits a primitive without area.
                        if own_bounds.has_area() {
                            bounds = bounds.union(own_bounds);
                        }
                        *padded = own_padded;
                    }
                    _ => odd = true,
                }
            }
            (bounds, odd)
        };
        let pieces: Vec<_> = boxes
            .par_chunks_mut(TASK_SIZE)
            .zip(all.par_chunks(TASK_SIZE))
            .map(piece)
            .collect();
        let bounds = pieces
            .iter()
            .fold(Aabb::EMPTY, |bounds, piece| bounds.union(piece.0));
        if !pieces.iter().any(|piece| piece.1) {
            return Self {
                unbounded: Vec::new(),
                bounded: all,
                untested: Vec::new(),
                boxes,
                bounds,
            };
        }
        let (mut slots, mut bounded, mut nothing): (
            Vec<PrimitiveSlot>,
            Vec<PrimitiveSlot>,
            Vec<PrimitiveSlot>,
        ) = Default::default();
        for (slot, padded) in all.into_iter().zip(&boxes) {
            if *padded != PaddedBox::EMPTY {
                bounded.push(slot);
            } else if group
                .bounds(&slot)
                .is_some_and(|own_bounds| own_bounds.is_empty())
            {
                nothing.push(slot);
            } else {
                slots.push(slot);
            }
        }
        boxes.retain(|padded| *padded != PaddedBox::EMPTY);
        Self {
            unbounded: slots,
            bounded,
            untested: nothing,
            boxes,
            bounds,
        }
    }
}

/// Returns the numbers of spheres, triangles and other primitives, if the set is so small that
/// nodes would cost more than they save; otherwise `None`. A set of at most `few` primitives is
/// always small. For primitives stored in f64, all count as other primitives.
fn count_primitives_of_small_set<R: Real>(
    bounded: &[PrimitiveSlot],
    few: usize,
) -> Option<[usize; 3]> {
    let is_few = bounded.len() <= few;
    if !R::IS_SINGLE || bounded.len() > few.max(Bvh8::MAX_WITHOUT_NODES) {
        return is_few.then_some([0, 0, bounded.len()]);
    }
    let count = |kind: PrimitiveKind| bounded.iter().filter(|slot| slot.kind == kind).count();
    let (spheres, triangles) = (count(PrimitiveKind::Sphere), count(PrimitiveKind::Triangle));
    let others = bounded.len() - spheres - triangles;
    let is_flat = Bvh8::prefers_no_nodes(spheres as u64, triangles as u64, others as u64);
    (is_few || is_flat).then_some([spheres, triangles, others])
}

/// Builds the accelerator over the bounded primitives; `None` if `stop` cancelled the build. In a
/// set too small for nodes, the slots in `bounded` are sorted by kind instead: spheres, triangles,
/// others. `few` is the parameter of [`count_primitives_of_small_set`].
fn build_accelerator<R: Real>(
    group: &PrimitiveSet<R>,
    kind: AcceleratorKind,
    bounded: &mut [PrimitiveSlot],
    few: usize,
    boxes: &[PaddedBox],
    stop: StopCheck<'_>,
) -> Option<BoxTree> {
    let AcceleratorKind::Tree(quality) = kind else {
        return Some(BoxTree::new_linear_scan(boxes.len(), None));
    };
    if let Some([spheres, triangles, others]) = count_primitives_of_small_set::<R>(bounded, few) {
        if spheres + triangles > 0 {
            let place = |kind: PrimitiveKind| {
                [PrimitiveKind::Sphere, PrimitiveKind::Triangle]
                    .iter()
                    .position(|&first| first == kind)
            };
            bounded.sort_by_key(|slot| place(slot.kind).unwrap_or(2));
        }
        let bvh = Bvh8::new_without_nodes(spheres, triangles, others);
        return Some(BoxTree {
            bvh,
            order: None,
            work: Some(BuildWork::default()),
            spheres,
        });
    }
    let bounded = &*bounded;
    build_box_tree(
        boxes,
        quality,
        &|index| group.leaf_kind(&bounded[index as usize]),
        stop,
    )
}

impl<R: Real> Geometry<R> {
    /// Builds the accelerator of a primitive set. The build can't fail, since every primitive was
    /// checked when it was added.
    ///
    /// # Panics
    /// Never: nothing cancels the build.
    pub fn new(group: PrimitiveSet<R>, kind: AcceleratorKind) -> Self {
        Self::build_cancellable(group, kind, &|| false).expect("nothing cancels the build")
    }

    /// Builds the accelerator as [`Self::new`]; `None` if `stop` returned true and so cancelled the
    /// build. Any thread of the pool may call `stop`, between two passes of the build. A pass over
    /// at most a quarter of a million boxes is not interrupted.
    pub fn build_cancellable(
        mut group: PrimitiveSet<R>,
        kind: AcceleratorKind,
        stop: StopCheck<'_>,
    ) -> Option<Self> {
        let PrimitivePartition {
            unbounded: mut slots,
            mut bounded,
            untested: mut nothing,
            boxes,
            bounds,
        } = PrimitivePartition::new(&mut group);
        let unbounded = slots.len();
        let few = max_linear_scan_size(
            unbounded + bounded.len() + nothing.len() == group.spheres.len() + group.planes.len(),
        );
        let BoxTree {
            mut bvh,
            order,
            work,
            spheres,
        } = build_accelerator(&group, kind, &mut bounded, few, &boxes, stop)?;
        let sphere = BoundingSphere::new(bounds.centre(), &boxes);
        drop(boxes);
        let has_lanes = R::IS_SINGLE && kind != AcceleratorKind::Linear;
        let is_plane = |slot: &PrimitiveSlot| has_lanes && slot.kind == PrimitiveKind::Plane;
        slots.sort_by_key(|slot| !is_plane(slot));
        let planes = slots.partition_point(is_plane);
        let mut firsts = slots;
        let mut slots = huge_page_vec(unbounded + bounded.len() + nothing.len());
        slots.append(&mut firsts);
        match order {
            Some(order) => slots.par_extend(
                order
                    .par_iter()
                    .with_min_len(TASK_SIZE)
                    .map(|&index| bounded[index as usize]),
            ),
            None => slots.extend_from_slice(&bounded),
        }
        drop(bounded);
        slots.append(&mut nothing);
        let faces = group.has_triangles_or_quads();
        group.slots = slots;
        if has_lanes {
            group.move_triangles_to_blocks(&mut bvh, unbounded);
            group.build_primitive_rows(&mut bvh, planes, unbounded, spheres);
        }
        group.sort_primitives_by_slot();
        Some(Self {
            has_faces: faces,
            primitives: group,
            unbounded,
            planes,
            bvh,
            work,
            bounds,
            sphere,
        })
    }

    /// Returns the box around all primitives; `None` if a primitive is unbounded.
    pub fn bounds(&self) -> Option<Aabb> {
        (self.unbounded == 0).then_some(self.bounds)
    }

    /// Returns the box around the bounded primitives that have an area; empty without any.
    pub fn bounded_primitives_box(&self) -> Aabb {
        self.bounds
    }

    /// Number of primitives; an instance counts as one.
    pub fn len(&self) -> usize {
        self.primitives.len()
    }

    /// Whether the geometry has no primitives.
    pub fn is_empty(&self) -> bool {
        self.primitives.is_empty()
    }

    /// Number of unbounded primitives, which every query tests.
    pub fn unbounded_count(&self) -> usize {
        self.unbounded
    }

    /// Number of instances.
    pub fn instance_count(&self) -> usize {
        self.primitives.instances.len()
    }

    /// Memory of the primitives and accelerators in bytes, including instanced geometries.
    pub fn memory_bytes(&self) -> usize {
        self.primitives.memory_bytes() + self.bvh.memory_bytes()
    }

    /// Returns the triangle with the given index: from the tree if the tree stores the triangles,
    /// otherwise from the set's array.
    #[inline(always)]
    pub(crate) fn triangle(&self, index: usize) -> Triangle<R> {
        if R::IS_SINGLE && self.bvh.has_triangle_blocks() {
            return Triangle {
                vertices: self
                    .bvh
                    .triangle(index as u32)
                    .vertices
                    .map(|v| Vector::from_f64(v.as_dvec3())),
            };
        }
        self.primitives.triangles[index]
    }

    /// Returns the coordinates of the corners of the triangle with the given index, as
    /// [`Self::triangle`]. Vectors of f32 would be packed in pairs and unpacked again.
    #[inline(always)]
    pub(crate) fn triangle_coordinates(&self, index: usize) -> [[R; 3]; 3] {
        if R::IS_SINGLE && self.bvh.has_triangle_blocks() {
            let (corners, lane) = self.bvh.block_corners(index as u32);
            let corner = |c: usize| {
                [
                    R::from_f32(corners[0][c][lane]),
                    R::from_f32(corners[1][c][lane]),
                    R::from_f32(corners[2][c][lane]),
                ]
            };
            return [corner(0), corner(1), corner(2)];
        }
        let [a, b, c] = self.primitives.triangles[index].vertices;
        [
            [a.x(), a.y(), a.z()],
            [b.x(), b.y(), b.z()],
            [c.x(), c.y(), c.z()],
        ]
    }

    /// Returns the tree if SIMD kernels can traverse it; `None` for a linear scan and for
    /// primitives stored in f64.
    #[inline(always)]
    pub(crate) fn simd_tree(&self) -> Option<&Bvh8> {
        (R::IS_SINGLE && self.bvh.single_primitive_positions().is_none()).then_some(&self.bvh)
    }

    /// Returns the kernel that traverses the tree; `None` for a linear scan.
    pub fn kernel(&self) -> Option<Kernel> {
        self.work.map(|_| self.bvh.kernel())
    }

    /// Selects the kernel of this geometry and of its instanced geometries, for comparisons. Hits
    /// do not depend on the kernel. If the processor can't run `kernel`, [`Kernel::Portable`] is
    /// selected.
    pub fn set_kernel(&mut self, kernel: Kernel) {
        self.bvh.set_kernel(kernel);
        self.primitives
            .parts
            .iter_mut()
            .for_each(|part| part.set_kernel(kernel));
    }

    /// Returns the cost of building the tree; `None` for a linear scan.
    pub fn build_work(&self) -> Option<BuildWork> {
        self.work
    }
}
