//! Index-matched boundaries: surfaces with the same index of refraction on both sides. Light passes
//! them straight and is only tinted. They do not count as segments of a path.

use raywright_bvh::{Real, Vector};

use super::scatter::ScatteredRay;
use super::{PathState, PathTracer};
use crate::interaction::Interaction;
use crate::prepare::{PreparedMaterial, RefractiveIndex};

impl<R: Real> PathTracer<'_, R> {
    /// Returns the tint of an index-matched boundary; `None` for any other surface. The inlined
    /// checks exclude most surfaces.
    #[inline(always)]
    pub(super) fn index_matched_tint(
        &self,
        path: &mut PathState<R>,
        interaction: &Interaction<R>,
    ) -> Option<R::Vec3> {
        let may_match = self.is_glass_boundary(interaction.material)
            && match &self.scene.materials[interaction.material as usize] {
                PreparedMaterial::Classic(m) => {
                    self.has_nested_dielectrics()
                        || m.transmission
                            .is_some_and(|transmission| transmission.glass.ior == 1.0)
                }
                PreparedMaterial::Physical(m) => {
                    self.has_nested_dielectrics()
                        || !matches!(&m.index, RefractiveIndex::Constant(boundary) if boundary.ior != 1.0)
                }
                PreparedMaterial::Unused => false,
            };
        if may_match {
            self.compute_index_matched_tint(path, interaction)
        } else {
            None
        }
    }

    #[inline(never)]
    fn compute_index_matched_tint(
        &self,
        path: &mut PathState<R>,
        interaction: &Interaction<R>,
    ) -> Option<R::Vec3> {
        let (material, context) = (
            &self.scene.materials[interaction.material as usize],
            self.scene.texture_tables.shading_context(interaction),
        );
        if material.emits() {
            return None;
        }
        match material {
            PreparedMaterial::Classic(m) => {
                let glass = m.transmission.as_ref()?.glass;
                let ior = if self.has_nested_dielectrics() {
                    self.relative_ior(path, interaction, &context)
                } else {
                    glass.ior
                };
                (ior == 1.0).then_some(glass.transmitted)
            }
            PreparedMaterial::Physical(m) if m.layers.is_none() && !m.unlit => {
                let mut model = m.metallic_roughness_at(&context);
                if self.has_nested_dielectrics() {
                    self.set_relative_ior(path, interaction, &context, &mut model);
                }
                let glass = model.glass.filter(|_| model.glass_share() >= R::ONE)?;
                (glass.ior == 1.0).then_some(glass.transmitted)
            }
            PreparedMaterial::Physical(_) | PreparedMaterial::Unused => None,
        }
    }

    /// Continues a path straight through an index-matched boundary. Returns whether the path goes
    /// on.
    pub(super) fn pass_index_matched_boundary(
        &mut self,
        path: &mut PathState<R>,
        interaction: &Interaction<R>,
        tint: R::Vec3,
    ) -> bool {
        (path.has_hit, path.segments_traced, path.matched_segments) =
            (true, path.segments_traced + 1, path.matched_segments + 1);
        let ray = self.scene.spawn_straight_ray(interaction);
        let scattered_ray = ScatteredRay {
            direction_error: path.segment.direction_error,
            is_delta: true,
            is_transmitted: true,
            is_straight: false,
        };
        if self.scene.tracks_media {
            path.media = self.media_beyond_surface(&path.media, interaction);
        }
        self.start_segment(
            path,
            interaction.surface.point,
            (path.throughput * tint, f64::INFINITY),
            (&ray, Vector::ZERO),
            &scattered_ray,
        );
        path.throughput != Vector::ZERO && self.count_passed_surface(path)
    }
}
