//! Tests of the light choice: lights are sampled by their stated probability, at any position and
//! number.

use super::*;
use crate::hash::splitmix64;
use crate::light::sky::{SkyKind, SkyRadiance};
use crate::light::{DeltaLight, EmissionEstimate, EmitterList, Emitters};
use crate::scene::{Colour, Falloff, Light as LightData, LightKind};
use glam::DVec3;
use raywright_bvh::shapes::{AnyShape, Sphere};
use raywright_bvh::{Aabb, Side};

/// Emissive spheres with these centres and radiances.
fn lights(balls: impl Iterator<Item = (DVec3, f64)>) -> Lights<f64> {
    let mut list = EmitterList::default();
    for (centre, radiance) in balls {
        list.begin_object();
        list.add_shape(
            AnyShape::Sphere(Sphere {
                centre,
                radius: 0.01,
            }),
            EmissionEstimate::from_uniform_emission(DVec3::splat(radiance)),
            Side::Outside,
            None,
        );
    }
    let scene = Aabb {
        min: DVec3::splat(-9.0),
        max: DVec3::splat(9.0),
    };
    let sky = SkyRadiance {
        kind: SkyKind::Constant(DVec3::splat(0.1)),
    };
    let mut lights = Lights::new(Vec::new(), Emitters::new(list), sky, &scene);
    lights.build_sky_sampler();
    lights.build_light_sampler();
    lights
}

fn number(i: u64) -> f64 {
    (splitmix64(i) >> 11) as f64 / (1_u64 << 53) as f64
}

/// Position of a light by its number.
type LightPlace = fn(u64) -> DVec3;

fn place(i: u64) -> DVec3 {
    DVec3::new(number(3 * i), number(3 * i + 1), number(3 * i + 2)) * 8.0 - 4.0
}

/// Protects: each light is sampled with its stated probability (M10). The probabilities sum to one,
/// less the probability of failure where no light of a subtree contributes; a light without power
/// is never sampled.
#[test]
fn lights_are_drawn_by_their_probability() {
    const COUNT: u64 = 40_000;
    let powers = [0.0, 1e-30, 1.0, 3.0, 1e30];
    let mixed = lights((0..60).map(|i| (place(i), powers[(i % 4) as usize])));
    let wild = lights((0..20).map(|i| (place(i), powers[(i % 5) as usize])));
    for (name, lights) in [("mixed", &mixed), ("wild", &wild)] {
        for (from, normal) in [
            (DVec3::new(0.3, -4.5, 0.1), DVec3::Y),
            (DVec3::ZERO, DVec3::new(0.6, 0.0, 0.8)),
            (DVec3::ONE, DVec3::ZERO),
        ] {
            let probability = |id| lights.light_sampler().probability::<f64>(id, from, normal);
            let total: f64 = lights.light_ids().map(probability).sum();
            assert!(
                total > 0.2 && total < 1.0 + 1e-9,
                "{name} from {from}: {total}"
            );
            let mut missed: f64 = 0.0;
            let mut found = vec![0.0; lights.emitters.len() + 1];
            for i in 0..COUNT {
                let pair = [2 * i, 2 * i + 1].map(|k| number(k) as f32 * 0.999_999_9);
                let Some((light, drawn)) = lights.light_sampler().sample::<f64>(from, normal, pair)
                else {
                    missed += 1.0;
                    continue;
                };
                assert!(
                    (drawn / probability(light) - 1.0).abs() < 1e-9,
                    "{name}: {drawn} and {}",
                    probability(light)
                );
                let slot = if let LightId::Emitter(i) = light {
                    i as usize
                } else {
                    lights.emitters.len()
                };
                found[slot] += 1.0;
            }
            let expected = (1.0 - total) * COUNT as f64;
            assert!(
                (missed - expected).abs() <= 5.0 * (expected + 1.0).sqrt(),
                "{name} from {from}: {missed}, not {expected}"
            );
            for (id, found) in lights.light_ids().zip(&found) {
                let expected = probability(id) * COUNT as f64;
                let off: f64 = found - expected;
                assert!(
                    off.abs() <= 5.0 * (expected + 1.0).sqrt(),
                    "{name} from {from}, {id:?}: {found}, not {expected}"
                );
                if id != LightId::Sky {
                    assert!(
                        lights.power(id) > 0.0 || probability(id) == 0.0,
                        "{name}: {id:?} has no power"
                    );
                }
            }
        }
    }
}

