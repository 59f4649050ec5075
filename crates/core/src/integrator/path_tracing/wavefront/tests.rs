//! Paths side by side against single paths.

use raywright_bvh::{Ray, Real, Vector};
use serde_json::json;

use super::super::super::LightTransport;
use super::*;
use crate::counters::Counters;
use crate::effects::{Effect, EffectSet};
use crate::integrator::PathResult;
use crate::prepare::{PreparedMaterial, PreparedScene};
use crate::sampler::SampleAddress;
use crate::scene::Scene;
use crate::settings::Settings;

const SIZE: [u32; 2] = [24, 16];

/// A scene of everything that paths hit, and lights of each kind: rough surfaces, plain and
/// checkered, a mesh with images, mirrors, glass, layers, partly transparent surfaces, lamps and a
/// sky.
fn everything() -> Scene {
    let ball = |x: f64, y: f64, material: &str| json!({ "shape": { "sphere": { "centre": [x, y, 0], "radius": 0.6 } }, "material": material });
    let physical = |name: &str, terms: serde_json::Value| json!({ "name": name, "model": { "physical": terms } });
    let classic = |name: &str, terms: serde_json::Value| json!({ "name": name, "model": { "classic": terms } });
    let cells =
        json!({ "checker": { "even": [0.9, 0.4, 0.1], "odd": [0.1, 0.2, 0.8], "size": 0.3 } });
    let codes: Vec<[f64; 4]> = (0..64)
        .map(|i| {
            [
                0.4 + 0.003 * f64::from(i),
                0.6 - 0.002 * f64::from(i),
                0.9,
                1.0,
            ]
        })
        .collect();
    let mut scene: Scene = serde_json::from_value(json!({
        "format": 1,
        "cameras": [{ "pose": { "look_at": { "eye": [0, 1.0, 7], "target": [0, 0.4, 0] } },
            "projection": { "pinhole": { "vertical_fov": 40 } } }],
        "sky": { "gradient": { "bottom": [0.2, 0.3, 0.5], "top": [0.6, 0.7, 0.9],
            "suns": [{ "direction": [1, 2, 1], "exponent": 200, "colour": [9, 8, 7], "weight": 1 }] } },
        "lights": [{ "kind": { "point": { "position": [2, 3, 2] } }, "colour": [6, 6, 6] },
            { "kind": { "point": { "position": [-2, 3, 2] } }, "colour": [6, 5, 4], "specular": false }],
        "materials": [
            physical("floor", json!({ "base_colour": cells, "roughness": 0.7, "specular": 0.3 })),
            physical("metal", json!({ "base_colour": [0.9, 0.7, 0.4], "metallic": 1, "roughness": 0.25 })),
            physical("smooth", json!({ "metallic": 1, "roughness": 0 })),
            physical("glass", json!({ "transmission": 1, "roughness": 0, "ior": 1.5 })),
            physical("frosted", json!({ "transmission": 1, "roughness": 0.3 })),
            physical("coated", json!({ "clearcoat": { "factor": 1 }, "roughness": 0.5 })),
            physical("sheet", json!({ "alpha": "blend", "opacity": 0.5 })),
            physical("expressed", json!({ "base_colour": "vec3(abs(n.x), abs(n.y), abs(n.z))", "roughness": 0.6 })),
            physical("lamp", json!({ "emission": [5, 4, 3] })),
            physical("leaf", json!({ "roughness": 0.4,
                "base_colour_texture": { "name": "grain" }, "normal_texture": { "name": "grain" } })),
            classic("matte", json!({ "colour": "vec3(0.2, abs(n.x), 0.9)", "diffuse": 0.8 })),
            classic("tile", json!({ "colour": cells, "emission": [0.1, 0.2, 0.3] })),
            classic("mixed", json!({ "colour": 0.7, "mixture": { "specular_chance": 0.4, "specular_colour": 0.9 } })),
            classic("shiny", json!({ "colour": 0.5, "specular": { "model": "phong", "exponent": 30, "strength": 0.5 } })),
        ],
        "images": [{ "name": "grain", "path": "" }],
        "textures": [{ "name": "grain", "image": "grain", "colour_space": "linear" }],
        "meshes": [{ "name": "leaf", "source": { "inline": {
            "positions": [[-3, 0, -1.5], [3, 0, -1.5], [3, 3, -2], [-3, 3, -2]], "indices": [[0, 1, 2], [0, 2, 3]],
            "normals": [[-0.3, 0, 1], [0.3, 0, 1], [0.3, 0.3, 1], [-0.3, 0.3, 1]],
            "uvs": [[[0, 0], [3, 0], [3, 3], [0, 3]]] } } }],
        "objects": [
            { "shape": { "plane": { "point": [0, -0.6, 0], "normal": [0, 1, 0] } }, "material": "floor" },
            { "shape": { "mesh": "leaf" }, "material": "leaf" },
            ball(-2.1, 0.0, "metal"), ball(-0.7, 0.0, "smooth"), ball(0.7, 0.0, "glass"), ball(2.1, 0.0, "frosted"),
            ball(-2.1, 1.3, "coated"), ball(-0.7, 1.3, "sheet"), ball(0.7, 1.3, "expressed"), ball(2.1, 1.3, "lamp"),
            ball(-1.4, 2.3, "matte"), ball(0.0, 2.3, "tile"), ball(1.4, 2.3, "shiny"), ball(2.8, 2.3, "mixed"),
        ],
    }))
    .expect("a scene");
    let pixels =
        crate::scene::PixelData::Linear(codes.iter().map(|code| code.map(|c| c as f32)).collect());
    scene.images[0].data = Some(std::sync::Arc::new(crate::scene::ImageData {
        width: 8,
        height: 8,
        pixels,
    }));
    scene
}

