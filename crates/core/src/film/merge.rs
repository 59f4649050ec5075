//! Parts of a picture become one: their union, whoever rendered which.

use super::{Film, Rect};
use crate::settings::Settings;

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
        what: &'static str,
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

/// What decides a picture's samples, apart from the scene. How they are computed (threads, accelerator, kernel, memory) does not.
fn difference(a: &Settings, b: &Settings) -> Option<&'static str> {
    let settings = [
        (a.size != b.size, "size"),
        (a.crop != b.crop, "crop"),
        (a.camera != b.camera, "camera"),
        (a.sampling != b.sampling, "number of samples"),
        (a.replicates != b.replicates, "number of replicates"),
        (a.max_depth != b.max_depth, "maximum depth"),
        (a.integrator != b.integrator, "integrator"),
        (a.light_sampling != b.light_sampling, "light sampling"),
        (a.seed != b.seed, "seed"),
        (a.frame != b.frame, "frame"),
        (a.precision != b.precision, "precision"),
        (a.background != b.background, "background"),
        (a.aovs != b.aovs, "list of layers"),
        (a.tile_size != b.tile_size, "size of tiles"),
    ];
    settings.into_iter().find(|(differs, _)| *differs).map(|(_, what)| what)
}

impl Film {
    /// What tells the picture of another film from this one's; none: they are parts of one.
    pub(crate) fn difference(&self, other: &Film) -> Option<&'static str> {
        let scene = (self.scene != other.scene || self.plan != other.plan).then_some("scene");
        difference(&self.settings, &other.settings).or(scene)
    }

    /// The union of parts of one picture, in whatever order they come: the bits of one run, where together they hold all of it.
    ///
    /// # Errors
    /// See [`PartError`].
    pub fn merge(parts: &[Film]) -> Result<Film, PartError> {
        let first = parts.first().ok_or(PartError::Nothing)?;
        let mut film = Film::new(&first.scene, &first.settings, first.plan.clone());
        for (index, part) in parts.iter().enumerate() {
            if let Some(what) = first.difference(part) {
                return Err(PartError::Foreign { part: index, what });
            }
            film.mark(part, index)?;
        }
        // Whatever the parts' order, their spreads are joined in that of their replicates.
        let mut parts: Vec<&Film> = parts.iter().collect();
        parts.sort_by_key(|part| part.done.iter().position(|&done| done));
        parts.into_iter().for_each(|part| film.take(part));
        Ok(film)
    }

    /// Notes what a part holds.
    fn mark(&mut self, part: &Film, index: usize) -> Result<(), PartError> {
        let tiles = self.plan.tiles() as usize;
        for (unit, (done, &held)) in self.done.iter_mut().zip(&part.done).enumerate() {
            if *done && held {
                let (tile, replicate) = ((unit % tiles) as u32, (unit / tiles) as u32);
                return Err(PartError::Overlap { part: index, tile, replicate });
            }
            *done |= held;
        }
        Ok(())
    }

    /// Copies what a part holds.
    fn take(&mut self, part: &Film) {
        for tile in 0..self.plan.tiles() {
            let area = Rect::within(self.plan.tile(tile), self.plan.crop.width);
            for replicate in (0..self.plan.replicates).filter(|&replicate| part.has(tile, replicate)) {
                if let Some(plane) = &part.planes[replicate as usize] {
                    self.place(replicate, plane, area, area);
                }
            }
            if part.has(tile, 0) {
                self.place_centre(&part.centre, area, area);
            }
            if (0..self.plan.replicates).any(|replicate| part.has(tile, replicate)) {
                self.widen(&part.spread, area, area);
            }
        }
        self.counters += part.counters;
    }
}
