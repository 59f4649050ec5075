//! Light that scatters on its way: bodies and air against closed forms. Beer's law, furnaces,
//! Chandrasekhar's H functions, the airlight of a lamp, and densities by formula.

use core::f64::consts::{PI, TAU};

use glam::DVec3;
use raywright_core::Settings;
use raywright_core::scene::Scene;
use raywright_core::settings::{Aov, LightSampling, PrecisionChoice, Sampling};
use serde_json::{Value, json};

use crate::paths::{expect_pixels, lamp, mean_radiance, paths};
use crate::support::{EyeAndTarget, ball, physical, render_scene, scene};

/// Tolerance in standard errors.
const ERRORS: f64 = 4.0;

/// A body with a medium inside, and further terms of its material.
fn body(name: &str, medium: Value, terms: Value) -> Value {
    let mut model = json!({ "interior": medium, "transmission": 1, "roughness": 0 });
    let all = model.as_object_mut().expect("a table");
    all.extend(terms.as_object().expect("a table").clone());
    json!({ "name": name, "model": physical(model) })
}

/// The terms of a body without a surface.
fn open() -> Value {
    json!({ "boundary": "none", "transmission": 0 })
}

/// Settings for paths that chance alone ends.
fn endless(scene: &Scene, view: EyeAndTarget) -> Settings {
    Settings {
        size: [48; 2],
        ..paths(scene, view, Settings::UNLIMITED)
    }
}

/// Asserts a radiance within four standard errors and a relative error, and a standard error below
/// one per cent.
#[track_caller]
fn expect_mean(scene: &Scene, settings: &Settings, expected: [f64; 3], off: f64, label: &str) {
    let (found, error) = mean_radiance(scene, settings);
    for k in 0..3 {
        let most = ERRORS * error[k] + off * expected[k] + 1e-6;
        assert!(
            (found[k] - expected[k]).abs() <= most && error[k] <= 0.01 * expected[k] + 1e-6,
            "{label}: {found:?} instead of {expected:?}, errors {error:?}"
        );
    }
}

/// A view onto the centre from outside a ball of radius one.
const ONTO: EyeAndTarget = [[0.3, 0.5, 3.0], [0.2, 0.1, 0.0]];

fn furnace(medium: Value, terms: Value) -> Scene {
    scene(
        json!({ "sky": { "constant": 1 }, "materials": [body("body", medium, terms)],
        "objects": [ball([0.0; 3], 1.0, "body")] }),
    )
}

/// Protects: a body that absorbs nothing returns all light, whatever its phase function, boundary
/// and thickness. One channel alone may scatter.
#[test]
fn bodies_without_absorption_keep_all_light() {
    let clear = json!({ "ior": 1.5 });
    for (scattering, anisotropy, terms) in [
        (json!([0.01, 1, 5]), 0.0, open()),
        (json!(2), -0.9, open()),
        (json!([0, 30, 0]), 0.999, open()),
        (json!([1e-9, 3, 1e3]), 0.9, open()),
        (json!(50), 0.6, clear.clone()),
        (json!([3, 0, 8]), -0.5, clear),
        (json!(5), 0.3, json!({ "ior": 1, "roughness": 0 })),
        (
            json!([4, 20, 0]),
            0.0,
            json!({ "ior": 1.5, "roughness": 0.4 }),
        ),
        (
            json!([2, 9, 40]),
            -0.999,
            json!({ "transmission": 0, "ior": 1, "specular": 0, "diffuse_transmission": { "factor": 0.7 } }),
        ),
    ] {
        let label = format!("{scattering}, {anisotropy}, {terms}");
        let medium = json!({ "scattering": scattering, "anisotropy": anisotropy });
        let found = furnace(medium, terms);
        let settings = Settings {
            size: [20; 2],
            ..endless(&found, ONTO)
        };
        expect_mean(&found, &settings, [1.0; 3], 2e-3, &label);
    }
}

/// Protects: a body a thousand mean free paths thick loses no path: neither at its boundary, where
/// steps are as short as rounding allows, nor on the way.
#[test]
fn a_thousand_mean_free_paths() {
    for (scattering, size, terms) in [(500, 6, open()), (500, 8, json!({ "ior": 1.3 }))] {
        let found = furnace(json!({ "scattering": scattering }), terms);
        let settings = Settings {
            size: [size; 2],
            ..endless(&found, ONTO)
        };
        let output = render_scene(&found, &settings);
        assert_eq!((output.counters.dropped, output.counters.cut_short), (0, 0));
        expect_mean(&found, &settings, [1.0; 3], 2e-3, "thick");
    }
}

