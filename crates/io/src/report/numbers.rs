//! Numbers as text: counts, shares, times, sizes and measured values, each in one notation
//! everywhere.

use crate::limits::format_bytes;
use raywright_core::bench::SampleQuantiles;
use raywright_core::film::ErrorEstimate;

/// Formats a count with its noun in singular or plural: `1 thread`, `2 threads`.
pub fn format_count(count: usize, noun: &str) -> String {
    let ending = match count {
        1 => "",
        _ if noun.ends_with("sh") => "es",
        _ => "s",
    };
    format!("{count} {noun}{ending}")
}

/// Formats a number with four significant digits.
pub fn format_four_digits(value: f64) -> String {
    format_significant_digits(value, 4)
}

/// Formats a number with `digits` significant digits, without trailing zeros.
pub fn format_significant_digits(value: f64, digits: i32) -> String {
    let magnitude = value.abs();
    if value == 0.0 {
        "0".to_owned()
    } else if (1e-3..1e4).contains(&magnitude) {
        let digits = (digits - 1 - magnitude.log10().floor() as i32).max(0) as usize;
        let text = format!("{value:.digits$}");
        if text.contains('.') {
            text.trim_end_matches('0').trim_end_matches('.').to_owned()
        } else {
            text
        }
    } else {
        format!("{value:.0$e}", (digits - 1).max(0) as usize)
    }
}

/// Formats a number with three significant digits and its trailing zeros, so that the numbers of a
/// column have the same precision; `-` for infinity and NaN.
pub fn format_three_digits(x: f64) -> String {
    if !x.is_finite() {
        return "-".to_owned();
    }
    let whole = if x == 0.0 {
        0
    } else {
        x.abs().log10().floor() as i32
    };
    let step = 10_f64.powi(whole - 2);
    let rounded = if whole > 2 {
        (x / step).round() * step
    } else {
        x
    };
    format!("{rounded:.*}", (2 - whole).clamp(0, 6) as usize)
}

/// Formats the change that a ratio stands for, in whole per cent with its sign: `+12 %`.
pub fn format_change(ratio: f64) -> String {
    format!("{:+.0} %", 100.0 * (ratio - 1.0))
}

/// Formats a share from 0 to 1 in per cent, with three significant digits.
pub fn format_percent(share: f64) -> String {
    format!("{} %", format_significant_digits(100.0 * share, 3))
}

/// Formats the median of measured values with three significant digits, and half their
/// interquartile range in per cent of the median.
pub fn format_median(values: &SampleQuantiles) -> String {
    format!(
        "{} ±{:>4.1} %",
        format_three_digits(values.median),
        values.relative_half_spread() * 100.0
    )
}

/// Formats a time in seconds: below a second with three digits in milliseconds, otherwise like
/// [`format_duration`].
pub fn format_precise_duration(seconds: f64) -> String {
    if seconds < 0.9995 {
        format!("{} ms", format_significant_digits(seconds * 1e3, 3))
    } else {
        format_duration(seconds)
    }
}

/// Formats seconds in the unit that fits, with about three digits: `35 ms`, `1.24 s`, `12 min 5 s`.
pub fn format_duration(seconds: f64) -> String {
    match seconds {
        s if s < 0.9995 => format!("{:.0} ms", s * 1e3),
        s if s < 9.995 => format!("{s:.2} s"),
        s if s < 99.95 => format!("{s:.1} s"),
        s => format_whole_seconds(s as u64),
    }
}

/// Formats a power of ten in seconds by its exponent, in the unit that fits: `10 ms`.
pub fn format_seconds(exponent: i32) -> String {
    let (unit, name) = match exponent {
        ..-6 => (-9, "ns"),
        -6..-3 => (-6, "µs"),
        -3..0 => (-3, "ms"),
        _ => (0, "s"),
    };
    format!("{} {name}", format_power(exponent - unit))
}

/// Formats a power of ten by its exponent: `0.01`, `1000`, `1e-5`.
pub fn format_power(exponent: i32) -> String {
    match exponent {
        -4..7 => 10_f64.powi(exponent).to_string(),
        _ => format!("1e{exponent}"),
    }
}

/// Formats seconds as a value of `--budget`, rounded up to tens of seconds, or to minutes from one
/// minute on.
pub fn format_budget(seconds: f64) -> String {
    let rounded = 10.0 * (seconds / 10.0).ceil();
    if rounded < 60.0 {
        format!("{rounded}s")
    } else {
        format!("{}min", (seconds / 60.0).ceil())
    }
}

