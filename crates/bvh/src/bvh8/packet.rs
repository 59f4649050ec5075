//! Rays from one point, up to sixteen at a time: a pencil, as the rays of a pinhole camera are.
//!
//! Boxes are tested once for all of them, by the interval of their inverse directions: rounding keeps order, so where the box test of
//! any of them passes, this one does, and no later. What a triangle has to do with the common origin is worked out once, eight
//! triangles side by side; then each triangle that the interval of directions may hit meets eight rays at a time. What [`super::filter`]
//! says of bounds holds here as it stands: U = e₂·(f64 × d) is (e₂ × f64)·d, with as many roundings. W is also taken for the interval as
//! (N − A − B)·d, of components that are wrong by 23 u E R, so by 42 u E R |d|, of the same 46. What the filter leaves goes through
//! the exact test's own operations, eight rays at once in f64, so that a hit has the bits that the ray alone would find.

#![expect(unsafe_code, reason = "the stack is read where it was written; each block says why")]

use glam::{DVec3, Vec3};

use super::filter::{Bounds, TOLD, cross, sub3};
use super::row::{RaysF64, Row};
use super::stack::Stack;
use super::traversal_ray::{LeafRay, TraversalRay};
use super::traversal_simd::TraversalSimd;
use super::triangle8::Triangle8;
use super::{Bvh8, Child, Node, WIDTH};
use crate::math::simd::{Simd, dot_f64};
use crate::ray::Ray;
use crate::shapes::{EDGE_ON, PreparedRay, Triangle};

/// Vectors of rays in a pencil.
const GROUPS: usize = 2;
/// Rays of a pencil.
pub(crate) const RAYS: usize = GROUPS * WIDTH;
/// A direction that is nearer to a plane across an axis is not known to leave on one side of it.
const LEAST: f32 = 1e-30;

/// What a pencil asks, with what it has found so far.
pub(crate) struct PacketState {
    origin: [f32; 3],
    /// One array an axis; where there is no ray, the direction of the first.
    directions: [[f32; RAYS]; 3],
    /// How many rays there are.
    count: usize,
    /// The excluded lower end of distances.
    near: f32,
    /// The greatest distance that still counts of each ray: that of its hit where it has one.
    far: [f32; RAYS],
    /// The other numbers of its hit, and the slots.
    rest: [[f32; RAYS]; 2],
    slots: [[u32; RAYS]; 2],
    /// Whether the rays pass backs that are culled.
    culls: bool,
}

impl PacketState {
    /// No slot: nothing found.
    const NOTHING: u32 = u32::MAX;

    /// Of so many directions at most. `near` is excluded, `last` the greatest distance that counts.
    #[inline(always)]
    pub fn new(origin: Vec3, directions: &[Vec3], [near, last]: [f32; 2], culls: bool) -> Self {
        let count = directions.len().min(RAYS);
        let mut lanes = directions.first().copied().unwrap_or(Vec3::ONE).to_array().map(|d| [d; RAYS]);
        for (ray, direction) in directions.iter().take(RAYS).enumerate() {
            (lanes[0][ray], lanes[1][ray], lanes[2][ray]) = (direction.x, direction.y, direction.z);
        }
        let (mut far, slots) = ([f32::NEG_INFINITY; RAYS], [[Self::NOTHING; RAYS]; 2]);
        far[..count].fill(last);
        Self { origin: origin.to_array(), directions: lanes, count, near, far, rest: [[0.0; RAYS]; 2], slots, culls }
    }

    /// How many rays there are.
    pub fn count(&self) -> usize {
        self.count
    }

    /// What a ray has hit: the distance and the hit's other numbers, and both slots.
    #[inline(always)]
    pub fn hit(&self, ray: usize) -> Option<([f32; 3], [u32; 2])> {
        let ray = ray & (RAYS - 1);
        let found = self.slots[0][ray] != Self::NOTHING;
        found.then(|| ([self.far[ray], self.rest[0][ray], self.rest[1][ray]], [self.slots[0][ray], self.slots[1][ray]]))
    }

