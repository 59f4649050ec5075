//! Scattering on the way through media: distances, phase functions, sampled lights, transmittance.
//!
//! A path walks from a surface through a medium until it reaches the next surface. Distances are
//! sampled by delta tracking in a channel chosen by the path's throughput; the weight is the balance
//! heuristic over the channels ("A Null-Scattering Path Integral Formulation of Light Transport",
//! Miller, Georgiev, Jarosz 2019). In an even medium that is the exponential distribution. Shadow
//! rays estimate transmittance by ratio tracking ("Residual Ratio Tracking for Estimating
//! Attenuation in Participating Media", Novák, Selle, Jarosz 2014).
//!
//! Only scenes with such media use these functions: others pay for a check of one flag.

use core::f64::consts::TAU;
use core::mem::take;

use glam::DVec3;
use raywright_bvh::{Hit, Ray, Real, Surface, TriangleSlot, Vector};

use super::light::power_heuristic;
use super::roulette::{FORCED_ROULETTE_SEGMENTS, apply_roulette, survival_scale};
use super::scatter::ScatteredRay;
use super::vertices::MisStrategy;
use super::{LightKinds, MediumStack, PathState, PathTracer};
use crate::counters::DensityExcess;
use crate::interaction::Interaction;
use crate::light::{LightDensity, LightId, LightSample};
use crate::number::{exp, log1p};
use crate::prepare::{PreparedMedium, ROUNDING, RaySegment};
use crate::sampler::{SamplePurpose, SampleSequence};

/// Number of scatterings of a walk whose random numbers are stratified. Later ones gain nothing by
/// it, and hashed numbers are faster.
const STRATIFIED: u32 = 16;

/// Greatest number of scatterings between two surfaces, and of steps of tracking between two
/// scatterings. The limits only guarantee termination. Rays that reach them are counted.
const MOST_SCATTERINGS: u32 = 1 << 20;

/// Transmittance from which on ratio tracking may end by chance.
const FAINT: f64 = 0.1;

impl<'a, R: Real> PathTracer<'a, R> {
    /// Scatters the paths in the media between their latest surfaces and the next ones. Afterwards
    /// the active paths are those that reach a surface, and the escaped ones those that reach the
    /// sky.
    pub(super) fn scatter_in_media(
        &mut self,
        paths: &mut [PathState<R>],
        (active, hits): (&mut Vec<u32>, &mut Vec<Hit<R>>),
        escaped: &mut Vec<u32>,
    ) {
        let reaching = take(active)
            .into_iter()
            .zip(take(hits).into_iter().map(Some));
        let leaving = take(escaped).into_iter().map(|index| (index, None));
        for (index, hit) in reaching.chain(leaving) {
            match self.walk_through_media(&mut paths[index as usize], hit) {
                Some(Some(hit)) => {
                    active.push(index);
                    hits.push(hit);
                }
                Some(None) => escaped.push(index),
                None => {}
            }
        }
    }

    /// Walks from scattering to scattering until the path reaches a surface or the sky. Returns the
    /// hit of its last segment; `None` if the path ends in a medium.
    fn walk_through_media(
        &mut self,
        path: &mut PathState<R>,
        mut hit: Option<Hit<R>>,
    ) -> Option<Option<Hit<R>>> {
        for walk in 0..MOST_SCATTERINGS {
            let Some((medium, segment)) = self.segment_medium(path, hit.as_ref()) else {
                return Some(hit);
            };
            let is_shaded = path.segments_traced + u32::from(walk == 0) - path.matched_segments
                < self.max_depth;
            let has_lamps = is_shaded && self.samples_lamps_along(medium, segment.range);
            if has_lamps {
                self.add_light_along(path, medium, segment, walk);
            }
            let Some(distance) = self.sample_distance(path, medium, segment, walk) else {
                return (path.throughput != Vector::ZERO).then_some(hit);
            };
            let origin = path.segment.ray.origin;
            // A rounded point must not lie behind the surface ahead.
            let resolution = 8.0 * R::ROUNDOFF.to_f64() * segment.at(distance).abs().max_element();
            let distance = match &hit {
                Some(hit) => distance
                    .min(hit.t.to_f64() - resolution)
                    .max(segment.range[0]),
                None => distance,
            };
            if !self.scatter_at(path, medium, (segment.at(distance), has_lamps), walk) {
                return None;
            }
            hit = self.intersect_path_ray(path);
            if medium.material.is_some()
                && self.is_outside_body(path, medium, hit.as_ref(), resolution)
            {
                // Rounding moved the point out of the body, beside a grazing surface.
                path.segment.ray.origin = origin;
                hit = self.intersect_path_ray(path);
            }
        }
        self.counters.cut_short += 1;
        None
    }

