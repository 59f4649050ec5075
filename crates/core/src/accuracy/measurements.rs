//! The renders of a measurement by setting and round, and what they say.

use std::time::{Duration, Instant};

use super::answer::RelativeCost;
use super::estimate::{PairedDifference, Truth};
use super::frontier::Point;
use super::renderer::{Renderer, TimedRender, Unfinished};
use super::report::{Measured, RungCost};
use super::setting::Setting;
use crate::bench::Spread;
use crate::metrics::{DEFAULT_PIXELS_PER_DEGREE, flip, statistics};
use crate::picture::Picture;
use crate::prepare::PrepareError;

/// Rounds in which a rung without error is timed.
const PRICE_ROUNDS: u64 = 3;
/// It may take this many times as long as the scene's own setting, or so long at least.
const PATIENCE: f64 = 20.0;
const LEAST_PATIENCE: Duration = Duration::from_secs(1);

/// The truth with its display picture, which FLIP needs.
pub(super) struct Reference {
    pub truth: Truth,
    pub display: crate::display::Display,
    pub shown: Picture,
}

pub(super) struct Measurements<'a> {
    pub studio: &'a Renderer<'a>,
    pub truth: &'a Reference,
    taken: Vec<(Setting, Vec<(u64, TimedRender)>)>,
}

impl<'a> Measurements<'a> {
    pub fn new(studio: &'a Renderer<'a>, truth: &'a Reference) -> Self {
        Self { studio, truth, taken: Vec::new() }
    }

    fn of(&self, setting: &Setting) -> &[(u64, TimedRender)] {
        self.taken.iter().find(|(known, _)| known == setting).map_or(&[], |(_, takes)| takes)
    }

    pub fn has(&self, setting: &Setting, round: u64) -> bool {
        self.of(setting).iter().any(|(known, _)| *known == round)
    }

    /// Renders a setting in a round, unless that is there already. False where time is out.
    pub fn take(&mut self, setting: &Setting, round: u64, end: Instant) -> Result<bool, PrepareError> {
        Ok(self.has(setting, round) || self.take_again(setting, round, end)?)
    }

    /// Renders a setting in a round in place of what is there, which stays where time is out: then false.
    pub fn take_again(&mut self, setting: &Setting, round: u64, end: Instant) -> Result<bool, PrepareError> {
        let Some(take) = finished(self.studio.take(setting, round, end))? else { return Ok(false) };
        let place = self.taken.iter().position(|(known, _)| known == setting).unwrap_or(self.taken.len());
        if place == self.taken.len() {
            self.taken.push((setting.clone(), Vec::new()));
        }
        let takes = &mut self.taken[place].1;
        takes.retain(|(known, _)| *known != round);
        takes.push((round, take));
        Ok(true)
    }

    /// The first render; none where there is none.
    pub fn first(&self, setting: &Setting) -> Option<&Picture> {
        self.of(setting).first().map(|(_, take)| &take.picture)
    }

    /// Time and error, and the time over that of another setting; none where it was not rendered.
    pub fn measured(&self, setting: &Setting, beside: &Setting) -> Option<Measured> {
        let takes = self.of(setting);
        let (_, first) = takes.first()?;
        let seconds: Vec<f64> = takes.iter().map(|(_, take)| take.seconds).collect();
        let pictures: Vec<&Picture> = takes.iter().map(|(_, take)| &take.picture).collect();
        let shown = self.truth.display.to_values(&first.picture);
        // All pictures have one size, which is not zero.
        let map = flip(&shown, &self.truth.shown, DEFAULT_PIXELS_PER_DEGREE).unwrap_or_default();
        Some(Measured {
            renders: takes.len(),
            seconds: Spread::of(&seconds),
            ratio: Spread::of(&self.ratios(setting, beside)),
            rays: first.rays,
            errors: self.truth.truth.judge(&pictures, first.by_chance),
            flip: statistics(&map).mean,
        })
    }

    /// Times over those of another setting in the same rounds, of which there may be none.
    fn ratios(&self, setting: &Setting, beside: &Setting) -> Vec<f64> {
        let others = self.of(beside);
        let pairs = self.of(setting).iter().filter_map(|(round, take)| {
            let (_, other) = others.iter().find(|(known, _)| known == round)?;
            Some(take.seconds / other.seconds.max(1e-9))
        });
        pairs.collect()
    }

    /// What a choice alone changes: the difference to another setting in the rounds that both have.
    pub fn paired(&self, setting: &Setting, other: &Setting) -> Option<PairedDifference> {
        let (ours, theirs) = (self.of(setting), self.of(other));
        let pairs: Vec<(&Picture, &Picture)> = ours
            .iter()
            .filter_map(|(round, take)| {
                let (_, other) = theirs.iter().find(|(known, _)| known == round)?;
                Some((&take.picture, &other.picture))
            })
            .collect();
        (!pairs.is_empty()).then(|| self.truth.truth.paired(&pairs))
    }

    pub fn point(&self, setting: &Setting) -> Option<Point> {
        let measured = self.measured(setting, setting)?;
        // A clock may be too coarse for a tiny picture.
        Some(Point { time: measured.seconds.median.max(1e-9), error: measured.errors.relmse.value })
    }

    /// Time and error over those of another setting; none where one of both is not known.
    pub fn relative_cost(&self, setting: &Setting, beside: &Setting) -> Option<RelativeCost> {
        let (point, other) = (self.point(setting)?, self.point(beside)?);
        let ratios = self.ratios(setting, beside);
        let is_timed = ratios.len() >= 2;
        let time = Spread::of(&ratios);
        Some(RelativeCost {
            time: if ratios.is_empty() { point.time / other.time } else { time.median },
            most_time: if is_timed { time.max } else { f64::INFINITY },
            error: point.error / other.error.max(1e-300),
        })
    }

    /// Time and memory of a setting that gives the same picture as another one, beside that in the same rounds; none where it takes too
    /// long.
    pub fn paid(&self, setting: &Setting, beside: &Setting, end: Instant) -> Result<Option<RungCost>, PrepareError> {
        let (mut preparing, mut seconds, mut ratios) = (Vec::new(), Vec::new(), Vec::new());
        let (mut geometry, mut same_bits) = (0, true);
        for round in 0..PRICE_ROUNDS {
            let before = (self.studio.now)();
            let Some(own) = finished(self.studio.take(beside, round, end))? else { break };
            let patience = ((self.studio.now)() - before).mul_f64(PATIENCE).max(LEAST_PATIENCE);
            let Some(take) = finished(self.studio.take(setting, round, end.min((self.studio.now)() + patience)))? else { break };
            preparing.push(take.preparing);
            seconds.push(take.seconds);
            ratios.push(take.seconds / own.seconds.max(1e-9));
            geometry = take.geometry;
            same_bits &= take.picture == own.picture;
        }
        let [preparing, seconds, ratio] = [preparing, seconds, ratios].map(|list| (!list.is_empty()).then(|| Spread::of(&list)));
        let paid = preparing.zip(seconds).zip(ratio);
        Ok(paid.map(|((preparing, seconds), ratio)| RungCost { preparing, seconds, ratio, geometry, same_bits }))
    }
}

fn finished(take: Result<TimedRender, Unfinished>) -> Result<Option<TimedRender>, PrepareError> {
    match take {
        Ok(take) => Ok(Some(take)),
        Err(Unfinished::Late) => Ok(None),
        Err(Unfinished::Failed(error)) => Err(error),
    }
}
