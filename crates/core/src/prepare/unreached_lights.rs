//! Detection of lights that contributed nothing to a picture.

use raywright_bvh::Real;

use super::PreparedScene;
use crate::light::{LightId, LightUsage};

/// Least number of blocked shadow rays for which a light is reported. If one ray in twenty reached
/// the light, all of a hundred rays would be blocked with a probability below 1 %.
const MIN_BLOCKED_RAYS: u64 = 100;

/// A light or an emissive object that contributed nothing to a picture: all its shadow rays were
/// blocked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UnreachedLight {
    /// A delta light, by its index in the scene's list of lights.
    Light {
        /// Index in the list.
        index: usize,
        /// Number of shadow rays, all of which were blocked.
        rays: u64,
    },
    /// An emissive object, by its index in the scene's list of objects; generated objects follow
    /// the listed objects.
    Object {
        /// Index in the list.
        index: usize,
        /// Number of shadow rays, all of which were blocked.
        rays: u64,
    },
}

impl<R: Real> PreparedScene<R> {
    /// Returns the lights that contributed nothing although at least [`MIN_BLOCKED_RAYS`] shadow
    /// rays were traced to them. All these rays were blocked.
    pub(crate) fn find_unreached_lights(&self, usage: &LightUsage) -> Vec<UnreachedLight> {
        let in_vain = |light| usage.blocked_rays(light).map(u64::from);
        let lights = (0..self.lights.delta.len()).filter_map(|index| {
            let rays = in_vain(LightId::Delta(index as u32))?;
            Some(UnreachedLight::Light { index, rays })
        });
        // A mesh is reported only if all its triangles are unreached.
        let objects = self
            .lights
            .emitters
            .emitters_by_object()
            .filter_map(|(index, emitters)| {
                let rays: Option<u64> = emitters
                    .map(|emitter| in_vain(LightId::Emitter(emitter)))
                    .sum();
                Some(UnreachedLight::Object { index, rays: rays? })
            });
        let sure = |unreached_light: &UnreachedLight| matches!(unreached_light, UnreachedLight::Light { rays, .. } | UnreachedLight::Object { rays, .. } if *rays >= MIN_BLOCKED_RAYS);
        lights.chain(objects).filter(sure).collect()
    }
}
