//! Queue of work: all tiles in passes over the picture, so that a stopped render has samples
//! everywhere.

use core::ops::Range;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::film::{Film, FilmPart, ReplicateBuffer, TileUpdate};
use crate::light::LightUsage;
use crate::observer::Observer;

/// Queue of the units of work in order, with the film that receives their results.
pub(super) struct UnitQueue<'f> {
    film: &'f mut Film,
    /// Heap of the next pass of each tile in each replicate, as (pass, replicate, tile); without
    /// finished tiles and units in progress. A thread that finds the heap empty can end: threads
    /// continue their own units.
    waiting: BinaryHeap<Reverse<(u32, u32, u32)>>,
    /// Number of tiles of the rendered part without any samples.
    bare: usize,
    /// Samples of all pixels: finished, and total.
    done: u64,
    total: u64,
}

/// A unit of work for a thread: a range of samples of one tile in one replicate.
pub(super) struct NextUnit {
    pub tile: u32,
    pub replicate: u32,
    pub samples: Range<u32>,
    /// Sums of the tile so far.
    pub start: ReplicateBuffer,
}

impl<'f> UnitQueue<'f> {
    pub fn new(film: &'f mut Film, part: &FilmPart) -> Self {
        let plan = film.plan();
        let replicates = part.replicates.start..part.replicates.end.min(plan.replicates);
        let (mut waiting, mut bare) = (Vec::new(), 0);
        let (done, total) = film.progress(part);
        for tile in part.each_tile(plan) {
            bare += usize::from(
                (0..plan.replicates).all(|replicate| film.samples_drawn(tile, replicate) == 0),
            );
            for replicate in replicates.clone() {
                let next = plan.pass(
                    film.sample_goal(tile, replicate),
                    film.samples_drawn(tile, replicate),
                );
                waiting.extend(next.map(|(pass, _)| Reverse((pass, replicate, tile))));
            }
        }
        Self {
            film,
            waiting: waiting.into(),
            bare,
            done,
            total,
        }
    }

    /// Stores the result of a finished unit, and returns the next unit; `None` if none is waiting
    /// or the observer has enough samples. Takes one lock for each tile.
    pub fn exchange(
        &mut self,
        finished: Option<TileUpdate>,
        observer: &dyn Observer,
    ) -> Option<NextUnit> {
        self.put(finished, observer);
        if observer.has_enough(self.bare == 0) {
            return None;
        }
        let Reverse((_, replicate, tile)) = self.waiting.pop()?;
        let (_, samples) = self.next(tile, replicate)?;
        Some(NextUnit {
            tile,
            replicate,
            samples,
            start: self.film.state(tile, replicate),
        })
    }

    /// Returns the next pass of a tile in a replicate, and the range of its samples; `None` if the
    /// tile is finished.
    fn next(&self, tile: u32, replicate: u32) -> Option<(u32, Range<u32>)> {
        self.film.plan().pass(
            self.film.sample_goal(tile, replicate),
            self.film.samples_drawn(tile, replicate),
        )
    }

    /// Stores the last result and the light usage of a worker that ends.
    pub fn end(
        &mut self,
        finished: Option<TileUpdate>,
        usage: &LightUsage,
        observer: &dyn Observer,
    ) {
        self.put(finished, observer);
        self.film.add_usage(usage);
    }

    fn put(&mut self, finished: Option<TileUpdate>, observer: &dyn Observer) {
        let Some(tile_update) = finished else { return };
        let (tile, replicate) = (tile_update.tile, tile_update.replicate);
        let bare = (0..self.film.plan().replicates)
            .all(|replicate| self.film.samples_drawn(tile, replicate) == 0);
        let before = self.film.samples_drawn(tile, replicate);
        self.film.put(&tile_update);
        self.bare -= usize::from(bare);
        self.done += self.film.plan().pixels_of(tile) * u64::from(tile_update.drawn - before);
        self.waiting.extend(
            self.next(tile, replicate)
                .map(|(pass, _)| Reverse((pass, replicate, tile))),
        );
        observer.progress(self.done, self.total);
    }
}
