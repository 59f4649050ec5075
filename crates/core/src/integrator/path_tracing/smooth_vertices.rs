//! Vertices on smooth mirrors and smooth glass. Their only lobe is a delta lobe: no light sample
//! reaches it, and the path goes on from the hit at once, without columns.

use raywright_bvh::{Hit, Real, Vector};

use super::super::spawn::round_direction;
use super::roulette::{apply_roulette, has_finite_components};
use super::scatter::ScatteredRay;
use super::{PathState, PathTracer, VertexSamples};
use crate::interaction::Interaction;
use crate::material::{Glass, Lobe, ScatteringLobe};

impl<R: Real> PathTracer<'_, R> {
    /// Continues a path at a surface whose only lobe is a mirror, or a smooth boundary of `glass`.
    /// Returns whether the path goes on.
    pub(super) fn scatter_smoothly(
        &mut self,
        path: &mut PathState<R>,
        (hit, interaction): (&Hit<R>, &Interaction<R>),
        (lobe, glass): (&Lobe<R>, Option<&Glass<R>>),
        samples: &VertexSamples,
    ) -> bool {
        let [_, u, _, u_roulette] = samples.scatter.map(R::from_f32);
        let mut scattered_ray = ScatteredRay {
            is_delta: true,
            ..ScatteredRay::REFLECTED
        };
        let (normal, direction, weight) = match glass {
            Some(glass) => {
                let interface =
                    self.scene
                        .dielectric_interface(&path.segment, hit, interaction, glass);
                if interface.cos_incident <= 0.0 {
                    return false;
                }
                // The probability of reflection is the reflectance itself, so the weight is the tint.
                let (direction, tint) = match interface.refracted {
                    Some(refracted) if u.to_f64() >= interface.fresnel() => {
                        scattered_ray.is_transmitted = true;
                        (refracted, glass.transmitted)
                    }
                    _ => (interface.reflected, glass.reflected),
                };
                let (direction, rest) = round_direction::<R>(direction);
                scattered_ray.direction_error = rest;
                (interaction.facing_normal(), direction, tint)
            }
            None => {
                let (normal, view) = (interaction.normal, -interaction.direction);
                if normal.dot(view) <= R::ZERO {
                    return false;
                }
                let (direction, reflectance) = lobe.sample_delta(normal, view, u);
                (normal, direction, reflectance)
            }
        };
        // A shading normal must not turn a reflection below the surface, nor a transmission above
        // it.
        let height = interaction.surface.normal.dot(direction);
        let height = if interaction.outside { height } else { -height };
        if (height < R::ZERO) != scattered_ray.is_transmitted {
            return false;
        }
        let throughput = path.throughput * weight;
        if !has_finite_components::<R>(throughput) {
            path.radiance = Vector::splat(R::INFINITY);
        }
        let scale = path.survival_scale(self.scene.roulette);
        let (throughput, continues) = apply_roulette(throughput, scale, u_roulette);
        if continues {
            self.leave_smooth_surface(
                path,
                interaction,
                (throughput, normal, direction),
                &scattered_ray,
            );
        }
        continues
    }

    /// Continues a path in a direction from a smooth surface with the normal `normal`.
    #[inline(always)]
    fn leave_smooth_surface(
        &mut self,
        path: &mut PathState<R>,
        interaction: &Interaction<R>,
        (throughput, normal, direction): (R::Vec3, R::Vec3, R::Vec3),
        scattered_ray: &ScatteredRay<R>,
    ) {
        let side = if scattered_ray.is_transmitted == (normal == interaction.normal) {
            -R::ONE
        } else {
            R::ONE
        };
        let ray = self.scene.spawn_ray(interaction, direction, side);
        if self.scene.tracks_media && scattered_ray.is_transmitted {
            path.media = self.media_beyond_surface(&path.media, interaction);
        }
        self.start_segment(
            path,
            interaction.surface.point,
            (throughput, f64::INFINITY),
            (&ray, normal),
            scattered_ray,
        );
    }
}

#[cfg(test)]
mod tests;