/// Formats whole seconds: `8 s`, `3 min 20 s`, `2 h 5 min`.
pub fn format_whole_seconds(seconds: u64) -> String {
    match seconds {
        0..60 => format!("{seconds} s"),
        60..3600 => format!("{} min {} s", seconds / 60, seconds % 60),
        _ => format!("{} h {} min", seconds / 3600, seconds / 60 % 60),
    }
}

/// Formats the names and sizes of all parts above zero bytes: `geometry 1.2 MiB, picture 300 KiB`.
pub fn format_memory_parts(parts: &[(&str, u64)]) -> String {
    let taken = parts.iter().filter(|(_, bytes)| *bytes > 0);
    taken
        .map(|(name, bytes)| format!("{name} {}", format_bytes(*bytes)))
        .collect::<Vec<_>>()
        .join(", ")
}

/// Formats an estimated error with its interval: `0.05 (0.04 to 0.06)`.
pub fn format_estimate(estimate: ErrorEstimate) -> String {
    let [value, low, high] = [estimate.value, estimate.low, estimate.high]
        .map(|value| format_significant_digits(value, 3));
    match estimate.value == 0.0 && estimate.high > 0.0 {
        _ if estimate.is_meaningless() => "not known".to_owned(),
        true => format!("at most {high}"),
        false => format!("{value} ({low} to {high})"),
    }
}

/// Formats an estimated error without its interval: `about 0.05`.
pub fn format_rough_estimate(estimate: ErrorEstimate) -> String {
    if estimate.is_meaningless() {
        return "not known".to_owned();
    }
    format!("about {}", format_significant_digits(estimate.value, 2))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: numbers of any size have four digits and no trailing zeros.
    #[test]
    fn numbers_are_short() {
        let cases = [
            (0.0, "0"),
            (0.25, "0.25"),
            (1.0, "1"),
            (10.0, "10"),
            (2500.0, "2500"),
            (31.41592, "31.42"),
            (0.0012345, "0.001234"),
            (2.5e-7, "2.500e-7"),
            (9999.4, "9999"),
            (12345.6, "1.235e4"),
        ];
        for (value, text) in cases {
            assert_eq!(format_four_digits(value), text);
        }
        assert_eq!(format_four_digits(f64::NAN), "NaN");
    }

    /// Protects: numbers of any size are rounded to three significant digits.
    #[test]
    fn numbers_are_rounded_to_three_digits() {
        let cases = [
            (0.0, "0.00"),
            (0.001_234, "0.00123"),
            (1.2345, "1.23"),
            (12.345, "12.3"),
            (123.45, "123"),
            (12_345.0, "12300"),
        ];
        for (x, text) in cases {
            assert_eq!(format_three_digits(x), text);
        }
        assert_eq!(format_three_digits(f64::NAN), "-");
    }

    /// Protects: durations have at most three digits, in the unit that fits.
    #[test]
    fn durations_are_short() {
        let cases = [
            (0.0354, "35 ms"),
            (0.9996, "1.00 s"),
            (1.239, "1.24 s"),
            (75.04, "75.0 s"),
            (725.0, "12 min 5 s"),
        ];
        for (seconds, text) in cases {
            assert_eq!(format_duration(seconds), text);
        }
        assert_eq!(format_duration(7500.0), "2 h 5 min");
    }

    /// Protects: times at an axis have units, from a tenth of a nanosecond to seconds.
    #[test]
    fn powers_of_ten_have_units() {
        assert_eq!(
            [-10, -9, -7, -6, -2, 0, 1].map(format_seconds),
            ["0.1 ns", "1 ns", "100 ns", "1 µs", "10 ms", "1 s", "10 s"]
        );
    }

    /// Protects: a mean square error whose estimate is below zero is shown as its upper bound, not
    /// as zero.
    #[test]
    fn an_error_of_zero_is_a_bound() {
        let value_of = |value: f64, low: f64, high: f64| {
            format_estimate(ErrorEstimate {
                value,
                low,
                high,
                carriers: 100.0,
            })
        };
        assert_eq!(value_of(0.05, 0.01, 0.0712), "0.05 (0.01 to 0.0712)");
        assert_eq!(value_of(0.0, 0.0, 0.0712), "at most 0.0712");
        assert_eq!(value_of(0.0, 0.0, 0.0), "0 (0 to 0)");
        // An interval of twenty powers of ten says nothing.
        assert_eq!(value_of(2.6e-4, 7e-11, 1e9), "not known");
        assert_eq!(value_of(0.0, 0.0, f64::INFINITY), "not known");
    }
}
