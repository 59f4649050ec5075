//! Which code walks the tree: chosen once from what the processor has, the same for every ray.

use super::Bvh8;
use super::optimisation_barrier::opaque;
use super::packet::{PacketResult, PacketState, PacketVisitor};
use super::traversal_ray::{LeafRay, TraversalRay};
use super::traverse::HitVisitor;
use crate::aabb::BoundingSphere;
use crate::instance::RoughInverse;
use crate::math::simd::{Avx2, Avx512, Portable};
use crate::ray::{Interval, Ray};
use crate::scalar::{Real, Vector};
use crate::shapes::PreparedRay;

/// Code that walks the tree of `robust`. Hits do not depend on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Kernel {
    /// For every processor.
    Portable,
    /// With AVX2 and FMA.
    Avx2,
    /// With AVX-512 at 256 bits.
    Avx512,
}

impl Kernel {
    /// Those that this processor can run, slowest first.
    pub fn available() -> Vec<Self> {
        let all = [Self::Portable, Self::Avx2, Self::Avx512];
        all.into_iter().filter(|&kernel| Chosen::new(kernel).is_some()).collect()
    }
}

/// A kernel that this processor can run.
#[derive(Clone, Copy, Debug)]
pub(super) enum Chosen {
    Portable(Portable),
    Avx2(Avx2),
    Avx512(Avx512),
}

impl Chosen {
    pub fn new(kernel: Kernel) -> Option<Self> {
        match kernel {
            Kernel::Portable => Some(Self::Portable(Portable)),
            Kernel::Avx2 => Avx2::detect().map(Self::Avx2),
            Kernel::Avx512 => Avx512::detect().map(Self::Avx512),
        }
    }
}

/// The fastest that this processor can run.
impl Default for Chosen {
    fn default() -> Self {
        [Kernel::Avx512, Kernel::Avx2].into_iter().find_map(Self::new).unwrap_or(Self::Portable(Portable))
    }
}

/// A call of an entry for the instructions that a kernel has.
macro_rules! with {
    ($kernel:expr, $token:ident => $call:expr) => {
        match $kernel {
            Chosen::Portable($token) => $call,
            Chosen::Avx2($token) => $call,
            Chosen::Avx512($token) => $call,
        }
    };
}

impl Bvh8 {
    /// Shows `answer` what the ray meets. Whether it ended the traversal.
    #[inline(always)]
    pub(crate) fn visit<R: Real, A: HitVisitor>(&self, ray: &Ray<R>, range: Interval<R>, answer: &mut A) -> bool {
        // One by one, and on in registers: a load of two numbers would wait for both stores of whoever has just made the ray.
        let one = |axis: usize| (opaque(ray.origin.axis(axis).to_f32()), opaque(ray.direction.axis(axis).to_f32()));
        let ([(ox, dx), (oy, dy), (oz, dz)], near) = ([one(0), one(1), one(2)], range.min.to_f32());
        if self.always > 0 && with!(self.kernel, s => s.rows(self, ox, oy, oz, dx, dy, dz, answer)) {
            return true;
        }
        if self.nodes.is_empty() {
            if self.blocks.is_empty() && self.others.is_empty() {
                return false;
            }
            return self.visit_flat(&TraversalRay::new([ox, oy, oz], [dx, dy, dz], near).aim, answer);
        }
        with!(self.kernel, s => s.walk(self, ox, oy, oz, dx, dy, dz, near, answer))
    }

    /// The same of blocks and of the rest, one after the other, where there are no nodes.
    #[inline(never)]
    fn visit_flat<A: HitVisitor>(&self, aim: &LeafRay, answer: &mut A) -> bool {
        with!(self.kernel, s => s.blocks(self, aim, answer))
    }

    /// The same for a ray in the space of an instance, which f32 would move: `setup` is that of [`TraversalRay::mapped`].
    #[inline(never)]
    pub(crate) fn visit_mapped<A: HitVisitor>(&self, setup: &TraversalRay, answer: &mut A) -> bool {
        if self.always > 0 {
            let line = *answer.prepared();
            if with!(self.kernel, s => s.rows_mapped(self, &line, answer)) {
                return true;
            }
        }
        if self.nodes.is_empty() {
            return self.visit_flat(&setup.aim, answer);
        }
        with!(self.kernel, s => s.walk_mapped(self, setup, answer))
    }

    /// The same for a ray of the world that comes to an instance of what this is the tree of; none where another ray has to be made.
    #[inline(always)]
    pub(crate) fn visit_instance<A: HitVisitor>(
        &self,
        inverse: &RoughInverse,
        bounds: &BoundingSphere,
        ray: &PreparedRay,
        answer: &mut A,
    ) -> Option<bool> {
        if self.always > 0 || self.nodes.is_empty() {
            return None;
        }
        with!(self.kernel, s => s.walk_instance(self, inverse, bounds, ray, answer))
    }

    /// Shows `meets` what rays from one point meet.
    #[inline(never)]
    pub(crate) fn visit_packet<M: PacketVisitor>(&self, pencil: &mut PacketState, meets: &mut M) -> PacketResult {
        with!(self.kernel, s => s.pencil(self, pencil, meets))
    }
}
