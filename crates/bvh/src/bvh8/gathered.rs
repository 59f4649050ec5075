//! Leaves of up to eight spheres, or of up to eight quads.
//!
//! Spheres go through their own test in lanes of f64, as in [`super::row`]: what a filter in f32 would spare is less than it costs. A quad is two
//! triangles to its own test, the second asked where the first is not hit, so the filter of triangles says of both halves at once which
//! quads are missed: with as many roundings, since the exact test of a half is that of a triangle. A quad goes on to its own test where
//! either half is left. Where neither is, the first half is missed or hit out of range, and the second one is too where it is asked.

use super::filter;
use super::row::{RayF64, Row};
use super::traversal_ray::{LeafRay, TraversalRay};
use super::traverse::HitVisitor;
use super::triangle8::{LeafHeader, Triangle8};
use super::{Bvh8, Child, WIDTH};
use crate::math::simd::Simd;
use crate::shapes::PreparedRay;
use glam::Vec3;

/// Up to eight quads, as the filter reads them.
#[repr(C, align(64))]
#[derive(Clone, Debug)]
pub(super) struct Quad8 {
    /// One array a coordinate: `corners[axis][corner][lane]`.
    pub corners: [[[f32; WIDTH]; 4]; 3],
    /// As [`Triangle8::longest`], of both halves.
    pub longest: [f32; WIDTH],
    /// The place of the first; the others follow.
    pub first: u32,
    pub count: u8,
}

impl Quad8 {
    /// Room for so many.
    pub fn room(first: usize, count: usize) -> Self {
        Self { corners: [[[0.0; WIDTH]; 4]; 3], longest: [f32::NEG_INFINITY; WIDTH], first: first as u32, count: count as u8 }
    }

    /// The lanes in use. Of a ray whose bounds are infinite the filter leaves the others too.
    #[inline(always)]
    pub fn used(&self) -> u32 {
        (1 << self.count) - 1
    }

    fn set(&mut self, lane: usize, [a, b, c, d]: [Vec3; 4]) {
        for (corner, place) in [a, b, c, d].into_iter().enumerate() {
            (0..3).for_each(|axis| self.corners[axis][corner][lane] = place[axis]);
        }
        let mut halves = [Triangle8::EMPTY, Triangle8::EMPTY];
        halves[0].set(lane, [a, b, c]);
        halves[1].set(lane, [a, c, d]);
        self.longest[lane] = halves[0].longest[lane].max(halves[1].longest[lane]);
    }
}

impl Bvh8 {
    /// Bytes of leaves of so many spheres and so many quads, at most: of a sphere or a quad beside `others` of other kinds, few leaves are full.
    pub(super) fn most_bytes_of_leaves(spheres: u64, quads: u64, others: u64) -> u64 {
        let most =
            |count: u64, others: u64| (count / 2).min((count / 5).saturating_mul(2).saturating_add(others).saturating_add(2));
        let rows = most(spheres, others.saturating_add(quads)).saturating_mul(size_of::<Row>() as u64);
        rows.saturating_add(most(quads, others.saturating_add(spheres)).saturating_mul(size_of::<Quad8>() as u64))
    }

    /// Fills the leaves of spheres; `row` makes one of some slots, of which the tree's begin at `first`.
    pub(crate) fn fill_rows(&mut self, first: usize, row: impl Fn(core::ops::Range<usize>) -> Row) {
        for at in self.always..self.rows.len() {
            let LeafHeader { first: place, count, .. } = self.rows[at].facts;
            let start = first + place as usize;
            self.rows[at] = row(start..start + usize::from(count));
        }
    }

    /// Fills the leaves of quads, by their corners.
    pub(crate) fn fill_quads(&mut self, first: usize, corners: impl Fn(usize) -> Option<[Vec3; 4]>) {
        for at in 0..self.quads.len() {
            let quads = &mut self.quads[at];
            for lane in 0..usize::from(quads.count) {
                if let Some(corners) = corners(first + quads.first as usize + lane) {
                    quads.set(lane, corners);
                }
            }
        }
    }
}

/// All that is asked about a leaf of spheres or of quads. Whether that ended the walk.
#[inline(always)]
pub(super) fn gathered<S: Simd, A: HitVisitor>(
    s: S,
    bvh: &Bvh8,
    leaf: Child,
    aim: &LeafRay,
    probe: Option<&PreparedRay>,
    line: &mut Option<RayF64>,
    answer: &mut A,
) -> bool {
    if leaf.is_row() {
        let row = &bvh.rows[bvh.always + leaf.index()];
        answer.several(row.facts.count.into());
        // Made for the first row that the ray meets.
        let line = line.get_or_insert_with(|| probe.map_or_else(|| RayF64::new(aim.origin, aim.direction), RayF64::from));
        let found = row.hits(s, line, answer.range(), answer.culls());
        return found.hits != 0 && answer.row(&row.facts, &found.roots(s));
    }
    let quads = &bvh.quads[leaf.index()];
    let mut lanes = filter::left_of_quads(s, aim, quads, TraversalRay::last(answer.far()));
    answer.several(u64::from(u32::from(quads.count) - lanes.count_ones()));
    while lanes != 0 {
        let lane = lanes.trailing_zeros() as usize & (WIDTH - 1);
        lanes &= lanes - 1;
        if answer.other(quads.first as usize + lane) {
            return true;
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: the bounds of a leaf of quads are those of both halves, whichever has the longer edge: no ray would tell, since a
    /// parallelogram's are within a factor of two and bounds are rarely met by half.
    #[test]
    fn quads_are_as_long_as_their_longer_half() {
        let mut quads = Quad8::room(0, 2);
        let (a, b, d) = (Vec3::ONE, Vec3::new(2.0, 1.0, 1.0), Vec3::new(-0.5, 1.0, 1.5));
        quads.set(0, [a, b, b + d - a, d]);
        quads.set(1, [a, d, b + d - a, b]);
        let edge = (d - a).length();
        assert!(quads.longest[..2].iter().all(|&longest| longest >= edge && longest < edge * 1.001), "{:?}", quads.longest);
        assert_eq!((quads.used(), quads.longest[2]), (3, f32::NEG_INFINITY));
    }
}
