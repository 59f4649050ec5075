//! Every kind of light against its density and against closed forms, through the common interface.

mod cones;
mod irradiance;
mod varied;

use core::f64::consts::TAU;

use super::*;
use crate::hash::splitmix64;
use crate::scene::{Colour, Falloff, Light, LightKind};
use glam::{DAffine3, DVec3};
use raywright_bvh::shapes::{
    AnyShape, Cuboid, Cylinder, Disk, Quad, Sphere, TransformedShape, Triangle,
};
use raywright_bvh::{
    AcceleratorKind, Geometry, Interval, PrimitiveSet, Ray, Side, Vector, Visibility,
};

/// Two uniform pseudo-random numbers in [0, 1).
fn numbers(i: u64) -> [f32; 2] {
    [2 * i, 2 * i + 1].map(|k| (splitmix64(k) >> 41) as f32 / (1 << 23) as f32)
}

/// Lights of a scene with these emitters alone.
fn alone<R: Real>(list: EmitterList<R>, strategy: EmitterStrategy) -> Lights<R> {
    let mut emitters = Emitters::new(list);
    emitters.strategy = strategy;
    let none = SkyRadiance {
        kind: sky::SkyKind::Black,
    };
    Lights::new(
        Vec::new(),
        emitters,
        none,
        &Aabb {
            min: DVec3::NEG_ONE,
            max: DVec3::ONE,
        },
    )
}

/// One outward-emitting shape of radiance one, as a light and as geometry.
fn surface<R: Real>(
    shape: AnyShape<R>,
    map: Option<DAffine3>,
    strategy: EmitterStrategy,
) -> (Lights<R>, Geometry<R>) {
    let (mut list, mut group) = (EmitterList::default(), PrimitiveSet::default());
    let visibility = Visibility {
        side: Side::Outside,
        ..Visibility::default()
    };
    list.begin_object();
    match map {
        None => {
            list.add_shape(
                shape,
                EmissionEstimate::from_uniform_emission(Vector::ONE),
                Side::Outside,
                None,
            );
            group.add_shape(shape, visibility).expect("a shape");
        }
        Some(map) => {
            list.add_transformed_shape(
                TransformedShape::new(shape, map).expect("a map"),
                EmissionEstimate::from_uniform_emission(Vector::ONE),
                Side::Outside,
                None,
            );
            group
                .add_transformed_shape(shape, map, visibility)
                .expect("a shape");
        }
    }
    (
        alone(list, strategy),
        Geometry::new(group, AcceleratorKind::Linear),
    )
}

/// Convex shapes above the origin, some transformed.
fn shapes<R: Real>() -> Vec<(&'static str, AnyShape<R>, Option<DAffine3>)> {
    let v = DVec3::new;
    let at = |p: DVec3| R::Vec3::from_f64(p);
    let turn = DAffine3::from_axis_angle(v(1.0, -2.0, 0.5).normalize(), 1.1);
    let map = DAffine3::from_translation(v(0.3, 2.5, -0.4))
        * turn
        * DAffine3::from_scale(v(1.5, 0.5, -0.8));
    let ball = AnyShape::from(Sphere {
        centre: Vector::ZERO,
        radius: R::ONE,
    });
    let quad = AnyShape::from(Quad::new(
        v(-1.0, 1.2, -0.8),
        v(1.9, 0.3, 0.2),
        v(-0.1, 0.4, 1.7),
    ));
    vec![
        ("quad", quad, None),
        (
            "triangle",
            Triangle::new([
                at(v(-0.5, 1.0, -1.0)),
                at(v(1.5, 1.3, -0.3)),
                at(v(0.1, 1.6, 1.2)),
            ])
            .into(),
            None,
        ),
        (
            "disk",
            Disk::new(v(0.2, 1.4, 0.1), v(0.2, -1.0, 0.3), 1.1).into(),
            None,
        ),
        (
            "ball",
            Sphere {
                centre: at(v(0.5, 1.5, -0.3)),
                radius: R::from_f64(0.9),
            }
            .into(),
            None,
        ),
        (
            "box",
            Cuboid::new(v(-0.7, 0.8, -0.2), v(0.9, 1.7, 1.1)).into(),
            None,
        ),
        (
            "tin",
            Cylinder::new(v(-0.9, 1.0, 0.2), v(1.0, 0.5, 0.0), 0.6, Some(1.8), true).into(),
            None,
        ),
        ("placed ball", ball, Some(map)),
        (
            "placed quad",
            quad,
            Some(
                DAffine3::from_translation(v(0.1, -0.3, 0.2))
                    * DAffine3::from_scale(v(1.4, 1.0, 0.6)),
            ),
        ),
    ]
}

