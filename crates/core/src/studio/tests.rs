use super::*;
use crate::camera::direction_from_angles;
use crate::scene::Sky;

fn camera(pose: Pose) -> Camera {
    let projection = crate::scene::Projection::Orthographic { height: 1.0 };
    Camera {
        name: String::new(),
        pose,
        projection,
        aspect: None,
        fit: Default::default(),
        pose_end: None,
        shutter: None,
    }
}

/// Returns the radiance of the studio's light along a direction, for a camera with this pose.
fn light_along(studio: &Studio, pose: Pose, direction: DVec3) -> f64 {
    let sky = studio_sky::<f64>(studio, &camera(pose));
    sky.radiance(DVec3::ZERO, direction).x
}

fn look(eye: [f64; 3], up: [f64; 3]) -> Pose {
    Pose::LookAt {
        eye,
        target: [0.0; 3],
        up,
    }
}

/// Protects: the key light stands to the left of the camera for every kind of pose, above the
/// target, also for views straight down and up, and rotates as environment maps do.
#[test]
fn key_light_stays_left_of_the_camera() {
    let own = Studio::default();
    let up = [0.0, 1.0, 0.0];
    let key = direction_from_angles(-42_f64.to_radians(), 42_f64.to_radians());
    assert!(key.x < 0.0 && key.y > 0.0 && key.z > 0.0, "{key}");
    // The key light, and the weaker light as far to the right.
    let right = glam::DQuat::from_rotation_y(84_f64.to_radians());
    let is_lit = |studio: &Studio, pose: Pose, direction: DVec3| {
        let [left, right] =
            [direction, right * direction].map(|d| light_along(studio, pose.clone(), d));
        assert!(left > 2.5 && right < 1.5, "{pose:?}: {left} {right}");
    };
    is_lit(&own, look([0.0, 0.0, 5.0], up), key);
    let orbit = Pose::Orbit {
        target: [3.0; 3],
        distance: 2.0,
        azimuth: 90.0,
        elevation: 50.0,
    };
    let axes = Pose::Axes {
        eye: [9.0, 0.0, 0.0],
        right: [0.0, 0.0, -1.0],
        up,
        back: [1.0, 0.0, 0.0],
    };
    for pose in [look([5.0, 7.0, 0.0], up), orbit, axes] {
        is_lit(&own, pose, DVec3::new(key.z, key.y, -key.x));
    }
    // From above, the front is at the foot of the picture; from below, at the head.
    is_lit(&own, look([0.0, 5.0, 0.0], [0.0, 0.0, -1.0]), key);
    is_lit(&own, look([0.0, -5.0, 0.0], [0.0, 0.0, 1.0]), key);
    // The light from +x is now at +z.
    let turned = Studio {
        rotation: 90.0,
        ..own
    };
    let front = look([0.0, 0.0, 5.0], up);
    is_lit(&turned, front, DVec3::new(-key.z, key.y, key.x));
}

/// Protects: a studio's strength multiplies all of its light; at strength 0 it has none.
#[test]
fn strength_multiplies_all_light() {
    let light = |strength: f64, azimuth: f64, elevation: f64| {
        let studio = Studio {
            strength,
            ..Studio::default()
        };
        let pose = look([0.0, 0.0, 5.0], [0.0, 1.0, 0.0]);
        light_along(&studio, pose, direction_from_angles(azimuth, elevation))
    };
    for (azimuth, elevation) in [(-0.7, 0.7), (1.0, 0.3), (2.0, -1.2), (0.1, 0.0)] {
        let [none, once, twice] = [0.0, 1.0, 2.0].map(|s| light(s, azimuth, elevation));
        assert!(once > 0.05, "{once}");
        assert_eq!([none, twice], [0.0, 2.0 * once]);
    }
}

/// Protects: a white surface that faces the camera is bright and not clipped, and its sides have at
/// least a quarter of that brightness.
#[test]
fn white_is_bright_and_nowhere_clipped() {
    let camera = camera(look([0.0, 1.0, 5.0], [0.0, 1.0, 0.0]));
    let irradiance = crate::light::Irradiance::new(&studio_sky::<f64>(&Studio::default(), &camera));
    let at = |x: f64, y: f64, z: f64| irradiance.eval(DVec3::new(x, y, z).normalize()).x;
    let front = at(0.0, 0.0, 1.0);
    assert!((0.6..0.9).contains(&front), "{front}");
    for normal in [
        [1.0, 0.0, 0.5],
        [-1.0, 0.0, 0.5],
        [0.0, 1.0, 0.2],
        [0.0, -1.0, 0.5],
    ] {
        let [x, y, z] = normal;
        assert!(
            (0.25 * front..1.35).contains(&at(x, y, z)),
            "{normal:?}: {}",
            at(x, y, z)
        );
    }
}

