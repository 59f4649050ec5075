//! `render`: a scene becomes pictures.

use std::io::{self, IsTerminal};
use std::path::Path;

use raywright_core::effects::EffectReport;
use raywright_core::settings::Settings;
use raywright_core::{Ready, Rendered, extent};
use raywright_io::output::{self, Metadata, write_atomically};
use raywright_io::{Error, Limits, Loaded};

use crate::args::RenderArgs;
use crate::clock::{Clock, Seconds, spoken};
use crate::commands::explain;
use crate::console::{self, Verbosity};
use crate::failure::{Exit, Failure};
use crate::plan::{self, Plan};
use crate::progress::Progress;
use crate::ready::{NOTHING_KEPT, framed, prepared};
use crate::stats::Stats;
use crate::table::lay_out;
use crate::targets::{self, Outputs, Target};
use crate::threads::Threads;
use crate::watch::Watch;
use crate::{interrupt, memory, origin, scene_input};

/// Renders a scene and writes its pictures.
pub fn run(args: &RenderArgs) -> Result<(), Failure> {
    let mut clock = Clock::start();
    let verbosity = args.report.verbosity();
    let mut outputs = Outputs::default();
    let mut targets = targets::pictures(&args.outputs, &mut outputs)?;
    refuse_terminal(&targets)?;
    refuse_layers_without_place(args, &targets)?;
    check_stats_target(args, &mut outputs)?;
    let (stop, threads) = (interrupt::flag()?, Threads::new(args.machine.threads)?);

    let name = args.scene.clone().map_or_else(scene_input::unnamed, Ok)?;
    let style = args.report.progress;
    let mut loaded = threads.run(|| scene_input::watched(&name, &args.changes, limits(args), verbosity, style))?;
    if targets.is_empty() {
        targets = vec![targets::unnamed(&loaded.source.stem, &mut outputs, &loaded.inputs)?];
    }
    outputs.keep_clear_of(&loaded.inputs)?;
    scene_input::complete(&mut loaded, &args.changes, verbosity);
    let mut plan = plan::settle(&loaded.scene, args, |settings| framed(&loaded.scene, settings))?;
    plan::choose(&args.choices, &mut loaded.scene, &mut plan.settings)?;
    let load = clock.lap();

    let ready = threads.run(|| prepared(&loaded, &plan.settings, &Watch { progress: None, stop }))?;
    let prepare = clock.lap();
    tell_effects(&loaded, ready.effects(), verbosity);
    tell_lost(&loaded, &ready, verbosity);

    let progress = Progress::start("rendering", style, verbosity);
    let rendered = threads.run(|| ready.render(&Watch { progress: Some(&progress), stop }));
    progress.finish();
    let render = clock.lap();

    let metadata = origin::metadata(&loaded, &plan, &args.choices);
    let is_free = |path: &Path| outputs.leave_free(path, &loaded.inputs);
    if !rendered.finished {
        return Err(interrupted(&rendered, &targets, &plan, &metadata, is_free));
    }
    tell_nothing_met(&loaded, &rendered, &plan.settings, verbosity);
    let written = write(&rendered, &targets, &plan, &metadata, is_free)?;
    let write = clock.lap();
    let seconds = Seconds { load, prepare, render, write, total: clock.total() };
    if let Some(path) = &args.report.stats {
        write_atomically(path, console::json(&Stats::new(&loaded, &ready, &rendered, seconds)).as_bytes())?;
    }
    verbosity.detail(details(&ready, &rendered, &seconds).trim_end());
    if !written.is_empty() {
        verbosity.say(format_args!("{written} ({}, {})", described(&plan.settings), spoken(seconds.total)));
    }
    Ok(())
}

/// Binary data would garble a terminal.
fn refuse_terminal(targets: &[Target]) -> Result<(), Failure> {
    if targets.contains(&Target::Stdout) && io::stdout().is_terminal() {
        let error = Error::usage("standard output is a terminal, which cannot show a PNG");
        return Err(error.with_hint("send it to a file or a program: raywright render -o - > picture.png").into());
    }
    Ok(())
}

