//! White furnaces: under a sky of one no surface returns more than one, whatever its fields, and
//! exactly one without absorption. Random over all fields of the physical model, angles and depths,
//! so that no case is hand-picked.

use core::f64::consts::TAU;

use raywright_core::Settings;
use raywright_core::ladder::{Ladder, RungChoice};
use raywright_core::scene::Scene;
use serde_json::{Map, Value, json};

use crate::paths::{mean_radiance, paths};
use crate::support::{EyeAndTarget, ball, floor, physical, scene};

/// Number of furnaces; every run tests a tenth, and all if the variable NETS is `all`.
const FURNACES: u64 = 300;
const SEED: u64 = 46;

/// Tolerance in standard errors: for 300 furnaces in three channels, chance alone exceeds it once
/// in three hundred full runs.
const ERRORS: f64 = 4.8;
/// Tolerance for the tables' errors: of a surface, and of a glass ball, where light hits the
/// surface many times.
const OFF: f64 = 0.01;
const OFF_WITHIN: f64 = 0.03;

/// A stream of numbers in [0, 1) (SplitMix64).
struct FurnaceRng(u64);

impl FurnaceRng {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ z >> 31) >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn chance(&mut self, share: f64) -> bool {
        self.next() < share
    }

    /// A number from 0 to 1, often one of the ends.
    fn uniform(&mut self) -> f64 {
        match self.next() {
            x if x < 0.2 => 0.0,
            x if x < 0.4 => 1.0,
            _ => self.next(),
        }
    }

    fn colour(&mut self) -> Value {
        json!([self.uniform(), self.uniform(), self.uniform()])
    }

    /// A roughness, often of the narrow lobes whose losses are small.
    fn roughness(&mut self) -> f64 {
        if self.chance(0.4) {
            0.05 + 0.3 * self.next()
        } else {
            self.uniform()
        }
    }

    /// An index, mostly of glass, sometimes low, close to one or very large.
    fn index(&mut self) -> f64 {
        match self.next() {
            x if x < 0.1 => 1.0 + 0.02 * self.next(),
            x if x < 0.15 => 1.02 + 0.4 * self.next(),
            x if x < 0.25 => 1e3_f64.powf(self.next()),
            x if x < 0.3 => 0.0,
            _ => 1.2 + 1.4 * self.next(),
        }
    }
}

/// A surface with its view, and whether it absorbs nothing.
struct Furnace {
    scene: Scene,
    view: EyeAndTarget,
    depth: u32,
    keeps_all: bool,
    off: f64,
}

/// Absorbing layers: a furnace with them returns at most one.
fn layers(numbers: &mut FurnaceRng, all: &mut Map<String, Value>) {
    let mut add = |numbers: &mut FurnaceRng, key: &str, of: fn(&mut FurnaceRng) -> Value| {
        let share = if key == "iridescence" { 0.6 } else { 0.3 };
        if numbers.chance(share) {
            all.insert(key.to_owned(), of(numbers));
        }
    };
    add(
        numbers,
        "clearcoat",
        |n| json!({ "factor": n.uniform(), "roughness": n.uniform() }),
    );
    add(
        numbers,
        "sheen",
        |n| json!({ "colour": n.colour(), "roughness": n.uniform() }),
    );
    add(
        numbers,
        "iridescence",
        |n| json!({ "factor": n.uniform(), "ior": 1.0 + 4.0 * n.next().powi(2), "thickness": 1500.0 * n.next() }),
    );
    add(
        numbers,
        "conductor",
        |n| json!({ "n": [n.next() + 0.05, n.next() + 0.05, 3.0 * n.next() + 0.05], "k": [5.0 * n.next(), 3.0 * n.next(), n.next()] }),
    );
    add(numbers, "specular_colour", |n| {
        json!([2.0 * n.next(), n.uniform(), n.uniform()])
    });
    add(numbers, "attenuation_distance", |n| json!(n.next() + 0.01));
    add(numbers, "attenuation_colour", FurnaceRng::colour);
}

