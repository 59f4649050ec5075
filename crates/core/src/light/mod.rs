//! All light of a scene behind one interface: what arrives from a light without size, from an
//! emissive surface and from the sky is asked, drawn and weighed in the same words, so that what
//! stands above (a choice among lights, a combination of sampling techniques) needs not know which
//! kind it is.
//!
//! Seen from a point, a light is drawn by [`Lights::sample`]: a direction, what arrives from there
//! over the density of having drawn it, that density over solid angle, and what a shadow ray aims
//! at. [`Lights::density`] is the same density for a point of a light that a ray met by itself, and
//! [`Emitters::of`] the way back from that hit to the light. [`Lights::power`] and
//! [`Lights::bounds`] are for choosing. A light without size has no density ([`Density::Delta`]):
//! no ray meets it by itself.
//!
//! Whitted shading is a client: it asks every light without size in scene order, and one emitter
//! chosen by power. It asks for no way to draw the sky, so none is built. The path tracer has one
//! light chosen at each vertex, the sky among them: it calls [`Lights::prepare_sky`] and
//! [`Lights::prepare_choice`].
//!
//! The tables are flat arrays of plain data, made by preparation and only read while rendering.

mod bounds;
mod cdf;
mod choice;
mod cone;
mod delta;
mod emitters;
mod grid;
mod irradiance;
mod lanes;
mod polygon;
mod sky;
mod sky_lobe;
mod sky_sampler;
mod tree;
mod usage;

use raywright_bvh::{Aabb, Real, Surface};

use emitters::EmitterLanes;

pub use bounds::LightBounds;
pub use choice::{ChoiceQuery, LightChoice};
pub use cone::DirectionCone;
pub use delta::DeltaLight;
pub use emitters::{EmissionEstimate, EmitterList, Emitters, Exit, Strategy};
pub use grid::SphereGrid;
pub use irradiance::Irradiance;
pub(crate) use lanes::{
    Column, LANES, LightLanes, SurfaceLanes, TargetKind, Vec3Column, put, vector,
};
pub use polygon::Polygon;
pub use sky::{SkyRadiance, SkySample};
pub(crate) use sky::{packed_bytes, prepare as prepare_sky};
pub use sky_sampler::SkySampler;
pub(crate) use usage::LightUsage;

/// Which light of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum LightId {
    /// One without size, by its place in the scene's list.
    Delta(u32),
    /// An emissive shape or triangle, by its place in [`Emitters`].
    Emitter(u32),
    /// What surrounds the scene.
    Sky,
}

/// Where a light was drawn or met: what a shadow ray aims at.
#[derive(Clone, Copy, Debug)]
pub enum Target<R: Real> {
    /// Farther than everything.
    Infinity,
    /// A point that no ray can hit.
    Point(R::Vec3),
    /// A point of a surface, which must not be in its own light.
    Surface(Surface<R>),
    /// The middle of an emitter, which is not in its own light either, although rays to there meet
    /// it.
    Middle {
        /// Where it is.
        point: R::Vec3,
        /// Which emitter.
        emitter: u32,
    },
}

/// How densely a direction is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Density {
    /// The light has no size: there is one direction and no other.
    Delta,
    /// Per steradian, the probability of having chosen the light included.
    SolidAngle(f64),
}

/// A light as a point sees it.
#[derive(Clone, Copy, Debug)]
pub struct LightSample<R: Real> {
    /// Unit direction to it.
    pub direction: R::Vec3,
    /// What arrives on a surface that faces it, if nothing is in between, as an estimate of all
    /// that the light sends: radiance over the density; irradiance where the light has no size.
    pub arriving: R::Vec3,
    /// How densely `direction` is drawn.
    pub density: Density,
    /// What a shadow ray aims at.
    pub target: Target<R>,
}

/// A light that was chosen with a probability, the point that is lit, and two numbers in [0, 1) by
/// which the light is drawn.
#[derive(Clone, Copy, Debug)]
pub struct ChosenLight<R: Real> {
    /// Which light.
    pub light: LightId,
    /// How likely the choice was.
    pub probability: f64,
    /// The point.
    pub from: R::Vec3,
    /// The numbers.
    pub position: [f32; 2],
}

/// Every light of a scene.
#[derive(Clone, Debug)]
pub struct Lights<R: Real> {
    /// Those without size, in scene order.
    pub delta: Vec<DeltaLight<R>>,
    /// Emissive surfaces that light others.
    pub emitters: Emitters<R>,
    /// What a ray sees that hits nothing.
    pub sky: SkyRadiance<R>,
    sky_sampler: Option<SkySampler>,
    /// Which light a point asks; empty until it is prepared.
    choice: LightChoice,
    /// Half the diagonal of everything that has an end: how much of what comes from far away enters
    /// the scene.
    reach: f64,
}

impl<R: Real> Lights<R> {
    /// From their tables, for a scene whose bounded part lies within `scene`.
    pub fn new(
        delta: Vec<DeltaLight<R>>,
        emitters: Emitters<R>,
        sky: SkyRadiance<R>,
        scene: &Aabb,
    ) -> Self {
        let reach = if scene.is_empty() {
            0.0
        } else {
            0.5 * scene.extent().length()
        };
        Self {
            delta,
            emitters,
            sky,
            sky_sampler: None,
            choice: LightChoice::default(),
            reach,
        }
    }

    /// Builds what drawing the sky takes. Without it the sky has no power and is never drawn.
    pub fn prepare_sky(&mut self) {
        self.sky_sampler = SkySampler::new(&self.sky);
    }

