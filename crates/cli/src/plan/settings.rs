//! Settings of a picture: those of the scene, as changed by the flags of a run. Flags that contradict
//! the chosen rungs (quality levels of settings) are refused.

use std::cell::OnceCell;

use raywright_core::denoise::is_denoisable_sampling;
use raywright_core::display::Display;
use raywright_core::effects::{Effect, EffectSet, assess_effects};
use raywright_core::framing::{FIELD_OF_VIEW, Silhouette, ViewAngles};
use raywright_core::ladder::{Ladder, RungChoice};
use raywright_core::scene::{Camera, Scene};
use raywright_core::settings::{Background, Crop, Sampling};
use raywright_core::{Observer, ReadyScene, Settings};
use raywright_io::LoadedScene;

use crate::args::{BackgroundChoice, ChoiceArgs, ExposureChoice, MOST_SAMPLES};
use crate::failure::Failure;
use crate::plan::display::{ChosenExposure, apply_display_flags, choose_exposure};
use crate::plan::{DisplayOverrides, PictureJob, RenderTask, view};
use crate::preparation::prepare_loaded;

/// Samples per pixel of a model that is denoised: at 1280×720 they have half of the squared error of
/// 64 noisy samples in 0.4 of the time (`benches/runs/2026-11-30-models.md`).
const MODEL_SAMPLES: u32 = 16;
/// Samples per pixel of a quick preview.
const QUICK_SAMPLES: u32 = 8;
/// Largest width and height of a quick preview, in pixels.
const QUICK_SIZE: [u32; 2] = [640, 360];

/// Settings of a picture, and its conversion to display values.
#[derive(Clone, Debug)]
pub struct PicturePlan {
    /// Settings that determine the pixel values, together with the scene.
    pub settings: Settings,
    /// Conversion of pixel values to display values, for all formats but EXR.
    pub display: Display,
    /// Exposure that the user requests; `None`: that of the scene, or of a model's own lights.
    pub requested_exposure: Option<ExposureChoice>,
    /// Whether the view leaves out stray parts of the scene.
    pub has_stray_parts: bool,
}

impl PicturePlan {
    /// Applies a chosen exposure to the picture, and to the backdrop of its studio.
    pub fn apply_exposure(&mut self, chosen: ChosenExposure, ready: &mut ReadyScene) {
        ready.set_backdrop_exposure(chosen.lights);
        self.display.exposure_stops = chosen.display.unwrap_or(self.display.exposure_stops);
    }
}

impl RenderTask {
    /// Resolves the settings of a picture of a scene, and applies the chosen rungs (quality levels)
    /// to the scene. A scene without a camera is framed. The silhouette is computed only if a
    /// camera frames the whole scene.
    pub fn resolve_job(
        &self,
        loaded: &mut LoadedScene,
        job: &PictureJob,
        silhouette: &OnceCell<Silhouette>,
    ) -> Result<PicturePlan, Failure> {
        let scene = &mut loaded.scene;
        let view = job.resolve_view(|| silhouette.get_or_init(|| Silhouette::from_scene(scene)));
        let frame = |scene: &Scene, view: Option<ViewAngles>, fov, aspect| {
            let silhouette = silhouette.get_or_init(|| Silhouette::from_scene(scene));
            let view = view.unwrap_or_else(|| silhouette.default_view());
            silhouette.frame_camera(view, fov, aspect)
        };
        let mut plan = self.resolve_plan(scene, view, frame)?;
        let [width, height] = plan.settings.size.map(f64::from);
        plan.settings
            .camera
            .get_or_insert_with(|| frame(scene, None, FIELD_OF_VIEW, width / height));
        plan.has_stray_parts = silhouette.get().is_some_and(Silhouette::has_stray_parts);
        self.denoise_by_default(loaded, &mut plan.settings);
        Ok(plan)
    }

    /// Resolves the settings of the task's first picture, prepares its scene, and chooses and applies
    /// its exposure.
    pub fn prepare_first_job(
        &self,
        loaded: &mut LoadedScene,
        silhouette: &OnceCell<Silhouette>,
        observer: &dyn Observer,
    ) -> Result<(PicturePlan, ReadyScene, ChosenExposure), Failure> {
        let mut plan = self.resolve_job(loaded, &self.jobs[0], silhouette)?;
        let mut ready = prepare_loaded(loaded, &plan.settings, observer)?;
        let requested = (plan.display, plan.requested_exposure);
        let exposure = choose_exposure(loaded, &ready, requested, observer);
        plan.apply_exposure(exposure, &mut ready);
        Ok((plan, ready, exposure))
    }

