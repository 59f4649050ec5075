//! Several pictures a run: from several views, once around, or of several moments. A scene is loaded once for each moment and prepared once
//! where only the camera moves; each picture has the bits of a run of its own.

use std::path::{Path, PathBuf};

use raywright_core::Ready;
use raywright_core::framing::{Silhouette, View};
use raywright_io::{Error, Loaded};

use super::film::Session;
use super::{check_floats_and_layers, described, limits, refuse_to_denoise, tell, wants_floats, write};
use crate::args::{RenderArgs, ViewArgs};
use crate::clock::{Clock, spoken};
use crate::commands::denoise;
use crate::failure::Failure;
use crate::plan;
use crate::progress::Progress;
use crate::ready::prepared;
use crate::targets::{self, Outputs, Target};
use crate::threads::Threads;
use crate::watch::Watch;
use crate::{interrupt, origin, scene_input};
use raywright_io::output::Format;

/// One picture of several.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Shot {
    /// What its file is called after where the user named none.
    label: String,
    at: Option<f64>,
    view: Option<View>,
    /// Degrees further around than the view in force.
    turn: Option<f64>,
}

/// The pictures that the flags ask for; none where they ask for one without a number.
pub(super) fn shots(args: &ViewArgs) -> Vec<Shot> {
    let numbered = |number: usize| Shot { label: format!("{number:04}"), at: None, view: args.view, turn: None };
    if let Some(views) = &args.views {
        let shot = |(name, view): &(String, View)| Shot { label: name.replace(',', "_"), view: Some(*view), ..numbered(0) };
        views.0.iter().map(shot).collect()
    } else if let Some(count) = args.turntable {
        (0..count).map(|i| Shot { turn: Some(360.0 * f64::from(i) / f64::from(count)), ..numbered(i as usize) }).collect()
    } else if let Some(frames) = args.frames {
        frames.times().enumerate().map(|(i, time)| Shot { at: Some(time), ..numbered(i) }).collect()
    } else {
        Vec::new()
    }
}

/// A scene at a moment.
struct Moment {
    loaded: Loaded,
    silhouette: Silhouette,
    ready: Option<Ready>,
}

