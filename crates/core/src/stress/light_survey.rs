//! The lights of a scene, and what the rays from and to them met.

use super::*;
use crate::scene::LightKind;

/// Least number of walks from which a light is judged.
const FEWEST_WALKS: u64 = 50;

/// Where a light shines.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Beam {
    /// Position; `None` for a light infinitely far away.
    pub position: Option<DVec3>,
    /// Direction to such a light.
    pub to_light: DVec3,
    pub range: Option<f64>,
    /// Axis of the cone of a spot light, and its half angle in degrees.
    pub cone: Option<(DVec3, f64)>,
}

impl From<&LightKind> for Beam {
    fn from(kind: &LightKind) -> Self {
        let mut beam = Self::default();
        match *kind {
            LightKind::Directional { to_light } => {
                beam.to_light = DVec3::from(to_light).normalize_or_zero();
            }
            LightKind::Point {
                position, range, ..
            } => (beam.position, beam.range) = (Some(position.into()), range),
            LightKind::Spot {
                position,
                direction,
                outer_angle,
                range,
                ..
            } => {
                (beam.position, beam.range) = (Some(position.into()), range);
                beam.cone = Some((DVec3::from(direction).normalize_or_zero(), outer_angle));
            }
        }
        beam
    }
}

/// A light and what its rays met: a delta light, an emissive object, or the sky.
#[derive(Clone, Debug, Default)]
pub(super) struct LightFacts {
    pub subject: FindingSubject,
    /// Numbers of rays from visible surfaces to the light: unblocked rays, rays blocked by glass
    /// alone, and rays blocked by opaque objects, by the first such object.
    pub unblocked: u64,
    pub through_glass: u64,
    pub blocked: BTreeMap<usize, u64>,
    /// The first glass object in the way.
    pub glass: Option<usize>,
    /// Number of walks that hit an opaque surface, and whether one of them reached a point to which a
    /// camera, or a point that it sees, has an unblocked line.
    pub walks: u64,
    pub is_seen: bool,
    /// For a delta light. `rays`: number of rays that left it. `hits`: those that hit a non-emissive
    /// surface within its range. `nearest`: distance to the nearest surface that a ray hit, in
    /// metres. `lamp`: an emissive object that a ray hit.
    pub rays: u64,
    pub hits: u64,
    pub nearest: Option<f64>,
    pub lamp: Option<usize>,
    /// For an emissive object. Area in square metres; radiance times area, summed over three
    /// channels, of both sides if both emit; greatest radiance, the mean of three channels.
    pub area: f64,
    pub power: f64,
    pub radiance: f64,
    /// Distance of the object's centre from the nearest camera, in metres.
    pub eye_distance: f64,
    /// Object of the body of glass around it.
    pub enclosing_glass: Option<usize>,
    /// Mean radiance that the visible surfaces reflect of its light if glass lets all light pass.
    pub arriving: f64,
    /// Variance of a sample of the radiance, in units of the squared mean, and share of the samples
    /// with half of the light. Zero for uniform emission.
    pub variance: f64,
    pub half_light_area: f64,
}

impl LightFacts {
    pub fn new(subject: FindingSubject) -> Self {
        Self {
            subject,
            ..Self::default()
        }
    }

    /// Returns the number of walks if they show that no light arrives.
    pub fn unseen_walks(&self) -> Option<u64> {
        (!self.is_seen && self.walks >= FEWEST_WALKS).then_some(self.walks)
    }

    /// Sets the variance of the radiance and the share of the surface with half of the light from
    /// samples of the radiance. Returns their mean.
    pub fn measure_variance(&mut self, mut samples: Vec<f64>) -> f64 {
        samples.sort_unstable_by(f64::total_cmp);
        let number = samples.len() as f64;
        let sum: f64 = samples.iter().sum();
        let squares: f64 = samples.iter().map(|radiance| radiance * radiance).sum();
        let mut rest = 0.5 * sum;
        let brightest = samples.iter().rev().take_while(|&&radiance| {
            rest -= radiance;
            rest > 0.0
        });
        if sum > 0.0 {
            self.half_light_area = (brightest.count() + 1) as f64 / number;
            self.variance = squares * number / (sum * sum) - 1.0;
        }
        sum / number
    }

    /// Adds the rays of another camera.
    fn combine(&mut self, other: Self) {
        self.unblocked += other.unblocked;
        self.through_glass += other.through_glass;
        for (object, count) in other.blocked {
            *self.blocked.entry(object).or_default() += count;
        }
        self.glass = self.glass.or(other.glass);
        self.walks += other.walks;
        self.is_seen |= other.is_seen;
        self.eye_distance = self.eye_distance.min(other.eye_distance);
    }
}

/// Survey of the lights, for a single camera or for several.
#[derive(Clone, Debug, Default)]
pub(super) struct LightSurvey {
    /// The first delta lights of the scene's list, in order.
    pub lights: Vec<LightFacts>,
    /// Number of lights from which rays were sent. The deadline may leave out some.
    pub surveyed: u64,
    /// Emissive objects, in the order of their facts; each copy of a generator is one.
    pub lamps: Vec<LightFacts>,
    /// Listed shapes whose emission varies, for the first camera.
    pub uneven_lamps: Vec<LightFacts>,
    pub sky: Option<LightFacts>,
    /// Greatest radiance of emissive objects, and among directions sampled by the sky's brightness;
    /// the mean of three channels.
    pub max_radiance: f64,
}

impl LightSurvey {
    /// Adds the survey of another camera.
    #[must_use]
    pub fn combine(mut self, other: Self) -> Self {
        let own = self
            .lights
            .iter_mut()
            .chain(&mut self.lamps)
            .chain(&mut self.sky);
        let others = other.lights.into_iter().chain(other.lamps).chain(other.sky);
        own.zip(others).for_each(|(own, other)| own.combine(other));
        self
    }

    pub fn lights_and_lamps(&self) -> impl Iterator<Item = &LightFacts> {
        self.lights.iter().chain(&self.lamps)
    }

    /// Returns the facts about a light, or about the first lamp of an object.
    pub fn light(&self, subject: FindingSubject) -> Option<&LightFacts> {
        self.lights_and_lamps()
            .find(|light| light.subject == subject)
    }
}
