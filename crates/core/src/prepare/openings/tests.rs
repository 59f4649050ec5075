use raywright_bvh::AcceleratorKind;
use serde_json::{Value, json};

use crate::metrics::picture_errors;
use crate::picture::Picture;
use crate::scene::{Integrator, Scene};
use crate::settings::{PrecisionChoice, Sampling, Settings, SkyChoice};
use crate::{ReadyScene, prepare, prepare_for_previews};

fn slab(min: [f64; 3], max: [f64; 3]) -> Value {
    json!({ "shape": { "box": { "min": min, "max": max } }, "material": "wall" })
}

/// A room of thick walls with these objects in place of its front wall, under a gradient sky with a
/// small sun.
fn room(front: &[Value]) -> Scene {
    let mut objects = vec![
        slab([-3.2, -0.2, -3.2], [3.2, 0.0, 3.2]),
        slab([-3.2, 3.0, -3.2], [3.2, 3.2, 3.2]),
        slab([-3.2, 0.0, -3.2], [3.2, 3.0, -3.0]),
        slab([-3.2, 0.0, -3.0], [-3.0, 3.0, 3.0]),
        slab([3.0, 0.0, -3.0], [3.2, 3.0, 3.0]),
    ];
    objects.extend_from_slice(front);
    serde_json::from_value(json!({
        "format": 1,
        "cameras": [{ "pose": { "look_at": { "eye": [2.6, 1.6, 2.4], "target": [-1.2, 0.9, -1.2] } },
            "projection": { "pinhole": { "vertical_fov": 60 } } }],
        "sky": { "gradient": { "bottom": 0.3, "top": [0.5, 0.7, 1.2], "suns": [
            { "direction": [-0.5, 0.7, 0.8], "colour": 1, "weight": 20, "exponent": 400 }] } },
        "materials": [{ "name": "wall", "model": { "physical": { "base_colour": 0.7, "roughness": 1 } } },
            { "name": "pane", "model": { "physical": { "transmission": 1, "roughness": 0, "ior": 1.5,
                "thin_walled": true } } },
            { "name": "lamp", "model": { "physical": { "base_colour": 0, "emission": 300 } } }],
        "objects": objects,
    }))
    .unwrap_or_else(|e| panic!("{e}"))
}

/// A front wall with a window.
fn window() -> Vec<Value> {
    vec![
        slab([-3.2, 0.0, 3.0], [-2.0, 3.0, 3.2]),
        slab([-0.8, 0.0, 3.0], [3.2, 3.0, 3.2]),
        slab([-2.0, 0.0, 3.0], [-0.8, 1.1, 3.2]),
        slab([-2.0, 2.1, 3.0], [-0.8, 3.0, 3.2]),
    ]
}

fn settings(scene: &Scene, samples: u32) -> Settings {
    Settings {
        size: [24, 16],
        sampling: Sampling::General(samples),
        max_depth: 4,
        integrator: Integrator::Path,
        sky_choice: SkyChoice::Openings,
        ..Settings::from_scene(scene)
    }
}

fn ready(scene: &Scene, settings: &Settings) -> ReadyScene {
    prepare(scene, settings, &()).unwrap_or_else(|e| panic!("{e}"))
}

fn cells(scene: &Scene) -> usize {
    ready(scene, &settings(scene, 1)).table_sizes().openings
}

