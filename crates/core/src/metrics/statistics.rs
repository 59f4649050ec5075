//! Mean and quantiles of a list of numbers.

use serde::Serialize;

/// Mean, quantiles and range of a list of numbers. Quantiles are interpolated linearly between
/// sorted neighbours (type 7 of Hyndman and Fan, "Sample Quantiles in Statistical Packages", 1996).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct MeanAndQuantiles {
    /// Arithmetic mean.
    pub mean: f64,
    /// Least number.
    pub minimum: f64,
    /// 25 % quantile.
    pub first_quartile: f64,
    /// 50 % quantile.
    pub median: f64,
    /// 75 % quantile.
    pub third_quartile: f64,
    /// 99 % quantile.
    pub percentile_99: f64,
    /// 99.9 % quantile.
    pub percentile_99_9: f64,
    /// Greatest number.
    pub maximum: f64,
}

/// Returns mean and quantiles of numbers without NaN; all zero for an empty slice.
pub fn mean_and_quantiles(values: &[f32]) -> MeanAndQuantiles {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f32::total_cmp);
    let mean = values.iter().map(|&x| f64::from(x)).sum::<f64>() / values.len().max(1) as f64;
    let at = |share| quantile(&sorted, share);
    MeanAndQuantiles {
        mean,
        minimum: at(0.0),
        first_quartile: at(0.25),
        median: at(0.5),
        third_quartile: at(0.75),
        percentile_99: at(0.99),
        percentile_99_9: at(0.999),
        maximum: at(1.0),
    }
}

/// Returns a quantile of a sorted list, interpolated linearly. `share` is 0 for the least number
/// and 1 for the greatest.
fn quantile(sorted: &[f32], share: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else {
        return 0.0;
    };
    let place = share * last as f64;
    let low = f64::from(sorted[place as usize]);
    let high = f64::from(sorted[(place as usize + 1).min(last)]);
    // Equal neighbours are returned unchanged, also infinite ones.
    if low == high {
        low
    } else {
        low + (high - low) * place.fract()
    }
}

/// Returns Student's factor for 95 %. A mean ± this many standard errors contains the true value in
/// 95 of 100 cases. `freedom` plus one is the number of independent normal values from which the
/// standard error is estimated. Infinite for zero degrees of freedom.
///
/// Up to ten degrees of freedom, the factor is tabulated. Beyond, it is computed to five digits by
/// the expansion in Abramowitz and Stegun, "Handbook of Mathematical Functions" (1964), 26.7.5.
pub fn student_factor_95(freedom: u32) -> f64 {
    const FEW: [f64; 10] = [
        12.706_205, 4.302_653, 3.182_446, 2.776_445, 2.570_582, 2.446_912, 2.364_624, 2.306_004,
        2.262_157, 2.228_139,
    ];
    const NORMAL: f64 = 1.959_963_984_540_054;
    match freedom {
        0 => f64::INFINITY,
        1..=10 => FEW[freedom as usize - 1],
        _ => {
            let (n, z) = (f64::from(freedom), NORMAL);
            let z2 = z * z;
            let first = z * (z2 + 1.0) / 4.0;
            let second = z * ((5.0 * z2 + 16.0) * z2 + 3.0) / 96.0;
            let third = z * (((3.0 * z2 + 19.0) * z2 + 17.0) * z2 - 15.0) / 384.0;
            let fourth =
                z * ((((79.0 * z2 + 776.0) * z2 + 1482.0) * z2 - 1920.0) * z2 - 945.0) / 92_160.0;
            z + (first + (second + (third + fourth / n) / n) / n) / n
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: the factor agrees with tables of Student's distribution, on both sides of the
    /// switch from table to expansion.
    #[test]
    fn students_factor_is_that_of_the_tables() {
        for (freedom, factor) in [
            (1, 12.7062),
            (3, 3.1824),
            (7, 2.3646),
            (10, 2.2281),
            (11, 2.2010),
            (15, 2.1314),
            (30, 2.0423),
            (120, 1.9799),
        ] {
            assert!(
                (student_factor_95(freedom) - factor).abs() < 6e-5,
                "{freedom}: {}",
                student_factor_95(freedom)
            );
        }
        assert_eq!(student_factor_95(0), f64::INFINITY);
    }

    /// Protects: quantiles of 0, 1, …, 1000 in any order equal their ranks.
    #[test]
    fn quantiles_are_ranks() {
        let values: Vec<f32> = (0..=1000).map(|i| ((i * 389) % 1001) as f32).collect();
        let s = mean_and_quantiles(&values);
        assert_eq!(
            (s.mean, s.minimum, s.first_quartile, s.median),
            (500.0, 0.0, 250.0, 500.0)
        );
        assert_eq!(
            (
                s.third_quartile,
                s.percentile_99,
                s.percentile_99_9,
                s.maximum
            ),
            (750.0, 990.0, 999.0, 1000.0)
        );
    }

    /// Protects: a quantile between two numbers is interpolated; every quantile of a single number
    /// is that number; quantiles of an empty slice are zero.
    #[test]
    fn few_numbers_are_enough() {
        assert_eq!(mean_and_quantiles(&[3.0, 1.0]).first_quartile, 1.5);
        assert_eq!(mean_and_quantiles(&[2.0]).percentile_99, 2.0);
        assert_eq!(mean_and_quantiles(&[]), MeanAndQuantiles::default());
        assert_eq!(
            mean_and_quantiles(&[f32::INFINITY; 2]).median,
            f64::INFINITY
        );
    }

    /// Protects: every entry of the table and the expansion beyond it: the integral of Student's
    /// density from minus the factor to the factor is 95 %.
    #[test]
    fn students_factor_cuts_off_one_case_in_twenty() {
        for freedom in 1..=40 {
            let n = f64::from(freedom);
            // Γ((n + 1)/2) / Γ(n/2), up from Γ(1)/Γ(½) for odd numbers and from Γ(3/2)/Γ(1) for
            // even ones.
            let start = if freedom % 2 == 1 {
                1.0 / core::f64::consts::PI.sqrt()
            } else {
                core::f64::consts::PI.sqrt() / 2.0
            };
            let minimum = if freedom % 2 == 1 { 1 } else { 2 };
            let ratio = (minimum..freedom)
                .step_by(2)
                .fold(start, |ratio, m| ratio * f64::from(m + 1) / f64::from(m));
            let density = |x: f64| {
                ratio / (n * core::f64::consts::PI).sqrt()
                    * (1.0 + x * x / n).powf(-(n + 1.0) / 2.0)
            };
            let (steps, factor) = (20_000, student_factor_95(freedom));
            let at = |i: i32| density(factor * (f64::from(i) + 0.5) / f64::from(steps));
            let share = 2.0 * factor / f64::from(steps) * (0..steps).map(at).sum::<f64>();
            assert!((share - 0.95).abs() < 2e-6, "{freedom}: {share}");
        }
    }
}
