//! Merging of films that are parts of one picture.

use super::{Film, FilmPlan, Rect};

/// Reason why films cannot be merged, or why a film cannot be continued.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FilmMergeError {
    /// No film was given.
    #[error("no film was given: name at least one film to merge")]
    Nothing,
    /// The films belong to different pictures.
    #[error(
        "film {part} (counted from 0) belongs to another picture: its {label} differs; use only films of one scene that were rendered with the same settings"
    )]
    Foreign {
        /// Index of the film, from zero.
        part: usize,
        /// Name of the property that differs, such as a setting or "scene".
        label: String,
    },
    /// The film cannot be continued to the requested number of samples.
    #[error(
        "the film has {has} samples per pixel and cannot be continued to {requested}; request at least {least} samples per pixel"
    )]
    Samples {
        /// Samples per pixel planned for the film.
        has: u32,
        /// Requested samples per pixel.
        requested: u32,
        /// Least possible number of samples per pixel that is not below the requested number.
        least: u32,
    },
    /// Two films contain the same samples; these must not count twice.
    #[error(
        "film {part} (counted from 0) contains samples that an earlier film contains too (replicate {replicate} of tile {tile}); name each film once"
    )]
    Overlap {
        /// Index of the film in which the samples occur again, from zero.
        part: usize,
        /// Index of the tile, counted row by row.
        tile: u32,
        /// Index of the replicate, from zero.
        replicate: u32,
    },
}

impl Film {
    /// Returns the name of the first property in which the pictures of two films differ, such as
    /// "camera" or "scene". `None` if both films are parts of one picture.
    pub(crate) fn find_difference(&self, other: &Film) -> Option<String> {
        self.identity
            .find_difference(&other.identity)
            .or_else(|| self.plan.find_difference(&other.plan).map(str::to_owned))
    }

    /// Takes over the samples of an earlier film of this picture. A render then continues from
    /// these samples, with the same bits as an uninterrupted render.
    ///
    /// # Errors
    /// [`FilmMergeError::Foreign`] for the film of another picture. [`FilmMergeError::Samples`] if a
    /// replicate of the earlier film has more samples than this film's plan gives to that
    /// replicate.
    pub fn continue_from(&mut self, earlier: Film) -> Result<(), FilmMergeError> {
        let foreign = self.identity.find_difference(&earlier.identity);
        let nets = [&self.plan, &earlier.plan].map(FilmPlan::replicates_per_net);
        if let Some(label) = foreign.or_else(|| {
            self.plan
                .find_division_difference(&earlier.plan)
                .or((nets[0] != nets[1])
                    .then_some("number of nets of samples (two below 64 samples with denoising)"))
                .map(str::to_owned)
        }) {
            return Err(FilmMergeError::Foreign { part: 0, label });
        }
        if !self.plan.can_continue_film(&earlier.plan) {
            let (has, requested) = (earlier.plan.samples(), self.plan.samples());
            let minimum = self
                .plan
                .least_samples_to_continue(&earlier.plan)
                .unwrap_or(has);
            return Err(FilmMergeError::Samples {
                has,
                requested,
                least: minimum,
            });
        }
        let Film {
            buffers,
            spread,
            centre_layers: centre,
            samples_drawn: drawn,
            sample_goals: goals,
            is_replayed,
            counters,
            ..
        } = earlier;
        self.buffers
            .iter_mut()
            .zip(buffers)
            .for_each(|(mine, its)| *mine = its);
        self.samples_drawn[..drawn.len()].copy_from_slice(&drawn);
        (self.sample_goals, self.is_replayed) = (goals, is_replayed);
        (self.spread, self.centre_layers, self.counters) = (spread, centre, counters);
        Ok(())
    }

    /// Empties this film, and sets the sample counts of its tiles to those of `map`, another film
    /// of the same picture. A render then repeats, to the bit, a picture whose render was stopped
    /// or reached its time limit.
    ///
    /// # Errors
    /// [`FilmMergeError::Foreign`] for the film of another picture.
    pub fn repeat_sample_counts(&mut self, map: &Film) -> Result<(), FilmMergeError> {
        let foreign = self.identity.find_difference(&map.identity);
        if let Some(label) = foreign.or_else(|| {
            self.plan
                .find_division_difference(&map.plan)
                .map(str::to_owned)
        }) {
            return Err(FilmMergeError::Foreign { part: 0, label });
        }
        *self = Self::new_empty(
            self.identity.clone(),
            self.plan.with_samples(map.plan.samples()),
        );
        (self.sample_goals, self.is_replayed) = (map.samples_drawn.clone(), true);
        Ok(())
    }

    /// Returns the union of parts of one picture, given in any order. The union of complete parts
    /// equals a single render to the bit.
    ///
    /// # Errors
    /// See [`FilmMergeError`].
    pub fn merge(parts: &[Film]) -> Result<Film, FilmMergeError> {
        let first = parts.first().ok_or(FilmMergeError::Nothing)?;
        let mut film = Film::new_empty(first.identity.clone(), first.plan.clone());
        (film.sample_goals, film.is_replayed) = (first.sample_goals.clone(), first.is_replayed);
        for (index, part) in parts.iter().enumerate() {
            let goals = || {
                (first.sample_goals != part.sample_goals)
                    .then(|| "list of sample counts".to_owned())
            };
            if let Some(label) = first.find_difference(part).or_else(goals) {
                return Err(FilmMergeError::Foreign { part: index, label });
            }
            film.record_part_samples(part, index)?;
        }
        // The spreads are joined in the order of the replicates, so that the order of the parts
        // does not matter.
        let mut parts: Vec<&Film> = parts.iter().collect();
        parts.sort_by_key(|part| part.samples_drawn.iter().position(|&drawn| drawn > 0));
        parts
            .into_iter()
            .for_each(|part| film.copy_part_samples(part));
        Ok(film)
    }

    /// Adds the sample counts of `part`, which has the given index. Fails if the film already holds
    /// samples of the same tile and replicate.
    fn record_part_samples(&mut self, part: &Film, index: usize) -> Result<(), FilmMergeError> {
        let tiles = self.plan.tile_count() as usize;
        for (unit, (drawn, &held)) in self
            .samples_drawn
            .iter_mut()
            .zip(&part.samples_drawn)
            .enumerate()
        {
            if *drawn > 0 && held > 0 {
                let (tile, replicate) = ((unit % tiles) as u32, (unit / tiles) as u32);
                return Err(FilmMergeError::Overlap {
                    part: index,
                    tile,
                    replicate,
                });
            }
            *drawn += held;
        }
        Ok(())
    }

    /// Copies the sums and layers of a part, and adds its counters.
    fn copy_part_samples(&mut self, part: &Film) {
        for tile in 0..self.plan.tile_count() {
            let area = Rect::for_film_tile(self.plan.tile_rect(tile), self.plan.crop.width);
            for replicate in (0..self.plan.replicates)
                .filter(|&replicate| part.samples_drawn(tile, replicate) > 0)
            {
                if let Some(buffer) = &part.buffers[replicate as usize] {
                    self.copy_buffer_into_film(replicate, buffer, area, area);
                }
            }
            if part.samples_drawn(tile, 0) > 0 {
                self.place_centre_layers(&part.centre_layers, area, area);
            }
            if (0..self.plan.replicates).any(|replicate| part.samples_drawn(tile, replicate) > 0) {
                self.add_sample_spread(&part.spread, area, area);
            }
        }
        self.counters += part.counters;
    }
}
