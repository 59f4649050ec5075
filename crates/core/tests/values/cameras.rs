//! Origins and directions of camera rays.

use glam::DVec3;
use raywright_core::bvh::Ray;
use raywright_core::camera::PreparedCamera;
use raywright_core::framing::{FIELD_OF_VIEW, Silhouette};
use raywright_core::scene::Camera as CameraData;
use raywright_core::settings::{Aov, Settings};
use serde_json::{Value, json};

use crate::support::{DOWN, ball, physical, render_scene, scene, settings};

fn camera(pose: Value, projection: Value, aspect: Value, size: [u32; 2]) -> PreparedCamera<f64> {
    let data: CameraData =
        serde_json::from_value(json!({ "pose": pose, "projection": projection, "aspect": aspect }))
            .expect("a camera");
    PreparedCamera::new(&data, size)
}

/// From (1, 2, 3) along −z.
fn pose() -> Value {
    json!({ "look_at": { "eye": [1, 2, 3], "target": [1, 2, 0] } })
}

#[track_caller]
fn expect_ray(ray: Ray<f64>, origin: [f64; 3], direction: [f64; 3]) {
    let direction = DVec3::from(direction).normalize();
    assert!(
        (ray.origin - DVec3::from(origin)).length() < 1e-12,
        "from {}",
        ray.origin
    );
    assert!(
        (ray.direction - direction).length() < 1e-12,
        "towards {} instead of {direction}",
        ray.direction
    );
}

const EYE: [f64; 3] = [1.0, 2.0, 3.0];

/// Protects: each field-of-view key sets its width or height of the film, which is one unit high;
/// right and up in the picture.
#[test]
fn pinholes_open_by_their_key() {
    let at = |pinhole: Value, x: f64, y: f64| {
        camera(pose(), json!({ "pinhole": pinhole }), Value::Null, [40, 20])
            .generate_ray(x, y, [0.5; 2])
    };
    expect_ray(
        at(json!({ "vertical_fov": 90 }), 20.0, 0.0),
        EYE,
        [0.0, 1.0, -1.0],
    );
    expect_ray(
        at(json!({ "vertical_fov": 90 }), 40.0, 10.0),
        EYE,
        [2.0, 0.0, -1.0],
    );
    // A lens has the view of its pinhole, also for a film with its own aspect ratio: 3 to 1 here,
    // with stretched pixels.
    for aspect in [Value::Null, json!(3)] {
        let half = if aspect.is_null() { 1.0 } else { 1.5 };
        for (pinhole, focal) in [
            (json!({ "vertical_fov": 90 }), 0.5),
            (json!({ "horizontal_fov": 90 }), half),
            (json!({ "focal_length": 2 }), 2.0),
        ] {
            let lens = json!({ "thin_lens": { "pinhole": pinhole, "aperture_radius": 0.1, "focus_distance": 4 } });
            for projection in [json!({ "pinhole": pinhole }), lens] {
                let camera = camera(pose(), projection, aspect.clone(), [40, 20]);
                expect_ray(
                    camera.generate_ray(40.0, 10.0, [0.0; 2]),
                    EYE,
                    [half, 0.0, -focal],
                );
                expect_ray(
                    camera.generate_ray(20.0, 0.0, [0.0; 2]),
                    EYE,
                    [0.0, 0.5, -focal],
                );
            }
        }
    }
    expect_ray(
        at(json!({ "vertical_fov": 60 }), 20.0, 20.0),
        EYE,
        [0.0, -f64::sqrt(1.0 / 3.0), -1.0],
    );
    expect_ray(
        at(json!({ "horizontal_fov": 90 }), 40.0, 10.0),
        EYE,
        [1.0, 0.0, -1.0],
    );
    expect_ray(
        at(json!({ "horizontal_fov": 90 }), 0.0, 0.0),
        EYE,
        [-1.0, 0.5, -1.0],
    );
    expect_ray(
        at(json!({ "focal_length": 2 }), 20.0, 0.0),
        EYE,
        [0.0, 0.5, -2.0],
    );
    expect_ray(
        at(json!({ "focal_length": 2 }), 0.0, 15.0),
        EYE,
        [-1.0, -0.25, -2.0],
    );
}

/// Protects: a fixed aspect stretches the film over the picture, for every key.
#[test]
fn a_fixed_aspect_is_kept() {
    let at = |pinhole: Value, x: f64, y: f64| {
        camera(pose(), json!({ "pinhole": pinhole }), json!(3), [20, 20])
            .generate_ray(x, y, [0.5; 2])
    };
    expect_ray(
        at(json!({ "vertical_fov": 90 }), 20.0, 0.0),
        EYE,
        [3.0, 1.0, -1.0],
    );
    expect_ray(
        at(json!({ "horizontal_fov": 90 }), 20.0, 0.0),
        EYE,
        [1.0, 1.0 / 3.0, -1.0],
    );
    let flat = camera(
        pose(),
        json!({ "orthographic": { "height": 4 } }),
        json!(3),
        [20, 20],
    );
    expect_ray(
        flat.generate_ray(20.0, 0.0, [0.5; 2]),
        [7.0, 4.0, 3.0],
        [0.0, 0.0, -1.0],
    );
}

/// Protects: orthographic rays are parallel and span the view's height.
#[test]
fn orthographic_rays_are_parallel() {
    let flat = camera(
        pose(),
        json!({ "orthographic": { "height": 4 } }),
        Value::Null,
        [40, 20],
    );
    expect_ray(
        flat.generate_ray(20.0, 10.0, [0.5; 2]),
        EYE,
        [0.0, 0.0, -1.0],
    );
    expect_ray(
        flat.generate_ray(40.0, 0.0, [0.5; 2]),
        [5.0, 4.0, 3.0],
        [0.0, 0.0, -1.0],
    );
    assert!(!flat.has_lens());
}

