//! What `render` says besides its result: what is left out, lost or not met, and with `-v` where the time went.

use raywright_core::display::Display;
use raywright_core::effects::EffectReport;
use raywright_core::film::{Doubt, Estimate, Film, Uncertainty};
use raywright_core::prepare::{ClosedGap, ShutAway};
use raywright_core::settings::{PrecisionChoice, Settings};
use raywright_core::{Ready, Rendered, extent};
use raywright_io::{Loaded, Warning};

use crate::clock::{Seconds, spoken};
use crate::commands::explain;
use crate::console::{Verbosity, on_one_line};
use crate::table::{lay_out, significant};
use crate::targets::Target;
use crate::{memory, origin};

/// What the scene has and the picture will not show; all effects where the user asks for more.
pub(super) fn tell_effects(loaded: &Loaded, report: &EffectReport, verbosity: Verbosity) {
    if verbosity == Verbosity::Verbose {
        return verbosity.detail(explain::text(&loaded.source, report));
    }
    let names: Vec<&str> = report.left_out().map(|finding| finding.effect.name()).collect();
    if !names.is_empty() {
        let name = &loaded.source.name;
        verbosity.warn(format_args!("left out: {} (why, and what to do: raywright explain {name})", names.join(", ")));
    }
}

/// What a clamp does to the picture, also for the list of warnings in the statistics.
pub(super) fn tell_clamp(loaded: &mut Loaded, ready: &Ready, settings: &Settings, verbosity: Verbosity) {
    let Some(most) = settings.clamp else { return };
    let message = if ready.follows_paths() {
        format!(
            "samples brighter than {most} are dimmed to it: the picture is darker than the true one where there are any (bias)"
        )
    } else {
        "--clamp dims samples of paths alone, and none are followed".to_owned()
    };
    verbosity.warn(&message);
    loaded.warnings.push(Warning { message });
}

/// Objects that vanish without being left out.
pub(super) fn tell_lost(loaded: &Loaded, ready: &Ready, verbosity: Verbosity) {
    let [first, others @ ..] = ready.lost() else { return };
    let object = object_name(loaded, *first as usize);
    let more = if others.is_empty() { String::new() } else { format!(" and {} more", others.len()) };
    verbosity.warn(format_args!(
        "nothing is seen of {object}{more}: so far from the origin, single precision takes the corners of such small triangles for \
         one; move the mesh nearer, or add --precision reference"
    ));
}

/// Bodies so near to each other that light passes from the one to beyond the other.
pub(super) fn tell_closed_gaps(loaded: &mut Loaded, ready: &Ready, settings: &Settings, verbosity: Verbosity) {
    let gaps = ready.closed_gaps();
    let [ClosedGap { object, other, resolved }, others @ ..] = gaps.as_slice() else { return };
    let [object, other] = [object, other].map(|&index| object_name(loaded, index));
    let more = if others.is_empty() { String::new() } else { format!(" (and {} more such pairs)", others.len()) };
    let exact = if settings.precision == PrecisionChoice::Reference { "" } else { ", or add --precision reference" };
    let message = format!(
        "the gap between {object} and {other}{more} is closed: light that passes the one starts beyond the other, since they touch or are \
         nearer than rounding tells apart; leave {} metres or more between them{exact}",
        significant(*resolved, 2)
    );
    verbosity.warn(&message);
    loaded.warnings.push(Warning { message });
}

/// An object by its name, or by its place in the scene's list, of which the generated ones are the last.
fn object_name(loaded: &Loaded, index: usize) -> String {
    match loaded.scene.objects.get(index) {
        Some(object) if !object.name.is_empty() => format!("object `{}`", on_one_line(&object.name)),
        _ => format!("object {}", index + 1),
    }
}

