//! Build times of trees over arrangements that are hard for builders, relative to random primitives
//! of the same number, and the ray cost of these trees. `benches/README.md` quotes the table.
#![expect(clippy::print_stdout, reason = "the table is this program's result")]

#[path = "../crates/bvh/tests/builds/families.rs"]
mod families;
#[path = "../crates/bvh/tests/split_mix.rs"]
mod split_mix;

use raywright::bvh::{AcceleratorKind, BuildQuality, Geometry, Interval, Ray, TraversalStats};
use raywright::core::bench::SampleQuantiles;
use raywright::core::bench::clock::process_seconds;

use families::{ArrangementRng, FAMILIES, Family, Item, group, random, uneven};

const ROUNDS: usize = 5;

/// `cargo bench --bench builds -- 1000000 High`: number of primitives, and build quality.
fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    // Cargo runs benches also to list or check them.
    if arguments
        .iter()
        .any(|argument| ["--test", "--list"].contains(&argument.as_str()))
    {
        return;
    }
    let count = arguments
        .iter()
        .find_map(|a| a.parse().ok())
        .unwrap_or(100_000);
    let named = |quality: &BuildQuality| arguments.contains(&format!("{quality:?}"));
    let quality = BuildQuality::ALL
        .into_iter()
        .find(named)
        .unwrap_or_default();
    println!(
        "\n{count} primitives, preset {quality:?}, {ROUNDS} rounds; CPU time of all threads as a multiple of random ones"
    );
    println!(
        "{:40}{:>18}{:>14}{:>14}",
        "", "time : random", "nodes/ray", "tests/ray"
    );
    let base: Family = ("random", random);
    [base, ("random, one of 500 large", uneven)]
        .into_iter()
        .chain(FAMILIES)
        .for_each(|family| row(family, count, quality));
}

/// CPU seconds of a build, and its result.
fn build(items: &[Item], quality: BuildQuality) -> (f64, Geometry<f32>) {
    let group = group(items);
    let start = process_seconds();
    let geometry = Geometry::new(group, AcceleratorKind::Tree(quality));
    (process_seconds() - start, geometry)
}

/// One family compared with random primitives, in turns.
fn row((name, family): Family, count: usize, quality: BuildQuality) {
    let (items, base) = (family(count), random(count));
    let ratio = |_| {
        let first = build(&base, quality).0;
        build(&items, quality).0 / first
    };
    let spread = SampleQuantiles::from_samples(&(0..ROUNDS).map(ratio).collect::<Vec<_>>());
    let (_, geometry) = build(&items, quality);
    let [nodes, tests] = visits(&geometry, &items);
    let time = format!(
        "{:.2} ± {:.0} %",
        spread.median,
        spread.relative_half_spread() * 100.0
    );
    println!("{name:40}{time:>18}{nodes:>14.1}{tests:>14.1}");
}

/// Nodes and primitives visited per ray. Each ray is aimed at a primitive from a few of its sizes
/// away.
fn visits(geometry: &Geometry<f32>, items: &[Item]) -> [f64; 2] {
    const RAYS: usize = 400;
    let (random, mut stats) = (&mut ArrangementRng(9), TraversalStats::default());
    for i in 0..RAYS {
        let (target, size) = match items[i * 7919 % items.len()] {
            Item::Ball(centre, radius) => (centre + random.point() * 0.5 * radius, radius),
            Item::Triangle([a, b, c]) => ((a + b + c) / 3.0, a.distance(b)),
        };
        let origin = target + random.point() * size * 4.0;
        let ray = Ray::new(origin, (target - origin).as_dvec3().normalize().as_vec3());
        geometry.closest(&ray, Interval::positive(), &mut stats);
    }
    [stats.nodes, stats.primitives].map(|n| n as f64 / RAYS as f64)
}