/// Protects: bodies of every kind keep all light: boxes and rings, moved instances of a mesh, five
/// bodies one in another, a hundred thousand of them, and a medium of nothing.
#[test]
fn bodies_of_every_kind_keep_all_light() {
    let under_sky = |mut parts: Value| {
        parts["sky"] = json!({ "constant": 1 });
        scene(parts)
    };
    let white = |rate: f64| json!({ "scattering": [rate, 2.0 * rate, 0], "anisotropy": 0.4 });
    let of = |shape: Value| json!({ "shape": shape, "material": "body" });
    let shapes = [
        of(json!({ "box": { "min": [-1, -0.4, -0.6], "max": [1, 0.5, 0.6] } })),
        of(
            json!({ "torus": { "centre": [0.2, 0.1, 0], "axis": [0.1, 0.2, 1], "major_radius": 0.3, "minor_radius": 0.2 } }),
        ),
    ];
    let inline = json!({ "positions": [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]],
        "indices": [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]] });
    let instance = |x: f64, turn: f64| {
        json!({ "shape": { "mesh": "octahedron" }, "material": "body",
        "transform": [{ "scale": [0.6, 0.5, 0.7] }, { "rotate": { "axis": [1, 2, 3], "degrees": turn } }, { "translate": [x, 0.1, 0] }] })
    };
    let shells: Vec<_> = (0..5)
        .map(|k| {
            let surface = json!({ "ior": 1.0 + 0.1 * f64::from(k), "priority": k });
            body(
                &format!("shell {k}"),
                white(f64::from(5 - k)),
                if k % 2 == 0 { open() } else { surface },
            )
        })
        .collect();
    let nested: Vec<_> = (0..5)
        .map(|k| {
            ball(
                [0.05 * f64::from(k), 0.0, 0.0],
                1.0 - 0.2 * f64::from(k),
                &format!("shell {k}"),
            )
        })
        .collect();
    let crowd = json!([{ "kind": { "grid": { "counts": [47, 47, 47], "origin": [-1, -1, -1], "step": [0.043, 0.043, 0.043] } },
        "object": ball([0.0; 3], 0.02, "body") }]);
    let clear = || json!([body("body", white(7.0), json!({ "ior": 1.4 }))]);
    let cloud = |medium: Value| json!([body("body", medium, open())]);
    for (label, found) in [
        (
            "box",
            under_sky(json!({ "materials": clear(), "objects": [shapes[0]] })),
        ),
        (
            "ring",
            under_sky(json!({ "materials": clear(), "objects": [shapes[1]] })),
        ),
        (
            "instances",
            under_sky(
                json!({ "materials": clear(), "meshes": [{ "name": "octahedron", "source": { "inline": inline } }],
            "objects": [instance(0.0, 20.0), instance(-1.5, 70.0)] }),
            ),
        ),
        (
            "shells",
            under_sky(json!({ "materials": shells, "objects": nested })),
        ),
        (
            "crowd",
            under_sky(
                json!({ "materials": cloud(white(9.0)), "objects": [], "generators": crowd }),
            ),
        ),
        (
            "nothing",
            under_sky(
                json!({ "materials": cloud(json!({ "density": "0*p.x", "max_density": 0, "scattering": 4 })), "objects": [shapes[0]] }),
            ),
        ),
    ] {
        let settings = Settings {
            size: [20; 2],
            ..endless(&found, ONTO)
        };
        let counters = render_scene(&found, &settings).counters;
        assert_eq!((counters.dropped, counters.cut_short), (0, 0), "{label}");
        expect_mean(&found, &settings, [1.0; 3], 2e-3, label);
    }
}

/// Source function of a slab that scatters evenly under an even sky of radiance 1, in cells of its
/// optical depth, by Milne's integral equation J = ω/2 (E₂ + ∫ E₁ J).
fn slab_source(albedo: f64, depth: f64) -> Vec<f64> {
    const CELLS: usize = 400;
    const DIRECTIONS: u32 = 2000;
    let step = depth / CELLS as f64;
    let e2 = |x: f64| {
        let at = |i: u32| (-x * f64::from(DIRECTIONS) / (f64::from(i) + 0.5)).exp();
        (0..DIRECTIONS).map(at).sum::<f64>() / f64::from(DIRECTIONS)
    };
    let edges: Vec<f64> = (0..=CELLS)
        .map(|k| e2((k as f64 - 0.5).abs() * step))
        .collect();
    let kernel = |i: usize, j: usize| match i.abs_diff(j) {
        0 => 2.0 * (1.0 - edges[0]),
        k => edges[k] - edges[k + 1],
    };
    let first: Vec<f64> = (0..CELLS)
        .map(|i| 0.5 * albedo * e2((i as f64 + 0.5) * step))
        .collect();
    let mut source = first.clone();
    for _ in 0..200 {
        let around = |i: usize| (0..CELLS).map(|j| kernel(i, j) * source[j]).sum::<f64>();
        source = (0..CELLS)
            .map(|i| first[i] + 0.5 * albedo * around(i))
            .collect();
    }
    source
}

