//! Memory estimates are made before anything is built, and are never too small: compared with the
//! built structures for every preset, for meshes, instances, generated objects and lamps, and for
//! the models of the shared assets.

use std::path::PathBuf;

use raywright::bvh::{AcceleratorKind, BuildQuality};
use raywright::core::settings::PrecisionChoice;
use raywright::core::{MemoryUse, Scene, Settings, estimate_scene_memory, prepare};
use raywright::io::{Input, LoadOptions, load, presets};
use serde_json::{Value, json};

use crate::support::shared;

const PRECISIONS: [PrecisionChoice; 2] = [PrecisionChoice::Robust, PrecisionChoice::Reference];
const ACCELERATORS: [AcceleratorKind; 2] = [
    AcceleratorKind::Linear,
    AcceleratorKind::Tree(BuildQuality::Fast),
];

/// Checks each part of the estimate: at least the actual memory and at most twice of it; for
/// geometry in a tree, up to five times and some kilobytes, because the fill of its nodes and
/// blocks is unknown. Returns both.
#[track_caller]
fn told(label: &str, scene: &Scene, settings: &Settings) -> [MemoryUse; 2] {
    let before = estimate_scene_memory(scene, settings);
    let after = prepare(scene, settings, &())
        .unwrap_or_else(|e| panic!("{label}: {e}"))
        .memory();
    for ((name, reported), (_, real)) in before
        .bytes_by_purpose()
        .into_iter()
        .zip(after.bytes_by_purpose())
    {
        let wide = name == "geometry" && matches!(settings.accelerator, AcceleratorKind::Tree(_));
        let maximum = if wide { 5 * real + 8192 } else { 2 * real };
        assert!(
            real <= reported && reported <= maximum,
            "{label}: {name} {real} bytes, told {reported}"
        );
    }
    [before, after]
}

#[track_caller]
fn told_in_every_way(label: &str, scene: &Scene) {
    for precision in PRECISIONS {
        for accelerator in ACCELERATORS {
            let settings = Settings {
                size: [8, 6],
                precision,
                accelerator,
                ..Settings::from_scene(scene)
            };
            told(
                &format!("{label}, {precision:?}, {accelerator:?}"),
                scene,
                &settings,
            );
        }
    }
}

/// A fan of this number of triangles.
fn fan(name: &str, triangles: u32) -> Value {
    let corner = |i: u32| {
        let turn = 0.01 * f64::from(i);
        [turn.cos(), turn.sin(), 0.1 * turn]
    };
    let positions: Vec<[f64; 3]> = (0..triangles + 2).map(corner).collect();
    let indices: Vec<[u32; 3]> = (1..=triangles).map(|i| [0, i, i + 1]).collect();
    json!({ "name": name, "source": { "inline": { "positions": positions, "indices": indices } } })
}

fn scene(parts: Value) -> Scene {
    let mut whole = json!({ "format": 1, "materials": [
        { "name": "matte", "model": { "classic": {} } },
        { "name": "lamp", "model": { "physical": { "emission": 1 } } }] });
    for (key, value) in parts.as_object().expect("parts with names") {
        whole[key] = value.clone();
    }
    serde_json::from_value(whole).unwrap_or_else(|e| panic!("{e}"))
}

fn shown(mesh: &str, material: &str, x: f64) -> Value {
    json!({ "shape": { "mesh": mesh }, "material": material, "transform": [{ "translate": [x, 0, 0] }] })
}

/// Protects: presets take at most the estimated memory and at least half of it, in each precision
/// and with each accelerator.
#[test]
fn memory_of_presets() {
    for preset in presets::list() {
        let scene = load(
            &Input::Preset(preset.name.to_owned()),
            &LoadOptions::default(),
        )
        .unwrap_or_else(|e| panic!("{e}"))
        .scene;
        told_in_every_way(preset.name, &scene);
    }
}

/// Protects: the same for single meshes, meshes shared by instances, one-sided or two-sided, lamps
/// of every kind, and thousands of generated objects, translated or rotated.
#[test]
fn memory_of_meshes_instances_and_generators() {
    let sided = |mut object: Value| {
        object["side"] = json!("outside");
        object
    };
    let instances: Vec<Value> = (0..40)
        .map(|i| shown("leaf", "matte", f64::from(i)))
        .collect();
    let ball = json!({ "shape": { "sphere": { "centre": [0, 0, 0], "radius": 0.1 } }, "material": "matte" });
    let turned =
        json!([{ "rotate": { "axis": [0, 1, 0], "degrees": 20 } }, { "scale": [1, 2, 3] }]);
    let (mut egg, mut glow) = (ball.clone(), ball.clone());
    egg["transform"] = turned.clone();
    (glow["transform"], glow["material"]) = (turned, json!("lamp"));
    let grid = |object: &Value| json!([{ "kind": { "grid": { "counts": [20, 10, 10], "origin": [0, 0, 0], "step": [1, 1, 1] } }, "object": object }]);
    let scenes = [
        ("nothing", json!({})),
        (
            "a mesh",
            json!({ "meshes": [fan("leaf", 500)], "objects": [shown("leaf", "matte", 0.0)] }),
        ),
        (
            "instances",
            json!({ "meshes": [fan("leaf", 500)], "objects": instances }),
        ),
        (
            "instances of two sides, and a mesh by itself",
            json!({ "meshes": [fan("leaf", 300), fan("stem", 9)], "objects": [shown("leaf", "matte", 0.0), shown("leaf", "matte", 1.0),
                sided(shown("leaf", "matte", 2.0)), sided(shown("leaf", "matte", 3.0)), shown("stem", "matte", 4.0)] }),
        ),
        (
            "a mesh that glows",
            json!({ "meshes": [fan("leaf", 500)], "objects": [shown("leaf", "lamp", 0.0), ball] }),
        ),
        (
            "instances that glow",
            json!({ "meshes": [fan("leaf", 50)], "objects": [shown("leaf", "lamp", 0.0), shown("leaf", "lamp", 1.0)] }),
        ),
        ("balls", json!({ "generators": grid(&ball) })),
        ("eggs", json!({ "generators": grid(&egg) })),
        (
            "lamps",
            json!({ "generators": grid(&glow), "objects": [ball] }),
        ),
    ];
    for (label, parts) in scenes {
        told_in_every_way(label, &scene(parts));
    }
}

/// Protects: the same for the loadable models of the shared assets, textures included.
#[test]
fn memory_of_models() {
    let Some(folder) = shared("assets") else {
        return;
    };
    let (mut open, mut maximum): (Vec<PathBuf>, f64) =
        (vec![folder.join("gltf"), folder.join("obj")], 1.0);
    while let Some(next) = open.pop() {
        for path in std::fs::read_dir(&next)
            .expect("a folder")
            .map(|entry| entry.expect("readable").path())
        {
            if path.is_dir() {
                open.push(path);
            } else if path.extension().is_some_and(|e| {
                ["gltf", "glb", "obj"]
                    .iter()
                    .any(|known| e.eq_ignore_ascii_case(known))
            }) {
                // Other tests cover files that do not load.
                let Ok(loaded) = load(&Input::Path(path.clone()), &LoadOptions::default()) else {
                    continue;
                };
                let settings = Settings {
                    size: [8, 6],
                    ..Settings::from_scene(&loaded.scene)
                };
                let [before, after] = told(&path.display().to_string(), &loaded.scene, &settings);
                maximum = maximum.max(before.total() as f64 / after.total() as f64);
            }
        }
    }
    eprintln!("what is told of models is at most {maximum:.2} times what they take");
}
