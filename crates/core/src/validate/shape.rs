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
        Shape::Sphere { centre, radius } => check_sphere(check, centre, radius),
        Shape::Plane { point, normal } => check_plane(check, point, normal),
        Shape::Disk {
            centre,
            normal,
            radius,
        } => check_disk(check, centre, normal, radius),
        Shape::Quad {
            corner,
            edge_u,
            edge_v,
        } => check_quad(check, corner, edge_u, edge_v),
        Shape::Box { min, max } => {
            check.with_key("box", |check| check_box_corners(check, min, max, false))
        }
        Shape::Cylinder {
            base,
            axis,
            radius,
            height,
            ..
        } => check_cylinder(check, base, axis, radius, height),
        Shape::Cone {
            base,
            axis,
            radius,
            top_radius,
            height,
        } => check_cone(check, base, axis, [radius, top_radius], height),
        Shape::Ellipsoid { centre, semi_axes } => check_ellipsoid(check, centre, &semi_axes),
        Shape::Hyperboloid {
            centre,
            waist_radius,
            c,
            half_height,
        } => check_hyperboloid(check, centre, waist_radius, c, half_height),
        Shape::Paraboloid {
            apex,
            radius,
            height,
        } => check_paraboloid(check, apex, radius, height),
        Shape::Torus {
            centre,
            axis,
            major_radius,
            minor_radius,
        } => check_torus(check, centre, axis, major_radius, minor_radius),
        Shape::Triangle { vertices } => check_triangle(check, &vertices),
    }
}

/// Checks a sphere: its radius is above zero.
fn check_sphere(check: &mut SceneCheck<'_>, centre: Triple, radius: f64) {
    check.with_key("sphere", |check| {
        check.require_point("centre", centre);
        check.require_length("radius", radius);
    });
}

/// Checks a plane: its normal has a length.
fn check_plane(check: &mut SceneCheck<'_>, point: Triple, normal: Triple) {
    check.with_key("plane", |check| {
        check.require_point("point", point);
        check.require_direction("normal", normal);
    });
}

/// Checks a disk: its normal has a length, and its radius is above zero.
fn check_disk(check: &mut SceneCheck<'_>, centre: Triple, normal: Triple, radius: f64) {
    check.with_key("disk", |check| {
        check.require_point("centre", centre);
        check.require_direction("normal", normal);
        check.require_length("radius", radius);
    });
}

/// Checks a cylinder. An infinite cylinder has no height.
fn check_cylinder(
    check: &mut SceneCheck<'_>,
    base: Triple,
    axis: Triple,
    radius: f64,
    height: Option<f64>,
) {
    check.with_key("cylinder", |check| {
        check.require_point("base", base);
        check.require_direction("axis", axis);
        check.require_length("radius", radius);
        if let Some(height) = height {
            check.require_length("height", height);
        }
    });
}

/// Checks a cone. A top radius of zero is a tip, which is valid.
fn check_cone(
    check: &mut SceneCheck<'_>,
    base: Triple,
    axis: Triple,
    [radius, top_radius]: [f64; 2],
    height: f64,
) {
    check.with_key("cone", |check| {
        check.require_point("base", base);
        check.require_direction("axis", axis);
        check.require_length("radius", radius);
        check.require_length("height", height);
        if top_radius != 0.0 {
            check.require_length("top_radius", top_radius);
        }
    });
}

/// Checks an ellipsoid: all semi-axes are above zero.
fn check_ellipsoid(check: &mut SceneCheck<'_>, centre: Triple, semi_axes: &Triple) {
    check.with_key("ellipsoid", |check| {
        check.require_point("centre", centre);
        check.check_each_element("semi_axes", semi_axes, |check, semi_axis| {
            check.require_length("", *semi_axis)
        });
    });
}

/// Checks a hyperboloid. `c` is the constant of its equation that sets the slope.
fn check_hyperboloid(
    check: &mut SceneCheck<'_>,
    centre: Triple,
    waist_radius: f64,
    c: f64,
    half_height: f64,
) {
    check.with_key("hyperboloid", |check| {
        check.require_point("centre", centre);
        check.require_length("waist_radius", waist_radius);
        check.require_length("c", c);
        check.require_length("half_height", half_height);
    });
}

/// Checks a paraboloid: its radius and its height are above zero.
fn check_paraboloid(check: &mut SceneCheck<'_>, apex: Triple, radius: f64, height: f64) {
    check.with_key("paraboloid", |check| {
        check.require_point("apex", apex);
        check.require_length("radius", radius);
        check.require_length("height", height);
    });
}

/// Checks a torus: the radius of its tube is below the radius of its ring.
fn check_torus(
    check: &mut SceneCheck<'_>,
    centre: Triple,
    axis: Triple,
    major_radius: f64,
    minor_radius: f64,
) {
    check.with_key("torus", |check| {
        check.require_point("centre", centre);
        check.require_direction("axis", axis);
        check.require_length("major_radius", major_radius);
        check.require_length("minor_radius", minor_radius);
        if minor_radius >= major_radius {
            let message =
                format!("`minor_radius` must be below `major_radius`, which is {major_radius}");
            check.with_key("minor_radius", |check| check.report_problem(message));
        }
    });
}

/// Checks a quad: its edges span an area.
fn check_quad(check: &mut SceneCheck<'_>, corner: Triple, edge_u: Triple, edge_v: Triple) {
    check.with_key("quad", |check| {
        check.require_point("corner", corner);
        check.require_direction("edge_u", edge_u);
        check.require_direction("edge_v", edge_v);
        if do_edges_span_no_area(edge_u.into(), edge_v.into()) {
            check.with_key("edge_v", |check| {
                check.report_problem(
                    "`edge_u` and `edge_v` lie on one line, so the quad has no area",
                )
            });
        }
    });
}

/// Checks a triangle: its corners do not lie on one line.
fn check_triangle(check: &mut SceneCheck<'_>, vertices: &[Triple; 3]) {
    check.with_key("triangle", |check| {
        check.check_each_element("vertices", vertices, |check, vertex| {
            check.require_point("", *vertex)
        });
        let [a, b, c] = vertices.map(DVec3::from);
        if a == b || b == c || c == a || do_edges_span_no_area(b - a, c - a) {
            check.with_key("vertices", |check| {
                check.report_problem("the corners lie on one line, so the triangle has no area")
            });
        }
    });
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
            check.report_problem(format!(
                "`max` must {words} `min` in every axis; `min` is {}",
                format_list(&min)
            ));
        }
    });
}
