//! Repair of float pixels that are invalid as radiance, with counts of the replaced values.

/// Value that replaces infinity: the largest number of half precision. Most infinities in pictures
/// result from an overflow of half precision.
const INFINITE: f32 = 65504.0;
/// Largest accepted value. With this limit, the sum over all pixels fits single precision.
pub(super) const GREATEST: f32 = 1e30;

/// Numbers of channel values that are invalid as radiance: infinite, NaN, negative or too large.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct InvalidRadianceCounts {
    infinite: u64,
    too_great: u64,
    undefined: u64,
    negative: u64,
}

impl InvalidRadianceCounts {
    /// Returns `value` if it is valid as radiance, otherwise the nearest valid value (0 for NaN).
    /// Replaced values are counted.
    pub fn repair_channel_value(&mut self, value: f32) -> f32 {
        if (0.0..=GREATEST).contains(&value) {
            return value;
        }
        let (count, instead) = match value {
            _ if value.is_nan() => (&mut self.undefined, 0.0),
            _ if value < 0.0 => (&mut self.negative, 0.0),
            f32::INFINITY => (&mut self.infinite, INFINITE),
            _ => (&mut self.too_great, GREATEST),
        };
        *count += 1;
        instead
    }

    /// Returns the number of replaced infinite and NaN values. Negative and excessive values are
    /// not counted: most negative values are rounding errors, and clamping excessive values changes
    /// nothing visible.
    pub fn repaired_count(&self) -> u64 {
        self.infinite + self.undefined
    }

    /// Returns a summary of the replaced values for a warning; `None` if no value was replaced.
    pub fn summary(&self) -> Option<String> {
        let kinds = [
            (self.infinite, format!("infinite (replaced by {INFINITE})")),
            (
                self.too_great,
                format!("above {GREATEST:e} (replaced by this value)"),
            ),
            (self.undefined, "NaN (replaced by 0)".to_owned()),
            (self.negative, "negative (replaced by 0)".to_owned()),
        ];
        let found: Vec<String> = kinds
            .into_iter()
            .filter(|(count, _)| *count > 0)
            .map(|(count, label)| format!("{count} {label}"))
            .collect();
        (!found.is_empty()).then(|| {
            format!(
                "has pixel values that are invalid as radiance: {}",
                found.join(", ")
            )
        })
    }
}
