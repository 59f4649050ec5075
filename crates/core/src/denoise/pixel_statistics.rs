//! Colours and statistics of one pixel, from its replicates and its candidate changes.

use core::array::from_fn;

use super::{PixelCandidates, REPLICATE_COUNT};
pub(super) use crate::metrics::RELATIVE_FLOOR as FLOOR;

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
