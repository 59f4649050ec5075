//! Reconstruction filters: how much of a pixel's surroundings counts towards it.
//!
//! Samples are drawn by the filter instead of being weighed by it (Ernst, Stamminger and Greiner,
//! "Filter Importance Sampling", 2006): each counts for one pixel and as much as any other, so
//! tiles need nothing of their neighbours and no weight varies. That asks for filters without
//! negative parts, which these are. All are separable, so each axis has a table of its own draws.

use core::f64::consts::PI;
use std::sync::LazyLock;

use serde::{Deserialize, Serialize};

/// How much of a pixel's surroundings counts towards it. Fixed patterns of samples have places of
/// their own and no filter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum PixelFilter {
    /// The pixel alone, all of it alike: the mean over its square.
    #[default]
    Box,
    /// Up to the middles of its neighbours, falling off evenly.
    Tent,
    /// A bell of standard deviation 0.5 pixels, cut off at 1.5.
    Gaussian,
    /// A narrow bell up to 1.5 pixels that ends without a step: the four-term window of Harris, "On
    /// the Use of Windows for Harmonic Analysis with the Discrete Fourier Transform" (1978).
    BlackmanHarris,
}

/// Places of a table of draws between its ends.
const STEPS: usize = 256;

impl PixelFilter {
    /// Every filter, from the widest blur to none.
    pub const ALL: [Self; 4] = [Self::Gaussian, Self::BlackmanHarris, Self::Tent, Self::Box];

    /// Pixels from its middle to where it ends.
    pub const fn radius(self) -> f64 {
        match self {
            Self::Box => 0.5,
            Self::Tent => 1.0,
            Self::Gaussian | Self::BlackmanHarris => 1.5,
        }
    }

    /// How much counts what lies so many pixels off the middle, up to a factor; zero beyond the
    /// radius.
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

    /// The draws of one axis.
    pub(crate) fn draws(self) -> Draws {
        static TENT: LazyLock<Box<Table>> = LazyLock::new(|| inverse(PixelFilter::Tent));
        static GAUSSIAN: LazyLock<Box<Table>> = LazyLock::new(|| inverse(PixelFilter::Gaussian));
        static BLACKMAN_HARRIS: LazyLock<Box<Table>> =
            LazyLock::new(|| inverse(PixelFilter::BlackmanHarris));
        Draws(match self {
            Self::Box => None,
            Self::Tent => Some(&TENT),
            Self::Gaussian => Some(&GAUSSIAN),
            Self::BlackmanHarris => Some(&BLACKMAN_HARRIS),
        })
    }
}

/// Where samples lie along one axis, from numbers in [0, 1).
///
/// The half of the filter below its middle is tabulated by the root of what lies below, so that the
/// thin ends of bells are as well drawn as their middles; a tent's table is a straight line.
#[derive(Clone, Debug)]
pub(crate) struct Draws(Option<&'static Table>);

/// Distances from the middle.
type Table = [f32; STEPS + 1];

impl Draws {
    /// A place from the pixel's low edge, in pixels: in [0, 1) for the box, which takes the number
    /// as it is.
    #[inline(always)]
    pub fn place(&self, number: f32) -> f32 {
        match &self.0 {
            None => number,
            Some(table) if number < 0.5 => 0.5 - between(table, number),
            Some(table) => 0.5 + between(table, 1.0 - number),
        }
    }
}

/// Distance from the middle beyond which a filter has this share on one side, up to a half.
fn between(table: &Table, share: f32) -> f32 {
    let at = (2.0 * share).sqrt() * STEPS as f32;
    let step = (at as usize).min(STEPS - 1);
    let (near, far) = (table[step], table[step + 1]);
    near + (far - near) * (at - step as f32)
}

/// Distances beyond which a filter has the shares s²/2 for evenly spaced s, by its integral from
/// outside, which Simpson's rule has to twelve digits.
fn inverse(filter: PixelFilter) -> Box<Table> {
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
        let wanted = integral[FINE] * (i as f64 / STEPS as f64).powi(2);
        let above = integral
            .partition_point(|&value| value < wanted)
            .clamp(1, FINE);
        let share = (wanted - integral[above - 1])
            / (integral[above] - integral[above - 1]).max(f64::MIN_POSITIVE);
        *distance = (filter.radius() - step * ((above - 1) as f64 + share.clamp(0.0, 1.0))) as f32;
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean of a function of places that a filter draws, relative to the pixel's middle, over
    /// evenly spaced numbers.
    fn mean(filter: PixelFilter, of: impl Fn(f64) -> f64) -> f64 {
        let (draws, n) = (filter.draws(), 1 << 20);
        (0..n)
            .map(|i| of(f64::from(draws.place((i as f32 + 0.5) / n as f32)) - 0.5))
            .sum::<f64>()
            / f64::from(n)
    }

    /// Protects: draws lie about the middle with the variance of the filter: 1/12 of the box, 1/6
    /// of the tent, of the cut-off bell σ²(1 − 2cφ(c)/(2Φ(c) − 1)) with c = 3, and of the window,
    /// whose cosines are integrated by hand, r²(1/3 + Σ aₖ 2(−1)ᵏ/(kπ)²/a₀).
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

    /// Protects: draws are spread as the filter says: of the whole of it, the share within any
    /// distance of the middle is that of the draws, nothing is drawn outside, and the tent's are
    /// its closed form, 1 − √(2(1 − u)) above the middle.
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
            let draws = filter.draws();
            let ends = [0.0, 1.0 - f32::EPSILON / 2.0].map(|u| f64::from(draws.place(u)) - 0.5);
            assert!(
                ends[0] >= -filter.radius() && ends[1] <= filter.radius(),
                "{filter:?}: {ends:?}"
            );
        }
        let tent = PixelFilter::Tent.draws();
        for u in [0.5_f32, 0.7, 0.9, 0.99] {
            let expected = 1.5 - (2.0 * (1.0 - u)).sqrt();
            assert!(
                (tent.place(u) - expected).abs() < 1e-5,
                "{u}: {} instead of {expected}",
                tent.place(u)
            );
        }
    }

    /// Protects: the box takes the number as it is, so that pictures without a filter keep their
    /// bits.
    #[test]
    fn the_box_changes_no_number() {
        let draws = PixelFilter::Box.draws();
        assert!(
            [0.0, 0.1, 0.5, 0.999_999_9]
                .into_iter()
                .all(|u: f32| draws.place(u).to_bits() == u.to_bits())
        );
    }
}
