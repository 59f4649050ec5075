//! BSDFs: short lists of [lobes](Lobe) on the stack, which can be evaluated, sampled and weighted.
//!
//! Directions are unit and point away from the surface. The normal is on the side of `wo`, the
//! direction to the viewer. The code is generic over a [`Number`](crate::number::Number): `f32` and
//! `f64` for a single path, [`Lanes`](crate::number::Lanes) for several paths side by side. All
//! lanes have the same number and kinds of lobes, because paths are sorted by the material of their
//! hit. All other values differ by lane. Refraction is computed lane by lane, because it needs
//! `f64`.
//!
//! ```
//! use glam::DVec3;
//! use raywright_core::material::MetallicRoughness;
//!
//! let base = DVec3::new(0.8, 0.2, 0.1);
//! let paint = MetallicRoughness::<f64> { base, metallic: 0.0, roughness: 0.5, dielectric: 0.04, grazing: 1.0, glass: None };
//! let (wo, wi) = (DVec3::Y, DVec3::new(0.6, 0.8, 0.0));
//! let bsdf = paint.local_bsdf(DVec3::Y, wo);
//! assert!(bsdf.eval(wo, wi).x > bsdf.eval(wo, wi).y && bsdf.pdf(wo, wi) > 0.0);
//! ```

use std::sync::LazyLock;

mod albedo;
mod bsdf;
mod dielectric;
mod diffuse_base;
mod energy;
mod fresnel;
mod ggx;
mod glass_layer;
mod lambert;
mod layer_fields;
mod layer_lobes;
mod layered_diffuse;
mod layered_surface;
mod lobe;
mod lobe_traits;
mod metallic_roughness;
mod microfacet_reflectance;
mod multiple_scattering;
mod normal_map;
mod rough_boundary_tables;
mod shading_frame;
mod sheen;
mod spectrum;
#[cfg(test)]
mod tests;
mod thin_film;

pub use bsdf::{Bsdf, BsdfSample, MOST_LOBES};
pub use dielectric::Dielectric;
pub(crate) use fresnel::SmoothInterface;
pub use fresnel::{
    FresnelRule, environment_reflectance, fresnel_conductor, fresnel_dielectric, schlick,
    schlick_weight,
};
pub(crate) use ggx::Ggx;
pub use lambert::Lambert;
pub use layer_fields::{LayerFieldEvaluator, LayerFieldTypes};
pub use layer_lobes::*;
pub use layered_surface::*;
pub use lobe::Lobe;
pub(crate) use lobe_traits::sample_cosine_hemisphere;
pub use lobe_traits::{BsdfLobe, Directions, ScatteringLobe};
pub use metallic_roughness::{Glass, MetallicRoughness};
pub use multiple_scattering::MultipleScattering;
pub use normal_map::{NormalMap, ensure_reflection_above, reflects_above};
pub use shading_frame::ShadingFrame;
pub use sheen::Sheen;
pub(crate) use spectrum::{HeroWavelength, ior_at_wavelength};
pub use thin_film::ThinFilm;

/// The lazily computed tables that a scene's materials need. The content of a table does not depend
/// on the scene.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct MaterialTables {
    /// Whether the directional albedos of sheen are needed.
    pub sheen: bool,
    /// Whether the interference of thin films is needed.
    pub films: bool,
    /// Whether the wavelengths of dispersion are needed.
    pub wavelengths: bool,
}

impl MaterialTables {
    /// Computes the needed tables that do not exist yet. Preparation calls this method: rendering
    /// times then exclude the tables.
    pub(crate) fn compute_tables(&self) {
        if self.sheen {
            LazyLock::force(&sheen::ALBEDO);
        }
        if self.films {
            LazyLock::force(&spectrum::COHERENCE);
        }
        if self.wavelengths {
            LazyLock::force(&spectrum::CUMULATIVE_PROBABILITY);
        }
    }
}