    /// Resolves the settings of a picture of a scene from a view, and applies the chosen rungs
    /// (quality levels of settings) to the scene. `framed` returns the camera that frames the whole
    /// scene, for a view, a vertical field of view in degrees and an aspect ratio. It is called
    /// only if the picture needs that camera and a flag changes the camera.
    pub fn resolve_plan(
        &self,
        scene: &mut Scene,
        view: Option<ViewAngles>,
        framed: impl Fn(&Scene, Option<ViewAngles>, f64, f64) -> Camera,
    ) -> Result<PicturePlan, Failure> {
        refuse_contradicting_flags(&self.choices.rungs, &self.overrides)?;
        let DisplayOverrides {
            view: flags,
            light,
            display,
            accel,
        } = &self.overrides;
        let own_settings = Settings::from_scene(scene);
        let size = flags.size.unwrap_or_else(|| {
            if self.is_quick {
                quick_preview_size(own_settings.size)
            } else {
                own_settings.size
            }
        });
        let mut settings = Settings {
            size,
            crop: flags.crop.map(|crop| check_crop(crop, size)).transpose()?,
            sampling: self.resolve_sampling(scene),
            max_depth: light.max_depth.unwrap_or(own_settings.max_depth),
            clamp: light.clamp,
            integrator: light.integrator.unwrap_or(own_settings.integrator),
            max_error: light.max_error,
            denoise: light.denoise || light.quick,
            seed: light.seed.unwrap_or(own_settings.seed),
            precision: light.precision.unwrap_or(own_settings.precision),
            accelerator: accel.unwrap_or(own_settings.accelerator),
            background: match flags.background {
                None => own_settings.background,
                Some(BackgroundChoice::Environment) => Background::Environment,
                // A picture over a background colour is rendered with coverage, and composited
                // afterwards.
                Some(BackgroundChoice::Transparent | BackgroundChoice::Colour(_)) => {
                    Background::Transparent
                }
            },
            wireframe: flags.wireframe,
            edges: flags.edges,
            aovs: self.layers.clone(),
            max_memory: Some(self.options.limits.memory_bytes),
            ..own_settings
        };
        let aspect = f64::from(size[0]) / f64::from(size[1]);
        settings.camera = view::resolve_camera(scene, (flags, view), |view, fov| {
            framed(scene, view, fov, aspect)
        })?;
        let display = Display {
            background: match flags.background {
                Some(BackgroundChoice::Colour(colour)) => Some(colour),
                _ => None,
            },
            ..apply_display_flags(display, Display::from_render(&scene.render))
        };
        self.choices.apply(scene, &mut settings)?;
        Ok(PicturePlan {
            display: Display {
                output: settings.output,
                ..display
            },
            settings,
            requested_exposure: self.overrides.display.exposure,
            has_stray_parts: false,
        })
    }

    /// Whether a flag says that the picture keeps its noise.
    pub fn keeps_noise(&self) -> bool {
        self.overrides.light.no_denoise || self.choices.has_ladder(Ladder::Reconstruction)
    }

    /// Denoises a picture as [`RungChoices::denoise_by_default`] does, unless flags say otherwise or
    /// the run keeps samples, as EXR files, layers and films do.
    fn denoise_by_default(&self, loaded: &LoadedScene, settings: &mut Settings) {
        let light = &self.overrides.light;
        if !(light.quick || light.no_denoise || self.keeps_samples()) {
            let has_number = light.spp.is_some()
                || light.max_error.is_some()
                || self.film.budget.is_some()
                || self.film.replay.is_some();
            self.choices
                .denoise_by_default(loaded, has_number, settings);
        }
    }

