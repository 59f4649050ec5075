//! Counters, reports and decisions of a render besides its picture.

use core::sync::atomic::{AtomicU32, Ordering};
use std::sync::Mutex;

use raywright_core::prepare::PrepareError;
use raywright_core::scene::{Integrator, SamplePattern, Scene};
use raywright_core::settings::{Aov, Crop, Sampling, Settings};
use raywright_core::{Observer, estimate_scene_memory, prepare};
use serde_json::json;

use crate::support::{DOWN, classic, floor, physical, render_scene, scene, settings, sun};

/// A floor under one light.
fn lit() -> Scene {
    floor(
        classic(json!({})),
        json!({ "lights": [sun([0.0, 1.0, 0.0])] }),
    )
}

/// Protects: rays of each kind and samples of a small picture are counted; corners are traced once
/// for all pixels that share them.
#[test]
fn rays_are_counted_by_kind() {
    let scene = lit();
    let counted = |sampling, tile_size| {
        let counters = render_scene(
            &scene,
            &Settings {
                size: [4, 3],
                sampling,
                tile_size,
                ..settings(&scene, DOWN)
            },
        )
        .counters;
        assert_eq!(
            (
                counters.reflection,
                counters.refraction,
                counters.scatter,
                counters.dropped
            ),
            (0, 0, 0, 0)
        );
        (counters.camera, counters.shadow, counters.samples)
    };
    assert_eq!(
        counted(Sampling::Pattern(SamplePattern::Centre), 32),
        (12, 12, 12)
    );
    assert_eq!(counted(Sampling::General(3), 2), (36, 36, 36));
    assert_eq!(
        counted(Sampling::Pattern(SamplePattern::Corners), 32),
        (20, 20, 48)
    );
    // Tiles of 2 × 2: 3 · 3 corners twice above, 3 · 2 twice below.
    assert_eq!(
        counted(Sampling::Pattern(SamplePattern::Corners), 2),
        (30, 30, 48)
    );
}

/// Protects: `--spp` keeps a pattern of its count, makes one sample of a pattern its centre, and
/// anything else general.
#[test]
fn sampling_is_resolved() {
    let mut scene = Scene::default();
    let resolve = |scene: &Scene, spp| Sampling::from_spp(scene, spp);
    scene.render.samples = 9;
    assert_eq!(
        (resolve(&scene, None), resolve(&scene, Some(1))),
        (Sampling::General(9), Sampling::General(1))
    );
    scene.render.pattern = Some(SamplePattern::Corners);
    let corners = Sampling::Pattern(SamplePattern::Corners);
    assert_eq!(
        (resolve(&scene, None), resolve(&scene, Some(4))),
        (corners, corners)
    );
    assert_eq!(
        resolve(&scene, Some(1)),
        Sampling::Pattern(SamplePattern::Centre)
    );
    assert_eq!(resolve(&scene, Some(5)), Sampling::General(5));
    assert_eq!(
        (
            corners.samples_per_pixel(),
            Sampling::Pattern(SamplePattern::Centre).samples_per_pixel(),
            Sampling::General(7).samples_per_pixel()
        ),
        (4, 1, 7)
    );
}

/// Records progress, and may cancel.
#[derive(Default)]
struct Watcher {
    reported: Mutex<Vec<(u64, u64)>>,
    stop: bool,
}

impl Observer for Watcher {
    fn progress(&self, done: u64, total: u64) {
        self.reported.lock().expect("no panic").push((done, total));
    }

    fn is_cancelled(&self) -> bool {
        self.stop
    }
}

