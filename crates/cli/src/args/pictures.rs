//! Which pictures are asked for: how many samples at most, which views, moments and shares.

use raywright_core::Settings;
use raywright_core::framing::View;

/// Samples a pixel that can be asked for.
pub const MOST_SAMPLES: u32 = Settings::MOST_SAMPLES;

/// How radiance is scaled before it is shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Exposure {
    /// By so many stops.
    Stops(f64),
    /// By what suits the picture.
    Auto,
}

/// What is seen where nothing is hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BackgroundChoice {
    /// The sky, or a studio's backdrop.
    Environment,
    /// Nothing: coverage is kept.
    Transparent,
    /// A colour, by its values in 0..1 as sRGB has them: those of its codes.
    Colour([f64; 3]),
}

/// Views with their names.
#[derive(Clone, Debug, PartialEq)]
pub struct Views(pub Vec<(String, View)>);

/// Moments of a film: from the first second up to the last, so many a second; up to infinity where
/// the animation says when it ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frames {
    /// The first moment.
    pub from: f64,
    /// Where the moments end.
    pub to: f64,
    /// How many a second.
    pub rate: f64,
}

impl Frames {
    /// Moments that can be asked for.
    pub const MOST: f64 = 1e5;

    /// Each moment.
    pub fn times(self) -> impl Iterator<Item = f64> {
        let count = ((self.to - self.from) * self.rate - 1e-9).ceil().max(1.0) as u32;
        (0..count).map(move |i| self.from + f64::from(i) / self.rate)
    }
}

/// Where tev listens.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TevAddress {
    /// A name or an address.
    pub host: String,
    /// Its port.
    pub port: u16,
}

impl TevAddress {
    /// The port on which tev listens unless it is told another one.
    pub const PORT: u16 = 14158;
}

/// One of several shares of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Share {
    /// Which, counted from one.
    pub number: u32,
    /// How many there are.
    pub of: u32,
}
