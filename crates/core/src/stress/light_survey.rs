//! The lights of a scene as the visible surfaces see them: rays to each light and what is in their
//! way, beside the shadow rays of the small pictures.

use super::facts::{HITS, stored_ray};
use super::*;
use crate::light::{LightId, ShadowRayTarget};
use crate::material::{ShadingFrame, sample_cosine_hemisphere};
use crate::prepare::{LampRef, LightRays};
use crate::scene::{Colour, LightKind};

/// Greatest number of lights that are surveyed, of either kind.
const LIGHTS: usize = 1000;
/// Numbers of camera rays along the picture's width and height. Rays to the lights start at their
/// hits.
const PLACES: [u32; 2] = [40, 24];
/// Share of a ray's length at both ends within which surfaces do not block it.
const NEAR: f64 = 1e-4;
/// Least number of visible surface points from which a light is judged, and of rays through glass from
/// which on it counts as behind glass.
const FEWEST: u64 = 8;
/// Least number of blocked shadow rays for which a light counts as unreached, and their least ratio
/// to rays by which light arrives: on an endless floor, a few rays start so far away that rounding
/// lets them past the cover of a light.
const FEWEST_BLOCKED: u64 = 100;
const BLOCKED_PER_ARRIVAL: u64 = 4000;
/// Number of sampled directions from which the greatest radiance of the sky is found.
const SKY_DIRECTIONS: usize = 256;

/// A light and what its rays met: a delta light, an emissive object, or the sky.
#[derive(Clone, Debug, Default)]
pub(super) struct LightFacts {
    /// Number of visible surface points from which the light was looked for.
    places: u64,
    /// Numbers of rays from visible surfaces to the light: unblocked rays, rays blocked by glass
    /// alone, and rays blocked by opaque objects, by the first such object.
    pub unblocked: u64,
    pub through_glass: u64,
    pub blocked: BTreeMap<usize, u64>,
    /// The first glass object in the way.
    pub glass: Option<usize>,
    /// Distance of a delta light to the nearest visible surface, in metres, and the object that the
    /// ray along the axis of its cone hits.
    pub nearest: Option<f64>,
    pub aim: Option<usize>,
    /// Numbers of shadow rays of the small pictures: blocked ones, and those by which light arrived.
    pub shadow_rays: [u64; 2],
    /// For an emissive object. Area in square metres; radiance times area, summed over three
    /// channels, of both sides if both emit.
    pub area: f64,
    pub power: f64,
}

impl LightFacts {
    /// Returns whether glass is in the way of most rays to the light. Rays blocked by opaque objects
    /// do not count.
    pub fn is_behind_glass(&self) -> bool {
        self.through_glass >= FEWEST && self.through_glass > self.unblocked
    }

    /// Returns whether no visible surface lies where the light shines.
    pub fn is_aimed_at_nothing(&self) -> bool {
        let rays = self.unblocked + self.through_glass + self.shadow_rays[1];
        self.places >= FEWEST && rays == 0 && self.blocked.is_empty()
    }

    /// Returns whether hardly any shadow ray finds the light.
    pub fn is_unreached(&self) -> bool {
        let [blocked, arrived] = self.shadow_rays;
        blocked >= FEWEST_BLOCKED && blocked >= BLOCKED_PER_ARRIVAL * arrived
    }

    fn combine(&mut self, other: Self) {
        self.places += other.places;
        self.unblocked += other.unblocked;
        self.through_glass += other.through_glass;
        for (object, count) in other.blocked {
            *self.blocked.entry(object).or_default() += count;
        }
        self.glass = self.glass.or(other.glass);
        let nearest = [self.nearest, other.nearest].into_iter().flatten();
        self.nearest = nearest.reduce(f64::min);
        self.aim = self.aim.or(other.aim);
        self.shadow_rays = [0, 1].map(|i| self.shadow_rays[i] + other.shadow_rays[i]);
        self.area = self.area.max(other.area);
        self.power = self.power.max(other.power);
    }
}

/// Survey of the lights, for a single camera or for several. The copies of a generator are one light.
#[derive(Clone, Debug, Default)]
pub(super) struct LightSurvey {
    pub lights: BTreeMap<Subject, LightFacts>,
    /// Numbers of delta lights: those that were surveyed, and those of the scene. The deadline may
    /// leave out some.
    pub surveyed: [u64; 2],
    /// Greatest radiance of emissive objects, and among directions sampled by the sky's brightness;
    /// the mean of three channels.
    pub max_radiance: f64,
}

