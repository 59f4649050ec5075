//! Display settings of a picture: those of the scene or the file, as changed by the flags.

use raywright_core::display::Display;
use raywright_core::picture::Picture;

use crate::args::{DisplayArgs, ExposureChoice};

/// Returns the display settings of a scene or a file, as changed by the flags.
pub fn apply_display_flags(requested: &DisplayArgs, display: Display) -> Display {
    Display {
        tone_map: requested.tonemap.unwrap_or(display.tone_map),
        curve: requested.gamma.unwrap_or(display.curve),
        exposure_stops: match requested.exposure {
            Some(ExposureChoice::Stops(stops)) => stops,
            Some(ExposureChoice::Auto) | None => display.exposure_stops,
        },
        ..display
    }
}

/// Returns the display settings as changed by the flags. With `--exposure auto` the exposure is
/// chosen from the picture.
pub fn apply_display_and_exposure(
    requested: &DisplayArgs,
    own_display: Display,
    picture: &Picture,
) -> Display {
    let display = apply_display_flags(requested, own_display);
    match requested.exposure {
        Some(ExposureChoice::Auto) => display.with_unclipped_exposure(picture),
        Some(ExposureChoice::Stops(_)) | None => display,
    }
}
