//! All lights of a scene behind one interface. Delta lights, area lights and the sky are sampled
//! and weighted alike, so that callers (the choice among lights, multiple importance sampling) need
//! not know the kind of a light.
//!
//! [`Lights::sample`] samples a light from a point. The sample holds a direction, the radiance from
//! that direction over its sampling density, the density by solid angle, and the target of a shadow
//! ray. [`Lights::density`] returns the same density for a point of a light that a ray hit, and
//! [`Emitters::emitter_index_of`] finds the light of such a hit. [`Lights::power`] and
//! [`Lights::bounds`] serve the choice among lights. A delta light has no density
//! ([`LightDensity::Delta`]): no ray can hit it.
//!
//! Whitted's integrator samples every delta light in scene order, and one emitter chosen by power.
//! It never samples the sky, so no sky sampler is built for it. The path tracer chooses one light
//! at each vertex, the sky among them: it calls [`Lights::build_sky_sampler`] and
//! [`Lights::build_light_sampler`].
//!
//! The tables are flat arrays of plain data, built by preparation and read-only while rendering.

mod bounds;
mod cdf;
mod delta;
mod emitters;
mod grid;
mod irradiance;
mod lanes;
mod light_sampler;
mod openings;
mod polygon;
mod rectangles;
mod sky;
mod sky_lobe;
mod sky_sampler;
mod tree;
mod usage;

use raywright_bvh::{Aabb, Real, Surface, Vector};

use emitters::EmitterLanes;
use grid::visit_directions;

pub use bounds::{DirectionCone, LightBounds};
pub use delta::DeltaLight;
pub(crate) use delta::{MOST_PLACED, placed_lights};
pub use emitters::{EmissionEstimate, EmissionPoint, EmitterList, EmitterStrategy, Emitters};
pub use grid::SphereGrid;
pub use irradiance::Irradiance;
pub(crate) use lanes::{
    LANES, LaneColumn, LightChoices, LightSampleLanes, ReceivingPointLanes, ShadowRayTargetKind,
    SurfaceLanes, Vec3Column, get_lane_vector, set_lane_vector,
};
pub use light_sampler::LightSampler;
pub(crate) use light_sampler::add_numbers;
use openings::CellBins;
pub use openings::Openings;
pub(crate) use openings::{BINS, CellGrid, SkyBins, smooth_bins};
pub use polygon::Polygon;
pub(crate) use rectangles::RectangleLamps;
#[cfg(test)]
pub(crate) use rectangles::lamps_scene as rectangle_lamps_scene;
pub use sky::{SkyRadiance, SkySample};
pub(crate) use sky::{max_sky_table_bytes, prepare_sky_radiance as prepare_sky};
pub use sky_sampler::SkySampler;
use sky_sampler::sky_light_sample;
pub(crate) use usage::LightUsage;

/// Identifier of a light of a scene: its kind and index.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum LightId {
    /// A delta light, by its index in the scene's list.
    Delta(u32),
    /// An emissive shape or triangle, by its index in [`Emitters`].
    Emitter(u32),
    /// The sky.
    Sky,
}

/// End of a shadow ray: infinity, or a sampled or hit point of a light.
#[derive(Clone, Copy, Debug)]
pub enum ShadowRayTarget<R: Real> {
    /// Infinity.
    Infinity,
    /// A point that no ray can hit.
    Point(R::Vec3),
    /// A point of a lamp's surface; the lamp must not shadow itself.
    Surface(Surface<R>),
    /// The centre of an emitter. The emitter does not shadow itself, although rays to its centre
    /// hit it.
    EmitterCentre {
        /// The centre.
        point: R::Vec3,
        /// Index of the emitter.
        emitter: u32,
    },
}

/// Density with which light sampling chooses the direction of a [`LightSample`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightDensity {
    /// A delta light: a single direction.
    Delta,
    /// Density by solid angle, times the probability of the light.
    SolidAngle(f64),
}

/// A direction to a light, sampled for a receiving point, with its radiance over density and the
/// target of its shadow ray.
#[derive(Clone, Copy, Debug)]
pub struct LightSample<R: Real> {
    /// Unit direction to the light.
    pub direction: R::Vec3,
    /// Unoccluded estimate of the irradiance on a surface that faces the light: radiance over
    /// density; the irradiance itself for a delta light.
    pub arriving: R::Vec3,
    /// Sampling density of `direction`.
    pub density: LightDensity,
    /// Target of the shadow ray.
    pub target: ShadowRayTarget<R>,
}

