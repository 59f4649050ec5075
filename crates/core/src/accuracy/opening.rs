//! Course of a measurement: a first look at the picture, the tiles, the reference, and the trials.

use rayon::iter::{IntoParallelIterator, ParallelIterator};

use super::ProgressListener;
use super::policy::{TRIAL_SHARE, expected_seconds, is_done, jobs, next_job};
use super::renderer::{FilmRequest, REPLICATES, SettingRenderer, none_if_cancelled};
use super::setting::{RungSetting, reference_setup};
use super::study::{Study, TRIALS_END};
use super::tiles::{FEWEST_TILES, crop_picture, evenly_spread_tiles, tile_count, tile_crop};
use super::trial::{Job, Region, TileSums, Trial, mean_of_replicates, replicates_of};
use crate::film::Film;
use crate::ladder::{Ladder, RungChoice};
use crate::picture::Picture;
use crate::prepare::PrepareError;
use crate::settings::Crop;

/// Largest share of the budget for the samples of the reference beyond the fewest. Its noise then
/// adds less than .5 % to an error (`benches/runs/2026-11-27-advice.md`).
const REFERENCE_SHARE: f64 = 0.1;
/// Most samples per pixel of the reference: more tell nothing on a picture of few pixels.
const MOST_REFERENCE_SAMPLES: u32 = 16_384;
/// Largest width and height in pixels of the magnified part of a picture, and its largest share of
/// the picture's edges. On a page each pixel is then a visible square.
const DETAIL: ([u32; 2], f64) = ([64, 48], 0.4);

