//! Whether locally ordered clustering will get through with these boxes in time, told before it starts, since it can't be
//! stopped once it has.
//!
//! In each pass every cluster looks at its neighbours in Morton order and the pairs that choose each other become one. Among
//! random boxes a third of the clusters find their partner. But where each one's best neighbour is the one before it (boxes
//! of rising size, or all alike), one pair in a whole row does: as many passes as boxes, quadratic time, and a list for a tree.
//! No sample of the boxes shows that: it may start after a few good passes, or with one box in a hundred. So the passes are
//! rehearsed, without the tree, up to where even the worst rest is cheap.

use glam::Vec3A;
use rayon::prelude::*;

use super::Stop;
use crate::aabb::PaddedBox;

/// How far clustering looks for partners: one place on either side in the first passes, `distance` after them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Passes {
    pub near: usize,
    pub distance: usize,
}

/// Clusters that all passes together may look at, for each box. Measured at every preset's distances: 2.1 to 4.9 on
/// random boxes, grids, terrain, a helix, a ball; 5.5 at most, where each box is there twice.
const LIMIT: u64 = 8;
/// Clusters that one thread looks at in one piece. The result does not depend on it.
const PIECE: usize = 4096;

#[derive(Clone, Copy)]
struct Cluster {
    min: Vec3A,
    max: Vec3A,
}

impl Cluster {
    fn union(&self, other: &Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Half the surface, by the operations of `obvhs` in their order: ties decide which pairs form.
    #[inline(always)]
    fn cost(&self, other: &Self) -> f32 {
        let d = self.max.max(other.max) - self.min.min(other.min);
        (d.x + d.y) * d.z + d.x * d.y
    }
}

/// What clustering will do with boxes in Morton order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct PlocDryRun {
    /// Whether it stays within the limit.
    pub passed: bool,
    /// Pairs of boxes that were compared to find that out.
    pub pairs: u64,
    /// Pairs that clustering itself compares at most, where it passed.
    pub ahead: u64,
}

/// Rehearses clustering of boxes in the order in which it will have them; given up, it has not passed.
pub(super) fn rehearse(boxes: &[PaddedBox], passes: Passes, stop: Stop<'_>) -> PlocDryRun {
    let limit = LIMIT * boxes.len() as u64;
    let worst = |clusters: usize| (clusters as u64).pow(2) / 2;
    let (mut looked, mut pairs) = (0, 0);
    let mut rest = boxes.len();
    let mut clusters = Vec::new();
    let (mut next, mut partners) = (Vec::new(), Vec::new());
    let mut pass = 0;
    while looked + worst(rest) > limit {
        if pass == 0 {
            clusters = boxes.iter().map(|b| Cluster { min: b.min.into(), max: b.max.into() }).collect();
            partners = vec![0; rest];
        }
        let distance = if pass < passes.near { 1 } else { passes.distance };
        run_pass(&mut clusters, distance, &mut partners, &mut next);
        looked += rest as u64;
        pairs += (rest * distance) as u64;
        // Costs that are not numbers leave every cluster alone.
        if looked > limit || clusters.len() == rest || stop() {
            return PlocDryRun { passed: false, pairs, ahead: 0 };
        }
        rest = clusters.len();
        pass += 1;
    }
    PlocDryRun { passed: true, pairs, ahead: pairs + worst(rest) * passes.distance as u64 }
}

/// One pass; the other two are room to work in.
fn run_pass(clusters: &mut Vec<Cluster>, distance: usize, partners: &mut [u32], next: &mut Vec<Cluster>) {
    let partners = &mut partners[..clusters.len()];
    choose(clusters, distance, partners);
    merge(clusters, partners, next);
    core::mem::swap(clusters, next);
}

