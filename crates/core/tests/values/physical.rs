//! The metallic-roughness model under one light: Lambert and GGX in textbook form.

use core::f64::consts::PI;

use glam::DVec3;
use raywright_core::effects::EffectStatus::Simulated;
use raywright_core::effects::{Effect, EffectSet, assess_effects};
use raywright_core::material::FresnelRule;
use raywright_core::scene::Integrator;
use raywright_core::settings::{MicrofacetEnergy, PrecisionChoice};
use raywright_core::{Scene, Settings, prepare};
use serde_json::{Value, json};

use crate::support::{
    DOWN, EyeAndTarget, SLANTED, Surface, ball, expect_near, expect_pixel, expect_pixel_within,
    floor, physical, pixel, render_scene, settings,
};

/// A floor of a physical material under directional light of irradiance π.
fn lit(terms: Value, to_light: [f64; 3]) -> raywright_core::Scene {
    let light = json!({ "kind": { "directional": { "to_light": to_light } }, "colour": PI });
    floor(physical(terms), json!({ "lights": [light] }))
}

const UP: [f64; 3] = [0.0, 1.0, 0.0];

/// Diffuse reflection of a grey dielectric straight back to a light straight above: the whole less
/// the microfacets' part.
fn below(base: f64, roughness: f64, f0: f64) -> f64 {
    Surface::dielectric(base, roughness, f0).sends([DVec3::Y; 3], true)[0]
        - f0 / (4.0 * roughness.max(0.03).powi(4))
}

/// Protects: at normal incidence D = 1/(π α²), V = ¼ and F = F0, so microfacets reflect F0/(4 α²)
/// with α = roughness². The base receives no more than they leave: base · (1 − F0), less their
/// reflection at other angles.
#[test]
fn values_at_normal_incidence() {
    for (base, roughness, f0) in [
        (0.5, 1.0, 0.04),
        (0.5, 0.5, 0.04),
        (0.5, 0.1, 0.04),
        (0.9, 0.5, 1.0 / 9.0),
    ] {
        let found = below(base, roughness, f0);
        assert!(
            (found - base * (1.0 - f0)).abs() < 0.06 * base,
            "{found} below facets of {f0}"
        );
    }
    let dielectric =
        |roughness: f64| lit(json!({ "base_colour": 0.5, "roughness": roughness }), UP);
    expect_pixel(&dielectric(1.0), DOWN, [below(0.5, 1.0, 0.04) + 0.01; 3]);
    expect_pixel(&dielectric(0.5), DOWN, [below(0.5, 0.5, 0.04) + 0.16; 3]);
    expect_pixel(&dielectric(0.1), DOWN, [below(0.5, 0.1, 0.04) + 100.0; 3]);
    // Highlights of delta lights are limited to the least roughness of 0.03.
    let minimum = 0.04 / 4.0 / f64::powi(0.03, 4);
    expect_pixel(
        &dielectric(0.02),
        DOWN,
        [below(0.5, 0.02, 0.04) + minimum; 3],
    );
    let metal = Surface {
        base: [1.0, 0.5, 0.25],
        metallic: 1.0,
        roughness: 0.5,
        f0: 0.04,
    };
    expect_pixel(
        &lit(
            json!({ "base_colour": [1, 0.5, 0.25], "metallic": 1, "roughness": 0.5 }),
            UP,
        ),
        DOWN,
        metal.sends([DVec3::Y; 3], true),
    );
    // F0 = ((2 − 1)/(2 + 1))² = 1/9; at ior 1 it is zero.
    expect_pixel(
        &lit(
            json!({ "base_colour": 0.9, "ior": 2, "roughness": 0.5 }),
            UP,
        ),
        DOWN,
        [below(0.9, 0.5, 1.0 / 9.0) + 4.0 / 9.0; 3],
    );
    expect_pixel(
        &lit(json!({ "base_colour": 0.5, "ior": 1 }), UP),
        DOWN,
        [below(0.5, 1.0, 0.0); 3],
    );
}

