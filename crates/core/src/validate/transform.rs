//! Validation of affine transforms. A singular transform is refused, because it would flatten the
//! object.

use glam::{DMat3, DVec3};

use super::MAX_COORDINATE;
use super::check::{SceneCheck, format_list};
use crate::affine::affine_from_steps;
use crate::scene::TransformStep;

/// Range of the absolute values of scale factors.
const SCALES: std::ops::RangeInclusive<f64> = 1e-15..=1e15;

/// Least absolute volume of the parallelepiped that the normalised rows of a matrix span. With a
/// smaller volume, the matrix counts as singular.
const MIN_ROW_VOLUME: f64 = 1e-12;

/// Checks the transform steps under a key of an object.
pub(super) fn check_transform_steps(
    check: &mut SceneCheck<'_>,
    key: &str,
    steps: &[TransformStep],
) {
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
