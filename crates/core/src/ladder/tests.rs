//! Tests of the ladders: choice of a rung, and messages for mistakes.

use super::value::OFFSET;
use super::*;
use crate::scene::{ColourSpace, ConstantOffset, SpawnRule, Texture, TextureFilter, WrapMode};

fn scene() -> Scene {
    let texture = |filter| Texture {
        name: String::new(),
        image: String::new(),
        colour_space: ColourSpace::Srgb,
        filter,
        wrap_u: WrapMode::Repeat,
        wrap_v: WrapMode::Repeat,
    };
    Scene {
        textures: vec![
            texture(TextureFilter::Bilinear),
            texture(TextureFilter::Nearest),
        ],
        ..Scene::default()
    }
}

/// Protects: choosing any rung of any ladder sets scene and settings to it and changes no other
/// ladder, from any state; the default is a rung.
#[test]
fn a_chosen_rung_is_in_use() {
    for ladder in Ladder::ALL {
        assert!(
            ladder
                .rungs()
                .iter()
                .any(|rung| rung.name == ladder.default_rung()),
            "{ladder:?}"
        );
        for before in ladder.rungs() {
            for after in ladder.rungs() {
                let (mut scene, mut settings) = (scene(), Settings::from_scene(&scene()));
                for rung in [before, after] {
                    let choice = RungChoice::parse(&format!("{}={}", ladder.name(), rung.name))
                        .expect("a rung");
                    choice.apply(&mut scene, &mut settings);
                    assert_eq!(
                        (
                            ladder.current_rung_name(&scene, &settings).as_str(),
                            choice.ladder()
                        ),
                        (rung.name, ladder)
                    );
                    assert_eq!(
                        choice.to_string(),
                        format!("{}={}", ladder.name(), rung.name)
                    );
                }
                for other in Ladder::ALL {
                    let tree = [Ladder::Build, Ladder::Accelerator];
                    if other != ladder && !(tree.contains(&other) && tree.contains(&ladder)) {
                        let own = other.current_rung_name(
                            &super::tests::scene(),
                            &Settings::from_scene(&super::tests::scene()),
                        );
                        assert_eq!(
                            other.current_rung_name(&scene, &settings),
                            own,
                            "{ladder:?} moved {other:?}"
                        );
                    }
                }
            }
        }
    }
}

/// Protects: rungs that would not change a scene's picture are left out: hard shadows without area
/// lights, and shadows switched off without lights of zero size.
#[test]
fn rungs_that_are_no_other_picture_are_told() {
    let left = |present: &[Effect]| -> Vec<&'static str> {
        let present = EffectSet::from_effects(present);
        Ladder::Shadows
            .choices()
            .filter(|choice| choice.changes_picture(present))
            .map(|choice| choice.rung())
            .collect()
    };
    assert_eq!(left(&[Effect::Shadows]), ["off", "on"]);
    assert_eq!(left(&[Effect::SoftShadows]), ["hard", "on"]);
    assert_eq!(
        left(&[Effect::SoftShadows, Effect::Shadows]),
        ["off", "hard", "on"]
    );
    for ladder in Ladder::ALL
        .into_iter()
        .filter(|&ladder| ladder != Ladder::Shadows)
    {
        assert!(
            ladder
                .choices()
                .all(|choice| choice.changes_picture(EffectSet::EMPTY)),
            "{ladder:?}"
        );
    }
}

/// Protects: a scene's own constant offset is kept when the constant rung is chosen.
#[test]
fn the_own_constant_stays() {
    let own = SpawnRule::Constant(ConstantOffset {
        offset: 0.25,
        ..OFFSET
    });
    let mut scene = scene();
    scene.classic.spawn = own;
    let mut settings = Settings::from_scene(&scene);
    RungChoice::parse("ray-offset=constant")
        .expect("a rung")
        .apply(&mut scene, &mut settings);
    assert_eq!(scene.classic.spawn, own);
}

/// Protects: path tracing continues from every surface, so the path length matters; without mirrors
/// it does not matter to Whitted ray tracing.
#[test]
fn paths_have_a_length_to_choose() {
    let reached_by = |integrator| {
        let (scene, settings) = (
            scene(),
            Settings {
                integrator,
                ..Settings::from_scene(&scene())
            },
        );
        let effects = crate::effects::assess_effects(&scene, &settings);
        applicable_ladders(&scene, &settings, &effects).any(|ladder| ladder == Ladder::PathLength)
    };
    assert_eq!(
        [Integrator::Path, Integrator::Whitted].map(reached_by),
        [true, false]
    );
}

/// Protects: the longest rung of paths is no limit: settings may exceed it, and its description
/// names the flag.
#[test]
fn paths_may_be_longer_than_their_longest_rung() {
    let longest = Ladder::PathLength.rungs().last().expect("a rung");
    let depth: u32 = longest.name.parse().expect("a number");
    let beyond = Settings {
        max_depth: depth + 1,
        ..Settings::from_scene(&scene())
    };
    assert_eq!(
        Ladder::PathLength.current_rung_name(&scene(), &beyond),
        (depth + 1).to_string()
    );
    assert!(
        longest.about.contains("for more use --max-depth"),
        "{}",
        longest.about
    );
}

/// Protects: an unknown rung is refused with the nearest word, or with all of them.
#[test]
fn mistakes_are_explained() {
    let message_of = |text| RungChoice::parse(text).expect_err("no rung").to_string();
    assert_eq!(
        message_of("precision"),
        "expected LADDER=RUNG, such as precision=reference"
    );
    assert_eq!(
        message_of("precison=reference"),
        "unknown ladder `precison`; did you mean `precision`?"
    );
    assert_eq!(
        message_of("precision=exact"),
        "unknown rung of precision `exact`; known: robust, reference"
    );
    assert!(message_of("brightness=red").contains("known: samples, reconstruction"));
}
