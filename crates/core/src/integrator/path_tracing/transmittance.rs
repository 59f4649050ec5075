//! Visibility of the light sampled at a vertex: shadow rays and their transmittance.

use raywright_bvh::{Hit, Interval, Ray, Real, Vector};

use super::super::PathSegment;
use super::super::shadow::Transmittance;
use super::shade::ShadedLanes;
use super::vertices::{VertexLanes, WavefrontSlice};
use super::{PathState, PathTracer};
use crate::interaction::Interaction;
use crate::light::{
    ChosenLight, Density, LightId, LightLanes, LightSample, LightTarget, LightTargetKind,
    lane_vector,
};
use crate::prepare::{PreparedMaterial, PreparedSpawn};
use crate::scene::AlphaMode;

impl<R: Real> PathTracer<'_, R> {
    /// Adds the reflected light of the sampled light to the path's radiance, times the light's
    /// visibility.
    #[inline(always)]
    pub(super) fn add_light(
        &mut self,
        slice: &mut WavefrontSlice<'_, R>,
        (vertices, lane): (&VertexLanes<R>, usize),
        (&ChosenLight { light, .. }, lights): (&ChosenLight<R>, &LightLanes<R>),
        shaded: &ShadedLanes<R>,
    ) {
        let index = vertices.place[lane] as usize;
        let (path, interaction) = (
            &mut slice.paths[slice.active[index] as usize],
            &slice.interactions[index],
        );
        let scattered = lane_vector::<R>(&shaded.lit.sent, lane);
        let scattered = if self.straight_to_lights(light)
            && lights.target_kinds[lane] != LightTargetKind::Target
        {
            let length = shaded.shadow.length[lane];
            // If the light lies at the ray's origin, nothing blocks it.
            let transmitted = if length > R::ZERO
                && (length < R::INFINITY || lights.target_kinds[lane] == LightTargetKind::Infinity)
            {
                let ray = Ray::new(
                    lane_vector::<R>(&shaded.shadow.start, lane),
                    lane_vector::<R>(&shaded.shadow.directions, lane),
                )
                .at_time(interaction.time);
                self.shadow_transmittance(
                    &ray,
                    Interval {
                        min: R::ZERO,
                        max: length,
                    },
                    None,
                    lights.is_sizeless(lane),
                )
            } else {
                R::ONE
            };
            let scattered = if transmitted > R::ZERO {
                scattered * transmitted
            } else {
                Vector::ZERO
            };
            self.usage.count(light, scattered != Vector::ZERO);
            scattered
        } else {
            self.arriving_radiance(
                path,
                interaction,
                (light, lights.lane(lane), shaded.lit.is_through[lane]),
                scattered,
            )
        };
        path.radiance += path.throughput * scattered;
    }

    /// Whether a single shadow ray to the sampled point determines a light's visibility.
    #[inline(always)]
    fn straight_to_lights(&self, light: LightId) -> bool {
        let (scene, lights) = (self.scene, &self.scene.lights);
        let shadows = !matches!(light, LightId::Delta(i) if !lights.delta[i as usize].shadows);
        let even = !matches!(light, LightId::Emitter(i) if lights.emitters.varies(i) || scene.casts_hard(i));
        shadows
            && even
            && !scene.lets_straight
            && !scene.absorbs
            && matches!(scene.rules.spawn, PreparedSpawn::ErrorBound)
    }

    /// Returns the visible part of `scattered`: the light that the surface would reflect, or
    /// transmit if `through`, without occlusion.
    #[inline(always)]
    fn arriving_radiance(
        &mut self,
        path: &PathState<R>,
        interaction: &Interaction<R>,
        (light, light_sample, through): (LightId, LightSample<R>, bool),
        mut scattered: R::Vec3,
    ) -> R::Vec3 {
        let scene = self.scene;
        let lights = &scene.lights;
        let Some(light_sample) =
            scene.aim_at_middle(light, light_sample, interaction.surface.point)
        else {
            return Vector::ZERO;
        };
        let varies = matches!(light, LightId::Emitter(i) if lights.emitters.varies(i));
        let shadows = !matches!(light, LightId::Delta(i) if !lights.delta[i as usize].shadows);
        let media = || {
            if through {
                self.beyond(&path.media, interaction)
            } else {
                path.media
            }
        };
        if varies || shadows && scene.lets_straight {
            let emitter = match light {
                LightId::Emitter(i) => Some(i),
                _ => None,
            };
            let media = media();
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
                scattered *= self
                    .media_transmittance(&media(), interaction.distance_to(&light_sample.target));
            }
            if shadows {
                let transmitted = self.transmitted_share(&light_sample, interaction);
                scattered = if transmitted > R::ZERO {
                    scattered * transmitted
                } else {
                    Vector::ZERO
                };
            }
        }
        self.usage.count(light, scattered != Vector::ZERO);
        scattered
    }

    /// Traces a shadow ray to a light sample, and returns the visible share of the light, 0 to 1.
    #[inline]
    fn transmitted_share(&mut self, light: &LightSample<R>, interaction: &Interaction<R>) -> R {
        // If the light lies at the ray's origin, nothing blocks it.
        let Some((ray, mut range)) = self.scene.shadow_ray(light, interaction) else {
            return R::ONE;
        };
        let sizeless = light.density == Density::Delta;
        if matches!(light.target, LightTarget::Infinity) && !sizeless {
            // The scene's limit on shadow distance applies to lights, not to the sky.
            range = Interval {
                max: R::INFINITY,
                ..range
            };
        }
        self.shadow_transmittance(
            &ray.at_time(interaction.time),
            range,
            Some(&light.target),
            sizeless,
        )
    }

    /// Transmittance along a shadow ray. `target` is set if the light may be its own occluder.
    #[inline(always)]
    fn shadow_transmittance(
        &mut self,
        ray: &Ray<R>,
        range: Interval<R>,
        target: Option<&LightTarget<R>>,
        sizeless: bool,
    ) -> R {
        self.counters.shadow += 1;
        let mut product = Transmittance::default();
        let blocked = self.scene.geometry.any(
            ray,
            range,
            &mut |hit| {
                if !target.is_some_and(|target| self.scene.is_own(target, hit)) {
                    product.factor(self.occluder_transmittance(ray, hit, sizeless).to_f64());
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

    /// Returns the transmittance of an occluder without a change of direction: its share that is
    /// absent by alpha. Objects that cast no shadow transmit delta lights fully; area lights are
    /// found by paths too, which hit every object.
    fn occluder_transmittance(&self, ray: &Ray<R>, hit: &Hit<R>, sizeless: bool) -> R {
        let record = &self.scene.objects[hit.outermost() as usize];
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