/// Protects: half a metal is the mean of a dielectric and a metal.
#[test]
fn metalness_blends() {
    let found = |base: f64| {
        let value_of = |metallic: f64| {
            Surface {
                base: [base; 3],
                metallic,
                roughness: 0.5,
                f0: 0.04,
            }
            .sends([DVec3::Y; 3], true)[0]
        };
        assert!((value_of(0.5) - 0.5 * (value_of(0.0) + value_of(1.0))).abs() < 1e-12);
        value_of(0.5)
    };
    let terms = json!({ "base_colour": [1, 0.5, 0.25], "metallic": 0.5, "roughness": 0.5 });
    expect_pixel(&lit(terms, UP), DOWN, [found(1.0), found(0.5), found(0.25)]);
}

/// The textbook form: D = α²/(π((n·h)²(α² − 1) + 1)²), height-correlated V, Schlick's F, for a base
/// colour and F0, with n·l under irradiance π.
fn textbook(base: f64, f0: f64, roughness: f64, l: [f64; 3], v: [f64; 3]) -> f64 {
    dimmed(base, [f0, 1.0], roughness, l, v)
}

/// The textbook form with reflectance from F0 to F90.
fn dimmed(base: f64, [f0, f90]: [f64; 2], roughness: f64, l: [f64; 3], v: [f64; 3]) -> f64 {
    let h: [f64; 3] = core::array::from_fn(|i| l[i] + v[i]);
    let length = h.iter().map(|x| x * x).sum::<f64>().sqrt();
    let (nl, nv, nh) = (l[1], v[1], h[1] / length);
    let vh = (0..3).map(|i| v[i] * h[i]).sum::<f64>() / length;
    let a2 = roughness.powi(4);
    let d = a2 / (PI * (nh * nh * (a2 - 1.0) + 1.0).powi(2));
    let smith = |c: f64| (c * c * (1.0 - a2) + a2).sqrt();
    let visibility = 0.5 / (nl * smith(nv) + nv * smith(nl));
    let f = f0 + (f90 - f0) * (1.0 - vh).powi(5);
    PI * (base * (1.0 - f) / PI + f * d * visibility) * nl
}

/// Protects: the whole lobe off the normal, in and out of the plane of incidence, up to grazing
/// angles, at several roughnesses.
#[test]
fn values_off_the_normal() {
    let views: [EyeAndTarget; 3] = [
        SLANTED,
        [[4.0, 3.0, 0.0], [0.0; 3]],
        [[-2.0, 1.0, 2.0], [0.0; 3]],
    ];
    for [eye, target] in views {
        let distance = eye.iter().map(|x| x * x).sum::<f64>().sqrt();
        let v = eye.map(|x| x / distance);
        for l in [
            [-0.6, 0.8, 0.0],
            [0.0, 0.6, 0.8],
            [-2.0 / 3.0, 1.0 / 3.0, -2.0 / 3.0],
            [0.96, 0.28, 0.0],
        ] {
            for roughness in [0.2, 0.5, 0.9] {
                let dielectric = json!({ "base_colour": 0.5, "roughness": roughness });
                // The microfacets by the textbook; the rest is the base's share, a part of the base
                // colour.
                let sends = |metallic: f64| {
                    let surface = Surface {
                        metallic,
                        ..Surface::dielectric(0.5, roughness, 0.04)
                    };
                    let whole = surface.sends([DVec3::Y, l.into(), v.into()], true);
                    let rest = whole[0]
                        - textbook(
                            0.0,
                            if metallic > 0.0 { 0.5 } else { 0.04 },
                            roughness,
                            l,
                            v,
                        );
                    assert!(
                        (-1e-9..0.55 * l[1]).contains(&rest),
                        "{rest} besides facets"
                    );
                    whole
                };
                expect_pixel_within(&lit(dielectric, l), [eye, target], sends(0.0), 1e-4);
                let metal = json!({ "base_colour": 0.5, "metallic": 1, "roughness": roughness });
                expect_pixel_within(&lit(metal, l), [eye, target], sends(1.0), 1e-4);
            }
        }
    }
    // In numbers: l and v mirror each other at cosine 0.8, α = 1/4: D = 16/π, V = ½/(1.6 · √(0.64 ·
    // 15/16 + 1/16)).
    let smith = f64::sqrt(0.64 * 0.9375 + 0.0625);
    let f = 0.04 + 0.96 * 0.2_f64.powi(5);
    let (l, v) = (DVec3::new(-0.6, 0.8, 0.0), DVec3::new(0.6, 0.8, 0.0));
    let [black, grey] = [0.0, 0.5]
        .map(|base| Surface::dielectric(base, 0.5, 0.04).sends([DVec3::Y, l, v], true)[0]);
    let facets = 0.8 * f * 16.0 * 0.5 / (1.6 * smith);
    assert!(
        (black - facets).abs() < 1e-12,
        "{black} of facets that send {facets}"
    );
    expect_pixel(
        &lit(
            json!({ "base_colour": 0.5, "roughness": 0.5 }),
            [-0.6, 0.8, 0.0],
        ),
        SLANTED,
        [grey; 3],
    );
}

