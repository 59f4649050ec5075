use super::*;

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

fn key(studio: &Studio, pose: Pose) -> DVec3 {
    let Sky::Gradient { suns, .. } = studio_sky(studio, &camera(pose)) else {
        panic!("a gradient")
    };
    suns[0].direction.into()
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
    let front = key(&own, look([0.0, 0.0, 5.0], up));
    let expected = direction_from_angles(-40_f64.to_radians(), 45_f64.to_radians());
    assert!(
        (front - expected).length() < 1e-12 && front.x < 0.0 && front.y > 0.0 && front.z > 0.0,
        "{front}"
    );
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
        let side = key(&own, pose.clone());
        assert!(
            (side - DVec3::new(front.z, front.y, -front.x)).length() < 1e-12,
            "{pose:?}: {side}"
        );
    }
    assert!(
        (key(&own, look([0.0, 5.0, 0.0], [0.0, 0.0, -1.0])) - front).length() < 1e-12,
        "from above, the front at the foot"
    );
    assert!(
        (key(&own, look([0.0, -5.0, 0.0], [0.0, 0.0, 1.0])) - front).length() < 1e-12,
        "from below, the front at the head"
    );
    // The light from +x is now at +z.
    let turned = key(
        &Studio {
            rotation: 90.0,
            ..own
        },
        look([0.0, 0.0, 5.0], up),
    );
    assert!(
        (turned - DVec3::new(-front.z, front.y, front.x)).length() < 1e-12,
        "{turned}"
    );
}

/// Protects: a studio's strength multiplies all of its light, lamps and gradient alike.
#[test]
fn strength_multiplies_all_light() {
    let camera = camera(look([0.0, 0.0, 5.0], [0.0, 1.0, 0.0]));
    let value_of = |strength: f64| {
        let studio = Studio {
            strength,
            ..Studio::default()
        };
        let Sky::Gradient { bottom, top, suns } = studio_sky(&studio, &camera) else {
            panic!("a gradient")
        };
        suns.iter()
            .map(|sun| sun.weight)
            .chain(bottom.0)
            .chain(top.0)
            .collect::<Vec<_>>()
    };
    assert_eq!(
        value_of(2.0),
        value_of(1.0)
            .iter()
            .map(|radiance| 2.0 * radiance)
            .collect::<Vec<_>>()
    );
    assert_eq!(value_of(1.0)[..6], [3.8, 0.4, 5.0, BELOW, BELOW, BELOW]);
}

/// Protects: a white surface that faces the camera is bright and not clipped, and its sides have at
/// least a quarter of that brightness.
#[test]
fn white_is_bright_and_nowhere_clipped() {
    let camera = camera(look([0.0, 1.0, 5.0], [0.0, 1.0, 0.0]));
    let scene = crate::Scene::default();
    let sky = studio_sky(&Studio::default(), &camera);
    let sky = crate::light::prepare_sky::<f64>(
        (Some(&sky), DVec3::ZERO),
        &crate::SceneLookup::new(&scene),
        &std::collections::BTreeMap::new(),
    );
    let irradiance = crate::light::Irradiance::new(&sky.expect("a gradient"));
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
