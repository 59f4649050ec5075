//! What a vertex of a path receives from the light that it asks.

use raywright_bvh::{Hit, Interval, Ray, Real, Vector};

use super::super::shadow::Product;
use super::super::{Kernel, Leg, Tracer};
use super::{Walk, weight};
use crate::interaction::Interaction;
use crate::light::{Density, LightId, LightSample, Target};
use crate::material::{Bsdf, Scatters};
use crate::prepare::{Alpha, Material};
use crate::settings::LightSampling;

/// A light that a vertex asks.
#[derive(Clone, Copy, Debug)]
pub(super) struct Question<R: Real> {
    light: LightId,
    pub seen: LightSample<R>,
    /// Cosine between it and the normal.
    facing: R,
    /// Whether it shines through the surface.
    through: bool,
    pub wanted: Wanted,
}

/// What a light asks of a surface.
#[derive(Clone, Copy, Debug)]
pub(super) enum Wanted {
    /// What it sends back.
    Value,
    /// The same of a light without size, of which only some make highlights.
    Delta { shines: bool },
    /// What it sends back, and how densely it would have drawn a direction that the light drew with this density.
    Weighed(f64),
}

impl Wanted {
    /// Whether what is diffused alone answers it.
    pub fn is_dull(&self) -> bool {
        matches!(self, Self::Delta { shines: false })
    }
}