/// A point that samples the sky.
struct SkyReceiver<R: Real> {
    /// Index of the point's batch, and the lane in it.
    place: [usize; 2],
    from: R::Vec3,
    /// Two uniform numbers in [0, 1).
    numbers: [f32; 2],
    /// Probability of choosing the sky.
    probability: f64,
}

/// All lights of a prepared scene: delta lights, emitters and the sky.
#[derive(Clone, Debug)]
pub struct Lights<R: Real> {
    /// Delta lights, in scene order.
    pub delta: Vec<DeltaLight<R>>,
    /// Emissive surfaces.
    pub emitters: Emitters<R>,
    /// Radiance of rays that hit nothing.
    pub sky: SkyRadiance<R>,
    sky_sampler: Option<SkySampler>,
    /// Where the sky can be seen from; `None` where it is not called for.
    openings: Option<Openings>,
    /// Sampler of lights; empty until prepared.
    light_sampler: LightSampler,
    /// Half the diagonal of the bounded part of the scene, or 1 without such a part: the radius of
    /// the scene for infinitely distant lights.
    scene_radius: f64,
}

impl<R: Real> Lights<R> {
    /// Collects the lights of a scene whose bounded part lies within `scene`.
    pub fn new(
        delta: Vec<DeltaLight<R>>,
        emitters: Emitters<R>,
        sky: SkyRadiance<R>,
        scene: &Aabb,
    ) -> Self {
        // Unbounded surfaces alone have no extent, but receive light too.
        let reach = Some(0.5 * scene.extent().length())
            .filter(|&reach| !scene.is_empty() && reach > 0.0)
            .unwrap_or(1.0);
        Self {
            delta,
            emitters,
            sky,
            sky_sampler: None,
            openings: None,
            light_sampler: LightSampler::default(),
            scene_radius: reach,
        }
    }

    /// Builds the sky sampler. Without a sampler, the sky has no power and is never sampled.
    pub fn build_sky_sampler(&mut self) {
        self.sky_sampler = SkySampler::new(&self.sky);
    }

    /// Restricts sky sampling to the excess of the sky over its uniform part: see
    /// [`SkySampler::into_bright_excess_sampler`].
    pub fn sample_bright_excess(&mut self) {
        self.sky_sampler = self
            .sky_sampler
            .take()
            .map(|sampler| sampler.into_bright_excess_sampler(&self.sky));
    }

    /// Sets the table by which the sky is sampled where it can be seen.
    pub(crate) fn set_openings(&mut self, openings: Option<Openings>) {
        self.openings = openings;
    }

    /// Returns the table by which the sky is sampled where it can be seen, if called for.
    pub fn openings(&self) -> Option<&Openings> {
        self.openings.as_ref()
    }

    /// Builds the sampler of all lights; the sky is included if its sampler is built.
    pub fn build_light_sampler(&mut self) {
        self.light_sampler = LightSampler::new(self);
    }

    /// Returns the sampler of lights; empty if not prepared.
    pub fn light_sampler(&self) -> &LightSampler {
        &self.light_sampler
    }

    /// Iterates over all lights, in the order of the tables: delta lights, emitters, then the sky
    /// if it is sampled.
    pub fn light_ids(&self) -> impl Iterator<Item = LightId> {
        let deltas = (0..self.delta.len()).map(|i| LightId::Delta(i as u32));
        let emitters = (0..self.emitters.len()).map(|i| LightId::Emitter(i as u32));
        deltas
            .chain(emitters)
            .chain(self.sky_sampler.is_some().then_some(LightId::Sky))
    }

    /// Whether a light is a delta light.
    pub fn is_delta(&self, light: LightId) -> bool {
        matches!(light, LightId::Delta(_))
    }

    /// Returns the flux of a light into the scene, summed over its three channels. Of lights
    /// without falloff and of infinitely distant lights, the flux through the sphere around the
    /// scene.
    pub fn power(&self, light: LightId) -> f64 {
        match light {
            LightId::Delta(i) => self.delta[i as usize].power(self.scene_radius),
            LightId::Emitter(i) => self.emitters.power(i),
            LightId::Sky => {
                let across = core::f64::consts::PI * self.scene_radius * self.scene_radius;
                self.sky_sampler
                    .as_ref()
                    .map_or(0.0, |sampler| sampler.flux() * across)
            }
        }
    }

    /// Returns the bounds of a light in position and direction; `None` for an infinitely distant
    /// light.
    pub fn bounds(&self, light: LightId) -> Option<LightBounds> {
        match light {
            LightId::Delta(i) => self.delta[i as usize].bounds(),
            LightId::Emitter(i) => self.emitters.bounds(i),
            LightId::Sky => None,
        }
    }

