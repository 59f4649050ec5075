//! Whitted ray tracing: local lighting, mirror reflection and refraction (Whitted, "An Improved Illumination Model for
//! Shaded Display", 1980), for both families of materials.
//!
//! A path is a loop with a running throughput; only where a surface sends two rays does it call itself for one of them.

mod classic;
mod kernel;
mod physical;
mod shadow;
mod surface;

pub(crate) use kernel::{Analytic, General, Kernel};
pub(crate) use surface::Leg;

use core::marker::PhantomData;

use raywright_bvh::{Hit, Interval, Precision, Ray, Real, Vec3Of, Vector};

use crate::counters::Counters;
use crate::interaction::Interaction;
use crate::prepare::{Material, Prepared, Spawn};
use crate::sampler::{Address, Branch};

/// Surfaces that a ray may pass through because they are absent there (alpha below a cutoff) before it is given up.
const MAX_CUTOUTS: u32 = 256;

/// The ray that came to a surface and the hit that it was.
type Arrival<'a, P> = (&'a Leg<<P as Precision>::Real>, &'a Hit<<P as Precision>::Real>);

/// What a ray brought back.
pub(crate) struct Brought<R: Real> {
    pub radiance: R::Vec3,
    /// Whether the first segment hit something.
    pub hit: bool,
}

/// A ray to follow, with what it counts.
pub(crate) struct Next<R: Real> {
    pub ray: Ray<R>,
    pub throughput: R::Vec3,
    /// What storing took from the direction. Only the next interface asks for it: leaving glass near the critical angle
    /// magnifies it thousands of times, and a slab then turns a ray that it should only move.
    pub rest: R::Vec3,
}

impl<R: Real> Next<R> {
    /// A ray whose stored direction is all there is to know.
    #[inline(always)]
    pub fn new(ray: Ray<R>, throughput: R::Vec3) -> Self {
        Self { ray, throughput, rest: Vector::ZERO }
    }
}

/// Follows rays through a prepared scene; one a worker.
pub(crate) struct Tracer<'a, P: Precision, K: Kernel> {
    pub scene: &'a Prepared<P>,
    pub counters: Counters,
    /// Vertex in the making, for random numbers.
    address: Address,
    /// Whether the first hits of camera rays are kept, and the one of the ray followed last.
    keeps_first: bool,
    first: Option<FirstHit>,
    max_depth: u32,
    camera_min: P::Real,
    secondary_min: P::Real,
    kernel: PhantomData<K>,
}

impl<'a, P: Precision, K: Kernel> Tracer<'a, P, K> {
    /// `keeps_first`: whether layers ask what camera rays hit first.
    pub fn new(scene: &'a Prepared<P>, max_depth: u32, keeps_first: bool) -> Self {
        let (camera_min, secondary_min) = match scene.rules.spawn {
            Spawn::ErrorBound => (P::Real::ZERO, P::Real::ZERO),
            Spawn::Constant { camera_min, secondary_min, .. } => (camera_min, secondary_min),
        };
        Self {
            scene,
            counters: Counters::default(),
            address: Address::default(),
            keeps_first,
            first: None,
            max_depth,
            camera_min,
            secondary_min,
            kernel: PhantomData,
        }
    }

    /// Radiance that arrives along a camera ray.
    #[inline]
    pub fn camera_ray(&mut self, ray: Ray<P::Real>, address: Address) -> Brought<P::Real> {
        self.address = address;
        self.first = None;
        self.counters.camera += 1;
        let mut brought = self.follow(Next::new(ray, Vector::ONE), self.max_depth, true);
        brought.radiance += self.scene.veil;
        brought
    }

    /// What a ray of a side branch brings; what is drawn on it has addresses of its own.
    fn aside(&mut self, next: Next<P::Real>, segments: u32, branch: Branch) -> Vec3Of<P> {
        let here = self.address;
        self.address = here.aside(branch);
        let radiance = self.follow(next, segments, false).radiance;
        self.address = here;
        radiance
    }

