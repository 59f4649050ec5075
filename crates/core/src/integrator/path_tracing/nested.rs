//! Bodies that overlap: which of them a point is in, and what a boundary between two of them bends
//! ("Simple Nested Dielectrics in Ray Traced Images", Schmidt, Budge 2002). A point is in the body
//! of the greatest priority that it was entered, of equal ones in the last; a boundary on whose two
//! sides that is the same body is none. So liquid may reach into its glass, where exact contact
//! would leave gaps or a film of air.
//!
//! Asked only where the table of priorities is not empty; out of line, so that other scenes have
//! one question more.

use raywright_bvh::Real;

use super::layered::wavelength;
use super::{Media, PathState, PathTracer};
use crate::interaction::Interaction;
use crate::material::MetallicRoughness;
use crate::prepare::{Boundary, Material};
use crate::texture::ShadingContext;

impl<R: Real> PathTracer<'_, R> {
    /// Whether bodies are told apart by priority.
    #[inline(always)]
    pub(super) fn nests(&self) -> bool {
        !self.scene.priorities.is_empty()
    }

    /// Whether a material bounds a body that light enters by bending.
    pub(super) fn bounds_glass(&self, material: u32) -> bool {
        match &self.scene.materials[material as usize] {
            Material::Classic(m) => m.transmission.is_some() && m.mixture.is_none(),
            Material::Physical(m) => m.transmission.is_some() && !m.thin,
            Material::Unused => false,
        }
    }

    /// The bodies on the near and on the far side of a boundary. One that is left was entered, also
    /// where that was not seen.
    fn sides(&self, media: &Media, at: &Interaction<R>) -> [Media; 2] {
        let known = at.outside || media.has(at.material);
        let near = if known {
            *media
        } else {
            media.beyond(at.material, true)
        };
        [near, near.beyond(at.material, at.outside)]
    }

    /// The bodies beyond a boundary that is none, because a body of a greater priority is on both
    /// sides of it.
    #[inline(never)]
    pub(super) fn hidden(&self, media: &Media, at: &Interaction<R>) -> Option<Media> {
        if !self.bounds_glass(at.material) {
            return None;
        }
        let [near, far] = self.sides(media, at);
        (self.around(&near) == self.around(&far)).then_some(far)
    }

    /// Index of refraction of a body, for the path's wavelength where it bends them apart.
    fn index_of(
        &self,
        path: &mut PathState<R>,
        body: Option<u32>,
        here: &ShadingContext<'_, R>,
    ) -> f64 {
        match body.map(|material| &self.scene.materials[material as usize]) {
            Some(Material::Classic(m)) => {
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
            Some(Material::Physical(m)) => {
                let dispersion = m
                    .layered
                    .map_or(0.0, |place| self.scene.layers[place as usize].ior);
                let ior = m.boundary_at(here).ior;
                if dispersion > 0.0 {
                    crate::material::index_at(ior, dispersion, wavelength::<R>(path))
                } else {
                    ior
                }
            }
            Some(Material::Unused) | None => 1.0,
        }
    }

    /// Index of a surface's inside over that of its outside, where either may be a body: of glass
    /// by what light is in on both sides, of all else over the body that it is in.
    #[inline(never)]
    pub(super) fn relative_index(
        &self,
        path: &mut PathState<R>,
        at: &Interaction<R>,
        here: &ShadingContext<'_, R>,
    ) -> f64 {
        if !self.bounds_glass(at.material) {
            let around = self.around(&path.media);
            let [own, around] =
                [Some(at.material), around].map(|body| self.index_of(path, body, here));
            // In what reflects all and has no index, as in air.
            return if around > 0.0 { own / around } else { own };
        }
        let [near, far] = self.sides(&path.media, at).map(|media| self.around(&media));
        let [near, far] = [near, far].map(|body| self.index_of(path, body, here));
        if at.outside { far / near } else { near / far }
    }

    /// A plain physical surface where it is: in what light is in.
    #[inline(never)]
    pub(super) fn immersed(
        &self,
        path: &mut PathState<R>,
        at: &Interaction<R>,
        here: &ShadingContext<'_, R>,
        model: &mut MetallicRoughness<R>,
    ) {
        let boundary = Boundary::<R>::new(self.relative_index(path, at, here));
        model.dielectric = boundary.f0 * model.grazing;
        if let Some(glass) = &mut model.glass {
            glass.ior = boundary.ior;
        }
    }
}
