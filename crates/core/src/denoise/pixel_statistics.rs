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
pub(super) fn full_and_leave_one_out_colours(
    mean: [f64; 3],
    pixel: &PixelCandidates,
) -> [[f64; 3]; 2] {
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
/// - the variance of this mean;
/// - an estimate of the mean's squared error from products of partner replicates.
///
/// The expectation of the estimate is the variance. Its noise is correlated with the noise of the
/// candidates' error terms, and part of the noise cancels in their sum.
pub(super) fn replicate_statistics(radiance: [[f64; 3]; REPLICATE_COUNT]) -> [[f64; 3]; 3] {
    let mean: [f64; 3] =
        from_fn(|i| radiance.iter().map(|value| value[i]).sum::<f64>() / REPLICATE_COUNT as f64);
    let apart = radiance.map(|value| -> [f64; 3] { from_fn(|i| value[i] - mean[i]) });
    let square: [f64; 3] = from_fn(|i| {
        apart.iter().map(|value| value[i] * value[i]).sum::<f64>() / REPLICATE_COUNT as f64
    });
    let partners: [f64; 3] =
        from_fn(|i| (apart[0][i] * apart[1][i] + apart[2][i] * apart[3][i]) / 2.0);
    [
        mean,
        square.map(|square| square / 3.0),
        from_fn(|i| -square[i] / 3.0 - 2.0 * partners[i]),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: the statistics of a pixel by hand: for 1, 2, 3 and 6 the mean is 3, its variance
    /// 14/12, and the error by partners −14/12 − 2·(2·1 + 0·3)/2 = −3.1667.
    #[test]
    fn statistics_by_hand() {
        let [mean, variance, error] = replicate_statistics([1.0, 2.0, 3.0, 6.0].map(|x| [x; 3]));
        assert_eq!((mean[0], variance[1]), (3.0, 14.0 / 12.0));
        assert!((error[2] + 14.0 / 12.0 + 2.0).abs() < 1e-12, "{error:?}");
    }
}