/// Protects: a slab under an even sky reflects and passes what Milne's equation says by angle, and
/// a slab that absorbs nothing loses nothing. The oracle itself passes the flux of the tables of
/// van de Hulst ("Multiple Light Scattering", 1980) and of Heaslet and Warming (1965).
#[test]
fn slabs_reflect_and_pass_by_milnes_equation() {
    for (albedo, depth, table) in [
        (1.0, 0.5, Some(0.7040)),
        (1.0, 2.0, Some(0.3900)),
        (0.8, 1.0, None),
    ] {
        let source = slab_source(albedo, depth);
        let step = depth / source.len() as f64;
        let returned = |mu: f64, distance: &dyn Fn(f64) -> f64| -> f64 {
            let seen = |i: usize| (-distance(i as f64 * step) / mu).exp();
            (0..source.len())
                .map(|i| source[i] * (seen(i) - seen(i + 1)).abs())
                .sum()
        };
        let reflected = |mu: f64| returned(mu, &|t| t);
        let passed = |mu: f64| returned(mu, &|t| depth - t) + (-depth / mu).exp();
        let flux: f64 = (0..500)
            .map(|i| (f64::from(i) + 0.5) / 500.0)
            .map(|mu| 2.0 * mu * passed(mu) / 500.0)
            .sum();
        assert!(
            table.is_none_or(|table: f64| (flux - table).abs() < 5e-4),
            "{flux} beside {table:?}"
        );
        let medium = json!({ "scattering": albedo, "absorption": 1.0 - albedo });
        let found = scene(
            json!({ "sky": { "expression": "d.y > 0 ? 1 : 0" }, "materials": [body("fog", medium, open())],
            "objects": [{ "shape": { "box": { "min": [-1e4, 0, -1e4], "max": [1e4, depth, 1e4] } }, "material": "fog" }] }),
        );
        for mu in [1.0, 0.4_f64] {
            let across = (1.0 - mu * mu).sqrt();
            let above: EyeAndTarget = [[across, depth + mu, 1e-3], [0.0, depth, 0.0]];
            let below: EyeAndTarget = [[across, -mu, 1e-3], [0.0; 3]];
            for (view, expected) in [(above, reflected(mu)), (below, passed(mu))] {
                let label = format!("albedo {albedo}, depth {depth}, {view:?}");
                expect_mean(&found, &endless(&found, view), [expected; 3], 3e-3, &label);
            }
            assert!(albedo < 1.0 || (reflected(mu) + passed(mu) - 1.0).abs() < 1e-3);
        }
    }
}

/// Chandrasekhar's H function of isotropic scattering, by iteration of its integral equation
/// ("Radiative Transfer", Chandrasekhar 1950): 1/H(μ) = √(1−ω) + ω/2 ∫ μ' H(μ')/(μ+μ') dμ'.
fn h_function(albedo: f64) -> impl Fn(f64) -> f64 {
    const N: usize = 2000;
    let at = |i: usize| (i as f64 + 0.5) / N as f64;
    let mut h = vec![1.0; N];
    let inverse = move |h: &[f64], mu: f64| {
        let sum: f64 = (0..N).map(|i| at(i) * h[i] / (mu + at(i))).sum();
        (1.0 - albedo).sqrt() + 0.5 * albedo * sum / N as f64
    };
    for _ in 0..60 {
        let next: Vec<f64> = (0..N).map(|i| 1.0 / inverse(&h, at(i))).collect();
        // The mean of two iterates converges for an albedo of one too.
        h.iter_mut()
            .zip(next)
            .for_each(|(h, n)| *h = 0.5 * (*h + n));
    }
    move |mu| 1.0 / inverse(&h, mu)
}

/// Protects: an endless half-space that scatters evenly reflects by Chandrasekhar's H functions:
/// light of a sky, 1 − √(1−ω) H(μ), and of a sun, ω/(4π) · μ₀/(μ+μ₀) · H(μ) H(μ₀).
#[test]
fn half_spaces_reflect_by_h_functions() {
    let space = |sigma: [f64; 3], light: Value| {
        let scattering = sigma.map(|albedo| 3.0 * albedo);
        let absorption = sigma.map(|albedo| 3.0 * (1.0 - albedo));
        let mut parts = light;
        parts["materials"] = json!([body(
            "fog",
            json!({ "scattering": scattering, "absorption": absorption }),
            open()
        )]);
        parts["objects"] = json!([{ "shape": { "plane": { "point": [0, 0, 0], "normal": [0, 1, 0] } }, "material": "fog" }]);
        scene(parts)
    };
    let albedos = [0.2, 0.8, 0.999];
    let h = albedos.map(h_function);
    for mu in [1.0, 0.5, 0.2_f64] {
        let across = (1.0 - mu * mu).sqrt();
        let view: EyeAndTarget = [[across, mu, 1e-3], [0.0; 3]];
        let found = space(albedos, json!({ "sky": { "constant": 1 } }));
        let expected = core::array::from_fn(|k| 1.0 - (1.0 - albedos[k]).sqrt() * h[k](mu));
        expect_mean(
            &found,
            &endless(&found, view),
            expected,
            3e-3,
            &format!("sky at {mu}"),
        );
        let mu0 = 0.6;
        let found = space(
            albedos,
            json!({ "lights": [crate::support::sun([-0.8, mu0, 0.0])] }),
        );
        let expected = core::array::from_fn(|k| {
            albedos[k] / (4.0 * PI) * mu0 / (mu + mu0) * h[k](mu) * h[k](mu0)
        });
        expect_mean(
            &found,
            &endless(&found, view),
            expected,
            3e-3,
            &format!("sun at {mu}"),
        );
    }
}

