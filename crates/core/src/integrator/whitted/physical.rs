//! Whitted shading of a physical material: base colour lit by the lights and by the cosine-weighted
//! mean of the sky; smooth reflection and refraction by traced rays; rough lobes as local
//! highlights.

use raywright_bvh::{Hit, Real, Vector};

use super::WhittedTracer;
use super::state::{NextRay, WhittedState};
use crate::effects::MIRROR_ROUGHNESS;
use crate::interaction::Interaction;
use crate::material::{Glass, MetallicRoughness, environment_reflectance};
use crate::prepare::PhysicalInputs;
use crate::sampler::{Branch, SampleAddress};
use crate::scene::TransmissionChoice;

impl<R: Real> WhittedTracer<'_, R> {
    /// Splits a path at a partly transparent surface. At a fully transparent point the path
    /// continues behind the surface (`Some(None)`). At a partly transparent point the path behind
    /// becomes a side branch, which is returned, and the path itself waits for it. `None` at an
    /// opaque point, and after the wait: the surface is then shaded.
    pub(super) fn cutout(
        &mut self,
        m: &PhysicalInputs<R>,
        path: &mut WhittedState<R>,
        hit: &Hit<R>,
        interaction: &Interaction<R>,
    ) -> Option<Option<WhittedState<R>>> {
        if path.hit.take().is_some() {
            return None;
        }
        let alpha = m.alpha_at(&self.scene.texture_tables.shading_context(interaction));
        if alpha >= R::ONE {
            return None;
        }
        if alpha <= R::ZERO {
            self.pass(path, interaction, path.throughput);
            return Some(None);
        }
        let ray = self.behind(path, interaction);
        let next = NextRay {
            ray,
            throughput: path.throughput * (R::ONE - alpha),
            rest: path.segment.rest,
        };
        let (camera, segments, share) = (path.camera, path.segments, path.share * (R::ONE - alpha));
        // Behind a partly transparent surface the ray still counts as a camera ray.
        let mut behind = WhittedState {
            camera,
            segments,
            share,
            ..path.branch(&next, Branch::Behind)
        };
        self.count_passage(&mut behind);
        path.throughput *= alpha;
        path.share *= alpha;
        path.hit = Some(*hit);
        Some(Some(behind))
    }

    /// Adds the local light of a physical surface to the path's radiance, and continues the path
    /// with the scattered rays.
    #[inline(always)]
    pub(super) fn physical(
        &mut self,
        m: &PhysicalInputs<R>,
        path: &mut WhittedState<R>,
        hit: &Hit<R>,
        interaction: &Interaction<R>,
    ) -> Option<WhittedState<R>> {
        let WhittedState {
            throughput,
            segments,
            address,
            ..
        } = *path;
        let radiance = &mut path.radiance;
        let context = self.scene.texture_tables.shading_context(interaction);
        if let Some(emission) = m
            .emission
            .as_ref()
            .filter(|_| self.scene.shines(interaction))
        {
            let emitted = emission.tint(&context, throughput);
            *radiance += emitted;
            self.record_direct(path.camera, emitted);
        }
        if m.unlit {
            let shown = throughput * m.base_at(&context);
            *radiance += shown;
            self.record_direct(path.camera, shown);
            return path.leave([None; 2]);
        }
        let model = m.model_at(&context);
        let mirror = m.mirrors && model.roughness <= R::from_f64(MIRROR_ROUGHNESS);
        *radiance += throughput * self.lit(&model, interaction, mirror, address);
        let dielectric = R::ONE - model.metallic;
        if let Some(glass) = model.glass.filter(|_| dielectric > R::ZERO) {
            // An opaque dielectric share reflects like glass, but from outside alone.
            let mirrored = if interaction.outside {
                R::ONE
            } else {
                glass.share
            };
            let glass = Glass {
                reflected: glass.reflected * mirrored,
                transmitted: glass.transmitted * glass.share,
                ..glass
            };
            if glass.ior == 1.0 {
                self.pass_border(
                    path,
                    interaction,
                    throughput * dielectric * glass.transmitted,
                );
                return None;
            }
            let leaving = self.refract(
                (&glass, TransmissionChoice::Split),
                path,
                hit,
                interaction,
                throughput * dielectric,
            );
            return path.leave(leaving);
        }
        let weight = throughput
            * model
                .mirror()
                .reflectance(-interaction.direction.dot(interaction.normal));
        let onward = (mirror && segments > 1).then(|| {
            self.counters.reflection += 1;
            NextRay {
                ray: self
                    .scene
                    .spawn(interaction, interaction.mirrored(), R::ONE),
                throughput: weight,
                rest: Vector::ZERO,
            }
        });
        path.leave([onward, None])
    }

    /// Returns the local light of a physical surface: direct light and the mean of the sky,
    /// reflected diffusely and by rough highlights.
    fn lit(
        &mut self,
        model: &MetallicRoughness<R>,
        interaction: &Interaction<R>,
        mirror: bool,
        address: SampleAddress,
    ) -> R::Vec3 {
        let (scene, normal, view) = (self.scene, interaction.normal, -interaction.direction);
        let bsdf = model.local_bsdf(normal, view);
        let zero = R::ZERO;
        let mut sum = R::Vec3::ZERO;
        for light in &scene.lights.delta {
            let Some(light_sample) = light.sample(interaction.surface.point) else {
                continue;
            };
            let facing = normal.dot(light_sample.direction);
            if facing <= zero {
                continue;
            }
            let share = if light.shadows {
                self.shadow_result(&light_sample, interaction, false).share
            } else {
                R::ONE
            };
            if share > zero {
                let wi = light_sample.direction;
                let response = if light.specular {
                    bsdf.eval(view, wi)
                } else {
                    bsdf.eval_diffuse(view, wi)
                };
                sum += light_sample.arriving * response * (facing * share);
            }
        }
        if let Some((drawn_light_sample, share)) = self.emitter(interaction, address) {
            let facing = normal.dot(drawn_light_sample.direction);
            sum += drawn_light_sample.arriving
                * bsdf.eval(view, drawn_light_sample.direction)
                * (facing * share);
        }
        if let Some(irradiance) = &scene.irradiance {
            let facing = normal.dot(view).max(zero);
            let reflected = environment_reflectance(model.f0(), model.roughness, facing);
            sum += model.albedo() * (R::Vec3::ONE - reflected) * irradiance.eval(normal);
            if !mirror {
                sum += reflected * irradiance.eval(interaction.mirrored());
            }
        }
        sum
    }
}
