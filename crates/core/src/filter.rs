//! Reconstruction filters: the weight of a sample in a pixel's value, by the sample's distance from
//! the pixel's centre.
//!
//! Positions are sampled in proportion to the filter; samples have equal weights (Ernst, Stamminger
//! and Greiner, "Filter Importance Sampling", 2006). Every sample counts for a single pixel. A tile
//! therefore does not read its neighbours, and weights add no variance. The method requires filters
//! without negative lobes. All filters are separable: one table samples both axes.

use core::f64::consts::PI;
use std::sync::LazyLock;

use serde::{Deserialize, Serialize};

/// Pixel filter: the weight of positions around a pixel's centre in the pixel's value. Fixed
/// patterns of samples use no filter, because they place their samples themselves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
#[doc(alias("reconstruction filter", "GaussianFilter"))]
pub enum PixelFilter {
    /// Uniform over the pixel's square.
    #[default]
    Box,
    /// Linear falloff to the centres of the neighbouring pixels.
    Tent,
    /// Gaussian of standard deviation 0.5 pixels, cut off at 1.5.
    Gaussian,
    /// Narrow bell up to 1.5 pixels that falls to zero without a step: the four-term window of
    /// Harris, "On the Use of Windows for Harmonic Analysis with the Discrete Fourier Transform"
    /// (1978).
    BlackmanHarris,
}

/// Number of intervals in a filter table.
const STEPS: usize = 256;

impl PixelFilter {
    /// All filters, from the widest to the narrowest.
    pub const ALL: [Self; 4] = [Self::Gaussian, Self::BlackmanHarris, Self::Tent, Self::Box];

    /// Returns the filter's radius in pixels.
    pub const fn radius(self) -> f64 {
        match self {
            Self::Box => 0.5,
            Self::Tent => 1.0,
            Self::Gaussian | Self::BlackmanHarris => 1.5,
        }
    }

    /// Returns the unnormalised weight at a distance in pixels from the pixel's centre, along one
    /// axis; zero beyond the radius.
    pub fn weight(self, offset: f64) -> f64 {
        let share = offset.abs() / self.radius();
        if share > 1.0 {
            return 0.0;
        }
        match self {
            Self::Box => 1.0,
            Self::Tent => 1.0 - share,
            Self::Gaussian => libm::exp(-2.0 * offset * offset),
            Self::BlackmanHarris => {
                let cosine = |k: f64| libm::cos(k * PI * share);
                0.35875 + 0.48829 * cosine(1.0) + 0.14128 * cosine(2.0) + 0.01168 * cosine(3.0)
            }
        }
    }

    /// Returns the sampler of positions along one axis. Its table is computed once per process.
    pub(crate) fn sampler(self) -> FilterSampler {
        static TENT: LazyLock<Box<FilterTable>> =
            LazyLock::new(|| tabulate_inverse_cdf(PixelFilter::Tent));
        static GAUSSIAN: LazyLock<Box<FilterTable>> =
            LazyLock::new(|| tabulate_inverse_cdf(PixelFilter::Gaussian));
        static BLACKMAN_HARRIS: LazyLock<Box<FilterTable>> =
            LazyLock::new(|| tabulate_inverse_cdf(PixelFilter::BlackmanHarris));
        FilterSampler(match self {
            Self::Box => None,
            Self::Tent => Some(&TENT),
            Self::Gaussian => Some(&GAUSSIAN),
            Self::BlackmanHarris => Some(&BLACKMAN_HARRIS),
        })
    }
}