/// Protects: a thick medium shows its `colour`, however it scatters: within five per cent along one
/// ray, where the colour is the mean over all. A wrong effect of the anisotropy is tens of per cent.
#[test]
fn a_thick_medium_shows_its_colour() {
    let colour = [0.2, 0.5, 0.8];
    for anisotropy in [0.0, 0.7, -0.5] {
        let medium = json!({ "colour": colour, "distance": 0.1, "anisotropy": anisotropy });
        let found = scene(
            json!({ "sky": { "constant": 1 }, "materials": [body("milk", medium, open())],
            "objects": [{ "shape": { "plane": { "point": [0, 0, 0], "normal": [0, 1, 0] } }, "material": "milk" }] }),
        );
        let settings = Settings {
            size: [24; 2],
            ..endless(&found, [[0.8, 0.6, 1e-3], [0.0; 3]])
        };
        expect_mean(
            &found,
            &settings,
            colour,
            0.05,
            &format!("g = {anisotropy}"),
        );
    }
}

/// Protects: light that crosses a scattering slab unscattered follows Beer's law in each channel,
/// and slabs that only absorb do so exactly, nested ones too.
#[test]
fn unscattered_light_follows_beers_law() {
    let lit = |materials: Value, objects: &[Value]| {
        let plate = json!({ "shape": { "quad": { "corner": [-9, -1, -9], "edge_u": [18, 0, 0], "edge_v": [0, 0, 18] } }, "material": "lamp" });
        let objects = [&[plate], objects].concat();
        scene(json!({ "materials": materials, "objects": objects }))
    };
    let slab = |min: f64, max: f64, name: &str| json!({ "shape": { "box": { "min": [-9, min, -9], "max": [9, max, 9] } }, "material": name });
    let down: EyeAndTarget = [[0.3, 5.0, 0.2], [0.3, 0.0, 0.2]];
    let left = |rates: [f64; 3]| rates.map(|rate| 3.0 * (-rate).exp());
    let fog = json!({ "scattering": [0.1, 0.5, 2], "absorption": [0.2, 0.1, 0] });
    let found = lit(
        json!([lamp(3.0), body("fog", fog, open())]),
        &[slab(0.0, 0.8, "fog")],
    );
    let first = Settings {
        max_depth: 1,
        ..endless(&found, down)
    };
    expect_mean(&found, &first, left([0.24, 0.48, 1.6]), 2e-3, "one slab");
    let tint = |rates: [f64; 3], terms: Value| json!([{ "absorption": rates }, terms]);
    let [red, blue] = [tint([0.5, 1.0, 2.0], open()), tint([3.0, 1.0, 0.0], open())];
    let materials = json!([
        lamp(3.0),
        body("red", red[0].clone(), red[1].clone()),
        body("blue", blue[0].clone(), blue[1].clone())
    ]);
    let found = lit(materials, &[slab(0.0, 1.0, "red"), slab(0.4, 0.7, "blue")]);
    expect_pixels(
        &found,
        down,
        1,
        left([0.35 + 0.9, 0.7 + 0.3, 1.4]),
        "nested",
    );
}

/// Protects: fog attenuates from the eye or from its edge on, also where rays of a far camera start
/// near the scene.
#[test]
fn fog_before_a_far_camera() {
    for far in [50.0_f64, 1e5] {
        for radius in [2.0 * far, 0.25 * far] {
            let metres = radius.min(far) - 2.0;
            let rate = 1.0 / metres;
            let air =
                json!({ "scattering": 0.5 * rate, "absorption": 0.5 * rate, "radius": radius });
            let found = scene(
                json!({ "air": air, "materials": [lamp(3.0)], "objects": [ball([0.0; 3], 2.0, "lamp")] }),
            );
            let settings = Settings {
                max_depth: 1,
                ..endless(&found, [[far, 0.0, 0.0], [0.0; 3]])
            };
            let label = format!("from {far} m, {metres} m of fog");
            expect_mean(&found, &settings, [3.0 * (-1.0_f64).exp(); 3], 2e-3, &label);
        }
    }
}

