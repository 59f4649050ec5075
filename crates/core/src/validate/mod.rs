//! Validation of a scene by all rules that its types do not enforce. It returns all problems at
//! once, each with its path in the scene.
//!
//! Validation reads no files and changes nothing. The reader of a scene file translates paths to
//! lines and columns. Preparation may still refuse a valid scene for one of two reasons: it needs
//! too much memory, or shapes collapse in the chosen precision.

mod camera;
mod check;
mod light;
mod material;
mod mesh;
mod motion;
mod object;
mod render;

pub(crate) use check::format_list;
pub use check::{MAX_LIGHT_INTENSITY, MAX_MAGNITUDE};
pub use mesh::{check_mesh_data, find_missing_uv_sets};
pub(crate) use object::do_edges_span_no_area;

use self::check::SceneCheck;
use crate::fault::Fault;
use crate::scene::{FORMAT, Scene};

/// Greatest number of problems that are reported.
pub(crate) const MAX_PROBLEMS: usize = 100;

/// Greatest absolute coordinate, in world units. Squared distances between farther points would
/// overflow the renderer's `f32`.
pub const MAX_COORDINATE: f64 = 1e15;

/// Least aspect ratio (width over height) of a camera.
pub const LEAST_ASPECT: f64 = 1e-3;
/// Greatest aspect ratio (width over height) of a camera.
pub const MOST_ASPECT: f64 = 1e3;

/// Least radius or size, in world units. It is also the least distance between points that must not
/// coincide.
pub const MIN_LENGTH: f64 = 1e-15;

/// Returns the faults of kind [`FaultKind::Invalid`](crate::fault::FaultKind::Invalid) of a scene, in
/// the order of the scene's fields; at most a hundred. A valid scene has none.
pub fn validate(scene: &Scene) -> Vec<Fault> {
    let mut check = SceneCheck::new(scene);
    if scene.format != FORMAT {
        let message = format!(
            "this program reads version {FORMAT} of the scene format, but this scene has version {}",
            scene.format
        );
        check.report("format", message);
        return check.into_problems();
    }
    render::check_parameters(&mut check, scene);
    check.with_key("render", |check| {
        render::check_render_settings(check, &scene.render)
    });
    check.with_key("classic", |check| {
        render::check_classic_rules(check, &scene.classic)
    });
    check.check_names("cameras", &scene.cameras, |camera| &camera.name, false);
    check.check_each_element("cameras", &scene.cameras, camera::check_camera);
    if let Some(sky) = &scene.sky {
        check.with_key("sky", |check| light::check_sky(check, sky));
    }
    if let Some(air) = &scene.air {
        check.with_key("air", |check| {
            material::check_fields(check, air);
            material::check_medium(check, air);
        });
    }
    check.check_each_element("lights", &scene.lights, light::check_light);
    check.check_names("images", &scene.images, |image| &image.name, true);
    check.check_each_element("images", &scene.images, mesh::check_image);
    check.check_names("textures", &scene.textures, |texture| &texture.name, true);
    check.check_each_element("textures", &scene.textures, mesh::check_texture);
    check.check_names(
        "materials",
        &scene.materials,
        |material| &material.name,
        true,
    );
    check.check_each_element("materials", &scene.materials, |check, material| {
        check.with_key("model", |check| {
            material::check_material_model(check, &material.model)
        });
    });
    check.check_names("meshes", &scene.meshes, |mesh| &mesh.name, true);
    check.check_each_element("meshes", &scene.meshes, mesh::check_mesh);
    check.check_each_element("models", &scene.models, object::check_model_file);
    check.check_each_element("objects", &scene.objects, object::check_object);
    check.check_each_element("generators", &scene.generators, object::check_generator);
    check.into_problems()
}

#[cfg(test)]
mod tests;
