//! `render`: a scene becomes pictures.

pub mod film;
mod series;
pub mod tell;
pub mod write;

use std::ffi::{OsStr, OsString};
use std::io::{self, IsTerminal};
use std::path::Path;

use raywright_core::denoise::{DenoiseError, FEWEST_SAMPLES};
use raywright_core::film::Uncertainty;
use raywright_core::framing::View;
use raywright_core::scene::Camera;
use raywright_core::settings::Settings;
use raywright_core::{Ready, Rendered, Scene};
use raywright_io::output::{Format, Metadata, pixel_hash, write_atomically};
use raywright_io::{Error, Limits, Loaded};

use crate::args::RenderArgs;
use crate::beginning::Beginning;
use crate::clock::{Clock, Seconds, spoken};
use crate::commands::denoise;
use crate::console;
use crate::failure::Failure;
use crate::notes::Notes;
use crate::plan::{self, Plan};
use crate::progress::Progress;
use crate::ready::{framed, prepared};
use crate::stats::Stats;
use crate::targets::{self, Outputs, Target};
use crate::threads::Threads;
use crate::watch::Watch;
use crate::{interrupt, origin, scene_input};
use film::Session;

/// Renders scenes and writes their pictures.
pub fn run(args: &RenderArgs) -> Result<(), Failure> {
    let shots = series::shots(&args.view);
    if series::is_asked_for(args, &shots) {
        return series::run(args, shots);
    }
    let mut notes = Notes::new(args.report.verbosity);
    let done = single(args, &mut notes);
    notes.finish();
    let Done { line, unkept } = done?;
    line.iter().for_each(|line| args.report.verbosity.say(line));
    unkept.map_or(Ok(()), |error| Err(error.into()))
}

/// How a render of one picture ended.
struct Done {
    /// What there is to say of it; none where it went to standard output alone.
    line: Option<String>,
    /// Why its film is not in its file.
    unkept: Option<Error>,
}

/// Renders one picture of one scene.
fn single(args: &RenderArgs, notes: &mut Notes) -> Result<Done, Failure> {
    let mut clock = Clock::start();
    let mut outputs = Outputs::default();
    let mut targets = targets::pictures(&args.outputs, &mut outputs)?;
    refuse_terminal(args, &targets)?;
    check_floats_and_layers(args, &targets)?;
    check_stats_target(args, &mut outputs)?;
    film::check(&args.film, args.light.max_error, &targets, &mut outputs)?;
    let (stop, threads) = (interrupt::flag()?, Threads::new(args.machine.threads)?);

    let name = name_of(args.scenes.first())?;
    let beginning = begin(&name, args, Some(&clock))?;
    let input = scene_input::input(&name, &limits(args))?;
    let (style, verbosity) = (args.report.progress, args.report.verbosity);
    let loading = Progress::start("loading", style, verbosity);
    let mut loaded = threads.run(|| scene_input::load(&input, &args.changes, limits(args), &loading))?;
    notes.warn_of(&loaded);
    if targets.is_empty() && args.film.part.is_none() {
        targets = vec![targets::unnamed(&loaded.source.stem, default_format(args), &mut outputs, &loaded.inputs)?];
    }
    outputs.keep_clear_of(&loaded.inputs)?;
    scene_input::note_completed(&loaded, notes);
    let plan = settle(args, &mut loaded, framed)?;
    let load = clock.lap();

    let ready = threads.run(|| prepared(&loaded, &plan.settings, &Watch::until(stop)))?;
    let prepare = clock.lap();
    note_prepared(&mut loaded, &ready, &plan.settings, notes);
    refuse_to_denoise(args, &plan.settings, &ready, notes)?;

    let mut session = start(args, &loaded, &ready, &plan)?;
    drop(beginning);
    let progress = Progress::start("rendering", style, verbosity);
    let done = threads.run(|| session.render(&ready, &progress, &args.report, (&clock, stop)));
    progress.finish();
    done?;
    session.note_slow(&clock, notes);
    let rendered = threads.run(|| denoise::rendered(session.film(), &args.report, stop));
    let noisy = threads.run(|| session.film().uncertainty());
    let render = clock.lap();
    let (is_free, metadata) = (|path: &Path| outputs.leave_free(path, &loaded.inputs), metadata(args, &session));
    if !session.is_done() || matches!(rendered.denoised, Some(Err(DenoiseError::Cancelled))) {
        let kept = write::keep(&rendered, &targets, plan.display, &metadata, is_free);
        return Err(session.explained(write::interrupted(kept.map(|kept| session.with_own(kept)))));
    }
    let names = write::write(&rendered, &targets, plan.display, &metadata, is_free)?;
    print_hash(args, &rendered, &names, &loaded.source.stem)?;
    let written = session.with_own(names);
    let write = clock.lap();
    let seconds = Seconds { load, prepare, render, write, total: clock.total() };
    loaded.warnings.extend(tell::note_losses(&rendered.counters, notes));
    if let Some(path) = &args.report.stats {
        let stats = Stats::new(&loaded, &ready, &rendered, noisy, seconds);
        write_atomically(path, console::json(&stats).as_bytes())?;
    }
    note_rendered(&loaded, &rendered, &plan, &targets, notes);
    tell::note_shut_away(&loaded, &ready, session.film(), notes);
    let description = described(args, &plan.settings, &session, (&ready, &rendered), noisy.as_ref(), notes);
    notes.detail(tell::details(&ready, &rendered, &seconds).trim_end());
    let line = (!written.is_empty()).then(|| format!("wrote {written} ({description}, {})", spoken(seconds.total)));
    Ok(Done { line, unkept: session.into_unkept() })
}