    /// Whether a ray that should start inside a body misses its boundary, or enters it right away.
    fn is_outside_body(
        &self,
        path: &PathState<R>,
        medium: &PreparedMedium,
        hit: Option<&Hit<R>>,
        resolution: f64,
    ) -> bool {
        match hit {
            None => !medium.is_unbounded,
            Some(hit) if hit.t.to_f64() > 4.0 * resolution => false,
            Some(hit) => {
                let material = self.scene.objects[hit.outermost_id() as usize].material;
                Some(material) == medium.material && self.is_hit_from_outside(path, hit)
            }
        }
    }

    fn is_hit_from_outside(&self, path: &PathState<R>, hit: &Hit<R>) -> bool {
        let ray = &path.segment.ray;
        ray.direction
            .dot(self.scene.geometry.surface(ray, hit).normal)
            < R::ZERO
    }

    /// Returns the scattering medium that a path goes through to its next hit, and the segment in
    /// it; `None` in a clear medium, or one that only absorbs evenly.
    pub(super) fn segment_medium(
        &self,
        path: &mut PathState<R>,
        hit: Option<&Hit<R>>,
    ) -> Option<(&'a PreparedMedium, RaySegment)> {
        let scene = self.scene;
        let around = self.effective_medium(&path.media).or_else(|| {
            // A hit from inside implies a body around the path, even if no hit recorded the entry.
            let hit = hit?;
            let material = scene.objects[hit.outermost_id() as usize].material;
            let is_body = self.is_glass_boundary(material) || scene.is_open_boundary(hit);
            (is_body && !self.is_hit_from_outside(path, hit)).then_some(material)
        });
        let length = hit.map_or(f64::INFINITY, |hit| hit.t.to_f64());
        let ray = &path.segment.ray;
        let range = [-path.segment.skipped_distance.to_f64(), length];
        let segment = RaySegment::new::<R>(ray.origin, ray.direction, range);
        let found = self.medium_along(around, segment);
        if hit.is_none() && found.is_some_and(|(medium, _)| medium.material.is_none()) {
            path.media = MediumStack::default();
        }
        found
    }

    /// Returns the scattering medium along a ray inside the body of a material, or outside all
    /// bodies, and the segment in that medium.
    fn medium_along(
        &self,
        material: Option<u32>,
        segment: RaySegment,
    ) -> Option<(&'a PreparedMedium, RaySegment)> {
        let scene = self.scene;
        if let Some(material) = material {
            let medium = &scene.media[scene.materials[material as usize].medium()? as usize];
            // A finite body ends somewhere, even if the ray missed its boundary.
            if segment.range[1] < f64::INFINITY || medium.is_unbounded {
                return Some((medium, segment));
            }
        }
        let air = scene.air.as_ref()?;
        Some((&air.medium, air.intersect(segment)?))
    }

