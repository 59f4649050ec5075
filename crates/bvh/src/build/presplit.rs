//! References to parts of triangles whose boxes are mostly empty: long ones that lie across the axes, large ones among small.
//!
//! A part has a box of its own and stands for the whole triangle, which is tested wherever a ray enters any of them. How many parts a
//! triangle gets depends on how much of its box it leaves empty and on the planes that it crosses: halves of the scene, of these and
//! so on, since those are what parts of a tree end at ("Fast Parallel Construction of High-Quality Bounding Volume Hierarchies",
//! Karras, Aila 2013, section 5).

use arrayvec::ArrayVec;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::{Corners, PIECE};
use crate::aabb::{Aabb, PaddedBox, exact_half_area};
use crate::bvh8::MAX_PRIMITIVES;

/// Steps an axis has that a plane may lie at.
const STEPS: f64 = (1 << 20) as f64;
/// Triangles that fill more of their boxes, by what they show to each axis, are left whole.
const EMPTY: f64 = 0.9;
/// Boxes that a ray through everything is expected to meet in vain, from which on splitting is worth what it takes.
const IN_VAIN: f64 = 32.0;
/// Most parts of a triangle.
const MOST: usize = 256;

/// How much is split.
#[derive(Clone, Copy, Debug)]
pub(super) struct SplitBudget {
    /// Most references that come in addition, for each box.
    pub more: f64,
    /// Triangles that leave less of their box empty than this of the surface of everything are not worth it.
    pub least: f64,
}

/// A triangle that is worth splitting.
struct Candidate {
    place: u32,
    weight: f64,
    empty: f64,
}

/// A part of a triangle: where its plane meets a box. Each of six planes adds a corner at most.
type Polygon = ArrayVec<DVec3, 9>;

/// Splits triangles. Returns the boxes of all references, first one for each box in their order, and for those after them whose
/// they are.
pub(super) fn presplit(boxes: &[PaddedBox], corners: Corners<'_>, shares: SplitBudget) -> Option<(Vec<PaddedBox>, Vec<u32>)> {
    let whole = boxes.par_chunks(PIECE).map(|piece| piece.iter().fold(PaddedBox::NOTHING, |all, one| all.union(one)));
    let whole = whole.collect::<Vec<_>>().iter().fold(PaddedBox::NOTHING, |all, one| all.union(one));
    let grid = Grid::new(&whole);
    let least = exact_half_area(&whole) * shares.least;
    let candidate = |place: usize| {
        // Most are told apart by their box alone.
        if exact_half_area(&boxes[place]) < least {
            return None;
        }
        let own = corners(place as u32)?.map(Vec3::as_dvec3);
        let empty = empty(&own);
        if empty < EMPTY * area(&Aabb::from_points(own)) {
            return None;
        }
        let weight = (empty * grid.plane(&of(&boxes[place]))?.size).cbrt();
        (empty >= least && weight.is_finite()).then_some(Candidate { place: place as u32, weight, empty })
    };
    let candidates: Vec<_> = (0..boxes.len()).into_par_iter().with_min_len(PIECE).filter_map(candidate).collect();
    let root = exact_half_area(&whole);
    if candidates.iter().map(|c| c.empty).sum::<f64>() < IN_VAIN * root {
        return None;
    }
    let budget = ((boxes.len() as f64 * shares.more) as usize).min(MAX_PRIMITIVES.saturating_sub(boxes.len()));
    let factor = factor(&candidates, budget)?;
    let split = |candidate: &Candidate| {
        let splits = ((candidate.weight * factor) as usize).min(MOST - 1);
        let own = corners(candidate.place)?.map(Vec3::as_dvec3);
        let mut parts = Vec::with_capacity(splits + 1);
        Splitter { grid, whole: boxes[candidate.place as usize], least }.split(own.into_iter().collect(), splits, &mut parts);
        // Pads may be as large as what they are around.
        let area: f64 = parts.iter().map(exact_half_area).sum();
        (area < exact_half_area(&boxes[candidate.place as usize])).then_some((candidate.place, parts))
    };
    let split: Vec<_> = candidates.par_iter().filter_map(split).collect();
    let mut all = boxes.to_vec();
    let mut owners = Vec::new();
    for (place, parts) in split {
        let mut parts = parts.into_iter();
        all[place as usize] = parts.next()?;
        for part in parts {
            all.push(part);
            owners.push(place);
        }
    }
    (!owners.is_empty()).then_some((all, owners))
}