    /// The greatest distance of a ray that still counts.
    pub fn far(&self, ray: usize) -> f32 {
        self.far[ray & (RAYS - 1)]
    }

    /// A ray, at no time.
    pub fn ray(&self, ray: usize) -> Ray<f32> {
        let d = |axis: usize| self.directions[axis][ray & (RAYS - 1)];
        Ray::new(self.origin.into(), [d(0), d(1), d(2)].into())
    }

    /// Takes a hit within the range where it is nearer than what was found, or as near and lower in the order of ties.
    #[inline(always)]
    pub fn consider(&mut self, ray: usize, [t, u, v]: [f32; 3], [slot, inner]: [u32; 2], lower: impl FnOnce(u32, u32) -> bool) {
        let ray = ray & (RAYS - 1);
        let (best, found) = (self.far[ray], self.slots[0][ray]);
        if t < best || t == best && (found == Self::NOTHING || lower(slot, found)) {
            self.far[ray] = t;
            (self.rest[0][ray], self.rest[1][ray]) = (u, v);
            (self.slots[0][ray], self.slots[1][ray]) = (slot, inner);
        }
    }

    /// The lanes of a group that are rays.
    #[inline(always)]
    fn asked(&self, group: usize) -> u32 {
        let count = self.count.saturating_sub(group * WIDTH).min(WIDTH);
        (1 << count) - 1
    }

    /// The least and the greatest size of directions in each axis, with their sign; none where that is not one.
    #[inline(always)]
    fn spans(&self) -> Option<[[f32; 3]; 2]> {
        let mut spans = [[0.0; 3]; 2];
        for (axis, directions) in self.directions.iter().enumerate() {
            let (mut least, mut greatest) = (f32::INFINITY, f32::NEG_INFINITY);
            for &d in directions {
                least = if d < least { d } else { least };
                greatest = if d > greatest { d } else { greatest };
            }
            (spans[0][axis], spans[1][axis]) = match () {
                () if least > LEAST => (least, greatest),
                () if greatest < -LEAST => (greatest, least),
                () => return None,
            };
        }
        Some(spans)
    }
}

/// What whoever asks makes of what a pencil meets.
pub(crate) trait PacketVisitor {
    /// Whether the first slot comes before the second where both are hit at one distance.
    fn lower(&self, slot: u32, than: u32) -> bool;
    /// Another primitive is met, by the rays of a mask at most.
    fn other(&mut self, place: usize, asked: u32, pencil: &mut PacketState);
}

/// The rays as boxes and filters need them: those of the least and of the greatest components.
struct Bundle<S: Simd> {
    origin: [S::Floats; 3],
    inverse: [[S::Floats; 2]; 3],
    widened: [[S::Floats; 2]; 3],
    late: S::Floats,
    near: S::Floats,
    side: [usize; 3],
    /// Least and greatest directions.
    spans: [[S::Floats; 2]; 3],
    /// Bounds of the filter that hold for each of the rays.
    bounds: LeafRay,
}

#[inline(always)]
fn both<S: Simd>(s: S, a: [f32; 3], b: [f32; 3]) -> [[S::Floats; 2]; 3] {
    [[s.splat(a[0]), s.splat(b[0])], [s.splat(a[1]), s.splat(b[1])], [s.splat(a[2]), s.splat(b[2])]]
}

impl<S: Simd> Bundle<S> {
    #[inline(always)]
    fn new(s: S, pencil: &PacketState) -> Option<Self> {
        let [least, most] = pencil.spans()?;
        let (short, long) =
            (TraversalRay::new(pencil.origin, least, pencil.near), TraversalRay::new(pencil.origin, most, pencil.near));
        let [x, y, z] = pencil.origin;
        Some(Self {
            origin: [s.splat(x), s.splat(y), s.splat(z)],
            inverse: both(s, short.slopes.inverse, long.slopes.inverse),
            widened: both(s, short.slopes.widened, long.slopes.widened),
            late: s.splat(long.slopes.late[0]),
            near: s.splat(pencil.near),
            side: long.slopes.side,
            spans: both(s, least, most),
            // The longest direction's e_T holds for all: 12 u E² R has no direction in it, and 14 u E² |d|² · 2R/|d| or, where |d| is below one,
            // 14 u E² · 2R/|d| is twice as much whatever |d| is.
            bounds: LeafRay { reach: short.aim.reach.max(long.aim.reach), ..long.aim },
        })
    }

