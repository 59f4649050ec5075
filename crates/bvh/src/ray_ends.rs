//! Triangles at the ends of a ray. Queries need not test them.

/// Identifies a triangle of a geometry for [`RayEndTriangles`]; triangles within instances have none. The
/// number is the position of the triangle's record, its slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TriangleSlot(u32);

impl TriangleSlot {
    /// No triangle.
    pub const NONE: Self = Self(u32::MAX);

    #[inline(always)]
    pub(crate) fn new(slot: u32) -> Self {
        Self(slot)
    }

    /// Returns the mask of the triangle's lane in the block whose slots start at `first`. If the
    /// triangle is in another block, no bit below the eighth is set.
    #[inline(always)]
    pub(crate) fn lane_mask(self, first: u32) -> u32 {
        1_u32
            .checked_shl(self.0.wrapping_sub(first))
            .unwrap_or_default()
    }
}

/// Triangles whose exact tests a query may skip: the triangle that the ray leaves, and the
/// triangles of the light before which a shadow ray ends.
///
/// A query skips the test only if the fast filter of triangle blocks is certain of the side from
/// which the ray comes. The ray then misses the triangle, as the following proof shows.
///
/// **Side.** Let N be the triangle's normal in f64, n its rounded form in
/// [`Surface`](crate::Surface), and d the stored direction. Let u be 2⁻²⁴ and E the longer of two
/// edges, so E² is at least |N|. The filter is certain of the sign of N · d if |N · d| > 14 u E²
/// |d| (module `bvh8::filter`). The product n · d differs from N · d / |N| by at most u |d|. So n ·
/// d has the same sign.
///
/// **Start.** The origin is that of
/// [`Surface::spawn_ray_origin`](crate::Surface::spawn_ray_origin). It lies on the side to which d
/// points by n · d, outside the error bound of the exact test. From the origin the ray only moves
/// away from the triangle. So every distance of the exact test is below zero.
///
/// **Target.** The end is that of
/// [`Surface::spawn_unchecked_ray_to_surface`](crate::Surface::spawn_unchecked_ray_to_surface). It
/// lies on the side from which the ray comes by n · d, outside the same error bound. All earlier
/// points are farther from the triangle's plane. So every distance of the exact test is beyond the
/// end.
///
/// If the filter is not certain, the exact test decides.
///
/// Two conditions must hold: the query's range accepts no distance below zero, and the origin is
/// that of `spawn_ray_origin`, not an origin at a constant offset.
#[derive(Clone, Copy, Debug)]
pub struct RayEndTriangles {
    /// The triangle that the ray leaves.
    pub start: TriangleSlot,
    /// The triangles of the light before which a shadow ray ends.
    pub target: [TriangleSlot; 2],
}

impl RayEndTriangles {
    /// No triangles.
    pub const NONE: Self = Self::from_start(TriangleSlot::NONE);

