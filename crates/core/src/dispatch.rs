//! Dispatch: the only file in which run-time choices, of precision and integrator, become types.

use core::sync::atomic::{AtomicBool, Ordering};

use raywright_bvh::Real;

use crate::effects::{EffectReport, EffectSet, RenderSetup};
use crate::extent::{self, SceneExtent};
use crate::film::{ErrorProgress, Film, FilmPart, FilmPlan, PartError};
use crate::integrator::{PathTracer, WhittedTracer};
use crate::lookup::SceneLookup;
use crate::memory::{MemoryUse, can_allocate};
use crate::observer::Observer;
use crate::prepare::{
    self, LightLeak, PrepareError, PreparedScene, TableCounts, UnreachedLight, UnresolvedGap,
};
use crate::render::{RenderOutput, RenderStage, render};
use crate::scene::{Camera, Integrator, MeshSource, SamplePattern, Scene};
use crate::settings::{Aov, Crop, PrecisionChoice, Sampling, Settings};
use crate::validate::Problem;

/// Edge of a preview's tiles in pixels: small, because a preview has few pixels to share among the
/// threads.
const PREVIEW_TILE: u32 = 16;

/// A scene prepared for one set of settings, ready to render.
pub struct ReadyScene {
    prepared: PreparedInPrecision,
    is_path_traced: bool,
    settings: Settings,
    effects: EffectReport,
}

enum PreparedInPrecision {
    Robust(Box<PreparedScene<f32>>),
    Reference(Box<PreparedScene<f64>>),
}

/// Evaluates an expression for the prepared scene, in the precision of the preparation.
macro_rules! each {
    ($ready:expr, $prepared:ident => $value:expr) => {
        match $ready {
            PreparedInPrecision::Robust($prepared) => $value,
            PreparedInPrecision::Reference($prepared) => $value,
        }
    };
}

/// A task on a prepared scene, generic over the precision.
pub(crate) trait PreparedSceneTask {
    /// Result of the task.
    type Output;

    /// Runs the task.
    fn run<R: Real>(&self, prepared: &PreparedScene<R>) -> Self::Output;
}

/// Prepares a validated scene on the current thread pool: detects the effects that the scene needs,
/// then builds their data.
///
/// # Errors
/// See [`PrepareError`].
pub fn prepare(
    scene: &Scene,
    settings: &Settings,
    observer: &dyn Observer,
) -> Result<ReadyScene, PrepareError> {
    settings.check().map_err(PrepareError::Settings)?;
    let render_setup = RenderSetup::new(scene, settings);
    let simulated = render_setup.effects.simulated();
    let needed = estimate_memory(&render_setup);
    if let Some(allowed) = settings
        .max_memory
        .filter(|&allowed| needed.total() > allowed)
    {
        return Err(PrepareError::Memory { needed, allowed });
    }
    if !can_allocate(remaining_allocations(&needed, scene)) {
        return Err(PrepareError::OutOfMemory { needed });
    }
    let inner = PreparedInPrecision::new(
        &render_setup.scene,
        &render_setup.settings,
        simulated,
        observer,
    )?;
    let follows_paths = render_setup.integrator() == Integrator::Path;
    Ok(ReadyScene {
        prepared: inner,
        is_path_traced: follows_paths,
        settings: settings.clone(),
        effects: render_setup.effects,
    })
}

/// Returns the bytes that preparation and rendering still have to allocate; `needed` is the
/// estimate of the total. Meshes and images are already in memory. Building a tree takes temporary
/// lists of about the tree's size, and writing a file takes a reordered copy of the picture.
fn remaining_allocations(needed: &MemoryUse, scene: &Scene) -> u64 {
    let images = scene
        .images
        .iter()
        .filter_map(|image| image.data.as_ref())
        .map(|data| data.byte_size() as u64);
    let meshes = scene.meshes.iter().map(|mesh| match &mesh.source {
        MeshSource::Inline(data) => data.byte_size() as u64,
        MeshSource::File(_) => 0,
    });
    let in_memory = images.sum::<u64>() + meshes.sum::<u64>();
    needed
        .total()
        .saturating_sub(in_memory)
        .saturating_add(needed.geometry)
        .saturating_add(needed.film / 2)
}

/// Estimates the memory that a scene takes, before preparation. The estimate is at least the memory
/// in use after preparation ([`ReadyScene::memory`]), and at most twice as much. The factor is at
/// most three with the tree of `robust`, four where triangles may be split (`build=high`), and five
/// where triangles and shapes mix.
pub fn estimate_scene_memory(scene: &Scene, settings: &Settings) -> MemoryUse {
    estimate_memory(&RenderSetup::new(scene, settings))
}

