//! Visibility of lights: shadow rays and their transmittance. The scene's spawn rule sets the
//! origins and lengths of shadow rays.

use raywright_bvh::{Hit, Interval, Ray, Real, Vector};

use super::PathSegment;
use crate::interaction::Interaction;
use crate::light::{LightId, LightSample, ShadowRayTarget};
use crate::prepare::{PreparedMaterial, PreparedScene, PreparedSpawnRule};
use crate::scene::AlphaMode;

/// Result of a shadow ray.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShadowResult<R> {
    /// Transmittance, 0 to 1.
    pub share: R,
    /// Distance of the nearest occluder; infinite without one.
    pub distance: R,
}

impl<R: Real> PreparedScene<R> {
    /// Returns the shadow ray from a surface to a light sample, and the range of distances in which
    /// occluders count. `None` if the surface point and the light sample coincide.
    #[inline(always)]
    pub(super) fn shadow_ray(
        &self,
        light: &LightSample<R>,
        interaction: &Interaction<R>,
    ) -> Option<(Ray<R>, Interval<R>)> {
        let (l, rules) = (light.direction, &self.rules);
        match (rules.spawn, &light.target) {
            // Area lights are not part of the documented shaders, so their spawn rule does not
            // apply.
            (_, ShadowRayTarget::Surface(surface)) => {
                interaction.surface.spawn_ray_to_surface(surface)
            }
            (
                PreparedSpawnRule::ErrorBound,
                ShadowRayTarget::Point(position)
                | ShadowRayTarget::EmitterCentre {
                    point: position, ..
                },
            ) => interaction.surface.spawn_ray_to_point(*position),
            (PreparedSpawnRule::ErrorBound, ShadowRayTarget::Infinity) => {
                let range = Interval {
                    min: R::ZERO,
                    max: rules.shadow_max_distance,
                };
                Some((Ray::new(interaction.surface.spawn_ray_origin(l), l), range))
            }
            // The documented shaders measure distances from the surface, also for an offset ray
            // origin.
            (
                PreparedSpawnRule::Constant {
                    offset, shadow_min, ..
                },
                target,
            ) => {
                let max = if matches!(target, ShadowRayTarget::Infinity) {
                    rules.shadow_max_distance
                } else {
                    interaction.distance_to_target(target)
                };
                Some((
                    Ray::new(interaction.surface.point + l * offset, l),
                    Interval {
                        min: shadow_min,
                        max,
                    },
                ))
            }
        }
    }

    /// Returns a light sample; for a lamp with hard shadows, its shadow ray ends at the lamp's
    /// centre. `None` if the lamp itself hides the sampled point.
    #[inline(always)]
    pub(super) fn aim_at_lamp_centre(
        &self,
        light: LightId,
        light_sample: LightSample<R>,
        from: R::Vec3,
    ) -> Option<LightSample<R>> {
        match light {
            LightId::Emitter(emitter) if self.casts_hard_shadow(emitter) => self
                .lights
                .emitters
                .redirect_to_centre(emitter, light_sample, from),
            _ => Some(light_sample),
        }
    }

    /// Whether a shadow ray to a lamp's centre hit that lamp itself.
    #[inline(always)]
    pub(super) fn is_target_emitter(&self, target: &ShadowRayTarget<R>, hit: &Hit<R>) -> bool {
        matches!(*target, ShadowRayTarget::EmitterCentre { emitter, .. } if self.lights.emitters.emitter_index_of(hit.outermost_id(), hit.primitive) == Some(emitter))
    }

