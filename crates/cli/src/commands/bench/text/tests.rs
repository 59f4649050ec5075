//! Tables of `bench`: rounded numbers, each in its column.

use raywright_core::bench::SampleQuantiles;

use super::*;

fn quantiles(median: f64) -> SampleQuantiles {
    SampleQuantiles {
        median,
        lower_quartile: 0.95 * median,
        upper_quartile: 1.05 * median,
        min: 0.5 * median,
        max: 2.0 * median,
    }
}

fn cost(nanoseconds: f64, build_milliseconds: f64, bytes: usize) -> QueryCost {
    let (nanoseconds, build_milliseconds) = (quantiles(nanoseconds), quantiles(build_milliseconds));
    QueryCost {
        nanoseconds,
        rays: 400,
        nodes_per_ray: 7.25,
        tests_per_ray: 2.5,
        build_milliseconds,
        bytes,
    }
}

/// Protects: each figure of a row is in its column: scan before tree, their ratio, shares in
/// percent, and for a whole scene's structures time and memory.
#[test]
fn figures_are_in_their_columns() {
    let row = ScanTreeTiming {
        primitives: 1000,
        hit_share: 0.625,
        scan: Some(cost(800.0, 1.0, 2000)),
        tree: cost(50.0, 5.0, 6_000_000),
        ratio: Some(quantiles(16.0)),
    };
    let times = |row: &ScanTreeTiming| {
        time_table(&["N"], vec![(vec!["7".to_owned()], row)]).rows[1]
            .cells
            .join(" | ")
    };
    assert_eq!(
        times(&row),
        "7 | 62.5 % | 800 ± 5.0 % | 50.0 ± 5.0 % | 16.0 ± 5.0 % | 7.2 | 2.5"
    );
    let comparison = SceneComparison {
        camera: row,
        bounce: None,
    };
    let options = raywright_core::bench::BenchOptions {
        repeats: 1,
        sample_seconds: 0.05,
        build: raywright_core::bvh::BuildQuality::Fast,
    };
    let report = BenchReport::new(options, BenchMeasurements::Generated(vec![]));
    let sheet = &scene_sections(&comparison, &report)[1];
    assert_eq!(
        sheet.title,
        "Scan against tree, 1000 primitives: build and memory"
    );
    let rows: Vec<String> = sheet
        .table
        .rows
        .iter()
        .map(|row| row.cells.join(" | "))
        .collect();
    assert_eq!(
        rows[1..],
        ["1000 | 1.00 ± 5.0 % | 2.00 | 5.00 ± 5.0 % | 6000"]
    );
    let untimed = ScanTreeTiming {
        scan: None,
        ratio: None,
        ..row
    };
    assert_eq!(
        times(&untimed),
        "7 | 62.5 % | not run | 50.0 ± 5.0 % | - | 7.2 | 2.5"
    );
}
