//! A small picture of a camera, from which the checks judge samples, blackness and noise.

use super::RayDeadline;
use super::covers::LightBlocker;
use super::facts::SceneFacts;
use super::finding::{CheckRun, FindingSubject};
use crate::counters::Counters;
use crate::dispatch::ReadyScene;
use crate::picture::Picture;
use crate::prepare::UnreachedLight;

/// A small picture of a camera, with its counters.
pub(super) struct SmallRender {
    pub camera: usize,
    pub picture: Picture,
    pub counters: Counters,
    pub unreached_lights: Vec<UnreachedLight>,
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
        let planned = pixels * u64::from(ready.settings().sampling.samples_per_pixel());
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
            run,
            cover: None,
        }
    }

    /// Returns whether surfaces are visible and all of them are black. Radiances up to 1e-6, which
    /// rounding can cause at grazing angles, count as black.
    pub fn is_black(&self) -> bool {
        const BLACK: f32 = 1e-6;
        let shines = |pixel: [f32; 3]| pixel.iter().any(|&channel| channel > BLACK);
        self.counters.hits > 0
            && self.first_pixel_where(shines).is_none()
            && !self.run.is_cut_short()
    }

    /// Returns the mean radiance of the pixels that show a surface, without the brightest twentieth
    /// of them. Pixels of the sky do not count.
    pub fn mean_radiance(&self) -> f64 {
        let objects = self.picture.layer("object.id");
        let shows_surface =
            |&(pixel, _): &(usize, _)| objects.is_none_or(|layer| layer.samples[pixel] >= 0.0);
        let value = |pixel: &[f32; 3]| f64::from(pixel.iter().sum::<f32>()) / 3.0;
        let pixels = self.picture.rgb.iter().enumerate().filter(shows_surface);
        let mut values: Vec<f64> = pixels.map(|(_, pixel)| value(pixel)).collect();
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