/// Returns a scene in a studio: the faces of a box around the origin that `faces` lists, 0 to 5, and
/// with the keys of its material.
fn room(faces: &[usize], side: &str, material: serde_json::Value) -> crate::Scene {
    let quad = |face: usize| {
        let (axis, sign) = (face / 2, if face.is_multiple_of(2) { -2.0 } else { 2.0 });
        let (mut corner, mut u, mut v) = ([-2.0; 3], [0.0; 3], [0.0; 3]);
        (corner[axis], u[(axis + 1) % 3], v[(axis + 2) % 3]) = (sign, 4.0, 4.0);
        if face.is_multiple_of(2) {
            core::mem::swap(&mut u, &mut v);
        }
        serde_json::json!({ "shape": { "quad": { "corner": corner, "edge_u": u, "edge_v": v } },
            "side": side, "material": "m" })
    };
    serde_json::from_value(serde_json::json!({
        "format": 1,
        "sky": { "studio": {} },
        "materials": [{ "name": "m", "model": { "physical": material } }],
        "objects": faces.iter().copied().map(quad).collect::<Vec<_>>(),
    }))
    .unwrap_or_else(|e| panic!("{e}"))
}

/// Returns whether a lamp at the camera lights the scene, and the mean radiance of its picture. The
/// camera looks at the middle of the room's last wall.
fn look_from(scene: &crate::Scene, eye: [f64; 3]) -> (bool, f32) {
    look_along(scene, eye, [0.0, 0.0, -2.0])
}

fn look_along(scene: &crate::Scene, eye: [f64; 3], target: [f64; 3]) -> (bool, f32) {
    let pose = Pose::LookAt {
        eye,
        target,
        up: [0.0, 1.0, 0.0],
    };
    let pinhole = crate::scene::Pinhole {
        vertical_fov: Some(40.0),
        ..Default::default()
    };
    let settings = crate::Settings {
        size: [8, 8],
        sampling: crate::settings::Sampling::General(16),
        camera: Some(Camera {
            projection: crate::scene::Projection::Pinhole(pinhole),
            ..camera(pose)
        }),
        ..crate::Settings::from_scene(scene)
    };
    let ready = crate::prepare(scene, &settings, &()).unwrap_or_else(|e| panic!("{e}"));
    let rgb = ready.render(&()).picture.rgb;
    let mean = rgb.iter().map(|pixel| pixel[0]).sum::<f32>() / rgb.len() as f32;
    (ready.has_headlight(), mean)
}

/// Protects: a closed room without light is lit from the camera within, whichever way its faces
/// point; a room with an open side, a room seen from outside, one with a lamp of its own and one
/// without the studio's light are not.
#[test]
fn enclosed_cameras_carry_a_lamp() {
    let plain = || serde_json::json!({ "base_colour": 0.4 });
    let all = [0, 1, 2, 3, 4, 5];
    for side in ["both", "inside"] {
        let (has_lamp, mean) = look_from(&room(&all, side, plain()), [0.3, 0.2, 1.5]);
        assert!(has_lamp && (0.2..1.0).contains(&mean), "{side}: {mean}");
    }
    let closed = room(&all, "both", plain());
    assert!(!look_from(&closed, [0.3, 0.2, 9.0]).0, "from outside");
    let (has_lamp, mean) = look_from(&room(&all[..5], "both", plain()), [0.3, 0.2, 1.5]);
    assert!(!has_lamp && mean > 0.02, "an open side: {mean}");
    let lamp = room(&all, "both", serde_json::json!({ "emission": 0.3 }));
    assert!(!look_from(&lamp, [0.3, 0.2, 1.5]).0, "a lamp of its own");
    let mut unlit = closed.clone();
    unlit.sky = Some(Sky::Studio(Studio {
        strength: 0.0,
        ..Studio::default()
    }));
    assert!(!look_from(&unlit, [0.3, 0.2, 1.5]).0, "a backdrop alone");
}

/// Protects: a closed room far from the origin is lit from the camera within as one at the origin.
#[test]
fn enclosed_cameras_far_away_carry_a_lamp() {
    for far in [1e3, 1e6, 1e9] {
        let mut scene = room(&[0, 1, 2, 3, 4, 5], "both", serde_json::json!({}));
        for object in &mut scene.objects {
            (object.transform).push(crate::scene::TransformStep::Translate([far, 0.0, -far]));
        }
        let [eye, target] = [[0.3, 0.2, 1.5], [0.0, 0.0, -2.0]];
        let [eye, target] = [eye, target].map(|[x, y, z]: [f64; 3]| [x + far, y, z - far]);
        let (has_lamp, mean) = look_along(&scene, eye, target);
        assert!(has_lamp && mean > 0.2, "{far} metres away: {mean}");
    }
}

/// Protects: a prepared scene takes another camera into a closed room, and out of it, only by a new
/// preparation.
#[test]
fn cameras_that_enter_a_room_are_prepared_anew() {
    let scene = room(&[0, 1, 2, 3, 4, 5], "both", serde_json::json!({}));
    let at = |z: f64| camera(look([0.1, 0.2, z], [0.0, 1.0, 0.0]));
    let prepared = |z: f64| {
        let settings = crate::Settings {
            size: [8, 8],
            camera: Some(at(z)),
            ..crate::Settings::from_scene(&scene)
        };
        crate::prepare(&scene, &settings, &()).unwrap_or_else(|e| panic!("{e}"))
    };
    for (from, to, is_kept) in [(9.0, 8.0, true), (9.0, 1.0, false), (1.0, 9.0, false)] {
        assert_eq!(
            prepared(from).replace_camera(&scene, &at(to)),
            is_kept,
            "{from} to {to}"
        );
    }
}
