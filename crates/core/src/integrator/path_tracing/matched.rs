//! Index-matched boundaries: surfaces with the same index of refraction on both sides, which light
//! passes straight, changed by a tint alone. They take no segment of a path.

use raywright_bvh::{Real, Vector};

use super::scatter::ScatteredRay;
use super::{PathState, PathTracer};
use crate::interaction::Interaction;
use crate::prepare::{PreparedMaterial, RefractiveIndex};

impl<R: Real> PathTracer<'_, R> {
    /// Returns the tint of a surface that is only an index-matched boundary; `None` for other
    /// surfaces. Inlined tests exclude most surfaces.
    #[inline(always)]
    pub(super) fn matched(
        &self,
        path: &mut PathState<R>,
        interaction: &Interaction<R>,
    ) -> Option<R::Vec3> {
        let may_match = self.bounds_glass(interaction.material)
            && match &self.scene.materials[interaction.material as usize] {
                PreparedMaterial::Classic(m) => {
                    self.nests()
                        || m.transmission
                            .is_some_and(|transmission| transmission.glass.ior == 1.0)
                }
                PreparedMaterial::Physical(m) => {
                    self.nests()
                        || !matches!(&m.index, RefractiveIndex::Even(boundary) if boundary.ior != 1.0)
                }
                PreparedMaterial::Unused => false,
            };
        if may_match {
            self.matched_tint(path, interaction)
        } else {
            None
        }
    }

    #[inline(never)]
    fn matched_tint(
        &self,
        path: &mut PathState<R>,
        interaction: &Interaction<R>,
    ) -> Option<R::Vec3> {
        let (material, context) = (
            &self.scene.materials[interaction.material as usize],
            self.scene.texture_tables.shading_context(interaction),
        );
        if material.glows() {
            return None;
        }
        match material {
            PreparedMaterial::Classic(m) => {
                let glass = m.transmission.as_ref()?.glass;
                let ior = if self.nests() {
                    self.relative_index(path, interaction, &context)
                } else {
                    glass.ior
                };
                (ior == 1.0).then_some(glass.transmitted)
            }
            PreparedMaterial::Physical(m) if m.layered.is_none() && !m.unlit => {
                let mut model = m.model_at(&context);
                if self.nests() {
                    self.immersed(path, interaction, &context, &mut model);
                }
                let glass = model.glass.filter(|_| model.through() >= R::ONE)?;
                (glass.ior == 1.0).then_some(glass.transmitted)
            }
            PreparedMaterial::Physical(_) | PreparedMaterial::Unused => None,
        }
    }

    /// Continues a path through an index-matched boundary. Returns whether the path goes on.
    pub(super) fn pass_matched(
        &mut self,
        path: &mut PathState<R>,
        interaction: &Interaction<R>,
        tint: R::Vec3,
    ) -> bool {
        (path.hit, path.traced, path.matched) = (true, path.traced + 1, path.matched + 1);
        let ray = self
            .scene
            .spawn(interaction, interaction.direction, -R::ONE);
        let scattered_ray = ScatteredRay {
            rest: path.segment.rest,
            smooth: true,
            through: true,
            straight: false,
        };
        self.leave(
            path,
            interaction,
            (path.throughput * tint, f64::INFINITY),
            (&ray, Vector::ZERO),
            &scattered_ray,
        );
        path.throughput != Vector::ZERO && self.counts_passage(path)
    }
}