    /// Which children some ray may enter before `far`, and no later than where.
    #[inline(always)]
    fn enter(&self, s: S, node: &Node, far: S::Floats) -> (u32, S::Floats) {
        let (mut entry, mut exit) = (self.near, far);
        for axis in 0..3 {
            let side = self.side[axis] & 1;
            let (in_, out) = (&node.planes[axis][side], &node.planes[axis][1 - side]);
            let (a, b) = (s.sub(s.load(in_), self.origin[axis]), s.sub(s.load(out), self.origin[axis]));
            let ([i, j], [k, l]) = (self.inverse[axis], self.widened[axis]);
            entry = s.max(s.min(s.mul(a, i), s.mul(a, j)), entry);
            exit = s.min(s.max(s.mul_add(b, k, self.late), s.mul_add(b, l, self.late)), exit);
        }
        (s.at_most(entry, exit), entry)
    }

    /// The least and the greatest product of vectors with any of the directions.
    #[inline(always)]
    fn products(&self, s: S, v: [S::Floats; 3]) -> [S::Floats; 2] {
        let [[xa, xb], [ya, yb], [za, zb]] = self.spans;
        let (xa, xb) = (s.mul(v[0], xa), s.mul(v[0], xb));
        let (ya, yb) = (s.mul(v[1], ya), s.mul(v[1], yb));
        let (za, zb) = (s.mul(v[2], za), s.mul(v[2], zb));
        [s.add(s.add(s.min(xa, xb), s.min(ya, yb)), s.min(za, zb)), s.add(s.add(s.max(xa, xb), s.max(ya, yb)), s.max(za, zb))]
    }
}

/// Eight rays as the exact test needs them: what a probe has of each, side by side.
struct Rays {
    across: [[[f64; WIDTH]; 3]; 2],
    direction: [[f64; WIDTH]; 3],
    inverse_length_squared: [f64; WIDTH],
}

/// Made when the first triangle asks.
#[inline(never)]
fn rays(pencil: &PacketState) -> [Rays; GROUPS] {
    let none = || Rays { across: [[[0.0; WIDTH]; 3]; 2], direction: [[0.0; WIDTH]; 3], inverse_length_squared: [0.0; WIDTH] };
    let mut rays = [none(), none()];
    for ray in 0..RAYS {
        let probe = PreparedRay::new(pencil.ray(ray));
        let (to, lane) = (&mut rays[ray / WIDTH], ray % WIDTH);
        for axis in 0..3 {
            to.across[0][axis][lane] = probe.across[0][axis];
            to.across[1][axis][lane] = probe.across[1][axis];
            to.direction[axis][lane] = probe.direction[axis];
        }
        to.inverse_length_squared[lane] = probe.inverse_length_squared;
    }
    rays
}

/// What the exact test says of a triangle and eight rays.
struct Crossed<S: Simd> {
    hits: u32,
    outside: u32,
    unsure: u32,
    t: S::Floats,
    weights: [S::Floats; 2],
}

