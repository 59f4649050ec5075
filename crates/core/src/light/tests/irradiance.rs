//! Mean irradiance against closed forms, and receivers where a formula could divide by zero.

use core::f64::consts::PI;

use super::*;

/// Mean and standard error of the irradiance on a surface of unit normal `n`, first channel.
fn estimate<R: Real>(
    lights: &Lights<R>,
    light: LightId,
    from: DVec3,
    n: DVec3,
    samples: u64,
) -> [f64; 2] {
    let (mut sum, mut squares) = (0.0, 0.0);
    for i in 0..samples {
        let sample = lights.sample(light, Vector::from_f64(from), numbers(i), 1.0);
        let x = sample.map_or(0.0, |s| {
            s.arriving.to_f64().x * s.direction.to_f64().dot(n).max(0.0)
        });
        (sum, squares) = (sum + x, squares + x * x);
    }
    let count = samples as f64;
    let mean = sum / count;
    [
        mean,
        ((squares / count - mean * mean).max(0.0) / count).sqrt(),
    ]
}

/// Asserts that the mean is within three standard errors, and that the error is small enough to be
/// meaningful.
fn check_irradiance<R: Real>(
    name: &str,
    lights: &Lights<R>,
    light: LightId,
    from: DVec3,
    n: DVec3,
    expected: f64,
) {
    let [mean, error] = estimate(lights, light, from, n, 40_000);
    assert!(
        (mean - expected).abs() <= 3.0 * error + 2e-6 * expected,
        "{name}: {mean} ± {error}, not {expected}"
    );
    assert!(error <= 0.02 * expected, "{name}: {mean} ± {error}");
}

/// Irradiance from a polygon of radiance one before a surface (Lambert, "Photometria", 1760): half
/// the sum over its edges of the angle of the edge times the cosine between the normal and the edge
/// plane's normal.
fn lambert(corners: &[DVec3], from: DVec3, n: DVec3) -> f64 {
    let edge = |i: usize| {
        let (a, b) = (corners[i] - from, corners[(i + 1) % corners.len()] - from);
        let normal = a.cross(b);
        libm::atan2(normal.length(), a.dot(b)) * normal.normalize().dot(n)
    };
    (0.5 * (0..corners.len()).map(edge).sum::<f64>()).abs()
}

/// Protects: polygons and spheres yield the irradiance of closed forms, by both strategies and in
/// both precisions.
#[test]
fn surface_irradiance_has_closed_forms() {
    fn check<R: Real>() {
        let (from, n) = (DVec3::new(0.1, -0.2, 0.05), DVec3::Y);
        for strategy in [EmitterStrategy::Area, EmitterStrategy::SolidAngle] {
            for (name, shape, _) in shapes::<R>().into_iter().filter(|(.., map)| map.is_none()) {
                let expected = match &shape {
                    AnyShape::Quad(quad) => lambert(&quad.corners.map(Vector::to_f64), from, n),
                    AnyShape::Triangle(triangle) => {
                        lambert(&triangle.vertices.map(Vector::to_f64), from, n)
                    }
                    // π · (r/d)² · cos θ.
                    AnyShape::Sphere(ball) => {
                        let across = ball.centre.to_f64() - from;
                        PI * ball.radius.to_f64().powi(2) * across.normalize().dot(n)
                            / across.length_squared()
                    }
                    _ => continue,
                };
                let lights = surface::<R>(shape, None, strategy).0;
                check_irradiance(
                    &format!("{name} by {strategy:?}"),
                    &lights,
                    LightId::Emitter(0),
                    from,
                    n,
                    expected,
                );
            }
        }
    }
    check::<f32>();
    check::<f64>();
}

