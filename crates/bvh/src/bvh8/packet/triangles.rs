//! Packet tests of a block of triangles: the filter for eight triangles, and the exact test of one
//! triangle for eight rays at once.

use glam::{DVec3, Vec3};

use super::bundle::RayBundle;
use super::{GROUPS, MAX_RAYS, PacketState, PacketVisitor, max_far_distance};
use crate::bvh8::filter::{
    ErrorBounds, cross, dot, filter_triangle_lanes, load_corner, splat_vector, sub3,
};
use crate::bvh8::triangle8::Triangle8;
use crate::bvh8::{Bvh8, MaskLanes, WIDTH};
use crate::math::simd::{Simd, dot_f64, splat3_f64};
use crate::shapes::{EDGE_ON_RATIO, PreparedRay, Triangle};

/// Values of eight prepared rays for the exact test, in structure-of-arrays layout.
#[derive(Default)]
pub(super) struct PreparedRays8 {
    across: [[[f64; WIDTH]; 3]; 2],
    direction: [[f64; WIDTH]; 3],
    inverse_length_squared: [f64; WIDTH],
}

/// Prepares the rays of a packet for the exact test, at the first triangle that needs it.
#[inline(never)]
fn prepare_rays(packet_state: &PacketState) -> [PreparedRays8; GROUPS] {
    let mut rays = <[PreparedRays8; GROUPS]>::default();
    for ray in 0..MAX_RAYS {
        let prepared_ray = PreparedRay::new(packet_state.ray(ray));
        let (to, lane) = (&mut rays[ray / WIDTH], ray % WIDTH);
        for axis in 0..3 {
            to.across[0][axis][lane] = prepared_ray.projection_axes[0][axis];
            to.across[1][axis][lane] = prepared_ray.projection_axes[1][axis];
            to.direction[axis][lane] = prepared_ray.direction[axis];
        }
        to.inverse_length_squared[lane] = prepared_ray.inverse_length_squared;
    }
    rays
}

/// Result of the exact test of a triangle for eight rays, one per lane. `hits`, `outside` and
/// `unsure` are masks of rays:
///
/// - `hits`: the rays that hit the triangle;
/// - `outside`: the rays that arrive from outside;
/// - `unsure`: the rays for which the test of a single ray must decide.
struct TriangleHits8<S: Simd> {
    hits: u32,
    outside: u32,
    unsure: u32,
    t: S::Floats,
    weights: [S::Floats; 2],
}

#[inline(always)]
fn load3_f64<S: Simd>(s: S, [x, y, z]: &[[f64; WIDTH]; 3]) -> [S::Doubles; 3] {
    [s.load_f64(x), s.load_f64(y), s.load_f64(z)]
}

/// Intersects eight rays with a triangle by the operations of [`crate::shapes::Triangle`]'s test,
/// in the same order. A ray is marked `unsure` if rounding could change the sign of an edge
/// function, or if the ray sees the triangle edge-on. Such a ray needs that test itself.
#[inline(always)]
fn intersect_eight_rays<S: Simd>(
    s: S,
    origin: DVec3,
    corners: &[Vec3; 3],
    rays: &PreparedRays8,
) -> TriangleHits8<S> {
    let zero = s.splat_f64(0.0);
    let [across, beside] = [load3_f64(s, &rays.across[0]), load3_f64(s, &rays.across[1])];
    let direction = load3_f64(s, &rays.direction);
    let (mut x, mut y, mut z) = ([zero; 3], [zero; 3], [zero; 3]);
    for corner in 0..3 {
        let offset = splat3_f64(s, corners[corner].as_dvec3() - origin);
        x[corner] = dot_f64(s, offset, across);
        y[corner] = dot_f64(s, offset, beside);
        z[corner] = dot_f64(s, offset, direction);
    }
    let products = [
        s.mul_f64(x[2], y[1]),
        s.mul_f64(x[0], y[2]),
        s.mul_f64(x[1], y[0]),
    ];
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
    let depth = s.sub_f64(
        s.max_f64(s.max_f64(z[0], z[1]), z[2]),
        s.min_f64(s.min_f64(z[0], z[1]), z[2]),
    );
    let is_well_conditioned = s.at_least_f64(
        s.abs_f64(determinant),
        s.mul_f64(s.mul_f64(sizes, depth), s.splat_f64(EDGE_ON_RATIO)),
    );
    let hits = s.greater_f64(s.abs_f64(determinant), zero) & !(below & above);
    let inverse = s.div_f64(s.splat_f64(1.0), determinant);
    let (u, v, w) = (
        s.mul_f64(u, inverse),
        s.mul_f64(v, inverse),
        s.mul_f64(w, inverse),
    );
    let along = s.add_f64(
        s.add_f64(s.mul_f64(z[0], u), s.mul_f64(z[1], v)),
        s.mul_f64(z[2], w),
    );
    TriangleHits8 {
        hits,
        outside: s.greater_f64(determinant, zero),
        unsure: !(sure & is_well_conditioned) & 0xff,
        t: s.narrow(s.mul_f64(along, s.load_f64(&rays.inverse_length_squared))),
        weights: [s.narrow(v), s.narrow(w)],
    }
}

