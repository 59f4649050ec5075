//! The canonical preset, compared with its original shader: every view, linear and display, object
//! ids, and the bounce study.

use raywright::core::picture::Picture;
use raywright::core::prepare;
use raywright::core::scene::{
    ConstantOffset, OffsetDirection, SamplePattern, Scene, ShadowRule, SpawnRule, SpecularModel,
    TransmissionChoice,
};
use raywright::core::settings::{Aov, PrecisionChoice, Sampling, Settings};

use super::{ACES_22, classic, read, render, scene, share_beyond};
use crate::support::{carried, shared};

const VIEWS: [(&str, f64, [u32; 2]); 3] = [
    ("t0_640x360", 0.0, [640, 360]),
    ("t2p5_640x360", 2.5, [640, 360]),
    ("t12_256x256", 12.0, [256, 256]),
];

/// Shares of pixels beyond the bounds of the reference: stable pixels by 1/255, all pixels by
/// 8/255.
fn shares(ours: &Picture, theirs: &Picture, stable: &dyn Fn(usize) -> bool) -> (f64, f64) {
    (
        share_beyond(ours, theirs, 1.0 / 255.0, stable),
        share_beyond(ours, theirs, 8.0 / 255.0, |_| true),
    )
}

/// At most 0.05 % of the stable pixels and 1.5 % of all may exceed the bounds.
fn within((tight, loose): (f64, f64)) -> bool {
    tight <= 0.0005 && loose <= 0.015
}

fn check(label: &str, ours: &Picture, theirs: &Picture, stable: &dyn Fn(usize) -> bool) {
    let found = shares(ours, theirs, stable);
    let text = format!(
        "{label}: {:.4} % of stable pixels off by > 1/255, {:.3} % of all by > 8/255",
        found.0 * 100.0,
        found.1 * 100.0
    );
    eprintln!("{text}");
    assert!(within(found), "{text}");
}

/// Protects: every rule and constant of the preset, in linear and display values, and the object in
/// each pixel.
fn views(precision: PrecisionChoice) {
    let Some(folder) = shared("reference/whitted").filter(|_| carried("whitted")) else {
        return;
    };
    for (name, t, size) in VIEWS {
        let folder = folder.join(name);
        let mask = read(&folder.join("stable.png"));
        let stable = |i: usize| mask.rgb[i][0] > 0.5;
        let ours = render("whitted", t, &[], |s| {
            s.size = size;
            s.precision = precision;
            s.aovs = vec![Aov::Object];
        })
        .picture;
        check(
            &format!("{name} linear"),
            &ours,
            &read(&folder.join("linear.exr")),
            &stable,
        );
        check(
            &format!("{name} linear f64"),
            &ours,
            &read(&folder.join("linear_f64.exr")),
            &stable,
        );
        check(
            &format!("{name} display"),
            &ACES_22.to_display_values(&ours),
            &read(&folder.join("final.exr")),
            &stable,
        );
        let ids = |p: &Picture, layer: &str| {
            p.layer(layer)
                .unwrap_or_else(|| panic!("no layer {layer}"))
                .samples
                .clone()
        };
        let (ours, theirs) = (
            ids(&ours, "object.id"),
            ids(&read(&folder.join("aov.exr")), "object"),
        );
        let judged = ours
            .iter()
            .zip(&theirs)
            .enumerate()
            .filter(|(i, _)| stable(*i));
        let (wrong, all) = judged.fold((0, 0), |(wrong, all), (_, (a, b))| {
            (wrong + u32::from(a != b), all + 1)
        });
        assert!(
            f64::from(wrong) <= 1e-4 * f64::from(all),
            "{name}: {wrong} of {all} stable pixels see another object"
        );
    }
}

/// Protects: every view of the canonical preset equals the shader's picture, pixel by pixel, in
/// `robust`.
#[test]
fn every_view_robust() {
    views(PrecisionChoice::Robust);
}

/// Protects: the same in `reference`.
#[test]
fn every_view_reference() {
    views(PrecisionChoice::Reference);
}

