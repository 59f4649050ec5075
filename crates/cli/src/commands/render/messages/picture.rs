//! Messages about a rendered picture: lost samples, exposure, lights that no path reached, and with
//! `-v` times and counts.

use raywright_core::counters::{Counters, SampleLoss};
use raywright_core::display::exposure::{Clipping, MOST_CLIPPED};
use raywright_core::film::Film;
use raywright_core::prepare::UnreachedLight;
use raywright_core::{ReadyScene, RenderOutput};
use raywright_io::report::{format_duration, format_memory_parts, format_significant_digits};
use raywright_io::{LoadedScene, Warning, WarningCode};

use super::names::{light_name, object_name};
use crate::args::ExposureChoice;
use crate::clock::StageSeconds;
use crate::notes::Notes;
use crate::origin;
use crate::plan::{ChosenExposure, PicturePlan};
use crate::table::format_rows;
use crate::targets::OutputTarget;

/// Warns of samples and rays that the picture lacks, and returns the warnings for the statistics.
pub fn note_lost_samples(counters: &Counters, notes: &mut Notes) -> Vec<Warning> {
    let message = |loss| match loss {
        SampleLoss::NotFinite { dropped, of: total } => format!(
            "{dropped} of {total} samples ({} %) were not finite and were dropped, so that their pixels are wrong; look for numbers \
             that are too large or not defined in materials, lights and sky, or add --precision reference",
            format_significant_digits(100.0 * dropped as f64 / total as f64, 2)
        ),
        SampleLoss::CutShort {
            rays,
            most: maximum,
        } => format!(
            "{rays} rays were ended after {maximum} surfaces that are cut out or partly transparent, so that objects \
             behind these surfaces are missing; place fewer such surfaces one behind the other"
        ),
    };
    let warnings: Vec<Warning> = counters
        .sample_losses()
        .map(|loss| Warning {
            code: WarningCode::Samples,
            message: message(loss),
        })
        .collect();
    warnings
        .iter()
        .for_each(|warning| notes.add_warning(&warning.message));
    warnings
}

/// Adds a note about an exposure that a model's own lights call for.
pub fn note_chosen_exposure(chosen: ChosenExposure, notes: &mut Notes) {
    if let Some(stops) = chosen.display.filter(|_| chosen.lights != 0.0) {
        let level = if chosen.lights < 0.0 { "bright" } else { "dim" };
        notes.add_note(format!(
            "the lights are too {level} for the display: exposure {stops} stops; --exposure 0 shows their numbers unchanged"
        ));
    }
}

/// Adds a note about small parts so far away that the view leaves them out.
pub fn note_stray_parts(plan: &PicturePlan, notes: &mut Notes) {
    if plan.has_stray_parts {
        notes.add_note(
            "the view leaves out small parts that lie hundreds of sizes away from the rest; delete them, or set a view with --eye and --target",
        );
    }
}

/// Adds a note about the lamp at a camera that surfaces enclose.
pub fn note_headlight(ready: &ReadyScene, notes: &mut Notes) {
    if ready.has_headlight() {
        notes.add_note(
            "surfaces enclose the camera and keep the studio's light out: a lamp at the camera lights them",
        );
    }
}

