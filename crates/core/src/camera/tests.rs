//! Distant cameras show the same picture as near ones, and view fitting.

use super::*;
use crate::scene::{Pinhole, Pose, Scene};
use crate::settings::{Aov, PrecisionChoice, Settings};
use crate::{RenderOutput, prepare};

const SIZE: [u32; 2] = [80, 60];

/// Shapes of a metre on an infinite floor, in slanting light with shadows.
fn still() -> Scene {
    serde_json::from_str(
        r#"{
        "format": 1,
        "sky": { "constant": 0.25 },
        "lights": [{ "kind": { "directional": { "to_light": [1, 2, 1.5] } }, "colour": 0.8 }],
        "materials": [
            { "name": "floor", "model": { "classic": { "colour": { "checker": { "even": 0.9, "odd": 0.4 } } } } },
            { "name": "clay", "model": { "classic": { "colour": "0.5 + 0.4*n" } } }],
        "objects": [
            { "shape": { "plane": { "point": [0, -1, 0], "normal": [0, 1, 0] } }, "material": "floor" },
            { "shape": { "sphere": { "centre": [0.3, 0, 0.2], "radius": 0.75 } }, "material": "clay" },
            { "shape": { "box": { "min": [-1.5, -1, -1], "max": [-0.7, 0.2, -0.25] } }, "material": "clay" },
            { "shape": { "torus": { "centre": [0.4, -0.8, 1.2], "axis": [0, 1, 0], "major_radius": 0.5, "minor_radius": 0.2 } },
              "material": "clay" },
            { "shape": { "cylinder": { "base": [1.25, -1, -0.5], "axis": [0, 1, 0], "radius": 0.25, "height": 1.5 } },
              "material": "clay" }]
    }"#,
    )
    .expect("a scene")
}

/// A view of four metres height around the origin, from a distance at an elevation, in the given
/// projection.
fn seen(
    distance: f64,
    elevation: f64,
    projection: Projection,
    precision: PrecisionChoice,
) -> RenderOutput {
    let scene = still();
    let pose = Pose::Orbit {
        target: [0.0; 3],
        distance,
        azimuth: 20.0,
        elevation,
    };
    let camera = CameraData {
        name: String::new(),
        pose,
        projection,
        aspect: None,
        fit: Default::default(),
        pose_end: None,
        shutter: None,
    };
    let settings = Settings {
        size: SIZE,
        camera: Some(camera),
        sampling: crate::settings::Sampling::Pattern(crate::scene::SamplePattern::Centre),
        aovs: vec![Aov::Depth, Aov::Object],
        precision,
        ..Settings::from_scene(&scene)
    };
    prepare(&scene, &settings, &())
        .expect("it can be prepared")
        .render(&())
}

/// Number of pixels that differ by more than the rounding of their points.
fn apart(a: &RenderOutput, b: &RenderOutput) -> usize {
    let pixels = |r: &RenderOutput| {
        (0..SIZE[1])
            .flat_map(|y| (0..SIZE[0]).map(move |x| (x, y)))
            .map(|(x, y)| r.picture.pixel(x, y).expect("inside"))
            .collect::<Vec<_>>()
    };
    pixels(a)
        .iter()
        .zip(pixels(b))
        .filter(|(p, q)| (0..3).any(|i| (p[i] - q[i]).abs() > 1e-4))
        .count()
}

