//! From samples to pixels: patterns, weights, layers, coverage and errors, in pixels computed by
//! hand.

use raywright_core::bvh::{AcceleratorKind, BuildQuality};
use raywright_core::picture::Picture;
use raywright_core::scene::{SamplePattern, Scene};
use raywright_core::settings::{Aov, Background, Crop, Sampling, Settings};
use serde_json::{Value, json};

use crate::support::{EyeAndTarget, ball, floor, physical, render_scene, scene, settings};

/// An orthographic view along −z with pixels of edge 1, centred at (0, 0, 5).
fn flat(scene: &Scene, size: [u32; 2], sampling: Sampling) -> Settings {
    let mut settings = Settings {
        size,
        sampling,
        aovs: Aov::ALL.map(|(_, aov)| aov).to_vec(),
        ..settings(scene, [[0.0, 0.0, 5.0], [0.0; 3]])
    };
    if let Some(camera) = &mut settings.camera {
        camera.projection = raywright_core::scene::Projection::Orthographic {
            height: f64::from(size[1]),
        };
    }
    settings
}

const CENTRE: Sampling = Sampling::Pattern(SamplePattern::Centre);
const CORNERS: Sampling = Sampling::Pattern(SamplePattern::Corners);

fn layer(picture: &Picture, name: &str) -> Vec<f32> {
    picture
        .layer(name)
        .unwrap_or_else(|| panic!("no layer {name}"))
        .samples
        .clone()
}

fn sky(expression: &str) -> Scene {
    scene(json!({ "sky": { "expression": expression } }))
}

/// Protects: sample positions of patterns. Columns run to the right and rows down; `centre` is the
/// pixel's centre; `corners` are the pixel's four corners, each a quarter: the mean of x² over
/// corners half a pixel away is x² + ¼. A crop has the positions of the whole picture.
#[test]
fn patterns_have_their_places() {
    let scene = sky("[o.x, o.y, o.x*o.x]");
    let crop = Crop {
        x: 2,
        y: 1,
        width: 2,
        height: 1,
    };
    for (sampling, extra) in [(CENTRE, 0.0), (CORNERS, 0.25)] {
        let settings = flat(&scene, [4, 2], sampling);
        let picture = render_scene(&scene, &settings).picture;
        for (i, rgb) in picture.rgb.iter().enumerate() {
            let (x, y) = ((i % 4) as f32 - 1.5, 0.5 - (i / 4) as f32);
            assert_eq!(*rgb, [x, y, x * x + extra], "{i}");
        }
        let cropped = render_scene(
            &scene,
            &Settings {
                crop: Some(crop),
                ..settings
            },
        )
        .picture;
        assert_eq!((cropped.width, cropped.height), (2, 1));
        assert_eq!(cropped.rgb, picture.rgb[6..8]);
    }
}

/// Protects: the general sampler fills the pixel uniformly, by mean and mean square of the offset;
/// a crop has the same samples.
#[test]
fn samples_fill_the_pixel() {
    let scene = sky("[o.x, o.y, (o.x - 0.5)^2]");
    let settings = flat(&scene, [2, 1], Sampling::General(1024));
    let picture = render_scene(&scene, &settings).picture;
    for (found, expected) in picture.rgb[1].iter().zip([0.5, 0.0, 1.0 / 12.0]) {
        assert!((found - expected).abs() < 1e-3, "{:?}", picture.rgb[1]);
    }
    let crop = Some(Crop {
        x: 1,
        y: 0,
        width: 1,
        height: 1,
    });
    assert_eq!(
        render_scene(
            &scene,
            &Settings {
                crop,
                ..settings.clone()
            }
        )
        .picture
        .rgb[0],
        picture.rgb[1]
    );
    let seeded = |seed| {
        render_scene(
            &scene,
            &Settings {
                seed,
                sampling: Sampling::General(1),
                ..settings.clone()
            },
        )
        .picture
        .rgb[0]
    };
    assert!(seeded(0) != seeded(1) && seeded(0) != seeded(1 << 32));
}

