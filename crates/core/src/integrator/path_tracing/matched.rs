//! Index-matched boundaries, which light passes unchanged but for a tint: they take no segment of a
//! path.

use raywright_bvh::{Real, Vector};

use super::scatter::Onward;
use super::{PathState, PathTracer};
use crate::interaction::Interaction;
use crate::prepare::{Index, Material};

impl<R: Real> PathTracer<'_, R> {
    /// The tint of a surface that is an index-matched boundary and nothing else.
    #[inline(always)]
    pub(super) fn matched(&self, path: &mut PathState<R>, at: &Interaction<R>) -> Option<R::Vec3> {
        let may_match = self.bounds_glass(at.material)
            && match &self.scene.materials[at.material as usize] {
                Material::Classic(m) => {
                    self.nests()
                        || m.transmission
                            .is_some_and(|transmission| transmission.glass.ior == 1.0)
                }
                Material::Physical(m) => {
                    self.nests()
                        || !matches!(&m.index, Index::Even(boundary) if boundary.ior != 1.0)
                }
                Material::Unused => false,
            };
        if may_match {
            self.matched_tint(path, at)
        } else {
            None
        }
    }

    #[inline(never)]
    fn matched_tint(&self, path: &mut PathState<R>, at: &Interaction<R>) -> Option<R::Vec3> {
        let (material, here) = (
            &self.scene.materials[at.material as usize],
            self.scene.sources.at(at),
        );
        if material.glows() {
            return None;
        }
        match material {
            Material::Classic(m) => {
                let glass = m.transmission.as_ref()?.glass;
                let ior = if self.nests() {
                    self.relative_index(path, at, &here)
                } else {
                    glass.ior
                };
                (ior == 1.0).then_some(glass.transmitted)
            }
            Material::Physical(m) if m.layered.is_none() && !m.unlit => {
                let mut model = m.model_at(&here);
                if self.nests() {
                    self.immersed(path, at, &here, &mut model);
                }
                let glass = model.glass.filter(|_| model.through() >= R::ONE)?;
                (glass.ior == 1.0).then_some(glass.transmitted)
            }
            Material::Physical(_) | Material::Unused => None,
        }
    }

    /// Continues a path through an index-matched boundary. Returns whether the path goes on.
    pub(super) fn pass_matched(
        &mut self,
        path: &mut PathState<R>,
        at: &Interaction<R>,
        tint: R::Vec3,
    ) -> bool {
        (path.hit, path.traced, path.matched) = (true, path.traced + 1, path.matched + 1);
        let ray = self.scene.spawn(at, at.direction, -R::ONE);
        let onward = Onward {
            rest: path.leg.rest,
            smooth: true,
            through: true,
            straight: false,
        };
        self.leave(
            path,
            at,
            (path.throughput * tint, f64::INFINITY),
            (&ray, Vector::ZERO),
            &onward,
        );
        path.throughput != Vector::ZERO && self.counts_passage(path)
    }
}