/// Protects: an orthographic view from 10³ to 10⁹ metres away equals the near one, including the
/// infinite floor, part of which lies between the eye and the rays' origins. From 10⁷ metres on it
/// once was noise.
#[test]
fn parallel_views_do_not_depend_on_the_distance() {
    for precision in [PrecisionChoice::Robust, PrecisionChoice::Reference] {
        for elevation in [8.0, 35.0, 90.0] {
            let view = |distance| {
                seen(
                    distance,
                    elevation,
                    Projection::Orthographic { height: 4.0 },
                    precision,
                )
            };
            let near = view(40.0);
            for exponent in 3..=9 {
                let distance = 10_f64.powi(exponent);
                let far = view(distance);
                let differ = apart(&near, &far);
                // Rays along an edge of the checker or of a shape may fall on either side.
                assert!(
                    differ * 1000 <= 4 * 4800,
                    "{precision:?} at {elevation}°, {distance:e} m: {differ} pixels differ"
                );
                let depth = |r: &RenderOutput| {
                    r.picture
                        .layer("depth.Z")
                        .expect("asked for")
                        .samples
                        .clone()
                };
                let wrong = depth(&near).into_iter().zip(depth(&far)).filter(|&(a, b)| {
                    let expected = f64::from(a) + distance - 40.0;
                    (expected - f64::from(b)).abs()
                        > 1e-4 + 2.0 * f64::from(f32::EPSILON) * distance
                });
                assert!(
                    wrong.count() * 1000 <= 4 * 4800,
                    "{precision:?} at {elevation}°, {distance:e} m: wrong depths"
                );
            }
        }
    }
}

/// Protects: a pinhole camera that moves away while its field of view shrinks converges to the
/// picture of parallel rays.
#[test]
fn distant_pinholes_show_what_parallel_rays_show() {
    let parallel = seen(
        40.0,
        35.0,
        Projection::Orthographic { height: 4.0 },
        PrecisionChoice::Robust,
    );
    for exponent in 6..=9 {
        let distance = 10_f64.powi(exponent);
        let pinhole = Pinhole {
            focal_length: Some(distance / 4.0),
            ..Pinhole::default()
        };
        let differ = apart(
            &parallel,
            &seen(
                distance,
                35.0,
                Projection::Pinhole(pinhole),
                PrecisionChoice::Robust,
            ),
        );
        assert!(
            differ * 1000 <= 4 * 4800,
            "from {distance:e} m {differ} pixels differ"
        );
    }
}

/// Protects: rays of a camera near the scene start at the eye, with unchanged bits.
#[test]
fn near_cameras_start_at_the_eye() {
    let pose = Pose::LookAt {
        eye: [1.0, 2.0, 300.0],
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
    };
    let data = CameraData {
        name: String::new(),
        pose,
        projection: Projection::Orthographic { height: 2.0 },
        aspect: None,
        fit: Default::default(),
        pose_end: None,
        shutter: None,
    };
    let bounds = Aabb::from_centre(DVec3::ZERO, DVec3::splat(2.0));
    let camera = PreparedCamera::<f32>::for_scene_bounds(&data, SIZE, &bounds);
    assert_eq!(
        (
            camera.eye_to_origin_distance(),
            camera.generate_ray(40.0, 30.0, [0.5; 2]).origin.to_array()
        ),
        (0.0, [1.0, 2.0, 300.0])
    );
    assert_eq!(
        PreparedCamera::<f32>::for_scene_bounds(&data, SIZE, &Aabb::EMPTY).eye_to_origin_distance(),
        0.0,
        "nothing to be far from"
    );
    let small = PreparedCamera::<f32>::for_scene_bounds(
        &data,
        SIZE,
        &Aabb::from_centre(DVec3::ZERO, DVec3::splat(0.25)),
    );
    assert!(
        small.eye_to_origin_distance() > 298.0,
        "far for a scene of that size"
    );
}