    /// Resolves the samples per pixel. With a time budget or a target error the default is the
    /// largest allowed number. A scene's fixed pattern keeps its own number, because its error does
    /// not fall with more samples.
    fn resolve_sampling(&self, scene: &Scene) -> Sampling {
        let spp = self.overrides.light.spp;
        let named = spp.is_some() || self.choices.has_ladder(Ladder::Samples);
        let open_ended = (self.film.budget.is_some() || self.film.replay.is_some()) && !named;
        match Sampling::from_spp(scene, spp) {
            Sampling::General(_) if open_ended => Sampling::General(MOST_SAMPLES),
            own if self.is_quick => quick_preview_sampling(own),
            _ if self.max_error.is_some() => Sampling::General(spp.unwrap_or(MOST_SAMPLES)),
            other => other,
        }
    }
}

/// Returns the samples per pixel of a quick preview, at most [`QUICK_SAMPLES`]. A fixed pattern has
/// few samples and is kept.
fn quick_preview_sampling(own: Sampling) -> Sampling {
    match own {
        Sampling::General(samples) => Sampling::General(samples.min(QUICK_SAMPLES)),
        fixed => fixed,
    }
}

/// Returns the size of a quick preview: half the width and height, or the largest size of the same
/// shape that fits [`QUICK_SIZE`].
fn quick_preview_size([width, height]: [u32; 2]) -> [u32; 2] {
    let [most_width, most_height] = QUICK_SIZE.map(f64::from);
    let factor = 0.5_f64
        .min(most_width / f64::from(width))
        .min(most_height / f64::from(height));
    [width, height].map(|edge| ((f64::from(edge) * factor).round() as u32).max(1))
}

/// Returns the crop if it lies inside the picture of this size; otherwise a usage error.
fn check_crop(crop: Crop, [width, height]: [u32; 2]) -> Result<Crop, Failure> {
    let fits = |start: u32, extent: u32, whole: u32| {
        start.checked_add(extent).is_some_and(|end| end <= whole)
    };
    if fits(crop.x, crop.width, width) && fits(crop.y, crop.height, height) {
        return Ok(crop);
    }
    let Crop {
        x,
        y,
        width: w,
        height: h,
    } = crop;
    let message =
        format!("--crop {x},{y},{w},{h} reaches outside the picture of {width}x{height} pixels");
    Err(Failure::usage(
        message,
        "--crop is x,y,width,height in pixels; x and y are distances from the top left corner",
    ))
}

/// Chosen rungs (quality levels of settings) and switched-off effects.
#[derive(Clone, Debug, Default)]
pub struct RungChoices {
    /// Chosen rungs. [`RungChoices::apply`] refuses two rungs of the same ladder.
    pub rungs: Vec<RungChoice>,
    /// Switched-off effects.
    pub without: Vec<Effect>,
}

impl From<&ChoiceArgs> for RungChoices {
    fn from(args: &ChoiceArgs) -> Self {
        Self {
            rungs: args.rungs.clone(),
            without: args.without.clone(),
        }
    }
}

impl RungChoices {
    /// Applies the chosen rungs (quality levels) to the scene and its settings, and switches the
    /// effects off. Fails with a usage error for two rungs of the same ladder.
    pub fn apply(&self, scene: &mut Scene, settings: &mut Settings) -> Result<(), Failure> {
        settings.without = self.without.iter().copied().collect::<EffectSet>();
        for (i, choice) in self.rungs.iter().enumerate() {
            let ladder = choice.ladder();
            if self.rungs[..i]
                .iter()
                .any(|earlier| earlier.ladder() == ladder)
            {
                return Err(contradiction_failure(ladder, "--rung"));
            }
            if ladder == Ladder::Shadows && self.without.contains(&Effect::Shadows) {
                return Err(contradiction_failure(ladder, "--without"));
            }
            choice.apply(scene, settings);
        }
        Ok(())
    }

    /// Whether `--rung` chooses a rung (quality level) of this ladder.
    pub fn has_ladder(&self, ladder: Ladder) -> bool {
        self.rungs.iter().any(|choice| choice.ladder() == ladder)
    }

    /// Denoises the path-traced picture of a model, or of a scene that asks for it, unless a rung
    /// keeps its noise. The picture of a model takes [`MODEL_SAMPLES`], unless a rung or, where
    /// `has_number`, a flag says how many.
    pub fn denoise_by_default(
        &self,
        loaded: &LoadedScene,
        has_number: bool,
        settings: &mut Settings,
    ) {
        let stays_noisy = !settings.denoise && self.has_ladder(Ladder::Reconstruction);
        let is_model = loaded.source.format.is_model();
        if stays_noisy
            || !(is_model || loaded.scene.render.denoise)
            || assess_effects(&loaded.scene, settings).integrator != "path"
        {
            return;
        }
        if is_model && !has_number && !self.has_ladder(Ladder::Samples) {
            settings.sampling = Sampling::General(MODEL_SAMPLES);
        }
        settings.denoise |= is_denoisable_sampling(settings.sampling);
    }

