//! Tests of valid scenes: notation, expressions, parameters and overrides.

use raywright_core::scene::{Colour, ColourInput, MaterialModel, ScalarFactor, Shape};

use super::{parse, read_scene, toml};
use crate::error_kind::ErrorKind;
use crate::native::{ParameterOverrides, SceneNotation};

const BALL: &str = r#"
format = 1
t = 2
[parameters]
z = 3
a = "z + t"        # uses one above that sorts after it
[[materials]]
name = "red"
model = { classic = { colour = [1, "a / 10", 0], diffuse = "1 - u", ambient = "a" } }
[[objects]]
shape = { sphere = {
  centre = [0, "a", 1e0], # TOML 1.1: line breaks and a last comma inside braces
  radius = 0x10,
} }
material = "red"
"#;

/// Protects: numbers may be expressions of the time and of earlier parameters.
#[test]
fn numbers_may_be_expressions_of_the_time_and_of_earlier_parameters() {
    let scene = read_scene(BALL);
    assert_eq!(scene.parameters["a"].value, 5.0);
    assert_eq!(
        scene.objects[0].shape,
        Shape::Sphere {
            centre: [0.0, 5.0, 1.0],
            radius: 16.0
        }
    );
}

/// Protects: inputs that depend on the hit keep their text, and colours do not.
#[test]
fn inputs_of_the_hit_keep_their_text_and_colours_do_not() {
    let MaterialModel::Classic(classic) = &read_scene(BALL).materials[0].model else {
        panic!("a classic material")
    };
    assert_eq!(
        classic.diffuse,
        ScalarFactor::Expression("1 - u".to_owned())
    );
    assert_eq!(
        classic.colour,
        ColourInput::Constant(Colour([1.0, 0.5, 0.0]))
    );
    assert_eq!(classic.ambient, Some(Colour([5.0; 3])));
}

/// Protects: an input of the physical model whose text does not depend on the hit is a number
/// before the render, so that an emission that depends on time still lights other objects; an input
/// that depends on the hit keeps its text.
#[test]
fn inputs_that_ask_nothing_of_the_hit_are_numbers() {
    let classic =
        r#"{ classic = { colour = [1, "a / 10", 0], diffuse = "1 - u", ambient = "a" } }"#;
    let physical =
        r#"{ physical = { metallic = "a / 10", roughness = "u / a", emission = "2 * a" } }"#;
    let text = BALL.replace(classic, physical);
    let MaterialModel::Physical(physical) = &read_scene(&text).materials[0].model else {
        panic!("a physical material")
    };
    assert_eq!(
        (physical.metallic.constant(), physical.emission.constant()),
        (Some(0.5), Some(Colour([10.0; 3])))
    );
    assert_eq!(
        physical.roughness,
        raywright_core::scene::Input::Expression("u / a".to_owned())
    );
}

/// Protects: overrides replace the file's values and affect later parameters.
#[test]
fn overrides_stand_in_place_of_the_file_and_reach_later_parameters() {
    let overrides = ParameterOverrides {
        time: Some(1.0),
        set: vec![("z".to_owned(), 10.0)],
    };
    let scene = parse("x", BALL, SceneNotation::Toml, &overrides)
        .expect("a scene")
        .scene;
    assert_eq!(
        (
            scene.t,
            scene.parameters["z"].value,
            scene.parameters["a"].value
        ),
        (1.0, 10.0, 11.0)
    );
}

/// Protects: a time can be given to a scene without one.
#[test]
fn the_time_can_be_given_to_a_scene_that_says_none() {
    let overrides = ParameterOverrides {
        time: Some(0.5),
        set: Vec::new(),
    };
    assert_eq!(
        parse("x", "format = 1", SceneNotation::Toml, &overrides)
            .expect("a scene")
            .scene
            .t,
        0.5
    );
}

/// Protects: an unknown parameter is a usage error with a suggestion.
#[test]
fn a_parameter_that_the_scene_does_not_have_is_a_usage_error_with_a_suggestion() {
    let overrides = ParameterOverrides {
        time: None,
        set: vec![("Z".to_owned(), 1.0)],
    };
    let error = parse("x", BALL, SceneNotation::Toml, &overrides)
        .err()
        .expect("no such parameter");
    assert_eq!(error.kind(), ErrorKind::Usage);
    assert!(error.to_string().contains("did you mean `z`?"), "{error}");
}

/// Protects: a parameter may not use a later one.
#[test]
fn a_parameter_may_not_use_a_later_one() {
    let error = toml("format = 1\n[parameters]\nb = \"a\"\na = 1").expect_err("a is not known yet");
    assert!(error.to_string().contains("unknown name `a`"), "{error}");
}

/// Protects: JSON gives the same scene as TOML.
#[test]
fn json_says_the_same_as_toml() {
    let json = r#"{ "format": 1, "t": 2, "parameters": { "z": 3, "a": "z + t" }, "sky": null,
        "materials": [{ "name": "red",
            "model": { "classic": { "colour": [1, "a / 10", 0], "diffuse": "1 - u", "ambient": "a" } } }],
        "objects": [{ "shape": { "sphere": { "centre": [0, "a", 1e0], "radius": 16 } }, "material": "red" }] }"#;
    assert_eq!(
        parse(
            "x",
            json,
            SceneNotation::Json,
            &ParameterOverrides::default()
        )
        .expect("a scene")
        .scene,
        read_scene(BALL)
    );
}

/// Protects: a parameter may state its range; a value of `--set` or of the file outside of it, an
/// empty range and an impossible step are refused.
#[test]
fn parameters_have_ranges() {
    let text = |range: &str| {
        format!("format = 1\nperiod = \"tau\"\n[parameters]\na = {{ {range} }}\nb = \"2*a\"")
    };
    let scene = read_scene(&text(
        "value = \"1 + 1\", min = 0, max = \"2*pi\", step = 0.5",
    ));
    assert_eq!(
        (scene.parameters["a"].value, scene.parameters["b"].value),
        (2.0, 4.0)
    );
    let range = scene.parameters["a"].range.expect("a range");
    assert_eq!((range.min, range.step), (0.0, Some(0.5)));
    assert!((range.max - std::f64::consts::TAU).abs() < 1e-15 && scene.period == Some(range.max));
    let set = |value: f64| {
        let overrides = ParameterOverrides {
            time: None,
            set: vec![("a".to_owned(), value)],
        };
        let text = text("value = 2, min = 0, max = 3");
        parse("x", &text, SceneNotation::Toml, &overrides).map(|parsed| parsed.scene)
    };
    assert_eq!(set(3.0).expect("within").parameters["b"].value, 6.0);
    let error = set(3.5).expect_err("outside");
    assert_eq!(error.kind(), ErrorKind::Usage);
    assert!(
        error.to_string().contains("from 0 to 3, not 3.5"),
        "{error}"
    );
    for (wrong, message) in [
        ("value = 4, min = 0, max = 3", "must be from 0 to 3, not 4"),
        (
            "value = 1, min = 3, max = 3",
            "`min` is 3, which is not below `max`, 3",
        ),
        (
            "value = 1, min = 0, max = 3, step = 4",
            "`step` must be above 0",
        ),
        ("value = 1, max = 3", "missing key `min`"),
        ("min = 0, max = 3", "missing key `value`"),
        ("value = 1, min = 0, maximum = 3", "unknown key `maximum`"),
    ] {
        let error = toml(&text(wrong)).expect_err(wrong).to_string();
        assert!(error.contains(message), "{wrong}: {error}");
    }
}