/// Protects: no ray of a wide lens starts beyond a possible hit, wherever the scene lies: the rim
/// of the lens is closer to oblique points than the eye by up to the lens radius.
#[test]
fn a_wide_lens_starts_before_the_scene() {
    let centre = DVec3::new(600.0, 0.0, -800.0);
    let bounds = Aabb::from_centre(centre, DVec3::ONE);
    for aperture_radius in [0.0, 0.01, 1.0, 300.0] {
        let pinhole = Pinhole {
            vertical_fov: Some(100.0),
            ..Pinhole::default()
        };
        let data = CameraData {
            name: String::new(),
            pose: Pose::LookAt {
                eye: [0.0; 3],
                target: [0.0, 0.0, -1.0],
                up: [0.0, 1.0, 0.0],
            },
            projection: Projection::ThinLens {
                pinhole,
                aperture_radius,
                focus_distance: 800.0,
            },
            aspect: None,
            fit: Default::default(),
            pose_end: None,
            shutter: None,
        };
        let camera = PreparedCamera::<f32>::for_scene_bounds(&data, SIZE, &bounds);
        assert_eq!(
            camera.eye_to_origin_distance() > 0.0,
            aperture_radius < 2.0,
            "far by what scene and lens measure together: {aperture_radius}"
        );
        for i in 0..1000_u16 {
            let at = |step: f32| (f32::from(i) * step).fract();
            let ray = camera.generate_ray(
                at(0.618) * SIZE[0] as f32,
                at(0.755) * SIZE[1] as f32,
                [at(0.57), at(0.31)],
            );
            let (origin, direction) = (Vector::to_f64(ray.origin), Vector::to_f64(ray.direction));
            let along = (centre - origin).dot(direction);
            let passes = (centre - origin - direction * along).length();
            // Only rays that hit the sphere around the scene count.
            assert!(
                passes > 1.8 || along > 1.8,
                "{aperture_radius}: {origin} towards {direction} starts within or beyond"
            );
        }
    }
}

/// Protects: for a camera with an aspect ratio, `contain` shows its whole view in every picture and
/// `cover` nothing beyond it, with square pixels, by angles of both kinds and by height. At its own
/// aspect ratio all fits agree, to the bit.
#[test]
fn other_shapes_contain_or_cover() {
    use crate::scene::AspectFit;
    let pinhole = |vertical_fov, horizontal_fov| {
        Projection::Pinhole(Pinhole {
            vertical_fov,
            horizontal_fov,
            focal_length: None,
        })
    };
    let wide = 2.0 * libm::atan(1.5 * libm::tan(20.0_f64.to_radians())).to_degrees();
    for projection in [
        pinhole(Some(40.0), None),
        pinhole(None, Some(wide)),
        Projection::Orthographic { height: 2.0 },
    ] {
        // Position seen at the middle of the right and of the upper edge, over the half height of
        // the file's view.
        let edges = |size: [u32; 2], aspect, fit| {
            let pose = Pose::Axes {
                eye: [0.0; 3],
                right: [1.0, 0.0, 0.0],
                up: [0.0, 1.0, 0.0],
                back: [0.0, 0.0, 1.0],
            };
            let projection = projection.clone();
            let data = CameraData {
                name: String::new(),
                pose,
                projection,
                aspect,
                fit,
                pose_end: None,
                shutter: None,
            };
            let camera = PreparedCamera::<f64>::new(&data, size);
            let [width, height] = size.map(f64::from);
            let half = if matches!(camera.kind, CameraKind::Orthographic) {
                0.5
            } else {
                camera.forward.length() * libm::tan(20.0_f64.to_radians())
            };
            [
                width * 0.5 * camera.pixel_size[0] / half,
                height * 0.5 * camera.pixel_size[1] / half,
            ]
        };
        let is = |found: [f64; 2], expected: [f64; 2]| {
            found
                .iter()
                .zip(expected)
                .all(|(found, expected)| (found - expected).abs() < 1e-12)
        };
        for (size, contained, covered) in [
            ([300, 100], [3.0, 1.0], [1.5, 0.5]),
            ([100, 200], [1.5, 3.0], [0.5, 1.0]),
            ([300, 200], [1.5, 1.0], [1.5, 1.0]),
        ] {
            let found = [AspectFit::Contain, AspectFit::Cover, AspectFit::Stretch]
                .map(|fit| edges(size, Some(1.5), fit));
            assert!(
                is(found[0], contained) && is(found[1], covered) && is(found[2], [1.5, 1.0]),
                "{size:?}: {found:?}"
            );
        }
        let of_its_own = [AspectFit::Contain, AspectFit::Cover, AspectFit::Stretch]
            .map(|fit| edges([300, 200], Some(1.5), fit));
        assert!(of_its_own.iter().all(|found| *found == of_its_own[0]));
    }
}
