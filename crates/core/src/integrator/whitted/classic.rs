//! Whitted shading of a classic material: its terms in the order of the documented shaders.

use glam::DVec3;
use raywright_bvh::{Hit, Real, Vector};

use super::super::spawn::round_direction;
use super::WhittedTracer;
use super::state::{SecondaryRay, SecondaryRays, WhittedState};
use crate::interaction::{Interaction, LightVariableValues};
use crate::light::{DeltaLight, LightSample};
use crate::material::Glass;
use crate::prepare::{ClassicInputs, ReflectionInputs, SpecularInputs, TransmissionInputs};
use crate::sampler::SampleAddress;
use crate::scene::{SpecularModel, TransmissionChoice};
use crate::texture::ShadingContext;

impl<R: Real> WhittedTracer<'_, R> {
    /// Adds the local term of a classic surface to the path's radiance, and continues the path with
    /// the scattered rays.
    #[inline(always)]
    pub(super) fn shade_classic(
        &mut self,
        m: &ClassicInputs<R>,
        path: &mut WhittedState<R>,
        hit: &Hit<R>,
        interaction: &Interaction<R>,
    ) -> Option<WhittedState<R>> {
        let WhittedState {
            throughput,
            remaining_segments: segments,
            address,
            ..
        } = *path;
        let radiance = &mut path.radiance;
        let mut context = self.scene.texture_tables.shading_context(interaction);
        let reflects = m.reflection.is_some() || m.transmission.is_some();
        let matched = m
            .transmission
            .is_some_and(|transmission| transmission.glass.ior == 1.0);
        let is_local_only =
            reflects && !matched && segments == 1 && self.scene.rules.local_only_at_limit;
        let colour = m.colour.eval_colour(&context);
        if is_local_only || !m.local.is_zero() {
            let local = self.eval_local_illumination(m, &mut context, colour, address);
            let weight = if is_local_only {
                R::ONE
            } else {
                m.local.eval_number(&context)
            };
            *radiance += throughput * local * weight;
        }
        if let Some(emission) = m
            .emission
            .as_ref()
            .filter(|_| self.scene.is_emissive_side(interaction))
        {
            let emitted = throughput * emission.eval_colour(&context);
            *radiance += emitted;
            self.add_directly_visible_radiance(path.is_camera_ray, emitted);
        }
        if is_local_only {
            return path.start_segment([None; 2]);
        }
        if let Some(transmission) = &m.transmission {
            self.transmit_classic(transmission, path, hit, interaction)
        } else if let Some(reflection) = &m.reflection {
            self.reflect_classic(m, reflection, path, &context, colour)
        } else {
            path.start_segment([None; 2])
        }
    }

    /// Continues a path at a transmissive surface with the refracted and the reflected ray.
    #[inline(always)]
    fn transmit_classic(
        &mut self,
        transmission: &TransmissionInputs<R>,
        path: &mut WhittedState<R>,
        hit: &Hit<R>,
        interaction: &Interaction<R>,
    ) -> Option<WhittedState<R>> {
        let throughput = path.throughput;
        if transmission.glass.ior == 1.0 {
            self.pass_index_matched_boundary(
                path,
                interaction,
                throughput * transmission.glass.transmitted,
            );
            return None;
        }
        let scattered_rays = self.refract(
            (&transmission.glass, transmission.choice),
            path,
            hit,
            interaction,
            throughput,
        );
        path.start_segment(scattered_rays)
    }

    /// Continues a path at a mirror with the reflected ray, and adds the highlights that the
    /// reflection's weight multiplies. `colour` is the base colour of the surface.
    #[inline(always)]
    fn reflect_classic(
        &mut self,
        m: &ClassicInputs<R>,
        reflection: &ReflectionInputs<R>,
        path: &mut WhittedState<R>,
        context: &ShadingContext<'_, R>,
        colour: R::Vec3,
    ) -> Option<WhittedState<R>> {
        let interaction = context.interaction;
        let mut throughput = path.throughput * reflection.weight.eval_number(context);
        if reflection.tinted {
            throughput *= colour;
        }
        let mut direction = interaction.mirrored_direction();
        if let Some((amount, rows)) = &reflection.fuzz {
            let p = R::Vec3::from_f64(self.scene.to_world(interaction.surface.point));
            let wave = R::Vec3::new(
                rows[0].dot(p).sin(),
                rows[1].dot(p).sin(),
                rows[2].dot(p).sin(),
            );
            direction = (direction + wave * *amount).normalize();
        }
        if let Some(specular) = m.specular.as_ref().filter(|s| s.on_reflection) {
            let highlight = self.sum_highlights(specular, context);
            path.radiance += throughput * highlight;
        }
        if path.remaining_segments > 1 {
            self.counters.reflection += 1;
        }
        path.start_segment([
            Some(SecondaryRay {
                ray: self.scene.spawn_ray(interaction, direction, R::ONE),
                throughput,
                direction_error: Vector::ZERO,
            }),
            None,
        ])
    }

    /// Returns the local term of a classic surface: the sum of colour·(ambient + Σ diffuse·light),
    /// Σ specular, and rim. Stores the direction and the shadow of the first light in `context`,
    /// for expressions of reflection weights.
    #[inline(always)]
    fn eval_local_illumination(
        &mut self,
        m: &ClassicInputs<R>,
        context: &mut ShadingContext<'_, R>,
        colour: R::Vec3,
        address: SampleAddress,
    ) -> R::Vec3 {
        let (scene, interaction) = (self.scene, context.interaction);
        let zero = R::ZERO;
        let n = interaction.normal;
        let mut lit = m.ambient;
        let mut gloss = R::Vec3::ZERO;
        let specular = m.specular.as_ref().filter(|s| !s.on_reflection);
        let mut first = None;
        for light in &scene.lights.delta {
            let Some(light_sample) = light.sample(interaction.surface.point) else {
                continue;
            };
            context.light_inputs.direction = light_sample.direction;
            let facing = n.dot(light_sample.direction).max(zero);
            let highlight = match specular {
                Some(s) if light.specular => eval_highlight(s, interaction, light_sample.direction),
                _ => zero,
            };
            let mut share = R::ONE;
            if light.has_shadow_rule && (facing > zero || highlight > zero || m.shadow.is_some()) {
                share = self.eval_shadow_rule(m, context, light, &light_sample);
            }
            lit += light_sample.arriving * (m.diffuse.eval_number(context) * facing * share);
            if let Some(s) = specular
                && highlight > zero
            {
                let tint = if s.lit {
                    light_sample.arriving
                } else {
                    R::Vec3::ONE
                };
                let share = if s.shadowed { share } else { R::ONE };
                gloss += tint * (highlight * share * s.strength.eval_number(context));
            }
            first.get_or_insert(context.light_inputs);
            context.light_inputs = LightVariableValues::default();
        }
        if !m.diffuse.is_zero()
            && let Some((drawn_light_sample, share)) = self.sample_emitter(interaction, address)
        {
            (context.light_inputs.direction, context.light_inputs.share) =
                (drawn_light_sample.direction, share);
            // Area lights have a radiance, so the classic surface acts as a Lambertian one here:
            // its colour over π.
            let facing = n.dot(drawn_light_sample.direction)
                * share
                * R::from_f64(core::f64::consts::FRAC_1_PI);
            lit += drawn_light_sample.arriving * (m.diffuse.eval_number(context) * facing);
        }
        context.light_inputs = first.unwrap_or_default();
        let mut local = colour * lit + gloss;
        if let Some((strength, exponent)) = &m.rim {
            let k = n.dot(interaction.direction);
            local += R::Vec3::splat(
                strength.eval_number(context) * Real::powi(R::ONE - k * k, *exponent),
            );
        }
        local
    }

    /// Returns the share of a light, 0 to 1, that reaches a classic surface by its shadow rule.
    /// Stores the share and the distance of the occluder in `context`.
    #[inline(always)]
    fn eval_shadow_rule(
        &mut self,
        m: &ClassicInputs<R>,
        context: &mut ShadingContext<'_, R>,
        light: &DeltaLight<R>,
        light_sample: &LightSample<R>,
    ) -> R {
        if light.shadows && m.needs_shadow_ray {
            let shadow_result =
                self.trace_shadow_ray(light_sample, context.interaction, m.reads_occluder_distance);
            (context.light_inputs.occluder, context.light_inputs.share) =
                (shadow_result.distance, shadow_result.share);
        }
        let share = m
            .shadow
            .as_ref()
            .map_or(context.light_inputs.share, |s| s.eval_number(context));
        context.light_inputs.share = share;
        share
    }

    /// Returns the summed highlights of the delta lights on a surface. Shadow rays are traced only
    /// if the material requires them, which the mirror of the documented preset does not.
    fn sum_highlights(
        &mut self,
        specular: &SpecularInputs<R>,
        context: &ShadingContext<'_, R>,
    ) -> R::Vec3 {
        let mut sum = R::Vec3::ZERO;
        for light in self.scene.lights.delta.iter().filter(|l| l.specular) {
            let Some(light_sample) = light.sample(context.interaction.surface.point) else {
                continue;
            };
            let mut highlight =
                eval_highlight(specular, context.interaction, light_sample.direction);
            if highlight > R::ZERO && specular.shadowed && light.shadows {
                highlight *= self
                    .trace_shadow_ray(&light_sample, context.interaction, false)
                    .share;
            }
            let tint = if specular.lit {
                light_sample.arriving
            } else {
                R::Vec3::ONE
            };
            sum += tint * (highlight * specular.strength.eval_number(context));
        }
        sum
    }

    /// Returns the refracted and the reflected ray of glass: a single ray, or both with their
    /// Fresnel weights.
    #[inline(always)]
    pub(super) fn refract(
        &mut self,
        (glass, choice): (&Glass<R>, TransmissionChoice),
        path: &WhittedState<R>,
        hit: &Hit<R>,
        interaction: &Interaction<R>,
        throughput: R::Vec3,
    ) -> SecondaryRays<R> {
        if path.remaining_segments <= 1 {
            return [None; 2];
        }
        // A normal that is not flipped towards the viewer points away from a ray inside the body.
        let (side, interface) = (
            interaction.facing_sign(),
            self.scene
                .dielectric_interface(&path.segment, hit, interaction, glass),
        );
        let leaves = |this: &Self, direction: DVec3, side, throughput| {
            let (direction, rest) = round_direction::<R>(direction);
            SecondaryRay {
                ray: this.scene.spawn_ray(interaction, direction, side),
                throughput,
                direction_error: rest,
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
        let side_branch = (mirrored != R::Vec3::ZERO).then(|| reflected(self, mirrored));
        [
            (through != R::Vec3::ZERO).then(|| onward(self, through)),
            side_branch,
        ]
    }
}

/// Returns the value of a highlight for a light in the unit direction `l`.
#[inline(always)]
fn eval_highlight<R: Real>(s: &SpecularInputs<R>, interaction: &Interaction<R>, l: R::Vec3) -> R {
    let cosine = match s.model {
        SpecularModel::Blinn => interaction
            .normal
            .dot((l - interaction.direction).normalize()),
        SpecularModel::BlinnReflected => interaction
            .normal
            .dot((l - interaction.mirrored_direction()).normalize()),
        SpecularModel::Phong => interaction.mirrored_direction().dot(l),
        SpecularModel::Grazing => interaction.direction.dot(interaction.mirrored_direction()),
    };
    // Opposite directions have no half vector: NaN, and no highlight.
    Real::powi(cosine.max(R::ZERO), s.exponent)
}
