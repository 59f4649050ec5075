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
    CaseCost, CaseOutcome, RayCount, TEXTBOOK, hard_cases, measure_case, time_case_formulas,
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
    let mut rounds = vec![];
    for round in 0..=ROUNDS {
        let mut seconds = [f64::NAN; 3];
        for place in 0..works.len() {
            let turn = (place + round) % works.len();
            let Some(work) = works[turn] else { continue };
            let start = process_seconds();
            work();
            seconds[turn] = process_seconds() - start;
        }
        rounds.push(seconds);
    }
    print_row(name, &rounds[1..]);
}

/// Prints the times of several rounds; NaN for an implementation that does not exist.
fn print_row(name: &str, rounds: &[[f64; 3]]) {
    let cell = |index: usize| {
        let ratios: Vec<_> = rounds.iter().map(|own| own[index] / own[1]).collect();
        let spread = SampleQuantiles::from_samples(&ratios);
        match index {
            _ if spread.median.is_nan() => "—".to_owned(),
            1 => "1".to_owned(),
            _ => {
                let half = spread.relative_half_spread() * 100.0;
                format!("{:.2} ± {half:.1} %", spread.median)
            }
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
        if let Some(CaseCost { label, rounds }) = time_case_formulas(number) {
            print_row(&format!("{label} ({number})"), &rounds);
        }
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
        let outcomes = measure_case(case.number, shot).unwrap_or_default();
        let of = |setting| {
            let own = outcomes
                .iter()
                .filter(move |own| own.setting.starts_with(setting));
            own.cloned().reduce(CaseOutcome::merge)
        };
        let Some(textbook) = of(TEXTBOOK) else {
            continue;
        };
        let share = 100.0 * textbook.wrong_fraction();
        let wrong = |precision| of(precision).map_or(0, |own| own.wrong);
        let (robust, reference) = (wrong("robust"), wrong("reference"));
        println!(
            "| **wrong**: {} ({}) | {share:.1} % | {robust} | {reference} |",
            case.difficulty.trim_end_matches('.'),
            case.number
        );
    }
}
