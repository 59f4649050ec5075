//! What the numbers of a float picture are as light, and how many of them can't be light.

/// What stands for an infinite number: the largest one of the half floats that most such pictures
/// overflow.
const INFINITE: f32 = 65504.0;
/// Greatest number that is read: sums over a picture must fit single precision.
const GREATEST: f32 = 1e30;

/// Numbers that light can't have, counted over a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Unusable {
    infinite: u64,
    too_great: u64,
    undefined: u64,
    negative: u64,
}

impl Unusable {
    /// The nearest value that light can have.
    pub fn mend(&mut self, value: f32) -> f32 {
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

    /// How many were infinite or no numbers. Negative ones are rounding, mostly, and of those too
    /// great nothing is lost that would be seen.
    pub fn count(&self) -> u64 {
        self.infinite + self.undefined
    }

    /// What was mended, for a warning; none: nothing.
    pub fn remark(&self) -> Option<String> {
        let kinds = [
            (self.infinite, format!("infinite ({INFINITE} was taken)")),
            (
                self.too_great,
                format!("above {GREATEST:e} (that was taken)"),
            ),
            (self.undefined, "no numbers (0 was taken)".to_owned()),
            (self.negative, "negative (0 was taken)".to_owned()),
        ];
        let found: Vec<String> = kinds
            .into_iter()
            .filter(|(count, _)| *count > 0)
            .map(|(count, what)| format!("{count} {what}"))
            .collect();
        (!found.is_empty()).then(|| {
            format!(
                "has channels of pixels that light can't have: {}",
                found.join(", ")
            )
        })
    }
}
