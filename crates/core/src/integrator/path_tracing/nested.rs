//! Nested dielectrics: the effective medium of overlapping bodies, and the relative index of
//! boundaries between bodies ("Simple Nested Dielectrics in Ray Traced Images", Schmidt, Budge
//! 2002).
//!
//! The effective medium is the entered body of the greatest priority; among equals, the body
//! entered last. A boundary with the same effective medium on both sides is ignored. A liquid may
//! therefore overlap its glass; exact contact would leave gaps or a film of air.
//!
//! Only scenes with priorities use these functions. The functions are not inlined: other scenes pay
//! for a check alone.

use raywright_bvh::Real;

use super::layered::get_or_sample_wavelength;
use super::{MediumStack, PathState, PathTracer};
use crate::interaction::Interaction;
use crate::material::MetallicRoughness;
use crate::prepare::{ConstantIor, PreparedMaterial};
use crate::texture::ShadingContext;

impl<R: Real> PathTracer<'_, R> {
    /// Whether the scene's materials have priorities: boundaries are then nested dielectrics.
    #[inline(always)]
    pub(super) fn has_nested_dielectrics(&self) -> bool {
        !self.scene.priorities.is_empty()
    }

    /// Whether surfaces of a material are boundaries of a refractive body.
    pub(super) fn is_glass_boundary(&self, material: u32) -> bool {
        match &self.scene.materials[material as usize] {
            PreparedMaterial::Classic(m) => m.transmission.is_some() && m.mixture.is_none(),
            PreparedMaterial::Physical(m) => m.transmission.is_some() && !m.thin,
            PreparedMaterial::Unused => false,
        }
    }

    /// Returns the media on the near side of a boundary, from which the ray arrives, and on its far
    /// side. A body that the ray leaves counts as entered, even if no hit recorded the entry.
    fn media_on_both_sides(
        &self,
        media: &MediumStack,
        interaction: &Interaction<R>,
    ) -> [MediumStack; 2] {
        let known = interaction.outside || media.contains(interaction.material);
        let near = if known {
            *media
        } else {
            media.cross_boundary(interaction.material, true)
        };
        [
            near,
            near.cross_boundary(interaction.material, interaction.outside),
        ]
    }

    /// Returns the media beyond a hidden boundary, `None` for any other boundary. A boundary is
    /// hidden if it lies inside a body of greater priority.
    #[inline(never)]
    pub(super) fn media_behind_hidden_boundary(
        &self,
        media: &MediumStack,
        interaction: &Interaction<R>,
    ) -> Option<MediumStack> {
        if !self.is_glass_boundary(interaction.material) {
            return None;
        }
        let [near, far] = self.media_on_both_sides(media, interaction);
        (self.effective_medium(&near) == self.effective_medium(&far)).then_some(far)
    }

    /// Returns the index of refraction of a medium; 1 without a medium. For a dispersive medium,
    /// the index is that of the path's wavelength.
    fn refractive_index(
        &self,
        path: &mut PathState<R>,
        body: Option<u32>,
        context: &ShadingContext<'_, R>,
    ) -> f64 {
        match body.map(|material| &self.scene.materials[material as usize]) {
            Some(PreparedMaterial::Classic(m)) => {
                let of_glass = || {
                    m.transmission
                        .as_ref()
                        .map(|transmission| transmission.glass.ior)
                };
                m.mixture
                    .as_ref()
                    .map_or_else(of_glass, |mixture| mixture.ior)
                    .unwrap_or(1.0)
            }
            Some(PreparedMaterial::Physical(m)) => {
                let dispersion = m
                    .layers
                    .map_or(0.0, |index| self.scene.layers[index as usize].ior);
                let ior = m.dielectric_boundary_at(context).ior;
                if dispersion > 0.0 {
                    crate::material::ior_at_wavelength(
                        ior,
                        dispersion,
                        get_or_sample_wavelength::<R>(path),
                    )
                } else {
                    ior
                }
            }
            Some(PreparedMaterial::Unused) | None => 1.0,
        }
    }

    /// Returns the relative index of refraction of a surface: the index inside over the index
    /// outside.
    ///
    /// - Glass boundary: the indices of the effective media on both sides.
    /// - Other surfaces: the surface's own index inside, and the index of the effective medium
    ///   outside.
    #[inline(never)]
    pub(super) fn relative_ior(
        &self,
        path: &mut PathState<R>,
        interaction: &Interaction<R>,
        context: &ShadingContext<'_, R>,
    ) -> f64 {
        if !self.is_glass_boundary(interaction.material) {
            let around = self.effective_medium(&path.media);
            let [own, around] = [Some(interaction.material), around]
                .map(|body| self.refractive_index(path, body, context));
            // A medium without an index counts as air.
            return if around > 0.0 { own / around } else { own };
        }
        let [near, far] = self
            .media_on_both_sides(&path.media, interaction)
            .map(|media| self.effective_medium(&media));
        let [near, far] = [near, far].map(|body| self.refractive_index(path, body, context));
        if interaction.outside {
            far / near
        } else {
            near / far
        }
    }

    /// Sets the reflectance at normal incidence and the glass's index of refraction in `model`,
    /// relative to the surrounding medium. For a physical surface without layers.
    #[inline(never)]
    pub(super) fn set_relative_ior(
        &self,
        path: &mut PathState<R>,
        interaction: &Interaction<R>,
        context: &ShadingContext<'_, R>,
        model: &mut MetallicRoughness<R>,
    ) {
        let boundary = ConstantIor::<R>::new(self.relative_ior(path, interaction, context));
        model.dielectric = boundary.f0 * model.grazing;
        if let Some(glass) = &mut model.glass {
            glass.ior = boundary.ior;
        }
    }
}