    /// Follows a ray for up to `segments` segments, itself included.
    fn follow(&mut self, first: Next<P::Real>, mut segments: u32, from_camera: bool) -> Brought<P::Real> {
        // What a camera that is far away has of the way behind it lies before the ray's origin.
        let ahead = if from_camera { self.scene.camera.ahead() } else { P::Real::ZERO };
        let mut leg = Leg { ray: first.ray, rest: first.rest, ahead };
        let mut throughput = first.throughput;
        let mut radiance = Vec3Of::<P>::ZERO;
        let mut camera = from_camera;
        let mut hit_anything = false;
        let mut cutouts = 0;
        loop {
            let min = if camera { self.camera_min - leg.ahead } else { self.secondary_min };
            let range = Interval { min, max: P::Real::INFINITY };
            let Some(hit) = self.scene.geometry.closest(&leg.ray, range, &mut ()) else {
                let backdrop = if camera { self.scene.backdrop } else { None };
                let seen = backdrop.unwrap_or_else(|| self.scene.lights.sky.radiance(leg.start(), leg.ray.direction));
                radiance += throughput * seen;
                break;
            };
            let at = Interaction::of::<P, K>(self.scene, &leg, &hit);
            if camera && self.keeps_first && self.first.is_none() {
                self.first = Some(self.seen(&leg, &hit));
            }
            let next = match &self.scene.materials[at.material as usize] {
                Material::Classic(m) => self.classic(m, (&leg, &hit), &at, throughput, segments, &mut radiance),
                Material::Physical(m) if K::PHYSICAL => {
                    if let Some(behind) = self.cutout(m, &leg, &at, &mut throughput, &mut radiance, segments) {
                        cutouts += 1;
                        if cutouts > MAX_CUTOUTS {
                            break;
                        }
                        (leg.ray, leg.ahead) = (behind, P::Real::ZERO);
                        self.address.bounce += 1;
                        continue;
                    }
                    self.physical(m, (&leg, &hit), &at, throughput, segments, &mut radiance)
                }
                Material::Physical(_) | Material::Unused => None,
            };
            hit_anything = true;
            self.address.bounce += 1;
            segments -= 1;
            match next {
                Some(next) if segments > 0 => {
                    leg = Leg { ray: next.ray, rest: next.rest, ahead: P::Real::ZERO };
                    throughput = next.throughput;
                    camera = false;
                }
                _ => break,
            }
        }
        Brought { radiance, hit: hit_anything }
    }

    /// The ray that leaves a surface in a unit direction. `side` is the normal's factor where the offset is constant: 1 for
    /// the side that the ray came from, −1 for the other.
    #[inline(always)]
    fn leave(&self, at: &Interaction<P::Real>, direction: Vec3Of<P>, side: P::Real) -> Ray<P::Real> {
        let origin = match self.scene.rules.spawn {
            Spawn::ErrorBound => at.surface.spawn(direction),
            Spawn::Constant { offset, along_ray: true, .. } => at.surface.point + direction * offset,
            Spawn::Constant { offset, .. } => at.surface.point + at.normal * (offset * side),
        };
        Ray::new(origin, direction)
    }
}

/// What the layers beside the colour show of a first hit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FirstHit {
    pub albedo: [f64; 3],
    pub normal: [f64; 3],
    pub position: [f64; 3],
    pub distance: f64,
    pub object: u32,
    pub material: u32,
}

impl<P: Precision, K: Kernel> Tracer<'_, P, K> {
    /// What the camera ray that was followed last hit first; none for the sky, and where layers ask for none.
    pub fn first(&self) -> Option<&FirstHit> {
        self.first.as_ref()
    }

    /// The first hit of a ray that is followed no further; none for the sky.
    pub fn first_hit(&mut self, ray: Ray<P::Real>) -> Option<FirstHit> {
        self.counters.camera += 1;
        let ahead = self.scene.camera.ahead();
        let range = Interval { min: self.camera_min - ahead, max: P::Real::INFINITY };
        let hit = self.scene.geometry.closest(&ray, range, &mut ())?;
        Some(self.seen(&Leg { ray, rest: Vector::ZERO, ahead }, &hit))
    }

    /// Out of line, and with a surface point of its own: a picture without such layers has only the question in its loop, and
    /// its surface points stay in registers.
    #[inline(never)]
    fn seen(&self, leg: &Leg<P::Real>, hit: &Hit<P::Real>) -> FirstHit {
        let at = Interaction::of::<P, K>(self.scene, leg, hit);
        let here = self.scene.sources.at(&at);
        let albedo = match &self.scene.materials[at.material as usize] {
            Material::Classic(m) => m.colour.colour(&here),
            Material::Physical(m) => m.base_at(&here),
            Material::Unused => Vector::ZERO,
        };
        FirstHit {
            albedo: albedo.to_f64().to_array(),
            normal: at.normal.to_f64().to_array(),
            position: at.surface.point.to_f64().to_array(),
            distance: at.distance.to_f64(),
            object: at.object,
            material: at.material,
        }
    }
}
