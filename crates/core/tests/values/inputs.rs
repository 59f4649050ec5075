//! Every input that may be an expression, and every switch: each alone, against the same scene
//! without it.

use std::sync::Arc;

use raywright_core::effects::{Effect, EffectSet, EffectStatus, assess_effects};
use raywright_core::ladder::{RungChoice, current_rungs};
use raywright_core::scene::{ImageData, PixelData, Scene};
use raywright_core::settings::{Aov, Settings};
use raywright_core::{estimate_scene_memory, prepare};
use serde_json::{Value, json};

use crate::support::{
    EyeAndTarget, ball, classic, expect_near, expect_pixel, floor, physical, pixel, render_scene,
    scene, settings, sun,
};

/// A view onto a floor at u = 0.25, v = 0.5, along (−0.6, −0.8, 0).
const ASIDE: EyeAndTarget = [[3.25, 4.0, 0.5], [0.25, 0.0, 0.5]];

/// A floor of this material under a sky and a slanting sun, with a texture that is red in its first
/// half.
fn lit(model: Value) -> Scene {
    let mut scene = floor(
        model,
        json!({ "sky": { "constant": [0.2, 0.4, 0.8] }, "lights": [sun([0.6, 0.8, 0.0])],
            "images": [{ "name": "halves", "path": "a" }],
            "textures": [{ "name": "halves", "image": "halves", "filter": "nearest", "colour_space": "linear" }] }),
    );
    let pixels = PixelData::Linear(vec![[1.0, 0.0, 0.0, 1.0], [0.0, 0.5, 1.0, 1.0]]);
    scene.images[0].data = Some(Arc::new(ImageData {
        width: 2,
        height: 1,
        pixels,
    }));
    scene
}

/// Protects: an expression of negative value counts as zero, as a surface colour and as a weight. A
/// texture coordinate keeps its sign, and so does a sky, with which shaders darken mirrors.
#[test]
fn what_a_hit_makes_negative_is_zero() {
    let emitted = |x: &str| lit(classic(json!({ "colour": 0, "emission": x })));
    expect_pixel(&emitted("[0 - u - 1, u, 0 - v]"), ASIDE, [0.0, 0.25, 0.0]);
    expect_pixel(
        &lit(classic(json!({ "colour": 1, "local": "0 - u" }))),
        ASIDE,
        [0.0; 3],
    );
    expect_pixel(
        &lit(classic(
            json!({ "colour": 0, "reflection": { "weight": "0 - u", "tinted": false } }),
        )),
        ASIDE,
        [0.0; 3],
    );
    expect_pixel(
        &lit(physical(json!({ "base_colour": "0 - u", "ior": 1 }))),
        ASIDE,
        [0.0; 3],
    );
    expect_pixel(
        &scene(json!({ "sky": { "expression": "d" } })),
        [[0.0; 3], [-0.6, 0.8, 0.0]],
        [-0.6, 0.8, 0.0],
    );
    let texture = |at: &str| json!({ "texture": { "name": "halves", "uv": [at, 0.5] } });
    expect_pixel(
        &lit(classic(
            json!({ "colour": 0, "emission": texture("0 - u") }),
        )),
        ASIDE,
        [0.0, 0.5, 1.0],
    );
}

/// Protects: a material that reads the surface's coordinates in a single input gets them, whichever
/// input it is, with their values at the point; and the input is reported as a procedural texture.
#[test]
fn every_input_may_read_the_coordinates() {
    let specular = |strength: Value| json!({ "diffuse": 0, "specular": { "model": "phong", "exponent": 1, "strength": strength } });
    let rim = |strength: Value| json!({ "rim": { "strength": strength, "exponent": 1 } });
    let mirror = |weight: Value| json!({ "reflection": { "weight": weight } });
    let texture =
        |at: Value| json!({ "colour": { "texture": { "name": "halves", "uv": [at, 0.5] } } });
    let inputs: [(&str, &dyn Fn(Value) -> Value); 15] = [
        ("colour", &|x| classic(json!({ "colour": x }))),
        ("uv of a colour", &|x| classic(texture(x))),
        ("local", &|x| classic(json!({ "local": x }))),
        ("diffuse", &|x| classic(json!({ "diffuse": x }))),
        ("shadow", &|x| classic(json!({ "shadow": x }))),
        ("specular", &|x| classic(specular(x))),
        ("rim", &|x| classic(rim(x))),
        ("reflection", &|x| classic(mirror(x))),
        ("emission", &|x| classic(json!({ "emission": x }))),
        ("base colour", &|x| physical(json!({ "base_colour": x }))),
        ("metallic", &|x| {
            physical(json!({ "metallic": x, "roughness": 0.5 }))
        }),
        ("roughness", &|x| physical(json!({ "roughness": x }))),
        ("opacity", &|x| {
            physical(json!({ "opacity": x, "alpha": "blend" }))
        }),
        ("emission of a physical one", &|x| {
            physical(json!({ "emission": x }))
        }),
        ("uv of a base colour", &|x| {
            physical(json!({ "base_colour": texture(x)["colour"] }))
        }),
    ];
    for (name, model) in inputs {
        for (text, number) in [("1 - u", 0.75), ("v / 2", 0.25)] {
            let (read, given) = (lit(model(json!(text))), lit(model(json!(number))));
            let [found, expected] =
                [&read, &given].map(|scene| pixel(scene, &settings(scene, ASIDE)));
            expect_near(found, expected, 1e-6, &format!("{name} {text}"));
            let other = lit(model(json!(1.0 - number)));
            assert_ne!(
                pixel(&other, &settings(&other, ASIDE)),
                expected,
                "{name} does not matter here"
            );
            let told = assess_effects(&read, &Settings::from_scene(&read))
                .status(Effect::ProceduralTextures);
            // An expression in `uv` belongs to the use of an image.
            assert!(
                told == EffectStatus::Simulated || name.starts_with("uv"),
                "{name}: {told:?}"
            );
        }
    }
}

