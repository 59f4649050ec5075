//! Validation of objects (references and transforms), models and generators.

use super::check::SceneCheck;
use super::shape::{check_box_corners, check_shape};
use super::{motion, transform};
use crate::scene::{Generator, GeneratorKind, ModelFile, Object};

/// Checks an object: its shape, material, transforms and motion.
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

/// Checks a model: its file, time, transform and materials.
pub(super) fn check_model_file(check: &mut SceneCheck<'_>, model: &ModelFile) {
    if model.file.is_empty() {
        check.report("file", "`file` must name a file");
    }
    check.require_finite("time", model.time.unwrap_or_default());
    transform::check_transform_steps(check, "transform", &model.transform);
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