/// Results of the paths of all pixels, traced `together` side by side, with first hits and
/// counters.
fn followed<R: Real>(
    prepared: &PreparedScene<R>,
    depth: u32,
    together: usize,
) -> (Vec<[u64; 5]>, Counters) {
    followed_by(
        prepared,
        PathTracer::<R>::new(prepared, depth, true, &()),
        together,
    )
}

fn followed_by<R: Real>(
    prepared: &PreparedScene<R>,
    mut tracer: PathTracer<'_, R>,
    together: usize,
) -> (Vec<[u64; 5]>, Counters) {
    let pixels = (0..SIZE[0] * SIZE[1]).map(|i| [i % SIZE[0], i / SIZE[0]]);
    let addresses: Vec<_> = pixels
        .flat_map(|pixel| {
            (0..4).map(move |index| SampleAddress {
                pixel,
                index,
                ..SampleAddress::default()
            })
        })
        .collect();
    let at = |x: u32| R::from_f64(f64::from(x) + 0.5);
    let rays: Vec<_> = addresses
        .iter()
        .map(|a| {
            prepared
                .camera
                .generate_ray(at(a.pixel[0]), at(a.pixel[1]), [0.5; 2])
        })
        .collect();
    let (mut results, mut out) = (PathResults::default(), Vec::new());
    for (rays, addresses) in rays.chunks(together).zip(addresses.chunks(together)) {
        tracer.trace(CameraRays { rays, addresses }, &mut results);
        out.extend((0..rays.len()).map(|position| {
            let PathResult {
                radiance, coverage, ..
            } = results.paths[position];
            let [r, g, b] = radiance.to_f64().to_array().map(f64::to_bits);
            let first = results
                .first_hit_and_emission(position)
                .0
                .map_or(0, |first| {
                    first.distance.to_bits() ^ u64::from(first.object)
                });
            [r, g, b, coverage.to_f64().to_bits(), first]
        }));
    }
    (out, tracer.counters)
}

/// [`everything`] with nested media, one of which absorbs, and a metal ball and a matte one in
/// them.
fn in_bodies() -> Scene {
    let mut scene = everything();
    let ball = |x: f64, radius: f64, material: &str| json!({ "shape": { "sphere": { "centre": [x, 0, 0], "radius": radius } }, "material": material });
    for terms in [
        ball(0.8, 0.3, "metal"),
        ball(0.5, 0.3, "floor"),
        ball(1.2, 0.4, "syrup"),
    ] {
        scene
            .objects
            .push(serde_json::from_value(terms).expect("an object"));
    }
    let syrup = json!({ "name": "syrup", "model": { "physical": { "transmission": 1, "roughness": 0, "ior": 1.33,
        "attenuation_colour": [0.9, 0.4, 0.1], "attenuation_distance": 0.5 } } });
    scene
        .materials
        .push(serde_json::from_value(syrup).expect("a material"));
    scene
}