fn furnace(index: u64) -> Furnace {
    let mut numbers = FurnaceRng(SEED.wrapping_add(index.wrapping_mul(0x2545_f491_4f6c_dd1d)));
    let n = &mut numbers;
    let keeps_all = n.chance(0.5);
    let (clear, thin) = (n.chance(0.5), n.chance(0.4));
    let mut all = Map::new();
    let base = if keeps_all { json!(1) } else { n.colour() };
    let ior = n.index();
    for (key, value) in [
        ("base_colour", base),
        (
            "metallic",
            json!(if n.chance(0.5) { 0.0 } else { n.uniform() }),
        ),
        ("roughness", json!(n.roughness())),
        ("ior", json!(ior)),
        ("transmission", json!(if clear { n.uniform() } else { 0.0 })),
        ("thin_walled", json!(thin)),
        (
            "dispersion",
            json!(if n.chance(0.2) { 5.0 * n.next() } else { 0.0 }),
        ),
        ("specular", json!(n.uniform())),
    ] {
        all.insert(key.to_owned(), value);
    }
    if n.chance(0.3) {
        all.insert(
            "anisotropy".to_owned(),
            json!({ "strength": n.uniform(), "rotation": 360.0 * n.next() }),
        );
    }
    let leaf = n.chance(0.2);
    if leaf {
        let colour = if keeps_all { json!(1) } else { n.colour() };
        all.insert(
            "diffuse_transmission".to_owned(),
            json!({ "factor": n.uniform(), "colour": colour }),
        );
    }
    if !keeps_all {
        layers(n, &mut all);
    }
    let within = (clear || leaf) && !thin;
    let is_ball = within && n.chance(0.7);
    let is_within = is_ball && n.chance(0.5);
    // No light enters an opaque ball, and out of a ball of great index it takes many bounces.
    let number = |path: &str| {
        Value::Object(all.clone())
            .pointer(path)
            .and_then(Value::as_f64)
            .unwrap_or(0.0)
    };
    let enters = (1.0 - number("/metallic"))
        * number("/transmission").max(number("/diffuse_transmission/factor"));
    let keeps_all =
        keeps_all && (!is_ball || ior < 2.0) && (!is_within || ior > 0.0 && enters > 0.05);
    let depth = if keeps_all && is_ball {
        400
    } else {
        2 + (60.0 * n.next().powi(3)) as u32
    };
    let (height, turn) = ((0.5 * TAU * 0.499 * n.next()).cos(), TAU * n.next());
    let across = (1.0 - height * height).sqrt();
    let direction = [across * turn.cos(), height, across * turn.sin()];
    let model = physical(Value::Object(all));
    let sky = json!({ "sky": { "constant": 1 } });
    if !is_ball {
        // A thin wall is viewed from either side.
        let side = if thin && n.chance(0.5) { -1.0 } else { 1.0 };
        let eye = [
            3.0 * direction[0],
            3.0 * side * direction[1],
            3.0 * direction[2],
        ];
        return Furnace {
            scene: floor(model, sky),
            view: [eye, [0.0; 3]],
            depth,
            keeps_all,
            off: OFF,
        };
    }
    let scene = scene(
        json!({ "sky": sky["sky"], "materials": [{ "name": "m", "model": model }], "objects": [ball([0.0; 3], 1.0, "m")] }),
    );
    let eye = direction.map(|x| if is_within { 0.7 * x } else { 3.0 * x });
    let target = [0.9 * n.next(), 0.3 * n.next(), 0.0];
    Furnace {
        scene,
        view: [eye, target],
        depth,
        keeps_all,
        off: OFF_WITHIN,
    }
}

