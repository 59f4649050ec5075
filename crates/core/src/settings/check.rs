//! Validation of settings before preparation.

use super::{Crop, Sampling, Settings};

/// Error: a setting is out of range.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SettingsError {
    /// Width or height of the picture is zero or too large.
    #[error("the size {} x {} pixels is out of range: width and height must be 1 to {} pixels", .0[0], .0[1], Settings::MOST_EDGE)]
    Size([u32; 2]),
    /// The crop is empty or extends outside the picture.
    #[error("the crop of {} x {} pixels at column {}, row {} is empty or extends outside the picture of {} x {} pixels; choose a rectangle inside the picture", .crop.width, .crop.height, .crop.x, .crop.y, .size[0], .size[1])]
    Crop {
        /// The crop.
        crop: Crop,
        /// Size of the picture.
        size: [u32; 2],
    },
    /// The number of samples per pixel is zero or too large.
    #[error("{0} samples per pixel are out of range: the number must be 1 to {most}", most = Settings::MOST_SAMPLES)]
    Samples(u32),
    /// The greatest number of segments of a path is zero.
    #[error(
        "the greatest number of path segments is 0, but must be at least 1, because the camera ray is the first segment"
    )]
    Depth,
    /// A value that must be above zero is zero, negative, NaN or infinite.
    #[error("the setting `{name}` is {value}, but must be a finite number above 0")]
    Number {
        /// Name of the field.
        name: &'static str,
        /// Value of the field.
        value: f64,
    },
}

impl Settings {
    /// Checks that all settings are in range. Preparation makes this check first.
    ///
    /// # Errors
    /// The first setting that is out of range, as [`SettingsError`].
    pub fn check(&self) -> Result<(), SettingsError> {
        if !self
            .size
            .iter()
            .all(|edge| (1..=Self::MOST_EDGE).contains(edge))
        {
            return Err(SettingsError::Size(self.size));
        }
        let fits = |start: u32, extent: u32, whole: u32| {
            extent > 0 && start.checked_add(extent).is_some_and(|end| end <= whole)
        };
        if let Some(crop) = self.crop
            && !(fits(crop.x, crop.width, self.size[0]) && fits(crop.y, crop.height, self.size[1]))
        {
            return Err(SettingsError::Crop {
                crop,
                size: self.size,
            });
        }
        if let Sampling::General(count) = self.sampling
            && !(1..=Self::MOST_SAMPLES).contains(&count)
        {
            return Err(SettingsError::Samples(count));
        }
        if self.max_depth == 0 {
            return Err(SettingsError::Depth);
        }
        for (name, value) in [("clamp", self.clamp), ("max_error", self.max_error)] {
            if let Some(value) = value.filter(|value| !(value.is_finite() && *value > 0.0)) {
                return Err(SettingsError::Number { name, value });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    fn settings() -> Settings {
        let scene: Scene = serde_json::from_str(r#"{ "format": 1 }"#).expect("an empty scene");
        Settings {
            size: [8, 6],
            sampling: Sampling::General(16),
            ..Settings::from_scene(&scene)
        }
    }

    /// Protects: the least and the greatest value of each number pass, values beyond them are
    /// refused with the name of their field, and no sum overflows.
    #[test]
    fn limits_are_kept() {
        type E = SettingsError;
        let (right, maximum) = (settings(), Settings::MOST_EDGE);
        let crop = |x, y, width, height| Settings {
            crop: Some(Crop {
                x,
                y,
                width,
                height,
            }),
            ..settings()
        };
        let count = |count| Settings {
            sampling: Sampling::General(count),
            ..settings()
        };
        let depth = |max_depth| Settings {
            max_depth,
            ..settings()
        };
        let clamp = |value| Settings {
            clamp: Some(value),
            ..settings()
        };
        for good in [
            Settings {
                size: [1, maximum],
                ..settings()
            },
            crop(0, 0, 8, 6),
            crop(7, 5, 1, 1),
            count(1),
            count(65_536),
            depth(1),
            depth(Settings::UNLIMITED),
            clamp(1e-9),
        ] {
            assert_eq!(good.check(), Ok(()), "{good:?}");
        }
        let wrong_crop = |crop: Crop| E::Crop {
            crop,
            size: right.size,
        };
        for (bad, error) in [
            (
                Settings {
                    size: [0, 6],
                    ..settings()
                },
                E::Size([0, 6]),
            ),
            (
                Settings {
                    size: [6, maximum + 1],
                    ..settings()
                },
                E::Size([6, maximum + 1]),
            ),
            (
                crop(0, 0, 9, 6),
                wrong_crop(Crop {
                    x: 0,
                    y: 0,
                    width: 9,
                    height: 6,
                }),
            ),
            (
                crop(0, 1, 8, 6),
                wrong_crop(Crop {
                    x: 0,
                    y: 1,
                    width: 8,
                    height: 6,
                }),
            ),
            (
                crop(2, 2, 0, 1),
                wrong_crop(Crop {
                    x: 2,
                    y: 2,
                    width: 0,
                    height: 1,
                }),
            ),
            (
                crop(u32::MAX, 0, 2, 1),
                wrong_crop(Crop {
                    x: u32::MAX,
                    y: 0,
                    width: 2,
                    height: 1,
                }),
            ),
            (count(0), E::Samples(0)),
            (count(65_537), E::Samples(65_537)),
            (depth(0), E::Depth),
            (
                clamp(0.0),
                E::Number {
                    name: "clamp",
                    value: 0.0,
                },
            ),
            (
                clamp(f64::INFINITY),
                E::Number {
                    name: "clamp",
                    value: f64::INFINITY,
                },
            ),
            (
                Settings {
                    max_error: Some(-1.0),
                    ..settings()
                },
                E::Number {
                    name: "max_error",
                    value: -1.0,
                },
            ),
        ] {
            assert_eq!(bad.check(), Err(error), "{bad:?}");
            assert!(error.to_string().len() > 30, "{error}");
        }
    }
}
