//! Cost of accuracy, and errors without it: the table in docs/accuracy-reference.md of textbook
//! formulas in f32, of `robust` and of `reference`. The textbook formulas are not part of the
//! program; they are the comparator of its tests.
#![expect(clippy::print_stdout, reason = "the table is this program's result")]

#[path = "support/mesh.rs"]
mod mesh;
#[path = "support/scenes.rs"]
mod scenes;
#[path = "support/threads.rs"]
mod threads;

use raywright::core::Scene;
use raywright::core::bench::SampleQuantiles;
use raywright::core::bench::clock::process_seconds;
use raywright::core::settings::{PrecisionChoice, Sampling};
use raywright::stability::{
    CostComparison, Measurement, RayCount, build_formula_comparison, hard_cases, measure_case,
};

use mesh::mesh;
use scenes::{preset, ready};
use threads::threads;

const ROUNDS: usize = 15;

fn main() {
    // Cargo runs benches also to list or check them.
    if std::env::args().any(|argument| ["--test", "--list"].contains(&argument.as_str())) {
        return;
    }
    println!(
        "| | the textbook's formulas | `robust`, the default | `reference` |\n|---|---|---|---|"
    );
    tests();
    pictures();
    cases();
}

/// Times several implementations in turns: CPU time relative to `robust`.
fn row(name: &str, works: [Option<&dyn Fn()>; 3]) {
    let mut ratios = [(); 3].map(|()| Vec::with_capacity(ROUNDS));
    for round in 0..=ROUNDS {
        let mut seconds = [f64::NAN; 3];
        for place in 0..works.len() {
            let turn = (place + round) % works.len();
            let Some(work) = works[turn] else { continue };
            let start = process_seconds();
            work();
            seconds[turn] = process_seconds() - start;
        }
        if round > 0 {
            ratios
                .iter_mut()
                .zip(seconds)
                .for_each(|(ratios, own)| ratios.push(own / seconds[1]));
        }
    }
    let cell = |index: usize| match works[index] {
        None => "—".to_owned(),
        Some(_) if index == 1 => "1".to_owned(),
        Some(_) => {
            let spread = SampleQuantiles::from_samples(&ratios[index]);
            format!(
                "{:.2} ± {:.1} %",
                spread.median,
                spread.relative_half_spread() * 100.0
            )
        }
    };
    println!(
        "| **time**: {name} | {} | {} | {} |",
        cell(0),
        cell(1),
        cell(2)
    );
}

/// Time per ray or sample, for every hard case with a textbook formula.
fn tests() {
    for number in hard_cases().map(|case| case.number) {
        let Some(CostComparison {
            label,
            textbook,
            library: [robust, reference],
            ..
        }) = build_formula_comparison(number)
        else {
            continue;
        };
        row(
            &format!("{label} ({number})"),
            [Some(&textbook), Some(&robust), Some(&reference)],
        );
    }
}

/// Whole pictures, for which no textbook implementation exists.
fn pictures() {
    let picture = |name: &str, scene: Option<Scene>, size: [u32; 2]| {
        let Some(scene) = scene else { return };
        let alone = threads(1);
        let [robust, reference] =
            [PrecisionChoice::Robust, PrecisionChoice::Reference].map(|precision| {
                ready(&scene, size, |settings| {
                    settings.precision = precision;
                    if scene.render.pattern.is_none() {
                        settings.sampling = Sampling::from_spp(&scene, Some(4));
                    }
                })
            });
        let render =
            |ready: &raywright::core::ReadyScene| drop(alone.install(|| ready.render(&())));
        row(
            name,
            [
                None,
                Some(&|| render(&robust)),
                Some(&|| render(&reference)),
            ],
        );
    };
    picture("the preset", preset("whitted"), [640, 360]);
    picture("a mesh of 65 536 triangles", Some(mesh()), [640, 360]);
    picture("the preset `shapes`", preset("shapes"), [320, 180]);
    picture(
        "the preset `product`, path-traced",
        preset("product"),
        [320, 180],
    );
}

/// Error rates in the hard cases with textbook formulas, on the same rays.
fn cases() {
    let shot = if std::env::var("RAYS").is_ok_and(|rays| rays == "all") {
        RayCount::All
    } else {
        RayCount::Quarter
    };
    for case in hard_cases() {
        let measurements = measure_case(case.number, shot).unwrap_or_default();
        let Some(share) = measurements.first().and_then(Measurement::textbook_wrong) else {
            continue;
        };
        let wrong = |precision: &str| -> u64 {
            let of = |measurement: &&Measurement| measurement.setting.starts_with(precision);
            measurements
                .iter()
                .filter(of)
                .map(|measurement| measurement.outcome().wrong)
                .sum()
        };
        let share = 100.0 * share;
        let (robust, reference) = (wrong("robust"), wrong("reference"));
        println!(
            "| **wrong**: {} ({}) | {share:.1} % | {robust} | {reference} |",
            case.difficulty.trim_end_matches('.'),
            case.number
        );
    }
}