/// Skies that can be sampled.
fn skies<R: Real>() -> Vec<(&'static str, SkyRadiance<R>)> {
    let v = |x: f64, y: f64, z: f64| R::Vec3::from_f64(DVec3::new(x, y, z));
    let sun = |d: DVec3, strength: f64, exponent: u32| sky::SunLobe {
        direction: R::Vec3::from_f64(d.normalize()),
        colour: v(strength, 0.5 * strength, 0.0),
        exponent,
    };
    let suns = vec![
        sun(DVec3::new(0.3, 0.8, 0.2), 5.0, 40),
        sun(DVec3::new(-1.0, 0.1, 0.4), 2.0, 3),
    ];
    let texel = |i: u64| {
        [
            (splitmix64(i) >> 44) as f32 / (1 << 20) as f32,
            0.3,
            if i == 21 { 40.0 } else { 0.0 },
            1.0,
        ]
    };
    let pixels = crate::scene::PixelData::Linear((0..72).map(texel).collect());
    let image = std::sync::Arc::new(crate::scene::ImageData {
        width: 12,
        height: 6,
        pixels,
    });
    vec![
        (
            "constant",
            SkyRadiance {
                kind: sky::SkyKind::Constant(v(0.2, 0.5, 1.0)),
            },
        ),
        (
            "gradient",
            SkyRadiance {
                kind: sky::SkyKind::Gradient(sky::GradientSky {
                    bottom: v(0.0, 0.0, 0.0),
                    top: v(1.0, 2.0, 3.0),
                    suns: Vec::new(),
                }),
            },
        ),
        (
            "suns",
            SkyRadiance {
                kind: sky::SkyKind::Gradient(sky::GradientSky {
                    bottom: v(0.3, 0.3, 0.3),
                    top: v(0.1, 0.2, 0.3),
                    suns,
                }),
            },
        ),
        (
            "map",
            SkyRadiance {
                kind: sky::SkyKind::Map(sky::EquirectMap::new(
                    image,
                    R::from_f64(0.15),
                    R::from_f64(2.0),
                )),
            },
        ),
    ]
}

fn under<R: Real>(sky: SkyRadiance<R>) -> Lights<R> {
    let mut lights = Lights::new(
        Vec::new(),
        Emitters::new(EmitterList::default()),
        sky,
        &Aabb::EMPTY,
    );
    lights.build_sky_sampler();
    lights
}

const ROWS: usize = 12;
const COLUMNS: usize = 24;

/// Tests by χ² that samples follow the density over cells of equal solid angle, up to six standard
/// deviations above the mean. Cells of low expectation, and failed samples, count together.
fn agrees<R: Real>(
    name: &str,
    lights: &Lights<R>,
    light: LightId,
    from: R::Vec3,
    density: impl Fn(R::Vec3) -> f64,
) {
    const SAMPLES: u64 = 30_000;
    const STEPS: usize = 64;
    let mut counts = [0_u32; ROWS * COLUMNS];
    for i in 0..SAMPLES {
        let Some(sample) = lights.sample(light, from, numbers(i), 1.0) else {
            continue;
        };
        let d = sample.direction.to_f64();
        let row = ((d.y + 1.0) * 0.5 * ROWS as f64) as usize;
        let column = (libm::atan2(d.z, d.x) / TAU).rem_euclid(1.0) * COLUMNS as f64;
        counts[row.min(ROWS - 1) * COLUMNS + (column as usize).min(COLUMNS - 1)] += 1;
    }
    let (mut chi2, mut cells, mut rare) = (0.0, 0_u32, [SAMPLES as f64, SAMPLES as f64]);
    for (cell, &count) in counts.iter().enumerate() {
        let at = |i: usize, total: usize, part: usize| {
            (i as f64 + (part as f64 + 0.5) / STEPS as f64) / total as f64
        };
        let mut mean = 0.0;
        for part in 0..STEPS * STEPS {
            let y = 2.0 * at(cell / COLUMNS, ROWS, part / STEPS) - 1.0;
            let (turn, ring) = (
                TAU * at(cell % COLUMNS, COLUMNS, part % STEPS),
                (1.0 - y * y).sqrt(),
            );
            mean += density(Vector::from_f64(DVec3::new(
                ring * libm::cos(turn),
                y,
                ring * libm::sin(turn),
            )));
        }
        let expected =
            SAMPLES as f64 * mean / (STEPS * STEPS) as f64 * 2.0 * TAU / (ROWS * COLUMNS) as f64;
        if expected >= 20.0 {
            chi2 += (f64::from(count) - expected) * (f64::from(count) - expected) / expected;
            cells += 1;
            (rare[0], rare[1]) = (rare[0] - f64::from(count), rare[1] - expected);
        }
    }
    // The second term bounds the error of the midpoint rule along the light's border.
    let few = rare[1].max(1.0);
    assert!(
        (rare[0] - rare[1]).abs() <= 5.0 * few.sqrt() + 2e-3 * SAMPLES as f64,
        "{name}: {rare:?} in rare cells or undrawn"
    );
    let (mean, spread) = (f64::from(cells), (2.0 * f64::from(cells)).sqrt());
    assert!(
        cells > 0 && chi2 <= mean + 6.0 * spread,
        "{name}: χ² = {chi2} in {cells} cells"
    );
}

