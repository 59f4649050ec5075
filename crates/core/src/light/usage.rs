//! Usage of lights: numbers of shadow rays that found light, and that found none. A light enclosed on all sides is
//! missing in the picture and in the picture's error estimate; only these counts reveal it. A lamp
//! in a closed box is reported even if its enclosure is intended.

use raywright_bvh::Real;

use super::{LightId, Lights};

/// Usage of lights: for each delta light and emitter the numbers of blocked shadow rays and of rays
/// by which light arrived.
///
/// Each worker of a render has its own counts, and a film adds them. Shared counters would move
/// between the workers' caches at every shadow ray. The counts affect no pixel. Their sum does not
/// depend on the order of rays.
#[derive(Clone, Debug, Default)]
pub(crate) struct LightUsage {
    deltas: usize,
    rays: Vec<[u32; 2]>,
}

impl LightUsage {
    /// Creates zero counts for all delta lights and emitters.
    pub fn new<R: Real>(lights: &Lights<R>) -> Self {
        let (deltas, emitters) = (lights.delta.len(), lights.emitters.len());
        Self {
            deltas,
            rays: vec![[0; 2]; deltas + emitters],
        }
    }

    fn counter_index(&self, light: LightId) -> Option<usize> {
        match light {
            LightId::Delta(i) => Some(i as usize),
            LightId::Emitter(i) => Some(self.deltas + i as usize),
            LightId::Sky => None,
        }
    }

    /// Counts a shadow ray to a light, or a path that hit the light. `arrived`: whether any light
    /// arrived.
    #[inline(always)]
    pub fn count_ray(&mut self, light: LightId, arrived: bool) {
        let index = self.counter_index(light);
        if let Some(rays) = index.and_then(|index| self.rays.get_mut(index)) {
            let count = &mut rays[usize::from(arrived)];
            *count = count.saturating_add(1);
        }
    }

    /// Adds another worker's counts of the same lights.
    pub fn add_worker_counts(&mut self, other: &Self) {
        if self.rays.is_empty() {
            self.clone_from(other);
            return;
        }
        let counts = self.rays.as_flattened_mut().iter_mut();
        counts
            .zip(other.rays.as_flattened())
            .for_each(|(own, &other)| *own = own.saturating_add(other));
    }

    /// Returns the numbers of rays to a light: of those that were blocked, and of those by which
    /// light arrived.
    pub fn ray_counts(&self, light: LightId) -> [u64; 2] {
        let index = self.counter_index(light);
        let rays = index.and_then(|index| self.rays.get(index));
        rays.copied().unwrap_or_default().map(u64::from)
    }

    /// Estimates the bytes of all counts for a number of lights: a table for each worker of the
    /// current thread pool, and a table of their sum.
    pub fn estimate_bytes(lights: u64) -> u64 {
        let tables = rayon::current_num_threads() as u64 + 1;
        lights.saturating_mul(size_of::<[u32; 2]>() as u64 * tables)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(delta: [u32; 2], lamp: [u32; 2]) -> LightUsage {
        LightUsage {
            deltas: 1,
            rays: vec![delta, lamp],
        }
    }

    /// Protects: the counts of two workers add up in either order, also beyond the range of the
    /// counter, and the sky is not counted.
    #[test]
    fn workers_add_up() {
        let (mut usage, lamp) = (of([0; 2], [0; 2]), LightId::Emitter(0));
        (0..3).for_each(|_| usage.count_ray(lamp, false));
        usage.count_ray(LightId::Delta(0), true);
        usage.count_ray(LightId::Delta(0), false);
        usage.count_ray(LightId::Sky, true);
        assert_eq!(usage.rays, [[1, 1], [3, 0]]);
        let (most, few) = (of([u32::MAX - 1, 2], [3, 0]), of([7, 5], [4, 1]));
        for (first, second) in [(&most, &few), (&few, &most)] {
            let mut usage = LightUsage::default();
            usage.add_worker_counts(first);
            usage.add_worker_counts(second);
            assert_eq!(usage.rays, [[u32::MAX, 7], [7, 1]]);
        }
        let counts = [lamp, LightId::Sky].map(|light| usage.ray_counts(light));
        assert_eq!(counts, [[3, 0], [0; 2]]);
    }
}