/// Protects: skies yield the irradiance of closed forms: π·L, π·(a + ⅔·b·n.y) for a + b·y, 2π/(k
/// + 2) for a lobe of exponent k along the normal, and for an image a sum over directions.
#[test]
fn sky_irradiance_has_closed_forms() {
    let direct = |sky: &SkyRadiance<f64>, n: DVec3| {
        const STEPS: u32 = 720;
        let cell = 2.0 * TAU / f64::from(STEPS * STEPS);
        let at = |i: u32| (f64::from(i) + 0.5) / f64::from(STEPS);
        let seen = (0..STEPS * STEPS).map(|i| {
            let (y, turn) = (2.0 * at(i / STEPS) - 1.0, TAU * at(i % STEPS));
            let d = DVec3::new(
                (1.0 - y * y).sqrt() * turn.cos(),
                y,
                (1.0 - y * y).sqrt() * turn.sin(),
            );
            sky.radiance(DVec3::ZERO, d).x * d.dot(n).max(0.0)
        });
        seen.sum::<f64>() * cell
    };
    let sun = SkyRadiance {
        kind: sky::SkyKind::Gradient(sky::GradientSky {
            bottom: DVec3::ZERO,
            top: DVec3::ZERO,
            suns: vec![sky::SunLobe {
                direction: DVec3::X,
                colour: DVec3::ONE,
                exponent: 65_536,
            }],
        }),
    };
    check_irradiance(
        "sun",
        &under::<f64>(sun),
        LightId::Sky,
        DVec3::ZERO,
        DVec3::X,
        TAU / 65_538.0,
    );
    for (name, sky) in skies::<f64>() {
        for n in [
            DVec3::Y,
            DVec3::new(0.6, -0.8, 0.0),
            DVec3::new(0.0, 0.6, 0.8),
        ] {
            let expected = match name {
                "constant" => 0.2 * PI,
                "gradient" => PI * (0.5 + 0.5 * 2.0 / 3.0 * n.y),
                _ => direct(&sky, n),
            };
            check_irradiance(
                name,
                &under::<f64>(sky.clone()),
                LightId::Sky,
                DVec3::ZERO,
                n,
                expected,
            );
        }
    }
}

/// Protects: a sky without a sampler costs nothing and is never sampled; a black sky gets no
/// sampler.
#[test]
fn an_unasked_sky_is_not_built() {
    let sky = |kind| SkyRadiance::<f64> { kind };
    let white = sky(sky::SkyKind::Constant(DVec3::ONE));
    let lights = Lights::<f64>::new(
        Vec::new(),
        Emitters::new(EmitterList::default()),
        white,
        &Aabb::EMPTY,
    );
    assert!(lights.light_ids().next().is_none() && lights.sky_sampler.is_none());
    assert!(
        lights
            .sample(LightId::Sky, DVec3::ZERO, [0.5; 2], 1.0)
            .is_none()
    );
    assert!(SkySampler::new(&sky(sky::SkyKind::Black)).is_none());
    assert!(SkySampler::new(&sky(sky::SkyKind::Constant(DVec3::ZERO))).is_none());
}

