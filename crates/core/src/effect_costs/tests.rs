//! Costs of effects, with a clock that counts rays.

use super::*;

fn measured(text: &str, budget: Duration) -> Result<EffectCosts, PrepareError> {
    measured_without(&[], text, budget)
}

fn measured_without(
    effects: &[Effect],
    text: &str,
    budget: Duration,
) -> Result<EffectCosts, PrepareError> {
    let scene: Scene =
        serde_json::from_str(text).unwrap_or_else(|e| panic!("the scene is right: {e}"));
    let settings = Settings {
        without: EffectSet::from_effects(effects),
        ..Settings::from_scene(&scene)
    };
    let stopwatch: Stopwatch = |work| work() as f64 * 1e-6;
    let observer = &();
    measure_by_stopwatch(
        (&scene, &settings),
        budget,
        observer,
        &mut |_, _| (),
        stopwatch,
    )
}

const MIRROR: &str = r#"{"format": 1, "render": {"size": [4, 2], "pattern": "centre", "max_depth": 4}, "sky": {"constant": 0.5},
    "cameras": [{"pose": {"look_at": {"eye": [0, 2, 0], "target": [0, 0, 0], "up": [0, 0, 1]}},
        "projection": {"pinhole": {"vertical_fov": 20}}}],
    "materials": [{"name": "m", "model": {"classic": {"local": 0, "emission": 1, "reflection": {"weight": 0.5}}}}],
    "objects": [{"shape": {"plane": {"point": [0, 0, 0], "normal": [0, 1, 0]}}, "material": "m"}]}"#;

/// Protects: costs follow the clock, which here counts rays. A mirror that fills the picture
/// and reflects half of a sky of 0.5 doubles the rays and adds 0.25. The sky itself also adds
/// 0.25, and the emission adds 1, both without additional rays.
#[test]
fn effects_cost_what_the_clock_says() {
    let costs = measured(MIRROR, Duration::from_secs(600)).expect("a small picture");
    assert_eq!(
        (costs.size, costs.seconds.median, costs.late.len()),
        ([4, 2], 16e-6, 0)
    );
    let value_of = |name: &str| {
        costs
            .effects
            .iter()
            .find(|cost| cost.effect == name)
            .unwrap_or_else(|| panic!("no {name}"))
    };
    let (mirror, sky, glow) = (
        value_of("mirror reflection"),
        value_of("sky"),
        value_of("emission"),
    );
    assert_eq!((mirror.ratio.median, mirror.rays), (2.0, 2.0));
    assert_eq!((sky.ratio.median, glow.ratio.median), (1.0, 1.0));
    assert!(
        (mirror.rmse - 0.25).abs() < 1e-6
            && (sky.rmse - 0.25).abs() < 1e-6
            && (glow.rmse - 1.0).abs() < 1e-6
    );
    assert!(costs.effects[0].effect == "mirror reflection");
    assert!(
        costs.effects.iter().all(|cost| cost.effect != "shadows"),
        "it has none"
    );
}

/// Protects: an effect that the user switched off stays off while others are measured: without
/// mirrors, the emission adds 1, with 8 rays with and without it.
#[test]
fn what_is_off_stays_off() {
    let costs = measured_without(
        &[Effect::MirrorReflection],
        MIRROR,
        Duration::from_secs(600),
    )
    .expect("a small picture");
    let glow = costs
        .effects
        .iter()
        .find(|cost| cost.effect == "emission")
        .expect("it glows");
    assert_eq!((costs.seconds.median, glow.rays), (8e-6, 1.0));
    assert!((glow.rmse - 1.0).abs() < 1e-6, "{glow:?}");
}

/// Protects: renders with and without an effect use the same random numbers. Stripes much finer
/// than a pixel, which are noise, cancel in the difference that the mirror makes.
#[test]
fn both_have_the_same_noise() {
    let text = MIRROR.replace("\"pattern\": \"centre\"", "\"samples\": 4");
    let text = text.replace("\"emission\": 1,", "\"emission\": \"1 + sin(1e4*p.x)\",");
    let costs = measured(&text, Duration::from_secs(600)).expect("a small picture");
    let mirror = costs
        .effects
        .iter()
        .find(|cost| cost.effect == "mirror reflection")
        .expect("a mirror");
    assert!((mirror.rmse - 0.25).abs() < 1e-6, "{mirror:?}");
}

/// Protects: a measurement without time reports so, and a scene without effects has no costs.
#[test]
fn nothing_costs_nothing() {
    assert!(matches!(
        measured(MIRROR, Duration::ZERO),
        Err(PrepareError::Cancelled)
    ));
    let bare = measured(
        r#"{"format": 1, "render": {"size": [4, 2], "pattern": "centre"}}"#,
        Duration::from_secs(600),
    )
    .expect("empty");
    assert!(bare.effects.is_empty() && bare.late.is_empty());
}

/// Protects: noise common to all rounds counts as a difference that the effect makes; noise
/// that differs between rounds is subtracted. Differences of 1, 2 and 3 in one number have the
/// mean 2 with variance 1/3.
#[test]
fn noise_is_no_change() {
    let picture = |value: f32| Picture {
        rgb: vec![[value; 3]],
        ..Picture::new(1, 1)
    };
    let (zero, others) = (picture(0.0), [1.0, 2.0, 3.0].map(picture));
    let pairs = others.map(|other| [other, zero.clone()]);
    assert!((rms_difference_of_mean_pictures(&pairs) - (4.0_f64 - 1.0 / 3.0).sqrt()).abs() < 1e-12);
    assert_eq!(rms_difference_of_mean_pictures(&pairs[..1]), 1.0);
}
