//! Whitted ray tracing: local lighting, mirror reflection and refraction (Whitted, "An Improved Illumination Model for
//! Shaded Display", 1980), for both families of materials; and path tracing, in [`path_tracing`].
//!
//! A path has a running throughput; where a surface sends two rays under Whitted's rules, one of them is a path of its own, followed
//! before this one goes on.

mod bump;
mod classic;
mod cone;
mod frame;
mod ground;
mod kernel;
mod path;
mod path_tracing;
mod physical;
mod shadow;
mod surface;

pub(crate) use kernel::{Analytic, General, Kernel, Paths};
use path::{Leaving, Next, Path, Step};
pub(crate) use path_tracing::Stream;
pub(crate) use surface::Leg;

use core::marker::PhantomData;

use raywright_bvh::{Hit, Interval, PacketBackoff, Query, Ray, RayPacket, Real, Vector};

use crate::counters::Counters;
use crate::interaction::Interaction;
use crate::light::LightUsage;
use crate::observer::Observer;
use crate::prepare::{Alpha, Material, Prepared, Spawn};
use crate::sampler::Address;
use crate::settings::Settings;

/// Surfaces that a ray may pass through because they are absent there (alpha below a cutoff) before it is given up.
const MAX_CUTOUTS: u32 = 256;

/// What a ray brought back.
pub(crate) struct Brought<R: Real> {
    pub radiance: R::Vec3,
    /// Share of the ray that something covers, seen through what is there in part.
    pub coverage: R,
}

/// A camera ray, with what it hits where that was asked before.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CameraRay<'a, R: Real> {
    pub ray: &'a Ray<R>,
    pub met: Option<&'a Option<Hit<R>>>,
}

impl<'a, R: Real> CameraRay<'a, R> {
    /// The ray alone.
    #[cfg(test)]
    pub fn unasked(ray: &'a Ray<R>) -> Self {
        Self { ray, met: None }
    }
}

/// What some camera rays hit, where they were asked together.
pub(crate) struct FirstHits<R: Real> {
    directions: Vec<R::Vec3>,
    hits: Vec<Option<Hit<R>>>,
    patience: PacketBackoff,
}

impl<R: Real> Default for FirstHits<R> {
    fn default() -> Self {
        Self { directions: Vec::new(), hits: Vec::new(), patience: PacketBackoff::default() }
    }
}

impl<R: Real> FirstHits<R> {
    /// What one of them hits; none where it was not asked.
    #[inline(always)]
    pub fn get(&self, ray: usize) -> Option<&Option<Hit<R>>> {
        self.hits.get(ray)
    }
}

/// Follows rays through a prepared scene; one a worker.
pub(crate) struct Tracer<'a, R: Real, K: Kernel> {
    pub scene: &'a Prepared<R>,
    pub counters: Counters,
    /// What its worker counted of lights so far.
    pub usage: &'a mut LightUsage,
    /// Paths that wait for their side branches; empty between camera rays.
    waiting: Vec<Path<R>>,
    /// Asked now and then while paths divide, since one pixel may have more branches than a lifetime has seconds.
    observer: &'a dyn Observer,
    divisions: u32,
    stopped: bool,
    /// Whether the first hits of camera rays are kept, the one of the ray followed last, and what that saw without light from elsewhere.
    keeps_first: bool,
    first: Option<FirstHit>,
    direct: R::Vec3,
    max_depth: u32,
    camera_min: R,
    secondary_min: R,
    /// Absorbing bodies that the camera is in; of path tracing.
    media: path_tracing::Media,
    kernel: PhantomData<K>,
}

impl<'a, R: Real, K: Kernel> Tracer<'a, R, K> {
    /// `keeps_first`: whether layers ask what camera rays hit first.
    pub fn new(
        scene: &'a Prepared<R>,
        usage: &'a mut LightUsage,
        max_depth: u32,
        keeps_first: bool,
        observer: &'a dyn Observer,
    ) -> Self {
        let (camera_min, secondary_min) = match scene.rules.spawn {
            Spawn::ErrorBound => (R::ZERO, R::ZERO),
            Spawn::Constant { camera_min, secondary_min, .. } => (camera_min, secondary_min),
        };
        let mut tracer = Self {
            scene,
            counters: Counters::default(),
            usage,
            waiting: Vec::new(),
            observer,
            divisions: 0,
            stopped: false,
            keeps_first,
            first: None,
            direct: Vector::ZERO,
            // Whitted's rays divide: without a limit there would be no end.
            max_depth: if K::PATHS { max_depth } else { max_depth.min(Settings::MOST_SEGMENTS) },
            camera_min,
            secondary_min,
            media: path_tracing::Media::default(),
            kernel: PhantomData,
        };
        if K::PATHS && scene.tracks_media {
            tracer.media = tracer.media_of_camera();
        }
        tracer
    }

    /// Whether the observer stopped a path halfway, so that what was traced is worth nothing.
    pub fn is_stopped(&self) -> bool {
        self.stopped
    }

    /// Radiance that arrives along a camera ray under Whitted's rules.
    #[inline]
    pub fn camera_ray(&mut self, asked: CameraRay<'_, R>, address: &Address) -> Brought<R> {
        let mut path = self.camera_path(asked.ray, address);
        self.follow(&mut path, asked.met);
        self.direct += self.scene.veil;
        Brought { radiance: path.radiance + self.scene.veil, coverage: path.covered }
    }

