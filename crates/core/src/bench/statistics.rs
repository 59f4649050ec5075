//! Statistics of repeated measurements: median and quartiles, a power law through points, and the
//! crossover of two curves.

use serde::Serialize;

/// Median, quartiles and range of repeated measurements of a quantity.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SampleQuantiles {
    /// 50 % quantile.
    pub median: f64,
    /// 25 % quantile.
    pub lower_quartile: f64,
    /// 75 % quantile.
    pub upper_quartile: f64,
    /// Least measurement.
    pub min: f64,
    /// Greatest measurement.
    pub max: f64,
}

impl SampleQuantiles {
    /// Returns the quantiles of finite measurements, interpolated linearly between measurements;
    /// all NaN for an empty slice.
    pub fn from_samples(measurements: &[f64]) -> Self {
        let mut sorted = measurements.to_vec();
        sorted.sort_by(f64::total_cmp);
        let quantile = |q: f64| {
            let place = q * sorted.len().saturating_sub(1) as f64;
            let at = |place: f64| sorted.get(place as usize).copied().unwrap_or(f64::NAN);
            let below = at(place.floor());
            below + (at(place.ceil()) - below) * place.fract()
        };
        let [min, lower_quartile, median, upper_quartile, max] =
            [0.0, 0.25, 0.5, 0.75, 1.0].map(quantile);
        Self {
            median,
            lower_quartile,
            upper_quartile,
            min,
            max,
        }
    }

    /// Returns the quantiles multiplied by a factor, for instance to change the unit.
    pub fn scale(self, factor: f64) -> Self {
        Self {
            median: factor * self.median,
            lower_quartile: factor * self.lower_quartile,
            upper_quartile: factor * self.upper_quartile,
            min: factor * self.min,
            max: factor * self.max,
        }
    }

    /// Returns the relative spread: half the distance between the quartiles divided by the median.
    pub fn relative_half_spread(&self) -> f64 {
        0.5 * (self.upper_quartile - self.lower_quartile) / self.median
    }
}

/// Power law, y in proportion to x^exponent, fitted to points by least squares in the logarithms.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PowerLaw {
    /// Exponent of the power law: 1 is linear growth. Logarithmic growth gives a small exponent,
    /// which falls slowly with the size.
    pub exponent: f64,
    /// Standard error of the exponent, from the scatter of the points about the line.
    pub standard_error: f64,
}

impl PowerLaw {
    /// Fits a power law to points (x, y) with x and y above zero; `None` for fewer than three
    /// points, or if all x are equal.
    pub fn fit(points: &[(f64, f64)]) -> Option<Self> {
        if points.len() < 3 {
            return None;
        }
        let count = points.len() as f64;
        let logs: Vec<(f64, f64)> = points
            .iter()
            .map(|&(x, y)| (libm::log(x), libm::log(y)))
            .collect();
        let mean = |of: fn(&(f64, f64)) -> f64| logs.iter().map(of).sum::<f64>() / count;
        let (mean_x, mean_y) = (mean(|p| p.0), mean(|p| p.1));
        let sum = |term: &dyn Fn(f64, f64) -> f64| {
            logs.iter()
                .map(|&(x, y)| term(x - mean_x, y - mean_y))
                .sum::<f64>()
        };
        let (xx, xy) = (sum(&|x, _| x * x), sum(&|x, y| x * y));
        if xx <= 0.0 {
            return None;
        }
        let exponent = xy / xx;
        let residual = sum(&|x, y| (y - exponent * x) * (y - exponent * x));
        Some(Self {
            exponent,
            standard_error: (residual / (count - 2.0) / xx).sqrt(),
        })
    }
}

/// Number of primitives from which on the first of two accelerators stays faster than the second.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Crossover {
    /// The first accelerator is faster at every measured size.
    Always,
    /// The first accelerator is faster from this number of primitives on, which is interpolated
    /// between two measured sizes.
    At(f64),
    /// The first accelerator is not faster at the greatest measured size.
    Never,
}

