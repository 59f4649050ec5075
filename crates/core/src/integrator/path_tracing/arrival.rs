//! Visibility of a vertex's sampled light: shadow rays and transmittance.

use raywright_bvh::{Hit, Interval, Ray, Real, Vector};

use super::super::PathSegment;
use super::super::shadow::Transmittance;
use super::shade::ShadedLanes;
use super::vertices::{Bounce, VertexLanes};
use super::{PathState, PathTracer};
use crate::interaction::Interaction;
use crate::light::{
    ChosenLight, Density, LightId, LightLanes, LightSample, Target, TargetKind, vector,
};
use crate::prepare::{Material, Spawn};
use crate::scene::AlphaMode;

impl<R: Real> PathTracer<'_, R> {
    /// Adds the reflected light of a sampled light, times its visibility.
    #[inline(always)]
    pub(super) fn add_light(
        &mut self,
        bounce: &mut Bounce<'_, R>,
        (vertices, lane): (&VertexLanes<R>, usize),
        (&ChosenLight { light, .. }, lights): (&ChosenLight<R>, &LightLanes<R>),
        shaded: &ShadedLanes<R>,
    ) {
        let place = vertices.place[lane] as usize;
        let (path, at) = (
            &mut bounce.paths[bounce.going[place] as usize],
            &bounce.met[place],
        );
        let sent = vector::<R>(&shaded.lit.sent, lane);
        let sent = if self.straight_to_lights(light) && lights.aim[lane] != TargetKind::Target {
            let length = shaded.shadow.length[lane];
            // If the light lies at the ray's origin, nothing blocks it.
            let arrives = if length > R::ZERO
                && (length < R::INFINITY || lights.aim[lane] == TargetKind::Infinity)
            {
                let ray = Ray::new(
                    vector::<R>(&shaded.shadow.start, lane),
                    vector::<R>(&shaded.shadow.towards, lane),
                )
                .at_time(at.time);
                self.passes(
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
            let sent = if arrives > R::ZERO {
                sent * arrives
            } else {
                Vector::ZERO
            };
            self.usage.count(light, sent != Vector::ZERO);
            sent
        } else {
            self.arriving(
                path,
                at,
                (light, lights.lane(lane), shaded.lit.is_through[lane]),
                sent,
            )
        };
        path.radiance += path.throughput * sent;
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
            && matches!(scene.rules.spawn, Spawn::ErrorBound)
    }

    /// Visible part of `sent`, the unoccluded light that a surface reflects, or transmits if
    /// `through`.
    #[inline(always)]
    fn arriving(
        &mut self,
        path: &PathState<R>,
        at: &Interaction<R>,
        (light, seen, through): (LightId, LightSample<R>, bool),
        mut sent: R::Vec3,
    ) -> R::Vec3 {
        let scene = self.scene;
        let lights = &scene.lights;
        let Some(seen) = scene.aimed(light, seen, at.surface.point) else {
            return Vector::ZERO;
        };
        let varies = matches!(light, LightId::Emitter(i) if lights.emitters.varies(i));
        let shadows = !matches!(light, LightId::Delta(i) if !lights.delta[i as usize].shadows);
        let media = || {
            if through {
                self.beyond(&path.media, at)
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
            let arrives = self.arrives_straight(path, media, (&seen, emitter), at);
            // Zero for NaN too.
            sent = if arrives == Vector::ZERO {
                Vector::ZERO
            } else {
                sent * arrives
            };
        } else {
            if scene.absorbs {
                sent *= self.passes_media(&media(), at.distance_to(&seen.target));
            }
            if shadows {
                let arrives = self.arrives(&seen, at);
                sent = if arrives > R::ZERO {
                    sent * arrives
                } else {
                    Vector::ZERO
                };
            }
        }
        self.usage.count(light, sent != Vector::ZERO);
        sent
    }

    /// Visible share of a light at an interaction.
    #[inline]
    fn arrives(&mut self, light: &LightSample<R>, at: &Interaction<R>) -> R {
        // If the light lies at the ray's origin, nothing blocks it.
        let Some((ray, mut range)) = self.scene.towards(light, at) else {
            return R::ONE;
        };
        let sizeless = light.density == Density::Delta;
        if matches!(light.target, Target::Infinity) && !sizeless {
            // The scene's limit on shadow distance applies to lights, not to the sky.
            range = Interval {
                max: R::INFINITY,
                ..range
            };
        }
        self.passes(&ray.at_time(at.time), range, Some(&light.target), sizeless)
    }

    /// Transmittance along a shadow ray. `target` is set if the light may be its own occluder.
    #[inline(always)]
    fn passes(
        &mut self,
        ray: &Ray<R>,
        range: Interval<R>,
        target: Option<&Target<R>>,
        sizeless: bool,
    ) -> R {
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
        if blocked {
            R::ZERO
        } else {
            R::from_f64(product.value())
        }
    }

    /// Straight transmittance of an occluder: of its absent share, and of delta lights if it casts
    /// no shadow. Area lights are found by paths too, which hit every object.
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