/// The operations of [`crate::shapes::Triangle`]'s test in their order, for eight rays. Those for which rounding could have taken the
/// sign of an edge function are to go through that test itself, and those that see it edge-on.
#[inline(always)]
fn crossed<S: Simd>(s: S, origin: DVec3, corners: &[Vec3; 3], rays: &Rays) -> Crossed<S> {
    let zero = s.splat_f64(0.0);
    let [[ax, ay, az], [bx, by, bz]] = &rays.across;
    let (across, beside) = ([s.load_f64(ax), s.load_f64(ay), s.load_f64(az)], [s.load_f64(bx), s.load_f64(by), s.load_f64(bz)]);
    let [dx, dy, dz] = &rays.direction;
    let direction = [s.load_f64(dx), s.load_f64(dy), s.load_f64(dz)];
    let (mut x, mut y, mut z) = ([zero; 3], [zero; 3], [zero; 3]);
    for corner in 0..3 {
        let offset = corners[corner].as_dvec3() - origin;
        let offset = [s.splat_f64(offset.x), s.splat_f64(offset.y), s.splat_f64(offset.z)];
        x[corner] = dot_f64(s, offset, across);
        y[corner] = dot_f64(s, offset, beside);
        z[corner] = dot_f64(s, offset, direction);
    }
    let products = [s.mul_f64(x[2], y[1]), s.mul_f64(x[0], y[2]), s.mul_f64(x[1], y[0])];
    let u = s.sub_f64(products[0], s.mul_f64(y[2], x[1]));
    let v = s.sub_f64(products[1], s.mul_f64(y[0], x[2]));
    let w = s.sub_f64(products[2], s.mul_f64(y[1], x[0]));
    let tiny = s.splat_f64(f64::EPSILON * 0.5 * 8.0);
    let sure = s.at_least_f64(s.abs_f64(u), s.mul_f64(s.abs_f64(products[0]), tiny))
        & s.at_least_f64(s.abs_f64(v), s.mul_f64(s.abs_f64(products[1]), tiny))
        & s.at_least_f64(s.abs_f64(w), s.mul_f64(s.abs_f64(products[2]), tiny));
    let below = s.greater_f64(zero, u) | s.greater_f64(zero, v) | s.greater_f64(zero, w);
    let above = s.greater_f64(u, zero) | s.greater_f64(v, zero) | s.greater_f64(w, zero);
    let determinant = s.add_f64(s.add_f64(u, v), w);
    let mut sizes = s.abs_f64(x[0]);
    for one in [y[0], x[1], y[1], x[2], y[2]] {
        sizes = s.add_f64(sizes, s.abs_f64(one));
    }
    let depth = s.sub_f64(s.max_f64(s.max_f64(z[0], z[1]), z[2]), s.min_f64(s.min_f64(z[0], z[1]), z[2]));
    let told = s.at_least_f64(s.abs_f64(determinant), s.mul_f64(s.mul_f64(sizes, depth), s.splat_f64(EDGE_ON)));
    let hits = s.greater_f64(s.abs_f64(determinant), zero) & !(below & above);
    let inverse = s.div_f64(s.splat_f64(1.0), determinant);
    let (u, v, w) = (s.mul_f64(u, inverse), s.mul_f64(v, inverse), s.mul_f64(w, inverse));
    let along = s.add_f64(s.add_f64(s.mul_f64(z[0], u), s.mul_f64(z[1], v)), s.mul_f64(z[2], w));
    Crossed {
        hits,
        outside: s.greater_f64(determinant, zero),
        unsure: !(sure & told) & 0xff,
        t: s.narrow(s.mul_f64(along, s.load_f64(&rays.inverse_length_squared))),
        weights: [s.narrow(v), s.narrow(w)],
    }
}

/// What eight triangles have to do with the common origin, a number of each triangle side by side.
struct TriangleOrigin8 {
    u: [[f32; WIDTH]; 3],
    v: [[f32; WIDTH]; 3],
    normal: [[f32; WIDTH]; 3],
    distance: [f32; WIDTH],
    error: [f32; WIDTH],
    determinant_error: [f32; WIDTH],
    before_error: [f32; WIDTH],
    beyond_error: [f32; WIDTH],
    /// Those that some ray may hit.
    lanes: u32,
}

#[inline(always)]
fn spread<S: Simd>(s: S, v: &[[f32; WIDTH]; 3], lane: usize) -> [S::Floats; 3] {
    [s.splat(v[0][lane]), s.splat(v[1][lane]), s.splat(v[2][lane])]
}

#[inline(always)]
fn rows<S: Simd>(s: S, v: [S::Floats; 3]) -> [[f32; WIDTH]; 3] {
    [s.to_array(v[0]), s.to_array(v[1]), s.to_array(v[2])]
}