/// Protects: no surface of the physical model gains energy, whatever its fields, angle and depth;
/// white ones without absorbing layers return all light. Of 300 random ones every run tests a
/// tenth, and NETS=all tests all.
#[test]
fn furnaces_return_at_most_one() {
    let all = std::env::var("NETS").is_ok_and(|nets| nets == "all");
    let requested = (0..FURNACES).filter(|index| all || index % 10 == 3);
    let mut wrong = Vec::new();
    for index in requested {
        let Furnace {
            scene,
            view,
            depth,
            keeps_all,
            off,
        } = furnace(index);
        let settings = Settings {
            size: [8, 8],
            seed: index as _,
            ..paths(&scene, view, depth)
        };
        let (found, error) = mean_radiance(&scene, &settings);
        for k in 0..3 {
            let (spread, whole) = (ERRORS * error[k] + off, keeps_all && found[k] < 1.0);
            if found[k] - 1.0 > spread || whole && 1.0 - found[k] > spread || !found[k].is_finite()
            {
                let material =
                    serde_json::to_string(&scene.materials[0]).expect("it can be written");
                wrong.push(format!("seed {SEED}, furnace {index}, keeps all {keeps_all}, depth {depth}, {view:?}: {found:?} ± {error:?}: {material}"));
                break;
            }
        }
    }
    assert!(
        wrong.is_empty(),
        "{} furnaces:\n{}",
        wrong.len(),
        wrong.join("\n")
    );
}

/// Radiance and error of a floor under an even sky of one, viewed at an angle from above or, if the
/// angle exceeds 90°, from below, on a rung.
fn even_light(rung: &str, terms: Value, degrees: f64, depth: u32) -> (f64, f64) {
    let mut scene = floor(physical(terms), json!({ "sky": { "constant": 1 } }));
    let (sine, cosine) = degrees.to_radians().sin_cos();
    let mut settings = Settings {
        size: [8, 8],
        ..paths(&scene, [[3.0 * sine, 3.0 * cosine, 0.0], [0.0; 3]], depth)
    };
    RungChoice::parse(rung)
        .expect("a rung")
        .apply(&mut scene, &mut settings);
    let (found, error) = mean_radiance(&scene, &settings);
    (found[0], error[0])
}

/// Reflectance in air, or in a body of index `within`, of the complex index n + ik, by Fresnel's
/// amplitudes in complex arithmetic.
fn fresnel(degrees: f64, [n, k]: [f64; 2], within: f64) -> f64 {
    let (sine, cosine) = degrees.to_radians().sin_cos();
    let [re, im] = [
        (n * n - k * k) / (within * within),
        2.0 * n * k / (within * within),
    ];
    // The root of n² − sin², whose imaginary part is positive.
    let (x, y) = (re - sine * sine, im);
    let length = x.hypot(y);
    let root = [
        (0.5 * (length + x)).max(0.0).sqrt(),
        (0.5 * (length - x)).max(0.0).sqrt(),
    ];
    let share = |[a, b]: [f64; 2], [c, d]: [f64; 2]| {
        ((a - c).powi(2) + (b - d).powi(2)) / ((a + c).powi(2) + (b + d).powi(2))
    };
    let across = share([cosine, 0.0], root);
    0.5 * (across + share([re * cosine, im * cosine], root))
}

/// Protects: on the rung `exact` every lobe that reflects by an index follows Fresnel's equations:
/// paint, a coat and half a coat, a boundary of glass from both sides, a thin wall, a metal of a
/// complex index, and a film of air. The coat once kept Schlick's formula: .070 for .089 at 60°.
#[test]
fn every_lobe_of_the_exact_rung_follows_fresnels_equations() {
    let black = |terms: Value| {
        let mut all = json!({ "base_colour": 0, "roughness": 0, "ior": 1.5 });
        let more = terms.as_object().expect("an object");
        more.iter()
            .for_each(|(key, value)| all[key] = value.clone());
        all
    };
    let coat = |factor: f64| json!({ "specular": 0, "roughness": 1, "clearcoat": { "factor": factor, "roughness": 0 } });
    let conductor = json!({ "base_colour": 1, "metallic": 1, "conductor": { "n": [0.2, 0.2, 0.2], "k": [3.0, 3.0, 3.0] } });
    let air = json!({ "iridescence": { "factor": 1, "ior": 1, "thickness": 400 } });
    for degrees in [0.0, 30.0, 60.0, 80.0] {
        let of = |n: f64| fresnel(degrees, [n, 0.0], 1.0);
        let wall = 2.0 * of(1.5) / (1.0 + of(1.5));
        let cases = [
            ("paint", json!({ "ior": 1.8 }), of(1.8)),
            ("coat", coat(1.0), of(1.5)),
            ("half a coat", coat(0.5), 0.5 * of(1.5)),
            ("glass", json!({ "transmission": 1, "ior": 1.33 }), of(1.33)),
            (
                "wall",
                json!({ "transmission": 1, "thin_walled": true }),
                wall,
            ),
            (
                "metal",
                conductor.clone(),
                fresnel(degrees, [0.2, 3.0], 1.0),
            ),
            ("film", air.clone(), of(1.5)),
        ];
        let within = fresnel(degrees, [1.0, 0.0], 1.5);
        let from_below = ("glass from below", json!({ "transmission": 1 }), within);
        for (view, (name, terms, expected)) in cases
            .into_iter()
            .map(|case| (degrees, case))
            .chain([(180.0 - degrees, from_below)])
        {
            let (found, error) = even_light("fresnel=exact", black(terms), view, 2);
            assert!(
                (found - expected).abs() <= 4.0 * error + 1e-4,
                "{name} at {degrees}°: {found} ± {error}, not {expected}"
            );
        }
    }
}

