//! Exposures of models that are lit as Blender exports them: by suns and lamps of many lux.

use raywright_core::prepare;
use raywright_core::settings::{Background, Crop, Sampling, Settings};
use raywright_io::{Input, LoadOptions, load};

use super::*;

/// Returns a model of a cube on a floor with a light, `light` of which is the JSON of the light and
/// `node` that of its place.
fn model(light: &str, node: &str) -> LoadedScene {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut positions: Vec<[f32; 3]> = (0..8_u32)
        .map(|i| [i & 1, i >> 1 & 1, i >> 2 & 1].map(|bit| bit as f32))
        .collect();
    positions.extend([[-1., 0., -1.], [2., 0., -1.], [2., 0., 2.], [-1., 0., 2.]]);
    let quads = [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [8, 11, 10, 9],
    ];
    let indices = quads.iter().flat_map(|&[a, b, c, d]| [a, b, c, a, c, d]);
    let mut bytes: Vec<u8> = positions
        .iter()
        .flatten()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    bytes.extend(indices.flat_map(u32::to_le_bytes));
    std::fs::write(folder.path().join("m.bin"), bytes).expect("a file");
    let text = format!(
        r#"{{ "asset": {{ "version": "2.0" }}, "extensionsUsed": ["KHR_lights_punctual"], "scene": 0,
        "scenes": [{{ "nodes": [0, 1] }}], "nodes": [{{ "mesh": 0 }},
            {{ {node} "extensions": {{ "KHR_lights_punctual": {{ "light": 0 }} }} }}],
        "extensions": {{ "KHR_lights_punctual": {{ "lights": [{{ {light} }}] }} }},
        "meshes": [{{ "primitives": [{{ "attributes": {{ "POSITION": 0 }}, "indices": 1, "material": 0 }}] }}],
        "materials": [{{ "pbrMetallicRoughness": {{ "metallicFactor": 0, "baseColorFactor": [0.8, 0.8, 0.8, 1] }} }}],
        "accessors": [
            {{ "bufferView": 0, "componentType": 5126, "count": 12, "type": "VEC3", "min": [-1, 0, -1], "max": [2, 1, 2] }},
            {{ "bufferView": 1, "componentType": 5125, "count": 42, "type": "SCALAR" }}],
        "bufferViews": [{{ "buffer": 0, "byteLength": 144 }}, {{ "buffer": 0, "byteOffset": 144, "byteLength": 168 }}],
        "buffers": [{{ "uri": "m.bin", "byteLength": 312 }}] }}"#
    );
    let file = folder.path().join("m.gltf");
    std::fs::write(&file, text).expect("a file");
    load(&Input::Path(file), &LoadOptions::default()).expect("a model")
}

/// Node of a light that shines downwards from the side of the default camera.
const ABOVE: &str = r#""translation": [1, 3, 3], "rotation": [-0.3826834, 0, 0, 0.9238795],"#;

fn settings(loaded: &LoadedScene) -> Settings {
    Settings {
        size: [96, 64],
        sampling: Sampling::General(4),
        ..Settings::from_scene(&loaded.scene)
    }
}

/// Returns the exposure without a request, and the level of the brightest tenth of the objects when
/// they are shown with it.
fn expose(loaded: &LoadedScene) -> (ChosenExposure, f32) {
    let ready = prepare(&loaded.scene, &settings(loaded), &()).expect("a scene");
    let display = Display::from_render(&loaded.scene.render);
    let chosen = choose_exposure(loaded, &ready, (display, None), &());
    let mut levels: Vec<f32> = ready.survey_lit_objects(&()).iter().map(|c| c[0]).collect();
    levels.sort_by(f32::total_cmp);
    let level = levels[levels.len() * 9 / 10] * (chosen.display.unwrap_or(0.0) as f32).exp2();
    (chosen, level)
}