    /// Formats each choice. A rung becomes `LADDER=RUNG` after the prefix `rung`. A switched-off
    /// effect becomes its name, with hyphens in place of blanks, after the prefix `without`.
    pub fn format_choices(&self, rung: &str, without: &str) -> Vec<String> {
        let rungs = self.rungs.iter().map(|choice| format!("{rung}{choice}"));
        let without = self
            .without
            .iter()
            .map(|effect| format!("{without}{}", effect.name().replace(' ', "-")));
        rungs.chain(without).collect()
    }
}

/// Refuses a `--rung` for a ladder whose setting another given flag, such as `--spp`, sets too.
fn refuse_contradicting_flags(
    rungs: &[RungChoice],
    overrides: &DisplayOverrides,
) -> Result<(), Failure> {
    let light = &overrides.light;
    for choice in rungs {
        let flag = match choice.ladder() {
            Ladder::Precision if light.precision.is_some() => "--precision",
            Ladder::Samples if light.spp.is_some() => "--spp",
            Ladder::Clamp if light.clamp.is_some() => "--clamp",
            Ladder::Reconstruction if light.denoise => "--denoise",
            Ladder::Reconstruction if light.no_denoise => "--no-denoise",
            Ladder::Reconstruction | Ladder::Samples if light.quick => "--quick",
            Ladder::PathLength if light.max_depth.is_some() => "--max-depth",
            Ladder::Accelerator | Ladder::Build if overrides.accel.is_some() => "--accel",
            _ => continue,
        };
        return Err(contradiction_failure(choice.ladder(), flag));
    }
    Ok(())
}

