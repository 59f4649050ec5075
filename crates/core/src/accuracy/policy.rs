//! The policy of a measurement: which trial is next.

use core::fmt;

use super::figures::Figures;
use super::setting::RungSetting;
use super::space::TILE_SAMPLES;
use super::study::{FIRST_SAMPLES, Study, TRIALS_END, WHOLE_SHARE};
use super::trial::{Region, Trial};

/// Largest share of the remaining time for which a single trial is begun.
const TRIAL_SHARE: f64 = 0.4;
/// Number of rungs after which the baseline is timed again: the speed of a machine changes within a
/// minute.
const RUNGS_BETWEEN_TIMINGS: usize = 4;

/// Trial that is still to be done.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Job {
    pub setting: RungSetting,
    pub region: Region,
    pub round: u64,
    /// Whether the scene is prepared anew, so that the preparation is timed.
    pub prepares: bool,
}

impl fmt::Display for Job {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let word = if self.prepares { "timing " } else { "" };
        write!(f, "{word}{}", self.setting)
    }
}

impl Study<'_> {
    /// Returns the next trial: the first of the order that is not in the table and for which the
    /// time suffices.
    pub fn next_job(&self) -> Option<Job> {
        let left = self.seconds_until(TRIALS_END);
        let budget = self.effort.budget.as_secs_f64();
        let jobs = self.jobs();
        let exact = self.space.exact_baseline();
        // Differences to the exact picture need its trial with the same random numbers.
        let paired_round = self.exact_replicates.as_ref().map(|(round, _)| *round);
        let is_paired = |job: &Job| {
            job.round == 0
                || paired_round.is_none_or(|round| {
                    job.round == round || job.round == round + 1 && job.setting == exact
                })
        };
        let is_affordable = |job: &Job| {
            let is_small = self.space.sample_count(&job.setting) <= TILE_SAMPLES;
            let most = match job.region {
                Region::Whole if !is_small => (WHOLE_SHARE * budget).min(TRIAL_SHARE * left),
                Region::Tiles if job.round == 0 && job.setting == self.space.baseline => left,
                _ => TRIAL_SHARE * left,
            };
            left > 0.0 && self.expected_seconds(job) <= most
        };
        let position = (0..jobs.len()).find(|&at| {
            !self.is_done(&jobs, at) && is_paired(&jobs[at]) && is_affordable(&jobs[at])
        });
        position.map(|at| jobs[at].clone())
    }

    /// Returns all trials in the order of the policy: small whole pictures, whose claims tell the
    /// error of noise; the exact setting and the baseline on tiles; the whole picture of the setting
    /// in use; each rung once; larger whole pictures; then further rounds of the rungs whose error
    /// or time may still decide the recommendation.
    pub fn jobs(&self) -> Vec<Job> {
        let job = |setting: &RungSetting, region: Region, round: u64| Job {
            setting: setting.clone(),
            region,
            round,
            prepares: false,
        };
        let tiles = |setting: &RungSetting| job(setting, Region::Tiles, 0);
        let samples = self.space.sample_settings();
        let (small, large): (Vec<_>, Vec<_>) = samples.iter().partition(|setting| {
            (FIRST_SAMPLES..=TILE_SAMPLES).contains(&self.space.sample_count(setting))
        });
        let mut jobs: Vec<Job> = small.iter().map(|s| job(s, Region::Whole, 0)).collect();
        let own = RungSetting::default();
        jobs.extend([
            tiles(&self.space.exact_baseline()),
            tiles(&self.space.baseline),
        ]);
        jobs.extend(
            samples
                .iter()
                .filter(|s| self.space.is_fixed(s) && **s != own)
                .map(tiles),
        );
        jobs.extend(
            self.space
                .general_baseline()
                .filter(|s| *s != self.space.baseline)
                .iter()
                .map(tiles),
        );
        jobs.push(job(&own, Region::Whole, 0));
        for rungs in self.space.rung_settings().chunks(RUNGS_BETWEEN_TIMINGS) {
            jobs.extend(rungs.iter().map(tiles));
            jobs.push(tiles(&self.space.baseline));
        }
        for &choice in &self.space.cost_choices() {
            jobs.push(Job {
                prepares: true,
                ..tiles(&self.space.with_rung(choice))
            });
        }
        jobs.extend(large.iter().map(|s| job(s, Region::Whole, 0)));
        let figures = Figures::new(self);
        for round in 1..u64::from(self.effort.rounds) {
            // A second time of each rung tells how far times vary.
            let rungs = match round {
                1 => self.space.rung_settings(),
                _ => figures.contenders(),
            };
            let all = [self.space.exact_baseline(), self.space.baseline.clone()];
            let all = all.into_iter().chain(rungs);
            jobs.extend(all.map(|setting| job(&setting, Region::Tiles, round)));
        }
        jobs
    }

    /// Whether the table has a trial for each job that equals the one at this place, up to it.
    pub fn is_done(&self, jobs: &[Job], at: usize) -> bool {
        let job = &jobs[at];
        let needed = jobs[..=at].iter().filter(|other| *other == job).count();
        let is_own = |trial: &&Trial| {
            trial.setting == job.setting
                && trial.region == job.region
                && trial.round == job.round
                && trial.is_prepared_anew == job.prepares
        };
        self.table.iter().filter(is_own).count() >= needed
    }

    /// Returns the expected wall-clock seconds of a trial: those of an earlier trial of the same
    /// setting, or as many for each sample as the largest whole picture took.
    pub fn expected_seconds(&self, job: &Job) -> f64 {
        let earlier = self.table.iter().find(|trial| {
            (&trial.setting, trial.region) == (&job.setting, job.region)
                && trial.seconds.is_finite()
        });
        if let Some(earlier) = earlier {
            return earlier.wall;
        }
        let samples = f64::from(self.space.sample_count(&job.setting));
        let share = match job.region {
            Region::Whole => 1.0,
            Region::Tiles => self.tile_share(),
        };
        self.seconds_per_sample() * samples * share
    }

    /// Returns the wall-clock seconds of a whole picture's sample per pixel.
    pub fn seconds_per_sample(&self) -> f64 {
        let whole = self
            .table
            .iter()
            .filter(|trial| trial.region == Region::Whole);
        let largest = whole.max_by_key(|trial| self.space.sample_count(&trial.setting));
        largest.map_or(0.0, |trial| {
            trial.wall / f64::from(self.space.sample_count(&trial.setting))
        })
    }
}
