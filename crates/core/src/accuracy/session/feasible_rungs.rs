//! Start of a measurement. A pilot pass measures time and noise of the tiles. A trial on the
//! slowest tile finds the most exact rungs (quality levels) whose render ends within a time limit;
//! the reference uses these rungs.

use std::time::{Duration, Instant};

use super::MeasurementSession;
use super::time_budget::{FEASIBLE_RUNGS_END, PILOT_PASS_END};
use crate::accuracy::renderer::{SettingRenderer, TimedRender, UnfinishedRender};
use crate::accuracy::setting::RungSetting;
use crate::accuracy::tiles::{PilotTile, TileGrid};
use crate::ladder::{Ladder, RungChoice};
use crate::prepare::PrepareError;
use crate::settings::Crop;

/// Time limit of a render of the slowest tile with a changed rung (quality level). The unit is the
/// time that the tile takes with the unchanged setting. The limit is at least
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

/// Outcome of the trial of a ladder's rungs (quality levels).
enum LadderTrial {
    /// The reference uses this rung.
    Feasible(RungChoice),
    /// The reference uses the scene's rung.
    KeepsRung,
    /// The time for trials is spent.
    TimeSpent,
}

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
        let order = grid.evenly_spread_tile_order();
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
    ) -> Result<Vec<PilotTile>, PrepareError> {
        let order = grid.evenly_spread_tile_order();
        let begun = (self.now)();
        let mut pilot_passes: Vec<PilotTile> = Vec::new();
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
        pilot_passes: &[PilotTile],
    ) -> Result<RungSetting, PrepareError> {
        let slowest = pilot_passes
            .iter()
            .max_by(|a, b| a.seconds.total_cmp(&b.seconds))
            .map_or(0, |pilot_pass| pilot_pass.tile);
        let tile = grid.tile_crop(slowest);
        let before = (self.now)();
        let end = self.instant_of_budget_share(FEASIBLE_RUNGS_END);
        let own_render = renderer.render_setting(
            &self.baseline,
            &[tile],
            0,
            self.instant_of_budget_share(1.0),
        );
        let timeout = ((self.now)() - before)
            .mul_f64(PATIENCE)
            .max(LEAST_PATIENCE);
        let own_render = own_render.map_err(UnfinishedRender::into_error)?;
        let mut exact = RungSetting::default();
        for ladder in self.picture_ladders.clone() {
            if ladder == Ladder::Samples || ladder.has_equal_accuracy() {
                continue;
            }
            match self.try_rungs(renderer, tile, ladder, (timeout, end))? {
                LadderTrial::Feasible(choice) => exact = exact.with_rung(choice),
                LadderTrial::KeepsRung => {}
                LadderTrial::TimeSpent => return Ok(exact),
            }
        }
        self.measure_reference_time_ratio(renderer, tile, (&exact, &own_render), end)?;
        Ok(exact)
    }

    /// Renders a tile with the rungs (quality levels) of a ladder, the most exact first, until a
    /// render ends within `timeout`. Rungs that take longer are stored as infeasible. No trial starts after `end`.
    fn try_rungs(
        &mut self,
        renderer: &SettingRenderer<'_>,
        tile: Crop,
        ladder: Ladder,
        (timeout, end): (Duration, Instant),
    ) -> Result<LadderTrial, PrepareError> {
        for choice in self
            .applicable_rungs(ladder)
            .rev()
            .filter(RungChoice::can_be_reference)
        {
            if (self.now)() >= end {
                return Ok(LadderTrial::TimeSpent);
            }
            let end = end.min((self.now)() + timeout);
            let render = renderer.render_setting(&self.setting_of_rung(choice), &[tile], 0, end);
            match UnfinishedRender::none_if_interrupted(render)? {
                // A ladder without bias keeps the scene's rung, because a slower rung gains less
                // than more samples.
                Some(_) if ladder.is_free_of_bias() => return Ok(LadderTrial::KeepsRung),
                Some(_) => return Ok(LadderTrial::Feasible(choice)),
                None => self.infeasible_rungs.push(choice),
            }
        }
        Ok(LadderTrial::KeepsRung)
    }

    /// Measures the render time per sample of the reference, divided by that of the unchanged
    /// setting, on a tile. `exact` holds the rungs (quality levels) of the reference, `own_render`
    /// the render of the unchanged setting. An unfinished render leaves the assumed ratio.
    fn measure_reference_time_ratio(
        &mut self,
        renderer: &SettingRenderer<'_>,
        tile: Crop,
        (exact, own_render): (&RungSetting, &[TimedRender]),
        end: Instant,
    ) -> Result<(), PrepareError> {
        let reference_setting = exact
            .choices()
            .iter()
            .fold(self.baseline.clone(), |setting, &choice| {
                setting.with_rung(choice)
            });
        let render = renderer.render_setting(&reference_setting, &[tile], 0, end);
        if let Some(reference) = UnfinishedRender::none_if_interrupted(render)? {
            let seconds = |renders: &[TimedRender]| -> f64 {
                renders.iter().map(|render| render.seconds).sum()
            };
            let ratio = seconds(&reference) / seconds(own_render);
            if ratio.is_finite() {
                self.reference_time_ratio = ratio.max(1.0);
            }
        }
        Ok(())
    }
}
