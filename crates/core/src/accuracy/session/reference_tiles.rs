//! Stages that render the reference, tile by tile.

use std::time::Instant;

use super::MeasurementSession;
use super::measurement_plan::MeasurementPlan;
use super::time_budget::{REFERENCE_END, REFINEMENT_END};
use crate::accuracy::estimate::ReferenceTile;
use crate::accuracy::measurements::Measurements;
use crate::accuracy::renderer::IncrementalReference;
use crate::film::FilmPart;

impl MeasurementSession<'_> {
    /// Renders the reference on the tiles of the plan, as far as the time allows. Returns false if
    /// even the tiles that an estimate needs are unfinished.
    pub(super) fn render_reference(
        &mut self,
        plan: &MeasurementPlan,
        reference: &mut IncrementalReference<'_>,
        measurements: &mut Measurements<'_>,
    ) -> bool {
        // An estimate needs at least two tiles.
        let minimum = 2.min(measurements.sample.drawable_tile_count());
        self.add_reference_tiles(
            reference,
            measurements,
            minimum,
            self.instant_of_budget_share(REFINEMENT_END),
        );
        if measurements.reference_tile_count() < minimum {
            return false;
        }
        while measurements.reference_tile_count() < plan.tiles
            && (self.now)() < self.instant_of_budget_share(REFERENCE_END)
            && !self.observer.is_cancelled()
        {
            let next = plan.tiles.min(4 * measurements.reference_tile_count());
            self.add_reference_tiles(
                reference,
                measurements,
                next,
                self.instant_of_budget_share(REFERENCE_END),
            );
        }
        true
    }

    /// Renders the reference on the first `count` tiles of the drawing order and adds the new tiles
    /// to the measurements. Tiles that are unfinished at `end` are not added.
    pub(super) fn add_reference_tiles(
        &mut self,
        reference: &mut IncrementalReference<'_>,
        measurements: &mut Measurements<'_>,
        count: usize,
        end: Instant,
    ) {
        let (sample, from) = (measurements.sample, measurements.reference_tile_count());
        let new: Vec<u32> = sample.passes[from..count.max(from)]
            .iter()
            .map(|pilot_pass| pilot_pass.tile)
            .collect();
        self.cut_short |= !reference.render_tiles(&new, end);
        let tile = |&tile: &u32| {
            let crop = sample.grid.tile_crop(tile);
            let is_done = reference.film.unfinished_tiles(&FilmPart {
                tiles: tile..tile + 1,
                ..reference.film.full_part()
            }) == 0;
            let means = reference
                .film
                .tile_means_and_variances(tile)
                .filter(|_| is_done)?;
            Some(ReferenceTile::new(
                [crop.width, crop.height],
                &means,
                self.display,
            ))
        };
        measurements.add_reference_tiles(new.iter().map_while(tile));
    }
}
