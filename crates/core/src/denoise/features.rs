//! Surface features that limit the filter's weights: albedo, normal and distance at first hits.
//! Each feature has a tolerance. Features are means of two of the four replicates.

use super::plane::{ColourPlanes, PixelPlane, mean_colour};

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
