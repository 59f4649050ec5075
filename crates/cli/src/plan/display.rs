//! Display settings of a picture: those of the scene or the file, as changed by the flags.

use raywright_core::display::Display;
use raywright_core::display::exposure::exposure_of_brightest_tenth;
use raywright_core::picture::Picture;
use raywright_core::{Observer, ReadyScene};
use raywright_io::LoadedScene;

use crate::args::{DisplayArgs, ExposureChoice};

/// Exposures of a picture, chosen before its render from a small picture of the whole view. They do
/// not depend on crop, part, samples and seed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ChosenExposure {
    /// Exposure of the display in stops; `None`: as planned.
    pub display: Option<f64>,
    /// Exposure in stops for which a model's own lights call; 0 where the model states no lights.
    pub lights: f64,
}

/// Chooses the exposure of a prepared scene: for a model with lights of its own, or with a lamp at an
/// enclosed camera, that which shows its objects, unless another is requested; with `auto` one that
/// clips few pixels of objects.
pub fn choose_exposure(
    loaded: &LoadedScene,
    ready: &ReadyScene,
    (display, requested): (Display, Option<ExposureChoice>),
    observer: &dyn Observer,
) -> ChosenExposure {
    let is_model = loaded.source.format.is_model();
    let has_own_lights = is_model && (!loaded.scene.lights.is_empty() || ready.has_headlight());
    let is_auto = requested == Some(ExposureChoice::Auto);
    if !has_own_lights && !is_auto {
        return ChosenExposure::default();
    }
    let colours = ready.survey_lit_objects(observer);
    let own = Display::from_render(&loaded.scene.render);
    // Walls that enclose a lamp send its light to and fro: the exposure is for what is seen, a stop
    // below white, whatever the lamp's strength.
    let lights = if ready.has_headlight() {
        exposure_of_brightest_tenth(&colours).map(|stops| stops - 1.0)
    } else {
        own.find_exposure_of_objects(&colours)
    };
    let lights = lights.filter(|_| has_own_lights);
    let exposed = Display {
        exposure_stops: lights.unwrap_or(display.exposure_stops),
        ..display
    };
    let unclipped = exposed.unclipped_exposure_of(&colours).filter(|_| is_auto);
    ChosenExposure {
        display: unclipped
            .or(lights)
            .filter(|_| requested.is_none() || is_auto),
        lights: lights.unwrap_or(0.0),
    }
}

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
    let better = display
        .find_unclipped_exposure(picture)
        .filter(|_| requested.exposure == Some(ExposureChoice::Auto));
    Display {
        exposure_stops: better.unwrap_or(display.exposure_stops),
        ..display
    }
}

#[cfg(test)]
mod tests;