fn many_or_few<R: Real>(scene: &Scene, effects: EffectSet) {
    let settings = Settings {
        size: SIZE,
        integrator: crate::scene::Integrator::Path,
        ..Settings::from_scene(scene)
    };
    let mut prepared =
        PreparedScene::<R>::new(scene, &settings, effects, &()).expect("it can be prepared");
    let plain = |m: &&PreparedMaterial<R>| {
        matches!(m, PreparedMaterial::Physical(m) if m.is_common)
            || matches!(m, PreparedMaterial::Classic(m) if m.matte)
    };
    assert_eq!(
        prepared.materials.iter().filter(plain).count(),
        7,
        "floor, metal, smooth, lamp, leaf, matte and tile"
    );
    let (alone, counters) = followed(&prepared, 7, 1);
    assert!(
        counters.scatter > 1000 && counters.reflection > 100 && counters.refraction > 100,
        "{counters:?}"
    );
    for together in [2, 7, 8, 9, 100, usize::MAX] {
        assert_eq!(
            followed(&prepared, 7, together),
            (alone.clone(), counters),
            "{together}"
        );
    }
    let short = followed(&prepared, 2, 100);
    prepared
        .objects
        .iter_mut()
        .for_each(|object| object.uniform = None);
    for material in &mut prepared.materials {
        match material {
            PreparedMaterial::Physical(m) => m.is_common = false,
            PreparedMaterial::Classic(m) => m.matte = false,
            PreparedMaterial::Unused => {}
        }
    }
    assert_eq!(
        followed(&prepared, 7, 100),
        (alone, counters),
        "one vertex after the other"
    );
    assert_eq!(followed(&prepared, 2, 100), short, "and of short paths");
}

/// Protects: the number of paths side by side, and shading vertices together, change no bit of any
/// result, no first hit and no counter.
#[test]
fn paths_bring_what_they_bring_alone() {
    let scene = everything();
    many_or_few::<f32>(&scene, EffectSet::ALL);
    many_or_few::<f64>(&scene, EffectSet::ALL);
}