impl Study<'_> {
    /// Runs trials until the policy has none left, the time of the trials is over, or the observer
    /// stops the measurement. Returns whether trials are left.
    ///
    /// # Errors
    /// A render that cannot be prepared; [`PrepareError::Cancelled`] before the first trials.
    pub fn run(&mut self, listener: ProgressListener<'_>) -> Result<bool, PrepareError> {
        listener("a first look at the picture", 0.0);
        self.look_at_picture()?;
        listener("the reference", self.spent_share());
        self.render_reference()?;
        while let Some(job) = next_job(self) {
            if self.renderer.observer.is_cancelled() {
                return Ok(true);
            }
            listener(&job.setting.to_string(), self.spent_share());
            if !self.run_job(job)? {
                break;
            }
        }
        let jobs = jobs(self);
        let is_left = |at: usize| jobs[at].round == 0 && !is_done(self, &jobs, at);
        Ok((0..jobs.len()).any(is_left))
    }

    /// Runs a job and adds its trial to the table. Returns false if the time of the trials is over.
    pub fn run_job(&mut self, job: Job) -> Result<bool, PrepareError> {
        let before = (self.renderer.now)();
        let end = match job.region {
            Region::Whole => self.instant_of(TRIALS_END),
            Region::Tiles => self.time_limit(expected_seconds(self, &job)),
        };
        let rendered = none_if_cancelled(self.render(&job, end))?;
        let wall = ((self.renderer.now)() - before).as_secs_f64();
        let is_over = || self.seconds_until(TRIALS_END) == 0.0;
        match rendered {
            Some((timed, _)) if job.region == Region::Whole => {
                if self.table.is_empty() {
                    let samples = f64::from(self.space.sample_count(&job.setting));
                    self.choose_tiles(wall / samples, &timed.film.mean_colours());
                    self.choose_detail(&timed.film)?;
                }
                self.record_whole(&job, &timed, wall, end);
            }
            Some((timed, replicates)) => self.record_tiles(&job, &timed, replicates, wall),
            None if is_over() || self.renderer.observer.is_cancelled() => return Ok(false),
            None => self.table.push(Trial::too_long(job)),
        }
        Ok(true)
    }

    /// Renders a whole picture of few samples, which tells the speed, and by which tiles are chosen. It
    /// also prepares the scene and allocates memory.
    pub fn look_at_picture(&mut self) -> Result<(), PrepareError> {
        let samples = self.space.sample_settings().into_iter();
        let mut enough = samples.filter(|s| self.space.sample_count(s) >= REPLICATES);
        let job = Job::whole(&enough.next().unwrap_or_default());
        if !self.run_job(job)? {
            return Err(PrepareError::Cancelled);
        }
        self.first_look = self.renderer.time_first_look(self.instant_of(TRIALS_END))?;
        Ok(())
    }

    /// Chooses as many tiles, evenly spread, as the time allows for one trial of each rung, and the
    /// brightest: what `clamp` does to a lamp shows nowhere else.
    fn choose_tiles(&mut self, seconds_per_sample: f64, picture: &Picture) {
        let size = self.renderer.settings.size;
        let mut order = evenly_spread_tiles(size, self.renderer.settings.seed);
        let light = |&tile: &u32| -> f32 {
            let shown = crop_picture(picture, tile_crop(size, tile));
            shown.rgb.as_flattened().iter().sum()
        };
        let brightest = order.iter().copied();
        self.brightest = brightest
            .max_by(|a, b| light(a).total_cmp(&light(b)))
            .unwrap_or_default();
        // Stable, so that the others stay evenly spread.
        order.sort_by_key(|&tile| tile != self.brightest);
        let [baseline, own] = [&self.space.baseline, &RungSetting::default()]
            .map(|setting| seconds_per_sample * f64::from(self.space.sample_count(setting)));
        let left = self.seconds_until(TRIALS_END);
        let whole = 2.0 * baseline + if own < TRIAL_SHARE * left { own } else { 0.0 };
        let rungs = self.space.rung_settings().len();
        // The exact setting and the reference take longer, and the baseline is repeated.
        let trials = 4.0 + 1.2 * rungs as f64;
        let left = (1.0 - REFERENCE_SHARE) * left - whole;
        let count = (order.len() as f64 * left / (trials * baseline).max(1e-9)) as usize;
        self.tiles = order[..count.clamp(FEWEST_TILES.min(order.len()), order.len())].to_vec();
        self.tiles.sort_unstable();
    }

    /// Chooses the magnified part of the picture: about the tile with the most noise in this film, of the
    /// tiles with an object in their middle.
    fn choose_detail(&mut self, film: &Film) -> Result<(), PrepareError> {
        let size = self.renderer.settings.size;
        let objects = self.renderer.find_objects(self.instant_of(1.0))?;
        let rank = |tile: u32| {
            let replicates = film.tile_replicates(tile).unwrap_or_default();
            let noise = replicates.first().map_or(0.0, |_| {
                let truth = mean_of_replicates(&replicates);
                TileSums::new(&replicates, &replicates[..1], &truth).noise
            });
            let object = objects.get(tile as usize);
            (object.is_some_and(|&object| object >= 0.0), noise)
        };
        let tiles = 0..tile_count(size) as u32;
        let ranked: Vec<_> = tiles
            .into_par_iter()
            .map(|tile| (rank(tile), tile))
            .collect();
        let most = ranked
            .into_iter()
            .max_by(|(a, _), (b, _)| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let tile = tile_crop(size, most.map_or(0, |(_, tile)| tile));
        let (largest, share) = DETAIL;
        let [width, height] = [0, 1].map(|i| {
            let part = (share * f64::from(size[i])).ceil() as u32;
            part.max(8 * REPLICATES).min(largest[i]).min(size[i])
        });
        let start = |start: u32, edge: u32, shown: u32, all: u32| {
            let first = (start + edge / 2).saturating_sub(shown / 2);
            first.min(all - shown)
        };
        self.detail = Crop {
            x: start(tile.x, tile.width, width, size[0]),
            y: start(tile.y, tile.height, height, size[1]),
            width,
            height,
        };
        Ok(())
    }

    /// Renders the reference on the tiles.
    pub fn render_reference(&mut self) -> Result<(), PrepareError> {
        self.space.exact = self.find_exact_rungs()?;
        // Arithmetic in f64 and long paths take about twice the time.
        let cost = 2.0 * self.seconds_of_sample() * self.tile_share();
        let most = REFERENCE_SHARE * self.effort.budget.as_secs_f64();
        let mut samples = 4 * REPLICATES;
        while samples < MOST_REFERENCE_SAMPLES && 4.0 * f64::from(samples) * cost < most {
            samples *= 4;
        }
        let of = self.renderer;
        let (scene, settings) = reference_setup(&self.space.exact, of.scene, of.settings, samples);
        let clocks = (of.stopwatch, of.now);
        let renderer = SettingRenderer::new(&scene, &settings, of.observer, clocks);
        let timed = renderer.render_film(&FilmRequest {
            setting: &RungSetting::default(),
            round: 0,
            tiles: Some(&self.tiles),
            denoises: false,
            end: self.instant_of(TRIALS_END),
        })?;
        let replicates = replicates_of(&timed.film, &self.tiles).unwrap_or_default();
        self.set_reference(timed, replicates);
        Ok(())
    }

    /// Returns the most exact rung of each ladder with bias. Of the path lengths it is the longest
    /// with which a few tiles are rendered in time; longer ones count as trials that took too long.
    fn find_exact_rungs(&mut self) -> Result<RungSetting, PrepareError> {
        let is_biased = |ladder: &&Ladder| {
            // No pixel filter is more exact than another.
            !ladder.is_free_of_bias()
                && !matches!(ladder, Ladder::PixelFilter | Ladder::Reconstruction)
        };
        let most_exact = |&ladder: &Ladder| {
            let exact = self.space.applicable_rungs(ladder).pop();
            exact.filter(|&choice| !self.space.is_in_use(choice))
        };
        let ladders = self.space.ladders.iter().filter(is_biased);
        let exact: Vec<RungChoice> = ladders.filter_map(most_exact).collect();
        let exact = RungSetting::from_rungs(&exact);
        let without = exact.without_ladder(Ladder::PathLength);
        if exact == without {
            return Ok(exact);
        }
        let tiles = self.tiles[..self.tiles.len().min(FEWEST_TILES / 4)].to_vec();
        let share = tiles.len() as f64 / tile_count(self.renderer.settings.size) as f64;
        let mut lengths = self.space.applicable_rungs(Ladder::PathLength);
        while let Some(choice) = lengths
            .pop()
            .filter(|&choice| !self.space.is_in_use(choice))
        {
            let exact = exact.with_rung(choice);
            let setting = self.space.applied_to_baseline(&exact);
            let samples = f64::from(self.space.sample_count(&setting));
            let render = self.renderer.render_film(&FilmRequest {
                setting: &setting,
                round: 0,
                tiles: Some(&tiles),
                denoises: false,
                end: self.time_limit(self.seconds_of_sample() * samples * share),
            });
            if none_if_cancelled(render)?.is_some() {
                return Ok(exact);
            }
            if self.seconds_until(TRIALS_END) == 0.0 || self.renderer.observer.is_cancelled() {
                break;
            }
            let job = Job::tiles(&self.space.baseline.with_rung(choice), 0);
            self.table.push(Trial::too_long(job));
        }
        Ok(without)
    }
}
