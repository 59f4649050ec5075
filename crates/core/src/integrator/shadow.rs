//! How much of a light arrives: shadow rays under the scene's rule.

use raywright_bvh::{Hit, Interval, Precision, Ray, Real, Vec3Of};

use super::{Kernel, Shading, Tracer};
use crate::prepare::{Alpha, Material, Prepared, Spawn};

/// What lies between a point and a light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Between<R> {
    /// Share of the light that arrives, 0 to 1.
    pub share: R,
    /// Distance of the nearest occluder; infinite without one.
    pub distance: R,
}

impl<P: Precision, K: Kernel> Tracer<'_, P, K> {
    /// Traces from a surface towards a light in unit direction `l` at `distance` (infinite for a directional one).
    #[inline]
    pub(super) fn between(
        &mut self,
        shading: &Shading<P>,
        l: Vec3Of<P>,
        distance: P::Real,
        want_distance: bool,
    ) -> Between<P::Real> {
        self.counters.shadow += 1;
        let scene = self.scene;
        let far = if distance == P::Real::INFINITY { scene.rules.shadow_max_distance } else { distance };
        let (ray, range) = match scene.rules.spawn {
            Spawn::ErrorBound => {
                let origin = shading.surface.spawn(l);
                (Ray::new(origin, l), Interval { min: P::Real::ZERO, max: far })
            }
            Spawn::Constant { offset, shadow_min, .. } => {
                (Ray::new(shading.inputs().p + l * offset, l), Interval { min: shadow_min, max: far })
            }
        };
        let mut nearest = P::Real::INFINITY;
        if scene.rules.first_occluder_decides {
            let mut first: Option<Hit<P::Real>> = None;
            scene.geometry.any(
                &ray,
                range,
                |hit| {
                    nearest = nearest.min(hit.t);
                    if first.is_none_or(|f| hit.order() < f.order()) {
                        first = Some(*hit);
                    }
                    false
                },
                &mut (),
            );
            let share = first.map_or(P::Real::ONE, |hit| passes::<P, K>(scene, &ray, &hit));
            return Between { share, distance: nearest };
        }
        let mut share = P::Real::ONE;
        scene.geometry.any(
            &ray,
            range,
            |hit| {
                nearest = nearest.min(hit.t);
                share *= passes::<P, K>(scene, &ray, hit);
                share == P::Real::ZERO && !want_distance
            },
            &mut (),
        );
        Between { share, distance: nearest }
    }
}

/// Share of light that one occluder lets through.
#[inline]
fn passes<P: Precision, K: Kernel>(scene: &Prepared<P>, ray: &Ray<P::Real>, hit: &Hit<P::Real>) -> P::Real {
    let object = scene.object_of[hit.order() as usize];
    let material = &scene.materials[scene.objects[object as usize].material as usize];
    if K::PHYSICAL
        && let Material::Physical(m) = material
        && m.alpha != Alpha::Opaque
    {
        let shading = Shading::<P>::new::<K>(scene, ray, hit);
        let alpha = m.alpha_at(&shading);
        return P::Real::ONE - alpha * (P::Real::ONE - material.shadow_transmittance());
    }
    material.shadow_transmittance()
}
