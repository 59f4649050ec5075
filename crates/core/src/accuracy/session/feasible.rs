//! Start of a measurement. A pilot pass measures time and noise of the tiles. A trial on the
//! slowest tile finds the most exact rungs (quality levels) whose render ends within a time limit;
//! the reference uses these rungs.

use std::time::Duration;

use super::super::renderer::{SettingRenderer, TimedRender, UnfinishedRender};
use super::super::setting::RungSetting;
use super::super::tiles::{PilotPass, TileGrid};
use super::{FEASIBLE_RUNGS_END, MeasurementSession, PILOT_PASS_END};
use crate::ladder::{Ladder, RungChoice};
use crate::prepare::PrepareError;

/// Time limit of a render of the slowest tile with a changed rung (quality level), as a multiple of
/// the time that the tile takes with the unchanged setting. The limit is at least
/// [`LEAST_PATIENCE`].
const PATIENCE: f64 = 20.0;
/// Least time limit of a render of the slowest tile with a changed rung.
const LEAST_PATIENCE: Duration = Duration::from_secs(2);

/// Tile edges in pixels to choose from, the longest first. The first edge is used at which the time
/// budget suffices for [`ENOUGH_TILES`] tiles, else the last.
const EDGES: [u32; 2] = [32, 16];
/// Number of tiles for which the time budget should suffice, and number of tiles in the first pilot
/// pass.
const ENOUGH_TILES: usize = 24;
/// Greatest number of tiles that are rendered for the first estimate of the time per sample.
const FIRST_LOOK: usize = 8;
/// Least number of tiles into which a picture is divided, unless the tile edge would be less than
/// eight pixels.
const FEWEST_TILES: f64 = 48.0;

