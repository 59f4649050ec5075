//! Cosine-weighted mean radiance of the sky for any surface normal, as nine spherical harmonics
//! ("An Efficient Representation for Irradiance Environment Maps", Ramamoorthi, Hanrahan 2001). It
//! lights matte physical materials in Whitted's integrator.

use core::f64::consts::PI;

use glam::DVec3;
use raywright_bvh::{Real, Vector};

use super::sky::{GradientSky, SkyKind, SkyRadiance};

/// Irradiance from the sky divided by π, for any surface normal: the cosine-weighted mean radiance
/// of the hemisphere. The coefficients of the spherical harmonics are convolved with the cosine
/// lobe and divided by π.
#[derive(Clone, Debug)]
pub struct Irradiance<R: Real> {
    coefficients: [R::Vec3; 9],
}

/// Returns the nine real spherical harmonics of bands 0 to 2 for a unit direction.
fn spherical_harmonics(d: DVec3) -> [f64; 9] {
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

/// Integral over all directions of the sky's radiance times each of the nine harmonics.
type HarmonicIntegrals = [DVec3; 9];

/// Returns the harmonic integrals of a constant sky.
fn integrate_constant_sky(radiance: DVec3) -> HarmonicIntegrals {
    let mut integrals = [DVec3::ZERO; 9];
    integrals[0] = radiance * (4.0 * PI * spherical_harmonics(DVec3::Y)[0]);
    integrals
}

/// Returns the harmonic integrals of the lobe radiance · max(0, d·direction)ⁿ over directions d,
/// with n = `exponent`.
///
/// Each integral is the value of the harmonic at the lobe's axis, times 2π ∫ tⁿ P(t) dt over the
/// cosine t from 0 to 1. P is the Legendre polynomial of the harmonic's band (Funk, Hecke).
fn integrate_lobe(radiance: DVec3, direction: DVec3, exponent: u32) -> HarmonicIntegrals {
    // As in [`SkyRadiance`]: a lobe of exponent 0 is constant, because 0⁰ = 1 for directions behind
    // it.
    if exponent == 0 {
        return integrate_constant_sky(radiance);
    }
    let n = f64::from(exponent);
    let [mean, linear, square] = [
        1.0 / (n + 1.0),
        1.0 / (n + 2.0),
        n / ((n + 1.0) * (n + 3.0)),
    ]
    .map(|integral| 2.0 * PI * integral);
    let bands = [
        mean, linear, linear, linear, square, square, square, square, square,
    ];
    let at_axis = spherical_harmonics(direction);
    core::array::from_fn(|i| radiance * (bands[i] * at_axis[i]))
}

/// Returns the harmonic integrals of any sky by the midpoint rule. Steps are equal in height and
/// azimuth: every cell has the same solid angle.
fn integrate_numerically<R: Real>(sky: &SkyRadiance<R>) -> HarmonicIntegrals {
    const ROWS: usize = 128;
    const COLUMNS: usize = 256;
    let mut sums = [DVec3::ZERO; 9];
    // The azimuths are equal in every row; computing them in each row would double the time.
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
            for (sum, h) in sums.iter_mut().zip(spherical_harmonics(d)) {
                *sum += radiance * h;
            }
        }
    }
    sums.map(|sum| sum * (4.0 * PI / (ROWS * COLUMNS) as f64))
}

impl<R: Real> Irradiance<R> {
    /// Integrates the sky over the sphere. Skies with integrals in closed form are integrated
    /// exactly: even a tiny sun is not missed, and the cost is small. Other skies are integrated
    /// numerically.
    pub fn new(sky: &SkyRadiance<R>) -> Self {
        let integrals = match &sky.kind {
            SkyKind::Black => [DVec3::ZERO; 9],
            SkyKind::Constant(radiance) => integrate_constant_sky(radiance.to_f64()),
            SkyKind::Gradient(GradientSky { bottom, top, suns }) => {
                let (bottom, top) = (bottom.to_f64(), top.to_f64());
                let mut all = integrate_constant_sky((bottom + top) * 0.5);
                // (top − bottom) / 2 · y is orthogonal to all harmonics but its own.
                all[1] = (top - bottom) * (0.5 * 4.0 * PI / 3.0 * spherical_harmonics(DVec3::Y)[1]);
                for sun in suns {
                    let own =
                        integrate_lobe(sun.colour.to_f64(), sun.direction.to_f64(), sun.exponent);
                    all.iter_mut().zip(own).for_each(|(sum, own)| *sum += own);
                }
                all
            }
            SkyKind::Expression(..) | SkyKind::Map(_) => integrate_numerically(sky),
        };
        // Cosine lobe by band, over π: 1, 2/3, 1/4.
        let band = [
            1.0,
            2.0 / 3.0,
            2.0 / 3.0,
            2.0 / 3.0,
            0.25,
            0.25,
            0.25,
            0.25,
            0.25,
        ];
        Self {
            coefficients: core::array::from_fn(|i| R::Vec3::from_f64(integrals[i] * band[i])),
        }
    }