/// Meshes of materials that are the same everywhere, matte and glossy, `scale` times as large: smooth
/// and flat, mirrored, with normals that point outwards on both sides, shown twice, and beside a
/// checkered mesh and a ball; under lamps of each kind and a sky.
fn uniform_meshes(scale: f64) -> Scene {
    let place = |x: f64, y: f64, z: f64| json!([x * scale, y * scale, z * scale]);
    let mesh = |name: &str, normals: serde_json::Value| {
        let mut data = json!({ "positions": [place(-1.0, -1.0, 0.0), place(1.0, -1.0, 0.0), place(1.0, 1.0, 0.2),
            place(-1.0, 1.0, 0.0)], "indices": [[0, 1, 2], [0, 2, 3]] });
        if !normals.is_null() {
            data["normals"] = normals;
        }
        json!({ "name": name, "source": { "inline": data } })
    };
    let object = |mesh: &str, material: &str, x: f64, y: f64, more: serde_json::Value| {
        let mut object = json!({ "shape": { "mesh": mesh }, "material": material,
            "transform": [{ "translate": place(x, y, 0.0) }] });
        for (key, value) in more.as_object().expect("keys") {
            object[key] = value.clone();
        }
        object
    };
    let material = |name: &str, terms: serde_json::Value| json!({ "name": name, "model": { "physical": terms } });
    let tilted = json!([
        [-0.9, 0, 0.3],
        [0.9, 0.2, 0.3],
        [0.9, 0.9, 0.1],
        [-0.9, 0.9, 0.1]
    ]);
    serde_json::from_value(json!({
        "format": 1,
        "cameras": [{ "pose": { "look_at": { "eye": place(1.0, 1.0, 9.0), "target": [0, 0, 0] } },
            "projection": { "pinhole": { "vertical_fov": 50 } } }],
        "sky": { "gradient": { "bottom": [0.2, 0.3, 0.5], "top": [0.6, 0.7, 0.9] } },
        "lights": [{ "kind": { "point": { "position": place(0.0, 0.0, 5.0) } },
                "colour": [9.0 * scale * scale, 8.0 * scale * scale, 7.0 * scale * scale] },
            { "kind": { "point": { "position": place(3.0, 0.0, 5.0) } }, "specular": false, "shadows": false,
                "colour": [scale * scale, scale * scale, scale * scale] }],
        "materials": [
            material("paper", json!({ "base_colour": [0.8, 0.7, 0.5], "specular": 0, "roughness": 1 })),
            material("metal", json!({ "base_colour": [0.9, 0.7, 0.4], "metallic": 1, "roughness": 0.25 })),
            material("cells", json!({ "specular": 0, "base_colour":
                { "checker": { "even": [0.9, 0.4, 0.1], "odd": [0.1, 0.2, 0.8], "size": 0.3 * scale } } })),
            material("lamp", json!({ "emission": [5, 4, 3] })),
        ],
        "meshes": [mesh("tilted", tilted.clone()), mesh("flat", json!(null)), mesh("again", tilted.clone()),
            mesh("mirrored", tilted.clone()), mesh("behind", tilted.clone()), mesh("checkered", tilted.clone()),
            mesh("shining", json!(null)), mesh("twice", tilted)],
        "objects": [
            object("tilted", "paper", -3.0, 2.0, json!({})),
            object("flat", "paper", 0.0, 2.0, json!({})),
            object("again", "metal", 3.0, 2.0, json!({})),
            object("mirrored", "paper", -3.0, -2.0, json!({ "transform":
                [{ "scale": [-1, 0.7, 2] }, { "translate": place(-3.0, -2.0, 0.0) }] })),
            object("behind", "paper", 3.0, -2.0, json!({ "face_viewer": false, "transform":
                [{ "rotate": { "axis": [0, 1, 0], "degrees": 180 } }, { "translate": place(3.0, -2.0, 0.0) }] })),
            object("checkered", "cells", 0.0, -2.0, json!({})),
            object("shining", "lamp", 0.0, 4.2, json!({})),
            object("twice", "paper", -3.0, 4.2, json!({})),
            object("twice", "paper", 3.0, 4.2, json!({})),
            { "shape": { "sphere": { "centre": place(0.0, 0.0, 0.0), "radius": 0.8 * scale } }, "material": "paper" },
            { "shape": { "sphere": { "centre": place(1.5, 0.0, 1.0), "radius": 0.2 * scale } }, "material": "lamp" },
            { "shape": { "quad": { "corner": place(-2.0, 0.0, 2.0), "edge_u": place(0.5, 0.0, 0.0),
                "edge_v": place(0.0, 0.5, 0.3) } }, "material": "lamp" },
        ],
    }))
    .expect("a scene")
}

fn uniform_or_general<R: Real>(scale: f64) {
    let scene = uniform_meshes(scale);
    let settings = Settings {
        size: SIZE,
        integrator: crate::scene::Integrator::Path,
        ..Settings::from_scene(&scene)
    };
    // Nested media need the material of every hit.
    let effects = EffectSet::ALL.without(EffectSet::from_effects(&[Effect::NestedMedia]));
    let mut prepared =
        PreparedScene::<R>::new(&scene, &settings, effects, &()).expect("it can be prepared");
    let uniform = prepared
        .objects
        .iter()
        .filter(|object| object.uniform.is_some());
    assert_eq!(
        uniform.count(),
        7,
        "five meshes, and one that is shown twice"
    );
    assert!(PathTracer::new(&prepared, 7, true, &()).has_uniform_triangles);
    let (alone, counters) = followed(&prepared, 7, 1);
    assert!(
        counters.scatter > 200 && counters.shadow > 100,
        "{counters:?}"
    );
    for together in [8, 100, usize::MAX] {
        assert_eq!(
            followed(&prepared, 7, together),
            (alone.clone(), counters),
            "{together}"
        );
    }
    let short = followed(&prepared, 2, 100);
    prepared
        .objects
        .iter_mut()
        .for_each(|object| object.uniform = None);
    assert_eq!(
        followed(&prepared, 7, 100),
        (alone, counters),
        "{scale:e} by interactions"
    );
    assert_eq!(followed(&prepared, 2, 100), short, "{scale:e}, short paths");
}

/// Protects: matte vertices under rectangular lamps, which one task shades, have the bits of each path
/// alone, whatever instructions shade them, with and without interactions, with their first hits and
/// counters; and the light of vertices that are shaded in steps.
#[test]
fn rectangles_light_matte_surfaces_as_other_lamps() {
    rectangles_or_steps(false);
    rectangles_or_steps(true);
}

