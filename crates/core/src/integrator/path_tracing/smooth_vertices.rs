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
        lobe: (&Lobe<R>, Option<&Glass<R>>),
        samples: &VertexSamples,
    ) -> bool {
        let [_, u, _, u_roulette] = samples.scatter.map(R::from_f32);
        let Some(([normal, direction, weight], scattered_ray)) =
            self.sample_smooth_surface(path, (hit, interaction), lobe, u)
        else {
            return false;
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
        if !continues {
            return false;
        }
        let side = scattered_ray.side(interaction, normal);
        let ray = self.scene.spawn_ray(interaction, direction, side);
        if self.scene.tracks_media && scattered_ray.is_transmitted {
            path.media = self.media_beyond_surface(&path.media, interaction);
        }
        self.start_segment(
            path,
            interaction.surface.point,
            (throughput, f64::INFINITY),
            (&ray, normal),
            &scattered_ray,
        );
        true
    }

    /// Samples the lobe of a smooth surface. Returns the normal of the vertex, the direction, its
    /// weight, and the properties of the ray; `None` for a ray along the surface.
    #[inline(always)]
    fn sample_smooth_surface(
        &self,
        path: &PathState<R>,
        (hit, interaction): (&Hit<R>, &Interaction<R>),
        (lobe, glass): (&Lobe<R>, Option<&Glass<R>>),
        u: R,
    ) -> Option<([R::Vec3; 3], ScatteredRay<R>)> {
        let mut scattered_ray = ScatteredRay {
            is_delta: true,
            ..ScatteredRay::REFLECTED
        };
        let Some(glass) = glass else {
            let (normal, view) = (interaction.normal, -interaction.direction);
            let (direction, reflectance) = lobe.sample_delta(normal, view, u);
            return (normal.dot(view) > R::ZERO)
                .then_some(([normal, direction, reflectance], scattered_ray));
        };
        let interface = self
            .scene
            .dielectric_interface(&path.segment, hit, interaction, glass);
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
        let vectors = [interaction.facing_normal(), direction, tint];
        (interface.cos_incident > 0.0).then_some((vectors, scattered_ray))
    }
}

#[cfg(test)]
mod tests;
