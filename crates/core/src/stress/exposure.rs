//! Pictures whose exposure shows nearly every pixel as black or as white.

use super::facts::SceneFacts;
use super::finding::{FindingCode, Severity, StressFinding};
use super::small_render::{SmallRender, camera_subject};
use crate::display::Display;

/// Share of the pixels from which on a picture counts as black or white.
const NEARLY_ALL: f64 = 0.999;
/// Stops of a lower exposure with which a picture is judged. A white one stays white: a sky of
/// radiance 1 is just white, and meant to be. Of a black one nothing is left: codes up to 2 look
/// black.
const LOWER: f64 = 1.0;
const MUCH_LOWER: f64 = 2.0;

/// Returns a finding if the scene's exposure shows nearly the whole picture as white, or as black
/// although it is lit.
pub(super) fn exposure_finding(
    scene_facts: &SceneFacts<'_>,
    small: &SmallRender,
) -> Option<StressFinding> {
    if small.counters.hits == 0 || small.run.is_cut_short() || small.is_black() {
        return None;
    }
    let (display, picture) = (
        Display::from_render(&scene_facts.scene.render),
        &small.picture,
    );
    let own = display.exposure_stops;
    let clipping = |stops: f64| {
        let display = Display {
            exposure_stops: own + stops,
            ..display
        };
        display.estimate_clipping(picture)
    };
    let is_unlit = |pixel: &&[f32; 3]| pixel.iter().all(|&channel| channel <= 0.0);
    let unlit = picture.rgb.iter().filter(is_unlit).count() as f64 / picture.rgb.len() as f64;
    let black = clipping(-MUCH_LOWER).black;
    let shown = if clipping(-LOWER).clipped >= NEARLY_ALL {
        "white"
    } else if black > 0.0 && black + unlit >= NEARLY_ALL && unlit < NEARLY_ALL {
        "black"
    } else {
        return None;
    };
    let reason = format!(
        "with an `exposure` of {own} stops, the picture is shown as {shown} nearly everywhere"
    );
    let remedy = match display.find_unclipped_exposure(picture) {
        Some(stops) => format!(
            "set `render.exposure` to {stops}, render with --exposure {stops}, or change the brightness of the lights"
        ),
        None => "change the brightness of the lights by a factor of some thousands, or `render.exposure`".to_owned(),
    };
    let subject = camera_subject(scene_facts, small);
    let (code, severity) = (FindingCode::BadExposure, Severity::PictureWrong);
    Some(StressFinding::new(code, severity, subject, reason, remedy))
}