/// Protects: no lights, one light, many lights, many at one position, in a row of powers of their
/// spacing, and duplicates: a tree is built, stays shallow, and reaches each light.
#[test]
fn many_lights_anywhere() {
    let choose = |lights: &Lights<f64>, from: DVec3| {
        let sum: f64 = lights
            .light_ids()
            .map(|id| {
                lights
                    .light_sampler()
                    .probability::<f64>(id, from, DVec3::ZERO)
            })
            .sum();
        (sum, lights.light_sampler().tree.depth())
    };
    let from = DVec3::new(0.1, 0.2, 30.0);
    assert_eq!(choose(&lights(core::iter::empty()), from), (1.0, 0));
    assert!((choose(&lights(core::iter::once((DVec3::X, 2.0))), from).0 - 1.0).abs() < 1e-12);
    let sets: [(&str, LightPlace); 4] = [
        ("scattered", place),
        ("at one place", |_| DVec3::X),
        ("in a row that grows", |i| {
            DVec3::X * 1.005_f64.powi((i % 4000) as i32)
        }),
        ("each twice", |i| place(i / 2)),
    ];
    for (name, at) in sets {
        let (sum, depth) = choose(&lights((0..20_000).map(|i| (at(i), 1.0 + number(i)))), from);
        assert!(
            (sum - 1.0).abs() < 1e-6 && depth <= 64,
            "{name}: {sum}, {depth} deep"
        );
    }
}

/// Protects: a point light is sampled equally from below and above, a spot equally at the edge and
/// in the middle of its cone, as a point of its intensity, and never beyond the cone; the nearer of
/// two lights is sampled in proportion to its contribution.
#[test]
fn points_and_spots_shine_evenly() {
    let light = |kind| {
        let data = LightData {
            name: String::new(),
            kind,
            colour: Colour([4.0; 3]),
            shadows: true,
            specular: true,
        };
        DeltaLight::<f64>::new(&data, true)
    };
    let point = |target_point: DVec3| {
        light(LightKind::Point {
            position: target_point.to_array(),
            falloff: Falloff::InverseSquare,
            range: None,
        })
    };
    let spot = |target_point: DVec3, target_direction: DVec3| {
        let (position, direction) = (target_point.to_array(), target_direction.to_array());
        light(LightKind::Spot {
            position,
            direction,
            inner_angle: 39.0,
            outer_angle: 40.0,
            falloff: Falloff::InverseSquare,
            range: None,
        })
    };
    // Probability of the first light at the origin, which receives light from all directions.
    let share = |delta: Vec<DeltaLight<f64>>| {
        let scene = Aabb {
            min: DVec3::splat(-9.0),
            max: DVec3::splat(9.0),
        };
        let mut lights = Lights::<f64>::new(
            delta,
            Emitters::new(EmitterList::default()),
            SkyRadiance {
                kind: SkyKind::Black,
            },
            &scene,
        );
        lights.build_light_sampler();
        let first = (0..1000).filter(|i| {
            let drawn = lights.light_sampler().sample::<f64>(
                DVec3::ZERO,
                DVec3::ZERO,
                [*i as f32 / 1000.0, 0.0],
            );
            drawn.is_some_and(|(light, _)| light == LightId::Delta(0))
        });
        first.count() as f64 / 1000.0
    };
    let is = |found: f64, expected: f64| {
        assert!((found - expected).abs() <= 2e-3, "{found}, not {expected}")
    };
    is(share(vec![point(DVec3::Y), point(DVec3::NEG_Y)]), 0.5);
    is(share(vec![point(DVec3::Y), point(DVec3::X)]), 0.5);
    is(share(vec![point(DVec3::Y), point(DVec3::NEG_Y * 2.0)]), 0.8);
    let (sin, cos) = libm::sincos(f64::to_radians(38.0));
    let aside = spot(DVec3::Z, DVec3::new(sin, 0.0, -cos));
    is(share(vec![aside, spot(DVec3::NEG_Z, DVec3::Z)]), 0.5);
    is(
        share(vec![spot(DVec3::Z, DVec3::Z), spot(DVec3::NEG_Z, DVec3::Z)]),
        0.0,
    );
    is(share(vec![aside, spot(DVec3::NEG_Z, DVec3::NEG_Z)]), 1.0);
    is(
        share(vec![spot(DVec3::Z, DVec3::NEG_Z), point(DVec3::X)]),
        0.5,
    );
}
