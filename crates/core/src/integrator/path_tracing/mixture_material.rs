//! Mixture surfaces, which reflect, refract or diffuse each ray by chance, as in a published family
//! of shaders ([`crate::scene::Mixture`]).

use core::f64::consts::PI;

use raywright_bvh::{Real, Vector};

use super::PathTracer;
use super::bsdf_lanes::{BsdfLanes, LaneVertex, eval_bsdf_for_light};
use super::scatter::ScatteredRay;
use super::vertices::LitSides;
use crate::interaction::Interaction;
use crate::light::get_lane_vector;
use crate::material::{
    Bsdf, BsdfSample, Lambert, ShadingFrame, SmoothInterface, sample_cosine_hemisphere,
};
use crate::prepare::PreparedMaterial;
use crate::scene::Mixture;

/// Least probability by which the published shader divides the throughput.
const LEAST_CHANCE: f64 = 0.001;

/// A mixture surface at a hit.
pub(super) struct MixtureSurface<R: Real> {
    albedo: R::Vec3,
    /// Probability of mirror reflection.
    mirror_probability: f64,
    /// Probability of refraction; the remaining probability is that of diffuse reflection.
    refraction_probability: f64,
    interface: SmoothInterface,
}

impl<R: Real> MixtureSurface<R> {
    pub fn new(m: &Mixture, interaction: &Interaction<R>, albedo: R::Vec3) -> Self {
        let normal = interaction.facing_normal();
        let eta = m
            .ior
            .map_or(1.0, |ior| if interaction.outside { 1.0 / ior } else { ior });
        let interface = SmoothInterface::new(interaction.direction.to_f64(), normal.to_f64(), eta);
        let s = m.specular_chance;
        let (mut mirrored, mut through) = (s, m.refraction_chance);
        if s > 0.0 && m.ior.is_some() {
            // Schlick's formula at the angle on the thin side.
            let fresnel = match interface.refracted {
                None => 1.0,
                Some(refracted) => {
                    let cosine = if eta > 1.0 {
                        -refracted.dot(normal.to_f64())
                    } else {
                        interface.cos_incident
                    };
                    interface.schlick(cosine.max(0.0))
                }
            };
            mirrored = s + (1.0 - s) * fresnel;
            through = if s < 1.0 {
                through * (1.0 - mirrored) / (1.0 - s)
            } else {
                0.0
            };
        }
        if interface.refracted.is_none() {
            through = 0.0;
        }
        Self {
            albedo,
            mirror_probability: mirrored,
            refraction_probability: through,
            interface,
        }
    }

    /// Returns the probability of diffuse reflection.
    fn diffuse_probability(&self) -> f64 {
        1.0 - self.mirror_probability - self.refraction_probability
    }

    /// Returns the sides on which the surface receives sampled light: none under the published
    /// shader's own roulette, which finds lights by scattering alone.
    pub fn lit_sides(&self, m: &Mixture) -> LitSides {
        if !m.published_roulette && self.diffuse_probability() > 0.0 {
            LitSides::One
        } else {
            LitSides::None
        }
    }
}

impl<R: Real> PathTracer<'_, R> {
    /// Evaluates and samples a mixture surface at a vertex, and returns the properties of the
    /// scattered ray.
    #[inline(never)]
    pub(super) fn shade_mixture(
        &self,
        vertex: &LaneVertex<'_, R>,
        surface: &MixtureSurface<R>,
        bsdf_lanes: &mut BsdfLanes<R>,
    ) -> ScatteredRay<R> {
        let normal = get_lane_vector::<R>(&vertex.vertices.normal, vertex.lane);
        let diffused = surface.diffuse_probability();
        if let Some(light) = vertex.light_direction() {
            let albedo = surface.albedo * R::from_f64(diffused);
            let matte = Bsdf::<R, Lambert<R>, 1>::new(normal).with_lobe(Lambert { albedo });
            bsdf_lanes.set_bsdf_values(
                vertex.lane,
                &eval_bsdf_for_light(&matte, vertex.view_direction(), light),
            );
        }
        let PreparedMaterial::Classic(classic) =
            &self.scene.materials[vertex.interaction().material as usize]
        else {
            return ScatteredRay::REFLECTED;
        };
        let Some(m) = &classic.mixture else {
            return ScatteredRay::REFLECTED;
        };
        let [u_lobe, u, v, u_roulette] = vertex.random_numbers();
        let u_lobe = u_lobe.to_f64();
        // The normal plus a uniform point of the unit sphere has a cosine-weighted direction.
        let h =
            ShadingFrame::<R>::from_normal(normal).to_world(sample_cosine_hemisphere::<R>([u, v]));
        let blend = |smooth: glam::DVec3, about: R::Vec3, roughness: f64| {
            let share = roughness * roughness;
            R::Vec3::from_f64((smooth * (1.0 - share) + about.to_f64() * share).normalize())
        };
        let (one, is_mirrored) = (R::ONE, u_lobe < surface.mirror_probability);
        let refracted = surface.interface.refracted.filter(|_| {
            !is_mirrored && u_lobe < surface.mirror_probability + surface.refraction_probability
        });
        let (direction, mut weight, chance) = if is_mirrored {
            let colour = R::Vec3::from_f64(m.specular_colour.0.into());
            (
                blend(surface.interface.reflected, h, m.specular_roughness),
                colour,
                surface.mirror_probability,
            )
        } else if let Some(refracted) = refracted {
            let about = h - normal * (one + one) * h.dot(normal);
            (
                blend(refracted, about, m.refraction_roughness),
                Vector::ONE,
                surface.refraction_probability,
            )
        } else {
            (h, surface.albedo, diffused)
        };
        let priced = refracted.is_none() && !is_mirrored && !m.published_roulette;
        let density = if priced {
            R::from_f64(diffused / PI) * normal.dot(h)
        } else {
            R::ZERO
        };
        let mut some = true;
        if m.published_roulette {
            weight *= R::from_f64(1.0 / chance.max(LEAST_CHANCE));
            let largest = (get_lane_vector::<R>(&vertex.vertices.throughput, vertex.lane) * weight)
                .max_element();
            // NaN and infinity go on unchanged, so that the sample is dropped at the end.
            if largest.is_finite() {
                some = u_roulette < largest;
                weight *= one / largest;
            }
        }
        bsdf_lanes.set_bsdf_sample(
            vertex.lane,
            &BsdfSample {
                is_valid: some,
                direction,
                weight,
                density,
                delta: !priced,
            },
        );
        ScatteredRay {
            is_delta: is_mirrored,
            is_transmitted: refracted.is_some(),
            ..ScatteredRay::REFLECTED
        }
    }
}