/// Of a block, up to a distance.
#[inline(always)]
fn see<S: Simd>(s: S, bundle: &Bundle<S>, block: &Triangle8, far: f32) -> TriangleOrigin8 {
    let Triangle8 { corners: [x, y, z], longest } = block;
    let a = [s.load(&x[0]), s.load(&y[0]), s.load(&z[0])];
    let ab = sub3(s, [s.load(&x[1]), s.load(&y[1]), s.load(&z[1])], a);
    let ac = sub3(s, [s.load(&x[2]), s.load(&y[2]), s.load(&z[2])], a);
    let from = sub3(s, a, bundle.origin);
    let (u, v, normal) = (cross(s, ac, from), cross(s, from, ab), cross(s, ab, ac));
    let w = sub3(s, sub3(s, normal, u), v);

    let errors = Bounds::new(s, &bundle.bounds, from, longest, far);
    let ([ul, ug], [vl, vg], [wl, wg]) = (bundle.products(s, u), bundle.products(s, v), bundle.products(s, w));
    let below = s.less(s.min(s.min(ug, vg), wg), s.negate(errors.weight));
    let above = s.less(errors.weight, s.max(s.max(ul, vl), wl));
    let distance = s.mul_add(normal[0], from[0], s.mul_add(normal[1], from[1], s.mul(normal[2], from[2])));
    TriangleOrigin8 {
        u: rows(s, u),
        v: rows(s, v),
        normal: rows(s, normal),
        distance: s.to_array(distance),
        error: s.to_array(errors.weight),
        determinant_error: s.to_array(errors.determinant),
        before_error: s.to_array(errors.before),
        beyond_error: s.to_array(errors.beyond),
        lanes: !(below & above) & 0xff,
    }
}

impl TriangleOrigin8 {
    /// The rays of a group that the exact test may say hit a triangle within the range, as [`super::filter::left`] has it.
    #[inline(always)]
    fn left<S: Simd>(&self, s: S, lane: usize, directions: [S::Floats; 3], near: S::Floats, far: S::Floats) -> u32 {
        let [ux, uy, uz] = spread(s, &self.u, lane);
        let [vx, vy, vz] = spread(s, &self.v, lane);
        let [nx, ny, nz] = spread(s, &self.normal, lane);
        let [dx, dy, dz] = directions;
        let u = s.mul_add(dx, ux, s.mul_add(dy, uy, s.mul(dz, uz)));
        let v = s.mul_add(dx, vx, s.mul_add(dy, vy, s.mul(dz, vz)));
        let along = s.mul_add(dx, nx, s.mul_add(dy, ny, s.mul(dz, nz)));
        let w = s.sub(s.sub(along, u), v);
        let (least, greatest) = (s.min(s.min(u, v), w), s.max(s.max(u, v), w));
        let error = s.splat(self.error[lane]);
        let missed = s.less(least, s.negate(error)) & s.less(error, greatest);
        let (determinant, distance) = (s.abs(along), s.signed_by(s.splat(self.distance[lane]), along));
        let before = s.less(distance, s.mul_sub(near, determinant, s.splat(self.before_error[lane])));
        let beyond = s.less(s.mul_add(far, determinant, s.splat(self.beyond_error[lane])), distance);
        let told = s.less(s.splat(self.determinant_error[lane] * TOLD), determinant);
        !(missed | (before | beyond) & told) & 0xff
    }
}

/// How asking rays together ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PacketResult {
    /// All is found that they meet.
    Whole,
    /// Each has its own way: it would take less to ask them one by one, and what they found so far is not all.
    Parted,
    /// They can't be asked together: directions differ too much. Nothing was done.
    Unfit,
}

/// Leaves that a pencil asks about before it is given up: as many as cost about what its rays cost one by one. Measured:
/// `../../../../benches/runs/2026-11-23-pencils.md`.
const MOST_LEAVES: u32 = 32;

