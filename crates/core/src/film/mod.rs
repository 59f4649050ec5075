//! The film: what is known of every pixel so far, and the picture that it amounts to.
//!
//! A picture by chance takes its samples in a few *replicates*
//! ([`replicates`](crate::settings::replicates) says how many), each with random numbers of its
//! own. Points within a replicate depend on each other, so that their spread says too much of the
//! error of their mean; the means of replicates do not, so theirs says it. The film therefore keeps
//! the sums of each replicate apart and adds them up last, in ascending order.
//!
//! What is rendered at a time is some samples of one tile in one replicate, from where the film has
//! come to there. A film holds any tiles and replicates, each with its first samples, and the union
//! of films is the film of one run: its picture has the same bits, whoever rendered which part, in
//! what order and in how many steps.
//!
//! A pixel takes 128 bytes in four replicates without layers, the finished picture included, and 24
//! more for each replicate whose last block of samples is not full; 38 where chance has no part,
//! because then there is one replicate and no spread. A picture that is to be denoised keeps four
//! replicates and four layers whatever else is asked for. [`Memory`](crate::Memory) counts them
//! before anything is rendered.

mod adaptive;
mod again;
mod estimate;
mod identity;
mod merge;
mod pixel;
mod plan;
mod plane;
mod record;
mod relative;
mod replicate_quad;
mod sums;
#[cfg(test)]
pub(crate) mod tests;
mod uncertainty;

pub(crate) use adaptive::Aim;
pub use adaptive::DoubtedAim;
pub(crate) use estimate::MeanVariance;
use estimate::ReplicateStats;
use identity::Identity;
pub use merge::PartError;
pub(crate) use plan::Plan;
pub(crate) use plane::{Rect, ReplicateBuffer};
pub use record::{FilmHeader, HeaderError, Numbers};
pub(crate) use replicate_quad::{BRIGHTEST, QuadError, ReplicateQuad};
pub(crate) use sums::{Block, Gather, Moments, Plain, Sums, parts};
pub use uncertainty::{Doubt, Estimate, Uncertainty};

use core::ops::{Range, RangeInclusive};

use crate::counters::Counters;
use crate::light::LightUsage;
use crate::picture::{Layer, Picture};
use crate::settings::{Aov, Settings};

/// A picture in the making: sums of the tiles and replicates rendered so far.
#[derive(Clone, Debug)]
pub struct Film {
    identity: Identity,
    plan: Plan,
    /// One a replicate; none while nothing of it is there.
    planes: Vec<Option<ReplicateBuffer>>,
    /// Root of the summed squared deviations of samples from the means of their replicates; empty
    /// without chance.
    spread: Vec<[f32; 3]>,
    /// Layers of pixel-centre rays, which come with the first replicate.
    centre: Vec<Vec<f32>>,
    /// Samples of each pixel that are there, tile by tile, replicate by replicate.
    drawn: Vec<u16>,
    /// How many there are to be in the end of this round, where they go where the error is or
    /// another film's went; else empty.
    goals: Vec<u16>,
    /// Whether they are those of another film, which nothing is added to.
    is_replayed: bool,
    /// Samples of all pixels that the picture will probably have taken in the end; none while
    /// nothing is known of it.
    expected: u64,
    /// Where the error that was asked for seemed to be reached, but could not be trusted. No file
    /// has it.
    doubted: Option<DoubtedAim>,
    counters: Counters,
    /// What the renders that put samples here counted of lights. It is no part of the picture, and
    /// no file has it.
    usage: LightUsage,
}

/// Some tiles in some replicates of a picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Part {
    /// Which tiles, counted row by row.
    pub tiles: Range<u32>,
    /// Every how manyeth of them, from the first on.
    pub step: u32,
    /// Which replicates.
    pub replicates: Range<u32>,
    /// Of the tiles these alone, in ascending order; none: all.
    pub among: Option<Vec<u32>>,
}

impl Part {
    /// Its tiles that a picture has.
    pub(crate) fn each_tile(&self, plan: &Plan) -> impl Iterator<Item = u32> + Clone + use<'_> {
        let is_among = |tile: &u32| {
            self.among
                .as_ref()
                .is_none_or(|among| among.binary_search(tile).is_ok())
        };
        (self.tiles.start..self.tiles.end.min(plan.tiles()))
            .step_by(self.step.max(1) as usize)
            .filter(is_among)
    }

    /// One of `of` shares of about the same work, counted from zero: every `of`th tile, so that
    /// what is hard to render is divided as well. Together they are the whole.
    #[must_use]
    pub fn share(self, index: u32, of: u32) -> Self {
        Self {
            tiles: self.tiles.start + index * self.step..self.tiles.end,
            step: self.step * of,
            ..self
        }
    }
}

