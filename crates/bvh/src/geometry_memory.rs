//! Memory estimate for a geometry before it is built, from the numbers of its primitives by kind.

use crate::build::AcceleratorKind;
use crate::bvh8::Bvh8;
use crate::instance::Instance;
use crate::motion::Motion;
use crate::primitive_set::{PrimitiveSet, max_linear_scan_size};
use crate::scalar::Real;
use crate::shapes::{AnyShape, Plane, Shape, Sphere, TransformedShape, Triangle};

/// Memory estimate of a geometry before its build, from its numbers of primitives. Each number
/// counts the primitives in one array of a [`PrimitiveSet`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GeometryMemory {
    /// Number of spheres without a transform.
    pub spheres: u64,
    /// Number of triangles without a transform.
    pub triangles: u64,
    /// Number of planes without a transform.
    pub planes: u64,
    /// Number of other shapes without a transform.
    pub shapes: u64,
    /// Number of shapes of any kind with a transform.
    pub transformed_shapes: u64,
    /// Number of instances of other geometries.
    pub instances: u64,
    /// Number of moving instances, which `instances` includes.
    pub moving_instances: u64,
    /// Number of unbounded primitives, which the numbers above include.
    unbounded: u64,
}

impl GeometryMemory {
    /// Creates the counts of a geometry that contains `count` triangles and nothing else.
    pub fn from_triangle_count(count: u64) -> Self {
        Self {
            triangles: count,
            ..Self::default()
        }
    }

    /// Adds `count` shapes of the kind of `shape`. All are unbounded if `shape` is. `mapped` is
    /// whether each of them has a transform.
    pub fn add_shapes<R: Real>(&mut self, shape: &AnyShape<R>, mapped: bool, count: u64) {
        let kind = match shape {
            _ if mapped => &mut self.transformed_shapes,
            AnyShape::Sphere(_) => &mut self.spheres,
            AnyShape::Triangle(_) => &mut self.triangles,
            AnyShape::Plane(_) => &mut self.planes,
            _ => &mut self.shapes,
        };
        *kind = kind.saturating_add(count);
        if shape.bounds().is_none() {
            self.unbounded = self.unbounded.saturating_add(count);
        }
    }

    /// Total number of primitives.
    pub fn primitive_count(&self) -> u64 {
        let kinds = [
            self.spheres,
            self.triangles,
            self.planes,
            self.shapes,
            self.transformed_shapes,
            self.instances,
        ];
        kinds.into_iter().fold(0, u64::saturating_add)
    }

    /// Whether the total number of primitives is zero.
    pub fn is_empty(&self) -> bool {
        self.primitive_count() == 0
    }

    /// Returns an upper bound of [`Geometry::memory_bytes`](crate::Geometry::memory_bytes) for a
    /// geometry of these primitives. The uncertain terms are the number of nodes and the fill of
    /// triangle blocks. The bound is below m times the true number of bytes, plus a few kilobytes.
    /// If triangles and other primitives are interspersed, m is five, otherwise three.
    pub fn max_geometry_bytes<R: Real>(&self, kind: AcceleratorKind) -> u64 {
        let bounded = self.primitive_count().saturating_sub(self.unbounded);
        let few = max_linear_scan_size(
            self.primitive_count() == self.spheres.saturating_add(self.planes),
        );
        let wide = R::IS_SINGLE && matches!(kind, AcceleratorKind::Tree(_));
        let planes = if wide {
            Bvh8::memory_bytes_without_nodes(self.planes, 0)
        } else {
            0
        };
        let others = bounded
            .saturating_sub(self.spheres)
            .saturating_sub(self.triangles);
        let counts = if R::IS_SINGLE {
            [self.spheres, self.triangles, others]
        } else {
            [0, 0, bounded]
        };
        let tree = match kind {
            _ if wide && Bvh8::prefers_no_nodes(self.spheres, self.triangles, others) => {
                Bvh8::memory_bytes_without_nodes(self.spheres, self.triangles)
            }
            AcceleratorKind::Tree(_) if bounded > few as u64 => Bvh8::max_tree_bytes(counts),
            _ => 0,
        };
        self.primitive_bytes::<R>(wide)
            .saturating_add(planes)
            .saturating_add(tree)
    }