/// Terms of the filter for eight triangles, one per lane. They depend only on the rays' common
/// origin.
struct CommonOriginTerms8 {
    u: [[f32; WIDTH]; 3],
    v: [[f32; WIDTH]; 3],
    normal: [[f32; WIDTH]; 3],
    distance: [f32; WIDTH],
    /// Error bounds as in [`ErrorBounds`]: `weight`, `determinant`, `before` and `beyond`, one
    /// value per lane.
    errors: [[f32; WIDTH]; 4],
    /// Mask of the triangles that some ray may hit.
    lanes: u32,
}

/// Broadcasts the vector of one lane to all lanes.
#[inline(always)]
fn splat_vector_of_lane<S: Simd>(s: S, v: &[[f32; WIDTH]; 3], lane: usize) -> [S::Floats; 3] {
    splat_vector(s, [v[0][lane], v[1][lane], v[2][lane]])
}

/// Copies eight vectors, one per lane, from registers to an array for each component.
#[inline(always)]
fn store_vector_lanes<S: Simd>(s: S, v: [S::Floats; 3]) -> [[f32; WIDTH]; 3] {
    [s.to_array(v[0]), s.to_array(v[1]), s.to_array(v[2])]
}

impl CommonOriginTerms8 {
    /// Computes the terms of a block's triangles, for hits at distances up to `far`.
    #[inline(always)]
    fn new<S: Simd>(s: S, bundle: &RayBundle<S>, block: &Triangle8, far: f32) -> Self {
        let a = load_corner(s, block, 0);
        let (ab, ac) = (
            sub3(s, load_corner(s, block, 1), a),
            sub3(s, load_corner(s, block, 2), a),
        );
        let from = sub3(s, a, bundle.origin);
        let (u, v, normal) = (cross(s, ac, from), cross(s, from, ab), cross(s, ab, ac));
        let w = sub3(s, sub3(s, normal, u), v);
        let ErrorBounds {
            weight,
            determinant,
            before,
            beyond,
            ..
        } = ErrorBounds::new(s, &bundle.bounds, from, &block.longest, far);
        let ([ul, ug], [vl, vg], [wl, wg]) = (
            bundle.dot_product_bounds(s, u),
            bundle.dot_product_bounds(s, v),
            bundle.dot_product_bounds(s, w),
        );
        let below = s.less(s.min(s.min(ug, vg), wg), s.negate(weight));
        let above = s.less(weight, s.max(s.max(ul, vl), wl));
        Self {
            u: store_vector_lanes(s, u),
            v: store_vector_lanes(s, v),
            normal: store_vector_lanes(s, normal),
            distance: s.to_array(dot(s, normal, from)),
            errors: [
                s.to_array(weight),
                s.to_array(determinant),
                s.to_array(before),
                s.to_array(beyond),
            ],
            lanes: !(below & above) & 0xff,
        }
    }