/// Protects: progress counts pixels of the crop up to all of them; a cancelled render is marked as
/// such and black.
#[test]
fn progress_is_told_and_a_render_can_be_stopped() {
    let scene = lit();
    let crop = Some(Crop {
        x: 1,
        y: 0,
        width: 5,
        height: 3,
    });
    let settings = Settings {
        size: [8, 8],
        crop,
        tile_size: 4,
        ..settings(&scene, DOWN)
    };
    let ready = prepare(&scene, &settings, &()).expect("prepares");
    let watcher = Watcher::default();
    assert!(ready.render(&watcher).finished);
    let mut reported = watcher.reported.into_inner().expect("no panic");
    reported.sort_unstable();
    assert!(
        reported == [(12, 15), (15, 15)] || reported == [(3, 15), (15, 15)],
        "{reported:?}"
    );
    let stopped = ready.render(&Watcher {
        stop: true,
        ..Watcher::default()
    });
    assert!(
        !stopped.finished
            && stopped.counters.camera == 0
            && stopped.picture.rgb.iter().all(|rgb| *rgb == [0.0; 3])
    );
}

/// Protects: in a deterministic render a pixel of the crop takes 26 bytes of sums and 12 of the
/// picture, a mean layer 24 of sums and 12 of the picture, a layer of pixel centres 4 of both; the
/// limit applies to the total.
#[test]
fn memory_is_counted_and_limited() {
    let scene = lit();
    let crop = Some(Crop {
        x: 0,
        y: 0,
        width: 10,
        height: 7,
    });
    let base = Settings {
        size: [100, 100],
        crop,
        aovs: vec![Aov::Albedo, Aov::Depth],
        ..settings(&scene, DOWN)
    };
    let memory = prepare(&scene, &base, &())
        .map(|ready| ready.memory())
        .expect("prepares");
    assert_eq!(
        (memory.film, memory.textures, memory.meshes),
        (70 * (26 + 12 + (24 + 12) + 2 * 4), 0, 0)
    );
    assert_eq!(
        memory.total(),
        memory.film + memory.geometry + memory.tables
    );
    let needed = estimate_scene_memory(&scene, &base).total();
    let limited = |limit| {
        prepare(
            &scene,
            &Settings {
                max_memory: Some(limit),
                ..base.clone()
            },
            &(),
        )
        .is_ok()
    };
    assert!(memory.geometry > 0 && memory.tables > 0 && limited(needed) && !limited(needed - 1));
}

/// Protects: too little memory is reported before anything is built: the observer is not called,
/// because nothing has begun.
#[test]
fn memory_is_told_before_anything_is_built() {
    let scene = lit();
    let watcher = Watcher {
        stop: true,
        ..Watcher::default()
    };
    let limited = |max_memory| {
        prepare(
            &scene,
            &Settings {
                max_memory,
                ..settings(&scene, DOWN)
            },
            &watcher,
        )
        .err()
    };
    let needed = estimate_scene_memory(&scene, &settings(&scene, DOWN));
    assert_eq!(
        limited(Some(1)),
        Some(PrepareError::Memory { needed, allowed: 1 })
    );
    assert_eq!(limited(None), Some(PrepareError::Cancelled));
}

/// Protects: tables count what was built, and an absent effect's table is empty.
#[test]
fn tables_count_what_was_built() {
    let tables = |scene: &Scene| {
        prepare(scene, &settings(scene, DOWN), &())
            .expect("prepares")
            .table_sizes()
    };
    let lamp = json!({ "name": "lamp", "model": { "classic": { "local": 0, "emission": 1 } } });
    let spare = json!({ "name": "spare", "model": { "classic": {} } });
    let objects = json!([
        crate::support::ball([0.0, 5.0, 0.0], 1.0, "lamp"),
        crate::support::ball([9.0, 5.0, 0.0], 1.0, "lamp")
    ]);
    let parts = json!({ "lights": [sun([0.0, 1.0, 0.0])], "materials": [lamp, spare], "objects": objects, "sky": { "constant": 1 } });
    let full = tables(&floor(physical(json!({})), parts.clone()));
    assert_eq!(
        (
            full.primitives,
            full.unbounded,
            full.instances,
            full.lights,
            full.emitters,
            full.materials
        ),
        (3, 1, 0, 1, 2, 2)
    );
    assert!(full.irradiance);
    let deaf = tables(&floor(classic(json!({ "diffuse": 0 })), parts));
    assert_eq!((deaf.lights, deaf.emitters, deaf.irradiance), (0, 0, false));
    let unlit = tables(&floor(
        physical(json!({ "unlit": true })),
        json!({ "lights": [sun([0.0, 1.0, 0.0])] }),
    ));
    assert_eq!(unlit.lights, 0);
}