fn contradiction_failure(ladder: Ladder, flag: &str) -> Failure {
    Failure::usage(
        format_args!(
            "--rung {}=... and {flag} both set the ladder {}",
            ladder.name(),
            ladder.name()
        ),
        "leave out one of the two flags",
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: a quick preview has half the width and height, fits its frame without a change of
    /// shape, and has at least one pixel.
    #[test]
    fn first_looks_are_small() {
        let sizes = [
            [64, 48],
            [1280, 720],
            [1920, 1080],
            [1000, 4000],
            [1, 1],
            [16_384, 1],
        ];
        assert_eq!(
            sizes.map(quick_preview_size),
            [
                [32, 24],
                [640, 360],
                [640, 360],
                [90, 360],
                [1, 1],
                [640, 1]
            ]
        );
    }

    /// Protects: right and lower edge of a crop are compared with the width and height of the
    /// picture, to the last pixel, and no sum overflows.
    #[test]
    fn crops_lie_inside_the_picture() {
        let fits = |x, y, width, height| {
            check_crop(
                Crop {
                    x,
                    y,
                    width,
                    height,
                },
                [100, 60],
            )
            .is_ok()
        };
        assert!(fits(0, 0, 100, 60) && fits(99, 59, 1, 1));
        assert!(!fits(0, 0, 101, 60) && !fits(1, 0, 100, 60), "right");
        assert!(
            !fits(0, 0, 100, 61) && !fits(0, 50, 10, 11) && !fits(0, 60, 1, 1),
            "below, in a wide picture"
        );
        assert!(!fits(u32::MAX, 0, 1, 1) && !fits(0, u32::MAX, 1, 1));
    }
}

#[cfg(test)]
mod rungs_tests {
    use clap::Parser;
    use raywright_core::accuracy::RungSetting;

    use super::*;
    use crate::args::{Arguments, Command};
    use crate::plan::RenderTask;

    fn task(words: &[&str]) -> RenderTask {
        let words = [&["raywright", "render"], words].concat();
        let Ok(Arguments {
            command: Some(Command::Render(args)),
            ..
        }) = Arguments::try_parse_from(words)
        else {
            panic!("a right command line")
        };
        RenderTask::new(*args).expect("nothing is wrong with it")
    }

    fn rungs(list: &[&str]) -> RungChoices {
        let choice = |text: &&str| RungChoice::parse(text).expect("a rung");
        RungChoices {
            rungs: list.iter().map(choice).collect(),
            without: Vec::new(),
        }
    }

    /// Protects: chosen rungs and switched-off effects reach the settings, and contradictory flags
    /// are refused.
    #[test]
    fn choices_reach_the_settings_once() {
        let (mut scene, mut settings) = (Scene::default(), Settings::from_scene(&Scene::default()));
        let choices = RungChoices {
            without: vec![Effect::Highlights],
            ..rungs(&["path-length=4", "shadows=off"])
        };
        choices
            .apply(&mut scene, &mut settings)
            .expect("no contradiction");
        assert_eq!(
            (settings.max_depth, settings.without),
            (
                4,
                EffectSet::from_effects(&[Effect::Highlights, Effect::Shadows])
            )
        );
        assert!(
            rungs(&["build=fast", "build=high"])
                .apply(&mut scene, &mut settings)
                .is_err()
        );
        let both = RungChoices {
            without: vec![Effect::Shadows],
            ..rungs(&["shadows=on"])
        };
        assert!(both.apply(&mut scene, &mut settings).is_err());
    }

    /// Protects: `--rung` renders exactly the scene and settings that the ladder measures, for
    /// every rung of every ladder.
    #[test]
    fn what_is_rendered_is_what_is_measured() {
        let texture = serde_json::json!({ "name": "t", "image": "i", "filter": "bilinear" });
        let own: Scene =
            serde_json::from_value(serde_json::json!({ "format": 1, "textures": [texture] }))
                .expect("a scene");
        let rendered = |words: &[&str]| {
            let mut scene = own.clone();
            let plan = task(words)
                .resolve_plan(&mut scene, None, |_, _, _, _| panic!("nothing is framed"))
                .expect("a plan");
            (scene, plan.settings)
        };
        let (_, settings) = rendered(&[]);
        for choice in Ladder::ALL.into_iter().flat_map(Ladder::choices) {
            let measured = RungSetting::from_rung(choice).apply(&own, &settings);
            assert_eq!(
                rendered(&["--rung", &choice.to_string()]),
                measured,
                "{choice}"
            );
        }
    }

    /// Protects: a flag such as `--spp` contradicts only the rungs of the ladder that it sets.
    #[test]
    fn each_flag_has_its_ladders() {
        let refused = |flag: &[&str]| {
            [
                "precision=reference",
                "samples=4",
                "path-length=2",
                "accelerator=linear",
                "build=fast",
                "clamp=10",
                "reconstruction=denoised",
            ]
            .map(|rung| {
                let RenderTask {
                    choices, overrides, ..
                } = task(&[&["--rung", rung], flag].concat());
                u8::from(refuse_contradicting_flags(&choices.rungs, &overrides).is_err())
            })
        };
        assert_eq!(
            refused(&["--precision", "reference"]),
            [1, 0, 0, 0, 0, 0, 0]
        );
        assert_eq!(refused(&["--spp", "4"]), [0, 1, 0, 0, 0, 0, 0]);
        assert_eq!(refused(&["--max-depth", "2"]), [0, 0, 1, 0, 0, 0, 0]);
        assert_eq!(refused(&["--accel", "bvh"]), [0, 0, 0, 1, 1, 0, 0]);
        assert_eq!(refused(&["--clamp", "3"]), [0, 0, 0, 0, 0, 1, 0]);
        assert_eq!(refused(&["--denoise"]), [0, 0, 0, 0, 0, 0, 1]);
        assert_eq!(refused(&["--no-denoise"]), [0, 0, 0, 0, 0, 0, 1]);
        assert_eq!(refused(&["--quick"]), [0, 1, 0, 0, 0, 0, 1]);
        assert_eq!(refused(&[]), [0; 7]);
    }

    /// Protects: chosen rungs and switched-off effects are printed as the user typed them.
    #[test]
    fn choices_have_their_own_words() {
        let choices = RungChoices {
            without: vec![Effect::MirrorReflection, Effect::Sky],
            ..rungs(&["samples=16"])
        };
        let words = choices.format_choices(" rung:", " without=").concat();
        assert_eq!(
            words,
            " rung:samples=16 without=mirror-reflection without=sky"
        );
    }
}
