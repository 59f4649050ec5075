//! Choice of scene, variant and time in a glTF file: transforms computed by hand from keys given
//! here.

use glam::DVec3;
use raywright_core::affine_from_steps;
use raywright_core::scene::{Colour, MaterialModel, MeshSource};
use raywright_io::{AnimationInfo, ErrorKind, LoadedScene};
use serde_json::{Value, json};

use crate::keyed::{KeyedTriangle, load_with};
use crate::shared::assets;

#[track_caller]
fn expect_near(found: DVec3, expected: [f64; 3]) {
    assert!(
        (found - DVec3::from(expected)).length() < 1e-6,
        "{found} instead of {expected:?}"
    );
}

/// Protects: translations and scales are linear between keys and constant outside, steps keep the
/// earlier key, and a node's children follow.
#[test]
fn keys_and_straight_lines() {
    let line = KeyedTriangle::new().animated(
        "",
        0,
        "translation",
        "LINEAR",
        &[0.0, 0.0, 5.0, 4.0, 8.0, 5.0],
    );
    for (time, place) in [
        (-2.0, [0.0, 0.0, 5.0]),
        (1.0, [0.0, 0.0, 5.0]),
        (1.5, [1.0, 2.0, 5.0]),
        (3.0, [4.0, 8.0, 5.0]),
        (9.0, [4.0, 8.0, 5.0]),
    ] {
        expect_near(line.transform_at(time).translation, place);
    }
    let step =
        KeyedTriangle::new().animated("", 1, "scale", "STEP", &[1.0, 1.0, 1.0, 2.0, 4.0, 8.0]);
    expect_near(step.transform_at(2.999).matrix3 * DVec3::ONE, [1.0; 3]);
    expect_near(step.transform_at(3.0).matrix3 * DVec3::ONE, [2.0, 4.0, 8.0]);
    expect_near(step.transform_at(3.0).translation, [0.0, 0.0, 5.0]);
}

/// Protects: an animated scale replaces the node's own, linear or by splines, and is applied before
/// its unchanged rotation and translation; a node without a channel keeps its own scale.
#[test]
fn scales_come_first() {
    let at_rest = |document: &mut Value| {
        let node = document["nodes"][1].as_object_mut().expect("a node");
        let s = std::f64::consts::FRAC_1_SQRT_2;
        // A quarter turn about z, which takes x to y.
        node.extend([
            ("scale".to_owned(), json!([7, 7, 7])),
            ("rotation".to_owned(), json!([0, 0, s, s])),
        ]);
    };
    let line = KeyedTriangle::new()
        .animated("", 1, "scale", "LINEAR", &[1.0, 1.0, 1.0, 3.0, 5.0, 9.0])
        .with(at_rest);
    let found = line.transform_at(1.5);
    expect_near(found.matrix3 * DVec3::X, [0.0, 1.5, 0.0]);
    expect_near(found.matrix3 * DVec3::Y, [-2.0, 0.0, 0.0]);
    expect_near(found.matrix3 * DVec3::Z, [0.0, 0.0, 3.0]);
    expect_near(found.translation, [0.0, 0.0, 5.0]);
    // Hermite weights with zero tangents: at a quarter of the interval the second key has 5/32.
    let flat = [
        [0.0_f32; 3],
        [1.0; 3],
        [0.0; 3],
        [0.0; 3],
        [33.0; 3],
        [0.0; 3],
    ]
    .concat();
    let spline = KeyedTriangle::new()
        .animated("", 1, "scale", "CUBICSPLINE", &flat)
        .with(at_rest);
    expect_near(spline.transform_at(1.5).matrix3 * DVec3::Z, [0.0, 0.0, 6.0]);
    let other = KeyedTriangle::new()
        .animated("", 1, "translation", "LINEAR", &[0.0; 6])
        .with(at_rest);
    expect_near(other.transform_at(2.0).matrix3 * DVec3::X, [0.0, 7.0, 0.0]);
}

