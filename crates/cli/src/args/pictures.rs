//! Values of flags that select the pictures of a run: samples per pixel, exposure, views, times of
//! an animation, and shares of a picture that separate runs render.

use raywright_core::Settings;
use raywright_core::framing::ViewAngles;

/// Largest number of samples per pixel.
pub const MOST_SAMPLES: u32 = Settings::MOST_SAMPLES;

/// Exposure, the scale of radiance before display, from `--exposure`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ExposureChoice {
    /// A number of stops: 1 doubles the radiance.
    Stops(f64),
    /// Automatic: a whole number of stops, chosen from the rendered picture.
    Auto,
}

/// Value of pixels whose rays hit nothing, from `--background`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BackgroundChoice {
    /// The radiance of the sky, or of a studio's backdrop.
    Environment,
    /// None: the pixels keep their coverage as alpha.
    Transparent,
    /// A colour, given by sRGB-encoded red, green and blue, each from 0 to 1: its 8-bit code
    /// divided by 255.
    Colour([f64; 3]),
}

/// Views of `--views` with their names, in the order of the flag.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedViews(pub Vec<(String, ViewAngles)>);

/// Times of the pictures of `--frames`, in seconds: from `from` up to, but not at, `to`. An
/// infinite `to` stands for the end of the animation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameTimes {
    /// First time, in seconds.
    pub from: f64,
    /// End of the times in seconds; no picture has this time itself.
    pub to: f64,
    /// Pictures per second.
    pub rate: f64,
}

impl FrameTimes {
    /// Largest number of times, and therefore of pictures, that `--frames` may request.
    pub const MOST_TIMES: f64 = 1e5;

    /// Returns the times of all pictures in seconds, in ascending order; at least one time.
    pub fn picture_times(self) -> impl Iterator<Item = f64> {
        let count = ((self.to - self.from) * self.rate - 1e-9).ceil().max(1.0) as u32;
        (0..count).map(move |i| self.from + f64::from(i) / self.rate)
    }
}

/// Network address of tev, an image viewer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TevAddress {
    /// Host name or IP address.
    pub host: String,
    /// TCP port.
    pub port: u16,
}

impl TevAddress {
    /// Default TCP port of tev.
    pub const PORT: u16 = 14158;
}

/// A share of a picture, from `--part K/N`: the samples that one of several runs renders.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PictureShare {
    /// Number of this share of the picture, counted from one.
    pub number: u32,
    /// Number of shares of the picture.
    pub of: u32,
}
