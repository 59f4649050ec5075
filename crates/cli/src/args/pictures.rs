//! Requested pictures: limits of samples, views, times and shares.

use raywright_core::Settings;
use raywright_core::framing::View;

/// Largest number of samples per pixel.
pub const MOST_SAMPLES: u32 = Settings::MOST_SAMPLES;

/// Scale of radiance before display.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Exposure {
    /// A number of stops.
    Stops(f64),
    /// The exposure that suits the picture.
    Auto,
}

/// Value of pixels whose rays hit nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BackgroundChoice {
    /// The sky, or a studio's backdrop.
    Environment,
    /// No background: coverage is kept.
    Transparent,
    /// A colour by its sRGB-encoded values in 0..1, which are the values of its codes.
    Colour([f64; 3]),
}

/// Views with their names.
#[derive(Clone, Debug, PartialEq)]
pub struct Views(pub Vec<(String, View)>);

/// Times of a film, in seconds: from `from` up to `to` at a rate per second. An infinite `to`
/// stands for the end of the animation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frames {
    /// First time.
    pub from: f64,
    /// End of the times, exclusive.
    pub to: f64,
    /// Pictures per second.
    pub rate: f64,
}

impl Frames {
    /// Largest number of times.
    pub const MOST: f64 = 1e5;

    /// All times in order.
    pub fn times(self) -> impl Iterator<Item = f64> {
        let count = ((self.to - self.from) * self.rate - 1e-9).ceil().max(1.0) as u32;
        (0..count).map(move |i| self.from + f64::from(i) / self.rate)
    }
}

/// Address of tev.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TevAddress {
    /// Host name or address.
    pub host: String,
    /// Port.
    pub port: u16,
}

impl TevAddress {
    /// Default port of tev.
    pub const PORT: u16 = 14158;
}

/// One of several shares of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PictureShare {
    /// Number of the share, counted from one.
    pub number: u32,
    /// Number of shares.
    pub of: u32,
}
