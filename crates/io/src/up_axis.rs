//! Up axis of models. A model whose up axis is not y is rotated as a whole. The studio, its ground
//! and the views are set up after this rotation.

use core::str::FromStr;

use glam::{DAffine3, DVec3};
use raywright_core::affine_from_steps;
use raywright_core::scene::{Camera, Light, LightKind, Pose, Scene, TransformStep, Triple};

/// Axis that points upwards in a model file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UpAxis {
    /// The axis of glTF.
    Y,
    /// The axis of 3D printers and most CAD programs.
    Z,
    /// The negative y axis: a model upside down.
    NegativeY,
    /// The negative z axis.
    NegativeZ,
    /// The positive x axis.
    X,
    /// The negative x axis.
    NegativeX,
}

impl UpAxis {
    /// All axes with their names.
    pub const NAMED: [(&'static str, Self); 6] = [
        ("y", Self::Y),
        ("z", Self::Z),
        ("-y", Self::NegativeY),
        ("-z", Self::NegativeZ),
        ("x", Self::X),
        ("-x", Self::NegativeX),
    ];

    /// Name of the axis.
    pub fn name(self) -> &'static str {
        Self::NAMED
            .iter()
            .find(|(_, axis)| *axis == self)
            .map_or("y", |(name, _)| name)
    }

    /// Returns the coordinate axis, 0 to 2, along which an axis of the file lies once the model is
    /// turned, and the sign of its direction there.
    pub(crate) fn turned_axis(self, axis: usize) -> (usize, f64) {
        let along = self.rotation_rows().map(|row| row[axis]);
        let turned = along.iter().position(|&x| x != 0.0).unwrap_or(axis);
        (turned, along[turned])
    }

    /// Returns the least and greatest corner, in the axes of the file, of a box of the turned model.
    pub fn bounds_in_file(self, [min, max]: [Triple; 2]) -> [Triple; 2] {
        let turned = [0, 1, 2].map(|axis| self.turned_axis(axis));
        let corner = |own: Triple, opposite: Triple| {
            turned.map(|(axis, sign)| {
                if sign > 0.0 {
                    own[axis]
                } else {
                    -opposite[axis]
                }
            })
        };
        [corner(min, max), corner(max, min)]
    }

    /// Returns the rows of the rotation that maps the axis to y. The rotation consists of quarter
    /// turns about x or z, so that coordinates are only permuted and negated, without rounding.
    fn rotation_rows(self) -> [[f64; 4]; 3] {
        let [x, y, z] = match self {
            Self::Y => [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            Self::Z => [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]],
            Self::NegativeY => [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]],
            Self::NegativeZ => [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]],
            Self::X => [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
            Self::NegativeX => [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
        };
        [x, y, z].map(|[a, b, c]| [a, b, c, 0.0])
    }
}

impl FromStr for UpAxis {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = Self::NAMED
            .iter()
            .find(|(name, _)| name.eq_ignore_ascii_case(text));
        found
            .map(|(_, axis)| *axis)
            .ok_or_else(|| format!("`{text}` is not an axis; choose y, z, x, -y, -z or -x"))
    }
}

/// Rotates the whole model so that an axis becomes y.
pub(crate) fn rotate_to_y_up(scene: &mut Scene, up: UpAxis) {
    if up == UpAxis::Y {
        return;
    }
    let step = TransformStep::Matrix(up.rotation_rows());
    let map = affine_from_steps(&[step]);
    for object in &mut scene.objects {
        object.transform.push(step);
        object
            .transform_end
            .iter_mut()
            .for_each(|end| end.push(step));
    }
    scene
        .lights
        .iter_mut()
        .for_each(|light| *light = transform_light(light, &map));
    for Camera { pose, pose_end, .. } in &mut scene.cameras {
        rotate_camera(pose, &map);
        pose_end.iter_mut().for_each(|end| rotate_camera(end, &map));
    }
}

/// Rotates a camera's pose. A pose given as an orbit is unchanged; it does not occur in models,
/// whose cameras are given by axes.
fn rotate_camera(pose: &mut Pose, map: &DAffine3) {
    let turn = |v: &mut Triple| *v = map.transform_vector3(DVec3::from(*v)).to_array();
    match pose {
        Pose::LookAt { eye, target, up } => [eye, target, up].map(turn),
        Pose::Axes {
            eye,
            right,
            up,
            back,
        } => {
            turn(eye);
            [right, up, back].map(turn)
        }
        Pose::Orbit { .. } => return,
    };
}

/// Transforms a light. Its intensity is unchanged, because in glTF the scale of a node does not
/// affect intensities.
pub(crate) fn transform_light(light: &Light, map: &DAffine3) -> Light {
    let mut light = light.clone();
    let point = |p: &mut Triple| *p = map.transform_point3(DVec3::from(*p)).to_array();
    let rotate = |d: &mut Triple| {
        *d = map
            .transform_vector3(DVec3::from(*d))
            .normalize_or(DVec3::from(*d))
            .to_array()
    };
    match &mut light.kind {
        LightKind::Directional { to_light } => rotate(to_light),
        LightKind::Point { position, .. } => point(position),
        LightKind::Spot {
            position,
            direction,
            ..
        } => {
            point(position);
            rotate(direction);
        }
    }
    light
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: each axis becomes y by a rotation without reflection or rounding, and is found by
    /// its name.
    #[test]
    fn every_axis_becomes_up() {
        let axes = [
            DVec3::Y,
            DVec3::Z,
            DVec3::NEG_Y,
            DVec3::NEG_Z,
            DVec3::X,
            DVec3::NEG_X,
        ];
        for ((name, up), axis) in UpAxis::NAMED.into_iter().zip(axes) {
            let map = affine_from_steps(&[TransformStep::Matrix(up.rotation_rows())]);
            assert_eq!(map.transform_vector3(axis), DVec3::Y, "{name}");
            assert_eq!(map.matrix3.determinant(), 1.0, "{name}");
            assert_eq!(
                (name.parse(), name.to_uppercase().parse(), up.name()),
                (Ok(up), Ok(up), name)
            );
        }
        assert!("up".parse::<UpAxis>().is_err());
    }

    /// Protects: everything along the axis becomes upright, cameras and lights included.
    #[test]
    fn all_is_turned_together() {
        let pose = Pose::Axes {
            eye: [0.0, -5.0, 1.0],
            right: [1.0, 0.0, 0.0],
            up: [0.0, 0.0, 1.0],
            back: [0.0, -1.0, 0.0],
        };
        let camera = |pose: Pose| {
            let text = r#"{"name": "c", "pose": {"look_at": {"eye": [0, 0, 1], "target": [0, 0, 0]}}, "projection": {"orthographic": {"height": 1}}}"#;
            Camera {
                pose,
                ..serde_json::from_str(text).expect("a camera")
            }
        };
        let light = r#"{"colour": [1, 1, 1], "kind": {"directional": {"to_light": [0, 0, 1]}}}"#;
        let mut scene = Scene {
            cameras: vec![camera(pose)],
            lights: vec![serde_json::from_str(light).expect("a light")],
            ..Scene::default()
        };
        rotate_to_y_up(&mut scene, UpAxis::Z);
        let upright = Pose::Axes {
            eye: [0.0, 1.0, 5.0],
            right: [1.0, 0.0, 0.0],
            up: [0.0, 1.0, 0.0],
            back: [0.0, 0.0, 1.0],
        };
        assert_eq!(scene.cameras[0].pose, upright);
        assert_eq!(
            scene.lights[0].kind,
            LightKind::Directional {
                to_light: [0.0, 1.0, 0.0]
            }
        );
    }
}
