//! The affine map that the transform steps of an object combine to. Generators, validation,
//! preparation and importers use it.

use glam::{DAffine3, DMat3, DVec3};

use crate::scene::TransformStep;

/// Returns the affine map of a list of transform steps, which are applied in the order of the list.
pub fn affine_from_steps(steps: &[TransformStep]) -> DAffine3 {
    steps.iter().fold(DAffine3::IDENTITY, |map, step| {
        let next = match *step {
            TransformStep::Translate(v) => DAffine3::from_translation(v.into()),
            TransformStep::Scale(v) => DAffine3::from_scale(v.into()),
            TransformStep::Rotate { axis, degrees } => {
                DAffine3::from_axis_angle(DVec3::from(axis).normalize(), degrees.to_radians())
            }
            TransformStep::Matrix([x, y, z]) => DAffine3::from_mat3_translation(
                DMat3::from_cols_array_2d(&[
                    [x[0], y[0], z[0]],
                    [x[1], y[1], z[1]],
                    [x[2], y[2], z[2]],
                ]),
                DVec3::new(x[3], y[3], z[3]),
            ),
        };
        next * map
    })
}