/// Protects: the light that thin air scatters from a lamp into a ray, against the airlight integral
/// ∫ σ p(θ) I/r² e^(−σ(t+r)) dt by quadrature, for air that scatters forwards or backwards. The air
/// absorbs nearly all, so that no light scatters twice.
#[test]
fn a_lamp_in_thin_air() {
    const STEPS: u32 = 200_000;
    let (rate, albedo, near, reach) = (0.25, 1e-3, 1.5_f64, 12.0);
    for g in [0.0, 0.7, -0.6_f64] {
        let air = json!({ "scattering": rate * albedo, "absorption": rate * (1.0 - albedo), "anisotropy": g, "radius": 1000 });
        let found = scene(json!({
            "air": air,
            "lights": [{ "kind": { "point": { "position": [0, near, 0] } }, "colour": 1000 }],
            "materials": [{ "name": "wall", "model": { "classic": { "colour": 0 } } }],
            "objects": [{ "shape": { "box": { "min": [0.5 * reach, -1, -1], "max": [reach, 1, 1] } }, "material": "wall" }],
        }));
        let view: EyeAndTarget = [[-0.5 * reach, 0.0, 0.0], [0.0; 3]];
        let step = reach / f64::from(STEPS);
        let light = |i: u32| {
            let t = (f64::from(i) + 0.5) * step;
            let along = t - 0.5 * reach;
            let r = near.hypot(along);
            // Of the directions from the lamp to the point, and from the point to the eye.
            let cos = -along / r;
            let phase = (1.0 - g * g) / (2.0 * TAU * (1.0 + g * g - 2.0 * g * cos).powf(1.5));
            rate * albedo * phase * 1000.0 / (r * r) * (-rate * (t + r)).exp()
        };
        let expected = (0..STEPS).map(light).sum::<f64>() * step;
        let settings = Settings {
            size: [64; 2],
            ..endless(&found, view)
        };
        expect_mean(&found, &settings, [expected; 3], 3e-3, &format!("g = {g}"));
    }
}

/// Protects: the light of a sun and of a spot that thin air scatters into a ray, where its density
/// is a formula, against the integral by quadrature. The air absorbs nearly all.
#[test]
fn shafts_and_cones_in_air_by_formula() {
    const STEPS: u32 = 200_000;
    let (rate, albedo, reach, g) = (0.5, 1e-3, 6.0, 0.4_f64);
    let density = |x: f64, y: f64| (-0.3 * y).exp() * (1.0 + 0.5 * (2.0 * x).sin());
    // Thickness along x, and up from the ray to the spot.
    let ahead = |x: f64| 0.5 * reach + x + 0.25 * ((-reach).cos() - (2.0 * x).cos());
    let sun = json!({ "kind": { "directional": { "to_light": [0, 1, 0] } }, "colour": 50 });
    let spot = json!({ "kind": { "spot": { "position": [1.7, 1.5, 0], "direction": [-0.2, -1, 0], "inner_angle": 0, "outer_angle": 25 } }, "colour": 500 });
    let box_of = |min: f64, max: f64| json!({ "shape": { "box": { "min": [min, -1, -1], "max": [max, 1, 1] } }, "material": "wall" });
    for light in [sun, spot] {
        let is_sun = light["colour"] == 50;
        let air = json!({ "scattering": rate * albedo, "absorption": rate * (1.0 - albedo), "anisotropy": g,
            "density": "exp(-0.3*p.y)*(1 + 0.5*sin(2*p.x))", "max_density": 1.7, "radius": 4.0 });
        let found = scene(
            json!({ "air": air, "lights": [light], "materials": [{ "name": "wall", "model": { "classic": { "colour": 0 } } }],
            "objects": [box_of(0.5 * reach, reach), box_of(-reach, -0.5 * reach - 0.5)] }),
        );
        let view: EyeAndTarget = [[-0.5 * reach, 0.0, 0.0], [0.0; 3]];
        // Optical thickness from a point of the ray to another one above it, by 64 midpoints.
        let thickness = |x: f64, [dx, dy]: [f64; 2], length: f64| {
            let at = |i: u32| (f64::from(i) + 0.5) / 64.0 * length;
            let sum: f64 = (0..64).map(|i| density(x + dx * at(i), dy * at(i))).sum();
            rate * sum * length / 64.0
        };
        let step = reach / f64::from(STEPS);
        let scattered = |i: u32| {
            let x = (f64::from(i) + 0.5) * step - 0.5 * reach;
            let (to, length, arriving) = if is_sun {
                // To the edge of the air.
                ([0.0, 1.0], (16.0 - x * x).sqrt(), 50.0)
            } else {
                let [dx, dy] = [1.7 - x, 1.5];
                let r = dx.hypot(dy);
                let cos = (0.2 * dx + dy) / (r * 0.2_f64.hypot(1.0));
                let outer = 25_f64.to_radians().cos();
                let edge = ((cos - outer) / (1.0 - outer)).clamp(0.0, 1.0);
                ([dx / r, dy / r], r, 500.0 * edge * edge / (r * r))
            };
            if arriving == 0.0 {
                return 0.0;
            }
            // Of the light's direction, and that to the eye, along −x.
            let cos = to[0];
            let phase = (1.0 - g * g) / (2.0 * TAU * (1.0 + g * g - 2.0 * g * cos).powf(1.5));
            let lost = rate * ahead(x) + thickness(x, to, length);
            rate * albedo * density(x, 0.0) * phase * arriving * (-lost).exp()
        };
        let expected = (0..STEPS)
            .step_by(20)
            .map(|i| scattered(i + 10))
            .sum::<f64>()
            * 20.0
            * step;
        let settings = Settings {
            size: [64; 2],
            ..endless(&found, view)
        };
        expect_mean(
            &found,
            &settings,
            [expected; 3],
            3e-3,
            if is_sun { "sun" } else { "spot" },
        );
    }
}