/// For each cluster the place of its best neighbour, of equals the last.
fn choose(clusters: &[Cluster], distance: usize, partners: &mut [u32]) {
    let piece = |(number, partners): (usize, &mut [u32])| {
        let (start, end) = (number * PIECE, number * PIECE + partners.len());
        let mut costs = [f32::INFINITY; PIECE];
        for (i, partner) in partners.iter_mut().enumerate() {
            *partner = (start + i) as u32;
        }
        // Each pair once, and in an order in which each cluster meets its neighbours from the first to the last.
        for i in start.saturating_sub(distance)..end {
            let own = clusters[i];
            let mut consider = |place: usize, other: usize, cost: f32| {
                if (start..end).contains(&place) && cost <= costs[place - start] {
                    costs[place - start] = cost;
                    partners[place - start] = other as u32;
                }
            };
            for (j, other) in clusters.iter().enumerate().take(i + distance + 1).skip((i + 1).max(start)) {
                let cost = own.cost(other);
                consider(i, j, cost);
                consider(j, i, cost);
            }
        }
    };
    if clusters.len() < 4 * PIECE {
        partners.chunks_mut(PIECE).enumerate().for_each(piece);
    } else {
        partners.par_chunks_mut(PIECE).enumerate().for_each(piece);
    }
}

/// The clusters after a pass: where two chose each other, their union stands at the second one's place.
fn merge(clusters: &[Cluster], partners: &[u32], merged: &mut Vec<Cluster>) {
    merged.clear();
    for (i, (cluster, &partner)) in clusters.iter().zip(partners).enumerate() {
        let partner = partner as usize;
        if partner == i || partners[partner] as usize != i {
            merged.push(*cluster);
        } else if i > partner {
            merged.push(cluster.union(&clusters[partner]));
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use glam::Vec3;
    use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

    use super::*;
    use crate::build::morton::sorted;

    /// Boxes at scattered places, of sizes that differ; those of a row with growth are a list for clustering.
    fn boxes(count: usize, row: bool) -> Vec<PaddedBox> {
        let at = |i: usize| {
            let place = |stride: usize| (i * stride % 20_011) as f32 / 20_011.0;
            let size = if row { 1.1_f32.powi(i as i32) } else { 0.01 + place(977) * 0.05 };
            let centre = if row { Vec3::X * size } else { Vec3::new(place(3137), place(6197), place(8117)) };
            PaddedBox { min: centre - size * 0.3, max: centre + size * 0.3 }
        };
        (0..count).map(at).collect()
    }

    fn bits(min: [f32; 3], max: [f32; 3]) -> [u32; 6] {
        let (a, b) = (min.map(f32::to_bits), max.map(f32::to_bits));
        [a[0], a[1], a[2], b[0], b[1], b[2]]
    }

    /// Protects: what is rehearsed is what clustering does: the same boxes of clusters, and as many passes.
    #[test]
    fn rehearsal_is_what_obvhs_does() {
        for (count, row) in [(1000, false), (20_000, false), (150, true)] {
            let sorted = sorted(&boxes(count, row), SortPrecision::U64).unwrap();
            let passes = Passes { near: 2, distance: 6 };
            let order = (0..count as u32).collect();
            let built = PlocBuilder::new().build(PlocSearchDistance::Low, &sorted.boxes, order, sorted.precision, passes.near);

            let mut clusters: Vec<_> = sorted.boxes.iter().map(|b| Cluster { min: b.min.into(), max: b.max.into() }).collect();
            let (mut partners, mut next) = (vec![0; count], Vec::new());
            let mut ours: BTreeSet<[u32; 6]> = BTreeSet::new();
            let (mut pass, mut looked) = (0, 0);
            loop {
                ours.extend(clusters.iter().map(|c| bits(c.min.to_array(), c.max.to_array())));
                if clusters.len() == 1 {
                    break;
                }
                looked += clusters.len();
                let distance = if pass < passes.near { 1 } else { passes.distance };
                run_pass(&mut clusters, distance, &mut partners, &mut next);
                pass += 1;
            }
            let theirs: BTreeSet<_> = built.nodes.iter().map(|n| bits(n.aabb.min.to_array(), n.aabb.max.to_array())).collect();
            assert!(ours == theirs, "{count} boxes: {} kinds of boxes against {}", ours.len(), theirs.len());
            assert_eq!(built.max_depth, (pass + 1).max(96), "{count} boxes");
            // What is promised covers what is done.
            let rehearsal = rehearse(&sorted.boxes, passes, &|| false);
            assert_eq!(rehearsal.passed, !row, "{count} boxes, {looked} looked at");
            assert!(row || looked <= LIMIT as usize * count, "{looked} clusters for {count} boxes");
        }
    }
}
