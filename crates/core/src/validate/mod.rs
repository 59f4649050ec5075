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

pub(crate) use check::format_list;
pub use check::{MAX_LIGHT_INTENSITY, MAX_MAGNITUDE};
pub use mesh::{check_mesh_data, find_missing_uv_sets};
pub(crate) use object::do_edges_span_no_area;

use self::check::SceneCheck;
use crate::expr::find_parameter_name_problem;
use crate::fault::Fault;
use crate::scene::{
    ClassicRules, FORMAT, Parameter, ParameterRange, RenderSettings, Scene, SpawnRule,
};
use crate::settings::Settings;

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
    check_parameters(&mut check, scene);
    check.with_key("render", |check| {
        check_render_settings(check, &scene.render)
    });
    check.with_key("classic", |check| {
        check_classic_rules(check, &scene.classic)
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

// Validation of a picture's settings, of the parameters, and of the rules that all classic
// materials share.

fn check_parameters(check: &mut SceneCheck<'_>, scene: &Scene) {
    check.require_finite("t", scene.t);
    if let Some(period) = scene.period {
        check.require_within("period", period, 1e-3, 1e9);
    }
    check.with_key("parameters", |check| {
        for (name, parameter) in &scene.parameters {
            check.with_key(name, |check| match find_parameter_name_problem(name) {
                Some(reason) => check.report_with_hint(
                    "",
                    format!("`{name}` cannot be the name of a parameter"),
                    reason,
                ),
                None => check_parameter(check, parameter),
            });
        }
    });
}

fn check_parameter(check: &mut SceneCheck<'_>, parameter: &Parameter) {
    check.require_finite("", parameter.value);
    let Some(ParameterRange { min, max, step }) = parameter.range else {
        return;
    };
    check.require_finite("min", min);
    check.require_finite("max", max);
    if min >= max {
        check.report(
            "",
            format!("`min` is {min}, which is not below `max`, {max}"),
        );
        return;
    }
    check.require_within("value", parameter.value, min, max);
    if step.is_some_and(|step| !(step > 0.0 && step <= max - min)) {
        check.report("", "`step` must be above 0, and at most `max` minus `min`");
    }
}

fn check_render_settings(check: &mut SceneCheck<'_>, render: &RenderSettings) {
    check.check_each_element("size", &render.size, |check, side| {
        check.require_count_within("", *side, 1, Settings::MOST_EDGE)
    });
    check.require_count_within("samples", render.samples, 1, Settings::MOST_SAMPLES);
    check.require_count_within("max_depth", render.max_depth, 1, Settings::MOST_SEGMENTS);
    check.require_within("exposure", render.exposure, -64.0, 64.0);
    check.require_not_negative_colour("veil", render.veil);
}

fn check_classic_rules(check: &mut SceneCheck<'_>, rules: &ClassicRules) {
    check.require_not_negative_colour("ambient", rules.ambient);
    check.require_optional_length("shadow_max_distance", rules.shadow_max_distance);
    if let SpawnRule::Constant(offsets) = rules.spawn {
        check.with_key("spawn.constant", |check| {
            check.require_not_negative("offset", offsets.offset);
            check.require_not_negative("camera_min", offsets.camera_min);
            check.require_not_negative("secondary_min", offsets.secondary_min);
            check.require_not_negative("shadow_min", offsets.shadow_min);
        });
    }
}

#[cfg(test)]
mod tests;