/// Protects: a table is made for a room with a window, also with a pane in it, in f64 and by a scan,
/// and once previews are shown. It is absent in an open room, in a closed one, under a bright lamp,
/// without a sky, and where the choice is by power.
#[test]
fn tables_are_made_where_walls_hide_the_sky() {
    let windowed = room(&window());
    assert!(cells(&windowed) > 100);
    let mut glazed = window();
    glazed.push(
        json!({ "shape": { "quad": { "corner": [-2, 1.1, 3.1], "edge_u": [1.2, 0, 0],
        "edge_v": [0, 1, 0] } }, "material": "pane" }),
    );
    assert!(cells(&room(&glazed)) > 100);
    let of = |change: fn(&mut Settings)| {
        let mut settings = settings(&windowed, 1);
        change(&mut settings);
        ready(&windowed, &settings).table_sizes().openings
    };
    assert!(of(|s| s.precision = PrecisionChoice::Reference) > 100);
    assert_eq!(
        of(|s| s.accelerator = AcceleratorKind::Linear),
        cells(&windowed)
    );
    assert_eq!(of(|s| s.sky_choice = SkyChoice::Power), 0);
    assert_eq!(of(|s| s.integrator = Integrator::Whitted), 0);
    assert_eq!(cells(&room(&[slab([-3.2, 0.0, 3.0], [3.2, 3.0, 3.2])])), 0);
    let mut field = room(&[]);
    field.objects.truncate(1);
    assert_eq!(cells(&field), 0);
    let mut lit = window();
    lit.push(json!({ "shape": { "sphere": { "centre": [0, 2, 0], "radius": 0.2 } }, "material": "lamp" }));
    assert_eq!(cells(&room(&lit)), 0);
    let settings = settings(&windowed, 1);
    let mut preview = prepare_for_previews(&windowed, &settings, &()).expect("a scene");
    assert_eq!(preview.table_sizes().openings, 0);
    preview.complete(&windowed, &()).expect("a scene");
    assert_eq!(preview.table_sizes().openings, cells(&windowed));
    assert!(preview.render(&()).picture.rgb == ready(&windowed, &settings).render(&()).picture.rgb);
    let mut dark = windowed.clone();
    dark.sky = None;
    assert_eq!(cells(&dark), 0);
}

fn render(scene: &Scene, settings: &Settings) -> Picture {
    ready(scene, settings).render(&()).picture
}

/// Protects: the light through a window is that of sampling by power, with a small part of its
/// noise.
#[test]
fn windows_keep_their_light_with_less_noise() {
    let scene = room(&window());
    let picture = |samples, seed, sky_choice| {
        let settings = Settings {
            seed,
            sky_choice,
            ..settings(&scene, samples)
        };
        render(&scene, &settings)
    };
    let truth = picture(4096, 1, SkyChoice::Openings);
    let mean = |picture: &Picture| {
        picture
            .rgb
            .iter()
            .flatten()
            .map(|&c| f64::from(c))
            .sum::<f64>()
            / picture.rgb.len() as f64
    };
    let other = mean(&picture(16_384, 2, SkyChoice::Power));
    assert!(
        (mean(&truth) / other - 1.0).abs() < 0.01,
        "{} and {other}",
        mean(&truth)
    );
    let error = |sky_choice| {
        (0..4)
            .map(|seed| picture_errors(&picture(16, 10 + seed, sky_choice), &truth))
            .map(|errors| errors.expect("one size").relmse)
            .sum::<f64>()
    };
    let [openings, power] = [SkyChoice::Openings, SkyChoice::Power].map(error);
    assert!(openings < 0.3 * power, "{openings} of {power}");
}

/// Protects: pictures of a room with a window have the same bits on one thread and on three, and
/// with a camera that is replaced.
#[test]
fn tables_do_not_depend_on_threads_and_cameras() {
    let scene = room(&window());
    let settings = settings(&scene, 4);
    let with_threads = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.expect("threads").install(|| render(&scene, &settings))
    };
    let alone = with_threads(1);
    assert!(alone.rgb == with_threads(3).rgb);
    let mut other = scene.clone();
    other.cameras[0].pose =
        serde_json::from_value(json!({ "look_at": { "eye": [-2, 1, 2], "target": [1, 1, -1] } }))
            .expect("a pose");
    let from_there = Settings {
        camera: other.cameras.first().cloned(),
        ..settings.clone()
    };
    let mut replaced = ready(&scene, &from_there);
    assert!(replaced.replace_camera(&scene, &scene.cameras[0]));
    assert!(alone.rgb == replaced.render(&()).picture.rgb);
}
