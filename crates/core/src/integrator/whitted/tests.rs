//! Whitted paths traced together.

use glam::{DAffine3, DVec3, Vec3};
use raywright_bvh::shapes::{AnyShape, Quad, Sphere};
use raywright_bvh::{AcceleratorKind, Geometry, Hit, Occlusion, PrimitiveSet, Visibility};
use serde_json::json;

use super::*;
use crate::effects::EffectSet;
use crate::prepare::PreparedScene;
use crate::scene::Scene;
use crate::settings::Settings;

/// Glass with two rays from every hit, a half-transparent sheet, a mask, mirrors, and a sampled
/// lamp.
fn everything() -> Scene {
    let ball = |x: f64, z: f64, material: &str| json!({ "shape": { "sphere": { "centre": [x, 0, z], "radius": 0.9 } }, "material": material });
    let quad = |z: f64, material: &str| {
        let shape =
            json!({ "quad": { "corner": [-3, -2, z], "edge_u": [6, 0, 0], "edge_v": [0, 4, 0] } });
        json!({ "shape": shape, "material": material })
    };
    let physical = |name: &str, terms: serde_json::Value| json!({ "name": name, "model": { "physical": terms } });
    let classic = |name: &str, terms: serde_json::Value| json!({ "name": name, "model": { "classic": terms } });
    serde_json::from_value(json!({
        "format": 1,
        "cameras": [{ "pose": { "look_at": { "eye": [0, 0.4, 6], "target": [0, 0, 0] } },
            "projection": { "pinhole": { "vertical_fov": 50 } } }],
        "sky": { "constant": [0.2, 0.3, 0.5] },
        "materials": [
            physical("glass", json!({ "transmission": 1, "roughness": 0, "ior": 1.5 })),
            physical("sheet", json!({ "alpha": "blend", "opacity": 0.4, "roughness": 0, "metallic": 0.5 })),
            physical("mask", json!({ "alpha": { "mask": { "cutoff": 0.5 } }, "opacity": "p.x > 0 ? 1 : 0" })),
            classic("mirror", json!({ "reflection": { "weight": 0.6 } })),
            classic("lamp", json!({ "local": 0, "emission": 4 })),
        ],
        "objects": [ball(-1.0, 0.0, "glass"), ball(1.0, 0.0, "mirror"), quad(1.5, "sheet"), quad(2.5, "mask"), quad(-3.0, "mirror"),
            { "shape": { "sphere": { "centre": [0, 3, 3], "radius": 0.5 } }, "material": "lamp" }],
    }))
    .expect("a scene")
}

/// A path with the paths that wait for it.
struct PixelState {
    path: WhittedState<f32>,
    waiting: Vec<WhittedState<f32>>,
    ended: bool,
}

/// Protects: paths advanced together, one segment each, in another order at every step and with
/// their rays intersected as one slice, give the bits and trace the rays of paths traced one by
/// one.
#[test]
fn together_or_one_by_one() {
    let scene = everything();
    let settings = Settings {
        max_depth: 7,
        size: [24, 16],
        ..Settings::from_scene(&scene)
    };
    let prepared = PreparedScene::<f32>::new(&scene, &settings, EffectSet::ALL, &())
        .expect("it can be prepared");
    let mut tracer = WhittedTracer::<f32>::new(&prepared, settings.max_depth, false, &());
    let pixels = || (0..24 * 16).map(|i| [i % 24, i / 24]);
    let begin = |tracer: &mut WhittedTracer<'_, f32>, pixel: [u32; 2]| {
        let ray =
            prepared
                .camera
                .generate_ray(pixel[0] as f32 + 0.5, pixel[1] as f32 + 0.5, [0.5; 2]);
        tracer.start_path(
            &ray,
            &SampleAddress {
                pixel,
                ..SampleAddress::default()
            },
        )
    };
    let single: Vec<_> = pixels()
        .map(|pixel| {
            let mut path = begin(&mut tracer, pixel);
            tracer.trace_path(&mut path, None);
            (path.radiance, path.coverage)
        })
        .collect();
    let alone = core::mem::take(&mut tracer.counters);
    let start = |pixel| PixelState {
        path: begin(&mut tracer, pixel),
        waiting: Vec::new(),
        ended: false,
    };
    let mut ways: Vec<PixelState> = pixels().map(start).collect();
    let (mut turns, mut hits): (usize, Vec<Option<Hit<f32>>>) = (0, Vec::new());
    loop {
        let mut active: Vec<usize> = (0..ways.len()).filter(|&i| !ways[i].ended).collect();
        if active.is_empty() {
            break;
        }
        let turn = turns % active.len();
        active.rotate_left(turn);
        active.reverse();
        hits.clear();
        hits.extend(
            active
                .iter()
                .map(|&i| tracer.intersect_path_ray(&ways[i].path)),
        );
        for (&i, hit) in active.iter().zip(&hits) {
            let pixel_state = &mut ways[i];
            let closest_hit = pixel_state.path.known_hit.or(*hit);
            if let Some(aside) = tracer.advance_path(&mut pixel_state.path, closest_hit.as_ref()) {
                pixel_state
                    .waiting
                    .push(core::mem::replace(&mut pixel_state.path, aside));
                continue;
            }
            while pixel_state.path.remaining_segments == 0 {
                let Some(before) = pixel_state.waiting.pop() else {
                    pixel_state.ended = true;
                    break;
                };
                let state = core::mem::replace(&mut pixel_state.path, before);
                pixel_state.path.radiance += state.radiance;
                pixel_state.path.coverage += state.coverage;
                pixel_state.path.passages = state.passages;
            }
        }
        turns += 1;
    }
    let together: Vec<_> = ways
        .iter()
        .map(|pixel_state| (pixel_state.path.radiance, pixel_state.path.coverage))
        .collect();
    assert_eq!(together, single);
    assert_eq!(tracer.counters, alone);
    assert!(
        alone.refraction > 100 && alone.reflection > 300 && alone.shadow > 300 && turns > 10,
        "{alone:?} {turns}"
    );
}

