//! Times taken once more, in turns: a machine's speed changes within a minute, so that the time of one setting over that of another one can
//! only be relied on where both were rendered side by side.

use std::time::Instant;

use super::super::estimate::Interval;
use super::super::renderer::{TimedRender, Unfinished};
use super::super::setting::Setting;
use super::{Figures, Measurements};
use crate::prepare::PrepareError;
use crate::settings::Crop;

/// Turns at most, and those that say anything.
const MOST_TURNS: usize = 5;
const FEWEST_TURNS: usize = 2;

impl Measurements<'_> {
    /// Times settings again, one after the other and all over again, with the random numbers of their first round: on so many of their first
    /// tiles, or on the whole picture where they were rendered so. The first one is what the others are held beside; where it was timed in turns
    /// before, the others are as if they had been timed then. Where there is no time for two turns, nothing is learned.
    pub fn time_in_turns(&mut self, settings: &[Setting], tiles: usize, end: Instant) -> Result<(), PrepareError> {
        let mut turns: Vec<Vec<f64>> = Vec::new();
        while turns.len() < MOST_TURNS {
            let turn = settings.iter().map(|setting| self.drift(setting, tiles, end));
            let Some(turn) = turn.collect::<Result<Option<Vec<f64>>, PrepareError>>()? else { break };
            turns.push(turn);
        }
        if turns.len() < FEWEST_TURNS {
            return Ok(());
        }
        let Some(first) = settings.first().and_then(|first| self.of(first)) else { return Ok(()) };
        let (earlier, has_more) = (first.turns.clone(), first.whole_seconds.is_none() && first.tiles.len() > tiles);
        let mut scale = 1.0;
        if has_more && earlier.is_empty() {
            // What few tiles took was told from their rays. All of them together were timed.
            let all = self.drift(&settings[0], first.tiles.len(), end)?.unwrap_or(1.0);
            scale = all / spread(turns.iter().map(|turn| turn[0]).collect()).value;
        }
        for (i, setting) in settings.iter().enumerate() {
            let Some(of) = self.all.iter_mut().find(|of| of.setting == *setting) else { continue };
            of.turns = match &earlier[..] {
                [] => turns.iter().map(|turn| scale * turn[i]).collect(),
                earlier => turns.iter().zip(earlier).map(|(turn, first)| first * turn[i] / turn[0]).collect(),
            };
        }
        Ok(())
    }

    /// Whether a setting was timed in turns.
    pub fn is_timed_in_turns(&self, setting: &Setting) -> bool {
        self.of(setting).is_some_and(|of| !of.turns.is_empty())
    }

    /// Whether a setting was rendered whole.
    pub fn is_rendered_whole(&self, setting: &Setting) -> bool {
        self.of(setting).is_some_and(|of| of.whole_seconds.is_some())
    }

    /// Time of a setting over what its first round took on the same part of the picture; none where time is out.
    fn drift(&self, setting: &Setting, tiles: usize, end: Instant) -> Result<Option<f64>, PrepareError> {
        let Some(of) = self.of(setting) else { return Ok(None) };
        let (parts, before) = match of.whole_seconds {
            Some(seconds) => (Vec::new(), seconds),
            None => {
                let tiles = tiles.min(of.tiles.len());
                let parts: Vec<Crop> = (0..tiles).map(|at| self.part(setting, at)).collect();
                (parts, of.tiles[..tiles].iter().map(|tile| tile.first_seconds).sum())
            }
        };
        let Some(renders) = Unfinished::allow(self.renderer.take(setting, &parts, 0, end))? else { return Ok(None) };
        let share = |at: usize| match parts.get(at) {
            Some(part) => self.share(at, *part),
            None => 1.0,
        };
        let seconds = |(at, render): (usize, &TimedRender)| share(at) * render.seconds;
        let after: f64 = renders.iter().enumerate().map(seconds).sum();
        // A clock may be too coarse for a tiny picture.
        Ok((before > 0.0 && after > 0.0).then(|| after / before))
    }

    /// What the time of a setting over that of another one is multiplied by.
    pub(super) fn relative_drift(&self, of: &Figures, other: &Figures) -> Interval {
        match (&of.turns[..], &other.turns[..]) {
            ([], []) => Interval::exact(1.0),
            ([], turns) => unknown(turns.iter().map(|drift| 1.0 / drift)),
            (turns, []) => unknown(turns.iter().copied()),
            (turns, others) => spread(turns.iter().zip(others).map(|(of, other)| of / other).collect()),
        }
    }

    /// What the time of a setting is multiplied by. One that was not timed again has drifted as the one in use did.
    pub(super) fn own_drift(&self, of: &Figures) -> Interval {
        if !of.turns.is_empty() {
            return spread(of.turns.clone());
        }
        let own = self.of(&Setting::default()).map_or(&[][..], |own| &own.turns[..]);
        if own.is_empty() {
            return Interval::exact(1.0);
        }
        let drift = unknown(own.iter().copied());
        Interval { value: if drift.low < 1.0 { drift.low } else { drift.high }, ..drift }
    }
}

/// Median and range of turns.
fn spread(mut turns: Vec<f64>) -> Interval {
    turns.sort_by(f64::total_cmp);
    let middle = turns.len() / 2;
    let value = if turns.len() % 2 == 1 { turns[middle] } else { 0.5 * (turns[middle - 1] + turns[middle]) };
    Interval { value, low: turns[0], high: turns[turns.len() - 1] }
}

/// What is known of a setting that was not timed again, where another one drifted so: that it may have drifted as far, or not at all.
fn unknown(turns: impl Iterator<Item = f64>) -> Interval {
    let drift = spread(turns.collect()).value;
    Interval { value: 1.0, low: drift.min(1.0), high: drift.max(1.0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: turns say their median and their range, and a setting that was not timed again may have drifted as far as another one.
    #[test]
    fn turns_say_their_median_and_range() {
        assert_eq!(spread(vec![1.2, 0.9, 1.0]), Interval { value: 1.0, low: 0.9, high: 1.2 });
        assert_eq!(spread(vec![1.25, 0.75]), Interval { value: 1.0, low: 0.75, high: 1.25 });
        assert_eq!(unknown([1.5, 1.25, 2.0].into_iter()), Interval { value: 1.0, low: 1.0, high: 1.5 });
        assert_eq!(unknown([0.5].into_iter()), Interval { value: 1.0, low: 0.5, high: 1.0 });
    }
}