/// Some samples of one tile in one replicate, and all that came before them.
#[derive(Clone, Debug)]
pub(crate) struct TileUpdate {
    pub tile: u32,
    pub replicate: u32,
    /// Samples of each pixel now.
    pub drawn: u32,
    pub plane: ReplicateBuffer,
    /// Of the samples that were added.
    pub spread: Vec<[f32; 3]>,
    pub centre: Vec<Vec<f32>>,
    pub counters: Counters,
}

impl Film {
    /// Nothing yet of a picture of `scene`, by which parts of one scene's pictures are told from
    /// those of others.
    pub(crate) fn new(scene: &str, settings: &Settings, plan: Plan) -> Self {
        Self::empty(Identity::new(scene, settings), plan)
    }

    fn empty(identity: Identity, plan: Plan) -> Self {
        let units = plan.tiles() as usize * plan.replicates as usize;
        let goals = if plan.adaptive {
            vec![adaptive::first(&plan); units]
        } else {
            Vec::new()
        };
        Self {
            identity,
            planes: vec![None; plan.replicates as usize],
            spread: Vec::new(),
            centre: Vec::new(),
            drawn: vec![0; units],
            goals,
            is_replayed: false,
            expected: 0,
            doubted: None,
            counters: Counters::default(),
            usage: LightUsage::default(),
            plan,
        }
    }

    pub(crate) fn plan(&self) -> &Plan {
        &self.plan
    }

    /// What tells its scene from others, as [`Ready::film`](crate::Ready::film) was told.
    pub fn scene(&self) -> &str {
        &self.identity.scene
    }

    /// Width and height in pixels, of the crop where there is one.
    pub fn size(&self) -> [u32; 2] {
        [self.plan.crop.width, self.plan.crop.height]
    }

    /// All there is to render.
    pub fn whole(&self) -> Part {
        Part {
            tiles: 0..self.plan.tiles(),
            step: 1,
            replicates: 0..self.plan.replicates,
            among: None,
        }
    }

    /// Samples of each pixel of a tile in a replicate; none of what the picture does not have.
    pub fn drawn(&self, tile: u32, replicate: u32) -> u32 {
        let unit = (tile < self.plan.tiles()).then(|| self.drawn.get(self.unit(tile, replicate)));
        unit.flatten().map_or(0, |&drawn| u32::from(drawn))
    }

    /// Samples of each pixel of a tile that a replicate is to have, as far as that is decided.
    pub(crate) fn goal(&self, tile: u32, replicate: u32) -> u32 {
        self.goals
            .get(self.unit(tile, replicate))
            .map_or(self.plan.samples_of(replicate), |&goal| u32::from(goal))
    }

    /// Samples of all pixels that there are, and that will probably be there in the end.
    pub(crate) fn progress(&self, part: &Part) -> (u64, u64) {
        let (mut done, mut total) = (0, 0);
        for tile in part.each_tile(&self.plan) {
            for replicate in part.replicates.start..part.replicates.end.min(self.plan.replicates) {
                let of = |samples: u32| self.plan.pixels_of(tile) * u64::from(samples);
                done += of(self.drawn(tile, replicate));
                total += of(self.goal(tile, replicate));
            }
        }
        (done, total.max(self.expected))
    }

    fn unit(&self, tile: u32, replicate: u32) -> usize {
        replicate as usize * self.plan.tiles() as usize + tile as usize
    }

    /// Pixels that lack samples.
    pub fn unfinished(&self) -> u64 {
        let lacking = |&tile: &u32| {
            (0..self.plan.replicates).any(|r| self.drawn(tile, r) < self.goal(tile, r))
        };
        (0..self.plan.tiles())
            .filter(lacking)
            .map(|tile| self.plan.pixels_of(tile))
            .sum()
    }

    /// Whether its picture is to be denoised.
    pub fn is_to_be_denoised(&self) -> bool {
        self.plan.denoise.is_some()
    }

    /// Samples of each pixel that the picture is to have; none where they go where the error is, or
    /// where another film's went.
    pub fn asked(&self) -> Option<u32> {
        self.goals.is_empty().then(|| self.plan.samples())
    }

    /// Fewest and most samples that pixels of a part have.
    pub fn samples(&self, part: &Part) -> RangeInclusive<u32> {
        let of = |tile| {
            part.replicates
                .clone()
                .map(|replicate| self.drawn(tile, replicate))
                .sum::<u32>()
        };
        let all = part.each_tile(&self.plan).map(of);
        all.clone().min().unwrap_or(0)..=all.max().unwrap_or(0)
    }

    /// Tiles of a part that lack samples.
    pub fn lacking(&self, part: &Part) -> usize {
        let replicates = || {
            part.replicates
                .clone()
                .take_while(|&replicate| replicate < self.plan.replicates)
        };
        part.each_tile(&self.plan)
            .filter(|&tile| replicates().any(|r| self.drawn(tile, r) < self.goal(tile, r)))
            .count()
    }

