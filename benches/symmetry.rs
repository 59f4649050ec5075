//! Pairs of equivalent scene descriptions, rendered and compared for a given time: random scenes,
//! presets, and named models. Differences are listed with their seed, so that they can be repeated.
//! `cargo bench --bench symmetry -- SECONDS [FIRST_SEED] [MODEL ...]`
#![expect(
    clippy::print_stdout,
    reason = "what is found is this program's result"
)]

#[path = "../tests/integration/symmetry/retold.rs"]
mod retold;
#[path = "../tests/integration/symmetry/twins.rs"]
mod twins;
#[path = "../tests/integration/symmetry/worlds.rs"]
mod worlds;

use std::time::{Duration, Instant};

use raywright::core::Scene;
use raywright::core::settings::PrecisionChoice;
use raywright::io::{Input, LoadOptions, load, presets};

use twins::{PictureDistance, Symmetry, of_scene, of_world};

const PRECISIONS: [PrecisionChoice; 2] = [PrecisionChoice::Robust, PrecisionChoice::Reference];

/// Results of one symmetry.
#[derive(Default)]
struct SymmetryTally {
    compared: u64,
    apart: u64,
    most_pixels: f64,
}

impl SymmetryTally {
    fn add(&mut self, apart: &PictureDistance) {
        self.compared += 1;
        self.most_pixels = self.most_pixels.max(apart.share);
        if !apart.holds {
            self.apart += 1;
            println!("{apart}");
        }
    }
}

fn main() {
    let arguments: Vec<String> = std::env::args()
        .skip(1)
        .filter(|argument| argument != "--bench")
        .collect();
    // Cargo runs benches also to list or check them.
    let Some(seconds) = arguments.first().and_then(|argument| argument.parse().ok()) else {
        return;
    };
    let first: u64 = arguments
        .get(1)
        .and_then(|argument| argument.parse().ok())
        .unwrap_or(1000);
    let (start, budget) = (Instant::now(), Duration::from_secs(seconds));
    let mut tallies: Vec<(String, SymmetryTally)> = Vec::new();
    let mut add = |name: String, apart: &PictureDistance| match tallies
        .iter_mut()
        .find(|(other, _)| *other == name)
    {
        Some((_, tally)) => tally.add(apart),
        None => {
            let mut tally = SymmetryTally::default();
            tally.add(apart);
            tallies.push((name, tally));
        }
    };
    let named = arguments
        .iter()
        .skip(2)
        .map(|path| Input::Path(path.into()));
    let carried = presets::list()
        .into_iter()
        .map(|preset| Input::Preset(preset.name.to_owned()));
    let scenes: Vec<(String, Scene)> = carried
        .chain(named)
        .filter_map(|input| {
            let loaded = load(&input, &LoadOptions::default())
                .inspect_err(|e| println!("{e}"))
                .ok()?;
            Some((loaded.source.name, loaded.scene))
        })
        .collect();
    for (name, scene) in &scenes {
        for (symmetry, precision) in Symmetry::OF_ANY
            .into_iter()
            .flat_map(|symmetry| PRECISIONS.map(|precision| (symmetry, precision)))
        {
            add(
                format!("{symmetry:?}, presets and models"),
                &of_scene(name, scene, symmetry, first, precision),
            );
        }
    }
    let mut seed = first;
    while start.elapsed() < budget {
        for symmetry in Symmetry::ALL {
            for precision in PRECISIONS {
                add(
                    format!("{symmetry:?}, random"),
                    &of_world(symmetry, seed, precision),
                );
            }
        }
        seed += 1;
    }
    println!(
        "\n| symmetry | pictures compared | apart | most pixels beyond the tolerance |\n|---|---|---|---|"
    );
    for (
        name,
        SymmetryTally {
            compared,
            apart,
            most_pixels,
        },
    ) in &tallies
    {
        println!(
            "| {name} | {compared} | {apart} | {:.2} % |",
            100.0 * most_pixels
        );
    }
    println!(
        "\nseeds {first} to {}, {} s",
        seed - 1,
        start.elapsed().as_secs()
    );
}