/// Protects: layers show the surface behind fog, and the fog in front of it, in their visible
/// shares and without noise: also behind a cloud without a surface, and for a formula.
#[test]
fn layers_show_what_fog_leaves_of_a_surface() {
    let wall =
        json!({ "name": "wall", "model": physical(json!({ "base_colour": [0.8, 0.4, 0.1] })) });
    let plate = json!({ "shape": { "box": { "min": [-9, -9, -3], "max": [9, 9, -2] } }, "material": "wall" });
    for density in [json!(0.5), json!("p.x > -99 ? 0.5 : 0")] {
        let fog = json!({ "scattering": 0.3, "absorption": 0.1, "density": density });
        let smoke = json!({ "scattering": 0.5, "absorption": 1.5, "density": density });
        let cloud = json!({ "shape": { "box": { "min": [-5, -5, -1], "max": [5, 5, 0] } }, "material": "smoke" });
        let found = scene(
            json!({ "air": fog, "sky": { "constant": 1 }, "materials": [wall, body("smoke", smoke, open())], "objects": [plate, cloud] }),
        );
        let settings = Settings {
            aovs: vec![Aov::Albedo, Aov::Normal],
            sampling: Sampling::General(8),
            ..endless(&found, [[0.0, 0.0, 2.0], [0.0; 3]])
        };
        let picture = render_scene(&found, &settings).picture;
        // Two metres of fog, one of smoke, one of fog.
        let left = [0.4_f64, 1.0, 0.2].map(|depth| (-depth).exp());
        let media = 0.75 * (1.0 - left[0])
            + left[0] * (0.25 * (1.0 - left[1]) + left[1] * 0.75 * (1.0 - left[2]));
        let visible: f64 = left.iter().product();
        for (name, surface, rest) in [
            ("albedo.R", 0.8, media),
            ("albedo.B", 0.1, media),
            ("normal.Z", 1.0, 0.0),
        ] {
            let layer = picture.layer(name).expect("a layer");
            let expected = (visible * surface + rest) as f32;
            let off = layer
                .samples
                .iter()
                .map(|value| (value - expected).abs())
                .fold(0.0, f32::max);
            assert!(off < 1e-4, "{name}: {off} from {expected}");
        }
    }
}

/// Protects: a formula equal to a constant makes the same medium, with a maximum above it too; and
/// air that thins out with height has its closed transmittance, whether it absorbs or scatters.
#[test]
fn densities_by_formula() {
    let cloud = |density: Value, most: f64| {
        let medium = json!({ "scattering": [1, 2, 4], "absorption": [0.2, 0.1, 0], "anisotropy": 0.4, "density": density, "max_density": most });
        scene(
            json!({ "sky": { "constant": 1 }, "materials": [body("cloud", medium, open())], "objects": [ball([0.0; 3], 1.0, "cloud")] }),
        )
    };
    let even = cloud(json!(0.5), 1.0);
    let (expected, error) = mean_radiance(&even, &endless(&even, ONTO));
    for most in [0.5, 2.0] {
        let found = cloud(json!("p.y > -9 ? 0.5 : 0"), most);
        let off = ERRORS * error.into_iter().fold(0.0, f64::max);
        expect_mean(
            &found,
            &endless(&found, ONTO),
            expected,
            off,
            &format!("below {most}"),
        );
    }
    for (absorption, scattering) in [(0.6, 0.0), (0.1, 0.5)] {
        let air = json!({ "absorption": absorption, "scattering": scattering, "density": "exp(-0.5*p.y)", "radius": 60 });
        let found = scene(json!({ "air": air, "sky": { "constant": 1 },
            "materials": [{ "name": "wall", "model": { "classic": { "colour": 0 } } }], "objects": [ball([0.0, -1.5, 0.0], 0.5, "wall")] }));
        let view: EyeAndTarget = [[0.0, 0.5, 0.0], [3.0, 2.5, 0.0]];
        let rise = 2.0 / 13.0_f64.sqrt();
        let depth = 0.6 * (-0.25_f64).exp() / (0.5 * rise);
        let settings = Settings {
            max_depth: 1,
            ..endless(&found, view)
        };
        expect_mean(&found, &settings, [(-depth).exp(); 3], 1e-3, "height");
        assert_eq!(render_scene(&found, &settings).counters.excess.count, 0);
    }
}

