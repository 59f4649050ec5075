//! Calibration of pixel errors: how often the 95 % intervals of pixels contain the truth, by the
//! number of replicates and samples, and the error that replicates add. `benches/README.md` quotes
//! the tables.
//!
//! `cargo bench --bench intervals -- 20` takes 20 seeds in place of 200.
#![expect(clippy::print_stdout, reason = "the tables are this program's result")]

#[path = "support/chance.rs"]
mod chance;
#[path = "support/turns.rs"]
#[expect(dead_code, reason = "nothing is timed here")]
mod turns;

use chance::{SamplingCase, judge, picture, scenes};

const SIZE: [u32; 2] = [40, 27];
/// Samples of the reference. Its variance is a small part of a judged pixel's, and is added.
const REFERENCE: u32 = 8192;

fn main() {
    if !turns::measuring() {
        return;
    }
    let seeds = std::env::args()
        .skip(1)
        .find_map(|argument| argument.parse().ok())
        .unwrap_or(200);
    for (name, scene) in scenes() {
        let reference = picture(
            &scene,
            SamplingCase {
                size: SIZE,
                samples: REFERENCE,
                replicates: Some(16),
            },
            u64::MAX,
        );
        println!("\n{name}, {seeds} seeds × {} pixels\n", SIZE[0] * SIZE[1]);
        println!(
            "| samples | replicates | intervals that hold | without width | error | said to be | error : one replicate |"
        );
        println!("|---|---|---|---|---|---|---|");
        for samples in [4, 8, 16, 64] {
            let mut single = f64::NAN;
            for replicates in [1, 2, 4, 8].into_iter().filter(|&r| r <= samples) {
                let render = SamplingCase {
                    size: SIZE,
                    samples,
                    replicates: Some(replicates),
                };
                let tally = judge(&scene, &reference, render, 0..seeds);
                if replicates == 1 {
                    single = tally.error();
                    println!("| {samples} | 1 | | | {single:.5} | | 1 |");
                    continue;
                }
                let (held, empty) = (
                    100.0 * tally.coverage(),
                    100.0 * tally.empty as f64 / tally.intervals as f64,
                );
                let (error, claimed) = (tally.error(), tally.claimed());
                println!(
                    "| {samples} | {replicates} | {held:.2} % | {empty:.2} % | {error:.5} | {claimed:.5} | {:.3} |",
                    error / single
                );
            }
        }
    }
}