/// Unlit orange for x < 0 at z = 1, of two objects and three materials.
fn half() -> Scene {
    let quad = json!({ "shape": { "quad": { "corner": [-9, -9, 1], "edge_u": [9, 0, 0], "edge_v": [0, 18, 0] } }, "material": "orange" });
    let material = |name: &str, base: Value| json!({ "name": name, "model": physical(json!({ "base_colour": base, "unlit": true })) });
    scene(
        json!({ "objects": [ball([50.0, 0.0, 0.0], 1.0, "grey"), quad], "sky": { "constant": 0.5 },
        "materials": [material("none", json!(0)), material("grey", json!(0.5)), material("orange", json!([1, 0.5, 0]))] }),
    )
}

/// Protects: every layer of a fully covered and of an uncovered pixel.
#[test]
fn layers_of_whole_pixels() {
    let scene = half();
    let picture = render_scene(&scene, &flat(&scene, [2, 1], CENTRE)).picture;
    for (name, expected) in [
        ("albedo.R", [1.0, 0.0]),
        ("albedo.G", [0.5, 0.0]),
        ("albedo.B", [0.0, 0.0]),
        ("emission.R", [1.0, 0.5]),
        ("emission.G", [0.5, 0.5]),
        ("emission.B", [0.0, 0.5]),
        ("normal.X", [0.0, 0.0]),
        ("normal.Y", [0.0, 0.0]),
        ("normal.Z", [1.0, 0.0]),
        ("position.X", [-0.5, 0.0]),
        ("position.Y", [0.0, 0.0]),
        ("position.Z", [1.0, 0.0]),
        ("depth.Z", [4.0, -1.0]),
        ("object.id", [1.0, -1.0]),
        ("material.id", [2.0, -1.0]),
        ("samples.N", [1.0, 1.0]),
        ("stderr.R", [0.0, 0.0]),
        ("stderr.B", [0.0, 0.0]),
    ] {
        assert_eq!(layer(&picture, name), expected, "{name}");
    }
    assert_eq!(picture.rgb, [[1.0, 0.5, 0.0], [0.5; 3]]);
    assert_eq!(picture.layers.len(), 20);
}

/// Protects: layers of a pixel with two hits in four samples: colours, albedo and normal are means
/// over all samples, the position over hits; the error of the mean of 1, 1, ½, ½ is √(1/48).
#[test]
fn layers_of_a_partly_covered_pixel() {
    let scene = half();
    // One pixel from −0.5 to 0.5: its left corners lie on the quad.
    let picture = render_scene(&scene, &flat(&scene, [1, 1], CORNERS)).picture;
    for (name, expected) in [
        ("albedo.R", 0.5),
        ("albedo.G", 0.25),
        ("normal.Z", 0.5),
        ("position.X", -0.5),
        ("position.Y", 0.0),
        ("position.Z", 1.0),
        ("samples.N", 4.0),
        ("stderr.R", 0.0),
        ("stderr.B", 0.0),
    ] {
        let found = layer(&picture, name)[0];
        assert!(
            (found - expected).abs() < 1e-6,
            "{name}: {found} instead of {expected}"
        );
    }
    assert_eq!(picture.rgb, [[0.75, 0.5, 0.25]]);
}

/// Protects: coverage is the share of samples with a hit, and colours are premultiplied by it.
#[test]
fn coverage_is_a_share() {
    let scene = half();
    let transparent = |sampling| Settings {
        background: Background::Transparent,
        ..flat(&scene, [1, 1], sampling)
    };
    let picture = render_scene(&scene, &transparent(CORNERS)).picture;
    assert_eq!(
        (picture.rgb[0], picture.alpha),
        ([0.5, 0.25, 0.0], Some(vec![0.5]))
    );
    let picture = render_scene(&scene, &transparent(Sampling::General(64))).picture;
    assert_eq!(
        (picture.rgb[0], picture.alpha),
        ([0.5, 0.25, 0.0], Some(vec![0.5]))
    );
}

