//! Normals that an image bends, for every integrator alike: made where an interaction is, so that none has to ask.

use raywright_bvh::{Hit, Precision, Real, Vector};

use super::Leg;
use super::surface::towards_viewer;
use crate::interaction::Interaction;
use crate::prepare::{Bump, Material, Prepared};

impl<R: Real> Interaction<R> {
    /// Bends the shading normal by the material's image. Out of line, so that surfaces without one have only the question.
    #[inline(never)]
    pub(super) fn bend<P: Precision<Real = R>>(&mut self, scene: &Prepared<P>, leg: &Leg<R>, hit: &Hit<R>) {
        let Material::Physical(material) = &scene.materials[self.material as usize] else { return };
        if let Some(bent) = material.bump.as_ref().and_then(|bump| self.bent(bump, scene, leg, hit)) {
            self.normal = bent;
        }
    }

    /// The shading normal as an image bends it; none where the image says nothing.
    pub(super) fn bent<P: Precision<Real = R>>(
        &self,
        bump: &Bump<R>,
        scene: &Prepared<P>,
        leg: &Leg<R>,
        hit: &Hit<R>,
    ) -> Option<R::Vec3> {
        let code = bump.image.colour(&scene.sources.at(self));
        let [x, y, z] = [code.x(), code.y(), code.z()].map(|c| c + c - R::ONE);
        let frame = self.frame(scene, leg, hit);
        // The image stands for a surface that rises and falls; from behind, its rises are hollows.
        let behind = self.normal.dot(self.surface.normal) < R::ZERO;
        let scale = if behind { -bump.scale } else { bump.scale };
        let bent = frame.to_world(R::Vec3::new(x * scale, y * scale, z)).normalize();
        // A texel of nothing, and the like, leave the normal as it is.
        bent.is_finite().then(|| towards_viewer::<R>(bent, self.surface.normal, self.outside, self.direction))
    }
}
