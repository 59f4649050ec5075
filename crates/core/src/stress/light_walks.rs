//! Random walks from lights. They find lights whose light no camera sees.
//!
//! The shadow rays of a picture do not suffice: on an endless floor, a few of them start so far away
//! that rounding lets them past the cover of a light.

use glam::DVec3;
use raywright_bvh::{Hit, Interval, Ray, Real, Surface, Vector};

use super::directions::directions_in_cone;
use super::facts::{ObjectFacts, SurfaceKind, unit_random};
use super::light_tracer::{LightTracer, VisiblePoint};
use super::ray_hits::{HITS, hits_along_ray};
use crate::light::ShadowRayTarget;
use crate::material::{ShadingFrame, sample_cosine_hemisphere};
use crate::scene::{LightKind, MaterialModel};

/// Numbers of walks from a light: that all lights share, and the greatest and least of a light.
const ALL_WALKS: usize = 1 << 17;
const WALKS: [usize; 2] = [64, 512];
/// Greatest number of surfaces that scatter a walk.
const BOUNCES: u64 = 6;
/// Distance of the points from which a lamp is sampled, in multiples of the lamp's size.
const AWAY: f64 = 3.0;

/// Result of the walks from a light.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct WalkResult {
    /// Number of walks that hit an opaque surface.
    pub walks: u64,
    /// Whether one of them reached a point to which a camera, or a point that it sees, has an
    /// unblocked line.
    pub is_seen: bool,
}

impl WalkResult {
    /// Returns the number of walks if they show that no light arrives.
    pub fn unseen_walks(&self) -> Option<u64> {
        const FEWEST: u64 = 50;
        (!self.is_seen && self.walks >= FEWEST).then_some(self.walks)
    }

    pub fn combine(&mut self, other: Self) {
        self.walks += other.walks;
        self.is_seen |= other.is_seen;
    }
}

/// Returns the number of walks from each of `lights` lights.
pub(super) fn walk_count(lights: usize) -> usize {
    (ALL_WALKS / lights.max(1)).clamp(WALKS[0], WALKS[1])
}