    /// What camera rays hit, where they leave one point at one time, which is asked for them together; nothing otherwise.
    pub fn meet(&self, rays: &[Ray<R>], hits: &mut FirstHits<R>) {
        let FirstHits { directions, hits, patience } = hits;
        hits.clear();
        let Some(first) = rays.first() else { return };
        if !rays.iter().all(|ray| ray.origin == first.origin && ray.time == first.time) {
            return;
        }
        directions.clear();
        directions.extend(rays.iter().map(|ray| ray.direction));
        let range = Interval { min: self.camera_min - self.scene.camera.ahead(), max: R::INFINITY };
        let asked = RayPacket { origin: first.origin, directions, time: first.time, culls: first.culls, range };
        self.scene.geometry.closest_from(&asked, patience, hits);
    }

    /// The path of a camera ray before its first segment.
    #[inline(always)]
    fn camera_path(&mut self, ray: &Ray<R>, address: &Address) -> Path<R> {
        self.first = None;
        self.direct = Vector::ZERO;
        self.counters.camera += 1;
        // The ray is written into its place: a leg that is copied has to wait for its own numbers.
        let mut path = Path {
            leg: Leg::of_camera(self.scene),
            throughput: Vector::ONE,
            radiance: Vector::ZERO,
            address: *address,
            segments: self.max_depth,
            cutouts: 0,
            camera: true,
            share: R::ONE,
            covered: R::ZERO,
            met: None,
        };
        path.leg.ray = *ray;
        path
    }

    /// What a path asks next.
    #[inline(always)]
    fn query(&self, path: &Path<R>) -> Query<R> {
        let min = if path.camera { self.camera_min - path.leg.ahead } else { self.secondary_min };
        Query { ray: path.leg.ray, range: Interval { min, max: R::INFINITY } }
    }

    /// What one more segment makes of a path: it has met this, or nothing.
    #[inline(always)]
    fn advance(&mut self, path: &mut Path<R>, hit: Option<&Hit<R>>) -> Step<R> {
        let Some(hit) = hit else {
            let backdrop = if path.camera { self.scene.backdrop } else { None };
            let direction = path.leg.ray.direction;
            let seen = match backdrop {
                Some(backdrop) => backdrop.seen(direction),
                None => self.scene.lights.sky.radiance(path.leg.start(), direction),
            };
            path.radiance += path.throughput * seen;
            self.see(path.camera, path.throughput * seen);
            return Step::Ended;
        };
        // What `Interaction::of` does, in its place.
        let mut at = Interaction::begun(self.scene, &path.leg, hit);
        at.finish::<K>(self.scene, &path.leg, hit);
        if K::PHYSICAL {
            at.bend_where_bumpy(self.scene, &path.leg, hit);
        }
        if path.camera && self.keeps_first && self.first.is_none() {
            self.first = Some(self.seen(&path.leg, hit));
        }
        match &self.scene.materials[at.material as usize] {
            Material::Classic(m) => self.classic(m, path, hit, &at),
            Material::Physical(m) if K::PHYSICAL => {
                if m.alpha != Alpha::Opaque
                    && let Some(step) = self.cutout(m, path, hit, &at)
                {
                    return step;
                }
                self.physical(m, path, hit, &at)
            }
            Material::Physical(_) | Material::Unused => path.leave(Leaving::NONE),
        }
    }

    /// Whether a surface gives off what its material does on the side that was hit.
    #[inline(always)]
    fn shines(&self, at: &Interaction<R>) -> bool {
        at.outside || !self.scene.objects[at.object as usize].culled
    }

    /// Notes what a camera ray sees by itself, where that is kept.
    #[inline(always)]
    fn see(&mut self, camera: bool, radiance: R::Vec3) {
        if camera && self.keeps_first {
            self.direct += radiance;
        }
    }

    /// The ray that leaves a surface in a unit direction. `side` is the normal's factor where the offset is constant: 1 for
    /// the side that the ray came from, −1 for the other.
    #[inline(always)]
    fn leave(&self, at: &Interaction<R>, direction: R::Vec3, side: R) -> Ray<R> {
        let origin = match self.scene.rules.spawn {
            Spawn::ErrorBound => at.surface.spawn(direction),
            Spawn::Constant { offset, along_ray: true, .. } => at.surface.point + direction * offset,
            Spawn::Constant { offset, .. } => at.surface.point + at.normal * (offset * side),
        };
        Ray::new(origin, direction)
    }
}

/// The share of a radiance whose brightest channel is not above a limit.
fn clamping<R: Real>(radiance: R::Vec3, most: R) -> R {
    let brightest = radiance.max_element();
    if brightest > most { most / brightest } else { R::ONE }
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

impl<R: Real, K: Kernel> Tracer<'_, R, K> {
    /// What the camera ray that was followed last hit first, none for the sky, and what it saw without light from elsewhere; nothing where
    /// layers ask for none.
    pub fn first(&self) -> (Option<&FirstHit>, R::Vec3) {
        (self.first.as_ref(), self.direct)
    }

    /// The first hit of a ray that is followed no further; none for the sky.
    pub fn first_hit(&mut self, ray: Ray<R>) -> Option<FirstHit> {
        self.counters.camera += 1;
        let leg = Leg { ray, ..Leg::of_camera(self.scene) };
        let range = Interval { min: self.camera_min - leg.ahead, max: R::INFINITY };
        let hit = self.scene.geometry.closest(&ray, range, &mut ())?;
        Some(self.seen(&leg, &hit))
    }

    /// Out of line, and with a surface point of its own: a picture without such layers has only the question in its loop, and
    /// its surface points stay in registers.
    #[inline(never)]
    fn seen(&self, leg: &Leg<R>, hit: &Hit<R>) -> FirstHit {
        let at = Interaction::of::<K>(self.scene, leg, hit);
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
