//! Tone maps from linear radiance after exposure, non-negative and finite, to display-linear values
//! in about 0..1.

use super::agx::AgxToneMap;
use super::matrix::multiply_matrix;
use crate::scene::ToneMap;

/// A tone map with its precomputed tables.
#[derive(Clone, Debug)]
pub(super) enum ToneOperator {
    Clip,
    Aces,
    AcesHill,
    Agx(AgxToneMap),
    KhronosNeutral,
}

impl ToneOperator {
    pub(super) fn new(map: ToneMap) -> Self {
        match map {
            ToneMap::None => Self::Clip,
            ToneMap::Aces => Self::Aces,
            ToneMap::AcesHill => Self::AcesHill,
            ToneMap::Agx => Self::Agx(AgxToneMap::new()),
            ToneMap::KhronosNeutral => Self::KhronosNeutral,
        }
    }

    /// Maps a colour with finite, non-negative channels to display-linear values. Results may lie
    /// slightly outside 0..1; the caller clips them.
    #[inline]
    pub(super) fn apply(&self, rgb: [f64; 3]) -> [f64; 3] {
        match self {
            Self::Clip => rgb,
            Self::Aces => rgb.map(aces_narkowicz),
            Self::AcesHill => aces_hill(rgb),
            Self::Agx(agx) => agx.apply(rgb),
            Self::KhronosNeutral => khronos_neutral(rgb),
        }
    }
}

/// ACES curve of Krzysztof Narkowicz, "ACES Filmic Tone Mapping Curve", 2015, for one channel.
fn aces_narkowicz(x: f64) -> f64 {
    x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14)
}

/// ACES tone map: Stephen Hill's fit of the reference rendering transform and the sRGB output
/// transform ("BakingLab", 2016). The factor 1/0.6, which glTF viewers apply before it, is
/// included.
fn aces_hill(rgb: [f64; 3]) -> [f64; 3] {
    const INPUT: [[f64; 3]; 3] = [
        [0.597_19, 0.354_58, 0.048_23],
        [0.076_00, 0.908_34, 0.015_66],
        [0.028_40, 0.133_83, 0.837_77],
    ];
    const OUTPUT: [[f64; 3]; 3] = [
        [1.604_75, -0.531_08, -0.073_67],
        [-0.102_08, 1.108_13, -0.006_05],
        [-0.003_27, -0.072_76, 1.076_02],
    ];
    let curve = |v: f64| {
        (v * (v + 0.024_578_6) - 0.000_090_537) / (v * (0.983_729 * v + 0.432_951_0) + 0.238_081)
    };
    multiply_matrix(
        &OUTPUT,
        multiply_matrix(&INPUT, rgb.map(|x| x / 0.6)).map(curve),
    )
}

