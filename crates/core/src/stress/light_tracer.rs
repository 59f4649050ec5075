//! Rays between the lights of a scene and the surfaces that a camera sees, rays that leave delta
//! lights (lights without size), and random walks from all lights.
//!
//! The walks find lights whose light no camera sees. The shadow rays of a picture do not suffice: on
//! an endless floor, a few of them start so far away that rounding lets them past the cover of a
//! light.

use raywright_bvh::shapes::TransformedShape;

use super::facts::{HITS, directions_in_cone, stored_ray};
use super::light_survey::{Beam, LightFacts, LightSurvey};
use super::*;
use crate::integrator::PathSegment;
use crate::interaction::Interaction;
use crate::light::ShadowRayTarget;
use crate::material::{ShadingFrame, sample_cosine_hemisphere};
use crate::scene::Colour;
use crate::shape::convert_shape;

/// Greatest numbers of delta lights and of lamps that are surveyed.
const LIGHTS: usize = 256;
const LAMPS: usize = 1000;
/// Numbers of rays that leave the delta lights: that all share, and the greatest number of a light.
/// `AIMED`: greatest number of objects at whose centre a light's rays are aimed.
const ALL_RAYS: usize = 1 << 16;
const MOST_RAYS: usize = 4096;
const AIMED: usize = 1024;
/// Numbers of camera rays along the picture's width and height. Rays to the lights start at their
/// hits.
const PLACES: [u32; 2] = [40, 24];
/// Share of a ray's length at both ends within which surfaces do not block it.
const NEAR: f64 = 1e-4;
/// Numbers of walks from a light: that all lights share, and the least and greatest of a light.
const ALL_WALKS: usize = 1 << 17;
const WALKS: [usize; 2] = [64, 512];
/// Greatest number of surfaces that scatter a walk.
const BOUNCES: u64 = 6;
/// Distance of the points from which a lamp is sampled, in multiples of the lamp's size; and number
/// of samples of the emission of a lamp that is not uniform.
const AWAY: f64 = 3.0;
const EMISSION_SAMPLES: u64 = 1 << 13;
/// Height above a lamp's surface at which the emission is looked up, in multiples of the lamp's size.
const LIFT: f64 = 1e-3;
/// Number of rays from a lamp, and number of them that must cross a body of glass around it. The body
/// may have holes.
const GLASS_RAYS: usize = 14;
const CROSSINGS: usize = 12;
/// Assumed share of the light that the visible surfaces reflect.
const ALBEDO: f64 = 0.5;
/// Number of sampled directions from which the greatest radiance of the sky is found.
const SKY_DIRECTIONS: usize = 256;

/// Task that surveys the lights for a camera.
pub(super) struct LightSurveyTask<'a> {
    pub facts: &'a SceneFacts<'a>,
    /// Points on opaque, non-emissive surfaces that the camera sees, with the normals on its side.
    pub places: Vec<[DVec3; 2]>,
    pub eye: DVec3,
    pub deadline: &'a RayDeadline<'a>,
}

impl<'a> LightSurveyTask<'a> {
    pub fn new(
        facts: &'a SceneFacts<'a>,
        ready: &ReadyScene,
        view: &CameraView,
        deadline: &'a RayDeadline<'a>,
    ) -> Self {
        let hits = facts.trace(ready, view.grid_rays(view.rectangle(), PLACES));
        let seen = hits.iter().filter_map(|hits| {
            let hit = hits.first()?;
            let object = &facts.objects[hit.object];
            let side = (view.eye() - hit.position).dot(hit.normal).signum();
            let is_place = object.is_opaque() && !object.emits_light();
            is_place.then_some([hit.position, hit.normal * side])
        });
        Self {
            facts,
            places: seen.collect(),
            eye: view.eye(),
            deadline,
        }
    }
}

