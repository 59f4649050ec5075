//! `denoise`: filters the noise out of the picture of a film file.

use std::slice;

use raywright_core::denoise::{DenoiseError, denoise};
use raywright_core::film::Film;
use raywright_core::{Observer, RenderOutput};
use raywright_io::Error;

use super::film_outputs::{FilmOutputs, report_files};
use super::render::film::read_own_film;
use crate::args::{DenoiseArgs, ProgressStyle};
use crate::console::Verbosity;
use crate::failure::{Exit, Failure};
use crate::observer::RunObserver;
use crate::plan;
use crate::preparation::NOTHING_KEPT;
use crate::progress::Progress;
use crate::session::Session;

/// Runs `denoise`: reads a film file, denoises its picture and writes the requested files.
pub fn run(mut session: Session, args: &DenoiseArgs) -> Result<(), Failure> {
    let films = slice::from_ref(&args.film);
    let named = (args.outputs.as_slice(), None);
    let outputs = FilmOutputs::resolve(&mut session, &args.display, named, films)?;
    let mut kept_film = read_own_film(&args.film, &plan::build_limits(args.max_memory))?;
    let watch = session.start_work();
    let denoised = session.run(|| denoise(&kept_film.film, &watch));
    if let Err(error) = &denoised {
        return Err(denoise_failure(&args.film.display().to_string(), error));
    }
    let rendered = RenderOutput {
        denoised: Some(denoised),
        ..RenderOutput::from_film_without_denoising(&kept_film.film)
    };
    let developed = (&mut kept_film, &rendered);
    let (written, error) = outputs.write_picture(&mut session, developed, &args.display)?;
    let error = error.unwrap_or_else(|| "denoised (biased)".to_owned());
    report_files(&mut session, &written, &error);
    Ok(())
}

fn denoise_failure(film: &str, error: &DenoiseError) -> Failure {
    match error {
        DenoiseError::Cancelled => Failure::new(Exit::Interrupted, NOTHING_KEPT),
        DenoiseError::NoChance => Error::invalid_input(film, error).into(),
        DenoiseError::Layer(_) | DenoiseError::Replicates => Error::invalid_input(film, error)
            .with_hint("render the scene with --denoise, --checkpoint and at least 8 samples a pixel; the film then has the layers that the denoiser needs")
            .into(),
    }
}

/// Computes the picture of a rendered film, denoised if the film's settings request it, with a
/// progress display. Called by `render` after its last sample.
pub fn denoise_with_progress(
    film: &Film,
    (style, verbosity): (ProgressStyle, Verbosity),
    watch: RunObserver<'_>,
) -> RenderOutput {
    if !film.is_to_be_denoised() {
        return RenderOutput::from_film_without_denoising(film);
    }
    let pixels = film.size().map(u64::from).into_iter().product::<u64>();
    let style = if pixels < SMALL_PIXELS {
        ProgressStyle::None
    } else {
        style
    };
    let progress = Progress::start("denoising", style, verbosity);
    let watch = RunObserver {
        progress: Some(&progress),
        ..watch
    };
    let rendered = RenderOutput::from_film(film, &watch as &dyn Observer);
    progress.finish();
    rendered
}

/// Largest number of pixels for which denoising is too short for a progress display.
const SMALL_PIXELS: u64 = 1 << 18;