/// Recommends an exposure in whole stops if more than a tenth of the pixels of a display picture
/// are clipped, or are black although they have radiance. More than a fifth of clipped pixels, and a
/// picture that no exposure makes visible, give a warning in place of a note.
pub fn note_exposure(
    rendered: &RenderOutput,
    plan: &PicturePlan,
    targets: &[OutputTarget],
    notes: &mut Notes,
) {
    const BAD: f64 = 0.2;
    const BLACK: f64 = 0.999;
    if plan.requested_exposure == Some(ExposureChoice::Auto)
        || (!targets.is_empty() && targets.iter().all(OutputTarget::has_layers))
    {
        return;
    }
    let Clipping {
        clipped,
        black,
        dark,
    } = plan.display.estimate_clipping(rendered.final_picture());
    if dark > BLACK && black <= MOST_CLIPPED && rendered.counters.hits > 0 {
        return notes.add_warning(
            "the picture is nearly black, because hardly any light reaches the surfaces in view; light them with --studio or --env default, or move the camera with --eye and --target",
        );
    }
    let (label, share) = if clipped > MOST_CLIPPED {
        ("clipped", clipped)
    } else {
        ("black", black)
    };
    if share <= MOST_CLIPPED {
        return;
    }
    let advice = match plan
        .display
        .find_unclipped_exposure(rendered.final_picture())
    {
        Some(stops) => format!("try --exposure {stops}, or --exposure auto"),
        None if clipped > BAD => {
            "even 12 stops darker, too many pixels stay clipped; dim the lights".to_owned()
        }
        None => return,
    };
    let message = format!("{:.0} % of the pixels are {label}; {advice}", 100.0 * share);
    if clipped > BAD {
        notes.add_warning(message)
    } else {
        notes.add_hint(message)
    }
}

/// Adds a note about lights that no path reached. This is no warning, because a lamp in a closed
/// box may be intended.
pub fn note_unreached_lights(
    loaded: &LoadedScene,
    ready: &ReadyScene,
    film: &Film,
    notes: &mut Notes,
) {
    let unreached_lights = ready.find_unreached_lights(film);
    let light = |one_unreached_light: &UnreachedLight| match *one_unreached_light {
        UnreachedLight::Light { index, .. } => light_name(loaded, index),
        UnreachedLight::Object { index, .. } => object_name(loaded, index),
    };
    let rays: u64 = unreached_lights
        .iter()
        .map(|&(UnreachedLight::Light { rays, .. } | UnreachedLight::Object { rays, .. })| rays)
        .sum();
    let stopped = format!(
        "all {rays} rays to surfaces were blocked; if this is not intended, move the light out of the object that encloses it"
    );
    match unreached_lights.as_slice() {
        [] => {}
        [unreached_light] => notes.add_hint(format!(
            "nothing is lit by {}: {stopped}",
            light(unreached_light)
        )),
        [first, .., last] => {
            let others = if unreached_lights.len() > 2 {
                format!(", {} more", unreached_lights.len() - 2)
            } else {
                String::new()
            };
            notes.add_hint(format!(
                "nothing is lit by {}{others} and {}: {stopped}",
                light(first),
                light(last)
            ));
        }
    }
}

/// Formats times, ray counts, memory and method of a render, for verbose runs.
pub fn format_details(
    ready: &ReadyScene,
    rendered: &RenderOutput,
    seconds: &StageSeconds,
) -> String {
    let rays = &rendered.counters;
    let stages = [
        ("load", seconds.load),
        ("prepare", seconds.prepare),
        ("render", seconds.render),
        ("write", seconds.write),
    ];
    let kinds = [
        ("camera", rays.camera),
        ("reflection", rays.reflection),
        ("refraction", rays.refraction),
        ("scatter", rays.scatter),
        ("shadow", rays.shadow),
    ];
    let settings = ready.settings();
    let rows = [
        (
            "time",
            stages
                .map(|(name, seconds)| format!("{name} {}", format_duration(seconds)))
                .join(", "),
        ),
        (
            "rays",
            kinds
                .iter()
                .filter(|(_, n)| *n > 0)
                .map(|(name, n)| format!("{n} {name}"))
                .collect::<Vec<_>>()
                .join(", "),
        ),
        (
            "memory",
            format_memory_parts(&ready.memory().bytes_by_purpose()),
        ),
        (
            "method",
            format!(
                "{} primitives, {}, {} precision{}",
                ready.table_sizes().primitives,
                origin::accelerator_name(settings.accelerator),
                origin::precision_name(settings.precision),
                match ready.table_sizes().openings {
                    0 => String::new(),
                    cells => format!(", sky through openings from {cells} cells"),
                }
            ),
        ),
    ];
    format_rows(rows)
}
