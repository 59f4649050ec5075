//! The reference picture, which is rendered tile by tile as time allows.

use std::time::Instant;

use super::SettingRenderer;
use crate::accuracy::setting::{RungSetting, reference_setup};
use crate::accuracy::tiles::TileGrid;
use crate::accuracy::{MeasureError, MeasurementStart};
use crate::dispatch::ReadyScene;
use crate::film::{Film, FilmPart};
use crate::settings::Settings;

/// Number of replicates (independent renders) of the reference, from which its standard error is
/// estimated.
const REPLICATES: u32 = 4;

/// Reference picture that is rendered tile by tile.
pub(in crate::accuracy) struct IncrementalReference<'a> {
    renderer: &'a SettingRenderer<'a>,
    ready: ReadyScene,
    pub film: Film,
    /// Number of rays of the earlier reference, zero for a new one.
    reused_rays: u64,
    /// Render time of the new tiles, in seconds summed over all threads.
    pub seconds: f64,
}

impl IncrementalReference<'_> {
    /// Renders all samples of these tiles of the grid, given by index. Returns false if the time
    /// runs out.
    pub fn render_tiles(&mut self, tiles: &[u32], end: Instant) -> bool {
        let Self {
            renderer,
            ready,
            film,
            ..
        } = self;
        let until = renderer.deadline_observer(end);
        let whole_part = film.full_part();
        let mut tiles = tiles.to_vec();
        tiles.sort_unstable();
        let part = FilmPart {
            selected_tiles: Some(tiles),
            ..whole_part
        };
        if film.unfinished_tiles(&part) == 0 {
            return true;
        }
        let before = film.counters().ray_count();
        self.seconds += (renderer.stopwatch)(&mut || {
            // The film belongs to this scene, so no part is refused.
            let _ = ready.render_part(film, &part, &until);
            film.counters().ray_count() - before
        });
        film.unfinished_tiles(&part) == 0
    }

    /// Whether the whole film comes from an earlier measurement.
    pub fn is_reused(&self) -> bool {
        self.reused_rays > 0 && self.reused_rays == self.film.counters().ray_count()
    }
}

impl SettingRenderer<'_> {
    /// Prepares a reference with the rungs (quality levels) of `exact` and this number of samples
    /// per pixel. Its film is empty, or the film of an earlier reference.
    pub fn prepare_reference(
        &self,
        exact: &RungSetting,
        samples: u32,
        grid: TileGrid,
        start: MeasurementStart<'_>,
        end: Instant,
    ) -> Result<IncrementalReference<'_>, MeasureError> {
        let (scene, settings) = reference_setup(exact, self.scene, self.settings, samples);
        let settings = Settings {
            replicates: Some(REPLICATES),
            tile_size: grid.edge,
            ..settings
        };
        let (ready, _) = self
            .prepare_and_time(&scene, &settings, end)
            .map_err(|error| self.to_measure_error(error.into_error()))?;
        let mut film = ready.new_film(start.scene);
        if let Some(earlier) = start.reference {
            film.continue_from(earlier.film)
                .map_err(MeasureError::Reference)?;
        }
        let kept = film.counters().ray_count();
        Ok(IncrementalReference {
            renderer: self,
            ready,
            film,
            reused_rays: kept,
            seconds: 0.0,
        })
    }
}
