//! Messages of `render` about a scene and its picture: effects left out, objects lost, lights that
//! no path reaches, the error, and with `-v` times and counts.

use raywright_core::counters::{Counters, SampleLoss};
use raywright_core::denoise::FEWEST_SAMPLES;
use raywright_core::display::exposure::{Clipping, MOST_CLIPPED};
use raywright_core::effects::EffectReport;
use raywright_core::film::{Doubt, ErrorEstimate, Film, Uncertainty};
use raywright_core::prepare::{LampRef, LightLeak, UnreachedLight, UnresolvedGap};
use raywright_core::scene::Shape;
use raywright_core::settings::{PrecisionChoice, Settings};
use raywright_core::{ReadyScene, RenderOutput};
use raywright_io::{LoadedScene, Warning, WarningCode};

use crate::clock::{StageSeconds, format_duration};
use crate::commands::explain;
use crate::console::mask_to_one_line;
use crate::notes::Notes;
use crate::plan::PicturePlan;
use crate::table::{format_columns, format_significant_digits};
use crate::targets::OutputTarget;
use crate::{memory, origin};

/// Warns of the effects that are left out, and prints all effects in verbose runs.
pub(super) fn note_effects(loaded: &LoadedScene, report: &EffectReport, notes: &mut Notes) {
    notes.print_detail(explain::format_effects(&loaded.source, report, false));
    let names: Vec<&str> = report
        .left_out()
        .map(|finding| finding.effect.name())
        .collect();
    if !names.is_empty() {
        let name = &loaded.source.name;
        notes.add_warning(format!(
            "effects left out: {} (reasons and remedies: raywright explain {name})",
            names.join(", ")
        ));
    }
}

/// Warns of the bias that a clamp causes. The warning is added to the warnings of the statistics
/// too.
pub(super) fn note_clamp_bias(
    loaded: &mut LoadedScene,
    ready: &ReadyScene,
    settings: &Settings,
    notes: &mut Notes,
) {
    let Some(maximum) = settings.clamp else {
        return;
    };
    let message = if ready.is_path_traced() {
        format!(
            "samples brighter than {maximum} are dimmed to this radiance: pixels with such samples are too dark (bias)"
        )
    } else {
        "--clamp has no effect: it dims samples of path tracing, and this scene is rendered without path tracing".to_owned()
    };
    notes.add_warning(&message);
    loaded.warnings.push(Warning {
        code: WarningCode::Samples,
        message,
        triangles: 0,
    });
}

/// Warns of objects that vanish in the chosen precision, because the corners of their triangles
/// coincide.
pub(super) fn note_lost_objects(loaded: &LoadedScene, ready: &ReadyScene, notes: &mut Notes) {
    let [first, others @ ..] = ready.invisible_objects() else {
        return;
    };
    let object = object_name(loaded, *first as usize);
    let more = if others.is_empty() {
        String::new()
    } else {
        format!(" and {} more", others.len())
    };
    notes.add_warning(format!(
        "{object}{more} cannot be seen: so far from the origin, the corners of such small triangles coincide in single \
         precision; move the mesh nearer to the origin, or add --precision reference"
    ));
}

/// Warns of an object so far from all others that the chosen precision does not resolve its shape.
pub(super) fn note_unresolved_objects(loaded: &LoadedScene, ready: &ReadyScene, notes: &mut Notes) {
    let Some(first) = ready
        .first_unresolved_object()
        .filter(|first| !ready.invisible_objects().contains(first))
    else {
        return;
    };
    let object = object_name(loaded, first as usize);
    notes.add_warning(format!(
        "{object} is so far from the rest of the scene that single precision does not resolve a thousandth of its size; move the objects \
         nearer to each other, or add --precision reference"
    ));
}

/// Adds a note if `--wireframe` is given and the scene has shapes without edges, such as spheres.
pub(super) fn note_missing_edges(loaded: &LoadedScene, settings: &Settings, notes: &mut Notes) {
    let objects = loaded.scene.objects.iter().chain(
        loaded
            .scene
            .generators
            .iter()
            .map(|generator| &generator.object),
    );
    let (meshes, others): (Vec<_>, Vec<_>) =
        objects.partition(|object| matches!(object.shape, Shape::Mesh(_)));
    if !settings.wireframe || others.is_empty() {
        return;
    }
    let which = if meshes.is_empty() {
        "the scene has only shapes"
    } else {
        "the scene also has shapes"
    };
    notes.add_hint(format!(
        "--wireframe draws the edges of triangles, and {which} without edges, such as spheres"
    ));
}

