//! Visibility of the light sampled at a vertex: shadow rays and their transmittance.

use raywright_bvh::{Hit, Interval, Ray, RayEndTriangles, Real, Vector};

use super::super::PathSegment;
use super::super::shadow::TransmittanceProduct;
use super::shade::ShadedLanes;
use super::vertices::{VertexLanes, WavefrontSlice};
use super::{PathState, PathTracer};
use crate::interaction::Interaction;
use crate::light::{
    LightDensity, LightId, LightSample, LightSampleLanes, ShadowRayTarget, ShadowRayTargetKind,
    get_lane_vector,
};
use crate::prepare::{PreparedMaterial, PreparedSpawnRule};
use crate::scene::AlphaMode;

impl<R: Real> PathTracer<'_, R> {
    /// Adds the direct light of the vertex in `lane`, times the light's visibility, to the path's
    /// radiance.
    #[inline(always)]
    pub(super) fn add_direct_light(
        &mut self,
        slice: &mut WavefrontSlice<'_, R>,
        (vertices, lane): (&VertexLanes<R>, usize),
        (light, lights): (LightId, &LightSampleLanes<R>),
        shaded: &ShadedLanes<R>,
    ) {
        let index = vertices.hit_indices[lane] as usize;
        let path = &mut slice.paths[slice.active[index] as usize];
        let scattered = get_lane_vector::<R>(&shaded.lit.reflected, lane);
        let scattered = if self.needs_one_shadow_ray(light)
            && lights.target_kinds[lane] != ShadowRayTargetKind::Stored
        {
            let length = shaded.shadow.length[lane];
            // If the light lies at the ray's origin, nothing blocks it.
            let transmitted = if length > R::ZERO
                && (length < R::INFINITY
                    || lights.target_kinds[lane] == ShadowRayTargetKind::Infinity)
            {
                let ray = Ray::new(
                    get_lane_vector::<R>(&shaded.shadow.start, lane),
                    get_lane_vector::<R>(&shaded.shadow.directions, lane),
                )
                .with_time(path.segment.ray.time);
                let sides = [shaded.shadow.leaves[lane], shaded.shadow.reaches[lane]];
                let ends = self.shadow_ray_ends(&slice.hits[index], light, sides);
                self.shadow_transmittance(
                    (&ray, &ends),
                    Interval {
                        min: R::ZERO,
                        max: length,
                    },
                    None,
                    lights.is_delta(lane),
                )
            } else {
                R::ONE
            };
            let scattered = if transmitted > R::ZERO {
                scattered * transmitted
            } else {
                Vector::ZERO
            };
            self.usage.count_ray(light, scattered != Vector::ZERO);
            scattered
        } else {
            let rebuilt;
            let interaction = if index < slice.uniform {
                rebuilt = Interaction::from_hit(self.scene, &path.segment, &slice.hits[index]);
                &rebuilt
            } else {
                &slice.interactions[index]
            };
            self.apply_visibility(
                path,
                interaction,
                (light, lights.get_lane(lane), shaded.lit.is_through[lane]),
                scattered,
            )
        };
        path.radiance += path.throughput * scattered;
    }

    /// Returns the triangles that a shadow ray leaves and reaches, and therefore certainly does not
    /// cross, given whether it leaves its origin's surface and reaches the light's.
    #[inline(always)]
    pub(super) fn shadow_ray_ends(
        &self,
        hit: &Hit<R>,
        light: LightId,
        [leaves, reaches]: [bool; 2],
    ) -> RayEndTriangles {
        let mut ends = RayEndTriangles::NONE;
        if !self.has_triangle_ends {
            return ends;
        }
        if leaves {
            ends.start = hit.triangle_slot();
        }
        if let LightId::Emitter(i) = light
            && reaches
        {
            ends.target = self.scene.lights.emitters.triangles(i);
        }
        ends
    }

    /// Whether a single shadow ray to the sampled point decides the light's visibility. More is
    /// needed for varying emission, hard shadows, transmissive surfaces, absorbing media, lights
    /// without shadows, and spawn rules of constant offset.
    #[inline(always)]
    pub(super) fn needs_one_shadow_ray(&self, light: LightId) -> bool {
        let (scene, lights) = (self.scene, &self.scene.lights);
        let shadows = !matches!(light, LightId::Delta(i) if !lights.delta[i as usize].shadows);
        let even = !matches!(light, LightId::Emitter(i) if lights.emitters.has_varying_emission(i) || scene.casts_hard_shadow(i));
        shadows
            && even
            && !scene.transmits_straight
            && !scene.absorbs
            && !scene.scatters
            && matches!(scene.rules.spawn, PreparedSpawnRule::ErrorBound)
    }

    /// Returns `scattered` times the transmittance of the shadow ray to the light sample.
    /// `scattered` is the light that the surface scatters without occlusion: transmitted if
    /// `through` is set, else reflected.
    #[inline(always)]
    pub(super) fn apply_visibility(
        &mut self,
        path: &PathState<R>,
        interaction: &Interaction<R>,
        (light, light_sample, through): (LightId, LightSample<R>, bool),
        mut scattered: R::Vec3,
    ) -> R::Vec3 {
        let scene = self.scene;
        let lights = &scene.lights;
        let Some(light_sample) =
            scene.aim_at_lamp_centre(light, light_sample, interaction.surface.point)
        else {
            return Vector::ZERO;
        };
        let varies =
            matches!(light, LightId::Emitter(i) if lights.emitters.has_varying_emission(i));
        let shadows = !matches!(light, LightId::Delta(i) if !lights.delta[i as usize].shadows);
        let media = |tracer: &Self| {
            if through {
                tracer.media_beyond_surface(&path.media, interaction)
            } else {
                path.media
            }
        };
        if varies || shadows && scene.transmits_straight {
            let emitter = match light {
                LightId::Emitter(i) => Some(i),
                _ => None,
            };
            let media = media(self);
            let transmitted =
                self.straight_transmittance(path, media, (&light_sample, emitter), interaction);
            // Zero for NaN too.
            scattered = if transmitted == Vector::ZERO {
                Vector::ZERO
            } else {
                scattered * transmitted
            };
        } else {
            if scene.absorbs {
                scattered *= self.even_transmittance(
                    &media(self),
                    interaction.distance_to_target(&light_sample.target),
                );
            }
            if shadows {
                let transmitted = self.light_visibility(&light_sample, interaction);
                scattered = if transmitted > R::ZERO {
                    scattered * transmitted
                } else {
                    Vector::ZERO
                };
            }
            if scene.scatters && scattered != Vector::ZERO {
                let (media, distance) = (
                    media(self),
                    interaction.distance_to_target(&light_sample.target),
                );
                let segment = (interaction.surface.point, light_sample.direction, distance);
                scattered *= self.scattering_transmittance(path, &media, segment);
            }
        }
        self.usage.count_ray(light, scattered != Vector::ZERO);
        scattered
    }

    /// Traces a shadow ray to a light sample, and returns the visible share of the light, 0 to 1.
    #[inline]
    fn light_visibility(&mut self, light: &LightSample<R>, interaction: &Interaction<R>) -> R {
        // If the light lies at the ray's origin, nothing blocks it.
        let Some((ray, mut range)) = self.scene.shadow_ray(light, interaction) else {
            return R::ONE;
        };
        let sizeless = light.density == LightDensity::Delta;
        if matches!(light.target, ShadowRayTarget::Infinity) && !sizeless {
            // The scene's limit on shadow distance applies to lights, not to the sky.
            range = Interval {
                max: R::INFINITY,
                ..range
            };
        }
        self.shadow_transmittance(
            (&ray.with_time(interaction.time), &RayEndTriangles::NONE),
            range,
            Some(&light.target),
            sizeless,
        )
    }

    /// Returns the transmittance along a shadow ray, 0 to 1.
    ///
    /// - `ends`: triangles at the ray's ends.
    /// - `target`: given if the light's own surface may occlude the ray; hits on that surface are
    ///   ignored.
    /// - `sizeless`: whether the light is a delta light.
    #[inline(always)]
    pub(super) fn shadow_transmittance(
        &mut self,
        (ray, ends): (&Ray<R>, &RayEndTriangles),
        range: Interval<R>,
        target: Option<&ShadowRayTarget<R>>,
        sizeless: bool,
    ) -> R {
        self.counters.shadow += 1;
        let mut product = TransmittanceProduct::default();
        let blocked = self.scene.geometry.occluded_with_ray_ends(
            ray,
            range,
            ends,
            &mut |hit| {
                if !target.is_some_and(|target| self.scene.is_target_emitter(target, hit)) {
                    product.multiply(self.occluder_transmittance(ray, hit, sizeless).to_f64());
                }
                product.opaque
            },
            &mut (),
        );
        if blocked {
            R::ZERO
        } else {
            R::from_f64(product.value())
        }
    }

    /// Returns the transmittance of an occluder for an undeflected ray, 0 to 1: one minus alpha.
    ///
    /// `sizeless`: whether the light is a delta light. An object that casts no shadow transmits a
    /// delta light fully. It blocks area lights, since paths that find area lights hit every
    /// object.
    fn occluder_transmittance(&self, ray: &Ray<R>, hit: &Hit<R>, sizeless: bool) -> R {
        let record = &self.scene.objects[hit.outermost_id() as usize];
        if sizeless && !record.casts_shadow {
            return R::ONE;
        }
        match &self.scene.materials[record.material as usize] {
            PreparedMaterial::Physical(m) if m.alpha != AlphaMode::Opaque => {
                let interaction =
                    Interaction::from_hit(self.scene, &PathSegment::from_ray(*ray), hit);
                R::ONE - m.alpha_at(&self.scene.texture_tables.shading_context(&interaction))
            }
            _ => R::ZERO,
        }
    }
}
