//! What is at a hit: the surface and its texture coordinates, made once the hit is known.

use crate::geometry::Geometry;
use crate::group::Kind;
use crate::ray::{Hit, Ray};
use crate::scalar::{Precision, Vec3Of, convert_vec};
use crate::shapes::{Located, Maps, Parameters, Probe, Shape, ShapeHit, Surface, Under};

impl<P: Precision> Geometry<P> {
    /// The surface at a hit that this geometry returned for the same ray, before it is rounded to the stored scalar.
    #[inline]
    pub fn located(&self, ray: &Ray<P::Real>, hit: &Hit<P::Real>) -> Located<P::Core> {
        // Spheres and planes are asked here, where what their answer does not need of a probe is not made.
        let slot = &self.group.slots[hit.slots[0] as usize];
        match slot.kind {
            Kind::Sphere => self.group.spheres[slot.index as usize].locate(&self.probe(*ray), own(hit)),
            Kind::Plane => self.group.planes[slot.index as usize].locate(&self.probe(*ray), own(hit)),
            _ => self.locate(&self.probe(*ray), own(hit), hit.slots, None),
        }
    }

    /// The surface at a hit that this geometry returned for the same ray.
    #[inline]
    pub fn surface(&self, ray: &Ray<P::Real>, hit: &Hit<P::Real>) -> Surface<P::Real> {
        self.located(ray, hit).stored::<P>()
    }

    /// Texture coordinates at a hit that this geometry returned for the same ray.
    #[inline]
    pub fn parameters(&self, ray: &Ray<P::Real>, hit: &Hit<P::Real>) -> Parameters<P::Real> {
        self.parameters_at(&self.probe(*ray), own(hit), hit.slots)
    }

    /// A normal of the space of the instance that a hit names, in the world at the ray's time, not brought to unit length: what
    /// whoever keeps the normals of a mesh asks where a constant map would not do. Without an instance it is the world's own.
    pub fn normal(&self, ray: &Ray<P::Real>, hit: &Hit<P::Real>, normal: Vec3Of<P>) -> Vec3Of<P> {
        let (group, slot) = (&self.group, &self.group.slots[hit.slots[0] as usize]);
        if slot.kind != Kind::Instance {
            return normal;
        }
        let mut room = None;
        let transform = group.transform(&group.instances[slot.index as usize], ray.time, &mut room);
        convert_vec::<P::Core, P::Real>(transform.normal_to_world(convert_vec::<P::Real, P::Core>(normal)))
    }

    /// For a probe of this geometry's own space, which is under these maps.
    #[inline(never)]
    fn locate(&self, probe: &Probe<P>, hit: ShapeHit<P::Real>, [slot, inner]: [u32; 2], maps: Under<'_, P>) -> Located<P::Core> {
        let (group, slot) = (&self.group, &self.group.slots[slot as usize]);
        let index = slot.index as usize;
        match slot.kind {
            Kind::Sphere => group.spheres[index].locate_under(probe, hit, maps),
            Kind::Triangle => self.triangle(index).locate_under(probe, hit, maps),
            Kind::Plane => group.planes[index].locate_under(probe, hit, maps),
            Kind::Shape => group.shapes[index].locate_under(probe, hit, maps),
            Kind::Placed => group.placed[index].locate_under(probe, hit, maps),
            Kind::Instance => {
                let (instance, mut room) = (&group.instances[index], None);
                let transform = group.transform(instance, probe.ray.time, &mut room);
                let part = &group.parts[instance.part as usize];
                let maps = Maps::new(transform, None);
                transform.located_to_world(&part.locate(&transform.probe_to_object(probe), hit, [inner, inner], Some(maps)))
            }
        }
    }

    fn parameters_at(&self, probe: &Probe<P>, hit: ShapeHit<P::Real>, [slot, inner]: [u32; 2]) -> Parameters<P::Real> {
        let (group, slot) = (&self.group, &self.group.slots[slot as usize]);
        let index = slot.index as usize;
        match slot.kind {
            Kind::Sphere => group.spheres[index].parameters(probe, hit),
            Kind::Triangle => self.triangle(index).parameters(probe, hit),
            Kind::Plane => group.planes[index].parameters(probe, hit),
            Kind::Shape => group.shapes[index].parameters(probe, hit),
            Kind::Placed => group.placed[index].parameters(probe, hit),
            Kind::Instance => {
                let (instance, mut room) = (&group.instances[index], None);
                let transform = group.transform(instance, probe.ray.time, &mut room);
                let part = &group.parts[instance.part as usize];
                let there = part.parameters_at(&transform.probe_to_object(probe), hit, [inner, inner]);
                transform.parameters_to_world(&there)
            }
        }
    }
}

/// The hit as a shape knows it.
#[inline(always)]
fn own<R: crate::scalar::Real>(hit: &Hit<R>) -> ShapeHit<R> {
    ShapeHit { t: hit.t, u: hit.u, v: hit.v }
}
