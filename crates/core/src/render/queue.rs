//! Queue of work. It contains all tiles in several passes over the picture, so that a stopped
//! render has samples everywhere.

use core::ops::Range;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::film::{Film, FilmPart, ReplicateBuffer, TileUpdate};
use crate::light::LightUsage;
use crate::observer::Observer;

/// Queue of units of work, the earliest pass first, and the film that receives their results.
pub(super) struct WorkQueue<'f> {
    film: &'f mut Film,
    /// Heap of (pass, replicate, tile): the next pass of each tile in each replicate. Finished
    /// tiles and those in progress are not in it. A thread that finds the heap empty may end,
    /// because other threads continue their own tiles.
    waiting: BinaryHeap<Reverse<(u32, u32, u32)>>,
    /// Number of rendered tiles that have no samples yet.
    tiles_without_samples: usize,
    /// Number of finished samples, summed over all pixels.
    samples_done: u64,
    /// Number of samples of the finished render, summed over all pixels.
    samples_total: u64,
}

/// A unit of work for a thread: a range of samples of one tile in one replicate (independent part
/// of the samples).
pub(super) struct WorkUnit {
    pub tile: u32,
    pub replicate: u32,
    pub samples: Range<u32>,
    /// Sums of the samples that the tile already has.
    pub start: ReplicateBuffer,
}

impl<'f> WorkQueue<'f> {
    pub fn new(film: &'f mut Film, part: &FilmPart) -> Self {
        let plan = film.plan();
        let replicates = part.replicates.start..part.replicates.end.min(plan.replicates);
        let (mut waiting, mut bare) = (Vec::new(), 0);
        let (done, total) = film.progress(part);
        for tile in part.iter_tiles(plan) {
            bare += usize::from(
                (0..plan.replicates).all(|replicate| film.samples_drawn(tile, replicate) == 0),
            );
            for replicate in replicates.clone() {
                let next = plan.next_sample_range(
                    film.sample_goal(tile, replicate),
                    film.samples_drawn(tile, replicate),
                );
                waiting.extend(next.map(|(pass, _)| Reverse((pass, replicate, tile))));
            }
        }
        Self {
            film,
            waiting: waiting.into(),
            tiles_without_samples: bare,
            samples_done: done,
            samples_total: total,
        }
    }

    /// Stores the result of a finished unit and returns the next unit. `None` if no unit is left or
    /// the observer has enough samples. One call per tile needs one lock only.
    pub fn store_result_and_take_unit(
        &mut self,
        finished: Option<TileUpdate>,
        observer: &dyn Observer,
    ) -> Option<WorkUnit> {
        self.store_result(finished, observer);
        if observer.has_enough_samples(self.tiles_without_samples == 0) {
            return None;
        }
        let Reverse((_, replicate, tile)) = self.waiting.pop()?;
        let (_, samples) = self.next_pass(tile, replicate)?;
        Some(WorkUnit {
            tile,
            replicate,
            samples,
            start: self.film.tile_buffer(tile, replicate),
        })
    }

    /// Returns the next pass of a tile in a replicate, and the range of its samples; `None` if the
    /// tile is finished.
    fn next_pass(&self, tile: u32, replicate: u32) -> Option<(u32, Range<u32>)> {
        self.film.plan().next_sample_range(
            self.film.sample_goal(tile, replicate),
            self.film.samples_drawn(tile, replicate),
        )
    }

    /// Stores the last result of a worker that ends, and how often it sampled each light.
    pub fn finish_worker(
        &mut self,
        finished: Option<TileUpdate>,
        usage: &LightUsage,
        observer: &dyn Observer,
    ) {
        self.store_result(finished, observer);
        self.film.add_light_usage(usage);
    }

    fn store_result(&mut self, finished: Option<TileUpdate>, observer: &dyn Observer) {
        let Some(tile_update) = finished else { return };
        let (tile, replicate) = (tile_update.tile, tile_update.replicate);
        let bare = (0..self.film.plan().replicates)
            .all(|replicate| self.film.samples_drawn(tile, replicate) == 0);
        let before = self.film.samples_drawn(tile, replicate);
        self.film.store_tile(&tile_update);
        self.tiles_without_samples -= usize::from(bare);
        self.samples_done +=
            self.film.plan().tile_pixel_count(tile) * u64::from(tile_update.drawn - before);
        self.waiting.extend(
            self.next_pass(tile, replicate)
                .map(|(pass, _)| Reverse((pass, replicate, tile))),
        );
        observer.progress(self.samples_done, self.samples_total);
    }
}