    /// Returns the sky sampler, if prepared.
    pub fn sky_sampler(&self) -> Option<&SkySampler> {
        self.sky_sampler.as_ref()
    }

    /// Returns the probability of choosing the sky where its light is even and not sampled through
    /// openings, else 0. A point in a medium then leaves the sky to the directions of its phase
    /// function.
    fn even_sky_share(&self) -> f64 {
        let is_even = |sampler: &SkySampler| sampler.is_even() && self.openings.is_none();
        if self.sky_sampler.as_ref().is_some_and(is_even) {
            self.light_sampler.sky_share()
        } else {
            0.0
        }
    }

    /// Samples a light for a point in a medium as [`LightSampler::sample`] does, except for an even
    /// sky.
    pub(crate) fn sample_in_medium(
        &self,
        from: R::Vec3,
        numbers: [f32; 2],
    ) -> Option<(LightId, f64)> {
        let sky = self.even_sky_share();
        let (light, probability) = self
            .light_sampler
            .sample_without_sky::<R>(from, numbers, sky)?;
        Some((light, probability / (1.0 - sky)))
    }

    /// Returns the probability of [`Self::sample_in_medium`].
    pub(crate) fn probability_in_medium(&self, light: LightId, from: R::Vec3) -> f64 {
        let sky = self.even_sky_share();
        if sky > 0.0 && light == LightId::Sky {
            return 0.0;
        }
        self.light_sampler
            .probability::<R>(light, from, Vector::ZERO)
            / (1.0 - sky)
    }

    /// Samples a light that was chosen with `probability`, for the receiving point `from` and two
    /// uniform numbers in [0, 1); `None` if no light arrives.
    pub fn sample(
        &self,
        light: LightId,
        from: R::Vec3,
        position: [f32; 2],
        probability: f64,
    ) -> Option<LightSample<R>> {
        match light {
            LightId::Delta(i) => {
                let sample = self.delta[i as usize].sample(from)?;
                Some(LightSample {
                    arriving: sample.arriving * R::from_f64(1.0 / probability),
                    ..sample
                })
            }
            LightId::Emitter(i) => self.emitters.sample(i, from, position, probability),
            LightId::Sky => {
                self.sky_sampler
                    .as_ref()?
                    .sample(&self.sky, from, position, probability)
            }
        }
    }

