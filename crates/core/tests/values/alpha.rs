//! Partly transparent surfaces in camera rays; `shadows` tests them in shadow rays.

use raywright_core::fault::FaultKind;
use raywright_core::scene::{ImageData, Integrator, Pinhole, PixelData, Projection, SamplePattern};
use raywright_core::settings::{Background, Sampling};
use raywright_core::{Scene, Settings};
use serde_json::{Value, json};

use crate::paths::{mean_radiance, paths};
use crate::support::{
    DOWN, PRECISIONS, SLANTED, expect_near, expect_pixel, floor, physical, pixel, render_scene,
    settings,
};

/// `count` disks of an unlit material, from height 1 downwards, above an unlit blue floor.
fn above_blue(terms: Value, count: usize) -> Scene {
    let mut pane = json!({ "base_colour": [1, 0.5, 0], "unlit": true });
    pane.as_object_mut()
        .expect("a table")
        .extend(terms.as_object().expect("a table").clone());
    let disk = |i: usize| json!({ "shape": { "disk": { "centre": [0, 1.0 - 0.1 * i as f64, 0], "normal": [0, 1, 0], "radius": 0.5 } }, "material": "pane" });
    let disks: Vec<Value> = (0..count).map(disk).collect();
    floor(
        physical(json!({ "base_colour": [0, 0, 1], "unlit": true })),
        json!({ "materials": [{ "name": "pane", "model": physical(pane) }], "objects": disks }),
    )
}

const BLEND: &str = "blend";

/// Protects: alpha · surface + (1 − alpha) · background, one pane after the other; opaque materials
/// ignore alpha.
#[test]
fn panes_cover_by_their_alpha() {
    expect_pixel(
        &above_blue(json!({ "opacity": 0.25, "alpha": BLEND }), 1),
        DOWN,
        [0.25, 0.125, 0.75],
    );
    expect_pixel(
        &above_blue(json!({ "opacity": 0.25, "alpha": BLEND }), 2),
        DOWN,
        [0.4375, 0.21875, 0.5625],
    );
    expect_pixel(
        &above_blue(json!({ "opacity": "abs(d.y) / 4", "alpha": BLEND }), 1),
        DOWN,
        [0.25, 0.125, 0.75],
    );
    expect_pixel(
        &above_blue(json!({ "opacity": 0.25 }), 1),
        DOWN,
        [1.0, 0.5, 0.0],
    );
    expect_pixel(
        &above_blue(json!({ "opacity": 0, "alpha": BLEND }), 1),
        DOWN,
        [0.0, 0.0, 1.0],
    );
    expect_pixel(
        &above_blue(json!({ "opacity": 1, "alpha": BLEND }), 1),
        DOWN,
        [1.0, 0.5, 0.0],
    );
}

/// Protects: through a partly transparent pane a camera ray sees the chosen background, and a
/// mirrored ray the sky; in path tracing, where alpha is stochastic, each sample sees either pane
/// or background.
#[test]
fn the_background_is_seen_through_panes() {
    let mut scene = above_blue(json!({ "opacity": 0.25, "alpha": BLEND }), 2);
    scene.objects.remove(0);
    scene.sky = serde_json::from_value(json!({ "constant": [9, 9, 9] })).expect("a sky");
    let settings = Settings {
        background: Background::Transparent,
        ..settings(&scene, DOWN)
    };
    let before_blue = |settings: &Settings| {
        render_scene(&scene, settings)
            .picture
            .composite_over([0.0, 0.0, 1.0])
            .rgb[0]
            .map(f64::from)
    };
    expect_near(
        before_blue(&settings),
        [0.4375, 0.21875, 0.5625],
        1e-6,
        "behind panes",
    );
    let paths = Settings {
        integrator: Integrator::Path,
        ..settings
    };
    let actual = before_blue(&paths);
    assert!(
        actual == [1.0, 0.5, 0.0] || actual == [0.0, 0.0, 1.0],
        "{actual:?}"
    );
}