    /// Filters eight rays by the triangle in one lane. Returns the mask of the rays for which the
    /// exact test may find a hit within the range.
    #[inline(always)]
    fn filter_rays<S: Simd>(
        &self,
        s: S,
        lane: usize,
        directions: [S::Floats; 3],
        range: [S::Floats; 2],
    ) -> u32 {
        let u = dot(s, directions, splat_vector_of_lane(s, &self.u, lane));
        let v = dot(s, directions, splat_vector_of_lane(s, &self.v, lane));
        let along = dot(s, directions, splat_vector_of_lane(s, &self.normal, lane));
        let [weight, determinant, before, beyond] = &self.errors;
        let bounds = ErrorBounds {
            weight: s.splat(weight[lane]),
            determinant: s.splat(determinant[lane]),
            // Not used here, since a packet needs no certain hits.
            distance: s.splat(0.0),
            before: s.splat(before[lane]),
            beyond: s.splat(beyond[lane]),
        };
        filter_triangle_lanes(
            s,
            [u, v, along],
            s.splat(self.distance[lane]),
            range,
            bounds,
        )
        .lanes
    }
}

/// Intersects the packet with the triangles of a block: by the filter, then by the exact test of
/// the remaining triangles. `exact` is set at the first exact test.
#[inline(always)]
pub(super) fn intersect_triangle_block<S: Simd>(
    s: S,
    bvh: &Bvh8,
    number: usize,
    bundle: &RayBundle<S>,
    packet_state: &mut PacketState,
    exact: &mut Option<[PreparedRays8; GROUPS]>,
    visitor: &mut dyn PacketVisitor,
) {
    let origin_terms = CommonOriginTerms8::new(
        s,
        bundle,
        &bvh.blocks[number],
        max_far_distance(packet_state),
    );
    for lane in MaskLanes(origin_terms.lanes) {
        for group in 0..GROUPS {
            let (first, [x, y, z]) = (group * WIDTH, &packet_state.directions);
            let directions = [
                s.load_from_index(x, first),
                s.load_from_index(y, first),
                s.load_from_index(z, first),
            ];
            let range = [bundle.near, s.load_from_index(&packet_state.far, first)];
            let candidate_rays =
                origin_terms.filter_rays(s, lane, directions, range) & packet_state.ray_mask(group);
            if candidate_rays != 0 {
                let rays = exact.get_or_insert_with(|| prepare_rays(packet_state));
                intersect_triangle_exactly(
                    s,
                    bvh,
                    [number, lane, group],
                    candidate_rays,
                    &rays[group],
                    packet_state,
                    visitor,
                );
            }
        }
    }
}

/// Intersects some rays of a group of eight with one triangle by the exact test, and records their
/// hits. `candidate_rays` is the mask of these rays.
#[inline(always)]
fn intersect_triangle_exactly<S: Simd>(
    s: S,
    bvh: &Bvh8,
    [number, lane, group]: [usize; 3],
    candidate_rays: u32,
    rays: &PreparedRays8,
    packet_state: &mut PacketState,
    visitor: &dyn PacketVisitor,
) {
    let triangle: Triangle<f32> = bvh.blocks[number].triangle(lane);
    let leaf_header = &bvh.leaf_headers[number];
    let crossings = intersect_eight_rays(
        s,
        Vec3::from(packet_state.origin).as_dvec3(),
        &triangle.vertices,
        rays,
    );
    let (mut outside, mut hits) = (crossings.outside, crossings.hits & candidate_rays);
    let (mut t, [mut u, mut v]) = (
        s.to_array(crossings.t),
        [
            s.to_array(crossings.weights[0]),
            s.to_array(crossings.weights[1]),
        ],
    );
    for ray in MaskLanes(crossings.unsure & candidate_rays) {
        let bit = 1 << ray;
        (hits, outside) = (hits & !bit, outside & !bit);
        if let Some(crossing) =
            triangle.intersect_watertight(&PreparedRay::new(packet_state.ray(group * WIDTH + ray)))
        {
            hits |= bit;
            outside |= if crossing.from_outside { bit } else { 0 };
            (t[ray], u[ray], v[ray]) = (
                crossing.t as f32,
                crossing.weights[0] as f32,
                crossing.weights[1] as f32,
            );
        }
    }
    let bit = 1 << lane;
    if leaf_header.outside_only_lanes(packet_state.culls) & bit != 0 {
        hits &= outside;
    }
    if leaf_header.inside & bit != 0 {
        hits &= !outside;
    }
    for ray in MaskLanes(hits) {
        if packet_state.near < t[ray] {
            let slots = [leaf_header.first + lane as u32, u32::MAX];
            packet_state.record_hit(
                group * WIDTH + ray,
                [t[ray], u[ray], v[ray]],
                slots,
                |a, b| visitor.wins_tie(a, b),
            );
        }
    }
}
