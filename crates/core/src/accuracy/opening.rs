//! Course of a measurement: a first look at the picture, the tiles, the reference, and the trials.

use rayon::iter::{IntoParallelRefIterator, ParallelIterator};

use super::policy::{
    WHOLE_SHARE, expected_seconds, expected_seconds_of_sample, is_done, jobs, next_job,
};
use super::renderer::{FilmRequest, REPLICATES, UnfinishedRender};
use super::setting::RungSetting;
use super::space::{FEWEST_TILES, FIRST_SAMPLES};
use super::study::{Study, TRIALS_END};
use super::tiles::{evenly_spread_tiles, tile_count, tile_crop};
use super::trial::{Job, Region, TileSums, Trial, mean_of_replicates, replicates_of};
use super::{MeasureError, MeasurementStart, ProgressListener};
use crate::film::Film;
use crate::ladder::{Ladder, RungChoice};
use crate::prepare::PrepareError;
use crate::settings::Crop;

/// Largest share of the budget for the samples of the reference beyond the fewest.
const REFERENCE_SHARE: f64 = 0.1;
/// Most samples per pixel of the reference.
const MOST_REFERENCE_SAMPLES: u32 = 16_384;
/// Largest size in pixels of the shown part of a picture of which all tiles are rendered.
const SHOWN: [u32; 2] = [128, 96];