    /// What is there of a tile in a replicate, to go on with.
    pub(crate) fn state(&self, tile: u32, replicate: u32) -> ReplicateBuffer {
        let area = Rect::within(self.plan.tile(tile), self.plan.crop.width);
        let plane = self.planes[replicate as usize]
            .as_ref()
            .filter(|_| self.drawn(tile, replicate) > 0);
        plane.map(|plane| plane.cut(area)).unwrap_or_default()
    }

    /// What it took so far.
    pub fn counters(&self) -> Counters {
        self.counters
    }

    /// What was counted of lights.
    pub(crate) fn usage(&self) -> &LightUsage {
        &self.usage
    }

    /// Adds what a worker counted of lights.
    pub(crate) fn add_usage(&mut self, usage: &LightUsage) {
        self.usage.add(usage);
    }

    /// Bytes that the sums and layers take.
    pub fn bytes(&self) -> u64 {
        let planes: usize = self
            .planes
            .iter()
            .flatten()
            .map(ReplicateBuffer::bytes)
            .sum();
        let centre: usize = self.centre.iter().map(|layer| layer.len() * 4).sum();
        (planes + self.spread.len() * 12 + centre) as u64
    }

    /// Puts a tile in its place, with samples that it did not have.
    pub(crate) fn put(&mut self, unit: &TileUpdate) {
        let tile = self.plan.tile(unit.tile);
        let (from, to) = (
            Rect::all(tile.width, tile.height),
            Rect::within(tile, self.plan.crop.width),
        );
        let spread = self.apart(unit, from, to);
        self.widen(&spread, from, to);
        self.place(unit.replicate, &unit.plane, from, to);
        self.place_centre(&unit.centre, from, to);
        self.counters += unit.counters;
        let index = self.unit(unit.tile, unit.replicate);
        self.drawn[index] = u16::try_from(unit.drawn).unwrap_or(u16::MAX);
    }

    /// How far samples that are added lie from their replicate's mean: their deviations from their
    /// own mean, and how far that lies from the mean of those before them (Chan, Golub and LeVeque
    /// 1983).
    fn apart(&self, unit: &TileUpdate, from: Rect, to: Rect) -> Vec<[f32; 3]> {
        let before = self.planes[unit.replicate as usize]
            .as_ref()
            .filter(|_| self.drawn(unit.tile, unit.replicate) > 0);
        let Some(before) = before.filter(|_| !unit.spread.is_empty()) else {
            return unit.spread.clone();
        };
        let pixels = from.rows().flatten().zip(to.rows().flatten());
        pixels
            .map(|(new, old)| {
                let (n, all) = (
                    f64::from(before.samples[old]),
                    f64::from(unit.plane.samples[new]),
                );
                let (sum, total) = (before.total(old), unit.plane.total(new));
                let added = all - n;
                if n == 0.0 || added == 0.0 {
                    return unit.spread[new];
                }
                core::array::from_fn(|i| {
                    let apart = (total[i] - sum[i]) / added - sum[i] / n;
                    (f64::from(unit.spread[new][i]).powi(2) + n * added / all * apart * apart)
                        .sqrt() as f32
                })
            })
            .collect()
    }

    fn place(&mut self, replicate: u32, plane: &ReplicateBuffer, from: Rect, to: Rect) {
        let plan = &self.plan;
        self.planes[replicate as usize]
            .get_or_insert_with(|| ReplicateBuffer::zero(plan))
            .copy(to, plane, from);
    }

    fn place_centre(&mut self, layers: &[Vec<f32>], from: Rect, to: Rect) {
        if self.centre.is_empty() {
            self.centre = layers
                .iter()
                .map(|_| vec![0.0; self.plan.pixels()])
                .collect();
        }
        for (into, layer) in self.centre.iter_mut().zip(layers) {
            plane::copy(into, to, layer, from);
        }
    }

    /// Joins further deviations to those that are there. In f32 each step rounds, so that parts
    /// joined in another order than that of replicates may end an ulp apart; no picture is made of
    /// it.
    fn widen(&mut self, spread: &[[f32; 3]], from: Rect, to: Rect) {
        if spread.is_empty() {
            return;
        }
        self.spread.resize(self.plan.pixels(), [0.0; 3]);
        for (into, of) in to.rows().zip(from.rows()) {
            for (into, of) in self.spread[into].iter_mut().zip(&spread[of]) {
                let join = |a: f32, b: f32| {
                    (f64::from(a) * f64::from(a) + f64::from(b) * f64::from(b)).sqrt() as f32
                };
                *into = core::array::from_fn(|i| join(into[i], of[i]));
            }
        }
    }

