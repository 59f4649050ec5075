//! `denoise`: filters the noise out of the picture of a film file.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use raywright_core::denoise::{DenoiseError, denoise};
use raywright_core::film::Film;
use raywright_core::{Observer, RenderOutput};
use raywright_io::output::read_film;
use raywright_io::{Error, InputFiles};

use super::render::film::refuse_other_program;
use super::render::{messages, write};
use crate::args::{DenoiseArgs, ProgressStyle};
use crate::clock::{Clock, format_duration};
use crate::console::Verbosity;
use crate::failure::{Exit, Failure};
use crate::notes::Notes;
use crate::progress::Progress;
use crate::targets::{self, OutputFiles};
use crate::threads::Threads;
use crate::watch::{Deadlines, Watch};
use crate::{interrupt, origin, plan};

/// Runs `denoise`: reads a film file, denoises its picture and writes the requested files.
pub fn run(args: &DenoiseArgs, verbosity: Verbosity) -> Result<(), Failure> {
    let clock = Clock::start();
    let (mut outputs, mut inputs) = (
        OutputFiles::with_quality(args.display.quality),
        InputFiles::default(),
    );
    let targets = targets::pictures(&args.outputs, &mut outputs)?;
    inputs.read(&args.film);
    outputs.keep_clear_of(&inputs)?;
    let (stop, threads) = (interrupt::flag()?, Threads::new(args.threads)?);
    let mut kept_film = read_film(&args.film, &plan::limits(args.max_memory))?;
    refuse_other_program(&args.film, &kept_film.metadata)?;
    kept_film.metadata.command = origin::command_line();
    let denoised = threads.run(|| denoise(&kept_film.film, &Watch::until(stop)));
    if let Err(error) = &denoised {
        return Err(refused(&args.film.display().to_string(), error));
    }
    let rendered = RenderOutput {
        denoised: Some(denoised),
        ..RenderOutput::noisy(&kept_film.film)
    };
    let display = plan::shown_as_suits(&args.display, kept_film.display, rendered.shown_picture());
    let noisy = rendered.noisy_error(&kept_film.film);
    kept_film.metadata.error = origin::error(noisy.as_ref(), &rendered, &kept_film.film);
    let written = write::write(
        &rendered,
        &targets,
        display,
        &kept_film.metadata,
        (&inputs, |path: &Path| outputs.leave_free(path, &inputs)),
    )?;
    let mut notes = Notes::new(verbosity);
    messages::note_losses(&rendered.counters, &mut notes);
    let error = messages::error(noisy.as_ref(), &kept_film.film, &rendered, None, &mut notes)
        .unwrap_or_else(|| "denoised (biased)".to_owned());
    notes.finish();
    if !written.is_empty() {
        verbosity.say(format_args!(
            "wrote {} ({error}, {})",
            written.join(", "),
            format_duration(clock.total())
        ));
    }
    Ok(())
}

fn refused(film: &str, error: &DenoiseError) -> Failure {
    match error {
        DenoiseError::Cancelled => Failure::new(Exit::Interrupted, "interrupted; nothing was written"),
        DenoiseError::NoChance => Error::input(film, error).into(),
        DenoiseError::Layer(_) | DenoiseError::Replicates => Error::input(film, error)
            .with_hint("render it with --denoise, from 8 samples on; --checkpoint keeps what is needed then")
            .into(),
    }
}

/// Computes the picture of a rendered film, denoised if the film's settings request it, with a
/// progress display. Called by `render` after its last sample.
pub fn rendered(
    film: &Film,
    (style, verbosity): (ProgressStyle, Verbosity),
    stop: &AtomicBool,
) -> RenderOutput {
    if !film.is_to_be_denoised() {
        return RenderOutput::noisy(film);
    }
    let is_small = film
        .size()
        .iter()
        .map(|&edge| u64::from(edge))
        .product::<u64>()
        < SMALL;
    let progress = Progress::start(
        "denoising",
        if is_small { ProgressStyle::None } else { style },
        verbosity,
    );
    let watch = Watch {
        progress: Some(&progress),
        deadlines: Deadlines::default(),
        ..Watch::until(stop)
    };
    let rendered = RenderOutput::from_film(film, &watch as &dyn Observer);
    progress.finish();
    rendered
}

/// Number of pixels below which denoising ends before a progress display would be noticed.
const SMALL: u64 = 1 << 18;
