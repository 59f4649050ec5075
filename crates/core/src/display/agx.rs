//! AgX tone map with its base look (Troy Sobotka, "AgX", 2022). The Rec. 2020 matrices are those of
//! Blender 4.0's configuration (Eary Chow, 2023). Filament and three.js use the same matrices:
//! `agx` gives the same colours as those viewers.
//!
//! The contrast curve is Sobotka's sigmoid. Shaders often replace the sigmoid by a polynomial. That
//! polynomial differs by up to 0.006, is negative near black and does not reach white.

use super::matrix::multiply_matrix;
use raywright_bvh::scalar::Real;

/// Matrices from linear Rec. 709 to linear Rec. 2020 (ITU-R BT.2087-0, four digits) and back (ITU-R
/// BT.2407-0).
const REC709_TO_REC2020: [[f64; 3]; 3] = [
    [0.6274, 0.3293, 0.0433],
    [0.0691, 0.9195, 0.0113],
    [0.0164, 0.0880, 0.8956],
];
const REC2020_TO_REC709: [[f64; 3]; 3] = [
    [1.6605, -0.5876, -0.0728],
    [-0.1246, 1.1329, -0.0083],
    [-0.0182, -0.1006, 1.1187],
];

/// `INSET` contracts the gamut before the contrast curve: saturated colours move towards white.
/// `OUTSET` partly reverts this after the curve.
const INSET: [[f64; 3]; 3] = [
    [
        0.856_627_153_315_983,
        0.095_121_240_538_158_8,
        0.048_251_606_145_858_3,
    ],
    [
        0.137_318_972_929_847,
        0.761_241_990_602_591,
        0.101_439_036_467_562,
    ],
    [
        0.111_898_212_999_95,
        0.076_799_418_603_190_3,
        0.811_302_368_396_859,
    ],
];
const OUTSET: [[f64; 3]; 3] = [
    [
        1.127_100_581_814_436_8,
        -0.110_606_643_096_603_23,
        -0.016_493_938_717_834_573,
    ],
    [
        -0.141_329_763_498_438_3,
        1.157_823_702_216_272,
        -0.016_493_938_717_834_257,
    ],
    [
        -0.141_329_763_498_438_26,
        -0.110_606_643_096_602_94,
        1.251_936_406_595_040_5,
    ],
];

/// Range of the logarithmic encoding, as base-2 logarithms: from 10 stops below to 6.5 stops above
/// middle grey (0.18).
const LOG2_MIN: f64 = -12.473_93;
const LOG2_MAX: f64 = 4.026_069;

/// AgX tone map with its two curves as tables; the tables replace four power functions per channel.
#[derive(Clone, Debug)]
pub(super) struct AgxToneMap {
    /// Contrast curve, from the logarithmic encoding in 0..1 to display values in 0..1.
    contrast: TabulatedCurve,
    /// Curve from display values of gamma 2.2 to display-linear values.
    linearise: TabulatedCurve,
}

impl AgxToneMap {
    pub(super) fn new() -> Self {
        Self {
            contrast: TabulatedCurve::tabulate(agx_contrast_curve),
            linearise: TabulatedCurve::tabulate(|x| Real::powf(x, 2.2)),
        }
    }

    /// Maps a linear Rec. 709 colour with finite, non-negative channels to display-linear values.
    /// Results may lie slightly outside 0..1.
    pub(super) fn apply(&self, rgb: [f64; 3]) -> [f64; 3] {
        let inset = multiply_matrix(&INSET, multiply_matrix(&REC709_TO_REC2020, rgb));
        let shaped = inset.map(|x| self.contrast.eval(encode_log2(x)));
        let linear =
            multiply_matrix(&OUTSET, shaped).map(|x| self.linearise.eval(x.clamp(0.0, 1.0)));
        multiply_matrix(&REC2020_TO_REC709, linear)
    }
}

/// Table of an increasing function on [0, 1], interpolated linearly between exact values. The
/// interpolated function never decreases. Its error is below 1e-6 for the curves of AgX.
#[derive(Clone, Debug)]
struct TabulatedCurve(Vec<f64>);

impl TabulatedCurve {
    const STEPS: usize = 2048;

    fn tabulate(exact: impl Fn(f64) -> f64) -> Self {
        // The table has one value past the end, so that x = 1 has a right neighbour.
        Self(
            (0..=Self::STEPS + 1)
                .map(|i| exact((i as f64 / Self::STEPS as f64).min(1.0)))
                .collect(),
        )
    }

    #[inline]
    fn eval(&self, x: f64) -> f64 {
        let place = x * Self::STEPS as f64;
        let index = (place as usize).min(Self::STEPS);
        let (low, high) = (self.0[index], self.0[index + 1]);
        low + (high - low) * (place - index as f64)
    }
}

/// Returns the logarithmic encoding of a linear value, from 0 at [`LOG2_MIN`] to 1 at [`LOG2_MAX`],
/// clamped.
fn encode_log2(x: f64) -> f64 {
    let log2 = Real::ln(x.max(1e-10)) * core::f64::consts::LOG2_E;
    ((log2 - LOG2_MIN) / (LOG2_MAX - LOG2_MIN)).clamp(0.0, 1.0)
}

