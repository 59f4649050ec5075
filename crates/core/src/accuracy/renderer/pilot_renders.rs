//! Renders from which a measurement is planned: the pilot pass over tiles, and the pilots, two noisy
//! whole pictures.

use std::time::Instant;

use super::{SettingRenderer, UnfinishedRender};
use crate::accuracy::estimate::relative_variance;
use crate::accuracy::setting::RungSetting;
use crate::accuracy::tiles::{PilotTile, TileGrid};
use crate::dispatch::ReadyScene;
use crate::film::Film;
use crate::picture::Picture;
use crate::settings::{Sampling, Settings};

/// Largest number of samples per pixel of the pilot pass, a short render that measures time and
/// noise of the tiles.
const LOOK_SAMPLES: u32 = 4;

/// Number that selects the random numbers of the first pilot (noisy whole picture). No measured
/// setting uses these random numbers.
const PILOT_ROUND: u64 = 1000;

impl SettingRenderer<'_> {
    /// Returns the number of samples per pixel of the pilot pass, a short render that measures time
    /// and noise of the tiles.
    pub fn pilot_pass_samples(&self) -> u32 {
        let samples = self.settings.sampling.samples_per_pixel();
        if self.settings.sampling.is_fixed() {
            samples
        } else {
            samples.clamp(2, LOOK_SAMPLES)
        }
    }

    /// Renders tiles with few samples and returns the time and the noise of each tile; see
    /// [`PilotTile`] for units.
    pub fn run_pilot_pass(
        &self,
        grid: TileGrid,
        tiles: &[u32],
        end: Instant,
    ) -> Result<Vec<PilotTile>, UnfinishedRender> {
        let sampling = self.settings.sampling;
        let sampling = if sampling.is_fixed() {
            sampling
        } else {
            Sampling::General(self.pilot_pass_samples())
        };
        let settings = Settings {
            sampling,
            replicates: Some(2),
            denoise: false,
            ..self.settings.clone()
        };
        let (until, parts) = (
            self.deadline_observer(end),
            tiles
                .iter()
                .map(|&tile| grid.tile_crop(tile))
                .collect::<Vec<_>>(),
        );
        self.run_on_prepared_scene(
            &RungSetting::default(),
            (self.scene, &settings),
            end,
            |ready| {
                let render = |settings: &Settings| ready.render_with_settings(settings, &until);
                let films = self.render_crops_in_parallel(&parts, &settings, render, |film| {
                    film.counters().ray_count()
                });
                if films.iter().any(|(film, _)| film.unfinished_pixels() > 0) {
                    return Err(UnfinishedRender::Interrupted);
                }
                Ok(tiles
                    .iter()
                    .zip(&films)
                    .map(|(&tile, (film, seconds))| PilotTile {
                        tile,
                        seconds: *seconds,
                        noise: sum_relative_variances(film),
                    })
                    .collect())
            },
        )?
    }

    /// Renders a pilot: a noisy whole picture with the scene's settings, but with this number of
    /// samples per pixel and with random numbers that no setting uses.
    pub fn render_pilot(
        &self,
        samples: u32,
        round: u64,
        end: Instant,
    ) -> Result<Picture, UnfinishedRender> {
        let seed = self.settings.seed.wrapping_add(PILOT_ROUND + round);
        let settings = Settings {
            sampling: Sampling::General(samples),
            denoise: false,
            seed,
            ..self.settings.clone()
        };
        let render = |ready: &ReadyScene| self.render_and_time(ready, (&settings, &[]), 0.0, end);
        let mut renders = self.run_on_prepared_scene(
            &RungSetting::default(),
            (self.scene, &settings),
            end,
            render,
        )??;
        renders
            .pop()
            .map(|render| render.picture)
            .ok_or(UnfinishedRender::Interrupted)
    }
}

/// Returns the sum of the relative variances of all pixels of a film.
fn sum_relative_variances(film: &Film) -> f64 {
    film.full_part()
        .tiles
        .filter_map(|part| film.tile_means_and_variances(part))
        .flatten()
        .map(|pixel| relative_variance(&pixel))
        .sum()
}
