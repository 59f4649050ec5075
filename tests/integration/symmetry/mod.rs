//! Symmetries: a picture depends on the scene and not on its description: its unit, position, axes,
//! order of objects and triangles, division and sharing of meshes. `cargo bench --bench symmetry`
//! tries as many scenes as the time allows; this test tries a few of them.

mod retold;
mod scales;
mod twins;
mod worlds;

use raywright::core::settings::PrecisionChoice;
use raywright::io::{Input, LoadOptions, load, presets};

use crate::support::shared;
use twins::{Symmetry, of_scene, of_world};

const PRECISIONS: [PrecisionChoice; 2] = [PrecisionChoice::Robust, PrecisionChoice::Reference];

/// Protects: random scenes of every shape, material and light, from a millionth to a thousand
/// million metres, give the same picture for every description: to the bit where the arithmetic is
/// exact, and up to a fiftieth of the pixels for exchanged axes.
#[test]
fn random_scenes_are_symmetric() {
    let seeds = 0..6;
    let all = Symmetry::ALL
        .into_iter()
        .flat_map(|symmetry| PRECISIONS.map(|precision| (symmetry, precision)));
    let failures: Vec<_> = all
        .flat_map(|(symmetry, precision)| {
            seeds
                .clone()
                .map(move |seed| of_world(symmetry, seed, precision))
        })
        .filter(|apart| !apart.holds)
        .map(|apart| format!("{apart}\n"))
        .collect();
    assert!(
        failures.is_empty(),
        "{} twins are apart:\n{}",
        failures.len(),
        failures.concat()
    );
}

/// Protects: presets and models keep their bits with permuted objects and triangles, and with
/// divided and copied meshes.
#[test]
fn presets_and_models_are_symmetric() {
    let carried = presets::list().into_iter().map(|preset| {
        (
            preset.name.to_owned(),
            Input::Preset(preset.name.to_owned()),
        )
    });
    let files = [
        "gltf/crafted/cornell/cornell.gltf",
        "gltf/crafted/nested_transforms.glb",
        "obj/crafted/glass_and_mirror.obj",
    ];
    let folder = shared("assets");
    let models = folder
        .iter()
        .flat_map(|folder| files.map(|file| (file.to_owned(), Input::Path(folder.join(file)))));
    for (name, input) in carried.chain(models) {
        let scene = load(&input, &LoadOptions::default())
            .unwrap_or_else(|e| panic!("{name}: {e}"))
            .scene;
        for symmetry in Symmetry::OF_ANY {
            let apart = of_scene(&name, &scene, symmetry, 1, PrecisionChoice::Robust);
            assert!(apart.holds, "{apart}");
        }
    }
}
