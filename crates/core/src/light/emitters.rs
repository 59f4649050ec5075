//! Area lights: emissive objects, sampled by points on their surfaces. If a path hits an emissive
//! object, its emitter is looked up here.

mod emission_cells;
mod emitter_point;
mod hard_shadow;
mod lanes;
mod list;
mod sample;

use core::f64::consts::PI;
use core::ops::Range;

use raywright_bvh::shapes::AnyShape;
use raywright_bvh::{Geometry, Real, Shape, Side, Surface, TriangleSlot, Vector};

use super::LightBounds;
use super::cdf::{entry_probability, push_cdf, sample_index};

pub(super) use lanes::EmitterLanes;
pub use list::{EmissionEstimate, EmitterList};
use list::{Emitter, EmitterShape};

/// Strategy for sampling points of an emitter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EmitterStrategy {
    /// Uniform by area, for any surface and receiver.
    #[default]
    Area,
    /// Uniform by solid angle for triangles, quads, and spheres seen from outside; uniform by area
    /// for other shapes. Solid-angle sampling removes the noise of varying distances and cosines.
    SolidAngle,
}

/// A point of an emissive surface, with the direction of the ray that hit it. The emitted radiance
/// is evaluated for this point and direction.
#[derive(Clone, Copy, Debug)]
pub struct EmissionPoint<R: Real> {
    /// The point.
    pub surface: Surface<R>,
    /// Texture coordinates, read only by varying emission.
    pub uv: [R; 2],
    /// Unit direction of the ray.
    pub direction: R::Vec3,
}

/// Sampler of a scene's emitters in proportion to their power, built from an [`EmitterList`].
#[derive(Clone, Debug)]
pub struct Emitters<R: Real> {
    /// All emitters in order of object and primitive, even those without power. The emitter of a
    /// hit is found by this order.
    list: EmitterList<R>,
    /// Cumulative distribution of the emitters' power. The value is 1 from the last emitter of
    /// positive power on. Empty if no emitter has power.
    cumulative: Vec<f64>,
    /// Number of emitters of positive power.
    lit: usize,
    /// Triangles of each emitter in the accelerator, for shadow rays that end on the emitter. Empty
    /// before [`Emitters::find_triangles`].
    triangles: Vec<[TriangleSlot; 2]>,
    /// Strategy for sampling points of emitters.
    pub strategy: EmitterStrategy,
}

impl<R: Real> Emitters<R> {
    /// Builds the tables of all emitters. The tables are empty if no emitter has power.
    pub fn new(list: EmitterList<R>) -> Self {
        let powers: Vec<f64> = list.emitters.iter().map(Emitter::power).collect();
        let of_quad = |i: usize| i - usize::from(list.emitters[i].is_second);
        let lit = (0..powers.len())
            .filter(|&i| powers[of_quad(i)] > 0.0)
            .count();
        if lit == 0 {
            return Self {
                list: EmitterList::default(),
                cumulative: Vec::new(),
                lit,
                triangles: Vec::new(),
                strategy: EmitterStrategy::default(),
            };
        }
        let mut cumulative = Vec::with_capacity(powers.len());
        push_cdf(&mut cumulative, &powers);
        Self {
            list,
            cumulative,
            lit,
            triangles: Vec::new(),
            strategy: EmitterStrategy::default(),
        }
    }

    /// Finds each emitter's triangles in the accelerator.
    pub fn find_triangles(&mut self, geometry: &Geometry<R>) {
        if self.is_empty() {
            return;
        }
        let mut triangles = vec![[TriangleSlot::NONE; 2]; self.len()];
        for (slot, object, primitive) in geometry.triangle_slots() {
            if let Some(emitter) = self.emitter_index_of(object, primitive) {
                let [first, second] = &mut triangles[emitter as usize];
                let is_second = *first != TriangleSlot::NONE;
                *(if is_second { second } else { first }) = slot;
            }
        }
        self.triangles = triangles;
    }

    /// Returns the triangles of an emitter in the accelerator: the two halves of a mesh's quad, a
    /// single triangle, or none.
    #[inline(always)]
    pub fn triangles(&self, index: u32) -> [TriangleSlot; 2] {
        self.triangles
            .get(index as usize)
            .map_or([TriangleSlot::NONE; 2], |&triangles| triangles)
    }

    /// Returns the number of emissive shapes and triangles, even those without power.
    pub fn len(&self) -> usize {
        self.list.emitters.len()
    }

    /// Returns the number of emissive shapes and triangles of positive power.
    pub fn powered_count(&self) -> usize {
        self.lit
    }

    /// Whether no emitter has power.
    pub fn is_empty(&self) -> bool {
        self.cumulative.is_empty()
    }

    /// Returns the index of the emitter for a primitive of an object. `primitive` is the index of a
    /// triangle in its mesh, or 0 for a shape. Both triangles of a quad have the same emitter.
    /// `None` if the object does not emit.
    pub fn emitter_index_of(&self, object: u32, primitive: u32) -> Option<u32> {
        let start = *self.list.first_emitters.get(object as usize)?;
        let end = self
            .list
            .first_emitters
            .get(object as usize + 1)
            .map_or(self.len() as u32, |&end| end);
        let index = start.checked_add(primitive).filter(|&index| index < end)?;
        Some(index - u32::from(self.list.emitters[index as usize].is_second))
    }

