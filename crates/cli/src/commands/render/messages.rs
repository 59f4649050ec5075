//! Messages of `render` about a scene and its picture: effects left out, objects lost, lights that
//! no path reaches, the error, and with `-v` times and counts.

use raywright_core::denoise::FEWEST_SAMPLES;
use raywright_core::display::exposure::{Clipping, MOST_CLIPPED};
use raywright_core::effects::EffectReport;
use raywright_core::fault::{Fault, FaultKind, Subject};
use raywright_core::film::{EstimateDoubt, Film, Uncertainty};
use raywright_core::prepare::LightRays;
use raywright_core::scene::{Scene, Shape};
use raywright_core::settings::Settings;
use raywright_core::{ReadyScene, RenderOutput};
use raywright_io::LoadedScene;
use raywright_io::report::{
    format_duration, format_estimate, format_memory_parts, format_rough_estimate,
    format_significant_digits,
};

use crate::args::ExposureChoice;
use crate::commands::explain;
use crate::commands::render::RenderedPicture;
use crate::notes::Notes;
use crate::origin;
use crate::plan::{ChosenExposure, PicturePlan};
use crate::session::StageSeconds;
use crate::table::format_rows;
use crate::targets::OutputTarget;

/// Warns of the effects that are left out, and prints all effects in verbose runs.
pub fn note_effects(loaded: &LoadedScene, report: &EffectReport, notes: &mut Notes) {
    notes.print_detail(explain::format_effects(loaded, report, false));
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

/// Adds faults that a preparation or a render finds to the notes, and returns them for the
/// statistics.
pub fn note_faults(
    faults: impl IntoIterator<Item = Fault>,
    scene: &Scene,
    notes: &mut Notes,
) -> Vec<Fault> {
    let faults = Fault::first_of_kinds(faults, scene);
    notes.add_faults(&faults);
    faults
}

/// Adds a note if `--wireframe` is given and the scene has shapes without edges, such as spheres.
pub fn note_missing_edges(loaded: &LoadedScene, ready: &ReadyScene, notes: &mut Notes) {
    let objects = loaded.scene.objects.iter().chain(
        loaded
            .scene
            .generators
            .iter()
            .map(|generator| &generator.object),
    );
    let has_edges = |shape: &Shape| matches!(shape, Shape::Mesh(_) | Shape::Triangle { .. });
    let (with_edges, others): (Vec<_>, Vec<_>) =
        objects.partition(|object| has_edges(&object.shape));
    if !ready.settings().wireframe || others.is_empty() {
        return;
    }
    let which = if with_edges.is_empty() {
        "the scene has only shapes without edges, such as spheres"
    } else {
        "the scene also has shapes without edges, such as spheres"
    };
    notes.add_hint(format!(
        "--wireframe draws the edges of triangles, and {which}"
    ));
}

/// Returns the fault of the bias that a clamp causes.
pub fn clamp_fault(ready: &ReadyScene) -> Option<Fault> {
    let maximum = ready.settings().clamp?;
    let message = if ready.is_path_traced() {
        format!(
            "--clamp dims samples brighter than {maximum} to this radiance: pixels with such samples are too dark (bias)"
        )
    } else {
        "--clamp has no effect: it dims samples of path tracing, and this scene is rendered without path tracing".to_owned()
    };
    Some(FaultKind::SamplesDimmed.fault(Subject::Scene, message, ""))
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
pub(super) fn note_exposure(
    picture: &RenderedPicture<'_>,
    targets: &[OutputTarget],
    notes: &mut Notes,
) {
    let RenderedPicture { plan, rendered, .. } = *picture;
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
        return notes.add_picture_warning(
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
        notes.add_picture_warning(message)
    } else {
        notes.add_hint(message)
    }
}

/// Adds a note about lights that no path reached. This is no warning, because a lamp in a closed
/// box may be intended.
pub(super) fn note_unreached_lights(picture: &RenderedPicture<'_>, notes: &mut Notes) {
    let scene = &picture.loaded.scene;
    let rays = picture.ready.light_rays(picture.film).into_iter();
    let unreached = rays.filter(LightRays::is_unreached);
    note_faults(unreached.map(|rays| rays.fault(scene)), scene, notes);
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
    let reached_text = requested
        .filter(|&requested| is_met(requested))
        .map(|requested| format!(", below the requested {requested}"))
        .unwrap_or_default();
    let phrase = match noisy.doubt {
        None => format!("error {}", format_estimate(noisy.root_relmse)),
        Some(EstimateDoubt::NearlyBlack) => {
            format!(
                "error not known: {}",
                unknown_error_reason(EstimateDoubt::NearlyBlack)
            )
        }
        Some(EstimateDoubt::FewSamples) => {
            let error = format_rough_estimate(noisy.root_relmse);
            format!("error {error}, a guess from few samples")
        }
        Some(
            EstimateDoubt::FewPixels | EstimateDoubt::WideInterval | EstimateDoubt::LightByChance,
        ) => format!(
            "not converged, error {}",
            format_rough_estimate(noisy.root_relmse)
        ),
    };
    match noisy.doubt {
        None | Some(EstimateDoubt::FewSamples) => {}
        Some(EstimateDoubt::NearlyBlack) => notes.add_picture_warning(
            "the error is not known: the picture is nearly black, with a mean radiance below 0.01, so that its relative error is small whatever it shows; \
             brighten the lights, and darken the picture by --exposure if it is meant to be dark",
        ),
        Some(EstimateDoubt::FewPixels) if noisy.root_relmse.high == 0.0 => {
            notes.add_picture_warning("not converged: rays were sent to lamps or to the sky, and no sample found light; a larger --spp may find light");
        }
        Some(EstimateDoubt::FewPixels | EstimateDoubt::WideInterval) => notes.add_picture_warning(format!(
            "not converged: a few pixels have most of the noise ({noise}), because their samples rarely find light; a larger --spp finds light more often"
        )),
        Some(EstimateDoubt::LightByChance) => notes.add_picture_warning(format!(
            "not converged: paths by mirrors, glass or gloss hit lamps and suns only by chance, and may have missed more light than the error shows ({noise}); \
             a larger --spp hits them more often"
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
    let doubt = noisy.and_then(|noisy| noisy.doubt);
    Some(match describe_doubted_progress(film, requested) {
        _ if doubt == Some(EstimateDoubt::NearlyBlack) => format!(
            "the requested error of {requested} is not reached: the picture is nearly black, and stays so with more samples"
        ),
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
    let first = film.first_doubtful_estimate()?;
    let [minimum, maximum] = first.samples;
    let samples = if minimum == maximum {
        maximum.to_string()
    } else {
        format!("{minimum} to {maximum}")
    };
    Some(format!(
        "{samples} samples seemed to reach the error of {requested}, with an estimate of {}, but {}",
        format_significant_digits(first.error, 2),
        unknown_error_reason(first.doubt)
    ))
}

/// Least root relMSE at which denoising is recommended.
const NOTICEABLE_ERROR: f64 = 0.05;

/// Recommends `--denoise` for a picture with visible noise, unless the samples are a fixed pattern,
/// are too few or depend on a target error. The numbers in the text, the remaining shares of the
/// error, are those of docs/accuracy-reference.md for 64 samples.
pub fn note_denoising(noisy: &Uncertainty, settings: &Settings, notes: &mut Notes) {
    let can = !settings.sampling.is_fixed()
        && settings.samples() >= FEWEST_SAMPLES
        && settings.max_error.is_none();
    if can && !settings.denoise && noisy.root_relmse.value > NOTICEABLE_ERROR {
        notes.add_hint(
            "--denoise would reduce the error of this picture to 0.2 to 0.9 of its size, usually to half (docs/accuracy.md)",
        );
    }
}

/// Formats root relMSE and RMSE with their intervals.
fn format_error_measures(of: &Uncertainty) -> String {
    format!(
        "root relMSE {}, RMSE {}",
        format_estimate(of.root_relmse),
        format_estimate(of.rmse)
    )
}

/// Describes why a picture has no reliable error estimate.
pub fn unknown_error_reason(doubt: EstimateDoubt) -> &'static str {
    match doubt {
        EstimateDoubt::NearlyBlack => "the picture is nearly black",
        EstimateDoubt::FewSamples => "the samples are too few for an estimate",
        EstimateDoubt::LightByChance => {
            "lamps and suns that paths hit only by chance were hit too seldom"
        }
        EstimateDoubt::FewPixels => "too few samples found light",
        EstimateDoubt::WideInterval => "the estimate is too uncertain",
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
            format!("error {}", format_estimate(root_relmse)),
            format_error_measures(&denoised.error),
        ),
        Some(EstimateDoubt::WideInterval) if !root_relmse.is_meaningless() => {
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
                format!("error not known: {reason}"),
                format!("root relMSE not known: {reason}"),
            )
        }
    };
    notes.print_detail(format_args!("denoised (biased): {figures}; {light}"));
    Some(format!("denoised (biased), {error}"))
}