/// The test above, with a sky or without.
fn rectangles_or_steps(under_sky: bool) {
    let mut scene = uniform_meshes(1.0);
    scene.lights.clear();
    scene.sky = scene.sky.filter(|_| under_sky);
    // The lamps that are no rectangles.
    scene.objects.remove(10);
    scene.objects.remove(6);
    let settings = Settings {
        size: SIZE,
        integrator: crate::scene::Integrator::Path,
        ..Settings::from_scene(&scene)
    };
    let effects = EffectSet::ALL.without(EffectSet::from_effects(&[Effect::NestedMedia]));
    let mut prepared =
        PreparedScene::<f32>::new(&scene, &settings, effects, &()).expect("it can be prepared");
    assert!(PathTracer::new(&prepared, 7, true, &()).lamps.is_some());
    let (alone, counters) = followed(&prepared, 7, 1);
    assert!(
        counters.scatter > 200 && counters.shadow > 100,
        "{counters:?}"
    );
    for together in [3, 8, 100, usize::MAX] {
        assert_eq!(
            followed(&prepared, 7, together),
            (alone.clone(), counters),
            "{together}"
        );
    }
    let short = followed(&prepared, 1, 100).1;
    assert_eq!((short.scatter, short.shadow), (0, 0));
    let mut tracer = PathTracer::new(&prepared, 7, true, &());
    tracer.registers = raywright_bvh::RegisterWidth::Baseline;
    assert_eq!(
        followed_by(&prepared, tracer, 100),
        (alone.clone(), counters)
    );
    let mut tracer = PathTracer::new(&prepared, 7, true, &());
    tracer.lamps = None;
    let (stepwise, _) = followed_by(&prepared, tracer, 100);
    prepared
        .objects
        .iter_mut()
        .for_each(|object| object.uniform = None);
    let by_interactions = followed(&prepared, 7, 100);
    assert_eq!(
        by_interactions,
        (alone.clone(), counters),
        "by interactions"
    );
    let sum = |paths: &[[u64; 5]]| {
        paths
            .iter()
            .map(|path| f64::from_bits(path[0]))
            .sum::<f64>()
    };
    let (fused, stepwise) = (sum(&alone), sum(&stepwise));
    assert!(
        fused > 1.0 && (fused / stepwise - 1.0).abs() < 0.02,
        "{fused} for {stepwise}"
    );
}

/// Protects: paths over triangles of uniform materials have the bits of paths that compute every
/// interaction, with their first hits and counters: on both sides, smooth and flat, mirrored, in
/// instances, under lights of each kind, at tiny and huge scales, in both precisions.
#[test]
fn uniform_triangles_bring_what_interactions_bring() {
    for scale in [1e-6, 1.0, 1e9] {
        uniform_or_general::<f32>(scale);
        uniform_or_general::<f64>(scale);
    }
}

/// Protects: the number of paths side by side changes no bit in absorbing and refractive media,
/// with priorities and without.
#[test]
fn paths_in_bodies_bring_what_they_bring_alone() {
    let (scene, without) = (
        in_bodies(),
        EffectSet::ALL.without(EffectSet::from_effects(&[Effect::NestedMedia])),
    );
    let settings = Settings {
        size: SIZE,
        integrator: crate::scene::Integrator::Path,
        ..Settings::from_scene(&scene)
    };
    let tracks = |effects| {
        let prepared =
            PreparedScene::<f32>::new(&scene, &settings, effects, &()).expect("it can be prepared");
        (prepared.absorbs, prepared.priorities.is_empty())
    };
    assert_eq!(
        (tracks(EffectSet::ALL), tracks(without)),
        ((true, false), (true, true))
    );
    many_or_few::<f32>(&scene, EffectSet::ALL);
    many_or_few::<f32>(&scene, without);
    many_or_few::<f64>(&scene, EffectSet::ALL);
}

/// Rays through the middles of all pixels.
fn rays<R: Real>(prepared: &PreparedScene<R>) -> Vec<Ray<R>> {
    let at = |x: u32| R::from_f64(f64::from(x) + 0.5);
    (0..SIZE[0] * SIZE[1])
        .map(|i| {
            prepared
                .camera
                .generate_ray(at(i % SIZE[0]), at(i / SIZE[0]), [0.5; 2])
        })
        .collect()
}

