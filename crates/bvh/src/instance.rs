//! What one instance is: which part it shows, and where.

use glam::DAffine3;

use crate::aabb::{Aabb, BoundingSphere};
use crate::error::{GeometryError, check_bounds};
use crate::shapes::{Transform, transform_bounds};

/// No motion: beyond the end of any list of them.
const STILL: u32 = u32::MAX;

/// A part of a group under an affine map.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(crate) struct Instance {
    /// The way back as boxes are asked by it; first, so that most rays read one line.
    pub to_object: RoughInverse,
    /// Which part.
    pub part: u32,
    /// Which of the group's motions; none of them for one that stands still. It lies where the
    /// map's alignment left room, so that those take nothing for it.
    pub motion: u32,
    /// Where it stands, or where its motion starts.
    pub transform: Transform,
    /// In the world, at any time; none where the part has something without bounds.
    pub bounds: Option<Aabb>,
}

impl Instance {
    /// `bounds`: the part's own, none where something in it has no end.
    pub fn new(part: u32, bounds: Option<Aabb>, to_world: DAffine3) -> Result<Self, GeometryError> {
        let transform = Transform::new(to_world).ok_or(GeometryError::Singular)?;
        // Nothing stays nothing, wherever it is: the map would make its infinite corners no
        // numbers, and what is no number has come from something too large.
        let mapped = |b: Aabb| {
            if b.is_empty() {
                Aabb::EMPTY
            } else {
                transform_bounds(&to_world, &b)
            }
        };
        let to_object = RoughInverse::new(&transform);
        Ok(Self {
            to_object,
            part,
            motion: STILL,
            transform,
            bounds: check_bounds(bounds.map(mapped))?,
        })
    }

    /// One that goes from the first map to the second. On the way a point is between its two ends,
    /// so the box around both ends' boxes holds it at any time, and no smaller box would at all of
    /// them.
    pub fn moving(
        part: u32,
        bounds: Option<Aabb>,
        to_world: [DAffine3; 2],
        motion: u32,
    ) -> Result<Self, GeometryError> {
        let [start, end] = to_world.map(|map| Self::new(part, bounds, map));
        let (start, end) = (start?, end?);
        let both = start
            .bounds
            .zip(end.bounds)
            .map(|(start, end)| start.union(end));
        Ok(Self {
            to_object: RoughInverse::NONE,
            motion,
            bounds: check_bounds(both)?,
            ..start
        })
    }

    /// A box around it that is no larger than its own, for a tree: what of that is in the box
    /// around the sphere of its part, too. The box of a turned box is larger than what is in it
    /// needs.
    pub fn within(&self, own: Aabb, sphere: &BoundingSphere) -> Aabb {
        if own.is_empty() || self.motion != STILL {
            return own;
        }
        let both = own.intersection(self.transform.sphere_bounds(sphere));
        // Numbers that are none, or too large, leave the box as it is.
        if both.is_empty() { own } else { both }
    }
}

/// The inverse of a map in f32, right to its rounding, as boxes are asked by it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RoughInverse {
    columns: [[f32; 3]; 3],
    /// What is taken from a point first, and then what rounding has left of that.
    translation: [f32; 3],
    rest: [f32; 3],
    /// A component of what is mapped is wrong by this much of the sum of the components' sizes at
    /// most, a point's counted from the translation.
    error: f32,
}

impl RoughInverse {
    /// No inverse: whatever it maps is no number.
    const NONE: Self = Self {
        columns: [[f32::NAN; 3]; 3],
        translation: [0.0; 3],
        rest: [0.0; 3],
        error: f32::NAN,
    };
    /// The greatest entry of an inverse, and the size of a translation, within which products with
    /// coordinates have all their digits.
    const SIZES: [f64; 2] = [1e-12, 1e12];

    /// An entry is wrong by u of itself, u = 2⁻²⁴, a difference from the translation by 2 u,
    /// products and their sums by 3 u, and what a ray is made of that by 2 u more. Half as much
    /// again covers what twice rounding leaves of a translation, too.
    fn new(transform: &Transform) -> Self {
        let (inverse, translation) = (transform.inverse, transform.to_world.translation);
        let columns = [inverse.x_axis, inverse.y_axis, inverse.z_axis];
        let largest = columns
            .iter()
            .fold(0.0_f64, |all, column| all.max(column.abs().max_element()));
        let [least, most] = Self::SIZES;
        if !(largest > least && largest < most && translation.abs().max_element() < most) {
            return Self::NONE;
        }
        Self {
            columns: columns.map(|column| column.as_vec3().to_array()),
            translation: translation.as_vec3().to_array(),
            rest: (translation - translation.as_vec3().as_dvec3())
                .as_vec3()
                .to_array(),
            error: (largest * (12.0 * f64::from(f32::EPSILON) * 0.5)) as f32,
        }
    }

    /// A ray of the world that f32 has exactly in the object's space, and by how much a component
    /// is wrong of its origin, and of its direction.
    #[inline(always)]
    pub fn ray(&self, origin: [f32; 3], direction: [f32; 3]) -> ([[f32; 3]; 2], [f32; 2]) {
        let ([x, y, z], [a, b, c], [i, j, k]) = (&self.columns, self.translation, self.rest);
        let offset = [origin[0] - a - i, origin[1] - b - j, origin[2] - c - k];
        let times = |v: [f32; 3]| {
            let one = |axis: usize| x[axis] * v[0] + y[axis] * v[1] + z[axis] * v[2];
            [one(0), one(1), one(2)]
        };
        let size = |v: [f32; 3]| v[0].abs() + v[1].abs() + v[2].abs();
        (
            [times(offset), times(direction)],
            [self.error * size(offset), self.error * size(direction)],
        )
    }
}