    /// Returns the cosine-weighted mean radiance over the hemisphere about the unit normal `n`;
    /// never negative.
    pub fn eval(&self, n: R::Vec3) -> R::Vec3 {
        let h = spherical_harmonics(n.to_f64());
        let sum = self
            .coefficients
            .iter()
            .zip(h)
            .fold(R::Vec3::ZERO, |sum, (&c, h)| sum + c * R::from_f64(h));
        sum.max(R::Vec3::ZERO)
    }
}

#[cfg(test)]
mod tests {
    use super::super::sky::SunLobe;
    use super::*;

    /// Protects: the band factors and the normalisation agree with the closed form of a sky linear
    /// in height: mean = a + b · 2/3 · n.y for L = a + b·y.
    #[test]
    fn linear_sky_has_its_closed_form() {
        let kind = SkyKind::<f64>::Gradient(GradientSky {
            bottom: DVec3::splat(0.4),
            top: DVec3::ONE,
            suns: Vec::new(),
        });
        let sky = SkyRadiance { kind };
        let irradiance = Irradiance::new(&sky);
        for n in [
            DVec3::Y,
            DVec3::NEG_Y,
            DVec3::X,
            DVec3::new(0.6, 0.8, 0.0),
            DVec3::new(0.0, -0.6, 0.8),
        ] {
            let expected = 0.7 + 0.3 * 2.0 / 3.0 * n.y;
            assert!(
                (irradiance.eval(n).x - expected).abs() < 1e-4,
                "{n} {} {expected}",
                irradiance.eval(n).x
            );
        }
    }

    /// Protects: closed forms agree with the sums, for suns of every width, including exponent 0
    /// with its radiance behind; and a sun smaller than a cell of the sum is not lost.
    #[test]
    fn skies_have_their_closed_forms() {
        let direction = DVec3::new(0.6, -0.64, 0.48);
        let under = |suns| SkyRadiance {
            kind: SkyKind::<f64>::Gradient(GradientSky {
                bottom: DVec3::new(0.1, 0.5, 2.0),
                top: DVec3::new(0.7, 0.3, 0.0),
                suns,
            }),
        };
        let sun = |exponent| SunLobe {
            direction,
            colour: DVec3::new(1.0, 2.0, 3.0),
            exponent,
        };
        let constant = SkyRadiance {
            kind: SkyKind::<f64>::Constant(DVec3::new(0.2, 3.0, 0.0)),
        };
        let skies = [0, 1, 2, 3, 7, 30].map(|exponent| under(vec![sun(exponent), sun(2)]));
        for sky in skies.iter().chain([&constant, &under(Vec::new())]) {
            let closed = Irradiance::new(sky);
            let band = [
                1.0,
                2.0 / 3.0,
                2.0 / 3.0,
                2.0 / 3.0,
                0.25,
                0.25,
                0.25,
                0.25,
                0.25,
            ];
            let sums = integrate_numerically(sky);
            for (i, coefficient) in closed.coefficients.iter().enumerate() {
                let expected = sums[i] * band[i];
                assert!(
                    (*coefficient - expected).abs().max_element() < 1e-3,
                    "{sky:?} {i}: {coefficient} {expected}"
                );
            }
        }
        let needle = Irradiance::new(&SkyRadiance {
            kind: SkyKind::<f64>::Gradient(GradientSky {
                bottom: DVec3::ZERO,
                top: DVec3::ZERO,
                suns: vec![sun(1 << 20)],
            }),
        });
        // Its integral is 2π/(n + 1), and nine harmonics give the cosine lobe (1 + 2 + 5/4)/4 of
        // 1/π at its axis.
        let expected = 2.0 / f64::from(1 << 20) * (0.25 + 0.5 + 0.3125);
        assert!(
            (needle.eval(direction).x / expected - 1.0).abs() < 1e-4,
            "{} {expected}",
            needle.eval(direction).x
        );
    }
}