/// Warns of pairs of transparent bodies so close together that light passes from one body into the
/// other without crossing the gap.
pub(super) fn note_closed_gaps(
    loaded: &mut LoadedScene,
    ready: &ReadyScene,
    settings: &Settings,
    notes: &mut Notes,
) {
    let gaps = ready.find_closed_gaps();
    let [
        UnresolvedGap {
            object,
            other,
            resolved_width: resolved,
        },
        others @ ..,
    ] = gaps.as_slice()
    else {
        return;
    };
    let [object, other] = [object, other].map(|&index| object_name(loaded, index));
    let more = if others.is_empty() {
        String::new()
    } else {
        format!(" (and {} more such pairs)", others.len())
    };
    let exact = if settings.precision == PrecisionChoice::Reference {
        ""
    } else {
        ", or add --precision reference"
    };
    let message = format!(
        "the gap between {object} and {other}{more} is closed: light passes from the first into the second without crossing the gap, since they touch or are \
         closer than rounding resolves; leave {} metres or more between them{exact}",
        format_significant_digits(*resolved, 2)
    );
    notes.add_warning(&message);
    loaded.warnings.push(Warning {
        code: WarningCode::Precision,
        message,
        triangles: 0,
    });
}

/// Warns of lights so close behind an opaque object that rounding lets their light leak through the
/// object.
pub(super) fn note_light_leaks(
    loaded: &mut LoadedScene,
    ready: &ReadyScene,
    settings: &Settings,
    notes: &mut Notes,
) {
    let leaks = ready.find_light_leaks();
    let [
        LightLeak {
            lamp,
            cover,
            resolved_distance: resolved,
        },
        others @ ..,
    ] = leaks.as_slice()
    else {
        return;
    };
    let lamp = match *lamp {
        LampRef::Light(index) => light_name(loaded, index),
        LampRef::Object(index) => object_name(loaded, index),
    };
    let more = if others.is_empty() {
        String::new()
    } else {
        format!(" (and {} more such pairs)", others.len())
    };
    let exact = if settings.precision == PrecisionChoice::Reference {
        ""
    } else {
        ", or add --precision reference"
    };
    let message = format!(
        "{lamp} shines through {}{more}, which is opaque but closer to the light than rounding resolves; leave {} metres or more between \
         them{exact}",
        object_name(loaded, *cover),
        format_significant_digits(*resolved, 2)
    );
    notes.add_warning(&message);
    loaded.warnings.push(Warning {
        code: WarningCode::Precision,
        message,
        triangles: 0,
    });
}

/// Formats the name of a light without size for a message, or its number in the scene, counted from
/// one.
fn light_name(loaded: &LoadedScene, index: usize) -> String {
    match loaded.scene.lights.get(index) {
        Some(light) if !light.name.is_empty() => {
            format!("light `{}`", mask_to_one_line(&light.name))
        }
        _ => format!("light {}", index + 1),
    }
}

/// Formats the name of an object for a message, or its number in the scene, counted from one.
/// Generated objects are numbered after the listed objects.
fn object_name(loaded: &LoadedScene, index: usize) -> String {
    match loaded.scene.objects.get(index) {
        Some(object) if !object.name.is_empty() => {
            format!("object `{}`", mask_to_one_line(&object.name))
        }
        _ => format!("object {}", index + 1),
    }
}

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
            triangles: 0,
        })
        .collect();
    warnings
        .iter()
        .for_each(|warning| notes.add_warning(&warning.message));
    warnings
}