/// Protects: a rough coat under `exact` reflects as much as rough paint of its index, and what lies
/// below gets the rest: a white mirror keeps all light.
#[test]
fn rough_coats_of_the_exact_rung_are_of_fresnels_equations() {
    for (roughness, degrees) in [(0.3, 30.0), (0.5, 70.0), (0.8, 80.0)] {
        let coat = json!({ "factor": 1, "roughness": roughness });
        let bare = json!({ "base_colour": 0, "roughness": roughness });
        let coated = json!({ "base_colour": 0, "specular": 0, "roughness": 1, "clearcoat": coat });
        let (expected, spread) = even_light("fresnel=exact", bare, degrees, 2);
        let (found, error) = even_light("fresnel=exact", coated, degrees, 2);
        // Paint returns the light between its microfacets too.
        assert!(
            (found - expected).abs() <= 4.0 * (error + spread) + 5e-3,
            "{roughness} at {degrees}°: {found}, not {expected}"
        );
        let mirror = json!({ "base_colour": 1, "metallic": 1, "roughness": 0, "clearcoat": coat });
        let (all, error) = even_light("fresnel=exact", mirror, degrees, 2);
        assert!(
            all <= 1.005 + 4.0 * error && all > 0.9,
            "{roughness} at {degrees}°: {all}"
        );
    }
}

/// Albedo and error of white paint of an index, viewed at an angle, on a rung.
fn white_paint(rung: RungChoice, [ior, roughness, degrees]: [f64; 3]) -> (f64, f64) {
    let terms = json!({ "base_colour": 1, "ior": ior, "roughness": roughness });
    even_light(&rung.to_string(), terms, degrees, 3)
}

/// Protects: references gain no energy. In the ladders of surfaces each rung but `fresnel=model` returns no
/// more than the incident light, the most exact one, which references have, all: for white paint of any
/// index, roughness and angle. `exact` once returned .716 to 1.059.
#[test]
fn references_make_no_light() {
    let model = RungChoice::parse("fresnel=model").expect("a rung");
    assert!(white_paint(model, [1.5, 0.0, 89.0]).0 > 1.3);
    for ladder in [Ladder::Fresnel, Ladder::Microfacets] {
        let last = ladder.choices().next_back();
        for rung in ladder.choices().filter(|rung| *rung != model) {
            for ior in [1.0, 1.01, 1.1, 1.5, 4.0, 1000.0] {
                for roughness in [0.0, 0.05, 0.3, 1.0] {
                    for degrees in [0.0, 60.0, 86.0, 89.9] {
                        let (found, error) = white_paint(rung, [ior, roughness, degrees]);
                        let name = format!(
                            "{rung}, index {ior}, roughness {roughness}, {degrees}°: {found} ± {error}"
                        );
                        assert!(found <= 1.005 + 4.0 * error, "{name}");
                        assert!(last != Some(rung) || found >= 0.99 - 4.0 * error, "{name}");
                    }
                }
            }
        }
    }
}
