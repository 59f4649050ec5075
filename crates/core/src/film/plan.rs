//! Plan of a picture, fixed before its first sample: tiles, replicates, passes, and the data kept
//! for each pixel.

use core::ops::Range;

use serde::{Deserialize, Serialize};

use super::film_picture::FilmLayers;
use super::sums::has_partial_block;
use crate::denoise::requirements;
use crate::picture::DataWindow;
use crate::settings::{Aov, Background, Crop, Settings, default_replicates};

/// Most samples of a pixel in one replicate: the limit of a 16-bit count, and of a sequence of 2¹⁶
/// points.
const MAX_REPLICATE_SAMPLES: u32 = u16::MAX as u32;

/// Numbers of samples of a replicate at the end of the first passes; later passes end at multiples
/// of [`PASS_SAMPLES`]. The first passes are short, so that every pixel soon has samples; the later
/// passes are whole blocks of sums. Pictures do not depend on the passes.
const FIRST_PASSES: [u32; 3] = [4, 16, 32];
const PASS_SAMPLES: u32 = 64;

/// Number of replicates under adaptive sampling: two halves, each of which decides the sample
/// counts of the other half.
const ADAPTIVE_REPLICATES: u32 = 4;

/// Edge of the tiles of adaptive sampling in pixels. Independent of the setting for tiles, because
/// an adaptive picture depends on the tile size. Smaller tiles estimate their noise less well,
/// larger tiles follow its changes less well.
const ADAPTIVE_TILE: u32 = 16;

/// Plan of a film: the division of the picture into tiles and replicates, and the data kept for
/// each pixel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct FilmPlan {
    /// Width and height of the whole picture.
    pub(super) size: [u32; 2],
    /// Rendered part of the picture.
    pub crop: Crop,
    pub(super) tile_size: u32,
    /// Samples per pixel, over all replicates.
    pub(super) samples: u32,
    /// Requested number of replicates; `None`: chosen by the number of samples.
    pub(super) asked: Option<u32>,
    /// Replicates of every pixel, at least one.
    pub replicates: u32,
    /// Whether the picture uses random numbers.
    pub random: bool,
    /// Whether the coverage of pixels is kept.
    pub alpha: bool,
    /// Radiance of the backdrop behind a studio's ground; `None` without a ground. The sums include
    /// the backdrop, and the ground's shadow is kept beside the coverage. Errors are those of the
    /// picture in front of this backdrop, so that a noisy shadow counts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub backdrop: Option<f64>,
    pub layers: FilmLayers,
    /// Whether the lines of the layer `edges` are drawn over the picture.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub draws_lines: bool,
    /// Whether the samples of a pixel form a fixed pattern, so that they cannot be split into
    /// replicates or passes.
    pub(super) is_fixed: bool,
    /// Whether sampling is adaptive, so that tiles and halves of replicates end with different
    /// numbers of samples.
    pub adaptive: bool,
    /// For a picture to be denoised, the layers kept for the denoiser alone, which the picture does
    /// not show; `None` without denoising.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub denoise: Option<Vec<Aov>>,
}

/// Returns the number of replicates for a number of samples per pixel; `requested` is the number
/// that the settings request.
fn choose_replicate_count(samples: u32, requested: Option<u32>, is_fixed: bool) -> u32 {
    match is_fixed {
        // The samples of a fixed pattern are different positions, not repetitions.
        true => 1,
        false => requested
            .unwrap_or(default_replicates(samples))
            .max(samples.div_ceil(MAX_REPLICATE_SAMPLES))
            .min(samples)
            .max(1),
    }
}