/// Recommends an exposure in whole stops if more than a tenth of the pixels of a display picture
/// are clipped, or are black although they have radiance. More than a fifth of clipped pixels gives
/// a warning in place of a note.
pub(super) fn note_exposure(
    rendered: &RenderOutput,
    plan: &PicturePlan,
    targets: &[OutputTarget],
    notes: &mut Notes,
) {
    const BAD: f64 = 0.2;
    if plan.has_auto_exposure
        || (!targets.is_empty() && targets.iter().all(OutputTarget::has_layers))
    {
        return;
    }
    let Clipping { clipped, black } = plan.display.clipping(rendered.final_picture());
    let (label, share) = if clipped > MOST_CLIPPED {
        ("clipped", clipped)
    } else {
        ("black", black)
    };
    if share <= MOST_CLIPPED {
        return;
    }
    let advice = match plan.display.suitable_exposure(rendered.final_picture()) {
        Some(stops) => format!("try --exposure {stops}, or auto"),
        None if clipped > BAD => "even 12 stops darker too many pixels stay clipped".to_owned(),
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
pub(super) fn note_unreached_lights(
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
        "all {rays} rays between lights and surfaces were blocked; if this is not intended, move the light out of the object around it"
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

/// Formats the estimated error of a picture for the final message: `error 0.05 (0.04 to 0.06)`.
/// Reasons to doubt the estimate become notes, and verbose runs print all measures. `requested` is
/// the target error.
pub fn report_error(
    noisy: Option<&Uncertainty>,
    film: &Film,
    rendered: &RenderOutput,
    requested: Option<f64>,
    notes: &mut Notes,
) -> Option<String> {
    let noisy = noisy?;
    let is_met = |requested| is_error_reached(requested, noisy, rendered);
    if let Some(doubted) = requested
        .filter(|&requested| is_met(requested))
        .and_then(|requested| describe_doubted_progress(film, requested))
    {
        notes.add_hint(format!("{doubted}; more samples were therefore taken"));
    }
    let noise = format_error_measures(noisy);
    notes.print_detail(format_args!("noise: {noise}"));
    let about = format_significant_digits(noisy.root_relmse.value, 2);
    let reached_text = requested
        .filter(|&requested| is_met(requested))
        .map(|requested| format!(", below the requested {requested}"))
        .unwrap_or_default();
    let phrase = match noisy.doubt {
        None => format!("error {}", format_with_interval(noisy.root_relmse)),
        Some(Doubt::FewSamples) => format!("error about {about}"),
        Some(Doubt::FewPixels | Doubt::WideInterval | Doubt::LightByChance) => {
            format!("not converged, error about {about}")
        }
    };
    match noisy.doubt {
        None | Some(Doubt::FewSamples) => {}
        Some(Doubt::FewPixels) if noisy.root_relmse.high == 0.0 => {
            notes.add_warning("not converged: rays were sent to lamps or to the sky, and no sample found light; a larger --spp may find some");
        }
        Some(Doubt::FewPixels | Doubt::WideInterval) => notes.add_warning(format!(
            "not converged: a few pixels have most of the noise ({noise}), as in places where light is rarely found; a larger --spp finds it more often"
        )),
        Some(Doubt::LightByChance) => notes.add_warning(format!(
            "not converged: lamps and suns that shine by mirrors or through glass are hit by chance, and only {} of {} such paths hit one ({noise}); \
             a larger --spp hits more",
            film.counters().found,
            film.counters().unaided
        )),
    }
    Some(report_denoised_error(rendered, notes).unwrap_or(phrase) + &reached_text)
}

/// Whether the error of the displayed picture, denoised or not, is at most `requested`.
fn is_error_reached(requested: f64, noisy: &Uncertainty, rendered: &RenderOutput) -> bool {
    rendered
        .denoise_output()
        .map_or(noisy.is_error_below(requested), |denoised| {
            denoised.reaches_error(requested, noisy)
        })
}

/// Describes why the target error is not reached; `None` if it is reached.
pub fn describe_shortfall(
    requested: f64,
    noisy: Option<&Uncertainty>,
    film: &Film,
    rendered: &RenderOutput,
) -> Option<String> {
    if noisy.is_some_and(|noisy| is_error_reached(requested, noisy, rendered)) {
        return None;
    }
    Some(match describe_doubted_progress(film, requested) {
        Some(doubted) => {
            format!("the requested error of {requested} may not be reached: {doubted}")
        }
        None => format!(
            "the requested error of {requested} is not reached; a larger --spp or a longer --budget reduces the error"
        ),
    })
}

/// Describes why more samples were taken after the error estimate first fell below the target
/// error; `None` if none were.
fn describe_doubted_progress(film: &Film, requested: f64) -> Option<String> {
    let first = film.rejected_stop()?;
    let [minimum, maximum] = first.samples;
    let samples = if minimum == maximum {
        maximum.to_string()
    } else {
        format!("{minimum} to {maximum}")
    };
    let reason = match first.doubt {
        Doubt::FewSamples => "the samples were too few for a sure estimate",
        Doubt::LightByChance => {
            "lamps and suns that are hit by chance alone had been hit too seldom"
        }
        Doubt::FewPixels => "a few pixels had most of the error",
        Doubt::WideInterval => "the estimate was too uncertain",
    };
    Some(format!(
        "{samples} samples seemed to reach the error of {requested}, with an estimate of {}, but {reason}",
        format_significant_digits(first.error, 2)
    ))
}

/// Least root relMSE at which denoising is recommended.
const NOTICEABLE_ERROR: f64 = 0.05;

/// Recommends `--denoise` for a picture with visible noise, unless the samples are a fixed pattern,
/// are too few or depend on a target error. The numbers in the text, the remaining shares of the
/// error, are those of docs/accuracy-reference.md for 64 samples.
pub(super) fn note_denoising(noisy: &Uncertainty, settings: &Settings, notes: &mut Notes) {
    let can = !settings.sampling.is_fixed()
        && settings.sampling.samples_per_pixel() >= FEWEST_SAMPLES
        && settings.max_error.is_none();
    if can && !settings.denoise && noisy.root_relmse.value > NOTICEABLE_ERROR {
        notes.add_hint(
            "--denoise reduces such an error to 0.2 to 0.9 of its size, usually to half (docs/accuracy.md)",
        );
    }
}

/// Formats root relMSE and RMSE with their intervals.
fn format_error_measures(of: &Uncertainty) -> String {
    format!(
        "root relMSE {}, RMSE {}",
        format_with_interval(of.root_relmse),
        format_with_interval(of.rmse)
    )
}

fn format_with_interval(estimate: ErrorEstimate) -> String {
    if estimate.value == 0.0 && estimate.high > 0.0 {
        return format!("at most {}", format_significant_digits(estimate.high, 3));
    }
    format!(
        "{} ({} to {})",
        format_significant_digits(estimate.value, 3),
        format_significant_digits(estimate.low, 3),
        format_significant_digits(estimate.high, 3)
    )
}

/// Describes why a denoised picture has no error estimate.
fn unknown_error_reason(doubt: Doubt) -> &'static str {
    match doubt {
        Doubt::FewSamples => "the samples are too few for an estimate",
        Doubt::LightByChance => "lamps and suns that are hit by chance alone were hit too seldom",
        Doubt::FewPixels => "light was found too rarely",
        Doubt::WideInterval => "the picture is too small for an estimate",
    }
}

/// Formats the error of a denoised picture, and prints all measures in verbose runs; `None` if the
/// picture is not denoised.
fn report_denoised_error(rendered: &RenderOutput, notes: &mut Notes) -> Option<String> {
    let denoised = match rendered.denoised.as_ref()? {
        Ok(denoised) => denoised,
        Err(error) => {
            notes.add_warning(format!("not denoised: {error}"));
            return None;
        }
    };
    let light = format!(
        "{}{} % light",
        if denoised.light_change < 0.0 { "" } else { "+" },
        format_significant_digits(100.0 * denoised.light_change, 2)
    );
    let root_relmse = denoised.error.root_relmse;
    let (error, figures) = match denoised.error.doubt {
        None => (
            format!("error {}", format_with_interval(root_relmse)),
            format_error_measures(&denoised.error),
        ),
        Some(Doubt::WideInterval) if root_relmse.high.is_finite() => {
            let most = format!(
                "at most about {}",
                format_significant_digits(root_relmse.high, 2)
            );
            (
                format!("error {most}"),
                format!("root relMSE not known, {most}"),
            )
        }
        Some(doubt) => {
            let reason = unknown_error_reason(doubt);
            (
                format!("error not known, since {reason}"),
                format!("root relMSE not known, since {reason}"),
            )
        }
    };
    notes.print_detail(format_args!("denoised (biased): {figures}; {light}"));
    Some(format!("denoised (biased), {error}"))
}

/// Formats times, ray counts, memory and method of a render, for verbose runs.
pub(super) fn format_details(
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
            memory::format_memory_parts(&ready.memory().bytes_by_purpose()),
        ),
        (
            "method",
            format!(
                "{} primitives, {}, {} precision",
                ready.table_sizes().primitives,
                origin::accelerator_name(settings.accelerator),
                origin::precision_name(settings.precision)
            ),
        ),
    ];
    format_columns(&rows.map(|(name, text)| [name.to_owned(), text]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: a mean square error whose estimate is below zero is shown as its upper bound, not
    /// as zero.
    #[test]
    fn an_error_of_nothing_is_a_bound() {
        let value_of = |value: f64, low: f64, high: f64| {
            format_with_interval(ErrorEstimate {
                value,
                low,
                high,
                carriers: 100.0,
            })
        };
        assert_eq!(value_of(0.05, 0.01, 0.0712), "0.05 (0.01 to 0.0712)");
        assert_eq!(value_of(0.0, 0.0, 0.0712), "at most 0.0712");
        assert_eq!(value_of(0.0, 0.0, 0.0), "0 (0 to 0)");
    }
}
