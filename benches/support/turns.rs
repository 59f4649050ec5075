//! Timing of contestants in turns.

use std::time::Instant;

use raywright::core::bench::SampleQuantiles;
use raywright::core::bench::clock::process_seconds;

/// A contestant to be timed.
pub struct Contestant<'a> {
    /// Name in the table.
    pub name: &'a str,
    /// Work to be timed.
    pub work: &'a dyn Fn(),
}

/// Times contestants in turns, with another one first in each round, after a warm-up round. Returns
/// a table: wall-clock and CPU seconds of all threads, median ± half the interquartile range, and
/// both as multiples of the first contestant's in the same round.
pub fn interleaved(title: &str, repeats: usize, contestants: &[Contestant<'_>]) -> String {
    let mut rounds: Vec<Vec<[f64; 2]>> = Vec::with_capacity(repeats);
    for round in 0..=repeats {
        let mut times = vec![[0.0; 2]; contestants.len()];
        for place in 0..contestants.len() {
            let turn = (place + round) % contestants.len();
            let (wall, cpu) = (Instant::now(), process_seconds());
            (contestants[turn].work)();
            times[turn] = [wall.elapsed().as_secs_f64(), process_seconds() - cpu];
        }
        if round > 0 {
            rounds.push(times);
        }
    }
    let mut table = format!(
        "\n{title}, {repeats} rounds\n{:24}{:>20}{:>20}{:>20}{:>20}\n",
        "", "wall, s", "CPU, s", "wall : first", "CPU : first"
    );
    for (i, contestant) in contestants.iter().enumerate() {
        let cell = |value: &dyn Fn(&[[f64; 2]]) -> f64| {
            let spread = SampleQuantiles::from_samples(
                &rounds.iter().map(|round| value(round)).collect::<Vec<_>>(),
            );
            format!(
                "{:.4} ±{:4.1} %",
                spread.median,
                spread.relative_half_spread() * 100.0
            )
        };
        let cells = [0, 1].map(|clock| cell(&|round| round[i][clock]));
        let ratios = [0, 1].map(|clock| cell(&|round| round[i][clock] / round[0][clock]));
        table += &format!(
            "{:24}{:>20}{:>20}{:>20}{:>20}\n",
            contestant.name, cells[0], cells[1], ratios[0], ratios[1]
        );
    }
    table
}

/// Whether this run measures, rather than lists or checks the benches.
pub fn measuring() -> bool {
    !std::env::args().any(|argument| ["--test", "--list"].contains(&argument.as_str()))
}