/// Protects: a render can be cancelled within one pixel with paths that divide at panes of glass:
/// half a million times here, and without a practical end at greater depths. The unfinished pixel
/// is dropped.
#[test]
fn a_pixel_of_many_paths_can_be_stopped() {
    struct StopsSoon(AtomicU32);
    impl Observer for StopsSoon {
        fn is_cancelled(&self) -> bool {
            self.0.fetch_add(1, Ordering::Relaxed) >= 3
        }
    }
    let glass = classic(json!({ "local": 0, "emission": 1, "transmission": { "ior": 1.5 } }));
    let pane = |i: i32| json!({ "shape": { "plane": { "point": [0, -i, 0], "normal": [0, 1, 0] } }, "material": "m" });
    let panes: Vec<_> = (0..24).map(pane).collect();
    let scene = scene(json!({ "objects": panes, "materials": [{ "name": "m", "model": glass }] }));
    let ready = prepare(
        &scene,
        &Settings {
            max_depth: 22,
            ..settings(&scene, DOWN)
        },
        &(),
    )
    .expect("prepares");
    let stopped = ready.render(&StopsSoon(AtomicU32::new(0)));
    assert_eq!(
        (
            stopped.finished,
            stopped.counters.camera,
            stopped.unfinished
        ),
        (false, 0, 1)
    );
    let whole = prepare(
        &scene,
        &Settings {
            max_depth: 14,
            ..settings(&scene, DOWN)
        },
        &(),
    )
    .expect("prepares")
    .render(&());
    assert!(
        whole.finished && whole.counters.reflection > 1000,
        "{:?}",
        whole.counters
    );
}

/// Protects: lamps hit by chance alone are counted, and nothing else. Between an emissive floor and
/// a mirror ceiling, both much wider than their distance, nearly every path scattered by the floor
/// is mirrored and hits the emissive floor again. A diffuse ceiling counts none, a floor without
/// emission is no lamp, and lamps that the camera sees in a mirror do not count.
#[test]
fn lamps_hit_by_chance_are_counted() {
    let value_of = |glow: f64, roughness: f64, view| {
        let wide = |y: f64, z: f64| json!({ "quad": { "corner": [-500, y, 500.0 * z], "edge_u": [1000, 0, 0], "edge_v": [0, 0, -1000.0 * z] } });
        let scene = scene(json!({ "render": { "samples": 16, "integrator": "path" },
            "materials": [{ "name": "floor", "model": physical(json!({ "base_colour": 0.9, "emission": glow })) },
                { "name": "ceiling", "model": physical(json!({ "base_colour": 1, "metallic": 1, "roughness": roughness })) }],
            "objects": [{ "shape": wide(0.0, 1.0), "material": "floor" }, { "shape": wide(3.0, -1.0), "material": "ceiling" }] }));
        let sampling = Sampling::General(16);
        let settings = Settings {
            size: [4, 3],
            sampling,
            max_depth: 3,
            integrator: Integrator::Path,
            ..settings(&scene, view)
        };
        let counters = render_scene(&scene, &settings).counters;
        (
            counters.samples as f64,
            counters.unaided as f64,
            counters.found as f64,
        )
    };
    let (samples, unaided, found) = value_of(1.0, 0.0, DOWN);
    assert!(
        unaided > 0.95 * samples && unaided <= samples && found == unaided,
        "{unaided} and {found} of {samples}"
    );
    let (.., unaided, found) = value_of(1.0, 1.0, DOWN);
    assert_eq!((unaided, found), (0.0, 0.0));
    let (.., unaided, found) = value_of(0.0, 0.0, DOWN);
    assert_eq!((unaided, found), (0.0, 0.0));
    let (.., unaided, found) = value_of(1.0, 0.0, [[0.0, 1.0, 0.0], [0.0, 3.0, 0.0]]);
    assert_eq!((unaided, found), (0.0, 0.0));
}
