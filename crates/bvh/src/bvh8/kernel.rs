//! Which code walks the tree: chosen once from what the processor has, the same for every ray.

use super::Bvh8;
use super::flat::{blocks, rows};
use super::optimisation_barrier::opaque;
use super::packet::{self, PacketResult, PacketState, PacketVisitor};
use super::row::RayF64;
use super::traversal_ray::{LeafRay, TraversalRay};
use super::traverse::{HitVisitor, traverse};
use crate::math::simd::Portable;
#[cfg(target_arch = "x86_64")]
use crate::math::simd::{Avx2, Avx512};
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
    Portable,
    #[cfg(target_arch = "x86_64")]
    Avx2(Avx2),
    #[cfg(target_arch = "x86_64")]
    Avx512(Avx512),
}

impl Chosen {
    pub fn new(kernel: Kernel) -> Option<Self> {
        match kernel {
            Kernel::Portable => Some(Self::Portable),
            #[cfg(target_arch = "x86_64")]
            Kernel::Avx2 => Avx2::detect().map(Self::Avx2),
            #[cfg(target_arch = "x86_64")]
            Kernel::Avx512 => Avx512::detect().map(Self::Avx512),
            #[cfg(not(target_arch = "x86_64"))]
            Kernel::Avx2 | Kernel::Avx512 => None,
        }
    }

    pub fn name(self) -> Kernel {
        match self {
            Self::Portable => Kernel::Portable,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(_) => Kernel::Avx2,
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(_) => Kernel::Avx512,
        }
    }
}

/// The fastest that this processor can run.
impl Default for Chosen {
    fn default() -> Self {
        [Kernel::Avx512, Kernel::Avx2].into_iter().find_map(Self::new).unwrap_or(Self::Portable)
    }
}

impl Bvh8 {
    /// Asks `answer` about what the ray meets. Whether it ended the walk.
    #[inline(always)]
    pub(crate) fn ask<R: Real, A: HitVisitor>(&self, ray: &Ray<R>, range: Interval<R>, answer: &mut A) -> bool {
        // One by one, and on in registers: a load of two numbers would wait for both stores of whoever has just made the ray.
        let one = |axis: usize| (opaque(ray.origin.axis(axis).to_f32()), opaque(ray.direction.axis(axis).to_f32()));
        let ([(ox, dx), (oy, dy), (oz, dz)], near) = ([one(0), one(1), one(2)], range.min.to_f32());
        if self.always > 0 {
            let over = match self.kernel {
                Chosen::Portable => rows_portable(self, ox, oy, oz, dx, dy, dz, answer),
                #[cfg(target_arch = "x86_64")]
                Chosen::Avx2(avx2) => avx2.rows(self, ox, oy, oz, dx, dy, dz, answer),
                #[cfg(target_arch = "x86_64")]
                Chosen::Avx512(avx512) => avx512.rows(self, ox, oy, oz, dx, dy, dz, answer),
            };
            if over {
                return true;
            }
        }
        if self.nodes.is_empty() {
            if self.blocks.is_empty() && self.others.is_empty() {
                return false;
            }
            return self.ask_flat(&TraversalRay::new([ox, oy, oz], [dx, dy, dz], near).aim, None, answer);
        }
        match self.kernel {
            Chosen::Portable => walk_portable(self, ox, oy, oz, dx, dy, dz, near, answer),
            #[cfg(target_arch = "x86_64")]
            Chosen::Avx2(avx2) => avx2.walk(self, ox, oy, oz, dx, dy, dz, near, answer),
            #[cfg(target_arch = "x86_64")]
            Chosen::Avx512(avx512) => avx512.walk(self, ox, oy, oz, dx, dy, dz, near, answer),
        }
    }

    /// The same of blocks and of the rest, one after the other, where there are no nodes.
    #[inline(never)]
    fn ask_flat<A: HitVisitor>(&self, aim: &LeafRay, probe: Option<&PreparedRay>, answer: &mut A) -> bool {
        match self.kernel {
            Chosen::Portable => blocks(Portable, self, aim, probe, answer),
            #[cfg(target_arch = "x86_64")]
            Chosen::Avx2(avx2) => avx2.blocks(self, aim, probe, answer),
            #[cfg(target_arch = "x86_64")]
            Chosen::Avx512(avx512) => avx512.blocks(self, aim, probe, answer),
        }
    }
}

impl Bvh8 {
    /// The same for a ray in the space of an instance, which f32 would move: `setup` is that of [`TraversalRay::mapped`].
    #[inline(never)]
    pub(crate) fn ask_mapped<A: HitVisitor>(&self, setup: &TraversalRay, probe: PreparedRay, answer: &mut A) -> bool {
        if self.always > 0 {
            let line = RayF64::from(&probe);
            let over = match self.kernel {
                Chosen::Portable => rows(Portable, self, &line, answer),
                #[cfg(target_arch = "x86_64")]
                Chosen::Avx2(avx2) => avx2.rows_mapped(self, &line, answer),
                #[cfg(target_arch = "x86_64")]
                Chosen::Avx512(avx512) => avx512.rows_mapped(self, &line, answer),
            };
            if over {
                return true;
            }
        }
        if self.nodes.is_empty() {
            return self.ask_flat(&setup.aim, Some(&probe), answer);
        }
        match self.kernel {
            Chosen::Portable => traverse::<_, _, true>(Portable, self, setup, Some(&probe), answer),
            #[cfg(target_arch = "x86_64")]
            Chosen::Avx2(avx2) => avx2.walk_mapped(self, setup, probe, answer),
            #[cfg(target_arch = "x86_64")]
            Chosen::Avx512(avx512) => avx512.walk_mapped(self, setup, probe, answer),
        }
    }
}

#[inline(never)]
#[expect(clippy::too_many_arguments, reason = "in registers")]
fn walk_portable<A: HitVisitor>(
    bvh: &Bvh8,
    ox: f32,
    oy: f32,
    oz: f32,
    dx: f32,
    dy: f32,
    dz: f32,
    near: f32,
    answer: &mut A,
) -> bool {
    traverse::<_, _, false>(Portable, bvh, &TraversalRay::new([ox, oy, oz], [dx, dy, dz], near), None, answer)
}

#[inline(never)]
#[expect(clippy::too_many_arguments, reason = "in registers")]
fn rows_portable<A: HitVisitor>(bvh: &Bvh8, ox: f32, oy: f32, oz: f32, dx: f32, dy: f32, dz: f32, answer: &mut A) -> bool {
    rows(Portable, bvh, &RayF64::new([ox, oy, oz], [dx, dy, dz]), answer)
}

impl Bvh8 {
    /// Asks `meets` about what rays from one point meet.
    #[inline(never)]
    pub(crate) fn ask_pencil<M: PacketVisitor>(&self, pencil: &mut PacketState, meets: &mut M) -> PacketResult {
        match self.kernel {
            Chosen::Portable => packet::walk(Portable, self, pencil, meets),
            #[cfg(target_arch = "x86_64")]
            Chosen::Avx2(avx2) => avx2.pencil(self, pencil, meets),
            #[cfg(target_arch = "x86_64")]
            Chosen::Avx512(avx512) => avx512.pencil(self, pencil, meets),
        }
    }
}
