//! Stores the sums of tiles in a film, and returns them to workers that continue the tiles.

use super::{Film, Rect, ReplicateBuffer, TileUpdate};

impl Film {
    /// Returns the sums of a tile in a replicate, from which sampling continues; empty before the
    /// first samples.
    pub(crate) fn tile_buffer(&self, tile: u32, replicate: u32) -> ReplicateBuffer {
        let area = Rect::for_film_tile(self.plan.tile_rect(tile), self.plan.crop.width);
        let buffer = self.buffers[replicate as usize]
            .as_ref()
            .filter(|_| self.samples_drawn(tile, replicate) > 0);
        buffer
            .map(|buffer| buffer.extract_rect(area))
            .unwrap_or_default()
    }

    /// Stores the result of a unit of work: replaces the sums of the tile in its replicate, and
    /// adds spread and counters.
    pub(crate) fn store_tile(&mut self, tile_update: &TileUpdate) {
        let tile = self.plan.tile_rect(tile_update.tile);
        let (from, to) = (
            Rect::for_whole_buffer(tile.width, tile.height),
            Rect::for_film_tile(tile, self.plan.crop.width),
        );
        let spread = self.combine_deviations(tile_update, from, to);
        self.add_sample_spread(&spread, from, to);
        self.copy_buffer_into_film(tile_update.replicate, &tile_update.buffer, from, to);
        self.place_centre_layers(&tile_update.centre, from, to);
        self.counters += tile_update.counters;
        let index = self.tile_replicate_index(tile_update.tile, tile_update.replicate);
        self.samples_drawn[index] = u16::try_from(tile_update.drawn).unwrap_or(u16::MAX);
    }

    /// Returns the spread of a tile's added samples about the mean of their replicate: their spread
    /// about their own mean, combined with the distance of that mean from the mean of the earlier
    /// samples (Chan, Golub and LeVeque 1983).
    fn combine_deviations(&self, tile_update: &TileUpdate, from: Rect, to: Rect) -> Vec<[f32; 3]> {
        let before = self.buffers[tile_update.replicate as usize]
            .as_ref()
            .filter(|_| self.samples_drawn(tile_update.tile, tile_update.replicate) > 0);
        let Some(before) = before.filter(|_| !tile_update.spread.is_empty()) else {
            return tile_update.spread.clone();
        };
        let pixels = from.row_ranges().flatten().zip(to.row_ranges().flatten());
        pixels
            .map(|(new, old)| {
                let (n, all) = (
                    f64::from(before.samples[old]),
                    f64::from(tile_update.buffer.samples[new]),
                );
                let (sum, total) = (before.pixel_total(old), tile_update.buffer.pixel_total(new));
                let added = all - n;
                if n == 0.0 || added == 0.0 {
                    return tile_update.spread[new];
                }
                core::array::from_fn(|i| {
                    let apart = (total[i] - sum[i]) / added - sum[i] / n;
                    (f64::from(tile_update.spread[new][i]).powi(2)
                        + n * added / all * apart * apart)
                        .sqrt() as f32
                })
            })
            .collect()
    }

    pub(super) fn copy_buffer_into_film(
        &mut self,
        replicate: u32,
        buffer: &ReplicateBuffer,
        from: Rect,
        to: Rect,
    ) {
        let plan = &self.plan;
        self.buffers[replicate as usize]
            .get_or_insert_with(|| ReplicateBuffer::zeroed(plan))
            .copy_rect_from(to, buffer, from);
    }

    pub(super) fn place_centre_layers(&mut self, layers: &[Vec<f32>], from: Rect, to: Rect) {
        if self.centre_layers.is_empty() {
            self.centre_layers = layers
                .iter()
                .map(|_| vec![0.0; self.plan.pixel_count()])
                .collect();
        }
        for (into, layer) in self.centre_layers.iter_mut().zip(layers) {
            super::buffer::copy_rect(into, to, layer, from);
        }
    }

    /// Adds a spread to the stored spread: the root of the sum of squares. Each addition rounds in
    /// f32, so parts merged in another order than that of the replicates may differ by an ulp; no
    /// picture depends on the spread.
    pub(super) fn add_sample_spread(&mut self, spread: &[[f32; 3]], from: Rect, to: Rect) {
        if spread.is_empty() {
            return;
        }
        self.spread.resize(self.plan.pixel_count(), [0.0; 3]);
        for (into, of) in to.row_ranges().zip(from.row_ranges()) {
            for (into, of) in self.spread[into].iter_mut().zip(&spread[of]) {
                let join = |a: f32, b: f32| {
                    (f64::from(a) * f64::from(a) + f64::from(b) * f64::from(b)).sqrt() as f32
                };
                *into = core::array::from_fn(|i| join(into[i], of[i]));
            }
        }
    }
}