fn estimate_memory(render_setup: &RenderSetup<'_>) -> MemoryUse {
    match render_setup.settings.precision {
        PrecisionChoice::Robust => prepare::estimate_memory::<f32>(render_setup),
        PrecisionChoice::Reference => prepare::estimate_memory::<f64>(render_setup),
    }
}

/// Measures the extent of a scene's coordinates, rounded as a precision stores them. Reads the
/// scene's data alone; builds nothing.
pub fn measure_extent(scene: &Scene, precision: PrecisionChoice) -> SceneExtent {
    let lookup = SceneLookup::new(scene);
    match precision {
        PrecisionChoice::Robust => extent::scene_extent::<f32>(scene, &lookup),
        PrecisionChoice::Reference => extent::scene_extent::<f64>(scene, &lookup),
    }
}

/// Returns a problem for each object that a precision cannot show, because the object collapses
/// when its coordinates are rounded. Preparation would fail with the same problems. Tests every
/// listed object and the first object of every generator; returns at most a hundred problems.
pub fn find_collapsed_objects(scene: &Scene, precision: PrecisionChoice) -> Vec<Problem> {
    match precision {
        PrecisionChoice::Robust => prepare::find_collapsed_objects::<f32>(scene),
        PrecisionChoice::Reference => prepare::find_collapsed_objects::<f64>(scene),
    }
}

impl PreparedInPrecision {
    fn new(
        scene: &Scene,
        settings: &Settings,
        simulated: EffectSet,
        observer: &dyn Observer,
    ) -> Result<Self, PrepareError> {
        Ok(match settings.precision {
            PrecisionChoice::Robust => Self::Robust(Box::new(PreparedScene::new(
                scene, settings, simulated, observer,
            )?)),
            PrecisionChoice::Reference => Self::Reference(Box::new(PreparedScene::new(
                scene, settings, simulated, observer,
            )?)),
        })
    }
}

/// Observer that ends a render early: once 1/2ᵏ of all samples are finished, for k = `halving`, and
/// every pixel has a sample.
struct StageObserver<'a> {
    observer: &'a dyn Observer,
    halving: u32,
    is_over: AtomicBool,
}

impl Observer for StageObserver<'_> {
    fn progress(&self, done: u64, total: u64) {
        self.observer.progress(done, total);
        self.is_over
            .store(done >= total >> self.halving, Ordering::Relaxed);
    }

    fn is_cancelled(&self) -> bool {
        self.observer.is_cancelled()
    }

    fn has_enough_samples(&self, everywhere: bool) -> bool {
        self.observer.has_enough_samples(everywhere)
            || everywhere && self.is_over.load(Ordering::Relaxed)
    }
}

impl ReadyScene {
    /// Replaces the camera, and keeps all prepared data that do not depend on the camera. `scene`
    /// must be the prepared scene. The result equals a new preparation to the bit. Returns false
    /// and changes nothing if the new camera requires a new preparation: because of a shutter, of
    /// other effects, or of effects switched off.
    pub fn replace_camera(&mut self, scene: &Scene, camera: &Camera) -> bool {
        let settings = Settings {
            camera: Some(camera.clone()),
            ..self.settings.clone()
        };
        let RenderSetup {
            settings: prepared,
            effects,
            ..
        } = RenderSetup::new(scene, &settings);
        let has_shutter = |settings: &Settings| {
            settings
                .camera
                .as_ref()
                .is_some_and(|camera| camera.shutter.is_some())
        };
        let simulated = effects.simulated();
        let differs = simulated != self.effects.simulated() || !settings.without.is_empty();
        if differs || has_shutter(&settings) || has_shutter(&self.settings) {
            return false;
        }
        let is_turned =
            each!(&mut self.prepared, p => p.set_camera(scene, &prepared, camera, simulated));
        if is_turned {
            (self.settings, self.effects) = (settings, effects);
        }
        is_turned
    }

    /// Renders the picture on the current thread pool.
    pub fn render(&self, observer: &dyn Observer) -> RenderOutput {
        let mut film = self.new_film("");
        let part = film.full_part();
        self.render_rounds(&mut film, &part, observer);
        RenderOutput::from_film(&film, observer)
    }

