//! Messages about inconsistent scenes, each read from a newcomer's point of view.

use super::expect_message;

/// Protects: the message for an unknown material, word for word: place, cause and remedy.
#[test]
fn an_unknown_material() {
    expect_message(
        "x.scene.toml",
        r#"format = 1
[[materials]]
name = "red"
model.classic = {}
[[objects]]
material = "rde"
shape.sphere = { centre = [0, 0, 0], radius = 1 }
"#,
        r#"
error: unknown material `rde`
 --> x.scene.toml:6:12
  |
6 | material = "rde"
  |            ^^^^^
  |
  = help: did you mean `red`?
"#,
    );
}

/// Protects: the message for two materials of one name, word for word: place, cause and remedy.
#[test]
fn two_materials_of_one_name() {
    expect_message(
        "x.scene.toml",
        r#"format = 1
[[materials]]
name = "red"
model.classic = {}
[[materials]]
name = "red"
model.physical = {}
"#,
        r#"
error: the name `red` is already used by `materials[0]`; rename one of the two
 --> x.scene.toml:6:8
  |
6 | name = "red"
  |        ^^^^^
"#,
    );
}

/// Protects: the message for a negative radius, word for word: place, cause and remedy.
#[test]
fn a_negative_radius() {
    expect_message(
        "x.scene.toml",
        r#"format = 1
[parameters]
r = -1
[[materials]]
name = "red"
model.classic = {}
[[objects]]
material = "red"
shape.sphere = { centre = [0, 0, 0], radius = "r / 2" }
"#,
        r#"
error: `radius` must be above zero, not -0.5
 --> x.scene.toml:9:47
  |
9 | shape.sphere = { centre = [0, 0, 0], radius = "r / 2" }
  |                                               ^^^^^^^
"#,
    );
}

/// Protects: the message for a direction without length, word for word: place, cause and remedy.
#[test]
fn a_direction_without_length() {
    expect_message(
        "x.scene.toml",
        r#"format = 1
[[lights]]
kind.directional.to_light = [0, 0, 0]
colour = 1
"#,
        r#"
error: `to_light` has length zero, so it gives no direction
 --> x.scene.toml:3:29
  |
3 | kind.directional.to_light = [0, 0, 0]
  |                             ^^^^^^^^^
"#,
    );
}

/// Protects: the message for a camera that looks at its own eye, word for word: place, cause and
/// remedy.
#[test]
fn a_camera_that_looks_at_its_own_eye() {
    expect_message(
        "x.scene.toml",
        r#"format = 1
[[cameras]]
projection.pinhole.vertical_fov = 40
[cameras.pose.look_at]
eye = [1, 2, 3]
target = [1, 2, 3]
"#,
        r#"
error: `target` equals `eye`, so the camera has no viewing direction
 --> x.scene.toml:6:10
  |
6 | target = [1, 2, 3]
  |          ^^^^^^^^^
"#,
    );
}

/// Protects: the message for a camera that looks along up, word for word: place, cause and remedy.
#[test]
fn a_camera_that_looks_along_up() {
    expect_message(
        "x.scene.toml",
        r#"format = 1
[[cameras]]
pose.look_at = { eye = [0, 5, 0], target = [0, 0, 0] }
projection.pinhole.vertical_fov = 40
"#,
        r#"
error: `up`, [0, 1, 0], is parallel to the viewing direction, so the picture has no upward direction
 --> x.scene.toml:3:16
  |
3 | pose.look_at = { eye = [0, 5, 0], target = [0, 0, 0] }
  |                ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^
  |
  = help: choose an `up` that is not parallel to the viewing direction, such as [0, 0, -1] for a camera that looks down
"#,
    );
}

/// Protects: the message for two opening angles, word for word: place, cause and remedy.
#[test]
fn two_opening_angles() {
    expect_message(
        "x.scene.toml",
        r#"format = 1
[[cameras]]
pose.look_at = { eye = [0, 0, 5], target = [0, 0, 0] }
projection.pinhole = { vertical_fov = 40, focal_length = 1 }
"#,
        r#"
error: `vertical_fov` and `focal_length` both set the field of view of the pinhole camera
 --> x.scene.toml:4:58
  |
4 | projection.pinhole = { vertical_fov = 40, focal_length = 1 }
  |                                                          ^
  |
  = help: give exactly one of `vertical_fov`, `horizontal_fov` (both in degrees) and `focal_length`
"#,
    );
}

/// Protects: the message for no number, word for word: place, cause and remedy.
#[test]
fn message_for_no_number() {
    expect_message(
        "x.scene.toml",
        r#"format = 1
[[lights]]
kind.point.position = [0, nan, 0]
colour = inf
"#,
        r#"
error: `position` must be three finite numbers, not [0, NaN, 0]
 --> x.scene.toml:3:23
  |
3 | kind.point.position = [0, nan, 0]
  |                       ^^^^^^^^^^^

error: `colour` must be finite, not [inf, inf, inf]
 --> x.scene.toml:4:10
  |
4 | colour = inf
  |          ^^^
"#,
    );
}

/// Protects: the message for a picture without pixels, word for word: place, cause and remedy.
#[test]
fn a_picture_without_pixels() {
    expect_message(
        "x.scene.toml",
        r#"format = 1
[render]
size = [640, 0]
max_depth = 0
"#,
        r#"
error: `size[1]` must be from 1 to 65536, not 0
 --> x.scene.toml:3:14
  |
3 | size = [640, 0]
  |              ^

error: `max_depth` must be from 1 to 64, not 0
 --> x.scene.toml:4:13
  |
4 | max_depth = 0
  |             ^
"#,
    );
}

/// Protects: the message for a mesh whose arrays do not fit, word for word: place, cause and
/// remedy.
#[test]
fn a_mesh_whose_arrays_do_not_fit() {
    expect_message(
        "x.scene.toml",
        r#"format = 1
[[meshes]]
name = "leaf"
[meshes.source.inline]
positions = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
indices = [[0, 1, 3]]
normals = [[0, 0, 1]]
"#,
        r#"
error: an index of this triangle is too large: the mesh has 3 vertices, whose indices begin at 0
 --> x.scene.toml:6:12
  |
6 | indices = [[0, 1, 3]]
  |            ^^^^^^^^^

error: `normals` must have one entry for each of the 3 positions, not 1
 --> x.scene.toml:7:11
  |
7 | normals = [[0, 0, 1]]
  |           ^^^^^^^^^^^
"#,
    );
}

/// Protects: the message for a transform that flattens, word for word: place, cause and remedy.
#[test]
fn a_transform_that_flattens() {
    expect_message(
        "x.scene.toml",
        r#"format = 1
[[materials]]
name = "red"
model.classic = {}
[[objects]]
material = "red"
shape.sphere = { centre = [0, 0, 0], radius = 1 }
transform = [{ scale = [1, 0, 1] }]
"#,
        r#"
error: no factor of `scale` may be zero, as in [1, 0, 1]: the object would have no extent
 --> x.scene.toml:8:24
  |
8 | transform = [{ scale = [1, 0, 1] }]
  |                        ^^^^^^^^^
"#,
    );
}