/// Settings for paths of two segments along one ray.
fn straight(scene: &Scene, view: EyeAndTarget) -> Settings {
    Settings {
        integrator: Integrator::Path,
        max_depth: 2,
        ..settings(scene, view)
    }
}

/// Asserts a path tracer's radiance for single scattering of microfacets: to a picture's digits in
/// `f64`, and within a wider tolerance in `f32`, where surfaces are shaded several at a time.
#[track_caller]
fn traced(scene: &Scene, view: EyeAndTarget, without: EffectSet, expected: f64, label: &str) {
    for (precision, tolerance) in [
        (PrecisionChoice::Reference, 1e-6),
        (PrecisionChoice::Robust, 1e-4),
    ] {
        let settings = Settings {
            microfacets: MicrofacetEnergy::Single,
            fresnel: FresnelRule::Model,
            without,
            precision,
            ..straight(scene, view)
        };
        expect_near(
            pixel(scene, &settings),
            [expected; 3],
            tolerance,
            &format!("{label}, {precision:?}"),
        );
    }
}

/// Protects: a factor on reflections scales the dielectric reflectance, at normal incidence and at
/// grazing, and dims the base accordingly: a factor of zero leaves Lambert's base · n·l. The metal
/// part ignores the factor.
#[test]
fn factors_dim_reflections_alone() {
    // View and light on opposite sides, at grazing Fresnel: v·h is 0.28.
    for (v, l) in [
        ([0.0, 1.0, 0.0], UP),
        ([0.8, 0.6, 0.0], [-0.6, 0.8, 0.0]),
        ([0.96, 0.28, 0.0], [-0.96, 0.28, 0.0]),
    ] {
        for (factor, metallic) in [(0.0, 0.0), (0.5, 0.0), (0.3, 0.6), (1.0, 0.0)] {
            let terms = json!({ "base_colour": 0.5, "roughness": 0.7, "specular": factor, "metallic": metallic });
            let (lit, view) = (lit(terms, l), [v.map(|x: f64| 3.0 * x), [0.0; 3]]);
            let between = |dielectric: f64, metal: f64| {
                dielectric * factor * (1.0 - metallic) + metal * metallic
            };
            let expected = dimmed(
                0.5 * (1.0 - metallic),
                [between(0.04, 0.5), between(1.0, 1.0)],
                0.7,
                l,
                v,
            );
            traced(
                &lit,
                view,
                EffectSet::EMPTY,
                expected,
                &format!("{factor}, {metallic}, from {v:?}"),
            );
            if factor == 0.0 {
                traced(&lit, view, EffectSet::EMPTY, 0.5 * l[1], "Lambert");
            }
        }
    }
}