/// Samples positions along one axis in proportion to a filter, from uniform numbers in [0, 1).
///
/// The table inverts the integral of one half of the filter. Its steps are even in the square root
/// of the tail's integral: thin tails are resolved as well as the middle. The table of a tent
/// filter is a straight line.
#[derive(Clone, Debug)]
pub(crate) struct FilterSampler(Option<&'static FilterTable>);

/// Table of distances from the pixel's centre, in pixels. Entry k belongs to the fraction s²/2 of
/// the filter's integral beyond that distance on one side, with s = k / [`STEPS`].
type FilterTable = [f32; STEPS + 1];

impl FilterSampler {
    /// Samples a position, in pixels from the pixel's low edge, by a uniform number in [0, 1). The
    /// box filter returns the number unchanged.
    #[inline(always)]
    pub fn sample(&self, number: f32) -> f32 {
        match &self.0 {
            None => number,
            Some(table) if number < 0.5 => 0.5 - interpolate_distance(table, number),
            Some(table) => 0.5 + interpolate_distance(table, 1.0 - number),
        }
    }
}

/// Returns the distance from the pixel's centre beyond which one side of the filter has the
/// fraction `share` of the filter's integral, at most a half. The table is interpolated linearly.
fn interpolate_distance(table: &FilterTable, share: f32) -> f32 {
    let at = (2.0 * share).sqrt() * STEPS as f32;
    let step = (at as usize).min(STEPS - 1);
    let (near, far) = (table[step], table[step + 1]);
    near + (far - near) * (at - step as f32)
}

/// Computes the table of a filter, see [`FilterTable`]. The integral is summed inwards from the
/// radius by Simpson's rule, exact to twelve digits.
fn tabulate_inverse_cdf(filter: PixelFilter) -> Box<FilterTable> {
    const FINE: usize = 1 << 14;
    let step = filter.radius() / FINE as f64;
    let mut integral = vec![0.0; FINE + 1];
    for i in 0..FINE {
        let from = filter.radius() - step * i as f64;
        let mean = (filter.weight(from)
            + 4.0 * filter.weight(from - 0.5 * step)
            + filter.weight(from - step))
            / 6.0;
        integral[i + 1] = integral[i] + mean * step;
    }
    let mut table = Box::new([0.0; STEPS + 1]);
    for (i, distance) in table.iter_mut().enumerate() {
        let requested = integral[FINE] * (i as f64 / STEPS as f64).powi(2);
        let above = integral
            .partition_point(|&value| value < requested)
            .clamp(1, FINE);
        let share = (requested - integral[above - 1])
            / (integral[above] - integral[above - 1]).max(f64::MIN_POSITIVE);
        *distance = (filter.radius() - step * ((above - 1) as f64 + share.clamp(0.0, 1.0))) as f32;
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the mean of a function of filter samples, relative to the pixel's centre, over
    /// evenly spaced numbers.
    fn mean(filter: PixelFilter, value_of: impl Fn(f64) -> f64) -> f64 {
        let (filter_sampler, n) = (filter.sampler(), 1 << 20);
        (0..n)
            .map(|i| value_of(f64::from(filter_sampler.sample((i as f32 + 0.5) / n as f32)) - 0.5))
            .sum::<f64>()
            / f64::from(n)
    }

    /// Protects: filter samples have mean zero and the filter's variance: 1/12 for the box, 1/6 for
    /// the tent, σ²(1 − 2cφ(c)/(2Φ(c) − 1)) with c = 3 for the cut-off Gaussian, and r²(1/3 + Σ aₖ
    /// 2(−1)ᵏ/(kπ)²/a₀) for the window, whose cosines are integrated by hand.
    #[test]
    fn draws_have_the_filters_variance() {
        let bell = 0.25 * (1.0 - 6.0 * 0.004_431_848_411_938_008 / 0.997_300_203_936_739_8);
        let cosines = -2.0 * 0.48829 + 2.0 * 0.14128 / 4.0 - 2.0 * 0.01168 / 9.0;
        let window = 2.25 * (1.0 / 3.0 + cosines / (PI * PI) / 0.35875);
        let expected = [
            (PixelFilter::Box, 1.0 / 12.0),
            (PixelFilter::Tent, 1.0 / 6.0),
            (PixelFilter::Gaussian, bell),
        ];
        for (filter, expected) in expected
            .into_iter()
            .chain([(PixelFilter::BlackmanHarris, window)])
        {
            let (centre, variance) = (mean(filter, |x| x), mean(filter, |x| x * x));
            assert!(centre.abs() < 1e-5, "{filter:?}: {centre}");
            assert!(
                (variance / expected - 1.0).abs() < 1e-4,
                "{filter:?}: {variance} instead of {expected}"
            );
        }
    }

    /// Protects: filter samples follow the filter. The share of samples within any distance of the
    /// centre equals the filter's integral, no sample lies outside the radius, and the tent's
    /// samples equal the closed form 1 − √(2(1 − u)) above the centre.
    #[test]
    fn draws_follow_the_filter() {
        for filter in PixelFilter::ALL {
            let within = |limit: f64| {
                let n = 10_000;
                let sum = |limit: f64| {
                    (0..n)
                        .map(|i| filter.weight(limit * (f64::from(i) + 0.5) / f64::from(n)))
                        .sum::<f64>()
                        * limit
                };
                sum(limit) / sum(filter.radius())
            };
            for limit in [0.1, 0.3, 0.5, 0.8, 1.2]
                .into_iter()
                .filter(|&limit| limit <= filter.radius())
            {
                let found = mean(filter, |x| f64::from(u8::from(x.abs() < limit)));
                assert!(
                    (found - within(limit)).abs() < 1e-3,
                    "{filter:?} within {limit}: {found}, {}",
                    within(limit)
                );
            }
            let filter_sampler = filter.sampler();
            let ends =
                [0.0, 1.0 - f32::EPSILON / 2.0].map(|u| f64::from(filter_sampler.sample(u)) - 0.5);
            assert!(
                ends[0] >= -filter.radius() && ends[1] <= filter.radius(),
                "{filter:?}: {ends:?}"
            );
        }
        let tent = PixelFilter::Tent.sampler();
        for u in [0.5_f32, 0.7, 0.9, 0.99] {
            let expected = 1.5 - (2.0 * (1.0 - u)).sqrt();
            assert!(
                (tent.sample(u) - expected).abs() < 1e-5,
                "{u}: {} instead of {expected}",
                tent.sample(u)
            );
        }
    }

    /// Protects: the box filter returns its number unchanged, so pictures without a filter keep
    /// their bits.
    #[test]
    fn the_box_changes_no_number() {
        let filter_sampler = PixelFilter::Box.sampler();
        assert!(
            [0.0, 0.1, 0.5, 0.999_999_9]
                .into_iter()
                .all(|u: f32| filter_sampler.sample(u).to_bits() == u.to_bits())
        );
    }
}
