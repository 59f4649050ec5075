//! Prepared emitters: their areas, their positions, and the look-up from a hit.

use super::super::geometry::tests::glowing;
use super::*;
use crate::affine::affine_from_steps;
use crate::effects::EffectSet;
use crate::generate::expand_generators;
use crate::hash::splitmix64;
use crate::light::{Emitters, LightDensity, ShadowRayTarget};
use crate::prepare::{PreparedScene, build_geometry};
use crate::scene::{Generator, GeneratorKind, Integrator, Object, TransformStep};
use crate::settings::Settings;
use raywright_bvh::{AcceleratorKind, Interval, Ray};
use serde_json::json;

fn found(scene: &Scene) -> Emitters<f32> {
    let (texture_tables, expected) = (
        InputTables::default(),
        EmitterFilter {
            uniform: true,
            varying: false,
            evaluated_at_hits: false,
        },
    );
    Emitters::new(
        list_emitters::<f32>(
            (scene, DVec3::ZERO),
            &SceneLookup::new(scene),
            (&[], &texture_tables),
            expected,
            &(),
        )
        .expect("nobody stops it"),
    )
}

/// Protects: a translated emitter is stored as an untransformed shape, so that tens of thousands of
/// emitters stay cheap, with the area and position of a transformed one.
#[test]
fn moved_emitters_need_no_map() {
    let (material, object) = glowing(
        Shape::Sphere {
            centre: [1.0, 0.0, 0.0],
            radius: 0.5,
        },
        Vec::new(),
    );
    let kind = GeneratorKind::Scatter {
        count: 20_000,
        min: [-5.0; 3],
        max: [5.0; 3],
        seed: 3,
    };
    let turned = TransformStep::Rotate {
        axis: [0.0, 1.0, 0.0],
        degrees: 90.0,
    };
    let scene = Scene {
        materials: vec![material],
        objects: vec![Object {
            transform: vec![turned, TransformStep::Scale([2.0; 3])],
            ..object.clone()
        }],
        generators: vec![Generator { kind, object }],
        ..Scene::default()
    };
    let emitters = found(&scene);
    assert_eq!((emitters.len(), emitters.transformed_count()), (20_001, 1));
    // A sphere of radius 1/2 emits π times its radiance, 3.5 in all, from an area of π.
    let power = 3.5 * core::f64::consts::PI * core::f64::consts::PI;
    assert!(
        (emitters.power(0) / (4.0 * power) - 1.0).abs() < 1e-6,
        "{}",
        emitters.power(0)
    );
    for (i, object) in expand_generators(&scene).iter().enumerate().skip(1) {
        let position = affine_from_steps(&object.transform).translation + DVec3::X;
        let index = emitters
            .emitter_index_of(i as u32, 0)
            .expect("each object has an emitter");
        let bounds = emitters.bounds(index).expect("a ball has an end");
        assert!(
            (bounds.bounding_box.centre() - position).length() < 1e-5
                && (emitters.power(index) / power - 1.0).abs() < 1e-6
        );
    }
}

/// Protects: the previous object's area is reused only for an equal shape and map.
#[test]
fn areas_are_each_emitters_own() {
    let ball = |radius| Shape::Sphere {
        centre: [0.0; 3],
        radius,
    };
    let (material, object) = glowing(ball(1.0), Vec::new());
    let scaled = |shape: Shape, factor: f64| {
        let transform = vec![
            TransformStep::Scale([factor; 3]),
            TransformStep::Translate([factor, 0.0, 0.0]),
        ];
        Object {
            shape,
            transform,
            ..object.clone()
        }
    };
    let objects = vec![
        object.clone(),
        scaled(ball(1.0), 1.0),
        scaled(ball(1.0), 2.0),
        scaled(ball(2.0), 2.0),
        object.clone(),
    ];
    let scene = Scene {
        materials: vec![material],
        objects,
        ..Scene::default()
    };
    let emitters = found(&scene);
    let powers: Vec<f64> = (0..5)
        .map(|i| emitters.power(i) / emitters.power(0))
        .collect();
    let expected = [1.0, 1.0, 4.0, 16.0, 1.0];
    assert!(
        powers
            .iter()
            .zip(expected)
            .all(|(a, b)| (a / b - 1.0).abs() < 1e-9),
        "{powers:?}"
    );
}