/// Protects: a mesh without coordinates uses the barycentric coordinates of its second and third
/// corner, also reversed.
#[test]
fn corners_weigh_where_a_mesh_has_no_coordinates() {
    let shown = |map: Value| {
        scene(
            json!({ "materials": [{ "name": "m", "model": classic(json!({ "colour": "[u, v, 0]", "ambient": 1 })) }],
            "meshes": [{ "name": "leaf", "source": { "inline": {
                "positions": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "indices": [[0, 1, 2]] } } }],
            "objects": [{ "shape": { "mesh": "leaf" }, "material": "m", "transform": map }] }),
        )
    };
    expect_pixel(
        &shown(json!([])),
        [[0.3, 0.2, 2.0], [0.3, 0.2, 0.0]],
        [0.3, 0.2, 0.0],
    );
    expect_pixel(
        &shown(json!([{ "scale": [-1, 1, 1] }])),
        [[-0.3, 0.2, 2.0], [-0.3, 0.2, 0.0]],
        [0.3, 0.2, 0.0],
    );
}

/// Protects: objects beyond a lamp do not occlude it, under either rule of ray origins.
#[test]
fn what_is_beyond_a_lamp_hides_nothing() {
    for spawn in [
        json!("error_bound"),
        json!({ "constant": { "offset": 0.001 } }),
    ] {
        for (height, expected) in [(1.0, 0.0), (4.0, 1.0)] {
            let lamp = json!({ "kind": { "point": { "position": [0, 2.5, 0], "falloff": "none" } }, "colour": 1 });
            let scene = floor(
                classic(json!({})),
                json!({ "lights": [lamp], "classic": { "spawn": spawn }, "materials": [{ "name": "m", "model": classic(json!({})) }],
                    "objects": [ball([0.0, height, 0.0], 0.5, "m")] }),
            );
            expect_pixel(&scene, [[3.0, 4.0, 0.0], [0.0; 3]], [expected; 3]);
        }
    }
}

/// Protects: the rays of pixel-centre layers are counted, one a pixel for all of them.
#[test]
fn rays_of_layers_are_counted() {
    let scene = floor(classic(json!({})), json!({}));
    let camera = |aovs: &[Aov]| {
        let settings = Settings {
            size: [4, 3],
            aovs: aovs.to_vec(),
            ..settings(&scene, ASIDE)
        };
        render_scene(&scene, &settings).counters.camera
    };
    assert_eq!(
        [
            camera(&[]),
            camera(&[Aov::Albedo]),
            camera(&[Aov::Depth]),
            camera(&[Aov::Depth, Aov::Object])
        ],
        [12, 12, 24, 24]
    );
}

/// Protects: images count once in memory, to the byte, whether a material, the sky or both read
/// them.
#[test]
fn images_count_once_in_memory() {
    for (sky, surface) in [(false, false), (true, false), (false, true), (true, true)] {
        let model = physical(if surface {
            json!({ "base_colour_texture": { "name": "halves" } })
        } else {
            json!({})
        });
        let mut scene = lit(model);
        if sky {
            scene.sky = serde_json::from_value(json!({ "map": { "image": "halves" } })).ok();
        }
        let settings = settings(&scene, ASIDE);
        let held = prepare(&scene, &settings, &())
            .unwrap_or_else(|e| panic!("{e}"))
            .memory()
            .textures;
        // A sky also keeps its texels packed, in four bytes each.
        let expected = if sky || surface { 2 * 16 } else { 0 } + if sky { 2 * 4 } else { 0 };
        assert_eq!(
            (held, estimate_scene_memory(&scene, &settings).textures),
            (expected, expected),
            "{sky} {surface}"
        );
    }
}

