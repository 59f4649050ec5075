//! Large numbers of every kind of item in a scene: items are found by look-up, and no list is
//! scanned for each entry of another.

use raywright::core::effects::assess_effects;
use raywright::core::{Scene, Settings, prepare};
use raywright::io::{Input, LoadOptions, load};

use crate::support::Sandbox;

#[path = "../../benches/support/many.rs"]
mod files;

use files::FAMILIES;

/// Large enough that quadratic work takes minutes, and linear work a fraction of a second.
const MANY: usize = 100_000;

/// Protects: loading, validation, effect detection and preparation take linear time. No time is
/// measured: a list scanned for each entry would make this test practically endless.
#[test]
fn loading_is_linear_in_everything() {
    for (label, write) in FAMILIES {
        let sandbox = Sandbox::new();
        // Decoding an image takes longer than everything else.
        let n = if label.starts_with("images") {
            MANY / 10
        } else {
            MANY
        };
        let files = write(n);
        for (name, contents) in &files {
            sandbox.write(name, contents);
        }
        let loaded = load(
            &Input::Path(sandbox.path(files[0].0)),
            &LoadOptions::default(),
        )
        .unwrap_or_else(|e| panic!("{label}: {e}"));
        let scene = loaded.scene;
        let settings = Settings {
            size: [1, 1],
            ..Settings::from_scene(&scene)
        };
        let report = assess_effects(&scene, &settings);
        assert_eq!(
            report.effects.len(),
            assess_effects(&Scene::default(), &settings).effects.len(),
            "{label}"
        );
        let ready = prepare(&scene, &settings, &()).unwrap_or_else(|e| panic!("{label}: {e}"));
        let found = [
            ready.table_sizes().primitives,
            scene.lights.len(),
            scene.parameters.len(),
        ]
        .into_iter()
        .max();
        assert_eq!(found, Some(n), "{label}");
    }
}

/// Protects: many unknown names are refused in time, too. Each may be compared with every known
/// name, which is so much slower than a look-up that fewer names suffice here.
#[test]
fn a_flood_of_unknown_names_is_refused_in_time() {
    let files = FAMILIES[5].1(MANY / 5);
    let text = String::from_utf8(files[0].1.clone()).expect("it is text");
    let sandbox = Sandbox::new();
    sandbox.write(
        "many.scene.toml",
        text.replace("material = \"material", "material = \"unknown"),
    );
    let error = load(
        &Input::Path(sandbox.path("many.scene.toml")),
        &LoadOptions::default(),
    )
    .expect_err("no such materials");
    assert!(
        error.to_string().contains("unknown material `unknown 0`"),
        "{error}"
    );
    // Many unknown keys are another case.
    sandbox.write("many.scene.toml", text.replace("colour =", "color ="));
    let error = load(
        &Input::Path(sandbox.path("many.scene.toml")),
        &LoadOptions::default(),
    )
    .expect_err("no such keys");
    assert!(error.to_string().contains("unknown key `color`"), "{error}");
}
