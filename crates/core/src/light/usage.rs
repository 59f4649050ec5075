//! Usage of lights: numbers of shadow rays that found no light. A light enclosed on all sides is
//! missing in the picture and in the picture's error estimate; only these counts reveal it. A lamp
//! in a closed box is reported even if its enclosure is intended.

use raywright_bvh::Real;

use super::{LightId, Lights};

/// Marks a light that has reached a surface, in place of its number of blocked rays.
const LIT: u32 = u32::MAX;

/// Usage of lights: for each delta light and emitter the number of blocked shadow rays, until the
/// light first reaches a surface.
///
/// Each worker of a render has its own counts, and a film adds them. Shared counters would move
/// between the workers' caches at every shadow ray. The counts affect no pixel. Their sum does not
/// depend on the order of rays.
#[derive(Clone, Debug, Default)]
pub(crate) struct LightUsage {
    deltas: usize,
    blocked: Vec<u32>,
}

impl LightUsage {
    /// Creates zero counts for all delta lights and emitters.
    pub fn new<R: Real>(lights: &Lights<R>) -> Self {
        let (deltas, emitters) = (lights.delta.len(), lights.emitters.len());
        Self {
            deltas,
            blocked: vec![0; deltas + emitters],
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
        let Some(stopped) = self
            .counter_index(light)
            .and_then(|index| self.blocked.get_mut(index))
        else {
            return;
        };
        *stopped = add_blocked_rays(*stopped, if arrived { LIT } else { 1 });
    }

    /// Adds another worker's counts of the same lights.
    pub fn add_worker_counts(&mut self, other: &Self) {
        if self.blocked.is_empty() {
            self.clone_from(other);
            return;
        }
        self.blocked
            .iter_mut()
            .zip(&other.blocked)
            .for_each(|(own, &other)| *own = add_blocked_rays(*own, other));
    }

    /// Returns the number of blocked shadow rays to a light; `None` once light arrived.
    pub fn blocked_rays(&self, light: LightId) -> Option<u32> {
        self.blocked
            .get(self.counter_index(light)?)
            .copied()
            .filter(|&stopped| stopped != LIT)
    }

    /// Estimates the bytes of all counts for a number of lights: a table for each worker of the
    /// current thread pool, and a table of their sum.
    pub fn estimate_bytes(lights: u64) -> u64 {
        let tables = rayon::current_num_threads() as u64 + 1;
        lights.saturating_mul(size_of::<u32>() as u64 * tables)
    }
}

/// Adds two numbers of blocked rays, saturating. The result is [`LIT`] if either argument is.
#[inline(always)]
fn add_blocked_rays(a: u32, b: u32) -> u32 {
    if a == LIT || b == LIT {
        LIT
    } else {
        a.saturating_add(b).min(LIT - 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(stopped: [u32; 2]) -> LightUsage {
        LightUsage {
            deltas: 1,
            blocked: stopped.into(),
        }
    }

    /// Protects: the counts of two workers add up in either order, also beyond the range of the
    /// counter; light that one of them saw stays seen, and the sky is not counted.
    #[test]
    fn workers_add_up() {
        let (mut usage, lamp) = (of([0, 0]), LightId::Emitter(0));
        (0..3).for_each(|_| usage.count_ray(lamp, false));
        usage.count_ray(LightId::Delta(0), true);
        usage.count_ray(LightId::Delta(0), false);
        usage.count_ray(LightId::Sky, true);
        assert_eq!(usage.blocked, [LIT, 3]);
        for (a, b, expected) in [
            ([0, 3], [5, 4], [5, 7]),
            ([LIT, 1], [2, LIT], [LIT; 2]),
            ([LIT - 1, 1], [7, 0], [LIT - 1, 1]),
        ] {
            for (first, second) in [(a, b), (b, a)] {
                let mut usage = LightUsage::default();
                usage.add_worker_counts(&of(first));
                usage.add_worker_counts(&of(second));
                assert_eq!(usage.blocked, expected);
            }
        }
        assert_eq!(
            [
                usage.blocked_rays(lamp),
                usage.blocked_rays(LightId::Delta(0)),
                usage.blocked_rays(LightId::Sky)
            ],
            [Some(3), None, None]
        );
    }
}