/// Protects: rotations take the shorter arc at constant speed: a quarter of the interval is a
/// quarter of the angle, unlike linear interpolation of quaternions.
#[test]
fn rotations_take_the_shorter_turn() {
    let (s, c) = 60.0_f64.to_radians().sin_cos();
    // 120 degrees about z, by the negated quaternion.
    let turn = KeyedTriangle::new().animated(
        "",
        1,
        "rotation",
        "LINEAR",
        &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, -s as f32, -c as f32],
    );
    for (time, degrees) in [
        (1.0, 0.0_f64),
        (1.5, 30.0),
        (2.0, 60.0),
        (2.5, 90.0),
        (3.0, 120.0),
    ] {
        let (sine, cosine) = degrees.to_radians().sin_cos();
        expect_near(
            turn.transform_at(time).matrix3 * DVec3::X,
            [cosine, sine, 0.0],
        );
    }
    let still = KeyedTriangle::new().animated(
        "",
        1,
        "rotation",
        "LINEAR",
        &[0.0, 0.0, s as f32, c as f32, 0.0, 0.0, s as f32, c as f32],
    );
    expect_near(
        still.transform_at(1.7).matrix3 * DVec3::X,
        [-0.5, 3.0_f64.sqrt() / 2.0, 0.0],
    );
}

/// Protects: splines are Hermite's with tangents in units per second, in-tangent and out-tangent in
/// the file's order, and exact at keys; rotations are interpolated by components, then normalised.
#[test]
fn splines_follow_their_tangents() {
    // In-tangent, value and out-tangent of each key; only x moves, from 0 to 2, leaving at 3 per
    // second and arriving at −1.5.
    let x =
        |before: f32, value: f32, after: f32| [before, 0.0, 0.0, value, 0.0, 5.0, after, 0.0, 0.0];
    let keys = [x(9.0, 0.0, 3.0), x(-1.5, 2.0, 9.0)].concat();
    let spline = KeyedTriangle::new().animated("", 0, "translation", "CUBICSPLINE", &keys);
    for (time, x) in [(0.0, 0.0), (1.0, 0.0), (3.0, 2.0), (7.0, 2.0)] {
        expect_near(spline.transform_at(time).translation, [x, 0.0, 5.0]);
    }
    // Half-way: ½·0 + 2·⅛·3 + ½·2 + 2·(−⅛)·(−1.5); at a quarter, the weights are 27/32, 9/64, 5/32
    // and −3/64.
    expect_near(spline.transform_at(2.0).translation, [2.125, 0.0, 5.0]);
    expect_near(
        spline.transform_at(1.5).translation,
        [
            2.0 * 9.0 / 64.0 * 3.0 + 5.0 / 32.0 * 2.0 + 2.0 * 3.0 / 64.0 * 1.5,
            0.0,
            5.0,
        ],
    );
    let h = std::f32::consts::FRAC_1_SQRT_2;
    let zero = [0.0_f32; 4];
    let keys = [
        zero,
        [0.0, 0.0, 0.0, 1.0],
        zero,
        zero,
        [0.0, 0.0, h, h],
        zero,
    ]
    .concat();
    let turn = KeyedTriangle::new().animated("", 1, "rotation", "CUBICSPLINE", &keys);
    // At a quarter of the interval the second key has the weight 5/32.
    let (w, h) = (5.0 / 32.0, std::f64::consts::FRAC_1_SQRT_2);
    let angle = 2.0 * (w * h).atan2(1.0 - w + w * h);
    expect_near(
        turn.transform_at(1.5).matrix3 * DVec3::X,
        [angle.cos(), angle.sin(), 0.0],
    );
    expect_near(turn.transform_at(1.5).matrix3 * DVec3::Z, [0.0, 0.0, 1.0]);
}

