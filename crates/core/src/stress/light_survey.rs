//! Rays from the delta lights (lights without size) into the scene, and from visible surfaces to
//! these lights. Also the area and the brightness of emissive objects.

use glam::DVec3;
use rayon::prelude::*;
use raywright_bvh::{Interval, Real, Vector};

use super::RayDeadline;
use super::directions::directions_in_cone;
use super::emission_peaks::UnevenLamp;
use super::facts::{SceneFacts, SurfaceKind};
use super::finding::CheckRun;
use super::light_tracer::{LightTracer, VisiblePoint};
use super::light_walks::{WalkResult, walk_count};
use crate::dispatch::PreparedSceneTask;
use crate::prepare::PreparedScene;
use crate::scene::{Colour, Light, LightKind, MaterialModel};

/// Limits on the rays that leave delta lights:
/// - `LIGHTS`: greatest number of lights.
/// - `ALL_RAYS`: number of rays that the lights share.
/// - `MOST_RAYS`: greatest number of rays of a light.
const LIGHTS: usize = 256;
const ALL_RAYS: usize = 1 << 16;
const MOST_RAYS: usize = 4096;
/// Greatest number of objects at whose centre a light's rays are aimed.
const AIMED: usize = 1024;
/// Numbers of camera rays along the picture's width and height. Rays to the lights start at their
/// hits.
const PLACES: [u32; 2] = [40, 24];
/// Share of a ray's length at both ends within which surfaces do not block it.
const NEAR: f64 = 1e-4;
/// Number of sampled directions from which the greatest radiance of the sky is found.
const SKY_DIRECTIONS: usize = 256;

/// Result of the rays from and to a delta light.
#[derive(Clone, Debug, Default)]
pub(super) struct LightReach {
    /// `rays`: number of rays that left the light. `nearest`: distance from the light to the
    /// nearest surface that a ray hit, in metres.
    pub rays: u64,
    pub nearest: Option<f64>,
    /// `hits`: number of rays that hit a non-emissive surface within the light's range. `lamp`: an
    /// emissive object that a ray hit.
    pub hits: u64,
    pub lamp: Option<usize>,
    /// Numbers of rays from visible surfaces to the light. `unblocked_rays`: unblocked rays.
    /// `rays_through_glass`: rays blocked by glass alone.
    pub unblocked_rays: u64,
    pub rays_through_glass: u64,
    /// The first glass object that blocked a ray.
    pub glass: Option<usize>,
    pub walks: WalkResult,
}

/// An emissive object.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lamp {
    pub object: usize,
    /// Area, in square metres.
    pub area: f64,
    /// Radiance times area, summed over three channels. Both sides count if both emit.
    pub power: f64,
    /// Greatest radiance of its surface, the mean of three channels.
    pub radiance: f64,
    /// Distance of the object's centre from the nearest camera, in metres.
    pub eye_distance: f64,
    /// Object of the body of glass around it.
    pub glass: Option<usize>,
    /// Only for a lamp in glass: mean radiance that the surfaces which the first camera sees would
    /// reflect of its light without the glass, and the area that paths have to hit, in multiples of the lamp's own.
    pub arriving: f64,
    pub target_ratio: f64,
    pub walks: WalkResult,
}

/// Survey of the lights, for a single camera or for several.
#[derive(Clone, Debug, Default)]
pub(super) struct LightSurvey {
    /// The first lights of the scene's list, in order; without rays if the deadline left one out.
    pub lights: Vec<LightReach>,
    /// Number of lights from which rays were sent, for the first camera.
    pub surveyed: u64,
    /// Emissive objects, in the order of their facts.
    pub lamps: Vec<Lamp>,
    /// For the first camera.
    pub uneven_lamps: Vec<UnevenLamp>,
    /// Greatest radiance among directions sampled by the sky's brightness, the mean of three
    /// channels.
    pub max_sky_radiance: f64,
}

impl LightSurvey {
    /// Adds the survey of another camera.
    #[must_use]
    pub fn combine(mut self, other: Self) -> Self {
        if self.lights.is_empty() && self.lamps.is_empty() && self.uneven_lamps.is_empty() {
            return other;
        }
        for (own, other) in self.lights.iter_mut().zip(other.lights) {
            own.unblocked_rays += other.unblocked_rays;
            own.rays_through_glass += other.rays_through_glass;
            own.glass = own.glass.or(other.glass);
            own.walks.combine(other.walks);
        }
        for (own, other) in self.lamps.iter_mut().zip(other.lamps) {
            own.eye_distance = own.eye_distance.min(other.eye_distance);
            own.walks.combine(other.walks);
        }
        self
    }

