//! Random scenes: materials of both families with random fields, bodies and lights, by both
//! integrators. Closed forms test single terms; these scenes find unforeseen combinations.
//!
//! The scenes are numbered, and a number suffices to recreate one. `NETS=all` renders all of them,
//! a tenth otherwise.

use std::env;
use std::sync::Arc;

use raywright_core::scene::{ImageData, Integrator, PixelData, Scene};
use raywright_core::settings::{PrecisionChoice, Sampling};
use raywright_core::{Settings, validate};
use serde_json::{Map, Value, json};

use crate::support::{EyeAndTarget, ball, render_scene, scene, settings};

const SCENES: u64 = 500;
const SEED: u64 = 46;

/// Random numbers (Steele, Lea, Flood, "Fast Splittable Pseudorandom Number Generators", 2014).
struct SceneRng(u64);

impl SceneRng {
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
    fn uniform(&mut self) -> f64 {
        if self.is(0.5) {
            self.one_of(&[0.0, 1.0])
        } else {
            self.unit()
        }
    }

    fn colour(&mut self) -> Value {
        json!([self.uniform(), self.uniform(), self.uniform()])
    }

    /// A magnitude between two powers of ten.
    fn magnitude(&mut self, from: f64, to: f64) -> f64 {
        10_f64.powf(from + (to - from) * self.unit())
    }
}

/// Adds a field by chance.
fn maybe(
    rng: &mut SceneRng,
    of: &mut Map<String, Value>,
    name: &str,
    value: impl FnOnce(&mut SceneRng) -> Value,
) {
    if rng.is(0.4) {
        let value = value(rng);
        of.insert(name.to_owned(), value);
    }
}

fn physical(rng: &mut SceneRng) -> Value {
    let mut m = Map::new();
    let all = &mut m;
    for field in [
        "metallic",
        "roughness",
        "transmission",
        "specular",
        "opacity",
    ] {
        maybe(rng, all, field, |r| r.uniform().into());
    }
    for field in ["base_colour", "specular_colour", "attenuation_colour"] {
        maybe(rng, all, field, SceneRng::colour);
    }
    maybe(rng, all, "ior", |r| {
        r.one_of(&[1.0, 1.0001, 1.1, 1.33, 1.5, 2.4, 1000.0]).into()
    });
    maybe(rng, all, "attenuation_distance", |r| {
        r.magnitude(-6.0, 3.0).into()
    });
    maybe(rng, all, "dispersion", |r| r.magnitude(-2.0, 2.0).into());
    // A thin wall has no inside, so it takes no priority.
    match rng.next() % 4 {
        0 => all.insert("thin_walled".to_owned(), true.into()),
        1 => all.insert("priority".to_owned(), rng.one_of(&[1, 2]).into()),
        _ => None,
    };
    maybe(rng, all, "emission", |r| {
        json!([r.uniform(), 0.0, r.magnitude(-3.0, 3.0)])
    });
    maybe(rng, all, "alpha", |r| {
        r.one_of(&[json!("blend"), json!({ "mask": { "cutoff": 0.5 } })])
    });
    maybe(
        rng,
        all,
        "conductor",
        |r| json!({ "n": [0.001, 1.5, 3.0], "k": [r.magnitude(-2.0, 2.0), 0.0, 7.0] }),
    );
    maybe(
        rng,
        all,
        "clearcoat",
        |r| json!({ "factor": r.uniform(), "roughness": r.uniform() }),
    );
    maybe(
        rng,
        all,
        "sheen",
        |r| json!({ "colour": r.colour(), "roughness": r.uniform() }),
    );
    maybe(
        rng,
        all,
        "iridescence",
        |r| json!({ "factor": r.uniform(), "ior": 1.0 + r.unit(), "thickness": 800.0 * r.unit() }),
    );
    maybe(
        rng,
        all,
        "anisotropy",
        |r| json!({ "strength": r.uniform(), "rotation": 360.0 * r.unit() }),
    );
    maybe(
        rng,
        all,
        "diffuse_transmission",
        |r| json!({ "factor": r.uniform(), "colour": r.colour() }),
    );
    json!({ "physical": m })
}

