//! Sampling tables over the sphere at their extremes: black rows, one bright cell, the poles.

use raywright_bvh::shapes::equirectangular_coordinates;

use super::*;
use crate::hash::splitmix64;

/// Two uniform pseudo-random numbers.
fn numbers(i: u64) -> [f64; 2] {
    [2 * i, 2 * i + 1].map(|k| (splitmix64(k) >> 11) as f64 / (1_u64 << 53) as f64)
}

/// The density of a direction.
fn density(grid: &SphereGrid, direction: DVec3) -> f64 {
    grid.density(equirectangular_coordinates::<f64>(direction))
}

/// The integral of the density by one point a cell, with the solid angle as a difference of
/// cosines.
fn integral(grid: &SphereGrid, width: usize, height: usize) -> f64 {
    let row = |row: usize| {
        let at = |edge: f64| PI * edge / height as f64;
        let cell = (at(row as f64).cos() - at(row as f64 + 1.0).cos()) * TAU / width as f64;
        let (y, ring) = (at(row as f64 + 0.5).cos(), at(row as f64 + 0.5).sin());
        let value_of = |column: usize| {
            let angle = TAU * ((column as f64 + 0.5) / width as f64 + grid.turn - 0.5);
            density(grid, DVec3::new(ring * angle.cos(), y, ring * angle.sin()))
        };
        (0..width).map(value_of).sum::<f64>() * cell
    };
    (0..height).map(row).sum()
}

/// Protects: the density of an image with black rows and one sun-like texel integrates to one,
/// samples lie where the image is not black, and cumulative distributions end at exactly one.
#[test]
fn m09_one_bright_texel_among_black_rows() {
    for (width, height, sun) in [
        (4, 2, (1, 0)),
        (4, 2, (3, 1)),
        (2048, 1024, (700, 300)),
        (2048, 1024, (0, 0)),
        (2048, 1024, (2047, 1023)),
    ] {
        // The sun alone, and with a faint sky in a quarter of the rows.
        for faint in [0.0, 1.0] {
            let radiance = |x: usize, y: usize| {
                let sky = if y * 4 >= height && y * 2 < height {
                    faint
                } else {
                    0.0
                };
                if (x, y) == sun { 1e5 } else { sky }
            };
            let grid = SphereGrid::new(width, height, 0.25, radiance).expect("it is not black");
            let name = format!("{width}×{height}, sun at {sun:?}, sky {faint}");
            assert_eq!(grid.rows.last(), Some(&1.0), "{name}");
            let blocks = width.div_ceil(grid.block[0]);
            assert!(
                grid.columns
                    .chunks(blocks)
                    .all(|row| row.last() == Some(&1.0)),
                "{name}"
            );
            let whole = integral(&grid, width, height);
            assert!(
                (whole - 1.0).abs() <= 1e-5,
                "{name}: the density integrates to {whole}"
            );
            for i in 0..2_000 {
                let d = grid.sample_direction(numbers(i));
                assert!((d.length() - 1.0).abs() < 1e-12, "{name}: {d}");
                let [u, v] = equirectangular_coordinates::<f64>(d);
                let u = u - 0.25;
                let (x, y) = (
                    ((u - u.floor()) * width as f64) as usize,
                    (v * height as f64) as usize,
                );
                assert!(
                    radiance(x.min(width - 1), y.min(height - 1)) > 0.0,
                    "{name}: drew ({x}, {y})"
                );
                assert!(density(&grid, d) > 0.0, "{name}: {d}");
            }
        }
    }
    assert!(
        SphereGrid::new(4, 2, 0.0, |_, _| 0.0).is_none()
            && SphereGrid::new(4, 2, 0.0, |_, _| f64::NAN).is_none()
    );
}

/// Protects: rows at the poles of a tall image, with cosines closer to one than their rounding, are
/// sampled uniformly by solid angle within the row.
#[test]
fn m09_poles_keep_their_digits() {
    const HEIGHT: usize = 1 << 20;
    for (row, pole) in [(0, 1.0), (HEIGHT - 1, -1.0)] {
        let grid = SphereGrid::new(1, HEIGHT, 0.0, |_, y| if y == row { 1.0 } else { 0.0 })
            .expect("it is not black");
        let widest = PI / HEIGHT as f64;
        let mut inner = 0;
        for i in 0..4_000 {
            let d = grid.sample_direction(numbers(i));
            let angle = f64::atan2(d.x.hypot(d.z), d.y * pole);
            assert!(
                angle <= widest * (1.0 + 1e-9) && angle > 0.0,
                "{angle:e} from the pole"
            );
            inner += u32::from(angle < widest * 0.5_f64.sqrt());
        }
        // Half of the solid angle lies within √½ of the angle: 2000 of 4000, with a standard
        // deviation of 32.
        assert!(
            (1_905..=2_095).contains(&inner),
            "{inner} of 4000 in the inner half"
        );
        let density = density(&grid, DVec3::new(0.5 * widest, pole, 0.0).normalize());
        assert!(
            (density * PI * widest * widest - 1.0).abs() < 1e-6,
            "density {density:e}"
        );
    }
}

