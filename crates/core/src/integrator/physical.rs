//! Evaluation of a physical material's inputs at a surface point, for every integrator.

use raywright_bvh::{Real, Vector};

use crate::material::MetallicRoughness;
use crate::prepare::{
    ConstantIor, PhysicalInputs, PhysicalTransmission, RefractiveIndex, tinted_shadow_transmittance,
};
use crate::scene::{AlphaMode, Physical as PhysicalData};
use crate::texture::ShadingContext;

impl<R: Real> PhysicalTransmission<R> {
    /// Returns the transmissive share of a surface at a point, 0 to 1.
    #[inline(always)]
    fn transmissive_share_at(&self, context: &ShadingContext<'_, R>) -> R {
        Real::clamp(self.share.eval_number(context), R::ZERO, R::ONE)
    }
}

impl<R: Real> PhysicalInputs<R> {
    /// Returns the base colour at a point, vertex colours included.
    #[inline]
    pub fn base_colour_at(&self, context: &ShadingContext<'_, R>) -> R::Vec3 {
        let colour = self.base.multiply_colour(context, R::Vec3::ONE);
        let [r, g, b, _] = context.interaction.colour;
        if self.vertex_colours {
            colour * R::Vec3::new(r, g, b)
        } else {
            colour
        }
    }

    /// Returns the dielectric boundary at a point: index of refraction and reflectance at normal
    /// incidence.
    #[inline(always)]
    pub fn dielectric_boundary_at(&self, context: &ShadingContext<'_, R>) -> ConstantIor<R> {
        match &self.index {
            RefractiveIndex::Constant(boundary) => *boundary,
            RefractiveIndex::Varying(index) => {
                let [minimum, maximum] = PhysicalData::IOR;
                ConstantIor::new(Real::clamp(
                    index.eval_number(context).to_f64(),
                    minimum,
                    maximum,
                ))
            }
        }
    }

    /// Returns the inputs of the metallic-roughness model, evaluated at a point.
    #[inline(always)]
    pub fn metallic_roughness_at(&self, context: &ShadingContext<'_, R>) -> MetallicRoughness<R> {
        if let Some(model) = self.uniform_model {
            return model;
        }
        let (boundary, base) = (
            self.dielectric_boundary_at(context),
            self.base_colour_at(context),
        );
        let glass = |transmission: &PhysicalTransmission<R>| {
            self.glass_of_share(transmission.share.eval_number(context), base, boundary.ior)
        };
        MetallicRoughness {
            base,
            metallic: self.metallic.eval_number(context),
            roughness: self.roughness.eval_number(context),
            dielectric: boundary.f0 * self.specular,
            grazing: self.specular,
            glass: self.transmission.as_ref().and_then(glass),
        }
    }

    /// Returns the transmittance at a point for shadow rays, 0 to 1. Light passes where the surface
    /// is absent by alpha or transmissive.
    pub fn shadow_transmittance_at(&self, context: &ShadingContext<'_, R>) -> R {
        let through = self.transmission.as_ref().map_or(R::ZERO, |transmission| {
            tinted_shadow_transmittance(
                self.base_colour_at(context),
                transmission.transmissive_share_at(context),
            )
        });
        R::ONE - self.alpha_at(context) * (R::ONE - through)
    }

    /// Returns the coverage (alpha) at a point, 0 to 1. An alpha mask gives only 0 or 1.
    pub fn alpha_at(&self, context: &ShadingContext<'_, R>) -> R {
        let alpha = || {
            let alpha = self.opacity.eval_number(context);
            if self.vertex_colours {
                alpha * context.interaction.colour[3]
            } else {
                alpha
            }
        };
        match self.alpha {
            // Compared in `f32`, the precision of files: an alpha rounded to or from the cutoff
            // counts as equal to the cutoff in every precision.
            AlphaMode::Mask { cutoff } if (alpha().to_f64() as f32) < cutoff as f32 => R::ZERO,
            AlphaMode::Opaque | AlphaMode::Mask { .. } => R::ONE,
            AlphaMode::Blend => Real::clamp(alpha(), R::ZERO, R::ONE),
        }
    }
}
