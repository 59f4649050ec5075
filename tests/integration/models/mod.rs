//! Whole collections of real models, held against what is known of each: pictures by other
//! programs, twins, answers by hand, verdicts.

mod answers;
mod samples;
mod verdicts;

use std::path::Path;

use raywright::core::picture::Picture;
use raywright::core::scene::{Camera, Integrator, Pinhole, Pose, Projection};
use raywright::core::settings::{Background, Sampling};
use raywright::core::{Scene, Settings, prepare};
use raywright::io::{Input, LoadOptions, load};

/// A model's scene.
fn scene(path: &Path) -> Scene {
    load(&Input::Path(path.to_owned()), &LoadOptions::default())
        .unwrap_or_else(|e| panic!("{e}"))
        .scene
}

/// A camera from a point to a point.
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

/// A scene's picture on a transparent ground.
fn picture(scene: &Scene, camera: Option<Camera>, size: [u32; 2], samples: u32) -> Picture {
    let settings = Settings {
        size,
        camera,
        sampling: Sampling::resolve(scene, Some(samples)),
        background: Background::Transparent,
        // The samples' pictures have no light that surfaces send to each other.
        integrator: Integrator::Whitted,
        ..Settings::of(scene)
    };
    prepare(scene, &settings, &())
        .unwrap_or_else(|e| panic!("{e}"))
        .render(&())
        .picture
}