/// Protects: a hit finds its emitter, in meshes used once and twice, after non-emissive objects and
/// after triangles without area; a non-emissive object has none.
#[test]
fn a_hit_finds_its_emitter() {
    let strip = json!({ "name": "strip", "source": { "inline": {
        "positions": [[0, 0, 0], [0.5, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1]], "indices": [[0, 1, 2], [0, 2, 3], [0, 3, 4]] } } });
    let glow = json!({ "name": "glow", "model": { "classic": { "local": 0, "emission": 1 } } });
    let dull = json!({ "name": "dull", "model": { "classic": {} } });
    let mesh = |x: f64, material: &str| json!({ "shape": { "mesh": "strip" }, "material": material, "transform": [{ "translate": [x, 0, 0] }] });
    let ball = |x: f64, material: &str| json!({ "shape": { "sphere": { "centre": [x, 0, 0.5], "radius": 0.5 } }, "material": material });
    let once = json!({ "shape": { "mesh": "single" }, "material": "glow", "transform": [{ "translate": [10, 0, 0] }] });
    let mut single = strip.clone();
    single["name"] = json!("single");
    let objects = [
        ball(0.5, "dull"),
        mesh(2.0, "glow"),
        ball(4.5, "glow"),
        mesh(6.0, "glow"),
        mesh(8.0, "dull"),
        once,
    ];
    let scene: Scene = serde_json::from_value(
        json!({ "format": 1, "materials": [glow, dull], "meshes": [strip, single],
        "objects": objects }),
    )
    .expect("a scene");
    let (lookup, emitters) = (SceneLookup::new(&scene), found(&scene));
    assert_eq!((emitters.len(), emitters.powered_count()), (10, 7));
    let built = build_geometry::<f32>(&scene, &lookup, AcceleratorKind::Linear, &())
        .expect("it can be built");
    let emitter_at = |x: f32, z: f32| {
        let ray = Ray::new(glam::Vec3::new(x, 3.0, z), glam::Vec3::NEG_Y);
        let hit = built
            .geometry
            .closest(&ray, Interval::positive(), &mut ())
            .expect("something lies below");
        (
            emitters.emitter_index_of(hit.outermost_id(), hit.primitive),
            built.geometry.surface(&ray, &hit).point,
        )
    };
    let mut seen = Vec::new();
    for (x, z) in [
        (2.8, 0.3),
        (2.2, 0.7),
        (4.5, 0.5),
        (6.8, 0.3),
        (6.2, 0.7),
        (10.8, 0.3),
        (10.2, 0.7),
    ] {
        let (index, point) = emitter_at(x, z);
        let index = index.expect("it shines");
        let space = emitters.bounds(index).expect("it has an end").bounding_box;
        let (low, high) = (point.as_dvec3() + 1e-5, point.as_dvec3() - 1e-5);
        assert!(
            space.min.cmple(low).all() && space.max.cmpge(high).all(),
            "({x}, {z}): {space:?}"
        );
        assert!(emitters.probability(index) > 0.0);
        seen.push(index);
    }
    // Both triangles of a quad have the light index of the first triangle.
    assert_eq!(seen, [1, 1, 3, 5, 5, 8, 8]);
    assert_eq!(
        (
            emitter_at(0.5, 0.5).0,
            emitter_at(8.5, 0.3).0,
            emitters.emitter_index_of(99, 0),
            emitters.emitter_index_of(2, 1)
        ),
        (None, None, None, None)
    );
}

/// A mesh of two emissive triangles, scaled along z.
fn pair(positions: [[f32; 3]; 4], indices: [[u32; 3]; 2], sign: f64) -> Emitters<f32> {
    let mesh = json!({ "name": "pair", "source": { "inline": { "positions": positions, "indices": indices } } });
    let glow = json!({ "name": "glow", "model": { "classic": { "local": 0, "emission": 1 } } });
    let object = json!({ "shape": { "mesh": "pair" }, "material": "glow", "transform": [{ "scale": [1, 1, sign] }] });
    let scene = json!({ "format": 1, "materials": [glow], "meshes": [mesh], "objects": [object] });
    found(&serde_json::from_value(scene).expect("a scene"))
}

