//! Only the effects that a scene needs: an absent effect has empty tables and traces no ray.

use raywright::core::effects::{Effect, EffectSet, EffectStatus, SWITCHABLE_EFFECTS};
use raywright::core::scene::{Colour, Integrator};
use raywright::core::settings::Settings;
use raywright::core::{Scene, prepare};
use raywright::io::{Input, LoadOptions, load, presets};

use crate::support::carried;

fn preset(name: &str) -> Scene {
    load(&Input::Preset(name.to_owned()), &LoadOptions::default())
        .unwrap_or_else(|e| panic!("{e}"))
        .scene
}

/// Renders a small picture and checks that each absent effect has built and counted nothing.
fn prove(label: &str, scene: &Scene) {
    let settings = Settings {
        size: [48, 27],
        ..Settings::from_scene(scene)
    };
    let ready = prepare(scene, &settings, &()).unwrap_or_else(|e| panic!("{label}: {e}"));
    let (tables, counters) = (ready.table_sizes(), ready.render(&()).counters);
    let absent = |effect| ready.effects().status(effect) == EffectStatus::Absent;
    let zero = |effect: Effect, value: u64| {
        assert!(
            !absent(effect) || value == 0,
            "{label}: {} is absent, but {value} of it",
            effect.name()
        );
    };
    zero(
        Effect::MirrorReflection,
        if absent(Effect::Refraction) {
            counters.reflection
        } else {
            0
        },
    );
    zero(Effect::Refraction, counters.refraction);
    // Path tracing also samples the sky, as a light.
    let whitted = ready.effects().integrator == "whitted";
    let asks_none = absent(Effect::SoftShadows) && (whitted || absent(Effect::SkyLight));
    zero(Effect::Shadows, if asks_none { counters.shadow } else { 0 });
    zero(Effect::SoftShadows, tables.emitters as u64);
    zero(
        Effect::Instances,
        if absent(Effect::Motion) {
            tables.instances as u64
        } else {
            0
        },
    );
    zero(Effect::UnboundedShapes, tables.unbounded as u64);
    zero(Effect::SkyLight, u64::from(tables.irradiance));
    zero(
        Effect::ImageTextures,
        if absent(Effect::EnvironmentMap) {
            tables.texture_bytes as u64
        } else {
            0
        },
    );
    if absent(Effect::DirectLight) && absent(Effect::Highlights) {
        assert_eq!(
            tables.lights, 0,
            "{label}: lights show on nothing, but were built"
        );
    }
    if whitted {
        assert_eq!(
            counters.scatter, 0,
            "{label}: Whitted ray tracing scatters nothing"
        );
    }
}

/// Protects: absent effects cost nothing on every preset.
#[test]
fn absent_effects_cost_nothing_on_every_preset() {
    for p in presets::list() {
        prove(p.name, &preset(p.name));
    }
}

/// Protects: each effect of the canonical preset is detected, and absent once its only cause is
/// removed.
#[test]
fn the_canonical_preset_with_one_thing_taken_away() {
    if !carried("whitted") {
        return;
    }
    let whole = preset("whitted");
    let status = |scene: &Scene, effect| {
        raywright::core::effects::assess_effects(scene, &Settings::from_scene(scene)).status(effect)
    };
    for effect in [
        Effect::AmbientLight,
        Effect::DirectLight,
        Effect::Shadows,
        Effect::Highlights,
        Effect::MirrorReflection,
        Effect::FuzzyReflection,
        Effect::Refraction,
    ] {
        assert_eq!(
            status(&whole, effect),
            EffectStatus::Simulated,
            "{effect:?}"
        );
    }
    for effect in [
        Effect::RimLight,
        Effect::Emission,
        Effect::ImageTextures,
        Effect::Instances,
        Effect::SoftShadows,
        Effect::IndirectLight,
        Effect::Caustics,
    ] {
        assert_eq!(status(&whole, effect), EffectStatus::Absent, "{effect:?}");
    }
    let without = |effect: Effect, change: &dyn Fn(&mut Scene)| {
        let mut scene = whole.clone();
        change(&mut scene);
        assert_eq!(status(&scene, effect), EffectStatus::Absent, "{effect:?}");
        prove(&format!("whitted without {effect:?}"), &scene);
    };
    without(Effect::Refraction, &|s| {
        s.objects.retain(|o| o.material != "glass")
    });
    without(Effect::FuzzyReflection, &|s| {
        s.objects.retain(|o| o.material != "gold")
    });
    without(Effect::Shadows, &|s| s.lights[0].shadows = false);
    without(Effect::Shadows, &|s| {
        s.objects.iter_mut().for_each(|o| o.casts_shadow = false)
    });
    without(Effect::DirectLight, &|s| s.lights.clear());
    without(Effect::Checkerboard, &|s| {
        s.objects.retain(|o| o.material != "ground")
    });
    without(Effect::UnboundedShapes, &|s| {
        s.objects.retain(|o| o.material != "ground")
    });
    without(Effect::MirrorReflection, &|s| {
        s.objects
            .retain(|o| ["red", "blue"].contains(&o.material.as_str()))
    });
    without(Effect::Sky, &|s| s.sky = None);
}