/// Protects: switching an effect off equals removing its cause from the scene: in listed and in
/// generated objects, in a material's own term and in shared rules, in each of its inputs.
#[test]
fn what_is_switched_off_is_gone() {
    let lamp = || json!({ "shape": { "disk": { "centre": [0, 9, 0], "normal": [0, -1, 0], "radius": 0.01 } }, "material": "lamp" });
    let materials = || {
        json!([{ "name": "lamp", "model": classic(json!({ "local": 0, "emission": 90000 })) },
            { "name": "m", "model": classic(json!({})) }])
    };
    let hidden = |casts: bool, generated: bool| {
        let mut caster = ball([0.0, 4.0, 0.0], 1.0, "m");
        caster["casts_shadow"] = json!(casts);
        let made = json!({ "kind": { "grid": { "counts": [1, 1, 1], "origin": [0, 0, 0], "step": [0, 0, 0] } }, "object": caster });
        let (objects, generators) = if generated {
            (json!([lamp()]), json!([made]))
        } else {
            (json!([lamp(), caster]), json!([]))
        };
        floor(
            classic(json!({})),
            json!({ "materials": materials(), "objects": objects, "generators": generators }),
        )
    };
    let checker =
        |even: f64, odd: f64| json!({ "checker": { "even": even, "odd": odd, "size": 100 } });
    let glow = |emission: Value| {
        floor(
            classic(json!({ "local": 0, "emission": emission })),
            json!({}),
        )
    };
    let grey = |own: Value, shared: f64| {
        floor(
            classic(json!({ "ambient": own })),
            json!({ "classic": { "ambient": shared } }),
        )
    };
    let shiny = |specular: bool| {
        let mut light = sun([-0.6, 0.8, 0.0]);
        light["specular"] = json!(specular);
        floor(
            physical(json!({ "metallic": 1, "roughness": 0.5 })),
            json!({ "lights": [light] }),
        )
    };
    for (effect, with, without) in [
        (Effect::Highlights, shiny(true), shiny(false)),
        (Effect::Shadows, hidden(true, false), hidden(false, false)),
        (Effect::Shadows, hidden(true, true), hidden(false, true)),
        (
            Effect::AmbientLight,
            grey(json!(0.5), 0.0),
            grey(json!(0), 0.0),
        ),
        (
            Effect::AmbientLight,
            grey(Value::Null, 0.5),
            grey(json!(0), 0.0),
        ),
        (
            Effect::Checkerboard,
            glow(checker(0.25, 0.75)),
            glow(json!(0.5)),
        ),
        (Effect::Emission, glow(json!(0.5)), glow(json!(0))),
    ] {
        let view = [[3.0, 4.0, 0.0], [0.0; 3]];
        let off = EffectSet::from_effects(&[effect]);
        let [as_it_is, switched, by_hand] = [
            (&with, EffectSet::EMPTY),
            (&with, off),
            (&without, EffectSet::EMPTY),
        ]
        .map(|(scene, without)| {
            pixel(
                scene,
                &Settings {
                    without,
                    ..settings(scene, view)
                },
            )
        });
        assert_ne!(as_it_is, switched, "{effect:?} does not matter here");
        expect_near(switched, by_hand, 1e-6, &format!("{effect:?}"));
    }
}

/// Protects: a ladder is reported where it matters, also to an effect that is left out, and nowhere
/// else; a tree keeps its given quality when a tree is requested.
#[test]
fn ladders_are_reported_where_they_matter() {
    let told = |model: Value, max_depth: u32| -> Vec<&'static str> {
        let scene = floor(model, json!({}));
        let settings = Settings {
            max_depth,
            ..Settings::from_scene(&scene)
        };
        current_rungs(&scene, &settings, &assess_effects(&scene, &settings))
            .iter()
            .map(|current_rung| current_rung.ladder)
            .collect()
    };
    let always = [
        "samples",
        "reconstruction",
        "precision",
        "pixel-filter",
        "sampler",
        "output",
        "build",
        "accelerator",
    ];
    assert_eq!(told(classic(json!({})), 8), always);
    let mirror = || classic(json!({ "reflection": { "weight": 1 } }));
    let (first, last) = always.split_at(2);
    let further = [
        first,
        &["path-length", "precision", "ray-offset"],
        &last[1..],
    ]
    .concat();
    assert_eq!(
        (told(mirror(), 8), told(mirror(), 1)),
        (further.clone(), further)
    );

    let (mut scene, mut settings) = (Scene::default(), Settings::from_scene(&Scene::default()));
    for text in ["build=high", "accelerator=bvh"] {
        RungChoice::parse(text)
            .unwrap_or_else(|e| panic!("{e}"))
            .apply(&mut scene, &mut settings);
    }
    let standings = current_rungs(&scene, &settings, &assess_effects(&scene, &settings));
    let build = standings
        .iter()
        .find(|current_rung| current_rung.ladder == "build")
        .map(|current_rung| current_rung.rung.as_str());
    assert_eq!(build, Some("high"));
}
