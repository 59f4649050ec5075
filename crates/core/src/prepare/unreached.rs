//! Report of lights that lit nothing.

use raywright_bvh::Real;

use super::Prepared;
use crate::light::{LightId, LightUsage};

/// Least number of blocked rays for a report: for a light that one ray in twenty reaches, a hundred
/// rays are all blocked in less than one case in a hundred.
const ENOUGH: u64 = 100;

/// A light or emissive object without any contribution.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UnreachedLight {
    /// A delta light, by its index in the scene's list.
    Light {
        /// The index.
        index: usize,
        /// Number of shadow rays to it, all blocked.
        rays: u64,
    },
    /// An emissive object, by its index in the scene's list; generated objects follow the listed
    /// ones.
    Object {
        /// The index.
        index: usize,
        /// Number of shadow rays to it, all blocked.
        rays: u64,
    },
}

impl<R: Real> Prepared<R> {
    /// Lights with enough blocked rays and no contribution.
    pub(crate) fn shut_away(&self, usage: &LightUsage) -> Vec<UnreachedLight> {
        let in_vain = |light| usage.in_vain(light).map(u64::from);
        let lights = (0..self.lights.delta.len()).filter_map(|index| {
            let rays = in_vain(LightId::Delta(index as u32))?;
            Some(UnreachedLight::Light { index, rays })
        });
        // Some triangles of a mesh may be hidden; a mesh is reported only if all are.
        let objects = self
            .lights
            .emitters
            .objects()
            .filter_map(|(index, emitters)| {
                let rays: Option<u64> = emitters
                    .map(|emitter| in_vain(LightId::Emitter(emitter)))
                    .sum();
                Some(UnreachedLight::Object { index, rays: rays? })
            });
        let sure = |unreached_light: &UnreachedLight| matches!(unreached_light, UnreachedLight::Light { rays, .. } | UnreachedLight::Object { rays, .. } if *rays >= ENOUGH);
        lights.chain(objects).filter(sure).collect()
    }
}
