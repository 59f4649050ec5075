//! Rays that leave one point, as those of a pinhole camera do: asked together, they find what each would find alone.

use super::Found;
use crate::accelerator::Accelerator;
use crate::geometry::Geometry;
use crate::ray::{Hit, Interval, Ray};
use crate::scalar::{Precision, Real, Vec3Of, Vector};
use crate::shapes::Probe;
use crate::wide::{Meets, Pencil, RAYS};

/// Fewer rays are asked one by one.
const FEWEST: usize = 4;

/// Rays from one point.
#[derive(Clone, Copy, Debug)]
pub struct FromOnePoint<'a, R: Real> {
    /// Where all of them start, in world units.
    pub origin: R::Vec3,
    /// Unit directions. Those that follow one another should be near one another: up to sixteen are asked together.
    pub directions: &'a [R::Vec3],
    /// When they are asked, see [`Ray::time`].
    pub time: R,
    /// Where hits count.
    pub range: Interval<R>,
}

impl<R: Real> FromOnePoint<'_, R> {
    fn ray(&self, direction: R::Vec3) -> Ray<R> {
        Ray::new(self.origin, direction).at_time(self.time)
    }
}

impl<P: Precision> Geometry<P> {
    /// The nearest hit of each ray, in their order, in place of what `hits` held: those of [`Geometry::closest`], bit for bit.
    pub fn closest_from(&self, rays: &FromOnePoint<'_, P::Real>, hits: &mut Vec<Option<Hit<P::Real>>>) {
        hits.clear();
        hits.reserve(rays.directions.len());
        for some in rays.directions.chunks(RAYS) {
            if some.len() < FEWEST || !self.together(rays, some, hits) {
                hits.extend(some.iter().map(|&direction| self.closest(&rays.ray(direction), rays.range, &mut ())));
            }
        }
    }

    /// Up to [`RAYS`] of them at once; false where that is not to be done, and nothing was.
    #[inline(never)]
    fn together(&self, rays: &FromOnePoint<'_, P::Real>, directions: &[Vec3Of<P>], hits: &mut Vec<Option<Hit<P::Real>>>) -> bool {
        let Accelerator::Wide(wide, _) = &self.accelerator else { return false };
        let mut stored = [glam::Vec3::ZERO; RAYS];
        stored.iter_mut().zip(directions).for_each(|(to, from)| *to = from.to_f32());
        let last = rays.range.max.next_down().to_f32();
        let mut pencil = Pencil::new(rays.origin.to_f32(), &stored[..directions.len()], rays.range.min.to_f32(), last);
        let mut asking = Asking { geometry: self, rays, directions };
        if !wide.ask_pencil(&mut pencil, &mut asking) {
            return false;
        }
        for slot in self.planes..self.unbounded {
            asking.one_by_one(slot, u32::MAX, &mut pencil);
        }
        let number = P::Real::from_f32;
        hits.extend((0..pencil.count()).map(|ray| {
            let ([t, u, v], [slot, inner]) = pencil.hit(ray)?;
            Some(self.named(&Found { t: number(t), u: number(u), v: number(v), slot, inner }))
        }));
        true
    }
}

/// What a pencil asks of a geometry.
struct Asking<'a, 'r, P: Precision> {
    geometry: &'a Geometry<P>,
    rays: &'a FromOnePoint<'r, P::Real>,
    directions: &'a [Vec3Of<P>],
}

impl<P: Precision> Asking<'_, '_, P> {
    /// What has no test for several rays, for those of a mask.
    #[inline(never)]
    fn one_by_one(&self, slot: usize, asked: u32, pencil: &mut Pencil) {
        let geometry = self.geometry;
        for (ray, &direction) in self.directions.iter().enumerate().filter(|(ray, _)| asked >> ray & 1 != 0) {
            let probe: Probe<P> = geometry.probe(self.rays.ray(direction));
            let range = Interval { min: self.rays.range.min, max: P::Real::from_f32(pencil.far(ray)).next_up() };
            let own = (slot as u32, &geometry.group.slots[slot]);
            if let Some(Found { t, u, v, slot, inner }) = geometry.test::<(), false>(own, &probe, range, &mut ()) {
                pencil.consider(ray, [t, u, v].map(Real::to_f32), [slot, inner], |a, b| self.lower(a, b));
            }
        }
    }
}

impl<P: Precision> Meets for Asking<'_, '_, P> {
    #[inline(always)]
    fn lower(&self, slot: u32, than: u32) -> bool {
        let order = |slot: u32| self.geometry.group.slots[slot as usize].order();
        order(slot) < order(than)
    }

    fn other(&mut self, place: usize, asked: u32, pencil: &mut Pencil) {
        self.one_by_one(self.geometry.unbounded + place, asked, pencil);
    }
}
