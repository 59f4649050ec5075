//! Random scenes: materials of both families with random fields, bodies and lights, by both
//! integrators. Closed forms test single terms; these scenes find unforeseen combinations.
//!
//! The scenes are numbered, and a number suffices to recreate one. `NETS=all` renders all of them,
//! a tenth otherwise.

use std::env;
use std::sync::Arc;

use raywright_core::scene::{ImageData, Integrator, Pixels, Scene};
use raywright_core::settings::{PrecisionChoice, Sampling};
use raywright_core::{Settings, validate};
use serde_json::{Map, Value, json};

use crate::support::{View, ball, rendered, scene, settings};

const SCENES: u64 = 500;
const SEED: u64 = 46;

/// Random numbers (Steele, Lea, Flood, "Fast Splittable Pseudorandom Number Generators", 2014).
struct Random(u64);

impl Random {
    fn of(scene: u64) -> Self {
        Self((SEED << 32) + scene)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn is(&mut self, chance: f64) -> bool {
        self.unit() < chance
    }

    fn one_of<T: Clone>(&mut self, of: &[T]) -> T {
        of[(self.next() % of.len() as u64) as usize].clone()
    }

    /// A number from 0 to 1, in half of the cases one of its ends, where formulas have their poles.
    fn share(&mut self) -> f64 {
        if self.is(0.5) {
            self.one_of(&[0.0, 1.0])
        } else {
            self.unit()
        }
    }

    fn colour(&mut self) -> Value {
        json!([self.share(), self.share(), self.share()])
    }

    /// A magnitude between two powers of ten.
    fn magnitude(&mut self, from: f64, to: f64) -> f64 {
        10_f64.powf(from + (to - from) * self.unit())
    }
}

/// Adds a field by chance.
fn maybe(
    random: &mut Random,
    of: &mut Map<String, Value>,
    name: &str,
    value: impl FnOnce(&mut Random) -> Value,
) {
    if random.is(0.4) {
        let value = value(random);
        of.insert(name.to_owned(), value);
    }
}

fn physical(random: &mut Random) -> Value {
    let mut m = Map::new();
    let all = &mut m;
    for field in [
        "metallic",
        "roughness",
        "transmission",
        "specular",
        "opacity",
    ] {
        maybe(random, all, field, |r| r.share().into());
    }
    for field in ["base_colour", "specular_colour", "attenuation_colour"] {
        maybe(random, all, field, Random::colour);
    }
    maybe(random, all, "ior", |r| {
        r.one_of(&[1.0, 1.0001, 1.1, 1.33, 1.5, 2.4, 1000.0]).into()
    });
    maybe(random, all, "attenuation_distance", |r| {
        r.magnitude(-6.0, 3.0).into()
    });
    maybe(random, all, "dispersion", |r| r.magnitude(-2.0, 2.0).into());
    // A thin wall has no inside, so it takes no priority.
    match random.next() % 4 {
        0 => all.insert("thin_walled".to_owned(), true.into()),
        1 => all.insert("priority".to_owned(), random.one_of(&[1, 2]).into()),
        _ => None,
    };
    maybe(random, all, "emission", |r| {
        json!([r.share(), 0.0, r.magnitude(-3.0, 3.0)])
    });
    maybe(random, all, "alpha", |r| {
        r.one_of(&[json!("blend"), json!({ "mask": { "cutoff": 0.5 } })])
    });
    maybe(
        random,
        all,
        "conductor",
        |r| json!({ "n": [0.001, 1.5, 3.0], "k": [r.magnitude(-2.0, 2.0), 0.0, 7.0] }),
    );
    maybe(
        random,
        all,
        "clearcoat",
        |r| json!({ "factor": r.share(), "roughness": r.share() }),
    );
    maybe(
        random,
        all,
        "sheen",
        |r| json!({ "colour": r.colour(), "roughness": r.share() }),
    );
    maybe(
        random,
        all,
        "iridescence",
        |r| json!({ "factor": r.share(), "ior": 1.0 + r.unit(), "thickness": 800.0 * r.unit() }),
    );
    maybe(
        random,
        all,
        "anisotropy",
        |r| json!({ "strength": r.share(), "rotation": 360.0 * r.unit() }),
    );
    maybe(
        random,
        all,
        "diffuse_transmission",
        |r| json!({ "factor": r.share(), "colour": r.colour() }),
    );
    json!({ "physical": m })
}

fn classic(random: &mut Random) -> Value {
    let mut m = Map::new();
    let all = &mut m;
    for field in ["local", "diffuse", "shadow_transmittance"] {
        maybe(random, all, field, |r| r.share().into());
    }
    maybe(random, all, "colour", Random::colour);
    maybe(random, all, "emission", |r| r.magnitude(-3.0, 3.0).into());
    maybe(
        random,
        all,
        "rim",
        |r| json!({ "strength": r.share(), "exponent": 3 }),
    );
    maybe(random, all, "specular", |r| {
        let model = r.one_of(&["blinn", "blinn_reflected", "phong", "grazing"]);
        json!({ "model": model, "exponent": r.one_of(&[1, 30, 65536]), "strength": r.share(), "on_reflection": r.is(0.5) })
    });
    let ior = random.one_of(&[0.5, 1.0, 1.33, 1.5, 2.4]);
    match random.next() % 4 {
        0 => all.extend([(
            "reflection".to_owned(),
            json!({ "weight": random.share(), "tinted": random.is(0.5) }),
        )]),
        1 => all.extend([(
            "transmission".to_owned(),
            json!({ "ior": ior, "refracted_tint": random.colour() }),
        )]),
        2 => {
            let through = random.share();
            let mut mixture = json!({
                "specular_chance": (1.0 - through) * random.share(), "refraction_chance": through, "specular_roughness": random.share(),
                "refraction_roughness": random.share(), "absorption": [0.0, random.magnitude(-3.0, 6.0), random.share()],
            });
            if random.is(0.7) {
                mixture["ior"] = ior.into();
            }
            all.extend([("mixture".to_owned(), mixture)]);
        }
        _ => {}
    }
    json!({ "classic": m })
}

/// A material of either family.
fn material(random: &mut Random, name: &str) -> Value {
    let model = if random.is(0.7) {
        physical(random)
    } else {
        classic(random)
    };
    json!({ "name": name, "model": model })
}

/// One of five bodies: a ball, a box, a mesh, a thin quad, a ball in a ball.
fn bodies(kind: u64) -> Vec<Value> {
    let of = |shape: Value| json!({ "shape": shape, "material": "a" });
    match kind {
        0 => vec![ball([0.0, 1.0, 0.0], 1.0, "a")],
        1 => vec![of(
            json!({ "box": { "min": [-0.8, 0.1, -0.7], "max": [0.8, 1.6, 0.9] } }),
        )],
        2 => vec![of(json!({ "mesh": "tent" }))],
        3 => vec![of(
            json!({ "quad": { "corner": [-1, 0.2, 0], "edge_u": [2, 0, 0.3], "edge_v": [0, 1.6, 0.2] } }),
        )],
        _ => vec![
            ball([0.0, 1.0, 0.0], 1.0, "a"),
            ball([0.1, 1.0, 0.1], 0.6, "b"),
        ],
    }
}

/// A closed mesh with leaning normals and equal texture coordinates at two corners.
fn tent() -> Value {
    let data = json!({
        "positions": [[-1, 0.1, -1], [1, 0.1, -1], [0, 0.1, 1], [0, 1.8, 0]],
        "indices": [[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]],
        "normals": [[-1, -0.4, -1], [1, -0.4, -1], [0, -0.4, 1], [0, 1, 0]],
        "uvs": [[[0, 0], [1, 0], [1, 0], [0, 1]]],
    });
    json!({ "name": "tent", "source": { "inline": data } })
}

/// Adds one of eight lights: directional, point, spot, a lamp, a constant sky, a gradient with a
/// sun, an environment map, an emissive mesh.
fn add_light(kind: u64, random: &mut Random, parts: &mut Value) {
    let strength = random.magnitude(-2.0, 4.0);
    let light = |kind: Value| json!([{ "kind": kind, "colour": [strength, strength, 0.0] }]);
    let glow = |shape: Value, parts: &mut Value| {
        let lamp =
            json!({ "name": "lamp", "model": { "classic": { "local": 0, "emission": strength } } });
        parts["materials"]
            .as_array_mut()
            .expect("a list")
            .push(lamp);
        parts["objects"]
            .as_array_mut()
            .expect("a list")
            .push(json!({ "shape": shape, "material": "lamp" }));
    };
    match kind {
        0 => parts["lights"] = light(json!({ "directional": { "to_light": [0.4, 1, 0.3] } })),
        1 => parts["lights"] = light(json!({ "point": { "position": [0.5, 2.5, 1.0] } })),
        2 => {
            let spot = json!({ "position": [0, 3, 1], "direction": [0, -1, -0.3], "inner_angle": 20, "outer_angle": 35 });
            parts["lights"] = light(json!({ "spot": spot }));
        }
        3 => glow(
            json!({ "quad": { "corner": [-1, 3, -1], "edge_u": [2, 0, 0], "edge_v": [0, 0, 2] } }),
            parts,
        ),
        4 => parts["sky"] = json!({ "constant": strength }),
        5 => {
            let sun = json!({ "direction": [0.3, 1, 0.2], "colour": 1, "weight": strength, "exponent": 4000 });
            parts["sky"] = json!({ "gradient": { "bottom": [0, 0, 0], "top": [0.3, 0.5, 1.0], "suns": [sun] } });
        }
        6 => parts["sky"] = json!({ "map": { "image": "sky", "strength": strength } }),
        _ => {
            parts["objects"]
                .as_array_mut()
                .expect("a list")
                .push(json!({ "shape": { "mesh": "tent" }, "material": "lamp",
                "transform": [{ "translate": [0, 2.2, 0] }] }));
            let lamp = json!({ "name": "lamp", "model": { "physical": { "emission": [strength, strength, 0] } } });
            parts["materials"]
                .as_array_mut()
                .expect("a list")
                .push(lamp);
        }
    }
}

/// A scene by its number.
fn of_number(number: u64) -> Scene {
    let random = &mut Random::of(number);
    let materials = ["floor", "a", "b"].map(|name| material(random, name));
    let floor = json!({ "shape": { "plane": { "point": [0, 0, 0], "normal": [0, 1, 0] } }, "material": "floor" });
    let mut parts = json!({ "materials": materials, "meshes": [tent()], "objects": [floor], "images": [{ "name": "sky", "path": "sky" }] });
    parts["objects"]
        .as_array_mut()
        .expect("a list")
        .extend(bodies(number % 5));
    add_light(number / 5 % 8, random, &mut parts);
    let mut scene = scene_of(parts);
    // Black but for a spot of a million.
    let mut texels = vec![[0.0, 0.0, 0.0, 1.0]; 8];
    texels[2] = [1e6, 0.0, 1e6, 1.0];
    scene.images[0].data = Some(Arc::new(ImageData {
        width: 4,
        height: 2,
        pixels: Pixels::Linear(texels),
    }));
    scene
}

fn scene_of(parts: Value) -> Scene {
    let scene = scene(parts);
    assert!(validate::validate(&scene).is_empty());
    scene
}

/// Views from outside, and from inside the bodies.
const VIEWS: [View; 2] = [
    [[1.0, 2.2, 4.0], [0.0, 0.9, 0.0]],
    [[0.05, 1.02, 0.03], [0.5, 0.4, 0.6]],
];

/// Protects: no sample of a valid scene is lost, for any materials, bodies and lights: none is
/// dropped as NaN, and no ray ends at the limit of passed surfaces.
#[test]
fn no_sample_is_lost() {
    let step = if env::var("NETS").is_ok_and(|nets| nets == "all") {
        1
    } else {
        10
    };
    let mut lost = Vec::new();
    // Multiples of ten would cover few bodies and lights.
    for number in (0..SCENES / step).map(|k| k * step + k % step) {
        let scene = of_number(number);
        for (integrator, precision) in [
            (Integrator::Path, PrecisionChoice::Robust),
            (Integrator::Whitted, PrecisionChoice::Robust),
            (Integrator::Path, PrecisionChoice::Reference),
            (Integrator::Whitted, PrecisionChoice::Reference),
        ] {
            for view in VIEWS {
                let own = settings(&scene, view);
                let settings = Settings {
                    integrator,
                    precision,
                    max_depth: 6,
                    size: [12, 12],
                    sampling: Sampling::General(8),
                    ..own
                };
                let counters = rendered(&scene, &settings).counters;
                if counters.samples != 12 * 12 * 8 || counters.losses().next().is_some() {
                    lost.push(format!(
                        "scene {number}, {integrator:?}, {precision:?}, {view:?}: {counters:?}\n{:?}",
                        scene.materials
                    ));
                }
            }
        }
    }
    assert!(
        lost.is_empty(),
        "{} renders of seed {SEED} lost samples:\n{}",
        lost.len(),
        lost.join("\n")
    );
}

/// Protects: a partly transparent flat lamp is hit once by a shadow ray that begins in its plane,
/// so that no such ray ends at the limit of passed surfaces: the one random scene where a ray did.
#[test]
fn flat_lamps_are_met_once_from_their_own_plane() {
    let scene = of_number(473);
    for view in VIEWS {
        let own = settings(&scene, view);
        let precision = PrecisionChoice::Reference;
        let settings = Settings {
            precision,
            max_depth: 6,
            size: [12, 12],
            sampling: Sampling::General(8),
            ..own
        };
        let counters = rendered(
            &scene,
            &Settings {
                integrator: Integrator::Path,
                ..settings
            },
        )
        .counters;
        assert!(counters.losses().next().is_none(), "{view:?}: {counters:?}");
    }
}