fn classic(rng: &mut SceneRng) -> Value {
    let mut m = Map::new();
    let all = &mut m;
    for field in ["local", "diffuse", "shadow_transmittance"] {
        maybe(rng, all, field, |r| r.uniform().into());
    }
    maybe(rng, all, "colour", SceneRng::colour);
    maybe(rng, all, "emission", |r| r.magnitude(-3.0, 3.0).into());
    maybe(
        rng,
        all,
        "rim",
        |r| json!({ "strength": r.uniform(), "exponent": 3 }),
    );
    maybe(rng, all, "specular", |r| {
        let model = r.one_of(&["blinn", "blinn_reflected", "phong", "grazing"]);
        json!({ "model": model, "exponent": r.one_of(&[1, 30, 65536]), "strength": r.uniform(), "on_reflection": r.is(0.5) })
    });
    let ior = rng.one_of(&[0.5, 1.0, 1.33, 1.5, 2.4]);
    match rng.next() % 4 {
        0 => all.extend([(
            "reflection".to_owned(),
            json!({ "weight": rng.uniform(), "tinted": rng.is(0.5) }),
        )]),
        1 => all.extend([(
            "transmission".to_owned(),
            json!({ "ior": ior, "refracted_tint": rng.colour() }),
        )]),
        2 => {
            let through = rng.uniform();
            let mut mixture = json!({
                "specular_chance": (1.0 - through) * rng.uniform(), "refraction_chance": through, "specular_roughness": rng.uniform(),
                "refraction_roughness": rng.uniform(), "absorption": [0.0, rng.magnitude(-3.0, 6.0), rng.uniform()],
            });
            if rng.is(0.7) {
                mixture["ior"] = ior.into();
            }
            all.extend([("mixture".to_owned(), mixture)]);
        }
        _ => {}
    }
    json!({ "classic": m })
}

/// A material of either family.
fn material(rng: &mut SceneRng, name: &str) -> Value {
    let model = if rng.is(0.7) {
        physical(rng)
    } else {
        classic(rng)
    };
    json!({ "name": name, "model": model })
}

/// One of five bodies: a ball, a box, a mesh, a thin quad, a ball in a ball.
fn bodies(kind: u64) -> Vec<Value> {
    let value_of = |shape: Value| json!({ "shape": shape, "material": "a" });
    match kind {
        0 => vec![ball([0.0, 1.0, 0.0], 1.0, "a")],
        1 => vec![value_of(
            json!({ "box": { "min": [-0.8, 0.1, -0.7], "max": [0.8, 1.6, 0.9] } }),
        )],
        2 => vec![value_of(json!({ "mesh": "tent" }))],
        3 => vec![value_of(
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
fn add_light(kind: u64, rng: &mut SceneRng, parts: &mut Value) {
    let strength = rng.magnitude(-2.0, 4.0);
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
    let rng = &mut SceneRng::of(number);
    let materials = ["floor", "a", "b"].map(|name| material(rng, name));
    let floor = json!({ "shape": { "plane": { "point": [0, 0, 0], "normal": [0, 1, 0] } }, "material": "floor" });
    let mut parts = json!({ "materials": materials, "meshes": [tent()], "objects": [floor], "images": [{ "name": "sky", "path": "sky" }] });
    parts["objects"]
        .as_array_mut()
        .expect("a list")
        .extend(bodies(number % 5));
    add_light(number / 5 % 8, rng, &mut parts);
    let mut scene = scene_of(parts);
    // Black but for a spot of a million.
    let mut texels = vec![[0.0, 0.0, 0.0, 1.0]; 8];
    texels[2] = [1e6, 0.0, 1e6, 1.0];
    scene.images[0].data = Some(Arc::new(ImageData {
        width: 4,
        height: 2,
        pixels: PixelData::Linear(texels),
    }));
    scene
}

fn scene_of(parts: Value) -> Scene {
    let scene = scene(parts);
    assert!(validate::validate(&scene).is_empty());
    scene
}

/// Views from outside, and from inside the bodies.
const VIEWS: [EyeAndTarget; 2] = [
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
                let own_settings = settings(&scene, view);
                let settings = Settings {
                    integrator,
                    precision,
                    max_depth: 6,
                    size: [12, 12],
                    sampling: Sampling::General(8),
                    ..own_settings
                };
                let counters = render_scene(&scene, &settings).counters;
                if counters.samples != 12 * 12 * 8 || counters.faults().next().is_some() {
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
fn flat_lamps_are_hit_once_from_their_own_plane() {
    let scene = of_number(473);
    for view in VIEWS {
        let own_settings = settings(&scene, view);
        let precision = PrecisionChoice::Reference;
        let settings = Settings {
            precision,
            max_depth: 6,
            size: [12, 12],
            sampling: Sampling::General(8),
            ..own_settings
        };
        let counters = render_scene(
            &scene,
            &Settings {
                integrator: Integrator::Path,
                ..settings
            },
        )
        .counters;
        assert!(counters.faults().next().is_none(), "{view:?}: {counters:?}");
    }
}
