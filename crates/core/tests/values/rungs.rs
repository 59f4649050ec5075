//! Rungs of light and sampling against closed forms: hard shadows of lamps, roulette, samplers.

use raywright_core::Settings;
use raywright_core::scene::{Integrator, Scene};
use raywright_core::settings::{AreaShadows, LightSampling, RouletteStart, SamplerKind, Sampling};
use serde_json::{Value, json};

use crate::paths::{AT, lamp, mean_radiance, paths};
use crate::support::{EyeAndTarget, ball, classic, floor, render_scene, scene, settings};

/// A floor under a lamp and a wall half way up, which hides the part of the lamp with x above
/// `edge` from the point of [`AT`]. The view comes from x below the wall.
fn half_hidden(lamp_object: Value, edge: f64) -> Scene {
    let wall = json!({ "shape": { "quad": { "corner": [edge, 1, -9], "edge_u": [9, 0, 0], "edge_v": [0, 0, 18] } }, "material": "wall" });
    let black = json!({ "name": "wall", "model": classic(json!({ "local": 0 })) });
    floor(
        classic(json!({ "colour": 0.6 })),
        json!({ "materials": [lamp(5.0), black], "objects": [lamp_object, wall] }),
    )
}

fn quad_lamp() -> Value {
    json!({ "shape": { "quad": { "corner": [-1, 2, -1], "edge_u": [2, 0, 0], "edge_v": [0, 0, 2] } }, "material": "lamp" })
}

/// A closed lamp above the floor: it hides its own upper side.
fn box_lamp() -> Value {
    json!({ "shape": { "box": { "min": [-1, 2, -1], "max": [1, 2.2, 1] } }, "material": "lamp" })
}

/// Protects: with hard shadows all of a lamp's light arrives where its centre is visible, and none
/// elsewhere, for both integrators and both strategies with light samples, without counting light
/// twice: for lamps sampled by solid angle and by area, flat, round and closed. Soft shadows lie in
/// between.
#[test]
fn hard_shadows_go_by_the_middle() {
    let ball_lamp = || ball([0.0, 2.0, 0.0], 0.8, "lamp");
    for (label, object) in [
        ("quad", quad_lamp()),
        ("ball", ball_lamp()),
        ("box", box_lamp()),
    ] {
        // 20 m away the wall hides nothing; at −0.1 the centre is hidden, at 0.1 visible.
        let [open, hidden, seen] = [20.0, -0.1, 0.1].map(|edge| half_hidden(object.clone(), edge));
        for (integrator, light_sampling) in [
            (Integrator::Path, LightSampling::Both),
            (Integrator::Path, LightSampling::Lights),
            (Integrator::Whitted, LightSampling::Both),
        ] {
            let value_of = |scene: &Scene, area_shadows| {
                mean_radiance(
                    scene,
                    &Settings {
                        integrator,
                        light_sampling,
                        area_shadows,
                        ..paths(scene, AT, 2)
                    },
                )
            };
            let (whole, error) = value_of(&open, AreaShadows::Soft);
            for (scene, share) in [(&open, 1.0), (&hidden, 0.0), (&seen, 1.0)] {
                let (found, noise) = value_of(scene, AreaShadows::Hard);
                let allowed = 3.5 * (error[0].powi(2) + noise[0].powi(2)).sqrt() + 1e-9;
                assert!(
                    (found[0] - share * whole[0]).abs() <= allowed,
                    "{label}, {integrator:?}, {share}: {found:?} of {whole:?}"
                );
            }
            for scene in [&hidden, &seen] {
                let (soft, _) = value_of(scene, AreaShadows::Soft);
                assert!(
                    soft[0] > 0.25 * whole[0] && soft[0] < 0.75 * whole[0],
                    "{label}, {integrator:?}: {soft:?} of {whole:?}"
                );
            }
        }
    }
}