/// Protects: layers follow the general sampler too, and the depth is a distance from the eye along
/// the ray.
#[test]
fn depth_is_along_the_ray() {
    let view: EyeAndTarget = [[3.0, 4.0, 0.0], [0.0; 3]];
    let scene = floor(physical(json!({})), json!({}));
    let settings = Settings {
        aovs: vec![Aov::Depth, Aov::Position],
        sampling: Sampling::General(2),
        ..settings(&scene, view)
    };
    let picture = render_scene(&scene, &settings).picture;
    assert!(
        (layer(&picture, "depth.Z")[0] - 5.0).abs() < 1e-6
            && layer(&picture, "position.Y")[0].abs() < 1e-6
    );
}

/// Protects: a NaN sample is left out of the mean and of the number of samples, and is counted
/// itself.
#[test]
fn samples_that_are_not_numbers_are_dropped() {
    let scene = sky("o.x < 0 ? sqrt(o.x) : 3");
    let rendered = render_scene(&scene, &flat(&scene, [1, 1], CORNERS));
    assert_eq!(
        (rendered.counters.samples, rendered.counters.dropped),
        (2, 2)
    );
    assert_eq!(
        (
            rendered.picture.rgb[0],
            layer(&rendered.picture, "samples.N")
        ),
        ([3.0; 3], vec![2.0])
    );
}

/// Protects: of two hits at the same distance, the first in the file's order is visible, with and
/// without a tree.
#[test]
fn the_first_of_equals_is_seen() {
    for kind in [
        AcceleratorKind::Linear,
        AcceleratorKind::Tree(BuildQuality::default()),
    ] {
        let mut scene = half();
        scene.objects.push(raywright_core::scene::Object {
            material: "grey".to_owned(),
            ..scene.objects[1].clone()
        });
        let at = |scene: &Scene| {
            layer(
                &render_scene(
                    scene,
                    &Settings {
                        accelerator: kind,
                        ..flat(scene, [2, 1], CENTRE)
                    },
                )
                .picture,
                "object.id",
            )[0]
        };
        assert_eq!(at(&scene), 1.0);
        scene.objects.swap(0, 2);
        assert_eq!(at(&scene), 0.0);
    }
}

/// Protects: a pixel is the filtered mean of its surroundings. For light that begins at an edge
/// between two columns, the pixels beside it show the filter's integral beyond their distance: all
/// or nothing for the box, 1/8 for the tent from half a pixel away, (Φ(3) − Φ(1)) / (2Φ(3) − 1) for
/// the bell, and (1 − x)/2 − Σ aₖ sin(kπx)/(kπ)/(2a₀) at a third of its radius for the window's
/// cosines.
#[test]
fn filters_cover_their_surroundings() {
    use core::f64::consts::PI;
    use raywright_core::filter::PixelFilter;
    let scene = sky("[step(0, o.x), step(0, o.y), 1]");
    let shown = |filter| {
        let all = Settings {
            filter,
            ..flat(&scene, [8, 4], Sampling::General(1024))
        };
        render_scene(&scene, &all).picture.rgb
    };
    let sine = |k: f64, a: f64| a * (k * PI / 3.0).sin() / (k * PI);
    let window = |a: f64| {
        1.0 / 3.0 - (sine(1.0, 0.48829) + sine(2.0, 0.14128) + sine(3.0, 0.01168)) / (2.0 * a)
    };
    let bell = (0.998_650_101_968_369_9 - 0.841_344_746_068_542_9) / 0.997_300_203_936_739_8;
    let expected = [
        (PixelFilter::Box, 0.0),
        (PixelFilter::Tent, 0.125),
        (PixelFilter::Gaussian, bell),
        (PixelFilter::BlackmanHarris, window(0.35875)),
    ];
    for (filter, share) in expected {
        let shown = shown(filter);
        let row: Vec<f64> = shown[8..16].iter().map(|rgb| f64::from(rgb[0])).collect();
        assert!(
            (row[3] - share).abs() < 0.01 && (row[4] - (1.0 - share)).abs() < 0.01,
            "{filter:?}: {row:?}, {share}"
        );
        assert_eq!((row[0], row[7]), (0.0, 1.0), "{filter:?}: {row:?}");
        // The same along a column, where y falls.
        let [above, below] = [shown[12], shown[20]].map(|rgb| f64::from(rgb[1]));
        assert!(
            (above - (1.0 - share)).abs() < 0.01 && (below - share).abs() < 0.01,
            "{filter:?}: {above}, {below}, {share}"
        );
    }
}