/// Layers fit into an EXR only.
fn refuse_layers_without_place(args: &RenderArgs, targets: &[Target]) -> Result<(), Failure> {
    if args.aov.is_empty() || targets.iter().any(Target::has_layers) {
        return Ok(());
    }
    let error = Error::usage("--aov adds layers to an .exr picture, and none is written");
    Err(error.with_hint("add one: -o picture.exr").into())
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

/// What the scene has and the picture will not show; all effects where the user asks for more.
fn tell_effects(loaded: &Loaded, report: &EffectReport, verbosity: Verbosity) {
    if verbosity == Verbosity::Verbose {
        return verbosity.detail(explain::text(&loaded.source, report));
    }
    let names: Vec<&str> = report.left_out().map(|finding| finding.effect.name()).collect();
    if !names.is_empty() {
        let name = &loaded.source.name;
        verbosity.warn(format_args!("left out: {} (why, and what to do: raywright explain {name})", names.join(", ")));
    }
}

/// Objects that vanish without being left out.
fn tell_lost(loaded: &Loaded, ready: &Ready, verbosity: Verbosity) {
    let [first, others @ ..] = ready.lost() else { return };
    let object = match loaded.scene.objects.get(*first as usize) {
        Some(object) if !object.name.is_empty() => format!("object `{}`", object.name),
        _ => format!("object {first}"),
    };
    let more = if others.is_empty() { String::new() } else { format!(" and {} more", others.len()) };
    verbosity.warn(format_args!(
        "nothing is seen of {object}{more}: so far from the origin, single precision takes the corners of such small triangles for \
         one; move the mesh nearer, or add --precision reference"
    ));
}

/// A picture that shows the background alone is seldom what was meant.
fn tell_nothing_met(loaded: &Loaded, rendered: &Rendered, settings: &Settings, verbosity: Verbosity) {
    if rendered.counters.met > 0 {
        return;
    }
    let bounds = extent(&loaded.scene, settings.precision).bounds;
    if bounds.is_empty() {
        return;
    }
    let show = |[x, y, z]: [f64; 3]| format!("({x:.6}, {y:.6}, {z:.6})");
    verbosity.warn(format_args!(
        "no camera ray met anything: the scene lies between {} and {}; turn the camera there with --eye and --target",
        show(bounds.min.to_array()),
        show(bounds.max.to_array())
    ));
}

fn limits(args: &RenderArgs) -> Limits {
    let own = Limits::default();
    Limits { memory_bytes: args.machine.max_memory.unwrap_or(own.memory_bytes), ..own }
}

/// Writes the picture everywhere it should go; what was written, in words.
fn write(
    rendered: &Rendered,
    targets: &[Target],
    plan: &Plan,
    metadata: &Metadata,
    is_free: impl Fn(&Path) -> bool,
) -> Result<String, Failure> {
    let mut written = Vec::new();
    for target in targets {
        match target {
            Target::Stdout => {
                let bytes =
                    output::png_bytes(&rendered.picture, plan.display, metadata).map_err(|error| Failure::stdout(&error))?;
                console::print(bytes)?;
            }
            Target::File(path, _) => {
                output::write_picture(path, &rendered.picture, plan.display, metadata)?;
                written.push(path.display().to_string());
            }
            // Something else may lie there by now; a picture that took an hour is not given up for it.
            Target::Unnamed(path) => {
                let is_free = |other: &Path| other == path || is_free(other);
                let name = output::write_unnamed_picture(path, &rendered.picture, plan.display, metadata, is_free)?;
                written.push(name.display().to_string());
            }
        }
    }
    Ok(if written.is_empty() { String::new() } else { format!("wrote {}", written.join(", ")) })
}

/// Keeps what there is of a picture that was stopped, under names that nobody chose and that replace nobody's files.
fn interrupted(
    rendered: &Rendered,
    targets: &[Target],
    plan: &Plan,
    metadata: &Metadata,
    is_free: impl Fn(&Path) -> bool,
) -> Failure {
    let mut kept = Vec::new();
    let something = rendered.counters.samples > 0;
    for path in targets.iter().filter_map(Target::path).filter(|_| something) {
        let partial = output::partial_name(path);
        match output::write_unnamed_picture(&partial, &rendered.picture, plan.display, metadata, &is_free) {
            Ok(name) => kept.push(name.display().to_string()),
            Err(error) => return Failure { exit: Exit::Interrupted, message: error.to_string() },
        }
    }
    let message = match kept.is_empty() {
        true => NOTHING_KEPT.to_owned(),
        false => format!("interrupted; what was finished is in {}", kept.join(", ")),
    };
    Failure::new(Exit::Interrupted, message)
}

/// What `-v` adds: where the time went, what was traced, what was held in memory.
fn details(ready: &Ready, rendered: &Rendered, seconds: &Seconds) -> String {
    let rays = &rendered.counters;
    let stages = [("load", seconds.load), ("prepare", seconds.prepare), ("render", seconds.render), ("write", seconds.write)];
    let kinds = [
        ("camera", rays.camera),
        ("reflection", rays.reflection),
        ("refraction", rays.refraction),
        ("scatter", rays.scatter),
        ("shadow", rays.shadow),
    ];
    let settings = ready.settings();
    let rows = [
        ("time", stages.map(|(name, seconds)| format!("{name} {}", spoken(seconds))).join(", ")),
        ("rays", kinds.iter().filter(|(_, n)| *n > 0).map(|(name, n)| format!("{n} {name}")).collect::<Vec<_>>().join(", ")),
        ("memory", memory::listed(&ready.memory().parts())),
        (
            "method",
            format!(
                "{} primitives, {}, {} precision, {} kernel",
                ready.tables().primitives,
                origin::accelerator(settings.accelerator),
                origin::precision(settings.precision),
                ready.kernel_name()
            ),
        ),
    ];
    lay_out(&rows.map(|(name, text)| [name.to_owned(), text]))
}

/// The picture in a few words.
fn described(settings: &Settings) -> String {
    let [width, height] = settings.crop.map_or(settings.size, |crop| [crop.width, crop.height]);
    let samples = settings.sampling.count();
    format!("{width}x{height}, {samples} {}", if samples == 1 { "sample" } else { "samples" })
}

#[cfg(test)]
mod tests {
    use raywright_core::{Observer, Scene, prepare};

    use super::*;

    struct Stopped;

    impl Observer for Stopped {
        fn cancelled(&self) -> bool {
            true
        }
    }

    /// Protects: a render that was stopped before its first tile leaves no picture, which would be black; one that was not keeps
    /// what it has, beside whatever lies under that name.
    #[test]
    fn only_what_was_made_is_kept() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let at = |name: &str| folder.path().join(name);
        let settings = Settings { size: [8, 8], ..Settings::of(&Scene::default()) };
        let plan = Plan { settings, display: Default::default() };
        let ready = prepare(&Scene::default(), &plan.settings, &()).expect("nothing is wrong with an empty scene");
        let targets = [Target::File(at("a.png"), output::Format::Png), Target::Stdout];
        let end = |rendered: &Rendered| {
            let failure = interrupted(rendered, &targets, &plan, &Metadata::default(), |_| true);
            assert_eq!(failure.exit, Exit::Interrupted);
            failure.message
        };
        assert_eq!(end(&ready.render(&Stopped)), "error: interrupted; nothing was written");
        assert_eq!(std::fs::read_dir(folder.path()).expect("a folder").count(), 0);
        std::fs::write(at("a.partial.png"), "mine").expect("a file");
        let kept = at("a.partial-2.png");
        assert_eq!(end(&ready.render(&())), format!("error: interrupted; what was finished is in {}", kept.display()));
        assert_eq!(std::fs::read(at("a.partial.png")).expect("a file"), b"mine");
        assert!(kept.exists());
    }

    /// Protects: the size that is reported is that of what was rendered, and one sample is not several.
    #[test]
    fn the_size_told_is_the_crops() {
        use raywright_core::scene::Pattern;
        use raywright_core::settings::{Crop, Sampling};
        let whole = Settings { size: [8, 6], sampling: Sampling::Pattern(Pattern::Centre), ..Settings::of(&Scene::default()) };
        assert_eq!(described(&whole), "8x6, 1 sample");
        let crop = Some(Crop { x: 1, y: 2, width: 3, height: 4 });
        assert_eq!(described(&Settings { crop, sampling: Sampling::Pattern(Pattern::Corners), ..whole }), "3x4, 4 samples");
    }
}