/// Protects: a density that varies within a body lets pass what quadrature says, whether the body
/// absorbs or scatters, along rays straight and oblique to the cells of its bounds; and a body whose
/// density the bounds know exactly.
#[test]
fn densities_within_bodies_have_their_transmittance() {
    const STEPS: u32 = 20_000;
    let bumps = |p: DVec3| {
        (-4.0 * p.dot(p)).exp() * (1.0 + 0.6 * (7.0 * p.x).sin() * (6.0 * p.y + 1.0).cos())
    };
    let steps = |p: DVec3| if p.x > 0.25 { 0.9 } else { 0.1 };
    let formulas: [(&str, &dyn Fn(DVec3) -> f64); 2] = [
        (
            "exp(-4*dot(p, p))*(1 + 0.6*sin(7*p.x)*cos(6*p.y + 1))",
            &bumps,
        ),
        ("p.x > 0.25 ? 0.9 : 0.1", &steps),
    ];
    let (min, max) = (DVec3::new(-1.0, -0.8, -1.2), DVec3::new(1.0, 0.9, 1.0));
    for ((formula, density), [absorption, scattering], eye) in
        formulas.into_iter().flat_map(|formula| {
            [
                ([1.2, 0.0], [0.2, 0.1, 3.0]),
                ([0.4, 0.8], [0.2, 0.1, 3.0]),
                ([0.4, 0.8], [3.0, 2.0, 1.0]),
            ]
            .map(|(rates, eye)| (formula, rates, eye))
        })
    {
        let medium = json!({ "absorption": absorption, "scattering": scattering, "density": formula, "max_density": 1.6 });
        let cloud = json!({ "shape": { "box": { "min": min.to_array(), "max": max.to_array() } }, "material": "cloud" });
        let found = scene(
            json!({ "sky": { "constant": 1 }, "materials": [body("cloud", medium, open())], "objects": [cloud] }),
        );
        let view: EyeAndTarget = [eye, [0.15, -0.1, 0.0]];
        let [from, to] = view.map(DVec3::from);
        let step = 3.0 * (to - from) / f64::from(STEPS);
        let depth: f64 = (0..STEPS)
            .map(|i| from + step * (f64::from(i) + 0.5))
            .filter(|p| p.cmpge(min).all() && p.cmple(max).all())
            .map(|p| 1.2 * density(p) * step.length())
            .sum();
        let settings = Settings {
            max_depth: 1,
            ..endless(&found, view)
        };
        let label = format!("{formula}, {absorption}, from {eye:?}");
        expect_mean(&found, &settings, [(-depth).exp(); 3], 1e-3, &label);
    }
}

/// Protects: light samples of points in media, and paths that find light by chance, count each light
/// once: an even sky, a bright one and a lamp, around a cloud, in it, beside a body with a surface
/// (also one with holes) and inside of it.
#[test]
fn light_samples_in_media_agree_with_chance() {
    let bright = json!({ "gradient": { "bottom": 0.2, "top": 0.5, "suns": [{ "direction": [0.3, 1, 0.2], "colour": 3, "weight": 1, "exponent": 8 }] } });
    for (label, terms, centre, sky) in [
        (
            "beside a cloud",
            open(),
            [0.0, 1.5, 0.0],
            json!({ "constant": 0.4 }),
        ),
        ("in a cloud", open(), [0.1, 0.2, 0.0], bright.clone()),
        (
            "beside a body",
            json!({ "ior": 1.2 }),
            [0.0, 1.7, 0.0],
            bright,
        ),
        (
            "inside of a body",
            json!({ "ior": 1.2 }),
            [0.1, 0.2, 0.0],
            json!({ "constant": 0.4 }),
        ),
        (
            "beside a body with holes",
            json!({ "ior": 1.2, "opacity": 0.5, "alpha": "blend" }),
            [0.0, 1.5, 0.0],
            json!({ "constant": 0.4 }),
        ),
    ] {
        let medium = json!({ "scattering": [2, 3, 1], "absorption": 0.3, "anisotropy": 0.5 });
        let found = scene(
            json!({ "sky": sky, "materials": [body("body", medium, terms), lamp(6.0)],
            "objects": [ball([0.0; 3], 1.0, "body"), ball(centre, 0.4, "lamp")] }),
        );
        let each = [
            LightSampling::Both,
            LightSampling::Lights,
            LightSampling::Scattering,
        ]
        .map(|light_sampling| {
            let settings = Settings {
                light_sampling,
                size: [28; 2],
                ..endless(&found, [[0.3, 0.5, 3.0], [0.6, -0.3, 0.0]])
            };
            mean_radiance(&found, &settings)
        });
        let (both, error) = each[0];
        for (other, second) in &each[1..] {
            for k in 0..3 {
                let most = ERRORS * error[k].hypot(second[k]);
                assert!(
                    (both[k] - other[k]).abs() <= most && error[k] < 0.015 * both[k],
                    "{label}: {each:?}"
                );
            }
        }
    }
}

