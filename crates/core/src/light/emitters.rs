//! Surfaces that light others: emissive objects whose points are drawn, and found again where a ray
//! meets them.

mod cells;
mod lanes;
mod list;
mod middle;
mod point;
mod sample;

use core::f64::consts::PI;
use core::ops::Range;

use raywright_bvh::shapes::AnyShape;
use raywright_bvh::{Real, Shape, Side, Surface, Vector};

use super::LightBounds;
use super::cdf::{pick, push_shares, share};

pub(super) use lanes::EmitterLanes;
pub use list::{EmissionEstimate, EmitterList};
use list::{Emitter, EmitterShape};

/// How points of a surface are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Strategy {
    /// By area: any surface, from anywhere.
    #[default]
    Area,
    /// Over the solid angle under which it is seen, where that is known (balls from outside,
    /// triangles, quads), by area elsewhere: without the noise that unequal distances and slants
    /// bring.
    SolidAngle,
}

/// Where light leaves an emitter, and along what ray it is seen.
#[derive(Clone, Copy, Debug)]
pub struct Exit<R: Real> {
    /// The point.
    pub surface: Surface<R>,
    /// Its texture coordinates, for emission that varies; an even one reads none.
    pub uv: [R; 2],
    /// Unit direction of the ray that met it.
    pub direction: R::Vec3,
}

/// All emitters of a scene, drawn in proportion to their power.
#[derive(Clone, Debug)]
pub struct Emitters<R: Real> {
    /// One after the other by object and primitive, so that a hit finds its own; those without
    /// power too.
    list: EmitterList<R>,
    /// Running sum of the probabilities, 1 from the last emitter that has power; empty where none
    /// has.
    cumulative: Vec<f64>,
    /// Those that have power.
    lit: usize,
    /// How points are drawn.
    pub strategy: Strategy,
}

impl<R: Real> Emitters<R> {
    /// From what preparation found; empty when nothing of it gives off light.
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
                strategy: Strategy::default(),
            };
        }
        let mut cumulative = Vec::with_capacity(powers.len());
        push_shares(&mut cumulative, &powers);
        Self {
            list,
            cumulative,
            lit,
            strategy: Strategy::default(),
        }
    }

    /// How many shapes and triangles, those without power included.
    pub fn len(&self) -> usize {
        self.list.emitters.len()
    }

    /// How many shapes and triangles have power.
    pub fn lit(&self) -> usize {
        self.lit
    }

    /// Whether nothing gives off light.
    pub fn is_empty(&self) -> bool {
        self.cumulative.is_empty()
    }

    /// The emitter that a primitive of an object belongs to: a triangle of its mesh, alone or with
    /// its other half, or 0 for a shape. None where the object does not light others.
    pub fn of(&self, object: u32, primitive: u32) -> Option<u32> {
        let start = *self.list.first.get(object as usize)?;
        let end = self
            .list
            .first
            .get(object as usize + 1)
            .map_or(self.len() as u32, |&end| end);
        let index = start.checked_add(primitive).filter(|&index| index < end)?;
        Some(index - u32::from(self.list.emitters[index as usize].is_second))
    }

    /// The emitters of each object that has any.
    pub fn objects(&self) -> impl Iterator<Item = (usize, Range<u32>)> {
        let starts = self.list.first.iter().copied();
        let ends = starts.clone().skip(1).chain([self.len() as u32]);
        starts
            .zip(ends)
            .map(|(start, end)| start..end)
            .enumerate()
            .filter(|(_, emitters)| !emitters.is_empty())
    }

    /// The emitter for a pair of numbers in [0, 1), and the probability of drawing it; none where
    /// there is none. Both numbers, because one of f32 has steps of 2⁻²³: of a million emitters the
    /// faint ones would be drawn always or never.
    pub fn choose(&self, [coarse, fine]: [f32; 2]) -> Option<(u32, f64)> {
        const STEP: f64 = 1.0 / (1 << 23) as f64;
        if self.is_empty() {
            return None;
        }
        let (index, probability, _) =
            pick(&self.cumulative, f64::from(coarse) + f64::from(fine) * STEP);
        Some((index as u32, probability))
    }

    /// The probability with which [`Emitters::choose`] draws an emitter.
    pub fn probability(&self, index: u32) -> f64 {
        share(&self.cumulative, index as usize)
    }

    /// Bytes of the tables.
    pub(crate) fn bytes(&self) -> u64 {
        let list = &self.list;
        EmitterList::<R>::bytes_of(
            self.len() as u64,
            list.placed.len() as u64,
            list.first.len() as u64,
            [0; 2],
        ) + list.cells.bytes()
    }

    /// Emitters that need a map of their own.
    #[cfg(test)]
    pub(crate) fn under_maps(&self) -> usize {
        self.list.placed.len()
    }

    /// Whether what an emitter gives off is not the same everywhere: [`Emitters::sample`] then says
    /// what arrives of a radiance of one.
    pub fn varies(&self, index: u32) -> bool {
        self.list.emitters[index as usize].varies
    }

    /// Whether an emitter lies in a plane, so that a ray meets it once at most.
    pub fn is_flat(&self, index: u32) -> bool {
        is_flat(match &self.list.emitters[index as usize].form {
            EmitterShape::Plain(shape) => shape,
            EmitterShape::Placed(i) => self.list.placed[*i as usize].shape(),
        })
    }

    /// Radiance that leaves an emitter where a ray met it; zero on a side that gives off none.
    pub fn radiance(&self, index: u32, exit: &Exit<R>) -> R::Vec3 {
        let emitter = &self.list.emitters[index as usize];
        let from_outside = exit.direction.dot(exit.surface.normal) < R::ZERO;
        if emitter.side.accepts(from_outside) {
            emitter.radiance
        } else {
            Vector::ZERO
        }
    }

    /// Flux of the three channels of an emitter, summed.
    pub fn power(&self, index: u32) -> f64 {
        PI * self.list.emitters[index as usize].power()
    }

    /// Where an emitter is and which way it shines; none for one without end, which lights nothing.
    pub fn bounds(&self, index: u32) -> Option<LightBounds> {
        let emitter = &self.list.emitters[index as usize];
        let half = R::from_f64(0.5);
        let (space, shape, drawn) = match &emitter.form {
            EmitterShape::Plain(shape) => (shape.bounds()?, shape, shape.sample_area(half, half)),
            EmitterShape::Placed(i) => {
                let placed = &self.list.placed[*i as usize];
                (
                    placed.bounds()?,
                    placed.shape(),
                    placed.sample_area(half, half),
                )
            }
        };
        let normal = drawn
            .map(|(anywhere, _)| anywhere.normal.to_f64())
            .filter(|n| is_flat(shape) && n.is_finite());
        Some(match (normal, emitter.side) {
            (Some(normal), Side::Outside) => LightBounds::flat(space, normal),
            (Some(normal), Side::Inside) => LightBounds::flat(space, -normal),
            _ => LightBounds::round(space),
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