impl FilmPlan {
    /// Plans a film for settings. `random`: whether samples lie at random positions or sample
    /// lights or lenses; `grounded`: whether the scene has a ground with shadows.
    pub fn new(settings: &Settings, random: bool, grounded: bool) -> Self {
        let [width, height] = settings.size;
        let by_replicates = random && !settings.sampling.is_fixed();
        let adaptive = settings.max_error.is_some() && by_replicates;
        let denoise =
            settings.denoise && random && requirements::is_denoisable_sampling(settings.sampling);
        let requested = match (adaptive, denoise) {
            (true, _) => Some(ADAPTIVE_REPLICATES),
            (_, true) => Some(
                settings
                    .replicates
                    .unwrap_or(0)
                    .max(requirements::REPLICATES),
            ),
            _ => settings.replicates,
        };
        let unasked: Vec<Aov> = requirements::REQUIRED_LAYERS
            .into_iter()
            .filter(|aov| !settings.aovs.contains(aov))
            .collect();
        let denoise = denoise.then_some(unasked);
        let lines = settings.edges && !settings.aovs.contains(&Aov::Edges);
        Self {
            size: settings.size,
            crop: settings.crop.unwrap_or(Crop {
                x: 0,
                y: 0,
                width,
                height,
            }),
            tile_size: if adaptive {
                ADAPTIVE_TILE
            } else {
                settings.tile_size.max(1)
            },
            samples: settings.samples(),
            asked: requested,
            replicates: choose_replicate_count(
                settings.samples(),
                requested,
                settings.sampling.is_fixed(),
            ),
            random,
            alpha: settings.background == Background::Transparent,
            backdrop: (settings.background == Background::Transparent && grounded)
                .then(|| settings.radiance_behind_ground()),
            layers: settings
                .aovs
                .iter()
                .chain(lines.then_some(&Aov::Edges))
                .chain(denoise.iter().flatten())
                .copied()
                .collect::<Vec<_>>()
                .into(),
            draws_lines: settings.edges,
            is_fixed: settings.sampling.is_fixed(),
            adaptive,
            denoise,
        }
    }