/// Protects: a density below zero, above its stated maximum, or not a number is counted, with its
/// place and its owner, and is told in words.
#[test]
fn a_density_out_of_its_range_is_counted() {
    for (density, ratio, words) in [
        ("2", 2.0, "is 2 times its `max_density` at"),
        ("-3", -3.0, "is below zero at"),
        ("1/(p.y - p.y)", f64::INFINITY, "is infinite at"),
        ("sqrt(-1 - p.y)", f64::NAN, "is not a number at"),
    ] {
        let formula = format!("p.y > 0 ? {density} : 0.5");
        let medium = json!({ "scattering": 3, "density": formula, "max_density": 1 });
        let found = furnace(medium, open());
        let counters = render_scene(&found, &endless(&found, ONTO)).counters;
        let excess = &counters.excess;
        assert!(excess.count > 1000, "{excess:?}");
        assert_eq!(excess.owner(), "materials[0].model.physical.interior");
        assert_eq!(
            excess.ratio().abs().to_bits(),
            ratio.abs().to_bits(),
            "{excess:?}"
        );
        assert_eq!(excess.ratio() < 0.0, ratio < 0.0);
        let [x, y, z] = excess.point();
        assert!(y > 0.0 && x.hypot(y).hypot(z) <= 1.0 + 1e-6, "{excess:?}");
        let faults: Vec<String> = counters.faults().map(|fault| fault.to_string()).collect();
        assert!(
            faults.iter().any(|fault| fault.contains(words)),
            "{faults:?}"
        );
    }
}

/// Protects: whatever the media, no sample is lost and both precisions agree: none, tiny, huge, one
/// channel alone, nested, overlapping, around the camera, moving, in fog.
#[test]
fn families_of_media_lose_no_sample() {
    let inside: EyeAndTarget = [[0.1, 0.2, 0.1], [0.4, 0.1, 1.0]];
    let soft = json!({ "scattering": [0, 4, 0], "absorption": [0.5, 0, 0], "anisotropy": 0.8 });
    let milk = json!({ "colour": [0.9, 0.8, 0.7], "distance": 0.1 });
    let glass = json!({ "ior": 1.4, "priority": 1 });
    let rough = json!({ "ior": 1.4, "roughness": 0.4 });
    for (label, air, first, second, view) in [
        (
            "none",
            json!({}),
            (json!({}), open()),
            (json!({}), open()),
            ONTO,
        ),
        (
            "tiny",
            json!({ "scattering": 1e-9 }),
            (json!({ "scattering": 1e-9 }), open()),
            (soft.clone(), glass.clone()),
            ONTO,
        ),
        (
            "huge",
            json!({}),
            (json!({ "scattering": 1e9, "absorption": 1e9 }), open()),
            (
                json!({ "scattering": 1e7, "absorption": 1e7 }),
                rough.clone(),
            ),
            ONTO,
        ),
        (
            "nested",
            json!({ "scattering": 0.02 }),
            (milk.clone(), glass.clone()),
            (soft.clone(), json!({ "ior": 1.1, "priority": 2 })),
            ONTO,
        ),
        (
            "inside",
            json!({ "scattering": 0.1 }),
            (milk.clone(), open()),
            (soft, rough),
            inside,
        ),
        (
            "formula",
            json!({ "scattering": 0.3, "density": "exp(-p.y)", "max_density": 60, "radius": 3.5 }),
            (
                json!({ "scattering": 9, "density": "noise(3*p) > 0 ? 1 : 0" }),
                open(),
            ),
            (milk, glass),
            ONTO,
        ),
    ] {
        let moving = json!({ "shape": { "sphere": { "centre": [0.2, 0, 0.1], "radius": 0.5 } }, "material": "b",
            "transform_end": [{ "translate": [0.2, 0, 0] }] });
        let found = scene(json!({
            "air": air, "sky": { "constant": [0.5, 0.7, 1] },
            "lights": [{ "kind": { "point": { "position": [2, 3, 2] } }, "colour": 5 }, crate::support::sun([0.2, 1.0, 0.1])],
            "materials": [body("a", first.0, first.1), body("b", second.0, second.1), lamp(4.0)],
            "objects": [ball([0.0; 3], 1.0, "a"), moving, ball([0.9, 0.3, 0.2], 0.4, "a"), ball([-2.0, 2.0, 0.0], 0.3, "lamp")],
        }));
        let each = [PrecisionChoice::Robust, PrecisionChoice::Reference].map(|precision| {
            let settings = Settings {
                precision,
                size: [20; 2],
                ..endless(&found, view)
            };
            let counters = render_scene(&found, &settings).counters;
            assert_eq!(
                (counters.dropped, counters.cut_short, counters.excess.count),
                (0, 0, 0),
                "{label}, {precision:?}"
            );
            mean_radiance(&found, &settings)
        });
        let [(robust, error), (reference, other)] = each;
        // Steps of a nanometre are below what single precision resolves.
        for k in (0..3).filter(|_| label != "huge") {
            let most = ERRORS * error[k].hypot(other[k]) + 2e-3 * reference[k];
            assert!(
                (robust[k] - reference[k]).abs() <= most,
                "{label}: {robust:?} beside {reference:?}, errors {error:?}"
            );
        }
    }
}