/// Protects: factors on reflections act the same in a scene of bodies with priorities, where each
/// surface checks its medium: here, none.
#[test]
fn factors_dim_reflections_beside_bodies() {
    let glass = |name: &str, priority: u32| json!({ "name": name, "model": physical(json!({ "transmission": 1, "roughness": 0, "priority": priority })) });
    let light =
        json!({ "kind": { "directional": { "to_light": [-0.96, 0.28, 0.0] } }, "colour": PI });
    let scene = floor(
        physical(json!({ "base_colour": 0.5, "roughness": 0.7, "specular": 0.3 })),
        json!({ "lights": [light], "materials": [glass("cup", 2), glass("tea", 1)],
            "objects": [ball([0.0, 50.0, 9.0], 1.0, "cup"), ball([0.5, 50.0, 9.0], 1.0, "tea")] }),
    );
    let view = [[0.96, 0.28, 0.0], [0.0; 3]];
    let told = assess_effects(&scene, &straight(&scene, view)).status(Effect::NestedMedia);
    assert_eq!(told, Simulated);
    let expected = dimmed(
        0.5,
        [0.012, 0.3],
        0.7,
        [-0.96, 0.28, 0.0],
        [0.96, 0.28, 0.0],
    );
    traced(&scene, view, EffectSet::EMPTY, expected, "beside bodies");
    traced(
        &scene,
        view,
        EffectSet::from_effects(&[Effect::NestedMedia]),
        expected,
        "beside bodies that are not told apart",
    );
}

/// Protects: a factor on reflections needs layers only on glass, whose boundary then reflects less;
/// and never in Whitted's integrator, which leaves it out.
#[test]
fn where_factors_are_layers() {
    let layers = |terms: Value| {
        let scene = lit(terms, UP);
        prepare(&scene, &straight(&scene, DOWN), &())
            .expect("it can be prepared")
            .table_sizes()
            .layered
    };
    assert_eq!(layers(json!({ "specular": 0.5 })), 0);
    assert_eq!(
        layers(json!({ "specular": 0.5, "transmission": 1, "roughness": 0 })),
        1
    );
    assert_eq!(layers(json!({ "transmission": 1, "roughness": 0 })), 0);
    expect_pixel(
        &lit(
            json!({ "base_colour": 0.5, "roughness": 0.5, "specular": 0 }),
            UP,
        ),
        DOWN,
        [below(0.5, 0.5, 0.04) + 0.16; 3],
    );
}

/// Protects: light from behind a surface has no effect, and highlights are omitted by a light's
/// setting or a shadow.
#[test]
fn what_does_not_reach_a_surface() {
    expect_pixel(
        &lit(json!({ "base_colour": 0.5 }), [0.0, -1.0, 0.0]),
        DOWN,
        [0.0; 3],
    );
    let mut dull = lit(json!({ "base_colour": 0.5, "roughness": 0.5 }), UP);
    dull.lights[0].specular = false;
    expect_pixel(
        &dull,
        DOWN,
        Surface::dielectric(0.5, 0.5, 0.04).sends([DVec3::Y; 3], false),
    );
}

/// Protects: shadows dim physical surfaces if the light casts them.
#[test]
fn shadows_dim_physical_surfaces() {
    let light = |shadows: bool| json!({ "kind": { "directional": { "to_light": UP } }, "colour": PI, "shadows": shadows });
    let veil = json!({ "name": "veil", "model": { "classic": { "shadow_transmittance": 0.25 } } });
    let scene = |shadows| {
        floor(
            physical(json!({ "base_colour": 0.5, "ior": 1 })),
            json!({ "lights": [light(shadows)], "materials": [veil],
            "objects": [crate::support::ball([0.0, 3.0, 0.0], 0.5, "veil")] }),
        )
    };
    let dull = |shadows| {
        let mut scene = scene(shadows);
        scene.lights[0].specular = false;
        scene
    };
    let lit = Surface::dielectric(0.5, 1.0, 0.0)
        .sends([DVec3::Y, DVec3::Y, DVec3::new(0.6, 0.8, 0.0)], false);
    expect_pixel(&dull(true), SLANTED, lit.map(|x| 0.25 * x));
    expect_pixel(&dull(false), SLANTED, lit);
}