/// Protects: without a time a file is at rest, with a note; the first of two animations of a
/// property is used; an animation without a valid target has no effect, with a warning.
#[test]
fn what_is_played() {
    let up = [0.0, 0.0, 0.0, 0.0, 8.0, 0.0];
    let made = KeyedTriangle::new()
        .animated("walk", 0, "translation", "LINEAR", &up)
        .animated("run", 0, "translation", "LINEAR", &[9.0; 6]);
    let warned =
        |loaded: &LoadedScene, word: &str| loaded.warnings.iter().any(|w| w.message.contains(word));
    let rest = made
        .load_with(None, None, None)
        .unwrap_or_else(|e| panic!("{e}"));
    expect_near(
        affine_from_steps(&rest.scene.objects[0].transform).translation,
        [0.0, 0.0, 5.0],
    );
    assert!(warned(&rest, "at rest") && !warned(&rest, "several"));
    let played = made
        .load_with(None, None, Some(2.0))
        .unwrap_or_else(|e| panic!("{e}"));
    expect_near(
        affine_from_steps(&played.scene.objects[0].transform).translation,
        [0.0, 4.0, 0.0],
    );
    assert!(warned(&played, "several animations") && !warned(&played, "at rest"));
    let seconds = Some(3.0);
    let info = |name: &str| AnimationInfo {
        name: name.to_owned(),
        seconds,
    };
    assert_eq!(played.contents.animations, [info("walk"), info("run")]);
    let matrix = json!([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1, 2, 3, 1]);
    let fixed = KeyedTriangle::new()
        .animated("", 0, "translation", "LINEAR", &up)
        .with(|d| d["nodes"][0] = json!({ "children": [1], "matrix": matrix }));
    let fixed = fixed
        .load_with(None, None, Some(2.0))
        .unwrap_or_else(|e| panic!("{e}"));
    expect_near(
        affine_from_steps(&fixed.scene.objects[0].transform).translation,
        [1.0, 2.0, 3.0],
    );
    assert!(warned(&fixed, "has a matrix"));
    assert!(warned(
        &KeyedTriangle::new()
            .load_with(None, None, Some(1.0))
            .unwrap_or_else(|e| panic!("{e}")),
        "no animation"
    ));
    assert_ne!(rest.hash, played.hash, "other pictures");
}

/// A change of a file's JSON that makes it invalid.
type AnimationDamage = fn(&mut Value);

/// Protects: broken animations are errors with a position where they are played, and are ignored at
/// rest.
#[test]
fn broken_animations_are_refused_when_played() {
    let made = |change: AnimationDamage| {
        KeyedTriangle::new()
            .animated("", 0, "translation", "LINEAR", &[0.0; 6])
            .with(change)
    };
    let breaks: [(AnimationDamage, &str); 6] = [
        (
            |d| d["animations"][0]["channels"][0]["sampler"] = json!(7),
            "samplers",
        ),
        (
            |d| d["animations"][0]["channels"][0]["target"]["node"] = json!(99),
            "nodes",
        ),
        (
            |d| d["animations"][0]["samplers"][0]["input"] = json!(99),
            "accessors",
        ),
        (
            |d| d["animations"][0]["samplers"][0]["interpolation"] = json!("CUBICSPLINE"),
            "has values that do not match its keyframe times: 2 keyframe times and 2 values of 3 numbers, in place of 6 values of 3 numbers",
        ),
        (
            |d| d["animations"][0]["channels"][0]["target"]["path"] = json!("rotation"),
            "in place of 2 values of 4 numbers",
        ),
        (
            |d| d["accessors"][1]["count"] = json!(0),
            "has no keyframe times, but needs at least one",
        ),
    ];
    for (change, word) in breaks {
        let made = made(change);
        assert!(made.load_with(None, None, None).is_ok(), "{word}");
        let error = made.load_with(None, None, Some(2.0)).expect_err(word);
        assert_eq!(error.kind(), ErrorKind::Input);
        assert!(
            error.to_string().contains("animations[0].channels[0]")
                && error.to_string().contains(word),
            "{error}"
        );
    }
}

