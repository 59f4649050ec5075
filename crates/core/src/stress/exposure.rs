//! Pictures whose exposure shows nearly every surface as white, or nearly every pixel as black.

use super::facts::SceneFacts;
use super::finding::{FindingCode, Severity, StressFinding};
use super::numbers::format_decimal;
use super::small_render::{SmallRender, camera_subject};
use crate::display::Display;

/// Share of the surfaces that count as white, and share of the pixels that count as black.
const WHITE_SHARE: f64 = 0.9;
const BLACK_SHARE: f64 = 0.999;
/// Surfaces are white if they stay white with an exposure that is so many stops lower: a wall of
/// radiance 1 is just white, and meant to be.
const LOWER: f64 = 1.0;
/// Greatest 8-bit code that looks black.
const DARK: u8 = 10;
/// Share of the picture that surfaces without light of their own must cover to be judged alone.
const SURFACES: f64 = 0.01;
/// Radiance that looks medium grey with an exposure of 0.
const GREY: f64 = 0.18;
/// Greatest exposure that a scene may set, in stops.
const MOST_STOPS: f64 = 64.0;

/// Returns a finding if the scene's exposure shows nearly all surfaces as white, or nearly the
/// whole picture as black although it is lit.
pub(super) fn exposure_finding(
    scene_facts: &SceneFacts<'_>,
    small: &SmallRender,
) -> Option<StressFinding> {
    if small.counters.hits == 0 || small.run.is_cut_short() || small.is_black() {
        return None;
    }
    let display = Display::from_render(&scene_facts.scene.render);
    let own = display.exposure_stops;
    let judged = judged_colours(scene_facts, small);
    let is_lit = |pixel: &[f32; 3]| pixel.iter().any(|&channel| channel > 0.0);
    let all = &small.picture.rgb;
    let lit: Vec<[f32; 3]> = all.iter().copied().filter(is_lit).collect();
    let of_white = if is_white(display, &judged) {
        true
    } else if is_black(display, &lit, all.len()) {
        false
    } else {
        return None;
    };
    let (shown, colours) = match of_white {
        true => ("nearly all surfaces in view are shown as white", judged),
        false => ("nearly the whole picture is shown as black", lit),
    };
    let reason = format!("with an `exposure` of {own} stops, {shown}");
    let subject = camera_subject(scene_facts, small);
    let remedy = exposure_remedy(own, of_white, median_radiance(colours));
    let (code, severity) = (FindingCode::BadExposure, Severity::PictureWrong);
    Some(StressFinding::new(code, severity, subject, reason, remedy))
}

/// Returns the colours of the surfaces that emit no light, or of the whole picture if hardly any
/// such surface is in view.
fn judged_colours(scene_facts: &SceneFacts<'_>, small: &SmallRender) -> Vec<[f32; 3]> {
    let is_dull = |object: u32| {
        let object = scene_facts.facts_index(object);
        !scene_facts.objects[object].emits_light()
    };
    let surfaces: Vec<[f32; 3]> = small.surface_pixels(is_dull).collect();
    let all = &small.picture.rgb;
    match surfaces.len() as f64 >= SURFACES * all.len() as f64 {
        true => surfaces,
        false => all.clone(),
    }
}

fn is_white(display: Display, judged: &[[f32; 3]]) -> bool {
    let lower = Display {
        exposure_stops: display.exposure_stops - LOWER,
        ..display
    };
    lower.clipping_of_colours(judged).clipped >= WHITE_SHARE
}

/// Returns whether a picture of `all` pixels is black, given the colours of its lit pixels.
fn is_black(display: Display, lit: &[[f32; 3]], all: usize) -> bool {
    let map = display.build_map();
    let shows = |&&colour: &&[f32; 3]| map.codes(colour).iter().any(|&code| code > DARK);
    let most = (1.0 - BLACK_SHARE) * all as f64;
    lit.len() as f64 > most && lit.iter().filter(shows).count() as f64 <= most
}

/// Returns the median of the colours' radiances, the means of three channels. `None` without a
/// finite one.
fn median_radiance(colours: Vec<[f32; 3]>) -> Option<f64> {
    let mean = |colour: [f32; 3]| colour.iter().map(|&c| f64::from(c)).sum::<f64>() / 3.0;
    let mut radiances: Vec<f64> = colours.into_iter().map(mean).collect();
    radiances.retain(|radiance| radiance.is_finite() && *radiance > 0.0);
    radiances.sort_unstable_by(f64::total_cmp);
    radiances.get(radiances.len() / 2).copied()
}

/// Returns the advice to show the median radiance as medium grey.
fn exposure_remedy(own: f64, is_white: bool, median: Option<f64>) -> String {
    let direction = if is_white { "darker" } else { "brighter" };
    let Some(median) = median else {
        return format!("make the lights {direction}");
    };
    let stops = libm::log2(GREY / median).round();
    let factor = libm::exp2((stops - own).abs());
    let step = libm::pow(10.0, libm::log10(factor).floor());
    let factor = format_decimal((factor / step).round() * step);
    let lights = format!("make the lights about {factor} times {direction}");
    if stops.abs() > MOST_STOPS {
        return lights;
    }
    format!("set `render.exposure` to {stops}, render with --exposure {stops}, or {lights}")
}
