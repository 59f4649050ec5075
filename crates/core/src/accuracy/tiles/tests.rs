//! Tests of the tile sample: tiles cover the picture, inclusion probabilities are right, and
//! intervals hold.

use super::*;

const GRID: TileGrid = TileGrid {
    size: [320, 184],
    edge: 16,
    seed: 0,
};

fn uniform(seed: u64, index: u64) -> f64 {
    (splitmix64(seed ^ splitmix64(index)) >> 11) as f64 / 2_f64.powi(53)
}

/// A skewed number with mean and variance one.
fn exponential(seed: u64, index: u64) -> f64 {
    -libm::log(1.0 - uniform(seed, index))
}

/// Protects: tiles cover each pixel of a picture once, stay inside the picture with their margins,
/// and every prefix of their order reaches all of the picture.
#[test]
fn tiles_are_the_picture() {
    let mut covered = vec![0; 320 * 184];
    for index in 0..GRID.tile_count() as u32 {
        let Crop {
            x,
            y,
            width,
            height,
        } = GRID.tile_crop(index);
        (y..y + height)
            .for_each(|y| (x..x + width).for_each(|x| covered[(y * 320 + x) as usize] += 1));
        let around = GRID.tile_crop_with_margin(index, 20);
        assert!(
            around.x + around.width <= 320
                && around.y + around.height <= 184
                && around.x <= x
                && around.y <= y
        );
    }
    assert!(covered.iter().all(|&times| times == 1));
    let first: Vec<Crop> = GRID
        .evenly_spread_tile_order()
        .into_iter()
        .take(24)
        .map(|index| GRID.tile_crop(index))
        .collect();
    for (left, top) in [(0, 0), (160, 0), (0, 92), (160, 92)] {
        let here = first.iter().filter(|tile| {
            (left..left + 160).contains(&tile.x) && (top..top + 92).contains(&tile.y)
        });
        assert!((4..=8).contains(&here.count()), "{first:?}");
    }
}

/// Looks with uneven noise.
fn looks(grid: TileGrid) -> Vec<PilotTile> {
    let noise = |tile: u32| if tile.is_multiple_of(9) { 8.0 } else { 1.0 };
    (0..grid.tile_count() as u32)
        .map(|tile| PilotTile {
            tile,
            seconds: 1.0,
            noise: noise(tile),
        })
        .collect()
}

/// Protects: a tile is drawn as often as its inclusion probability says, noisy ones more often. The
/// probabilities sum to the number of drawn tiles, and a larger sample contains the smaller one.
#[test]
fn chances_are_those_with_which_tiles_are_drawn() {
    let (mut drawn, mut expected) = (vec![0.0; GRID.tile_count()], vec![0.0; GRID.tile_count()]);
    let seeds = 2000;
    for seed in 0..seeds {
        let grid = TileGrid { seed, ..GRID };
        let sample = TileSample::new(grid, &looks(grid));
        for (pilot_pass, chance) in sample.passes.iter().zip(sample.inclusion_probabilities(40)) {
            drawn[pilot_pass.tile as usize] += 1.0;
            expected[pilot_pass.tile as usize] = chance;
        }
    }
    for (drawn, expected) in drawn.iter().zip(&expected) {
        let share = drawn / seeds as f64;
        assert!(
            (share - expected).abs() < 0.2 * expected,
            "{share}, not {expected}"
        );
    }
    assert!(expected[9] > 2.0 * expected[10] && (expected.iter().sum::<f64>() - 40.0).abs() < 2.0);
    let all = TileSample::new(GRID, &looks(GRID)).inclusion_probabilities(GRID.tile_count());
    assert!(all.len() == GRID.tile_count() && all.iter().all(|&chance| chance == 1.0));
}

