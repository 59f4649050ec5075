//! The policy of a measurement: which trial is next.

use super::figures::Figures;
use super::renderer::REPLICATES;
use super::setting::RungSetting;
use super::space::TILE_SAMPLES;
use super::study::{Study, TRIALS_END};
use super::trial::{Job, Region};

/// Largest share of the remaining time for which a single trial is begun: the setting in use and
/// one further large picture fit into a budget (`benches/runs/2026-11-29-accuracy.md`).
pub(super) const TRIAL_SHARE: f64 = 0.4;
/// Number of rungs after which the baseline is timed again: the speed of a machine changes within a
/// minute (`benches/runs/2026-11-27-advice.md`).
const RUNGS_BETWEEN_TIMINGS: usize = 4;

/// Samples per pixel from which on the claim of one picture has an interval of its own. Of fewer, two
/// pictures with different seeds tell how much rare light each has found
/// (`benches/runs/2026-12-01-claims.md`).
const CERTAIN_SAMPLES: u32 = 64;

/// Returns the next job: the first of the order that is not in the table and for which the time
/// suffices.
pub(super) fn next_job(study: &Study<'_>) -> Option<Job> {
    let left = study.seconds_until(TRIALS_END);
    let mut jobs = jobs(study);
    let exact = study.space.exact_baseline();
    // Differences to the exact picture need its trial with the same random numbers.
    let paired_round = study.exact_replicates.as_ref().map(|(round, _)| *round);
    let is_paired = |job: &Job| {
        job.round == 0
            || job.region == Region::Whole
            || paired_round.is_none_or(|round| {
                job.round == round || job.round == round + 1 && job.setting == exact
            })
    };
    // Without these two there is no report: no other picture tells the error of a denoised one.
    let own = RungSetting::default();
    let is_needed = |job: &Job| {
        *job == Job::tiles(&study.space.baseline, 0)
            || *job == Job::whole(&own) && study.space.is_denoised(&own)
    };
    let is_affordable =
        |job: &Job| is_needed(job) || expected_seconds(study, job) <= TRIAL_SHARE * left;
    let next = (0..jobs.len())
        .filter(|_| left > 0.0)
        .find(|&at| !is_done(study, &jobs, at) && is_paired(&jobs[at]) && is_affordable(&jobs[at]));
    next.map(|at| jobs.swap_remove(at))
}

/// Returns all jobs in the order of the policy: small whole pictures, whose claims tell the error of
/// noise; the exact setting and the baseline on tiles; the whole picture of the setting in use, of fewer
/// samples, and, if it is denoised, of the next number of samples; those of few samples with another seed;
/// each rung once; other whole pictures; then further rounds of the rungs whose error or time may still
/// decide the recommendation.
pub(super) fn jobs(study: &Study<'_>) -> Vec<Job> {
    let space = &study.space;
    let (samples, own) = (space.sample_settings(), RungSetting::default());
    let count = |setting: &RungSetting| space.sample_count(setting);
    let (small, large): (Vec<_>, Vec<_>) = samples
        .iter()
        .partition(|setting| (REPLICATES..=TILE_SAMPLES).contains(&count(setting)));
    let (fewer, mut others): (Vec<_>, Vec<_>) = large.into_iter().rev().partition(|setting| {
        **setting == own || (TILE_SAMPLES..=count(&own)).contains(&count(setting))
    });
    let mut jobs: Vec<Job> = small.into_iter().map(Job::whole).collect();
    let (exact, baseline) = (space.exact_baseline(), &space.baseline);
    let is_fixed = |setting: &&RungSetting| space.is_fixed(setting) && **setting != own;
    let general = space.general_baseline().filter(|of| of != baseline);
    let first = [&exact, baseline].into_iter();
    let first = first.chain(samples.iter().filter(is_fixed)).chain(&general);
    jobs.extend(first.map(|setting| Job::tiles(setting, 0)));
    jobs.extend(fewer.into_iter().map(Job::whole));
    // No other picture tells the error of a denoised one.
    let is_next = |of: &&RungSetting| count(of) > count(&own) && space.is_denoised(of);
    let next = others.iter().rposition(is_next);
    jobs.extend(next.map(|at| Job::whole(others.remove(at))));
    let uncertain = samples.iter().filter(|setting| {
        !space.is_fixed(setting) && (TILE_SAMPLES..CERTAIN_SAMPLES).contains(&count(setting))
    });
    jobs.extend(uncertain.map(|setting| Job {
        round: 1,
        ..Job::whole(setting)
    }));
    let rungs = space.rung_settings();
    jobs.extend(timed_rungs(&rungs, baseline, 0));
    jobs.extend(others.into_iter().map(Job::whole));
    let figures = Figures { study };
    for round in 1..u64::from(study.effort.rounds) {
        // A second time of each rung tells how far times vary.
        let rungs = match round {
            1 => rungs.clone(),
            _ => figures.contenders(),
        };
        jobs.extend([&exact, baseline].map(|setting| Job::tiles(setting, round)));
        jobs.extend(timed_rungs(&rungs, baseline, round));
    }
    jobs
}

/// Returns the jobs of rungs in a round, with the baseline after every few, whose times they are
/// compared with.
fn timed_rungs<'r>(
    rungs: &'r [RungSetting],
    baseline: &'r RungSetting,
    round: u64,
) -> impl Iterator<Item = Job> + 'r {
    let groups = rungs.chunks(RUNGS_BETWEEN_TIMINGS);
    let timed = groups.flat_map(move |some| some.iter().chain([baseline]));
    timed.map(move |setting| Job::tiles(setting, round))
}

/// Whether the table has a trial for each job that equals the one at this place, up to it.
pub(super) fn is_done(study: &Study<'_>, jobs: &[Job], at: usize) -> bool {
    let needed = jobs[..=at].iter().filter(|job| **job == jobs[at]).count();
    let trials = study.table.iter();
    trials.filter(|trial| trial.job == jobs[at]).count() >= needed
}

/// Returns the expected wall-clock seconds of a job: those of an earlier trial of the same setting,
/// or as many for each sample as the largest whole picture took.
pub(super) fn expected_seconds(study: &Study<'_>, job: &Job) -> f64 {
    let earlier = study.table.iter().find(|trial| {
        (&trial.job.setting, trial.job.region) == (&job.setting, job.region)
            && trial.seconds.is_finite()
    });
    if let Some(earlier) = earlier {
        return earlier.wall;
    }
    let share = match job.region {
        Region::Whole => 1.0,
        Region::Tiles => study.tile_share(),
    };
    study.seconds_of_sample() * f64::from(study.space.sample_count(&job.setting)) * share
}
