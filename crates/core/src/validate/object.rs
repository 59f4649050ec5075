//! Validation of objects (shapes, references and transforms), models and generators.

use glam::DVec3;

use super::check::{SceneCheck, format_list};
use super::{motion, transform};
use crate::scene::{Generator, GeneratorKind, ModelFile, Object, Shape, Triple};

/// Sine of the angle between two edges below which the edges span no area.
const MIN_EDGE_SINE: f64 = 1e-12;

/// Whether two edges of a length above zero are so nearly parallel that they span no area.
pub(crate) fn spans_no_area(u: DVec3, v: DVec3) -> bool {
    let (u, v) = (u.normalize_or_zero(), v.normalize_or_zero());
    u != DVec3::ZERO && v != DVec3::ZERO && u.cross(v).length() < MIN_EDGE_SINE
}

pub(super) fn check_object(check: &mut SceneCheck<'_>, object: &Object) {
    check.with_key("shape", |check| check_shape(check, &object.shape));
    check.check_reference("material", &object.material, "material", |names| {
        &names.materials
    });
    let before = check.problem_count();
    transform::check_transform_steps(check, "transform", &object.transform);
    if let Some(end) = &object.transform_end {
        transform::check_transform_steps(check, "transform_end", end);
    }
    if check.problem_count() == before {
        motion::check_object_motion(check, object);
    }
}

pub(super) fn check_model_file(check: &mut SceneCheck<'_>, model: &ModelFile) {
    if model.file.is_empty() {
        check.with_key("file", |check| {
            check.report_problem("`file` must name a file")
        });
    }
    check.require_finite("time", model.time.unwrap_or_default());
    transform::check_transform_steps(check, "transform", &model.transform);
    check.with_key("materials", |check| {
        model.materials.iter().for_each(|(own, name)| {
            check.check_reference(own, name, "material", |names| &names.materials)
        });
    });
}

pub(super) fn check_generator(check: &mut SceneCheck<'_>, generator: &Generator) {
    check.with_key("kind", |check| match generator.kind {
        GeneratorKind::Grid {
            counts,
            origin,
            step,
        } => check.with_key("grid", |check| {
            check.check_each_element("counts", &counts, |check, count| {
                check.require_count_within("", *count, 1, u32::MAX)
            });
            check.require_point("origin", origin);
            check.require_point("step", step);
        }),
        GeneratorKind::Scatter {
            count, min, max, ..
        } => check.with_key("scatter", |check| {
            check.require_count_within("count", count, 1, u32::MAX);
            check_box_corners(check, min, max, true);
        }),
    });
    check.with_key("object", |check| check_object(check, &generator.object));
}

/// Checks a shape: every size, and the length of every direction, must be above zero.
fn check_shape(check: &mut SceneCheck<'_>, shape: &Shape) {
    match *shape {
        Shape::Mesh(ref name) => check.check_reference("mesh", name, "mesh", |names| &names.meshes),
        Shape::Sphere { centre, radius } => check.with_key("sphere", |check| {
            check.require_point("centre", centre);
            check.require_length("radius", radius);
        }),
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
        } => check.with_key("quad", |check| check_quad(check, corner, edge_u, edge_v)),
        Shape::Box { min, max } => {
            check.with_key("box", |check| check_box_corners(check, min, max, false))
        }
        Shape::Cylinder {
            base,
            axis,
            radius,
            height,
            ..
        } => check.with_key("cylinder", |check| {
            // An infinite cylinder has no height, and the default value passes the check.
            check_axis_shape(
                check,
                base,
                axis,
                &[("radius", radius), ("height", height.unwrap_or(1.0))],
            );
        }),
        Shape::Cone {
            base,
            axis,
            radius,
            top_radius,
            height,
        } => check.with_key("cone", |check| {
            check_axis_shape(check, base, axis, &[("radius", radius), ("height", height)]);
            // A top radius of zero is a tip, which is valid.
            if top_radius != 0.0 {
                check.require_length("top_radius", top_radius);
            }
        }),
        Shape::Ellipsoid { centre, semi_axes } => check.with_key("ellipsoid", |check| {
            check.require_point("centre", centre);
            check.check_each_element("semi_axes", &semi_axes, |check, half| {
                check.require_length("", *half)
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
        } => {
            check.with_key("torus", |check| {
                check_torus(check, centre, axis, major_radius, minor_radius)
            });
        }
        Shape::Triangle { vertices } => {
            check.with_key("triangle", |check| check_triangle(check, &vertices))
        }
    }
}

fn check_axis_shape(
    check: &mut SceneCheck<'_>,
    base: Triple,
    axis: Triple,
    lengths: &[(&str, f64)],
) {
    check.require_point("base", base);
    check.require_direction("axis", axis);
    for (key, length) in lengths {
        check.require_length(key, *length);
    }
}

fn check_torus(
    check: &mut SceneCheck<'_>,
    centre: Triple,
    axis: Triple,
    major_radius: f64,
    minor_radius: f64,
) {
    check.require_point("centre", centre);
    check.require_direction("axis", axis);
    check.require_length("major_radius", major_radius);
    check.require_length("minor_radius", minor_radius);
    if minor_radius >= major_radius {
        let message =
            format!("`minor_radius` must be below `major_radius`, which is {major_radius}");
        check.with_key("minor_radius", |check| check.report_problem(message));
    }
}

fn check_quad(check: &mut SceneCheck<'_>, corner: Triple, edge_u: Triple, edge_v: Triple) {
    check.require_point("corner", corner);
    check.require_direction("edge_u", edge_u);
    check.require_direction("edge_v", edge_v);
    if spans_no_area(edge_u.into(), edge_v.into()) {
        check.with_key("edge_v", |check| {
            check.report_problem("`edge_u` and `edge_v` lie on one line, so the quad has no area")
        });
    }
}

fn check_triangle(check: &mut SceneCheck<'_>, vertices: &[Triple; 3]) {
    check.check_each_element("vertices", vertices, |check, vertex| {
        check.require_point("", *vertex)
    });
    let [a, b, c] = vertices.map(DVec3::from);
    if a == b || b == c || c == a || spans_no_area(b - a, c - a) {
        check.with_key("vertices", |check| {
            check.report_problem("the corners lie on one line, so the triangle has no area")
        });
    }
}

/// Checks two corners of a box: `max` must be above `min` in every axis. If `may_touch`, as for a
/// scatter generator, the corners may also be equal.
fn check_box_corners(check: &mut SceneCheck<'_>, min: Triple, max: Triple, may_touch: bool) {
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