    /// Returns the ends of a ray that leaves a triangle and has no target.
    #[inline(always)]
    pub const fn from_start(start: TriangleSlot) -> Self {
        Self {
            start,
            target: [TriangleSlot::NONE; 2],
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::{
        AcceleratorKind, Geometry, Hit, Interval, Kernel, Occlusion, PrimitiveSet, Ray, Surface,
        Visibility,
    };

    /// Xorshift, from −1 to 1.
    fn number(state: &mut u64) -> f32 {
        *state ^= *state << 13;
        *state ^= *state >> 7;
        *state ^= *state << 17;
        (*state >> 40) as f32 / (1 << 23) as f32 - 1.0
    }

    fn vector(state: &mut u64) -> Vec3 {
        Vec3::new(number(state), number(state), number(state))
    }

    fn geometry(triangles: Vec<[Vec3; 3]>, kernel: Kernel) -> Geometry<f32> {
        let mut group = PrimitiveSet::default();
        let visibility = Visibility {
            occlusion: Occlusion::Filtered,
            ..Visibility::default()
        };
        group.add_mesh(triangles, visibility).unwrap();
        let mut geometry = Geometry::new(group, AcceleratorKind::default());
        geometry.set_kernel(kernel);
        geometry
    }

    fn closest(
        geometry: &Geometry<f32>,
        ray: &Ray<f32>,
        ends: &RayEndTriangles,
    ) -> Option<Hit<f32>> {
        geometry.closest_with_ray_ends(ray, Interval::positive(), ends, &mut ())
    }

    /// Protects: rays from a triangle, in all directions and nearly along it, and shadow rays
    /// between two triangles hit the same with and without their ends, among triangles of all
    /// sizes, slivers, and an origin far away.
    #[test]
    fn ends_change_no_hit() {
        for kernel in Kernel::available() {
            let (state, mut hits, mut misses) = (&mut 88_172_645_463_325_252, 0, 0);
            let mut triangle = |shift: f32| {
                let (size, middle) = (10_f32.powf(number(state) * 2.0 - 1.0), vector(state));
                let [a, b, c] = [(); 3].map(|()| middle + vector(state) * size + shift);
                let flat = number(state) > 0.5;
                [
                    a,
                    b,
                    if flat {
                        a + (b - a) * 0.4 + (c - a) * 1e-4
                    } else {
                        c
                    },
                ]
            };
            let soups = [0.0, 300.0]
                .map(|shift| geometry((0..400).map(|_| triangle(shift)).collect(), kernel));
            for (geometry, shift) in soups.iter().zip([0.0, 300.0]) {
                let mut before: Option<(Surface<f32>, Hit<f32>)> = None;
                for _ in 0..20_000 {
                    let ray = Ray::new(vector(state) + shift, vector(state).normalize());
                    let Some(hit) = closest(geometry, &ray, &RayEndTriangles::NONE) else {
                        continue;
                    };
                    let surface = geometry.surface(&ray, &hit);
                    let grazing = 10_f32.powf(number(state) * 5.0 - 5.0);
                    let along = vector(state).reject_from(surface.normal).normalize();
                    for direction in [
                        vector(state).normalize(),
                        (along + surface.normal * (grazing * number(state))).normalize(),
                    ] {
                        let next = Ray::new(surface.spawn_ray_origin(direction), direction);
                        let ends = RayEndTriangles::from_start(hit.triangle_slot());
                        let alone = closest(geometry, &next, &RayEndTriangles::NONE);
                        assert_eq!(
                            closest(geometry, &next, &ends),
                            alone,
                            "{kernel:?} {next:?}"
                        );
                        *(if alone.is_some() {
                            &mut hits
                        } else {
                            &mut misses
                        }) += 1;
                    }
                    if let Some((other, other_hit)) = before.replace((surface, hit)) {
                        let (ray, max, [leaves, reaches]) =
                            surface.spawn_unchecked_ray_to_surface(&other);
                        let ends = RayEndTriangles {
                            start: if leaves {
                                hit.triangle_slot()
                            } else {
                                TriangleSlot::NONE
                            },
                            target: [
                                if reaches {
                                    other_hit.triangle_slot()
                                } else {
                                    TriangleSlot::NONE
                                },
                                TriangleSlot::NONE,
                            ],
                        };
                        let range = Interval { min: 0.0, max };
                        let alone = geometry.occluded(&ray, range, &mut |_| true, &mut ());
                        let found = geometry.occluded_with_ray_ends(
                            &ray,
                            range,
                            &ends,
                            &mut |_| true,
                            &mut (),
                        );
                        assert_eq!(found, alone, "{kernel:?} {ray:?} to {max}");
                        *(if alone { &mut hits } else { &mut misses }) += 1;
                    }
                }
            }
            assert!(hits > 4000 && misses > 4000, "{hits} hits, {misses} misses");
        }
    }

    /// Protects: a triangle named as an end is not tested where the side is certain, so that a ray
    /// through it hits the one behind; it is tested where rounding may have changed the side.
    #[test]
    fn ends_are_left_out_where_the_side_is_certain() {
        let triangle = |z: f32| {
            [
                Vec3::new(0.0, 0.0, z),
                Vec3::new(1.0, 0.0, z),
                Vec3::new(0.0, 1.0, z),
            ]
        };
        for kernel in Kernel::available() {
            let geometry = geometry(vec![triangle(0.0), triangle(-1.0)], kernel);
            let [first, second] = [0, 1].map(|primitive| {
                let of = |&(_, _, own): &(TriangleSlot, u32, u32)| own == primitive;
                geometry.triangle_slots().find(of).expect("a triangle").0
            });
            let down = Ray::new(Vec3::new(0.25, 0.25, 1.0), Vec3::NEG_Z);
            let hit = |ray, start| {
                let hit = closest(&geometry, ray, &RayEndTriangles::from_start(start));
                hit.map(|hit| hit.primitive)
            };
            assert_eq!(hit(&down, TriangleSlot::NONE), Some(0));
            assert_eq!((hit(&down, first), hit(&down, second)), (Some(1), Some(0)));
            let blocked = |start, target| {
                let ends = RayEndTriangles { start, target };
                geometry.occluded_with_ray_ends(
                    &down,
                    Interval::positive(),
                    &ends,
                    &mut |_| true,
                    &mut (),
                )
            };
            assert!(blocked(first, [TriangleSlot::NONE; 2]));
            assert!(blocked(TriangleSlot::NONE, [second, TriangleSlot::NONE]));
            assert!(!blocked(first, [TriangleSlot::NONE, second]));
            assert!(!blocked(TriangleSlot::NONE, [first, second]));
            let grazing = Ray::new(Vec3::new(-1.0, 0.25, 1.25e-6), Vec3::new(1.0, 0.0, -1e-6));
            assert_eq!(hit(&grazing, first), Some(0), "{kernel:?}");
        }
    }
}
