//! The film: accumulated samples of every pixel, and the picture computed from them.
//!
//! A picture with random sampling takes its samples in a few *replicates* (their number:
//! [`default_replicates`](crate::settings::default_replicates)), each with independent random
//! numbers. Points within a replicate are correlated, so their spread overestimates the error of
//! their mean. The means of replicates are independent, and the spread of these means estimates the
//! error of the picture. The film therefore keeps the sums of each replicate separate, and adds
//! them last, in ascending order.
//!
//! A unit of work is a range of samples of one tile in one replicate, which continues the samples
//! in the film. A film may hold any tiles and replicates, each with its first samples. The union of
//! such films is the film of a single render: its picture has the same bits for any division of the
//! work, in any order of the parts and any number of steps.
//!
//! A pixel takes 128 bytes in four replicates without layers, the finished picture included, and 24
//! more for each replicate whose last block of samples is not full. Without random sampling a pixel
//! takes 38 bytes, because it has a single replicate and no spread. A picture to be denoised always
//! keeps four replicates and four layers. [`MemoryUse`](crate::MemoryUse) estimates the bytes
//! before the render.

mod adaptive;
mod buffer;
mod estimate;
mod four_replicates;
mod identity;
mod leave_one_out;
mod merge;
mod pixel_variance;
mod plan;
mod record;
mod relative_error;
mod sums;
#[cfg(test)]
pub(crate) mod tests;
mod uncertainty;

pub use adaptive::DoubtfulErrorEstimate;
pub(crate) use adaptive::ErrorProgress;
pub(crate) use buffer::{Rect, ReplicateBuffer};
pub(crate) use estimate::PixelMeanAndVariance;
use estimate::ReplicateStats;
pub(crate) use four_replicates::{BRIGHTEST, FourReplicates, FourReplicatesError};
use identity::FilmIdentity;
pub use merge::FilmMergeError;
pub(crate) use plan::FilmPlan;
pub use record::{FilmDataStream, FilmHeader, FilmHeaderError};
pub(crate) use sums::{
    BlockAccumulator, MomentAccumulator, PixelSums, SampleAccumulator, SumAccumulator,
    quantise_coverage,
};
pub use uncertainty::{ErrorEstimate, EstimateDoubt, Uncertainty};

use core::ops::{Range, RangeInclusive};

use crate::counters::Counters;
use crate::light::LightUsage;
use crate::picture::{Picture, PictureLayer};
use crate::settings::{Aov, Settings};

/// A picture in progress: sums of the samples rendered so far, for each tile and replicate. A
/// replicate is an independent part of a pixel's samples.
#[derive(Clone, Debug)]
#[doc(alias = "RGBFilm")]
pub struct Film {
    identity: FilmIdentity,
    plan: FilmPlan,
    /// Buffer of each replicate; `None` before its first samples.
    buffers: Vec<Option<ReplicateBuffer>>,
    /// Square root of the summed squared deviations of samples from the means of their replicates;
    /// empty without random sampling.
    spread: Vec<[f32; 3]>,
    /// Layers of pixel-centre rays, rendered with the first replicate.
    centre_layers: Vec<Vec<f32>>,
    /// Samples per pixel so far, by replicate and tile.
    samples_drawn: Vec<u16>,
    /// Samples per pixel at the end of the round, by replicate and tile, if the counts are adaptive
    /// or repeat another film's counts; else empty.
    sample_goals: Vec<u16>,
    /// Whether the goals repeat another film's sample counts. Adaptive sampling then adds no
    /// samples.
    is_replayed: bool,
    /// Expected number of samples of all pixels at the end of the render; zero if unknown.
    expected_samples: u64,
    /// Record of the first time that the estimated error reached the requested error but was
    /// doubtful. Not stored in files.
    rejected_stop: Option<DoubtfulErrorEstimate>,
    counters: Counters,
    /// Light usage, counted by the renders of this film. Not a part of the picture, and not stored
    /// in files.
    usage: LightUsage,
}

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

impl Film {
    /// Returns an empty film; `scene` is a text that identifies the scene.
    pub(crate) fn new(scene: &str, settings: &Settings, plan: FilmPlan) -> Self {
        Self::new_empty(FilmIdentity::new(scene, settings), plan)
    }

