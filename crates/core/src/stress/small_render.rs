//! A small picture of a camera, from which the checks judge samples, blackness and noise of lamps.

use super::RayDeadline;
use super::covers::LightBlocker;
use super::facts::SceneFacts;
use super::finding::{CheckRun, FindingSubject};
use crate::counters::Counters;
use crate::dispatch::ReadyScene;
use crate::picture::Picture;
use crate::prepare::UnreachedLight;

/// Fewest hits of lamps by chance alone from which the light of such lamps is determined.
const FEWEST_FOUND: u64 = 40;

/// If fewer than one path in this number of samples may hit lamps by chance alone, the light of
/// these lamps is negligible.
const ONE_IN: u64 = 500;

/// A small picture of a camera, with its counters.
pub(super) struct SmallRender {
    pub camera: usize,
    pub picture: Picture,
    pub counters: Counters,
    pub unreached_lights: Vec<UnreachedLight>,
    /// Error of the picture (root relMSE), estimated from its own samples, and its number of
    /// samples per pixel.
    error: Option<f64>,
    samples_per_pixel: u32,
    /// Whether too few paths hit lamps by chance for the error to include their noise.
    lacks_chance_hits: bool,
    pub run: CheckRun,
    /// Object that blocks the light, if the picture is black.
    pub cover: Option<LightBlocker>,
}

impl SmallRender {
    /// Renders the small picture, until it is complete or the time is over.
    pub fn render_small_picture(
        ready: &ReadyScene,
        camera: usize,
        deadline: &RayDeadline<'_>,
    ) -> Self {
        let mut film = ready.new_film("");
        let part = film.full_part();
        let pixels = u64::from(film.size()[0]) * u64::from(film.size()[1]);
        let samples_per_pixel = ready.settings().sampling.samples_per_pixel();
        let planned = pixels * u64::from(samples_per_pixel);
        // The film is its own, so that it can't be refused.
        let _ = ready.render_part(&mut film, &part, deadline);
        let (shut_away, counters) = (ready.find_unreached_lights(&film), film.counters());
        let looked_at = if film.unfinished_pixels() == 0 {
            planned
        } else {
            counters.samples + counters.dropped
        };
        let run = CheckRun {
            name: "samples",
            looked_at,
            unit: "samples",
            planned,
        };
        Self {
            camera,
            picture: film.picture(),
            counters,
            unreached_lights: shut_away,
            error: film
                .estimate_uncertainty()
                .map(|error| error.root_relmse.value),
            samples_per_pixel,
            lacks_chance_hits: counters.unaided.saturating_mul(ONE_IN) > counters.samples
                && counters.found < FEWEST_FOUND,
            run,
            cover: None,
        }
    }

    /// Returns whether surfaces are visible and all of them are black. Radiances up to 1e-6, which
    /// rounding can cause at grazing angles, count as black, unless most surfaces show some: then
    /// faint light reaches them.
    pub fn is_black(&self) -> bool {
        const BLACK: f32 = 1e-6;
        let shines = |pixel: [f32; 3]| pixel.iter().any(|&channel| channel > BLACK);
        let is_dark = self.counters.hits > 0
            && self.first_pixel_where(shines).is_none()
            && !self.run.is_cut_short();
        let surfaces = || self.surface_pixels(|_| true);
        let is_lit = |pixel: &[f32; 3]| pixel.iter().any(|&channel| channel > 0.0);
        is_dark && 2 * surfaces().filter(is_lit).count() <= surfaces().count()
    }

    /// Returns the expected error (root relMSE) of a picture with a number of samples per pixel:
    /// the variance falls as their inverse. `None` if the samples are too few to tell.
    pub fn expected_error(&self, samples: u32) -> Option<f64> {
        let is_known = !self.run.is_cut_short() && !self.lacks_chance_hits;
        let error = self.error.filter(|error| is_known && error.is_finite())?;
        let ratio = f64::from(self.samples_per_pixel) / f64::from(samples.max(1));
        Some(error * ratio.sqrt())
    }

    /// Returns the pixels that show a surface of objects of which `holds` is true. Objects count as
    /// in the layer `object.id`.
    pub fn surface_pixels(&self, holds: impl Fn(u32) -> bool) -> impl Iterator<Item = [f32; 3]> {
        let objects = self.picture.layer("object.id");
        let shows = move |pixel: usize| {
            objects.is_none_or(|layer| {
                let object = layer.samples[pixel];
                object >= 0.0 && holds(object as u32)
            })
        };
        let pixels = self.picture.rgb.iter().enumerate();
        pixels.filter_map(move |(pixel, &rgb)| shows(pixel).then_some(rgb))
    }

    /// Returns the mean radiance of the pixels that show a surface, without the brightest twentieth
    /// of them. Pixels of the sky do not count.
    pub fn mean_radiance(&self) -> f64 {
        let value = |pixel: [f32; 3]| f64::from(pixel.iter().sum::<f32>()) / 3.0;
        let mut values: Vec<f64> = self.surface_pixels(|_| true).map(value).collect();
        values.retain(|value| value.is_finite());
        values.sort_unstable_by(f64::total_cmp);
        values.truncate(values.len() - values.len() / 20);
        values.iter().sum::<f64>() / values.len().max(1) as f64
    }

    /// Returns the centre of a pixel in a picture of another size, and the index of the camera.
    pub fn full_size_position(&self, pixel: usize, size: [u32; 2]) -> Option<([f64; 2], usize)> {
        let (width, height) = (self.picture.width as usize, f64::from(self.picture.height));
        let at = [(pixel % width) as f64 + 0.5, (pixel / width) as f64 + 0.5];
        Some((
            [
                at[0] / width as f64 * f64::from(size[0]),
                at[1] / height * f64::from(size[1]),
            ],
            self.camera,
        ))
    }

    /// Returns the first pixel for which `holds` is true.
    pub fn first_pixel_where(&self, holds: impl Fn([f32; 3]) -> bool) -> Option<usize> {
        self.picture.rgb.iter().position(|&pixel| holds(pixel))
    }
}

/// Returns the camera of a picture as the subject of a finding.
pub(super) fn camera_subject(
    scene_facts: &SceneFacts<'_>,
    picture: &SmallRender,
) -> FindingSubject {
    FindingSubject::Camera((!scene_facts.scene.cameras.is_empty()).then_some(picture.camera))
}