/// What a weight is multiplied with to be the number of splits, so that all are as many as may be; none where there are none.
fn factor(candidates: &[Candidate], budget: usize) -> Option<f64> {
    let count = |factor: f64| candidates.iter().map(|c| ((c.weight * factor) as usize).min(MOST - 1)).sum::<usize>();
    let greatest = candidates.iter().map(|c| c.weight).fold(0.0, f64::max);
    if greatest <= 0.0 || budget == 0 {
        return None;
    }
    let (mut low, mut high) = (0.0, MOST as f64 / candidates.iter().map(|c| c.weight).fold(f64::INFINITY, f64::min));
    high = high.min(f64::MAX);
    if count(high) <= budget {
        return Some(high);
    }
    for _ in 0..64 {
        let middle = 0.5 * (low + high);
        if count(middle) <= budget { low = middle } else { high = middle }
    }
    (low > 0.0).then_some(low)
}

fn of(bounds: &PaddedBox) -> Aabb {
    Aabb { min: bounds.min.as_dvec3(), max: bounds.max.as_dvec3() }
}

fn area(bounds: &Aabb) -> f64 {
    let e = bounds.extent();
    e.x * e.y + e.y * e.z + e.z * e.x
}

/// How much of half a box's surface would be gone if the box were replaced by ever smaller ones along the polygon: these show to each
/// axis what it shows.
fn empty(polygon: &[DVec3]) -> f64 {
    let vector = polygon.windows(2).fold(DVec3::ZERO, |sum, edge| sum + (edge[0] - polygon[0]).cross(edge[1] - polygon[0]));
    area(&Aabb::from_points(polygon.iter().copied())) - 0.5 * vector.abs().element_sum()
}

/// The planes that halve everything, its halves, and so on.
#[derive(Clone, Copy)]
struct Grid {
    min: DVec3,
    step: DVec3,
}

/// Where to split, and how large the cells are that the plane parts.
struct Plane {
    axis: usize,
    at: f64,
    size: f64,
}

impl Grid {
    fn new(whole: &PaddedBox) -> Self {
        let (min, max) = (whole.min.as_dvec3(), whole.max.as_dvec3());
        Self { min, step: (max - min) / STEPS }
    }

    /// Of the planes through a box the one between the largest cells.
    fn plane(&self, bounds: &Aabb) -> Option<Plane> {
        let of = |axis: usize| {
            let step = |x: f64| ((x - self.min[axis]) / self.step[axis]) as u32;
            let (low, high) = (step(bounds.min[axis]), step(bounds.max[axis]));
            let bit = (low ^ high).checked_ilog2()?;
            let at = self.min[axis] + f64::from(high >> bit << bit) * self.step[axis];
            let inside = bounds.min[axis] < at && at < bounds.max[axis];
            inside.then(|| Plane { axis, at, size: f64::from(1 << bit) * self.step[axis] })
        };
        (0..3).filter_map(of).max_by(|a, b| a.size.total_cmp(&b.size))
    }
}

struct Splitter {
    grid: Grid,
    /// The box of the triangle, which parts do not leave.
    whole: PaddedBox,
    least: f64,
}

impl Splitter {
    /// Appends the boxes of a polygon's parts after so many splits.
    fn split(&self, polygon: Polygon, splits: usize, parts: &mut Vec<PaddedBox>) {
        let bounds = Aabb::from_points(polygon.iter().copied());
        let plane = if splits > 0 && empty(&polygon) >= self.least { self.grid.plane(&bounds) } else { None };
        let Some(plane) = plane else {
            parts.push(self.padded(&bounds));
            return;
        };
        let (low, high) = (clipped(&polygon, plane.axis, plane.at, 1.0), clipped(&polygon, plane.axis, plane.at, -1.0));
        let longest = |polygon: &Polygon| Aabb::from_points(polygon.iter().copied()).extent().max_element();
        let (a, b) = (longest(&low), longest(&high));
        if low.len() < 3 || high.len() < 3 || a.is_nan() || b.is_nan() {
            parts.push(self.padded(&bounds));
            return;
        }
        let to_low = (((splits - 1) as f64 * a / (a + b)).round() as usize).min(splits - 1);
        self.split(low, to_low, parts);
        self.split(high, splits - 1 - to_low, parts);
    }

    /// The box of a part: with the pads of the whole triangle, since what they are for grows with that.
    fn padded(&self, bounds: &Aabb) -> PaddedBox {
        let whole = of(&self.whole);
        let ulp = f64::from(f32::EPSILON);
        let pad = whole.extent().max_element() * (2.0 * ulp);
        let out = |v: DVec3| v.abs() * (4.0 * ulp) + DVec3::splat(pad + f64::from(f32::MIN_POSITIVE));
        let (min, max) = ((bounds.min - out(bounds.min)).as_vec3(), (bounds.max + out(bounds.max)).as_vec3());
        PaddedBox { min: min.max(self.whole.min), max: max.min(self.whole.max) }
    }
}

