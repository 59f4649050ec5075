//! Validation of affine transforms: a singular transform would flatten the object.

use glam::{DMat3, DVec3};

use super::FARTHEST;
use super::check::{SceneCheck, list};
use crate::affine::affine;
use crate::scene::TransformStep;

/// Range of absolute scale factors.
const SCALES: std::ops::RangeInclusive<f64> = 1e-15..=1e15;

/// Least volume that the normalised rows of a matrix must span. With a smaller volume, the matrix
/// counts as singular.
const FLAT: f64 = 1e-12;

/// Checks the transform steps under a key of an object.
pub(super) fn steps(check: &mut SceneCheck<'_>, key: &str, steps: &[TransformStep]) {
    let before = check.problems();
    check.each(key, steps, |check, step| match *step {
        TransformStep::Translate(offset) => check.point("translate", offset),
        TransformStep::Scale(factors) => check.with_key("scale", |check| {
            if factors.contains(&0.0) {
                let factors = list(&factors);
                check.report(format!("no factor of `scale` may be zero, as in {factors}: nothing would be left to see"));
            } else if !factors.iter().all(|factor| SCALES.contains(&factor.abs())) {
                check.report(format!("each factor of `scale` must be from 1e-15 to 1e15 or negative, not {}", list(&factors)));
            }
        }),
        TransformStep::Rotate { axis, degrees } => check.with_key("rotate", |check| {
            check.direction("axis", axis);
            check.finite("degrees", degrees);
        }),
        TransformStep::Matrix(rows) => check.with_key("matrix", |check| matrix(check, &rows)),
    });
    // Steps that are valid one by one can combine to an extreme scale.
    let whole = affine(steps);
    if check.problems() == before
        && !(whole.is_finite()
            && whole.inverse().is_finite()
            && whole.translation.abs().max_element() <= FARTHEST)
    {
        check.with_key(key, |check| {
            check.report(format!(
                "the steps of `{key}` together lead beyond every measure"
            ))
        });
    }
}

fn matrix(check: &mut SceneCheck<'_>, rows: &[[f64; 4]; 3]) {
    if !rows.iter().flatten().all(|x| x.abs() <= 1e15) {
        check.report("each entry of `matrix` must be finite and from -1e15 to 1e15");
        return;
    }
    let unit = |row: [f64; 4]| DVec3::new(row[0], row[1], row[2]).normalize_or_zero();
    let volume = DMat3::from_cols(unit(rows[0]), unit(rows[1]), unit(rows[2])).determinant();
    if volume.abs() < FLAT {
        let hint = "its first three columns must be linearly independent";
        check.advise(
            "`matrix` flattens space, so nothing would be left to see",
            hint,
        );
    }
}