/// Protects: a mask is absent below its cutoff, and present at it.
#[test]
fn masks_are_there_or_not() {
    let mask = |opacity: f64| {
        above_blue(
            json!({ "opacity": opacity, "alpha": { "mask": { "cutoff": 0.5 } } }),
            1,
        )
    };
    expect_pixel(&mask(0.5), DOWN, [1.0, 0.5, 0.0]);
    expect_pixel(&mask(0.49), DOWN, [0.0, 0.0, 1.0]);
}

/// Protects: a mask with its alpha at the cutoff is present at every point, from every source of
/// alpha and in every precision: equal alphas at corners or texels are not lost in interpolation.
/// At a cutoff above one nothing is present.
#[test]
fn masks_at_their_cutoff_are_whole() {
    let share = |cutoff: f64, alphas: [f64; 3], textured: bool| {
        let colours: Vec<[f64; 4]> = alphas.iter().map(|&alpha| [1.0, 1.0, 1.0, alpha]).collect();
        let texture = if textured {
            json!({ "name": "even" })
        } else {
            Value::Null
        };
        let data = json!({ "positions": [[-9, -7, 0], [11, -8, 0], [0.7, 13, 0]], "indices": [[0, 1, 2]], "colours": colours,
            "uvs": [[[0, 0], [7.3, 0.1], [0.4, 5.7]]] });
        let model = json!({ "unlit": true, "vertex_colours": !textured, "alpha": { "mask": { "cutoff": cutoff } }, "base_colour_texture": texture });
        let mut scene = crate::support::scene(
            json!({ "meshes": [{ "name": "leaf", "source": { "inline": data } }],
            "images": [{ "name": "even", "path": "even.png" }], "textures": [{ "name": "even", "image": "even" }],
            "objects": [{ "shape": { "mesh": "leaf" }, "material": "leaf" }], "materials": [{ "name": "leaf", "model": physical(model) }] }),
        );
        let code = [255, 255, 255, (alphas[0] * 255.0).round() as u8];
        let image = ImageData {
            width: 3,
            height: 2,
            pixels: PixelData::Codes(vec![code; 6]),
        };
        scene.images[0].data = Some(std::sync::Arc::new(image));
        PRECISIONS.map(|(precision, _)| {
            let view = settings(&scene, [[0.0, 0.0, 9.0], [0.0; 3]]);
            let seen = render_scene(
                &scene,
                &Settings {
                    precision,
                    size: [48, 48],
                    ..view
                },
            )
            .picture
            .rgb;
            seen.iter().filter(|pixel| pixel[0] > 0.5).count() as f64 / seen.len() as f64
        })
    };
    for cutoff in [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0] {
        assert_eq!(
            share(cutoff, [cutoff; 3], false),
            [1.0; 2],
            "corners at {cutoff}"
        );
        assert_eq!(
            share(cutoff, [cutoff, 1.0, cutoff], false),
            [1.0; 2],
            "corners from {cutoff} on"
        );
    }
    for code in [1, 51, 77, 102, 128, 200, 255] {
        let cutoff = f64::from(code) / 255.0;
        assert_eq!(
            share(cutoff, [cutoff; 3], true),
            [1.0; 2],
            "texels at {cutoff}"
        );
    }
    for cutoff in [1.0 + 1e-6, 1.5, 2.0, 1e30] {
        assert_eq!(
            share(cutoff, [1.0; 3], false),
            [0.0; 2],
            "corners below {cutoff}"
        );
        assert_eq!(
            share(cutoff, [1.0; 3], true),
            [0.0; 2],
            "texels below {cutoff}"
        );
    }
}

/// Asserts the share `left` of the blue floor behind each of several numbers of layers, for both
/// integrators with one segment.
#[track_caller]
fn leave_of_blue(layers: impl Fn(usize) -> Scene, left: f64) {
    for count in [0, 1, 10, 100, 1000] {
        let (scene, expected) = (layers(count), [0.0, 0.0, left.powi(count as i32)]);
        for (precision, tolerance) in crate::support::PRECISIONS {
            let found = pixel(
                &scene,
                &Settings {
                    precision,
                    max_depth: 1,
                    ..settings(&scene, DOWN)
                },
            );
            expect_near(
                found,
                expected,
                1e-3 * expected[2] + tolerance,
                &format!("{count} layers, {precision:?}"),
            );
            let ([.., found], [.., error]) = mean_radiance(
                &scene,
                &Settings {
                    precision,
                    size: [4, 4],
                    ..paths(&scene, DOWN, 1)
                },
            );
            assert!(
                (found - expected[2]).abs() <= 4.0 * error + 1e-4,
                "{count} layers, {precision:?}: {found}, not {expected:?}"
            );
        }
    }
}

