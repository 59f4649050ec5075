//! Instances: geometries placed by a transform.

use glam::DAffine3;

use crate::aabb::{Aabb, BoundingSphere};
use crate::error::{GeometryError, check_bounds};
use crate::shapes::{Transform, transform_bounds};

/// Motion index of an instance at rest, beyond the end of any list of motions.
const NO_MOTION: u32 = u32::MAX;

/// An instance: one of the parts of a primitive set, placed in the world by an affine map. A part
/// is a geometry of its own.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(crate) struct Instance {
    /// World-to-object map for box tests. It is the first field, so that most rays read only one
    /// cache line of the instance.
    pub to_object: ApproximateInverse,
    /// Index of the instanced geometry among the set's parts.
    pub part: u32,
    /// Index of the instance's motion; `NO_MOTION` for an instance at rest. The field occupies
    /// alignment padding, so it costs no memory.
    pub motion: u32,
    /// Object-to-world map; for a moving instance, the map at time 0.
    pub transform: Transform,
    /// World-space box around the instance at all times; `None` if the part is unbounded.
    pub bounds: Option<Aabb>,
}

impl Instance {
    /// Creates an instance at rest. `bounds` is the object-space box of the part; `None` if the
    /// part is unbounded.
    pub fn new(part: u32, bounds: Option<Aabb>, to_world: DAffine3) -> Result<Self, GeometryError> {
        let transform = Transform::new(to_world).ok_or(GeometryError::Singular)?;
        // An empty box stays empty. The map would turn its infinite corners into NaN, and a NaN box
        // is refused as too large.
        let mapped = |b: Aabb| {
            if b.is_empty() {
                Aabb::EMPTY
            } else {
                transform_bounds(&to_world, &b)
            }
        };
        let to_object = ApproximateInverse::new(&transform);
        Ok(Self {
            to_object,
            part,
            motion: NO_MOTION,
            transform,
            bounds: check_bounds(bounds.map(mapped))?,
        })
    }

    /// Creates a moving instance, whose map is interpolated from the first map at time 0 to the
    /// second at time 1. Each point moves along a line segment. So the union of the boxes at both
    /// times is the smallest box that contains the instance at every time.
    pub fn new_moving(
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
            to_object: ApproximateInverse::NONE,
            motion,
            bounds: check_bounds(both)?,
            ..start
        })
    }

    /// Returns the intersection of the instance's world-space box `bounds` with the box around the
    /// part's mapped bounding sphere. For a rotated part the sphere's box may be smaller. A moving
    /// instance keeps `bounds`.
    pub fn tighten_bounds(&self, bounds: Aabb, sphere: &BoundingSphere) -> Aabb {
        if bounds.is_empty() || self.motion != NO_MOTION {
            return bounds;
        }
        let both = bounds.intersection(self.transform.transform_sphere_bounds(sphere));
        // Where the sphere's box is NaN or too large, the box stays unchanged.
        if both.is_empty() { bounds } else { both }
    }
}

/// World-to-object map in f32 with an error bound, for box tests.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ApproximateInverse {
    /// Columns of the world-to-object matrix.
    columns: [[f32; 3]; 3],
    /// Translation of the object-to-world map. A point is mapped as its offset from this
    /// translation.
    translation: [f32; 3],
    /// Rounding error of the stored translation, subtracted from that offset.
    translation_error: [f32; 3],
    /// Error bound of a mapped vector, per component, divided by the sum of the absolute components
    /// of the vector before the map.
    error: f32,
}

impl ApproximateInverse {
    /// Result for a transform that f32 can't represent. Every mapped ray is NaN, so the caller maps
    /// the ray in f64 instead.
    const NONE: Self = Self {
        columns: [[f32::NAN; 3]; 3],
        translation: [0.0; 3],
        translation_error: [0.0; 3],
        error: f32::NAN,
    };
    /// Range of the inverse's greatest entry in which this map is used. Within it, products of
    /// entries and coordinates keep full precision. The upper end also limits the translation.
    const SIZES: [f64; 2] = [1e-12, 1e12];

    /// Creates the map, or [`Self::NONE`] outside the range [`Self::SIZES`]. With u = 2⁻²⁴, the
    /// relative error of a mapped ray has these terms:
    ///
    /// - u for a rounded entry,
    /// - 2 u for the difference from the translation,
    /// - 3 u for products and their sums,
    /// - 2 u for later computations with the ray.
    ///
    /// Their sum of 8 u is multiplied by 1.5. This factor covers the rounding of the translation,
    /// which is stored in two parts.
    fn new(transform: &Transform) -> Self {
        let (inverse, translation) = (transform.inverse, transform.to_world.translation);
        let columns = [inverse.x_axis, inverse.y_axis, inverse.z_axis];
        let largest = columns
            .iter()
            .fold(0.0_f64, |all, column| all.max(column.abs().max_element()));
        let [minimum, maximum] = Self::SIZES;
        if !(largest > minimum && largest < maximum && translation.abs().max_element() < maximum) {
            return Self::NONE;
        }
        Self {
            columns: columns.map(|column| column.as_vec3().to_array()),
            translation: translation.as_vec3().to_array(),
            translation_error: (translation - translation.as_vec3().as_dvec3())
                .as_vec3()
                .to_array(),
            error: (largest * (12.0 * f64::from(f32::EPSILON) * 0.5)) as f32,
        }
    }

    /// Maps a world-space ray, exact in f32, to object space. Returns the mapped origin and
    /// direction, and an error bound of each: the greatest error of a component.
    #[inline(always)]
    pub fn map_ray(&self, origin: [f32; 3], direction: [f32; 3]) -> ([[f32; 3]; 2], [f32; 2]) {
        let ([x, y, z], [a, b, c], [i, j, k]) =
            (&self.columns, self.translation, self.translation_error);
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
