//! `render`: a scene becomes pictures.

pub mod film;
mod series;
pub mod tell;
pub mod write;

use std::io::{self, IsTerminal};
use std::path::Path;

use raywright_core::denoise::{DenoiseError, FEWEST_SAMPLES};
use raywright_core::settings::Settings;
use raywright_core::{Ready, Rendered};
use raywright_io::output::{Format, write_atomically};
use raywright_io::{Error, Limits};

use crate::args::RenderArgs;
use crate::clock::{Clock, Seconds, spoken};
use crate::commands::denoise;
use crate::console;
use crate::failure::Failure;
use crate::plan;
use crate::progress::Progress;
use crate::ready::{framed, prepared};
use crate::stats::Stats;
use crate::targets::{self, Outputs, Target};
use crate::threads::Threads;
use crate::watch::Watch;
use crate::{interrupt, origin, scene_input};
use film::Session;

/// Renders a scene and writes its pictures.
pub fn run(args: &RenderArgs) -> Result<(), Failure> {
    let shots = series::shots(&args.view);
    if !shots.is_empty() {
        return series::run(args, &shots);
    }
    let mut clock = Clock::start();
    let verbosity = args.report.verbosity();
    let mut outputs = Outputs::default();
    let mut targets = targets::pictures(&args.outputs, &mut outputs)?;
    refuse_terminal(&targets)?;
    check_floats_and_layers(args, &targets)?;
    check_stats_target(args, &mut outputs)?;
    film::check(&args.film, args.light.max_error, &targets, &mut outputs)?;
    let (stop, threads) = (interrupt::flag()?, Threads::new(args.machine.threads)?);

    let name = args.scene.clone().map_or_else(scene_input::unnamed, Ok)?;
    let style = args.report.progress;
    let mut loaded = threads.run(|| scene_input::watched(&name, &args.changes, limits(args), verbosity, style))?;
    if targets.is_empty() && args.film.part.is_none() {
        let format = if wants_floats(args) { Format::Exr } else { Format::Png };
        targets = vec![targets::unnamed(&loaded.source.stem, format, &mut outputs, &loaded.inputs)?];
    }
    outputs.keep_clear_of(&loaded.inputs)?;
    scene_input::tell_completed(&loaded, verbosity);
    let mut plan = plan::settle(&loaded.scene, args, |view, fov, aspect| framed(&loaded.scene, view, fov, aspect))?;
    plan::choose(&args.choices, &mut loaded.scene, &mut plan.settings)?;
    plan.display.output = plan.settings.output;
    let load = clock.lap();

    let ready = threads.run(|| prepared(&loaded, &plan.settings, &Watch::until(stop)))?;
    let prepare = clock.lap();
    tell::tell_effects(&loaded, ready.effects(), verbosity);
    tell::tell_lost(&loaded, &ready, verbosity);
    tell::tell_closed_gaps(&mut loaded, &ready, &plan.settings, verbosity);
    tell::tell_clamp(&mut loaded, &ready, &plan.settings, verbosity);
    refuse_to_denoise(args, &plan.settings, &ready)?;

    let metadata = origin::metadata(&loaded, &plan, &args.choices);
    let mut session = Session::start(
        args,
        &ready,
        origin::identity(&loaded, &args.changes, &args.choices),
        metadata,
        plan.display,
        limits(args),
    )?;
    let progress = Progress::start("rendering", style, verbosity);
    let done = threads.run(|| session.render(&ready, &progress, &args.report, (&clock, stop)));
    progress.finish();
    done?;
    let rendered = threads.run(|| denoise::rendered(session.film(), &args.report, stop));
    let render = clock.lap();
    let is_free = |path: &Path| outputs.leave_free(path, &loaded.inputs);
    if !session.is_done() || matches!(rendered.denoised, Some(Err(DenoiseError::Cancelled))) {
        let failure = write::interrupted(&rendered, &targets, plan.display, session.metadata(), is_free);
        return Err(session.explained(failure));
    }
    tell::tell_nothing_met(&loaded, &rendered, &plan.settings, verbosity);
    tell::tell_exposure(&rendered, plan.display, &targets, verbosity);
    let written = session.with_own(write::write(&rendered, &targets, plan.display, session.metadata(), is_free)?);
    let write = clock.lap();
    let seconds = Seconds { load, prepare, render, write, total: clock.total() };
    if let Some(path) = &args.report.stats {
        write_atomically(
            path,
            console::json(&Stats::new(&loaded, &ready, &rendered, session.film().uncertainty(), seconds)).as_bytes(),
        )?;
    }
    tell::tell_shut_away(&loaded, &ready, session.film(), verbosity);
    if ready.follows_paths() || args.light.max_error.is_some() {
        tell::tell_noise(session.film(), &rendered, args.light.max_error, verbosity);
    }
    verbosity.detail(tell::details(&ready, &rendered, &seconds).trim_end());
    if !written.is_empty() {
        verbosity.say(format_args!(
            "wrote {written} ({}, {})",
            described(&plan.settings, &session, &rendered),
            spoken(seconds.total)
        ));
    }
    session.into_unkept().map_or(Ok(()), |error| Err(error.into()))
}