/// Protects: a model lit by a sun, a lamp or a spot of thousands of lux is shown neither white nor
/// black without a flag, whatever the strength; a light of the usual strength changes nothing, a dim
/// one brightens the picture, and a scene file keeps its exposure.
#[test]
fn lights_of_any_strength_show_their_model() {
    let suns = [1.0, 2049.0, 68_300.0, 1e9].map(|lux| {
        let sun = model(
            &format!(r#""type": "directional", "intensity": {lux}"#),
            ABOVE,
        );
        expose(&sun)
    });
    assert_eq!(suns[0].0, ChosenExposure::default());
    let stops = suns.map(|(chosen, _)| chosen.lights);
    assert!((stops[1] - stops[2] - 5.0).abs() <= 1.0, "{stops:?}");
    for (chosen, level) in &suns[1..] {
        assert_eq!(chosen.display, Some(chosen.lights));
        assert!((0.7..1.42).contains(level), "{chosen:?} {level}");
    }
    for light in [
        r#""type": "point", "intensity": 54351"#,
        r#""type": "spot", "spot": {}, "intensity": 54351"#,
        r#""type": "directional", "intensity": 0.03"#,
    ] {
        let (chosen, level) = expose(&model(light, ABOVE));
        assert!((0.7..1.42).contains(&level), "{light}: {chosen:?} {level}");
    }
    let mut native = model(r#""type": "directional", "intensity": 2049"#, ABOVE);
    native.source.format = raywright_io::SceneFormat::Native(raywright_io::SceneNotation::Toml);
    assert_eq!(expose(&native).0, ChosenExposure::default());
}

/// Protects: crop, samples, seed, tiles, background and threads change no chosen exposure, and a
/// requested number wins; `auto` counts the objects alone.
#[test]
fn exposures_depend_on_the_view_alone() {
    let loaded = model(r#""type": "directional", "intensity": 2049"#, ABOVE);
    let display = Display::from_render(&loaded.scene.render);
    let choose = |settings: &Settings, requested| {
        let ready = prepare(&loaded.scene, settings, &()).expect("a scene");
        choose_exposure(&loaded, &ready, (display, requested), &())
    };
    let plain = choose(&settings(&loaded), None);
    let crop = Crop {
        x: 0,
        y: 0,
        width: 8,
        height: 8,
    };
    for changed in [
        Settings {
            crop: Some(crop),
            ..settings(&loaded)
        },
        Settings {
            sampling: Sampling::General(1),
            ..settings(&loaded)
        },
        Settings {
            seed: 7,
            tile_size: 5,
            ..settings(&loaded)
        },
        Settings {
            background: Background::Transparent,
            ..settings(&loaded)
        },
    ] {
        assert_eq!(choose(&changed, None), plain);
        assert_eq!(choose(&changed, Some(ExposureChoice::Auto)), plain);
    }
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .expect("a thread");
    assert_eq!(pool.install(|| choose(&settings(&loaded), None)), plain);
    let stops = choose(&settings(&loaded), Some(ExposureChoice::Stops(1.0)));
    assert_eq!((stops.display, stops.lights), (None, plain.lights));
}

/// Protects: the studio's backdrop behind a model with lights of its own is neither black nor white
/// at the chosen exposure, and lights nothing.
#[test]
fn a_backdrop_stands_behind_lit_models() {
    let mut loaded = model(r#""type": "directional", "intensity": 2049"#, ABOVE);
    let render = |loaded: &LoadedScene| {
        let mut ready = prepare(&loaded.scene, &settings(loaded), &()).expect("a scene");
        let (chosen, _) = expose(loaded);
        ready.set_backdrop_exposure(chosen.lights);
        (ready.render(&()).picture, chosen.lights)
    };
    let (with, stops) = render(&loaded);
    let backdrop = f64::from(with.rgb[0][0]) * stops.exp2();
    assert!((0.03..0.7).contains(&backdrop), "{backdrop}");
    loaded.scene.sky = None;
    let (without, _) = render(&loaded);
    assert_eq!(without.rgb[0], [0.0; 3]);
    let middle = 32 * 96 + 48;
    assert_eq!(with.rgb[middle], without.rgb[middle]);
}

/// Protects: a closed room, whose walls send the light of the lamp at its camera to and fro, is shown
/// below white, dark and white walls alike.
#[test]
fn rooms_without_light_are_shown_below_white() {
    let cube = "v -2 -2 -2\nv 2 -2 -2\nv 2 2 -2\nv -2 2 -2\nv -2 -2 2\nv 2 -2 2\nv 2 2 2\nv -2 2 2\n\
                usemtl wall\nf 1 2 3 4\nf 5 6 7 8\nf 1 2 6 5\nf 4 3 7 8\nf 1 4 8 5\nf 2 3 7 6\n";
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("room.obj");
    std::fs::write(&file, format!("mtllib room.mtl\n{cube}")).expect("a file");
    for white in [0.04, 0.4, 0.95] {
        let material = format!("newmtl wall\nKd {white} {white} {white}\n");
        std::fs::write(folder.path().join("room.mtl"), material).expect("a file");
        let mut loaded = load(&Input::Path(file.clone()), &LoadOptions::default()).expect("a room");
        let camera = serde_json::json!({
            "pose": { "look_at": { "eye": [0.5, 0.2, 1.5], "target": [0, 0, 0] } },
            "projection": { "pinhole": { "vertical_fov": 50 } },
        });
        let camera = serde_json::from_value(camera).expect("a camera");
        loaded.scene.cameras.push(camera);
        let (chosen, level) = expose(&loaded);
        assert!((0.3..0.75).contains(&level), "{white}: {chosen:?} {level}");
    }
}
