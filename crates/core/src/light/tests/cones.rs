//! Spheres sampled by solid angle, near and far.

use core::f64::consts::PI;

use super::*;

/// Protects: the solid angle of a sphere up to 10⁷ radii away equals the series of 1 − √(1 − s²),
/// and sampled points lie on the visible side of the sphere.
#[test]
fn m04_far_balls_keep_their_solid_angle() {
    let centre = DVec3::new(3.0, -2.0, 1.0);
    for ratio in [1.000_001, 1.5, 10.0, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7] {
        let direction = DVec3::new(0.48, 0.6, 0.64);
        let cone =
            DirectionCone::new(centre, 0.25, centre + direction * (0.25 * ratio)).expect("outside");
        let s2 = 1.0 / (ratio * ratio);
        let height = if ratio < 10.0 {
            1.0 - (1.0 - s2).sqrt()
        } else {
            s2 * (0.5 + s2 * (0.125 + s2 * (0.0625 + s2 * (5.0 / 128.0 + s2 * 7.0 / 256.0))))
        };
        let error = cone.solid_angle() / (TAU * height) - 1.0;
        assert!(
            error.abs() <= 1e-9,
            "{ratio:e} radii away: off by {error:e}"
        );
        for i in 0..500 {
            let normal = cone.sample_normal(numbers(i).map(f64::from));
            assert!((normal.length() - 1.0).abs() < 1e-9, "{normal}");
            // Visible points lie on the near side of the circle of tangent rays.
            assert!(
                normal.dot(direction) >= 1.0 / ratio - 1e-9,
                "{ratio:e} radii away: {normal}"
            );
        }
    }
}

/// Protects: a distant sphere yields π·(r/d)² without noise but for the direction within the narrow
/// cone.
#[test]
fn m04_far_balls_send_their_light_without_noise() {
    for ratio in [10.0, 1e3, 1e5, 1e7] {
        let ball = Sphere {
            centre: DVec3::new(0.0, 0.25 * ratio, 0.0),
            radius: 0.25,
        };
        let (lights, _) = surface::<f64>(ball.into(), None, EmitterStrategy::SolidAngle);
        for i in 0..200 {
            let sample = lights
                .sample(LightId::Emitter(0), DVec3::ZERO, numbers(i), 1.0)
                .expect("all of it is seen");
            let expected = PI / (ratio * ratio);
            assert!(
                (sample.arriving.x / expected - 1.0).abs() <= 0.3 / (ratio * ratio) + 1e-5,
                "{ratio:e}: {}",
                sample.arriving.x
            );
        }
    }
}

/// Protects: inside and on a sphere no cone exists, and points are sampled by area; a room lit by
/// its walls yields π from anywhere.
#[test]
fn m04_within_a_ball_points_are_drawn_by_area() {
    let centre = DVec3::new(1.0, 2.0, 3.0);
    assert!(
        [DVec3::ZERO, DVec3::X, DVec3::Y * 0.5]
            .iter()
            .all(|&d| DirectionCone::new(centre, 1.0, centre + d).is_none())
    );
    assert!(DirectionCone::new(centre, 1.0, DVec3::NAN).is_none());
    let mut list = EmitterList::<f64>::default();
    list.add_shape(
        Sphere {
            centre,
            radius: 1.0,
        }
        .into(),
        EmissionEstimate::from_uniform_emission(DVec3::ONE),
        Side::Inside,
        None,
    );
    let lights = alone(list, EmitterStrategy::SolidAngle);
    let (mut sum, mut squares, count) = (0.0, 0.0, 40_000_u32);
    for i in 0..count {
        let from = centre + DVec3::new(0.3, 0.1, -0.2);
        let sample = lights
            .sample(LightId::Emitter(0), from, numbers(i.into()), 1.0)
            .expect("walls all around");
        let x = sample.arriving.x * sample.direction.y.max(0.0);
        (sum, squares) = (sum + x, squares + x * x);
    }
    let mean = sum / f64::from(count);
    let error = ((squares / f64::from(count) - mean * mean) / f64::from(count)).sqrt();
    assert!(
        (mean - PI).abs() <= 3.0 * error && error < 0.03,
        "{mean} ± {error}"
    );
}
