//! `denoise`: filters the noise out of the picture of a film file.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use raywright_core::denoise::{DenoiseError, denoise};
use raywright_core::film::Film;
use raywright_core::{Observer, RenderOutput};
use raywright_io::output::read_film;
use raywright_io::{Error, InputFiles};

use super::render::film::refuse_other_version;
use super::render::{messages, write};
use crate::args::{DenoiseArgs, ProgressStyle};
use crate::clock::{StageClock, format_duration};
use crate::console::Verbosity;
use crate::early_stage::EarlyStageGuard;
use crate::failure::{Exit, Failure};
use crate::notes::Notes;
use crate::observer::{Deadlines, RunObserver};
use crate::preparation::NOTHING_KEPT;
use crate::progress::Progress;
use crate::targets::{self, OutputFiles};
use crate::threads::Threads;
use crate::{interrupt, origin, plan};

/// Runs `denoise`: reads a film file, denoises its picture and writes the requested files.
pub fn run(args: &DenoiseArgs, verbosity: Verbosity) -> Result<(), Failure> {
    let clock = StageClock::start();
    let (mut outputs, mut inputs) = (
        OutputFiles::with_quality(args.display.quality),
        InputFiles::default(),
    );
    let targets = targets::resolve_picture_targets(&args.outputs, &mut outputs)?;
    inputs.record_read(&args.film);
    outputs.check_against_inputs(&inputs)?;
    let (stop, threads) = (
        interrupt::install_stop_flag()?,
        Threads::within_machine(args.threads, verbosity)?,
    );
    let stage = EarlyStageGuard::start_unlimited(NOTHING_KEPT);
    let mut kept_film = read_film(&args.film, &plan::build_limits(args.max_memory))?;
    drop(stage);
    refuse_other_version(&args.film, &kept_film.metadata)?;
    kept_film.metadata.command = origin::command_line();
    let denoised = threads.run(|| denoise(&kept_film.film, &RunObserver::with_stop_flag(stop)));
    if let Err(error) = &denoised {
        return Err(denoise_failure(&args.film.display().to_string(), error));
    }
    let rendered = RenderOutput {
        denoised: Some(denoised),
        ..RenderOutput::from_film_without_denoising(&kept_film.film)
    };
    let display = plan::apply_display_and_exposure(
        &args.display,
        kept_film.display,
        rendered.final_picture(),
    );
    let noisy = rendered.error_before_denoising(&kept_film.film);
    kept_film.metadata.error =
        origin::format_error_metadata(noisy.as_ref(), &rendered, &kept_film.film);
    let written = write::write_targets(
        &rendered,
        &targets,
        display,
        &kept_film.metadata,
        (&inputs, |path: &Path| outputs.is_free_path(path, &inputs)),
    )?;
    let mut notes = Notes::new(verbosity);
    messages::note_lost_samples(&rendered.counters, &mut notes);
    let error =
        messages::report_error(noisy.as_ref(), &kept_film.film, &rendered, None, &mut notes)
            .unwrap_or_else(|| "denoised (biased)".to_owned());
    notes.print_kept_messages();
    if !written.is_empty() {
        verbosity.print_result_message(format_args!(
            "wrote {} ({error}, {})",
            written.join(", "),
            format_duration(clock.total_seconds())
        ));
    }
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
    stop: &AtomicBool,
) -> RenderOutput {
    if !film.is_to_be_denoised() {
        return RenderOutput::from_film_without_denoising(film);
    }
    let is_small = film
        .size()
        .iter()
        .map(|&edge| u64::from(edge))
        .product::<u64>()
        < SMALL_PIXELS;
    let progress = Progress::start(
        "denoising",
        if is_small { ProgressStyle::None } else { style },
        verbosity,
    );
    let watch = RunObserver {
        progress: Some(&progress),
        deadlines: Deadlines::default(),
        ..RunObserver::with_stop_flag(stop)
    };
    let rendered = RenderOutput::from_film(film, &watch as &dyn Observer);
    progress.finish();
    rendered
}

/// Largest number of pixels for which denoising is too short for a progress display.
const SMALL_PIXELS: u64 = 1 << 18;