    /// Returns the distance of the next scattering along a segment; `None` if the path passes the
    /// medium. The path's throughput is multiplied by the weight of the event.
    fn sample_distance(
        &mut self,
        path: &mut PathState<R>,
        medium: &PreparedMedium,
        segment: RaySegment,
        walk: u32,
    ) -> Option<f64> {
        if medium.is_dark() {
            let passed = self.transmittance_along(path, medium, segment);
            path.throughput *= R::Vec3::from_f64(passed);
            return None;
        }
        let mut beta = path.throughput.to_f64();
        let [coarse, mut u_channel, fine, _] =
            numbers(path, SamplePurpose::Medium, walk).map(f64::from);
        let mut further =
            sequence(path, SamplePurpose::Medium).hashed_numbers(path.address.index, 0);
        let mut u = coarse + fine / (1 << 23) as f64;
        let mut parts = medium.parts_along(segment);
        let (mut t, mut end, mut most) = (segment.range[0], segment.range[0], 0.0);
        for _ in 0..MOST_SCATTERINGS {
            let shares = channel_shares(beta);
            let step = exponential(u, medium.majorant[choose_channel(shares, u_channel)]);
            // Lengths at the greatest density of all. An endless step does not end in an endless
            // medium.
            let mut length = 0.0;
            let scatters = loop {
                let reach = (end - t) * most;
                if length + reach > step {
                    t += (step - length) / most;
                    break true;
                }
                length += reach;
                let Some((next, [_, greatest])) = parts.next() else {
                    break false;
                };
                (t, end, most) = (end, next, greatest);
            };
            if scatters {
                length = step;
            }
            // In a grey medium all channels agree.
            if !medium.is_grey() {
                let mut event = beer_lambert(medium.majorant, length);
                if scatters {
                    event *= medium.majorant;
                }
                beta *= event / shares.dot(event);
            }
            if !scatters {
                path.throughput = R::Vec3::from_f64(beta);
                return None;
            }
            let is_met = medium.density.is_none() || {
                let density = self.relative_density(medium, segment.at(t));
                further.next() < Some(density / most)
            };
            if is_met {
                path.throughput = R::Vec3::from_f64(beta * medium.albedo);
                return Some(t);
            }
            (u, u_channel) = (further.next()?, further.next()?);
        }
        self.counters.cut_short += 1;
        path.throughput = Vector::ZERO;
        None
    }

    /// Returns the density of a medium at a point over the greatest density. Values out of this range
    /// are counted.
    pub(super) fn relative_density(&mut self, medium: &PreparedMedium, point: DVec3) -> f64 {
        let Some((program, per_most)) = medium.density else {
            return 1.0;
        };
        let point = R::Vec3::from_f64(point);
        let density = self.scene.texture_tables.eval_at_point(program, point) * per_most;
        if !(0.0..=1.0 + ROUNDING).contains(&density) {
            let place = self.scene.to_world(point).to_array();
            self.counters.excess += DensityExcess::new(medium.material, density, place);
        }
        density.clamp(0.0, 1.0).max(0.0)
    }

    /// Scatters a path at a point of its segment: adds the light that reaches this point
    /// directly, and continues in a direction of the phase function. Returns whether the path goes
    /// on. `has_lamps`: whether the segment has the light of lamps without size already.
    fn scatter_at(
        &mut self,
        path: &mut PathState<R>,
        medium: &PreparedMedium,
        (point, has_lamps): (DVec3, bool),
        walk: u32,
    ) -> bool {
        // All scatterings between two surfaces are one segment.
        path.segments_traced += u32::from(walk == 0);
        (path.has_hit, path.start) = (true, TriangleSlot::NONE);
        if self.is_at_depth_limit(path) {
            return false;
        }
        let incoming = path.segment.ray.direction.to_f64();
        let point = R::Vec3::from_f64(point);
        // A sealed body gets light of a size through its surface alone, which no shadow ray passes.
        let kinds = if medium.is_sealed {
            LightKinds::None
        } else {
            LightKinds::AllButEvenSky
        };
        self.add_scattered_light(path, medium, (point, has_lamps), (walk, kinds));
        let [u, v, u_roulette, _] = numbers(path, SamplePurpose::Scatter, walk);
        let (direction, density) = sample_phase(medium.anisotropy, incoming, [u, v].map(f64::from));
        let direction = R::Vec3::from_f64(direction);
        let traced = (path.segments_traced + walk).min(FORCED_ROULETTE_SEGMENTS - 1);
        let (throughput, continues) = apply_roulette::<R>(
            path.throughput,
            survival_scale(traced, path.throughput, self.scene.roulette),
            R::from_f32(u_roulette),
        );
        if continues {
            self.start_segment(
                path,
                point,
                (throughput, density),
                (&Ray::new(point, direction), Vector::ZERO),
                &ScatteredRay::REFLECTED,
            );
            path.previous.lights = kinds;
        }
        continues
    }

