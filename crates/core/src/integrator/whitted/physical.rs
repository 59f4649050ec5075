//! Whitted shading of a physical material: base colour lit by the lights and by the cosine-weighted
//! mean of the sky; smooth reflection and refraction by traced rays; rough lobes as local
//! highlights.

use raywright_bvh::{Hit, Real, Vector};

use super::WhittedTracer;
use super::state::{SecondaryRay, WhittedState};
use crate::effects::MIRROR_ROUGHNESS;
use crate::interaction::Interaction;
use crate::material::{Glass, MetallicRoughness, environment_reflectance};
use crate::prepare::PhysicalInputs;
use crate::sampler::{PathBranch, SampleAddress};
use crate::scene::TransmissionChoice;

impl<R: Real> WhittedTracer<'_, R> {
    /// Splits a path at a partly transparent surface. Returns `None` if the surface is to be
    /// shaded: at an opaque point, and after the light from behind was collected. Returns
    /// `Some(None)` at a fully transparent point, where the path itself continues behind the
    /// surface. Otherwise returns a side branch that continues behind the surface; the path waits
    /// until the branch has ended.
    pub(super) fn split_at_alpha(
        &mut self,
        m: &PhysicalInputs<R>,
        path: &mut WhittedState<R>,
        hit: &Hit<R>,
        interaction: &Interaction<R>,
    ) -> Option<Option<WhittedState<R>>> {
        if path.known_hit.take().is_some() {
            return None;
        }
        let alpha = m.alpha_at(&self.scene.texture_tables.shading_context(interaction));
        if alpha >= R::ONE {
            return None;
        }
        if alpha <= R::ZERO {
            self.pass_through_surface(path, interaction, path.throughput);
            return Some(None);
        }
        let ray = self.ray_behind_surface(path, interaction);
        let next = SecondaryRay {
            ray,
            throughput: path.throughput * (R::ONE - alpha),
            direction_error: path.segment.direction_error,
        };
        let (camera, segments, share) = (
            path.is_camera_ray,
            path.remaining_segments,
            path.share * (R::ONE - alpha),
        );
        // Behind a partly transparent surface the ray still counts as a camera ray.
        let mut behind = WhittedState {
            is_camera_ray: camera,
            remaining_segments: segments,
            share,
            ..path.create_side_branch(&next, PathBranch::Behind)
        };
        self.count_passed_surface(&mut behind);
        path.throughput *= alpha;
        path.share *= alpha;
        path.known_hit = Some(*hit);
        Some(Some(behind))
    }

    /// Adds the local light of a physical surface to the path's radiance, and continues the path
    /// with the scattered rays.
    #[inline(always)]
    pub(super) fn shade_physical(
        &mut self,
        m: &PhysicalInputs<R>,
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
        let context = self.scene.texture_tables.shading_context(interaction);
        if let Some(emission) = m
            .emission
            .as_ref()
            .filter(|_| self.scene.is_emissive_side(interaction))
        {
            let emitted = emission.multiply_colour(&context, throughput);
            *radiance += emitted;
            self.add_directly_visible_radiance(path.is_camera_ray, emitted);
        }
        if m.unlit {
            let shown = throughput * m.base_colour_at(&context);
            *radiance += shown;
            self.add_directly_visible_radiance(path.is_camera_ray, shown);
            return path.start_segment([None; 2]);
        }
        let model = m.metallic_roughness_at(&context);
        let mirror = m.mirrors && model.roughness <= R::from_f64(MIRROR_ROUGHNESS);
        *radiance += throughput * self.sum_local_light(&model, interaction, mirror, address);
        let dielectric = R::ONE - model.metallic;
        if let Some(glass) = model.glass.filter(|_| dielectric > R::ZERO) {
            return self.transmit_physical(&glass, dielectric, path, hit, interaction);
        }
        let weight = throughput
            * model
                .mirror_lobe()
                .reflectance(-interaction.direction.dot(interaction.normal));
        let onward = (mirror && segments > 1).then(|| {
            self.counters.reflection += 1;
            SecondaryRay {
                ray: self
                    .scene
                    .spawn_ray(interaction, interaction.mirrored_direction(), R::ONE),
                throughput: weight,
                direction_error: Vector::ZERO,
            }
        });
        path.start_segment([onward, None])
    }

    /// Continues a path at glass with the refracted and the reflected ray. `dielectric` is the share
    /// of the surface, 0 to 1, that is no metal.
    #[inline(always)]
    fn transmit_physical(
        &mut self,
        glass: &Glass<R>,
        dielectric: R,
        path: &mut WhittedState<R>,
        hit: &Hit<R>,
        interaction: &Interaction<R>,
    ) -> Option<WhittedState<R>> {
        let throughput = path.throughput;
        // An opaque dielectric share reflects like glass, but from outside alone.
        let mirrored = if interaction.outside {
            R::ONE
        } else {
            glass.share
        };
        let glass = Glass {
            reflected: glass.reflected * mirrored,
            transmitted: glass.transmitted * glass.share,
            ..*glass
        };
        if glass.ior == 1.0 {
            self.pass_index_matched_boundary(
                path,
                interaction,
                throughput * dielectric * glass.transmitted,
            );
            return None;
        }
        let scattered_rays = self.refract(
            (&glass, TransmissionChoice::Split),
            path,
            hit,
            interaction,
            throughput * dielectric,
        );
        path.start_segment(scattered_rays)
    }

    /// Returns the local light of a physical surface: direct light and the mean of the sky,
    /// reflected diffusely and by rough highlights.
    fn sum_local_light(
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
                self.trace_shadow_ray(&light_sample, interaction, false)
                    .share
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
        if let Some((drawn_light_sample, share)) = self.sample_emitter(interaction, address) {
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
                sum += reflected * irradiance.eval(interaction.mirrored_direction());
            }
        }
        sum
    }
}
