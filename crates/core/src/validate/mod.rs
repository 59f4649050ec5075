//! Validation of a scene by all rules that its types do not enforce. All problems are reported at
//! once, each with its path in the scene.
//!
//! Validation reads no files and changes nothing. The reader of a scene file maps paths to lines
//! and columns. A scene without problems can be prepared, with two exceptions: preparation may
//! refuse a scene that needs too much memory, and shapes that collapse in the chosen precision.

mod camera;
mod check;
mod light;
mod material;
mod mesh;
mod motion;
mod object;
mod render;
mod transform;

use std::ops::Range;

pub(crate) use check::list;
pub use check::{GREATEST, GREATEST_INTENSITY};
pub use mesh::{mesh_data, missing_uv_sets};
pub(crate) use object::no_area;

use self::check::SceneCheck;
use crate::scene::{FORMAT, Scene};

/// Greatest number of reported problems.
pub(crate) const MOST: usize = 100;

/// Greatest absolute coordinate, in world units. Squared distances between farther points do not
/// fit the renderer's `f32`.
pub const FARTHEST: f64 = 1e15;

/// Least aspect ratio (width over height) of a camera.
pub const LEAST_ASPECT: f64 = 1e-3;
/// Greatest aspect ratio (width over height) of a camera.
pub const MOST_ASPECT: f64 = 1e3;

/// Least radius, size, or distance between points that must not coincide, in world units.
pub const SMALLEST: f64 = 1e-15;

/// A problem of a scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// Path from the root of the scene, such as `objects[3].shape.sphere.radius`; empty for the
    /// scene as a whole. The last keys of the path may be missing in the file, if the file omits a
    /// key.
    pub path: String,
    /// Message: one sentence without a full stop.
    pub message: String,
    /// Hint for a correction, if any.
    pub hint: Option<String>,
    /// Byte range within a value that is text; `None` for the whole value.
    pub within: Option<Range<usize>>,
}

/// Returns the problems of a scene, in the order of the scene's fields; at most a hundred. A valid
/// scene has none.
pub fn validate(scene: &Scene) -> Vec<Problem> {
    let mut check = SceneCheck::new(scene);
    if scene.format != FORMAT {
        let message = format!(
            "this program reads format {FORMAT} of scenes, not {}",
            scene.format
        );
        check.with_key("format", |check| check.report(message));
        return check.finish();
    }
    render::parameters(&mut check, scene);
    check.with_key("render", |check| render::render(check, &scene.render));
    check.with_key("classic", |check| {
        render::classic_rules(check, &scene.classic)
    });
    check.names("cameras", &scene.cameras, |camera| &camera.name, false);
    check.each("cameras", &scene.cameras, camera::camera);
    if let Some(sky) = &scene.sky {
        check.with_key("sky", |check| light::sky(check, sky));
    }
    check.each("lights", &scene.lights, light::light);
    check.names("images", &scene.images, |image| &image.name, true);
    check.each("images", &scene.images, mesh::image);
    check.names("textures", &scene.textures, |texture| &texture.name, true);
    check.each("textures", &scene.textures, mesh::texture);
    check.names(
        "materials",
        &scene.materials,
        |material| &material.name,
        true,
    );
    check.each("materials", &scene.materials, |check, material| {
        check.with_key("model", |check| material::model(check, &material.model));
    });
    check.names("meshes", &scene.meshes, |mesh| &mesh.name, true);
    check.each("meshes", &scene.meshes, mesh::mesh);
    check.each("models", &scene.models, object::model);
    check.each("objects", &scene.objects, object::object);
    check.each("generators", &scene.generators, object::generator);
    check.finish()
}

#[cfg(test)]
mod tests;