/// Protects: directions to every kind of surface, by both strategies, follow the density at the
/// ray's hit.
#[test]
fn surfaces_are_drawn_by_their_density() {
    let from = DVec3::new(0.1, -0.2, 0.05);
    for (name, shape, map) in shapes::<f64>() {
        let known = map.is_none()
            && matches!(
                shape,
                AnyShape::Sphere(_) | AnyShape::Triangle(_) | AnyShape::Quad(_)
            );
        for strategy in [EmitterStrategy::Area, EmitterStrategy::SolidAngle]
            .into_iter()
            .take(1 + usize::from(known))
        {
            let (lights, geometry) = surface::<f64>(shape, map, strategy);
            let light = LightId::Emitter(0);
            agrees(
                &format!("{name} by {strategy:?}"),
                &lights,
                light,
                from,
                |d| {
                    let ray = Ray::new(from, d);
                    let hit = geometry.closest(&ray, Interval::positive(), &mut ());
                    let light_target = hit.map_or(ShadowRayTarget::Infinity, |hit| {
                        ShadowRayTarget::Surface(geometry.surface(&ray, &hit))
                    });
                    lights.density(light, from, d, &light_target, 1.0)
                },
            );
        }
    }
}

/// Protects: sampled directions of every kind of sky follow the density.
#[test]
fn skies_are_drawn_by_their_density() {
    for (name, sky) in skies::<f64>() {
        let lights = under::<f64>(sky);
        let density = |d| {
            lights.density(
                LightId::Sky,
                DVec3::ZERO,
                d,
                &ShadowRayTarget::Infinity,
                1.0,
            )
        };
        agrees(name, &lights, LightId::Sky, DVec3::ZERO, density);
    }
}

/// Protects: the density of a sampled point equals the density of a hit there, the choice included;
/// the point lies within the light's bounds, in a direction of emission.
#[test]
fn a_hit_has_the_density_of_the_draw() {
    fn check<R: Real>(name: &str, lights: &Lights<R>, tolerance: f64) {
        let from = R::Vec3::from_f64(DVec3::new(0.1, -0.2, 0.05));
        let ids: Vec<LightId> = lights.light_ids().collect();
        assert_eq!(ids.len(), 1, "{name}");
        let (light, mut drawn) = (ids[0], 0);
        assert!(!lights.is_delta(light) && lights.power(light) >= 0.0);
        for i in 0..2_000 {
            let Some(sample) = lights.sample(light, from, numbers(i), 0.125) else {
                continue;
            };
            let LightDensity::SolidAngle(density) = sample.density else {
                panic!("{name}: {:?}", sample.density)
            };
            let again = lights.density(light, from, sample.direction, &sample.target, 0.125);
            assert!(
                (again / density - 1.0).abs() <= tolerance,
                "{name}: {again} and {density}"
            );
            if let (Some(bounds), ShadowRayTarget::Surface(at)) =
                (lights.bounds(light), sample.target)
            {
                let (space, p) = (bounds.bounding_box, at.point.to_f64());
                assert!(
                    (space.min - 1e-5).cmple(p).all() && (space.max + 1e-5).cmpge(p).all(),
                    "{name}: {p} outside"
                );
                assert!(
                    bounds.may_emit(-sample.direction.to_f64()),
                    "{name}: {:?} has no {}",
                    bounds,
                    -sample.direction.to_f64()
                );
                let exit = EmissionPoint {
                    surface: at,
                    uv: [R::ZERO; 2],
                    direction: sample.direction,
                };
                assert_eq!(lights.emitters.radiance(0, &exit), Vector::ONE, "{name}");
                let behind = EmissionPoint {
                    direction: -sample.direction,
                    ..exit
                };
                assert_eq!(lights.emitters.radiance(0, &behind), Vector::ZERO, "{name}");
            }
            drawn += 1;
        }
        assert!(drawn >= 400, "{name}: {drawn} drawn");
    }
    for strategy in [EmitterStrategy::Area, EmitterStrategy::SolidAngle] {
        shapes().into_iter().for_each(|(name, shape, map)| {
            check(name, &surface::<f32>(shape, map, strategy).0, 1e-5)
        });
        shapes().into_iter().for_each(|(name, shape, map)| {
            check(name, &surface::<f64>(shape, map, strategy).0, 1e-9)
        });
    }
    skies()
        .into_iter()
        .for_each(|(name, sky)| check(name, &under::<f32>(sky), 0.0));
    skies()
        .into_iter()
        .for_each(|(name, sky)| check(name, &under::<f64>(sky), 0.0));
}