/// Asks about all that the rays may meet.
#[inline(always)]
pub(super) fn walk<S: TraversalSimd, M: PacketVisitor>(
    s: S,
    bvh: &Bvh8,
    pencil: &mut PacketState,
    meets: &mut M,
) -> PacketResult {
    let bundle = if bvh.nodes.is_empty() && bvh.blocks.is_empty() { None } else { Bundle::new(s, pencil) };
    if bundle.is_none() && !(bvh.nodes.is_empty() && bvh.blocks.is_empty()) {
        return PacketResult::Unfit;
    }
    if bvh.always > 0 {
        rows_of_lanes(s, &bvh.rows[..bvh.always], pencil, meets);
    }
    if let Some(bundle) = bundle {
        let mut exact = None;
        if bvh.nodes.is_empty() {
            for number in 0..bvh.blocks.len() {
                block(s, bvh, number, &bundle, pencil, &mut exact, meets);
            }
        } else if !down(s, bvh, &bundle, pencil, &mut exact, meets) {
            return PacketResult::Parted;
        }
    }
    bvh.others.clone().for_each(|place| meets.other(place, u32::MAX, pencil));
    PacketResult::Whole
}

/// Spheres or planes, each asked about eight rays at a time.
#[inline(always)]
fn rows_of_lanes<S: Simd, M: PacketVisitor>(s: S, rows: &[Row], pencil: &mut PacketState, meets: &M) {
    let origin = Vec3::from(pencil.origin).as_dvec3();
    for group in 0..GROUPS {
        let first = group * WIDTH;
        if first >= pencil.count {
            return;
        }
        let row = |axis: usize| -> [f32; WIDTH] { core::array::from_fn(|lane| pencil.directions[axis][first + lane]) };
        let lines = RaysF64::new(s, origin, [&row(0), &row(1), &row(2)], pencil.culls);
        for row in rows {
            for lane in 0..usize::from(row.facts.count) {
                let far: [f32; WIDTH] = core::array::from_fn(|lane| pencil.far[first + lane]);
                let found = row.lane(s, lane, &lines, pencil.near, s.load(&far));
                if found.hits == 0 {
                    continue;
                }
                let roots = found.roots(s);
                let mut hits = roots.hits;
                while hits != 0 {
                    let ray = hits.trailing_zeros() as usize & (WIDTH - 1);
                    hits &= hits - 1;
                    let v = if roots.leaving >> ray & 1 == 0 { 0.0 } else { 1.0 };
                    let slots = [row.facts.first + lane as u32, u32::MAX];
                    pencil.consider(first + ray, [roots.t[ray], 0.0, v], slots, |a, b| meets.lower(a, b));
                }
            }
        }
    }
}

/// The greatest distance that still counts of any ray, as boxes use it.
#[inline(always)]
fn last(pencil: &PacketState) -> f32 {
    let mut far = f32::NEG_INFINITY;
    for &one in &pencil.far {
        far = if one > far { one } else { far };
    }
    TraversalRay::last(far)
}

/// Down the tree; whether to its end.
#[inline(always)]
fn down<S: TraversalSimd, M: PacketVisitor>(
    s: S,
    bvh: &Bvh8,
    bundle: &Bundle<S>,
    pencil: &mut PacketState,
    exact: &mut Option<[Rays; GROUPS]>,
    meets: &mut M,
) -> bool {
    let (mut far, mut leaves) = (last(pencil), 0);
    let (mut stack, mut top, mut current) = (Stack::new(), 0, Child(0));
    loop {
        if !current.is_leaf() {
            let node = &bvh.nodes[current.node()];
            let (entered, entry) = bundle.enter(s, node, s.splat(far));
            if entered != 0 {
                if entered & (entered - 1) == 0 {
                    current = node.children[entered.trailing_zeros() as usize & 7];
                    continue;
                }
                top = s.push_sorted(&mut stack, top, &node.children, entry, entered);
            }
        } else if current != Child::NONE {
            leaves += 1;
            if leaves > MOST_LEAVES {
                return false;
            }
            match () {
                () if current.is_block() => block(s, bvh, current.index(), bundle, pencil, exact, meets),
                () if current.is_row() => {
                    let row = bvh.always + current.index();
                    rows_of_lanes(s, &bvh.rows[row..=row], pencil, meets);
                }
                () => meets.other(current.index(), u32::MAX, pencil),
            }
            far = last(pencil);
        }
        current = loop {
            if top == 0 {
                return true;
            }
            top -= 1;
            // SAFETY: everything below the top was written.
            let waiting = unsafe { stack.get(top) };
            if waiting.entry() <= far {
                break waiting.child();
            }
        };
    }
}