/// Protects: the layer of standard errors marks pixels as unknown if light was sampled without any
/// success, instead of zero; it is zero if no light exists.
#[test]
fn errors_of_light_that_was_not_found_are_unknown() {
    use raywright_core::scene::Integrator;
    let dark = crate::support::classic(json!({ "colour": 0.5 }));
    let lamp = crate::support::classic(json!({ "local": 0, "emission": 4 }));
    for (closed, error) in [(true, -1.0), (false, 0.0)] {
        let lit = if closed { "lamp" } else { "dark" };
        let scene = floor(
            dark.clone(),
            json!({ "materials": [{ "name": "lamp", "model": lamp }, { "name": "dark", "model": dark }],
                "objects": [ball([-3.0, 3.0, 0.0], 0.5, lit), ball([-3.0, 3.0, 0.0], 1.0, "dark")] }),
        );
        let view = settings(&scene, crate::support::DOWN);
        let paths = Settings {
            integrator: Integrator::Path,
            sampling: Sampling::General(64),
            aovs: vec![Aov::StandardError],
            ..view
        };
        let picture = render_scene(
            &scene,
            &Settings {
                size: [4, 4],
                ..paths
            },
        )
        .picture;
        assert_eq!(picture.rgb, [[0.0; 3]; 16]);
        for name in ["stderr.R", "stderr.G", "stderr.B"] {
            assert_eq!(layer(&picture, name), [error; 16], "{name}, {closed}");
        }
    }
}

/// Protects: a path that overflows in one channel alone makes its sample invalid, which is dropped
/// and counted, also if many paths are shaded together.
#[test]
fn paths_that_overflow_in_one_channel_are_dropped() {
    use raywright_core::scene::Integrator;
    use raywright_core::settings::PrecisionChoice;
    for channel in 0..3 {
        let mut colour = [0.5; 3];
        colour[channel] = 1e30;
        let bright = crate::support::physical(
            json!({ "base_colour": colour, "roughness": 1, "specular": 0 }),
        );
        let side = |y: f64, normal: f64| json!({ "shape": { "plane": { "point": [0, y, 0], "normal": [0, normal, 0] } }, "material": "bright" });
        let scene = scene(
            json!({ "materials": [{ "name": "bright", "model": bright }], "objects": [side(0.0, 1.0), side(9.0, -1.0)] }),
        );
        let down = settings(&scene, crate::support::DOWN);
        let (integrator, precision, size) = (Integrator::Path, PrecisionChoice::Robust, [16, 16]);
        let sampling = Sampling::General(4);
        let counters = render_scene(
            &scene,
            &Settings {
                integrator,
                precision,
                size,
                sampling,
                ..down
            },
        )
        .counters;
        assert!(
            counters.dropped > 512 && counters.samples + counters.dropped == 1024,
            "channel {channel}: {counters:?}"
        );
    }
}

/// Protects: a path that overflows makes its sample invalid, which is dropped and counted.
#[test]
fn paths_that_carry_no_number_are_dropped() {
    use raywright_core::scene::Integrator;
    use raywright_core::settings::PrecisionChoice;
    let bright = crate::support::classic(
        json!({ "local": 0, "transmission": { "ior": 1.5, "refracted_tint": 1e30 } }),
    );
    let pane = |y: f64| json!({ "shape": { "quad": { "corner": [-9, y, 9], "edge_u": [18, 0, 0], "edge_v": [0, 0, -18] } }, "material": "bright" });
    let scene = scene(
        json!({ "materials": [{ "name": "bright", "model": bright }], "objects": [pane(1.0), pane(0.5)] }),
    );
    let down = settings(&scene, crate::support::DOWN);
    let (integrator, precision) = (Integrator::Path, PrecisionChoice::Robust);
    let counters = render_scene(
        &scene,
        &Settings {
            integrator,
            precision,
            sampling: Sampling::General(16),
            ..down
        },
    )
    .counters;
    assert!(
        counters.dropped > 8 && counters.samples + counters.dropped == 16,
        "{counters:?}"
    );
}