    /// Checks a plan that was read from a file; the error names the invalid part.
    pub fn validate(&self) -> Result<(), &'static str> {
        let Crop {
            x,
            y,
            width,
            height,
        } = self.crop;
        let lies_within = |index: u32, edge: u32, all: u32| {
            edge > 0 && index.checked_add(edge).is_some_and(|end| end <= all)
        };
        let edges = lies_within(x, width, self.size[0]) && lies_within(y, height, self.size[1]);
        // Pixel indices and tile numbers are 32 bits wide.
        if !edges || u64::from(width) * u64::from(height) > u64::from(u32::MAX) {
            return Err("size");
        }
        if self.tile_size == 0 {
            return Err("size of tiles");
        }
        if self.samples == 0
            || self.replicates != choose_replicate_count(self.samples, self.asked, self.is_fixed)
            || self.replicate_samples(0) > MAX_REPLICATE_SAMPLES
        {
            return Err("number of samples");
        }
        Ok(())
    }

    /// Returns the position of the crop in the uncropped picture; `None` without a crop.
    pub fn data_window(&self) -> Option<DataWindow> {
        let Crop {
            x,
            y,
            width,
            height,
        } = self.crop;
        // Both coordinates are far below 2³¹: a picture has at most 2³² pixels, and no edge of that
        // length.
        let origin = [x, y].map(|index| i32::try_from(index).unwrap_or(i32::MAX));
        ([width, height] != self.size).then_some(DataWindow {
            origin,
            full: self.size,
        })
    }

    /// Returns the samples of a pixel.
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// Returns the same plan with another number of samples per pixel.
    pub fn with_samples(&self, samples: u32) -> Self {
        Self {
            samples,
            replicates: choose_replicate_count(samples, self.asked, self.is_fixed),
            ..self.clone()
        }
    }

    /// Returns the next pass of a tile in a replicate, numbered from zero, and the range of its
    /// samples. `all` is the number of samples per pixel in the replicate, and `drawn` of them are
    /// finished. `None` if all are finished.
    pub fn next_sample_range(&self, all: u32, drawn: u32) -> Option<(u32, Range<u32>)> {
        if drawn >= all {
            return None;
        }
        if self.is_fixed {
            return Some((0, drawn..all));
        }
        let listed = FIRST_PASSES.iter().position(|&end| drawn < end);
        let (pass, end) = match listed {
            Some(pass) => (pass as u32, FIRST_PASSES[pass]),
            None => (
                FIRST_PASSES.len() as u32 + drawn / PASS_SAMPLES,
                (drawn / PASS_SAMPLES + 1) * PASS_SAMPLES,
            ),
        };
        Some((pass, drawn..end.min(all)))
    }

    /// Returns the samples of a pixel in one replicate: an even share of all samples, and one more
    /// in the first replicates if the division leaves a remainder.
    pub fn replicate_samples(&self, replicate: u32) -> u32 {
        self.samples / self.replicates + u32::from(replicate < self.samples % self.replicates)
    }

    /// Returns the number of replicates whose samples together are one net, the first points of one
    /// sequence: two in a picture to be denoised, where the samples without denoising are two nets.
    pub fn replicates_per_net(&self) -> u32 {
        let shares = self.denoise.is_some()
            && self.asked == Some(requirements::REPLICATES)
            && !self.adaptive
            && default_replicates(self.samples) < requirements::REPLICATES;
        if shares { 2 } else { 1 }
    }

    /// Returns the net of a replicate, and the index in that net of the replicate's sample `index`.
    /// Two replicates of one net take two samples each in turn, so that the samples of a film are
    /// also the first ones of a film of more samples.
    pub fn net_and_index(&self, replicate: u32, index: u32) -> (u32, u32) {
        match self.replicates_per_net() {
            1 => (replicate, index),
            _ => (
                replicate / 2,
                2 * (index - index % 2) + 2 * (replicate % 2) + index % 2,
            ),
        }
    }

    pub fn pixel_count(&self) -> usize {
        self.crop.width as usize * self.crop.height as usize
    }

    pub fn tile_count(&self) -> u32 {
        self.tile_columns() * self.crop.height.div_ceil(self.tile_size)
    }

    pub fn tile_columns(&self) -> u32 {
        self.crop.width.div_ceil(self.tile_size)
    }

    /// Returns the rectangle of a tile, relative to the crop. Tiles are numbered row by row.
    pub fn tile_rect(&self, index: u32) -> Crop {
        let (x, y) = (
            index % self.tile_columns() * self.tile_size,
            index / self.tile_columns() * self.tile_size,
        );
        let (width, height) = (
            self.tile_size.min(self.crop.width - x),
            self.tile_size.min(self.crop.height - y),
        );
        Crop {
            x,
            y,
            width,
            height,
        }
    }

    /// Returns the number of pixels of a tile.
    pub fn tile_pixel_count(&self, index: u32) -> u64 {
        let tile = self.tile_rect(index);
        u64::from(tile.width) * u64::from(tile.height)
    }

    /// Returns the number of the tile that contains a pixel, given by its index in the film.
    pub fn tile_of_pixel(&self, pixel: usize) -> u32 {
        let (x, y) = (
            pixel as u32 % self.crop.width,
            pixel as u32 / self.crop.width,
        );
        y / self.tile_size * self.tile_columns() + x / self.tile_size
    }

    /// Returns the bytes of the film and of its picture.
    pub fn bytes(&self) -> u64 {
        (self.pixel_count() as u64).saturating_mul(self.bytes_per_pixel())
    }

    /// Returns the bytes per pixel of the film and of its picture: 128 with four replicates and no
    /// layers. Each replicate has three sums in f64 and a count; the spread of the samples and the
    /// picture's colour exist once.
    fn bytes_per_pixel(&self) -> u64 {
        let (mean, centre) = (
            self.layers.mean.len() as u64,
            self.layers.centre.len() as u64,
        );
        let coverage = if self.alpha { 4 } else { 0 } + if self.backdrop.is_some() { 4 } else { 0 };
        let counts = 2 + coverage + if self.counts_first_hits() { 2 } else { 0 };
        let open = (0..self.replicates)
            .filter(|&replicate| {
                self.adaptive || has_partial_block(self.replicate_samples(replicate))
            })
            .count() as u64;
        let film = u64::from(self.replicates) * (24 + counts + 24 * mean)
            + 24 * open
            + if self.random { 12 } else { 0 }
            + 4 * centre;
        let picture = 12 + coverage + 4 * self.extra_channel_count();
        let denoised = if self.denoise.is_some() {
            requirements::BYTES_A_PIXEL
        } else {
            0
        };
        film + picture + denoised
    }

    /// Returns the number of channels of the picture's layers, without its colour.
    fn extra_channel_count(&self) -> u64 {
        let FilmLayers {
            mean,
            centre,
            samples,
            standard_error,
            asked: _,
        } = &self.layers;
        let (mean, centre) = (
            mean.iter().filter(|(aov, _)| self.shows_layer(*aov)),
            centre.iter().filter(|(aov, _)| self.shows_layer(*aov)),
        );
        3 * mean.count() as u64
            + centre.count() as u64
            + u64::from(*samples)
            + 3 * u64::from(*standard_error)
    }

    /// Whether the picture shows a layer; hidden layers are kept for the denoiser alone.
    pub fn shows_layer(&self, aov: Aov) -> bool {
        !self
            .denoise
            .as_ref()
            .is_some_and(|unasked| unasked.contains(&aov))
    }

    /// Whether the film counts the samples that hit a surface, because a layer is a mean over these
    /// samples.
    pub fn counts_first_hits(&self) -> bool {
        self.layers
            .mean
            .iter()
            .any(|(aov, _)| *aov == Aov::Position)
    }
}

#[cfg(test)]
mod tests;
