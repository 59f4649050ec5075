//! Which lights have lit anything: one that is shut away from every path is missing in the picture and in its error alike, so that it can
//! only be told by counting. A lamp in a closed box may be meant; that its light is nowhere is worth saying all the same.

use core::sync::atomic::{AtomicU32, Ordering::Relaxed};

use raywright_bvh::Precision;

use super::{LightId, Lights};

/// Instead of a number of rays: some light arrived.
const LIT: u32 = u32::MAX;

/// For each light without size and each emitter how many rays to it were stopped, until one arrives. Nothing that is rendered depends on it,
/// and what it says in the end not on the order in which rays were asked.
#[derive(Debug, Default)]
pub struct Reached {
    deltas: usize,
    stopped: Vec<AtomicU32>,
}

impl Clone for Reached {
    fn clone(&self) -> Self {
        let stopped = self.stopped.iter().map(|stopped| AtomicU32::new(stopped.load(Relaxed))).collect();
        Self { deltas: self.deltas, stopped }
    }
}

impl Reached {
    /// Nothing is known yet of these lights.
    pub(crate) fn new<P: Precision>(lights: &Lights<P>) -> Self {
        let (deltas, emitters) = (lights.delta.len(), lights.emitters.len());
        Self { deltas, stopped: (0..deltas + emitters).map(|_| AtomicU32::new(0)).collect() }
    }

    fn of(&self, light: LightId) -> Option<&AtomicU32> {
        match light {
            LightId::Delta(i) => self.stopped.get(i as usize),
            LightId::Emitter(i) => self.stopped.get(self.deltas + i as usize),
            LightId::Sky => None,
        }
    }

    /// Notes what became of a ray to a light, or that a path met it. Once it has lit something, this is one look at a number that no one
    /// writes to.
    #[inline(always)]
    pub(crate) fn note(&self, light: LightId, arrived: bool) {
        let Some(stopped) = self.of(light).filter(|stopped| stopped.load(Relaxed) != LIT) else { return };
        if arrived {
            stopped.store(LIT, Relaxed);
        } else {
            // Fails where another thread has just seen light, or where there are more rays than can be counted.
            let _ = stopped.fetch_update(Relaxed, Relaxed, |n| (n < LIT - 1).then_some(n + 1));
        }
    }

    /// How many rays to a light were stopped, where none arrived.
    pub(crate) fn in_vain(&self, light: LightId) -> Option<u32> {
        self.of(light).map(|stopped| stopped.load(Relaxed)).filter(|&stopped| stopped != LIT)
    }

    /// Bytes of the table for so many lights.
    pub(crate) fn bytes_of(lights: u64) -> u64 {
        lights.saturating_mul(size_of::<AtomicU32>() as u64)
    }

    /// Bytes of the table.
    pub(crate) fn bytes(&self) -> u64 {
        Self::bytes_of(self.stopped.len() as u64)
    }
}
