//! Light of lamps without size and of suns in thin media, by points along a segment: denser where a
//! lamp is near ("Importance Sampling Techniques for Path Tracing in Participating Media", Kulla,
//! Fajardo 2012), even for a sun, and only within the cone of a spot. Half of the points follow the
//! attenuation instead; the weight is that of the mixture. Where a segment is sampled so, its
//! scatterings leave these lamps out.

use glam::DVec3;
use raywright_bvh::{Real, Vector};

use super::scattering::{numbers, phase};
use super::{PathState, PathTracer};
use crate::light::{LightId, MOST_PLACED};
use crate::prepare::{PreparedMedium, RaySegment};
use crate::sampler::SamplePurpose;

/// Optical depth of a segment from which on it is sampled by its scatterings alone.
const THICK: f64 = 8.0;

/// Number of points on a camera ray, which are most of the noise of shafts and cones of light.
const CAMERA_POINTS: u32 = 4;

/// Steps between the points of a camera ray, by number of the random number: even along the ray,
/// and irrational for the choices of lamp and of technique (Martin Roberts, "The Unreasonable
/// Effectiveness of Quasirandom Sequences", 2018).
const STEPS: [f64; 3] = [1.0 / CAMERA_POINTS as f64, 0.754_877_67, 0.569_840_29];

/// A lamp along a segment.
#[derive(Clone, Copy, Default)]
struct SegmentLamp {
    index: u32,
    /// Part of the segment that the lamp may light.
    range: [f64; 2],
    /// Distance along the segment of its point closest to the lamp, and distance of both; `None`
    /// for a sun.
    closest: Option<[f64; 2]>,
    /// Angles of the part's ends, seen from the lamp; for a sun its distances.
    ends: [f64; 2],
    /// Estimate of the light that the segment gets.
    weight: f64,
}

impl SegmentLamp {
    /// Returns the distance of a uniform number, dense where the lamp is near.
    fn sample(&self, u: f64) -> f64 {
        let [start, end] = self.ends;
        let at = start + u * (end - start);
        self.closest
            .map_or(at, |[along, aside]| along + aside * libm::tan(at))
    }

    /// Returns the density per metre of [`Self::sample`].
    fn density(&self, t: f64) -> f64 {
        let span = self.ends[1] - self.ends[0];
        match self.closest {
            Some([along, aside]) => aside / (span * (aside * aside + (t - along) * (t - along))),
            None => 1.0 / span,
        }
    }
}

impl<R: Real> PathTracer<'_, R> {
    /// Whether lights without size are sampled along a segment, apart from its scatterings: in thin
    /// media that light enters straight. The surface of a body blocks all of it.
    pub(super) fn samples_lamps_along(
        &self,
        medium: &PreparedMedium,
        [from, to]: [f64; 2],
    ) -> bool {
        let is_open = |material: u32| self.scene.materials[material as usize].is_open();
        let depth = medium.majorant.max_element() * (to - from);
        !self.scene.equiangular_lamps.is_empty()
            && !medium.is_dark()
            && medium.material.is_none_or(is_open)
            && (f64::MIN_POSITIVE..THICK).contains(&depth)
    }

    /// Samples lamps and points of a segment, and adds the light that is scattered there along the
    /// path.
    pub(super) fn add_light_along(
        &mut self,
        path: &mut PathState<R>,
        medium: &PreparedMedium,
        segment: RaySegment,
        walk: u32,
    ) {
        let mut lamps = [SegmentLamp::default(); MOST_PLACED];
        let placed = &self.scene.equiangular_lamps;
        let lamps = &mut lamps[..placed.len()];
        for (lamp, &(index, position)) in lamps.iter_mut().zip(placed) {
            *lamp = self.lamp_along((index, position), segment);
        }
        let sum: f64 = lamps.iter().map(|lamp| lamp.weight).sum();
        let drawn = numbers(path, SamplePurpose::Airlight, walk).map(f64::from);
        let points = if path.segments_traced == 0 && walk == 0 {
            CAMERA_POINTS
        } else {
            1
        };
        for k in 0..points {
            let [u, u_lamp, u_technique] = core::array::from_fn(|i| {
                let u = drawn[i] + STEPS[i] * f64::from(k);
                u - u.floor()
            });
            let mut rest = u_lamp * sum;
            let Some(lamp) = lamps.iter().find(|lamp| {
                rest -= lamp.weight;
                rest < 0.0
            }) else {
                continue;
            };
            let chance = lamp.weight / sum * f64::from(points);
            self.add_light_of_lamp(path, medium, segment, (lamp, chance), [u, u_technique]);
        }
    }

    /// Returns a lamp as a segment sees it.
    fn lamp_along(
        &self,
        (index, position): (u32, Option<DVec3>),
        segment: RaySegment,
    ) -> SegmentLamp {
        let light = &self.scene.lights.delta[index as usize];
        let RaySegment {
            origin,
            direction,
            range: [from, to],
        } = segment;
        let closest = position.map(|position| {
            let offset = position - origin;
            let along = offset.dot(direction);
            // On the line of the segment, no farther from it than the segment resolves.
            let least = R::ROUNDOFF.to_f64() * (offset.length() + to - from);
            [along, (offset - direction * along).length().max(least)]
        });
        let range = light.lit_range(origin, direction, segment.range);
        let ends = closest.map_or(range, |[along, aside]| {
            range.map(|end| libm::atan2(end - along, aside))
        });
        let aside = closest.map_or(1.0, |[_, aside]| aside);
        SegmentLamp {
            index,
            range,
            closest,
            ends,
            weight: light.intensity(aside) * (ends[1] - ends[0]).max(0.0) / aside,
        }
    }

    /// Samples a point of a segment for a lamp, and adds the light that is scattered there. `chance`
    /// is the expected number of points of the lamp.
    fn add_light_of_lamp(
        &mut self,
        path: &mut PathState<R>,
        medium: &PreparedMedium,
        segment: RaySegment,
        (lamp, chance): (&SegmentLamp, f64),
        [u, u_technique]: [f64; 2],
    ) {
        let (rate, [start, end]) = (medium.majorant.max_element(), lamp.range);
        let lost = -libm::expm1(-rate * (end - start));
        let t = if u_technique < 0.5 {
            lamp.sample(u)
        } else {
            start - libm::log1p(-u * lost) / rate
        };
        let t = t.clamp(start, end);
        let exponential = rate * libm::exp(-rate * (t - start)) / lost;
        let density = 0.5 * (lamp.density(t) + exponential) * chance;
        let place = segment.at(t);
        let point = R::Vec3::from_f64(place);
        let Some(sample) = self.scene.lights.delta[lamp.index as usize].sample(point) else {
            return;
        };
        let scattering = medium.majorant * medium.albedo * self.relative_density(medium, place);
        let phase = phase(
            medium.anisotropy,
            segment.direction,
            sample.direction.to_f64(),
        );
        let before = RaySegment {
            range: [segment.range[0], t],
            ..segment
        };
        let share = self.transmittance_along(path, medium, before) * scattering * (phase / density);
        let scattered = sample.arriving * R::Vec3::from_f64(share);
        if scattered != Vector::ZERO {
            let light = (LightId::Delta(lamp.index), sample);
            self.add_visible_light(path, point, light, scattered);
        }
    }
}
