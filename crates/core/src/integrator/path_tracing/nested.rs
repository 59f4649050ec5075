//! Nested dielectrics: the effective medium of overlapping bodies, and the relative index of
//! boundaries between bodies ("Simple Nested Dielectrics in Ray Traced Images", Schmidt, Budge
//! 2002). The effective medium is the entered body of the greatest priority, and of equal bodies
//! the one entered last; a boundary with the same effective medium on both sides is ignored. So a
//! liquid may reach into its glass, where exact contact would leave gaps or a film of air.
//!
//! Used only if the table of priorities is not empty. Functions are not inlined, so that other
//! scenes pay for a check alone.

use raywright_bvh::Real;

use super::layered::wavelength;
use super::{Media, PathState, PathTracer};
use crate::interaction::Interaction;
use crate::material::MetallicRoughness;
use crate::prepare::{DielectricBoundary, PreparedMaterial};
use crate::texture::ShadingContext;

impl<R: Real> PathTracer<'_, R> {
    /// Whether the scene's media have priorities, so that their boundaries are nested dielectrics.
    #[inline(always)]
    pub(super) fn nests(&self) -> bool {
        !self.scene.priorities.is_empty()
    }

    /// Whether surfaces of a material are boundaries of a refractive body.
    pub(super) fn bounds_glass(&self, material: u32) -> bool {
        match &self.scene.materials[material as usize] {
            PreparedMaterial::Classic(m) => m.transmission.is_some() && m.mixture.is_none(),
            PreparedMaterial::Physical(m) => m.transmission.is_some() && !m.thin,
            PreparedMaterial::Unused => false,
        }
    }

    /// Returns the media on the ray's side of a boundary and on the far side. A body that the ray
    /// leaves counts as entered, even if no hit recorded the entry.
    fn sides(&self, media: &Media, interaction: &Interaction<R>) -> [Media; 2] {
        let known = interaction.outside || media.has(interaction.material);
        let near = if known {
            *media
        } else {
            media.beyond(interaction.material, true)
        };
        [near, near.beyond(interaction.material, interaction.outside)]
    }

    /// Returns the media beyond a boundary that a body of greater priority on both sides hides;
    /// `None` for a boundary that is not hidden.
    #[inline(never)]
    pub(super) fn hidden(&self, media: &Media, interaction: &Interaction<R>) -> Option<Media> {
        if !self.bounds_glass(interaction.material) {
            return None;
        }
        let [near, far] = self.sides(media, interaction);
        (self.around(&near) == self.around(&far)).then_some(far)
    }

    /// Returns the index of refraction of a medium, at the path's wavelength if the medium is
    /// dispersive; 1 without a medium.
    fn index_of(
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
                    .layered
                    .map_or(0.0, |index| self.scene.layers[index as usize].ior);
                let ior = m.boundary_at(context).ior;
                if dispersion > 0.0 {
                    crate::material::index_at(ior, dispersion, wavelength::<R>(path))
                } else {
                    ior
                }
            }
            Some(PreparedMaterial::Unused) | None => 1.0,
        }
    }

    /// Returns the index of refraction inside a surface over the index outside, where both sides
    /// may be media. For glass: by the effective media of both sides; for other surfaces: over the
    /// index of the medium around.
    #[inline(never)]
    pub(super) fn relative_index(
        &self,
        path: &mut PathState<R>,
        interaction: &Interaction<R>,
        context: &ShadingContext<'_, R>,
    ) -> f64 {
        if !self.bounds_glass(interaction.material) {
            let around = self.around(&path.media);
            let [own, around] =
                [Some(interaction.material), around].map(|body| self.index_of(path, body, context));
            // A medium without an index counts as air.
            return if around > 0.0 { own / around } else { own };
        }
        let [near, far] = self
            .sides(&path.media, interaction)
            .map(|media| self.around(&media));
        let [near, far] = [near, far].map(|body| self.index_of(path, body, context));
        if interaction.outside {
            far / near
        } else {
            near / far
        }
    }

    /// Adapts the reflectance and the glass of a physical surface without layers to the medium
    /// around it.
    #[inline(never)]
    pub(super) fn immersed(
        &self,
        path: &mut PathState<R>,
        interaction: &Interaction<R>,
        context: &ShadingContext<'_, R>,
        model: &mut MetallicRoughness<R>,
    ) {
        let boundary =
            DielectricBoundary::<R>::new(self.relative_index(path, interaction, context));
        model.dielectric = boundary.f0 * model.grazing;
        if let Some(glass) = &mut model.glass {
            glass.ior = boundary.ior;
        }
    }
}