    /// Samples a light for a point in a medium, and adds the light that is scattered along the path.
    fn add_scattered_light(
        &mut self,
        path: &mut PathState<R>,
        medium: &PreparedMedium,
        (point, has_lamps): (R::Vec3, bool),
        (walk, kinds): (u32, LightKinds),
    ) {
        let lights = &self.scene.lights;
        let is_sealed = kinds == LightKinds::None;
        if is_sealed && lights.delta.is_empty() {
            return;
        }
        let [coarse, fine, u, v] = numbers(path, SamplePurpose::Light, walk);
        let Some((light, probability)) = lights.sample_in_medium(point, [coarse, fine]) else {
            return;
        };
        let is_delta = matches!(light, LightId::Delta(_));
        if is_sealed && !is_delta || has_lamps && is_delta {
            return;
        }
        let Some(sample) = lights.sample(light, point, [u, v], probability) else {
            return;
        };
        let Some(strategy) = self.mis_strategy(light, sample.density) else {
            return;
        };
        let incoming = path.segment.ray.direction.to_f64();
        let phase = phase(medium.anisotropy, incoming, sample.direction.to_f64());
        let weight = match (strategy, sample.density) {
            (MisStrategy::PowerHeuristic, LightDensity::SolidAngle(density)) => {
                power_heuristic(density, phase)
            }
            _ => 1.0,
        };
        if let LightDensity::SolidAngle(density) = sample.density {
            let arriving = sample.arriving.to_f64().max_element();
            path.light_sample = [density, density * arriving];
        }
        let scattered = sample.arriving * R::from_f64(phase * weight);
        self.add_visible_light(path, point, (light, sample), scattered);
    }

    /// Adds light that is scattered at a point of a medium, times the visibility of its source.
    pub(super) fn add_visible_light(
        &mut self,
        path: &mut PathState<R>,
        point: R::Vec3,
        (light, sample): (LightId, LightSample<R>),
        scattered: R::Vec3,
    ) {
        let interaction = Interaction {
            surface: Surface {
                point,
                above: point,
                below: point,
                ..Interaction::PLACEHOLDER.surface
            },
            outside: true,
            direction: path.segment.ray.direction,
            time: path.segment.ray.time,
            ..Interaction::PLACEHOLDER
        };
        let scattered =
            self.apply_visibility(path, &interaction, (light, sample, false), scattered);
        path.radiance += path.throughput * scattered;
    }

    /// Returns the transmittance of the scattering medium along a part of a shadow ray.
    #[inline(always)]
    pub(super) fn scattering_transmittance(
        &mut self,
        path: &PathState<R>,
        media: &MediumStack,
        (from, direction, length): (R::Vec3, R::Vec3, R),
    ) -> R::Vec3 {
        if !self.scene.scatters {
            return Vector::ONE;
        }
        let segment = RaySegment::new::<R>(from, direction, [0.0, length.to_f64()]);
        self.medium_along(self.effective_medium(media), segment)
            .map_or(Vector::ONE, |(medium, segment)| {
                R::Vec3::from_f64(self.transmittance_along(path, medium, segment))
            })
    }

    /// Returns the transmittance of a medium along a ray: exact in an even medium, otherwise an
    /// estimate by ratio tracking.
    pub(super) fn transmittance_along(
        &mut self,
        path: &PathState<R>,
        medium: &PreparedMedium,
        segment: RaySegment,
    ) -> DVec3 {
        let (origin, [from, to]) = (segment.origin, segment.range);
        if medium.density.is_none() {
            return beer_lambert(medium.majorant, to - from);
        }
        let rate = medium.majorant.max_element();
        let salt =
            origin.x.to_bits() ^ origin.y.to_bits().rotate_left(21) ^ to.to_bits().rotate_left(42);
        let mut numbers = sequence(path, SamplePurpose::Medium)
            .hashed_numbers(path.address.index, salt | 1)
            .take(3 * MOST_SCATTERINGS as usize);
        // The least density of each part attenuates evenly, and only the rest by chance.
        let (mut passed, mut even, mut start) = (DVec3::ONE, 0.0, from);
        let mut step = exponential(numbers.next().unwrap_or_default(), rate);
        for (end, [least, greatest]) in medium.parts_along(segment) {
            let (mut t, varying) = (start, greatest - least);
            if least > 0.0 {
                even += least * (end - start);
            }
            start = end;
            while step < (end - t) * varying {
                t += step / varying;
                let density = self.relative_density(medium, segment.at(t));
                passed *= DVec3::ONE - medium.majorant * ((density - least) / (rate * varying));
                let most = (passed * beer_lambert(medium.majorant, even)).max_element();
                if most < FAINT {
                    if numbers.next() >= Some(most / FAINT) {
                        return DVec3::ZERO;
                    }
                    passed *= FAINT / most;
                }
                let Some(u) = numbers.next() else {
                    self.counters.cut_short += 1;
                    return DVec3::ZERO;
                };
                step = exponential(u, rate);
            }
            step -= (end - t) * varying;
        }
        passed * beer_lambert(medium.majorant, even)
    }
}