/// Protects: receivers in the light's plane, at its corner, border and centre, and a millionth
/// beside them, yield no infinity and no NaN, by either strategy.
#[test]
fn m03_receivers_in_the_plane_of_a_light_hear_numbers() {
    fn check<R: Real>(strategy: EmitterStrategy) {
        let (corner, u, v) = (
            DVec3::new(-1.0, 1.0, -1.0),
            DVec3::new(2.0, 0.0, 0.0),
            DVec3::new(0.0, 0.0, 2.0),
        );
        let quad = AnyShape::from(Quad::new(corner, u, v));
        let triangle = Triangle::new([corner, corner + u, corner + v].map(Vector::from_f64)).into();
        let ball = Sphere {
            centre: Vector::from_f64(DVec3::new(0.0, 1.0, 0.0)),
            radius: R::ONE,
        }
        .into();
        for shape in [quad, triangle, ball] {
            let (lights, _) = surface::<R>(shape, None, strategy);
            let places = [
                corner,
                corner + u * 0.5,
                corner + (u + v) * 0.25,
                corner + u * 3.0,
                DVec3::new(0.0, 0.0, 0.0),
            ];
            for from in places
                .iter()
                .flat_map(|&p| [0.0, 1e-6, -1e-6].map(|lift| p + DVec3::Y * lift))
            {
                let from = R::Vec3::from_f64(from);
                let corners = [
                    [0.0; 2],
                    [0.0, 1.0_f32.next_down()],
                    [1.0_f32.next_down(); 2],
                ];
                for position in (0..500).map(numbers).chain(corners) {
                    let Some(sample) = lights.sample(LightId::Emitter(0), from, position, 1.0)
                    else {
                        continue;
                    };
                    let LightDensity::SolidAngle(density) = sample.density else {
                        panic!("it has a size")
                    };
                    assert!(
                        sample.arriving.is_finite() && sample.direction.is_finite(),
                        "{from:?}: {sample:?}"
                    );
                    assert!(density > 0.0 && density.is_finite(), "{from:?}: {sample:?}");
                    let again = lights.density(
                        LightId::Emitter(0),
                        from,
                        sample.direction,
                        &sample.target,
                        1.0,
                    );
                    assert!(again > 0.0 && again.is_finite(), "{from:?}: {again}");
                }
            }
        }
    }
    for strategy in [EmitterStrategy::Area, EmitterStrategy::SolidAngle] {
        check::<f32>(strategy);
        check::<f64>(strategy);
    }
}

/// Protects: a millionth before a quad, at its centre, beside it and at its corner, the mean is
/// Lambert's and no sample is an outlier, for solid-angle sampling.
#[test]
fn m03_receivers_close_to_a_quad_hear_no_sparks() {
    let (corner, u, v) = (
        DVec3::new(-1.0, 1.0, -1.0),
        DVec3::new(2.0, 0.0, 0.0),
        DVec3::new(0.0, 0.0, 2.0),
    );
    let (lights, _) = surface::<f64>(
        Quad::new(corner, u, v).into(),
        None,
        EmitterStrategy::SolidAngle,
    );
    for across in [
        u * 0.5 + v * 0.5,
        u * 0.3 + v * 0.6,
        u * 0.5,
        DVec3::ZERO,
        (u + v) * 1e-6,
    ] {
        let from = corner + across - DVec3::Y * 1e-6;
        let expected = lambert(
            &[corner, corner + u, corner + u + v, corner + v],
            from,
            DVec3::Y,
        );
        check_irradiance(
            &format!("{across}"),
            &lights,
            LightId::Emitter(0),
            from,
            DVec3::Y,
            expected,
        );
        let most =
            (0..1024).filter_map(|i| lights.sample(LightId::Emitter(0), from, numbers(i), 1.0));
        let maximum = most
            .map(|s| s.arriving.x * s.direction.y)
            .fold(0.0, f64::max);
        assert!(
            maximum <= 1e4 * expected,
            "{across}: a sample of {maximum}, mean {expected}"
        );
    }
}

/// Protects: the solid angle of an octant, of half of it, and of polygons that are small or seen
/// from their own plane, which count as none.
#[test]
fn polygons_have_their_solid_angle() {
    let corners = [DVec3::X * 2.0, DVec3::Y * 3.0, DVec3::Z * 0.5];
    let octant = Polygon::from_triangle(corners)
        .solid_angle(DVec3::ZERO)
        .expect("it is large");
    assert!((octant - 0.5 * PI).abs() < 1e-14, "{octant}");
    let [a, b, c] = [DVec3::X, DVec3::Y, DVec3::Z];
    let halves = Polygon::from_quad([b, a, a + c, c])
        .solid_angle(DVec3::ZERO)
        .expect("it is large");
    assert!((halves - 0.5 * PI).abs() < 1e-14, "{halves}");
    for from in [a, (a + b + c) / 3.0, a * 2.0 - b, a * 1e3, DVec3::NAN] {
        assert!(
            Polygon::from_triangle(corners.map(|p| p.normalize()))
                .solid_angle(from)
                .is_none(),
            "{from}"
        );
    }
}