impl Study<'_> {
    /// Runs trials until the policy has none left, the time of the trials is over, or the observer
    /// stops the measurement. Returns whether trials are left.
    ///
    /// # Errors
    /// See [`MeasureError`].
    pub fn run(
        &mut self,
        start: MeasurementStart<'_>,
        listener: &mut dyn ProgressListener,
    ) -> Result<bool, MeasureError> {
        let renderer = self.renderer;
        let as_measure_error = |error| renderer.to_measure_error(error);
        listener.report_step("a first look at the picture", 0.0);
        self.look_at_picture().map_err(as_measure_error)?;
        listener.report_step("the reference", self.spent_share());
        self.render_reference(start)?;
        while let Some(job) = next_job(self) {
            if renderer.observer.is_cancelled() {
                return Ok(true);
            }
            listener.report_step(&job.to_string(), self.spent_share());
            if !self.run_job(&job).map_err(as_measure_error)? {
                break;
            }
        }
        let jobs = jobs(self);
        let is_left = |at: usize| jobs[at].round == 0 && !is_done(self, &jobs, at);
        Ok((0..jobs.len()).any(is_left))
    }

    /// Runs a trial and adds it to the table. Returns false if the time of the trials is over.
    fn run_job(&mut self, job: &Job) -> Result<bool, PrepareError> {
        let before = (self.renderer.now)();
        let end = match job.region {
            Region::Whole => self.instant_of(TRIALS_END),
            Region::Tiles => self.time_limit(expected_seconds(self, job)),
        };
        let rendered = UnfinishedRender::none_if_interrupted(self.render(job, end))?;
        let wall = ((self.renderer.now)() - before).as_secs_f64();
        match rendered {
            Some((timed, _)) if job.region == Region::Whole => {
                self.record_whole(job, timed, wall, end);
            }
            Some((timed, replicates)) => self.record_tiles(job, &timed, replicates, wall),
            None if self.seconds_until(TRIALS_END) == 0.0
                || self.renderer.observer.is_cancelled() =>
            {
                return Ok(false);
            }
            None => self.table.push(Trial {
                round: job.round,
                is_prepared_anew: job.prepares,
                region: job.region,
                ..Trial::too_long(job.setting.clone())
            }),
        }
        Ok(true)
    }

    /// Renders a whole picture of few samples, which tells the speed, and chooses the tiles.
    pub fn look_at_picture(&mut self) -> Result<(), PrepareError> {
        let samples = self.space.sample_settings();
        let first = samples
            .iter()
            .find(|s| self.space.sample_count(s) >= FIRST_SAMPLES);
        let job = Job {
            setting: first.cloned().unwrap_or_default(),
            region: Region::Whole,
            round: 0,
            prepares: false,
        };
        let before = (self.renderer.now)();
        let end = self.instant_of(1.0);
        // The first render also prepares the scene and allocates memory.
        let (timed, _) = self
            .render(&job, end)
            .map_err(UnfinishedRender::into_error)?;
        let wall = ((self.renderer.now)() - before).as_secs_f64();
        self.choose_tiles(
            &timed.film,
            wall / f64::from(self.space.sample_count(&job.setting)),
        );
        self.record_whole(&job, timed, wall, end);
        Ok(())
    }

    /// Chooses as many tiles, evenly spread, as the time allows for one trial of each rung, and the
    /// shown part of the picture: where the noise of this film is greatest.
    fn choose_tiles(&mut self, film: &Film, seconds_per_sample: f64) {
        let size = self.renderer.settings.size;
        let order = evenly_spread_tiles(size, self.renderer.settings.seed);
        let baseline =
            seconds_per_sample * f64::from(self.space.sample_count(&self.space.baseline));
        let own = seconds_per_sample * f64::from(self.space.sample_count(&RungSetting::default()));
        let budget = self.effort.budget.as_secs_f64();
        let whole = baseline + if own < WHOLE_SHARE * budget { own } else { 0.0 };
        let rungs = self.space.rung_settings().len() + self.space.cost_choices().len();
        // The exact setting and the reference take longer, and the baseline is repeated.
        let trials = 4.0 + 1.2 * rungs as f64;
        let left = (1.0 - REFERENCE_SHARE) * self.seconds_until(TRIALS_END) - whole;
        let count = (order.len() as f64 * left / (trials * baseline).max(1e-9)) as usize;
        self.tiles = order[..count.clamp(FEWEST_TILES.min(order.len()), order.len())].to_vec();
        self.tiles.sort_unstable();
        let noise = |&tile: &u32| {
            let replicates = film.tile_replicates(tile).unwrap_or_default();
            let truth = replicates.first().map(|_| mean_of_replicates(&replicates));
            truth.map_or(0.0, |truth| {
                TileSums::new(&replicates, &replicates[..1], &truth, true).noise[0]
            })
        };
        let noises: Vec<f64> = self.tiles.par_iter().map(noise).collect();
        let noisiest = (0..noises.len()).max_by(|&a, &b| noises[a].total_cmp(&noises[b]));
        let tile = tile_crop(size, noisiest.map_or(0, |at| self.tiles[at]));
        self.shown = tile;
        if self.tiles.len() == order.len() {
            let [width, height] = [0, 1].map(|i| SHOWN[i].min(size[i]));
            let start = |start: u32, edge: u32, shown: u32, all: u32| {
                (start + edge / 2)
                    .saturating_sub(shown / 2)
                    .min(all - shown)
            };
            self.shown = Crop {
                x: start(tile.x, tile.width, width, size[0]),
                y: start(tile.y, tile.height, height, size[1]),
                width,
                height,
            };
        }
    }

    /// Renders the reference on the tiles.
    pub fn render_reference(&mut self, start: MeasurementStart<'_>) -> Result<(), MeasureError> {
        let renderer = self.renderer;
        self.space.exact = match &start.reference {
            Some(kept) => RungSetting::from_rungs(&kept.rungs),
            None => self
                .find_exact_rungs()
                .map_err(|error| renderer.to_measure_error(error))?,
        };
        let budget = self.effort.budget.as_secs_f64();
        // Arithmetic in f64 and long paths take about twice the time.
        let cost = 2.0 * expected_seconds_of_sample(self) * self.tile_share();
        let mut samples = 4 * REPLICATES;
        while samples < MOST_REFERENCE_SAMPLES
            && 4.0 * f64::from(samples) * cost < REFERENCE_SHARE * budget
        {
            samples *= 4;
        }
        let kept = start.reference.as_ref();
        let samples = samples.max(
            kept.and_then(|kept| kept.film.requested_samples())
                .unwrap_or(0),
        );
        let end = self.instant_of(TRIALS_END);
        let mut reference = renderer.prepare_reference(&self.space.exact, samples, start, end)?;
        let is_done = renderer.render_reference(&mut reference, &self.tiles, end);
        let replicates = replicates_of(&reference.film, &self.tiles).filter(|_| is_done);
        self.reference_replicates =
            replicates.ok_or_else(|| renderer.to_measure_error(PrepareError::Cancelled))?;
        self.truth = self
            .reference_replicates
            .iter()
            .map(|replicates| mean_of_replicates(replicates))
            .collect();
        self.reference = Some(reference);
        Ok(())
    }

    /// Returns the most exact rung of each ladder with bias. Of the path lengths it is the longest
    /// with which a few tiles are rendered in time; longer ones count as trials that took too long.
    fn find_exact_rungs(&mut self) -> Result<RungSetting, PrepareError> {
        let is_biased = |ladder: &&Ladder| {
            !ladder.is_free_of_bias()
                && !ladder.has_equal_accuracy()
                && **ladder != Ladder::Reconstruction
        };
        let most_exact = |ladder: &Ladder| {
            let mut choices = self.space.applicable_rungs(*ladder).into_iter().rev();
            choices.find(RungChoice::can_be_reference)
        };
        let exact: Vec<_> = self
            .space
            .ladders
            .iter()
            .filter(is_biased)
            .filter_map(most_exact)
            .collect();
        let exact: Vec<_> = exact
            .into_iter()
            .filter(|c| !self.space.is_in_use(*c))
            .collect();
        let exact = RungSetting::from_rungs(&exact);
        if exact.rung(Ladder::PathLength).is_none() {
            return Ok(exact);
        }
        let tiles: Vec<u32> = self.tiles.iter().copied().take(FEWEST_TILES / 4).collect();
        let lengths = self.space.applicable_rungs(Ladder::PathLength);
        let longer = lengths
            .into_iter()
            .rev()
            .take_while(|&choice| !self.space.is_in_use(choice));
        for choice in longer.collect::<Vec<_>>() {
            let exact = exact.with_rung(choice);
            let setting = self.space.applied_to_baseline(&exact);
            let expected = expected_seconds_of_sample(self)
                * f64::from(self.space.sample_count(&setting))
                * tiles.len() as f64
                / tile_count(self.renderer.settings.size) as f64;
            let render = self.renderer.render_film(&FilmRequest {
                setting: &setting,
                round: 0,
                tiles: Some(&tiles),
                denoises: false,
                prepares: false,
                end: self.time_limit(expected),
            });
            if UnfinishedRender::none_if_interrupted(render)?.is_some() {
                return Ok(exact);
            }
            if self.seconds_until(TRIALS_END) == 0.0 || self.renderer.observer.is_cancelled() {
                break;
            }
            self.table
                .push(Trial::too_long(self.space.with_rung(choice)));
        }
        Ok(exact.without_ladder(Ladder::PathLength))
    }
}
