//! Ray origins near the border of a flat face under affine maps: they are moved inwards, so that a
//! ray starts on its own side of adjacent faces.
//!
//! A face does not know its neighbours. Its ray origins clear every neighbour that joins it at no
//! less than 45° in object space. The move is the shortest in world space, since a face may be a
//! million times as long as it is wide. A face smaller than the error of its points has no such
//! origin, and its origins stay.

use super::spawn_offset::SpawnOffset;
use super::{SurfacePoint, TransformChain};
use crate::scalar::Real;
use glam::DVec3;

/// Region spanned by two edges.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Face {
    Triangle,
    Parallelogram,
}

/// The surface of a face spanned by two edges, at coordinates `at`, with ray origins moved off the
/// border.
#[inline(never)]
pub(super) fn off_border<R: Real>(
    surface_point: SurfacePoint,
    face: Face,
    [ab, ac]: [DVec3; 2],
    at: [f64; 2],
    transform_chain: TransformChain<'_>,
) -> SurfacePoint {
    let ([u, v], normal) = (at, ab.cross(ac));
    let inverse = 1.0 / normal.dot(normal);
    let (by_u, by_v) = (ac.cross(normal) * inverse, normal.cross(ab) * inverse);
    let by_both = by_u + by_v;
    let spawn_offset = SpawnOffset::around::<R>(
        Some(transform_chain),
        surface_point.point,
        surface_point.error,
    );
    let reach = spawn_offset.max_offset() * 2.0;
    let is_far = |share: f64, gradient: DVec3| {
        share > 0.0 && share * share > reach * reach * gradient.dot(gradient)
    };
    let opposite = if face == Face::Triangle {
        is_far(1.0 - u - v, by_both)
    } else {
        is_far(1.0 - u, by_u) && is_far(1.0 - v, by_v)
    };
    if is_far(u, by_u) && is_far(v, by_v) && opposite {
        return surface_point;
    }
    // The margin also covers the drift off the face itself, so that the origin stays behind a
    // neighbour that leans over the face.
    let lean = spawn_offset.offset_along(surface_point.normal);
    let least = [by_u, by_v, by_both]
        .map(|gradient| spawn_offset.offset_along(gradient) + lean * gradient.length());
    let within = if face == Face::Triangle {
        within_triangle
    } else {
        within_parallelogram
    };
    let kept = within(
        at,
        [spawn_offset.in_world(by_u), spawn_offset.in_world(by_v)],
        least,
    );
    let start = surface_point.point + ab * (kept[0] - u) + ac * (kept[1] - v);
    SurfacePoint {
        above: start,
        below: start,
        ..surface_point
    }
}

/// The nearest coordinates whose shares are at least `least`; the shares are both coordinates and
/// that of the third corner. Distances are measured by the gradients in world space.
fn within_triangle([u, v]: [f64; 2], [by_u, by_v]: [DVec3; 2], least: [f64; 3]) -> [f64; 2] {
    let gradients = [by_u, by_v, -(by_u + by_v)];
    let mut shares = [u, v, 1.0 - u - v];
    let lack = |shares: &[f64; 3], i: usize| least[i] - shares[i];
    let mut near = 0;
    for i in 1..3 {
        near = if lack(&shares, i) > lack(&shares, near) {
            i
        } else {
            near
        };
    }
    let lacks = lack(&shares, near);
    let has_room = least[0] + least[1] + least[2] < 1.0;
    if !has_room || lacks <= 0.0 {
        return [u, v];
    }
    // Straight away from the nearest edge.
    let step = lacks / gradients[near].dot(gradients[near]);
    for i in 0..3 {
        shares[i] += gradients[i].dot(gradients[near]) * step;
    }
    for i in (0..3).filter(|&i| i != near) {
        if lack(&shares, i) > 0.0 {
            // Near a corner: at the required distance from both edges there.
            (shares[near], shares[i]) = (least[near], least[i]);
            shares[3 - near - i] = 1.0 - least[near] - least[i];
            break;
        }
    }
    [shares[0], shares[1]]
}

/// The nearest coordinates at least `least` away from all four sides.
fn within_parallelogram(
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
    // A step straight away from one side also changes the other coordinate.
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