    /// Variance of a pixel's samples, per channel, about their mean: what one sample is worth, not
    /// the error of the mean. None where chance has no part or there are fewer than two samples.
    pub fn variance(&self, x: u32, y: u32) -> Option<[f64; 3]> {
        if x >= self.plan.crop.width || y >= self.plan.crop.height {
            return None;
        }
        let pixel = y as usize * self.plan.crop.width as usize + x as usize;
        let within = self.spread.get(pixel)?.map(|s| f64::from(s) * f64::from(s));
        let means = self.there().means(pixel);
        (means.samples >= 2.0).then(|| {
            core::array::from_fn(|i| (within[i] + means.between[i]) / (means.samples - 1.0))
        })
    }

    /// Standard error of each pixel's mean as the layer `stderr` has it, with the degrees of
    /// freedom of each: one fewer than the replicates. None where there are fewer than two of them.
    pub fn standard_errors(&self) -> Option<(Vec<[f32; 3]>, u32)> {
        let freedom = self
            .plan
            .replicates
            .checked_sub(1)
            .filter(|freedom| *freedom > 0 && self.plan.random)?;
        Some((self.pixel_errors(), freedom))
    }

    /// Standard errors of pixels; of a picture in which no sample found the light that was looked
    /// for, nothing is known.
    fn pixel_errors(&self) -> Vec<[f32; 3]> {
        if self.is_unlit() {
            return vec![[-1.0; 3]; self.plan.pixels()];
        }
        self.there()
            .standard_errors(self.plan.pixels(), self.plan.crop.width as usize)
    }

    fn there(&self) -> ReplicateStats<'_> {
        ReplicateStats::new(self.planes.iter().flatten(), self.plan.adaptive)
    }

    /// The means of all pixels, with what lies behind a ground, and nothing else.
    pub(crate) fn colours(&self) -> Picture {
        let (plan, planes) = (&self.plan, self.there());
        let mut picture = Picture {
            window: plan.window(),
            ..Picture::new(plan.crop.width, plan.crop.height)
        };
        for (pixel, colour) in picture.rgb.iter_mut().enumerate() {
            *colour = planes.mean(pixel).0.map(|c| c as f32);
        }
        picture
    }

    /// The picture so far: of pixels that lack samples the mean of those they have, black without
    /// any.
    pub fn picture(&self) -> Picture {
        let (plan, planes) = (&self.plan, self.there());
        let all = 0..plan.pixels();
        let mut picture = self.colours();
        self.take_off_backdrop(&mut picture);
        let mut layers: Vec<(&str, Vec<f32>)> = Vec::new();
        for (k, (aov, names)) in plan
            .layers
            .mean
            .iter()
            .enumerate()
            .filter(|(_, (aov, _))| plan.shows(*aov))
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
            .filter(|(_, (aov, _))| plan.shows(*aov))
        {
            layers.push((
                name,
                self.centre
                    .get(k)
                    .cloned()
                    .unwrap_or_else(|| vec![0.0; plan.pixels()]),
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
                self.pixel_errors()
            } else {
                vec![[0.0; 3]; plan.pixels()]
            };
            let named = ["stderr.R", "stderr.G", "stderr.B"].into_iter().enumerate();
            layers.extend(
                named.map(|(i, name)| (name, errors.iter().map(|error| error[i]).collect())),
            );
        }
        picture.layers = layers
            .into_iter()
            .map(|(name, samples)| Layer {
                name: name.to_owned(),
                samples,
            })
            .collect();
        picture
    }

    /// Gives a picture of the film's colours its coverage, and takes off what lies behind a ground.
    /// What is nothing but ground has no colour, and says itself how much of it is shadow, so that
    /// noise that was filtered out of it stays out.
    pub(crate) fn take_off_backdrop(&self, picture: &mut Picture) {
        if !self.plan.alpha {
            return;
        }
        let (planes, all) = (self.there(), 0..self.plan.pixels());
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
                    1.0 - covered - planes.shadow(pixel)
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

    /// One channel of a layer that is a mean over the samples, weighted by how many each replicate
    /// has.
    fn layer_mean(&self, layer: usize, aov: Aov, channel: usize, pixel: usize) -> f32 {
        let (mut sum, mut count) = (0.0, 0.0);
        let tile = self.plan.tile_of(pixel);
        for (replicate, plane) in (0..).zip(&self.planes) {
            let Some(plane) = plane else { continue };
            let n = match aov {
                Aov::Position => f64::from(plane.first_hits[pixel]),
                Aov::Emission => f64::from(plane.samples[pixel]),
                _ => f64::from(self.drawn(tile, replicate)),
            };
            let mean = (plane.layers[layer][pixel][channel] / f64::max(n, 1.0)) as f32;
            sum += n * f64::from(mean);
            count += n;
        }
        (sum / f64::max(count, 1.0)) as f32
    }
}