/// Protects: the two halves of a parallelogram are one light, with the numbers of the quad of these
/// corners, in any order of corners; hits on both halves find it. Others stay two lights: a
/// trapezoid, a bent pair, one triangle twice, and halves that face opposite sides.
#[test]
fn halves_of_a_quad_are_one_light() {
    let slanted = [
        [0.125, 2.0, -0.5],
        [1.125, 2.5, -0.5],
        [1.375, 2.5, 1.5],
        [0.375, 2.0, 1.5],
    ];
    let glow = json!({ "name": "glow", "model": { "classic": { "local": 0, "emission": 1 } } });
    let quad = json!({ "shape": { "quad": { "corner": slanted[0], "edge_u": [1.0, 0.5, 0.0], "edge_v": [0.25, 0.0, 2.0] } },
        "material": "glow" });
    let whole = found(
        &serde_json::from_value(json!({ "format": 1, "materials": [glow], "objects": [quad] }))
            .expect("a scene"),
    );
    let from = glam::Vec3::new(0.4, 0.0, 0.3);
    let sample = |emitters: &Emitters<f32>, u: [f32; 2]| {
        let sample = emitters
            .sample(0, from, u, 0.5)
            .map(|sample| (sample.direction, sample.arriving, sample.density));
        sample.expect("it is seen")
    };
    for (i, j) in (0..9).map(|k| (k / 3, k % 3)) {
        let mut indices = [[0, 1, 2], [0, 2, 3]];
        indices[0].rotate_left(i);
        indices[1].rotate_left(j);
        let halves = pair(slanted, indices, 1.0);
        assert_eq!(
            (
                halves.len(),
                halves.powered_count(),
                halves.emitter_index_of(0, 0),
                halves.emitter_index_of(0, 1),
                halves.emitter_index_of(0, 2)
            ),
            (2, 2, Some(0), Some(0), None)
        );
        assert!((halves.power(0) / whole.power(0) - 1.0).abs() < 1e-6 && halves.power(1) == 0.0);
        assert_eq!((halves.probability(0), halves.probability(1)), (1.0, 0.0));
        for u in [[0.1, 0.2], [0.9, 0.3], [0.5, 0.999]] {
            let ((direction, arriving, density), (there, expected, all)) =
                (sample(&halves, u), sample(&whole, u));
            assert!(
                (direction - there).length() < 1e-6
                    && (arriving - expected).length() < 1e-5 * expected.length(),
                "{i} {j}"
            );
            let (LightDensity::SolidAngle(density), LightDensity::SolidAngle(all)) = (density, all)
            else {
                panic!("lamps have a size")
            };
            assert!(
                (density / all - 1.0).abs() < 1e-5,
                "{i} {j}: {density} and {all}"
            );
        }
        let mirrored = pair(slanted, indices, -1.0);
        assert_eq!(
            (mirrored.emitter_index_of(0, 1), mirrored.power(1)),
            (Some(0), 0.0)
        );
        assert!((mirrored.power(0) / whole.power(0) - 1.0).abs() < 1e-6);
    }
    let (mut trapezoid, mut perturbed) = (slanted, slanted);
    trapezoid[3][2] = 1.25;
    perturbed[3][1] = 2.25;
    let two = [
        (trapezoid, [[0, 1, 2], [0, 2, 3]]),
        (perturbed, [[0, 1, 2], [0, 2, 3]]),
        (slanted, [[0, 1, 2], [0, 1, 2]]),
        (slanted, [[0, 1, 2], [0, 3, 2]]),
    ];
    for (positions, indices) in two {
        let emitters = pair(positions, indices, 1.0);
        assert_eq!(
            (
                emitters.emitter_index_of(0, 0),
                emitters.emitter_index_of(0, 1)
            ),
            (Some(0), Some(1)),
            "{positions:?} {indices:?}"
        );
        assert!(emitters.power(0) > 0.0 && emitters.power(1) > 0.0);
    }
}

/// A square of two triangles in the plane z = 0 with texture coordinates x and y, emissive in its
/// upper right corner: a sixteenth of it. Mirrored for a negative `sign`.
fn screen(sign: f64) -> PreparedScene<f64> {
    let square = json!({ "name": "square", "source": { "inline": {
        "positions": [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], "uvs": [[[0, 0], [1, 0], [1, 1], [0, 1]]],
        "indices": [[0, 1, 2], [0, 2, 3]] } } });
    let glow = json!({ "name": "glow", "model": { "classic": { "local": 0, "emission": "max(0, min(1, 1e6 * (min(u, v) - 0.75)))" } } });
    let object = json!({ "shape": { "mesh": "square" }, "material": "glow", "transform": [{ "scale": [1, 1, sign] }] });
    let scene =
        json!({ "format": 1, "meshes": [square], "materials": [glow], "objects": [object] });
    let scene: Scene = serde_json::from_value(scene).expect("a scene");
    let settings = Settings {
        integrator: Integrator::Path,
        ..Settings::from_scene(&scene)
    };
    PreparedScene::new(&scene, &settings, EffectSet::ALL, &()).expect("it can be prepared")
}

