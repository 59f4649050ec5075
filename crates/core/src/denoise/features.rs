//! Surface features that limit the filter's weights: albedo, normal and distance at first hits.
//! Each feature has a tolerance. Features are means of two of the four replicates.

use core::array::from_fn;

use super::plane::{ColourPlanes, PixelPlane, mean_colour};
use super::{PixelCandidates, REPLICATE_COUNT};
pub(super) use crate::metrics::RELATIVE_FLOOR as FLOOR;

/// Squared differences between two pixels that are always tolerated: of the albedo for reflected
/// light, of the albedo for directly visible emission (`SHARP_ALBEDO`), of normals, and of
/// logarithms of distances (`DEPTH`).
const ALBEDO: f32 = 0.1 * 0.1;
const SHARP_ALBEDO: f32 = 0.03 * 0.03;
const NORMAL: f32 = 0.15 * 0.15;
const DEPTH: f32 = 0.05 * 0.05;

/// Squared differences of a feature are tolerated up to this factor times its squared noise and
/// squared slope.
const TOLERANCE_FACTOR: f32 = 2.0;

/// Logarithm of the distance assumed for a pixel without a hit.
const MISS_LOG_DISTANCE: f32 = 12.0;

/// Returns seven features, each with the inverse of its tolerated squared difference: three of the
/// albedo, three of the normal, one of the distance. `sharp` selects the lower tolerance of the
/// albedo, for directly visible emission.
pub(super) fn surface_features(
    albedo: [&ColourPlanes; 2],
    normal: [&ColourPlanes; 2],
    distance: &(PixelPlane, PixelPlane),
    sharp: bool,
) -> Vec<(PixelPlane, PixelPlane)> {
    let mut features = Vec::with_capacity(7);
    let noise = |[one, other]: [&ColourPlanes; 2], i: usize| {
        PixelPlane::map_planes([&one[i], &other[i]], |[a, b]| (a - b) * (a - b) / 4.0).box_mean(1)
    };
    let minimum = if sharp { SHARP_ALBEDO } else { ALBEDO };
    for (i, plane) in mean_colour(albedo).into_iter().enumerate() {
        let tolerance = PixelPlane::map_planes([&noise(albedo, i)], |[noise]| {
            1.0 / minimum.max(TOLERANCE_FACTOR * noise)
        });
        features.push((plane, tolerance));
    }
    for (i, plane) in mean_colour(normal).into_iter().enumerate() {
        let of = [&noise(normal, i), &plane.squared_slope()];
        let tolerance = PixelPlane::map_planes(of, |[noise, slope]| {
            1.0 / NORMAL.max(TOLERANCE_FACTOR * noise.max(slope))
        });
        features.push((plane, tolerance));
    }
    features.push(distance.clone());
    features
}

/// Returns the logarithm of the distance as a feature, with the inverse of its tolerated squared
/// difference.
pub(super) fn distance_feature(depth: &PixelPlane) -> (PixelPlane, PixelPlane) {
    let log = PixelPlane::map_planes([depth], |[z]| {
        if z > 0.0 {
            libm::logf(z.max(1e-4))
        } else {
            MISS_LOG_DISTANCE
        }
    });
    let tolerance = PixelPlane::map_planes([&log.squared_slope()], |[slope]| {
        1.0 / DEPTH.max(TOLERANCE_FACTOR * slope)
    });
    (log, tolerance)
}

// Colours and statistics of one pixel, from its replicates and its candidate changes.

/// Greatest ratio between the leave-one-out colour (filtered without the pixel itself) and the
/// filtered colour, whichever is brighter. The leave-one-out colour is clamped to this ratio, and
/// then serves as the denominator of relative errors.
const MAX_COLOUR_RATIO: f64 = 1.5;

/// Returns two colours of a pixel: the filtered colour with all candidates applied in full, and the
/// leave-one-out colour. Their ratio is limited by [`MAX_COLOUR_RATIO`].
pub(super) fn jackknife_colours(mean: [f64; 3], pixel: &PixelCandidates) -> [[f64; 3]; 2] {
    let whole = from_fn(|i| {
        mean[i]
            + pixel
                .changes
                .iter()
                .map(|added| f64::from(added[i]))
                .sum::<f64>()
    });
    let base = from_fn(|i: usize| {
        let (below, above) = (f64::min(whole[i], 0.0), f64::max(whole[i], 0.0));
        f64::from(pixel.base_colour[i])
            .clamp(below + above / MAX_COLOUR_RATIO, above * MAX_COLOUR_RATIO)
    });
    [whole, base]
}

/// Returns three statistics over a pixel's replicates:
/// - their mean;
/// - the variance of this mean, if all four are independent;
/// - the variance of this mean from the halves alone, which are independent.
pub(super) fn replicate_statistics(radiance: [[f64; 3]; REPLICATE_COUNT]) -> [[f64; 3]; 3] {
    let mean: [f64; 3] =
        from_fn(|i| radiance.iter().map(|value| value[i]).sum::<f64>() / REPLICATE_COUNT as f64);
    let apart = radiance.map(|value| -> [f64; 3] { from_fn(|i| value[i] - mean[i]) });
    let square: [f64; 3] = from_fn(|i| {
        apart.iter().map(|value| value[i] * value[i]).sum::<f64>() / REPLICATE_COUNT as f64
    });
    [
        mean,
        square.map(|square| square / 3.0),
        from_fn(|i| ((apart[0][i] + apart[1][i]) / 2.0).powi(2)),
    ]
}

#[cfg(test)]
mod tests {
    use super::super::plane::black_planes;
    use super::*;

    /// Protects: tolerances of features: a tenth of albedo, less for lamps, more for noise.
    #[test]
    fn tolerances_by_hand() {
        let (still, mut other) = (black_planes([3, 1]), black_planes([3, 1]));
        let far = distance_feature(&PixelPlane {
            width: 3,
            height: 1,
            values: vec![2.0, 2.0, -1.0],
        });
        assert_eq!(
            (far.0.values[1], far.0.values[2], far.1.values[0]),
            (libm::logf(2.0), MISS_LOG_DISTANCE, 1.0 / DEPTH)
        );
        let value_of = |other: &ColourPlanes, sharp: bool| {
            surface_features([&still, other], [&still, &still], &far, sharp)
        };
        assert_eq!(
            (
                value_of(&other, false)[0].1.values[0],
                value_of(&other, true)[0].1.values[0],
                value_of(&other, false).len()
            ),
            (1.0 / ALBEDO, 1.0 / SHARP_ALBEDO, 7)
        );
        other[0].values.fill(0.6);
        assert!(
            (value_of(&other, false)[0].1.values[1] - 1.0 / (TOLERANCE_FACTOR * 0.09)).abs() < 1e-4
        );
    }
}

#[cfg(test)]
mod pixel_statistics_tests {
    use super::*;

    /// Protects: the statistics of a pixel by hand: for 1, 2, 3 and 6 the mean is 3, its variance
    /// 14/12, and that from the halves, 1.5 and 4.5, 9/4.
    #[test]
    fn statistics_by_hand() {
        let [mean, variance, of_halves] =
            replicate_statistics([1.0, 2.0, 3.0, 6.0].map(|x| [x; 3]));
        assert_eq!(
            (mean[0], variance[1], of_halves[2]),
            (3.0, 14.0 / 12.0, 9.0 / 4.0)
        );
    }
}