    fn new_empty(identity: FilmIdentity, plan: FilmPlan) -> Self {
        let units = plan.tile_count() as usize * plan.replicates as usize;
        let goals = if plan.adaptive {
            vec![adaptive::first_round_samples(&plan); units]
        } else {
            Vec::new()
        };
        Self {
            identity,
            buffers: vec![None; plan.replicates as usize],
            spread: Vec::new(),
            centre_layers: Vec::new(),
            samples_drawn: vec![0; units],
            sample_goals: goals,
            is_replayed: false,
            expected_samples: 0,
            rejected_stop: None,
            counters: Counters::default(),
            usage: LightUsage::default(),
            plan,
        }
    }

    pub(crate) fn plan(&self) -> &FilmPlan {
        &self.plan
    }

    /// Returns the text that identifies the scene, as given to
    /// [`ReadyScene::new_film`](crate::ReadyScene::new_film).
    pub fn scene(&self) -> &str {
        &self.identity.scene
    }

    /// Returns width and height in pixels: those of the crop, if the picture is cropped.
    pub fn size(&self) -> [u32; 2] {
        [self.plan.crop.width, self.plan.crop.height]
    }

    /// Returns the part that covers the whole picture.
    pub fn full_part(&self) -> FilmPart {
        FilmPart {
            tiles: 0..self.plan.tile_count(),
            step: 1,
            replicates: 0..self.plan.replicates,
            selected_tiles: None,
        }
    }

    /// Returns the samples per pixel of a tile in a replicate; zero outside the picture.
    pub fn samples_drawn(&self, tile: u32, replicate: u32) -> u32 {
        let unit = (tile < self.plan.tile_count()).then(|| {
            self.samples_drawn
                .get(self.tile_replicate_index(tile, replicate))
        });
        unit.flatten().map_or(0, |&drawn| u32::from(drawn))
    }

    /// Returns the samples per pixel that a tile has in a replicate at the end of the present
    /// round.
    pub(crate) fn sample_goal(&self, tile: u32, replicate: u32) -> u32 {
        self.sample_goals
            .get(self.tile_replicate_index(tile, replicate))
            .map_or(self.plan.replicate_samples(replicate), |&goal| {
                u32::from(goal)
            })
    }

    /// Returns the samples of all pixels of a part so far, and their expected final number.
    pub(crate) fn progress(&self, part: &FilmPart) -> (u64, u64) {
        let (mut done, mut total) = (0, 0);
        for tile in part.iter_tiles(&self.plan) {
            for replicate in part.replicates.start..part.replicates.end.min(self.plan.replicates) {
                let value_of = |samples: u32| self.plan.tile_pixel_count(tile) * u64::from(samples);
                done += value_of(self.samples_drawn(tile, replicate));
                total += value_of(self.sample_goal(tile, replicate));
            }
        }
        (done, total.max(self.expected_samples))
    }

    fn tile_replicate_index(&self, tile: u32, replicate: u32) -> usize {
        replicate as usize * self.plan.tile_count() as usize + tile as usize
    }

    /// Returns the number of pixels that lack samples.
    pub fn unfinished_pixels(&self) -> u64 {
        let lacking = |&tile: &u32| {
            (0..self.plan.replicates)
                .any(|r| self.samples_drawn(tile, r) < self.sample_goal(tile, r))
        };
        (0..self.plan.tile_count())
            .filter(lacking)
            .map(|tile| self.plan.tile_pixel_count(tile))
            .sum()
    }

    /// Whether the picture is to be denoised.
    pub fn is_to_be_denoised(&self) -> bool {
        self.plan.denoise.is_some()
    }

    /// Returns the requested samples per pixel; `None` if the counts are adaptive or repeat another
    /// film's counts.
    pub fn requested_samples(&self) -> Option<u32> {
        self.sample_goals.is_empty().then(|| self.plan.samples())
    }

    /// Returns the least and the greatest number of samples of a pixel in a part.
    pub fn sample_range(&self, part: &FilmPart) -> RangeInclusive<u32> {
        let value_of = |tile| {
            part.replicates
                .clone()
                .map(|replicate| self.samples_drawn(tile, replicate))
                .sum::<u32>()
        };
        let all = part.iter_tiles(&self.plan).map(value_of);
        all.clone().min().unwrap_or(0)..=all.max().unwrap_or(0)
    }

    /// Returns the number of a part's tiles that lack samples.
    pub fn unfinished_tiles(&self, part: &FilmPart) -> usize {
        let replicates = || {
            part.replicates
                .clone()
                .take_while(|&replicate| replicate < self.plan.replicates)
        };
        part.iter_tiles(&self.plan)
            .filter(|&tile| {
                replicates().any(|r| self.samples_drawn(tile, r) < self.sample_goal(tile, r))
            })
            .count()
    }

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