/// The directions of a group, and the greatest distances that still count.
#[inline(always)]
fn group_of<S: Simd>(s: S, pencil: &PacketState, group: usize) -> ([S::Floats; 3], S::Floats) {
    let (first, [x, y, z]) = (group * WIDTH, &pencil.directions);
    let directions = [s.load_from(x, first), s.load_from(y, first), s.load_from(z, first)];
    (directions, s.load_from(&pencil.far, first))
}

/// The triangles of a block.
#[inline(always)]
fn block<S: Simd, M: PacketVisitor>(
    s: S,
    bvh: &Bvh8,
    number: usize,
    bundle: &Bundle<S>,
    pencil: &mut PacketState,
    exact: &mut Option<[Rays; GROUPS]>,
    meets: &mut M,
) {
    let seen = see(s, bundle, &bvh.blocks[number], last(pencil));
    let mut lanes = seen.lanes;
    while lanes != 0 {
        let lane = lanes.trailing_zeros() as usize & (WIDTH - 1);
        lanes &= lanes - 1;
        for group in 0..GROUPS {
            let (directions, far) = group_of(s, pencil, group);
            let left = seen.left(s, lane, directions, bundle.near, far) & pencil.asked(group);
            if left != 0 {
                let rays = exact.get_or_insert_with(|| rays(pencil));
                settle(s, bvh, [number, lane, group], left, &rays[group], pencil, meets);
            }
        }
    }
}

/// The exact test of a triangle for some rays of a group.
#[inline(always)]
fn settle<S: Simd, M: PacketVisitor>(
    s: S,
    bvh: &Bvh8,
    [number, lane, group]: [usize; 3],
    left: u32,
    rays: &Rays,
    pencil: &mut PacketState,
    meets: &M,
) {
    let triangle: Triangle<f32> = bvh.blocks[number].triangle(lane);
    let facts = bvh.facts(number);
    let found = crossed(s, Vec3::from(pencil.origin).as_dvec3(), &triangle.vertices, rays);
    let (mut outside, mut hits) = (found.outside, found.hits & left);
    let (mut t, [mut u, mut v]) = (s.to_array(found.t), [s.to_array(found.weights[0]), s.to_array(found.weights[1])]);
    let mut unsure = found.unsure & left;
    while unsure != 0 {
        let (ray, bit) = (unsure.trailing_zeros() as usize & (WIDTH - 1), unsure & unsure.wrapping_neg());
        (unsure, hits, outside) = (unsure & !bit, hits & !bit, outside & !bit);
        if let Some(crossing) = triangle.crossing(&PreparedRay::new(pencil.ray(group * WIDTH + ray))) {
            hits |= bit;
            outside |= if crossing.from_outside { bit } else { 0 };
            (t[ray], u[ray], v[ray]) = (crossing.t as f32, crossing.weights[0] as f32, crossing.weights[1] as f32);
        }
    }
    let bit = 1 << lane;
    if facts.outside_alone(pencil.culls) & bit != 0 {
        hits &= outside;
    }
    if facts.inside & bit != 0 {
        hits &= !outside;
    }
    while hits != 0 {
        let ray = hits.trailing_zeros() as usize & (WIDTH - 1);
        hits &= hits - 1;
        if pencil.near < t[ray] {
            let slots = [facts.first + lane as u32, u32::MAX];
            pencil.consider(group * WIDTH + ray, [t[ray], u[ray], v[ray]], slots, |a, b| meets.lower(a, b));
        }
    }
}