impl MeasurementSession<'_> {
    /// Chooses the division of the picture into tiles, and makes the first estimate of the time per
    /// sample. `edge` is the tile edge in pixels of a reused reference, which is kept. Without
    /// `edge`, tiles are small enough for the time budget to suffice for [`ENOUGH_TILES`] tiles, as
    /// far as [`EDGES`] allows.
    pub(super) fn choose_tile_grid(
        &mut self,
        renderer: &SettingRenderer<'_>,
        edge: Option<u32>,
    ) -> Result<TileGrid, PrepareError> {
        let [width, height] = self.settings.size.map(f64::from);
        let fitting = ((width * height / FEWEST_TILES).sqrt() / 8.0)
            .floor()
            .max(1.0) as u32
            * 8;
        let value_of = |edge: u32| TileGrid {
            size: self.settings.size,
            edge,
            seed: self.settings.seed,
        };
        let grid = value_of(edge.unwrap_or(fitting.min(EDGES[0])));
        // The first render of a scene also includes preparation and memory allocation, so the
        // second is timed.
        let order = grid.spread_order();
        let tiles = &order[..FIRST_LOOK.min(order.len())];
        renderer
            .run_pilot_pass(grid, tiles, self.instant_of_budget_share(1.0))
            .map_err(UnfinishedRender::into_error)?;
        let before = (self.now)();
        renderer
            .run_pilot_pass(grid, tiles, self.instant_of_budget_share(1.0))
            .map_err(UnfinishedRender::into_error)?;
        let pixels: f64 = tiles
            .iter()
            .map(|&tile| grid.pixel_count_of_tile(tile))
            .sum();
        self.seconds_per_sample = ((self.now)() - before).as_secs_f64()
            / (pixels * f64::from(renderer.pilot_pass_samples()));
        let is_long = |edge: &u32| {
            *edge <= grid.edge && self.affordable_tile_count(&value_of(*edge), 1.0) >= ENOUGH_TILES
        };
        let shorter = EDGES
            .into_iter()
            .find(is_long)
            .unwrap_or(EDGES[EDGES.len() - 1])
            .min(grid.edge);
        Ok(if edge.is_some() {
            grid
        } else {
            value_of(shorter)
        })
    }

    /// Renders tiles with few samples, until all tiles are rendered or the time for pilot passes is
    /// spent. The first pass renders [`ENOUGH_TILES`] tiles, and each further pass doubles the
    /// number of rendered tiles. Returns time and noise of each rendered tile.
    pub fn run_pilot_passes(
        &mut self,
        renderer: &SettingRenderer<'_>,
        grid: TileGrid,
    ) -> Result<Vec<PilotPass>, PrepareError> {
        let order = grid.spread_order();
        let begun = (self.now)();
        let mut pilot_passes: Vec<PilotPass> = Vec::new();
        while pilot_passes.len() < order.len()
            && (pilot_passes.is_empty()
                || (self.now)() < self.instant_of_budget_share(PILOT_PASS_END))
        {
            let next = &order
                [pilot_passes.len()..(2 * pilot_passes.len()).max(ENOUGH_TILES).min(order.len())];
            pilot_passes.extend(
                renderer
                    .run_pilot_pass(grid, next, self.instant_of_budget_share(1.0))
                    .map_err(UnfinishedRender::into_error)?,
            );
        }
        let pixels: f64 = pilot_passes
            .iter()
            .map(|pilot_pass| grid.pixel_count_of_tile(pilot_pass.tile))
            .sum();
        let samples = f64::from(renderer.pilot_pass_samples());
        self.seconds_per_sample = ((self.now)() - begun).as_secs_f64() / (pixels * samples);
        Ok(pilot_passes)
    }

    /// Returns the rungs (quality levels) for the reference: for each ladder, the most exact rung
    /// whose render of the slowest tile ends within the time limit. The limit matters for Whitted
    /// ray tracing, in which rays split at glass and mirrors, so that their number doubles per
    /// bounce. Sample counts, ladders without bias or with equally accurate rungs, and ladders that
    /// are not tried in time keep the scene's rung. The function also stores the render time per
    /// sample of the reference, divided by that of the unchanged setting; at least 1.
    pub fn find_feasible_rungs(
        &mut self,
        renderer: &SettingRenderer<'_>,
        grid: TileGrid,
        pilot_passes: &[PilotPass],
    ) -> Result<RungSetting, PrepareError> {
        let longest = pilot_passes
            .iter()
            .max_by(|a, b| a.seconds.total_cmp(&b.seconds))
            .map_or(0, |pilot_pass| pilot_pass.tile);
        let (part, before, end) = (
            [grid.tile_crop(longest)],
            (self.now)(),
            self.instant_of_budget_share(FEASIBLE_RUNGS_END),
        );
        let own =
            renderer.render_setting(&self.baseline, &part, 0, self.instant_of_budget_share(1.0));
        let timeout = ((self.now)() - before)
            .mul_f64(PATIENCE)
            .max(LEAST_PATIENCE);
        let renders = own.map_err(UnfinishedRender::into_error)?;
        let mut exact = RungSetting::default();
        for ladder in self
            .picture_ladders
            .iter()
            .copied()
            .filter(|&ladder| ladder != Ladder::Samples && !ladder.has_equal_accuracy())
        {
            for choice in self
                .applicable_rungs(ladder)
                .rev()
                .filter(RungChoice::can_be_reference)
            {
                if (self.now)() >= end {
                    return Ok(exact);
                }
                let end = end.min((self.now)() + timeout);
                match UnfinishedRender::interrupted_as_none(renderer.render_setting(
                    &self.setting_of_rung(choice),
                    &part,
                    0,
                    end,
                ))? {
                    // A ladder without bias keeps the scene's rung, because a slower rung gains
                    // less than more samples.
                    Some(_) if ladder.is_free_of_bias() => break,
                    Some(_) => {
                        exact = exact.with_rung(choice);
                        break;
                    }
                    None => self.infeasible_rungs.push(choice),
                }
            }
        }
        let all = exact
            .choices()
            .iter()
            .fold(self.baseline.clone(), |setting, &choice| {
                setting.with_rung(choice)
            });
        if let Some(reference) =
            UnfinishedRender::interrupted_as_none(renderer.render_setting(&all, &part, 0, end))?
        {
            let seconds = |each_renders: &[TimedRender]| {
                each_renders
                    .iter()
                    .map(|render| render.seconds)
                    .sum::<f64>()
            };
            let cost = seconds(&reference) / seconds(&renders);
            self.reference_time_ratio = if cost.is_finite() {
                cost.max(1.0)
            } else {
                self.reference_time_ratio
            };
        }
        Ok(exact)
    }
}
