//! The preset of noise and procedural materials, compared with its original shader.

use raywright::core::Scene;
use raywright::core::scene::{ColourInput, Sky};
use raywright::core::settings::{Aov, PrecisionChoice};

use super::{
    classic, hold_stable, object_ids, read, render, render_scene, scene, share_beyond, stable_mask,
};
use crate::support::{carried, shared};

/// Folder, time, pointer, size.
const VIEWS: [(&str, f64, [f64; 2], [u32; 2]); 2] = [
    ("t6_480x270", 6.0, [0.5, 0.5], [480, 270]),
    ("t20_240x180", 20.0, [0.45, 0.6], [240, 180]),
];

/// Protects: gradient noise and its sums inside expressions of surfaces, weights, shadows and sky,
/// and every constant of the preset.
fn views(precision: PrecisionChoice) {
    let Some(folder) = shared("reference/noise").filter(|_| carried("noise")) else {
        return;
    };
    for (name, t, [x, y], size) in VIEWS {
        let folder = folder.join(name);
        let stable = stable_mask(&folder);
        let ours = render("noise", t, &[("mouse_x", x), ("mouse_y", y)], |s| {
            s.size = size;
            s.precision = precision;
            s.aovs = vec![Aov::Object];
        })
        .picture;
        for file in ["color.exr", "color_f64.exr"] {
            hold_stable(
                &format!("noise {name} {file}"),
                &ours,
                &read(&folder.join(file)),
                &stable,
                0.0005,
            );
        }
        let (ours, theirs) = (
            object_ids(&ours, "object.id"),
            object_ids(&read(&folder.join("aov.exr")), "object"),
        );
        let wrong = (0..ours.len())
            .filter(|&i| stable[i] && ours[i] != theirs[i])
            .count();
        assert_eq!(wrong, 0, "{name}: stable pixels that see another object");
    }
}

/// Protects: both views of the preset equal the pictures of the original program, pixel by pixel,
/// in `robust`.
#[test]
fn both_views_robust() {
    views(PrecisionChoice::Robust);
}

/// Protects: the same in `reference`.
#[test]
fn both_views_reference() {
    views(PrecisionChoice::Reference);
}

/// Protects: a material's own shadow rule applies even without an occluder. Otherwise the plane
/// would be brighter all around the ball, not only in the ball's former shadow.
#[test]
fn a_shadow_rule_of_its_own_needs_no_occluder() {
    if !carried("noise") {
        return;
    }
    let mut scene = scene("noise", 6.0, &[]);
    let whole = render_scene(&scene, |_| {}).picture;
    scene
        .objects
        .iter_mut()
        .for_each(|object| object.casts_shadow = false);
    let bare = render_scene(&scene, |_| {});
    assert_eq!(
        bare.counters.shadow, 0,
        "nothing casts a shadow, so no ray asks"
    );
    let share = share_beyond(&whole, &bare.picture, 1e-3, |_| true);
    assert!(
        (0.001..0.02).contains(&share),
        "{:.2} % of the pixels changed with the ball's shadow",
        share * 100.0
    );
}

/// Protects the tests above: each single wrong rule breaks their bound in one of the views.
#[test]
fn a_single_wrong_rule_is_seen() {
    let Some(folder) = shared("reference/noise").filter(|_| carried("noise")) else {
        return;
    };
    type NoiseMistake = (&'static str, fn(&mut Scene));
    let mistakes: [NoiseMistake; 6] = [
        ("one pattern on the ball", |s| {
            edit(&mut classic(s, "ball").colour, "0.4*(", "0.0*(")
        }),
        ("six octaves of clouds", |s| {
            edit(sky(s), "0.03], 8", "0.03], 6")
        }),
        ("a cloud's octaves without their sign", |s| {
            edit(sky(s), "fbm", "turbulence")
        }),
        ("no grazing highlight", |s| {
            classic(s, "water").specular = None
        }),
        ("the rule's own shadow", |s| {
            classic(s, "water").shadow = None
        }),
        ("a ball in Lambert's light", |s| {
            classic(s, "ball").shadow = None
        }),
    ];
    for (label, change) in mistakes {
        let off = VIEWS.map(|(name, t, [x, y], size)| {
            let mut scene = scene("noise", t, &[("mouse_x", x), ("mouse_y", y)]);
            change(&mut scene);
            let (ours, stable) = (
                render_scene(&scene, |s| s.size = size).picture,
                stable_mask(&folder.join(name)),
            );
            share_beyond(
                &ours,
                &read(&folder.join(name).join("color.exr")),
                1.0 / 255.0,
                |i| stable[i],
            )
        });
        eprintln!(
            "{label}: {:.3} % and {:.3} % of stable pixels",
            off[0] * 100.0,
            off[1] * 100.0
        );
        assert!(
            off.iter().any(|&share| share > 0.0005),
            "{label} is not seen"
        );
    }
}

/// Replaces a part of an expression.
fn edit(input: &mut ColourInput, from: &str, to: &str) {
    let ColourInput::Expression(text) = input else {
        panic!("the input is an expression")
    };
    assert!(text.contains(from), "`{from}` is in the expression");
    *text = text.replace(from, to);
}

fn sky(scene: &mut Scene) -> &mut ColourInput {
    match &mut scene.sky {
        Some(Sky::Expression(input)) => input,
        _ => panic!("the sky is an expression"),
    }
}