impl LightSurvey {
    /// Adds the survey of another camera.
    #[must_use]
    pub fn combine(mut self, other: Self) -> Self {
        self.add_all(other.lights);
        self.surveyed = [0, 1].map(|i| self.surveyed[i] + other.surveyed[i]);
        self.max_radiance = self.max_radiance.max(other.max_radiance);
        self
    }

    /// Adds the shadow rays of a picture to the surveyed lights.
    pub fn add_shadow_rays(&mut self, facts: &SceneFacts<'_>, rays: &[LightRays]) {
        for rays in rays {
            if let Some(light) = self.lights.get_mut(&facts.lamp_subject(rays.lamp)) {
                light.shadow_rays[0] += rays.blocked;
                light.shadow_rays[1] += rays.arrived;
            }
        }
    }

    fn add_all(&mut self, lights: impl IntoIterator<Item = (Subject, LightFacts)>) {
        for (subject, light) in lights {
            self.lights.entry(subject).or_default().combine(light);
        }
    }
}

impl SceneFacts<'_> {
    /// Returns the subject of a light or of an emissive object of the prepared scene.
    pub fn lamp_subject(&self, lamp: LampRef) -> Subject {
        match lamp {
            LampRef::Light(index) => Subject::Light(index),
            LampRef::Object(object) => Subject::Object(self.facts_index(object as u32)),
        }
    }

    /// Returns the position of a light, or the centre of an object.
    pub fn subject_centre(&self, subject: Subject) -> Option<DVec3> {
        match subject {
            Subject::Light(index) => match self.scene.lights[index].kind {
                LightKind::Directional { .. } => None,
                LightKind::Point { position, .. } | LightKind::Spot { position, .. } => {
                    Some(position.into())
                }
            },
            Subject::Object(index) => self.objects[index].centre(),
            _ => None,
        }
    }
}

/// Task that surveys the lights for a camera.
pub(super) struct LightSurveyTask<'a> {
    facts: &'a SceneFacts<'a>,
    /// Points on opaque, non-emissive surfaces that the camera sees, with the normals on its side.
    places: Vec<[DVec3; 2]>,
    deadline: &'a RayDeadline<'a>,
}

impl<'a> LightSurveyTask<'a> {
    pub fn new(
        facts: &'a SceneFacts<'a>,
        ready: &ReadyScene,
        view: &CameraView,
        deadline: &'a RayDeadline<'a>,
    ) -> Self {
        let hits = facts.trace(ready, view.grid_rays(PLACES));
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
            deadline,
        }
    }

    /// Surveys a delta light.
    fn survey_light<R: Real>(&self, prepared: &PreparedScene<R>, index: usize) -> LightFacts {
        let light = &self.facts.scene.lights[index];
        let subject = Subject::Light(index);
        let mut found = self.survey(prepared, subject, |_| LightId::Delta(index as u32));
        if let Some(position) = self.facts.subject_centre(subject) {
            let distances = self
                .places
                .iter()
                .map(|[place, _]| place.distance(position));
            found.nearest = distances.reduce(f64::min);
        }
        if let LightKind::Spot {
            position,
            direction,
            ..
        } = light.kind
        {
            let ray = stored_ray(
                prepared,
                position.into(),
                DVec3::from(direction).normalize(),
            );
            let hit = prepared
                .geometry
                .closest(&ray, Interval::positive(), &mut ());
            found.aim = hit.map(|hit| self.facts.object_of_hit(&hit).index);
        }
        found
    }

    /// Traces a ray from each visible point to a light, which `light` chooses by a random number.
    fn survey<R: Real>(
        &self,
        prepared: &PreparedScene<R>,
        subject: Subject,
        light: impl Fn(f64) -> LightId,
    ) -> LightFacts {
        let mut found = LightFacts {
            places: self.places.len() as u64,
            ..LightFacts::default()
        };
        for (index, &[from, normal]) in self.places.iter().enumerate() {
            let [choice, u, v] = [0, 1, 2].map(|axis| unit_random(0, index as u64, axis));
            let aim = sample_light(prepared, light(choice), [from, normal], [u, v]);
            let Some((direction, distance)) = aim else {
                continue;
            };
            if normal.dot(direction) <= 1e-3 {
                continue;
            }
            let range = Interval {
                min: R::from_f64(NEAR * distance.min(self.facts.diagonal())),
                max: R::from_f64(distance * (1.0 - NEAR)),
            };
            let ray = stored_ray(prepared, from, direction);
            let hits = hits_along_ray(&prepared.geometry, &ray, range).take(HITS);
            let mut objects = hits.map(|hit| self.facts.object_of_hit(&hit));
            let mut glass = None;
            let blocker = objects.find(|object| {
                let casts_shadow = object.object.casts_shadow && object.subject() != subject;
                if casts_shadow && object.is_body() && object.is_physical() {
                    glass = glass.or(Some(object.index));
                }
                casts_shadow && object.is_opaque()
            });
            found.glass = found.glass.or(glass);
            match (blocker, glass) {
                (Some(object), _) => *found.blocked.entry(object.index).or_default() += 1,
                (_, Some(_)) => found.through_glass += 1,
                _ => found.unblocked += 1,
            }
        }
        found
    }
}

