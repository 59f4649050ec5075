//! Values of a ray for the tests of boxes, triangle blocks and rows, computed once per traversal.

use glam::DVec3;

use super::optimisation_barrier::optimisation_barrier;
use super::triangle8::LARGE_COORDINATE;
use crate::aabb::{Aabb, BoundingSphere};

/// Greatest direction length for which the triangle filter is used; the least is 2/`MAX_LENGTH`.
/// Outside this range f32 might overflow or underflow, so every triangle gets the exact test.
const MAX_LENGTH: f32 = (1 << 20) as f32;
/// Unit roundoffs of f32 and f64: 2⁻²⁴ and 2⁻⁵³.
const U: f32 = 5.960_464_5e-8;
const W: f32 = 1.110_223e-16;
/// Least absolute value of a direction component after scaling. Smaller components are replaced by
/// it.
const MIN_COMPONENT: f64 = 1e-20;
/// Least squared length of a mapped direction that is rounded to f32. Its inverse is the greatest.
const MIN_LENGTH_SQUARED: f32 = 1e-20;
/// Greatest coordinate, in radii of the bounding sphere, for which an origin is rounded to f32. Some
/// roundings of such a coordinate are below one percent of the radius.
const MAX_COORDINATE: f32 = 10_000.0;
/// Factor on error bounds. It covers the rounding errors of the computation of the bound itself.
const ROUNDING_FACTOR: f32 = 1.000_01;

/// A ray for the traversal of a tree, in f32: its values for box tests, and its values for leaf
/// tests.
#[derive(Clone, Copy)]
pub(crate) struct TraversalRay {
    pub box_ray: BoxRay,
    pub leaf_ray: LeafRay,
}

/// Result of rounding a ray in an instance's space to f32.
pub(crate) enum RayRoundingResult {
    /// The ray misses the bounding sphere of the instanced geometry.
    Miss,
    /// The rounded ray, and the distance at which it starts.
    Hit(TraversalRay, f32),
    /// The ray or the sphere is too far away for f32, or the direction is too long or too short.
    Imprecise,
}

/// Values of a ray for box tests, except its origin and the near end of its range. A traversal
/// keeps these values in registers.
#[derive(Clone, Copy)]
pub(crate) struct BoxRay {
    /// Inverse of each component of the direction.
    pub inverse: [f32; 3],
    /// Inverse direction for the planes at which the ray leaves a box, slightly greater in absolute
    /// value than `inverse`.
    pub exit_inverse: [f32; 3],
    /// Amount, per axis, that is subtracted from entry distances; zero for a ray that is exact in
    /// f32.
    pub entry_margin: [f32; 3],
    /// Amount, per axis, that is added to exit distances. It is `entry_margin` plus a margin for
    /// negative distances, which `exit_inverse` makes smaller.
    pub exit_margin: [f32; 3],
    /// Side on which the ray enters a box in each axis: 0 for the box's minimum, 1 for its maximum.
    /// It is the sign bit of the direction, which is known before the inverse and equals the
    /// inverse's sign, also for −0. If the inverse is zero or NaN, both sides give the same result.
    pub side: [usize; 3],
}

/// Values of a ray for the tests of leaves. They stay in memory: the filter loads each number and
/// broadcasts it to all lanes.
#[derive(Clone, Copy)]
pub(crate) struct LeafRay {
    /// Lower end of the accepted distances, itself excluded.
    pub near: f32,
    pub origin: [f32; 3],
    pub direction: [f32; 3],
    /// Terms of the error bounds of [`super::filter`]. `reach` is the ray's contribution to R, the
    /// distance of the farthest corner. `weight`, `determinant` and `distance` are the ray's
    /// factors in the bounds of these three values.
    pub reach: f32,
    pub weight: f32,
    pub determinant: f32,
    pub distance: f32,
}