/// Protects: surfaces that a ray passes unchanged take no segment, in any number, with either
/// integrator: blended surfaces, stacked or nested, absent parts of a mask, and index-matched
/// boundaries with their tint.
#[test]
fn what_is_passed_costs_no_segment() {
    let stack = |terms: Value| {
        move |count: usize| {
            let mut scene = above_blue(terms.clone(), 0);
            let kind = json!({ "grid": { "counts": [1, count, 1], "origin": [0, 0.001, 0], "step": [0, 0.001, 0] } });
            let object = json!({ "shape": { "disk": { "centre": [0, 0, 0], "normal": [0, 1, 0], "radius": 0.5 } }, "material": "pane" });
            if count > 0 {
                scene.generators.push(
                    serde_json::from_value(json!({ "kind": kind, "object": object }))
                        .expect("a generator"),
                );
            }
            scene
        }
    };
    leave_of_blue(
        stack(json!({ "base_colour": 0, "opacity": 0.05, "alpha": BLEND })),
        0.95,
    );
    leave_of_blue(
        stack(json!({ "opacity": 0.25, "alpha": { "mask": { "cutoff": 0.5 } } })),
        1.0,
    );
    let clear = json!({ "base_colour": [1, 1, 0.97], "unlit": false, "transmission": 1, "roughness": 0, "ior": 1 });
    leave_of_blue(stack(clear), 0.97);
    leave_of_blue(
        |count| {
            let mut scene = above_blue(
                json!({ "base_colour": 0, "opacity": 0.05, "alpha": BLEND }),
                0,
            );
            let shell = |i: usize| {
                crate::support::ball([0.0, 1.0, 0.0], 0.9 - 0.8 * i as f64 / count as f64, "pane")
            };
            scene
                .objects
                .extend((0..count).map(|i| serde_json::from_value(shell(i)).expect("an object")));
            scene
        },
        0.95 * 0.95,
    );
}

/// Protects: a shadow ray passes any number of blended surfaces with few segments, also if a thin
/// wall elsewhere in the scene makes shadow rays visit surfaces in order.
#[test]
fn shadow_rays_pass_more_panes_than_segments() {
    let pane = json!({ "base_colour": 0, "opacity": 0.05, "alpha": BLEND });
    let wall = json!({ "transmission": 1, "roughness": 0, "thin_walled": true });
    let disk = |centre: [f64; 3], material: &str| json!({ "shape": { "disk": { "centre": centre, "normal": [0, 1, 0], "radius": 9 } }, "material": material });
    let lit = |count: usize| {
        let panes = (0..count).map(|i| disk([0.0, 20.0 + i as f64, 0.0], "pane"));
        let scene = floor(
            crate::support::classic(json!({ "local": 1 })),
            json!({ "materials": [{ "name": "pane", "model": physical(pane.clone()) }, { "name": "wall", "model": physical(wall.clone()) }],
                "objects": panes.chain([disk([100.0, 1.0, 0.0], "wall")]).collect::<Vec<_>>(), "lights": [crate::support::sun([0.0, 1.0, 0.0])] }),
        );
        mean_radiance(&scene, &paths(&scene, SLANTED, 2)).0[0]
    };
    let (bare, covered) = (lit(0), lit(12));
    assert!(
        bare > 0.01 && (covered / bare - 0.95_f64.powi(12)).abs() < 1e-5,
        "{covered} of {bare}"
    );
}