/// Protects: a scene is chosen by name or index, whatever the file's default; an unknown one is an
/// error that lists them.
#[test]
fn scenes_are_chosen() {
    let made = KeyedTriangle::new();
    let z = |scene: Option<&str>| {
        let loaded = made
            .load_with(scene, None, None)
            .unwrap_or_else(|e| panic!("{e}"));
        affine_from_steps(&loaded.scene.objects[0].transform)
            .translation
            .to_array()
    };
    assert_eq!(
        [z(None), z(Some("day")), z(Some("0")), z(Some("1"))],
        [
            [0.0, 0.0, 5.0],
            [0.0, 0.0, 5.0],
            [0.0, 0.0, 5.0],
            [7.0, 0.0, 0.0]
        ]
    );
    for (wish, message) in [
        (
            "dya",
            "has no scene `dya`; did you mean `day`? Its scenes: 0 `day`, 1",
        ),
        ("2", "has no scene `2`; its scenes: 0 `day`, 1"),
    ] {
        let error = made.load_with(Some(wish), None, None).expect_err("none");
        assert_eq!(error.kind(), ErrorKind::Usage);
        assert!(error.to_string().contains(message), "{error}");
    }
    assert_eq!(
        made.load_with(None, None, None)
            .unwrap_or_else(|e| panic!("{e}"))
            .contents
            .scenes,
        ["day", ""]
    );
}

/// Protects: a primitive has the material of the chosen variant, or its own without a mapping.
#[test]
fn variants_are_chosen() {
    let made = KeyedTriangle::new();
    let colour = |variant: Option<&str>| {
        let loaded = made
            .load_with(None, variant, None)
            .unwrap_or_else(|e| panic!("{e}"));
        let [material] = &loaded.scene.materials[..] else {
            panic!("only what is shown is converted")
        };
        let MaterialModel::Physical(model) = &material.model else {
            panic!("a physical material")
        };
        model.base_colour.clone()
    };
    let (red, blue) = (Colour([1.0, 0.0, 0.0]), Colour([0.0, 0.0, 1.0]));
    assert_eq!(
        [None, Some("red"), Some("blue"), Some("sea")].map(colour),
        [&red, &red, &blue, &blue].map(|c| (*c).into())
    );
    let error = made.load_with(None, Some("green"), None).expect_err("none");
    assert_eq!(error.kind(), ErrorKind::Usage);
    assert!(
        error
            .to_string()
            .contains("has no variant `green`; its variants: `red`, `blue`, `sea`"),
        "{error}"
    );
    let none = made
        .with(|d| d["extensions"] = json!({}))
        .load_with(None, Some("red"), None)
        .expect_err("none");
    assert!(
        none.to_string()
            .contains("has no variants, but the variant `red` was requested"),
        "{none}"
    );
}

