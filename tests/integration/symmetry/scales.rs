//! Scale invariance: with every length times a power of two, which is exact in floating point, a
//! picture keeps its bits. An absolute length in the renderer (a padding, a least distance, a
//! tolerance) or an overflow breaks this.

use raywright::core::picture::Picture;
use raywright::core::settings::{Aov, PrecisionChoice};
use raywright::core::{Scene, Settings, prepare};
use raywright::io::{Input, LoadOptions, ParameterOverrides, load};

use crate::support::Sandbox;

const SCENE: &str = include_str!("scales.scene.toml");

/// The scene with lengths times 2ᵏ.
fn scaled(sandbox: &Sandbox, k: i32) -> Scene {
    let overrides = ParameterOverrides {
        time: None,
        set: vec![("s".to_owned(), 2.0_f64.powi(k))],
    };
    let options = LoadOptions {
        overrides,
        ..LoadOptions::default()
    };
    load(&Input::Path(sandbox.path("scales.scene.toml")), &options)
        .unwrap_or_else(|e| panic!("2^{k}: {e}"))
        .scene
}

fn picture(scene: &Scene, precision: PrecisionChoice) -> Picture {
    let aovs = vec![Aov::Normal, Aov::Object, Aov::Depth];
    let settings = Settings {
        precision,
        aovs,
        ..Settings::from_scene(scene)
    };
    prepare(scene, &settings, &())
        .unwrap_or_else(|e| panic!("{e}"))
        .render(&())
        .picture
}

/// Number of pixels that differ in a bit, of colour or layers, with depths in units of the scale.
fn different(a: &Picture, b: &Picture, unit: f32) -> usize {
    let layer = |i: usize, at: usize| {
        let (x, y) = (&a.layers[i], &b.layers[i]);
        // −1 without a hit.
        let factor = if x.name == "depth.Z" && x.samples[at] > 0.0 {
            unit
        } else {
            1.0
        };
        (x.samples[at] * factor).to_bits() == y.samples[at].to_bits()
    };
    let same = |at: usize| {
        a.rgb[at].map(f32::to_bits) == b.rgb[at].map(f32::to_bits)
            && (0..a.layers.len()).all(|i| layer(i, at))
    };
    (0..a.rgb.len()).filter(|&at| !same(at)).count()
}

fn hold(precision: PrecisionChoice) {
    let sandbox = Sandbox::new();
    sandbox.write("scales.scene.toml", SCENE);
    let first = picture(&scaled(&sandbox, 0), precision);
    assert!(
        first.rgb.iter().flatten().all(|x| x.is_finite()),
        "{precision:?}: the picture has numbers that are none"
    );
    let failures: Vec<String> = [-30, -20, -10, -3, -1, 1, 2, 5, 10, 20, 30]
        .into_iter()
        .map(|k| {
            (
                k,
                different(
                    &first,
                    &picture(&scaled(&sandbox, k), precision),
                    2.0_f32.powi(k),
                ),
            )
        })
        .filter(|(_, count)| *count > 0)
        .map(|(k, count)| format!("2^{k}: {count}"))
        .collect();
    assert!(
        failures.is_empty(),
        "{precision:?}: of {} pixels differ with lengths times {}",
        first.rgb.len(),
        failures.join(", ")
    );
}

/// Protects: the renderer has no absolute length and no overflow, from a thousandth of a micrometre
/// to a million kilometres, with storage in f32.
#[test]
fn pictures_have_no_unit_in_single_precision() {
    hold(PrecisionChoice::Robust);
}

/// Protects: the same with storage in f64.
#[test]
fn pictures_have_no_unit_in_the_reference_precision() {
    hold(PrecisionChoice::Reference);
}
