//! Ray origins near the border of a flat face under affine maps. Such origins are moved towards the
//! inside of the face. So each rounded origin stays on its side of the adjacent faces.
//!
//! A face has no data about its neighbours. After the move, its ray origins clear every neighbour
//! that joins the face at 45° or more in object space. The move is the shortest in world space,
//! since a face may be a million times as long as wide. On a face smaller than the error of its
//! points no origin is safe, so the origins stay in place.

use super::spawn_offset::SpawnOffset;
use super::{SurfacePoint, TransformChain};
use crate::scalar::Real;
use glam::DVec3;

/// Kind of a flat face that is spanned by two edges from one corner.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum FaceKind {
    Triangle,
    Parallelogram,
}

/// Returns the surface point with its ray origins moved away from the border of the face. The edges
/// `ab` and `ac` span the face in object space. `at` is the point's position, as fractions of these
/// edges.
#[inline(never)]
pub(super) fn move_ray_origins_off_border<R: Real>(
    surface_point: SurfacePoint,
    face: FaceKind,
    [ab, ac]: [DVec3; 2],
    at: [f64; 2],
    transform_chain: TransformChain<'_>,
) -> SurfacePoint {
    let ([u, v], normal) = (at, ab.cross(ac));
    let inverse = 1.0 / normal.dot(normal);
    let (by_u, by_v) = (ac.cross(normal) * inverse, normal.cross(ab) * inverse);
    let by_both = by_u + by_v;
    let spawn_offset = SpawnOffset::from_surface_error::<R>(
        Some(transform_chain),
        surface_point.point,
        surface_point.error,
    );
    let reach = spawn_offset.max_offset() * 2.0;
    let is_far = |share: f64, gradient: DVec3| {
        share > 0.0 && share * share > reach * reach * gradient.dot(gradient)
    };
    let opposite = if face == FaceKind::Triangle {
        is_far(1.0 - u - v, by_both)
    } else {
        is_far(1.0 - u, by_u) && is_far(1.0 - v, by_v)
    };
    if is_far(u, by_u) && is_far(v, by_v) && opposite {
        return surface_point;
    }
    // The margin also covers the offset of the origin along the face's normal, so that the origin
    // stays inside a neighbour that leans over the face.
    let lean = spawn_offset.offset_along(surface_point.normal);
    let minimum_shares = [by_u, by_v, by_both]
        .map(|gradient| spawn_offset.offset_along(gradient) + lean * gradient.length());
    let within = if face == FaceKind::Triangle {
        move_weights_into_triangle
    } else {
        clamp_to_parallelogram
    };
    let kept = within(
        at,
        [
            spawn_offset.gradient_to_world(by_u),
            spawn_offset.gradient_to_world(by_v),
        ],
        minimum_shares,
    );
    let start = surface_point.point + ab * (kept[0] - u) + ac * (kept[1] - v);
    SurfacePoint {
        above: start,
        below: start,
        ..surface_point
    }
}

/// Moves barycentric weights, by the shortest way, to weights that are at least `least`. `u` and
/// `v` are the weights of the second and third corner. `by_u` and `by_v` are the gradients of `u`
/// and `v` in world space, where distances are measured. If no weights satisfy `least`, the weights
/// stay.
fn move_weights_into_triangle(
    [u, v]: [f64; 2],
    [by_u, by_v]: [DVec3; 2],
    least: [f64; 3],
) -> [f64; 2] {
    let gradients = [by_u, by_v, -(by_u + by_v)];
    let mut shares = [u, v, 1.0 - u - v];
    let lack = |shares: &[f64; 3], i: usize| least[i] - shares[i];
    let mut nearest_edge = 0;
    for i in 1..3 {
        nearest_edge = if lack(&shares, i) > lack(&shares, nearest_edge) {
            i
        } else {
            nearest_edge
        };
    }
    let missing_share = lack(&shares, nearest_edge);
    let has_room = least[0] + least[1] + least[2] < 1.0;
    if !has_room || missing_share <= 0.0 {
        return [u, v];
    }
    // A step perpendicular to the nearest edge.
    let step = missing_share / gradients[nearest_edge].dot(gradients[nearest_edge]);
    for i in 0..3 {
        shares[i] += gradients[i].dot(gradients[nearest_edge]) * step;
    }
    for i in (0..3).filter(|&i| i != nearest_edge) {
        if lack(&shares, i) > 0.0 {
            // Near a corner the point gets the required distance from both edges that end at the
            // corner.
            (shares[nearest_edge], shares[i]) = (least[nearest_edge], least[i]);
            shares[3 - nearest_edge - i] = 1.0 - least[nearest_edge] - least[i];
            break;
        }
    }
    [shares[0], shares[1]]
}

/// Moves coordinates in [0, 1]², by the shortest way, to coordinates at least `least_u` from u = 0
/// and u = 1, and at least `least_v` from v = 0 and v = 1. `by_u` and `by_v` are the gradients of u
/// and v in world space, where distances are measured. If no coordinates satisfy both, they stay.
fn clamp_to_parallelogram(
    [u, v]: [f64; 2],
    [by_u, by_v]: [DVec3; 2],
    [least_u, least_v, _]: [f64; 3],
) -> [f64; 2] {
    let has_room = least_u < 0.5 && least_v < 0.5;
    if !has_room {
        return [u, v];
    }
    let kept = |share: f64, minimum: f64| share.max(minimum).min(1.0 - minimum);
    let (to_u, to_v) = (kept(u, least_u) - u, kept(v, least_v) - v);
    // A step perpendicular to one pair of sides also changes the coordinate of the other pair.
    let both = by_u.dot(by_v);
    let with_u = if to_v == 0.0 {
        to_u * (both / by_u.dot(by_u))
    } else {
        to_v
    };
    let with_v = if to_u == 0.0 {
        to_v * (both / by_v.dot(by_v))
    } else {
        to_u
    };
    [kept(u + with_v, least_u), kept(v + with_u, least_v)]
}
