//! Whether the error that a whole picture claims is the one it has: how often the interval of its root relMSE holds the distance to the
//! truth, scene by scene, and how often it is said that the interval means nothing. docs/accuracy.md quotes it.
//!
//! `cargo bench --bench calibration -- 1000` takes 1000 renders of each scene, which takes minutes; the default is 100. The truth is the
//! mean of all renders but the one that is judged.
#![expect(clippy::print_stdout, reason = "the table is this program's result")]

#[path = "support/turns.rs"]
#[expect(dead_code, reason = "nothing is timed here")]
mod turns;

use raywright::core::film::Uncertainty;
use raywright::core::scene::Integrator;
use raywright::core::settings::Sampling;
use raywright::core::{Ready, Scene, Settings, prepare};
use raywright::io::{Input, LoadOptions, load};

/// A floor that is lit through a glass ball alone: every light path is a caustic, found by chance.
const CAUSTIC: &str = r#"{ "format": 1,
    "cameras": [{ "pose": { "look_at": { "eye": [0, 3, 4], "target": [0, 0.4, 0] } }, "projection": { "pinhole": { "vertical_fov": 40 } } }],
    "materials": [{ "name": "floor", "model": { "physical": { "base_colour": 0.7 } } },
                  { "name": "lamp", "model": { "physical": { "base_colour": 0, "emission": 40 } } },
                  { "name": "glass", "model": { "physical": { "transmission": 1, "roughness": 0 } } }],
    "objects": [{ "shape": { "plane": { "point": [0, 0, 0], "normal": [0, 1, 0] } }, "material": "floor" },
                { "shape": { "sphere": { "centre": [0, 0.7, 0], "radius": 0.6 } }, "material": "glass" },
                { "shape": { "sphere": { "centre": [1, 4, -1], "radius": 0.5 } }, "material": "lamp" }] }"#;

/// A dim room with a tiny, very bright lamp inside a ball of glass, which no ray towards it can reach: few paths find it.
const RARE: &str = r#"{ "format": 1, "sky": { "constant": 0.1 },
    "cameras": [{ "pose": { "look_at": { "eye": [0, 2, 5], "target": [0, 0.5, 0] } }, "projection": { "pinhole": { "vertical_fov": 40 } } }],
    "materials": [{ "name": "floor", "model": { "physical": { "base_colour": 0.7 } } },
                  { "name": "lamp", "model": { "physical": { "base_colour": 0, "emission": 40000 } } },
                  { "name": "glass", "model": { "physical": { "transmission": 1, "roughness": 0 } } }],
    "objects": [{ "shape": { "plane": { "point": [0, 0, 0], "normal": [0, 1, 0] } }, "material": "floor" },
                { "shape": { "sphere": { "centre": [0, 1, 0], "radius": 0.3 } }, "material": "glass" },
                { "shape": { "sphere": { "centre": [0, 1, 0], "radius": 0.01 } }, "material": "lamp" }] }"#;

/// What is judged: presets that there are, and two scenes that are hard.
fn scenes() -> Vec<(String, Scene)> {
    let preset =
        |name: &str| load(&Input::Preset(name.to_owned()), &LoadOptions::default()).ok().map(|l| (name.to_owned(), l.scene));
    let mut all: Vec<(String, Scene)> =
        ["cornell", "glossy-box", "many-lights", "product"].into_iter().filter_map(preset).collect();
    for (name, text) in [("caustic", CAUSTIC), ("rare light", RARE)] {
        all.push((name.to_owned(), serde_json::from_str(text).unwrap_or_else(|e| panic!("{name} is right: {e}"))));
    }
    all
}

/// One render: its colours and what it claims.
struct Taken {
    colours: Vec<[f32; 3]>,
    claimed: Uncertainty,
}

fn taken(scene: &Scene, samples: u32, seed: u64) -> Taken {
    let settings = Settings {
        size: [30, 20],
        sampling: Sampling::General(samples),
        integrator: Integrator::Path,
        seed,
        ..Settings::of(scene)
    };
    let ready: Ready = prepare(scene, &settings, &()).unwrap_or_else(|e| panic!("{e}"));
    let mut film = ready.film("");
    let whole = film.whole();
    ready.render_part(&mut film, &whole, &()).unwrap_or_else(|e| panic!("{e}"));
    Taken { colours: film.picture().rgb, claimed: film.uncertainty().unwrap_or_else(|| panic!("two replicates")) }
}

/// Root relMSE of a render, judged by the mean of the others, whose own error adds a share of one in so many.
fn error(render: &Taken, sum: &[[f64; 3]], renders: f64) -> f64 {
    let pixels = render.colours.iter().zip(sum);
    let of = |(colour, sum): (&[f32; 3], &[f64; 3])| {
        (0..3)
            .map(|i| {
                let truth = (sum[i] - f64::from(colour[i])) / (renders - 1.0);
                (f64::from(colour[i]) - truth).powi(2) / (truth * truth + 0.01)
            })
            .sum::<f64>()
    };
    (pixels.map(of).sum::<f64>() / (3.0 * render.colours.len() as f64) * (renders - 1.0) / renders).sqrt()
}

fn main() {
    if !turns::measuring() {
        return;
    }
    let renders = std::env::args().skip(1).find_map(|argument| argument.parse().ok()).unwrap_or(100_u64);
    println!("{renders} renders of 30 x 20 pixels each\n");
    println!(
        "| scene | samples | root relMSE, mean | flagged | interval holds, of the others | beyond twice, of the others | pixels that share the error |"
    );
    println!("|---|---|---|---|---|---|---|");
    for (name, scene) in scenes() {
        for samples in [16, 64] {
            let all: Vec<Taken> = (0..renders).map(|seed| taken(&scene, samples, seed)).collect();
            let mut sum = vec![[0.0; 3]; all[0].colours.len()];
            for colours in all.iter().map(|render| &render.colours) {
                sum.iter_mut().zip(colours).for_each(|(sum, c)| (0..3).for_each(|i| sum[i] += f64::from(c[i])));
            }
            let errors: Vec<f64> = all.iter().map(|render| error(render, &sum, renders as f64)).collect();
            let sure: Vec<(&Taken, f64)> = all.iter().zip(errors.iter().copied()).filter(|(r, _)| r.claimed.converged).collect();
            let share = |count: usize, of: usize| {
                if of == 0 { "-".to_owned() } else { format!("{:.1} %", 100.0 * count as f64 / of as f64) }
            };
            let holds = |(render, error): &&(&Taken, f64)| {
                let of = render.claimed.root_relmse;
                (of.low..=of.high).contains(error)
            };
            let beyond = |(render, error): &&(&Taken, f64)| !(0.5..=2.0).contains(&(error / render.claimed.root_relmse.value));
            let mut pixels: Vec<f64> = all.iter().map(|render| render.claimed.root_relmse.pixels).collect();
            pixels.sort_by(f64::total_cmp);
            println!(
                "| {name} | {samples} | {:.4} | {} | {} | {} | {:.0} ({:.0} to {:.0}) |",
                errors.iter().sum::<f64>() / errors.len() as f64,
                share(all.len() - sure.len(), all.len()),
                share(sure.iter().filter(holds).count(), sure.len()),
                share(sure.iter().filter(beyond).count(), sure.len()),
                pixels[pixels.len() / 2],
                pixels[pixels.len() / 20],
                pixels[pixels.len() - 1 - pixels.len() / 20],
            );
        }
    }
}
