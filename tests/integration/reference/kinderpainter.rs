//! The preset of the round textured room, compared with its original shader.

use raywright::core::Scene;
use raywright::core::scene::{
    ColourSpace, ConstantOffset, DepthLimit, Falloff, LightKind, OffsetDirection, SideRule,
    SpawnRule,
};
use raywright::core::settings::{Aov, PrecisionChoice};

use super::{
    classic, hold_stable, object_ids, read, render, render_scene, scene, share_beyond, stable_mask,
};
use crate::support::{carried, shared};

/// Folder, parameter, and indices of the scene's objects in the reference's order: column and wall
/// change places in its second set.
const SETS: [(&str, f64, [f32; 6]); 2] = [
    ("set_a", 0.0, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]),
    ("set_b", 1.0, [0.0, 1.0, 3.0, 2.0, 4.0, 5.0]),
];

/// Protects: near and far roots by side, texture coordinates by expression, weights by the angle of
/// view, unshadowed highlights, rays without offset, and the local colour at the end of the only
/// bounce.
fn sets(precision: PrecisionChoice) {
    let Some(folder) = shared("reference/kinderpainter").filter(|_| carried("kinderpainter"))
    else {
        return;
    };
    for (name, b, order) in SETS {
        let folder = folder.join(name);
        let stable = stable_mask(&folder);
        let ours = render("kinderpainter", 0.0, &[("b", b)], |s| {
            s.precision = precision;
            s.aovs = vec![Aov::Object];
        })
        .picture;
        for file in ["color.exr", "color_f64.exr"] {
            hold_stable(
                &format!("kinderpainter {name} {file}"),
                &ours,
                &read(&folder.join(file)),
                &stable,
                0.0002,
            );
        }
        let (ours, theirs) = (
            object_ids(&ours, "object.id"),
            object_ids(&read(&folder.join("aov.exr")), "object"),
        );
        let wrong = (0..ours.len())
            .filter(|&i| stable[i] && order.get(ours[i] as usize) != Some(&theirs[i]))
            .count();
        assert_eq!(wrong, 0, "{name}: stable pixels that see another object");
    }
}

/// Protects: both sets of the preset equal the pictures of the original program, pixel by pixel, in
/// `robust`.
#[test]
fn both_sets_robust() {
    sets(PrecisionChoice::Robust);
}

/// Protects: the same in `reference`.
#[test]
fn both_sets_reference() {
    sets(PrecisionChoice::Reference);
}

/// Protects the tests above: each single wrong rule breaks their bound in one of the sets.
#[test]
fn a_single_wrong_rule_is_seen() {
    let Some(folder) = shared("reference/kinderpainter").filter(|_| carried("kinderpainter"))
    else {
        return;
    };
    type KinderpainterMistake = (&'static str, fn(&mut Scene));
    let mistakes: [KinderpainterMistake; 8] = [
        ("nothing at the end of the bounce", |s| {
            s.classic.depth_limit = DepthLimit::Drop
        }),
        ("mirrored rays from distance zero", |s| {
            s.classic.spawn = SpawnRule::Constant(ConstantOffset {
                offset: 0.0,
                along: OffsetDirection::Normal,
                camera_min: 0.0,
                secondary_min: 0.0,
                shadow_min: 0.0,
            });
        }),
        ("a light that weakens", |s| {
            let LightKind::Point { falloff, .. } = &mut s.lights[0].kind else {
                panic!("the light is a point")
            };
            *falloff = Falloff::InverseSquare;
        }),
        ("shadowed highlights", |s| {
            classic(s, "floor")
                .specular
                .as_mut()
                .expect("the floor shines")
                .shadowed = true
        }),
        ("the rim's exponent", |s| {
            classic(s, "wall")
                .rim
                .as_mut()
                .expect("the wall has a rim")
                .exponent = 1
        }),
        ("a tinted reflection", |s| {
            classic(s, "column")
                .reflection
                .as_mut()
                .expect("the column reflects")
                .tinted = true
        }),
        ("the wall from outside", |s| {
            s.objects[3].side = SideRule::Outside
        }),
        ("decoded texels", |s| {
            s.textures[0].colour_space = ColourSpace::Srgb
        }),
    ];
    for (label, change) in mistakes {
        let off = SETS.map(|(name, b, _)| {
            let mut scene = scene("kinderpainter", 0.0, &[("b", b)]);
            change(&mut scene);
            let (ours, stable) = (
                render_scene(&scene, |_| {}).picture,
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
            off.iter().any(|&share| share > 0.0002),
            "{label} is not seen"
        );
    }
}
