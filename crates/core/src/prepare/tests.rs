//! Data of a prepared scene.
use std::sync::Arc;

use serde_json::json;

use super::*;
use crate::light::DeltaLight;
use crate::scene::{ImageData, Integrator, MeshSource, PixelData};

/// A mesh used once directly and twice by instances, under two textures of one image.
fn textured() -> Scene {
    let square = json!({ "positions": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "indices": [[0, 1, 2]] });
    let shown = |material: &str, side: &str| json!({ "shape": { "mesh": "square" }, "material": material, "side": side });
    let material = |name: &str, texture: &str| json!({ "name": name, "model": { "classic": { "colour": { "texture": { "name": texture } } } } });
    let mut scene: Scene = serde_json::from_value(json!({
        "format": 1,
        "images": [{ "name": "spare", "path": "a.png" }, { "name": "wood", "path": "b.png" }],
        "textures": [{ "name": "near", "image": "wood", "filter": "nearest" }, { "name": "soft", "image": "wood" }],
        "materials": [material("near", "near"), material("soft", "soft")],
        "meshes": [{ "name": "square", "source": { "inline": square } }],
        "objects": [shown("near", "outside"), shown("soft", "both"), shown("near", "both")],
    }))
    .unwrap_or_else(|e| panic!("{e}"));
    scene.images[1].data = Some(Arc::new(ImageData {
        width: 1,
        height: 1,
        pixels: PixelData::Codes(vec![[128; 4]]),
    }));
    scene
}

/// Protects: records of objects, materials, texture uses and lights are plain numbers without
/// pointers or lists; meshes and images are the scene's own buffers, each once in its table.
#[test]
fn prepared_is_flat() {
    fn plain<T: Copy>() {}
    plain::<ObjectRecord<f32>>();
    plain::<PreparedMaterial<f32>>();
    plain::<crate::texture::TextureBinding<f32>>();
    plain::<DeltaLight<f32>>();

    let scene = textured();
    let prepared =
        PreparedScene::<f32>::new(&scene, &Settings::from_scene(&scene), EffectSet::EMPTY, &())
            .expect("it can be prepared");
    let MeshSource::Inline(mesh) = &scene.meshes[0].source else {
        panic!("it has its arrays")
    };
    let image = scene.images[1].data.as_ref().expect("it has its pixels");
    assert!(prepared.meshes.len() == 1 && Arc::ptr_eq(&prepared.meshes[0], mesh));
    assert!(
        prepared.texture_tables.images.len() == 1
            && Arc::ptr_eq(&prepared.texture_tables.images[0], image)
    );
    // The scene and the table each hold a reference.
    assert_eq!((Arc::strong_count(mesh), Arc::strong_count(image)), (2, 2));
    assert!(
        prepared
            .objects
            .iter()
            .all(|object| object.mesh.is_some_and(|shown| shown.mesh == 0))
    );
}

/// Protects: settings without an integrator prepare the scene's default one, by every entry point.
#[test]
fn an_integrator_that_is_not_named_is_chosen() {
    let scene: Scene = serde_json::from_value(json!({
        "format": 1,
        "sky": { "constant": 1 },
        "materials": [{ "name": "m", "model": { "physical": { "clearcoat": {} } } }],
        "objects": [{ "shape": { "sphere": { "centre": [0, 0, 0], "radius": 1 } }, "material": "m" }],
    }))
    .unwrap_or_else(|e| panic!("{e}"));
    let samples_lights = |integrator| {
        let settings = Settings {
            integrator,
            ..Settings::from_scene(&scene)
        };
        let prepared = PreparedScene::<f32>::new(&scene, &settings, EffectSet::ALL, &())
            .expect("it can be prepared");
        prepared.lights.sky_sampler().is_some()
    };
    assert_eq!(
        [Integrator::Auto, Integrator::Path, Integrator::Whitted].map(samples_lights),
        [true, true, false]
    );
}

/// Protects: preparation too rejects a sky that needs a surface, instead of rendering black.
#[test]
fn a_sky_without_a_surface_is_refused() {
    let checker = json!({ "checker": { "even": 0, "odd": 1, "size": 1 } });
    for input in [checker, json!({ "texture": { "name": "soft" } })] {
        let sky = serde_json::from_value(json!({ "expression": input }))
            .unwrap_or_else(|e| panic!("{e}"));
        let scene = Scene {
            sky: Some(sky),
            ..textured()
        };
        let refused =
            PreparedScene::<f32>::new(&scene, &Settings::from_scene(&scene), EffectSet::ALL, &())
                .err();
        assert_eq!(
            refused,
            Some(PrepareError::NoSurface {
                path: "sky.expression".to_owned()
            })
        );
    }
}