impl<R: Real> LightTracer<'_, R> {
    /// Walks from a point or spot light.
    pub fn walk_from_light(
        &self,
        kind: &LightKind,
        count: usize,
        seen: &[VisiblePoint],
    ) -> WalkResult {
        let (position, axis, lowest) = match *kind {
            LightKind::Directional { .. } => return WalkResult::default(),
            LightKind::Point { position, .. } => (DVec3::from(position), DVec3::Y, -1.0),
            LightKind::Spot {
                position,
                direction,
                outer_angle,
                ..
            } => {
                let axis = DVec3::from(direction).normalize_or_zero();
                let lowest = libm::cos(outer_angle.to_radians());
                (DVec3::from(position), axis, lowest)
            }
        };
        let directions = directions_in_cone(axis, lowest, count);
        let mut result = WalkResult::default();
        for (index, direction) in directions.enumerate() {
            let start = position - self.prepared.origin.origin;
            let ray = Ray::new(R::Vec3::from_f64(start), R::Vec3::from_f64(direction));
            self.walk(ray, index as u64, seen, &mut result);
            if result.is_seen {
                break;
            }
        }
        result
    }

    /// Walks from points of an emissive object, whose emitters are `emitters`.
    pub fn walk_from_lamp(
        &self,
        object: usize,
        emitters: core::ops::Range<u32>,
        count: usize,
        seen: &[VisiblePoint],
    ) -> WalkResult {
        let mut result = WalkResult::default();
        let Some(bounds) = self.scene_facts.objects[object].bounds else {
            return result;
        };
        let away = AWAY * bounds.extent().length();
        let origin = self.prepared.origin.origin;
        let viewpoints = directions_in_cone(DVec3::Y, -1.0, count);
        for (index, viewpoint) in viewpoints.enumerate() {
            let number = |axis| unit_random(0, index as u64, axis);
            let emitter =
                emitters.start + (number(0) * f64::from(emitters.end - emitters.start)) as u32;
            // Every other point is sampled from the camera, which may be inside the lamp.
            let from = match index % 2 {
                0 => bounds.centre() + viewpoint * away,
                _ => self.eye,
            };
            let from = R::Vec3::from_f64(from - origin);
            let place = [number(1), number(2)].map(|x| x.min(0.999_999) as f32);
            let sample = self
                .prepared
                .lights
                .emitters
                .sample(emitter, from, place, 1.0);
            let Some(ShadowRayTarget::Surface(surface)) = sample.map(|sample| sample.target) else {
                continue;
            };
            let side = from - surface.point;
            let (start, normal) = towards_side(&surface, side);
            if self.is_in_sight(start, seen, index as u64) {
                result.is_seen = true;
                break;
            }
            let ray = Ray::new(
                start,
                diffuse_direction::<R>(normal, [number(3), number(4)]),
            );
            self.walk(ray, index as u64, seen, &mut result);
            if result.is_seen {
                break;
            }
        }
        result
    }

    /// Follows a ray from surface to surface. All opaque surfaces scatter it diffusely, all others
    /// let it pass.
    fn walk(&self, mut ray: Ray<R>, index: u64, seen: &[VisiblePoint], result: &mut WalkResult) {
        for bounce in 0..BOUNCES {
            let Some(surface) = self.next_opaque_surface(&ray, R::INFINITY) else {
                return;
            };
            result.walks += u64::from(bounce == 0);
            let (start, normal) = towards_side(&surface, -ray.direction);
            if self.is_in_sight(start, seen, index ^ (bounce << 32)) {
                result.is_seen = true;
                return;
            }
            let number = |axis| unit_random(1 + bounce, index, axis);
            ray = Ray::new(
                start,
                diffuse_direction::<R>(normal, [number(0), number(1)]),
            );
        }
    }

    /// Returns whether nothing opaque is between a point and the camera, or between it and one of
    /// the points that the camera sees.
    fn is_in_sight(&self, point: R::Vec3, seen: &[VisiblePoint], index: u64) -> bool {
        let some = (unit_random(2, index, 0) * seen.len() as f64) as usize;
        let lifted = seen.get(some).map(|place| {
            let lift = 1e-5 * place.position.distance(self.eye);
            place.position + place.normal * lift
        });
        let origin = self.prepared.origin.origin;
        [Some(self.eye), lifted]
            .into_iter()
            .flatten()
            .any(|target| {
                let away = R::Vec3::from_f64(target - origin) - point;
                let distance = away.length();
                let ray = Ray::new(point, away / distance);
                distance > R::ZERO && self.next_opaque_surface(&ray, distance).is_none()
            })
    }

    /// Returns the first opaque surface on a ray, within a distance.
    fn next_opaque_surface(&self, ray: &Ray<R>, max: R) -> Option<Surface<R>> {
        let geometry = &self.prepared.geometry;
        let mut hits = hits_along_ray(geometry, ray, Interval { min: R::ZERO, max }).take(HITS);
        let is_opaque =
            |hit: &Hit<R>| !lets_light_pass(&self.scene_facts.objects[self.facts_index(hit)]);
        hits.find(is_opaque).map(|hit| geometry.surface(ray, &hit))
    }
}

/// Returns whether any light may pass an object's surface, such as glass, a leaf or a sheet with
/// holes.
fn lets_light_pass(object_facts: &ObjectFacts<'_>) -> bool {
    let passes = object_facts
        .material
        .is_none_or(|(_, material)| match &material.model {
            MaterialModel::Physical(m) => {
                material.is_partly_transparent() || m.may_transmit_diffusely()
            }
            MaterialModel::Classic(m) => m.shadow_transmittance > 0.0 || m.shadow.is_some(),
        });
    passes || !object_facts.object.casts_shadow || object_facts.surface_kind != SurfaceKind::Opaque
}

/// Returns the start of rays and the normal on the side of a surface to which a vector points.
fn towards_side<R: Real>(surface: &Surface<R>, side: R::Vec3) -> (R::Vec3, DVec3) {
    let normal = surface.normal.to_f64();
    let is_outside = surface.normal.dot(side) > R::ZERO;
    // Twice the error from the surface, so that a ray along a neighbouring surface stays inside.
    let lift = surface.normal * (surface.error * R::from_f64(2.0));
    if is_outside {
        (surface.above + lift, normal)
    } else {
        (surface.below - lift, -normal)
    }
}

/// Returns a direction with the density of diffuse reflection.
fn diffuse_direction<R: Real>(normal: DVec3, point: [f64; 2]) -> R::Vec3 {
    let up = sample_cosine_hemisphere::<f64>(point);
    R::Vec3::from_f64(ShadingFrame::<f64>::from_normal(normal).to_world(up))
}