/// Protects: points of a partly emissive mesh are sampled where it emits, mirrored or not: nine
/// tenths within a sixteenth of a square, where uniform sampling has a sixteenth. Its power is that
/// of the emissive part.
#[test]
fn points_are_drawn_where_a_mesh_glows() {
    for sign in [1.0, -1.0] {
        let prepared = screen(sign);
        let emitters = &prepared.lights.emitters;
        let (from, mut lit) = (DVec3::new(0.5, 0.5, 2.0), 0);
        let number = |i: u64| (splitmix64(i) >> 41) as f32 / (1 << 23) as f32;
        for i in 0..2_000 {
            let (emitter, probability) = emitters
                .sample_emitter([number(4 * i), number(4 * i + 1)])
                .expect("it glows");
            let sample = emitters
                .sample(
                    emitter,
                    from,
                    [number(4 * i + 2), number(4 * i + 3)],
                    probability,
                )
                .expect("it is seen");
            let ShadowRayTarget::Surface(surface) = sample.target else {
                panic!("{:?}", sample.target)
            };
            // Cells are a thirtieth wide, and their neighbours are sampled half as often.
            lit += usize::from(surface.point.x.min(surface.point.y) > 0.75 - 0.08);
        }
        assert!(lit > 1_700, "{lit} of 2000, {sign}");
        let power: f64 = (0..2).map(|i| emitters.power(i)).sum();
        // Three channels and two sides; a sixteenth of an area of 1 m² emits.
        let by_hand = core::f64::consts::PI * 3.0 * 2.0 / 16.0;
        assert!(
            (power / by_hand - 1.0).abs() < 0.05,
            "{power} and by hand {by_hand}"
        );
    }
}

/// Protects: triangles of varying emission count once for each object of their mesh; triangles of
/// uniform emission count only if they are partly cut away and a path tracer evaluates them.
#[test]
fn triangles_that_vary_are_counted() {
    let mesh = json!({ "name": "square", "source": { "inline": { "positions": [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]],
        "indices": [[0, 1, 2], [0, 2, 3]] } } });
    let physical = |name: &str, terms: serde_json::Value| json!({ "name": name, "model": { "physical": terms } });
    let object = |material: &str| json!({ "shape": { "mesh": "square" }, "material": material });
    let several = json!({ "kind": { "grid": { "counts": [3, 1, 2], "origin": [0, 0, 0], "step": [2, 0, 2] } }, "object": object("varied") });
    let scene = json!({ "format": 1, "meshes": [mesh], "generators": [several], "objects": [object("varied"), object("even"), object("cut"), object("dark")],
        "materials": [physical("varied", json!({ "emission": "vec3(u, 1, 1)" })), physical("even", json!({ "emission": 1 })),
            physical("cut", json!({ "emission": 1, "alpha": { "mask": { "cutoff": 0.5 } }, "opacity": "u" })), physical("dark", json!({}))] });
    let scene: Scene = serde_json::from_value(scene).expect("a scene");
    let count = |even, varied, read| {
        count_varying_triangles(
            &scene,
            &SceneLookup::new(&scene),
            EmitterFilter {
                uniform: even,
                varying: varied,
                evaluated_at_hits: read,
            },
            &(),
        )
        .expect("nobody ends it")
    };
    assert_eq!(count(true, true, true), 2 * (6 + 1 + 1));
    assert_eq!(
        (
            count(true, true, false),
            count(false, true, true),
            count(true, false, false)
        ),
        (2 * 7, 2 * 7, 0)
    );
}

/// Protects: the number of points along each side by hand: 2²⁰ in all, at least 2 and at most 32
/// along a side.
#[test]
fn points_are_shared_among_triangles() {
    let across = [0, 1, 1024, 1025, 15_158, 1 << 18, u64::MAX].map(emission_grid_size);
    assert_eq!(across, [32, 32, 32, 31, 8, 2, 2]);
}