impl PreparedSceneTask for LightSurveyTask<'_> {
    type Output = LightSurvey;

    fn run<R: Real>(&self, prepared: &PreparedScene<R>) -> LightSurvey {
        let (facts, lights) = (self.facts, &prepared.lights);
        let emitters = &lights.emitters;
        // Effects that are switched off leave lights out.
        let deltas = 0..facts.scene.lights.len().min(lights.delta.len());
        let is_lit = |index: &usize| facts.scene.lights[*index].colour != Colour::BLACK;
        let has_time = || !self.deadline.has_passed();
        let delta = |index: usize| {
            let light = || (Subject::Light(index), self.survey_light(prepared, index));
            has_time().then(light)
        };
        let found = deltas.clone().into_par_iter().take(LIGHTS).filter(is_lit);
        let found: Vec<_> = found.filter_map(delta).collect();
        let ranges = emitters.emitters_by_object().map(|(_, range)| range);
        let lamps: Vec<_> = emitters.areas_and_powers().zip(ranges).collect();
        let lamp = |((object, area, power, _), range): &((usize, f64, f64, f64), _)| {
            let subject = facts.lamp_subject(LampRef::Object(*object));
            let core::ops::Range { start, end } = *range;
            let choose = |x: f64| LightId::Emitter(start + (x * f64::from(end - start)) as u32);
            let light = || LightFacts {
                area: *area,
                power: *power,
                ..self.survey(prepared, subject, choose)
            };
            has_time().then(|| (subject, light()))
        };
        let radiances = lamps.iter().map(|((.., radiance), _)| *radiance);
        let mut survey = LightSurvey {
            surveyed: [
                found.len() as u64,
                deltas.clone().filter(is_lit).count() as u64,
            ],
            max_radiance: radiances.fold(max_sky_radiance(prepared), f64::max),
            ..LightSurvey::default()
        };
        if deltas.is_empty() && lamps.is_empty() {
            let sky = self.survey(prepared, Subject::Sky, |_| LightId::Sky);
            survey.lights.insert(Subject::Sky, sky);
        }
        survey.add_all(found);
        let lamps = lamps.par_iter().take(LIGHTS).filter_map(lamp);
        survey.add_all(lamps.collect::<Vec<_>>());
        survey
    }
}

/// Returns the direction to a sampled point of a light and its distance; for the sky, a direction
/// with the density of diffuse reflection. `None` if no light arrives.
fn sample_light<R: Real>(
    prepared: &PreparedScene<R>,
    light: LightId,
    [from, normal]: [DVec3; 2],
    numbers: [f64; 2],
) -> Option<(DVec3, f64)> {
    if light == LightId::Sky {
        let up = sample_cosine_hemisphere::<f64>(numbers);
        let direction = ShadingFrame::<f64>::from_normal(normal).to_world(up);
        return Some((direction, f64::INFINITY));
    }
    let start = R::Vec3::from_f64(from - prepared.origin.origin);
    let numbers = numbers.map(|x| x.min(0.999_999) as f32);
    let sample = prepared.lights.sample(light, start, numbers, 1.0)?;
    let distance = match sample.target {
        ShadowRayTarget::Infinity => f64::INFINITY,
        ShadowRayTarget::Point(point) | ShadowRayTarget::EmitterCentre { point, .. } => {
            (point - start).length().to_f64()
        }
        ShadowRayTarget::Surface(surface) => (surface.point - start).length().to_f64(),
    };
    Some((sample.direction.to_f64(), distance))
}

fn max_sky_radiance<R: Real>(prepared: &PreparedScene<R>) -> f64 {
    let lights = &prepared.lights;
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