/// Protects: a mesh of a scene file uses a chosen scene and time of its model, given by an
/// expression of `t`; an unknown choice is an error at its key, and inline arrays have no choices.
#[test]
fn scene_files_name_part_and_moment() {
    let made = KeyedTriangle::new().animated(
        "",
        2,
        "translation",
        "LINEAR",
        &[0.0, 0.0, 0.0, 4.0, 8.0, 0.0],
    );
    let folder = made.write().parent().expect("a folder").to_owned();
    let scene = |mesh: &str, at: Option<f64>| {
        let path = folder.join("a.scene.toml");
        let text = format!("format = 1\nt = 1\n[[meshes]]\nname = \"m\"\n{mesh}\n");
        std::fs::write(&path, text).expect("a file");
        load_with(path, None, None, at)
    };
    let first = |loaded: LoadedScene| match &loaded.scene.meshes[0].source {
        MeshSource::Inline(data) => data.positions.offsets()[0],
        MeshSource::File(path) => panic!("{path} was not read"),
    };
    let moment = "source.file = \"made.gltf\"\nmodel = { scene = \"1\", time = \"2*t\" }";
    assert_eq!(
        first(scene(moment, None).unwrap_or_else(|e| panic!("{e}"))),
        [2.0, 4.0, 0.0]
    );
    assert_eq!(
        first(scene(moment, Some(1.5)).unwrap_or_else(|e| panic!("{e}"))),
        [4.0, 8.0, 0.0]
    );
    assert_eq!(
        first(scene("source.file = \"made.gltf\"", None).unwrap_or_else(|e| panic!("{e}"))),
        [0.0, 0.0, 5.0]
    );
    let error = scene("source.file = \"made.gltf\"\nmodel.scene = \"night\"", None)
        .expect_err("no such scene");
    assert_eq!(error.kind(), ErrorKind::Input);
    assert!(
        error.to_string().contains("its scenes: 0 `day`, 1") && error.to_string().contains(":6:"),
        "{error}"
    );
    let inline = "source.inline = {}\nmodel.time = 1";
    assert!(
        scene(inline, None)
            .expect_err("nothing to choose")
            .to_string()
            .contains("selects a part of a file")
    );
    std::fs::write(folder.join("a.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").expect("a file");
    assert!(
        scene("source.file = \"a.obj\"\nmodel.time = 1", None)
            .expect_err("no time")
            .to_string()
            .contains("no time")
    );
    let native =
        load_with(folder.join("a.scene.toml"), Some("1"), None, None).expect_err("no scenes");
    assert_eq!(native.kind(), ErrorKind::Usage);
}

/// Protects: real files have their known scenes, variants and times.
#[test]
fn real_files() {
    let Some(folder) = assets("gltf") else { return };
    let load = |file: &str, scene, variant, at| {
        load_with(folder.join(file), scene, variant, at).unwrap_or_else(|e| panic!("{e}"))
    };
    // A full turn about y in two seconds, whose direction only rounding decides.
    let cube = |at| {
        affine_from_steps(
            &load("AnimatedCube/AnimatedCube.gltf", None, None, Some(at))
                .scene
                .objects[0]
                .transform,
        )
        .matrix3
    };
    assert!(
        (cube(0.5) * DVec3::X).x.abs() < 1e-6 && (cube(0.5) * DVec3::Y - DVec3::Y).length() < 1e-6
    );
    expect_near(cube(1.0) * DVec3::X, [-1.0, 0.0, 0.0]);
    let variants = |name| load("bio-18_variants/18_variants.gltf", None, name, None);
    assert_eq!(
        variants(None).contents.variants,
        ["Variant_Red", "Variant_Blue"]
    );
    let looks = [None, Some("Variant_Red"), Some("Variant_Blue")];
    let names = |loaded: LoadedScene| {
        loaded
            .scene
            .materials
            .into_iter()
            .map(|material| material.name)
            .collect::<Vec<_>>()
    };
    let [own, red, blue] = looks.map(|name| names(variants(name)));
    assert_eq!(
        (own, red, blue),
        (
            vec!["Blue".into(), "Green".into(), "White".into()],
            vec!["Red".into(), "Orange".into(), "White".into()],
            vec!["Blue".into(), "Green".to_owned(), "White".into()]
        )
    );
    let boxes = |scene| {
        load("crafted/two_scenes_default_1.glb", scene, None, None)
            .scene
            .objects
            .len()
    };
    assert_eq!([boxes(None), boxes(Some("0")), boxes(Some("1"))], [2, 1, 2]);
    let tests = load(
        "InterpolationTest/InterpolationTest.gltf",
        None,
        None,
        Some(0.5),
    );
    assert!(
        tests.contents.animations.len() == 9
            && tests
                .contents
                .animations
                .iter()
                .all(|info| info.seconds.is_some())
    );
}