    /// Samples the chosen lights of many points as [`Lights::sample`] does, one lane of `samples`
    /// for each, and overwrites their contents. Lights of the same kind are sampled together.
    pub(crate) fn sample_batches<'a>(
        &self,
        batches: impl Iterator<Item = (ReceivingPointLanes<'a, R>, &'a LightChoices<LANES>)> + Clone,
        samples: &mut [LightSampleLanes<R>],
    ) {
        let mut emitters = EmitterLanes::new();
        for ((points, choices), samples) in batches.clone().zip(&mut *samples) {
            samples.target_kinds = [ShadowRayTargetKind::Nothing; LANES];
            self.emitters
                .sample_lanes(&points, choices, &mut emitters, samples);
            for (lane, &light) in choices.lights.iter().enumerate() {
                if let Some(light @ LightId::Delta(_)) = light {
                    let (from, position) = points.get_lane(lane);
                    self.sample(light, from, position, choices.probabilities[lane])
                        .iter()
                        .for_each(|sample| samples.set_lane(lane, sample));
                }
            }
        }
        self.sample_sky_batches(batches, samples);
    }

    /// Samples the sky for those points of [`Self::sample_batches`] that chose it.
    fn sample_sky_batches<'a>(
        &self,
        batches: impl Iterator<Item = (ReceivingPointLanes<'a, R>, &'a LightChoices<LANES>)> + Clone,
        samples: &mut [LightSampleLanes<R>],
    ) {
        let Some(sampler) = &self.sky_sampler else {
            return;
        };
        let openings = self.openings.as_ref();
        let mut receivers = Vec::with_capacity(LANES * samples.len());
        let mut cells = Vec::new();
        for (batch, (points, choices)) in batches.enumerate() {
            for lane in (0..LANES).filter(|&lane| choices.lights[lane] == Some(LightId::Sky)) {
                let (from, numbers) = points.get_lane(lane);
                receivers.push(SkyReceiver {
                    place: [batch, lane],
                    from,
                    numbers,
                    probability: choices.probabilities[lane],
                });
                if let Some(table) = openings {
                    cells.push(table.cell_at::<R>(from, points.normal(lane)));
                }
            }
        }
        // Each stage prefetches for all points what the next one reads.
        let bins = cells.iter().map(|&cell| openings?.bins(cell?));
        let bins: Vec<_> = bins.collect();
        let directions = self.sample_sky_directions(sampler, &receivers, &bins);
        let places = bins
            .iter()
            .zip(&directions)
            .map(|(&bins, direction)| Some(openings?.locate(bins?, direction.to_f64())));
        let places: Vec<_> = places.collect();
        let mut sky_samples = Vec::with_capacity(directions.len());
        let origins = receivers.iter().map(|receiver| receiver.from);
        self.sky
            .eval_rays(origins.zip(directions.iter().copied()), &mut sky_samples);
        for (k, ((receiver, direction), sky_sample)) in receivers
            .into_iter()
            .zip(directions)
            .zip(sky_samples)
            .enumerate()
        {
            // Density of the rounded direction, so that a ray that hits the sky in this direction
            // computes the same density.
            let (coordinates, [batch, lane]) = (sky_sample.image_coordinates, receiver.place);
            let own = sampler.density::<R>(direction, coordinates);
            let place = places.get(k).copied().flatten();
            let density = place.map_or(own, |place| place.density(own)) * receiver.probability;
            sky_light_sample(direction, sky_sample.radiance, density)
                .iter()
                .for_each(|sample| samples[batch].set_lane(lane, sample));
        }
    }

    /// Samples a direction of the sky for each receiver.
    fn sample_sky_directions(
        &self,
        sampler: &SkySampler,
        receivers: &[SkyReceiver<R>],
        bins: &[Option<CellBins<'_>>],
    ) -> Vec<R::Vec3> {
        let Some(table) = &self.openings else {
            return sampler.sample_directions::<R>(receivers.iter().map(|point| point.numbers));
        };
        let numbers = || receivers.iter().map(|receiver| receiver.numbers);
        let parts = bins
            .iter()
            .zip(numbers())
            .map(|(bins, [u, _])| (*bins)?.find_part(u));
        let parts: Vec<_> = parts.collect();
        let drawn: Vec<_> = parts
            .iter()
            .zip(bins)
            .zip(numbers())
            .map(|((&part, &bins), numbers)| match bins {
                Some(bins) => table.sample_direction(bins, part, numbers),
                None => Err(numbers),
            })
            .collect();
        let mut through = Vec::with_capacity(drawn.len());
        visit_directions(drawn.iter().filter_map(|place| place.ok()), |direction| {
            through.push(R::Vec3::from_f64(direction));
        });
        let own = drawn.iter().filter_map(|place| place.err());
        let own = sampler.sample_directions::<R>(own);
        let (mut through, mut own) = (through.into_iter(), own.into_iter());
        let next = |is_through: bool| {
            if is_through {
                through.next()
            } else {
                own.next()
            }
        };
        drawn
            .iter()
            .map(|place| place.is_ok())
            .map(next)
            .map(|direction| direction.unwrap_or(Vector::ZERO))
            .collect()
    }

    /// Returns the density by solid angle with which [`Lights::sample`] samples `light_target` from
    /// the point `from`. `light_target` is a point of an emitter, or the sky, and lies in the unit
    /// `direction`. Zero if it is never sampled.
    pub fn density(
        &self,
        light: LightId,
        from: R::Vec3,
        direction: R::Vec3,
        light_target: &ShadowRayTarget<R>,
        probability: f64,
    ) -> f64 {
        match (light, light_target) {
            (LightId::Emitter(i), ShadowRayTarget::Surface(surface)) => {
                self.emitters.density(i, from, surface, probability)
            }
            // Of a point that receives light on both sides.
            (LightId::Sky, ShadowRayTarget::Infinity) => self.sky_density(
                (from, Vector::ZERO),
                direction,
                self.sky.image_coordinates(direction),
                probability,
            ),
            _ => 0.0,
        }
    }

    /// Returns the density of the sky as [`Lights::density`] does, for a receiving point with the
    /// unit normal of the side that receives light, zero if both sides do. `place_in_image` holds the image
    /// coordinates of the direction ([`SkyRadiance::image_coordinates`]).
    pub fn sky_density(
        &self,
        (from, normal): (R::Vec3, R::Vec3),
        direction: R::Vec3,
        place_in_image: [R; 2],
        probability: f64,
    ) -> f64 {
        let Some(sampler) = &self.sky_sampler else {
            return 0.0;
        };
        let own = sampler.density::<R>(direction, place_in_image);
        let place = self.openings.as_ref().and_then(|table| {
            let bins = table.bins(table.cell_at::<R>(from, normal)?)?;
            Some(table.locate(bins, direction.to_f64()))
        });
        place.map_or(own, |place| place.density(own)) * probability
    }
}

#[cfg(test)]
mod tests;
