//! Detection of lights that contributed nothing to a picture.

use raywright_bvh::Real;

use super::{LampRef, PreparedScene};
use crate::light::{LightId, LightUsage};

/// Least number of blocked shadow rays for which a light counts as unreached. If one ray in twenty
/// reached the light, all of a hundred rays would be blocked with a probability below 1 %.
const MIN_BLOCKED_RAYS: u64 = 100;

/// Shadow rays to a light or an emissive object in a picture, with the paths that hit it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LightRays {
    /// The light or the object.
    pub lamp: LampRef,
    /// Number of rays that were blocked.
    pub blocked: u64,
    /// Number of rays by which light arrived.
    pub arrived: u64,
}

impl LightRays {
    /// Returns whether the light contributed nothing, although at least a hundred shadow rays were
    /// traced to it.
    pub fn is_unreached(&self) -> bool {
        self.arrived == 0 && self.blocked >= MIN_BLOCKED_RAYS
    }
}

impl<R: Real> PreparedScene<R> {
    /// Returns the numbers of rays to all delta lights and emissive objects. The rays to a mesh are
    /// those to all its triangles.
    pub(crate) fn light_rays(&self, usage: &LightUsage) -> Vec<LightRays> {
        let rays = |lamp, [blocked, arrived]: [u64; 2]| LightRays {
            lamp,
            blocked,
            arrived,
        };
        let lights = (0..self.lights.delta.len()).map(|index| {
            let counts = usage.ray_counts(LightId::Delta(index as u32));
            rays(LampRef::Light(index), counts)
        });
        let objects = self.lights.emitters.emitters_by_object();
        let objects = objects.map(|(object, emitters)| {
            let counts = emitters.map(|emitter| usage.ray_counts(LightId::Emitter(emitter)));
            let sum = counts.fold([0; 2], |[a, b], [c, d]| [a + c, b + d]);
            rays(LampRef::Object(object), sum)
        });
        lights.chain(objects).collect()
    }
}