/// Renders several pictures of a scene.
pub(super) fn run(args: &RenderArgs, shots: &[Shot]) -> Result<(), Failure> {
    let clock = Clock::start();
    let (verbosity, style) = (args.report.verbosity(), args.report.progress);
    refuse_what_is_of_one_picture(args)?;
    let mut outputs = Outputs::default();
    let mut targets = named(&args.outputs, shots.len(), &mut outputs)?;
    targets.iter().try_for_each(|targets| check_floats_and_layers(args, targets))?;
    let (stop, threads) = (interrupt::flag()?, Threads::new(args.machine.threads)?);
    let name = args.scene.clone().map_or_else(scene_input::unnamed, Ok)?;
    let progress = Progress::start("rendering", style, verbosity).of_pieces(shots.len());
    let (mut moment, mut described_as): (Option<Moment>, String) = (None, String::new());
    let mut names = Vec::new();
    for (i, shot) in shots.iter().enumerate() {
        if moment.is_none() || shot.at.is_some() {
            let mut changes = args.changes.clone();
            changes.at = shot.at.or(changes.at);
            let quietly = if i == 0 { verbosity } else { crate::console::Verbosity::Quiet };
            let loaded = threads.run(|| scene_input::read(&name, &changes, limits(args), quietly))?;
            if i == 0 {
                if args.outputs.is_empty() {
                    let format = if wants_floats(args) { Format::Exr } else { Format::Png };
                    let stem = &loaded.source.stem;
                    let unnamed = shots
                        .iter()
                        .map(|shot| targets::unnamed(&format!("{stem}-{}", shot.label), format, &mut outputs, &loaded.inputs));
                    targets = unnamed.map(|target| target.map(|target| vec![target])).collect::<Result<_, _>>()?;
                }
                scene_input::tell_completed(&loaded, verbosity);
            }
            outputs.keep_clear_of(&loaded.inputs)?;
            moment = Some(Moment { silhouette: Silhouette::of(&loaded.scene), loaded, ready: None });
        }
        let Some(Moment { loaded, silhouette, ready }) = &mut moment else { continue };
        let mut own = args.clone();
        (own.view.view, own.changes.at) = (seen_from(shot, silhouette), shot.at.or(args.changes.at));
        let mut plan = plan::settle(&loaded.scene, &own, |view, fov, aspect| {
            silhouette.frame(view.unwrap_or_else(|| silhouette.front()), fov, aspect)
        })?;
        plan::choose(&args.choices, &mut loaded.scene, &mut plan.settings)?;
        plan.display.output = plan.settings.output;
        let turned = match (&mut *ready, &plan.settings.camera) {
            (Some(ready), Some(camera)) => ready.turn_to(&loaded.scene, camera),
            _ => false,
        };
        if !turned {
            *ready = Some(threads.run(|| prepared(loaded, &plan.settings, &Watch::until(stop)))?);
        }
        let Some(ready) = ready else { continue };
        if i == 0 {
            tell::tell_effects(loaded, ready.effects(), verbosity);
            tell::tell_lost(loaded, ready, verbosity);
            tell::tell_clamp(loaded, ready, &plan.settings, verbosity);
            refuse_to_denoise(args, &plan.settings, ready)?;
        }
        let metadata = origin::metadata(loaded, &plan, &args.choices);
        let identity = origin::identity(loaded, &own.changes, &args.choices);
        let mut session = Session::start(args, ready, identity, metadata, plan.display, limits(args))?;
        threads.run(|| session.render(ready, &progress, &args.report, (&clock, stop)))?;
        let quiet = crate::args::ReportArgs { quiet: true, ..args.report.clone() };
        let rendered = threads.run(|| denoise::rendered(session.film(), &quiet, stop));
        let is_free = |path: &Path| outputs.leave_free(path, &loaded.inputs);
        if !session.is_done() {
            progress.finish();
            return Err(write::interrupted(&rendered, &targets[i], plan.display, session.metadata(), is_free));
        }
        if i == 0 {
            tell::tell_exposure(&rendered, plan.display, &targets[i], verbosity);
        }
        names.extend(write::write(&rendered, &targets[i], plan.display, session.metadata(), is_free)?);
        described_as = described(&plan.settings, &session, &rendered);
        progress.finish_piece();
    }
    progress.finish();
    if let [first, .., last] = names.as_slice() {
        let (count, took) = (names.len(), spoken(clock.total()));
        verbosity.say(format_args!("wrote {first} to {last} ({count} pictures, {described_as}, {took})"));
    } else {
        verbosity.say(format_args!("wrote {} ({described_as}, {})", names.join(", "), spoken(clock.total())));
    }
    Ok(())
}

/// From where a picture is taken, where that is not the scene's own camera.
fn seen_from(shot: &Shot, silhouette: &Silhouette) -> Option<View> {
    let Some(turn) = shot.turn else { return shot.view };
    let view = shot.view.unwrap_or_else(|| silhouette.front());
    Some(View { azimuth: view.azimuth + turn, ..view })
}

/// Flags that mean one picture.
fn refuse_what_is_of_one_picture(args: &RenderArgs) -> Result<(), Failure> {
    let film = &args.film;
    let flags = [
        ("--checkpoint", film.checkpoint.is_some()),
        ("--resume", film.resume.is_some()),
        ("--replay", film.replay.is_some()),
        ("--part", film.part.is_some()),
        ("--budget", film.budget.is_some()),
        ("--stats", args.report.stats.is_some()),
        ("-o -", args.outputs.iter().any(|path| path == Path::new("-"))),
    ];
    match flags.iter().find(|(_, given)| *given) {
        Some((flag, _)) => {
            let error = Error::usage(format_args!("{flag} is of one picture, and several are asked for"));
            Err(error.with_hint("leave it away, or render the pictures one by one").into())
        }
        None => Ok(()),
    }
}