/// Returns the sequence of a path's vertex.
fn sequence<R: Real>(path: &PathState<R>, purpose: SamplePurpose) -> SampleSequence {
    SampleSequence::from_sample_hash(path.sample_hash, path.address, purpose)
}

/// Returns four numbers in [0, 1) for a scattering.
pub(super) fn numbers<R: Real>(path: &PathState<R>, purpose: SamplePurpose, walk: u32) -> [f32; 4] {
    let (sequence, index) = (sequence(path, purpose), path.address.index);
    if walk < STRATIFIED {
        return sequence.sample_4d(index);
    }
    let mut hashed = sequence.hashed_numbers(index, 2);
    // Rounded down, so that no number becomes one.
    core::array::from_fn(|_| {
        let steps = hashed.next().unwrap_or_default() * (1 << 23) as f64;
        steps.floor() as f32 / (1 << 23) as f32
    })
}

/// Returns the probability of choosing each channel for a path of this throughput.
fn channel_shares(beta: DVec3) -> DVec3 {
    let sum = beta.element_sum();
    if sum > 0.0 && sum < f64::INFINITY {
        beta / sum
    } else {
        DVec3::splat(1.0 / 3.0)
    }
}

fn choose_channel(shares: DVec3, u: f64) -> usize {
    match u {
        u if u < shares.x => 0,
        u if u < shares.x + shares.y => 1,
        // Of a sum that rounds to less than one, the last channel that has a share.
        _ if shares.z > 0.0 => 2,
        _ => usize::from(shares.y > 0.0),
    }
}

/// Returns the exponentially distributed number of a uniform number; infinite for a rate of zero.
fn exponential(u: f64, rate: f64) -> f64 {
    if rate > 0.0 {
        -log1p(-u) / rate
    } else {
        f64::INFINITY
    }
}

/// Returns the transmittance exp(−σ·length) for a coefficient σ per metre (Beer and Lambert). A zero
/// coefficient attenuates nothing, even over an infinite length.
pub(super) fn beer_lambert(attenuation: DVec3, length: f64) -> DVec3 {
    let share = |a: f64| {
        let passed = exp(-a * length);
        if a > 0.0 && length > 0.0 { passed } else { 1.0 }
    };
    DVec3::from(attenuation.to_array().map(share))
}

/// Returns the density by solid angle of the phase function of Henyey and Greenstein, between two
/// directions of propagation. From the difference of the directions, since the cosine of a small
/// angle has lost its digits.
pub(super) fn phase(g: f64, incoming: DVec3, outgoing: DVec3) -> f64 {
    let apart = (incoming.normalize() - outgoing.normalize()).length_squared();
    let squared = (1.0 - g) * (1.0 - g) + g * apart;
    (1.0 - g * g) / (2.0 * TAU * squared * squared.sqrt())
}

/// Samples a direction by the phase function [`phase`]. Returns it with its density.
fn sample_phase(g: f64, incoming: DVec3, [u, v]: [f64; 2]) -> (DVec3, f64) {
    let (cos, density) = if g.abs() < 1e-3 {
        (1.0 - 2.0 * u, 1.0)
    } else {
        let s = (1.0 - g * g) / (1.0 - g + 2.0 * g * u);
        (
            (1.0 + g * g - s * s) / (2.0 * g),
            (1.0 - g * g) / (s * s * s),
        )
    };
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    let axis = incoming.normalize();
    let (x, y) = axis.any_orthonormal_pair();
    let [sin_phi, cos_phi] = Real::sin_cos_turns(v);
    let direction = axis * cos + (x * cos_phi + y * sin_phi) * sin;
    (direction, density / (2.0 * TAU))
}