    /// Bytes of the primitives, without the accelerator. `wide` is whether an eight-wide tree
    /// stores the triangles: these then count as zero here.
    fn primitive_bytes<R: Real>(&self, wide: bool) -> u64 {
        let each = [
            (self.primitive_count(), PrimitiveSet::<R>::SLOT_BYTES),
            (self.spheres, size_of::<Sphere<R>>()),
            (
                if wide { 0 } else { self.triangles },
                size_of::<Triangle<R>>(),
            ),
            (self.planes, size_of::<Plane<R>>()),
            (self.shapes, size_of::<AnyShape<R>>()),
            (self.transformed_shapes, size_of::<TransformedShape<R>>()),
            (self.instances, size_of::<Instance>()),
            (self.moving_instances, size_of::<Motion>()),
        ];
        each.into_iter().fold(0, |sum, (count, bytes)| {
            sum.saturating_add(count.saturating_mul(bytes as u64))
        })
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::geometry::Geometry;
    use crate::ray::Visibility;
    use crate::shapes::{Disk, Quad};
    use crate::{BuildQuality, Vector};

    /// Creates `n` spheres in a row, with `others` disks and optionally a plane.
    fn both<R: Real>(n: u64, others: u64, plane: bool) -> (GeometryMemory, PrimitiveSet<R>) {
        let (mut geometry_memory, mut group) =
            (GeometryMemory::default(), PrimitiveSet::<R>::default());
        let mut add = |shape: AnyShape<R>| {
            geometry_memory.add_shapes(&shape, false, 1);
            group.add_shape(shape, Visibility::default()).unwrap();
        };
        let at = |i: u64| DVec3::new((i * 7 % 101) as f64, (i * 13 % 89) as f64, (i % 97) as f64);
        for i in 0..n {
            add(AnyShape::Sphere(Sphere {
                centre: Vector::from_f64(at(i)),
                radius: R::from_f64(0.25),
            }));
        }
        for i in 0..others {
            add(AnyShape::Disk(Disk::new(at(i), DVec3::Y, 0.5)));
        }
        if plane {
            add(AnyShape::Plane(Plane::new(
                Vector::ZERO,
                Vector::from_f64(DVec3::Y),
            )));
        }
        (geometry_memory, group)
    }

    fn holds<R: Real>() {
        let tree = BuildQuality::ALL.map(AcceleratorKind::Tree);
        for n in [0, 1, 2, 3, 5, 14, 15, 16, 64, 1000] {
            for (others, plane) in [(0, false), (0, true), (1, false), (n, true)] {
                for kind in [AcceleratorKind::Linear].into_iter().chain(tree) {
                    let (geometry_memory, group) = both::<R>(n, others, plane);
                    let maximum = geometry_memory.max_geometry_bytes::<R>(kind);
                    let real = Geometry::new(group, kind).memory_bytes() as u64;
                    let label = format!(
                        "{n} balls, {others} disks, {kind:?}: {real} bytes, at most {maximum}"
                    );
                    assert!(real <= maximum && maximum <= 3 * real, "{label}");
                    assert!(
                        matches!(kind, AcceleratorKind::Tree(_)) || real == maximum,
                        "{label}"
                    );
                }
            }
        }
    }

    /// Protects: the memory estimate is never too small and at most three times the true value, for
    /// few primitives and many, bounded and unbounded, in both precisions and with each build
    /// quality. For a linear scan the estimate is exact.
    #[test]
    fn memory_is_told_beforehand() {
        holds::<f32>();
        holds::<f64>();
    }

    /// Protects: the memory estimate is never too small and bounded for meshes with nearly empty
    /// leaves: scattered triangles, a growing row in which each triangle has a node of its own,
    /// coincident triangles, and all of these mixed with spheres.
    #[test]
    fn memory_of_meshes_is_told_beforehand() {
        let at = |i: u64| DVec3::new((i * 7 % 101) as f64, (i * 13 % 89) as f64, (i % 97) as f64);
        for (n, balls) in [3, 5, 8, 9, 17, 64, 300, 5000]
            .into_iter()
            .flat_map(|n| [(n, 0), (n, 1), (n, n / 3)])
        {
            for family in 0..3 {
                let corner = |i: u64| match family {
                    0 => at(i),
                    1 => DVec3::X * 1.05_f64.powi((i % 600) as i32),
                    _ => DVec3::ONE,
                };
                let corners = |i: u64| {
                    [corner(i), corner(i) + DVec3::X, corner(i) + DVec3::Y].map(|p| p.as_vec3())
                };
                for kind in BuildQuality::ALL.map(AcceleratorKind::Tree) {
                    let (mut geometry_memory, mut group) = (
                        GeometryMemory::from_triangle_count(n),
                        PrimitiveSet::<f32>::default(),
                    );
                    group
                        .add_mesh((0..n).map(corners), Visibility::default())
                        .unwrap();
                    for i in 0..balls {
                        let ball = AnyShape::Sphere(Sphere {
                            centre: corner(i * 3).as_vec3(),
                            radius: 0.25,
                        });
                        geometry_memory.add_shapes(&ball, false, 1);
                        group.add_shape(ball, Visibility::default()).unwrap();
                    }
                    let (maximum, real) = (
                        geometry_memory.max_geometry_bytes::<f32>(kind),
                        Geometry::new(group, kind).memory_bytes() as u64,
                    );
                    let label = format!(
                        "{n} triangles, {balls} balls, family {family}, {kind:?}: {real} bytes, at most {maximum}"
                    );
                    let times = if balls == 0 { 3 } else { 5 };
                    assert!(real <= maximum && maximum <= times * real + 4096, "{label}");
                }
            }
        }
    }

    /// Protects: the memory estimate is never too small and bounded for quads, alone and mixed with
    /// as many spheres and disks.
    #[test]
    fn memory_of_quads_is_told_beforehand() {
        let at = |i: u64| DVec3::new((i * 7 % 101) as f64, (i * 13 % 89) as f64, (i % 97) as f64);
        for (n, others) in [3, 5, 8, 9, 17, 64, 300, 5000]
            .into_iter()
            .flat_map(|n| [(n, false), (n, true)])
        {
            for kind in BuildQuality::ALL.map(AcceleratorKind::Tree) {
                let (mut geometry_memory, mut group) = if others {
                    both::<f32>(n, n, false)
                } else {
                    Default::default()
                };
                for i in 0..n {
                    let quad = AnyShape::Quad(Quad::new(at(i), DVec3::X, DVec3::Y));
                    geometry_memory.add_shapes(&quad, false, 1);
                    group.add_shape(quad, Visibility::default()).unwrap();
                }
                let (maximum, real) = (
                    geometry_memory.max_geometry_bytes::<f32>(kind),
                    Geometry::new(group, kind).memory_bytes() as u64,
                );
                let label = format!(
                    "{n} quads, others: {others}, {kind:?}: {real} bytes, at most {maximum}"
                );
                assert!(real <= maximum && maximum <= 5 * real + 4096, "{label}");
            }
        }
    }

    /// Protects: the greatest number of nodes equals a value computed by hand, for eight boxes in
    /// leaves of their own; and is zero for two.
    #[test]
    fn node_count_of_the_emptiest_nodes() {
        let most = |count: u64| {
            let memory = GeometryMemory {
                shapes: count,
                ..GeometryMemory::default()
            };
            memory.max_geometry_bytes::<f32>(AcceleratorKind::default())
                - memory.max_geometry_bytes::<f32>(AcceleratorKind::Linear)
        };
        assert_eq!([most(8), most(2)], [(4 * 8 + 3) / 7 * 256, 0]);
    }
}
