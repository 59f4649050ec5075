//! What all boxes and blocks ask of a ray, made once for it.

use glam::DVec3;

use super::optimisation_barrier::opaque;
use super::triangle8::LARGE;
use crate::aabb::{Aabb, BoundingSphere};
use crate::instance::RoughInverse;
use crate::shapes::PreparedRay;

/// Directions as long as this or longer, or shorter than its inverse, might leave the range of f32:
/// everything is then tested exactly.
const LONG: f32 = (1 << 20) as f32;
/// 2⁻²⁴ and 2⁻⁵³.
const U: f32 = 5.960_464_5e-8;
const W: f32 = 1.110_223e-16;
/// The least component of a scaled direction.
const LEAST: f64 = 1e-20;
/// Squares of lengths between this and its inverse are those of directions that f32 maps.
const SHORT: f32 = 1e-24;
/// More than what rounding may take from a bound while it is computed.
const ROUNDED: f32 = 1.000_01;

/// A ray as the kernels know it, all in f32.
#[derive(Clone, Copy)]
pub(crate) struct TraversalRay {
    pub slopes: BoxRay,
    pub aim: LeafRay,
}

/// What f32 makes of a ray of the world for what an instance shows.
pub(crate) enum RoughRay {
    /// It passes the sphere around that.
    Misses,
    /// What boxes and blocks ask, and the distance from which they count.
    Meets(TraversalRay, f32),
    /// It may be wrong by more than a hundredth of what is there.
    TooRough,
}

/// What boxes ask besides the origin and the near end: a walk has it in registers.
#[derive(Clone, Copy)]
pub(crate) struct BoxRay {
    pub inverse: [f32; 3],
    /// The same, widened for the planes through which the ray leaves.
    pub widened: [f32; 3],
    /// By how much entries are earlier besides: something only where the ray was rounded.
    pub early: [f32; 3],
    /// By how much exits are later besides: as much, and something where distances below zero
    /// count, which widening would make less.
    pub late: [f32; 3],
    /// The side of each axis through which the ray enters: by the sign of the direction, which is
    /// known before its inverse is and has that one's sign, −0 too. Where the inverse is zero or no
    /// number, both sides are one.
    pub side: [usize; 3],
}

/// What blocks and what is in them ask: it stays in memory, from where the filter spreads it over
/// its lanes.
#[derive(Clone, Copy)]
pub(crate) struct LeafRay {
    /// The excluded lower end of distances.
    pub near: f32,
    pub origin: [f32; 3],
    pub direction: [f32; 3],
    /// Bounds of [`super::filter`]: of a lane's reach, and factors of what it is made from.
    pub reach: f32,
    pub weight: f32,
    pub determinant: f32,
    pub distance: f32,
}