/// Protects: poses follow their documentation: the up direction, an orbit's angles, explicit axes.
#[test]
fn poses_stand_as_documented() {
    let corner = |pose: Value| {
        camera(
            pose,
            json!({ "pinhole": { "vertical_fov": 90 } }),
            Value::Null,
            [20, 20],
        )
        .generate_ray(20.0, 10.0, [0.5; 2])
    };
    let top = |pose: Value| {
        camera(
            pose,
            json!({ "pinhole": { "vertical_fov": 90 } }),
            Value::Null,
            [20, 20],
        )
        .generate_ray(10.0, 0.0, [0.5; 2])
    };
    let rolled = json!({ "look_at": { "eye": EYE, "target": [1, 2, 0], "up": [2, 0, 1] } });
    expect_ray(top(rolled.clone()), EYE, [1.0, 0.0, -1.0]);
    expect_ray(corner(rolled), EYE, [0.0, -1.0, -1.0]);
    let orbit = |azimuth: f64, elevation: f64| json!({ "orbit": { "target": [1, 1, 1], "distance": 2, "azimuth": azimuth, "elevation": elevation } });
    expect_ray(corner(orbit(90.0, 0.0)), [3.0, 1.0, 1.0], [-1.0, 0.0, -1.0]);
    expect_ray(top(orbit(0.0, 0.0)), [1.0, 1.0, 3.0], [0.0, 1.0, -1.0]);
    let (c, s) = (f64::sqrt(0.75), 0.5);
    expect_ray(
        top(orbit(0.0, 30.0)),
        [1.0, 1.0 + 2.0 * s, 1.0 + 2.0 * c],
        [0.0, c - s, -c - s],
    );
    expect_ray(
        top(orbit(30.0, 0.0)),
        [1.0 + 2.0 * s, 1.0, 1.0 + 2.0 * c],
        [-s, 1.0, -c],
    );
    let axes =
        json!({ "axes": { "eye": EYE, "right": [0, 1, 0], "up": [0, 0, 1], "back": [1, 0, 0] } });
    expect_ray(corner(axes.clone()), EYE, [-1.0, 1.0, 0.0]);
    expect_ray(top(axes), EYE, [-1.0, 0.0, 1.0]);
}

/// Protects: rays start on the aperture's disk, at √l₀ of its radius, and rays of one film position
/// meet on the plane of focus, at any focal length.
#[test]
fn a_lens_is_sharp_at_its_distance() {
    let lens = |radius: f64| {
        let lens = json!({ "pinhole": { "vertical_fov": 40 }, "aperture_radius": radius, "focus_distance": 5 });
        camera(pose(), json!({ "thin_lens": lens }), Value::Null, [40, 20])
    };
    let pinhole = camera(
        pose(),
        json!({ "pinhole": { "vertical_fov": 40 } }),
        Value::Null,
        [40, 20],
    );
    assert!(lens(0.5).has_lens() && !lens(0.0).has_lens());
    for (x, y) in [(20.0, 10.0), (3.0, 1.0), (35.0, 19.0)] {
        let sharp = pinhole.generate_ray(x, y, [0.5; 2]);
        let sharp = sharp.at(5.0 / -sharp.direction.z);
        for (numbers, right, up) in [
            ([0.25, 0.0], 0.25, 0.0),
            ([0.25, 0.25], 0.0, 0.25),
            ([0.0, 0.7], 0.0, 0.0),
            ([0.81, 0.5], -0.45, 0.0),
        ] {
            let ray = lens(0.5).generate_ray(x, y, numbers);
            assert!(
                (ray.origin - (DVec3::from(EYE) + DVec3::new(right, up, 0.0))).length() < 1e-7,
                "{}",
                ray.origin
            );
            let hit_point = ray.at((sharp.z - ray.origin.z) / ray.direction.z);
            assert!(
                (hit_point - sharp).length() < 1e-7,
                "{hit_point} instead of {sharp}"
            );
        }
        assert_eq!(
            lens(0.0).generate_ray(x, y, [0.9; 2]).direction,
            pinhole.generate_ray(x, y, [0.5; 2]).direction
        );
    }
}

/// Protects: a scene without a camera uses the default view that frames its silhouette, also if
/// that view is given explicitly.
#[test]
fn scenes_without_a_camera_are_framed() {
    let white = json!({ "name": "white", "model": physical(json!({ "unlit": true })) });
    let scene =
        scene(json!({ "materials": [white], "objects": [ball([5.0, -7.0, 3.0], 2.0, "white")] }));
    let own_settings = settings(&scene, DOWN);
    let value_of = |camera| {
        render_scene(
            &scene,
            &Settings {
                camera,
                aovs: vec![Aov::Position],
                ..own_settings.clone()
            },
        )
        .picture
    };
    let silhouette = Silhouette::from_scene(&scene);
    let aspect = f64::from(own_settings.size[0]) / f64::from(own_settings.size[1]);
    let [framed, said] = [
        None,
        Some(silhouette.frame_camera(silhouette.default_view(), FIELD_OF_VIEW, aspect)),
    ]
    .map(value_of);
    let position = |name: &str| framed.layer(name).expect("asked for").samples[0];
    for (name, middle) in [
        ("position.X", 5.0),
        ("position.Y", -7.0),
        ("position.Z", 3.0),
    ] {
        assert!(
            (position(name) - middle).abs() < 2.0,
            "{name}: {}",
            position(name)
        );
        assert_eq!(
            position(name),
            said.layer(name).expect("asked for").samples[0]
        );
    }
}