/// Protects: the count of `--max-depth`, and that energy beyond it is dropped.
#[test]
fn bounce_study() {
    let Some(folder) = shared("reference/whitted").filter(|_| carried("whitted")) else {
        return;
    };
    for depth in [1, 2, 3, 4, 8] {
        let ours = render("whitted", 2.5, &[], |s| {
            s.size = [320, 180];
            s.max_depth = depth;
        });
        let theirs = read(&folder.join(format!("bounces_t2p5_320x180/linear_b{depth}.exr")));
        check(&format!("depth {depth}"), &ours.picture, &theirs, &|_| {
            false
        });
    }
}

/// Mean of the four quarter points of each pixel: a picture of twice the size, sampled at its pixel
/// centres.
fn quarter_points(t: f64, [width, height]: [u32; 2]) -> Picture {
    let fine = render("whitted", t, &[], |s| {
        s.size = [2 * width, 2 * height];
        s.sampling = Sampling::Pattern(SamplePattern::Centre);
    });
    let mut coarse = Picture::new(width, height);
    for (i, pixel) in coarse.rgb.iter_mut().enumerate() {
        let (x, y) = (2 * (i as u32 % width), 2 * (i as u32 / width));
        let four = [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)]
            .map(|(x, y)| fine.picture.pixel(x, y).unwrap_or_default());
        *pixel = std::array::from_fn(|k| four.iter().map(|p| p[k]).sum::<f32>() / 4.0);
    }
    coarse
}

/// Protects the tests above: each single wrong rule listed by the reference breaks its bounds in at
/// least one view.
#[test]
fn a_single_wrong_rule_is_seen() {
    let Some(folder) = shared("reference/whitted").filter(|_| carried("whitted")) else {
        return;
    };
    type WhittedMistake = (&'static str, fn(&mut Scene));
    let mistakes: [WhittedMistake; 5] = [
        ("the product of the occluders", |s| {
            s.classic.shadow = ShadowRule::Product
        }),
        ("an offset of 1e-5", |s| {
            let d = 1e-5;
            let along = OffsetDirection::Normal;
            let constants = ConstantOffset {
                offset: d,
                along,
                camera_min: d,
                secondary_min: d,
                shadow_min: d,
            };
            s.classic.spawn = SpawnRule::Constant(constants);
        }),
        ("no Fresnel switch", |s| {
            let glass = classic(s, "glass")
                .transmission
                .as_mut()
                .expect("glass transmits");
            glass.choice = TransmissionChoice::Switch { threshold: 2.0 };
        }),
        ("no fuzz", |s| {
            classic(s, "gold")
                .reflection
                .as_mut()
                .expect("gold reflects")
                .fuzz = None
        }),
        ("the incoming direction in the mirror's highlight", |s| {
            classic(s, "mirror")
                .specular
                .as_mut()
                .expect("the mirror shines")
                .model = SpecularModel::Blinn;
        }),
    ];
    let seen = |make: &dyn Fn(f64, [u32; 2]) -> Picture| {
        let fails = |&(name, t, size): &(&str, f64, [u32; 2])| {
            let folder = folder.join(name);
            let mask = read(&folder.join("stable.png"));
            let ours = ACES_22.to_display_values(&make(t, size));
            let found = shares(&ours, &read(&folder.join("final.exr")), &|i| {
                mask.rgb[i][0] > 0.5
            });
            eprintln!(
                "    {name}: {:.3} % of stable pixels, {:.3} % of all",
                found.0 * 100.0,
                found.1 * 100.0
            );
            !within(found)
        };
        VIEWS.iter().filter(|view| fails(view)).count() > 0
    };
    eprintln!("quarter points in place of corners");
    assert!(seen(&quarter_points), "quarter points are not seen");
    for (name, change) in mistakes {
        eprintln!("{name}");
        let make = |t: f64, size: [u32; 2]| {
            let mut scene = scene("whitted", t, &[]);
            change(&mut scene);
            let settings = Settings {
                size,
                ..Settings::from_scene(&scene)
            };
            prepare(&scene, &settings, &())
                .unwrap_or_else(|e| panic!("{e}"))
                .render(&())
                .picture
        };
        assert!(seen(&make), "{name} is not seen");
    }
}
