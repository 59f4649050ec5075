//! Conversion of classic materials (highlight exponents, constant reflection weights) to BSDFs for
//! path tracing.

use raywright_bvh::{Real, Vector};

use crate::interaction::Interaction;
use crate::material::{Bsdf, Glass, Lambert, Lobe, MetallicRoughness};
use crate::prepare::{ClassicInputs, SpecularInputs};
use crate::scene::SpecularModel;
use crate::texture::ShadingContext;

/// Adds the lobes of a classic surface to a BSDF without lobes:
/// - Lambertian, with the albedo `local`·`colour`·`diffuse`;
/// - a microfacet lobe for the highlight `specular`, with the roughness of the highlight's
///   exponent;
/// - a mirror for the reflection, with the same weight at every angle;
/// - a smooth dielectric in place of the mirror, if `glass` is given with its relative index of
///   refraction.
///
/// If all lobes together would reflect more than the incident light, the mirror or dielectric keeps
/// its weight. The highlight gets at most the remainder, and the Lambertian lobe what is left.
#[inline(always)]
pub(super) fn add_classic_lobes<R: Real>(
    bsdf: &mut Bsdf<R>,
    (m, glass): (&ClassicInputs<R>, Option<&Glass<R>>),
    context: &ShadingContext<'_, R>,
    interaction: &Interaction<R>,
) {
    let colour = m.colour.eval_colour(context);
    let local = clamp_to_unit(m.local.eval_number(context));
    let mut taken = R::Vec3::ZERO;
    if let Some(glass) = glass {
        bsdf.add_lobe(Lobe::Dielectric(glass.dielectric_lobe(
            interaction.outside,
            R::ONE,
            None,
        )));
        taken = R::Vec3::ONE;
    } else if let Some(reflection) = &m.reflection {
        let weight = R::Vec3::splat(clamp_to_unit(reflection.weight.eval_number(context)));
        let mirror = clamp_colour_to_unit::<R>(if reflection.tinted {
            weight * colour
        } else {
            weight
        });
        bsdf.add_lobe(Lobe::Mirror {
            f0: mirror,
            f90: mirror,
        });
        taken = mirror;
    }
    if let Some(specular) = m
        .specular
        .as_ref()
        .filter(|specular| specular.model != SpecularModel::Grazing)
    {
        let scale = if specular.on_reflection {
            taken
        } else {
            R::Vec3::splat(local)
        };
        let f0 = clamp_colour_to_unit::<R>(
            scale * clamp_to_unit(specular.strength.eval_number(context)),
        )
        .min(R::Vec3::ONE - taken);
        if f0 != R::Vec3::ZERO {
            bsdf.add_lobe(Lobe::Rough {
                f0,
                f90: f0,
                roughness: roughness_from_exponent(specular),
            });
            taken += f0;
        }
    }
    let albedo = clamp_colour_to_unit::<R>(colour * (local * m.diffuse.eval_number(context)))
        .min(R::Vec3::ONE - taken);
    if albedo != R::Vec3::ZERO {
        bsdf.add_lobe(Lobe::Lambert(Lambert { albedo }));
    }
}

/// Returns the metallic-roughness model of a matte classic surface. Without specular reflection,
/// the model has a single Lambertian lobe, with the albedo of the classic surface.
#[inline(always)]
pub(super) fn build_matte_model<R: Real>(
    m: &ClassicInputs<R>,
    context: &ShadingContext<'_, R>,
) -> MetallicRoughness<R> {
    let base = clamp_colour_to_unit::<R>(
        m.colour.eval_colour(context)
            * (clamp_to_unit(m.local.eval_number(context)) * m.diffuse.eval_number(context)),
    );
    MetallicRoughness {
        base,
        metallic: R::ZERO,
        roughness: R::ONE,
        dielectric: R::ZERO,
        grazing: R::ZERO,
        glass: None,
    }
}

/// Returns the perceptual roughness √α for the exponent n of a highlight: α = √(2/(n + 2)) for a
/// lobe about the half vector ("Microfacet Models for Refraction through Rough Surfaces", Walter et
/// al. 2007). A highlight about the mirrored view direction (Phong) has the width of a half-vector
/// lobe with the exponent 4n.
fn roughness_from_exponent<R: Real>(specular: &SpecularInputs<R>) -> R {
    let exponent = f64::from(specular.exponent);
    let about_half = match specular.model {
        SpecularModel::Blinn | SpecularModel::BlinnReflected => exponent,
        SpecularModel::Phong | SpecularModel::Grazing => 4.0 * exponent,
    };
    R::from_f64((2.0 / (about_half + 2.0)).sqrt().sqrt())
}

fn clamp_to_unit<R: Real>(x: R) -> R {
    // Zero for NaN too.
    Real::clamp(x.max(R::ZERO), R::ZERO, R::ONE)
}

fn clamp_colour_to_unit<R: Real>(c: R::Vec3) -> R::Vec3 {
    c.max(R::Vec3::ZERO).min(R::Vec3::ONE)
}
