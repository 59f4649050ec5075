//! The policy of a measurement: which trial is next.

use super::figures::Figures;
use super::setting::RungSetting;
use super::space::{FIRST_SAMPLES, TILE_SAMPLES};
use super::study::{Study, TRIALS_END};
use super::trial::{Job, Region, Trial};

/// Largest share of the budget for a whole picture of more samples than the tiles have.
pub(super) const WHOLE_SHARE: f64 = 0.3;
/// Largest share of the remaining time for which a single trial is begun.
const TRIAL_SHARE: f64 = 0.4;
/// Number of rungs after which the baseline is timed again: the speed of a machine changes within a
/// minute.
const RUNGS_BETWEEN_TIMINGS: usize = 4;

/// Returns the next trial: the first of the order that is not in the table and for which the
/// time suffices.
pub(super) fn next_job(study: &Study<'_>) -> Option<Job> {
    let left = study.seconds_until(TRIALS_END);
    let budget = study.effort.budget.as_secs_f64();
    let jobs = jobs(study);
    let exact = study.space.exact_baseline();
    // Differences to the exact picture need its trial with the same random numbers.
    let paired_round = study.exact_replicates.as_ref().map(|(round, _)| *round);
    let is_paired = |job: &Job| {
        job.round == 0
            || paired_round.is_none_or(|round| {
                job.round == round || job.round == round + 1 && job.setting == exact
            })
    };
    let is_affordable = |job: &Job| {
        let is_small = study.space.sample_count(&job.setting) <= TILE_SAMPLES;
        let most = match job.region {
            Region::Whole if !is_small => (WHOLE_SHARE * budget).min(TRIAL_SHARE * left),
            Region::Tiles if job.round == 0 && job.setting == study.space.baseline => left,
            _ => TRIAL_SHARE * left,
        };
        left > 0.0 && expected_seconds(study, job) <= most
    };
    let position = (0..jobs.len())
        .find(|&at| !is_done(study, &jobs, at) && is_paired(&jobs[at]) && is_affordable(&jobs[at]));
    position.map(|at| jobs[at].clone())
}

/// Returns all trials in the order of the policy: small whole pictures, whose claims tell the
/// error of noise; the exact setting and the baseline on tiles; the whole picture of the setting
/// in use, and of fewer samples; each rung once; other whole pictures; then further rounds of the
/// rungs whose error or time may still decide the recommendation.
pub(super) fn jobs(study: &Study<'_>) -> Vec<Job> {
    let job = |setting: &RungSetting, region: Region, round: u64| Job {
        setting: setting.clone(),
        region,
        round,
        prepares: false,
    };
    let tiles = |setting: &RungSetting| job(setting, Region::Tiles, 0);
    let whole = |settings: &[&RungSetting]| -> Vec<Job> {
        settings.iter().map(|s| job(s, Region::Whole, 0)).collect()
    };
    let (samples, own) = (study.space.sample_settings(), RungSetting::default());
    let count = |setting: &&RungSetting| study.space.sample_count(setting);
    let (small, large): (Vec<_>, Vec<_>) = samples
        .iter()
        .partition(|setting| (FIRST_SAMPLES..=TILE_SAMPLES).contains(&count(setting)));
    let (fewer, others): (Vec<_>, Vec<_>) = large.into_iter().rev().partition(|setting| {
        **setting == own || (TILE_SAMPLES..=count(&&own)).contains(&count(setting))
    });
    let mut jobs = whole(&small);
    jobs.extend([
        tiles(&study.space.exact_baseline()),
        tiles(&study.space.baseline),
    ]);
    jobs.extend(
        samples
            .iter()
            .filter(|s| study.space.is_fixed(s) && **s != own)
            .map(tiles),
    );
    jobs.extend(
        study
            .space
            .general_baseline()
            .filter(|s| *s != study.space.baseline)
            .iter()
            .map(tiles),
    );
    jobs.extend(whole(&fewer));
    for rungs in study.space.rung_settings().chunks(RUNGS_BETWEEN_TIMINGS) {
        jobs.extend(rungs.iter().map(tiles));
        jobs.push(tiles(&study.space.baseline));
    }
    for &choice in &study.space.cost_choices() {
        jobs.push(Job {
            prepares: true,
            ..tiles(&study.space.with_rung(choice))
        });
    }
    jobs.extend(whole(&others));
    let figures = Figures::new(study);
    for round in 1..u64::from(study.effort.rounds) {
        // A second time of each rung tells how far times vary.
        let rungs = match round {
            1 => study.space.rung_settings(),
            _ => figures.contenders(),
        };
        let all = [study.space.exact_baseline(), study.space.baseline.clone()];
        let all = all.into_iter().chain(rungs);
        jobs.extend(all.map(|setting| job(&setting, Region::Tiles, round)));
    }
    jobs
}

/// Whether the table has a trial for each job that equals the one at this place, up to it.
pub(super) fn is_done(study: &Study<'_>, jobs: &[Job], at: usize) -> bool {
    let job = &jobs[at];
    let needed = jobs[..=at].iter().filter(|other| *other == job).count();
    let is_own = |trial: &&Trial| {
        trial.setting == job.setting
            && trial.region == job.region
            && trial.round == job.round
            && trial.is_prepared_anew == job.prepares
    };
    study.table.iter().filter(is_own).count() >= needed
}

/// Returns the expected wall-clock seconds of a trial: those of an earlier trial of the same
/// setting, or as many for each sample as the largest whole picture took.
pub(super) fn expected_seconds(study: &Study<'_>, job: &Job) -> f64 {
    let earlier = study.table.iter().find(|trial| {
        (&trial.setting, trial.region) == (&job.setting, job.region) && trial.seconds.is_finite()
    });
    if let Some(earlier) = earlier {
        return earlier.wall;
    }
    let samples = f64::from(study.space.sample_count(&job.setting));
    let share = match job.region {
        Region::Whole => 1.0,
        Region::Tiles => study.tile_share(),
    };
    expected_seconds_of_sample(study) * samples * share
}

/// Returns the wall-clock seconds of a whole picture's sample per pixel.
pub(super) fn expected_seconds_of_sample(study: &Study<'_>) -> f64 {
    let whole = study
        .table
        .iter()
        .filter(|trial| trial.region == Region::Whole);
    let largest = whole.max_by_key(|trial| study.space.sample_count(&trial.setting));
    largest.map_or(0.0, |trial| {
        trial.wall / f64::from(study.space.sample_count(&trial.setting))
    })
}