    /// Returns the number of surveyed lights, and the number planned.
    pub fn to_check_run(&self) -> CheckRun {
        CheckRun {
            name: "rays of the lights",
            looked_at: self.surveyed,
            unit: "lights",
            planned: self.lights.len() as u64,
        }
    }

    /// Returns the lamps of an object or a generator, by the index of its facts.
    pub fn lamps_of_object(&self, object: usize) -> &[Lamp] {
        let first = self.lamps.partition_point(|lamp| lamp.object < object);
        let end = self.lamps.partition_point(|lamp| lamp.object <= object);
        &self.lamps[first..end]
    }

    /// Returns the body of glass around the first lamp of an object. Both are indices into the facts
    /// of objects.
    pub fn enclosing_glass(&self, object: usize) -> Option<usize> {
        self.lamps_of_object(object).first()?.glass
    }

    /// Returns the greatest radiance of emissive objects and of the sky.
    pub fn max_radiance(&self) -> f64 {
        let lamps = self.lamps.iter().map(|lamp| lamp.radiance);
        lamps.fold(self.max_sky_radiance, f64::max)
    }
}

pub(super) struct LightSurveyTask<'a> {
    pub scene_facts: &'a SceneFacts<'a>,
    pub size: [u32; 2],
    pub eye: DVec3,
    pub deadline: &'a RayDeadline<'a>,
}

impl PreparedSceneTask for LightSurveyTask<'_> {
    type Output = LightSurvey;

    fn run<R: Real>(&self, prepared: &PreparedScene<R>) -> LightSurvey {
        let tracer = LightTracer {
            prepared,
            scene_facts: self.scene_facts,
            eye: self.eye,
            deadline: self.deadline,
        };
        let lights = &self.scene_facts.scene.lights;
        let mut objects = self.scene_facts.objects.iter();
        let seen = match lights.is_empty() && !objects.any(|object| object.emits_light()) {
            true => Vec::new(),
            false => tracer.visible_points(self.size),
        };
        let count = (ALL_RAYS / lights.len().max(1)).clamp(64, MOST_RAYS);
        let survey = |light: &Light| match light.colour {
            _ if self.deadline.has_passed() => None,
            Colour::BLACK => Some(LightReach::default()),
            _ => Some(LightReach {
                walks: tracer.walk_from_light(&light.kind, walk_count(lights.len()), &seen),
                ..tracer.survey_light(&light.kind, count, &seen)
            }),
        };
        let lights: Vec<Option<LightReach>> = lights.par_iter().take(LIGHTS).map(survey).collect();
        LightSurvey {
            surveyed: lights.iter().flatten().count() as u64,
            lights: lights.into_iter().map(Option::unwrap_or_default).collect(),
            lamps: tracer.measure_lamps(&seen),
            uneven_lamps: tracer.measure_uneven_lamps(&seen),
            max_sky_radiance: tracer.max_sky_radiance(),
        }
    }
}

/// Object that blocks a ray to a light. Glass blocks it only if no opaque object does.
enum Obstacle {
    Opaque,
    Glass(usize),
}

