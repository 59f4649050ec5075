//! Parsers of numbers and amounts: with a range, with a unit, or several separated by commas.

use std::str::FromStr;
use std::time::Duration;

use super::super::pictures::MOST_SAMPLES;

/// Parses a finite number.
pub fn parse_number(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        Ok(_) => Err("expected a finite number".to_owned()),
        Err(_) => Err("expected a number".to_owned()),
    }
}

/// Parses a finite number of at least zero.
pub fn parse_non_negative(text: &str) -> Result<f64, String> {
    match parse_number(text)? {
        value if value >= 0.0 => Ok(value),
        _ => Err("expected a number of at least 0".to_owned()),
    }
}

/// Parses a target for the root relMSE, from 1e-6 to 1, as a number or in percent.
pub fn parse_max_error(text: &str) -> Result<f64, String> {
    let percent = text.trim().strip_suffix('%');
    let value = percent.map_or_else(
        || parse_number(text),
        |percent| Ok(parse_number(percent)? / 100.0),
    )?;
    match (1e-6..=1.0).contains(&value) {
        true => Ok(value),
        false => Err(
            "expected a relative error (root relMSE) from 0.000001 to 1, such as 0.05 or 5%"
                .to_owned(),
        ),
    }
}

/// Parses the probability of a false alarm, from 1e-9 to 0.5.
pub fn parse_significance_level(text: &str) -> Result<f64, String> {
    match parse_number(text)? {
        value if (1e-9..=0.5).contains(&value) => Ok(value),
        _ => Err("expected a probability from 1e-9 to 0.5, such as 0.01".to_owned()),
    }
}

/// Parses a field of view in degrees, above 0 and below 180.
pub fn parse_field_of_view(text: &str) -> Result<f64, String> {
    match parse_number(text)? {
        value if value > 0.0 && value < 180.0 => Ok(value),
        _ => Err("expected an angle in degrees, above 0 and below 180, such as 40".to_owned()),
    }
}

/// Parses a zoom factor from 0.001 to 1000.
pub fn parse_zoom(text: &str) -> Result<f64, String> {
    match parse_number(text)? {
        value if (1e-3..=1e3).contains(&value) => Ok(value),
        _ => Err("expected a factor from 0.001 to 1000, such as 2".to_owned()),
    }
}

/// Parses the number of samples per pixel, from 1 to [`MOST_SAMPLES`].
pub fn parse_samples(text: &str) -> Result<u32, String> {
    let number = text
        .trim()
        .parse()
        .ok()
        .filter(|number| (1..=MOST_SAMPLES).contains(number));
    number.ok_or_else(|| {
        format!("expected a whole number of samples from 1 to {MOST_SAMPLES}, such as 64")
    })
}

/// Parses exactly `N` values separated by commas; returns `None` for any other text.
pub fn parse_list<T: FromStr, const N: usize>(text: &str) -> Option<[T; N]> {
    let parts: Vec<T> = text
        .split(',')
        .map(|part| part.trim().parse().ok())
        .collect::<Option<_>>()?;
    parts.try_into().ok()
}

/// Parses a point or direction, `x,y,z`, of finite numbers.
pub fn parse_triple(text: &str) -> Result<[f64; 3], String> {
    match parse_list::<f64, 3>(text) {
        Some(triple) if triple.iter().all(|v| v.is_finite()) => Ok(triple),
        _ => Err("expected three numbers x,y,z without spaces, such as 0,1.5,-2".to_owned()),
    }
}

/// Parses a value of a scene parameter, `NAME=VALUE`.
pub fn parse_assignment(text: &str) -> Result<(String, f64), String> {
    const EXPECTED: &str = "expected NAME=VALUE with a number, such as roughness=0.3";
    let (name, value) = text.split_once('=').ok_or(EXPECTED)?;
    match (name.trim(), parse_number(value)) {
        ("", _) | (_, Err(_)) => Err(EXPECTED.to_owned()),
        (name, Ok(value)) => Ok((name.to_owned(), value)),
    }
}

/// Parses a time from 1 second to 24 hours, as numbers with the units `s`, `min` or `h`, such as
/// `1h30min`; a number alone is in seconds.
pub fn parse_duration(text: &str) -> Result<Duration, String> {
    const EXPECTED: &str = "expected a time from 1s to 24h, such as 90s, 5min or 1h30min";
    let (mut rest, mut seconds, mut unit_before) = (text.trim(), 0.0, f64::INFINITY);
    while !rest.is_empty() {
        let (amount, tail) = rest.split_at(
            rest.find(|c: char| c.is_ascii_alphabetic())
                .unwrap_or(rest.len()),
        );
        let (unit, tail) = tail.split_at(
            tail.find(|c: char| !c.is_ascii_alphabetic())
                .unwrap_or(tail.len()),
        );
        let unit = match unit {
            // After hours, a number without a unit could mean minutes or seconds.
            "" if unit_before < f64::INFINITY => return Err(EXPECTED.to_owned()),
            "" | "s" => 1.0,
            "min" | "m" => 60.0,
            "h" => 3600.0,
            _ => return Err(EXPECTED.to_owned()),
        };
        match parse_number(amount) {
            Ok(amount) if amount >= 0.0 && unit < unit_before => seconds += amount * unit,
            _ => return Err(EXPECTED.to_owned()),
        }
        (rest, unit_before) = (tail.trim_start(), unit);
    }
    if (1.0..=86_400.0).contains(&seconds) {
        Ok(Duration::from_secs_f64(seconds))
    } else {
        Err(EXPECTED.to_owned())
    }
}

/// Parses an amount of memory in bytes, with an optional suffix K, M, G or T (powers of 1024).
pub fn parse_bytes(text: &str) -> Result<u64, String> {
    const EXPECTED: &str = "expected a number of bytes, such as 800000000, 512M or 2G";
    let digits = text.trim_end_matches(|c: char| c.is_ascii_alphabetic());
    let power = match text[digits.len()..].to_ascii_uppercase().as_str() {
        "" | "B" => 0,
        "K" | "KB" | "KIB" => 1,
        "M" | "MB" | "MIB" => 2,
        "G" | "GB" | "GIB" => 3,
        "T" | "TB" | "TIB" => 4,
        _ => return Err(EXPECTED.to_owned()),
    };
    let amount: u64 = digits.parse().map_err(|_| EXPECTED)?;
    match amount.checked_mul(1 << (10 * power)) {
        Some(0) | None => Err(EXPECTED.to_owned()),
        Some(bytes) => Ok(bytes),
    }
}