/// What a picture's file says of where it comes from.
fn metadata(args: &RenderArgs, session: &Session) -> Metadata {
    if args.no_metadata { Metadata::default() } else { session.metadata().clone() }
}

/// The hash of a picture's pixels, where it is asked for, beside each file that has them; beside a name where none has.
fn print_hash(args: &RenderArgs, rendered: &Rendered, files: &[String], name: &str) -> Result<(), Failure> {
    if !args.report.hash {
        return Ok(());
    }
    let (hash, name) = (pixel_hash(rendered.shown()), [name.to_owned()]);
    let names = if files.is_empty() { &name } else { files };
    console::print(names.iter().map(|name| format!("{hash}  {}\n", console::on_one_line(name))).collect::<String>())
}

/// The scene that is named, or the one that is meant where none is.
fn name_of(name: Option<&OsString>) -> Result<OsString, Failure> {
    name.cloned().map_or_else(scene_input::unnamed, Ok)
}

/// What a picture is written in where its name is not the user's.
fn default_format(args: &RenderArgs) -> Format {
    if wants_floats(args) { Format::Exr } else { Format::Png }
}

/// What the arguments amount to for a scene, with the rungs and switches that change the scene itself. `framed` makes the camera that shows
/// the whole of it.
fn settle(
    args: &RenderArgs,
    loaded: &mut Loaded,
    framed: impl FnOnce(&Scene, Option<View>, f64, f64) -> Camera,
) -> Result<Plan, Failure> {
    let mut plan = plan::settle(&loaded.scene, args, |view, fov, aspect| framed(&loaded.scene, view, fov, aspect))?;
    plan::choose(&args.choices, &mut loaded.scene, &mut plan.settings)?;
    plan.display.output = plan.settings.output;
    Ok(plan)
}

/// A session for one picture of a scene.
fn start<'a>(args: &'a RenderArgs, loaded: &Loaded, ready: &Ready, plan: &Plan) -> Result<Session<'a>, Failure> {
    let identity = origin::identity(loaded, &args.changes, &args.choices);
    let metadata = origin::metadata(loaded, plan, &args.choices);
    Session::start(args, ready, identity, metadata, plan.display, limits(args))
}

/// What is known of a picture before it is rendered.
fn note_prepared(loaded: &mut Loaded, ready: &Ready, settings: &Settings, notes: &mut Notes) {
    tell::note_effects(loaded, ready.effects(), notes);
    tell::note_lost(loaded, ready, notes);
    tell::note_unresolved(loaded, ready, notes);
    tell::note_closed_gaps(loaded, ready, settings, notes);
    tell::note_clamp(loaded, ready, settings, notes);
}

/// What a picture itself tells.
fn note_rendered(loaded: &Loaded, rendered: &Rendered, plan: &Plan, targets: &[Target], notes: &mut Notes) {
    tell::note_nothing_met(loaded, rendered, &plan.settings, notes);
    tell::note_exposure(rendered, plan.display, targets, notes);
}

/// Binary data would garble a terminal, and text the binary data.
fn refuse_terminal(args: &RenderArgs, targets: &[Target]) -> Result<(), Failure> {
    if targets.contains(&Target::Stdout) && args.report.hash {
        let error = Error::usage("-o - and --hash both write to standard output");
        return Err(error.with_hint("name a file with -o").into());
    }
    if targets.contains(&Target::Stdout) && io::stdout().is_terminal() {
        let error = Error::usage("standard output is a terminal, which cannot show a PNG");
        return Err(error.with_hint("send it to a file or a program: raywright render -o - > picture.png").into());
    }
    Ok(())
}

/// Denoising was asked for by name where it can't be. A first look is one without, too.
fn refuse_to_denoise(args: &RenderArgs, settings: &Settings, ready: &Ready, notes: &mut Notes) -> Result<(), Failure> {
    if !settings.denoise || args.light.quick {
        return Ok(());
    }
    if !ready.is_by_chance() {
        notes.hint("nothing in this picture is by chance, so that there is no noise to take out");
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

/// The beginning of a render: until there is something to keep. A series has no budget, and a scene of several that takes too much does not
/// keep the others away.
fn begin(name: &OsStr, args: &RenderArgs, clock: Option<&Clock>) -> Result<Beginning, Failure> {
    let time = clock.and_then(|clock| Some((clock.began(), args.film.budget?)));
    let memory = if args.scenes.len() > 1 { u64::MAX } else { limits(args).memory_bytes };
    Beginning::of(name, memory, time)
}

fn limits(args: &RenderArgs) -> Limits {
    let own = Limits::default();
    Limits { memory_bytes: args.machine.max_memory.unwrap_or(own.memory_bytes), ..own }
}

/// The picture in a few words: its size, its samples, and how far it probably is from the true one.
fn described(
    args: &RenderArgs,
    settings: &Settings,
    session: &Session,
    (ready, rendered): (&Ready, &Rendered),
    noisy: Option<&Uncertainty>,
    notes: &mut Notes,
) -> String {
    let asked = args.light.max_error;
    let noisy = noisy.filter(|_| ready.follows_paths() || asked.is_some() || rendered.denoised().is_some());
    let error = tell::error(noisy, session.film(), rendered, asked, notes);
    let error = error.map(|error| format!(", {error}")).unwrap_or_default();
    size_and_samples(settings, session) + &error
}

fn size_and_samples(settings: &Settings, session: &Session) -> String {
    let [width, height] = settings.crop.map_or(settings.size, |crop| [crop.width, crop.height]);
    format!("{width}x{height}, {}", session.samples())
}