/// Protects: panes before a mirror and panes in its reflection take none of its segments.
#[test]
fn panes_take_no_segment_from_mirrors() {
    let pane = json!({ "base_colour": 0, "unlit": true, "opacity": 0.1, "alpha": BLEND });
    let disk = |y: f64| json!({ "shape": { "disk": { "centre": [0, y, 0], "normal": [0, 1, 0], "radius": 9 } }, "material": "pane" });
    let scene = floor(
        crate::support::classic(json!({ "local": 0, "reflection": { "weight": 1 } })),
        json!({ "materials": [{ "name": "pane", "model": physical(pane) }], "sky": { "constant": 1 },
            "objects": (1..=12).map(|i| disk(0.1 * f64::from(i))).collect::<Vec<_>>() }),
    );
    let expected = 0.9_f64.powi(24);
    expect_near(
        pixel(
            &scene,
            &Settings {
                max_depth: 2,
                ..settings(&scene, SLANTED)
            },
        ),
        [expected; 3],
        1e-5,
        "Whitted",
    );
    let (found, error) = mean_radiance(&scene, &paths(&scene, SLANTED, 2));
    assert!(
        (found[0] - expected).abs() <= 4.0 * error[0],
        "{found:?} +- {error:?}, not {expected}"
    );
}

/// Protects: behind absent surfaces the camera still sees its background.
#[test]
fn the_background_shows_through_what_is_absent() {
    let mut scene = above_blue(
        json!({ "opacity": 0.25, "alpha": { "mask": { "cutoff": 0.5 } } }),
        1,
    );
    scene.objects.remove(0);
    let settings = Settings {
        background: Background::Transparent,
        ..settings(&scene, DOWN)
    };
    assert_eq!(
        render_scene(&scene, &settings).picture.alpha,
        Some(vec![0.0])
    );
}

/// Protects: under a transparent background a pixel's alpha is that of its panes, with their colour
/// in that share; it is one where an opaque surface lies behind them or reflects the ray. Surfaces
/// seen only in a mirror add no alpha.
#[test]
fn panes_over_nothing_cover_their_share() {
    let pane = |opacity: f64, count: usize| {
        above_blue(json!({ "opacity": opacity, "alpha": BLEND }), count)
    };
    let over_nothing = |mut scene: Scene| {
        scene.objects.remove(0);
        scene
    };
    let two = {
        let mut scene = over_nothing(pane(0.25, 2));
        let mut other = scene.materials[1].clone();
        other.name = "other".to_owned();
        let raywright_core::scene::MaterialModel::Physical(model) = &mut other.model else {
            panic!("a physical material")
        };
        model.opacity = 0.5.into();
        scene.objects[1].material = other.name.clone();
        scene.materials.push(other);
        scene
    };
    let mirror = above_blue(
        json!({ "opacity": 0.25, "alpha": BLEND, "unlit": false, "metallic": 1, "roughness": 0 }),
        1,
    );
    let under_a_ceiling = {
        let mut scene = over_nothing(mirror.clone());
        let ceiling = json!({ "shape": { "plane": { "point": [0, 9, 0], "normal": [0, -1, 0] } }, "material": scene.materials[0].name });
        scene
            .objects
            .push(serde_json::from_value(ceiling).expect("an object"));
        scene
    };
    for (name, scene, colour, alpha) in [
        (
            "one",
            over_nothing(pane(0.25, 1)),
            Some([0.25, 0.125, 0.0]),
            0.25,
        ),
        ("two", two, Some([0.625, 0.3125, 0.0]), 0.625),
        (
            "a third",
            over_nothing(pane(1.0 / 3.0, 1)),
            Some([1.0 / 3.0, 1.0 / 6.0, 0.0]),
            1.0 / 3.0,
        ),
        (
            "before a floor",
            pane(0.25, 2),
            Some([0.4375, 0.21875, 0.5625]),
            1.0,
        ),
        (
            "whole",
            over_nothing(pane(1.0, 1)),
            Some([1.0, 0.5, 0.0]),
            1.0,
        ),
        ("absent", over_nothing(pane(0.0, 1)), Some([0.0; 3]), 0.0),
        ("a mirror", over_nothing(mirror.clone()), None, 0.25),
        ("a mirror of a ceiling", under_a_ceiling, None, 0.25),
    ] {
        for (precision, _) in crate::support::PRECISIONS {
            for sampling in [
                Sampling::Pattern(SamplePattern::Centre),
                Sampling::Pattern(SamplePattern::Corners),
                Sampling::General(20),
            ] {
                let settings = Settings {
                    precision,
                    sampling,
                    background: Background::Transparent,
                    ..settings(&scene, DOWN)
                };
                let picture = render_scene(
                    &scene,
                    &Settings {
                        camera: Some(narrow(&settings)),
                        ..settings
                    },
                )
                .picture;
                let label = format!("{name}, {precision:?}, {sampling:?}");
                let covered = picture.alpha.expect("an alpha")[0];
                assert!(
                    (f64::from(covered) - alpha).abs() < 1e-5,
                    "{label}: {covered} instead of {alpha}"
                );
                assert!(
                    alpha > 0.0 && alpha < 1.0 || f64::from(covered) == alpha,
                    "{label}: {covered}"
                );
                colour.iter().for_each(|&colour| {
                    expect_near(picture.rgb[0].map(f64::from), colour, 1e-5, &label)
                });
            }
        }
    }
}