/// Khronos PBR neutral tone mapper (Khronos Group, "Khronos PBR Neutral Tone Mapper" specification,
/// 2024). Colours below 0.8 are only darkened by 0.04, the reflectance of a dielectric. Brighter
/// colours are compressed and desaturated.
fn khronos_neutral(rgb: [f64; 3]) -> [f64; 3] {
    const START: f64 = 0.8 - 0.04;
    const DESATURATION: f64 = 0.15;
    let minimum = rgb[0].min(rgb[1]).min(rgb[2]);
    // The least channel minus the offset, in a form without cancellation for small numbers.
    let remainder = if minimum < 0.08 {
        6.25 * minimum * minimum
    } else {
        minimum - 0.04
    };
    let colour = rgb.map(|x| (x - minimum) + remainder);
    let peak = colour[0].max(colour[1]).max(colour[2]);
    if peak < START {
        return colour;
    }
    let range = 1.0 - START;
    let new_peak = 1.0 - range * range / (peak + range - START);
    let white = 1.0 - 1.0 / (DESATURATION * (peak - new_peak) + 1.0);
    colour.map(|x| x * (new_peak / peak) * (1.0 - white) + new_peak * white)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn apply(map: ToneMap, rgb: [f64; 3]) -> [f64; 3] {
        ToneOperator::new(map).apply(rgb)
    }

    fn close(a: [f64; 3], b: [f64; 3], tolerance: f64) -> bool {
        a.iter().zip(b).all(|(a, b)| (a - b).abs() <= tolerance)
    }

    /// Protects: Narkowicz's curve agrees with the published fraction at points computed by hand.
    #[test]
    fn aces_has_the_published_values() {
        // x = 1: 2.54/3.16; x = 0.5: 0.5·1.285/(0.5·1.805 + 0.14) = 0.6425/1.0425.
        assert!(close(
            apply(ToneMap::Aces, [1.0, 0.5, 0.0]),
            [2.54 / 3.16, 0.6425 / 1.0425, 0.0],
            1e-15
        ));
    }

    /// Protects: Hill's matrices keep greys grey, and grey 0.6 (times 1/0.6) has the value of the
    /// curve at one.
    #[test]
    fn hill_keeps_greys_and_includes_its_exposure() {
        let curve_at_one = (1.024_578_6 - 0.000_090_537) / (0.983_729 + 0.432_951 + 0.238_081);
        assert!(close(
            apply(ToneMap::AcesHill, [0.6; 3]),
            [curve_at_one; 3],
            2e-5
        ));
    }

    /// Protects: Hill's matrices are not transposed: a red and a blue input separate the channels
    /// as the two matrices specify.
    #[test]
    fn hill_does_not_transpose_its_matrices() {
        let red = apply(ToneMap::AcesHill, [0.6, 0.0, 0.0]);
        // By hand: v = (0.59719, 0.076, 0.0284); the curve gives (0.439938, 0.027490, 0.005641).
        let fit = |v: f64| {
            (v * (v + 0.024_578_6) - 0.000_090_537) / (v * (0.983_729 * v + 0.432_951) + 0.238_081)
        };
        let v = [fit(0.597_19), fit(0.076), fit(0.028_4)];
        assert!((red[0] - (1.604_75 * v[0] - 0.531_08 * v[1] - 0.073_67 * v[2])).abs() < 1e-12);
        assert!((red[2] - (-0.003_27 * v[0] - 0.072_76 * v[1] + 1.076_02 * v[2])).abs() < 1e-12);
    }

    /// Protects: the neutral map: the toe subtracts 4 %, the middle is otherwise unchanged, the
    /// shoulder approaches white.
    #[test]
    fn khronos_neutral_has_the_specified_values() {
        assert!(close(
            apply(ToneMap::KhronosNeutral, [0.5, 0.3, 0.1]),
            [0.46, 0.26, 0.06],
            1e-15
        ));
        assert!(
            close(apply(ToneMap::KhronosNeutral, [0.04; 3]), [0.01; 3], 1e-15),
            "6.25 x² in the toe"
        );
        // Peak 1.96 after the offset: new peak 1 − 0.0576/1.44 = 0.96.
        let white = 1.0 - 1.0 / (0.15 * (1.96 - 0.96) + 1.0);
        let red = apply(ToneMap::KhronosNeutral, [2.0, 0.04 + 0.96, 0.08]);
        let mix = |x: f64| x * (0.96 / 1.96) * (1.0 - white) + 0.96 * white;
        assert!(
            close(red, [mix(1.96), mix(0.96), mix(0.04)], 1e-12),
            "{red:?}"
        );
    }

    /// Protects: the pieces of the neutral map agree at their joints, so that no contour shows.
    #[test]
    fn khronos_neutral_is_continuous_at_its_joints() {
        for joint in [0.08_f64, 0.8] {
            let [below, above] = [joint * (1.0 - 1e-9), joint * (1.0 + 1e-9)]
                .map(|x| apply(ToneMap::KhronosNeutral, [x; 3])[0]);
            assert!((above - below).abs() < 1e-8, "at {joint}: {below} {above}");
        }
    }
}
