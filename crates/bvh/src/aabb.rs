//! Axis-aligned boxes in f64, and the padded f32 boxes that a tree stores.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Number of boxes for each parallel task. No result depends on it.
pub(crate) const TASK_SIZE: usize = 4096;

/// A closed axis-aligned box in f64; empty if `min` exceeds `max` in any axis.
#[derive(Clone, Copy, Debug, PartialEq)]
#[doc(alias("RTCBounds", "Bounds3f"))]
pub struct Aabb {
    /// Least corner.
    pub min: DVec3,
    /// Greatest corner.
    pub max: DVec3,
}

impl Aabb {
    /// Empty box: its union with any box is that box.
    pub const EMPTY: Self = Self {
        min: DVec3::INFINITY,
        max: DVec3::NEG_INFINITY,
    };

    /// Creates the smallest box around points. If any coordinate is NaN, all six bounds are NaN. A
    /// box that ignored the NaN might not contain its primitive.
    pub fn from_points(points: impl IntoIterator<Item = DVec3>) -> Self {
        let (mut min, mut max, mut is_number) = (Self::EMPTY.min, Self::EMPTY.max, true);
        // One comparison per bound: `min` and `max` of floats would also check for NaN.
        for point in points {
            min = DVec3::select(point.cmplt(min), point, min);
            max = DVec3::select(point.cmpgt(max), point, max);
            is_number &= !point.is_nan();
        }
        if is_number {
            Self { min, max }
        } else {
            Self {
                min: DVec3::NAN,
                max: DVec3::NAN,
            }
        }
    }

    /// Creates the box around a shape from its support function: the maximum of p·direction over
    /// all points p of the shape. `None` if the function returns `None` for an axis.
    pub fn from_support(support: impl Fn(DVec3) -> Option<f64>) -> Option<Self> {
        let along = |d: DVec3| {
            Some(DVec3::new(
                support(d * DVec3::X)?,
                support(d * DVec3::Y)?,
                support(d * DVec3::Z)?,
            ))
        };
        Some(Self {
            min: -along(DVec3::NEG_ONE)?,
            max: along(DVec3::ONE)?,
        })
    }

    /// Creates the box from `centre − half` to `centre + half`.
    pub fn from_centre(centre: DVec3, half: DVec3) -> Self {
        Self {
            min: centre - half,
            max: centre + half,
        }
    }

    /// Returns the smallest box around two boxes.
    pub fn union(self, other: Self) -> Self {
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
        }
    }

    /// Whether the box contains no point.
    pub fn is_empty(&self) -> bool {
        !(self.min.x <= self.max.x && self.min.y <= self.max.y && self.min.z <= self.max.z)
    }

    /// Whether the box can contain a surface: two of its edges have a length.
    pub fn has_area(&self) -> bool {
        self.extent().cmpgt(DVec3::ZERO).bitmask().count_ones() >= 2
    }

    /// Centre of the box.
    pub fn centre(&self) -> DVec3 {
        (self.min + self.max) * 0.5
    }

    /// Edge lengths of the box along x, y, z.
    pub fn extent(&self) -> DVec3 {
        self.max - self.min
    }

    /// Returns the intersection of two boxes.
    pub(crate) fn intersection(self, other: Self) -> Self {
        Self {
            min: self.min.max(other.min),
            max: self.max.min(other.max),
        }
    }

    /// Returns the eight corners.
    pub fn corners(&self) -> [DVec3; 8] {
        core::array::from_fn(|i| {
            let pick = |bit: usize, a: f64, b: f64| if i >> bit & 1 == 0 { a } else { b };
            DVec3::new(
                pick(0, self.min.x, self.max.x),
                pick(1, self.min.y, self.max.y),
                pick(2, self.min.z, self.max.z),
            )
        })
    }

    /// Converts to the f32 box for box tests; `None` for an empty box, or if a bound is not a
    /// finite f32. No tree can hold a primitive without such a box.
    ///
    /// Each side is moved outwards by 2⁻²³ of the greatest extent, plus 2⁻²¹ of the bound's
    /// absolute value. The second term exceeds the rounding to f32. In measurements this padding
    /// was enough for a watertight triangle test. It also gives flat boxes a thickness: builders
    /// that sort boxes by Morton codes degenerate on closed rooms of flat boxes.
    pub fn to_padded(&self) -> Option<PaddedBox> {
        if self.is_empty() {
            return None;
        }
        let ulp = f64::from(f32::EPSILON);
        let extent = self.extent().max_element();
        let pad = |v: DVec3| {
            v.abs() * (4.0 * ulp) + DVec3::splat(extent * ulp + f64::from(f32::MIN_POSITIVE))
        };
        let (min, max) = (
            (self.min - pad(self.min)).as_vec3(),
            (self.max + pad(self.max)).as_vec3(),
        );
        (min.is_finite() && max.is_finite()).then_some(PaddedBox { min, max })
    }
}

/// Bounding sphere of boxes. Its radius is three percent greater than needed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BoundingSphere {
    pub centre: [f32; 3],
    pub radius: f32,
}

impl BoundingSphere {
    /// Creates the sphere around `centre` that contains all boxes, with a margin of three percent
    /// of the radius.
    pub fn new(centre: DVec3, boxes: &[PaddedBox]) -> Self {
        let farthest = |bounds: &PaddedBox| {
            (bounds.max.as_dvec3() - centre)
                .max(centre - bounds.min.as_dvec3())
                .length_squared()
        };
        let radius = boxes
            .par_iter()
            .with_min_len(TASK_SIZE)
            .map(farthest)
            .reduce(|| 0.0, f64::max)
            .sqrt();
        // The margin also covers the rounding of the stored centre to f32.
        let radius = radius * 1.03 + centre.length() * (4.0 * f64::from(f32::EPSILON));
        Self {
            centre: centre.as_vec3().to_array(),
            radius: radius as f32,
        }
    }
}

/// An f32 box that contains its primitive with a margin for the rounding errors of a traversal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PaddedBox {
    /// Least corner.
    pub min: Vec3,
    /// Greatest corner.
    pub max: Vec3,
}

impl PaddedBox {
    /// Empty box: its union with any box is that box.
    pub(crate) const EMPTY: Self = Self {
        min: Vec3::INFINITY,
        max: Vec3::NEG_INFINITY,
    };

    /// Returns the smallest box around two boxes.
    pub(crate) fn union(&self, other: &Self) -> Self {
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
        }
    }
}

/// Computes half the surface area of a box, in f32.
pub(crate) fn half_area(bounds: &PaddedBox) -> f32 {
    let e = bounds.max - bounds.min;
    e.x * e.y + e.y * e.z + e.z * e.x
}