impl PreparedSceneTask for LightSurveyTask<'_> {
    type Output = LightSurvey;

    fn run<R: Real>(&self, prepared: &PreparedScene<R>) -> LightSurvey {
        let tracer = LightTracer {
            task: self,
            prepared,
        };
        let lights = &self.facts.scene.lights;
        let light = |index: usize| {
            let mut facts = LightFacts::new(FindingSubject::Light(index));
            let is_surveyed = !self.deadline.has_passed();
            if is_surveyed && lights[index].colour != Colour::BLACK {
                tracer.survey_light(&Beam::from(&lights[index].kind), lights.len(), &mut facts);
            }
            (facts, is_surveyed)
        };
        let indices = (0..lights.len().min(LIGHTS)).into_par_iter();
        let (lights, surveyed): (Vec<_>, Vec<_>) = indices.map(light).unzip();
        let emitters = &prepared.lights.emitters;
        let ranges = emitters.emitters_by_object().map(|(_, range)| range);
        let lamps: Vec<_> = emitters.areas_and_powers().zip(ranges).collect();
        let lamp = |index: usize| {
            let ((object, area, power, radiance), range) = lamps[index].clone();
            let object = &self.facts.objects[self.facts.facts_index(object as u32)];
            let mut facts = LightFacts {
                area,
                power,
                radiance,
                eye_distance: object
                    .centre()
                    .map_or(0.0, |centre| centre.distance(self.eye)),
                ..LightFacts::new(object.subject())
            };
            if let Some(bounds) = object
                .bounds
                .filter(|_| index < LAMPS && !self.deadline.has_passed())
            {
                tracer.survey_lamp(object, &bounds, range, lamps.len().min(LAMPS), &mut facts);
            }
            facts
        };
        let lamps: Vec<_> = (0..lamps.len()).into_par_iter().map(lamp).collect();
        let listed = self.facts.scene.objects.len();
        let uneven = self.facts.objects[..listed].par_iter().take(LAMPS);
        let uneven = uneven.filter(|_| !self.deadline.has_passed());
        let uneven = uneven.filter_map(|object| tracer.survey_uneven_lamp(object));
        let sky = (lights.is_empty() && lamps.is_empty()).then(|| tracer.survey_sky());
        let radiances = lamps.iter().map(|lamp| lamp.radiance);
        LightSurvey {
            max_radiance: radiances.fold(tracer.max_sky_radiance(), f64::max),
            surveyed: surveyed.iter().filter(|surveyed| **surveyed).count() as u64,
            lights,
            lamps,
            uneven_lamps: uneven.collect(),
            sky,
        }
    }
}

/// Returns the number of walks from each of `lights` lights.
fn walk_count(lights: usize) -> usize {
    (ALL_WALKS / lights.max(1)).clamp(WALKS[0], WALKS[1])
}

/// Traces rays from lights and to lights in a prepared scene.
struct LightTracer<'a, R: Real> {
    task: &'a LightSurveyTask<'a>,
    prepared: &'a PreparedScene<R>,
}

