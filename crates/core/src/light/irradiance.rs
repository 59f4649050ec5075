//! The sky's cosine-weighted average by normal, as nine spherical harmonics ("An Efficient Representation for Irradiance
//! Environment Maps", Ramamoorthi, Hanrahan 2001): what a matte physical material receives under Whitted shading.

use core::f64::consts::PI;

use glam::DVec3;
use raywright_bvh::{Real, Vector};

use super::sky::Sky;

/// Coefficients, already convolved with the cosine and divided by π.
#[derive(Clone, Debug)]
pub struct Irradiance<R: Real> {
    coefficients: [R::Vec3; 9],
}

/// Real spherical harmonics up to band 2 of a unit direction.
fn harmonics(d: DVec3) -> [f64; 9] {
    let DVec3 { x, y, z } = d;
    [
        0.282_094_791_773_878_14,
        0.488_602_511_902_919_9 * y,
        0.488_602_511_902_919_9 * z,
        0.488_602_511_902_919_9 * x,
        1.092_548_430_592_079_2 * x * y,
        1.092_548_430_592_079_2 * y * z,
        0.315_391_565_252_520_05 * (3.0 * z * z - 1.0),
        1.092_548_430_592_079_2 * x * z,
        0.546_274_215_296_039_6 * (x * x - y * y),
    ]
}

impl<R: Real> Irradiance<R> {
    /// Integrates the sky over the sphere by the midpoint rule in equal steps of height and azimuth, so that every cell has
    /// the same solid angle.
    pub fn new(sky: &Sky<R>) -> Self {
        const ROWS: usize = 128;
        const COLUMNS: usize = 256;
        let mut sums = [DVec3::ZERO; 9];
        // The same in every row, and half of the time otherwise.
        let around: [[f64; 2]; COLUMNS] = core::array::from_fn(|column| {
            let a = (column as f64 + 0.5) * 2.0 * PI / COLUMNS as f64;
            [libm::cos(a), libm::sin(a)]
        });
        for row in 0..ROWS {
            let y = 1.0 - (row as f64 + 0.5) * 2.0 / ROWS as f64;
            let s = (1.0 - y * y).sqrt();
            for [cos, sin] in around {
                let d = DVec3::new(s * cos, y, s * sin);
                let radiance = sky.radiance(R::Vec3::ZERO, R::Vec3::from_f64(d)).to_f64();
                for (sum, h) in sums.iter_mut().zip(harmonics(d)) {
                    *sum += radiance * h;
                }
            }
        }
        let cell = 4.0 * PI / (ROWS * COLUMNS) as f64;
        // Cosine lobe by band, over π: 1, 2/3, 1/4.
        let band = [1.0, 2.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0, 0.25, 0.25, 0.25, 0.25, 0.25];
        Self { coefficients: core::array::from_fn(|i| R::Vec3::from_f64(sums[i] * (cell * band[i]))) }
    }

    /// Mean radiance that a surface of unit normal `n` receives, cosine-weighted; never negative.
    pub fn at(&self, n: R::Vec3) -> R::Vec3 {
        let h = harmonics(n.to_f64());
        let sum = self.coefficients.iter().zip(h).fold(R::Vec3::ZERO, |sum, (&c, h)| sum + c * R::from_f64(h));
        sum.max(R::Vec3::ZERO)
    }
}

#[cfg(test)]
mod tests {
    use super::super::sky::Kind;
    use super::*;

    /// Protects: the band factors and the normalisation, against the closed form of a sky linear in height:
    /// mean = a + b · 2/3 · n.y for L = a + b·y.
    #[test]
    fn linear_sky_has_its_closed_form() {
        let kind = Kind::<f64>::Gradient { bottom: DVec3::splat(0.4), top: DVec3::ONE, suns: Vec::new() };
        let sky = Sky { kind };
        let irradiance = Irradiance::new(&sky);
        for n in [DVec3::Y, DVec3::NEG_Y, DVec3::X, DVec3::new(0.6, 0.8, 0.0), DVec3::new(0.0, -0.6, 0.8)] {
            let expected = 0.7 + 0.3 * 2.0 / 3.0 * n.y;
            assert!((irradiance.at(n).x - expected).abs() < 1e-4, "{n} {} {expected}", irradiance.at(n).x);
        }
    }
}