    /// Traces a shadow ray. Callers count the ray.
    ///
    /// - Transmittance: the product over all occluders, or that of the first occluder alone if the
    ///   scene's rules demand this.
    /// - Distance: that of the nearest occluder. Without `want_distance`, an opaque occluder may
    ///   end the traversal early, and the distance may be too large.
    #[inline]
    pub(crate) fn trace_shadow(
        &self,
        (ray, range): (&Ray<R>, Interval<R>),
        target: &ShadowRayTarget<R>,
        want_distance: bool,
    ) -> ShadowResult<R> {
        let mut nearest = R::INFINITY;
        if self.rules.first_occluder_decides {
            let mut first: Option<Hit<R>> = None;
            self.geometry.occluded(
                ray,
                range,
                &mut |hit| {
                    if self.is_target_emitter(target, hit) {
                        return false;
                    }
                    nearest = nearest.min(hit.t);
                    if first.is_none_or(|f| hit.tie_order() < f.tie_order()) {
                        first = Some(*hit);
                    }
                    false
                },
                &mut (),
            );
            let share = first.map_or(R::ONE, |hit| occluder_transmittance(self, ray, &hit));
            return ShadowResult {
                share,
                distance: nearest,
            };
        }
        let mut product = TransmittanceProduct::default();
        let blocked = self.geometry.occluded(
            ray,
            range,
            &mut |hit| {
                if self.is_target_emitter(target, hit) {
                    return false;
                }
                nearest = nearest.min(hit.t);
                product.multiply(occluder_transmittance(self, ray, hit).to_f64());
                product.opaque && !want_distance
            },
            &mut (),
        );
        let share = if blocked {
            R::ZERO
        } else {
            R::from_f64(product.value())
        };
        ShadowResult {
            share,
            distance: nearest,
        }
    }
}

impl<R: Real> Interaction<R> {
    /// Returns the distance from a surface to the target of a shadow ray; infinite for targets at
    /// infinity.
    pub(super) fn distance_to_target(&self, target: &ShadowRayTarget<R>) -> R {
        match target {
            ShadowRayTarget::Infinity => R::INFINITY,
            ShadowRayTarget::Point(target)
            | ShadowRayTarget::EmitterCentre { point: target, .. } => {
                (*target - self.surface.point).length()
            }
            ShadowRayTarget::Surface(target) => (target.point - self.surface.point).length(),
        }
    }
}

/// Product of transmittances in [0, 1]. Its bits do not depend on the order of the factors: a
/// traversal visits occluders in any order. The logarithms of several factors are summed as
/// integers.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct TransmittanceProduct {
    pub opaque: bool,
    single_factor: Option<f64>,
    /// Sum of the logarithms of all factors, in units of 2⁻⁴⁰.
    logarithm: i64,
    count: u32,
}

impl TransmittanceProduct {
    const UNIT: f64 = (1_u64 << 40) as f64;

    pub fn multiply(&mut self, share: f64) {
        if share <= 0.0 {
            self.opaque = true;
        } else if share < 1.0 {
            self.count += 1;
            self.single_factor = (self.count == 1).then_some(share);
            self.logarithm = self
                .logarithm
                .saturating_add((Real::ln(share) * Self::UNIT) as i64);
        }
    }

    pub fn value(&self) -> f64 {
        match (self.opaque, self.count, self.single_factor) {
            (true, ..) => 0.0,
            (_, 0, _) => 1.0,
            (_, _, Some(only)) => only,
            _ => Real::exp(self.logarithm as f64 / Self::UNIT),
        }
    }
}

/// Returns the transmittance of an occluder for shadow rays, from its material's alpha and
/// transmission.
#[inline]
fn occluder_transmittance<R: Real>(scene: &PreparedScene<R>, ray: &Ray<R>, hit: &Hit<R>) -> R {
    let material = &scene.materials[scene.objects[hit.outermost_id() as usize].material as usize];
    let even = material.shadow_transmittance();
    if let PreparedMaterial::Physical(m) = material
        && (m.alpha != AlphaMode::Opaque || even.is_none())
    {
        let interaction = Interaction::from_hit(scene, &PathSegment::from_ray(*ray), hit);
        return m.shadow_transmittance_at(&scene.texture_tables.shading_context(&interaction));
    }
    even.unwrap_or(R::ZERO)
}

#[cfg(test)]
mod tests {
    use super::TransmittanceProduct;

    fn product(factors: &[f64]) -> f64 {
        let mut product = TransmittanceProduct::default();
        factors.iter().for_each(|&f| product.multiply(f));
        product.value()
    }

    /// Protects: a single occluder's transmittance is exact, any order gives the same bits, and the
    /// value is the product.
    #[test]
    fn order_does_not_matter() {
        assert_eq!(
            (
                product(&[]),
                product(&[0.45]),
                product(&[1.0, 0.45]),
                product(&[0.45, 0.0])
            ),
            (1.0, 0.45, 0.45, 0.0)
        );
        let (a, b) = (
            product(&[0.3, 0.7, 0.45, 0.9]),
            product(&[0.9, 0.45, 0.3, 0.7]),
        );
        assert_eq!(a.to_bits(), b.to_bits());
        assert!((a - 0.3 * 0.7 * 0.45 * 0.9).abs() < 1e-11);
    }
}
