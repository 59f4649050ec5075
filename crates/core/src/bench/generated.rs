//! Generated scenes of any number of primitives, and rays through these scenes. Both depend only on
//! a seed and are the same on every machine.
//!
//! The N primitives of a scene are scattered in the unit cube. Their size is proportional to
//! N^(−1/3). So spheres fill the same fraction of the cube for every N.

use core::f64::consts::{PI, TAU};

use glam::DVec3;
use raywright_bvh::shapes::Sphere;
use raywright_bvh::{GeometryError, PrimitiveSet, Ray, Real, Vector, Visibility};
use serde::Serialize;

use crate::hash::splitmix64;

/// Total volume of the spheres of a generated scene, as a fraction of the volume of the unit cube.
/// Overlaps count twice, and parts outside the cube are included.
pub const TOTAL_SPHERE_VOLUME: f64 = 0.01;

/// Kind of the primitives of a generated scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum GeneratedPrimitive {
    /// Spheres.
    Spheres,
    /// Triangles, each with its corners on a sphere of the same size.
    Triangles,
}

impl GeneratedPrimitive {
    /// Every kind of primitive with its name.
    pub const ALL: [(&'static str, Self); 2] =
        [("spheres", Self::Spheres), ("triangles", Self::Triangles)];

    /// Returns the plural name of the kind, in lower case.
    pub fn name(self) -> &'static str {
        match self {
            Self::Spheres => "spheres",
            Self::Triangles => "triangles",
        }
    }
}

/// Returns the radius at which `count` spheres have the total volume [`TOTAL_SPHERE_VOLUME`].
pub(crate) fn sphere_radius(count: u32) -> f64 {
    libm::cbrt(TOTAL_SPHERE_VOLUME * 3.0 / (4.0 * PI * f64::from(count.max(1))))
}

/// Random numbers computed by a hash of a seed and two indices: the item, such as a primitive, and
/// the number's index within the item (`lane`). They do not depend on the order of calls.
#[derive(Clone, Copy, Debug)]
pub(super) struct HashedRandom {
    pub seed: u64,
}

impl HashedRandom {
    /// Returns a number in [0, 1). `lane` is the index of the number within the item.
    pub fn number_in_unit_interval(self, item: u64, lane: u64) -> f64 {
        (splitmix64(self.seed ^ splitmix64(item << 8 | lane)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Returns a uniform point in the unit cube, from the numbers `lane` to `lane + 2` of the item.
    fn point_in_cube(self, item: u64, lane: u64) -> DVec3 {
        DVec3::new(
            self.number_in_unit_interval(item, lane),
            self.number_in_unit_interval(item, lane + 1),
            self.number_in_unit_interval(item, lane + 2),
        )
    }

    /// Returns a uniform point on the unit sphere, from the numbers `lane` and `lane + 1` of the
    /// item (Archimedes' projection).
    pub fn unit_direction(self, item: u64, lane: u64) -> DVec3 {
        let (z, angle) = (
            2.0 * self.number_in_unit_interval(item, lane) - 1.0,
            TAU * self.number_in_unit_interval(item, lane + 1),
        );
        let radius = (1.0 - z * z).max(0.0).sqrt();
        DVec3::new(radius * libm::cos(angle), radius * libm::sin(angle), z)
    }
}

/// Generates a scene of `count` primitives in the unit cube.
///
/// # Errors
/// Fails for more primitives than a BVH can address.
pub(crate) fn generate_primitives<R: Real>(
    kind: GeneratedPrimitive,
    count: u32,
    seed: u64,
) -> Result<PrimitiveSet<R>, GeometryError> {
    let (numbers, radius) = (HashedRandom { seed }, sphere_radius(count));
    let mut group = PrimitiveSet::default();
    for i in 0..u64::from(count) {
        let centre = numbers.point_in_cube(i, 0);
        match kind {
            GeneratedPrimitive::Spheres => {
                let sphere = Sphere {
                    centre: Vector::from_f64(centre),
                    radius: R::from_f64(radius),
                };
                group.add_sphere(sphere, Visibility::default())?;
            }
            GeneratedPrimitive::Triangles => {
                let corner =
                    |lane: u64| Vector::from_f64(centre + numbers.unit_direction(i, lane) * radius);
                group.add_triangle([corner(3), corner(5), corner(7)], Visibility::default())?;
            }
        }
    }
    Ok(group)
}

/// Generates rays in uniform directions. Each ray starts outside the unit cube, at a distance of 2
/// from a uniform point in the cube, at which it aims.
pub(crate) fn generate_rays<R: Real>(count: u32, seed: u64) -> Vec<Ray<R>> {
    let numbers = HashedRandom { seed };
    let ray = |i: u64| {
        let (target_direction, direction) =
            (numbers.point_in_cube(i, 0), numbers.unit_direction(i, 3));
        // The distance 2 is more than the cube's diagonal.
        Ray::new(
            Vector::from_f64(target_direction - direction * 2.0),
            <R::Vec3 as Vector<R>>::from_f64(direction).normalize(),
        )
    };
    (0..u64::from(count)).map(ray).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use raywright_bvh::{AcceleratorKind, Geometry, Interval, TraversalStats};

    /// Protects: equal seeds give equal scenes on every machine and day; different seeds differ.
    #[test]
    fn a_seed_names_a_scene() {
        let hits = |kind, seed| -> Vec<_> {
            let geometry = Geometry::<f32>::new(
                generate_primitives(kind, 500, seed).unwrap(),
                AcceleratorKind::Linear,
            );
            generate_rays(200, 7)
                .iter()
                .map(|ray| geometry.closest(ray, Interval::positive(), &mut ()))
                .collect()
        };
        for (_, kind) in GeneratedPrimitive::ALL {
            assert_eq!(hits(kind, 1), hits(kind, 1));
            assert_ne!(hits(kind, 1), hits(kind, 2));
        }
        assert_ne!(
            hits(GeneratedPrimitive::Spheres, 1),
            hits(GeneratedPrimitive::Triangles, 1)
        );
        // A fixed value: a change of the generator would silently change the meaning of the
        // figures.
        assert_eq!(
            generate_rays::<f32>(3, 7)[2].origin,
            glam::Vec3::new(-0.744_443, 2.062_738_2, 0.879_758_8)
        );
    }

    /// Protects: with constant fill, N times the volume of a sphere is constant, and the sizes of
    /// triangles follow.
    #[test]
    fn fill_does_not_depend_on_the_count() {
        for count in [1, 10, 1_000_000] {
            let volume = f64::from(count) * 4.0 / 3.0 * PI * sphere_radius(count).powi(3);
            assert!(
                (volume - TOTAL_SPHERE_VOLUME).abs() < 1e-12,
                "{count}: {volume}"
            );
        }
        let bounds = Geometry::<f32>::new(
            generate_primitives(GeneratedPrimitive::Triangles, 1, 3).unwrap(),
            AcceleratorKind::Linear,
        )
        .bounded_primitives_box();
        assert!(bounds.extent().max_element() <= 2.0 * sphere_radius(1) + 1e-6);
    }

    /// Protects: every ray starts outside the scene with a unit direction; some rays hit and some
    /// miss.
    #[test]
    fn rays_come_from_outside() {
        let geometry = Geometry::<f32>::new(
            generate_primitives(GeneratedPrimitive::Spheres, 1000, 1).unwrap(),
            AcceleratorKind::default(),
        );
        let bounds = geometry.bounded_primitives_box();
        let mut stats = TraversalStats::default();
        let hits = generate_rays::<f32>(1000, 2).into_iter().filter(|ray| {
            let o = ray.origin.as_dvec3();
            assert!(
                o.cmplt(bounds.min).any() || o.cmpgt(bounds.max).any(),
                "{ray:?}"
            );
            assert!((ray.direction.length() - 1.0).abs() < 1e-6);
            geometry
                .closest(ray, Interval::positive(), &mut stats)
                .is_some()
        });
        let hits = hits.count();
        assert!((50..950).contains(&hits), "{hits}");
        assert!(stats.nodes > 0 && stats.primitives > 0);
    }
}
