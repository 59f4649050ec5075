//! Normal maps. A normal map is applied when an interaction is created: integrators need no code
//! for normal maps.

use raywright_bvh::{Hit, Real, Vector};

use super::PathSegment;
use crate::interaction::Interaction;
use crate::material::NormalMap;
use crate::prepare::{PreparedMaterial, PreparedScene};
use crate::texture::NormalMapInput;

impl<R: Real> Interaction<R> {
    /// Perturbs the shading normal by the material's normal map. Not inlined: surfaces without a
    /// normal map cost a check alone.
    #[inline(never)]
    pub(super) fn perturb_normal(
        &mut self,
        scene: &PreparedScene<R>,
        segment: &PathSegment<R>,
        hit: &Hit<R>,
    ) {
        let PreparedMaterial::Physical(material) = &scene.materials[self.material as usize] else {
            return;
        };
        if let Some(bump) = &material.normal_map {
            self.normal = self
                .eval_normal_map(bump, scene, segment, hit)
                .perturbed_normal();
        }
    }

    /// Returns the value of a normal map at an interaction, with the tangent frame for its
    /// components.
    #[inline(always)]
    pub(super) fn eval_normal_map(
        &self,
        bump: &NormalMapInput<R>,
        scene: &PreparedScene<R>,
        segment: &PathSegment<R>,
        hit: &Hit<R>,
    ) -> NormalMap<R> {
        let code = bump
            .image
            .eval_colour(&scene.texture_tables.shading_context(self));
        let [x, y, z] = [code.x(), code.y(), code.z()].map(|c| c + c - R::ONE);
        // The image describes the relief of the front; from behind, hills become valleys.
        let behind = self.normal.dot(self.surface.normal) < R::ZERO;
        let scale = if behind { -bump.scale } else { bump.scale };
        let (along, mirrored) = self.tangent_direction(scene, segment, hit);
        NormalMap {
            normal: self.normal,
            along,
            mirrored,
            code: R::Vec3::new(x * scale, y * scale, z),
            geometric: self.surface.normal,
            outside: self.outside,
            direction: self.direction,
        }
    }
}
