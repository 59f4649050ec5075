//! Renders of a prepared scene: the picture, parts of it, its stages and previews.

use core::sync::atomic::{AtomicBool, Ordering};

use raywright_bvh::Real;

use super::{PreparedInPrecision, ReadyScene};
use crate::camera::PreparedCamera;
use crate::denoise::{REQUIRED_LAYERS, sketch};
use crate::film::{ErrorProgress, Film, FilmMergeError, FilmPart, FilmPlan};
use crate::integrator::{PathTracer, WhittedTracer};
use crate::observer::Observer;
use crate::picture::Picture;
use crate::prepare::PreparedScene;
use crate::render::{RenderOutput, RenderStage, render};
use crate::scene::SamplePattern;
use crate::settings::{Aov, Crop, Sampling, Settings};

/// Edge of a preview's tiles in pixels. It is small, because a preview has few pixels to divide
/// among the threads.
const PREVIEW_TILE: u32 = 16;

/// Greatest width and height in pixels of the picture from which an exposure is chosen, and its
/// samples per pixel.
const SURVEY_EDGE: u32 = 64;
const SURVEY_SAMPLES: u32 = 16;

/// Observer that ends a render early: when 1/2ᵏ of all samples are finished and every pixel has a
/// sample. k is `halving`.
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
    /// Renders the picture on the current thread pool.
    pub fn render(&self, observer: &dyn Observer) -> RenderOutput {
        let mut film = self.new_film("");
        let part = film.full_part();
        self.render_rounds(&mut film, &part, observer);
        RenderOutput::from_film(&film, observer)
    }

    /// Renders like [`Self::render`], and calls `look` with the state of the render each time that
    /// the number of samples has about doubled. The first call is after 1/128 of all samples; no
    /// call follows the last sample. The result equals that of [`Self::render`] to the bit.
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

    /// Renders a new film with the given settings: all tiles, or those with the given numbers in
    /// ascending order. The settings may differ from the prepared settings only
    /// where the prepared scene does not depend on them: in crop, seed, samples, sampler,
    /// replicates, tiles and denoising.
    pub(crate) fn render_with_settings(
        &self,
        settings: &Settings,
        tiles: Option<&[u32]>,
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
            FilmPlan::new(settings, self.depends_on_seed(), self.has_ground()),
        );
        let part = FilmPart {
            selected_tiles: tiles.map(<[u32]>::to_vec),
            ..film.full_part()
        };
        each!(&self.prepared, prepared => self.render_with_integrator((prepared, &prepared.camera), settings, (&mut film, &part), observer));
        film
    }

    /// Renders a quick preview. Its pixels are `edge` times as wide and high as the picture's. They
    /// are counted from the top left corner, so the last column and row may reach beyond the
    /// picture. Each pixel has at most `samples` samples, or one at its centre under a fixed
    /// pattern. The preview has the given layers, uses the prepared scene, and takes a fraction of
    /// the picture's time. Of a picture to be denoised, the preview is a [`sketch`].
    pub fn render_preview(
        &self,
        edge: u32,
        samples: u32,
        layers: &[Aov],
        observer: &dyn Observer,
    ) -> RenderOutput {
        let edge = edge.max(1);
        let sampling = match self.settings.sampling {
            Sampling::General(maximum) => Sampling::General(samples.clamp(1, maximum)),
            fixed => fixed,
        };
        let value_of = |pixels: u32| pixels.div_ceil(edge);
        let guides = REQUIRED_LAYERS.iter().filter(|_| self.settings.denoise);
        let mut layers = layers.to_vec();
        for aov in guides {
            if !layers.contains(aov) {
                layers.push(*aov);
            }
        }
        let settings = Settings {
            edges: self.settings.edges,
            crop: self.settings.crop.map(|crop| {
                let [x, y] = [crop.x, crop.y].map(|start| start / edge);
                Crop {
                    x,
                    y,
                    width: value_of(crop.x + crop.width) - x,
                    height: value_of(crop.y + crop.height) - y,
                }
            }),
            ..self.preview_settings(edge, sampling, &layers)
        };
        let film = self.render_with_large_pixels(edge, &settings, observer);
        let mut output = RenderOutput::from_film_without_denoising(&film);
        if let Some(picture) = sketch(&film).filter(|_| self.settings.denoise) {
            let layers = core::mem::take(&mut output.picture.layers);
            output.picture = Picture { layers, ..picture };
        }
        output
    }

    /// Looks for an object in view before a render: by a sample of each pixel of a small picture, then,
    /// if it shows none, by a few of the whole picture. Returns the last picture, and whether it shows
    /// that there is none.
    pub fn look_for_objects(&self, observer: &dyn Observer) -> (RenderOutput, bool) {
        const COARSE_EDGE: u32 = 64;
        const SAMPLES: u32 = 4;
        let look = |edge, samples| {
            let rendered = self.render_preview(edge, samples, &[], observer);
            let shows_object = rendered.counters.hits + rendered.counters.cut_short > 0;
            let is_empty = !shows_object && rendered.finished;
            (rendered, is_empty)
        };
        let [width, height] = self.settings.size;
        match look(width.max(height).div_ceil(COARSE_EDGE), 1) {
            (_, true) => look(1, SAMPLES),
            found => found,
        }
    }

    /// Returns the colours of lit objects in a small picture of the whole view: of each pixel that
    /// shows an object with radiance, or of each pixel with radiance if no object is in view. They do
    /// not depend on crop, samples, seed and parts.
    pub fn survey_lit_objects(&self, observer: &dyn Observer) -> Vec<[f32; 3]> {
        let edge = self.settings.size[0]
            .max(self.settings.size[1])
            .div_ceil(SURVEY_EDGE);
        let sampling = match self.settings.sampling {
            Sampling::General(_) => Sampling::General(SURVEY_SAMPLES),
            fixed => fixed,
        };
        let settings = Settings {
            crop: None,
            seed: 0,
            ..self.preview_settings(edge, sampling, &[Aov::Object])
        };
        let picture = self
            .render_with_large_pixels(edge, &settings, observer)
            .picture();
        let objects = picture.layer("object.id");
        let shows_object = |pixel: usize| objects.is_some_and(|layer| layer.samples[pixel] >= 0.0);
        let pixels = 0..picture.rgb.len();
        let is_empty = !pixels.clone().any(shows_object);
        pixels
            .filter(|&pixel| is_empty || shows_object(pixel))
            .filter_map(|pixel| picture.surface_colour(pixel))
            .filter(|colour| colour.iter().any(|&channel| channel > 0.0))
            .collect()
    }

    /// Returns the settings of a preview with pixels that are `edge` times as wide and high. Of a
    /// fixed pattern, the preview has the centre alone.
    fn preview_settings(&self, edge: u32, sampling: Sampling, layers: &[Aov]) -> Settings {
        Settings {
            size: self.settings.size.map(|pixels| pixels.div_ceil(edge)),
            sampling: match sampling {
                Sampling::Pattern(_) => Sampling::Pattern(SamplePattern::Centre),
                general => general,
            },
            aovs: layers.to_vec(),
            edges: false,
            max_error: None,
            denoise: false,
            replicates: None,
            tile_size: PREVIEW_TILE,
            ..self.settings.clone()
        }
    }

    /// Renders a preview whose pixels are `edge` times as wide and high as the picture's.
    fn render_with_large_pixels(
        &self,
        edge: u32,
        settings: &Settings,
        observer: &dyn Observer,
    ) -> Film {
        let mut film = Film::new(
            "",
            settings,
            FilmPlan::new(settings, self.depends_on_seed(), self.has_ground()),
        );
        let part = film.full_part();
        each!(&self.prepared, prepared => {
            let camera = prepared.camera.with_preview_pixels(edge);
            self.render_with_integrator((prepared, &camera), settings, (&mut film, &part), observer);
        });
        film
    }

    /// Returns an empty film, to be rendered part by part. `scene` is a text that identifies the
    /// scene, for example a hash of its files. Parts with different texts cannot be merged.
    pub fn new_film(&self, scene: &str) -> Film {
        Film::new(scene, &self.settings, self.film_plan())
    }

    /// Renders the samples of `part` that the film lacks, on the current thread pool, in passes
    /// over the picture. Tiles and replicates outside the picture are ignored. If the observer
    /// stops the render, the film keeps all finished units of work, and another call continues from
    /// there.
    ///
    /// # Errors
    /// [`FilmMergeError::Foreign`] if the film belongs to another picture.
    pub fn render_part(
        &self,
        film: &mut Film,
        part: &FilmPart,
        observer: &dyn Observer,
    ) -> Result<(), FilmMergeError> {
        if let Some(label) = self.new_film(film.scene()).find_difference(film) {
            return Err(FilmMergeError::Foreign { part: 0, label });
        }
        self.render_rounds(film, part, observer);
        Ok(())
    }

    /// Renders all missing samples of `part`. Adaptive sampling adds rounds until the requested
    /// error is reached. The numbers of samples of a round follow from all tiles of a film whose
    /// earlier round is complete. So a render of only a part of the film ends with its round.
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

    /// Renders the samples of `part` that the film lacks, in the precision of the preparation.
    fn render_film_part(&self, film: &mut Film, part: &FilmPart, observer: &dyn Observer) {
        each!(&self.prepared, prepared => self.render_with_integrator((prepared, &prepared.camera), &self.settings, (film, part), observer));
    }

    /// Renders the samples of `part` that the film lacks, by the integrator of the preparation.
    fn render_with_integrator<R: Real>(
        &self,
        prepared: (&PreparedScene<R>, &PreparedCamera<R>),
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

    /// Returns the plan of a film: the division of the picture into tiles and replicates.
    pub(super) fn film_plan(&self) -> FilmPlan {
        FilmPlan::new(&self.settings, self.depends_on_seed(), self.has_ground())
    }

    /// Whether the studio's ground shows shadows.
    fn has_ground(&self) -> bool {
        each!(&self.prepared, prepared => prepared.ground.is_some())
    }
}