/// Returns the share of intervals that contain the true mean of errors, where tiles have different
/// means and blocks their own noise.
fn held(count: usize, mean: impl Fn(u64, u32) -> f64, has_looks: bool) -> f64 {
    let runs = 3000;
    let holds = |seed: &u64| {
        let mean = |tile: u32| mean(*seed, tile);
        let truth = (0..GRID.tile_count() as u32)
            .map(|tile| mean(tile) * GRID.pixel_count_of_tile(tile))
            .sum::<f64>()
            / (320.0 * 184.0);
        let grid = TileGrid {
            seed: *seed,
            ..GRID
        };
        let look = |tile: u32| PilotTile {
            tile,
            seconds: 1.0,
            noise: if has_looks {
                mean(tile) * GRID.pixel_count_of_tile(tile)
            } else {
                0.0
            },
        };
        let sample = TileSample::new(
            grid,
            &(0..GRID.tile_count() as u32).map(look).collect::<Vec<_>>(),
        );
        let blocks: Vec<[Vec<f64>; 2]> = (sample.passes.iter().take(count))
            .map(|pilot_pass| {
                let pixels = grid.pixel_count_of_tile(pilot_pass.tile) / 4.0;
                // Sixteen squares make a block.
                let noise = |block: u64| {
                    (0..16)
                        .map(|i| {
                            exponential(
                                *seed + 77,
                                u64::from(pilot_pass.tile) << 8 | block << 4 | i,
                            )
                        })
                        .sum::<f64>()
                        / 16.0
                };
                [
                    (0..4)
                        .map(|block| mean(pilot_pass.tile) * pixels * noise(block))
                        .collect(),
                    vec![pixels; 4],
                ]
            })
            .collect();
        let share = |(chance, [above, below]): (f64, &'_ [Vec<f64>; 2])| {
            (chance, above.clone(), below.clone())
        };
        let parts: Vec<_> = sample
            .inclusion_probabilities(count)
            .into_iter()
            .zip(&blocks)
            .map(share)
            .collect();
        let shares: Vec<RatioTerm<'_>> = parts
            .iter()
            .map(|(chance, above, below)| RatioTerm {
                inclusion_probability: *chance,
                numerator: above,
                denominator: below,
                reference_variance: 0.0,
            })
            .collect();
        let interval = ratio_interval(&shares);
        interval.low <= truth && truth <= interval.high
    };
    (0..runs).filter(holds).count() as f64 / runs as f64
}

/// Protects: for even noise, intervals contain the true mean in 93 to 97 of 100 pictures, with few
/// tiles, many, and the whole picture.
#[test]
fn intervals_hold_even_noise() {
    for count in [12, 60, 240] {
        let share = held(count, |_, _| 0.3, false);
        assert!((0.93..=0.97).contains(&share), "{share} with {count} tiles");
    }
}

/// Protects: intervals hold as well where tiles differ at random by a factor of several. They are
/// rather too wide where a look predicted the noisy tiles, and where a twentieth of the picture has
/// most of the error.
#[test]
fn intervals_hold_uneven_noise() {
    let uneven = |seed: u64, tile: u32| 0.1 * (0.2 + 2.0 * exponential(seed + 5, u64::from(tile)));
    for (count, has_looks, maximum) in [
        (20, false, 0.97),
        (60, false, 0.97),
        (20, true, 0.99),
        (60, true, 0.99),
    ] {
        let share = held(count, uneven, has_looks);
        assert!(
            (0.93..=maximum).contains(&share),
            "{share} with {count} tiles, {has_looks}"
        );
    }
    let rare = |seed: u64, tile: u32| {
        if uniform(seed + 6, u64::from(tile)) < 1.0 / 19.0 {
            4.0
        } else {
            0.1
        }
    };
    let share = held(40, rare, true);
    assert!(share >= 0.93, "{share}");
}

/// Protects: an estimate below the reference's own noise has an interval that starts at zero, and a
/// single tile of many gives no information.
#[test]
fn what_is_lost_in_noise_begins_at_zero() {
    let share = |chance: f64, doubt: f64| RatioTerm {
        inclusion_probability: chance,
        numerator: &[1.0, 1.2],
        denominator: &[10.0, 10.0],
        reference_variance: doubt,
    };
    let interval = ratio_interval(&[share(0.5, 0.01), share(0.5, 0.01)]);
    assert!(
        interval.low > 0.0 && (interval.value - 0.11).abs() < 1e-12,
        "{interval:?}"
    );
    let lost = ratio_interval(&[share(0.5, 40.0), share(0.5, 40.0)]);
    assert!(lost.includes_zero() && lost.high > 0.2, "{lost:?}");
    assert_eq!(ratio_interval(&[share(0.5, 0.0)]).high, f64::INFINITY);
}

/// Protects: the estimate from all tiles of a small picture, with one piece each, has an interval
/// although no tile was left out: the sum of ten alternating values 1 and 3 is as uncertain as the
/// noise of ten.
#[test]
fn all_tiles_of_a_small_picture_have_noise() {
    let above: [&[f64]; 2] = [&[1.0], &[3.0]];
    // A black tile has no doubt.
    let share = |i: usize| RatioTerm {
        inclusion_probability: 1.0,
        numerator: above[i % 2],
        denominator: &[1.0],
        reference_variance: if i == 4 { 0.0 } else { 1e-9 },
    };
    let (ratio, error, factor) =
        hajek_ratio_estimate(&(0..10).map(share).collect::<Vec<_>>()).expect("tiles");
    assert!(
        (ratio - 2.0).abs() < 1e-12 && (error - 20_f64.sqrt() / 10.0).abs() < 1e-12 && factor < 2.0,
        "{error} {factor}"
    );
}