/// Protects: lamps without a usable centre have soft shadows: from inside a box lamp, and for
/// varying emission, which is evaluated at hits. Through a thin wall a lamp is still found by its
/// centre, without occluding itself.
#[test]
fn hard_shadows_have_their_exceptions() {
    let [soft, hard] = [AreaShadows::Soft, AreaShadows::Hard];
    let alike = |scene: &Scene, view: EyeAndTarget, depth: u32, label: &str| {
        let [(a, sa), (b, sb)] = [soft, hard].map(|area_shadows| {
            mean_radiance(
                scene,
                &Settings {
                    area_shadows,
                    ..paths(scene, view, depth)
                },
            )
        });
        let allowed = 3.5 * (sa[0] * sa[0] + sb[0] * sb[0]).sqrt() + 1e-6;
        assert!(
            a[0] > 0.05 && (a[0] - b[0]).abs() <= allowed,
            "{label}: {a:?} ± {sa:?}, hard {b:?} ± {sb:?}"
        );
    };
    let mut room = json!({ "shape": { "box": { "min": [-3, -1, -3], "max": [3, 4, 3] } }, "material": "lamp" });
    room["side"] = json!("inside");
    alike(&half_hidden(room, 0.1), AT, 2, "a box from within");

    let varied = json!({ "name": "lamp", "model": { "classic": { "local": 0, "emission": "vec3(4 + sin(9*p.x))" } } });
    let wall = json!({ "shape": { "quad": { "corner": [-0.1, 1, -9], "edge_u": [9, 0, 0], "edge_v": [0, 0, 18] } }, "material": "wall" });
    let black = json!({ "name": "wall", "model": classic(json!({ "local": 0 })) });
    let parts = json!({ "materials": [varied, black], "objects": [quad_lamp(), wall] });
    alike(
        &floor(classic(json!({ "colour": 0.6 })), parts),
        AT,
        2,
        "a lamp that varies",
    );

    let pane = json!({ "shape": { "quad": { "corner": [-9, 1, -9], "edge_u": [18, 0, 0], "edge_v": [0, 0, 18] } }, "material": "pane" });
    let glass = json!({ "name": "pane", "model": { "physical": { "transmission": 1, "roughness": 0, "thin_walled": true } } });
    let parts = |lamp_object: Value| json!({ "materials": [lamp(5.0), glass.clone()], "objects": [lamp_object, pane.clone()] });
    for (label, object) in [("quad", quad_lamp()), ("box", box_lamp())] {
        alike(
            &floor(classic(json!({ "colour": 0.6 })), parts(object)),
            AT,
            3,
            &format!("{label} behind a pane"),
        );
    }
}

/// Protects: a triangle's centre is a point on it: a lamp of one triangle, with its bounds' centre
/// off it, is hidden by a wall before that point and not by a wall before the bounds' centre.
#[test]
fn a_triangle_has_a_middle_of_its_own() {
    let triangle = |wall: [f64; 2]| {
        let [from, to] = wall;
        let wall = json!({ "shape": { "quad": { "corner": [from, 1, -9], "edge_u": [to - from, 0, 0], "edge_v": [0, 0, 18] } },
            "material": "wall" });
        let black = json!({ "name": "wall", "model": classic(json!({ "local": 0 })) });
        floor(
            classic(json!({ "colour": 0.6 })),
            json!({ "materials": [lamp(5.0), black], "objects": [wall,
                { "shape": { "triangle": { "vertices": [[-1, 2, -1], [1, 2, -1], [-1, 2, 1]] } }, "material": "lamp" }] }),
        )
    };
    let hard = |scene: &Scene| {
        mean_radiance(
            scene,
            &Settings {
                area_shadows: AreaShadows::Hard,
                ..paths(scene, AT, 2)
            },
        )
        .0[0]
    };
    // The bounds' centre is above the origin, the triangle's at x < 0: a wall half way up has half
    // its x.
    let [open, before_bounds, before_itself] =
        [[20.0, 21.0], [-0.02, 0.3], [-0.4, -0.02]].map(|wall| hard(&triangle(wall)));
    assert!(
        open > 0.1 && (before_bounds / open - 1.0).abs() < 0.1 && before_itself == 0.0,
        "{open} {before_bounds} {before_itself}"
    );
}

