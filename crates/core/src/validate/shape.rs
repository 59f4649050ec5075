//! Validation of shapes: sizes must be above zero, directions must have a length, and surfaces an
//! area.

use glam::DVec3;

use super::check::{SceneCheck, format_list};
use crate::scene::{Shape, Triple};

/// Sine of the angle between two edges below which the edges span no area.
const MIN_EDGE_SINE: f64 = 1e-12;

/// Whether two edges are so nearly parallel that they span no area. False for an edge of length
/// zero.
pub(crate) fn do_edges_span_no_area(u: DVec3, v: DVec3) -> bool {
    let (u, v) = (u.normalize_or_zero(), v.normalize_or_zero());
    u != DVec3::ZERO && v != DVec3::ZERO && u.cross(v).length() < MIN_EDGE_SINE
}

/// Checks a shape under the key of its kind. Every size, and the length of every direction, must be
/// above zero.
pub(super) fn check_shape(check: &mut SceneCheck<'_>, shape: &Shape) {
    match *shape {
        Shape::Mesh(ref name) => check.check_reference("mesh", name, "mesh", |names| &names.meshes),
        Shape::Plane { point, normal } => check.with_key("plane", |check| {
            check.require_point("point", point);
            check.require_direction("normal", normal);
        }),
        Shape::Disk {
            centre,
            normal,
            radius,
        } => check.with_key("disk", |check| {
            check.require_point("centre", centre);
            check.require_direction("normal", normal);
            check.require_length("radius", radius);
        }),
        Shape::Quad {
            corner,
            edge_u,
            edge_v,
        } => check.with_key("quad", |check| {
            check.require_point("corner", corner);
            check.require_direction("edge_u", edge_u);
            check.require_direction("edge_v", edge_v);
            if do_edges_span_no_area(edge_u.into(), edge_v.into()) {
                check.report(
                    "edge_v",
                    "`edge_u` and `edge_v` lie on one line, so the quad has no area",
                );
            }
        }),
        Shape::Box { min, max } => {
            check.with_key("box", |check| check_box_corners(check, min, max, false))
        }
        Shape::Triangle { vertices } => check.with_key("triangle", |check| {
            check.check_each_element("vertices", &vertices, |check, vertex| {
                check.require_point("", *vertex)
            });
            let [a, b, c] = vertices.map(DVec3::from);
            if a == b || b == c || c == a || do_edges_span_no_area(b - a, c - a) {
                check.report(
                    "vertices",
                    "the corners lie on one line, so the triangle has no area",
                );
            }
        }),
        _ => check_round_shape(check, shape),
    }
}

/// Checks a quadric or a torus under the key of its kind.
fn check_round_shape(check: &mut SceneCheck<'_>, shape: &Shape) {
    match *shape {
        Shape::Sphere { centre, radius } => check.with_key("sphere", |check| {
            check.require_point("centre", centre);
            check.require_length("radius", radius);
        }),
        Shape::Cylinder {
            base,
            axis,
            radius,
            height,
            ..
        } => check.with_key("cylinder", |check| {
            check.require_point("base", base);
            check.require_direction("axis", axis);
            check.require_length("radius", radius);
            // An infinite cylinder has no height.
            check.require_optional_length("height", height);
        }),
        Shape::Cone {
            base,
            axis,
            radius,
            top_radius,
            height,
        } => check.with_key("cone", |check| {
            check.require_point("base", base);
            check.require_direction("axis", axis);
            check.require_length("radius", radius);
            check.require_length("height", height);
            // A top radius of zero is a tip.
            check.require_optional_length("top_radius", Some(top_radius).filter(|r| *r != 0.0));
        }),
        Shape::Ellipsoid { centre, semi_axes } => check.with_key("ellipsoid", |check| {
            check.require_point("centre", centre);
            check.check_each_element("semi_axes", &semi_axes, |check, semi_axis| {
                check.require_length("", *semi_axis)
            });
        }),
        Shape::Hyperboloid {
            centre,
            waist_radius,
            c,
            half_height,
        } => check.with_key("hyperboloid", |check| {
            check.require_point("centre", centre);
            check.require_length("waist_radius", waist_radius);
            check.require_length("c", c);
            check.require_length("half_height", half_height);
        }),
        Shape::Paraboloid {
            apex,
            radius,
            height,
        } => check.with_key("paraboloid", |check| {
            check.require_point("apex", apex);
            check.require_length("radius", radius);
            check.require_length("height", height);
        }),
        Shape::Torus {
            centre,
            axis,
            major_radius,
            minor_radius,
        } => check.with_key("torus", |check| {
            check.require_point("centre", centre);
            check.require_direction("axis", axis);
            check.require_length("major_radius", major_radius);
            check.require_length("minor_radius", minor_radius);
            if minor_radius >= major_radius {
                check.report(
                    "minor_radius",
                    format!("`minor_radius` must be below `major_radius`, which is {major_radius}"),
                );
            }
        }),
        _ => {}
    }
}

/// Checks two corners of a box: `max` must be above `min` in every axis. If `may_touch`, as for a
/// scatter generator, the corners may also be equal.
pub(super) fn check_box_corners(
    check: &mut SceneCheck<'_>,
    min: Triple,
    max: Triple,
    may_touch: bool,
) {
    check.require_point("min", min);
    check.with_key("max", |check| {
        check.require_point("", max);
        let ordered = |low: f64, high: f64| low < high || may_touch && low == high;
        let finite = min.iter().chain(&max).all(|x| x.is_finite());
        if finite && !min.iter().zip(&max).all(|(low, high)| ordered(*low, *high)) {
            let words = if may_touch {
                "not be below"
            } else {
                "be above"
            };
            check.report(
                "",
                format!(
                    "`max` must {words} `min` in every axis; `min` is {}",
                    format_list(&min)
                ),
            );
        }
    });
}
