//! Instances: geometries placed by a transform.

use glam::DAffine3;

use crate::aabb::{Aabb, BoundingSphere};
use crate::error::{GeometryError, check_bounds};
use crate::shapes::{Transform, transform_bounds};

/// Motion index of an instance at rest, beyond the end of any list of motions.
const NO_MOTION: u32 = u32::MAX;

/// An instance: a geometry that is placed in the world by an affine map. The geometry is one of the
/// parts of a primitive set.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(crate) struct Instance {
    /// World-to-object map for box tests. It comes first in the struct, so that most rays read only
    /// one cache line.
    pub to_object: ApproximateInverse,
    /// Index of the instanced geometry among the set's parts.
    pub part: u32,
    /// Index of the instance's motion; `NO_MOTION` for an instance at rest. The field fills
    /// padding, so it costs no memory.
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

    /// Creates a moving instance, from the first map at time 0 to the second map at time 1. Each
    /// point moves along the segment between its ends. So the union of the boxes at both ends
    /// contains the instance at every time, and no smaller box does.
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

    /// Tightens the box of the instance for a tree: intersects it with the box of the part's mapped
    /// bounding sphere. The box around a rotated box is larger than its contents need.
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
    /// Translation, which is subtracted from a point first.
    translation: [f32; 3],
    /// Rounding error of the stored translation, subtracted from the point next.
    translation_error: [f32; 3],
    /// Error bound of each component of a mapped vector, as a fraction of the sum of the absolute
    /// components before the map. A point is mapped as its offset from the translation.
    error: f32,
}

impl ApproximateInverse {
    /// Map without a valid inverse: every result is NaN, so the ray is mapped in f64 instead.
    const NONE: Self = Self {
        columns: [[f32::NAN; 3]; 3],
        translation: [0.0; 3],
        translation_error: [0.0; 3],
        error: f32::NAN,
    };
    /// Accepted range of the greatest entry of the inverse. In this range, products of entries and
    /// coordinates keep full precision. The upper end also bounds the translation.
    const SIZES: [f64; 2] = [1e-12, 1e12];

    /// Creates the map. Its relative errors, with u = 2⁻²⁴, are: u for a rounded entry, 2 u for the
    /// difference from the translation, 3 u for products and their sums, and 2 u for the ray made
    /// from these results. A factor of 1.5 covers the error that remains after the translation was
    /// rounded twice.
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

    /// Maps a world-space ray, exact in f32, to object space. Returns the ray, and the error bounds
    /// of a component of its origin and of a component of its direction.
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