impl<R: Real> LightTracer<'_, R> {
    /// Returns points on opaque, non-emissive surfaces that the camera sees.
    fn visible_points(&self, size: [u32; 2]) -> Vec<VisiblePoint> {
        let [width, height] = PLACES;
        let places = (0..width * height).filter_map(|i| {
            let at = |axis: usize, cell: u32| {
                let share = (f64::from(cell) + 0.5) / f64::from(PLACES[axis]);
                R::from_f64(share * f64::from(size[axis]))
            };
            let camera = &self.prepared.camera;
            let ray = camera.generate_ray(at(0, i % width), at(1, i / width), [0.5; 2]);
            let range = Interval::positive();
            let hit = self.prepared.geometry.closest(&ray, range, &mut ())?;
            let object_facts = &self.scene_facts.objects[self.facts_index(&hit)];
            if object_facts.surface_kind != SurfaceKind::Opaque || object_facts.emits_light() {
                return None;
            }
            let surface = self.prepared.geometry.surface(&ray, &hit);
            let (normal, direction) = (surface.normal.to_f64(), ray.direction.to_f64());
            let is_back = normal.dot(direction) > 0.0;
            Some(VisiblePoint {
                position: self.prepared.to_world(surface.point),
                normal: if is_back { -normal } else { normal },
            })
        });
        places.collect()
    }

    fn survey_light(&self, kind: &LightKind, count: usize, seen: &[VisiblePoint]) -> LightReach {
        let mut reach = LightReach::default();
        self.count_shadow_rays(kind, seen, &mut reach);
        let (position, range, cone) = match *kind {
            LightKind::Directional { .. } => return reach,
            LightKind::Point {
                position, range, ..
            } => (DVec3::from(position), range, None),
            LightKind::Spot {
                position,
                range,
                direction,
                outer_angle,
                ..
            } => {
                let axis = DVec3::from(direction).normalize_or_zero();
                (DVec3::from(position), range, Some((axis, outer_angle)))
            }
        };
        let (axis, lowest) = cone.map_or((DVec3::Y, -1.0), |(axis, angle)| {
            (axis, libm::cos(angle.to_radians()))
        });
        let objects = self.scene_facts.objects.iter().take(AIMED);
        let aimed = objects
            .filter_map(|object| (object.bounds?.centre() - position).try_normalize())
            .filter(|direction| direction.dot(axis) >= lowest);
        for direction in directions_in_cone(axis, lowest, count).chain(aimed) {
            reach.rays += 1;
            let Some(hit) = self.closest(position, direction, [0.0, f64::INFINITY]) else {
                continue;
            };
            let distance = hit.t.to_f64();
            reach.nearest = Some(reach.nearest.map_or(distance, |least| least.min(distance)));
            let object = self.facts_index(&hit);
            if range.is_some_and(|range| distance >= range) {
            } else if self.scene_facts.objects[object].emits_light() {
                reach.lamp = reach.lamp.or(Some(object));
            } else {
                reach.hits += 1;
            }
        }
        reach
    }

    /// Traces rays from visible points to a light, and counts the unblocked rays and those blocked
    /// by glass.
    fn count_shadow_rays(&self, kind: &LightKind, seen: &[VisiblePoint], reach: &mut LightReach) {
        for place in seen {
            let (direction, distance) = match *kind {
                LightKind::Directional { to_light } => {
                    (DVec3::from(to_light).normalize_or_zero(), f64::INFINITY)
                }
                LightKind::Point { position, .. } | LightKind::Spot { position, .. } => {
                    let away = DVec3::from(position) - place.position;
                    (away.normalize_or_zero(), away.length())
                }
            };
            if place.normal.dot(direction) <= 1e-3 || !light_emits_towards(kind, direction) {
                continue;
            }
            match self.find_obstacle(place.position, direction, distance) {
                None => reach.unblocked_rays += 1,
                Some(Obstacle::Opaque) => {}
                Some(Obstacle::Glass(object)) => {
                    reach.rays_through_glass += 1;
                    reach.glass = reach.glass.or(Some(object));
                }
            }
        }
    }

    /// Returns what blocks a ray to a light, or `None`.
    fn find_obstacle(&self, from: DVec3, direction: DVec3, distance: f64) -> Option<Obstacle> {
        let size = self.scene_facts.bounds_diagonal();
        let start = NEAR * if distance.is_finite() { distance } else { size };
        let mut glass = None;
        let opaque = |object: usize, _| {
            let object_facts = &self.scene_facts.objects[object];
            let is_physical = object_facts
                .material
                .is_some_and(|(_, m)| matches!(m.model, MaterialModel::Physical(_)));
            match object_facts.surface_kind {
                _ if !object_facts.object.casts_shadow => {}
                SurfaceKind::Opaque => return Some(Obstacle::Opaque),
                SurfaceKind::Body if is_physical => glass = glass.or(Some(object)),
                SurfaceKind::Body | SurfaceKind::Veil => {}
            }
            None
        };
        let range = [start, distance * (1.0 - NEAR)];
        let opaque = self.find_along_ray(from, direction, range, opaque);
        opaque.or(glass.map(Obstacle::Glass))
    }

    fn max_sky_radiance(&self) -> f64 {
        let lights = &self.prepared.lights;
        let Some(sampler) = lights.sky_sampler() else {
            return 0.0;
        };
        let radiance = |i: usize| {
            let [u, v] = [i % 16, i / 16].map(|cell| (cell as f32 + 0.5) / 16.0);
            let direction = sampler.sample_direction::<R>([u, v]);
            let origin = R::Vec3::from_f64(DVec3::ZERO);
            lights
                .sky
                .radiance(origin, direction)
                .to_f64()
                .element_sum()
                / 3.0
        };
        (0..SKY_DIRECTIONS).map(radiance).fold(0.0, f64::max)
    }
}

/// Returns whether a light emits towards a point, given the direction from the point to the light.
fn light_emits_towards(kind: &LightKind, towards: DVec3) -> bool {
    let LightKind::Spot {
        direction,
        outer_angle,
        ..
    } = *kind
    else {
        return true;
    };
    let axis = DVec3::from(direction).normalize_or_zero();
    axis.dot(-towards) >= libm::cos(outer_angle.to_radians())
}
