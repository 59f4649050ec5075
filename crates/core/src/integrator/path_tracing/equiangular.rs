//! Light of lamps without size in thin even media, by equiangular sampling: points along a segment
//! are denser where the lamp is near ("Importance Sampling Techniques for Path Tracing in
//! Participating Media", Kulla, Fajardo 2012). Half of the points follow the attenuation instead; the
//! weight is that of the mixture. Where a segment is sampled so, its scatterings leave these lamps
//! out.

use raywright_bvh::{Real, Vector};

use super::scattering::{beer_lambert, numbers, phase};
use super::{PathState, PathTracer};
use crate::light::{LightId, MOST_PLACED};
use crate::prepare::PreparedMedium;
use crate::sampler::SamplePurpose;

/// Optical depth of a segment from which on it is sampled by its scatterings alone.
const THICK: f64 = 8.0;

/// A lamp along a segment.
#[derive(Clone, Copy, Default)]
struct SegmentLamp {
    index: u32,
    /// Distance along the segment of its point closest to the lamp, and distance of both.
    along: f64,
    aside: f64,
    /// Angles of the segment's ends, seen from the lamp.
    angles: [f64; 2],
    /// Estimate of the light that the segment gets.
    weight: f64,
}

impl<R: Real> PathTracer<'_, R> {
    /// Whether lamps are sampled along a segment, apart from its scatterings.
    pub(super) fn samples_lamps_along(
        &self,
        medium: &PreparedMedium,
        [from, to]: [f64; 2],
    ) -> bool {
        !self.scene.equiangular_lamps.is_empty()
            && medium.density.is_none()
            && !medium.is_dark()
            && medium.majorant.max_element() * (to - from) < THICK
    }

    /// Whether a light is one of the lamps that are sampled along segments.
    pub(super) fn is_lamp_along(&self, light: LightId) -> bool {
        matches!(light, LightId::Delta(i) if self.scene.lights.delta[i as usize].position().is_some())
    }

    /// Samples a lamp and a point of a segment, and adds the light that is scattered there along the
    /// path.
    pub(super) fn add_light_along(
        &mut self,
        path: &mut PathState<R>,
        medium: &PreparedMedium,
        [from, to]: [f64; 2],
        walk: u32,
    ) {
        let (origin, direction) = (path.segment.ray.origin, path.segment.ray.direction);
        let (origin, direction) = (origin.to_f64(), direction.to_f64());
        let [u, u_lamp, u_technique, _] =
            numbers(path, SamplePurpose::Airlight, walk).map(f64::from);
        let mut lamps = [SegmentLamp::default(); MOST_PLACED];
        let placed = &self.scene.equiangular_lamps;
        for (lamp, &(index, position)) in lamps.iter_mut().zip(placed) {
            let offset = position - origin;
            let along = offset.dot(direction);
            // On the line of the segment, no farther from it than the segment resolves.
            let least = R::ROUNDOFF.to_f64() * (offset.length() + to - from);
            let aside = (offset - direction * along).length().max(least);
            let angles = [from, to].map(|end| libm::atan2(end - along, aside));
            let light = &self.scene.lights.delta[index as usize];
            let weight = light.intensity(aside) * (angles[1] - angles[0]) / aside;
            *lamp = SegmentLamp {
                index,
                along,
                aside,
                angles,
                weight,
            };
        }
        let sum: f64 = lamps.iter().map(|lamp| lamp.weight).sum();
        let mut rest = u_lamp * sum;
        let Some(lamp) = lamps[..placed.len()].iter().find(|lamp| {
            rest -= lamp.weight;
            rest < 0.0
        }) else {
            return;
        };
        let (rate, [start, end]) = (medium.majorant.max_element(), lamp.angles);
        let lost = -libm::expm1(-rate * (to - from));
        let t = if u_technique < 0.5 {
            lamp.along + lamp.aside * libm::tan(start + u * (end - start))
        } else {
            from - libm::log1p(-u * lost) / rate
        };
        let t = t.clamp(from, to);
        let square = lamp.aside * lamp.aside + (t - lamp.along) * (t - lamp.along);
        let equiangular = lamp.aside / ((end - start) * square);
        let exponential = rate * libm::exp(-rate * (t - from)) / lost;
        let density = 0.5 * (equiangular + exponential) * lamp.weight / sum;
        let point = R::Vec3::from_f64(origin + direction * t);
        let Some(sample) = self.scene.lights.delta[lamp.index as usize].sample(point) else {
            return;
        };
        let scattering = medium.majorant * medium.albedo;
        let share = beer_lambert(medium.majorant, t - from)
            * scattering
            * (phase(medium.anisotropy, direction, sample.direction.to_f64()) / density);
        let scattered = sample.arriving * R::Vec3::from_f64(share);
        self.add_visible_light(path, point, (LightId::Delta(lamp.index), sample), scattered);
    }
}