/// The greater one, the second where the first is not a number: one instruction, since whatever is
/// not a number is tested exactly.
#[inline(always)]
fn greater(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

#[inline(always)]
fn greatest_of(v: [f32; 3]) -> f32 {
    greater(v[0].abs(), greater(v[1].abs(), v[2].abs()))
}

#[inline(always)]
fn least_of(v: [f32; 3]) -> f32 {
    let lesser = |a: f32, b: f32| if a < b { a } else { b };
    lesser(v[0].abs(), lesser(v[1].abs(), v[2].abs()))
}

impl TraversalRay {
    #[inline(always)]
    pub fn new(origin: [f32; 3], direction: [f32; 3], near: f32) -> Self {
        let inverse = direction.map(|d| opaque(1.0 / d));
        let squared =
            direction[0] * direction[0] + direction[1] * direction[1] + direction[2] * direction[2];
        // No less than the length, be that below one or above, and without a root: directions are
        // of unit length but for rounding.
        let length = opaque(greater(squared, 1.0)) * ROUNDED;
        let sane =
            squared < LONG * LONG && squared > 4.0 / (LONG * LONG) && greatest_of(origin) < LARGE;
        let slopes = BoxRay {
            inverse,
            widened: inverse.map(|i| opaque(i * (1.0 + 8.0 * U))),
            early: [0.0; 3],
            late: [greater(-near, 0.0) * (16.0 * U); 3],
            side: direction.map(|d| (d.to_bits() >> 31) as usize),
        };
        let aim = LeafRay {
            origin,
            direction,
            near,
            reach: opaque(if sane { 1e-30 } else { f32::INFINITY }),
            weight: opaque(50.0 * U * length),
            determinant: opaque(14.0 * U * length),
            distance: opaque(2.0 * ROUNDED * least_of(inverse)),
        };
        Self { slopes, aim }
    }

    /// For a ray of the space of an instance, in f64 and of any length: moved along itself to
    /// beside what is there and scaled, so that f32 holds it as well as the boxes. Rounded it is a
    /// ray that passes the true one by `wrong` at its origin and by u in each component of its
    /// direction. Boxes are entered earlier by that and left later, and what the bounds of
    /// [`super::filter`] take for a corner's distance is longer by so much that the errors of f64,
    /// 1.8 u E |d| of a weight for each unit, and 2.5 u E² of D and of T, are in them.
    pub fn mapped(
        origin: DVec3,
        direction: DVec3,
        near: f64,
        bounds: &Aabb,
    ) -> (Self, RayReparametrisation) {
        let rebase = RayReparametrisation::new(origin, direction, near, bounds);
        let (moved, scaled) = (origin + direction * rebase.start, direction / rebase.scale);
        // Nothing is met farther from here than the farthest corner.
        let farthest = (moved - bounds.centre()).length() + bounds.extent().length();
        // A component that is next to nothing is taken for a little more, so that none of the
        // bounds is infinite.
        let scaled = scaled.map(|d| {
            if d.abs() < LEAST {
                LEAST.copysign(d)
            } else {
                d
            }
        });
        let wrong = moved.abs() * f64::from(U)
            + (origin.abs() + (direction * rebase.start).abs()) * (8.0 * f64::from(W))
            + farthest * (2.0 * LEAST);
        let near = greater(rebase.rebased(near).next_down(), 0.0);
        let setup = Self::new(
            moved.as_vec3().to_array(),
            scaled.as_vec3().to_array(),
            near,
        );
        (
            setup.widened(wrong.as_vec3().to_array(), wrong.element_sum() as f32),
            rebase,
        )
    }

    /// What [`TraversalRay::mapped`] makes of a ray of the world by f32 alone, and where it starts:
    /// `wrong` is larger, since it has the rounding of the map in it, and so is what the direction
    /// is wrong by, which counts over the way to what is there and through it, and which takes E²
    /// times as much from a determinant.
    #[inline(always)]
    pub fn roughly_mapped(
        inverse: &RoughInverse,
        ray: &PreparedRay,
        near: f32,
        bounds: &BoundingSphere,
    ) -> RoughRay {
        let stored = |v: DVec3| [v.x as f32, v.y as f32, v.z as f32];
        let ([o, d], [origin_error, direction_error]) =
            inverse.ray(stored(ray.origin), stored(ray.direction));
        let dot = |a: [f32; 3], b: [f32; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let (squared, [x, y, z]) = (dot(d, d), bounds.centre);
        let shorter = 1.0 / squared.sqrt();
        // The sphere is larger than what is in it, by more than what is wrong of the way to it.
        let (middle, half) = (
            dot([x - o[0], y - o[1], z - o[2]], d) * (shorter * shorter),
            bounds.radius * shorter,
        );
        let start = greater(middle - half, near - near.abs() * (4.0 * U));
        let wrong = origin_error + direction_error * (start.abs() + 2.0 * half);
        if !(wrong <= bounds.radius * 0.01 && squared > SHORT && squared < 1.0 / SHORT) {
            return RoughRay::TooRough;
        }
        let nearest = [
            o[0] + d[0] * middle - x,
            o[1] + d[1] * middle - y,
            o[2] + d[2] * middle - z,
        ];
        if dot(nearest, nearest) > bounds.radius * bounds.radius {
            return RoughRay::Misses;
        }
        let moved = [
            o[0] + d[0] * start,
            o[1] + d[1] * start,
            o[2] + d[2] * start,
        ];
        let direction = d.map(|d| greater(d.abs(), LEAST as f32).copysign(d));
        let setup = Self::new(moved, direction, greater((near - start).next_down(), 0.0))
            .widened([wrong; 3], 3.0 * wrong);
        let determinant = setup.aim.determinant + 6.0 * direction_error;
        RoughRay::Meets(
            Self {
                aim: LeafRay {
                    determinant,
                    ..setup.aim
                },
                ..setup
            },
            start,
        )
    }

    /// The same for a ray that is wrong by so much in each component of its origin, and by so much
    /// at most in all.
    #[inline(always)]
    fn widened(self, wrong: [f32; 3], all: f32) -> Self {
        let Self { slopes, aim } = self;
        let early: [f32; 3] =
            core::array::from_fn(|axis| wrong[axis] * 2.01 * slopes.inverse[axis].abs());
        let slopes = BoxRay {
            widened: slopes.inverse.map(|i| i * (1.0 + 16.0 * U)),
            early,
            late: early.map(|early| early + slopes.late[0]),
            ..slopes
        };
        Self {
            slopes,
            aim: LeafRay {
                reach: aim.reach + all * (0.1 * ROUNDED / U),
                ..aim
            },
        }
    }

    /// A far end as boxes use it, later by what the rounding of their distances may take.
    #[inline(always)]
    pub fn last(far: f32) -> f32 {
        far + far.abs() * (8.0 * U)
    }
}

/// How a walk in f32 counts distances along a ray of an instance's space: from where it starts and
/// in its unit. A distance t is (t − start) · scale to the walk.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct RayReparametrisation {
    pub start: f64,
    /// A power of two.
    pub scale: f64,
}

impl RayReparametrisation {
    /// Starts where the ray comes to the sphere around the box, or at `near` where that is later,
    /// so that no distance that counts is below zero. Steps are of about unit length.
    pub fn new(origin: DVec3, direction: DVec3, near: f64, bounds: &Aabb) -> Self {
        let squared = direction.length_squared();
        let (middle, length) = (
            (bounds.centre() - origin).dot(direction) / squared,
            squared.sqrt(),
        );
        let sphere = middle - (bounds.extent().length() * 0.51 / length + middle.abs() * 1e-12);
        // What is stored as more than `near` may be that much less.
        let start = sphere.max(near - near.abs() * (2.0 * f64::from(U)));
        // The greatest power of two that is not above the length: its exponent alone.
        let scale = f64::from_bits(length.to_bits() & 0x7ff << 52);
        let sane = start.is_finite() && scale.is_normal();
        if sane {
            Self { start, scale }
        } else {
            Self {
                start: 0.0,
                scale: 1.0,
            }
        }
    }

    /// A distance as the walk has it, rounded to the nearest.
    pub fn rebased(&self, t: f64) -> f32 {
        ((t - self.start) * self.scale) as f32
    }

    /// A far end: later than all that rounds to a stored distance up to it.
    pub fn far(&self, t: f32) -> f32 {
        let t = f64::from(t);
        self.rebased(t + (t.abs() + self.start.abs()) * (2.0 * f64::from(U)))
            .next_up()
    }
}
