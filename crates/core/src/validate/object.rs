//! Validation of objects (references and transforms), models and generators.

use glam::{DMat3, DVec3};

use super::check::{SceneCheck, format_list};
use super::{MAX_COORDINATE, motion};
use crate::affine::affine_from_steps;
use crate::scene::{Generator, GeneratorKind, ModelFile, Object, Shape, TransformStep, Triple};

/// Checks an object: its shape, material, transforms and motion.
pub(super) fn check_object(check: &mut SceneCheck<'_>, object: &Object) {
    check.with_key("shape", |check| check_shape(check, &object.shape));
    check.check_reference("material", &object.material, "material", |names| {
        &names.materials
    });
    let before = check.problem_count();
    check_transform_steps(check, "transform", &object.transform);
    if let Some(end) = &object.transform_end {
        check_transform_steps(check, "transform_end", end);
    }
    if check.problem_count() == before {
        motion::check_object_motion(check, object);
    }
}

/// Checks a model: its file, time, transform and materials.
pub(super) fn check_model_file(check: &mut SceneCheck<'_>, model: &ModelFile) {
    if model.file.is_empty() {
        check.report("file", "`file` must name a file");
    }
    check.require_finite("time", model.time.unwrap_or_default());
    check_transform_steps(check, "transform", &model.transform);
    check.with_key("materials", |check| {
        model.materials.iter().for_each(|(own, name)| {
            check.check_reference(own, name, "material", |names| &names.materials)
        });
    });
}

/// Checks a generator: its kind and its object.
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

// Validation of shapes: sizes must be above zero, directions must have a length, and surfaces an
// area.

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
fn check_shape(check: &mut SceneCheck<'_>, shape: &Shape) {
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

// Validation of affine transforms. A singular transform is refused, because it would flatten the
// object.

/// Range of the absolute values of scale factors.
const SCALES: std::ops::RangeInclusive<f64> = 1e-15..=1e15;

/// Least absolute volume of the parallelepiped that the normalised rows of a matrix span. With a
/// smaller volume, the matrix counts as singular.
const MIN_ROW_VOLUME: f64 = 1e-12;

/// Checks the transform steps under a key of an object.
fn check_transform_steps(check: &mut SceneCheck<'_>, key: &str, steps: &[TransformStep]) {
    let before = check.problem_count();
    check.check_each_element(key, steps, |check, step| match *step {
        TransformStep::Translate(offset) => check.require_point("translate", offset),
        TransformStep::Scale(factors) => check.with_key("scale", |check| {
            if factors.contains(&0.0) {
                let factors = format_list(&factors);
                check.report("", format!("no factor of `scale` may be zero, as in {factors}: the object would have no extent"));
            } else if !factors.iter().all(|factor| SCALES.contains(&factor.abs())) {
                check.report("", format!("each factor of `scale` must have an absolute value from 1e-15 to 1e15, not {}", format_list(&factors)));
            }
        }),
        TransformStep::Rotate { axis, degrees } => check.with_key("rotate", |check| {
            check.require_direction("axis", axis);
            check.require_finite("degrees", degrees);
        }),
        TransformStep::Matrix(rows) => check.with_key("matrix", |check| check_matrix(check, &rows)),
    });
    // Steps that are valid one by one can combine to an extreme scale.
    let whole = affine_from_steps(steps);
    if check.problem_count() == before
        && !(whole.is_finite()
            && whole.inverse().is_finite()
            && whole.translation.abs().max_element() <= MAX_COORDINATE)
    {
        check.report(key, format!(
                "the steps of `{key}` together flatten the object, or move it farther than 1e15: use less extreme factors"
            ));
    }
}

fn check_matrix(check: &mut SceneCheck<'_>, rows: &[[f64; 4]; 3]) {
    if !rows.iter().flatten().all(|x| x.abs() <= 1e15) {
        check.report(
            "",
            "each entry of `matrix` must be finite and from -1e15 to 1e15",
        );
        return;
    }
    let unit = |row: [f64; 4]| DVec3::new(row[0], row[1], row[2]).normalize_or_zero();
    let volume = DMat3::from_cols(unit(rows[0]), unit(rows[1]), unit(rows[2])).determinant();
    if volume.abs() < MIN_ROW_VOLUME {
        let hint = "the first three columns of `matrix` must be linearly independent";
        check.report_with_hint(
            "",
            "`matrix` is singular, so it would flatten the object",
            hint,
        );
    }
}