/// Protects: roulette is unbiased on every rung and only shortens paths: in a closed room of albedo
/// a and emission e, d segments give e·(1 − aᵈ)/(1 − a). Without roulette every path has all its
/// segments; with roulette from the first surface on, 1 + a + a² + … on average; from the third on,
/// where the throughput is a³ and twice that survives, 3 + 2·a³·(1 + a + …).
#[test]
fn roulette_only_saves_time() {
    let wall = classic(json!({ "colour": 0.5, "emission": 0.5 }));
    let mut room = ball([0.0; 3], 2.0, "wall");
    room["side"] = json!("inside");
    let room =
        scene(json!({ "materials": [{ "name": "wall", "model": wall }], "objects": [room] }));
    const DEPTH: u32 = 10;
    let expected = 0.5 * (1.0 - 0.5_f64.powi(DEPTH as i32)) / 0.5;
    for (roulette, segments) in [
        (RouletteStart::Early, 1.998),
        (RouletteStart::Late, 3.496),
        (RouletteStart::Off, 10.0),
    ] {
        let settings = Settings {
            roulette,
            light_sampling: LightSampling::Scattering,
            ..paths(&room, [[0.5, 0.2, 0.3], [0.0, 0.0, -1.0]], DEPTH)
        };
        let (found, error) = mean_radiance(&room, &settings);
        assert!(
            (found[0] - expected).abs() <= 3.5 * error[0] + 1e-4,
            "{roulette:?}: {found:?} instead of {expected}"
        );
        let counters = render_scene(&room, &settings).counters;
        let mean = counters.ray_count() as f64 / counters.camera as f64;
        assert!(
            (mean / segments - 1.0).abs() < 0.02,
            "{roulette:?}: {mean} segments instead of {segments}"
        );
    }
}

/// An edge through the middle of every pixel: half of each is white.
fn edge() -> (Scene, EyeAndTarget) {
    let white = json!({ "classic": { "local": 0, "emission": 1 } });
    let half = json!({ "shape": { "quad": { "corner": [0, 0, -50], "edge_u": [50, 0, 0], "edge_v": [0, 0, 100] } }, "material": "white" });
    (
        scene(json!({ "materials": [{ "name": "white", "model": white }], "objects": [half] })),
        [[0.0, 2.0, 0.0], [0.0; 3]],
    )
}

/// Protects: samplers have their names' properties. Of sixteen samples of an edge through a pixel's
/// middle a 4 × 4 grid has eight on each side in every pixel, and so have Sobol points; independent
/// samples have a standard deviation of a half over √16.
#[test]
fn samplers_are_what_they_are_called() {
    let (scene, view) = edge();
    let value_of = |sampler, seed| {
        let requested = Settings {
            sampler,
            seed,
            sampling: Sampling::General(16),
            replicates: Some(1),
            ..settings(&scene, view)
        };
        f64::from(render_scene(&scene, &requested).picture.rgb[0][0])
    };
    for sampler in [SamplerKind::Stratified, SamplerKind::Sobol] {
        assert!(
            (0..50).all(|seed| value_of(sampler, seed) == 0.5),
            "{sampler:?}"
        );
    }
    let found: Vec<f64> = (0..400)
        .map(|seed| value_of(SamplerKind::Independent, seed))
        .collect();
    let mean = found.iter().sum::<f64>() / 400.0;
    let deviation = (found.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / 400.0).sqrt();
    assert!(
        (mean - 0.5).abs() < 0.02 && (deviation - 0.125).abs() < 0.015,
        "{mean} ± {deviation}"
    );
}
