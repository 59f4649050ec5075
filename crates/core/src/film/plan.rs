//! What is fixed before the first sample of a picture: its tiles, its replicates, the passes over
//! it and what is kept of each pixel.

use core::ops::Range;

use serde::{Deserialize, Serialize};

use super::sums::has_open;
use crate::denoise::demand;
use crate::picture::DataWindow;
use crate::settings::{Aov, Background, Crop, Settings, replicates};

/// Samples of a pixel in one replicate, at most: they are counted in 16 bits and are points of one
/// sequence of 2¹⁶.
const MOST: u32 = u16::MAX as u32;

/// Samples of a replicate that the passes over a picture end at, first those listed, then every
/// [`PASS`]: few at first, so that there is soon something everywhere, then whole blocks of sums.
/// Pictures do not depend on it.
const FIRST_PASSES: [u32; 3] = [4, 16, 32];
const PASS: u32 = 64;

/// Replicates of a picture whose samples go where the error is: two that decide for the other two.
const ADAPTIVE_REPLICATES: u32 = 4;

/// Edge of the tiles that decide it in pixels, whatever the tiles of other pictures are, since such
/// a picture does depend on them: with fewer pixels each would know less of its own noise, and
/// larger ones miss where it is.
const ADAPTIVE_TILE: u32 = 16;

/// Which layers there are, by where their numbers come from, and their names in files.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "Vec<Aov>", into = "Vec<Aov>")]
pub(crate) struct Layers {
    asked: Vec<Aov>,
    /// From the first hits of all samples.
    pub mean: Vec<(Aov, [&'static str; 3])>,
    /// From the first hit of the pixel-centre ray.
    pub centre: Vec<(Aov, &'static str)>,
    /// From the pixel's sums.
    pub samples: bool,
    pub standard_error: bool,
}

impl From<Layers> for Vec<Aov> {
    fn from(layers: Layers) -> Self {
        layers.asked
    }
}

impl From<Vec<Aov>> for Layers {
    fn from(asked: Vec<Aov>) -> Self {
        let mut mean = Vec::new();
        let mut centre = Vec::new();
        for &aov in &asked {
            match aov {
                Aov::Albedo => mean.push((aov, ["albedo.R", "albedo.G", "albedo.B"])),
                Aov::Normal => mean.push((aov, ["normal.X", "normal.Y", "normal.Z"])),
                Aov::Position => mean.push((aov, ["position.X", "position.Y", "position.Z"])),
                Aov::Emission => mean.push((aov, ["emission.R", "emission.G", "emission.B"])),
                Aov::Depth => centre.push((aov, "depth.Z")),
                Aov::Object => centre.push((aov, "object.id")),
                Aov::Material => centre.push((aov, "material.id")),
                Aov::Samples | Aov::StandardError => {}
            }
        }
        let has = |aov| asked.contains(&aov);
        Self {
            mean,
            centre,
            samples: has(Aov::Samples),
            standard_error: has(Aov::StandardError),
            asked,
        }
    }
}

/// How a picture is divided, and what its film holds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Plan {
    /// Width and height of the whole picture.
    size: [u32; 2],
    /// The part of it that is rendered.
    pub crop: Crop,
    tile_size: u32,
    /// Samples of a pixel, in all replicates together.
    samples: u32,
    /// Replicates that were asked for; none: as many as suit the samples.
    asked: Option<u32>,
    /// Replicates of every pixel, at least one.
    pub replicates: u32,
    /// Whether chance has a part in the picture.
    pub random: bool,
    /// Whether the coverage of pixels is kept.
    pub alpha: bool,
    /// Radiance that sums have of what lies behind a studio's ground, whose shadows are kept beside
    /// the coverage; none: there is no ground. Errors are those of the picture before a page like
    /// that, so that a noisy shadow counts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub backdrop: Option<f64>,
    pub layers: Layers,
    /// Whether samples are the places of a pattern, which belong together.
    is_fixed: bool,
    /// Whether samples go where the error is, so that tiles and halves of replicates end with
    /// different numbers.
    pub adaptive: bool,
    /// Where the picture is to be denoised, the layers that are kept for that alone and are none of
    /// the picture's; none: it is not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub denoise: Option<Vec<Aov>>,
}

/// Replicates of so many samples.
fn division(samples: u32, asked: Option<u32>, is_fixed: bool) -> u32 {
    match is_fixed {
        // A pattern's samples are different places, not repetitions.
        true => 1,
        false => asked
            .unwrap_or(replicates(samples))
            .max(samples.div_ceil(MOST))
            .min(samples)
            .max(1),
    }
}

impl Plan {
    /// `random`: whether samples lie at random places, or draw points of lights or lenses;
    /// `grounded`: whether there is a ground with shadows.
    pub fn new(settings: &Settings, random: bool, grounded: bool) -> Self {
        let [width, height] = settings.size;
        let by_replicates = random && !settings.sampling.is_fixed();
        let adaptive = settings.max_error.is_some() && by_replicates;
        let denoise = settings.denoise && random && demand::is_possible(settings.sampling);
        let asked = match (adaptive, denoise) {
            (true, _) => Some(ADAPTIVE_REPLICATES),
            (_, true) => Some(settings.replicates.unwrap_or(0).max(demand::REPLICATES)),
            _ => settings.replicates,
        };
        let unasked: Vec<Aov> = demand::LAYERS
            .into_iter()
            .filter(|aov| !settings.aovs.contains(aov))
            .collect();
        let denoise = denoise.then_some(unasked);
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
            samples: settings.sampling.count(),
            asked,
            replicates: division(
                settings.sampling.count(),
                asked,
                settings.sampling.is_fixed(),
            ),
            random,
            alpha: settings.background == Background::Transparent,
            backdrop: (settings.background == Background::Transparent && grounded)
                .then(|| settings.page_radiance()),
            layers: settings
                .aovs
                .iter()
                .chain(denoise.iter().flatten())
                .copied()
                .collect::<Vec<_>>()
                .into(),
            is_fixed: settings.sampling.is_fixed(),
            adaptive,
            denoise,
        }
    }

    /// What makes no sense in a plan that was read from a file.
    pub fn check(&self) -> Result<(), &'static str> {
        let Crop {
            x,
            y,
            width,
            height,
        } = self.crop;
        let lies_within = |at: u32, edge: u32, all: u32| {
            edge > 0 && at.checked_add(edge).is_some_and(|end| end <= all)
        };
        let edges = lies_within(x, width, self.size[0]) && lies_within(y, height, self.size[1]);
        // Places of pixels and numbers of tiles are 32 bits wide.
        if !edges || u64::from(width) * u64::from(height) > u64::from(u32::MAX) {
            return Err("size");
        }
        if self.tile_size == 0 {
            return Err("size of tiles");
        }
        if self.samples == 0
            || self.replicates != division(self.samples, self.asked, self.is_fixed)
            || self.samples_of(0) > MOST
        {
            return Err("number of samples");
        }
        Ok(())
    }