/// The part of a polygon on one side of a plane.
fn clipped(polygon: &Polygon, axis: usize, at: f64, side: f64) -> Polygon {
    let mut out = Polygon::new();
    for (i, &from) in polygon.iter().enumerate() {
        let to = polygon[(i + 1) % polygon.len()];
        let (a, b) = ((at - from[axis]) * side, (at - to[axis]) * side);
        if a >= 0.0 {
            let _ = out.try_push(from);
        }
        if a * b < 0.0 {
            let mut crossing = from + (to - from) * (a / (a - b));
            crossing[axis] = at;
            let _ = out.try_push(crossing);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Xorshift, from 0 to 1.
    fn unit(state: &mut u64) -> f64 {
        *state ^= *state << 13;
        *state ^= *state >> 7;
        *state ^= *state << 17;
        (*state >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn point(state: &mut u64) -> DVec3 {
        DVec3::new(unit(state), unit(state), unit(state)) * 2.0 - 1.0
    }

    /// Slivers of some width across a cube of ±1, at a place and of a scale, with their boxes.
    fn slivers(width: f64, place: DVec3, scale: f64) -> (Vec<[Vec3; 3]>, Vec<PaddedBox>) {
        let state = &mut 88_172_645_463_325_252;
        let corners = (0..3000).map(|_| {
            let (a, b) = (point(state), point(state));
            [a, b, a.lerp(b, unit(state)) + point(state) * width].map(|p| (place + p * scale).as_vec3())
        });
        let corners: Vec<_> = corners.collect();
        let bounds = |c: &[Vec3; 3]| Aabb::from_points(c.map(Vec3::as_dvec3)).padded().unwrap();
        (corners.clone(), corners.iter().map(bounds).collect())
    }

    const SHARES: SplitBudget = SplitBudget { more: 3.0, least: 1e-8 };

    /// Protects: every point of a triangle lies in the box of a part, at any scale and place; parts are as many as are allowed and no
    /// more, stay within their triangle's box, and are smaller.
    #[test]
    fn parts_cover_their_triangle() {
        for (place, scale) in
            [(DVec3::ZERO, 1.0), (DVec3::new(1e6, -3e5, 0.0), 1e3), (DVec3::ONE, 1e-2), (DVec3::ZERO, 1e-6), (DVec3::ZERO, 1e9)]
        {
            let (corners, boxes) = slivers(0.01, place, scale);
            let (all, owners) = presplit(&boxes, &|place| Some(corners[place as usize]), SHARES).unwrap();
            assert_eq!(all.len(), boxes.len() + owners.len());
            assert!(owners.len() <= 3 * boxes.len() && owners.len() > boxes.len(), "{} parts at {place}", owners.len());
            let mut parts: Vec<Vec<PaddedBox>> = all[..boxes.len()].iter().map(|b| vec![*b]).collect();
            owners.iter().zip(&all[boxes.len()..]).for_each(|(&owner, part)| parts[owner as usize].push(*part));
            let state = &mut 9_172_645_463_325_252;
            let area: [f64; 2] = [boxes.as_slice(), all.as_slice()].map(|list| list.iter().map(exact_half_area).sum());
            assert!(area[1] < 0.6 * area[0], "{area:?} at {place}");
            for ((corners, own), parts) in corners.iter().zip(&boxes).zip(&parts) {
                assert!(parts.iter().all(|part| part.min.cmpge(own.min).all() && part.max.cmple(own.max).all()));
                let [a, b, c] = corners.map(Vec3::as_dvec3);
                for _ in 0..40 {
                    let (u, v) = (unit(state), unit(state));
                    let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                    let p = a + (b - a) * u + (c - a) * v;
                    let within = |part: &PaddedBox| p.cmpge(part.min.as_dvec3()).all() && p.cmple(part.max.as_dvec3()).all();
                    assert!(parts.iter().any(within), "{corners:?}, {p}");
                }
            }
        }
    }

    /// Protects: nothing is split where it would not pay: few triangles, broad ones, other primitives, points.
    #[test]
    fn what_fills_its_box_is_left_whole() {
        let split = |corners: &[[Vec3; 3]], boxes: &[PaddedBox]| presplit(boxes, &|place| Some(corners[place as usize]), SHARES);
        let (corners, boxes) = slivers(0.01, DVec3::ZERO, 1.0);
        assert!(split(&corners[..30], &boxes[..30]).is_none());
        assert!(presplit(&boxes, &|_| None, SHARES).is_none());
        let (corners, boxes) = slivers(1.0, DVec3::ZERO, 1.0);
        assert!(split(&corners, &boxes).is_none());
        let (corners, boxes) = slivers(0.01, DVec3::ONE, 0.0);
        assert!(split(&corners, &boxes).is_none());
    }
}