impl Crossover {
    /// Determines the crossover from pairs of a size and a ratio: the second accelerator's time
    /// divided by the first's. The pairs are in ascending order of sizes. The first accelerator
    /// counts as faster at a size if three quarters of the measured ratios are above one. The
    /// crossover is interpolated between the last size at which it is not faster and the next size.
    /// If the median ratio at that last size is at least one, the last size itself is the
    /// crossover. `None` without a measurement.
    pub fn from_time_ratios(ratios: &[(f64, SampleQuantiles)]) -> Option<Self> {
        let Some(last) = ratios
            .iter()
            .rposition(|(_, ratio)| ratio.lower_quartile <= 1.0)
        else {
            return (!ratios.is_empty()).then_some(Self::Always);
        };
        let Some(&(after, lead)) = ratios.get(last + 1) else {
            return Some(Self::Never);
        };
        let (before, behind) = ratios[last];
        let (x0, x1) = (libm::log(before), libm::log(after));
        let (y0, y1) = (libm::log(behind.median.min(1.0)), libm::log(lead.median));
        Some(Self::At(libm::exp(x0 - y0 * (x1 - x0) / (y1 - y0))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn level(ratio: f64) -> SampleQuantiles {
        SampleQuantiles {
            median: ratio,
            lower_quartile: ratio,
            upper_quartile: ratio,
            min: ratio,
            max: ratio,
        }
    }

    /// Protects: median and quartiles of odd and even counts, for measurements in any order.
    #[test]
    fn spread_of_known_numbers() {
        assert!(SampleQuantiles::from_samples(&[]).median.is_nan());
        assert_eq!(SampleQuantiles::from_samples(&[2.5]), level(2.5));
        let odd = SampleQuantiles {
            median: 3.0,
            lower_quartile: 2.0,
            upper_quartile: 4.0,
            min: 1.0,
            max: 100.0,
        };
        assert_eq!(
            SampleQuantiles::from_samples(&[100.0, 3.0, 1.0, 4.0, 2.0]),
            odd
        );
        let even = SampleQuantiles {
            median: 2.5,
            lower_quartile: 1.75,
            upper_quartile: 3.25,
            min: 1.0,
            max: 4.0,
        };
        assert_eq!(SampleQuantiles::from_samples(&[4.0, 1.0, 3.0, 2.0]), even);
        assert_eq!(even.scale(2.0).upper_quartile, 6.5);
        assert!((even.relative_half_spread() - 0.3).abs() < 1e-15);
    }

    /// Protects: an exact power law is recovered without an error.
    #[test]
    fn exact_power_law() {
        let points: Vec<(f64, f64)> = [1e3, 3e3, 1e4, 1e5, 1e6]
            .map(|x: f64| (x, 7.0 * x.powf(0.25)))
            .to_vec();
        let law = PowerLaw::fit(&points).expect("enough points");
        assert!(
            (law.exponent - 0.25).abs() < 1e-12 && law.standard_error < 1e-12,
            "{law:?}"
        );
    }

    /// Protects: the standard error agrees with a case computed by hand: ln y = 0, 1, 1 at ln x = 0,
    /// 1, 2 has slope 1/2, residuals 1/6, −1/3, 1/6, so s² = 1/6, standard error √(1/12).
    #[test]
    fn scattered_power_law() {
        let e = core::f64::consts::E;
        let law = PowerLaw::fit(&[(1.0, 1.0), (e, e), (e * e, e)]).expect("enough points");
        assert!((law.exponent - 0.5).abs() < 1e-12, "{law:?}");
        assert!(
            (law.standard_error - (1.0_f64 / 12.0).sqrt()).abs() < 1e-12,
            "{law:?}"
        );
    }

    /// Protects: no exponent is reported with too few points for an error, or without a range of x.
    #[test]
    fn no_law_without_enough_points() {
        assert_eq!(PowerLaw::fit(&[(1.0, 1.0), (2.0, 2.0)]), None);
        assert_eq!(PowerLaw::fit(&[(5.0, 1.0), (5.0, 2.0), (5.0, 3.0)]), None);
    }

    /// Protects: a crossover must persist, a tie at the start is no lead, and interpolation is
    /// logarithmic.
    #[test]
    fn crossovers() {
        let value_of = |ratios: &[(f64, f64)]| {
            Crossover::from_time_ratios(
                &ratios
                    .iter()
                    .map(|&(n, r)| (n, level(r)))
                    .collect::<Vec<_>>(),
            )
        };
        assert_eq!(value_of(&[]), None);
        assert_eq!(value_of(&[(1.0, 1.5), (2.0, 3.0)]), Some(Crossover::Always));
        assert_eq!(value_of(&[(1.0, 1.5), (2.0, 0.9)]), Some(Crossover::Never));
        // An early lead that is lost again does not count.
        let Some(Crossover::At(n)) = value_of(&[(1.0, 2.0), (4.0, 0.5), (16.0, 2.0), (64.0, 8.0)])
        else {
            panic!("no crossover")
        };
        assert!((n - 8.0).abs() < 1e-12, "{n}");
        // A tie at 8: the median is above one, but not clearly.
        let tie = SampleQuantiles {
            lower_quartile: 0.99,
            ..level(1.01)
        };
        let Some(Crossover::At(n)) = Crossover::from_time_ratios(&[(8.0, tie), (16.0, level(2.0))])
        else {
            panic!("no crossover")
        };
        assert!((n - 8.0).abs() < 1e-12, "{n}");
    }
}
