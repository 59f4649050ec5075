//! Messages about the estimated error of a picture, before and after denoising.

use raywright_core::RenderOutput;
use raywright_core::denoise::FEWEST_SAMPLES;
use raywright_core::film::{EstimateDoubt, Film, Uncertainty};
use raywright_core::settings::Settings;
use raywright_io::report::{format_estimate, format_rough_estimate, format_significant_digits};

use crate::notes::Notes;

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
            format!("error {}", format_rough_estimate(noisy.root_relmse))
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
        Some(EstimateDoubt::NearlyBlack) => notes.add_warning(
            "the error is not known: the picture is nearly black, with a mean radiance below 0.01, so that its relative error is small whatever it shows; \
             brighten the lights, and darken the picture by --exposure if it is meant to be dark",
        ),
        Some(EstimateDoubt::FewPixels) if noisy.root_relmse.high == 0.0 => {
            notes.add_warning("not converged: rays were sent to lamps or to the sky, and no sample found light; a larger --spp may find light");
        }
        Some(EstimateDoubt::FewPixels | EstimateDoubt::WideInterval) => notes.add_warning(format!(
            "not converged: a few pixels have most of the noise ({noise}), because their samples rarely find light; a larger --spp finds light more often"
        )),
        Some(EstimateDoubt::LightByChance) => notes.add_warning(format!(
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
        && settings.sampling.samples_per_pixel() >= FEWEST_SAMPLES
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
fn unknown_error_reason(doubt: EstimateDoubt) -> &'static str {
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
