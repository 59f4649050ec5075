//! Transfer curves between display-linear values and encoded display values, and the luminance of
//! Rec. 709 colours.

use crate::scene::TransferCurve;
use raywright_bvh::scalar::Real;

/// Linear value at which the two branches of the sRGB curve meet. The standard rounds this value up
/// to 0.0031308, where the curve would step down by 2.6e-8. Between both values, this curve and the
/// standard's differ by at most that step.
const SRGB_JOINT: f64 = 0.003_130_668_442_500_634;

/// Encodes a display-linear value in 0..1 as a display value in 0..1.
pub fn encode_transfer(curve: TransferCurve, linear: f64) -> f64 {
    match curve {
        // IEC 61966-2-1 (1999).
        TransferCurve::Srgb if linear <= SRGB_JOINT => 12.92 * linear,
        TransferCurve::Srgb => 1.055 * Real::powf(linear, 1.0 / 2.4) - 0.055,
        TransferCurve::Gamma22 => Real::powf(linear, 1.0 / 2.2),
        TransferCurve::None => linear,
    }
}

/// Decodes a display value in 0..1 to a display-linear value in 0..1. The inverse of
/// [`encode_transfer`].
pub fn decode_transfer(curve: TransferCurve, value: f64) -> f64 {
    match curve {
        TransferCurve::Srgb if value <= 12.92 * SRGB_JOINT => value / 12.92,
        TransferCurve::Srgb => Real::powf((value + 0.055) / 1.055, 2.4),
        TransferCurve::Gamma22 => Real::powf(value, 2.2),
        TransferCurve::None => value,
    }
}

/// Returns the 8-bit code of a display value v in 0..1: floor(255 v + ½). Each code is the centre
/// of its interval of values.
pub fn quantise_8_bit(value: f64) -> u8 {
    (255.0 * value + 0.5) as u8
}

/// Returns the relative luminance of a linear colour in Rec. 709 primaries with white D65 (ITU-R
/// BT.709-6).
pub fn luminance(rgb: [f64; 3]) -> f64 {
    0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]
}

#[cfg(test)]
mod tests {
    use super::*;

    const CURVES: [TransferCurve; 3] = [
        TransferCurve::Srgb,
        TransferCurve::Gamma22,
        TransferCurve::None,
    ];

    /// Protects: F06: the two branches of the sRGB curve meet within 1e-6 and do not step down.
    #[test]
    fn f06_srgb_is_continuous_at_its_joint() {
        for joint in [SRGB_JOINT as f32, 0.003_130_8] {
            let around = [joint.next_down(), joint, joint.next_up()];
            let values = around.map(|x| encode_transfer(TransferCurve::Srgb, f64::from(x)));
            assert!(values[0] < values[1] && values[1] < values[2], "{values:?}");
            assert!(values[2] - values[0] < 1e-6, "{values:?}");
            let back = values.map(|v| decode_transfer(TransferCurve::Srgb, v));
            assert!(
                back.iter()
                    .zip(around)
                    .all(|(a, b)| (a / f64::from(b) - 1.0).abs() < 1e-12),
                "{back:?}"
            );
        }
    }

    /// Protects: F06: every curve is exact at 0 and 1.
    #[test]
    fn f06_zero_and_one_map_to_themselves() {
        for curve in CURVES {
            assert_eq!(encode_transfer(curve, 0.0), 0.0, "{curve:?}");
            assert!(
                (encode_transfer(curve, 1.0) - 1.0).abs() < 1e-15,
                "{curve:?}"
            );
            assert_eq!(
                quantise_8_bit(encode_transfer(curve, 1.0)),
                255,
                "{curve:?}"
            );
        }
    }

    /// Protects: F10: all 256 codes survive the conversion to linear f32, to luminance and back.
    #[test]
    fn f10_codes_survive_the_round_trip() {
        for curve in CURVES {
            for code in 0..=255_u8 {
                let linear = decode_transfer(curve, f64::from(code) / 255.0) as f32;
                assert_eq!(
                    quantise_8_bit(encode_transfer(curve, f64::from(linear))),
                    code,
                    "{curve:?} {code}"
                );
                let grey = luminance([f64::from(linear); 3]);
                assert_eq!(
                    quantise_8_bit(encode_transfer(curve, grey)),
                    code,
                    "{curve:?} {code} through luminance"
                );
            }
        }
    }

    /// Protects: F07: on a ramp of 4 096 steps each value gets the nearest code, and rounding is
    /// unbiased.
    #[test]
    fn f07_quantisation_is_centred() {
        let mut bias = 0.0;
        for step in 0..4096 {
            let value = f64::from(step) / 4095.0;
            let code = quantise_8_bit(value);
            assert_eq!(f64::from(code), (255.0 * value).round(), "step {step}");
            bias += f64::from(code) - 255.0 * value;
        }
        assert!((bias / 4096.0).abs() < 1e-12, "mean error {bias}");
    }
}