    /// Returns the counters of rays and samples, summed over all renders of the film.
    pub fn counters(&self) -> Counters {
        self.counters
    }

    /// Returns the light usage counted so far.
    pub(crate) fn light_usage(&self) -> &LightUsage {
        &self.usage
    }

    /// Adds the light usage of a worker.
    pub(crate) fn add_light_usage(&mut self, usage: &LightUsage) {
        self.usage.add_worker_counts(usage);
    }

    /// Returns the bytes of sums and layers.
    pub fn bytes(&self) -> u64 {
        let planes: usize = self
            .buffers
            .iter()
            .flatten()
            .map(ReplicateBuffer::bytes)
            .sum();
        let centre: usize = self.centre_layers.iter().map(|layer| layer.len() * 4).sum();
        (planes + self.spread.len() * 12 + centre) as u64
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

    fn copy_buffer_into_film(
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

    fn place_centre_layers(&mut self, layers: &[Vec<f32>], from: Rect, to: Rect) {
        if self.centre_layers.is_empty() {
            self.centre_layers = layers
                .iter()
                .map(|_| vec![0.0; self.plan.pixel_count()])
                .collect();
        }
        for (into, layer) in self.centre_layers.iter_mut().zip(layers) {
            buffer::copy_rect(into, to, layer, from);
        }
    }

    /// Adds a spread to the stored spread: the root of the sum of squares. Each addition rounds in
    /// f32, so parts merged in another order than that of the replicates may differ by an ulp; no
    /// picture depends on the spread.
    fn add_sample_spread(&mut self, spread: &[[f32; 3]], from: Rect, to: Rect) {
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

    /// Returns the variance of a pixel's samples about their mean, per channel: the variance of a
    /// sample, not of the mean. `None` without random sampling, or with fewer than two samples.
    pub fn pixel_variance(&self, x: u32, y: u32) -> Option<[f64; 3]> {
        if x >= self.plan.crop.width || y >= self.plan.crop.height {
            return None;
        }
        let pixel = y as usize * self.plan.crop.width as usize + x as usize;
        let within = self.spread.get(pixel)?.map(|s| f64::from(s) * f64::from(s));
        let means = self.replicate_stats().replicate_deviations(pixel);
        (means.samples >= 2.0).then(|| {
            core::array::from_fn(|i| {
                (within[i] + means.squared_deviations[i]) / (means.samples - 1.0)
            })
        })
    }

    /// Returns the standard error of each pixel's mean, as in the layer `stderr`, with the degrees
    /// of freedom: one less than the number of replicates. `None` with fewer than two replicates.
    pub fn standard_errors(&self) -> Option<(Vec<[f32; 3]>, u32)> {
        let freedom = self
            .plan
            .replicates
            .checked_sub(1)
            .filter(|freedom| *freedom > 0 && self.plan.random)?;
        Some((self.standard_errors_or_unknown(), freedom))
    }

    /// Returns the standard errors of all pixels; −1, for unknown, in a picture in which no sample
    /// found light.
    fn standard_errors_or_unknown(&self) -> Vec<[f32; 3]> {
        if self.is_black_despite_lights() {
            return vec![[-1.0; 3]; self.plan.pixel_count()];
        }
        self.replicate_stats()
            .standard_errors(self.plan.pixel_count(), self.plan.crop.width as usize)
    }

    fn replicate_stats(&self) -> ReplicateStats<'_> {
        ReplicateStats::new(self.buffers.iter().flatten(), self.plan.adaptive)
    }

    /// Returns a picture of the means of all pixels, without coverage and layers. The backdrop
    /// behind a ground is included.
    pub(crate) fn mean_colours(&self) -> Picture {
        let (plan, planes) = (&self.plan, self.replicate_stats());
        let mut picture = Picture {
            window: plan.data_window(),
            ..Picture::new(plan.crop.width, plan.crop.height)
        };
        for (pixel, colour) in picture.rgb.iter_mut().enumerate() {
            *colour = planes.mean(pixel).0.map(|c| c as f32);
        }
        picture
    }

    /// Returns the picture of the samples so far. A pixel without its full number of samples has
    /// the mean of those present; it is black without any.
    pub fn picture(&self) -> Picture {
        let (plan, planes) = (&self.plan, self.replicate_stats());
        let all = 0..plan.pixel_count();
        let mut picture = self.mean_colours();
        self.subtract_backdrop(&mut picture);
        let mut layers: Vec<(&str, Vec<f32>)> = Vec::new();
        for (k, (aov, names)) in plan
            .layers
            .mean
            .iter()
            .enumerate()
            .filter(|(_, (aov, _))| plan.shows_layer(*aov))
        {
            let mean = |i: usize| {
                all.clone()
                    .map(|pixel| self.layer_mean(k, *aov, i, pixel))
                    .collect()
            };
            layers.extend(names.iter().enumerate().map(|(i, &name)| (name, mean(i))));
        }
        for (k, (_, name)) in plan
            .layers
            .centre
            .iter()
            .enumerate()
            .filter(|(_, (aov, _))| plan.shows_layer(*aov))
        {
            layers.push((
                name,
                self.centre_layers
                    .get(k)
                    .cloned()
                    .unwrap_or_else(|| vec![0.0; plan.pixel_count()]),
            ));
        }
        if plan.layers.samples {
            layers.push((
                "samples.N",
                all.clone()
                    .map(|pixel| planes.mean(pixel).1 as f32)
                    .collect(),
            ));
        }
        if plan.layers.standard_error {
            let errors = if plan.random {
                self.standard_errors_or_unknown()
            } else {
                vec![[0.0; 3]; plan.pixel_count()]
            };
            let named = ["stderr.R", "stderr.G", "stderr.B"].into_iter().enumerate();
            layers.extend(
                named.map(|(i, name)| (name, errors.iter().map(|error| error[i]).collect())),
            );
        }
        picture.layers = layers
            .into_iter()
            .map(|(name, samples)| PictureLayer {
                name: name.to_owned(),
                samples,
            })
            .collect();
        picture
    }

    /// Adds the coverage to a picture of the film's colours, and subtracts the backdrop behind a
    /// ground. A pixel of ground alone has no colour; its shadow is computed from the picture's
    /// colour, so that denoising applies to the shadow too.
    pub(crate) fn subtract_backdrop(&self, picture: &mut Picture) {
        if !self.plan.alpha {
            return;
        }
        let (planes, all) = (self.replicate_stats(), 0..self.plan.pixel_count());
        let mut alpha: Vec<f32> = all
            .clone()
            .map(|pixel| planes.coverage(pixel) as f32)
            .collect();
        if let Some(backdrop) = self.plan.backdrop {
            let shadow = |pixel: usize| {
                let (rgb, covered) = (&mut picture.rgb[pixel], planes.coverage(pixel));
                let seen = rgb.iter().map(|&channel| f64::from(channel)).sum::<f64>() / 3.0;
                let is_drawn = planes.mean(pixel).1 > 0.0;
                let clear = if covered > 0.0 {
                    1.0 - covered - planes.shadow_coverage(pixel)
                } else {
                    seen / backdrop
                }
                .clamp(0.0, 1.0);
                *rgb = rgb.map(|channel| {
                    if covered > 0.0 {
                        (f64::from(channel) - backdrop * clear).max(0.0) as f32
                    } else {
                        0.0
                    }
                });
                if is_drawn {
                    (1.0 - covered - clear).max(0.0) as f32
                } else {
                    0.0
                }
            };
            let shadow: Vec<f32> = all.map(shadow).collect();
            alpha
                .iter_mut()
                .zip(&shadow)
                .for_each(|(alpha, shadow)| *alpha += shadow);
            picture.shadow = Some(shadow);
        }
        picture.alpha = Some(alpha);
    }

    /// Returns the mean of a layer over a pixel's samples, in one channel; replicates are weighted
    /// by their numbers of samples.
    fn layer_mean(&self, layer: usize, aov: Aov, channel: usize, pixel: usize) -> f32 {
        let (mut sum, mut count) = (0.0, 0.0);
        let tile = self.plan.tile_of_pixel(pixel);
        for (replicate, buffer) in (0..).zip(&self.buffers) {
            let Some(buffer) = buffer else { continue };
            let n = match aov {
                Aov::Position => f64::from(buffer.first_hits[pixel]),
                Aov::Emission => f64::from(buffer.samples[pixel]),
                _ => f64::from(self.samples_drawn(tile, replicate)),
            };
            let mean = (buffer.layers[layer][pixel][channel] / f64::max(n, 1.0)) as f32;
            sum += n * f64::from(mean);
            count += n;
        }
        (sum / f64::max(count, 1.0)) as f32
    }
}