/// Binary data would garble a terminal.
fn refuse_terminal(targets: &[Target]) -> Result<(), Failure> {
    if targets.contains(&Target::Stdout) && io::stdout().is_terminal() {
        let error = Error::usage("standard output is a terminal, which cannot show a PNG");
        return Err(error.with_hint("send it to a file or a program: raywright render -o - > picture.png").into());
    }
    Ok(())
}

/// Denoising was asked for by name where it can't be. A first look is one without, too.
fn refuse_to_denoise(args: &RenderArgs, settings: &Settings, ready: &Ready) -> Result<(), Failure> {
    if !settings.denoise || args.light.quick {
        return Ok(());
    }
    if !ready.is_by_chance() {
        args.report.verbosity().say("note: nothing in this picture is by chance, so that there is no noise to take out");
    } else if settings.sampling.is_fixed() {
        let error = Error::usage("samples of a fixed pattern do not tell noise from what is seen");
        return Err(error.with_hint("--spp 16, or any other number of its own, gives up the pattern").into());
    } else if settings.sampling.count() < FEWEST_SAMPLES {
        let error = Error::usage(format_args!("fewer than {FEWEST_SAMPLES} samples do not tell noise from what is seen"));
        return Err(error.with_hint(format!("--spp {FEWEST_SAMPLES}, or more")).into());
    }
    Ok(())
}

/// Whether the formats of the pictures hold what is asked for.
fn check_floats_and_layers(args: &RenderArgs, targets: &[Target]) -> Result<(), Failure> {
    refuse_layers_without_place(args, targets)?;
    refuse_codes_for_floats(args, targets)
}

/// Layers fit into an EXR or a film only.
fn refuse_layers_without_place(args: &RenderArgs, targets: &[Target]) -> Result<(), Failure> {
    if args.aov.is_empty() || args.film.checkpoint.is_some() || targets.iter().any(Target::has_layers) {
        return Ok(());
    }
    let error = Error::usage("--aov adds layers to an .exr picture, and none is written");
    Err(error.with_hint("add one: -o picture.exr").into())
}

/// Whether pictures are to keep linear numbers alone.
fn wants_floats(args: &RenderArgs) -> bool {
    args.choices.rungs.iter().any(|choice| choice.to_string() == "output=float")
}

/// A PNG holds codes.
fn refuse_codes_for_floats(args: &RenderArgs, targets: &[Target]) -> Result<(), Failure> {
    if !wants_floats(args) || targets.iter().all(Target::has_layers) {
        return Ok(());
    }
    let error = Error::usage("--rung output=float keeps linear numbers, and a PNG has codes of display values");
    Err(error.with_hint("name pictures that end in .exr, or leave the rung away").into())
}

/// The report is JSON in a file of its own.
fn check_stats_target(args: &RenderArgs, outputs: &mut Outputs) -> Result<(), Failure> {
    let Some(path) = &args.report.stats else { return Ok(()) };
    if path.extension().is_none_or(|extension| !extension.eq_ignore_ascii_case("json")) {
        let error = Error::usage(format_args!("--stats {}: the name does not end in .json", path.display()));
        return Err(error.with_hint(format!("--stats {}", path.with_extension("json").display())).into());
    }
    outputs.add(path, "--stats")
}

fn limits(args: &RenderArgs) -> Limits {
    let own = Limits::default();
    Limits { memory_bytes: args.machine.max_memory.unwrap_or(own.memory_bytes), ..own }
}

/// The picture in a few words.
fn described(settings: &Settings, session: &Session, rendered: &Rendered) -> String {
    let [width, height] = settings.crop.map_or(settings.size, |crop| [crop.width, crop.height]);
    let denoised = if rendered.denoised().is_some() { ", denoised" } else { "" };
    format!("{width}x{height}, {}{denoised}", session.samples())
}
