//! Tables over the sphere at their worst: rows of nothing, one bright cell, the poles.

use super::*;
use crate::hash::mix;

/// Two even pseudo-random numbers.
fn numbers(i: u64) -> [f64; 2] {
    [2 * i, 2 * i + 1].map(|k| (mix(k) >> 11) as f64 / (1_u64 << 53) as f64)
}

/// The integral of the density, one point a cell, with the solid angle as the difference of cosines.
fn integral(grid: &SphereGrid, width: usize, height: usize) -> f64 {
    let row = |row: usize| {
        let at = |edge: f64| PI * edge / height as f64;
        let cell = (at(row as f64).cos() - at(row as f64 + 1.0).cos()) * TAU / width as f64;
        let (y, ring) = (at(row as f64 + 0.5).cos(), at(row as f64 + 0.5).sin());
        let of = |column: usize| {
            let angle = TAU * ((column as f64 + 0.5) / width as f64 + grid.turn - 0.5);
            grid.density(DVec3::new(ring * angle.cos(), y, ring * angle.sin()))
        };
        (0..width).map(of).sum::<f64>() * cell
    };
    (0..height).map(row).sum()
}

/// Protects (M09): the density of a picture with rows of nothing and one texel like a sun integrates to one, what is drawn lies
/// where the picture is not black, and running sums end at exactly one.
#[test]
fn one_bright_texel_among_black_rows() {
    for (width, height, sun) in
        [(4, 2, (1, 0)), (4, 2, (3, 1)), (2048, 1024, (700, 300)), (2048, 1024, (0, 0)), (2048, 1024, (2047, 1023))]
    {
        // Nothing but the sun, and a faint sky in a quarter of the rows.
        for faint in [0.0, 1.0] {
            let radiance = |x: usize, y: usize| {
                let sky = if y * 4 >= height && y * 2 < height { faint } else { 0.0 };
                if (x, y) == sun { 1e5 } else { sky }
            };
            let grid = SphereGrid::new(width, height, 0.25, radiance).expect("it is not black");
            let name = format!("{width}×{height}, sun at {sun:?}, sky {faint}");
            assert_eq!(grid.rows.last(), Some(&1.0), "{name}");
            assert!(grid.columns.chunks(width).all(|row| row.last() == Some(&1.0)), "{name}");
            let whole = integral(&grid, width, height);
            assert!((whole - 1.0).abs() <= 1e-5, "{name}: the density integrates to {whole}");
            for i in 0..2_000 {
                let d = grid.direction(numbers(i));
                assert!((d.length() - 1.0).abs() < 1e-12, "{name}: {d}");
                let [u, v] = equirectangular::<f64>(d);
                let u = u - 0.25;
                let (x, y) = (((u - u.floor()) * width as f64) as usize, (v * height as f64) as usize);
                assert!(radiance(x.min(width - 1), y.min(height - 1)) > 0.0, "{name}: drew ({x}, {y})");
                assert!(grid.density(d) > 0.0, "{name}: {d}");
            }
        }
    }
    assert!(SphereGrid::new(4, 2, 0.0, |_, _| 0.0).is_none() && SphereGrid::new(4, 2, 0.0, |_, _| f64::NAN).is_none());
}

/// Protects (M09): rows at the poles of a tall picture, whose cosines differ from one by less than their rounding, are drawn evenly
/// over their solid angle, within the row.
#[test]
fn poles_keep_their_digits() {
    const HEIGHT: usize = 1 << 20;
    for (row, pole) in [(0, 1.0), (HEIGHT - 1, -1.0)] {
        let grid = SphereGrid::new(1, HEIGHT, 0.0, |_, y| if y == row { 1.0 } else { 0.0 }).expect("it is not black");
        let widest = PI / HEIGHT as f64;
        let mut inner = 0;
        for i in 0..4_000 {
            let d = grid.direction(numbers(i));
            let angle = f64::atan2(d.x.hypot(d.z), d.y * pole);
            assert!(angle <= widest * (1.0 + 1e-9) && angle > 0.0, "{angle:e} from the pole");
            inner += u32::from(angle < widest * 0.5_f64.sqrt());
        }
        // Half of the solid angle lies within √½ of the angle: 2000 of 4000, whose standard deviation is 32.
        assert!((1_905..=2_095).contains(&inner), "{inner} of 4000 in the inner half");
        let density = grid.density(DVec3::new(0.5 * widest, pole, 0.0).normalize());
        assert!((density * PI * widest * widest - 1.0).abs() < 1e-6, "density {density:e}");
    }
}

/// Protects: numbers at the ends of their range stay unit directions.
#[test]
fn corner_numbers_are_directions() {
    let grid = SphereGrid::new(4, 2, 0.0, |x, y| (x + y) as f64).expect("it is not black");
    for u in [0.0, f64::MIN_POSITIVE, 0.5, 1.0_f64.next_down()] {
        for v in [0.0, f64::MIN_POSITIVE, 0.5, 1.0_f64.next_down()] {
            let d = grid.direction([u, v]);
            assert!((d.length() - 1.0).abs() < 1e-12, "{u}, {v}: {d}");
        }
    }
}