/// Contrast curve of AgX: Sobotka's sigmoid (after Jed Smith) with slope 2 at the pivot. The power
/// is 3 in the toe and 3.25 in the shoulder. The curve maps 0 to exactly 0 and 1 to exactly 1.
fn agx_contrast_curve(x: f64) -> f64 {
    const X_PIVOT: f64 = 10.0 / 16.5;
    const Y_PIVOT: f64 = 0.5;
    /// Scales of the two halves of the curve, toe and shoulder: ((slope·run)^−p ·
    /// ((slope·run/rise)^p − 1))^(−1/p). Run and rise are the distances along x and y from the
    /// pivot to the end of the half, p is its power.
    const TOE_SCALE: f64 = 0.512_277_382_293_071_4;
    const SHOULDER_SCALE: f64 = 0.541_464_156_278_149_7;
    let half = |distance: f64, scale: f64, power: f64| {
        let t = 2.0 * distance / scale;
        scale * t / Real::powf(1.0 + Real::powf(t, power), 1.0 / power)
    };
    let y = if x < X_PIVOT {
        Y_PIVOT - half(X_PIVOT - x, TOE_SCALE, 3.0)
    } else {
        Y_PIVOT + half(x - X_PIVOT, SHOULDER_SCALE, 3.25)
    };
    y.clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: the numeric scales equal those of the sigmoid's definition, so that both corners
    /// are reached.
    #[test]
    fn sigmoid_passes_through_its_corners_and_pivot() {
        for (x, y) in [(0.0, 0.0), (10.0 / 16.5, 0.5), (1.0, 1.0)] {
            assert!(
                (agx_contrast_curve(x) - y).abs() < 1e-12,
                "{x}: {}",
                agx_contrast_curve(x)
            );
        }
        let slope = (agx_contrast_curve(10.0 / 16.5 + 1e-6)
            - agx_contrast_curve(10.0 / 16.5 - 1e-6))
            / 2e-6;
        assert!((slope - 2.0).abs() < 1e-5, "{slope}");
    }

    /// Protects: the curve agrees with Wrensch's published polynomial fit ("Minimal AgX
    /// Implementation", 2023).
    #[test]
    fn sigmoid_agrees_with_the_published_fit() {
        for i in 1..100 {
            let x = f64::from(i) / 100.0;
            let coefficients = [15.5, -40.14, 31.96, -6.868, 0.4298, 0.1191, -0.002_32];
            let fit = coefficients.iter().fold(0.0, |sum, c| sum * x + c);
            assert!(
                (agx_contrast_curve(x) - fit).abs() < 6e-3,
                "{x}: {} {fit}",
                agx_contrast_curve(x)
            );
        }
    }

    /// Protects: the tables agree with their curves within 1e-6 between the nodes, and exactly at
    /// both ends.
    #[test]
    fn tabulated_curves_are_close_to_the_exact_ones() {
        let agx = AgxToneMap::new();
        for i in 0..=100_000 {
            let x = f64::from(i) / 100_000.0;
            assert!(
                (agx.contrast.eval(x) - agx_contrast_curve(x)).abs() < 1e-6,
                "contrast at {x}"
            );
            assert!(
                (agx.linearise.eval(x) - Real::powf(x, 2.2)).abs() < 1e-6,
                "linearise at {x}"
            );
        }
        assert_eq!(
            [agx.linearise.eval(0.0), agx.linearise.eval(1.0)],
            [0.0, 1.0]
        );
    }

    /// Protects: greys stay grey, and middle grey maps to the pivot, half the display range.
    #[test]
    fn middle_grey_lands_on_the_pivot() {
        let half = Real::powf(0.5, 2.2);
        let grey = AgxToneMap::new().apply([0.18; 3]);
        assert!(
            grey.iter().all(|x: &f64| (x - half).abs() < 2e-4),
            "{grey:?} {half}"
        );
    }

    /// Protects: a strong red turns towards white as it brightens, the purpose of this map.
    #[test]
    fn bright_colours_lose_saturation() {
        let agx = AgxToneMap::new();
        let ratio = |x: f64| agx.apply([x, 0.0, 0.0])[1] / agx.apply([x, 0.0, 0.0])[0];
        assert!(ratio(0.2) < ratio(2.0) && ratio(2.0) < ratio(20.0) && ratio(20.0) > 0.3);
    }

    /// Protects: every entry of the matrices. The two between Rec. 709 and Rec. 2020 follow from
    /// the standards' primaries, in four digits, one truncated and the others rounded. The matrices
    /// of AgX are published by columns: the image of each primary on the way in. On the way out,
    /// the other two entries of a column are equal, because hues are not rotated there.
    #[test]
    fn matrices_are_those_of_their_primaries() {
        use crate::display::tests::primaries::{REC709, REC2020, between};
        for (rows, derived) in [
            (REC709_TO_REC2020, between(REC709, REC2020)),
            (REC2020_TO_REC709, between(REC2020, REC709)),
        ] {
            for (i, row) in rows.iter().enumerate() {
                let apart = glam::DVec3::from(*row) - derived.row(i);
                assert!(
                    apart.abs().max_element() < 1e-4,
                    "row {i}: {row:?} {}",
                    derived.row(i)
                );
            }
        }
        let columns = [
            [
                0.856_627_153_315_983,
                0.137_318_972_929_847,
                0.111_898_212_999_95,
            ],
            [
                0.095_121_240_538_158_8,
                0.761_241_990_602_591,
                0.076_799_418_603_190_3,
            ],
            [
                0.048_251_606_145_858_3,
                0.101_439_036_467_562,
                0.811_302_368_396_859,
            ],
        ];
        let primary = |k: usize| [0, 1, 2].map(|i| f64::from(u8::from(i == k)));
        for (k, column) in columns.into_iter().enumerate() {
            assert_eq!(multiply_matrix(&INSET, primary(k)), column);
            let out = multiply_matrix(&OUTSET, primary(k));
            assert!(
                (out[(k + 1) % 3] - out[(k + 2) % 3]).abs() < 1e-14,
                "{out:?}"
            );
        }
        for rows in [INSET, OUTSET] {
            assert!(
                multiply_matrix(&rows, [1.0; 3])
                    .iter()
                    .all(|grey| (grey - 1.0).abs() < 1e-14),
                "{rows:?}"
            );
        }
    }
}
