use super::*;
use crate::hash::splitmix64;
use crate::light::SkySampler;
use crate::lookup::SceneLookup;
use crate::scene::Scene;

/// A gradient sky with a small sun.
fn sky() -> SkyRadiance<f32> {
    let scene: Scene = serde_json::from_str(
        r#"{ "format": 1, "sky": { "gradient": { "bottom": 0.2, "top": [0.4, 0.6, 1.0],
            "suns": [{ "direction": [0.3, 0.8, -0.5], "colour": 1, "weight": 200, "exponent": 900 }] } } }"#,
    )
    .unwrap_or_else(|e| panic!("{e}"));
    let names = std::collections::BTreeMap::new();
    crate::light::prepare_sky::<f32>(
        (scene.sky.as_ref(), DVec3::ZERO),
        &SceneLookup::new(&scene),
        &names,
    )
    .unwrap_or_else(|e| panic!("{e}"))
}

fn numbers(index: u64) -> [f32; 2] {
    [0, 1].map(|k| (splitmix64(2 * index + k) >> 40) as f32 / (1 << 24) as f32)
}

/// A table of one cell, lit through a few bins of the upper hemisphere, the sun's among them.
fn table() -> Openings {
    let bounds = Aabb {
        min: DVec3::ZERO,
        max: DVec3::ONE,
    };
    let grid = CellGrid::new(&bounds).expect("an extent");
    let cell = grid
        .cell_index(DVec3::splat(0.5), DVec3::Y)
        .expect("inside");
    let (mut light, bins) = (vec![0.0; BINS], SkyBins::new(&sky()));
    let of_sun = bins
        .bin_and_density(DVec3::new(0.3, 0.8, -0.5).normalize())
        .0;
    assert!(bins.is_even[300] && !bins.is_even[of_sun]);
    for (bin, share) in [
        (300, 0.3),
        (301, 0.5),
        (332, 0.1),
        (500, 0.6),
        (of_sun, 0.4),
    ] {
        light[bin] = share;
    }
    Openings::new(grid, bins, &[(cell, smooth_bins(&light))])
}

/// Protects: the density of the mixture integrates to one over the sphere, and is that with which
/// directions are sampled, bin by bin.
#[test]
fn densities_are_those_of_the_samples() {
    let (table, sky) = (table(), sky());
    let sampler = SkySampler::new(&sky).expect("a sky");
    let bins = table
        .cell_at::<f32>(glam::Vec3::splat(0.5), glam::Vec3::Y)
        .and_then(|cell| table.bins(cell))
        .expect("a cell");
    const COUNT: u64 = 400_000;
    let mut found = vec![0.0; BINS];
    for index in 0..COUNT {
        let numbers = numbers(index);
        let part = bins.find_part(numbers[0]);
        let direction = match table.sample_direction(bins, part, numbers) {
            Ok(place) => place.to_direction(),
            Err(own) => sampler.sample_direction::<f64>(own),
        };
        found[table.sky.bin_and_density(direction).0] += 1.0 / COUNT as f64;
    }
    // Midpoint rule over a grid finer than the sun.
    const SIDE: usize = 64;
    let mut expected = vec![0.0; BINS];
    for (bin, expected) in expected.iter_mut().enumerate() {
        for cell in 0..SIDE * SIDE {
            let part = |cell: usize, fine: usize| (cell as f64 + 0.5) / SIDE as f64 * fine as f64;
            let direction = direction_in_grid(
                (bin / COLUMNS * FINE[0]) as f64 + part(cell / SIDE, FINE[0]),
                (bin % COLUMNS * FINE[1]) as f64 + part(cell % SIDE, FINE[1]),
            )
            .to_direction();
            let own = sampler.density::<f64>(direction, [0.0; 2]);
            let density = table.locate(bins, direction).density(own);
            *expected += density * 4.0 * PI / (BINS * SIDE * SIDE) as f64;
        }
    }
    let sum: f64 = expected.iter().sum();
    assert!((sum - 1.0).abs() < 1e-3, "the density integrates to {sum}");
    for (bin, (found, expected)) in found.iter().zip(&expected).enumerate() {
        let deviation = (expected / COUNT as f64).sqrt();
        assert!(
            (found - expected).abs() <= 5.0 * deviation + 1e-4,
            "bin {bin}: {found}, not {expected}"
        );
    }
}

/// Protects: a cell is that of a point and of the axis to which its normal points most; there is
/// none outside the bounds and for a point lit from both sides.
#[test]
fn cells_are_told_apart_by_place_and_side() {
    let bounds = Aabb {
        min: DVec3::new(-1.0, 0.0, 2.0),
        max: DVec3::new(3.0, 2.0, 5.0),
    };
    let grid = CellGrid::new(&bounds).expect("an extent");
    let inside = DVec3::new(0.1, 1.0, 3.0);
    let mut cells: Vec<usize> = [1.0, -1.0]
        .into_iter()
        .flat_map(|sign| DVec3::AXES.map(|axis| axis * sign))
        .map(|normal| grid.cell_index(inside, normal).expect("inside"))
        .chain(grid.cell_index(bounds.max, DVec3::Y))
        .chain(grid.cell_index(bounds.min, DVec3::Y))
        .collect();
    assert!(cells.iter().all(|&cell| cell < grid.len()));
    cells.sort_unstable();
    cells.dedup();
    assert_eq!(cells.len(), 8);
    assert_eq!(grid.cell_index(inside, DVec3::ZERO), None);
    assert_eq!(grid.cell_index(bounds.max + 1.0, DVec3::Y), None);
    assert_eq!(grid.cell_index(DVec3::NAN, DVec3::Y), None);
    let point = Aabb {
        min: inside,
        max: inside,
    };
    assert!(CellGrid::new(&point).is_none() && CellGrid::new(&Aabb::EMPTY).is_none());
}