/// Returns the greater number, or the second if the first is NaN, in a single instruction. A NaN of
/// the second may be lost too. This is harmless, since a ray with a NaN gets the exact test.
#[inline(always)]
fn max_or_second(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

#[inline(always)]
fn max_abs_component(v: [f32; 3]) -> f32 {
    max_or_second(v[0].abs(), max_or_second(v[1].abs(), v[2].abs()))
}

#[inline(always)]
fn min_abs_component(v: [f32; 3]) -> f32 {
    let lesser = |a: f32, b: f32| if a < b { a } else { b };
    lesser(v[0].abs(), lesser(v[1].abs(), v[2].abs()))
}

impl TraversalRay {
    #[inline(always)]
    pub fn new(origin: [f32; 3], direction: [f32; 3], near: f32) -> Self {
        let squared =
            direction[0] * direction[0] + direction[1] * direction[1] + direction[2] * direction[2];
        // An upper bound of the length for directions shorter or longer than one, computed without
        // a square root. It is tight, since directions have unit length up to rounding.
        let length = optimisation_barrier(max_or_second(squared, 1.0));
        Self::with_length(origin, direction, near, squared, length)
    }

    /// Creates the ray as [`Self::new`], for a direction of any length. `squared` is its squared
    /// length, and `length` its length or more, up to rounding.
    #[inline(always)]
    fn with_length(
        origin: [f32; 3],
        direction: [f32; 3],
        near: f32,
        squared: f32,
        length: f32,
    ) -> Self {
        let inverse = direction.map(|d| optimisation_barrier(1.0 / d));
        let length = length * ROUNDING_FACTOR;
        let is_in_range = squared < MAX_LENGTH * MAX_LENGTH
            && squared > 4.0 / (MAX_LENGTH * MAX_LENGTH)
            && max_abs_component(origin) < LARGE_COORDINATE;
        let box_ray = BoxRay {
            inverse,
            exit_inverse: inverse.map(|i| optimisation_barrier(i * (1.0 + 8.0 * U))),
            entry_margin: [0.0; 3],
            exit_margin: [max_or_second(-near, 0.0) * (16.0 * U); 3],
            side: direction.map(|d| (d.to_bits() >> 31) as usize),
        };
        let leaf_ray = LeafRay {
            origin,
            direction,
            near,
            reach: optimisation_barrier(if is_in_range { 1e-30 } else { f32::INFINITY }),
            weight: optimisation_barrier(50.0 * U * length),
            determinant: optimisation_barrier(14.0 * U * length),
            distance: optimisation_barrier(2.0 * ROUNDING_FACTOR * min_abs_component(inverse)),
        };
        Self { box_ray, leaf_ray }
    }

    /// Creates the traversal ray from a ray in f64, such as a ray in an instance's space, with a
    /// direction of any length. The ray's start is moved along the ray to the bounds of the tree,
    /// and its direction is scaled. So f32 represents the ray as precisely as the boxes.
    ///
    /// The rounded ray differs from the exact ray by `origin_error` at its origin, and by u = 2⁻²⁴
    /// in each component of its direction. So box tests lower entry distances and increase exit
    /// distances by the resulting error. The error bounds of [`super::filter`] must also cover the
    /// errors of the mapped ray. With the symbols of that module, these are 1.8 u E |d| in a
    /// weight, per unit of R, and 2.5 u E² in D and in T. Therefore R is increased.
    pub fn from_f64_ray(
        origin: DVec3,
        direction: DVec3,
        near: f64,
        bounds: &Aabb,
    ) -> (Self, RayReparametrisation) {
        let rebase = RayReparametrisation::new(origin, direction, near, bounds);
        let (moved, scaled) = (origin + direction * rebase.start, direction / rebase.scale);
        // No hit is farther from the moved origin than the farthest corner of the bounds.
        let farthest = (moved - bounds.centre()).length() + bounds.extent().length();
        // Tiny components are replaced by a slightly larger number, so that no error bound is
        // infinite.
        let scaled = scaled.map(|d| {
            if d.abs() < MIN_COMPONENT {
                MIN_COMPONENT.copysign(d)
            } else {
                d
            }
        });
        let origin_error = moved.abs() * f64::from(U)
            + (origin.abs() + (direction * rebase.start).abs()) * (8.0 * f64::from(W))
            + farthest * (2.0 * MIN_COMPONENT);
        let near = max_or_second(rebase.traversal_distance(near).next_down(), 0.0);
        let traversal_ray = Self::new(
            moved.as_vec3().to_array(),
            scaled.as_vec3().to_array(),
            near,
        );
        (
            traversal_ray.widen_error_bounds(
                origin_error.as_vec3().to_array(),
                origin_error.element_sum() as f32,
            ),
            rebase,
        )
    }

    /// Computes the ray of [`TraversalRay::from_f64_ray`] from the origin and the direction of a ray
    /// in an instance's space, and the distance at which it starts. All but the moved origin is
    /// computed in f32, so the starting distance is rounded more. Any starting distance gives the
    /// same hits.
    ///
    /// The error bound is the same on each axis. It is the rounding of the moved origin, and that of
    /// the direction along the diameter of the bounding sphere, which is two radii. A tenth of a
    /// radius more covers the rounding of the starting distance.
    #[inline(always)]
    pub fn from_mapped_ray(
        [origin, direction]: [DVec3; 2],
        near: f32,
        bounds: &BoundingSphere,
    ) -> RayRoundingResult {
        let stored = |v: DVec3| [v.x as f32, v.y as f32, v.z as f32];
        let dot = |a: [f32; 3], b: [f32; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let (o, d, [x, y, z]) = (stored(origin), stored(direction), bounds.centre);
        let squared = dot(d, d);
        // The root and the quotient do not wait for each other.
        let (inverse, length) = (1.0 / squared, squared.sqrt());
        let to_centre = [x - o[0], y - o[1], z - o[2]];
        let (middle, half) = (
            dot(to_centre, d) * inverse,
            bounds.radius * (length * inverse),
        );
        // The margin of the bounding sphere exceeds the error that the ray has at the sphere.
        let greatest = max_or_second(max_abs_component(o), max_abs_component(to_centre));
        if !(greatest < bounds.radius * MAX_COORDINATE
            && squared > MIN_LENGTH_SQUARED
            && squared < 1.0 / MIN_LENGTH_SQUARED)
        {
            return RayRoundingResult::Imprecise;
        }
        let nearest = [
            d[0] * middle - to_centre[0],
            d[1] * middle - to_centre[1],
            d[2] * middle - to_centre[2],
        ];
        if dot(nearest, nearest) > bounds.radius * bounds.radius {
            return RayRoundingResult::Miss;
        }
        let start = max_or_second(middle - half, near - near.abs() * (4.0 * U));
        let moved = stored(origin + direction * f64::from(start));
        let near_margin = (near.abs() + start.abs()) * (4.0 * U);
        let error = (max_abs_component(moved) + 2.1 * bounds.radius) * (1.01 * U);
        let traversal_ray = Self::with_length(
            moved,
            d.map(|d| max_or_second(d.abs(), MIN_COMPONENT as f32).copysign(d)),
            max_or_second(near - start - near_margin, 0.0),
            squared,
            length,
        )
        .widen_error_bounds([error; 3], 3.0 * error);
        RayRoundingResult::Hit(traversal_ray, start)
    }

    /// Increases the error bounds of the ray, for an origin whose error on each axis is at most
    /// `origin_error`. `total_error` is the sum of `origin_error` over the axes.
    #[inline(always)]
    fn widen_error_bounds(self, origin_error: [f32; 3], total_error: f32) -> Self {
        let Self { box_ray, leaf_ray } = self;
        let early: [f32; 3] =
            core::array::from_fn(|axis| origin_error[axis] * 2.01 * box_ray.inverse[axis].abs());
        let box_ray = BoxRay {
            exit_inverse: box_ray.inverse.map(|i| i * (1.0 + 16.0 * U)),
            entry_margin: early,
            exit_margin: early.map(|early| early + box_ray.exit_margin[0]),
            ..box_ray
        };
        Self {
            box_ray,
            leaf_ray: LeafRay {
                reach: leaf_ray.reach + total_error * (0.1 * ROUNDING_FACTOR / U),
                ..leaf_ray
            },
        }
    }

    /// Adds the rounding error of box distances to the far end of a range, so that box tests miss
    /// no hit before that end.
    #[inline(always)]
    pub fn widen_far_distance(far: f32) -> f32 {
        far + far.abs() * (8.0 * U)
    }
}

/// Conversion from distances along a ray in f64, such as a ray in an instance's space, to distances
/// of the f32 traversal. A distance t becomes (t − start) · scale.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct RayReparametrisation {
    pub start: f64,
    /// Factor of distances, a power of two. It is one for a ray that was mapped in f32.
    pub scale: f64,
}

impl RayReparametrisation {
    /// Creates the conversion for a ray and the bounds of a tree. Converted distances are zero
    /// where the ray enters the bounding sphere of the box, or at `near` if that is later. So no
    /// accepted distance is negative. The scale makes the length of the direction about one.
    pub fn new(origin: DVec3, direction: DVec3, near: f64, bounds: &Aabb) -> Self {
        let squared = direction.length_squared();
        let (middle, length) = (
            (bounds.centre() - origin).dot(direction) / squared,
            squared.sqrt(),
        );
        let sphere = middle - (bounds.extent().length() * 0.51 / length + middle.abs() * 1e-12);
        // The stored distance of a hit after `near` may be less than `near`, by this rounding
        // error.
        let start = sphere.max(near - near.abs() * (2.0 * f64::from(U)));
        // The greatest power of two up to the length has the same exponent bits, and no others.
        let scale = f64::from_bits(length.to_bits() & 0x7ff << 52);
        let is_in_range = start.is_finite() && scale.is_normal();
        if is_in_range {
            Self { start, scale }
        } else {
            Self {
                start: 0.0,
                scale: 1.0,
            }
        }
    }

    /// Converts a distance along the ray to a distance of the traversal, rounded to nearest.
    pub fn traversal_distance(&self, t: f64) -> f32 {
        ((t - self.start) * self.scale) as f32
    }

    /// Converts the far end of a range to a distance of the traversal. Every hit whose distance,
    /// rounded to f32, is at most `t` has a converted distance of at most the result. Two units of
    /// the margin are for that rounding, two for the rounding of the result.
    #[inline(always)]
    pub fn traversal_far_distance(&self, t: f32) -> f32 {
        let t = f64::from(t);
        self.traversal_distance(t + (t.abs() + self.start.abs()) * (4.0 * f64::from(U)))
    }
}
