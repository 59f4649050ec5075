//! Whole collections of real models, compared with other programs' pictures, twins, results by
//! hand, and listed verdicts.

mod expected_images;
mod samples;
mod verdicts;

use std::path::Path;

use raywright::core::picture::Picture;
use raywright::core::scene::{Camera, Integrator, Pinhole, Pose, Projection};
use raywright::core::settings::{Background, Sampling};
use raywright::core::{Scene, Settings, prepare};
use raywright::io::{Input, LoadOptions, load};

/// Loads a model's scene.
fn scene(path: &Path) -> Scene {
    load(&Input::Path(path.to_owned()), &LoadOptions::default())
        .unwrap_or_else(|e| panic!("{e}"))
        .scene
}

/// A camera from a point to a target.
fn looking(eye: [f64; 3], target: [f64; 3], vertical_fov: f64) -> Camera {
    Camera {
        name: String::new(),
        pose: Pose::LookAt {
            eye,
            target,
            up: [0.0, 1.0, 0.0],
        },
        projection: Projection::Pinhole(Pinhole {
            vertical_fov: Some(vertical_fov),
            ..Pinhole::default()
        }),
        aspect: None,
        fit: Default::default(),
        pose_end: None,
        shutter: None,
    }
}

/// Renders a scene on a transparent background.
fn picture(scene: &Scene, camera: Option<Camera>, size: [u32; 2], samples: u32) -> Picture {
    let settings = Settings {
        size,
        camera,
        sampling: Sampling::from_spp(scene, Some(samples)),
        background: Background::Transparent,
        // The sample pictures have no indirect light.
        integrator: Integrator::Whitted,
        ..Settings::from_scene(scene)
    };
    prepare(scene, &settings, &())
        .unwrap_or_else(|e| panic!("{e}"))
        .render(&())
        .picture
}
