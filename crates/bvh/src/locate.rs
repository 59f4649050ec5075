//! What is at a hit: the surface and its texture coordinates, made once the hit is known.

use crate::geometry::Geometry;
use crate::primitive_set::Kind;
use crate::ray::{Hit, Ray};
use crate::scalar::{Real, Vector};
use crate::shapes::{Maps, Parameters, PreparedRay, Shape, ShapeHit, Surface, SurfacePoint, Under};

impl<R: Real> Geometry<R> {
    /// The surface at a hit that this geometry returned for the same ray, before it is rounded to the stored scalar.
    #[inline]
    pub fn located(&self, ray: &Ray<R>, hit: &Hit<R>) -> SurfacePoint {
        // Spheres and planes are asked here, where what their answer does not need of a probe is not made.
        let slot = &self.group.slots[hit.slots[0] as usize];
        match slot.kind {
            Kind::Sphere => self.group.spheres[slot.index as usize].locate(&self.prepare(*ray), own(hit)),
            Kind::Plane => self.group.planes[slot.index as usize].locate(&self.prepare(*ray), own(hit)),
            _ => self.locate(&self.prepare(*ray), own(hit), hit.slots, None),
        }
    }

    /// The surface at a hit that this geometry returned for the same ray.
    #[inline]
    pub fn surface(&self, ray: &Ray<R>, hit: &Hit<R>) -> Surface<R> {
        self.located(ray, hit).stored()
    }

    /// Texture coordinates at a hit that this geometry returned for the same ray.
    #[inline]
    pub fn parameters(&self, ray: &Ray<R>, hit: &Hit<R>) -> Parameters<R> {
        self.parameters_at(&self.prepare(*ray), own(hit), hit.slots)
    }

    /// A normal of the space of the instance that a hit names, in the world at the ray's time, not brought to unit length: what
    /// whoever keeps the normals of a mesh asks where a constant map would not do. Without an instance it is the world's own.
    pub fn normal(&self, ray: &Ray<R>, hit: &Hit<R>, normal: R::Vec3) -> R::Vec3 {
        let (group, slot) = (&self.group, &self.group.slots[hit.slots[0] as usize]);
        if slot.kind != Kind::Instance {
            return normal;
        }
        let mut room = None;
        let (transform, _) = group.shown(&group.instances[slot.index as usize], ray.time.to_f64(), &mut room);
        R::Vec3::from_f64(transform.normal_to_world(normal.to_f64()))
    }

    /// For a probe of this geometry's own space, which is under these maps.
    #[inline(never)]
    fn locate(&self, probe: &PreparedRay, hit: ShapeHit<R>, [slot, inner]: [u32; 2], maps: Under<'_>) -> SurfacePoint {
        let (group, slot) = (&self.group, &self.group.slots[slot as usize]);
        let index = slot.index as usize;
        match slot.kind {
            Kind::Sphere => group.spheres[index].locate_under(probe, hit, maps),
            Kind::Triangle => self.triangle(index).locate_under(probe, hit, maps),
            Kind::Plane => group.planes[index].locate_under(probe, hit, maps),
            Kind::Shape => group.shapes[index].locate_under(probe, hit, maps),
            Kind::TransformedShape => group.placed[index].locate_under(probe, hit, maps),
            Kind::Instance => {
                let mut room = None;
                let (transform, part) = group.shown(&group.instances[index], probe.time, &mut room);
                let maps = Maps { map: transform, outer: None };
                transform.located_to_world(&part.locate(&transform.probe_to_object(probe), hit, [inner, inner], Some(maps)))
            }
        }
    }

    fn parameters_at(&self, probe: &PreparedRay, hit: ShapeHit<R>, [slot, inner]: [u32; 2]) -> Parameters<R> {
        let (group, slot) = (&self.group, &self.group.slots[slot as usize]);
        let index = slot.index as usize;
        match slot.kind {
            Kind::Sphere => group.spheres[index].parameters(probe, hit),
            Kind::Triangle => self.triangle(index).parameters(probe, hit),
            Kind::Plane => group.planes[index].parameters(probe, hit),
            Kind::Shape => group.shapes[index].parameters(probe, hit),
            Kind::TransformedShape => group.placed[index].parameters(probe, hit),
            Kind::Instance => {
                let mut room = None;
                let (transform, part) = group.shown(&group.instances[index], probe.time, &mut room);
                let there = part.parameters_at(&transform.probe_to_object(probe), hit, [inner, inner]);
                transform.parameters_to_world(&there)
            }
        }
    }
}

/// The hit as a shape knows it.
#[inline(always)]
fn own<R: Real>(hit: &Hit<R>) -> ShapeHit<R> {
    ShapeHit { t: hit.t, u: hit.u, v: hit.v }
}
