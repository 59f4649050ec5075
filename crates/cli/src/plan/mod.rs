//! What a render's arguments amount to for one scene: settings and display, checked. Mistakes that need the scene to be
//! seen - a camera that it has not, a crop outside its picture - are found here, before anything is computed.

mod rungs;
mod view;

pub use rungs::choose;

use raywright_core::Settings;
use raywright_core::display::Display;
use raywright_core::framing::View;
use raywright_core::ladder::Ladder;
use raywright_core::scene::{Camera, Scene};
use raywright_core::settings::{Crop, Sampling};
use raywright_io::{Error, Limits};

use crate::args::{MOST_SAMPLES, RenderArgs};
use crate::failure::Failure;

/// Samples of a pixel for a first look.
const QUICK_SAMPLES: u32 = 16;

/// How one picture is made.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Everything that decides the picture's numbers besides the scene.
    pub settings: Settings,
    /// How a PNG shows them.
    pub display: Display,
}

/// Settles what is rendered. `framed` makes the camera that shows a whole scene from a view under a vertical angle, for an aspect; it is
/// asked only where a flag says something of that camera.
pub fn settle(scene: &Scene, args: &RenderArgs, framed: impl FnOnce(Option<View>, f64, f64) -> Camera) -> Result<Plan, Failure> {
    rungs::refuse_two_words(args)?;
    let (view, light, display) = (&args.view, &args.light, &args.display);
    let own = Settings::of(scene);
    let size = view.size.unwrap_or(own.size);
    let mut settings = Settings {
        size,
        crop: view.crop.map(|crop| within(crop, size)).transpose()?,
        sampling: sampling(scene, args),
        max_depth: light.max_depth.unwrap_or(own.max_depth),
        clamp: light.clamp,
        integrator: light.integrator.unwrap_or(own.integrator),
        max_error: light.max_error,
        denoise: light.denoise || light.quick,
        seed: light.seed.unwrap_or(own.seed),
        precision: light.precision.map_or(own.precision, Into::into),
        accelerator: args.machine.accel.map_or(own.accelerator, Into::into),
        background: view.background.unwrap_or(own.background),
        aovs: args.aov.clone(),
        max_memory: Some(args.machine.max_memory.unwrap_or(Limits::default().memory_bytes)),
        ..own
    };
    let aspect = f64::from(size[0]) / f64::from(size[1]);
    settings.camera = view::camera(scene, view, |view, fov| framed(view, fov, aspect))?;
    let own = Display::of(&scene.render);
    let display = Display {
        tone_map: display.tonemap.unwrap_or(own.tone_map),
        curve: display.gamma.unwrap_or(own.curve),
        exposure_stops: display.exposure.unwrap_or(own.exposure_stops),
        ..own
    };
    Ok(Plan { settings, display })
}

/// Samples of a pixel: a time or an error that was asked for instead takes as many as there may be. A pattern says where samples lie
/// and has no others; its error is none that more of them would lower.
fn sampling(scene: &Scene, args: &RenderArgs) -> Sampling {
    let named = args.light.spp.is_some() || args.choices.rungs.iter().any(|choice| choice.ladder() == Ladder::Samples);
    let open_ended = (args.film.budget.is_some() || args.film.replay.is_some()) && !named;
    match Sampling::resolve(scene, args.light.spp) {
        Sampling::General(_) if open_ended => Sampling::General(MOST_SAMPLES),
        Sampling::General(own) if args.light.quick => Sampling::General(own.min(QUICK_SAMPLES)),
        _ if args.light.max_error.is_some() => Sampling::General(args.light.spp.unwrap_or(MOST_SAMPLES)),
        other => other,
    }
}

/// The crop, if it lies inside the picture.
fn within(crop: Crop, [width, height]: [u32; 2]) -> Result<Crop, Failure> {
    let fits = |start: u32, extent: u32, whole: u32| start.checked_add(extent).is_some_and(|end| end <= whole);
    if fits(crop.x, crop.width, width) && fits(crop.y, crop.height, height) {
        return Ok(crop);
    }
    let Crop { x, y, width: w, height: h } = crop;
    let message = format!("--crop {x},{y},{w},{h} reaches outside the picture of {width}x{height} pixels");
    Err(Error::usage(message).with_hint("--crop is x,y,width,height, counted from the top left").into())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: each edge of a crop is held against its own extent of the picture, to the last pixel, and no sum wraps round.
    #[test]
    fn crops_lie_inside_the_picture() {
        let fits = |x, y, width, height| within(Crop { x, y, width, height }, [100, 60]).is_ok();
        assert!(fits(0, 0, 100, 60) && fits(99, 59, 1, 1));
        assert!(!fits(0, 0, 101, 60) && !fits(1, 0, 100, 60), "right");
        assert!(!fits(0, 0, 100, 61) && !fits(0, 50, 10, 11) && !fits(0, 60, 1, 1), "below, in a wide picture");
        assert!(!fits(u32::MAX, 0, 1, 1) && !fits(0, u32::MAX, 1, 1));
    }
}
