//! Lights that have lit nothing, as the scene names them.

use raywright_bvh::Real;

use super::Prepared;
use crate::light::{LightId, LightUsage};

/// Fewer rays to a light that were all stopped say too little: of a light that every twentieth
/// reaches, less than one in a hundred times none does.
const ENOUGH: u64 = 100;

/// A light or a lamp of which nothing was seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShutAway {
    /// One without size, by its place in the scene's list.
    Light {
        /// Which one.
        index: usize,
        /// Rays to it, all of which were stopped.
        rays: u64,
    },
    /// An object that gives off light, by its place in the scene's list, those that the scene
    /// generates behind them.
    Object {
        /// Which one.
        index: usize,
        /// Rays to it, all of which were stopped.
        rays: u64,
    },
}

impl<R: Real> Prepared<R> {
    /// Those to which enough rays were sent in vain.
    pub(crate) fn shut_away(&self, usage: &LightUsage) -> Vec<ShutAway> {
        let in_vain = |light| usage.in_vain(light).map(u64::from);
        let lights = (0..self.lights.delta.len()).filter_map(|index| {
            let rays = in_vain(LightId::Delta(index as u32))?;
            Some(ShutAway::Light { index, rays })
        });
        // Of a mesh some triangles may well be hidden; it is shut away where all are.
        let objects = self
            .lights
            .emitters
            .objects()
            .filter_map(|(index, emitters)| {
                let rays: Option<u64> = emitters
                    .map(|emitter| in_vain(LightId::Emitter(emitter)))
                    .sum();
                Some(ShutAway::Object { index, rays: rays? })
            });
        let sure = |shut: &ShutAway| matches!(shut, ShutAway::Light { rays, .. } | ShutAway::Object { rays, .. } if *rays >= ENOUGH);
        lights.chain(objects).filter(sure).collect()
    }
}
