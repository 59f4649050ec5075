//! How much of a light arrives: shadow rays under the scene's rule.

use raywright_bvh::{Hit, Interval, Ray, Real, Vector};

use super::{Kernel, Leg, Tracer};
use crate::interaction::Interaction;
use crate::light::{LightId, LightSample, Target};
use crate::prepare::{Alpha, Material, Prepared, Spawn};
use crate::sampler::{Address, Purpose, pair};

/// A ray towards a light and the range before it.
type ShadowRay<R> = (Ray<R>, Interval<R>);

/// What lies between a point and a light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Between<R> {
    /// Share of the light that arrives, 0 to 1.
    pub share: R,
    /// Distance of the nearest occluder; infinite without one.
    pub distance: R,
}

impl<R: Real, K: Kernel> Tracer<'_, R, K> {
    /// What lies between a surface and a light that it sees.
    #[inline]
    pub(super) fn before(&mut self, light: &LightSample<R>, at: &Interaction<R>, want_distance: bool) -> Between<R> {
        match self.towards(light, at) {
            Some((ray, range)) => self.between((&ray.at_time(at.time), range), &light.target, want_distance),
            // The light is where the ray would start: nothing is in between.
            None => Between { share: R::ONE, distance: R::INFINITY },
        }
    }

    /// The ray from a surface to a light that it sees, and the range before it; none where they meet.
    #[inline(always)]
    pub(super) fn towards(&self, light: &LightSample<R>, at: &Interaction<R>) -> Option<ShadowRay<R>> {
        let (l, rules) = (light.direction, &self.scene.rules);
        match (rules.spawn, &light.target) {
            // Surfaces are drawn and not points of a documented shader, whatever its rule.
            (_, Target::Surface(surface)) => at.surface.spawn_to_surface(surface),
            (Spawn::ErrorBound, Target::Point(position) | Target::Middle { point: position, .. }) => {
                at.surface.spawn_to(*position)
            }
            (Spawn::ErrorBound, Target::Infinity) => {
                let range = Interval { min: R::ZERO, max: rules.shadow_max_distance };
                Some((Ray::new(at.surface.spawn(l), l), range))
            }
            // The documented shaders measure from the surface, also where the ray starts off it.
            (Spawn::Constant { offset, shadow_min, .. }, target) => {
                let p = at.surface.point;
                let max = match target {
                    Target::Point(position) | Target::Middle { point: position, .. } => (*position - p).length(),
                    _ => rules.shadow_max_distance,
                };
                Some((Ray::new(p + l * offset, l), Interval { min: shadow_min, max }))
            }
        }
    }

    /// A lamp as a point sees it that was drawn, and is to be seen by its middle where shadows are hard; none where it hides itself.
    #[inline(always)]
    pub(super) fn aimed(&self, light: LightId, drawn: LightSample<R>, from: R::Vec3) -> Option<LightSample<R>> {
        match light {
            LightId::Emitter(emitter) if self.scene.casts_hard(emitter) => {
                self.scene.lights.emitters.by_middle(emitter, drawn, from)
            }
            _ => Some(drawn),
        }
    }

    /// Whether a hit on the way to a lamp's middle is the lamp itself.
    #[inline(always)]
    pub(super) fn is_own(&self, target: &Target<R>, hit: &Hit<R>) -> bool {
        matches!(*target, Target::Middle { emitter, .. } if self.scene.lights.emitters.of(hit.outermost(), hit.primitive) == Some(emitter))
    }

    /// A point of an emissive surface that lights the hit, with the share of its light that arrives.
    pub(super) fn emitter(&mut self, at: &Interaction<R>, address: Address) -> Option<(LightSample<R>, R)> {
        let emitters = &self.scene.lights.emitters;
        if emitters.is_empty() {
            return None;
        }
        let pick = pair(address, Purpose::Emitter);
        let position = pair(address, Purpose::EmitterPoint);
        let (index, probability) = emitters.choose(pick)?;
        let drawn = emitters.sample(index, at.surface.point, position, probability)?;
        if at.normal.dot(drawn.direction) <= R::ZERO {
            return None;
        }
        let aimed = self.aimed(LightId::Emitter(index), drawn, at.surface.point)?;
        let (ray, range) = self.towards(&aimed, at)?;
        let share = self.between((&ray.at_time(at.time), range), &aimed.target, false).share;
        (share > R::ZERO).then_some((drawn, share))
    }

    /// Traces towards a light.
    #[inline]
    pub(super) fn between(
        &mut self,
        (ray, range): (&Ray<R>, Interval<R>),
        target: &Target<R>,
        want_distance: bool,
    ) -> Between<R> {
        self.counters.shadow += 1;
        let scene = self.scene;
        let mut nearest = R::INFINITY;
        if scene.rules.first_occluder_decides {
            let mut first: Option<Hit<R>> = None;
            scene.geometry.any(
                ray,
                range,
                &mut |hit| {
                    if self.is_own(target, hit) {
                        return false;
                    }
                    nearest = nearest.min(hit.t);
                    if first.is_none_or(|f| hit.order() < f.order()) {
                        first = Some(*hit);
                    }
                    false
                },
                &mut (),
            );
            let share = first.map_or(R::ONE, |hit| passes::<R, K>(scene, ray, &hit));
            return Between { share, distance: nearest };
        }
        let mut product = Product::default();
        let blocked = scene.geometry.any(
            ray,
            range,
            &mut |hit| {
                if self.is_own(target, hit) {
                    return false;
                }
                nearest = nearest.min(hit.t);
                product.factor(passes::<R, K>(scene, ray, hit).to_f64());
                product.opaque && !want_distance
            },
            &mut (),
        );
        let share = if blocked { R::ZERO } else { R::from_f64(product.value()) };
        Between { share, distance: nearest }
    }
}

