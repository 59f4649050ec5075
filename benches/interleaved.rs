//! Comparisons with differences below the drift of a machine's speed between two benches: the
//! contestants take turns, and the table gives the spread of repeats. `benches/README.md` quotes
//! it. Named scenes (`-- preset:product model.glb`) are rendered in each precision, and nothing
//! else is.
#![expect(clippy::print_stdout, reason = "the tables are this program's result")]

#[path = "support/mesh.rs"]
mod mesh;
#[path = "support/scenes.rs"]
mod scenes;
#[path = "support/threads.rs"]
mod threads;
#[path = "support/turns.rs"]
mod turns;

use raywright::core::Scene;
use raywright::core::settings::{PrecisionChoice, Sampling, Settings};
use raywright::io::{Input, LoadOptions, load};

use mesh::mesh;
use scenes::{preset, ready};
use threads::threads;
use turns::{Contestant, interleaved, measuring};

const ROUNDS: usize = 15;
/// Size for scenes with slow pixels.
const TINY: [u32; 2] = [320, 180];
const SMALL: [u32; 2] = [640, 360];
const FULL: [u32; 2] = [1920, 1080];

fn main() {
    if !measuring() {
        return;
    }
    let named: Vec<String> = std::env::args()
        .skip(1)
        .filter(|argument| !argument.starts_with("--"))
        .collect();
    if !named.is_empty() {
        named
            .iter()
            .for_each(|name| precisions(&scene(name), name, TINY));
        return;
    }
    let Some(whitted) = preset("whitted") else {
        return;
    };
    two_threads(&whitted, "whitted", FULL);
    precisions(&whitted, "whitted", SMALL);
    precisions(&mesh(), "mesh of 65 536 triangles", SMALL);
    for name in ["shapes", "product"] {
        if let Some(scene) = preset(name) {
            precisions(&scene, name, TINY);
        }
    }
}

/// A scene by the name that the program accepts.
fn scene(name: &str) -> Scene {
    let input = name.strip_prefix("preset:").map_or_else(
        || Input::Path(name.into()),
        |preset| Input::Preset(preset.to_owned()),
    );
    load(&input, &LoadOptions::default())
        .unwrap_or_else(|e| panic!("{e}"))
        .scene
}

/// Name in the table, and the change of settings.
type Variant<'a> = (&'a str, &'a dyn Fn(&mut Settings));

/// Renders with several settings on one thread, in turns.
fn compare(title: &str, scene: &Scene, size: [u32; 2], variants: &[Variant<'_>]) {
    let prepared: Vec<_> = variants
        .iter()
        .map(|(name, adjust)| (*name, ready(scene, size, adjust)))
        .collect();
    let alone = threads(1);
    let works: Vec<_> = prepared
        .iter()
        .map(|(name, ready)| (*name, || drop(alone.install(|| ready.render(&())))))
        .collect();
    let contestants: Vec<_> = works
        .iter()
        .map(|(name, work)| Contestant { name, work })
        .collect();
    print!("{}", interleaved(title, ROUNDS, &contestants));
}

/// Speedup of a second thread, in wall-clock time.
fn two_threads(scene: &Scene, name: &str, size: [u32; 2]) {
    let title = format!("{name} at {}x{}, one thread and two", size[0], size[1]);
    let (ready, pools) = (ready(scene, size, |_| {}), [threads(1), threads(2)]);
    let [one, two] = pools
        .each_ref()
        .map(|pool| || drop(pool.install(|| ready.render(&()))));
    let contestants = [
        Contestant {
            name: "one thread",
            work: &one,
        },
        Contestant {
            name: "two threads",
            work: &two,
        },
    ];
    print!("{}", interleaved(&title, ROUNDS, &contestants));
}

/// Cost of each precision. Randomly sampled scenes use 4 samples per pixel.
fn precisions(scene: &Scene, name: &str, size: [u32; 2]) {
    let with = |precision| {
        move |settings: &mut Settings| {
            settings.precision = precision;
            if scene.render.pattern.is_none() {
                settings.sampling = Sampling::from_spp(scene, Some(4));
            }
        }
    };
    let variants: [Variant<'_>; 2] = [
        ("robust", &with(PrecisionChoice::Robust)),
        ("reference", &with(PrecisionChoice::Reference)),
    ];
    compare(
        &format!("{name} at {}x{}, by precision", size[0], size[1]),
        scene,
        size,
        &variants,
    );
}