/// Interactions at the first hits of the rays through the middles of all pixels.
fn interactions(prepared: &PreparedScene<f32>) -> impl Iterator<Item = Interaction<f32>> {
    rays(prepared).into_iter().filter_map(|ray| {
        let segment = super::super::super::PathSegment::from_ray(ray);
        let range = raywright_bvh::Interval::positive();
        let hit = prepared.geometry.closest(&ray, range, &mut ())?;
        Some(Interaction::from_hit_without_normal_map(
            prepared, &segment, &hit,
        ))
    })
}

fn prepared(scene: &Scene) -> PreparedScene<f32> {
    let settings = Settings {
        size: SIZE,
        integrator: crate::scene::Integrator::Path,
        ..Settings::from_scene(scene)
    };
    PreparedScene::new(scene, &settings, EffectSet::ALL, &()).expect("it can be prepared")
}

/// Protects: layers show the first hit of a camera ray on a surface that is present there; a veil
/// is added to the results, after clamping.
#[test]
fn first_hits_veils_and_limits() {
    let mut prepared = prepared(&everything());
    let (rays, plain) = (rays(&prepared), followed(&prepared, 7, 64).0);
    let address = |i: usize| SampleAddress {
        pixel: [i as u32 % SIZE[0], i as u32 / SIZE[0]],
        ..SampleAddress::default()
    };
    let addresses: Vec<_> = (0..rays.len()).map(address).collect();
    let (mut tracer, mut results) = (
        PathTracer::<f32>::new(&prepared, 7, true, &()),
        PathResults::default(),
    );
    tracer.trace(
        CameraRays {
            rays: &rays,
            addresses: &addresses,
        },
        &mut results,
    );
    let (mut hits, mut passed) = (0, 0);
    for (index, ray) in rays.iter().enumerate() {
        let hit = prepared
            .geometry
            .closest(ray, raywright_bvh::Interval::positive(), &mut ());
        hits += usize::from(hit.is_some());
        let found = results.first_hit_and_emission(index).0;
        let (found, nearest) = (
            found.map(|first| first.object),
            hit.map(|hit| hit.outermost_id()),
        );
        // A surface that straight rays may pass is the first hit, or another one behind it is.
        let is_passable = |&object: &u32| {
            let material = prepared.objects[object as usize].material;
            !prepared.materials[material as usize].blocks_straight_rays()
        };
        passed += usize::from(found != nearest);
        assert!(
            found == nearest || nearest.as_ref().is_some_and(is_passable),
            "{index}: {found:?}, not {nearest:?}"
        );
    }
    assert!(hits > rays.len() / 2, "{hits}");
    assert!(passed > 0, "{passed}");
    prepared.veil = glam::Vec3::new(0.25, 0.5, 1.0);
    prepared.clamp = Some(0.75);
    let mut limited = 0;
    for (found, before) in followed(&prepared, 7, 64).0.iter().zip(&plain) {
        let before: [f32; 3] = core::array::from_fn(|k| f64::from_bits(before[k]) as f32);
        let brightest = before.into_iter().fold(0.0, f32::max);
        let factor = if brightest > 0.75 {
            0.75 / brightest
        } else {
            1.0
        };
        limited += usize::from(brightest > 0.75);
        for (k, veil) in [0.25, 0.5, 1.0].into_iter().enumerate() {
            assert_eq!(f64::from_bits(found[k]) as f32, before[k] * factor + veil);
        }
    }
    assert!(limited > 10, "{limited}");
}

/// Protects: a vertex gets its own numbers, the best stratified ones for the direction, and zeros
/// for the light of a scene without lights.
#[test]
fn vertices_get_their_own_numbers() {
    let draws: Vec<[f32; 4]> = (0..4)
        .map(|i| core::array::from_fn(|k| 4.0 * i as f32 + k as f32))
        .collect();
    let numbers = |draws: &[[f32; 4]]| {
        let VertexSamples { light, scatter } = VertexSamples::from_draws(draws, 1, 3);
        (light, scatter)
    };
    let scatter = [7.0, 4.0, 5.0, 6.0];
    assert_eq!(numbers(&draws), ([12.0, 13.0, 14.0, 15.0], scatter));
    assert_eq!(numbers(&draws[..2]), ([0.0; 4], scatter));
}