/// A picture that shows the background alone is seldom what was meant.
pub(super) fn tell_nothing_met(loaded: &Loaded, rendered: &Rendered, settings: &Settings, verbosity: Verbosity) {
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

/// What to try where more than a tenth of the pixels of a display picture is clipped, or black that is not so in the scene: the exposure
/// that changes it, in whole stops.
pub(super) fn tell_exposure(rendered: &Rendered, display: Display, targets: &[Target], verbosity: Verbosity) {
    const LOOKED_AT: usize = 1 << 16;
    if targets.iter().all(Target::has_layers) {
        return;
    }
    let rgb = &rendered.shown().rgb;
    let pixels: Vec<[f32; 3]> = rgb.iter().step_by(rgb.len() / LOOKED_AT + 1).copied().collect();
    let shares = |stops: f64| {
        let map = Display { exposure_stops: stops, ..display }.prepare();
        let codes = pixels.iter().map(|&pixel| (pixel, map.codes(pixel)));
        let (mut clipped, mut black) = (0, 0);
        for (pixel, codes) in codes {
            clipped += usize::from(codes.contains(&255));
            black += usize::from(codes == [0; 3] && pixel.iter().any(|&channel| channel > 0.0));
        }
        [clipped, black].map(|count| count as f64 / pixels.len().max(1) as f64)
    };
    let own = display.exposure_stops;
    let [clipped, black] = shares(own);
    let (what, share, which, step) = match (clipped > TOO_MANY, black > TOO_MANY) {
        (false, false) => return,
        (true, _) => ("clipped", clipped, 0, -1.0),
        (false, true) => ("black", black, 1, 1.0),
    };
    let better = (1..=12).map(|steps| own + step * f64::from(steps)).find(|&stops| shares(stops)[which] <= TOO_MANY);
    if let Some(stops) = better {
        verbosity.say(format_args!("note: {:.0} % of the pixels are {what}; try --exposure {stops}", 100.0 * share));
    }
}

/// Share of a picture that is told.
const TOO_MANY: f64 = 0.1;

/// Lights of which nothing was seen; no warning, since who puts a lamp into a box may mean it.
pub fn tell_shut_away(loaded: &Loaded, ready: &Ready, film: &Film, verbosity: Verbosity) {
    let shut = ready.shut_away(film);
    let light = |shut: &ShutAway| match *shut {
        ShutAway::Light { index, .. } => match loaded.scene.lights.get(index) {
            Some(light) if !light.name.is_empty() => format!("light `{}`", on_one_line(&light.name)),
            _ => format!("light {}", index + 1),
        },
        ShutAway::Object { index, .. } => object_name(loaded, index),
    };
    let rays: u64 = shut.iter().map(|&(ShutAway::Light { rays, .. } | ShutAway::Object { rays, .. })| rays).sum();
    let stopped = format!("all {rays} rays there were stopped");
    match shut.as_slice() {
        [] => {}
        [one] => verbosity.say(format_args!("nothing is lit by {}: {stopped}", light(one))),
        [first, .., last] => {
            let others = if shut.len() > 2 { format!(", {} more", shut.len() - 2) } else { String::new() };
            verbosity.say(format_args!("nothing is lit by {}{others} and {}: {stopped}", light(first), light(last)));
        }
    }
}

/// How far the picture probably is from the true one, the denoised one too, and whether that is what was asked for.
pub fn tell_noise(film: &Film, rendered: &Rendered, asked: Option<f64>, verbosity: Verbosity) {
    let Some(noisy) = film.uncertainty() else { return };
    let reaches = |asked| rendered.denoised().map_or(noisy.reaches(asked), |denoised| denoised.reaches(asked, &noisy));
    if let Some(asked) = asked.filter(|&asked| !reaches(asked)) {
        verbosity.warn(format_args!(
            "the error of {asked} that was asked for is not reached; more --spp or a longer --budget comes nearer"
        ));
    }
    let noise = told(&noisy);
    match noisy.doubt {
        None => verbosity.say(format_args!("noise: {noise}")),
        Some(Doubt::FewSamples) => {
            let [relative, absolute] = [noisy.root_relmse, noisy.rmse].map(|of| significant(of.value, 2));
            verbosity.say(format_args!(
                "noise: root relMSE about {relative}, RMSE about {absolute} (how sure that is, 64 samples or more tell)"
            ));
        }
        Some(Doubt::FewPixels | Doubt::WideInterval) => verbosity.warn(format_args!(
            "not converged: a few pixels carry most of the noise ({noise}), as where light is rarely found; more --spp finds it more often"
        )),
        Some(Doubt::LightByChance) => verbosity.warn(format_args!(
            "not converged: lamps and suns that shine by way of mirrors or glass are met by chance, and only {} of {} such paths met one ({noise}); \
             more --spp meets more",
            film.counters().found,
            film.counters().unaided
        )),
    }
    tell_denoised(rendered, verbosity);
}

/// Both errors with their intervals.
fn told(of: &Uncertainty) -> String {
    let shown =
        |of: Estimate| format!("{} ({} to {})", significant(of.value, 3), significant(of.low, 3), significant(of.high, 3));
    format!("root relMSE {}, RMSE {}", shown(of.root_relmse), shown(of.rmse))
}

/// What is claimed of a denoised picture, or why there is none.
fn tell_denoised(rendered: &Rendered, verbosity: Verbosity) {
    let denoised = match &rendered.denoised {
        None => return,
        Some(Err(error)) => return verbosity.warn(format_args!("not denoised: {error}")),
        Some(Ok(denoised)) => denoised,
    };
    let light =
        format!("{}{} % light", if denoised.brightened < 0.0 { "" } else { "+" }, significant(100.0 * denoised.brightened, 2));
    let error = match denoised.error.doubt {
        None => told(&denoised.error),
        Some(Doubt::LightByChance) => format!("{}, but for light that was not found", told(&denoised.error)),
        Some(_) => format!("root relMSE not known, at most about {}", significant(denoised.error.root_relmse.high, 2)),
    };
    verbosity.say(format_args!("denoised (biased): {error}; {light}"));
}

/// What `-v` adds: where the time went, what was traced, what was held in memory.
pub(super) fn details(ready: &Ready, rendered: &Rendered, seconds: &Seconds) -> String {
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
