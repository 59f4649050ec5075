//! The film: accumulated samples of every pixel, and the picture computed from them.
//!
//! A picture with random sampling takes its samples in a few *replicates* (their number:
//! [`default_replicates`](crate::settings::default_replicates)), each with independent random
//! numbers. Points within a replicate are correlated, so their spread overestimates the error of
//! their mean. The means of replicates are independent, and the spread of these means estimates the
//! error of the picture. The film therefore keeps the sums of each replicate separate, and adds
//! them last, in ascending order.
//!
//! A picture to be denoised has four replicates. Where the same picture without denoising has two,
//! they are pairs that share a *net*, the first points of one sequence. Nets are independent; the
//! replicates of one net are not, and only guide the denoiser.
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
mod error_estimate;
mod estimate;
mod film_picture;
mod four_replicates;
mod identity;
mod leave_one_out;
mod merge;
mod part;
mod plan;
mod plan_comparison;
mod record;
mod relative_error;
mod row_variances;
mod sums;
#[cfg(test)]
pub(crate) mod tests;
mod tile_storage;
mod uncertainty;

pub use adaptive::DoubtfulErrorEstimate;
pub(crate) use adaptive::ErrorProgress;
pub(crate) use buffer::{Rect, ReplicateBuffer};
pub use error_estimate::ErrorEstimate;
use estimate::ReplicateStats;
pub(crate) use four_replicates::{BRIGHTEST, FourReplicates, FourReplicatesError};
use identity::FilmIdentity;
pub use merge::FilmMergeError;
pub use part::FilmPart;
pub(crate) use part::TileUpdate;
pub(crate) use plan::FilmPlan;
pub use record::{FilmDataStream, FilmHeader, FilmHeaderError};
pub(crate) use sums::{
    BlockAccumulator, MomentAccumulator, PixelSums, SampleAccumulator, SumAccumulator,
    quantise_coverage,
};
pub use uncertainty::{EstimateDoubt, Uncertainty};

use core::ops::RangeInclusive;

use crate::counters::Counters;
use crate::light::LightUsage;
use crate::settings::Settings;

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
}