/// Protects: prefetched texels are the ones read, also if two maps of a material have different
/// transforms.
#[test]
fn prefetching_changes_no_texel() {
    let mut scene = everything();
    let crate::scene::MaterialModel::Physical(leaf) = &mut scene.materials[9].model else {
        panic!("a physical leaf")
    };
    let normals = leaf.normal_texture.as_mut().expect("a normal map");
    normals.uv_transform = Some([[0.5, 0.0, 0.3], [0.0, 2.0, 0.1]]);
    let prepared = prepared(&scene);
    let mut leaves = 0;
    for interaction in interactions(&prepared) {
        let PreparedMaterial::Physical(m) = &prepared.materials[interaction.material as usize]
        else {
            continue;
        };
        let Some(bump) = &m.normal_map else { continue };
        let mut ahead = interaction;
        prepared.texture_tables.prefetch_texels(&mut ahead);
        let read = |interaction: &Interaction<f32>| {
            let (base, code) = (
                m.base_colour_at(&prepared.texture_tables.shading_context(interaction)),
                bump.image
                    .eval_colour(&prepared.texture_tables.shading_context(interaction)),
            );
            (
                base,
                code,
                bump.image
                    .eval_colour(&prepared.texture_tables.shading_context(interaction))
                    - base,
            )
        };
        assert_eq!(read(&ahead), read(&interaction));
        leaves += usize::from(read(&interaction).2 != glam::Vec3::ZERO);
    }
    assert!(leaves > 20, "{leaves} where the maps differ");
}

/// Protects: a material whose inputs are the same everywhere has the model that its inputs give at
/// a hit; one with a checker, a texture, an expression or glass has no such model.
#[test]
fn uniform_models_are_those_of_the_inputs() {
    let mut scene = everything();
    scene.materials[1] = serde_json::from_value(json!({ "name": "metal",
        "model": { "physical": { "base_colour": [0.5, 0.4, 0.3], "metallic": 0.5, "roughness": 0.6, "specular": 0.4 } } }))
    .expect("a material");
    let prepared = prepared(&scene);
    let (mut uniform, mut varying) = (0, 0);
    for interaction in interactions(&prepared) {
        let PreparedMaterial::Physical(m) = &prepared.materials[interaction.material as usize]
        else {
            continue;
        };
        let inputs = crate::prepare::PhysicalInputs {
            uniform_model: None,
            ..*m
        };
        let context = prepared.texture_tables.shading_context(&interaction);
        let model = inputs.metallic_roughness_at(&context);
        assert_eq!(m.metallic_roughness_at(&context), model);
        assert!(m.uniform_model.is_none_or(|uniform| uniform == model));
        uniform += usize::from(m.uniform_model.is_some());
        varying += usize::from(m.uniform_model.is_none());
    }
    assert!(uniform > 20 && varying > 50, "{uniform}, {varying}");
}

/// Protects: a light above the shading horizon and below the geometric one contributes nothing;
/// above both it contributes.
#[test]
fn lights_below_the_surface_light_nothing() {
    let lit = |height: f64| {
        let scene: Scene = serde_json::from_value(json!({
            "format": 1,
            "cameras": [{ "pose": { "look_at": { "eye": [0.2, 0.2, 4], "target": [0.2, 0.2, 0] } },
                "projection": { "pinhole": { "vertical_fov": 2 } } }],
            "lights": [{ "kind": { "point": { "position": [5, 0, height] } }, "colour": 100 }],
            "materials": [{ "name": "paint", "model": { "physical": {} } }],
            "meshes": [{ "name": "leaf", "source": { "inline": { "positions": [[-1, -1, 0], [3, -1, 0], [-1, 3, 0]],
                "indices": [[0, 1, 2]], "normals": [[0.6, 0, 0.8], [0.6, 0, 0.8], [0.6, 0, 0.8]] } } }],
            "objects": [{ "shape": { "mesh": "leaf" }, "material": "paint" }],
        }))
        .expect("a scene");
        let (brought, _) = followed(&prepared(&scene), 2, 64);
        brought
            .iter()
            .filter(|brought| f64::from_bits(brought[0]) > 0.0)
            .count()
    };
    assert_eq!(lit(-0.5), 0);
    assert_eq!(lit(0.5), (4 * SIZE[0] * SIZE[1]) as usize);
}