/// Protects: paths of one segment leave reflections out, with a hint, instead of reporting them as
/// absent.
#[test]
fn depth_one_leaves_reflections_out() {
    if !carried("whitted") {
        return;
    }
    let scene = preset("whitted");
    let settings = Settings {
        max_depth: 1,
        size: [16, 9],
        ..Settings::from_scene(&scene)
    };
    let ready = prepare(&scene, &settings, &()).unwrap_or_else(|e| panic!("{e}"));
    let left_out: Vec<_> = ready
        .effects()
        .left_out()
        .map(|e| (e.effect, e.hint.is_some()))
        .collect();
    assert_eq!(
        left_out,
        [
            (Effect::MirrorReflection, true),
            (Effect::FuzzyReflection, true),
            (Effect::Refraction, true)
        ]
    );
    let counters = ready.render(&()).counters;
    assert_eq!((counters.reflection, counters.refraction), (0, 0));
}

/// Protects: the part of glass that is left out concerns rough glass only, and the report names its
/// place in the scene.
#[test]
fn only_rough_glass_is_shown_clearer_than_it_is() {
    let glass = |roughness: f64| {
        let text = format!(
            r#"{{ "format": 1,
            "materials": [{{ "name": "glass", "model": {{ "physical": {{ "transmission": 1, "roughness": {roughness} }} }} }}],
            "objects": [{{ "shape": {{ "sphere": {{ "centre": [0, 0, 0], "radius": 1 }} }}, "material": "glass" }}] }}"#
        );
        let scene: Scene = serde_json::from_str(&text).expect("the scene is right");
        let settings = Settings {
            integrator: Integrator::Whitted,
            ..Settings::from_scene(&scene)
        };
        let report = raywright::core::effects::assess_effects(&scene, &settings);
        let of = |effect: Effect| report.effects[effect as usize].clone();
        [
            Effect::Refraction,
            Effect::RoughRefraction,
            Effect::GlossyReflection,
        ]
        .map(|effect| (of(effect).status, of(effect).source))
    };
    let from = |field: &str| Some(format!("materials[0].model.physical.{field}"));
    let clear = (EffectStatus::Simulated, from("transmission"));
    assert_eq!(
        glass(0.0),
        [
            clear.clone(),
            (EffectStatus::Absent, None),
            (EffectStatus::Absent, None)
        ]
    );
    assert_eq!(glass(0.05), glass(0.0), "as rough as what is still traced");
    let rough = [
        clear,
        (EffectStatus::LeftOut, from("transmission")),
        (EffectStatus::LeftOut, from("roughness")),
    ];
    assert_eq!(glass(0.06), rough);
}

/// Protects: a switched-off effect gives the picture of a scene without it, and is reported as left
/// out together with its dependents; other effects do not change.
#[test]
fn an_effect_that_is_switched_off_is_as_if_it_were_not_there() {
    if !carried("whitted") {
        return;
    }
    let whole = preset("whitted");
    let render = |scene: &Scene, without: EffectSet| {
        let settings = Settings {
            size: [48, 27],
            without,
            ..Settings::from_scene(scene)
        };
        let ready = prepare(scene, &settings, &()).unwrap_or_else(|e| panic!("{e}"));
        (ready.render(&()), ready.effects().clone())
    };
    let (as_it_is, _) = render(&whole, EffectSet::EMPTY);
    type ByHand<'a> = (Effect, &'a dyn Fn(&mut Scene));
    let hand: [ByHand<'_>; 4] = [
        (Effect::Shadows, &|s| s.lights[0].shadows = false),
        (Effect::DirectLight, &|s| s.lights.clear()),
        (Effect::Sky, &|s| s.sky = None),
        (Effect::AmbientLight, &|s| s.classic.ambient = Colour::BLACK),
    ];
    for (effect, change) in hand {
        let (switched, report) = render(&whole, EffectSet::from_effects(&[effect]));
        let mut changed = whole.clone();
        change(&mut changed);
        let (by_hand, _) = render(&changed, EffectSet::EMPTY);
        assert_eq!(switched.picture, by_hand.picture, "{effect:?}");
        assert_ne!(switched.picture, as_it_is.picture, "{effect:?}");
        assert_eq!(
            switched.counters.shadow, by_hand.counters.shadow,
            "{effect:?}"
        );
        assert_eq!(report.status(effect), EffectStatus::LeftOut, "{effect:?}");
    }
    let (_, dark) = render(&whole, EffectSet::from_effects(&[Effect::DirectLight]));
    let status = [
        Effect::DirectLight,
        Effect::Shadows,
        Effect::Highlights,
        Effect::Refraction,
    ]
    .map(|effect| dark.status(effect));
    assert_eq!(
        status,
        [
            EffectStatus::LeftOut,
            EffectStatus::LeftOut,
            EffectStatus::LeftOut,
            EffectStatus::Simulated
        ]
    );
    for effect in SWITCHABLE_EFFECTS.iter() {
        let (_, report) = render(&whole, EffectSet::from_effects(&[effect]));
        assert_ne!(report.status(effect), EffectStatus::Simulated, "{effect:?}");
    }
}