/// Protects: emission is added to the other light, and an unlit surface shows its base colour
/// alone.
#[test]
fn emission_and_unlit_surfaces() {
    expect_pixel(
        &lit(json!({ "base_colour": 0.5, "emission": [3, 2, 1] }), UP),
        DOWN,
        [3.0, 2.0, 1.0].map(|glow| glow + 0.01 + below(0.5, 1.0, 0.04)),
    );
    expect_pixel(
        &lit(
            json!({ "base_colour": [0.5, 0.25, 2], "unlit": true, "emission": [3, 2, 1] }),
            UP,
        ),
        DOWN,
        [0.5, 0.25, 2.0],
    );
}

/// Protects: no field of an unlit material besides base colour and alpha changes any bit of a
/// picture (KHR_materials_unlit): it lights nothing, transmits nothing and casts the same shadow,
/// with either integrator.
#[test]
fn unlit_surfaces_are_their_base_colour_alone() {
    for integrator in [Integrator::Whitted, Integrator::Path] {
        let picture = |terms: Value| {
            let mut all = json!({ "base_colour": [0, 0, 1], "unlit": true });
            terms
                .as_object()
                .into_iter()
                .flatten()
                .for_each(|(key, value)| all[key] = value.clone());
            let light = json!({ "kind": { "point": { "position": [0.5, 4, 0] } }, "colour": 30 });
            let ball = ball([0.0, 1.0, 0.0], 0.5, "unlit");
            let scene = floor(
                physical(json!({ "base_colour": 0.8 })),
                json!({ "lights": [light], "materials": [{ "name": "unlit", "model": physical(all) }], "objects": [ball] }),
            );
            let view = settings(&scene, [[3.0, 4.0, 0.0], [0.0, 0.5, 0.0]]);
            let sampling = raywright_core::settings::Sampling::General(16);
            render_scene(
                &scene,
                &Settings {
                    size: [12, 12],
                    integrator,
                    sampling,
                    precision: PrecisionChoice::Robust,
                    ..view
                },
            )
            .picture
            .rgb
        };
        let plain = picture(json!({}));
        assert!(plain.contains(&[0.0, 0.0, 1.0]), "the ball is seen");
        for (key, value) in [
            ("emission", json!([4, 0, 0])),
            ("metallic", json!(1)),
            ("roughness", json!(0)),
            ("normal_scale", json!(3)),
            ("ior", json!(2)),
            ("ior", json!(0)),
            ("transmission", json!(1)),
            ("specular", json!(0.5)),
            ("specular_colour", json!([9, 0, 0])),
            ("dispersion", json!(5)),
            ("conductor", json!({ "n": 2, "k": 3 })),
            ("diffuse_transmission", json!({ "factor": 1 })),
            ("anisotropy", json!({ "strength": 1 })),
            ("iridescence", json!({ "factor": 1 })),
            ("sheen", json!({ "colour": 1 })),
            ("clearcoat", json!({ "factor": 1 })),
        ] {
            assert!(
                picture(json!({ key: value })) == plain,
                "{key} by {integrator:?}"
            );
        }
        for (key, value) in [
            ("thin_walled", json!(true)),
            ("priority", json!(3)),
            ("attenuation_distance", json!(0.1)),
        ] {
            let terms = json!({ key: value, "transmission": 1, "attenuation_colour": 0.5, "emission": 1, "roughness": 0 });
            assert!(picture(terms) == plain, "{key} by {integrator:?}");
        }
    }
}
