//! Parts of a picture become one: their union, whoever rendered which.

use super::{Film, Rect};

/// Why films are not parts of one picture.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PartError {
    /// No film at all.
    #[error("there is nothing to merge")]
    Nothing,
    /// Films of different pictures.
    #[error("part {part} belongs to another picture: its {what} differs")]
    Foreign {
        /// Which film, counted from zero.
        part: usize,
        /// What differs.
        what: String,
    },
    /// A film can't become part of a picture with so many samples.
    #[error(
        "it has {has} samples a pixel, which are not among the first of {asked}; of {least} they are"
    )]
    Samples {
        /// Samples a pixel that the film is divided for.
        has: u32,
        /// Samples a pixel that are asked for.
        asked: u32,
        /// The fewest, of at least those asked for, among which they are.
        least: u32,
    },
    /// Two films hold the same samples, which must not count twice.
    #[error("part {part} holds replicate {replicate} of tile {tile}, which another part holds too")]
    Overlap {
        /// The later one of the films, counted from zero.
        part: usize,
        /// Tile, counted row by row.
        tile: u32,
        /// Replicate.
        replicate: u32,
    },
}

impl Film {
    /// What tells the picture of another film from this one's; none: they are parts of one.
    pub(crate) fn difference(&self, other: &Film) -> Option<String> {
        self.identity
            .difference(&other.identity)
            .or_else(|| self.plan.difference(&other.plan).map(str::to_owned))
    }

    /// Goes on with what an earlier film holds, if that is of this picture with as many samples or
    /// fewer: the bits of a render that was never interrupted.
    ///
    /// # Errors
    /// [`PartError::Foreign`] for the film of another picture, [`PartError::Samples`] where its
    /// replicates have more samples than this picture's.
    pub fn adopt(&mut self, earlier: Film) -> Result<(), PartError> {
        let foreign = self.identity.difference(&earlier.identity);
        if let Some(what) =
            foreign.or_else(|| self.plan.other_division(&earlier.plan).map(str::to_owned))
        {
            return Err(PartError::Foreign { part: 0, what });
        }
        if !self.plan.continues(&earlier.plan) {
            let (has, asked) = (earlier.plan.samples(), self.plan.samples());
            let least = self.plan.least_continuing(&earlier.plan).unwrap_or(has);
            return Err(PartError::Samples { has, asked, least });
        }
        let Film {
            planes,
            spread,
            centre,
            drawn,
            goals,
            is_replayed,
            counters,
            ..
        } = earlier;
        self.planes
            .iter_mut()
            .zip(planes)
            .for_each(|(mine, its)| *mine = its);
        self.drawn[..drawn.len()].copy_from_slice(&drawn);
        (self.goals, self.is_replayed) = (goals, is_replayed);
        (self.spread, self.centre, self.counters) = (spread, centre, counters);
        Ok(())
    }

    /// Gets ready to take the samples that another film of this picture has, tile by tile: the bits
    /// of a render that ended when its time was over, or when it was stopped.
    ///
    /// # Errors
    /// [`PartError::Foreign`] for the film of another picture.
    pub fn replay(&mut self, map: &Film) -> Result<(), PartError> {
        let foreign = self.identity.difference(&map.identity);
        if let Some(what) =
            foreign.or_else(|| self.plan.other_division(&map.plan).map(str::to_owned))
        {
            return Err(PartError::Foreign { part: 0, what });
        }
        *self = Self::empty(
            self.identity.clone(),
            self.plan.with_samples(map.plan.samples()),
        );
        (self.goals, self.is_replayed) = (map.drawn.clone(), true);
        Ok(())
    }

    /// The union of parts of one picture, in whatever order they come: the bits of one run, where
    /// together they hold all of it.
    ///
    /// # Errors
    /// See [`PartError`].
    pub fn merge(parts: &[Film]) -> Result<Film, PartError> {
        let first = parts.first().ok_or(PartError::Nothing)?;
        let mut film = Film::empty(first.identity.clone(), first.plan.clone());
        (film.goals, film.is_replayed) = (first.goals.clone(), first.is_replayed);
        for (index, part) in parts.iter().enumerate() {
            let goals = || (first.goals != part.goals).then(|| "map of samples".to_owned());
            if let Some(what) = first.difference(part).or_else(goals) {
                return Err(PartError::Foreign { part: index, what });
            }
            film.mark(part, index)?;
        }
        // Whatever the parts' order, their spreads are joined in that of their replicates.
        let mut parts: Vec<&Film> = parts.iter().collect();
        parts.sort_by_key(|part| part.drawn.iter().position(|&drawn| drawn > 0));
        parts.into_iter().for_each(|part| film.take(part));
        Ok(film)
    }

    /// Notes what a part holds.
    fn mark(&mut self, part: &Film, index: usize) -> Result<(), PartError> {
        let tiles = self.plan.tiles() as usize;
        for (unit, (drawn, &held)) in self.drawn.iter_mut().zip(&part.drawn).enumerate() {
            if *drawn > 0 && held > 0 {
                let (tile, replicate) = ((unit % tiles) as u32, (unit / tiles) as u32);
                return Err(PartError::Overlap {
                    part: index,
                    tile,
                    replicate,
                });
            }
            *drawn += held;
        }
        Ok(())
    }

    /// Copies what a part holds.
    fn take(&mut self, part: &Film) {
        for tile in 0..self.plan.tiles() {
            let area = Rect::within(self.plan.tile(tile), self.plan.crop.width);
            for replicate in
                (0..self.plan.replicates).filter(|&replicate| part.drawn(tile, replicate) > 0)
            {
                if let Some(plane) = &part.planes[replicate as usize] {
                    self.place(replicate, plane, area, area);
                }
            }
            if part.drawn(tile, 0) > 0 {
                self.place_centre(&part.centre, area, area);
            }
            if (0..self.plan.replicates).any(|replicate| part.drawn(tile, replicate) > 0) {
                self.widen(&part.spread, area, area);
            }
        }
        self.counters += part.counters;
    }
}