    /// Of the sky, draws only what exceeds the rest of it: see [`SkySampler::of_excess`].
    pub fn draw_excess_of_sky(&mut self) {
        self.sky_sampler = self
            .sky_sampler
            .take()
            .map(|sampler| sampler.of_excess(&self.sky));
    }

    /// Builds what choosing among all lights takes, the sky among them if drawing it is prepared.
    pub fn prepare_choice(&mut self) {
        self.choice = LightChoice::new(self);
    }

    /// Which light a point asks, where that is prepared.
    pub fn choice(&self) -> &LightChoice {
        &self.choice
    }

    /// Every light, in the order of the tables.
    pub fn ids(&self) -> impl Iterator<Item = LightId> {
        let deltas = (0..self.delta.len()).map(|i| LightId::Delta(i as u32));
        let emitters = (0..self.emitters.len()).map(|i| LightId::Emitter(i as u32));
        deltas
            .chain(emitters)
            .chain(self.sky_sampler.is_some().then_some(LightId::Sky))
    }

    /// Whether a light has no size.
    pub fn is_delta(&self, light: LightId) -> bool {
        matches!(light, LightId::Delta(_))
    }

    /// What a light sends into the scene: the flux of its three channels, summed. Through the
    /// sphere around the scene for what does not weaken with distance, and for what is infinitely
    /// far.
    pub fn power(&self, light: LightId) -> f64 {
        match light {
            LightId::Delta(i) => self.delta[i as usize].power(self.reach),
            LightId::Emitter(i) => self.emitters.power(i),
            LightId::Sky => {
                let across = core::f64::consts::PI * self.reach * self.reach;
                self.sky_sampler
                    .as_ref()
                    .map_or(0.0, |sampler| sampler.flux() * across)
            }
        }
    }

    /// Where a light is and which way it shines; none for one that is infinitely far.
    pub fn bounds(&self, light: LightId) -> Option<LightBounds> {
        match light {
            LightId::Delta(i) => self.delta[i as usize].bounds(),
            LightId::Emitter(i) => self.emitters.bounds(i),
            LightId::Sky => None,
        }
    }

    /// What drawing the sky takes, where that is prepared.
    pub fn sky_sampler(&self) -> Option<&SkySampler> {
        self.sky_sampler.as_ref()
    }

    /// Draws a light that was chosen with a `probability`, as `from` sees it, for two numbers in
    /// [0, 1); none where it sends nothing there.
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

    /// [`Lights::sample`] of many lights, so many in each of `samples` as those have lanes, in
    /// place of what those held: those of one kind are drawn together.
    pub(crate) fn sample_each(
        &self,
        chosen: &[Option<ChosenLight<R>>],
        samples: &mut Vec<LightLanes<R>>,
    ) {
        samples.resize_with(
            chosen.len().div_ceil(LANES).max(samples.len()),
            LightLanes::new,
        );
        let mut emitters = EmitterLanes::new();
        for (chosen, samples) in chosen.chunks(LANES).zip(&mut *samples) {
            samples.aim = [TargetKind::Nothing; LANES];
            let each = || {
                chosen
                    .iter()
                    .enumerate()
                    .filter_map(|(lane, chosen)| chosen.as_ref().map(|chosen| (lane, chosen)))
            };
            self.emitters.sample_lanes(chosen, &mut emitters, samples);
            for (
                lane,
                &ChosenLight {
                    light,
                    probability,
                    from,
                    position,
                },
            ) in each()
            {
                if matches!(light, LightId::Delta(_)) {
                    self.sample(light, from, position, probability)
                        .iter()
                        .for_each(|sample| samples.put(lane, sample));
                }
            }
        }
        let Some(sampler) = &self.sky_sampler else {
            return;
        };
        let each = || {
            chosen
                .iter()
                .enumerate()
                .filter_map(|(place, chosen)| chosen.as_ref().map(|chosen| (place, chosen)))
        };
        let sky = || each().filter(|(_, chosen)| chosen.light == LightId::Sky);
        let directions = sampler.drawn_each::<R>(sky().map(|(_, chosen)| chosen.position));
        let mut seen = Vec::with_capacity(directions.len());
        self.sky.look(
            sky()
                .zip(&directions)
                .map(|((_, chosen), &direction)| (chosen.from, direction)),
            &mut seen,
        );
        for (((place, chosen), &direction), seen) in sky().zip(&directions).zip(&seen) {
            let sample = sampler.sample_seen(direction, seen, chosen.probability);
            sample
                .iter()
                .for_each(|sample| samples[place / LANES].put(place % LANES, sample));
        }
    }

    /// The density over solid angle with which [`Lights::sample`] draws what a ray from `from` met
    /// in a unit `direction`: a point of an emitter, or the sky. Zero where it never does.
    pub fn density(
        &self,
        light: LightId,
        from: R::Vec3,
        direction: R::Vec3,
        met: &Target<R>,
        probability: f64,
    ) -> f64 {
        match (light, met) {
            (LightId::Emitter(i), Target::Surface(surface)) => {
                self.emitters.density(i, from, surface, probability)
            }
            (LightId::Sky, Target::Infinity) => {
                self.density_of_sky(direction, self.sky.place(direction), probability)
            }
            _ => 0.0,
        }
    }

    /// [`Lights::density`] of the sky, in a direction that has this [`SkyRadiance::place`].
    pub fn density_of_sky(&self, direction: R::Vec3, place: [R; 2], probability: f64) -> f64 {
        self.sky_sampler.as_ref().map_or(0.0, |sampler| {
            sampler.density::<R>(direction, place) * probability
        })
    }
}

#[cfg(test)]
mod tests;