/// The settings' camera with a narrow field of view, so that panes fill the picture.
fn narrow(settings: &Settings) -> raywright_core::scene::Camera {
    let mut camera = settings.camera.clone().expect("a camera");
    camera.projection = Projection::Pinhole(Pinhole {
        vertical_fov: Some(2.0),
        ..Pinhole::default()
    });
    camera
}

/// Protects: a ray passes thousands of absent surfaces in a row, with either integrator, and ends
/// beyond a limit, which is counted.
#[test]
fn rays_pass_some_thousand_absent_surfaces() {
    let mask = json!({ "opacity": 0.25, "alpha": { "mask": { "cutoff": 0.5 } } });
    let stack = |count: u32| {
        let mut scene = above_blue(mask.clone(), 0);
        let kind = json!({ "grid": { "counts": [1, count, 1], "origin": [0, 0.0001, 0], "step": [0, 0.0001, 0] } });
        let object = json!({ "shape": { "disk": { "centre": [0, 0, 0], "normal": [0, 1, 0], "radius": 0.5 } }, "material": "pane" });
        scene.generators.push(
            serde_json::from_value(json!({ "kind": kind, "object": object })).expect("a generator"),
        );
        scene
    };
    for integrator in [Integrator::Whitted, Integrator::Path] {
        for (count, blue, losses) in [
            (8192, 1.0, vec![]),
            (8193, 0.0, vec![(FaultKind::RaysCutShort, 1)]),
        ] {
            let scene = stack(count);
            let found = render_scene(
                &scene,
                &Settings {
                    integrator,
                    ..settings(&scene, DOWN)
                },
            );
            assert_eq!(
                (
                    found.picture.rgb[0],
                    found
                        .counters
                        .faults()
                        .map(|fault| (fault.kind, fault.count))
                        .collect()
                ),
                ([0.0, 0.0, blue], losses),
                "{integrator:?}, {count}"
            );
        }
    }
}

/// Protects: a mirrored or refracted ray shares its sample's limit of passed surfaces, in Whitted's
/// integrator.
#[test]
fn rays_of_a_sample_share_their_limit() {
    for (count, cut) in [(4096, 0), (4097, 1)] {
        let kind = json!({ "grid": { "counts": [1, count, 1], "origin": [0, 0.0001, 0], "step": [0, 0.0001, 0] } });
        let disk = json!({ "shape": { "disk": { "centre": [0, 0, 0], "normal": [0, 1, 0], "radius": 0.5 } }, "material": "pane" });
        let mask = physical(json!({ "opacity": 0.25, "alpha": { "mask": { "cutoff": 0.5 } } }));
        // The mirrored ray passes the stack once more.
        let scene = floor(
            physical(json!({ "transmission": 1, "roughness": 0, "ior": 1.5 })),
            json!({ "materials": [{ "name": "pane", "model": mask }], "generators": [{ "kind": kind, "object": disk }] }),
        );
        let counters = render_scene(&scene, &settings(&scene, DOWN)).counters;
        assert_eq!(counters.cut_short, cut, "{count}");
    }
}