/// Protects: numbers at the ends of their range stay unit directions.
#[test]
fn m02_corner_numbers_are_directions() {
    let grid = SphereGrid::new(4, 2, 0.0, |x, y| (x + y) as f64).expect("it is not black");
    for u in [0.0, f64::MIN_POSITIVE, 0.5, 1.0_f64.next_down()] {
        for v in [0.0, f64::MIN_POSITIVE, 0.5, 1.0_f64.next_down()] {
            let d = grid.sample_direction([u, v]);
            assert!((d.length() - 1.0).abs() < 1e-12, "{u}, {v}: {d}");
        }
    }
}

/// Protects: cells of an image with uniform, non-uniform and truncated blocks are sampled by the
/// stated density, by χ² over cells, and this density is close to the image.
#[test]
fn blocks_are_drawn_by_their_density() {
    let (width, height) = (301, 133);
    let speckle = |x: usize, y: usize| {
        if x < 150 {
            1.0
        } else {
            0.2 + (splitmix64((x * 1000 + y) as u64) % 97) as f64 / 20.0
        }
    };
    let radiance = |x: usize, y: usize| {
        speckle(x, y) * (1.0 + y as f64 / 40.0) * if (x, y) == (40, 70) { 3e3 } else { 1.0 }
    };
    let grid = SphereGrid::new(width, height, 0.0, radiance).expect("it is not black");
    assert!(
        grid.cell_starts.contains(&WHOLE) && grid.cell_starts.iter().any(|&index| index != WHOLE)
    );
    let middle = |x: usize, y: usize| {
        [
            (x as f64 + 0.5) / width as f64,
            (y as f64 + 0.5) / height as f64,
        ]
    };
    let share =
        |x: usize, y: usize| grid.density(middle(x, y)) * cell_solid_angle(width, height, y);
    let total: f64 = (0..height)
        .flat_map(|y| (0..width).map(move |x| (x, y)))
        .map(|(x, y)| share(x, y))
        .sum();
    assert!(
        (total - 1.0).abs() < 1e-9,
        "the density integrates to {total}"
    );
    let mut counts = vec![0_u32; width * height];
    const DRAWN: u64 = 2_000_000;
    for i in 0..DRAWN {
        let [u, v] = equirectangular_coordinates::<f64>(grid.sample_direction(numbers(i)));
        counts[((v * height as f64) as usize).min(height - 1) * width
            + ((u * width as f64) as usize).min(width - 1)] += 1;
    }
    let (mut chi2, mut degrees) = (0.0, 0.0);
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        let (expected, wanted_value) = (share(x, y) * DRAWN as f64, radiance(x, y) / grid.flux());
        assert!(
            (0.75..1.34).contains(&(grid.density(middle(x, y)) / wanted_value)),
            "({x}, {y})"
        );
        if expected > 5.0 {
            chi2 += (f64::from(counts[y * width + x]) - expected).powi(2) / expected;
            degrees += 1.0;
        }
    }
    // The standard deviation of χ² is √(2·degrees).
    assert!(
        (chi2 - degrees).abs() < 4.0 * f64::sqrt(2.0 * degrees),
        "χ² of {chi2} over {degrees} cells"
    );
}

/// Protects: directions drawn together have the bits of each drawn alone, with full and partial
/// lanes, and with azimuths beyond a turn.
#[test]
fn many_directions_are_those_of_each() {
    let speckle = |x: usize, y: usize| (splitmix64((x / 9 * 1000 + y) as u64) % 97) as f64;
    for turn in [0.0, 0.3, 0.999] {
        let grid = SphereGrid::new(301, 133, turn, speckle).expect("it is not black");
        for count in [0, 1, 7, 8, 9, 20_003] {
            let mut many = Vec::new();
            grid.sample_directions((0..count).map(numbers), |direction| many.push(direction));
            let each: Vec<DVec3> = (0..count)
                .map(|i| grid.sample_direction(numbers(i)))
                .collect();
            assert_eq!(many, each, "{count} turned by {turn}");
        }
    }
}

/// Protects: sines and cosines of azimuths in lanes have the bits of `libm`, of both signs and
/// beyond a turn, whatever the other lanes hold.
#[test]
fn azimuths_in_lanes_have_the_bits_of_libm() {
    let mut angles: Vec<f64> = vec![0.0, PI, TAU, -TAU, 1.5 * PI, 7.853_981_633_974_483];
    angles.extend((0..2_000).map(|i| (numbers(i)[0] - 0.5) * 4.0 * TAU));
    for (i, lane_angles) in angles.windows(LANES).enumerate() {
        let mut lanes = PolarDirectionLanes::<LANES>::default();
        for (lane, &angle) in lane_angles.iter().enumerate() {
            // On the equator, where the ring's radius is one.
            lanes.set_lane(
                lane,
                PolarDirection {
                    height: 0.0,
                    squared_ring: 1.0,
                    angle,
                },
            );
        }
        let [x, _, z] = run_widest(lanes);
        for (lane, &angle) in lane_angles.iter().enumerate() {
            let (sine, cosine) = libm::sincos(angle);
            assert_eq!(
                [x[lane].to_bits(), z[lane].to_bits()],
                [cosine.to_bits(), sine.to_bits()],
                "window {i}, lane {lane}: angle {angle:e}"
            );
        }
    }
}
