//! How loading grows with what there is to load: for each kind of thing that a scene has many of, the time to read and check
//! its file, and to explain and prepare it, at 10³, 10⁴ and 10⁵ of it. `tests/integration/many.rs` holds that it stays linear.
#![expect(clippy::print_stdout, reason = "the table is this program's result")]

#[path = "support/many.rs"]
mod many;

use std::time::Instant;

use raywright::core::effects::detect;
use raywright::core::{Settings, prepare};
use raywright::io::{Input, LoadOptions, load};

use many::{FAMILIES, Family};

const ROUNDS: usize = 3;
const SIZES: [usize; 3] = [1_000, 10_000, 100_000];

fn main() {
    // `cargo test` and a listing of the benches do not measure.
    if std::env::args().any(|argument| ["--test", "--list"].contains(&argument.as_str())) {
        return;
    }
    println!("seconds to load + explain and prepare, the least of {ROUNDS}; exponent from {} to {}", SIZES[0], SIZES[2]);
    for family in &FAMILIES {
        let times = SIZES.map(|n| least(family, n));
        let exponent = (times[2].iter().sum::<f64>() / times[0].iter().sum::<f64>()).log10() / 2.0;
        let cells = times.map(|[load, rest]| format!("{load:.3} + {rest:.3}"));
        println!("| {:40} | {} | {exponent:.2} |", family.0, cells.join(" | "));
    }
}

/// The least times of several rounds: to load, and for the rest.
fn least((what, write): &Family, n: usize) -> [f64; 2] {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let files = write(n);
    for (name, contents) in &files {
        std::fs::write(folder.path().join(name), contents).expect("the folder can be written to");
    }
    let path = folder.path().join(files[0].0);
    let round = || {
        let start = Instant::now();
        let loaded = load(&Input::Path(path.clone()), &LoadOptions::default()).unwrap_or_else(|e| panic!("{what}: {e}"));
        let load = start.elapsed().as_secs_f64();
        let start = Instant::now();
        let settings = Settings { size: [8, 8], ..Settings::of(&loaded.scene) };
        let report = detect(&loaded.scene, &settings);
        let ready = prepare(&loaded.scene, &settings, &()).unwrap_or_else(|e| panic!("{what}: {e}"));
        let rest = start.elapsed().as_secs_f64();
        drop((report, ready));
        [load, rest]
    };
    (0..ROUNDS).map(|_| round()).fold([f64::INFINITY; 2], |least, times| [least[0].min(times[0]), least[1].min(times[1])])
}