/// Protects: behind index-matched boundaries a matte floor and a mirror keep all their segments; an
/// emissive boundary is visible.
#[test]
fn borders_of_equal_media_hide_nothing() {
    let clear = |emission: f64| {
        let model = json!({ "transmission": 1, "roughness": 0, "ior": 1, "base_colour": [1, 1, 0.9], "emission": emission });
        json!({ "name": "clear", "model": physical(model) })
    };
    let border = |t: f64| json!({ "shape": { "disk": { "centre": [3.0 * t, 4.0 * t, 0], "normal": [3, 4, 0], "radius": 0.05 } }, "material": "clear" });
    let lit = |model: &Value, borders: &[f64]| {
        let objects: Vec<Value> = borders.iter().copied().map(border).collect();
        let scene = floor(
            physical(model.clone()),
            json!({ "materials": [clear(0.0)], "objects": objects, "lights": [crate::support::sun([-3.0, 4.0, 0.0])], "sky": { "constant": 0.1 } }),
        );
        mean_radiance(&scene, &paths(&scene, SLANTED, 2))
    };
    let matte = json!({ "base_colour": 0.5, "roughness": 1, "specular": 0 });
    for model in [matte, json!({ "metallic": 1, "roughness": 0 })] {
        let (([bare, ..], [error, ..]), ([behind, ..], _)) =
            (lit(&model, &[]), lit(&model, &[0.2, 0.4, 0.6]));
        assert!(
            bare > 0.05 && (behind - bare).abs() <= 5.0 * error + 1e-3 * bare,
            "{model}: {behind}, not {bare}"
        );
    }
    let glowing = crate::support::scene(
        json!({ "materials": [clear(2.0)], "objects": [border(0.5)], "sky": { "constant": 0.5 } }),
    );
    let (found, error) = mean_radiance(&glowing, &paths(&glowing, SLANTED, 4));
    assert!(
        (found[0] - 2.5).abs() <= 4.0 * error[0] + 1e-3,
        "{found:?} +- {error:?}, not 2.5"
    );
}

/// Protects: layers and edges show what stands behind surfaces that alpha cuts out, under both
/// integrators. A surface of any alpha above zero has a depth and edges.
#[test]
fn layers_show_what_stands_behind_cut_out_surfaces() {
    use raywright_core::settings::Aov;
    let aovs = [
        Aov::Albedo,
        Aov::Normal,
        Aov::Position,
        Aov::Depth,
        Aov::Object,
        Aov::Material,
        Aov::Edges,
    ];
    for integrator in [Integrator::Path, Integrator::Whitted] {
        let layers = |terms: Value, count| {
            let scene = above_blue(terms, count);
            let settings = Settings {
                integrator,
                aovs: aovs.to_vec(),
                sampling: Sampling::General(4),
                size: [16, 16],
                ..settings(&scene, SLANTED)
            };
            let layers = render_scene(&scene, &settings).picture.layers;
            layers.into_iter().map(|layer| (layer.name, layer.samples))
        };
        for terms in [
            json!({ "opacity": 0.25, "alpha": { "mask": { "cutoff": 0.5 } } }),
            json!({ "opacity": 0, "alpha": BLEND }),
        ] {
            for ((name, found), (_, floor)) in layers(terms, 2).zip(layers(json!({}), 0)) {
                let off = found.iter().zip(&floor).map(|(a, b)| (a - b).abs());
                let off = off.fold(0.0, f32::max);
                assert!(off < 1e-5, "{integrator:?}, {name}: {off}");
            }
        }
        let veil = json!({ "opacity": 0.25, "alpha": BLEND });
        let pairs = layers(veil, 1).zip(layers(json!({}), 0));
        let changed: Vec<_> = pairs
            .filter(|((_, found), (_, floor))| found != floor)
            .map(|((name, _), _)| name)
            .collect();
        for name in ["albedo.R", "depth", "object", "material", "edges"] {
            assert!(
                changed.iter().any(|changed| changed.starts_with(name)),
                "{integrator:?}: {name} not in {changed:?}"
            );
        }
    }
}