impl<R: Real> LightTracer<'_, R> {
    fn objects(&self) -> &[ObjectFacts<'_>] {
        &self.task.facts.objects
    }

    /// Returns the objects that a ray in world space crosses between two distances, with the
    /// distances.
    fn crossed(
        &self,
        from: DVec3,
        direction: DVec3,
        [min, max]: [f64; 2],
    ) -> impl Iterator<Item = (&ObjectFacts<'_>, f64)> {
        let ray = stored_ray(self.prepared, from, direction);
        let [mut min, max] = [min, max].map(R::from_f64);
        let hits = core::iter::from_fn(move || {
            let range = Interval { min, max };
            let hit = self.prepared.geometry.closest(&ray, range, &mut ())?;
            min = hit.t;
            Some((self.task.facts.object_of_hit(&hit), hit.t.to_f64()))
        });
        hits.take(HITS)
    }

    /// Surveys a delta light among `count` lights.
    fn survey_light(&self, beam: &Beam, count: usize, light: &mut LightFacts) {
        self.count_shadow_rays(beam, None, light);
        let Some(position) = beam.position else {
            return;
        };
        let (axis, lowest) = beam.cone.map_or((DVec3::Y, -1.0), |(axis, angle)| {
            (axis, libm::cos(angle.to_radians()))
        });
        let aimed = self.objects().iter().take(AIMED);
        let aimed = aimed
            .filter_map(|object| (object.centre()? - position).try_normalize())
            .filter(|direction| direction.dot(axis) >= lowest);
        let rays = (ALL_RAYS / count.max(1)).clamp(64, MOST_RAYS);
        for direction in directions_in_cone(axis, lowest, rays).chain(aimed) {
            light.rays += 1;
            let mut crossed = self.crossed(position, direction, [0.0, f64::INFINITY]);
            let Some((object, distance)) = crossed.next() else {
                continue;
            };
            light.nearest = Some(light.nearest.map_or(distance, |least| least.min(distance)));
            if beam.range.is_some_and(|range| distance >= range) {
            } else if object.emits_light() {
                light.lamp = light.lamp.or(Some(object.index));
            } else {
                light.hits += 1;
            }
            let ray = stored_ray(self.prepared, position, direction);
            self.walk(ray, light.rays, light);
        }
    }

    /// Surveys an emissive object with the given emitters among `count` lamps.
    fn survey_lamp(
        &self,
        object: &ObjectFacts<'_>,
        bounds: &Aabb,
        emitters: core::ops::Range<u32>,
        count: usize,
        lamp: &mut LightFacts,
    ) {
        let beam = Beam {
            position: Some(bounds.centre()),
            ..Beam::default()
        };
        lamp.enclosing_glass = self.find_glass_around(bounds);
        self.count_shadow_rays(&beam, Some(object), lamp);
        lamp.arriving *= lamp.power / 3.0;
        for index in 0..walk_count(count) as u64 {
            if let Some((start, normal)) = self.sample_lamp(bounds, &emitters, index) {
                lamp.is_seen |= self.is_in_sight(start, index);
                self.walk(self.diffuse_ray(start, normal, 4, index), index, lamp);
            }
        }
    }

    /// Samples a point of a lamp. Returns the start of rays there, and the normal on that side.
    fn sample_lamp(
        &self,
        bounds: &Aabb,
        emitters: &core::ops::Range<u32>,
        index: u64,
    ) -> Option<(R::Vec3, DVec3)> {
        let number = |dimension| unit_random(0, index, dimension);
        let emitter =
            emitters.start + (number(0) * f64::from(emitters.end - emitters.start)) as u32;
        let away = AWAY * bounds.extent().length();
        let z = 2.0 * number(5) - 1.0;
        let (sin, cos) = libm::sincos(TAU * number(6));
        let ring = (1.0 - z * z).sqrt();
        // Every other point is sampled from the camera, which may be inside the lamp.
        let from = match index % 2 {
            0 => bounds.centre() + DVec3::new(ring * cos, ring * sin, z) * away,
            _ => self.task.eye,
        };
        let from = R::Vec3::from_f64(from - self.prepared.origin.origin);
        let place = [number(1), number(2)].map(|x| x.min(0.999_999) as f32);
        let emitters = &self.prepared.lights.emitters;
        let sample = emitters.sample(emitter, from, place, 1.0)?;
        let ShadowRayTarget::Surface(surface) = sample.target else {
            return None;
        };
        Some(towards_side(&surface, from - surface.point))
    }

    /// Surveys a lamp whose emission varies over its surface. `None` for other objects, and for
    /// meshes, whose samples follow the emission. The lamp need not be among the emitters, whose
    /// power is an estimate.
    fn survey_uneven_lamp(&self, object: &ObjectFacts<'_>) -> Option<LightFacts> {
        let (_, material) = object.material?;
        let is_uneven = object.emits_light() && material.uniform_emission().is_none();
        let bounds = object
            .bounds
            .filter(|_| is_uneven && object.mesh.is_none())?;
        let map = DAffine3::from_translation(-self.prepared.origin.origin) * object.object_to_world;
        let (shape, map) = convert_shape::<f64>(&object.object.shape, map)?;
        let mapped = map.map(|map| TransformedShape::new(shape, map));
        let lift = LIFT * bounds.extent().length();
        let mut lamp = LightFacts::new(object.subject());
        let beam = Beam {
            position: Some(bounds.centre()),
            ..Beam::default()
        };
        self.count_shadow_rays(&beam, Some(object), &mut lamp);
        // The radiance over the density by area.
        let sample = |index: u64| {
            let [u, v] = [1, 2].map(|dimension| unit_random(0, index, dimension));
            let (point, density) = match &mapped {
                Some(mapped) => mapped.as_ref()?.sample_area(u, v)?,
                None => shape.sample_area(u, v)?,
            };
            let side = object.visible_normal(point.normal).unwrap_or(point.normal);
            Some(self.emission_above(object, point.point, side, lift)? / density)
        };
        let samples = (0..EMISSION_SAMPLES).map(|index| sample(index).unwrap_or(0.0));
        let sides = if object.hides_back_faces() { 1.0 } else { 2.0 };
        lamp.arriving *= lamp.measure_variance(samples.collect()) * sides;
        Some(lamp)
    }

    /// Returns the radiance of a lamp at a point of its surface, the mean of three channels, seen from
    /// a height. `None` if another object is there.
    fn emission_above(
        &self,
        lamp: &ObjectFacts<'_>,
        point: DVec3,
        normal: DVec3,
        height: f64,
    ) -> Option<f64> {
        let [start, down] = [point + normal * height, -normal].map(R::Vec3::from_f64);
        let ray = Ray::new(start, down);
        let range = Interval {
            min: R::ZERO,
            max: R::from_f64(2.0 * height),
        };
        let hit = self.prepared.geometry.closest(&ray, range, &mut ())?;
        let segment = PathSegment {
            ray,
            ..PathSegment::from_camera(self.prepared)
        };
        let interaction = Interaction::from_hit(self.prepared, &segment, &hit);
        let context = self.prepared.texture_tables.shading_context(&interaction);
        let material = &self.prepared.materials[interaction.material as usize];
        let radiance = material.emission_at(&context).to_f64().element_sum() / 3.0;
        let is_own = self.task.facts.object_of_hit(&hit).index == lamp.index;
        (is_own && radiance.is_finite()).then_some(radiance.max(0.0))
    }

    /// Surveys the sky by a ray from each visible point into a random direction.
    fn survey_sky(&self) -> LightFacts {
        let mut sky = LightFacts::new(FindingSubject::Sky);
        for (index, &[_, normal]) in self.task.places.iter().enumerate() {
            let number = |dimension| unit_random(0, index as u64, dimension);
            let up = sample_cosine_hemisphere::<f64>([number(0), number(1)]);
            let to_light = ShadingFrame::<f64>::from_normal(normal).to_world(up);
            let beam = Beam {
                to_light,
                ..Beam::default()
            };
            self.count_shadow_ray(&beam, None, index, &mut sky);
        }
        sky
    }

    /// Counts rays from the visible points to a light, and adds up the light that arrives, for a
    /// power of one. A lamp counts as a point at its centre, equally bright to all sides.
    fn count_shadow_rays(
        &self,
        beam: &Beam,
        lamp: Option<&ObjectFacts<'_>>,
        light: &mut LightFacts,
    ) {
        let places = 0..self.task.places.len();
        let arriving: f64 = places
            .map(|place| self.count_shadow_ray(beam, lamp, place, light))
            .sum();
        // The mean over all directions of the area that a convex body shows is a quarter of its area.
        let number = self.task.places.len().max(1) as f64;
        light.arriving = 0.25 * ALBEDO / PI * arriving / number;
    }

    /// Counts a ray from a visible point to a light. Returns the part of the light's intensity that
    /// arrives.
    fn count_shadow_ray(
        &self,
        beam: &Beam,
        lamp: Option<&ObjectFacts<'_>>,
        place: usize,
        light: &mut LightFacts,
    ) -> f64 {
        let [from, normal] = self.task.places[place];
        let (direction, distance) = match beam.position {
            None => (beam.to_light, f64::INFINITY),
            Some(position) => {
                let away = position - from;
                (away.normalize_or_zero(), away.length())
            }
        };
        let is_lit = beam
            .cone
            .is_none_or(|(axis, angle)| axis.dot(-direction) >= libm::cos(angle.to_radians()));
        let cosine = normal.dot(direction);
        if cosine <= 1e-3 || !is_lit {
            return 0.0;
        }
        let start = NEAR * distance.min(self.task.facts.diagonal());
        let mut glass = None;
        for (object, _) in self.crossed(from, direction, [start, distance * (1.0 - NEAR)]) {
            let physical = object.material;
            let is_physical =
                physical.is_some_and(|(_, m)| matches!(m.model, MaterialModel::Physical(_)));
            if lamp.is_some_and(|lamp| lamp.index == object.index) {
                break;
            } else if !object.object.casts_shadow {
            } else if object.is_opaque() {
                *light.blocked.entry(object.index).or_default() += 1;
                return 0.0;
            } else if object.is_body() && is_physical {
                glass = glass.or(Some(object.index));
            }
        }
        match glass {
            Some(_) => light.through_glass += 1,
            None => light.unblocked += 1,
        }
        light.glass = light.glass.or(glass);
        let nearest = lamp.and_then(|lamp| lamp.bounds);
        let nearest = nearest.map_or(0.0, |bounds| 0.5 * bounds.extent().length());
        cosine / distance.max(nearest).powi(2)
    }

    /// Returns the first body of glass around a box: its own box contains the box, and nearly all
    /// rays from the middle of the box cross it.
    fn find_glass_around(&self, inner: &Aabb) -> Option<usize> {
        let is_around = |body: &&ObjectFacts<'_>| {
            let contains =
                |outer: Aabb| outer.min.cmplt(inner.min).all() && outer.max.cmpgt(inner.max).all();
            let crosses = |direction: &DVec3| {
                let mut crossed = self.crossed(inner.centre(), *direction, [0.0, f64::INFINITY]);
                crossed.any(|(object, _)| object.index == body.index)
            };
            body.is_body() && body.bounds.is_some_and(contains) && {
                let directions = directions_in_cone(DVec3::Y, -1.0, GLASS_RAYS);
                directions.filter(crosses).count() >= CROSSINGS
            }
        };
        Some(self.objects().iter().find(is_around)?.index)
    }

    /// Follows a ray from surface to surface, unless the light is seen already. All opaque surfaces
    /// scatter it diffusely, all others let it pass.
    fn walk(&self, mut ray: Ray<R>, index: u64, light: &mut LightFacts) {
        for bounce in 0..BOUNCES {
            if light.is_seen {
                return;
            }
            let Some(surface) = self.next_opaque_surface(&ray, R::INFINITY) else {
                return;
            };
            light.walks += u64::from(bounce == 0);
            let (start, normal) = towards_side(&surface, -ray.direction);
            light.is_seen = self.is_in_sight(start, index ^ (bounce << 32));
            ray = self.diffuse_ray(start, normal, 1 + bounce, index);
        }
    }

    /// Returns a ray with the density of diffuse reflection.
    fn diffuse_ray(&self, start: R::Vec3, normal: DVec3, seed: u64, index: u64) -> Ray<R> {
        let number = |dimension| unit_random(seed, index, dimension);
        let up = sample_cosine_hemisphere::<f64>([number(0), number(1)]);
        let direction = ShadingFrame::<f64>::from_normal(normal).to_world(up);
        Ray::new(start, R::Vec3::from_f64(direction))
    }

    /// Returns whether nothing opaque is between a point and the camera, or between it and one of
    /// the points that the camera sees.
    fn is_in_sight(&self, point: R::Vec3, index: u64) -> bool {
        let (places, eye) = (&self.task.places, self.task.eye);
        let some = (unit_random(2, index, 0) * places.len() as f64) as usize;
        let lifted = places
            .get(some)
            .map(|[position, normal]| *position + *normal * (1e-5 * position.distance(eye)));
        [Some(eye), lifted].into_iter().flatten().any(|target| {
            let away = R::Vec3::from_f64(target - self.prepared.origin.origin) - point;
            let distance = away.length();
            let ray = Ray::new(point, away / distance);
            distance > R::ZERO && self.next_opaque_surface(&ray, distance).is_none()
        })
    }

    /// Returns the first opaque surface on a ray, within a distance.
    fn next_opaque_surface(&self, ray: &Ray<R>, max: R) -> Option<Surface<R>> {
        let geometry = &self.prepared.geometry;
        let range = Interval { min: R::ZERO, max };
        let is_opaque = |hit: &Hit<R>| !lets_light_pass(self.task.facts.object_of_hit(hit));
        let mut hits = hits_along_ray(geometry, ray, range).take(HITS);
        hits.find(is_opaque).map(|hit| geometry.surface(ray, &hit))
    }

    fn max_sky_radiance(&self) -> f64 {
        let lights = &self.prepared.lights;
        let Some(sampler) = lights.sky_sampler() else {
            return 0.0;
        };
        let radiance = |i: usize| {
            let [u, v] = [i % 16, i / 16].map(|cell| (cell as f32 + 0.5) / 16.0);
            let direction = sampler.sample_direction::<R>([u, v]);
            let radiance = lights.sky.radiance(R::Vec3::ZERO, direction);
            radiance.to_f64().element_sum() / 3.0
        };
        (0..SKY_DIRECTIONS).map(radiance).fold(0.0, f64::max)
    }
}

/// Returns whether any light may pass an object's surface, such as glass, a leaf or a sheet with
/// holes.
fn lets_light_pass(object: &ObjectFacts<'_>) -> bool {
    let passes = object
        .material
        .is_none_or(|(_, material)| match &material.model {
            MaterialModel::Physical(m) => {
                material.is_partly_transparent() || m.may_transmit_diffusely()
            }
            MaterialModel::Classic(m) => m.shadow_transmittance > 0.0 || m.shadow.is_some(),
        });
    passes || !object.object.casts_shadow || !object.is_opaque()
}

/// Returns the start of rays and the normal on the side of a surface to which a vector points.
fn towards_side<R: Real>(surface: &Surface<R>, side: R::Vec3) -> (R::Vec3, DVec3) {
    let normal = surface.normal.to_f64();
    // Twice the error from the surface, so that a ray along a neighbouring surface stays inside.
    let lift = surface.normal * (surface.error * R::from_f64(2.0));
    match surface.normal.dot(side) > R::ZERO {
        true => (surface.above + lift, normal),
        false => (surface.below - lift, -normal),
    }
}