    /// Iterates over the emissive objects: the object's index and the range of its emitters.
    pub fn emitters_by_object(&self) -> impl Iterator<Item = (usize, Range<u32>)> {
        let starts = self.list.first_emitters.iter().copied();
        let ends = starts.clone().skip(1).chain([self.len() as u32]);
        starts
            .zip(ends)
            .map(|(start, end)| start..end)
            .enumerate()
            .filter(|(_, emitters)| !emitters.is_empty())
    }

    /// Iterates over the emissive objects, each with its area, its power and the greatest radiance
    /// of its emitters, the mean of three channels.
    pub fn areas_and_powers(&self) -> impl Iterator<Item = (usize, f64, f64, f64)> {
        self.emitters_by_object().map(|(object, emitters)| {
            let all = &self.list.emitters[emitters.start as usize..emitters.end as usize];
            let radiance = all
                .iter()
                .map(|emitter| emitter.radiance.to_f64().element_sum() / 3.0)
                .fold(0.0, f64::max);
            let area = all.iter().map(|emitter| emitter.area).sum();
            let power = all.iter().map(Emitter::power).sum();
            (object, area, power, radiance)
        })
    }

    /// Samples an emitter in proportion to power, by two uniform numbers in [0, 1). Returns the
    /// emitter and its probability; `None` if no emitter has power.
    ///
    /// A single `f32` number has steps of 2⁻²³. With that number alone, faint emitters among a
    /// million would be sampled always or never.
    pub fn sample_emitter(&self, [coarse, fine]: [f32; 2]) -> Option<(u32, f64)> {
        const STEP: f64 = 1.0 / (1 << 23) as f64;
        if self.is_empty() {
            return None;
        }
        let (index, probability, _) =
            sample_index(&self.cumulative, f64::from(coarse) + f64::from(fine) * STEP);
        Some((index as u32, probability))
    }

    /// Returns the probability with which [`Emitters::sample_emitter`] returns an emitter.
    pub fn probability(&self, index: u32) -> f64 {
        entry_probability(&self.cumulative, index as usize)
    }

    /// Bytes of the tables.
    pub(crate) fn bytes(&self) -> u64 {
        let list = &self.list;
        EmitterList::<R>::estimate_bytes(
            self.len() as u64,
            list.transformed_shapes.len() as u64,
            list.first_emitters.len() as u64,
            [0; 2],
        ) + list.cells.bytes()
    }

    /// Returns the number of emitters with a transform.
    #[cfg(test)]
    pub(crate) fn transformed_count(&self) -> usize {
        self.list.transformed_shapes.len()
    }

    /// Whether the emission varies over the emitter's surface. For such an emitter,
    /// [`Emitters::sample`] assumes a radiance of 1, and the caller evaluates the emission.
    pub fn has_varying_emission(&self, index: u32) -> bool {
        self.list.emitters[index as usize].varies
    }

    /// Whether an emitter is flat: a ray hits it at most once.
    pub fn is_flat(&self, index: u32) -> bool {
        is_flat(match &self.list.emitters[index as usize].shape {
            EmitterShape::Plain(shape) => shape,
            EmitterShape::Transformed(i) => self.list.transformed_shapes[*i as usize].shape(),
        })
    }

    /// Returns the radiance emitted at a hit, towards the ray's origin; zero on a side that does
    /// not emit.
    pub fn radiance(&self, index: u32, exit: &EmissionPoint<R>) -> R::Vec3 {
        let emitter = &self.list.emitters[index as usize];
        let from_outside = exit.direction.dot(exit.surface.normal) < R::ZERO;
        if emitter.side.accepts(from_outside) {
            emitter.radiance
        } else {
            Vector::ZERO
        }
    }

    /// Returns the flux of an emitter, summed over the three channels.
    pub fn power(&self, index: u32) -> f64 {
        PI * self.list.emitters[index as usize].power()
    }

    /// Returns the bounds of an emitter's positions and directions; `None` for an infinite surface,
    /// which is not sampled.
    pub fn bounds(&self, index: u32) -> Option<LightBounds> {
        let emitter = &self.list.emitters[index as usize];
        let half = R::from_f64(0.5);
        let (space, shape, drawn) = match &emitter.shape {
            EmitterShape::Plain(shape) => (shape.bounds()?, shape, shape.sample_area(half, half)),
            EmitterShape::Transformed(i) => {
                let transformed_shape = &self.list.transformed_shapes[*i as usize];
                (
                    transformed_shape.bounds()?,
                    transformed_shape.shape(),
                    transformed_shape.sample_area(half, half),
                )
            }
        };
        let normal = drawn
            .map(|(anywhere, _)| anywhere.normal.to_f64())
            .filter(|n| is_flat(shape) && n.is_finite());
        Some(match (normal, emitter.side) {
            (Some(normal), Side::Outside) => LightBounds::for_flat_surface(space, normal),
            (Some(normal), Side::Inside) => LightBounds::for_flat_surface(space, -normal),
            _ => LightBounds::for_curved_surface(space),
        })
    }
}

fn is_flat<R: Real>(shape: &AnyShape<R>) -> bool {
    matches!(
        shape,
        AnyShape::Disk(_) | AnyShape::Quad(_) | AnyShape::Triangle(_)
    )
}

#[cfg(test)]
mod tests;