    /// Renders as [`Self::render`], and calls `look` with the state of the render each time that
    /// the number of samples has about doubled: first after 1/128 of all samples, and not after the
    /// last sample. The result equals that of [`Self::render`] to the bit.
    pub fn render_progressively(
        &self,
        observer: &dyn Observer,
        mut look: impl FnMut(&RenderStage<'_>),
    ) -> RenderOutput {
        let mut film = self.new_film("");
        let part = film.full_part();
        for halving in (1..=7).rev() {
            let stage = StageObserver {
                observer,
                halving,
                is_over: AtomicBool::new(false),
            };
            self.render_film_part(&mut film, &part, &stage);
            if !stage.is_over.into_inner()
                || observer.is_cancelled()
                || film.unfinished_tiles(&part) == 0
            {
                break;
            }
            look(&RenderStage::from_film(&film));
        }
        self.render_rounds(&mut film, &part, observer);
        RenderOutput::from_film(&film, observer)
    }

    /// Renders a new film with the given settings. They may differ from the prepared settings in
    /// crop, seed, samples, sampler, replicates, tiles and denoising, on which the prepared scene
    /// does not depend.
    pub(crate) fn render_with_settings(
        &self,
        settings: &Settings,
        observer: &dyn Observer,
    ) -> Film {
        debug_assert_eq!(
            self.settings.sampling.is_fixed(),
            settings.sampling.is_fixed(),
            "a fixed pattern of samples simulates other effects than general sampling"
        );
        let mut film = Film::new(
            "",
            settings,
            FilmPlan::new(settings, self.is_random(), self.has_ground()),
        );
        let part = film.full_part();
        each!(&self.prepared, prepared => self.render_with_integrator((prepared, &prepared.camera), settings, (&mut film, &part), observer));
        film
    }

    /// Renders a quick preview with pixels `edge` times as wide and as high as the picture's.
    /// Pixels are counted from the top left corner of the picture, so the last column and row may
    /// reach beyond the picture. Each pixel takes at most `samples` samples (a fixed pattern: the
    /// centre alone) and has the given layers. The preview uses the prepared scene, and takes a
    /// fraction of the picture's time.
    pub fn render_preview(
        &self,
        edge: u32,
        samples: u32,
        layers: &[Aov],
        observer: &dyn Observer,
    ) -> RenderOutput {
        let edge = edge.max(1);
        let value_of = |pixels: u32| pixels.div_ceil(edge);
        let settings = Settings {
            size: self.settings.size.map(value_of),
            crop: self.settings.crop.map(|crop| {
                let [x, y] = [crop.x, crop.y].map(|start| start / edge);
                Crop {
                    x,
                    y,
                    width: value_of(crop.x + crop.width) - x,
                    height: value_of(crop.y + crop.height) - y,
                }
            }),
            sampling: match self.settings.sampling {
                Sampling::Pattern(_) => Sampling::Pattern(SamplePattern::Centre),
                Sampling::General(maximum) => Sampling::General(samples.clamp(1, maximum)),
            },
            aovs: layers.to_vec(),
            max_error: None,
            denoise: false,
            replicates: None,
            tile_size: PREVIEW_TILE,
            ..self.settings.clone()
        };
        let mut film = Film::new(
            "",
            &settings,
            FilmPlan::new(&settings, self.is_random(), self.has_ground()),
        );
        let part = film.full_part();
        each!(&self.prepared, prepared => {
            let camera = prepared.camera.with_larger_pixels(edge);
            self.render_with_integrator((prepared, &camera), &settings, (&mut film, &part), observer);
        });
        RenderOutput::from_film_without_denoising(&film)
    }

    /// Returns an empty film, to be rendered part by part. `scene` is a text that identifies the
    /// scene, for example a hash of its files: parts with different texts cannot be merged.
    pub fn new_film(&self, scene: &str) -> Film {
        Film::new(scene, &self.settings, self.film_plan())
    }

    /// Renders the samples that `part` names and the film lacks, on the current thread pool, in
    /// passes over the picture. Tiles and replicates outside the picture are ignored. If the
    /// observer stops the render, the film keeps the finished units, and another call continues
    /// from there.
    ///
    /// # Errors
    /// [`PartError::Foreign`] for the film of another picture.
    pub fn render_part(
        &self,
        film: &mut Film,
        part: &FilmPart,
        observer: &dyn Observer,
    ) -> Result<(), PartError> {
        if let Some(label) = self.new_film(film.scene()).find_difference(film) {
            return Err(PartError::Foreign { part: 0, label });
        }
        self.render_rounds(film, part, observer);
        Ok(())
    }

    /// Renders all missing samples of `part`. With adaptive sampling, a film that is complete at
    /// the end of a round gets the sample counts of its next round, which are decided from all
    /// tiles, until the requested error is reached. A part of a film therefore ends with its round.
    fn render_rounds(&self, film: &mut Film, part: &FilmPart, observer: &dyn Observer) {
        loop {
            self.render_film_part(film, part, observer);
            let requested_error = self
                .settings
                .max_error
                .filter(|_| film.unfinished_tiles(&film.full_part()) == 0);
            if requested_error.is_none_or(|error| {
                film.plan_next_round(error, observer) != ErrorProgress::NeedsSamples
            }) {
                return;
            }
        }
    }

    fn render_film_part(&self, film: &mut Film, part: &FilmPart, observer: &dyn Observer) {
        each!(&self.prepared, prepared => self.render_with_integrator((prepared, &prepared.camera), &self.settings, (film, part), observer));
    }

    fn render_with_integrator<R: Real>(
        &self,
        prepared: (&PreparedScene<R>, &crate::camera::PreparedCamera<R>),
        settings: &Settings,
        (film, part): (&mut Film, &FilmPart),
        observer: &dyn Observer,
    ) {
        if self.is_path_traced {
            render::<R, PathTracer<'_, R>>(prepared, settings, film, part, observer);
        } else {
            render::<R, WhittedTracer<'_, R>>(prepared, settings, film, part, observer);
        }
    }

    /// Returns the radiance of the studio's backdrop; `None` if camera rays do not see a backdrop.
    pub fn backdrop_radiance(&self) -> Option<f64> {
        each!(&self.prepared, prepared => prepared.studio_backdrop)
    }

    /// Returns the plan of a film: the division of the picture into tiles and replicates.
    fn film_plan(&self) -> FilmPlan {
        FilmPlan::new(&self.settings, self.is_random(), self.has_ground())
    }

    fn has_ground(&self) -> bool {
        each!(&self.prepared, prepared => prepared.ground.is_some())
    }

    /// Whether the picture depends on the seed: by samples at random positions in their pixels, on
    /// a lens or on area lights, or by path tracing.
    pub fn is_random(&self) -> bool {
        let drawn =
            each!(&self.prepared, p => p.camera.has_lens() || !p.lights.emitters.is_empty());
        drawn || self.is_path_traced() || !self.settings.sampling.is_fixed()
    }

    /// Whether the integrator is the path tracer, so that noise is the picture's largest error.
    pub fn is_path_traced(&self) -> bool {
        self.is_path_traced
    }

    /// Returns the lights that contributed nothing to a film of this picture although many shadow
    /// rays were traced to them. Such a light is enclosed, or no random path has reached its few
    /// unoccluded positions. Empty for pictures that are not path traced. Samples that the film
    /// read from a file do not count.
    pub fn find_unreached_lights(&self, film: &Film) -> Vec<UnreachedLight> {
        each!(&self.prepared, p => p.find_unreached_lights(film.light_usage()))
    }

    /// Returns the pairs of objects between which this precision closes a gap. Only gaps crossed by
    /// straight rays through the picture's pixels are found.
    pub fn find_closed_gaps(&self) -> Vec<UnresolvedGap> {
        each!(&self.prepared, p => p.find_unresolved_gaps(self.settings.size))
    }

    /// Returns the lamps whose light passes through an opaque object because this precision cannot
    /// separate the lamp from the object. Only leaks onto points hit by rays through the picture's
    /// pixels are found.
    pub fn find_light_leaks(&self) -> Vec<LightLeak> {
        each!(&self.prepared, p => p.find_light_leaks(self.settings.size))
    }

    /// Runs a task on the prepared scene, in its precision.
    pub(crate) fn run_task<W: PreparedSceneTask>(&self, work: &W) -> W::Output {
        each!(&self.prepared, p => work.run(p))
    }

    /// Returns the memory in use, by its purpose.
    pub fn memory(&self) -> MemoryUse {
        MemoryUse {
            film: self.film_plan().bytes(),
            ..each!(&self.prepared, p => p.memory_use())
        }
    }

    /// Returns the sizes of the tables that effects need; zero for the table of an absent effect.
    pub fn table_sizes(&self) -> TableCounts {
        each!(&self.prepared, p => p.table_counts())
    }

    /// Returns the objects that are invisible because all triangles of their mesh collapse when
    /// rounded far from the storage origin: ascending indices among the scene's objects, generated
    /// objects last.
    pub fn invisible_objects(&self) -> &[u32] {
        each!(&self.prepared, p => &p.collapsed_meshes)
    }

    /// Returns the first object so far from the storage origin that the precision cannot separate
    /// points a thousandth of the object's size apart: an index among the scene's objects,
    /// generated objects last.
    pub fn first_unresolved_object(&self) -> Option<u32> {
        each!(&self.prepared, p => p.origin.unresolved)
    }

    /// Returns the report of all effects: simulated, absent, or left out.
    pub fn effects(&self) -> &EffectReport {
        &self.effects
    }

    /// Returns the settings of the preparation.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }
}
