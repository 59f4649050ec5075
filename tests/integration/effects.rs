//! Only the effects that a scene calls for: what is absent has empty tables and traces no ray.

use raywright::core::effects::Status;
use raywright::core::settings::Settings;
use raywright::core::{Scene, prepare};
use raywright::io::{Input, LoadOptions, load, presets};

use crate::support::carried;

fn preset(name: &str) -> Scene {
    load(&Input::Preset(name.to_owned()), &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}")).scene
}

/// Renders a small picture and checks each absent effect against what was built and counted.
fn prove(what: &str, scene: &Scene) {
    let settings = Settings { size: [48, 27], ..Settings::of(scene) };
    let ready = prepare(scene, &settings).unwrap_or_else(|e| panic!("{what}: {e}"));
    let (tables, counters) = (ready.tables(), ready.render(&()).counters);
    let absent = |name: &str| match ready.effects().status(name) {
        Some(status) => status == Status::Absent,
        None => panic!("there is no effect named {name}"),
    };
    let zero = |name: &str, value: u64| assert!(!absent(name) || value == 0, "{what}: {name} is absent, but {value} of it");
    zero("mirror reflection", if absent("refraction") { counters.reflection } else { 0 });
    zero("refraction", counters.refraction);
    zero("shadows", if absent("soft shadows") { counters.shadow } else { 0 });
    zero("soft shadows", tables.emitters as u64);
    zero("instances", tables.instances as u64);
    zero("unbounded shapes", tables.unbounded as u64);
    zero("sky light", u64::from(tables.irradiance));
    zero("image textures", if absent("environment map") { tables.texture_bytes as u64 } else { 0 });
    if absent("direct light") && absent("highlights") {
        assert_eq!(tables.lights, 0, "{what}: lights show on nothing, but were built");
    }
    assert_eq!(counters.scatter, 0, "{what}: Whitted ray tracing scatters nothing");
}

/// Protects: the proofs hold for every preset as it is.
#[test]
fn absent_effects_cost_nothing_on_every_preset() {
    for p in presets::list() {
        prove(p.name, &preset(p.name));
    }
}

/// Protects: each effect of the canonical preset is found, and disappears when the one thing that calls for it does.
#[test]
fn the_canonical_preset_with_one_thing_taken_away() {
    if !carried("whitted") {
        return;
    }
    let whole = preset("whitted");
    let status = |scene: &Scene, effect: &str| {
        raywright::core::effects::detect(scene, &Settings::of(scene))
            .status(effect)
            .unwrap_or_else(|| panic!("no effect {effect}"))
    };
    for effect in
        ["ambient light", "direct light", "shadows", "highlights", "mirror reflection", "fuzzy reflection", "refraction"]
    {
        assert_eq!(status(&whole, effect), Status::Simulated, "{effect}");
    }
    for effect in ["rim light", "emission", "image textures", "instances", "soft shadows", "indirect light", "caustics"] {
        assert_eq!(status(&whole, effect), Status::Absent, "{effect}");
    }
    let without = |effect: &str, change: &dyn Fn(&mut Scene)| {
        let mut scene = whole.clone();
        change(&mut scene);
        assert_eq!(status(&scene, effect), Status::Absent, "{effect}");
        prove(&format!("whitted without {effect}"), &scene);
    };
    without("refraction", &|s| s.objects.retain(|o| o.material != "glass"));
    without("fuzzy reflection", &|s| s.objects.retain(|o| o.material != "gold"));
    without("shadows", &|s| s.lights[0].shadows = false);
    without("shadows", &|s| s.objects.iter_mut().for_each(|o| o.casts_shadow = false));
    without("direct light", &|s| s.lights.clear());
    without("checkerboard", &|s| s.objects.retain(|o| o.material != "ground"));
    without("unbounded shapes", &|s| s.objects.retain(|o| o.material != "ground"));
    without("mirror reflection", &|s| s.objects.retain(|o| ["red", "blue"].contains(&o.material.as_str())));
    without("sky", &|s| s.sky = None);
}

/// Protects: a path of one segment leaves reflections out and says so with a hint, instead of calling them absent.
#[test]
fn depth_one_leaves_reflections_out() {
    if !carried("whitted") {
        return;
    }
    let scene = preset("whitted");
    let settings = Settings { max_depth: 1, size: [16, 9], ..Settings::of(&scene) };
    let ready = prepare(&scene, &settings).unwrap_or_else(|e| panic!("{e}"));
    let left_out: Vec<_> = ready.effects().left_out().map(|e| (e.name, e.hint.is_some())).collect();
    assert_eq!(left_out, [("mirror reflection", true), ("fuzzy reflection", true), ("refraction", true)]);
    let counters = ready.render(&()).counters;
    assert_eq!((counters.reflection, counters.refraction), (0, 0));
}

/// Protects: what is left out of glass is left out of rough glass only, and the report says where in the scene it comes from.
#[test]
fn only_rough_glass_is_shown_clearer_than_it_is() {
    let glass = |roughness: f64| {
        let text = format!(
            r#"{{ "format": 1,
            "materials": [{{ "name": "glass", "model": {{ "physical": {{ "transmission": 1, "roughness": {roughness} }} }} }}],
            "objects": [{{ "shape": {{ "sphere": {{ "centre": [0, 0, 0], "radius": 1 }} }}, "material": "glass" }}] }}"#
        );
        let scene: Scene = serde_json::from_str(&text).expect("the scene is right");
        let report = raywright::core::effects::detect(&scene, &Settings::of(&scene));
        let of = |name: &str| report.effects.iter().find(|effect| effect.name == name).expect("an effect").clone();
        ["refraction", "rough refraction", "glossy reflection"].map(|name| (of(name).status, of(name).source))
    };
    let from = |field: &str| Some(format!("materials[0].model.physical.{field}"));
    let clear = (Status::Simulated, from("transmission"));
    assert_eq!(glass(0.0), [clear.clone(), (Status::Absent, None), (Status::Absent, None)]);
    assert_eq!(glass(0.05), glass(0.0), "as rough as what is still traced");
    let rough = [clear, (Status::LeftOut, from("transmission")), (Status::LeftOut, from("roughness"))];
    assert_eq!(glass(0.06), rough);
}