    /// Where the picture lies in the whole one; none: it is that.
    pub fn window(&self) -> Option<DataWindow> {
        let Crop {
            x,
            y,
            width,
            height,
        } = self.crop;
        // Both are far below 2³¹: a picture has no more than 2³² pixels and no edge as long as
        // that.
        let origin = [x, y].map(|at| i32::try_from(at).unwrap_or(i32::MAX));
        ([width, height] != self.size).then_some(DataWindow {
            origin,
            full: self.size,
        })
    }

    /// Edge of a tile in pixels.
    pub fn tile_size(&self) -> u32 {
        self.tile_size
    }

    /// Samples of a pixel.
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// The same picture with another number of samples.
    pub fn with_samples(&self, samples: u32) -> Self {
        Self {
            samples,
            replicates: division(samples, self.asked, self.is_fixed),
            ..self.clone()
        }
    }

    /// What divides another picture differently, apart from samples.
    pub fn other_division(&self, other: &Self) -> Option<&'static str> {
        let differs = [
            (self.crop != other.crop, "crop"),
            (self.tile_size != other.tile_size, "size of tiles"),
            (self.asked != other.asked, "number of replicates"),
            (self.is_fixed != other.is_fixed, "pattern of samples"),
            (self.adaptive != other.adaptive, "maximum error"),
            (self.denoise != other.denoise, "denoising"),
            (
                (self.random, self.alpha, &self.layers)
                    != (other.random, other.alpha, &other.layers),
                "scene",
            ),
            (self.backdrop != other.backdrop, "ground"),
        ];
        differs
            .into_iter()
            .find(|(differs, _)| *differs)
            .map(|(_, what)| what)
    }

    /// What divides another picture differently.
    pub fn difference(&self, other: &Self) -> Option<&'static str> {
        let samples = (self.samples != other.samples).then_some("number of samples");
        samples.or_else(|| self.other_division(other))
    }

    /// Whether each replicate has the samples that it has in a picture with fewer, or more.
    pub fn continues(&self, fewer: &Self) -> bool {
        fewer.replicates <= self.replicates
            && (0..fewer.replicates).all(|r| fewer.samples_of(r) <= self.samples_of(r))
    }

    /// The fewest samples, of at least its own, with which this plan continues another one of the
    /// same division; none where no number does.
    pub fn least_continuing(&self, fewer: &Self) -> Option<u32> {
        // The last replicate has the fewest samples, and must have as many here: this many in each,
        // and one more up to that one.
        let (before, last) = (
            u64::from(fewer.samples / fewer.replicates - 1),
            u64::from(fewer.replicates),
        );
        let mut samples = self.samples.max(fewer.samples);
        loop {
            let plan = self.with_samples(samples);
            if plan.continues(fewer) {
                return Some(samples);
            }
            // Replicates do not become fewer: with less than that there are too few samples for
            // each of them.
            let next = (u64::from(plan.replicates) * before + last).max(u64::from(samples) + 1);
            samples = u32::try_from(next).ok()?;
        }
    }

    /// The pass, counted from zero, that comes next for a tile which has so many of `all` samples
    /// of a replicate, and which samples it takes; none where all are there.
    pub fn pass(&self, all: u32, drawn: u32) -> Option<(u32, Range<u32>)> {
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
                FIRST_PASSES.len() as u32 + drawn / PASS,
                (drawn / PASS + 1) * PASS,
            ),
        };
        Some((pass, drawn..end.min(all)))
    }

    /// Samples of a pixel in one replicate: spread evenly, the first ones have one more where the
    /// count does not divide.
    pub fn samples_of(&self, replicate: u32) -> u32 {
        self.samples / self.replicates + u32::from(replicate < self.samples % self.replicates)
    }

    pub fn pixels(&self) -> usize {
        self.crop.width as usize * self.crop.height as usize
    }

    pub fn tiles(&self) -> u32 {
        self.columns() * self.crop.height.div_ceil(self.tile_size)
    }

    pub fn columns(&self) -> u32 {
        self.crop.width.div_ceil(self.tile_size)
    }

    /// A tile, counted row by row, in film coordinates: relative to the crop.
    pub fn tile(&self, index: u32) -> Crop {
        let (x, y) = (
            index % self.columns() * self.tile_size,
            index / self.columns() * self.tile_size,
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

    /// Pixels of a tile.
    pub fn pixels_of(&self, index: u32) -> u64 {
        let tile = self.tile(index);
        u64::from(tile.width) * u64::from(tile.height)
    }

    /// The tile that a pixel of the film lies in.
    pub fn tile_of(&self, pixel: usize) -> u32 {
        let (x, y) = (
            pixel as u32 % self.crop.width,
            pixel as u32 / self.crop.width,
        );
        y / self.tile_size * self.columns() + x / self.tile_size
    }

    /// Bytes of the film and of the picture made of it.
    pub fn bytes(&self) -> u64 {
        (self.pixels() as u64).saturating_mul(self.bytes_a_pixel())
    }

    /// Bytes of both a pixel. With four replicates and no layers 128: for each replicate
    /// three sums in f64 and a count, once the spread of the samples, and the picture's colour.
    fn bytes_a_pixel(&self) -> u64 {
        let (mean, centre) = (
            self.layers.mean.len() as u64,
            self.layers.centre.len() as u64,
        );
        let coverage = if self.alpha { 4 } else { 0 } + if self.backdrop.is_some() { 4 } else { 0 };
        let counts = 2 + coverage + if self.counts_first_hits() { 2 } else { 0 };
        let open = (0..self.replicates)
            .filter(|&replicate| self.adaptive || has_open(self.samples_of(replicate)))
            .count() as u64;
        let film = u64::from(self.replicates) * (24 + counts + 24 * mean)
            + 24 * open
            + if self.random { 12 } else { 0 }
            + 4 * centre;
        let picture = 12 + coverage + 4 * self.channels();
        let denoised = if self.denoise.is_some() {
            demand::BYTES_A_PIXEL
        } else {
            0
        };
        film + picture + denoised
    }

    /// Channels that the picture has beside its colour.
    fn channels(&self) -> u64 {
        let Layers {
            mean,
            centre,
            samples,
            standard_error,
            asked: _,
        } = &self.layers;
        let (mean, centre) = (
            mean.iter().filter(|(aov, _)| self.shows(*aov)),
            centre.iter().filter(|(aov, _)| self.shows(*aov)),
        );
        3 * mean.count() as u64
            + centre.count() as u64
            + u64::from(*samples)
            + 3 * u64::from(*standard_error)
    }

    /// Whether the picture shows a layer; else it is kept for denoising alone.
    pub fn shows(&self, aov: Aov) -> bool {
        !self
            .denoise
            .as_ref()
            .is_some_and(|unasked| unasked.contains(&aov))
    }

    /// Whether a layer is a mean over the samples that hit something.
    pub fn counts_first_hits(&self) -> bool {
        self.layers
            .mean
            .iter()
            .any(|(aov, _)| *aov == Aov::Position)
    }
}

#[cfg(test)]
mod tests;