/// The objects of [`everything`] as instances, each with its own motion, or static at a given time.
fn on_the_way(standing: Option<f64>) -> Geometry<f32> {
    let ball = |x: f32, y: f32, z: f32, radius: f32| {
        AnyShape::from(Sphere {
            centre: Vec3::new(x, y, z),
            radius,
        })
    };
    let quad = |z: f64| {
        AnyShape::from(Quad::new(
            DVec3::new(-3.0, -2.0, z),
            DVec3::X * 6.0,
            DVec3::Y * 4.0,
        ))
    };
    let shapes = [
        ball(-1.0, 0.0, 0.0, 0.9),
        ball(1.0, 0.0, 0.0, 0.9),
        quad(1.5),
        quad(2.5),
        quad(-3.0),
        ball(0.0, 3.0, 3.0, 0.5),
    ];
    let requested = Visibility {
        occlusion: Occlusion::Filtered,
        ..Visibility::default()
    };
    let mut group = PrimitiveSet::default();
    for (order, shape) in (0_i32..).zip(shapes) {
        let mut own = PrimitiveSet::default();
        own.add_shape(shape, requested).expect("a shape");
        let part = group
            .add_part(Geometry::new(own, AcceleratorKind::default()))
            .expect("no instances");
        let to = |time: f64| {
            DAffine3::from_translation(
                DVec3::new(f64::from(order % 3 - 1), 0.25, -0.25 * f64::from(order)) * time,
            )
        };
        let added = match standing {
            None => group.add_moving_instance(part, [to(0.0), to(1.0)], requested),
            Some(time) => group.add_instance(part, to(time), requested),
        };
        added.expect("an invertible map");
    }
    Geometry::new(group, AcceleratorKind::default())
}

/// Protects: every ray of a camera ray's path has its time: mirrored, refracted, passing through
/// transparent surfaces, and shadow rays. So moving objects give the picture of static ones at that
/// time, bit for bit.
#[test]
fn rays_keep_their_time() {
    let scene = everything();
    let settings = Settings {
        max_depth: 7,
        size: [24, 16],
        ..Settings::from_scene(&scene)
    };
    let picture = |geometry: Geometry<f32>, time: f32| {
        let mut prepared = PreparedScene::<f32>::new(&scene, &settings, EffectSet::ALL, &())
            .expect("it can be prepared");
        prepared.geometry = geometry;
        let mut tracer = WhittedTracer::<f32>::new(&prepared, settings.max_depth, false, &());
        let mut results = PathResults::default();
        let mut pixel = |i: u32| {
            let ray = prepared
                .camera
                .generate_ray((i % 24) as f32 + 0.5, (i / 24) as f32 + 0.5, [0.5; 2])
                .with_time(time);
            let address = SampleAddress {
                pixel: [i % 24, i / 24],
                ..SampleAddress::default()
            };
            tracer.trace(
                CameraRays {
                    rays: &[ray],
                    addresses: &[address],
                },
                &mut results,
            );
            results.paths[0].radiance
        };
        (
            (0..24 * 16).map(&mut pixel).collect::<Vec<_>>(),
            tracer.counters,
        )
    };
    let (there, counters) = picture(on_the_way(Some(0.5)), 0.0);
    assert!(
        counters.refraction > 100 && counters.reflection > 300 && counters.shadow > 300,
        "{counters:?}"
    );
    assert_eq!(picture(on_the_way(None), 0.5), (there.clone(), counters));
    assert_ne!(picture(on_the_way(None), 0.0).0, there);
}
