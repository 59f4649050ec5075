//! A part of the work on a film, and the result of a unit of that work.

use core::ops::Range;

use super::{FilmPlan, ReplicateBuffer};
use crate::counters::Counters;

/// A part of the work on a picture: a selection of tiles in a range of replicates, for example one
/// machine's share of a render.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FilmPart {
    /// Range of tiles, numbered row by row.
    pub tiles: Range<u32>,
    /// Stride within the range: every `step`-th tile, from the first on.
    pub step: u32,
    /// Range of replicates.
    pub replicates: Range<u32>,
    /// Restriction to these tiles, in ascending order; `None` for all tiles.
    pub selected_tiles: Option<Vec<u32>>,
}

impl FilmPart {
    /// Iterates over the part's tiles that exist in the picture.
    pub(crate) fn iter_tiles(
        &self,
        plan: &FilmPlan,
    ) -> impl Iterator<Item = u32> + Clone + use<'_> {
        let is_among = |tile: &u32| {
            self.selected_tiles
                .as_ref()
                .is_none_or(|among| among.binary_search(tile).is_ok())
        };
        (self.tiles.start..self.tiles.end.min(plan.tile_count()))
            .step_by(self.step.max(1) as usize)
            .filter(is_among)
    }

    /// Returns one of `total` shares of about equal work; `index` counts them from zero. A share
    /// takes every `total`-th tile of the part, so that slow regions are divided as well. The union
    /// of the shares is the part.
    #[must_use]
    pub fn split_into_nth_subset(self, index: u32, total: u32) -> Self {
        Self {
            tiles: self.tiles.start + index * self.step..self.tiles.end,
            step: self.step * total,
            ..self
        }
    }
}

/// Result of a unit of work: the sums of one tile in one replicate, which include all earlier
/// samples.
#[derive(Clone, Debug)]
pub(crate) struct TileUpdate {
    pub tile: u32,
    pub replicate: u32,
    /// Samples per pixel after the update.
    pub drawn: u32,
    pub buffer: ReplicateBuffer,
    /// Spread of the added samples about their mean.
    pub spread: Vec<[f32; 3]>,
    pub centre: Vec<Vec<f32>>,
    pub counters: Counters,
}
