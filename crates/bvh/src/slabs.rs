//! Boxes four at a time, and the test of a ray against them.
//!
//! It is conservative (padded boxes, exit scaled as in "Robust BVH Ray Traversal", Ize 2013): it decides which primitives are
//! tested and never which one is hit.

use crate::aabb::PaddedBox;
use crate::lanes::Four;
use crate::ray::Ray;
use crate::scalar::{Real, Vector};

/// Boxes side by side.
pub(crate) const WIDTH: usize = 4;

/// Four boxes, one array a plane: `planes[side][axis][lane]` with side 0 the minima.
#[derive(Clone, Debug)]
pub(crate) struct FourBoxes {
    planes: [[[f32; WIDTH]; 3]; 2],
}

impl FourBoxes {
    /// Inverted boxes: absent ones, which no ray of finite numbers enters.
    pub const EMPTY: Self = Self { planes: [[[f32::INFINITY; WIDTH]; 3], [[f32::NEG_INFINITY; WIDTH]; 3]] };

    /// Puts a box into a lane.
    pub fn set(&mut self, lane: usize, bounds: &PaddedBox) {
        for axis in 0..3 {
            self.planes[0][axis][lane] = bounds.min[axis];
            self.planes[1][axis][lane] = bounds.max[axis];
        }
    }
}

/// What the box tests of a ray share.
pub(crate) struct Slabs<R: Real> {
    near: R::Four,
    origin: [R::Four; 3],
    inverse: [R::Four; 3],
    /// The same, widened by 1 + 2γ(3), for the planes through which the ray leaves: the three roundings of a slab distance
    /// on either side.
    widened: [R::Four; 3],
    /// 0 where the ray enters through the minimum plane: from the sign of the reciprocal actually used, so that −0 is
    /// treated as what it does.
    entry_side: [usize; 3],
}

impl<R: Real> Slabs<R> {
    #[inline(always)]
    pub fn new(ray: &Ray<R>, near: R) -> Self {
        let origin = [ray.origin.x(), ray.origin.y(), ray.origin.z()];
        let inverse = [ray.direction.x(), ray.direction.y(), ray.direction.z()].map(|d| R::ONE / d);
        Self {
            near: R::Four::splat(near),
            origin: origin.map(R::Four::splat),
            inverse: inverse.map(R::Four::splat),
            widened: inverse.map(|i| R::Four::splat(i * Self::widen())),
            entry_side: inverse.map(|i| usize::from(i < R::ZERO)),
        }
    }

    /// 1 + 2γ(3): the three roundings of a slab distance on either side.
    #[inline(always)]
    pub fn widen() -> R {
        R::ONE + R::ROUNDOFF * R::from_f64(8.0)
    }

    /// The distance of the first lane, as it is: only f32, whose distances a tree keeps unrounded, asks for it.
    #[inline(always)]
    pub fn first(entry: R::Four) -> R {
        R::from_f32(entry.below()[0])
    }

    /// Which boxes the ray enters before `far`, a bit each, and where.
    ///
    /// A ray in a slab's plane gives 0·∞ = NaN there: the comparisons are written so that NaN keeps the other bound.
    #[inline(always)]
    pub fn enter(&self, boxes: &FourBoxes, far: R) -> (u32, R::Four) {
        let (mut entry, mut exit) = (self.near, R::Four::splat(far * Self::widen()));
        for axis in 0..3 {
            let (o, side) = (self.origin[axis], self.entry_side[axis]);
            entry = ((R::Four::from_f32(&boxes.planes[side][axis]) - o) * self.inverse[axis]).or_greater(entry);
            exit = ((R::Four::from_f32(&boxes.planes[1 - side][axis]) - o) * self.widened[axis]).or_less(exit);
        }
        (entry.at_most(exit), entry)
    }
}