/// The targets of each of several pictures, by names with a place for its number.
fn named(outputs: &[PathBuf], count: usize, all: &mut Outputs) -> Result<Vec<Vec<Target>>, Failure> {
    let numbered = |path: &PathBuf, number: usize| match with_number(&path.to_string_lossy(), number) {
        Some(name) => Ok(PathBuf::from(name)),
        None if count == 1 => Ok(path.clone()),
        None => {
            let error = Error::usage(format_args!("{count} pictures cannot all be {}", path.display()));
            let stem = path.file_stem().unwrap_or_default().to_string_lossy();
            let numbered = path.with_file_name(format!("{stem}-%04d")).with_extension(path.extension().unwrap_or_default());
            Err(error.with_hint(format!("number them: -o {}", numbered.display())))
        }
    };
    let of = |number: usize| outputs.iter().map(|path| numbered(path, number)).collect::<Result<Vec<_>, _>>();
    (0..count).map(|number| targets::pictures(&of(number)?, all)).collect()
}

/// A name with a number in place of `%d` or `%04d`; none where it has no such place.
fn with_number(name: &str, number: usize) -> Option<String> {
    let (before, rest) = name.split_once('%')?;
    let (digits, after) = rest.split_once('d')?;
    let width =
        if digits.is_empty() { 0 } else { digits.strip_prefix('0')?.parse().ok().filter(|&width: &usize| width <= 20)? };
    Some(format!("{before}{number:0width$}{after}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::values;

    /// Protects: numbers stand where a name has a place for them, with as many digits, and nowhere else.
    #[test]
    fn names_are_numbered() {
        assert_eq!(with_number("a-%04d.png", 7).as_deref(), Some("a-0007.png"));
        assert_eq!(with_number("%d/%d.png", 12).as_deref(), Some("12/%d.png"));
        assert_eq!(with_number("a%03dx.exr", 12345).as_deref(), Some("a12345x.exr"));
        for name in ["a.png", "100%.png", "a%4d.png", "a%0xd.png", "a%099d.png"] {
            assert_eq!(with_number(name, 1), None, "{name}");
        }
    }

    /// Protects: each flag makes the pictures that it says, in order, and none asks for the usual one.
    #[test]
    fn flags_make_pictures() {
        assert!(shots(&ViewArgs::default()).is_empty());
        let views = values::views("front,30,-20,iso").expect("views");
        let found = shots(&ViewArgs { views: Some(views), ..ViewArgs::default() });
        let labels: Vec<_> = found.iter().map(|shot| shot.label.as_str()).collect();
        assert_eq!(labels, ["front", "30_-20", "iso"]);
        assert_eq!(found[1].view, Some(View { azimuth: 30.0, elevation: -20.0 }));
        let turns = shots(&ViewArgs { turntable: Some(4), ..ViewArgs::default() });
        assert_eq!(turns.iter().map(|shot| shot.turn).collect::<Vec<_>>(), [0.0, 90.0, 180.0, 270.0].map(Some));
        let frames = |text: &str| {
            let frames = Some(values::frames(text).expect("moments"));
            shots(&ViewArgs { frames, ..ViewArgs::default() }).iter().filter_map(|shot| shot.at).collect::<Vec<_>>()
        };
        assert_eq!(frames("0..1:4"), [0.0, 0.25, 0.5, 0.75]);
        assert_eq!((frames("-1..0.5:2"), frames("0..0.1:3")), (vec![-1.0, -0.5, 0.0], vec![0.0]));
        for wrong in ["", "1", "0..1", "1..0:5", "0..1:0", "0..1:-2", "0..1e9:25", "a..b:c"] {
            assert!(values::frames(wrong).is_err(), "{wrong}");
        }
        assert!(values::views("front,top,sideways").is_err() && values::views("30").is_err());
    }
}
