//! Checks of single values: numbers, lengths, points, directions and colours.

use super::{MAX_LIGHT_INTENSITY, MAX_MAGNITUDE, SceneCheck};
use crate::scene::{Colour, Triple};
use crate::validate::{MAX_COORDINATE, MIN_LENGTH};

/// Shortest direction. The squared length of a shorter direction does not fit an `f64`.
const SHORTEST_DIRECTION: f64 = 1e-100;
/// Longest direction. The squared length of a longer direction does not fit an `f64`.
const LONGEST_DIRECTION: f64 = 1e100;

impl SceneCheck<'_> {
    /// Checks a number against a range, both ends included.
    pub fn require_within(&mut self, key: &str, value: f64, minimum: f64, greatest: f64) {
        if !(minimum..=greatest).contains(&value) {
            self.report_value(
                key,
                format_args!("must be from {minimum} to {greatest}, not {value}"),
            );
        }
    }

    /// Checks a number that must be zero or within a range, both ends included.
    pub fn require_zero_or_within(&mut self, key: &str, value: f64, minimum: f64, greatest: f64) {
        if value != 0.0 && !(minimum..=greatest).contains(&value) {
            self.report_value(
                key,
                format_args!("must be 0, or from {minimum} to {greatest}, not {value}"),
            );
        }
    }

    /// Checks a number against a range, both ends excluded.
    pub fn require_between(&mut self, key: &str, value: f64, low: f64, high: f64) {
        if !(value > low && value < high) {
            self.report_value(
                key,
                format_args!("must be above {low} and below {high}, not {value}"),
            );
        }
    }

    /// Checks a whole number against a range, both ends included.
    pub fn require_count_within(&mut self, key: &str, value: u32, minimum: u32, greatest: u32) {
        self.require_within(
            key,
            f64::from(value),
            f64::from(minimum),
            f64::from(greatest),
        );
    }

    /// Checks that a number is finite and not too large.
    pub fn require_finite(&mut self, key: &str, value: f64) {
        if !value.is_finite() {
            self.report_value(key, format_args!("must be a finite number, not {value}"));
        } else if value.abs() > MAX_MAGNITUDE {
            self.report_value(
                key,
                format_args!(
                    "must be from {:e} to {MAX_MAGNITUDE:e}, not {value:e}",
                    -MAX_MAGNITUDE
                ),
            );
        }
    }

    /// Checks that a factor is not negative.
    pub fn require_not_negative(&mut self, key: &str, value: f64) {
        if value < 0.0 {
            self.report_value(key, format_args!("must not be negative, but is {value}"));
        } else {
            self.require_finite(key, value);
        }
    }

    /// Checks that a length is above zero and within the supported range.
    pub fn require_length(&mut self, key: &str, value: f64) {
        if value <= 0.0 {
            self.report_value(key, format_args!("must be above zero, not {value}"));
        } else if !(MIN_LENGTH..=MAX_COORDINATE).contains(&value) {
            self.report_value(
                key,
                format_args!("must be from {MIN_LENGTH:e} to {MAX_COORDINATE:e}, not {value:e}"),
            );
        }
    }

    /// Checks a length that may be absent.
    pub fn require_optional_length(&mut self, key: &str, value: Option<f64>) {
        if let Some(value) = value {
            self.require_length(key, value);
        }
    }

    /// Checks that a point is finite and within [`MAX_COORDINATE`] of the origin on each axis.
    pub fn require_point(&mut self, key: &str, point: Triple) {
        if point.iter().any(|x| !x.is_finite()) {
            self.report_value(
                key,
                format_args!("must be three finite numbers, not {}", format_list(&point)),
            );
        } else if point.iter().any(|x| x.abs() > MAX_COORDINATE) {
            self.report_value(
                key,
                format_args!(
                    "must lie within {MAX_COORDINATE:e} world units of the origin on each axis"
                ),
            );
        }
    }

    /// Checks that a direction is finite and has a length above zero.
    pub fn require_direction(&mut self, key: &str, direction: Triple) {
        let longest = direction
            .iter()
            .fold(0.0_f64, |longest, x| longest.max(x.abs()));
        if direction.iter().any(|x| !x.is_finite()) {
            self.report_value(
                key,
                format_args!(
                    "must be three finite numbers, not {}",
                    format_list(&direction)
                ),
            );
        } else if longest == 0.0 {
            self.report_value(key, "has length zero, so it gives no direction");
        } else if !(SHORTEST_DIRECTION..=LONGEST_DIRECTION).contains(&longest) {
            self.report_value(
                key,
                format_args!(
                    "must have a length from {SHORTEST_DIRECTION:e} to {LONGEST_DIRECTION:e}"
                ),
            );
        }
    }

    /// Checks that a colour has no negative channel and none above [`MAX_MAGNITUDE`].
    pub fn require_not_negative_colour(&mut self, key: &str, colour: Colour) {
        self.require_colour_up_to(key, colour, MAX_MAGNITUDE);
    }

    /// Checks the intensity of a light with inverse-square falloff. It may be as large as
    /// [`MAX_LIGHT_INTENSITY`], because the falloff bounds the irradiance.
    pub fn require_intensity(&mut self, key: &str, colour: Colour) {
        self.require_colour_up_to(key, colour, MAX_LIGHT_INTENSITY);
    }

    /// Checks that a colour has no negative channel and none above a limit.
    fn require_colour_up_to(&mut self, key: &str, colour: Colour, greatest: f64) {
        if colour.0.iter().any(|x| *x < 0.0) {
            self.report_value(
                key,
                format_args!(
                    "must have no negative channel, but is {}",
                    format_list(&colour.0)
                ),
            );
        } else if colour.0.iter().any(|x| !x.is_finite()) {
            self.report_value(
                key,
                format_args!("must be finite, not {}", format_list(&colour.0)),
            );
        } else if colour.0.iter().any(|x| *x > greatest) {
            self.report_value(key, format_args!("must have no channel above {greatest:e}"));
        }
    }
}

/// Formats numbers as a list such as `[1, 2, 3]`; numbers with many zeros have exponents, as in
/// `[1e-30, 1, 1]`.
pub(crate) fn format_list(values: &[f64]) -> String {
    let plain = |x: f64| x == 0.0 || !x.is_finite() || (1e-6..1e6).contains(&x.abs());
    let number = |x: &f64| {
        if plain(*x) {
            x.to_string()
        } else {
            format!("{x:e}")
        }
    };
    let values: Vec<String> = values.iter().map(number).collect();
    format!("[{}]", values.join(", "))
}