fn delta(kind: LightKind) -> Lights<f64> {
    let light = Light {
        name: String::new(),
        kind,
        colour: Colour([1.0, 2.0, 0.0]),
        shadows: true,
        specular: true,
    };
    let none = Emitters::new(EmitterList::default());
    Lights::new(
        vec![DeltaLight::new(&light, true)],
        none,
        SkyRadiance {
            kind: sky::SkyKind::Black,
        },
        &Aabb {
            min: DVec3::NEG_ONE,
            max: DVec3::ONE,
        },
    )
}

/// Protects: delta lights are marked as such, have no density for hits, are divided by the
/// probability of their choice, and have as power the flux through a sphere around them.
#[test]
fn lights_without_size_say_so() {
    let position = [0.5, 2.0, -1.0];
    let (down, falloff) = ([0.3, -1.0, 0.2], Falloff::InverseSquare);
    let spot = LightKind::Spot {
        position,
        direction: down,
        inner_angle: 20.0,
        outer_angle: 50.0,
        falloff,
        range: None,
    };
    let kinds = [
        LightKind::Point {
            position,
            falloff,
            range: None,
        },
        spot,
        LightKind::Directional {
            to_light: [1.0, 2.0, 2.0],
        },
    ];
    for kind in kinds {
        let (lights, light) = (delta(kind.clone()), LightId::Delta(0));
        assert!(lights.is_delta(light) && lights.light_ids().eq([light]));
        let from = DVec3::new(0.5, 0.0, -0.9);
        let sample = lights
            .sample(light, from, [0.5; 2], 0.25)
            .expect("it shines there");
        assert_eq!(sample.density, LightDensity::Delta);
        assert_eq!(
            lights.density(light, from, sample.direction, &sample.target, 1.0),
            0.0
        );
        let light_sample = lights
            .sample(light, from, [0.5; 2], 1.0)
            .expect("it shines there");
        assert_eq!(sample.arriving, light_sample.arriving * 4.0);
        let LightKind::Directional { .. } = kind else {
            // Flux through a sphere of radius two around the light, by the midpoint rule.
            let mut flux = 0.0;
            for i in 0..400 * 400 {
                let (y, turn) = (
                    f64::from(i / 400) / 200.0 - 0.9975,
                    TAU * f64::from(i % 400) / 400.0,
                );
                let ring = (1.0 - y * y).sqrt();
                let out = DVec3::new(ring * turn.cos(), y, ring * turn.sin());
                let seen_light_sample =
                    lights.sample(light, DVec3::from(position) + out * 2.0, [0.5; 2], 1.0);
                let bounds = lights.bounds(light).expect("it is somewhere");
                assert!(bounds.may_emit(out) || seen_light_sample.is_none(), "{out}");
                flux += seen_light_sample.map_or(0.0, |s| s.arriving.x + s.arriving.y)
                    * 4.0
                    * 2.0
                    * TAU
                    / (400.0 * 400.0);
            }
            assert!(
                (lights.power(light) / flux - 1.0).abs() < 1e-3,
                "{} and {flux}",
                lights.power(light)
            );
            continue;
        };
        // π · 3 · 3: flux through a disk as wide as the scene, that is its diagonal √12.
        assert!(
            (lights.power(light) - core::f64::consts::PI * 9.0).abs() < 1e-9
                && lights.bounds(light).is_none()
        );
    }
}