impl<R: Real, K: Kernel> Tracer<'_, R, K> {
    /// Light of one light, drawn by chance, that a surface sends back along a path. `gain`: factor on lights without size, whose
    /// unit is not the same to both families of materials.
    #[inline(always)]
    pub(super) fn asked<L: Scatters<R>, const MOST: usize>(
        &mut self,
        walk: &Walk<R>,
        at: &Interaction<R>,
        bsdf: &Bsdf<R, L, MOST>,
        gain: R,
    ) -> R::Vec3 {
        if bsdf.is_delta() {
            return Vector::ZERO;
        }
        let Some(question) = self.question(walk, at, bsdf.normal(), bsdf.lets_through()) else { return Vector::ZERO };
        let (view, direction, through) = (-at.direction, question.seen.direction, question.through);
        let value = || if through { bsdf.eval_either(view, direction) } else { bsdf.eval(view, direction) };
        let (answer, share) = match question.wanted {
            Wanted::Value => (value(), R::ONE),
            Wanted::Delta { shines: true } => (value(), gain),
            Wanted::Delta { .. } if through => return Vector::ZERO,
            Wanted::Delta { .. } => (bsdf.diffuse(view, direction), gain),
            Wanted::Weighed(density) => {
                let (answer, other) = if through { (value(), bsdf.pdf(view, direction)) } else { bsdf.answer(view, direction) };
                (answer, R::from_f64(weight(density, other.to_f64())))
            }
        };
        self.answered(walk, at, question, (answer, share))
    }

    /// Draws a light and a point of it for a surface with a normal; none where nothing of it can be sent back.
    #[inline(always)]
    pub(super) fn question(
        &self,
        walk: &Walk<R>,
        at: &Interaction<R>,
        normal: R::Vec3,
        lets_through: bool,
    ) -> Option<Question<R>> {
        let (light, probability) = self.chosen(walk, at, if lets_through { Vector::ZERO } else { normal })?;
        let [.., u, v] = walk.draws.light;
        let seen = self.scene.lights.sample(light, at.surface.point, [u, v], probability)?;
        self.question_of(light, seen, at, normal, lets_through)
    }

    /// The light that a point asks, and how likely that was; `lit`: the normal on the side that is lit, zero where both are.
    #[inline(always)]
    pub(super) fn chosen(&self, walk: &Walk<R>, at: &Interaction<R>, lit: R::Vec3) -> Option<(LightId, f64)> {
        let choice = self.scene.lights.choice();
        if choice.is_empty() {
            return None;
        }
        let [coarse, fine, ..] = walk.draws.light;
        choice.draw::<R>(at.surface.point, lit, [coarse, fine])
    }

    /// [`Self::question`] of a light that was drawn.
    #[inline(always)]
    pub(super) fn question_of(
        &self,
        light: LightId,
        seen: LightSample<R>,
        at: &Interaction<R>,
        normal: R::Vec3,
        lets_through: bool,
    ) -> Option<Question<R>> {
        let lights = &self.scene.lights;
        let (facing, zero) = (normal.dot(seen.direction), R::ZERO);
        // Above the shading normal's horizon and the surface's own, or below both of what lets light through.
        let geometric = if at.outside { at.surface.normal } else { -at.surface.normal };
        let through = facing < zero;
        if facing == zero || (geometric.dot(seen.direction) < zero) != through || through && !lets_through {
            return None;
        }
        let wanted = match (seen.density, light) {
            (Density::Delta, LightId::Delta(i)) => Wanted::Delta { shines: lights.delta[i as usize].specular },
            (Density::Delta, _) => Wanted::Delta { shines: false },
            (Density::SolidAngle(density), _) => match self.scene.sampling_of(light) {
                LightSampling::Scattering => return None,
                LightSampling::Lights => Wanted::Value,
                LightSampling::Both => Wanted::Weighed(density),
            },
        };
        Some(Question { light, seen, facing, through, wanted })
    }

    /// What arrives of a light that was asked, sent back in this share.
    #[inline(always)]
    pub(super) fn answered(
        &mut self,
        walk: &Walk<R>,
        at: &Interaction<R>,
        Question { light, seen, facing, through, .. }: Question<R>,
        (answer, share): (R::Vec3, R),
    ) -> R::Vec3 {
        let scene = self.scene;
        let lights = &scene.lights;
        let Some(seen) = self.aimed(light, seen, at.surface.point) else { return Vector::ZERO };
        let mut sent = seen.arriving * answer * (Real::abs(facing) * share);
        if sent == Vector::ZERO || !sent.is_finite() {
            return Vector::ZERO;
        }
        let varies = matches!(light, LightId::Emitter(i) if lights.emitters.varies(i));
        let shadows = !matches!(light, LightId::Delta(i) if !lights.delta[i as usize].shadows);
        let media = || if through { self.beyond(&walk.media, at) } else { walk.media };
        if varies || shadows && scene.lets_straight {
            let emitter = match light {
                LightId::Emitter(i) if varies => Some(i),
                _ => None,
            };
            let media = media();
            sent *= self.arrives_straight(walk, media, &seen, (at, emitter));
        } else {
            if scene.absorbs {
                sent *= self.passes_media(&media(), at.distance_to(&seen.target));
            }
            if shadows {
                sent *= self.arrives(&seen, at);
            }
        }
        self.usage.count(light, sent != Vector::ZERO);
        sent
    }

    /// Share of a light that arrives where it is asked from.
    #[inline]
    fn arrives(&mut self, light: &LightSample<R>, at: &Interaction<R>) -> R {
        // Where the light is where the ray would start, nothing is in between.
        let Some((ray, mut range)) = self.towards(light, at) else { return R::ONE };
        let sizeless = light.density == Density::Delta;
        if matches!(light.target, Target::Infinity) && !sizeless {
            // The scene's limit on shadows is that of its lights, not of its sky.
            range = Interval { max: R::INFINITY, ..range };
        }
        self.counters.shadow += 1;
        let ray = ray.at_time(at.time);
        let mut product = Product::default();
        let blocked = self.scene.geometry.any(
            &ray,
            range,
            &mut |hit| {
                if !self.is_own(&light.target, hit) {
                    product.factor(self.lets_through(&ray, hit, sizeless).to_f64());
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
            Material::Physical(m) if m.alpha != Alpha::Opaque => {
                let at = Interaction::of::<K>(self.scene, &Leg::of(*ray), hit);
                R::ONE - m.alpha_at(&self.scene.sources.at(&at))
            }
            _ => R::ZERO,
        }
    }
}
