//! What a vertex of a path receives from the light that it asks.

use raywright_bvh::{Hit, Interval, Ray, Real, Vector};

use super::super::PathSegment;
use super::super::shadow::Transmittance;
use super::mis::MisStrategy;
use super::respond::LightResponse;
use super::{PathState, PathTracer, weight};
use crate::interaction::Interaction;
use crate::light::{ChosenLight, Density, LightId, LightSample, Target};
use crate::prepare::{Material, Spawn};
use crate::scene::AlphaMode;
use crate::settings::LightSampling;

/// A light that a vertex asks.
#[derive(Clone, Copy, Debug)]
pub(super) struct LightQuery<R: Real> {
    light: LightId,
    pub seen: LightSample<R>,
    /// Cosine between it and the normal.
    facing: R,
    /// Whether it shines through the surface.
    pub through: bool,
    pub strategy: MisStrategy,
}

impl<R: Real> PathTracer<'_, R> {
    /// Samples a light and a point of it for a surface with a normal; none where nothing of it can be sent back.
    #[inline(always)]
    pub(super) fn query(
        &self,
        path: &PathState<R>,
        at: &Interaction<R>,
        normal: R::Vec3,
        lets_through: bool,
    ) -> Option<LightQuery<R>> {
        let ChosenLight { light, probability, from, position } =
            self.choose_light(path, at, if lets_through { Vector::ZERO } else { normal })?;
        let seen = self.scene.lights.sample(light, from, position, probability)?;
        let (facing, zero) = (normal.dot(seen.direction), R::ZERO);
        // Above the shading normal's horizon and the surface's own, or below both of what lets light through.
        let geometric = if at.outside { at.surface.normal } else { -at.surface.normal };
        let through = facing < zero;
        if facing == zero || (geometric.dot(seen.direction) < zero) != through || through && !lets_through {
            return None;
        }
        let strategy = self.strategy(light, seen.density)?;
        Some(LightQuery { light, seen, facing, through, strategy })
    }

    /// The light that a point asks; `lit`: the normal on the side that is lit, zero where both are.
    #[inline(always)]
    pub(super) fn choose_light(&self, path: &PathState<R>, at: &Interaction<R>, lit: R::Vec3) -> Option<ChosenLight<R>> {
        let choice = self.scene.lights.choice();
        if choice.is_empty() {
            return None;
        }
        let ([coarse, fine, u, v], from) = (path.draws.light, at.surface.point);
        let (light, probability) = choice.draw::<R>(from, lit, [coarse, fine])?;
        Some(ChosenLight { light, probability, from, position: [u, v] })
    }

    /// What a light asks of a surface that would be drawn with a density; none: it is found by scattering alone.
    #[inline(always)]
    pub(super) fn strategy(&self, light: LightId, density: Density) -> Option<MisStrategy> {
        Some(match (density, light) {
            (Density::Delta, LightId::Delta(i)) => MisStrategy::Delta { shines: self.scene.lights.delta[i as usize].specular },
            (Density::Delta, _) => MisStrategy::Delta { shines: false },
            (Density::SolidAngle(density), _) => match self.scene.sampling_of(light) {
                LightSampling::Scattering => return None,
                LightSampling::Lights => MisStrategy::Value,
                LightSampling::Both => MisStrategy::Weighed(density),
            },
        })
    }

    /// Adds what a surface sends back along a path of a light that was asked, by its response. `gain`: factor on lights without size, whose
    /// unit is not the same to both families of materials.
    #[inline(always)]
    pub(super) fn add_direct(
        &mut self,
        path: &mut PathState<R>,
        at: &Interaction<R>,
        query: &LightQuery<R>,
        (response, gain): (&LightResponse<R>, R),
    ) {
        let answer = match query.strategy {
            MisStrategy::Value => (response.value, R::ONE),
            MisStrategy::Delta { shines: true } => (response.value, gain),
            MisStrategy::Delta { .. } if query.through => return,
            MisStrategy::Delta { .. } => (response.diffuse, gain),
            MisStrategy::Weighed(density) => (response.value, R::from_f64(weight(density, response.density.to_f64()))),
        };
        let (answer, share) = answer;
        let sent = query.seen.arriving * answer * (Real::abs(query.facing) * share);
        if sent == Vector::ZERO {
            return;
        }
        let sent = self.arriving(path, at, (query.light, query.seen, query.through), sent);
        path.radiance += path.throughput * sent;
    }

    /// Whether all that comes of a light may be asked of one shadow ray to where it was drawn.
    #[inline(always)]
    pub(super) fn straight_to_lights(&self, light: LightId) -> bool {
        let (scene, lights) = (self.scene, &self.scene.lights);
        let shadows = !matches!(light, LightId::Delta(i) if !lights.delta[i as usize].shadows);
        let even = !matches!(light, LightId::Emitter(i) if lights.emitters.varies(i) || scene.casts_hard(i));
        shadows && even && !scene.lets_straight && !scene.absorbs && matches!(scene.rules.spawn, Spawn::ErrorBound)
    }

    /// What arrives of what a surface would send back of a light, `through` itself or not, if nothing were in between.
    #[inline(always)]
    pub(super) fn arriving(
        &mut self,
        path: &PathState<R>,
        at: &Interaction<R>,
        (light, seen, through): (LightId, LightSample<R>, bool),
        mut sent: R::Vec3,
    ) -> R::Vec3 {
        let scene = self.scene;
        let lights = &scene.lights;
        let Some(seen) = scene.aimed(light, seen, at.surface.point) else { return Vector::ZERO };
        let varies = matches!(light, LightId::Emitter(i) if lights.emitters.varies(i));
        let shadows = !matches!(light, LightId::Delta(i) if !lights.delta[i as usize].shadows);
        let media = || if through { self.beyond(&path.media, at) } else { path.media };
        if varies || shadows && scene.lets_straight {
            let emitter = match light {
                LightId::Emitter(i) => Some(i),
                _ => None,
            };
            let media = media();
            let arrives = self.arrives_straight(path, media, (&seen, emitter), at);
            // Also of what is no number.
            sent = if arrives == Vector::ZERO { Vector::ZERO } else { sent * arrives };
        } else {
            if scene.absorbs {
                sent *= self.passes_media(&media(), at.distance_to(&seen.target));
            }
            if shadows {
                let arrives = self.arrives(&seen, at);
                sent = if arrives > R::ZERO { sent * arrives } else { Vector::ZERO };
            }
        }
        self.usage.count(light, sent != Vector::ZERO);
        sent
    }

    /// Share of a light that arrives where it is asked from.
    #[inline]
    fn arrives(&mut self, light: &LightSample<R>, at: &Interaction<R>) -> R {
        // Where the light is where the ray would start, nothing is in between.
        let Some((ray, mut range)) = self.scene.towards(light, at) else { return R::ONE };
        let sizeless = light.density == Density::Delta;
        if matches!(light.target, Target::Infinity) && !sizeless {
            // The scene's limit on shadows is that of its lights, not of its sky.
            range = Interval { max: R::INFINITY, ..range };
        }
        self.passes(&ray.at_time(at.time), range, Some(&light.target), sizeless)
    }

    /// Share of light that passes the way of a shadow ray. What it aims at is told where that may be its own occluder.
    #[inline(always)]
    pub(super) fn passes(&mut self, ray: &Ray<R>, range: Interval<R>, target: Option<&Target<R>>, sizeless: bool) -> R {
        self.counters.shadow += 1;
        let mut product = Transmittance::default();
        let blocked = self.scene.geometry.any(
            ray,
            range,
            &mut |hit| {
                if !target.is_some_and(|target| self.scene.is_own(target, hit)) {
                    product.factor(self.lets_through(ray, hit, sizeless).to_f64());
                }
                product.opaque
            },
            &mut (),
        );
        if blocked { R::ZERO } else { R::from_f64(product.value()) }
    }

    /// Share of light that passes an occluder straight: where it is absent, and the light of a light without size where it casts no
    /// shadow. Light with a size is found by paths too, which meet everything.
    fn lets_through(&self, ray: &Ray<R>, hit: &Hit<R>, sizeless: bool) -> R {
        let record = &self.scene.objects[hit.outermost() as usize];
        if sizeless && !record.casts_shadow {
            return R::ONE;
        }
        match &self.scene.materials[record.material as usize] {
            Material::Physical(m) if m.alpha != AlphaMode::Opaque => {
                let at = Interaction::of(self.scene, &PathSegment::of(*ray), hit);
                R::ONE - m.alpha_at(&self.scene.sources.at(&at))
            }
            _ => R::ZERO,
        }
    }
}
