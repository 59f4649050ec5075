//! The classic material model: its terms in the order of the documented shaders.

use glam::DVec3;
use raywright_bvh::{Hit, Real, Vector};

use super::super::spawn::stored;
use super::WhittedTracer;
use super::state::{NextRay, ScatteredRays, WhittedState};
use crate::interaction::{Beam, Interaction};
use crate::material::Glass;
use crate::prepare::{ClassicInputs, SpecularInputs};
use crate::sampler::Address;
use crate::scene::{SpecularModel, TransmissionChoice};
use crate::texture::ShadingContext;

impl<R: Real> WhittedTracer<'_, R> {
    /// Adds the local term of a classic surface to the path's radiance, and continues the path with
    /// the scattered rays.
    #[inline(always)]
    pub(super) fn classic(
        &mut self,
        m: &ClassicInputs<R>,
        path: &mut WhittedState<R>,
        hit: &Hit<R>,
        at: &Interaction<R>,
    ) -> Option<WhittedState<R>> {
        let WhittedState {
            throughput,
            segments,
            address,
            ..
        } = *path;
        let radiance = &mut path.radiance;
        let mut here = self.scene.sources.at(at);
        let reflects = m.reflection.is_some() || m.transmission.is_some();
        let matched = m
            .transmission
            .is_some_and(|transmission| transmission.glass.ior == 1.0);
        let alone = reflects && !matched && segments == 1 && self.scene.rules.local_only_at_limit;
        let colour = m.colour.colour(&here);
        if alone || !m.local.is_zero() {
            let local = self.local(m, &mut here, colour, address);
            let weight = if alone { R::ONE } else { m.local.number(&here) };
            *radiance += throughput * local * weight;
        }
        if let Some(emission) = m.emission.as_ref().filter(|_| self.scene.shines(at)) {
            let emitted = throughput * emission.colour(&here);
            *radiance += emitted;
            self.see(path.camera, emitted);
        }
        if alone {
            return path.leave([None; 2]);
        }
        if let Some(transmission) = &m.transmission {
            if matched {
                self.pass_border(path, at, throughput * transmission.glass.transmitted);
                return None;
            }
            let leaving = self.refract(
                (&transmission.glass, transmission.choice),
                path,
                hit,
                at,
                throughput,
            );
            return path.leave(leaving);
        }
        let Some(reflection) = &m.reflection else {
            return path.leave([None; 2]);
        };
        let mut throughput = throughput * reflection.weight.number(&here);
        if reflection.tinted {
            throughput *= colour;
        }
        let mut direction = at.mirrored();
        if let Some((amount, rows)) = &reflection.fuzz {
            let p = R::Vec3::from_f64(self.scene.in_world(at.surface.point));
            let wave = R::Vec3::new(
                rows[0].dot(p).sin(),
                rows[1].dot(p).sin(),
                rows[2].dot(p).sin(),
            );
            direction = (direction + wave * *amount).normalize();
        }
        if let Some(specular) = m.specular.as_ref().filter(|s| s.on_reflection) {
            let highlight = self.highlights(specular, &here);
            *radiance += throughput * highlight;
        }
        if segments > 1 {
            self.counters.reflection += 1;
        }
        path.leave([
            Some(NextRay {
                ray: self.scene.spawn(at, direction, R::ONE),
                throughput,
                rest: Vector::ZERO,
            }),
            None,
        ])
    }

    /// colour·(ambient + Σ diffuse·light) + Σ specular + rim. Stores the first light's direction
    /// and shadow in `here`, for the expressions of reflection weights.
    #[inline(always)]
    fn local(
        &mut self,
        m: &ClassicInputs<R>,
        here: &mut ShadingContext<'_, R>,
        colour: R::Vec3,
        address: Address,
    ) -> R::Vec3 {
        let (scene, at) = (self.scene, here.at);
        let zero = R::ZERO;
        let n = at.normal;
        let mut lit = m.ambient;
        let mut gloss = R::Vec3::ZERO;
        let specular = m.specular.as_ref().filter(|s| !s.on_reflection);
        let mut first = None;
        for light in &scene.lights.delta {
            let Some(seen) = light.sample(at.surface.point) else {
                continue;
            };
            here.beam.direction = seen.direction;
            let facing = n.dot(seen.direction).max(zero);
            let highlight = match specular {
                Some(s) if light.specular => lobe(s, at, seen.direction),
                _ => zero,
            };
            let mut share = R::ONE;
            if light.dimmed && (facing > zero || highlight > zero || m.shadow.is_some()) {
                if light.shadows && m.asks_what_is_between {
                    let between = self.before(&seen, at, m.asks_how_far);
                    (here.beam.occluder, here.beam.share) = (between.distance, between.share);
                }
                share = m
                    .shadow
                    .as_ref()
                    .map_or(here.beam.share, |s| s.number(here));
                here.beam.share = share;
            }
            lit += seen.arriving * (m.diffuse.number(here) * facing * share);
            if let Some(s) = specular
                && highlight > zero
            {
                let tint = if s.lit { seen.arriving } else { R::Vec3::ONE };
                let share = if s.shadowed { share } else { R::ONE };
                gloss += tint * (highlight * share * s.strength.number(here));
            }
            first.get_or_insert(here.beam);
            here.beam = Beam::default();
        }
        if !m.diffuse.is_zero()
            && let Some((drawn, share)) = self.emitter(at, address)
        {
            (here.beam.direction, here.beam.share) = (drawn.direction, share);
            // Area lights have a radiance, so the classic surface acts as a Lambertian one here:
            // its colour over π.
            let facing = n.dot(drawn.direction) * share * R::from_f64(core::f64::consts::FRAC_1_PI);
            lit += drawn.arriving * (m.diffuse.number(here) * facing);
        }
        here.beam = first.unwrap_or_default();
        let mut local = colour * lit + gloss;
        if let Some((strength, exponent)) = &m.rim {
            let k = n.dot(at.direction);
            local += R::Vec3::splat(strength.number(here) * Real::powi(R::ONE - k * k, *exponent));
        }
        local
    }

    /// Highlights of the reflection: without a shadow ray, as for the documented preset's mirror.
    fn highlights(
        &mut self,
        specular: &SpecularInputs<R>,
        here: &ShadingContext<'_, R>,
    ) -> R::Vec3 {
        let mut sum = R::Vec3::ZERO;
        for light in self.scene.lights.delta.iter().filter(|l| l.specular) {
            let Some(seen) = light.sample(here.at.surface.point) else {
                continue;
            };
            let mut highlight = lobe(specular, here.at, seen.direction);
            if highlight > R::ZERO && specular.shadowed && light.shadows {
                highlight *= self.before(&seen, here.at, false).share;
            }
            let tint = if specular.lit {
                seen.arriving
            } else {
                R::Vec3::ONE
            };
            sum += tint * (highlight * specular.strength.number(here));
        }
        sum
    }

    /// Refraction and reflection of glass: one ray, or both with their Fresnel weights.
    #[inline(always)]
    pub(super) fn refract(
        &mut self,
        (glass, choice): (&Glass<R>, TransmissionChoice),
        path: &WhittedState<R>,
        hit: &Hit<R>,
        at: &Interaction<R>,
        throughput: R::Vec3,
    ) -> ScatteredRays<R> {
        if path.segments <= 1 {
            return [None; 2];
        }
        // A normal that is not flipped to the viewer points away from a ray inside.
        let (side, interface) = (at.side(), self.scene.interface(&path.leg, hit, at, glass));
        let leaves = |this: &Self, direction: DVec3, side, throughput| {
            let (direction, rest) = stored::<R>(direction);
            NextRay {
                ray: this.scene.spawn(at, direction, side),
                throughput,
                rest,
            }
        };
        let reflected = |this: &mut Self, throughput| {
            this.counters.reflection += 1;
            leaves(this, interface.reflected, side, throughput)
        };
        let Some(refracted) = interface.refracted else {
            return [Some(reflected(self, throughput * glass.reflected)), None];
        };
        let onward = |this: &mut Self, throughput| {
            this.counters.refraction += 1;
            leaves(this, refracted, -side, throughput)
        };
        if let TransmissionChoice::Switch { threshold } = choice {
            // Schlick's reflectance at the *incident* angle, whichever side that is.
            return if R::from_f64(interface.schlick(interface.cos_incident))
                > R::from_f64(threshold)
            {
                [Some(reflected(self, throughput * glass.reflected)), None]
            } else {
                [Some(onward(self, throughput * glass.transmitted)), None]
            };
        }
        let fresnel = R::from_f64(interface.fresnel());
        let mirrored = throughput * glass.reflected * fresnel;
        let through = throughput * glass.transmitted * (R::ONE - fresnel);
        let aside = (mirrored != R::Vec3::ZERO).then(|| reflected(self, mirrored));
        [
            (through != R::Vec3::ZERO).then(|| onward(self, through)),
            aside,
        ]
    }
}

/// Value of a highlight towards a light in unit direction `l`.
#[inline(always)]
fn lobe<R: Real>(s: &SpecularInputs<R>, at: &Interaction<R>, l: R::Vec3) -> R {
    let cosine = match s.model {
        SpecularModel::Blinn => at.normal.dot((l - at.direction).normalize()),
        SpecularModel::BlinnReflected => at.normal.dot((l - at.mirrored()).normalize()),
        SpecularModel::Phong => at.mirrored().dot(l),
        SpecularModel::Grazing => at.direction.dot(at.mirrored()),
    };
    // Opposite directions have no half vector: NaN, and no highlight.
    Real::powi(cosine.max(R::ZERO), s.exponent)
}