/// A product of factors in 0..1 whose bits do not depend on their order, because occluders are met in the order of the
/// accelerator: beyond the first factor, logarithms are summed as integers.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Product {
    pub opaque: bool,
    only: Option<f64>,
    /// Sum of the logarithms, in units of 2⁻⁴⁰.
    logarithm: i64,
    count: u32,
}

impl Product {
    const UNIT: f64 = (1_u64 << 40) as f64;

    pub fn factor(&mut self, share: f64) {
        if share <= 0.0 {
            self.opaque = true;
        } else if share < 1.0 {
            self.count += 1;
            self.only = (self.count == 1).then_some(share);
            self.logarithm = self.logarithm.saturating_add((Real::ln(share) * Self::UNIT) as i64);
        }
    }

    pub fn value(&self) -> f64 {
        match (self.opaque, self.count, self.only) {
            (true, ..) => 0.0,
            (_, 0, _) => 1.0,
            (_, _, Some(only)) => only,
            _ => Real::exp(self.logarithm as f64 / Self::UNIT),
        }
    }
}

/// Share of light that one occluder lets through.
#[inline]
fn passes<R: Real, K: Kernel>(scene: &Prepared<R>, ray: &Ray<R>, hit: &Hit<R>) -> R {
    let material = &scene.materials[scene.objects[hit.outermost() as usize].material as usize];
    let even = material.shadow_transmittance();
    if K::PHYSICAL
        && let Material::Physical(m) = material
        && (m.alpha != Alpha::Opaque || even.is_none())
    {
        let at = Interaction::of::<K>(scene, &Leg::of(*ray), hit);
        return m.passes_at(&scene.sources.at(&at));
    }
    even.unwrap_or(R::ZERO)
}

#[cfg(test)]
mod tests {
    use super::Product;

    fn product(factors: &[f64]) -> f64 {
        let mut product = Product::default();
        factors.iter().for_each(|&f| product.factor(f));
        product.value()
    }

    /// Protects: one occluder's share is exact, any order gives the same bits, and the value is the product.
    #[test]
    fn order_does_not_matter() {
        assert_eq!((product(&[]), product(&[0.45]), product(&[1.0, 0.45]), product(&[0.45, 0.0])), (1.0, 0.45, 0.45, 0.0));
        let (a, b) = (product(&[0.3, 0.7, 0.45, 0.9]), product(&[0.9, 0.45, 0.3, 0.7]));
        assert_eq!(a.to_bits(), b.to_bits());
        assert!((a - 0.3 * 0.7 * 0.45 * 0.9).abs() < 1e-11);
    }
}
