//! Numbers in the words of findings.

/// Returns a count with its unit. `unit` is the plural; for 1 the singular is written.
pub fn count_with_unit(count: u64, unit: &str) -> String {
    let unit = match count {
        1 if unit == "copies" => "copy",
        1 if unit == "glass bodies" => "glass body",
        1 => unit.strip_suffix('s').unwrap_or(unit),
        _ => unit,
    };
    format!("{count} {unit}")
}

/// Returns a number with four digits. Very small and very large numbers have a power of ten.
pub fn format_decimal(x: f64) -> String {
    let size = x.abs();
    if x == 0.0 {
        return "0".to_owned();
    }
    if !(1e-3..1e6).contains(&size) {
        let short = format!("{x:.3e}");
        let (digits, power) = short.split_once('e').unwrap_or((&short, "0"));
        return format!("{}e{power}", trim_zeros(digits));
    }
    let places = (3.0 - size.log10().floor()).max(0.0) as usize;
    trim_zeros(&format!("{x:.places$}")).to_owned()
}

/// Returns a length in metres with its unit.
pub(super) fn format_metres(x: f64) -> String {
    append_metre_unit(&format_decimal(x))
}

/// Appends the unit metre to a formatted number.
pub(super) fn append_metre_unit(digits: &str) -> String {
    match digits {
        "1" => "1 metre".to_owned(),
        _ => format!("{digits} metres"),
    }
}

fn trim_zeros(digits: &str) -> &str {
    if digits.contains('.') {
        digits.trim_end_matches('0').trim_end_matches('.')
    } else {
        digits
    }
}

/// Returns a number with one digit, rounded up, as a lower limit in messages.
pub(super) fn format_rounded_up(x: f64) -> String {
    let step = libm::pow(10.0, x.log10().floor());
    format_decimal((x / step).ceil() * step)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: numbers have four digits without trailing zeros, and a power of ten if they are
    /// very small or large.
    #[test]
    fn numbers_are_short() {
        let of = [0.0, 2.0, 0.012345, -1234.56, 123456.7, 1e-8, 1.5e9].map(format_decimal);
        assert_eq!(
            of,
            ["0", "2", "0.01235", "-1235", "123457", "1e-8", "1.5e9"]
        );
        assert_eq!(
            [1.2e-6, 3.0, 171.0].map(format_rounded_up),
            ["2e-6", "3", "200"]
        );
        assert_eq!(
            [format_metres(1.0), format_metres(2.5)],
            ["1 metre", "2.5 metres"]
        );
        assert_eq!(
            [count_with_unit(1, "rays"), count_with_unit(2, "rays")],
            ["1 ray", "2 rays"]
        );
    }
}
